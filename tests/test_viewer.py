"""The viewer as a process: it sends no usage statistics, and ends with whoever started it."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest

from orient_eye.errors import InputError
from orient_eye.recording import viewer

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


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_the_server_ends_with_its_parent_and_leaves_nothing_at_home(recorded: Path, tmp_path: Path, name: str) -> None:
    """Also where the environment forces the statistics on."""
    process = subprocess.Popen(
        [sys.executable, "-m", "orient_eye", "view", str(recorded), "--web"],
        env=at_home(tmp_path, FORCE_RERUN_ANALYTICS="1"),
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),  # noqa: PLW1509 - nohup ignores it; one thread here
    )
    with process:
        assert process.stderr is not None
        port = port_of(next(line for line in process.stderr if line.startswith("http")))
        within(20, lambda: listens(port))
        process.send_signal(getattr(signal, name))
        assert process.wait(20) == (0 if name == "SIGINT" else 128 + getattr(signal, name))
    assert not listens(port)
    assert not of_rerun(tmp_path)


def test_a_server_in_another_thread(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Signal handlers are the main thread's; a viewer that is killed says so."""
    started: list[subprocess.Popen[bytes]] = []
    popen = subprocess.Popen

    def start(*args: object, **options: object) -> "subprocess.Popen[bytes]":
        started.append(popen(*args, **options))  # type: ignore[call-overload]
        return started[0]

    failures: list[InputError] = []

    def serve() -> None:
        try:
            viewer.serve(recorded, lambda address: started[0].kill())
        except InputError as error:
            failures.append(error)

    monkeypatch.setattr(subprocess, "Popen", start)
    thread = threading.Thread(target=serve)
    thread.start()
    thread.join(20)
    assert "the Rerun viewer failed (exit code -9)" in str(failures[0])


def test_signal_handlers_are_given_back() -> None:
    def hang_up_and_terminate() -> None:
        with viewer._signals_raise():
            os.kill(os.getpid(), signal.SIGHUP)
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(5)

    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as under nohup
    try:
        with pytest.raises(SystemExit, match="143"):
            hang_up_and_terminate()
    finally:
        signal.signal(signal.SIGHUP, before)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
