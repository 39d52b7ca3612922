"""Training runs: what they leave, that they can be stopped, killed and resumed to the same numbers."""

import json
import math
import signal
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy
import torch

from orient_eye import rotations
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.learning.checkpoint import NAME
from orient_eye.learning.config import TrainConfig, TrainSettings
from orient_eye.learning.loop import StopRequest, TrainingLoop
from orient_eye.learning.policy import Policy
from orient_eye.learning.training import Interrupted, resume, train
from orient_eye.plants import make_plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.uncertain import uncertain
from orient_eye.search.optimum import Optimum
from orient_eye.state import State
from orient_eye.surrogate import Surrogate
from orient_eye.task.judge import JUDGES
from orient_eye.task.saccade import Outcome, SaccadeTask

TINY = TrainConfig(updates=60, saccades_per_update=16, warmup=64, batch_size=64, evaluation_pairs=4)


pytestmark = pytest.mark.usefixtures("private_cache")


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "tiny"
    train(TINY, folder, quiet=True)
    return folder


def _numbers(folder: Path) -> dict[str, np.ndarray]:
    return safetensors.numpy.load_file(folder / "policy.safetensors")


def _metrics(folder: Path) -> list[str]:
    """Rows of metrics.csv without the wall clock."""
    rows = [line.split(",") for line in (folder / "metrics.csv").read_text().splitlines()]
    clock = rows[0].index("elapsed_s")
    return [",".join(row[:clock] + row[clock + 1 :]) for row in rows]


def test_a_run_explains_itself(tiny: Path) -> None:
    description = json.loads((tiny / "run.json").read_text())
    assert description["config"]["updates"] == 60
    assert None not in [v for k, v in description["config"].items() if k != "task"]
    assert description["seed"] == 0
    assert "mujoco" in description["versions"]
    result = json.loads((tiny / "result.json").read_text())
    assert [row["amplitude_deg"] for row in result["table"]] == [5, 10, 20, 30, 45, 60]
    assert [number["key"] for number in result["numbers"]] == ["B", "step_deg", "k0"]
    assert 0 <= result["gap_mean"] < 5
    where = {result["weights_from"], description["config"]["weights_from"], Policy.load(tiny).manifest["weights_from"]}
    assert len(where) == 1
    assert "thesis 4.4.5" in where.pop()
    for name in (
        "policy.safetensors",
        "README.md",
        "metrics.csv",
        "learning.png",
        "policy.png",
        "recording.rrd",
    ):
        assert (tiny / name).stat().st_size > 0
    assert len(list((tiny / "stages").glob("*.npz"))) == 5


@pytest.mark.slow
@pytest.mark.usefixtures("plain")
def test_training_learns(tmp_path: Path) -> None:
    """A third of the usual updates come within a few per cent of the searched optimum."""
    result = train(TrainConfig(updates=3000, evaluation_pairs=60), tmp_path / "run", quiet=True)
    assert 0 <= result["gap_mean"] < 0.06


def test_policy_file_acts_as_the_trained_network(tiny: Path) -> None:
    policy = Policy.load(tiny)
    table = json.loads((tiny / "result.json").read_text())["table"]
    half = np.array([row["amplitude_deg"] for row in table]) / 2
    action = policy.act(rotations.from_yaw(-half), rotations.from_yaw(half))
    np.testing.assert_allclose(action[:, 0], [row["B"] for row in table])
    F = -half / 1.4758  # where the motor of the thesis' surrogate stands at the start
    np.testing.assert_allclose(action[:, 1] - F, [row["step_deg"] for row in table])


@pytest.mark.usefixtures("plain")
def test_same_seed_same_numbers_other_seed_others(tiny: Path, tmp_path: Path) -> None:
    train(TINY, tmp_path / "again", quiet=True)
    for name, array in _numbers(tiny).items():
        np.testing.assert_array_equal(_numbers(tmp_path / "again")[name], array)
    assert _metrics(tmp_path / "again") == _metrics(tiny)
    train(TrainConfig(**{**TINY.__dict__, "seed": 1}), tmp_path / "other", quiet=True)
    assert not np.array_equal(_numbers(tmp_path / "other")["weight0"], _numbers(tiny)["weight0"])


def test_saccades_and_first_actions_come_from_streams_of_their_own(tiny: Path) -> None:
    """Streams of one seed used twice would be the same numbers: as yaw of the start and as action."""
    rows = safetensors.numpy.load_file(tiny / NAME)["rows"][: TINY.warmup].astype(float)
    yaw = np.rad2deg(2 * np.arcsin(rows[:, 3]))  # of the start's quaternion (w, x, y, z)
    starts, actions = (yaw + 35) / 70, (rows[:, 8:11].ravel() + 1) / 2
    assert (starts.min(), starts.max()) == pytest.approx((0, 1), abs=0.1)  # the warmup covers the range
    alike = np.abs(starts[:, None] - actions).min(axis=1) < 1e-5
    assert alike.mean() < 0.1
    other = SaccadeVecEnv(16, seed=0).batch.start
    assert other is not None
    assert not np.allclose(yaw[:16], rotations.to_euler(other.orientation)[0], atol=1e-3)


@pytest.mark.usefixtures("plain")
def test_stopped_and_resumed_under_the_automatic_temperature_is_the_run_never_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What that rule has learned goes on too; tests/test_checkpoint.py stops trainings in other ways."""
    config = replace(TINY, temperature="auto")
    train(config, tmp_path / "whole", quiet=True)
    evaluate = TrainingLoop._evaluate

    def pressed(loop: TrainingLoop, n: int) -> None:
        evaluate(loop, n)
        if n == 32 and loop.done_before == 0:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(TrainingLoop, "_evaluate", pressed)
    with pytest.raises(Interrupted, match="train --resume"):
        train(config, tmp_path / "stopped", quiet=True)
    resume(tmp_path / "stopped", quiet=True)
    for name, array in _numbers(tmp_path / "whole").items():
        np.testing.assert_array_equal(_numbers(tmp_path / "stopped")[name], array)
    assert _metrics(tmp_path / "stopped") == _metrics(tmp_path / "whole")


@pytest.mark.usefixtures("plain")
def test_killed_before_the_first_checkpoint_a_run_begins_again(tiny: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "run.json").write_bytes((tiny / "run.json").read_bytes())
    resume(folder, quiet=True)
    assert _metrics(folder) == _metrics(tiny)
    for name, array in _numbers(tiny).items():
        np.testing.assert_array_equal(_numbers(folder)[name], array)


@pytest.mark.usefixtures("plain")
def test_every_number_of_updates_has_its_last_evaluation(tmp_path: Path) -> None:
    train(replace(TINY, updates=103), tmp_path / "run", quiet=True)
    assert _metrics(tmp_path / "run")[-1].startswith("103,")
    assert {file.stem for file in (tmp_path / "run" / "stages").glob("*.npz")} == {"000", "010", "025", "050", "100"}


@pytest.mark.usefixtures("plain")
def test_a_training_that_diverges_says_so_at_its_end_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rewards beyond float32 make the networks' numbers infinite; here all updates follow one rollout."""
    monkeypatch.setattr(SaccadeTask, "perform", _huge)
    config = replace(TINY, reward_scale="raw")
    for name, updates, rollout in (("within", 60, 4), ("end", 8, 8)):
        with pytest.raises(InputError, match=r"diverged at update .* smaller learning rate"):
            train(replace(config, updates=updates, updates_per_rollout=rollout), tmp_path / name, quiet=True)
        assert not (tmp_path / name / "policy.safetensors").exists()


_PERFORM = SaccadeTask.perform


def _huge(task: SaccadeTask, *saccades: Any) -> Outcome:
    outcome = _PERFORM(task, *saccades)
    return replace(outcome, reward=replace(outcome.reward, total=1e40 * outcome.reward.total))


@pytest.mark.usefixtures("plain")
def test_failed_saccades_stop_nothing_and_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every third saccade of the training comes out as not a number."""
    perform = SaccadeTask.perform

    def failing(task: SaccadeTask, start: State, action: np.ndarray, target: np.ndarray, *random: Any) -> Outcome:
        outcome = perform(task, start, action, target, *random)
        if len(action) != 64:
            return outcome  # of the evaluation
        measures = replace(outcome.measures, failed=np.arange(len(action)) % 3 == 0)
        worst = JUDGES[task.judge].reward(outcome.movement, measures, target, task.weights)
        return replace(outcome, measures=measures, reward=worst)

    monkeypatch.setattr(SaccadeTask, "perform", failing)
    result = train(TINY, tmp_path / "run", quiet=True)
    rollouts = TINY.warmup // 64 + 60 // 4  # of 64 saccades, for four updates each: 8 do not divide the 60
    assert result["failed_saccades"] == 22 * rollouts
    assert _metrics(tmp_path / "run")[-1].endswith(f",{result['failed_saccades']}")


@pytest.mark.usefixtures("plain")
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
    for wrong, words in (
        ({"updates": 0}, "updates must be a whole number from 1 to .*, got 0"),
        ({"updates": 2.5}, "updates must be a whole number"),
        ({"updates": 10**12}, "updates must be"),
        ({"updates_per_rollout": 7}, "updates per rollout must be a number that divides the 60 updates, got 7"),
        ({"updates_per_rollout": 60, "saccades_per_update": 10**4}, "updates per rollout x saccades per update"),
        ({"batch_size": 10**13}, "batch size must be a whole number from 1 to 100000, got 10000000000000"),
        ({"batch_size": True}, "batch size"),
        ({"replay_size": 10**12}, "replay size"),
        ({"warmup": -1}, "warmup"),
        ({"evaluation_pairs": 10**6}, "evaluation pairs"),
        ({"learning_rate": -1.0}, "learning rate must be a number from 1e-12 to 1, got -1"),
        ({"learning_rate": 1e30}, "learning rate"),
        ({"learning_rate": math.inf}, "learning rate"),
        ({"learning_rate": math.nan}, "learning rate"),
        ({"second_moment": 1.0}, "second moment"),
        ({"temperature": (0.0, 1.0)}, "temperature must be a number from 1e-12"),
        ({"temperature": (math.nan, 1.0)}, "temperature"),
        ({"temperature": "warm"}, "temperature must be 'auto', or a first and a last one, got 'warm'"),
        ({"temperature": (1.0,)}, "temperature"),
        ({"last_learning_rate": 2.0}, "last learning rate must be a number from 0 to 1, got 2"),
        ({"doubt": math.nan}, "doubt"),
        ({"reward_scale": "sqrt"}, "log or raw"),
        ({"preset": "mine"}, "unknown preset"),
        ({"seed": -1}, "seed"),
        ({"seed": 10**30}, "seed"),
        ({"device": "cudas"}, "device must be"),
        ({"plant": "clay"}, "unknown plant 'clay'"),
        ({"plant_options": {"surrogate": "nosuch"}}, "nosuch"),
        ({"plant_options": {"eye": "eve_v3"}}, "its options are surrogate"),
        ({"case": "9"}, "unknown case"),
        ({"targets": "nowhere"}, "unknown target"),
        ({"driven": ("motor9",)}, "motor9"),
        ({"weights": (1.0, 2.0)}, "4 weights"),
        ({"weights": (0.0, 0.0, 0.0, 0.0)}, "not all 0"),
        ({"band": 7.0}, "band"),
        ({"horizon_s": -1.0}, "horizon"),
    ):
        with pytest.raises(InputError, match=words) as error:
            train(replace(TINY, **wrong), tmp_path / "bad", quiet=True)
        assert "--" not in str(error.value)  # options of the command line are the command line's business
    for interval in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="between checkpoints"):
            train(TINY, tmp_path / "bad", quiet=True, checkpoint_s=interval)
        with pytest.raises(InputError, match="between checkpoints"):
            resume(tiny, quiet=True, checkpoint_s=interval)
    assert not (tmp_path / "bad").exists()


def test_trains_on_the_whole_eye(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = TrainConfig(plant="mujoco", updates=3, saccades_per_update=4, warmup=8, batch_size=16, evaluation_pairs=1)
    # The search on this plant takes minutes: something stands in for it here.
    monkeypatch.setattr("orient_eye.learning.evaluation.searched_optimum", _no_search)
    result = train(config, tmp_path / "run", quiet=True)
    assert result["plant"] == "mujoco"
    assert Policy.load(tmp_path / "run").manifest["task"]["plant"] == make_plant("mujoco").identity()


def test_preset_of_the_thesis_and_options_beside_it() -> None:
    config = TrainConfig(preset="thesis", batch_size=512).resolved()
    assert (config.learning_rate, config.replay_size, config.updates) == (1e-5, 30_000, 300_000)  # thesis 4.6
    assert config.batch_size == 512
    assert config.temperature == "auto"
    assert TrainConfig(plant="mujoco").resolved().evaluation_pairs == 60


def test_device_that_is_not_there() -> None:

    wrong = "fpga" if torch.cuda.is_available() else "cuda"
    with pytest.raises(InputError, match=f"device .*{wrong}"):
        TrainConfig(device=wrong).resolved()


def test_settings_come_back_from_json_and_describe_the_same_task() -> None:
    config = TrainConfig(
        case="2-varying",
        speed_limit=5000.0,
        band=0.02,
        weights={"accuracy": 1, "energy": 2, "duration": 3, "overshoot": 4},
    )
    settings = config.resolved()
    again = TrainSettings.from_plain(json.loads(json.dumps(asdict(settings))))
    assert again == settings
    assert again.make_task().identity() == config.make_task().identity()
    assert again.make_task().weights_from == "given"
    assert TrainConfig(weights=(1.0, 2.0, 3.0, 4.0)).resolved().task["weights"] == settings.task["weights"]


def test_other_targets_and_motors_are_learned_too(tmp_path: Path) -> None:
    """Vertical saccades by whatever motors turn this eye in pitch: nothing here is horizontal or of one motor."""
    from orient_eye.learning import figures

    config = TrainConfig(
        plant="tavares",
        targets="vertical",
        weights=(3e7, 1.0, 5e5, 2e8),
        updates=2,
        saccades_per_update=2,
        warmup=4,
        batch_size=4,
    )
    task = config.make_task()
    assert len(task.actions.numbers) == 3 * len(task.actions.driven)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("orient_eye.learning.evaluation.searched_optimum", _no_search)
        result = train(replace(config, evaluation_pairs=1), tmp_path / "run", quiet=True)
        policy = Policy.load(tmp_path / "run")
        assert policy.act(rotations.FORWARD[None], rotations.FORWARD[None]).shape == (1, len(task.actions.numbers))
        assert set(result["distance_from_optimum_above_5_deg"]) == set(task.actions.names)
        assert all(f"{number['key']}_best" in result["table"][0] for number in result["numbers"])
        figures.figure_5_2(policy, task)
        figures.figure_5_3(policy, task)


def _no_search(task: SaccadeTask, start: State, target: np.ndarray, **_: object) -> Optimum:
    """The middle of the ranges, as if it were the best action."""
    action = task.actions.from_unit(np.zeros((len(target), len(task.actions.numbers))))
    return Optimum(action, task.perform(start, action, target).reward.total, 0)


def test_a_stop_is_asked_for_by_the_first_signal_and_forced_by_the_second() -> None:
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    with StopRequest() as request:
        assert request.signal is None
        signal.raise_signal(signal.SIGTERM)
        assert request.signal == signal.SIGTERM
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert before == {number: signal.getsignal(number) for number in before}


# --- rigs ------------------------------------------------------------------------------------------

INTERVALS = {"K": (1.8, 2.0), "wn": (10.5, 13.5), "zeta": (0.75, 1.25), "dead_time": (-0.002, 0.014)}
RIG = Surrogate(
    1.9, wn=12.0, zeta=0.9, dead_time=0.008, motor="servo", axis="pitch", range=(-60, 60), speed_limit=350.0,
    intervals=INTERVALS,
)  # fmt: skip


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> TrainConfig:
    file = RIG.save(tmp_path_factory.mktemp("rig") / "surrogate.json")
    return replace(TINY, updates=20, plant_options={"surrogate": str(file)})


@pytest.mark.usefixtures("plain")
def test_a_rig_says_what_it_is_trained_on(rig: TrainConfig, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Axis, bounds and weights follow from the plant; they are printed, stored, and held against the thesis'."""
    from orient_eye.cli.train import Train

    Train(replace(rig, end_point_error_deg=0.5), out=tmp_path / "run", quiet=True).run()
    said = " ".join(capsys.readouterr().err.split())
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    task = Policy.load(tmp_path / "run").task()
    assert task.targets.name == "vertical"
    assert result["weights"] == dict(task.weights)
    ends = np.array([result["bounds"][name] for name in ("B", "D", "k0")])
    assert np.array_equal(ends, np.stack([task.actions.low, task.actions.high], axis=1))
    assert "actions: B from 4.8 to 300 1/s" in said
    assert "by rule (docs/weights.md)" in said
    assert "20 updates are performed 4 at a time; a multiple of 8 is quicker" in said
    assert "the thesis' eye has B from 18 to 80 1/s, k0 from 5 to 40 1/s" in said


def test_the_error_one_can_live_with_sets_the_weight(rig: TrainConfig) -> None:
    fine, usual, coarse = (replace(rig, end_point_error_deg=error).make_task().weights for error in (0.125, 0.25, 1.0))
    assert rig.make_task().weights == usual
    assert fine["accuracy"] > 1.9 * usual["accuracy"] > 3 * coarse["accuracy"]
    assert fine["duration"] == usual["duration"] == coarse["duration"]
    thesis = TrainConfig(end_point_error_deg=0.25).make_task()
    assert thesis.weights_from.startswith("by rule")
    with pytest.raises(InputError, match="both set"):
        replace(rig, weights=(1.0, 1.0, 1.0, 1.0), end_point_error_deg=0.25).make_task()
    with pytest.raises(InputError, match="positive, got 0"):
        replace(rig, end_point_error_deg=0.0).make_task()


def test_each_saccade_has_an_eye_of_its_own() -> None:
    """A batch of eyes against one plant for each of them, limited and not."""
    plant = uncertain(LinearPlant(RIG))
    task = SaccadeTask.of_case(plant)
    start, target = task.targets.draw(12, np.random.default_rng(1))
    action = task.actions.from_unit(np.random.default_rng(2).uniform(-1, 1, (12, 3)))
    action[:, 1] = task.actions.likely(target)[:, 1]
    action[::3, [0, 2]] = 12.0, 14.0  # gentle: the motor follows the small ones of these
    command = task.actions.command(start, target, action)
    movement = plant.move(command, start, task.horizon_s, np.random.default_rng(3))
    numbers = plant.draw(12, np.random.default_rng(3))
    measures = movement.measure()
    assert 0 < movement.limited.sum() < 12
    assert len(set(numbers.K)) == 12
    for i in range(12):
        wn = np.sqrt(numbers.poles[0][i] * numbers.poles[1][i]).real
        zeta = (numbers.poles[0][i] + numbers.poles[1][i]).real / (2 * wn)
        one = replace(RIG, K=numbers.K[i], wn=wn, zeta=zeta, dead_time=numbers.dead_time[i])
        alone = LinearPlant(one).move(command[np.arange(12) == i], None, task.horizon_s)
        for name in ("settling_time_s", "overshoot", "peak_velocity_deg_s", "final"):
            assert getattr(measures, name)[i] == pytest.approx(getattr(alone.measure(), name)[0], rel=1e-6, abs=1e-9)
        assert movement.energy()[i] == pytest.approx(alone.energy()[0], rel=1e-12)
        assert movement.trajectory().orientation[i] == pytest.approx(alone.trajectory().orientation[0], abs=1e-5)
    nominal = plant.move(command, start, task.horizon_s).measure()
    assert nominal.settling_time_s == pytest.approx(LinearPlant(RIG).move(command, start).measure().settling_time_s)


@pytest.mark.usefixtures("plain")
def test_robust_training(rig: TrainConfig, tmp_path: Path) -> None:
    """Seeded, other than without, and it says what it costs; resumed it ends in the same numbers."""
    robust = replace(rig, robust=True)
    results = [train(c, tmp_path / name, quiet=True) for c, name in ((robust, "a"), (robust, "b"), (rig, "c"))]
    a, b, c = (_numbers(tmp_path / name) for name in "abc")
    assert all(np.array_equal(a[name], b[name]) for name in a)
    assert any(not np.array_equal(a[name], c[name]) for name in a)
    told = results[0]["robust"]
    assert told["intervals"]["dead_time"] == (0.0, 0.014)
    assert told["policy"] == results[1]["robust"]["policy"]
    # K is off by 5 % at most, so the best actions for the nominal plant land 5 % off of 35 deg or so.
    assert 0.3 < told["best_of_nominal"]["error_deg_worst"] < 2.5
    assert told["best_of_nominal"]["overshoot_worst"] > told["best_of_nominal"]["overshoot_mean"] > 0
    assert "robust" not in results[2]
    settings = TrainSettings.from_plain(json.loads((tmp_path / "a" / "run.json").read_text())["config"])
    assert settings == TrainSettings.from_plain(asdict(robust.resolved()))
    assert Policy.load(tmp_path / "a").task().plant.identity() == LinearPlant(RIG).identity()


def test_nothing_is_robust_to_what_is_not_known(rig: TrainConfig, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no intervals"):
        replace(TINY, robust=True).resolved()
    with pytest.raises(InputError, match="plant 'mujoco' has no identified intervals"):
        replace(TINY, plant="mujoco", robust=True).resolved()
    for ends in ((0.0, 1.0), (-1.0, 3.0)):
        bad = replace(RIG, intervals={**INTERVALS, "zeta": ends}).save(tmp_path / "bad.json")
        with pytest.raises(InputError, match="recordings do not tell it"):
            replace(rig, plant_options={"surrogate": str(bad)}, robust=True).resolved()
    with pytest.raises(InputError, match=r"are of K, wn, zeta, dead_time, got w0"):
        uncertain(LinearPlant(RIG), {"w0": (1.0, 2.0)})
