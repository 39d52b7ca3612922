"""Training runs: what they leave, that they can be stopped, killed and resumed to the same numbers."""

import json
import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from orient_eye.cli.train import Train
from orient_eye.environments.saccade_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.loop import TrainingLoop
from orient_eye.learning.policy import Policy
from orient_eye.learning.training import resume, train
from orient_eye.plants import make_plant
from orient_eye.task.reward import reward
from orient_eye.task.saccade import Fixation, Outcome, SaccadeTask, horizontal

TINY = TrainConfig(updates=60, saccades_per_update=16, warmup=64, batch_size=64, evaluation_pairs=4)


@pytest.fixture(autouse=True, scope="module")
def _private_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "tiny"
    train(TINY, folder, quiet=True)
    return folder


def _numbers(folder: Path) -> dict[str, np.ndarray]:
    with np.load(folder / "policy.npz") as file:
        return dict(file)


def _metrics(folder: Path) -> list[str]:
    """Rows of metrics.csv without the wall clock."""
    rows = [line.split(",") for line in (folder / "metrics.csv").read_text().splitlines()]
    clock = rows[0].index("elapsed_s")
    return [",".join(row[:clock] + row[clock + 1 :]) for row in rows]


def test_a_run_explains_itself(tiny: Path) -> None:
    description = json.loads((tiny / "run.json").read_text())
    assert description["config"]["updates"] == 60
    assert description["seed"] == 0
    assert "mujoco" in description["versions"]
    result = json.loads((tiny / "result.json").read_text())
    assert [row["amplitude_deg"] for row in result["table"]] == [5, 10, 20, 30, 45, 60]
    assert 0 <= result["gap_mean"] < 100
    for name in (
        "policy.npz",
        "policy.json",
        "metrics.csv",
        "learning.png",
        "policy.png",
        "recording.rrd",
        "surrogate.json",
    ):
        assert (tiny / name).stat().st_size > 0
    assert len(list((tiny / "stages").glob("*.npz"))) == 5


def test_policy_file_acts_as_the_trained_network(tiny: Path) -> None:
    policy = Policy.load(tiny)
    table = json.loads((tiny / "result.json").read_text())["table"]
    half = np.array([row["amplitude_deg"] for row in table]) / 2
    action = policy.act(horizontal(-half), horizontal(half))
    np.testing.assert_allclose(action[:, 0, 0], [row["B"] for row in table])


def test_same_seed_same_numbers_other_seed_others(tiny: Path, tmp_path: Path) -> None:
    train(TINY, tmp_path / "again", quiet=True)
    for name, array in _numbers(tiny).items():
        np.testing.assert_array_equal(_numbers(tmp_path / "again")[name], array)
    assert _metrics(tmp_path / "again") == _metrics(tiny)
    train(TrainConfig(**{**TINY.__dict__, "seed": 1}), tmp_path / "other", quiet=True)
    assert not np.array_equal(_numbers(tmp_path / "other")["weight0"], _numbers(tiny)["weight0"])


def test_saccades_and_first_actions_come_from_streams_of_their_own(tiny: Path) -> None:
    """Streams of one seed used twice would be the same numbers: as yaw of the start and as action."""
    rows = torch.load(tiny / "checkpoint.pt", weights_only=True)["rows"][: TINY.warmup].double().numpy()
    yaw = np.rad2deg(2 * np.arcsin(rows[:, 3]))  # of the start's quaternion (w, x, y, z)
    starts, actions = (yaw + 35) / 70, (rows[:, 8:11].ravel() + 1) / 2
    assert (starts.min(), starts.max()) == pytest.approx((0, 1), abs=0.1)  # the warmup covers the range
    alike = np.abs(starts[:, None] - actions).min(axis=1) < 1e-5
    assert alike.mean() < 0.1
    other, _ = SaccadeVecEnv(16, seed=0).yaw_deg
    assert not np.allclose(yaw[:16], other, atol=1e-3)


def _command(folder: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "orient_eye", "train", "--quiet", "--out", str(folder), *options]


@pytest.mark.parametrize(("how", "temperature"), [(signal.SIGKILL, "auto"), (signal.SIGINT, "1 0.01")])
def test_killed_and_resumed_is_the_run_never_stopped(how: signal.Signals, temperature: str, tmp_path: Path) -> None:
    options = ["--updates", "400", "--saccades-per-update", "16", "--batch-size", "64", "--evaluation-pairs", "4"]
    options += ["--temperature", *temperature.split()]
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    process = subprocess.Popen(_command(stopped, *options, "--checkpoint-every", "0.2"), stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not (stopped / "checkpoint.pt").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.3)
    process.send_signal(how)
    code = process.wait(60)
    assert code == (-9 if how == signal.SIGKILL else 130)
    assert not (stopped / "result.json").exists()
    resume(stopped, quiet=True)
    subprocess.run(_command(whole, *options), check=True, stderr=subprocess.DEVNULL)
    for name, array in _numbers(whole).items():
        np.testing.assert_array_equal(_numbers(stopped)[name], array)
    assert _metrics(stopped) == _metrics(whole)


def test_half_a_checkpoint_is_not_taken_for_a_whole_one(tiny: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("run.json", "surrogate.json"):
        (folder / name).write_bytes((tiny / name).read_bytes())
    whole = (tiny / "checkpoint.pt").read_bytes()
    (folder / "checkpoint.pt").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="does not fit"):
        resume(folder, quiet=True)
    (folder / "checkpoint.pt").write_bytes(b"")  # as a loss of power leaves it
    with pytest.raises(InputError, match="cannot be read"):
        resume(folder, quiet=True)


def test_killed_before_the_first_checkpoint_a_run_begins_again(tiny: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "run.json").write_bytes((tiny / "run.json").read_bytes())
    resume(folder, quiet=True)
    assert _metrics(folder) == _metrics(tiny)
    for name, array in _numbers(tiny).items():
        np.testing.assert_array_equal(_numbers(folder)[name], array)


def test_every_number_of_updates_has_its_last_evaluation(tmp_path: Path) -> None:
    train(replace(TINY, updates=103), tmp_path / "run", quiet=True)
    assert _metrics(tmp_path / "run")[-1].startswith("103,")
    assert {file.stem for file in (tmp_path / "run" / "stages").glob("*.npz")} == {"000", "010", "025", "050", "100"}


def test_stop_asked_for_at_the_very_end_lets_the_run_finish(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    finish = TrainingLoop.finish

    def pressed(loop: TrainingLoop) -> None:
        loop.ctrl_c.pressed = True
        finish(loop)

    monkeypatch.setattr(TrainingLoop, "finish", pressed)
    assert train(TINY, tmp_path / "run", quiet=True)["updates"] == 60


def test_a_training_that_diverges_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"diverged at update .* smaller --learning-rate"):
        train(replace(TINY, learning_rate=1e30), tmp_path / "run", quiet=True)


def test_failed_saccades_stop_nothing_and_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every third saccade of the training comes out as not a number."""
    perform = SaccadeTask.perform

    def failing(task: SaccadeTask, start: Fixation, action: np.ndarray, target: np.ndarray) -> Outcome:
        outcome = perform(task, start, action, target)
        if len(action) != TINY.saccades_per_update:
            return outcome  # of the evaluation
        measures = replace(outcome.measures, failed=np.arange(len(action)) % 3 == 0)
        worst = reward(measures, outcome.command.energy(), target, task.weights)
        return replace(outcome, measures=measures, reward=worst)

    monkeypatch.setattr(SaccadeTask, "perform", failing)
    result = Train(TINY, out=tmp_path / "run", quiet=True).run()
    assert result["failed_saccades"] == 6 * (TINY.warmup // 16 + 60)
    assert _metrics(tmp_path / "run")[-1].endswith(f",{result['failed_saccades']}")
    assert f"{result['failed_saccades']} simulated saccades failed" in capsys.readouterr().err


def test_resume_refuses_what_is_no_run_of_this_version(tiny: Path, tmp_path: Path) -> None:
    description = json.loads((tiny / "run.json").read_text())
    other = {**description, "config": {**description["config"], "nosuch": 1}}
    for content, message in ((other, "not of this version"), ([], "not of train"), ({"command": "sysid"}, "sysid")):
        (tmp_path / "run.json").write_text(json.dumps(content))
        with pytest.raises(InputError, match=message):
            resume(tmp_path, quiet=True)
    (tmp_path / "run.json").write_text(json.dumps({**description, "versions": {"torch": "1.0"}}))
    with pytest.warns(UserWarning, match=r"torch.*1\.0"):
        resume(tmp_path, quiet=True)


def test_refusals_leave_nothing_behind(tiny: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not an empty folder"):
        train(TINY, tiny, quiet=True)
    with pytest.raises(InputError, match="finished"):
        resume(tiny, quiet=True)
    with pytest.raises(InputError, match="no run directory"):
        resume(tmp_path, quiet=True)
    for wrong in (
        {"updates": 0},
        {"learning_rate": -1.0},
        {"temperature": (0.0, 1.0)},
        {"seed": -1},
        {"surrogate": "nosuch"},
        {"eye": "eve_v3"},  # does nothing on lpf
        {"learning_rate": math.inf},
        {"last_learning_rate": 2.0},
        {"device": "cudas"},
    ):
        with pytest.raises(InputError):
            train(TrainConfig(**{**TINY.__dict__, **wrong}), tmp_path / "bad", quiet=True)
    assert not (tmp_path / "bad").exists()


def test_trains_on_the_whole_eye(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = TrainConfig(plant="mujoco", updates=3, saccades_per_update=4, warmup=8, batch_size=16, evaluation_pairs=1)
    # The search on this plant takes minutes: a short one stands in for it here.
    from orient_eye.learning import evaluation
    from orient_eye.search.optimum import find_optimum

    def short(task: SaccadeTask, start: np.ndarray, target: np.ndarray, **_: object) -> object:
        random = np.random.default_rng(0)
        return find_optimum(
            task, task.fixate(horizontal(start)), horizontal(target), random, population=12, generations=2
        )

    monkeypatch.setattr(evaluation, "searched_optimum", short)
    result = train(config, tmp_path / "run", quiet=True)
    assert result["plant"] == "mujoco"
    manifest = json.loads((tmp_path / "run" / "policy.json").read_text())
    assert manifest["task"]["plant"] == make_plant("mujoco").identity()


def test_preset_of_the_thesis_and_options_beside_it() -> None:
    config = TrainConfig(preset="thesis", batch_size=512).resolved()
    assert (config.learning_rate, config.replay_size, config.updates) == (1e-5, 30_000, 300_000)  # thesis 4.6
    assert config.batch_size == 512
    assert config.temperature == "auto"
    assert TrainConfig(plant="mujoco").resolved().saccades_per_update == 32


def test_device_that_is_not_there() -> None:
    import torch

    wrong = "fpga" if torch.cuda.is_available() else "cuda"
    with pytest.raises(InputError, match=f"--device .*{wrong}"):
        TrainConfig(device=wrong).resolved()
