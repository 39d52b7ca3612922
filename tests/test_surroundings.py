"""What surrounds a command: signals, closed and full streams, narrow terminals, homes that are none."""

import contextlib
import io
import os
import pwd
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from orient_eye.cli import main, surroundings
from orient_eye.cli.tables import say, table
from orient_eye.errors import InputError
from orient_eye.progress import progress_bar

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals, HOME and /dev are POSIX'")


def said(*message: object) -> str:
    with contextlib.redirect_stderr(io.StringIO()) as err:
        say(*message)  # type: ignore[arg-type]
    return err.getvalue()


# --- signals --------------------------------------------------------------------------------------


class Ends:
    """A command that a signal ends, and another one while it cleans up."""

    def __init__(self, number: int) -> None:
        self.number, self.cleaned = number, False

    def run(self) -> dict[str, object]:
        try:
            os.kill(os.getpid(), self.number)
            time.sleep(5)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.01)
            self.cleaned = True
        return {"passed": True}


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGHUP", 129), ("SIGINT", 130)])
def test_a_signal_does_what_ctrl_c_does(
    name: str, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    numbers = signal.SIGTERM, signal.SIGHUP
    before = [signal.signal(number, signal.SIG_DFL) for number in numbers]  # nohup ignores SIGHUP
    command = Ends(getattr(signal, name))
    monkeypatch.setattr("orient_eye.cli.options.parse", lambda *_, **__: command)
    try:
        with pytest.raises(SystemExit) as end:
            main(["models", "--json"])
        assert end.value.code == (code if name != "SIGINT" else 143)  # the last one said it
        assert command.cleaned or name == "SIGINT"
        assert [signal.getsignal(number) for number in numbers] == [signal.SIG_DFL, signal.SIG_DFL]
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
    assert capsys.readouterr() == ("", "interrupted\n")


def test_a_signal_that_is_ignored_stays_so() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with surroundings.signals():
            os.kill(os.getpid(), signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


# --- streams --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "code", "out", "err"),
    [
        ("--version > /dev/full", 2, "", "error: cannot write to standard output: No space left on device; send it"),
        ("--version >&-", 2, "", "error: cannot write to standard output: Bad file descriptor"),
        ("train --help > /dev/full", 2, "", "error: cannot write to standard output"),
        ("view nosuch --json 2> /dev/full", 2, '{"error": "cannot read nosuch', ""),
        ("view nosuch --json 2>&- <&-", 2, '{"error": "cannot read nosuch', ""),
        ("view nosuch --json > /dev/full", 2, "", "error: cannot read nosuch"),
        ("train --help | head -c 1", 0, "u", ""),
        ("view ü --json", 2, "u00fc", "error: cannot read \\xfc: "),
    ],
)
def test_streams_that_cannot_be_written(line: str, code: int, out: str, err: str) -> None:
    done = subprocess.run(
        ["sh", "-c", f"'{sys.executable}' -m orient_eye {line}"],
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == code
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    for told, words in ((done.stdout, out), (done.stderr, err)):
        assert words in told
        assert bool(words) == bool(told)


def test_a_terminal_of_one_column() -> None:
    """The library of the help pages wrapped words into it for ever."""
    command = [sys.executable, "-m", "orient_eye", "train", "--help"]
    done = subprocess.run(command, env={**os.environ, "COLUMNS": "1"}, capture_output=True, check=False, timeout=60)
    assert done.returncode == 0


@given(st.text())
def test_nothing_commands_a_terminal(text: str) -> None:
    for told in (said(text), said(table("t", {"heading": lambda row: row["cell"]}, [{"cell": text}]))):
        assert all(c.isprintable() or c == "\n" for c in told)


def test_names_are_told_as_they_are() -> None:
    assert said("a\x1b[31m\N{RIGHT-TO-LEFT OVERRIDE}b[/b] :smile: é 漢") == "a\\x1b[31m\\u202eb[/b] :smile: é 漢\n"


def test_words_and_notes_of_a_progress_bar_are_no_markup(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "120")
    with progress_bar("searching a[/b]") as advance:
        advance(0.5, "[red]note [/nothing]")
    told = capsys.readouterr().err
    assert "searching a[/b]" in told
    assert "[red]note [/nothing]" in told


# --- folders --------------------------------------------------------------------------------------

COMMANDS = """
import sys
from orient_eye.cli import main
for command in (
    "simulate --plant lpf --motor c.csv --out moved",
    "train --updates 2 --warmup 8 --batch-size 8 --saccades-per-update 8 --evaluation-pairs 2 --out trained",
):
    try:
        main(command.split())
    except SystemExit as end:
        assert not end.code, (command, end.code)
"""


def test_nothing_is_written_elsewhere(tmp_path: Path) -> None:
    """What libraries keep stands in our cache folder; temporary files are gone."""
    home, temporary, work = (tmp_path / name for name in ("home", "temporary", "work"))
    for folder in (home, temporary, work):
        folder.mkdir()
    (work / "c.csv").write_text("t_s,tau2_deg\n0,0\n0,8\n0.3,8\n")
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("XDG_", "MPL", "NUMBA_", "TORCH"))}
    environment = {**kept, "HOME": str(home), "TMPDIR": str(temporary)}
    done = subprocess.run(
        [sys.executable, "-c", COMMANDS], cwd=work, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr
    assert sorted(path.name for path in work.iterdir()) == ["c.csv", "moved", "trained"]
    assert not list(temporary.iterdir())
    assert [str(path.relative_to(home)) for path in home.glob("*/*")] == [".cache/orient-eye"]


def nobody(number: int) -> pwd.struct_passwd:
    raise KeyError(number)


def test_without_a_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a container for a user that it does not know."""
    for name in ("HOME", "XDG_CACHE_HOME", "MPLCONFIGDIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(pwd, "getpwuid", nobody)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    before = dict(os.environ)
    with surroundings.folders():
        assert Path(os.environ["XDG_CACHE_HOME"]).parent == tmp_path
        assert Path(os.environ["MPLCONFIGDIR"]).is_dir()
    assert dict(os.environ) == before
    assert not list(tmp_path.iterdir())


def test_a_cache_folder_that_cannot_be_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.delenv("MPLCONFIGDIR", raising=False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with surroundings.folders():
        assert Path(os.environ["MPLCONFIGDIR"]).parent == tmp_path
        assert os.environ["XDG_CACHE_HOME"] == str(tmp_path / "file")  # one that can be read is
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "file"))
    with pytest.raises(InputError, match="cannot write a temporary file: Not a directory"), surroundings.folders():
        pass
