"""Judge, saccade task and the search for the best action: plain formulas, the numbers of an independent
program, and searches by other means.
"""

import functools
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from orient_eye.commands.pulse_step import PulseStep
from orient_eye.commands.pulses import PULSES, varying_C
from orient_eye.constants import YAW_LIMIT_DEG
from orient_eye.errors import InputError
from orient_eye.movement import Movement
from orient_eye.movement.measures import Measures, measure
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.rotations import FORWARD, from_euler, from_yaw, gaze, to_euler
from orient_eye.search.optimum import Optimum, find_optimum
from orient_eye.search.simplex import around, climb
from orient_eye.state import State
from orient_eye.surrogate import Surrogate
from orient_eye.task.actions import B_RANGE, K0_RANGE
from orient_eye.task.cases import Case
from orient_eye.task.judge import JUDGES, Reward, plain_reward
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
K = 1.4758  # thesis 3.3.1
JUDGE = JUDGES["orientation"]
WEIGHTS = JUDGE.weights([2.66e7, 1.0, 5.12e5, 2.3e8])
TASK = SaccadeTask.of_case(LinearPlant(Surrogate(K, 17.5, eye="thesis")), "1", weights=WEIGHTS)


def measures(count: int, **fields: Array | float) -> Measures:
    values: dict[str, Any] = {
        "final": np.tile(FORWARD, (count, 1)),
        "at_settling": np.tile(FORWARD, (count, 1)),
        "failed": np.zeros(count, bool),
        "settled": np.ones(count, bool),
    }
    for name in ("amplitude_deg", "settling_time_s", "peak_velocity_deg_s", "overshoot", "skewness"):
        values[name] = np.zeros(count)
    values |= {name: np.broadcast_to(v, values[name].shape) for name, v in fields.items()}
    return Measures(**values)


def reward(
    measured: Measures, energy: Array, target: Array, judge: str = "orientation", force: Array | None = None
) -> Reward:
    """Of a movement that spent this energy, and ends with this excess of force, if it is known."""
    # All that a judge asks of it beside its measures.
    movement: Any = SimpleNamespace(energy=lambda: energy, excess_force=lambda: force)
    return JUDGES[judge].reward(movement, measured, target, {**WEIGHTS, "force": 1.0})


def horizontal(start: Any, target: Any, task: SaccadeTask = TASK) -> tuple[State, Array]:
    """Saccades between yaw angles [deg], each (saccades,)."""
    return saccades(task.targets, np.reshape(start, (-1, 1)), np.reshape(target, (-1, 1)))


# --- the four terms -------------------------------------------------------------------------------


def test_terms_by_their_formulas() -> None:
    """4.41, 4.35, 4.40, 4.42 and the weighted sum 4.32."""
    rng = np.random.default_rng(0)
    count = 50
    at, target = (from_euler(*rng.uniform(-80, 80, (3, count))) for _ in range(2))
    time, overshoot, energy = rng.uniform(0, 1, count), rng.uniform(0, 2, count), rng.uniform(0, 1e6, count)
    found = reward(measures(count, at_settling=at, settling_time_s=time, overshoot=overshoot), energy, target)
    aligned = np.array([np.dot(a, b) for a, b in zip(at, target, strict=True)])
    np.testing.assert_allclose(found.terms["accuracy"], -(1 - aligned**2), 1e-12)
    np.testing.assert_array_equal(found.terms["energy"], -energy)
    np.testing.assert_allclose(found.terms["duration"], -(1 - 1 / (1 + 0.6 * time)), 1e-14)
    np.testing.assert_array_equal(found.terms["overshoot"], -overshoot)
    total = sum(WEIGHTS[name] * found.terms[name] for name in ("accuracy", "energy", "duration", "overshoot"))
    np.testing.assert_allclose(found.total, total, 1e-14)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(
    exponent=st.floats(-12, 2), flips=st.tuples(st.sampled_from([1, -1]), st.sampled_from([1, -1])),
)  # fmt: skip
def test_accuracy_near_the_target_keeps_its_digits(exponent: float, flips: tuple[int, int]) -> None:
    """1 - (q_d . q_s)^2 is sin^2 of half the angle; -q is the same orientation as q."""
    angle = 10.0**exponent
    at = flips[0] * from_yaw([angle])
    found = reward(measures(1, at_settling=at), np.zeros(1), flips[1] * FORWARD[None])
    assert found.terms["accuracy"][0] == pytest.approx(-(np.sin(np.deg2rad(angle) / 2) ** 2), rel=1e-12, abs=0)


def test_no_term_is_positive_and_the_best_is_zero() -> None:
    found = reward(measures(1), np.zeros(1), FORWARD[None])
    for name, value in {**found.terms, "total": found.total}.items():
        assert value == 0, name
    opposite = reward(measures(1, settling_time_s=1e12, overshoot=1.0), np.ones(1), np.array([[0.0, 0, 0, 1]]))
    worst = [opposite.terms[name] for name in ("accuracy", "duration", "overshoot")]
    np.testing.assert_allclose(worst, -1, rtol=1e-11)


@pytest.mark.parametrize("judge", ["orientation", "gaze"])
def test_failed_saccades_get_the_worst_of_each_term(judge: str) -> None:
    broken: dict[str, Any] = {"failed": np.array([False, True])}
    for name in ("settling_time_s", "overshoot", "skewness", "amplitude_deg", "peak_velocity_deg_s"):
        broken[name] = np.array([0.1, np.nan])
    for name in ("final", "at_settling"):
        broken[name] = np.array([[1.0, 0, 0, 0], [np.nan] * 4])
    for energy in (np.nan, np.inf, 3e5):
        found = reward(measures(2, **broken), np.array([3e5, energy]), np.tile(FORWARD, (2, 1)), judge)
        assert (found.terms["accuracy"][1], found.terms["duration"][1], found.terms["overshoot"][1]) == (-1, -1, -10)
        for value in (*found.terms.values(), found.total):
            assert np.isfinite(value).all()
        spent = 3e5 if energy == 3e5 else 0.0
        assert found.total[1] == pytest.approx(-(2.66e7 + 5.12e5 + 2.3e9) - spent, rel=1e-14)
        assert found.total[0] == pytest.approx(-3e5 - 5.12e5 * (1 - 1 / 1.06) - 2.3e7, rel=1e-12)


def test_the_other_judge_looks_at_the_gaze() -> None:
    """Torsion does not count; elsewhere its accuracy is sin^2 of half the angle between directions."""
    rng = np.random.default_rng(1)
    at, target = (from_euler(*rng.uniform(-60, 60, (3, 30))) for _ in range(2))
    angle = np.arccos((gaze(at) * gaze(target)).sum(axis=-1))
    found = reward(measures(30, at_settling=at), np.zeros(30), target, "gaze")
    np.testing.assert_allclose(found.terms["accuracy"], -(np.sin(angle / 2) ** 2), rtol=1e-9)
    twisted = from_euler([10.0], [-5.0], [30.0])
    aim = from_euler([10.0], [-5.0], [0.0])
    assert reward(measures(1, at_settling=twisted), np.zeros(1), aim, "gaze").terms["accuracy"][0] > -1e-15
    assert reward(measures(1, at_settling=twisted), np.zeros(1), aim).terms["accuracy"][0] < -0.06


def test_an_excess_of_force_costs_as_much() -> None:
    """One below 0 is rounding; a saccade that failed has none, and where no elastics are known nobody has."""
    target = np.tile(FORWARD, (5, 1))
    found = reward(measures(5), np.zeros(5), target, "gaze", np.array([0.25, 3.0, -1e-9, np.nan, np.inf]))
    assert found.terms["force"].tolist() == found.total.tolist() == [-0.25, -3.0, 0.0, 0.0, 0.0]
    assert reward(measures(5), np.zeros(5), target, "gaze").terms["force"].tolist() == [0.0] * 5


def test_columns_of_a_reward_add_up() -> None:
    found = Reward({"speed": np.array([-1.0, -2.0]), "grace": np.array([-0.5, 0.0])}, np.array([-7.0, -12.0]))
    columns = {name: column.tolist() for name, column in plain_reward(found, {"speed": 6.0, "grace": 2.0}).items()}
    assert columns == {"reward": [-7, -12], "reward_speed": [-6, -12], "reward_grace": [-1, 0]}


@pytest.mark.parametrize("name", ["accuracy", "energy", "duration", "overshoot"])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_bad_weights_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match="finite, not negative"):
        JUDGE.weights(WEIGHTS | {name: value})
    assert JUDGE.weights(WEIGHTS | {name: 0.0})[name] == 0


def test_weights_are_those_of_the_terms() -> None:
    assert JUDGE.weights([1, 2, 3, 4]) == {"accuracy": 1, "energy": 2, "duration": 3, "overshoot": 4}
    for wrong in ([1, 2, 3], [1, 2, 3, 4, 5], {"accuracy": 1.0}, WEIGHTS | {"beauty": 1.0}):
        with pytest.raises(InputError, match="has 4 weights, accuracy, energy, duration, overshoot"):
            JUDGE.weights(wrong)
    with pytest.raises(InputError, match="not all 0"):
        JUDGE.weights([0, 0, 0, 0])


def test_a_judge_is_found_by_what_it_looks_at_and_needs_no_force() -> None:
    """`JUDGES[targets.of]`, with weights for a task whose weights do not matter, on any plant."""
    for judge in JUDGES.values():
        assert (JUDGES[judge.of].of, JUDGES[judge.of].names) == (judge.of, judge.names)
        assert judge.weights(judge.any_weights).get("force", 0.0) == 0


# --- the task: from command to reward -------------------------------------------------------------


def chosen(amplitude: Array, B: Array, KD: Array, k0: Array, task: SaccadeTask = TASK) -> tuple[State, Array, Array]:
    """Start, action and target of symmetric saccades [deg], the action given by K (D - F)."""
    start, target = horizontal(-amplitude / 2, amplitude / 2, task)
    D = start.motor[:, 0] + KD / K
    return start, np.stack([B, D, k0], axis=-1), target


def test_reward_of_a_saccade_from_the_definitions() -> None:
    """Variant 1 at k0 = w0: theta - theta0 = K (D - F) (1 - (1 + B t) e^(-B t)), so every term is plain."""
    B, KD = np.array([35.0, 60.0, 20.0]), np.array([30.0, 19.0, -41.0])
    amplitude = np.array([30.0, 20.0, -40.0])
    found = TASK.perform(*chosen(amplitude, B, KD, np.full(3, 17.5)))
    x = 6.638352067993813  # (1 + x) e^(-x) = 0.01
    assert (1 + x) * np.exp(-x) == pytest.approx(0.01, rel=1e-14)
    np.testing.assert_allclose(found.measures.settling_time_s, x / B, rtol=1e-12)
    np.testing.assert_allclose(found.measures.peak_velocity_deg_s, np.abs(KD) * B / np.e, rtol=1e-12)
    np.testing.assert_allclose(found.measures.skewness, (x - 1) / x, rtol=1e-10)
    missed = amplitude - 0.99 * KD
    np.testing.assert_allclose(found.reward.terms["accuracy"], -(np.sin(np.deg2rad(missed) / 2) ** 2), rtol=1e-9)
    A = KD / K * B**2 / 17.5  # 4.9, and 4.36 at its lower limit
    energy = A**2 * (1 / (2 * B) - 2 * (B - 17.5) / (4 * B**2) + 2 * (B - 17.5) ** 2 / (8 * B**3))
    np.testing.assert_allclose(found.reward.terms["energy"], -energy, rtol=1e-12)
    np.testing.assert_allclose(found.reward.terms["duration"], -(1 - 1 / (1 + 0.6 * x / B)), rtol=1e-12)
    np.testing.assert_allclose(found.reward.terms["overshoot"], 0, atol=1e-14)


@pytest.mark.parametrize("pulse", PULSES)
def test_closed_form_and_samples_are_judged_alike(pulse: str) -> None:
    """The reward of the low-pass plant, from its closed form and from its sampled trajectory."""
    rng = np.random.default_rng(len(pulse))
    task = SaccadeTask.of_case(LinearPlant(Surrogate(K, 17.5, eye="thesis"), step_s=1e-4), Case(pulse), weights=WEIGHTS)
    amplitude = rng.uniform(10, 60, 12)
    start, action, target = chosen(
        amplitude, rng.uniform(20, 70, 12), amplitude * rng.uniform(0.9, 1.1, 12), rng.uniform(10, 30, 12), task
    )
    outcome = task.perform(start, action, target)
    command = outcome.command
    final = from_yaw(K * command.D[:, 0])
    sampled = measure(task.plant.move(command, horizon_s=1.2).trajectory(), final)
    other = reward(sampled, command.energy(), target)
    np.testing.assert_allclose(outcome.reward.total, other.total, rtol=1e-5)


def test_pulse_step_of_an_action() -> None:
    """F is where the motor rests; C as the case says."""
    start, target = horizontal([5.0, -10.0], [17.0, -4.0])
    action = np.array([[35.0, 12.0, 17.0], [60.0, -3.0, 9.0]])
    for pulse, C in (("1", None), ("2", None), ("2", 20.0), ("2", "varying"), ("3", None), ("3", "varying")):
        actions = SaccadeTask.of_case(TASK.plant, Case(pulse, C), weights=WEIGHTS).actions
        command = actions.command(start, target, action)
        np.testing.assert_allclose(command.F[:, 0], [5 / K, -10 / K], rtol=1e-12)
        np.testing.assert_array_equal(np.concatenate([command.B, command.D, command.k0], axis=1), action)
        assert command.pulse == pulse
        if C == "varying":
            expected = varying_C(PULSES[pulse], command.D - command.F, command.B, command.k0)
        else:
            fixed = {"1": 0.0, "2": 85.0, "3": 3.6}[pulse]  # thesis 5.2.1, 5.3.1
            expected = np.full((2, 1), C if C is not None else fixed)
        np.testing.assert_array_equal(command.C, expected)
    slow = SaccadeTask.of_case(TASK.plant, Case("2", "varying"), weights=WEIGHTS, speed_limit=3600.0)
    limited = slow.actions.command(start, target, action)
    np.testing.assert_array_equal(limited.C, varying_C(PULSES["2"], limited.step, limited.B, limited.k0, 3600.0))


def test_motors_that_are_not_driven_are_told_to_stay() -> None:
    task = SaccadeTask.of_case(MujocoPlant(threads=1), "1", weights=WEIGHTS)
    start, target = horizontal([5.0], [15.0], task)
    command = task.actions.command(start, target, np.array([[35.0, 9.0, 17.0]]))
    assert command.D.tolist() == [[0.0, 9.0, 0.0]]
    assert np.ptp(command.sample(0.001, 200)[0, :, [0, 2]], axis=1).tolist() == [0, 0]


@pytest.mark.parametrize(
    ("case", "options", "message"),
    [
        ("1", {"driven": ("motor9",)}, r"'lpf' has the motors motor2; cannot drive \['motor9'\]"),
        (Case("2", "variable"), {}, "onset rate C must be a number .* got 'variable'; or 'varying'"),
        (Case("2", -1.0), {}, "onset rate C must be a number .* got -1"),
        (Case("1", 3.0), {}, "has no onset rate C"),
        (Case("9"), {}, "unknown pulse '9'"),
        ("9", {}, "unknown case '9'"),
        ("1", {"targets": "sideways"}, "unknown target 'sideways'"),
        ("1", {"judge": "mother"}, "unknown judge 'mother'"),
        ("1", {"band": 0.0}, "band must be a number .* got 0; it is a share"),
        ("1", {"band": 1.0}, "band must be a number .* got 1; it is a share"),
        ("2-varying", {"speed_limit": 0.0}, "speed limit must be a number .* deg/s, got 0"),
        ("1", {"horizon_s": -1.0}, "horizon must be a number .* s, got -1"),
    ],
)
def test_bad_tasks_are_refused(case: str | Case, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        SaccadeTask.of_case(TASK.plant, case, weights=WEIGHTS, **options)


def test_mujoco_task_lands_settles_and_saturates() -> None:
    task = SaccadeTask.of_case(MujocoPlant(threads=1), "1", weights=WEIGHTS)
    start, target = horizontal([-10.0, -10.0], [10.0, 10.0], task)
    likely = task.actions.likely(target)
    assert np.isnan(likely[:, [0, 2]]).all()  # only D is known
    D = likely[:, 1]
    np.testing.assert_allclose(D, 6.83, atol=0.1)  # 10 deg / 1.464, the author's gain of small steps
    action = np.stack([[40.0, 80.0], D + np.array([0, 5]), [17.0, 5.0]], axis=-1)
    outcome = task.perform(start, action, target)
    assert outcome.saturated.tolist() == [False, True]  # B = 80 with k0 = 5 sends the motor past 80 deg
    trajectory = task.trajectory(start, action, target)
    assert trajectory.motor[0].max() < 80
    assert trajectory.motor[1].max() == 80
    np.testing.assert_allclose(outcome.measures.amplitude_deg[0], 20, atol=1e-6)
    assert outcome.measures.settled[0]
    assert outcome.reward.terms["accuracy"][0] > -1e-5
    energy, told = -outcome.reward.terms["energy"], outcome.command.energy()
    np.testing.assert_allclose(energy[0], told[0], rtol=1e-15)
    assert energy[1] < told[1]  # a motor at its stop spends nothing on what it was told beyond


@pytest.mark.parametrize("plant", [TASK.plant, MujocoPlant(threads=1)], ids=["lpf", "mujoco"])
def test_an_action_that_is_none_fails_alone(plant: Any) -> None:
    """A policy that returns NaN for one saccade gets the worst reward there, and the others theirs."""
    task = SaccadeTask.of_case(plant, "1", weights=WEIGHTS)
    start, target = horizontal([0.0, 0.0, -5.0], [5.0, 10.0, 15.0], task)
    action = np.array([[35.0, 4.0, 17.5], [np.nan] * 3, [50.0, 9.0, 15.0]])
    found = task.perform(start, action, target)
    keep = np.array([0, 2])
    alone = task.perform(start[keep], action[keep], target[keep])
    assert found.measures.failed.tolist() == [False, True, False]
    np.testing.assert_allclose(found.reward.total[keep], alone.reward.total, rtol=1e-9)
    assert found.reward.total[1] < -2.5e8


# --- the best action ------------------------------------------------------------------------------

# Optimal actions of variant 1 by an independent program: weights (2.66e7, 1, 5.12e5, 2.3e8), band 1 %, symmetric.
AMPLITUDE = np.array([5.0, 10.0, 20.0, 30.0, 45.0, 60.0])
TABLE_B = np.array([80, 64.45, 43.67, 34.88, 27.45, 22.72])
TABLE_KD = np.array([4.586, 9.581, 19.840, 30.002, 45.203, 60.383])
TABLE_K0 = np.array([17.500, 17.500, 17.499, 17.487, 17.350, 16.862])
TABLE_COST = np.array([28940, 40227, 57314, 70546, 87028, 101192])


@functools.cache
def table_optimum() -> Optimum:
    start, _, target = chosen(AMPLITUDE, TABLE_B, TABLE_KD, TABLE_K0)
    return find_optimum(TASK, start, target, np.random.default_rng(0), effort=2)


def test_actions_of_the_table_cost_what_it_says() -> None:
    cost = -TASK.perform(*chosen(AMPLITUDE, TABLE_B, TABLE_KD, TABLE_K0)).reward.total
    np.testing.assert_allclose(cost, TABLE_COST, rtol=0, atol=0.5)


def test_a_lone_saccade_is_enough_for_the_basin_that_is_the_best() -> None:
    """Case 2-varying: B = 70 is 2.3 % short, and no saccade beside it tells."""
    task = SaccadeTask.of_case(TASK.plant, "2-varying")
    start, target = horizontal([-13.911318], [14.538076], task)
    stuck = task.perform(start, np.array([[70.12327804, 9.81393982, 17.50011878]]), target).reward.total[0]
    found = [find_optimum(task, start, target, np.random.default_rng(seed)).reward[0] for seed in range(4)]
    assert max(found) - min(found) < 1e-4 * abs(max(found))
    assert stuck < max(found) * 1.02


def test_the_search_finds_the_table() -> None:
    """The cost is flat in B near its optimum: 0.2 in B is 1e-5 of it, which is the table's own search."""
    found = table_optimum()
    np.testing.assert_allclose(-found.reward, TABLE_COST, rtol=1e-4)
    assert (-found.reward < TABLE_COST + 0.5).all()
    B, D, k0 = found.action.T
    np.testing.assert_allclose(B, TABLE_B, atol=0.25)
    np.testing.assert_allclose(K * D + AMPLITUDE / 2, TABLE_KD, atol=0.01)
    np.testing.assert_allclose(k0, TABLE_K0, atol=0.012)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_default_search_reaches_the_table_from_any_seed(seed: int) -> None:
    start, _, target = chosen(AMPLITUDE, TABLE_B, TABLE_KD, TABLE_K0)
    found = find_optimum(TASK, start, target, np.random.default_rng(seed))
    np.testing.assert_allclose(-found.reward, TABLE_COST, rtol=1e-4)


def test_the_found_reward_is_that_of_the_found_action() -> None:
    found = table_optimum()
    start, _, target = chosen(AMPLITUDE, TABLE_B, TABLE_KD, TABLE_K0)
    np.testing.assert_allclose(TASK.perform(start, found.action, target).reward.total, found.reward, rtol=1e-14)


@pytest.mark.parametrize("index", [1, 3])
def test_scipy_finds_no_better(index: int) -> None:
    amplitude = AMPLITUDE[index : index + 1]
    start, _, target = chosen(amplitude, *(np.ones((3, 1))))

    def cost(x: Array) -> Array:
        n = x.shape[1]
        rows = np.zeros(n, int)
        total = TASK.perform(start[rows], np.ascontiguousarray(x.T), target[rows]).reward.total
        return np.asarray(-total)

    bounds = [B_RANGE, (-80.0, 80.0), K0_RANGE]
    best = differential_evolution(
        cost, bounds, vectorized=True, updating="deferred", popsize=25, maxiter=150, tol=1e-10, rng=1, polish=False
    )
    ours = -table_optimum().reward[index]
    assert best.fun == pytest.approx(ours, rel=1e-4)  # and it is no worse than ours by chance
    assert (np.abs(best.x - table_optimum().action[index]) < [0.3, 0.01, 0.01]).all()


def test_the_weights_make_the_chosen_saccade_optimal() -> None:
    """Thesis 4.4.5: 0 to 30 deg, B = 35, D = 20.33, k0 = 17.5."""
    start, target = horizontal([0.0], [30.0])
    found = find_optimum(TASK, start, target, np.random.default_rng(3), effort=2).action[0]
    assert (np.abs(found - [35, 20.33, 17.5]) < [0.25, 0.01, 0.02]).all()


def random_pairs(count: int) -> tuple[State, Array]:
    return TASK.targets.draw(count, np.random.default_rng(11))


def test_another_search_finds_no_better() -> None:
    """45 random pairs, other seed, three times as long."""
    start, target = random_pairs(45)
    found = find_optimum(TASK, start, target, np.random.default_rng(1))
    other = find_optimum(TASK, start, target, np.random.default_rng(2), effort=3)
    gap = (other.reward - found.reward) / np.abs(other.reward)
    assert gap.max() < 1e-3
    low, high = TASK.actions.low, TASK.actions.high
    assert ((found.action >= low) & (found.action <= high)).all()


def test_no_random_action_is_better() -> None:
    """30 000 actions, half of them landing near the target."""
    start, target = random_pairs(5)
    best = find_optimum(TASK, start, target, np.random.default_rng(1)).reward
    rng = np.random.default_rng(3)
    for i in range(5):
        rows = np.full(6000, i)
        action = rng.uniform([18, -80, 5], [80, 80, 40], (6000, 3))
        action[::2, 1] = rng.normal(TASK.actions.likely(target[[i]])[0, 1], 0.3, 3000)
        action[::2, 2] = rng.normal(17.5, 0.3, 3000)
        assert TASK.perform(start[rows], action, target[rows]).reward.total.max() < best[i]


def test_same_generator_same_optimum() -> None:
    start, target = random_pairs(4)

    def search(seed: int) -> Optimum:
        return find_optimum(TASK, start, target, np.random.default_rng(seed), effort=0.1)

    one, same, other = search(5), search(5), search(6)
    np.testing.assert_array_equal(one.action, same.action)
    np.testing.assert_array_equal(one.reward, same.reward)
    assert (one.action != other.action).any()


def test_the_search_on_mujoco() -> None:
    """One search on the simulator: near the low-pass optimum, and better than its action."""
    task = SaccadeTask.of_case(MujocoPlant(), "1", weights=WEIGHTS, horizon_s=0.3)
    start, target = horizontal([-10.0], [10.0], task)
    found = find_optimum(task, start, target, np.random.default_rng(0), effort=0.5)
    B, D, k0 = found.action[0]
    rests = float(task.actions.likely(target)[0, 1])
    of_low_pass = np.array([[43.67, rests, 17.5]])
    assert found.reward[0] > task.perform(start, of_low_pass, target).reward.total[0]
    assert 41 < B < 47
    assert 6.6 < D < rests  # short of the target, like its own band around the end
    assert 17 < k0 < 19


def test_a_search_counts_and_tells_what_it_does() -> None:
    start, target = random_pairs(2)
    shares: list[float] = []
    performed = 0

    class Counted(LinearPlant):
        def move(self, command: Any, *given: Any) -> Movement:
            nonlocal performed
            performed += len(command)
            return super().move(command, *given)

    found = find_optimum(
        replace(TASK, plant=Counted()), start, target, np.random.default_rng(0), effort=0.2, progress=shares.append
    )
    assert found.evaluations == performed
    assert shares == sorted(shares)
    assert (shares[0] > 0, shares[-1]) == (True, 1)
    for effort in (0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match=r"effort of a search must be a number from 0.01 to 1000"):
            find_optimum(TASK, start, target, np.random.default_rng(0), effort=effort)


def test_a_search_takes_a_fifth_of_the_saccades_it_took() -> None:
    """Differential evolution and its scans performed 3648 a saccade."""
    start, target = random_pairs(10)
    found = find_optimum(TASK, start, target, np.random.default_rng(0))
    assert found.evaluations / 10 < 3648 / 5


class Rough(LinearPlant):
    """The thesis' eye with a twin that alone may be asked often."""

    asked = 0

    def __init__(self, twin: LinearPlant) -> None:
        super().__init__()
        self.quicker = twin

    def twin(self) -> LinearPlant:
        return self.quicker

    def move(self, command: Any, *given: Any) -> Movement:
        Rough.asked += len(command)
        return super().move(command, *given)


def test_what_a_quicker_twin_finds_is_judged_on_the_plant() -> None:
    start, target = random_pairs(6)
    best = find_optimum(TASK, start, target, np.random.default_rng(1))
    for w0, most, loss in ((17.5, 1, 1e-12), (17.5 * (1 + 1e-6), 1, 1e-4), (17.7, 150, 1e-3)):
        Rough.asked = 0
        task = replace(TASK, plant=Rough(LinearPlant(Surrogate(K, w0, eye="thesis"))))
        found = find_optimum(task, start, target, np.random.default_rng(1))
        assert Rough.asked <= 6 * most  # more than one a saccade where the twin is another eye
        own = TASK.perform(start, found.action, target).reward.total
        np.testing.assert_array_equal(found.reward, own)
        np.testing.assert_allclose(found.reward, best.reward, rtol=loss)


def test_simplices_climb_a_known_hill() -> None:
    """Of each simplex another: a peak inside the box, on a face, and a ridge with a cliff on one side; five numbers."""
    top = np.array([[0.3, 0.6, 0.5, 0.2, 0.9], [1.3, 0.5, 0.5, -0.2, 0.4]])

    def hill(x: Array, which: NDArray[np.intp]) -> Array:
        off = x - top[which]
        return np.asarray(-(off**2).sum(axis=1))

    points, value = climb(hill, around(np.full((2, 5), 0.5), np.full(5, 0.1), np.random.default_rng(0)), 400)
    np.testing.assert_allclose(points[:, 0], np.clip(top, 0, 1), atol=1e-4)
    assert (np.diff(value, axis=1) <= 0).all()
    np.testing.assert_array_equal(value.ravel(), hill(points.reshape(-1, 5), np.repeat([0, 1], 6)))

    def cliff(x: Array, _: NDArray[np.intp]) -> Array:
        edge = x[:, 1] - 0.4 - 0.2 * (x[:, 0] - 0.7)
        return np.asarray(-((x[:, 0] - 0.7) ** 2) - np.where(edge < 0, 100.0, 1.0) * np.abs(edge))

    best, random = np.array([[0.5, 0.6]]), np.random.default_rng(0)
    for step in (
        0.1,
        0.05,
        0.02,
    ):  # begun anew, as a search does
        best = climb(cliff, around(best, np.full(2, step), random), 60)[0][:, 0]
    np.testing.assert_allclose(best, [[0.7, 0.4]], atol=5e-3)


def test_a_saccade_of_no_size_costs_nothing() -> None:
    start, target = horizontal([12.0], [12.0])
    outcome = TASK.perform(start, np.array([[35.0, start.motor[0, 0], 17.5]]), target)
    assert outcome.reward.total[0] == pytest.approx(0, abs=1e-6)
    assert not outcome.measures.failed[0]
    assert isinstance(outcome.reward, Reward)
    assert isinstance(outcome.command, PulseStep)


def test_starts_and_targets_are_uniform_over_the_range() -> None:
    start, target = TASK.targets.draw(20_000, np.random.default_rng(0))
    yaws = [to_euler(q)[0] for q in (start.orientation, target)]
    for yaw in yaws:
        assert -YAW_LIMIT_DEG <= yaw.min() < -34.9
        assert 34.9 < yaw.max() <= YAW_LIMIT_DEG
        np.testing.assert_allclose(np.histogram(yaw, 7, (-35, 35))[0], 20_000 / 7, rtol=0.06)
    assert abs(np.corrcoef(*yaws)[0, 1]) < 0.02
    np.testing.assert_allclose(start.motor[:, 0], yaws[0] / K, rtol=1e-9)


def test_a_task_is_its_identity() -> None:
    """Written and restored it is the same task, on the same or on another plant."""
    plant = MujocoPlant(threads=1)
    task = SaccadeTask.of_case(plant, "2-varying", weights=WEIGHTS, targets="vertical", band=0.02, speed_limit=5000.0)
    again = SaccadeTask.restore(task.identity())
    assert again.identity() == task.identity()
    moved = SaccadeTask.restore(TASK.identity(), plant)
    assert moved.plant is plant
    assert moved.identity()["actions"]["driven"] == ["motor2"]
    with pytest.raises(InputError, match="4 weights"):
        SaccadeTask.restore({**TASK.identity(), "weights": None})
    with pytest.raises(InputError, match="no task of this version"):
        SaccadeTask.restore({**TASK.identity(), "band": None})
