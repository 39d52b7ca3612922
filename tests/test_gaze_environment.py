"""The reward of gaze saccades by hand, beside the thesis' own on horizontal ones; the environment by its checkers."""

from functools import cache

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from stable_baselines3.common.env_checker import check_env as check_sb3_env

import orient_eye  # noqa: F401  # registers the environment
from orient_eye import listing, rotations
from orient_eye.environments.batch import log_reward
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.plants import Plant, make_plant
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.fixation import fixate
from orient_eye.task.gaze_targets import TORSION_DEG
from orient_eye.task.saccade import Outcome, SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
NAME = "OrientEye/Saccade-v0"
ALL = ("motor1", "motor2", "motor3")
WEIGHTS = {"accuracy": 4.08e7, "energy": 1.0, "duration": 5.53e5, "overshoot": 5e6, "force": 3e5}


@cache
def made(name: str) -> Plant:
    return make_plant(name)


@cache
def task_of(name: str, judge: str = "gaze", force: float = 3e5) -> SaccadeTask:
    weights = {**WEIGHTS, "force": force}
    if judge == "orientation":
        del weights["force"]
    return SaccadeTask.of_case(made(name), targets="gaze", judge=judge, weights=weights, actions="pulse-step")


# --- the reward -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def performed() -> tuple[SaccadeTask, Array, Outcome]:
    """Drawn saccades with commands that do not end on their target, and with torsion of their own."""
    task = task_of("tavares")
    random = np.random.default_rng(2)
    start, target = task.targets.draw(12, random)
    action = task.actions.likely(target).reshape(12, 3, 3)
    action[:, :, 1] += random.uniform(-3, 3, (12, 3))
    action[:, :, 0], action[:, :, 2] = random.uniform(25, 60, (12, 3)), [5.5, 19.0, 5.5]
    return task, target, task.perform(start, action.reshape(12, 9), target)


def test_the_terms_by_hand(performed: tuple[SaccadeTask, Array, Outcome]) -> None:
    _, target, outcome = performed
    terms, measures = outcome.reward.terms, outcome.measures
    assert list(terms) == ["accuracy", "energy", "duration", "overshoot", "force"]
    assert measures.settled.any()
    off = np.deg2rad(rotations.angle_between_directions(rotations.gaze(target), rotations.gaze(measures.at_settling)))
    assert off.max() > 0.01
    np.testing.assert_allclose(terms["accuracy"], -(np.sin(off / 2) ** 2), rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(terms["duration"], 1 / (1 + 0.6 * measures.settling_time_s) - 1, rtol=1e-9)
    trajectory = outcome.movement.trajectory()
    assert trajectory.motor is not None
    speed = np.diff(trajectory.motor, axis=1) / 1e-3
    np.testing.assert_allclose(terms["energy"], -(speed**2).sum(axis=(1, 2)) * 1e-3, rtol=2e-3)
    total = sum(WEIGHTS[name] * terms[name] for name in terms)
    np.testing.assert_allclose(outcome.reward.total, total, rtol=1e-12)
    assert all((value <= 0).all() for value in terms.values())


def test_settling_and_overshoot_by_hand(performed: tuple[SaccadeTask, Array, Outcome]) -> None:
    """The gaze settles when it stays within 1 % of its amplitude; overshoot goes along the great circle, beyond."""
    _, _, outcome = performed
    measures, trajectory = outcome.measures, outcome.movement.trajectory()
    gaze, end = rotations.gaze(trajectory.orientation), rotations.gaze(measures.final)
    for i in range(len(end)):
        amplitude = float(rotations.angle_between_directions(gaze[i, 0], end[i]))
        assert measures.amplitude_deg[i] == pytest.approx(amplitude, abs=1e-9)
        outside = rotations.angle_between_directions(gaze[i], end[i]) > 0.01 * amplitude
        last = np.flatnonzero(outside)[-1]
        if last + 1 < len(outside):
            assert measures.settling_time_s[i] == pytest.approx(trajectory.time[last], abs=1.1e-3)
        # Angle around the axis of the great circle, from the start; what is beyond the end is overshoot.
        axis = np.cross(gaze[i, 0], end[i])
        axis /= np.linalg.norm(axis)
        progress = np.rad2deg(np.arctan2(gaze[i] @ np.cross(axis, gaze[i, 0]), gaze[i] @ gaze[i, 0]))
        beyond = max(progress.max() - amplitude, 0.0) / amplitude
        assert measures.overshoot[i] == pytest.approx(beyond, abs=2e-4)


def test_the_force_is_that_beyond_the_least_of_its_gaze(performed: tuple[SaccadeTask, Array, Outcome]) -> None:
    task, _, outcome = performed
    plant = task.plant
    assert isinstance(plant, ElasticPlant)
    rests = outcome.measures.final
    tension = plant.tension(rests, outcome.command.final)
    by_name = dict(zip(plant.tendons, tension.T, strict=True))
    pairs = [sorted(name for name in by_name if name.startswith(motor)) for motor in ALL]
    force = sum((by_name[one] - by_name[other]) ** 2 for one, other in pairs)
    least = fixate(plant, rotations.gaze(rests))[2]
    np.testing.assert_allclose(outcome.reward.terms["force"], -(force - least), atol=2e-5, rtol=1e-3)
    assert (outcome.reward.terms["force"] < -1e-4).any()


@settings(max_examples=15, deadline=None)
@given(st.floats(-20, 20), st.floats(3, 40), st.sampled_from([-1, 1]), st.floats(25, 60), st.floats(14, 24))
def test_on_horizontal_saccades_it_is_the_thesis_reward(
    start: float, size: float, way: int, B: float, k0: float
) -> None:
    """Where nothing turns about the line of sight, gaze and orientation are judged alike, term by term."""
    target = float(np.clip(start + way * size, -45, 45))
    gaze, thesis = task_of("tavares", "gaze", 0.0), task_of("tavares", "orientation")
    begin = gaze.targets.rest(rotations.from_yaw([start]))
    end = rotations.from_yaw([target])
    D = made("tavares").hold(end, ("motor2",))[0, 1]
    action = np.array([[30, 0, 6, B, D, k0, 30, 0, 6.0]])
    one, other = (task.perform(begin, action, end).reward for task in (gaze, thesis))
    for name, value in other.terms.items():
        np.testing.assert_allclose(one.terms[name], value, rtol=1e-4, atol=1e-7, err_msg=name)
    np.testing.assert_allclose(one.total, other.total, rtol=1e-4)


def test_torsion_is_free() -> None:
    """The same saccade is worth the same whatever torsion its target is told with; to the thesis' judge it is not."""
    task, thesis = task_of("tavares", "gaze", 0.0), task_of("tavares", "orientation")
    start, target = saccades(task.targets, [[0.0, 0.0]], [[10.0, -15.0]])
    action = task.actions.likely(target)
    action[np.isnan(action)] = np.tile([40.0, 10.0], 3)
    rolled = listing.with_torsion(rotations.gaze(target), [5.0])
    one, other = (task.perform(start, action, each).reward.total for each in (target, rolled))
    np.testing.assert_allclose(one, other, rtol=1e-9)
    one, other = (thesis.perform(start, action, each).reward.total for each in (target, rolled))
    assert other < one


def test_a_failed_saccade_is_worth_less_than_any_other() -> None:
    task = task_of("modal", "gaze", 0.0)
    start, target = task.targets.draw(4, np.random.default_rng(0))
    action = task.actions.from_unit(np.zeros((4, 9)))
    action[1] = np.nan
    outcome = task.perform(start, action, target)
    assert outcome.measures.failed.tolist() == [False, True, False, False]
    assert np.isfinite(outcome.reward.total).all()
    assert outcome.reward.total.argmin() == 1


def test_a_force_that_is_not_known_is_not_judged() -> None:
    with pytest.raises(InputError, match=r"of plant 'modal' no elastics are known.* give it the weight 0"):
        SaccadeTask.of_case(made("modal"), targets="gaze", weights=WEIGHTS)
    task = SaccadeTask.of_case(made("modal"), targets="gaze")
    assert task.weights["force"] == 0
    assert "no weight of the force" in task.weights_from


# --- the environment --------------------------------------------------------------------------------------


@pytest.mark.parametrize("plant", ["modal", "tavares"])
@pytest.mark.filterwarnings("ignore:.*render:UserWarning")
def test_the_checkers_of_gymnasium_and_sb3_are_content(plant: str) -> None:
    env = gymnasium.make(NAME, plant=made(plant), targets="gaze")
    check_env(env.unwrapped, skip_render_check=True)
    check_sb3_env(env.unwrapped)
    assert env.observation_space.shape == (8,)
    assert env.action_space.shape == (9,)


@pytest.fixture(scope="module")
def env() -> gymnasium.Env:  # type: ignore[type-arg]  # of arrays
    return gymnasium.make(NAME, plant=made("tavares"), targets="gaze", log_reward=True)


def test_a_saccade_chosen_by_its_gaze(env: gymnasium.Env) -> None:  # type: ignore[type-arg]
    options = {"start_yaw_deg": -5.0, "start_pitch_deg": 4.0, "target_yaw_deg": 20.0, "target_pitch_deg": -10.0}
    observation, told = env.reset(options=options)
    assert told == pytest.approx(options)
    ends = listing.directions([-5.0, 20.0], [4.0, -10.0])
    np.testing.assert_allclose(rotations.gaze(observation.reshape(2, 4)), ends, atol=1e-6)
    np.testing.assert_allclose(listing.torsion(observation.reshape(2, 4)), fixate(made("tavares"), ends)[0], atol=0.01)
    final, reward, terminated, truncated, info = env.step(np.zeros(9, np.float32))
    assert terminated
    assert not truncated
    assert float(reward) == pytest.approx(float(log_reward(np.array(info["reward"]))), rel=1e-9)
    assert info["final_yaw_deg"] == pytest.approx(20, abs=0.05)  # the usual command ends on its target
    assert info["final_pitch_deg"] == pytest.approx(-10, abs=0.05)
    np.testing.assert_allclose(rotations.gaze(final.reshape(2, 4)[0]), ends[1], atol=1e-3)
    parts = [info[f"reward_{name}"] for name in WEIGHTS]
    assert sum(parts) == pytest.approx(info["reward"])
    assert {"B_motor1", "D_motor3_deg", "k0_motor2"} <= set(info)


def test_a_start_with_torsion_chosen_by_its_orientation(env: gymnasium.Env) -> None:  # type: ignore[type-arg]
    start = listing.with_torsion(listing.directions(10.0, 5.0), 4.0)
    observation, told = env.reset(options={"start": start, "target_yaw_deg": 0.0, "target_pitch_deg": 0.0})
    assert listing.torsion(observation[:4]) == pytest.approx(4.0, abs=1e-4)
    assert told["start_yaw_deg"] == pytest.approx(10)
    _, _, _, _, info = env.step(np.zeros(9, np.float32))
    assert info["final_yaw_deg"] == pytest.approx(0, abs=0.05)
    with pytest.raises(InputError, match="choose one they can hold"):
        env.reset(options={"start": listing.with_torsion(listing.directions(0.0, 0.0), 45.0)})
    with pytest.raises(InputError, match="start is an orientation of four finite numbers"):
        env.reset(options={"start": [1.0, 0.0, 0.0]})
    with pytest.raises(InputError, match=r"unknown reset options \['start_roll_deg'\]"):
        env.reset(options={"start_roll_deg": 4.0})
    with pytest.raises(InputError, match=r"can be held up to 50\.0 deg"):
        env.reset(options={"start_yaw_deg": 85.0, "start_pitch_deg": 0.0})


def test_drawn_episodes_have_starts_with_torsion() -> None:
    envs = SaccadeVecEnv(64, made("modal"), targets="gaze", seed=0)
    observations = np.asarray(envs.reset())
    torsion = listing.torsion(observations[:, :4])
    assert 0.9 * TORSION_DEG < np.abs(torsion).max() <= TORSION_DEG + 1e-4
    assert np.abs(listing.torsion(observations[:, 4:])).max() < 1e-4
    observations, rewards, done, infos = envs.step(np.zeros((64, 9), np.float32))
    assert done.all()
    assert np.isfinite(rewards).all()
    assert all("final_pitch_deg" in info for info in infos)


def test_options_of_the_task_are_checked() -> None:
    with pytest.raises(InputError, match="'donders'"):
        gymnasium.make(NAME, plant=made("modal"), targets="gaze", action_options={"rule": "donders"})
    with pytest.raises(InputError, match="need all motors"):
        gymnasium.make(NAME, plant=made("modal"), targets="gaze", driven=("motor1", "motor2"))
    with pytest.raises(InputError, match="cannot drive"):
        gymnasium.make(NAME, plant=made("modal"), targets="gaze", driven=("motor1", "motor2", "motor9"))
