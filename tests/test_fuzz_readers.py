"""Whatever is in a file, who reads it gets a whole object or an `InputError`, in bounded time: law of every reader.

Valid files are spoiled in what they say (a key gone, a cell that is a word, an array of another shape, its hash made
right again) and in their bytes. A new reader is one line in `READERS`.
"""

import gzip
import io
import json
import math
import re
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy
from hypothesis import given, reject
from hypothesis import strategies as st

import orient_eye
from fuzzing import budget
from orient_eye.cli.saccades import read_pairs
from orient_eye.commands.motor_file import read_command
from orient_eye.errors import InputError
from orient_eye.exchange.eye_tables import read_gaze
from orient_eye.eyes.elastics import Elastics
from orient_eye.eyes.model import build_model, motors
from orient_eye.files import digest
from orient_eye.learning.policy import Policy, shipped_policies
from orient_eye.learning.policy_export import export_sb3, import_sb3
from orient_eye.modal_surrogate import ModalSurrogate, shipped_modal_surrogates
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.modal import ModalPlant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.resources import data_folder
from orient_eye.rig import Rig
from orient_eye.run_directory import RunDirectory
from orient_eye.search.optimum_file import read_optimum
from orient_eye.surrogate import Surrogate, shipped_surrogates
from orient_eye.sysid.physical_recordings import read_physical
from orient_eye.sysid.prototype_log import COLUMNS
from orient_eye.sysid.recording_checks import doubts_of, warnings_of
from orient_eye.sysid.recordings import read_recording
from orient_eye.task.known_weights import _read as read_weights
from orient_eye.task.saccade import SaccadeTask

_BOUND_S = 5.0
WEIRD: tuple[Any, ...] = (
    None, True, 0, -1, 10**400, 1e308, -1e-300, math.nan, math.inf, "", "word", "\0", "\ud800", "x" * 1000, [], {},
    [[]], {"K": {}}, [1, "a", None],
)  # fmt: skip
CELLS = ("", "nan", "inf", "-1", "0", "1e308", "1e-300", "1e200", "word", "1" + 400 * "0", '"', "[[", "{", "1,5", "\0")
NUMBER = re.compile(r"[-+]?\d[\d.eE+-]*|\w+")


# --- what can be wrong with a value ---------------------------------------------------------------


@st.composite
def spoiled_text(draw: st.DrawFn, text: str) -> str:
    lines = text.splitlines()
    which = draw(st.integers(0, len(lines) - 1))
    cell = draw(st.sampled_from(list(NUMBER.finditer(text))))
    ways: list[Callable[[], str]] = [
        lambda: text[: draw(st.integers(0, len(text)))],
        lambda: "\n".join(lines[:which] + lines[which + 1 :]),
        lambda: "\n".join([*lines[: which + 1], *lines[which:]]),
        lambda: "\n".join([*lines[:which], draw(st.text(max_size=30)), *lines[which:]]),
        *[lambda: text[: cell.start()] + draw(st.sampled_from(CELLS)) + text[cell.end() :]] * 4,
    ]
    return draw(st.sampled_from(ways))()


@st.composite
def spoiled_array(draw: st.DrawFn, array: np.ndarray) -> Any:
    some = draw(st.integers(0, max(array.size - 1, 0)))
    number = draw(st.sampled_from([math.nan, math.inf, -1.0, 0.0, 1e308, 1e-300, 1e200]))

    def other(change: Callable[[np.ndarray], None]) -> np.ndarray:
        changed = array.astype(float) if array.dtype.kind in "fb" else array.copy()
        change(changed)
        return changed

    ways: list[Callable[[], Any]] = [
        lambda: other(lambda a: a.put(some, number)) if array.size and array.dtype.kind in "fb" else array,
        lambda: array * number if array.dtype.kind == "f" else array,
        lambda: array[:-1] if array.ndim else array,
        lambda: array[..., None],
        array.ravel,
        lambda: array[::-1] if array.ndim else array,
        lambda: array.astype(draw(st.sampled_from(["float32", "int64", "bool", "float16"]))),
        lambda: np.zeros((0, 3)),
    ]
    with np.errstate(all="ignore"):
        try:
            return draw(st.sampled_from(ways))()
        except (ValueError, OverflowError):  # words are no numbers
            return np.array(["word"])


@st.composite
def spoiled(draw: st.DrawFn, value: Any) -> Any:
    """A value that is wrong somewhere: in one of its parts, at any depth, or as a whole."""
    if isinstance(value, np.ndarray):
        return draw(spoiled_array(value))
    if isinstance(value, bytes):
        return draw(damaged(value))
    if isinstance(value, str) and len(value) > 100:
        return draw(spoiled_text(value))
    if not isinstance(value, dict | list) or not value or draw(st.integers(0, 9)) == 0:
        return draw(st.sampled_from(WEIRD))
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    key, way = draw(st.sampled_from(keys)), draw(st.integers(0, 5))
    changed: Any = value.copy()
    if way == 0:
        del changed[key]
    elif way == 1 and isinstance(value, dict):
        changed[draw(st.sampled_from(["", "word", "K", "format"]))] = draw(st.sampled_from(WEIRD))
    else:
        changed[key] = draw(spoiled(value[key]))
    return changed


@st.composite
def damaged(draw: st.DrawFn, content: bytes) -> bytes:
    """Other bytes: any, a part of them, or some turned over."""
    ways: list[Callable[[], bytes]] = [
        lambda: draw(st.binary(max_size=200)),
        lambda: content[: draw(st.integers(0, len(content)))],
        lambda: content + draw(st.binary(max_size=20)),
        lambda: b"[" * 100_000,
    ]
    if content:
        at = draw(st.integers(0, len(content) - 1))
        ways += [lambda: content[:at] + draw(st.binary(max_size=8)) + content[at + draw(st.integers(0, 8)) :]] * 4
    return draw(st.sampled_from(ways))()


# --- files from values ----------------------------------------------------------------------------


def as_json(value: Any) -> bytes:
    return json.dumps(value).encode()


def as_text(value: Any) -> bytes:
    return str(value).encode("utf-8", "surrogatepass")


def as_safetensors(value: Any) -> bytes:
    """{"arrays": ..., "told": ...} with the hash of them, as policies and optima are written."""
    arrays, told = value["arrays"], dict(value["told"])
    named = told.pop("format", None)
    own = ("format", "sha256") if "evaluations" not in told else ("sha256",)
    hashed = told if "format" in own else {"format": named, **told}
    head = {"format": named, **told, "sha256": digest(arrays, hashed)}
    whole = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    return bytes(safetensors.numpy.save(whole, {"orient-eye": json.dumps(head)}))


def as_npz(value: Any) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **value)
    return file.getvalue()


def as_zip(value: Any) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, part in value.items():
            archive.writestr(name, part if isinstance(part, bytes) else json.dumps(part))
    return file.getvalue()


# --- valid ones -----------------------------------------------------------------------------------

T = np.linspace(0, 0.6, 30)


def table(**columns: np.ndarray) -> str:
    rows = "\n".join(",".join(f"{x:.6g}" for x in row) for row in zip(*columns.values(), strict=True))
    return ",".join(columns) + "\n" + rows + "\n"


@cache
def valid(kind: str) -> Any:  # noqa: PLR0911  one line a kind
    """What a valid file of each kind says."""
    turned = np.deg2rad(15 * (1 - np.exp(-17.5 * T))) / 2
    quaternion = {"q_w": np.cos(turned), "q_x": 0 * T, "q_y": 0 * T, "q_z": np.sin(turned)}
    motor = 10.0 * (T > 0)
    match kind:
        case "command":
            return table(t_s=T, tau2_deg=motor)
        case "recording":
            return table(t_s=T, tau2_deg=motor, eye_deg=1.5 * motor, yaw_deg=1.5 * motor, **quaternion)
        case "log":
            counts = np.round(512 + 400 * T)
            rest = dict.fromkeys(COLUMNS, 0 * T)
            text = table(**{**rest, "position1": counts, "velocity1": 60 + 0 * T, **quaternion})
            return text.split("\n", 1)[1].replace(",", " ")
        case "pairs":
            return table(start_yaw_deg=-T, target_yaw_deg=10 * T)
        case "surrogate":
            return json.loads(shipped_surrogates()["thesis"].read_text()) | {
                "range": [-30.0, 30.0], "intervals": {"K": [1.0, 2.0]}, "rig": Rig.load("prototype").to_plain(),
            }  # fmt: skip
        case "modal":
            return json.loads(shipped_modal_surrogates()["thesis-3d"].read_text())
        case "rig":
            return (data_folder("models") / "rigs" / "prototype.toml").read_text()
        case "eye":
            return (data_folder("eye_mjcf") / "eye3.xml").read_text()
        case "run":
            return {"command": "train", "config": {"plant": "lpf", "seed": 0}}
        case "weights":
            return {"of": weights_key(), "weights": task().weights, "from": "solved"}
        case "trajectory":
            plant = MujocoPlant(threads=1)
            move = plant.move(np.tile(np.linspace(0, 9, 12)[None, :, None], (2, 1, 3))).trajectory()
            arrays = {name: value for name, value in vars(move).items() if name != "motors"}
            arrays |= {"motor_names": list(move.motor_names), "motor_units": ["deg"] * 3}
            return {name: np.asarray(value) for name, value in arrays.items()}
        case "policy" | "optimum":
            folder = shipped_policies()["lpf-1"]
            name = "policy.safetensors" if kind == "policy" else "optimum.safetensors"
            with safetensors.safe_open(folder / name, "numpy") as file:
                told = json.loads(file.metadata()["orient-eye"])
                arrays = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118  no iterator
            del told["sha256"]
            return {"arrays": arrays, "told": told}
    raise KeyError(kind)


@cache
def task() -> SaccadeTask:
    return Policy.load("lpf-1").task()


@cache
def weights_key() -> dict[str, Any]:
    return {**task().identity(), "weights": None}


# --- the readers ----------------------------------------------------------------------------------


def same_again(one: Any, path: Path) -> None:
    """Saved and read again it is the same: what was read was whole."""
    assert type(one).load(one.save(path.with_name("again"))) == one


def use_command(path: Path) -> None:
    command = read_command(path, LinearPlant().motors)
    assert np.isfinite(command.sample(0.001, 50)).all()


def use_recording(path: Path) -> None:
    for row_times in ("even", "row-by-row"):
        step = read_recording(path, row_times=row_times)
        assert all(isinstance(text, str) for text in doubts_of(step) + warnings_of(step))


def use_physical(path: Path) -> None:
    measured = read_physical(path, eye_motors())
    assert np.isfinite(measured.motor).all()
    assert np.isfinite(measured.angles).all()


@cache
def eye_motors() -> Any:
    return motors(build_model(visual=False))


def use_surrogate(path: Path) -> None:
    one = Surrogate.load(path)
    same_again(one, path)
    assert np.isfinite(LinearPlant(one).rest(np.zeros((1, 1)))).all()


def use_modal(path: Path) -> None:
    one = ModalSurrogate.load(path)
    same_again(one, path)
    assert np.isfinite(ModalPlant(one).rest(np.zeros((1, len(one.motors))))).all()


def use_rig(path: Path) -> None:
    one = Rig.load(path)
    same_again(one, path)
    for axis in one.axes:
        drive = one.to_driver(axis, np.array([0.0, 1.0]))
        np.testing.assert_allclose(one.from_driver(axis, drive), [0, 1], atol=0.1)


def use_eye(path: Path) -> None:
    Elastics.from_model(build_model(str(path), visual=False))


def use_policy(path: Path) -> None:
    policy = Policy.load(path.parent)
    ahead = np.array([[1.0, 0, 0, 0]])
    assert np.isfinite(policy.act(ahead, ahead)).all()
    policy.task()


def use_trajectory(path: Path) -> None:
    move = Trajectory.load_npz(path)
    assert np.isfinite(move.yaw_deg[~move.failed]).all()


def as_parquet(value: Any) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    file = io.BytesIO()
    try:
        pq.write_table(pa.table(value), file)
    except (pa.ArrowException, OverflowError) as error:
        raise ValueError(str(error)) from error
    return file.getvalue()


def as_gzip(value: Any) -> bytes:
    return gzip.compress(as_text(value), mtime=0)


def gaze_columns() -> dict[str, Any]:
    time = np.arange(0, 0.2, 0.002)
    return {"time": time, "x": 10 * np.tanh(100 * (time - 0.1)), "y": 0 * time, "note": 1.0 * (time > 0.1)}


def gaze_text(separator: str = ",", header: bool = True) -> str:
    columns = gaze_columns()
    rows = [separator.join(f"{cell:.6g}" for cell in row) for row in zip(*columns.values(), strict=True)]
    return "\n".join([separator.join(columns), *rows] if header else rows) + "\n"


def use_gaze(path: Path) -> None:
    record = read_gaze(path)
    assert record.time.shape == record.horizontal_deg.shape == record.vertical_deg.shape
    found = record.saccades()
    assert (found.duration_s > 0).all()


def use_bids(path: Path) -> None:
    path.with_name("a.json").write_text(json.dumps({"Columns": list(gaze_columns())}), encoding="utf-8")
    use_gaze(path)


def use_sidecar(path: Path) -> None:
    path.with_name("b.tsv.gz").write_bytes(as_gzip(gaze_text("\t", header=False)))
    use_gaze(path.with_name("b.tsv.gz"))


def use_optimum(path: Path) -> None:
    found = read_optimum(path)
    if found is None:
        raise InputError("it is searched again")
    assert found.of(found.start, found.target) is not None or not len(found.start)


def use_weights(path: Path) -> None:
    if read_weights(path, weights_key()) is None:
        raise InputError("they are solved again")


@cache
def sb3_zip() -> dict[str, Any]:
    file = io.BytesIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("orient_eye.learning.policy_export.write_atomically", lambda _, write: write(Opened(file)))
        export_sb3(Policy.load("lpf-1"), "policy.zip")
    with zipfile.ZipFile(file) as archive:
        parts: dict[str, Any] = {name: archive.read(name) for name in ("data", "policy.pth")}
    return parts | {"data": json.loads(parts["data"])}


@dataclass
class Opened:
    """Stands for the path of a file in memory."""

    file: io.BytesIO

    def open(self, mode: str) -> "Opened":
        return self

    def __enter__(self) -> io.BytesIO:
        return self.file

    def __exit__(self, *_: object) -> None:
        pass


@dataclass(frozen=True)
class Reader:
    """A reader: the module that reads, the file's name, what a valid file says and how that is written, its use."""

    module: str
    name: str
    value: Callable[[], Any]
    pack: Callable[[Any], bytes]
    use: Callable[[Path], object]


READERS = {
    "command": Reader("commands.motor_file", "a.csv", partial(valid, "command"), as_text, use_command),
    "recording": Reader("sysid.recordings", "a.csv", partial(valid, "recording"), as_text, use_recording),
    "log": Reader("sysid.recordings", "a.txt", partial(valid, "log"), as_text, use_recording),
    "physical": Reader("sysid.physical_recordings", "a.csv", partial(valid, "recording"), as_text, use_physical),
    "physical log": Reader("sysid.physical_recordings", "a.txt", partial(valid, "log"), as_text, use_physical),
    "pairs": Reader("cli.saccades", "a.csv", partial(valid, "pairs"), as_text, lambda p: read_pairs(p, ("yaw_deg",))),
    "surrogate": Reader("surrogate", "a.json", partial(valid, "surrogate"), as_json, use_surrogate),
    "modal": Reader("modal_surrogate", "a.json", partial(valid, "modal"), as_json, use_modal),
    "rig": Reader("rig", "a.toml", partial(valid, "rig"), as_text, use_rig),
    "eye": Reader("eyes.model", "a.xml", partial(valid, "eye"), as_text, use_eye),
    "run": Reader("run_directory", "run.json", partial(valid, "run"), as_json,
                  lambda p: RunDirectory(p.parent).read_json("run.json")),
    "weights": Reader("task.known_weights", "a.json", partial(valid, "weights"), as_json, use_weights),
    "trajectory": Reader("movement.trajectory", "a.npz", partial(valid, "trajectory"), as_npz, use_trajectory),
    "policy": Reader("learning.policy", "policy.safetensors", partial(valid, "policy"), as_safetensors, use_policy),
    "optimum": Reader("search.optimum_file", "a.safetensors", partial(valid, "optimum"), as_safetensors, use_optimum),
    "gaze": Reader("exchange.eye_tables", "gaze.csv", gaze_text, as_text, use_gaze),
    "gaze parquet": Reader("exchange.eye_tables", "gaze.parquet", gaze_columns, as_parquet, use_gaze),
    "gaze bids": Reader("exchange.eye_tables", "a.tsv.gz", lambda: gaze_text("\t", header=False), as_gzip, use_bids),
    "sidecar": Reader("exchange.eye_tables", "b.json", lambda: {"Columns": list(gaze_columns())}, as_json, use_sidecar),
    "sb3": Reader("learning.policy_export", "a.zip", sb3_zip, as_zip, lambda p: import_sb3(p, task())),
}  # fmt: skip
ELSEWHERE = {
    "tables": "read by all that read a table; tests/test_tables.py",
    "cli.convert": "run.json; tests/test_exchange.py",
    "cli.check": "tests/test_check.py: the same tables as sysid.recordings",
    "cli.predict": "reads what cli.saccades reads",
    "learning.training": "run.json; tests/test_training.py",
    "learning.sweep": "sweep.json; tests/test_sweep.py",
    "learning.sweep_results": "result.json of runs; tests/test_sweep.py",
    "learning.workers": "what workers tell each other; tests/test_sweep.py",
    "cli.sweep": "a sweep's TOML; tests/test_sweep.py",
    "learning.checkpoint": "tests/test_checkpoint.py",
    "files": "the readers below all others",
    "report.evidence": "shipped studies, and metrics.csv by read_table",
}
"""Modules that read files, and where else they are tried."""
OF_OURS = {
    "files.py": "the readers themselves",
    "cli/view.py": "the first bytes of a recording; tests/test_viewer.py",
    "validation.py": "shipped data",
    "human.py": "shipped data",
    "report/page.py": "the template of the page",
    "learning/card.py": "the template of the card",
    "learning/figures/page.py": "the metrics of a run, while it is made",
    "learning/sweep_results.py": "the same",
    "learning/cluster.py": "a word that it has just written, to see whether another machine sees it",
}
"""Who opens a file by himself, and why."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("kind", READERS)
@budget(30)
@given(data=st.data())
def test_a_whole_object_or_an_input_error(kind: str, folder: Path, data: st.DataObject) -> None:
    reader = READERS[kind]
    path, value = folder / reader.name, reader.value()
    if kind == "eye" and not (folder / "meshes").exists():
        (folder / "meshes").symlink_to(data_folder("eye_mjcf") / "meshes")
    in_bytes = data.draw(st.integers(0, 3), label="damage of bytes at 0") == 0
    try:
        content = reader.pack(value if in_bytes else data.draw(spoiled(value)))
    except (TypeError, ValueError, KeyError, IndexError, AttributeError, safetensors.SafetensorError):
        reject()  # no file can say that
    path.write_bytes(data.draw(damaged(content)) if in_bytes else content)
    begun = time.process_time()
    try:
        reader.use(path)
    except InputError as error:
        told = str(error)
        assert len(told) < 5000
    assert time.process_time() - begun < _BOUND_S


@pytest.mark.parametrize("kind", READERS)
def test_the_valid_one_is_read(kind: str, tmp_path: Path) -> None:
    """Else spoiling it would show nothing."""
    reader = READERS[kind]
    (tmp_path / "meshes").symlink_to(data_folder("eye_mjcf") / "meshes")
    path = tmp_path / reader.name
    path.write_bytes(reader.pack(reader.value()))
    reader.use(path)


def test_every_reader_is_tried() -> None:
    """Whoever opens a file asks `files` or `tables`, and stands in the table above."""
    source = Path(orient_eye.__file__).parent
    reads = re.compile(r"(?<![.\w])(read_bytes|read_json|read_lines|read_table|read_arrays|read_text)\(|[^.\w]load\($")
    found = {
        ".".join(file.relative_to(source).with_suffix("").parts).removesuffix(".__init__")
        for file in source.rglob("*.py")
        if reads.search(file.read_text(encoding="utf-8"))
    }
    assert found - ELSEWHERE.keys() <= {reader.module for reader in READERS.values()} | {"modal_surrogate"}


def test_nobody_opens_an_input_by_himself() -> None:
    """One reader of all inputs: bounded, and never waiting for a pipe that nobody writes to."""
    source = Path(orient_eye.__file__).parent
    own = re.compile(r"np\.load\((?!io\.BytesIO)|json\.load\(|read_text\(|\.open\(encoding|open\(\"rb\"\)")
    found = {
        file.relative_to(source).as_posix(): own.findall(file.read_text(encoding="utf-8"))
        for file in source.rglob("*.py")
        if own.search(file.read_text(encoding="utf-8"))
    }
    assert found.keys() <= OF_OURS.keys(), found
