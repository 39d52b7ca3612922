"""The environment: Gymnasium's and Stable-Baselines3's own checkers without a warning, and one saccade's numbers
the same by every way in.
"""

import subprocess
import sys
import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray
from PIL import Image
from stable_baselines3 import SAC
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3
from stable_baselines3.common.vec_env import VecMonitor

import orient_eye
from orient_eye.environments.batch import log_reward, observe
from orient_eye.environments.saccade_env import SaccadeEnv
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.environments.vector_env import SaccadeVectorEnv
from orient_eye.errors import InputError
from orient_eye.eyes.model import ball
from orient_eye.plants import PLANTS, make_plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.recording.frames import still, write_film
from orient_eye.rotations import from_yaw, to_euler
from orient_eye.surrogate import Surrogate
from orient_eye.task.cases import Case
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
ID = "OrientEye/Saccade-v0"
K = 1.4758  # thesis 3.3.1


def options_of(plant: str) -> dict[str, Any]:
    """The simulators as short as they may be: half a second is the default."""
    return {"horizon_s": 0.25} if plant == "tavares" else {}


@pytest.fixture
def warnings_are_errors() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


# --- the checkers ---------------------------------------------------------------------------------


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("log", [False, True])
@pytest.mark.usefixtures("warnings_are_errors")
def test_gymnasium_checks_it(plant: str, log: bool) -> None:
    env = gymnasium.make(ID, plant=plant, log_reward=log, **options_of(plant))
    assert isinstance(env.unwrapped, SaccadeEnv)
    check_env(env.unwrapped)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.usefixtures("warnings_are_errors")
def test_stable_baselines3_checks_it(plant: str) -> None:
    check_env_of_sb3(SaccadeEnv(plant, **options_of(plant)), warn=True)


@pytest.mark.usefixtures("warnings_are_errors")
def test_episodes_through_all_of_gymnasiums_wrappers() -> None:
    """`make` adds a passive checker and an order enforcer; 50 episodes of one step each."""
    env = gymnasium.make(ID, plant="lpf")
    assert env.spec is not None
    assert env.spec.max_episode_steps is None  # a time limit would truncate the only step
    env.action_space.seed(0)
    for seed in range(50):
        observation, _ = env.reset(seed=seed)
        assert env.observation_space.contains(observation)
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert env.observation_space.contains(observation)
        assert type(reward) is float
        assert -1e10 < reward <= 0
        assert (terminated, truncated) == (True, False)


def test_the_version_is_the_packages() -> None:
    assert orient_eye.__version__[0].isdigit()
    assert ID in gymnasium.registry


# --- reset ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("plant", PLANTS)
def test_chosen_start_and_target(plant: str) -> None:
    env = SaccadeEnv(plant, **options_of(plant))
    chosen = {"start_yaw_deg": -12.5, "target_yaw_deg": 20}
    observation, info = env.reset(seed=1, options=chosen)
    np.testing.assert_allclose(observation, [*from_yaw(-12.5), *from_yaw(20.0)], atol=1e-7)
    assert observation.dtype == np.float32
    assert info == pytest.approx({"start_yaw_deg": -12.5, "target_yaw_deg": 20.0}, abs=1e-12)
    assert all(type(value) is float for value in info.values())


def test_one_chosen_and_the_other_drawn() -> None:
    """The same seed draws the same, whether or not the other is chosen."""
    env = SaccadeEnv()
    _, drawn = env.reset(seed=3)
    for name in drawn:
        _, info = env.reset(seed=3, options={name: 7.0})
        assert info == pytest.approx(drawn | {name: 7.0}, abs=1e-12)


def test_seeds() -> None:
    def draws(env: SaccadeEnv, seed: int | None) -> list[dict[str, Any]]:
        return [env.reset(seed=seed)[1], *(env.reset()[1] for _ in range(3))]

    one, same, other = (draws(SaccadeEnv(), seed) for seed in (5, 5, 6))
    assert one == same
    assert one != other
    assert len({info["start_yaw_deg"] for info in one}) == 4
    assert draws(SaccadeEnv("mujoco"), 5) == one  # whatever the plant
    assert draws(SaccadeEnv(), None) != draws(SaccadeEnv(), None)


def test_draws_are_of_the_whole_range() -> None:
    env = SaccadeEnv()
    env.reset(seed=0)
    yaw = np.array([list(env.reset()[1].values()) for _ in range(2000)])
    assert (np.abs(yaw) <= 35).all()
    assert (yaw.min(axis=0) < -34.5).all()
    assert (yaw.max(axis=0) > 34.5).all()
    np.testing.assert_allclose(yaw.std(axis=0), 70 / np.sqrt(12), rtol=0.05)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"yaw": 3.0}, r"unknown reset options \['yaw'\]; there are start_yaw_deg, target_yaw_deg \[deg\], and start"),
        ({"start": 3.0}, "start is an orientation of four finite numbers"),
        ({"target": [0.0, 0, 0, 0]}, "zero quaternion"),
        ({"start_yaw_deg": float("nan")}, "start_yaw_deg is one finite number of degrees, got nan"),
        ({"target_yaw_deg": float("inf")}, "target_yaw_deg is one finite number"),
        ({"target_yaw_deg": [1.0, 2.0]}, r"target_yaw_deg is one finite number of degrees, got \[1.0, 2.0\]"),
        ({"start_yaw_deg": "left"}, "start_yaw_deg is one finite number of degrees, got 'left'"),
        ({"start_yaw_deg": None}, "start_yaw_deg is one finite number of degrees, got None"),
    ],
)
def test_bad_reset_options_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SaccadeEnv().reset(options=options)


def test_a_start_the_eye_cannot_hold_is_refused() -> None:
    with pytest.raises(InputError, match=r"can be held between -61.8 and 61.8 deg"):
        SaccadeEnv("mujoco").reset(options={"start_yaw_deg": 130.0})
    with pytest.raises(InputError, match=r"target at 70 deg: the eye .* can be held between -61.8 and 61.8 deg"):
        SaccadeEnv("mujoco").reset(options={"target_yaw_deg": 70.0})


def test_a_step_needs_a_reset_before_it() -> None:
    env = SaccadeEnv()
    action = np.zeros(3, np.float32)
    with pytest.raises(InputError, match="reset the environment before a saccade"):
        env.step(action)
    env.reset(seed=0)
    env.step(action)
    with pytest.raises(InputError, match="an episode is one step"):
        env.step(action)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"plant": "mojoco"}, "unknown plant 'mojoco'"),
        ({"plant": LinearPlant(), "plant_options": {"step_s": 0.01}}, "plant_options go with a plant's name"),
        ({"plant": "lpf", "band": 2.0}, "settling band"),
        ({"plant": "lpf", "driven": ("motor1",)}, "cannot drive"),
        ({"plant": "lpf", "bend": 0.01}, "no option bend; of a task it has case, targets"),
        ({"plant": "lpf", "plant_options": {"eye": "thesis"}}, "plant 'lpf'.*'eye'.*its options are surrogate"),
        ({"plant": "lpf", "weights": (1.0, 2.0)}, "4 weights, accuracy, energy, duration, overshoot"),
        ({"plant": "lpf", "weights": (0.0, 0.0, 0.0, 0.0)}, "not all 0"),
        ({"plant": "lpf", "render_mode": "ansi"}, "render"),
    ],
)
def test_bad_environments_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SaccadeEnv(**options)
    with pytest.raises(InputError, match=message):
        SaccadeVecEnv(2, **options)


def test_plant_and_task_options_arrive() -> None:
    env = SaccadeEnv("mujoco", plant_options={"eye": "eve_v3", "threads": 1}, case=Case("2", 50.0), horizon_s=0.3)
    assert env.task.plant.identity()["eye"] == "eve_v3"
    assert (env.task.actions.pulse, env.task.actions.C, env.task.horizon_s) == ("2", 50.0, 0.3)
    by_case = SaccadeEnv("lpf", case="2-varying").task
    assert (by_case.actions.pulse, by_case.actions.C, by_case.weights["accuracy"]) == ("2", "varying", 8.70e7)
    assert SaccadeEnv("mujoco").task.weights["accuracy"] == 3.56e7  # solved on that plant
    given = SaccadeEnv("lpf", weights=(4.0, 3.0, 2.0, 1.0)).task
    assert given.weights == {"accuracy": 4.0, "energy": 3.0, "duration": 2.0, "overshoot": 1.0}
    assert given.weights == SaccadeEnv("lpf", weights=given.weights).task.weights
    three = SaccadeEnv("mujoco", driven=("motor1", "motor2", "motor3"), weights=(1.0, 1.0, 1.0, 1.0))
    assert three.action_space.shape == (9,)
    plant = LinearPlant(Surrogate(1.0, 10.0))
    assert SaccadeEnv(plant).task.plant is plant
    np.testing.assert_array_equal(SaccadeEnv("lpf").task.actions.low, [18, -80, 5])
    np.testing.assert_array_equal(SaccadeEnv("lpf").task.actions.high, [80, 80, 40])
    np.testing.assert_array_equal(SaccadeEnv("mujoco").task.actions.high, [80, 40, 40])


# --- a step ---------------------------------------------------------------------------------------


def test_action_and_scaled_action() -> None:
    task = SaccadeTask.of_case(make_plant("mujoco"), driven=("motor1", "motor2"), weights=(1.0, 1.0, 1.0, 1.0))
    actions = task.actions
    assert actions.names == ("B_motor1", "D_motor1", "k0_motor1", "B_motor2", "D_motor2", "k0_motor2")
    scaled = np.array([[-1.0, 0, 1, 0.5, -0.5, 0]])
    action = actions.from_unit(scaled)
    np.testing.assert_allclose(action, [[18, 0, 40, 64.5, -20, 22.5]], rtol=1e-15)
    np.testing.assert_allclose(actions.to_unit(action), scaled, atol=1e-15)
    np.testing.assert_array_equal(actions.from_unit(3 * np.sign(scaled)), actions.from_unit(np.sign(scaled)))
    rng = np.random.default_rng(0)
    many = rng.uniform(-1, 1, (100, 6))
    np.testing.assert_allclose(actions.to_unit(actions.from_unit(many)), many, atol=1e-14)


@pytest.mark.parametrize("plant", PLANTS)
def test_a_good_saccade(plant: str) -> None:
    """0 to 30 deg with B = 35, k0 = 17.5 and the D that lands there (thesis 4.4.5)."""
    env = SaccadeEnv(plant, **options_of(plant))
    env.reset(options={"start_yaw_deg": 0.0, "target_yaw_deg": 30.0})
    D = float(env.task.actions.likely(from_yaw([30.0]))[0, 1])
    action = env.task.actions.to_unit(np.array([[35.0, D, 17.5]]))[0]
    observation, reward, terminated, truncated, info = env.step(action.astype(np.float32))
    assert (terminated, truncated) == (True, False)
    np.testing.assert_allclose(observation, [*from_yaw(30.0), *from_yaw(30.0)], atol=1e-6)
    assert info["final_yaw_deg"] == pytest.approx(30, abs=1e-4)
    assert (info["B"], info["D_deg"], info["k0"]) == pytest.approx((35.0, D, 17.5), rel=1e-6)
    assert info["F_deg"] == pytest.approx(0, abs=1e-9)
    assert info["amplitude_deg"] == pytest.approx(30, abs=1e-4)
    assert 100 < info["duration_ms"] < 300
    assert 300 < info["peak_velocity_deg_s"] < 500
    assert 0.5 < info["skewness"] < 1
    assert not info["failed"]
    assert not info["saturated"]
    terms = [info[f"reward_{name}"] for name in env.task.weights]
    assert len(terms) == 4
    assert reward == info["reward"] == pytest.approx(sum(terms), rel=1e-12)
    if plant == "lpf":
        assert info["peak_velocity_deg_s"] == pytest.approx(30 * 35 / np.e, rel=1e-5)
        assert reward == pytest.approx(-70546, rel=1e-3)  # spec: the optimum there
    for name, value in info.items():
        assert isinstance(value, (float, int, bool)), name


def test_info_of_three_motors_names_their_numbers() -> None:
    env = SaccadeEnv("mujoco", driven=("motor1", "motor2", "motor3"), weights=(1.0, 1.0, 1.0, 1.0))
    env.reset(seed=0)
    info = env.step(np.zeros(9, np.float32))[4]
    for name in ("B_{}", "D_{}_deg", "k0_{}", "F_{}_deg"):
        assert all(isinstance(info[name.format(f"motor{i}")], float) for i in (1, 2, 3))
    assert isinstance(info["reward"], float)


def test_actions_beyond_the_bounds_are_clipped() -> None:
    results = []
    for scale in (1.0, 7.0):
        env = SaccadeEnv()
        env.reset(seed=2)
        results.append(env.step(scale * np.array([1.0, -1.0, 1.0], np.float32))[4])
    assert results[0] == results[1]
    assert (results[0]["B"], results[0]["D_deg"], results[0]["k0"]) == (80, -80, 40)


def test_log_reward() -> None:
    """-log10(-R / 1e5); it grows with R, and a reward of 0 is as one of -1."""
    total = -(10.0 ** np.arange(0, 11, 0.5))
    found = log_reward(total)
    np.testing.assert_allclose(found, 5 - np.arange(0, 11, 0.5), atol=1e-14)
    assert (np.diff(found) < 0).all()
    np.testing.assert_allclose(log_reward(np.array([0.0, -0.5])), 5.0, rtol=1e-15)
    plain, log = SaccadeEnv(), SaccadeEnv(log_reward=True)
    for env in (plain, log):
        env.reset(seed=4)
    action = np.array([0.1, 0.2, -0.3], np.float32)
    total = np.array([plain.step(action)[1]])
    assert log.step(action)[1] == log_reward(total)[0]


@pytest.mark.parametrize("plant", PLANTS)
def test_an_action_that_is_none_ends_the_episode_with_the_worst_reward(plant: str) -> None:
    env = SaccadeEnv(plant, **options_of(plant))
    env.reset(options={"start_yaw_deg": 5.0, "target_yaw_deg": 10.0})
    observation, reward, terminated, _, info = env.step(np.full(3, np.nan, np.float32))
    assert terminated
    assert info["failed"]
    assert np.isfinite(reward)
    assert reward < -2.5e8
    np.testing.assert_allclose(observation, [*from_yaw(5.0), *from_yaw(10.0)], atol=1e-7)  # it shows the start


def test_a_resets_observation_is_its_own() -> None:
    env = SaccadeEnv()
    one, info = env.reset(seed=0)
    before, said = one.copy(), dict(info)
    env.reset(seed=1)
    np.testing.assert_array_equal(one, before)
    assert info == said


# --- the batch ------------------------------------------------------------------------------------


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("log", [False, True])
def test_batch_and_single_give_the_same_numbers(plant: str, log: bool) -> None:
    count, options = 5, options_of(plant)
    rng = np.random.default_rng(0)
    many = SaccadeVecEnv(count, plant, log_reward=log, seed=0, **options)
    one = SaccadeEnv(plant, log_reward=log, **options)
    started = many.reset()
    start, target = (to_euler(q)[0] for q in (many.batch.start.orientation, many.batch.target))
    actions = rng.uniform(-0.6, 0.6, (count, 3)).astype(np.float32)
    _, rewards, dones, infos = many.step(actions)
    assert dones.all()
    assert rewards.dtype == np.float32
    for i in range(count):
        observation, _ = one.reset(options={"start_yaw_deg": start[i], "target_yaw_deg": target[i]})
        np.testing.assert_allclose(started[i], observation, atol=1e-7)
        ended, reward, _, _, info = one.step(actions[i])
        assert rewards[i] == pytest.approx(reward, rel=1e-6)
        np.testing.assert_allclose(infos[i]["terminal_observation"], ended, atol=1e-6)
        assert infos[i]["TimeLimit.truncated"] is False
        for name, value in info.items():
            assert infos[i][name] == pytest.approx(value, rel=1e-6, abs=1e-6), name


def test_batch_begins_anew_with_every_step() -> None:
    env = SaccadeVecEnv(4, seed=0)
    first = np.asarray(env.reset())
    second, _, _, infos = env.step(np.zeros((4, 3), np.float32))
    second = np.asarray(second)
    assert (first != second).any(axis=1).all()
    np.testing.assert_allclose(second, observe(env.batch.start.orientation, env.batch.target), atol=1e-7)
    for info, begun in zip(infos, first, strict=True):
        np.testing.assert_array_equal(info["terminal_observation"][4:], begun[4:])  # the target of the ended one
        landed = to_euler(info["terminal_observation"][:4].astype(float))[0]
        assert landed == pytest.approx(0, abs=1e-4)  # D = 0


def test_batch_of_chosen_saccades() -> None:
    env = SaccadeVecEnv(3, "mujoco", seed=0)
    start, target = np.array([0.0, -5.0, 20.0]), np.array([10.0, 15.0, -30.0])
    observation = env.begin(*saccades(env.task.targets, start[:, None], target[:, None]))
    np.testing.assert_allclose(observation, observe(from_yaw(start), from_yaw(target)), atol=1e-7)
    D = env.task.actions.likely(from_yaw(target))[:, 1]
    action = np.stack([np.full(3, 40.0), D, np.full(3, 17.5)], axis=-1)
    env.step(env.task.actions.to_unit(action).astype(np.float32))
    assert env.outcome is not None
    np.testing.assert_allclose(to_euler(env.outcome.measures.final)[0], target, atol=1e-3)
    np.testing.assert_allclose(env.outcome.measures.amplitude_deg, np.abs(target - start), atol=1e-3)


def test_seeds_of_the_batch() -> None:
    """By the constructor or by `seed()` before a reset; the same saccades on every plant."""

    def drawn(env: SaccadeVecEnv) -> list[Array]:
        rounds = [np.asarray(env.reset())]
        rounds += [np.asarray(env.step(np.zeros((3, 3), np.float32))[0]) for _ in range(2)]
        return rounds

    by_seed = SaccadeVecEnv(3)
    by_seed.seed(9)
    again = SaccadeVecEnv(3, seed=1)
    drawn(again)
    again.seed(9)
    other_plant = SaccadeVecEnv(3, "mujoco")
    other_plant.seed(9)
    reference = drawn(by_seed)
    for env in (again, other_plant):
        for a, b in zip(reference, drawn(env), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-7)
    assert (np.asarray(by_seed.reset()) != reference[0]).any()  # a seed counts for one reset
    np.testing.assert_array_equal(drawn(SaccadeVecEnv(3, seed=4)), drawn(SaccadeVecEnv(3, seed=4)))
    assert (np.array(drawn(SaccadeVecEnv(3, seed=4))) != np.array(drawn(SaccadeVecEnv(3, seed=5)))).any()
    unseeded = SaccadeVecEnv(3, seed=4)
    first = np.asarray(unseeded.reset())
    assert (np.asarray(unseeded.reset()) != first).any()  # a reset without a seed goes on


def test_an_action_that_is_none_harms_no_other() -> None:
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (4, 3)).astype(np.float32)
    results = []
    for spoilt in (False, True):
        env = SaccadeVecEnv(4, seed=0)
        env.reset()
        given = actions.copy()
        if spoilt:
            given[2] = np.nan
        results.append(env.step(given)[1])
    good, spoilt_rewards = results
    np.testing.assert_array_equal(np.delete(good, 2), np.delete(spoilt_rewards, 2))
    assert np.isfinite(spoilt_rewards[2])
    assert spoilt_rewards[2] < -2.5e8


def test_vec_env_interface() -> None:
    env = SaccadeVecEnv(4, seed=0)
    assert env.num_envs == 4
    assert env.get_attr("log_reward") == [False] * 4
    assert env.get_attr("task", [0, 2]) == [env.task] * 2
    env.set_attr("log_reward", True)
    assert env.log_reward is True
    assert env.has_attr("task")
    assert not env.has_attr("colour")
    assert env.env_is_wrapped(VecMonitor) == [False] * 4
    assert env.env_method("reset", indices=0)[0].shape == (4, 8)
    assert env.render_mode is None
    env.close()


@pytest.mark.parametrize("plant", ["lpf", "mujoco"])
@pytest.mark.filterwarnings("error")
def test_stable_baselines3_learns_on_it(plant: str) -> None:
    """Stock SAC, monitored: the machinery runs, episodes last one step, and the replay holds what was done."""
    env = VecMonitor(SaccadeVecEnv(8, plant, log_reward=True, seed=0))
    model = SAC("MlpPolicy", env, learning_starts=16, batch_size=16, policy_kwargs={"net_arch": [16]}, seed=0)
    model.learn(64, log_interval=1000)
    assert model.num_timesteps == 64
    assert len(model.ep_info_buffer) == 64
    assert {episode["l"] for episode in model.ep_info_buffer} == {1}
    replay = model.replay_buffer
    filled = replay.pos
    assert filled == 8
    assert (replay.dones[:filled] == 1).all()
    assert (replay.timeouts[:filled] == 0).all()
    np.testing.assert_array_equal(replay.next_observations[:filled, :, 4:], replay.observations[:filled, :, 4:])
    task = env.venv.task
    start = task.targets.rest(replay.observations[3, :, :4].astype(float))
    target = replay.observations[3, :, 4:].astype(float)
    again = task.perform(start, task.actions.from_unit(replay.actions[3]), target)
    np.testing.assert_allclose(replay.rewards[3], log_reward(again.reward.total), atol=1e-4)
    action, _ = model.predict(np.asarray(env.reset()), deterministic=True)
    assert action.shape == (8, 3)


def test_the_environment_of_a_surrogate(tmp_path: Any) -> None:
    path = Surrogate(2.0, 30.0).save(tmp_path / "surrogate.json")
    env = gymnasium.make(ID, plant="lpf", plant_options={"surrogate": path})
    env.reset(options={"start_yaw_deg": 0.0, "target_yaw_deg": 10.0})
    info = env.step(np.array([0.0, 0.25, 0.0], np.float32))[4]
    assert info["final_yaw_deg"] == pytest.approx(2.0 * 20.0)


# --- what one asks of all three -------------------------------------------------------------------


THREE = pytest.mark.parametrize(
    ("make", "shape"),
    [
        (SaccadeEnv, (3,)),
        (lambda **options: SaccadeVectorEnv(1, **options), (1, 3)),
        (lambda **options: SaccadeVecEnv(1, **options), (1, 3)),
    ],
    ids=["single", "vector", "sb3"],
)


@THREE
def test_weights_of_ones_own_and_what_a_step_tells(make: Any, shape: tuple[int, ...]) -> None:
    """Weights in a row or by name hold from the first step on; all three tell of a saccade the same."""
    weights = {"accuracy": 1e7, "energy": 1.0, "duration": 1e4, "overshoot": 1e5}
    for told in (tuple(weights.values()), weights):
        env = make(weights=told, case="2-varying")
        env.reset()
        infos = env.step(np.zeros(shape, np.float32))[-1]
        info = infos[0] if isinstance(infos, list) else infos.get("final_info", infos)
        assert {"duration_ms", "peak_velocity_deg_s", "overshoot", "skewness", "settled", "failed"} <= set(info)
        parts = sum(float(np.squeeze(info[f"reward_{name}"])) for name in weights)
        assert float(np.squeeze(info["reward"])) == pytest.approx(parts)
        assert env.task.weights == weights
        env.close()
        env.close()


@THREE
def test_actions_that_are_no_actions_are_refused(make: Any, shape: tuple[int, ...]) -> None:
    """And the saccade is still there to be made."""
    env = make()
    env.reset()
    for action in (np.zeros((*shape, 1)), np.zeros(shape[:-1]), "go", None, [[1.0], [1.0, 2.0]], np.full(shape, 1j)):
        with pytest.raises(InputError, match="action"):
            env.step(action)
    for action in (np.full(shape, np.inf), np.zeros(shape, int), np.zeros(shape).tolist()):
        env.step(action)
        env.reset()


@pytest.mark.parametrize("kind", [SaccadeVectorEnv, SaccadeVecEnv])
@pytest.mark.parametrize("count", [0, -1, 1.5, "lpf", None, True, 10**9])
def test_how_many_saccades_is_a_whole_number(kind: Any, count: Any) -> None:
    with pytest.raises(InputError, match=r"must be a whole number from 1 to 1000000, got"):
        kind(count, 4 if count == "lpf" else "lpf")


@pytest.mark.parametrize("seed", [-1, 0.5, "a"])
def test_a_seed_of_the_sb3_batch_is_one(seed: Any) -> None:
    with pytest.raises(InputError, match="seed must be a whole number of at least 0"):
        SaccadeVecEnv(2, seed=seed)


def test_options_of_the_sb3_batch() -> None:
    """`set_options` takes effect at the next reset, and once; the same for all, or one for each."""
    env = SaccadeVecEnv(3, seed=0)
    env.set_options({"start_yaw_deg": 5.0, "target_yaw_deg": -10.0})
    chosen = np.asarray(env.reset())
    np.testing.assert_allclose(chosen, observe(from_yaw([5.0] * 3), from_yaw([-10.0] * 3)), atol=1e-7)
    env.set_options([{"target_yaw_deg": angle} for angle in (1.0, 2.0, 3.0)])
    np.testing.assert_allclose(np.asarray(env.reset())[:, 4:], from_yaw([1.0, 2.0, 3.0]), atol=1e-7)
    assert (np.asarray(env.reset())[:, 4:] != from_yaw([1.0, 2.0, 3.0]).astype(np.float32)).any()
    env.set_options({"yaw": 3.0})
    with pytest.raises(InputError, match="unknown reset options"):
        env.reset()


def test_reset_by_orientation() -> None:
    env = SaccadeEnv("mujoco")
    observation, info = env.reset(options={"start": from_yaw(-4.0), "target": 3 * from_yaw(12.0)})
    np.testing.assert_allclose(observation, [*from_yaw(-4.0), *from_yaw(12.0)], atol=1e-7)
    assert info == pytest.approx({"start_yaw_deg": -4.0, "target_yaw_deg": 12.0}, abs=1e-9)


@pytest.mark.parametrize("plant", ["lpf", "mujoco"])
@pytest.mark.usefixtures("warnings_are_errors")
def test_gymnasiums_vector_environment(plant: str) -> None:
    """The numbers of the SB3 batch; SAME_STEP autoreset, whose `final_obs` and `final_info` are the ended saccades'."""
    envs = gymnasium.make_vec(ID, num_envs=4, vectorization_mode="vector_entry_point", plant=plant, log_reward=True)
    assert isinstance(envs.unwrapped, SaccadeVectorEnv)
    observations, infos = envs.reset(seed=0)
    assert envs.observation_space.contains(observations)
    assert infos == {}
    start, target = observations[:, :4].astype(float), observations[:, 4:].astype(float)
    envs.action_space.seed(0)
    actions = envs.action_space.sample()
    following, rewards, terminations, truncations, infos = envs.step(actions)
    assert envs.observation_space.contains(following)
    assert (terminations.all(), truncations.any()) == (True, False)
    assert (following != observations).any(axis=1).all()
    np.testing.assert_allclose(infos["final_obs"][:, 4:], target, atol=1e-7)
    told = infos["final_info"]
    assert {"B", "D_deg", "k0", "duration_ms", "overshoot", "reward", "reward_energy"} <= set(told)
    np.testing.assert_allclose(told["start_yaw_deg"], to_euler(start)[0], atol=1e-4)
    np.testing.assert_allclose(rewards, log_reward(told["reward"]))
    one = SaccadeEnv(plant, log_reward=True)
    for i in range(4):
        one.reset(options={"start": start[i], "target": target[i]})
        assert one.step(actions[i])[1] == pytest.approx(rewards[i], rel=1e-4)
    again, _ = envs.reset(seed=0)
    np.testing.assert_array_equal(again, observations)
    chosen, _ = envs.reset(options={"target_yaw_deg": [1.0, 2.0, 3.0, 4.0]})
    np.testing.assert_allclose(chosen[:, 4:], from_yaw([1.0, 2.0, 3.0, 4.0]), atol=1e-7)
    envs.close()


def test_neither_torch_nor_stable_baselines3_is_loaded() -> None:
    code = (
        "import sys, gymnasium, orient_eye; gymnasium.make('OrientEye/Saccade-v0', plant='mujoco');"
        "gymnasium.make_vec('OrientEye/Saccade-v0', 2, 'vector_entry_point');"
        "assert not {'torch', 'stable_baselines3', 'rerun', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


# --- pictures -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def draws() -> None:
    """Skips where MuJoCo cannot draw."""
    try:
        still(ball(), np.array([1.0, 0, 0, 0]), {}, size=(16, 16))
    except InputError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("plant", ["lpf", "mujoco"])
@pytest.mark.usefixtures("draws")
def test_frames_of_the_whole_movement(plant: str, tmp_path: Any) -> None:
    """An episode is one step, so its frames are the movement's, from the start to its end, evenly in time."""
    env = SaccadeEnv(plant, render_mode="rgb_array_list", horizon_s=0.1)
    env.reset(options={"start_yaw_deg": 20.0, "target_yaw_deg": -20.0})
    (before,) = env.render()
    env.step(env.task.actions.to_unit(np.array([[40.0, env.task.actions.likely(from_yaw([-20.0]))[0, 1], 17.0]]))[0])
    shown = env.render()
    assert len(shown) == 31  # 0.1 s, ten times slower, at 30 a second
    assert all(picture.shape == before.shape == (360, 480, 3) for picture in shown)
    np.testing.assert_array_equal(shown[0], before)
    assert (shown[0] != shown[-1]).any(axis=2).mean() > 0.02
    film = write_film(shown[:5], tmp_path / "saccade.gif")
    with Image.open(film) as opened:
        assert opened.n_frames == 5
    with pytest.raises(InputError, match=r"NAME.gif"):
        write_film(shown, tmp_path / "saccade.mp4")


@pytest.mark.usefixtures("draws", "warnings_are_errors")
def test_one_picture() -> None:
    env = gymnasium.make(ID, plant="mujoco", render_mode="rgb_array", horizon_s=0.1)
    check_env(env.unwrapped)
    env.reset(seed=0)
    before = env.render()
    env.step(env.action_space.sample())
    assert (before != env.render()).any()
    envs = SaccadeVectorEnv(2, render_mode="rgb_array_list", horizon_s=0.1)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    assert [len(each) for each in envs.render()] == [31, 31]


def test_human_needs_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    env = SaccadeEnv(render_mode="human")
    env.reset(seed=0)
    if sys.platform == "linux":
        with pytest.raises(InputError, match="no screen"):
            env.step(np.zeros(3, np.float32))
    env.close()
