"""The viewer as a process: it sends no usage statistics, ends with whoever started it, and shows whole recordings."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest

from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.recording import guard, viewer

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and HOME are POSIX'")

RECORD = """
import sys, numpy as np
from orient_eye.plants.linear import LinearPlant
from orient_eye.recording import record
record(sys.argv[1], LinearPlant().move(np.ones((1, 20, 1))).trajectory())
"""


def at_home(home: Path, **variables: str) -> dict[str, str]:
    """The environment of a person who has never run Rerun, and not on a build server."""
    kept = {k: v for k, v in os.environ.items() if k != "CI" and not k.startswith("XDG_")}
    return {**kept, "HOME": str(home), **variables}


def of_rerun(home: Path) -> list[Path]:
    return [path for path in home.rglob("*") if "rerun" in path.parts]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("home")
    path = folder / "one.rrd"
    subprocess.run([sys.executable, "-c", RECORD, str(path)], env=at_home(folder), check=True)
    return path


def listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def within(seconds: float, true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def port_of(address: str) -> int:
    """Where the viewer itself listens, from the address of its page."""
    port = urlsplit(parse_qs(urlsplit(address).query)["url"][0]).port
    assert port is not None
    return port


def test_recording_leaves_nothing_at_home(recorded: Path) -> None:
    assert not of_rerun(recorded.parent)


def served(recorded: Path, home: Path) -> tuple["subprocess.Popen[str]", str]:
    """`orient-eye view --web` and its address, where the environment forces the statistics on."""
    process = subprocess.Popen(
        [sys.executable, "-m", "orient_eye", "view", str(recorded), "--web"],
        env=at_home(home, FORCE_RERUN_ANALYTICS="1", TMPDIR=str(home)),
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    return process, next(line.strip() for line in process.stderr if line.startswith("http"))


def test_the_server_ends_when_interrupted_and_leaves_nothing_at_home(recorded: Path, tmp_path: Path) -> None:
    process, address = served(recorded, tmp_path)
    with process:
        assert listens(port_of(address))
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0
    assert not listens(port_of(address))
    assert {path.name for path in (tmp_path / ".cache").rglob("*")} <= {"orient-eye", "matplotlib", "torch"}
    assert [path.name for path in tmp_path.iterdir()] == [".cache"]


def test_the_page_asks_nobody_else_and_the_viewer_ends_with_a_parent_that_is_killed(
    recorded: Path, tmp_path: Path
) -> None:
    """What the browser then refuses: rerun's statistics, fonts, examples and news, which no setting of it turns off."""
    process, address = served(recorded, tmp_path)
    with process:
        with urllib.request.urlopen(address) as page:
            policy, text = page.headers["Content-Security-Policy"], page.read().decode()
        with urllib.request.urlopen(f"http://{urlsplit(address).netloc}/re_viewer.js") as script:
            assert len(script.read()) == int(script.headers["Content-Length"]) > 10_000
        process.kill()
    assert policy.startswith("default-src 'self' ")
    assert set(re.findall(r"https?:\S+", policy)) == {f"http://127.0.0.1:{port_of(address)}"}
    assert "<title>Rerun Viewer</title>" in text
    assert not re.search(r"<link[^>]*https:", text)
    within(10, lambda: not listens(port_of(address)))
    within(10, lambda: [path.name for path in tmp_path.iterdir()] == [".cache"])  # no temporary files of the viewer's


def test_a_program_ends_with_its_guard(tmp_path: Path) -> None:
    def guarded(program: str) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-I", guard.__file__, sys.executable, "-c", program]
        return subprocess.Popen(command, stdin=-1, stdout=-1, env={**os.environ, "TMPDIR": str(tmp_path)})

    sleeps = guarded("import os, time; print(os.environ['TMPDIR'], flush=True); time.sleep(60)")
    assert sleeps.stdout is not None
    folder = Path(sleeps.stdout.readline().decode().strip())
    assert folder.parent == tmp_path
    assert folder.is_dir()
    sleeps.communicate()  # closes its input
    assert (sleeps.returncode, list(tmp_path.iterdir())) == (128 + signal.SIGTERM, [])
    terminated = guarded("import time; print(flush=True); time.sleep(60)")
    assert terminated.stdout is not None
    terminated.stdout.readline()
    terminated.terminate()
    assert terminated.wait(10) == 128 + signal.SIGTERM
    assert guarded("raise SystemExit(3)").wait(10) == 3


def test_a_server_in_another_thread(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A viewer that is ended by others says so."""
    started: list[subprocess.Popen[bytes]] = []
    popen = subprocess.Popen

    def start(*args: object, **options: object) -> "subprocess.Popen[bytes]":
        started.append(popen(*args, **options))  # type: ignore[call-overload]
        return started[-1]

    failures: list[InputError] = []

    def serve() -> None:
        try:
            viewer.serve(recorded, lambda address: started[-1].terminate())
        except InputError as error:
            failures.append(error)

    monkeypatch.setattr(subprocess, "Popen", start)
    thread = threading.Thread(target=serve)
    thread.start()
    thread.join(20)
    assert "the Rerun viewer failed (exit code 143)" in str(failures[0])


def test_recordings_that_cannot_be_shown(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At once: the viewer waited for them."""
    whole = recorded.read_bytes()
    files = {"half": whole[: len(whole) // 2], "begun": whole[:100], "text": b"RRF and nothing", "empty": b""}
    for name, content in files.items():
        (tmp_path / f"{name}.rrd").write_bytes(content)
    os.mkfifo(tmp_path / "pipe.rrd")
    monkeypatch.chdir(tmp_path)
    for arguments, words in (
        (["half.rrd", "--screenshot", "a.png"], "half.rrd is damaged"),
        (["begun.rrd", "--web"], "begun.rrd is damaged"),
        (["text.rrd"], "text.rrd is damaged"),
        (["empty.rrd"], "empty.rrd is not a recording"),
        (["pipe.rrd"], "cannot read pipe.rrd: it is no file"),
        ([str(recorded), "--screenshot", "a.png", "--size", "0", "9"], "width must be a whole number from 1 to 4096"),
        ([str(recorded), "--screenshot", "a.png", "--size", "9", "1000000000"], "height must be a whole number"),
    ):
        with pytest.raises(SystemExit) as end:
            main(["view", *arguments])
        assert end.value.code == 2
        assert words in capsys.readouterr().err
    assert not (tmp_path / "a.png").exists()
