"""Training that begins with a policy: the same at first, it waits for its Q, and what does not fit is refused."""

import csv
import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from orient_eye.environments.batch import observe
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.learning import evaluation, figures, stages
from orient_eye.learning.config import FINE_TUNING, TrainConfig
from orient_eye.learning.policy import Policy
from orient_eye.learning.sac import OneStepSAC
from orient_eye.learning.training import train
from orient_eye.plants import make_plant
from orient_eye.rotations import FORWARD, from_yaw
from orient_eye.search import optimum
from test_sac import make_model

Array = NDArray[np.float64]
TINY = TrainConfig(
    plant="modal", targets="gaze", updates=16, saccades_per_update=16, warmup=128, batch_size=64, evaluation_pairs=2
)

pytestmark = pytest.mark.usefixtures("private_cache")


@pytest.fixture(scope="module", autouse=True)
def short_search() -> Iterator[None]:
    """Neither optimum nor pictures matter here, so that little is spent on them; and the eye is compiled already."""
    make_plant("tavares")
    with pytest.MonkeyPatch.context() as patch:
        for drawn in ("draw_learning", "draw_policy"):
            patch.setattr(figures, drawn, lambda *_: None)
        patch.setattr(stages, "record_stages", lambda *_: None)
        patch.setattr(optimum, "_GENERATIONS", ((2, 4, 1.0), (1, 4, 0.3)))
        patch.setattr(evaluation, "TABLE_IN_ALL_DIRECTIONS", ((10.0, 30.0), (0.0, 45.0)))
        yield


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "first"
    train(TINY, folder, quiet=True)
    return folder


def metrics(folder: Path) -> list[dict[str, str]]:
    with (folder / "metrics.csv").open() as file:
        return list(csv.DictReader(file))


# --- the algorithm ----------------------------------------------------------------------------------------


@pytest.fixture
def env() -> SaccadeVecEnv:
    return SaccadeVecEnv(16, "lpf", log_reward=True, seed=0)


def layers(random: np.random.Generator) -> tuple[list[Array], list[Array]]:
    """Of a network of the size of `make_model`'s."""
    sizes = (6, 16, 8, 3)
    weights = [random.normal(size=pair) / np.sqrt(pair[0]) for pair in pairwise(sizes)]
    return weights, [random.normal(size=size) * 0.1 for size in sizes[1:]]


def acts(model: OneStepSAC, start: Array, target: Array) -> Array:
    return np.asarray(model.predict(observe(start, target), deterministic=True)[0])


def test_a_model_acts_as_the_policy_it_begins_with(env: SaccadeVecEnv) -> None:
    weights, biases = layers(np.random.default_rng(0))
    model = make_model(env)
    model.begin_with(weights, biases, 0.1)
    unit = np.ones(3)
    policy = Policy(tuple(weights), tuple(biases), -unit, unit, np.zeros(3, bool), {})
    start, target = from_yaw(np.linspace(-30, 30, 20)), from_yaw(np.linspace(35, -35, 20))
    np.testing.assert_allclose(acts(model, start, target), policy.act(start, target), atol=2e-6)


def test_its_actions_spread_as_told(env: SaccadeVecEnv) -> None:
    weights, biases = layers(np.random.default_rng(0))
    model = make_model(env)
    model.begin_with(weights, biases, 0.1)
    torch.manual_seed(0)
    seen = np.repeat(observe(FORWARD[None], from_yaw([10.0])), 4000, axis=0)
    drawn = np.arctanh(np.asarray(model.predict(seen, deterministic=False)[0], dtype=float))
    assert drawn.std(axis=0) == pytest.approx([0.1] * 3, rel=0.05)
    mean = np.arctanh(acts(model, FORWARD[None], from_yaw([10.0]))[0].astype(float))
    assert drawn.mean(axis=0) == pytest.approx(mean, abs=0.01)


def test_the_policy_waits_while_q_learns(env: SaccadeVecEnv) -> None:
    """An untrained Q would spoil it; after that both learn, in one stroke of updates too."""
    weights, biases = layers(np.random.default_rng(0))
    model = make_model(env, policy_waits=5)
    model.begin_with(weights, biases, 0.1)
    start, target = from_yaw(np.linspace(-30, 30, 20)), from_yaw(np.linspace(35, -35, 20))
    before, q_before = acts(model, start, target), model.critic.optimizer.param_groups[0]["params"][0].clone()
    model.learn(32 + 16 * 4)  # the warm-up, then four updates or five
    assert 0 < model._n_updates <= 5
    np.testing.assert_array_equal(acts(model, start, target), before)
    assert not torch.equal(model.critic.optimizer.param_groups[0]["params"][0], q_before)
    model.train(gradient_steps=8, batch_size=64)
    assert model._n_updates > 5
    assert np.abs(acts(model, start, target) - before).max() > 1e-4


def test_layers_of_another_shape_are_refused(env: SaccadeVecEnv) -> None:
    weights, biases = layers(np.random.default_rng(0))
    model = make_model(env)
    before = acts(model, FORWARD[None], from_yaw([10.0]))
    with pytest.raises(InputError, match=r"the policy to begin with has layers \[\(6, 16\), \(16, 8\)\], not"):
        model.begin_with(weights[:2], biases[:2], 0.1)
    np.testing.assert_array_equal(acts(model, FORWARD[None], from_yaw([10.0])), before)


# --- runs -------------------------------------------------------------------------------------------------


def test_a_run_of_gaze_saccades_explains_itself(first: Path) -> None:
    result = json.loads((first / "result.json").read_text())
    config = json.loads((first / "run.json").read_text())["config"]
    assert config["origin"] == ""
    assert config["doubt"] == 1e-3
    assert config["temperature"] == [0.02, 3e-4]
    assert len(result["bounds"]) == 9
    assert {round(row["amplitude_deg"]) for row in result["table"]} == {10, 30}
    policy = Policy.load(first)
    assert policy.task().identity() == config["task"]
    assert policy.manifest["numbers"][1] == {"name": "D_shift_motor1", "unit": "deg"}
    assert (first / "optimum.safetensors").stat().st_size > 0
    assert len(metrics(first)) > 1


@pytest.mark.parametrize("plant", ["modal", "tavares"])
def test_it_begins_where_the_other_ended(plant: str, first: Path, tmp_path: Path) -> None:
    """Before the first update its saccades are those of the policy it began with."""
    config = replace(TINY, plant=plant, origin=str(first))
    train(config, tmp_path / "second", quiet=True)
    policy = Policy.load(first)
    task = config.make_task()
    pairs, _ = evaluation.evaluation_saccades(task, 2, carried=tmp_path / "second" / "optimum.safetensors")
    scale = policy.act(pairs.start.orientation, pairs.target)
    own = task.actions.from_unit(policy.task().actions.to_unit(scale))  # as shares of this task's own bounds
    reward = task.perform(pairs.start, own, pairs.target).reward.total
    gap = (pairs.optimum.reward - reward) / np.abs(pairs.optimum.reward)
    rows = metrics(tmp_path / "second")
    assert rows[0]["update"] == "0"
    assert float(rows[0]["gap_mean"]) == pytest.approx(gap.mean(), rel=1e-3, abs=1e-3)
    settings = json.loads((tmp_path / "second" / "run.json").read_text())["config"]
    assert settings["origin"] == str(first)
    assert Policy.load(tmp_path / "second").manifest["config"]["origin"] == first.name
    assert settings["temperature"] == list(FINE_TUNING["temperature"])
    assert settings["updates"] == 16  # what the user says comes before what suits fine-tuning


def refuse_others(first: Path, folder: Path) -> None:
    with pytest.raises(InputError, match=r"names \[B, D, k0\], not \[B_ratio_motor1"):
        train(replace(TINY, origin="lpf-1"), folder / "one", quiet=True)
    with pytest.raises(InputError, match="no-such-run is no policy"):
        train(replace(TINY, origin=str(folder / "no-such-run")), folder / "two", quiet=True)
    horizontal = replace(TINY, plant="lpf", targets=None, origin=str(first))
    with pytest.raises(InputError, match="targets gaze, not horizontal"):
        train(horizontal, folder / "three", quiet=True)


def test_a_policy_of_another_kind_is_refused(first: Path, tmp_path: Path) -> None:
    refuse_others(first, tmp_path)


def test_a_refused_run_leaves_nothing_behind(first: Path, tmp_path: Path) -> None:
    refuse_others(first, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_the_torsion_of_the_usual_command_is_chosen() -> None:
    task = replace(TINY, torsion="fick").make_task()
    assert task.actions.identity()["rule"] == "fick"


def test_torsion_is_for_gaze_targets() -> None:
    with pytest.raises(InputError, match=r"torsion|rule"):
        replace(TINY, plant="lpf", targets=None, torsion="fick").make_task()
