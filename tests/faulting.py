"""Command lines that are to be broken: the table of them, how what they write is checked, and processes to break.

A process is forked from a server that has imported everything, so that a fault meets the command at its work and not
at its imports. It has its own folder to stand in, and its own home, cache and temporary folder, all empty.
"""

import csv
import ctypes
import gzip
import json
import multiprocessing
import os
import resource
import shutil
import signal
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imread

from orient_eye.recording import viewer

_PATIENCE_S = 120.0  # until a command counts as one that hangs; the machine may be busy


@dataclass(frozen=True)
class Line:
    """A command line; `{out}` is the folder for what it writes, `{given}` that of what it reads."""

    words: str
    outputs: tuple[str, ...] = ()
    whole_run: bool = False
    """Writes a run directory, which has to be new or empty."""
    slow: bool = False
    """Tried only where each fault is tried more than once."""
    goes_on: bool = False
    """Takes up what is in its folder when it is called again."""
    resumes: bool = False
    """What interrupts it is tried elsewhere, and how it goes on (`tests/test_checkpoint.py`)."""

    def arguments(self, out: Path | str, given: Path) -> list[str]:
        return [word.replace("{out}", str(out)).replace("{given}", str(given)) for word in self.words.split()]


def _run(words: str, *outputs: str, **more: bool) -> Line:
    return Line(f"{words} --out {{out}}", ("run.json", *outputs), whole_run=True, **more)


_PICTURES = tuple(
    f"{name}.png" for name in ("policy_output", "saccades", "pure_step", "main_sequence", "reward_against_k0", "energy")
)
_SHORT = "--updates 8 --warmup 64 --batch-size 16 --evaluation-pairs 3 --quiet"
LINES = {
    "simulate": _run(
        "simulate --motor {given}/saccade.csv --plant lpf",
        "result.json", *(f"trajectory.{suffix}" for suffix in ("csv", "npz", "png", "rrd")),
    ),
    "sysid": _run(
        "sysid --plant lpf --amplitudes 5 10 --held-out 7",
        "surrogate.json", "fits.json", "fits.csv", "figure_3_5.png", "figure_3_6.png", "recording.rrd",
    ),
    "evaluate": _run("evaluate lpf-1 --pairs 5 --quiet", "result.json", "pairs.csv", "recording.rrd", *_PICTURES),
    "export --sb3": Line("export lpf-1 --sb3 {out}/policy.zip", ("policy.zip",)),
    "export --onnx": Line("export lpf-1 --onnx {out}/policy.onnx", ("policy.onnx",)),
    "convert --bids": Line(
        "convert lpf-1 --bids {out}",
        ("README", "participants.tsv", "participants.json", "dataset_description.json", *(
            f"sub-robot/beh/sub-robot_task-saccade_recording-eye1_physio{end}"
            for end in (".tsv.gz", ".json", "events.tsv.gz", "events.json")
        )), whole_run=True,
    ),
    "convert --parquet": Line("convert lpf-1 --parquet {out}/saccades.parquet", ("saccades.parquet",)),
    "compare": _run("compare {given}/gaze.tsv.gz --policy lpf-1", "result.json", "saccades.csv", "main_sequence.png"),
    "predict --out": Line("predict lpf-1 --target 20 --out {out}/saccade.csv", ("saccade.csv",)),
    "predict --command --back": Line(
        "predict lpf-1 --target 20 --command {out}/there.csv --back {out}/back.csv", ("there.csv", "back.csv")
    ),
    "predict --commands": Line(
        "predict lpf-1 --pairs {given}/pairs.csv --commands {out}", ("index.csv", "saccade-1.csv", "saccade-2.csv"),
        whole_run=True,
    ),
    "check": Line(
        "check thesis --command {given}/saccade.csv --executed {given}/executed.csv --out {out}/table.csv",
        ("table.csv",),
    ),
    "optimum": Line("optimum --pairs {given}/pairs.csv --quiet --out {out}/best.csv", ("best.csv",)),
    "weights": Line("weights --case 1"),
    "models": Line("models"),
    "report": _run("report --figures 2.2,5.1 --pairs 5 --quiet", "result.json", "index.html", "figures/5.1.png"),
    "validate": Line("validate --random-runs 1", slow=True),
    "listing": _run(
        "listing --plant viscous --quiet", "result.json", "statics.csv", "workspace.png", "torsion.png", "plane.png",
        slow=True,
    ),
    "listing six": _run(
        "listing --plant tavares --eye six --quiet",
        "result.json", "statics.csv", "reach.png", "planes.png", "motors.png", "antagonists.png", "stiffness.png",
    ),
    "listing POLICY": _run(
        "listing modal-gaze --saccades 8 --quiet",
        "result.json", "sequence.csv", "sequence.rrd", "plane.png", "torsion.png", slow=True,
    ),
    "train": _run(
        f"train {_SHORT}",
        "result.json", "metrics.csv", "policy.safetensors", "optimum.safetensors", "recording.rrd", "policy.png",
        "learning.png", "README.md", slow=True, resumes=True,
    ),
    "sweep": Line(
        f"sweep {_SHORT} --seed 0 1 --jobs 2 --out {{out}}",
        ("sweep.json", "result.json", "sweep.png", *(f"seed{k}/policy.safetensors" for k in (0, 1))),
        whole_run=True, slow=True, resumes=True, goes_on=True,
    ),
}  # fmt: skip
"""A new command is one line: its words, and the files that it leaves."""
ELSEWHERE = {"view": "tests/test_viewer.py, in processes that are not forked: its client is none that survives that"}


# --- what is whole --------------------------------------------------------------------------------


def _read_csv(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    rows = list(csv.reader(text.splitlines()))
    assert text.endswith("\n")
    assert len(rows) > 1
    assert len({len(row) for row in rows}) == 1


def _read_npz(path: Path) -> None:
    with np.load(path) as arrays:
        assert sum(array.size for array in arrays.values())


def _read_zip(path: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None


def _read_onnx(path: Path) -> None:
    import onnx

    onnx.checker.check_model(onnx.load(path))


def _read_safetensors(path: Path) -> None:
    import safetensors.numpy

    assert safetensors.numpy.load(path.read_bytes())


def _read_rrd(path: Path) -> None:
    subprocess.run([viewer._executable(), "rrd", "verify", str(path)], check=True, capture_output=True)


def _read_parquet(path: Path) -> None:
    import pyarrow.parquet as pq

    assert pq.read_table(path).num_rows


def _ends(path: Path, last: str) -> None:
    assert path.read_text(encoding="utf-8").rstrip().endswith(last)


READERS: dict[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text(encoding="utf-8")),
    ".csv": _read_csv,
    ".png": imread,
    ".npz": _read_npz,
    ".gz": lambda path: gzip.decompress(path.read_bytes()),
    ".parquet": _read_parquet,
    ".zip": _read_zip,
    ".html": lambda path: _ends(path, "</html>"),
    ".md": lambda path: _ends(path, "card."),
    ".svg": lambda path: _ends(path, "</svg>"),
    ".onnx": _read_onnx,
    ".safetensors": _read_safetensors,
    ".rrd": _read_rrd,
}


def broken(folder: Path) -> list[str]:
    """The files in a folder and below that are not whole, and why."""
    found = []
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.suffix in READERS:
            try:
                READERS[path.suffix](path)
            except Exception as error:  # whatever a reader makes of half a file
                found.append(f"{path.name} ({path.stat().st_size} bytes): {type(error).__name__}: {error}")
    return found


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()}


# --- processes ------------------------------------------------------------------------------------

_IMPORTED = (
    "torch", "torch._dynamo", "onnx", "pyarrow.parquet", "rerun", "scipy.optimize", "stable_baselines3", "rich.console",
    "faulting",
    "orient_eye.cli.options", "orient_eye.cli.tables", "orient_eye.exchange.bids", "orient_eye.exchange.eye_tables",
    "orient_eye.figures.main_sequence", "orient_eye.figures.trajectory", "orient_eye.learning.compared",
    "orient_eye.learning.figures",
    "orient_eye.learning.judged", "orient_eye.learning.policy_export", "orient_eye.learning.sequences",
    "orient_eye.learning.torch_policy", "orient_eye.learning.training", "orient_eye.recording",
    "orient_eye.search.evolution", "orient_eye.sysid.comparison", "orient_eye.task.known_weights",
)  # fmt: skip
_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(list(_IMPORTED))


@dataclass(frozen=True)
class Place:
    """Where a command line runs: `out` for what it writes, and folders of its own."""

    root: Path

    @classmethod
    def make(cls, root: Path) -> "Place":
        place = cls(root)
        for name in ("work", "home", "cache/orient-eye", "temporary"):
            (root / name).mkdir(parents=True)
        compiled = root.parent / "numba"  # compiled once for all: nothing that is tried here
        compiled.mkdir(exist_ok=True)
        (root / "cache" / "orient-eye" / "numba").symlink_to(compiled)
        return place

    @property
    def out(self) -> Path:
        return self.root / "work" / "out"

    @property
    def environment(self) -> dict[str, str]:
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("XDG_", "ORIENT_EYE"))}
        folders = {"HOME": "home", "XDG_CACHE_HOME": "cache", "TMPDIR": "temporary"}
        return kept | {"COLUMNS": "200"} | {name: str(self.root / folder) for name, folder in folders.items()}


@dataclass
class Ended:
    """How a process ended: its exit code, or minus the signal, and what it said."""

    code: int | None
    said: str


class Running:
    """A command line in a process of its own.

    Args:
        arguments: of `orient-eye`.
        place: where it runs.
        fault: called in the process before it begins.
        environment: added to the place's.
    """

    def __init__(
        self,
        arguments: list[str],
        place: Place,
        fault: Callable[[], object] | None = None,
        environment: dict[str, str] | None = None,
    ) -> None:
        self._said, speaks = _SERVER.Pipe(duplex=False)
        told = place.environment | (environment or {})
        self.process = _SERVER.Process(target=_begin, args=(arguments, str(place.root / "work"), told, speaks, fault))
        self.process.start()
        speaks.close()

    def send(self, number: int) -> None:
        if self.process.exitcode is None:
            os.kill(self.process.pid or 0, number)

    def end(self) -> Ended:
        """Wait for the end; a process that hangs has code None, and is killed."""
        self.process.join(_PATIENCE_S)
        code = self.process.exitcode
        if code is None:
            os.killpg(self.process.pid or 0, signal.SIGKILL)  # with its children
            self.process.join()
        os.set_blocking(self._said.fileno(), False)
        said = b""
        while True:
            try:
                part = os.read(self._said.fileno(), 2**20)
            except BlockingIOError:  # somebody else still holds the other end
                break
            if not part:
                break
            said += part
        self._said.close()
        return Ended(code, said.decode(errors="replace"))

    def children(self) -> list[int]:
        """Processes of its session that are still there."""
        found = []
        for entry in Path("/proc").iterdir():
            try:
                state = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if entry.name.isdigit() and int(state[3]) == self.process.pid and state[0] != "Z":
                found.append(int(entry.name))
        return found


def _begin(arguments: list[str], work: str, environment: dict[str, str], said: Connection, fault: Any) -> None:
    """What the forked process does."""
    os.setsid()
    os.chdir(work)
    os.environ.clear()
    os.environ.update(environment)
    os.dup2(said.fileno(), 1)
    os.dup2(said.fileno(), 2)
    sys.stdout, sys.stderr = (open(n, "w", encoding="utf-8", buffering=1, closefd=False) for n in (1, 2))  # noqa: SIM115  to the end
    sys.argv = ["orient-eye", *arguments]
    if fault is not None:
        fault()
    from orient_eye.cli import main

    main(arguments)


# --- faults, set up in the process ----------------------------------------------------------------


@dataclass(frozen=True)
class Limit:
    """A limit of the system, by its name in `resource`."""

    name: str
    value: int

    def __call__(self) -> None:
        resource.setrlimit(getattr(resource, self.name), (self.value, self.value))


@dataclass(frozen=True)
class Both:
    """Several things to set up, one after the other."""

    faults: tuple[Callable[[], object], ...]

    def __call__(self) -> None:
        for fault in self.faults:
            fault()


@dataclass(frozen=True)
class Room:
    """So many bytes of addresses more than the process has."""

    bytes: int

    def __call__(self) -> None:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        Limit("RLIMIT_AS", pages * os.sysconf("SC_PAGE_SIZE") + self.bytes)()


@dataclass(frozen=True)
class Mask:
    mask: int

    def __call__(self) -> None:
        os.umask(self.mask)


@dataclass(frozen=True)
class Gone:
    """The working directory is deleted."""

    def __call__(self) -> None:
        os.mkdir("gone")
        os.chdir("gone")
        os.rmdir(Path.cwd())


@dataclass(frozen=True)
class Mounted:
    """A file system over a folder that only this process sees; what is in it at the end is copied to `copy`."""

    folder: Path
    options: tuple[str, ...]
    copy: Path | None = None

    def __call__(self) -> None:
        _own_mounts()
        subprocess.run(["mount", *self.options, str(self.folder)], check=True)
        if self.copy is None:
            return
        child = os.fork()
        if child:
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            shutil.copytree(self.folder, self.copy, symlinks=True)
            os._exit(code)


def _own_mounts() -> None:
    """Mounts that nobody else sees; raises OSError where that is not allowed."""
    new_user, new_mounts = 0x10000000, 0x20000
    user, group = os.getuid(), os.getgid()
    library = ctypes.CDLL(None, use_errno=True)
    if library.unshare(new_mounts | (new_user if user else 0)):
        raise OSError(ctypes.get_errno(), "unshare")
    if user:
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"0 {user} 1")
        Path("/proc/self/gid_map").write_text(f"0 {group} 1")
    subprocess.run(["mount", "--make-rprivate", "/"], check=True)


def _try_mount(folder: str) -> None:
    Mounted(Path(folder), ("-t", "tmpfs", "none"))()


@cache
def mounts() -> bool:
    """Whether file systems may be mounted here."""
    trial = _SERVER.Process(target=_try_mount, args=("/mnt",))
    trial.start()
    trial.join()
    return trial.exitcode == 0
