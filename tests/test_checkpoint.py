"""A training survives what happens to it: damaged checkpoints, kills, signals, a full disk, a second one beside it."""

import json
import math
import os
import pickle
import resource
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy
import torch

import faulting
from conftest import without_pictures
from orient_eye import cli
from orient_eye.errors import InputError
from orient_eye.files import digest
from orient_eye.learning import checkpoint, training
from orient_eye.learning.checkpoint import DAMAGED, NAME, PREVIOUS, load_checkpoint
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.loop import TrainingLoop
from orient_eye.learning.training import Interrupted, resume, train
from orient_eye.search.optimum import Optimum
from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask

Load = Callable[[Path], checkpoint.Found]
FAULTS = int(os.environ.get("FAULTS", "2"))
"""Kills at random moments, and fifteen times as many flipped bits."""
TINY = TrainConfig(updates=48, saccades_per_update=8, warmup=64, batch_size=32, evaluation_pairs=2)


def _middle(task: SaccadeTask, start: State, target: np.ndarray, *_: Any, **__: Any) -> Optimum:
    """The middle of the ranges, as if a search had found it."""
    action = task.actions.from_unit(np.zeros((len(target), len(task.actions.numbers))))
    return Optimum(action, task.perform(start, action, target).reward.total, 0)


def _shorten(patch: pytest.MonkeyPatch) -> None:
    """Search and pictures are most of the work of a tiny training, and not what is tried here."""
    patch.setattr("orient_eye.search.optimum_cache.find_optimum", _middle)
    without_pictures(patch)


@pytest.fixture(autouse=True, scope="module")
def quickly(private_cache: None) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        _shorten(patch)
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was never stopped."""
    folder = tmp_path_factory.mktemp("whole") / "run"
    train(TINY, folder, quiet=True)
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that SIGTERM stopped, with two checkpoints."""
    folder = tmp_path_factory.mktemp("stopped") / "run"
    saved = TrainingLoop._save

    def pressed(loop: TrainingLoop) -> None:
        saved(loop)
        if loop.algorithm._n_updates == 24 and loop.request.signal is None:
            signal.raise_signal(signal.SIGTERM)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TrainingLoop, "_save", pressed)
        with pytest.raises(Interrupted, match="train --resume") as stopped:
            train(TINY, folder, quiet=True, checkpoint_s=0.01)
    assert stopped.value.code == 128 + signal.SIGTERM
    return folder


@pytest.fixture
def stopped(made: Path, tmp_path: Path) -> Path:
    """The same, to be spoilt."""
    return Path(shutil.copytree(made, tmp_path / "run"))


@pytest.fixture(scope="module")
def load() -> Load:
    """Load the checkpoint of a folder into a new model."""
    settings = TINY.resolved()
    run = training._Run(settings, settings.make_task(), training.RunDirectory(Path()), 1.0, True)
    env = run._env()
    model = run._model(env, seed=0, buffer_seed=0)
    return lambda folder: load_checkpoint(folder, settings, model, env)


def assert_same(one: Path, other: Path) -> None:
    """Bit for bit the same networks and metrics, but for the wall clock; nothing half-written."""
    a, b = (safetensors.numpy.load_file(folder / "policy.safetensors") for folder in (one, other))
    assert a.keys() == b.keys()
    assert all(np.array_equal(a[name], b[name]) for name in a)
    tables = [[line.split(",") for line in (f / "metrics.csv").read_text().splitlines()] for f in (one, other)]
    clock = tables[0][0].index("elapsed_s")
    assert [[*row[:clock], *row[clock + 1 :]] for row in tables[0]] == [
        [*row[:clock], *row[clock + 1 :]] for row in tables[1]
    ]
    assert not list(one.rglob(".*"))


def _half(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


@pytest.mark.parametrize("spoil", [_half, Path.unlink])
def test_the_previous_checkpoint_is_taken_and_this_is_said(
    spoil: Callable[[Path], None], stopped: Path, whole: Path
) -> None:
    """As a loss of power, or a kill between the two renames, leaves it."""
    spoil(stopped / NAME)
    with pytest.warns(UserWarning, match=r"going on from the checkpoint before the newest, at update 24: .*" + NAME):
        resume(stopped, quiet=True)
    assert_same(stopped, whole)
    (told,) = json.loads((stopped / "run.json").read_text())["resumed"]
    assert (told["from"], told["updates"]) == (PREVIOUS, 24)
    assert NAME in told["damage"]
    assert (stopped / DAMAGED).exists() == (spoil is _half)


def test_the_damaged_one_never_takes_the_place_of_the_good_one(stopped: Path, load: Load) -> None:
    good = (stopped / PREVIOUS).read_bytes()
    _half(stopped / NAME)
    load(stopped)
    assert (stopped / NAME).read_bytes() == good
    assert not load(stopped).damage


def test_where_both_are_damaged_both_are_told(stopped: Path) -> None:
    for name in (NAME, PREVIOUS):
        _half(stopped / name)
    with pytest.raises(InputError, match=rf"cannot go on: .*{NAME}.*The one before it: .*{PREVIOUS}.*Start a new run"):
        resume(stopped, quiet=True)
    assert (stopped / NAME).exists()


def test_a_flipped_bit_anywhere_is_found(
    stopped: Path, load: Load, record_property: Callable[[str, object], None]
) -> None:
    (stopped / PREVIOUS).unlink()
    content = (stopped / NAME).read_bytes()
    begins = 8 + int.from_bytes(content[:8], "little")  # of the arrays
    random = np.random.default_rng()
    places = [*range(8), *random.integers(begins, size=5 * FAULTS), *random.integers(len(content), size=10 * FAULTS)]
    record_property("cases", len(places))
    for place in places:
        bit = 1 << int(random.integers(8))
        spoilt = bytearray(content)
        spoilt[place] ^= bit
        (stopped / NAME).write_bytes(spoilt)
        with pytest.raises(InputError, match="cannot go on"):
            print(f"bit {bit} of byte {place}", load(stopped))
    (stopped / NAME).write_bytes(content)
    assert load(stopped).updates == 32


class Trap:
    """What runs code where it is unpickled."""

    def __reduce__(self) -> Any:
        return os.mkdir, ("sprung",)


def test_files_of_other_kinds(stopped: Path, load: Load, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    (stopped / PREVIOUS).unlink()
    torch.save({"rows": torch.zeros(3), "trap": Trap()}, tmp_path / "torch.pt")
    others = [(tmp_path / "torch.pt").read_bytes(), pickle.dumps(Trap()), b"", b"{}", b"\0" * 10_000]
    for other in [
        *others,
        safetensors.numpy.save({"rows": np.zeros(3)}),
        (stopped / "optimum.safetensors").read_bytes(),
    ]:
        (stopped / NAME).write_bytes(other)
        with pytest.raises(InputError, match="cannot go on"):
            load(stopped)
    assert not (tmp_path / "sprung").exists()
    (stopped / NAME).unlink()
    (stopped / NAME).mkdir()
    with pytest.raises(InputError, match="cannot go on"):
        load(stopped)


CHANGES: dict[str, Callable[[dict[str, Any], dict[str, Any]], object]] = {
    "negative rollouts": lambda _, told: told.update(rollouts=-1),
    "too many rollouts": lambda _, told: told.update(rollouts=10**9),
    "half a rollout": lambda _, told: told.update(rollouts=1.5),
    "rollouts that the buffer denies": lambda _, told: told.update(rollouts=told["rollouts"] - 1),
    "no rollouts": lambda _, told: told.pop("rollouts"),
    "another format": lambda _, told: told.update(format="orient-eye checkpoint 0"),
    "another seed": lambda _, told: told["settings"].update(seed=1),
    "a setting more": lambda _, told: told["settings"].update(nosuch=1),
    "a setting less": lambda _, told: told["settings"].pop("doubt"),
    "no settings": lambda _, told: told.update(settings=None),
    "negative time": lambda _, told: told["counters"].update(elapsed=-1.0),
    "time not a number": lambda _, told: told["counters"].update(elapsed=None),
    "NaN time": lambda _, told: told["counters"].update(elapsed=math.nan),
    "negative failures": lambda _, told: told["counters"].update(failed=-3),
    "an evaluation before the first": lambda _, told: told["counters"].update(evaluated=-2),
    "other columns": lambda _, told: told["counters"]["rows"][0].pop("gap_mean"),
    "words in a row": lambda _, told: told["counters"]["rows"][0].update(gap_mean="small"),
    "rows that are none": lambda _, told: told["counters"].update(rows=3),
    "a counter more": lambda _, told: told["counters"].update(nosuch=3),
    "a counter less": lambda _, told: told["counters"].pop("rewards"),
    "no generator": lambda _, told: told["generators"].pop("env"),
    "a generator of another kind": lambda _, told: told["generators"]["env"].update(bit_generator="MT19937"),
    "a negative state": lambda _, told: told["generators"]["env"]["state"].update(state=-1),
    "a state beyond 128 bits": lambda _, told: told["generators"]["buffer"]["state"].update(state=2**200),
    "half a state": lambda _, told: told["generators"]["actions"]["state"].update(state=1.5),
    "no array": lambda arrays, _: arrays.pop("policy.actor.mu.weight"),
    "an array more": lambda arrays, _: arrays.update(nosuch=np.zeros(3)),
    "another shape": lambda arrays, _: arrays.update(target=arrays["target"][:-1]),
    "moments of another shape": lambda arrays, _: arrays.update({"actor.exp_avg": arrays["actor.exp_avg"][:-1]}),
    "another type": lambda arrays, _: arrays.update(rows=arrays["rows"].astype(float)),
    "a buffer of other rows": lambda arrays, _: arrays.update(rows=arrays["rows"][:, 1:]),
    "networks that are no numbers": lambda arrays, _: arrays["policy.actor.mu.weight"].fill(np.nan),
    "a state of torch that is none": lambda arrays, _: arrays["random"].fill(255),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES.keys())
def test_what_fits_no_run_is_refused_even_with_the_right_checksum(
    change: Callable[[dict[str, Any], dict[str, Any]], object], stopped: Path, load: Load
) -> None:
    (stopped / PREVIOUS).unlink()
    content = (stopped / NAME).read_bytes()
    arrays = {name: array.copy() for name, array in safetensors.numpy.load(content).items()}
    header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])["__metadata__"]
    told = json.loads(header["orient-eye"])
    change(arrays, told)
    plain = {"orient-eye": json.dumps(told)}
    arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    (stopped / NAME).write_bytes(safetensors.numpy.save(arrays, {**plain, "sha256": digest(arrays, plain)}))
    with pytest.raises(InputError, match="cannot go on"):
        load(stopped)


def test_a_checkpoint_of_another_run_says_what_differs(made: Path, whole: Path, load: Load, tmp_path: Path) -> None:
    """Nothing is restored of it: the numbers would be those of neither."""
    settings = replace(TINY, seed=1, learning_rate=0.01).resolved()
    training.RunDirectory.create(tmp_path / "other", "train", settings, seed=1)
    shutil.copy(made / NAME, tmp_path / "other")
    with pytest.raises(InputError, match="other settings: learning_rate, seed"):
        resume(tmp_path / "other", quiet=True)


# --- kills, signals, two at once -------------------------------------------------------------------


def _train_slowly(folder: str, cache: str) -> None:
    """In a process of its own, with a checkpoint every time."""
    os.environ["XDG_CACHE_HOME"] = cache
    _shorten(pytest.MonkeyPatch())
    train(TINY, Path(folder), quiet=True, checkpoint_s=0.01)


@pytest.mark.parametrize("_", range(FAULTS))
def test_killed_at_any_moment_and_resumed_is_the_run_never_stopped(_: int, whole: Path, tmp_path: Path) -> None:
    """While it runs nobody else may train there; the lock dies with it."""
    folder, deadline = tmp_path / "run", time.monotonic() + 120
    process = faulting._SERVER.Process(target=_train_slowly, args=(str(folder), os.environ["XDG_CACHE_HOME"]))
    process.start()
    while not (folder / "metrics.csv").exists() and process.is_alive() and time.monotonic() < deadline:
        time.sleep(0.002)
    os.kill(process.pid or 0, signal.SIGSTOP)  # not to be done meanwhile
    for beside in (lambda: resume(folder, quiet=True), lambda: train(TINY, folder, quiet=True)):
        with pytest.raises(InputError, match=r"another process trains in"):
            beside()
    os.kill(process.pid or 0, signal.SIGCONT)
    time.sleep(np.random.default_rng().uniform(0, 0.5))
    process.kill()
    process.join()
    (folder / f".checkpoint-{'0' * 16}.tmp-orient-eye.safetensors").write_bytes(b"half")
    (folder / "stages" / f".000-{'0' * 16}.tmp-orient-eye.npz").write_bytes(b"half")
    if not (folder / "result.json").exists():
        resume(folder, quiet=True)
        assert_same(folder, whole)


@pytest.mark.parametrize(
    ("where", "number"),
    [
        ("training.evaluation_saccades", signal.SIGTERM),
        ("training.load_checkpoint", signal.SIGHUP),
        ("figures.draw_policy", signal.SIGINT),
        ("stages.record_stages", signal.SIGTERM),
    ],
)
def test_a_signal_before_and_after_the_loop_ends_the_run_and_it_can_go_on(
    where: str, number: signal.Signals, stopped: Path, whole: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The search of the optimum is the longest of the one, pictures and recordings of the other."""

    def pressed(*_: Any, **__: Any) -> None:
        signal.raise_signal(number)
        signal.raise_signal(number)  # while a checkpoint is loaded the first only asks
        pytest.fail("the signal did nothing")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"orient_eye.learning.{where}", pressed)
        with pytest.raises(SystemExit) as ended:
            cli.main(["train", "--resume", str(stopped), "--quiet"])
    assert ended.value.code == 128 + number
    assert f"train--resume{stopped}" in "".join(capsys.readouterr().err.split())
    assert not (stopped / "result.json").exists()
    resume(stopped, quiet=True)
    assert_same(stopped, whole)


def test_a_stop_asked_for_at_the_very_end_leaves_the_conclusion_to_the_resumed_run(
    stopped: Path, whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluate = TrainingLoop._evaluate

    def pressed(loop: TrainingLoop, n: int) -> None:
        evaluate(loop, n)
        if n == TINY.updates:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(TrainingLoop, "_evaluate", pressed)
    with pytest.raises(Interrupted) as ended:
        resume(stopped, quiet=True)
    assert ended.value.code == 130
    monkeypatch.setattr(TrainingLoop, "_evaluate", evaluate)
    resume(stopped, quiet=True)
    assert_same(stopped, whole)
    told = json.loads((stopped / "run.json").read_text())["resumed"]
    assert [(each["from"], each["updates"]) for each in told] == [(NAME, 32), (NAME, TINY.updates)]


# --- disks -----------------------------------------------------------------------------------------


def test_a_full_disk_costs_nothing_but_the_time_since_the_last_checkpoint(
    stopped: Path, whole: Path, load: Load
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, ((stopped / NAME).stat().st_size, hard))  # which grows
    try:
        with pytest.raises(InputError, match=rf"cannot write .*{NAME}.*make room"):
            resume(stopped, quiet=True, checkpoint_s=0.01)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not load(stopped).damage
    assert not list(stopped.rglob(".*"))
    resume(stopped, quiet=True)
    assert_same(stopped, whole)


def test_folders_that_cannot_be_made_or_are_taken(whole: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for out, words in ((tmp_path / "file", "file stands where"), (tmp_path / "file" / "in", "file stands where"),
                       (Path("/proc/nosuch"), "cannot write"), (whole, "not an empty folder")):  # fmt: skip
        with pytest.raises(InputError, match=words):
            train(TINY, out, quiet=True)
    for folder in (tmp_path, tmp_path / "nosuch", tmp_path / "file"):
        with pytest.raises(InputError, match="no run directory"):
            resume(folder, quiet=True)


def test_nothing_is_written_outside_the_run_and_the_cache(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And a cache that cannot be written costs a search, nothing else."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(elsewhere))
    monkeypatch.setenv("HOME", str(elsewhere))
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nosuch")
    monkeypatch.chdir(elsewhere)
    train(TINY, tmp_path / "run", quiet=True)
    assert not list(elsewhere.iterdir())
    assert_same(tmp_path / "run", whole)
