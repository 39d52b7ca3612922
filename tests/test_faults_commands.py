"""Every command under faults: what it leaves is whole or absent, what it says helps, and it works again afterwards.

Here each fault meets one or two commands, once; `make faults` (the variable FAULTS) tries each on all, that many times,
and prints a line of the table for each.
"""

import os
import random
import shutil
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from faulting import (
    ELSEWHERE,
    LINES,
    Both,
    Ended,
    Gone,
    Limit,
    Line,
    Mask,
    Mounted,
    Place,
    Room,
    Running,
    broken,
    files,
    mounts,
)
from orient_eye.cli import COMMANDS
from orient_eye.eyes.model import build_model
from orient_eye.files import remove_leftovers
from orient_eye.recording.geometry import _mesh

FAULTS = int(os.environ.get("FAULTS", "0"))
"""How many times each fault is tried on each command, on slow ones from 2 on; 0 for the small form."""
OLD = b"old"

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals, limits and mounts are Linux'")


@dataclass(frozen=True)
class Usual:
    """How a command ends when nothing is in its way."""

    seconds: float
    bytes: int
    largest: int


@dataclass(frozen=True)
class Case:
    """One trial of a fault on a command."""

    name: str
    place: Place
    given: Path
    random: random.Random
    usual: Callable[[str], Usual]

    @property
    def line(self) -> Line:
        return LINES[self.name]

    def start(self, fault: Callable[[], object] | None = None, out: Path | str | None = None, **more: str) -> Running:
        return Running(self.line.arguments(out or self.place.out, self.given), self.place, fault, more)

    def put_old(self) -> None:
        """Older files, where outputs are files."""
        if not self.line.whole_run:
            self.place.out.mkdir(exist_ok=True)
            for name in self.line.outputs:
                (self.place.out / name).write_bytes(OLD)

    def check_files(self, out: Path | None = None, *, after_kill: bool = False) -> None:
        """Outputs are older, whole or absent, and nothing else is left."""
        out = out or self.place.out
        left = remove_leftovers(self.place.root)
        assert after_kill or not left, f"left {[path.name for path in left]}"
        temporary = files(self.place.root / "temporary")
        assert after_kill or not temporary, f"left {temporary}"
        assert not files(self.place.root / "home")
        elsewhere = files(self.place.root / "work") - {f"out/{name}" for name in files(out)}
        assert not elsewhere, f"{elsewhere} outside the output folder"
        for path in out.rglob("*") if not self.line.whole_run else ():
            if path.is_file() and path.read_bytes() == OLD:
                path.unlink()
        assert broken(out) == []
        assert broken(self.place.root / "cache" / "orient-eye") == []

    def check_refused(self, ended: Ended, *words: str) -> None:
        """Exit code 2 and a message; of a sweep also 1, where a run was."""
        assert ended.code == 2 or (ended.code == 1 and self.line.goes_on), ended
        assert ("error: " in ended.said, "Traceback" in ended.said) == (True, False), ended.said
        assert not words or any(word in ended.said for word in words), ended.said

    def check_works(self) -> None:
        """The same command line again, where the older run has been moved away."""
        if self.line.whole_run and not self.line.goes_on and self.place.out.exists() and any(self.place.out.iterdir()):
            self.check_refused(self.start().end(), "not an empty folder")
            shutil.rmtree(self.place.out)
        ended = self.start().end()
        assert ended.code == 0, ended
        assert set(self.line.outputs) <= files(self.place.out)
        self.check_files()


# --- faults ---------------------------------------------------------------------------------------


def ended_by(number: int) -> Callable[[Case], None]:
    def fault(case: Case) -> None:
        case.put_old()
        running = case.start()
        moment = time.monotonic() + case.random.uniform(0, case.usual(case.name).seconds)
        writing = case.random.random() < 0.5  # then as soon after it as a file is being written
        while running.process.is_alive() and (
            time.monotonic() < moment or (writing and case.line.outputs and not any(case.place.out.glob(".*")))
        ):
            time.sleep(0.001)
        running.send(number)
        ended = running.end()
        killed = number == signal.SIGKILL
        assert ended.code in (-number, 0) if killed else (128 + number, -number, 0), ended
        ours = ended.said.partition("Exception ignored in: ")[0]  # what follows a library says of its half-made objects
        assert "Traceback" not in ours, ended.said
        assert running.children() == []
        case.check_files(after_kill=killed)
        case.check_works()

    return fault


def small_disk(case: Case) -> None:
    size = case.random.randrange(4096, max(case.usual(case.name).bytes, 8192))
    disk = case.place.root / "disk"
    disk.mkdir()
    ended = case.start(Mounted(disk, ("-t", "tmpfs", "-o", f"size={size}", "none"), case.place.out), out=disk).end()
    if ended.code != 0:
        case.check_refused(ended, "No space left on device; make room there or name another place")
    case.check_files()


def small_files(case: Case) -> None:
    size = case.random.randrange(max(case.usual(case.name).largest, 1))
    case.put_old()
    ended = case.start(Limit("RLIMIT_FSIZE", size)).end()
    if ended.code != 0:
        case.check_refused(ended, "File too large; make room there or name another place")
    case.check_files()


def full_device(case: Case) -> None:
    """`--out /dev/full`; a run directory cannot be there."""
    if case.line.whole_run:
        case.check_refused(case.start(out="/dev/full").end(), "/dev/full")
    else:
        case.place.out.mkdir()
        for name in case.line.outputs:
            (case.place.out / name).symlink_to("/dev/full")
        case.check_refused(case.start().end(), "No space left on device; make room there or name another place")
        assert all((case.place.out / name).is_char_device() for name in case.line.outputs)
    assert Path("/dev/full").is_char_device()


def read_only(case: Case) -> None:
    out = case.place.out
    out.mkdir()
    case.put_old()
    before = files(out)
    ended = case.start(Both((Mounted(out, ("--bind", str(out))), Mounted(out, ("-o", "remount,ro,bind"))))).end()
    case.check_refused(ended, "name a place that you may write to")
    assert files(out) == before
    case.check_files()


IMPOSSIBLE = {
    "file/out": "Not a directory; a file stands where a folder is needed",
    f"{'n' * 300}": "name too long; shorten it",
    "loop": "symbolic links",
    "loop/out": "symbolic links",
    "dangling/../file/out": "a file stands where a folder is needed",
    "nul\0name": "a file name holds no NUL",
}


def impossible_place(case: Case) -> None:
    work = case.place.root / "work"
    name = case.random.choice(list(IMPOSSIBLE))
    (work / "file").write_bytes(OLD)
    (work / "loop").symlink_to("loop")
    (work / "dangling").symlink_to("nowhere/at/all")
    before = files(work)
    ended = case.start(out=name).end()
    case.check_refused(ended, IMPOSSIBLE[name])
    assert files(work) == before


def no_home(case: Case) -> None:
    ended = case.start(HOME=case.random.choice(["", "/nonexistent", "/dev/null", "/proc"]), XDG_CACHE_HOME="").end()
    assert ended.code == 0, ended
    case.check_files()


def dead_cache(case: Case) -> None:
    shutil.rmtree(case.place.root / "cache")
    (case.place.root / "cache").symlink_to(case.random.choice(["/dev/null", "/proc", "nowhere/at/all", "cache"]))
    ended = case.start().end()
    assert ended.code == 0, ended
    case.check_files()


def full_cache(case: Case) -> None:
    cache = case.place.root / "cache"
    ended = case.start(Mounted(cache, ("-t", "tmpfs", "-o", "size=4096", "none"))).end()
    assert ended.code == 0, ended
    case.check_files()


def same_place_twice(case: Case) -> None:
    first, second = case.start(), case.start()
    both = [first.end(), second.end()]
    if "run.json" in case.line.outputs:  # predict's folder of commands may be two runs', as any other files
        assert sorted(ended.code or 0 for ended in both) == [0, 2], both
        case.check_refused(next(ended for ended in both if ended.code), "not an empty folder")
    else:
        assert {ended.code for ended in both} <= {0, 2 if case.line.whole_run else 0}, both
    assert set(case.line.outputs) <= files(case.place.out)
    case.check_files()


def same_cache_twice(case: Case) -> None:
    """Both find it empty, and what they print and write is the same."""
    outs = [case.place.out / name for name in ("first", "second")]
    case.place.out.mkdir()
    runs = [case.start(out=out, COLUMNS="10000") for out in outs]
    both = [run.end() for run in runs]
    assert [ended.code for ended in both] == [0, 0], both
    first, second = (ended.said.replace(str(out), "") for ended, out in zip(both, outs, strict=True))
    assert first == second
    for name in case.line.outputs:
        if name.endswith((".csv", ".npz")):
            assert (outs[0] / name).read_bytes() == (outs[1] / name).read_bytes()
    case.check_files()


def little_memory(case: Case) -> None:
    """Ours is told of; a library that gets none may fail to load, or end the process. Files are whole all the same."""
    ended = case.start(Room(case.random.randrange(300) * 2**20)).end()
    assert ended.code is not None, ended
    if ended.code == 2:
        case.check_refused(ended, "not enough memory", "Cannot allocate memory")
    case.check_files(after_kill=ended.code < 0)


def few_descriptors(case: Case) -> None:
    ended = case.start(Limit("RLIMIT_NOFILE", case.random.choice([16, 24, 32]))).end()
    if ended.code != 0:
        case.check_refused(ended, "Too many open files")
    case.check_files()


def odd_surroundings(case: Case) -> None:
    odd = {
        "TZ": case.random.choice(["", "Nowhere/Land", "UTC+25", "Asia/Kathmandu"]),
        "LANG": case.random.choice(["C", "tr_TR.UTF-8", "xx_XX", ""]),
        "LC_ALL": case.random.choice(["C", "POSIX", "de_DE.UTF-8"]),
        "TERM": case.random.choice(["", "dumb", "xterm"]),
        "COLUMNS": case.random.choice(["1", "0", "-1", "x", "10000"]),
    }
    mask = case.random.choice([0o000, 0o077])
    ended = case.start(Mask(mask), **odd).end()
    assert ended.code == 0, ended
    case.check_files()
    for name in case.line.outputs:
        assert (case.place.out / name).stat().st_mode & 0o777 == 0o666 & ~mask


def no_working_directory(case: Case) -> None:
    out = case.random.choice([case.place.out, "somewhere"])
    ended = case.start(Gone(), out=out).end()
    if ended.code != 0:
        case.check_refused(ended)
    case.check_files()


TRIED: dict[str, Callable[[Case], None]] = {
    "kill -9": ended_by(signal.SIGKILL),
    "SIGTERM": ended_by(signal.SIGTERM),
    "SIGHUP": ended_by(signal.SIGHUP),
    "SIGINT": ended_by(signal.SIGINT),
    "a small disk": small_disk,
    "files of limited size": small_files,
    "/dev/full": full_device,
    "a read-only folder": read_only,
    "a place where nothing can be": impossible_place,
    "no home": no_home,
    "no cache": dead_cache,
    "a full cache": full_cache,
    "two runs in one place": same_place_twice,
    "two runs with one empty cache": same_cache_twice,
    "little memory": little_memory,
    "few descriptors": few_descriptors,
    "odd time zone, language, terminal, umask": odd_surroundings,
    "no working directory": no_working_directory,
}
MOUNTED = {"a small disk", "a read-only folder", "a full cache"}
WRITING = {*MOUNTED, "files of limited size", "/dev/full", "a place where nothing can be", "two runs in one place"}
INTERRUPTED = {"kill -9", "SIGTERM", "SIGHUP", "SIGINT", "two runs in one place"}


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands read."""
    folder = tmp_path_factory.mktemp("given")
    (folder / "pairs.csv").write_text("start_yaw_deg,target_yaw_deg\n0,10\n5,-20\n", encoding="utf-8")
    place = Place.make(folder / "place")
    for words in (
        f"predict lpf-1 --target 20 --command {folder}/saccade.csv",
        f"simulate --motor {folder}/saccade.csv --plant lpf --out {folder}/simulated",
        f"convert lpf-1 --bids {folder}/recorded",
    ):
        ended = Running(words.split(), place).end()
        assert ended.code == 0, ended
    for path in (folder / "recorded").rglob("*_physio.*"):
        path.rename(folder / f"gaze{''.join(path.suffixes)}")
    for suffix, name in (("csv", "executed.csv"), ("rrd", "recording.rrd")):
        (folder / "simulated" / f"trajectory.{suffix}").rename(folder / name)
    return folder


@pytest.fixture(scope="module")
def usual(given: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Usual]:
    """How long a command takes and how much it writes, tried once; and that all its files are there and whole."""
    known: dict[str, Usual] = {}

    def of(name: str) -> Usual:
        if name not in known:
            case = Case(name, Place.make(tmp_path_factory.mktemp("usual") / "place"), given, random.Random(0), of)
            began = time.monotonic()
            case.check_works()
            sizes = [path.stat().st_size for path in case.place.out.rglob("*")]
            known[name] = Usual(time.monotonic() - began, sum(sizes), max(sizes, default=0))
        return known[name]

    return of


def chosen(fault: str) -> list[str]:
    """The commands that a fault is tried on: all that it can meet, or one."""
    meets = [
        name
        for name, line in LINES.items()
        if (line.outputs or fault not in WRITING)
        and not (line.resumes and fault in INTERRUPTED)
        and not (line.slow and FAULTS < 2)
    ]
    return meets * FAULTS if FAULTS else [meets[(5 * list(TRIED).index(fault)) % len(meets)]]


@pytest.mark.parametrize("fault", TRIED)
def test_fault(
    fault: str,
    given: Path,
    usual: Callable[[str], Usual],
    tmp_path: Path,
    record_property: Callable[[str, int], None],
) -> None:
    if fault in MOUNTED and not mounts():
        pytest.skip("no file system may be mounted here")
    fell = []
    names = chosen(fault)
    record_property("cases", len(names))
    for seed, name in enumerate(names):
        case = Case(
            name, Place.make(tmp_path / str(seed) / "place"), given, random.Random(f"{fault}, {name}, {seed}"), usual
        )
        try:
            TRIED[fault](case)
        except AssertionError as error:
            fell.append(f"{fault}, {name}, seed {seed}: {error}")
            print(fell[-1], flush=True)
        shutil.rmtree(tmp_path / str(seed))
    print(f"| {fault} | {len(set(names))} commands | {len(names)} cases | {len(fell)} fell |", flush=True)
    assert not fell, "\n".join(fell)


def test_every_command_is_tried() -> None:
    assert {line.words.split()[0] for line in LINES.values()} | set(ELSEWHERE) == set(COMMANDS)


def test_no_signal_is_lost_while_a_mesh_is_shaded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trimesh goes on after any exception in its search of facets: none is asked for."""
    asked: list[object] = []
    monkeypatch.setattr("trimesh.Trimesh.facets", property(asked.append))
    _mesh(build_model(), 0)
    assert not asked
