"""Any input, and the laws that hold for all: plants by the registry, commands, motors, measures, rewards, angles.

Short in the suite; `make fuzz` looks much longer (tests/fuzzing.py).
"""

import warnings
from collections.abc import Iterator
from functools import cache
from math import inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from fuzzing import budget
from orient_eye import listing, rotations
from orient_eye.commands import Sampled
from orient_eye.commands.exponentials import impulse_response
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.commands.pulses import PULSES, keeps_speed_limit, varying_C
from orient_eye.environments.batch import SaccadeBatch, log_reward
from orient_eye.errors import InputError
from orient_eye.motor import Motor, ranges
from orient_eye.movement import Movement, oblique
from orient_eye.movement.measures import Measures, measure, measure_angle
from orient_eye.movement.tail import tail_of
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import PLANTS, Plant, make_plant
from orient_eye.plants.limited_motor import follow, peaks
from orient_eye.plants.linear_response import LinearResponse, measure_closed_form, sampled_response, second_order_poles
from orient_eye.state import State, as_numbers, unit
from orient_eye.task.judge import JUDGES
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import make_targets

Array = NDArray[np.float64]
WILD = (0.0, -0.0, nan, inf, -inf, 1e300, -1e300, 1e160, -1e160, 1.7e308, 1e9, 1e10, -1e6, 1e-160, 1e-200, 5e-324)
anything = st.one_of(st.floats(), st.sampled_from(WILD))
share = st.floats(-1, 1)
few = st.integers(1, 3)


@pytest.fixture(autouse=True)
def warnings_are_errors() -> Iterator[None]:
    """A number that overflows on its way is told by its saccade's failure, and by nothing else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield


@cache
def plant_of(name: str) -> Plant:
    return make_plant(name)


def reach(plant: Plant) -> Array:
    return np.array([min(-motor.working[0], motor.working[1]) for motor in plant.motors])


def some(shape: tuple[int, ...], elements: st.SearchStrategy[float] = share) -> st.SearchStrategy[Array]:
    return arrays(float, shape, elements=elements, fill=st.nothing())


@st.composite
def spoilt(draw: st.DrawFn, values: Array) -> Array:
    """Values, a few of which are anything."""
    values = np.array(values)
    for _ in range(draw(st.integers(0, 2)) if values.size else 0):
        values.flat[draw(st.integers(0, values.size - 1))] = draw(anything)
    return values


def smooth(draw: st.DrawFn, shape: tuple[int, ...], samples: int) -> Array:
    """Paths (saccades, time, n) of a few waves, in -1 .. 1."""
    t = np.linspace(0, 1, samples)[:, None]
    waves = [draw(some((shape[0], 1, shape[1]))) * np.sin(k * np.pi * t / 2) for k in (1, 3)]
    return np.asarray(sum(waves) / 2 + draw(some((shape[0], 1, shape[1]))) / 4)


# --- plants ---------------------------------------------------------------------------------------


@st.composite
def performed(draw: st.DrawFn) -> tuple[Plant, Any, State, int]:
    """A plant, a written or made command for it, starts, and how many samples the movement has."""
    plant = plant_of(draw(st.sampled_from(sorted(PLANTS))))
    count, motors, samples = draw(st.integers(0, 3)), len(plant.motors), draw(st.integers(1, 25))
    reaches = reach(plant)
    F = 0.2 * reaches * draw(some((count, motors)))
    state = [plant.rest(F), F, np.zeros((count, 3))]
    if draw(st.booleans()):
        state = [draw(spoilt(part)) for part in state]
    if draw(st.booleans()):
        path = F[:, None] + 0.2 * reaches * smooth(draw, (count, motors), samples)
        return plant, Sampled(draw(spoilt(path)), plant.step_s), State(*state), samples
    D = 0.3 * reaches * draw(some((count, motors)))
    B, k0 = 45 + 25 * draw(some((count, motors))), 15 + 10 * draw(some((count, motors)))
    F, B, D, k0 = (draw(spoilt(part)) for part in (F, B, D, k0))
    assume(not ((B <= 0).any() or (k0 <= 0).any()))
    return (
        plant,
        PulseStep(F, B, D, k0, *draw(st.sampled_from([("1", None), ("2", 85.0), ("3", 3.6)]))),
        State(*state),
        samples,
    )


def whole_or_failed(movement: Movement, count: int, samples: int) -> Measures:
    """Of each saccade every number, or none."""
    trajectory = movement.trajectory()
    assert trajectory.orientation.shape == (count, samples, 4)
    told = [trajectory.orientation, trajectory.angular_velocity, trajectory.motor]
    for values in [*told, *([] if trajectory.tension is None else [trajectory.tension])]:
        rows = values.reshape(count, np.prod(values.shape[1:]))
        np.testing.assert_array_equal(np.isfinite(rows).all(axis=1), ~trajectory.failed)
        np.testing.assert_array_equal(np.isnan(rows).all(axis=1), trajectory.failed)
    low, high = ranges(trajectory.motors).T
    assert ((trajectory.motor >= low) & (trajectory.motor <= high))[~trajectory.failed].all()
    assert np.allclose(np.linalg.norm(trajectory.orientation, axis=-1)[~trajectory.failed], 1, atol=1e-9)
    for of in ("orientation", "gaze"):
        found = movement.measure(of=of)  # type: ignore[arg-type]  # of a loop
        np.testing.assert_array_equal(found.failed, trajectory.failed)
        good = found[~found.failed]
        for values in (good.amplitude_deg, good.settling_time_s, good.peak_velocity_deg_s, good.overshoot):
            assert (np.isfinite(values) & (values >= 0)).all()
        assert np.isnan(found.settling_time_s[found.failed]).all()
        assert np.isfinite(good.at_settling).all()
    energy = movement.energy()
    assert energy.shape == (count,)
    assert (np.isfinite(energy) & (energy >= 0))[~trajectory.failed].all()
    return found


@budget(60)
@given(performed())
def test_any_saccade_is_whole_or_failed_and_alone_with_it(given_: tuple[Plant, Any, State, int]) -> None:
    """Refused, which is told of written commands alone; else as it would be by itself, bit for bit."""
    plant, command, start, samples = given_
    horizon_s = (samples - 1) * plant.step_s or None
    try:
        movement = plant.move(command, start, horizon_s)
    except InputError as error:
        told = str(error)
        assert isinstance(command, Sampled) or "turns the eye in" in told  # raised or not, by the example
        return
    trajectory = movement.trajectory()
    whole_or_failed(movement, len(command), len(trajectory.time))
    for i in range(len(command)):
        one = Sampled(command.positions[[i]], plant.step_s) if isinstance(command, Sampled) else command[np.array([i])]
        own = plant.move(one, start[[i]], horizon_s).trajectory()
        np.testing.assert_array_equal(own.orientation[0], trajectory.orientation[i])
        np.testing.assert_array_equal(own.motor[0], trajectory.motor[i])
        assert own.failed[0] == trajectory.failed[i]
    for judge in JUDGES.values():
        target = np.tile(rotations.FORWARD, (len(command), 1))
        measures = movement.measure(of=judge.of)
        reward = judge.reward(movement, measures, target, dict.fromkeys(judge.names, 1.0))
        for term in reward.terms.values():
            assert (np.isfinite(term) & (term <= 0)).all()
        if measures.failed.any():
            assert (reward.terms["accuracy"][measures.failed] == -1).all()


@budget(25)
@given(st.sampled_from(sorted(PLANTS)), st.data())
def test_left_is_right_in_a_mirror_and_later_is_the_same(name: str, data: st.DataObject) -> None:
    """Of the motors that turn the eye about one axis alone; MuJoCo's servos yield by 2e-5 deg."""
    plant = plant_of(name)
    targets = make_targets(None, plant)
    index = [motor.name in targets.driven for motor in plant.motors]
    command = np.zeros((2, 40, len(plant.motors)))
    command[0][:, index] = 0.2 * reach(plant)[index] * smooth(data.draw, (1, sum(index)), 40)[0]
    command[1] = -command[0]
    found = plant.move(command).trajectory()
    angle = targets.angles_of(found.orientation.reshape(-1, 4)).reshape(2, -1)
    np.testing.assert_allclose(angle[1], -angle[0], atol=1e-4)
    later = plant.move(np.concatenate([np.repeat(command[:, :1], 10, axis=1), command], axis=1)).trajectory()
    apart = rotations.angle_between(later.orientation[:, 10:], found.orientation)
    assert apart.max() < 1e-3


@budget(15)
@given(st.sampled_from(sorted(PLANTS)), st.data())
def test_what_rests_is_held(name: str, data: st.DataObject) -> None:
    plant = plant_of(name)
    motor = 0.4 * reach(plant) * data.draw(some((2, len(plant.motors))))
    every = tuple(each.name for each in plant.motors)
    orientation = plant.rest(motor)
    held = plant.held(orientation, every)
    assert rotations.angle_between(plant.rest(held), orientation).max() < 1e-5
    force = plant.force(orientation, motor)
    assert force is None or (force >= 0).all()


# --- commands -------------------------------------------------------------------------------------

rate = st.floats(1e-2, 1e4)


def test_a_motor_that_stands_and_has_no_rate_fails_too() -> None:
    for rates in ({"B": [[1.0]], "k0": [[1e300]]}, {"B": [[np.nan]], "k0": [[1.0]]}):
        command = PulseStep(F=[[0.0]], D=[[0.0]], **rates)
        assert np.isnan(command.position([0.0, 0.01])).all()
        assert np.isnan(command.rate([0.0, 0.01])).all()


@budget(100)
@given(st.sampled_from(sorted(PULSES)), st.data())
def test_pulse_steps_of_anything(name: str, data: st.DataObject) -> None:
    shape = data.draw(few), data.draw(few)
    parts = {key: data.draw(some(shape, anything)) for key in ("F", "B", "D", "k0")}
    C = None if PULSES[name].onset is None else data.draw(anything)
    try:
        command = PulseStep(**parts, pulse=name, C=C)
    except InputError as error:
        assert "must be positive" in str(error)  # noqa: PT017  # raised or not, by the example
        return
    energy, position = command.energy(), command.sample(0.001, 20)
    assert not (energy < 0).any()
    known = np.isfinite(position).all(axis=(1, 2))
    np.testing.assert_allclose(position[known, 0], np.asarray(command.F)[known], rtol=1e-9, atol=1e-9)
    rate_of = command.rate([0.0, 0.01])
    assert np.isfinite(rate_of[known]).all()


@budget(60)
@given(st.sampled_from(sorted(PULSES)), st.data())
def test_pulse_steps_are_linear_in_their_step(name: str, data: st.DataObject) -> None:
    """And go from F to D, whatever their rates."""
    shape = (2, 2)
    F, D = (np.round(40 * data.draw(some(shape)), 9) for _ in range(2))
    B, k0 = data.draw(some(shape, rate)), data.draw(some(shape, rate))
    onset = PULSES[name].onset
    C = None if onset is None else varying_C(PULSES[name], D - F, B, k0)
    command, mirrored, doubled = (PulseStep(s * F, B, s * D, k0, name, C) for s in (1.0, -1.0, 2.0))
    t = np.linspace(0, 0.5, 12)
    np.testing.assert_array_equal(mirrored.position(t), -command.position(t))
    np.testing.assert_array_equal(doubled.position(t), 2 * command.position(t))
    np.testing.assert_array_equal(doubled.energy(), 4 * command.energy())
    ends = command.position([0.0, 60 / min(B.min(), k0.min(), *([] if C is None else [np.min(C)]), 1.0) + 60])
    np.testing.assert_array_equal(ends[:, 0], F)
    slow = np.minimum(B, k0) > 1
    np.testing.assert_allclose(ends[:, 1][slow], D[slow], rtol=0, atol=1e-6)
    if C is not None:
        fastest = np.abs(command.rate(np.linspace(0, 0.2, 300))).max(axis=1)
        keeps = keeps_speed_limit(PULSES[name], D - F, B, k0) & (k0 <= 2 * B + C)  # else 4.18 is not of the fastest
        assert (fastest <= 7200 * (1 + 1e-6))[keeps].all()


@budget(60)
@given(st.lists(rate, min_size=2, max_size=5), st.floats(-1e-6, 1e-6))
def test_any_poles_pass_a_step_wholly(poles: list[float], apart: float) -> None:
    """Also poles that nearly meet: the impulse response has the integral 1, and their order does not matter."""
    each = [np.array([pole]) for pole in (*poles[:-1], poles[0] * (1 + apart))]
    response = impulse_response(each)
    assert response.tail().jet(np.array([[0.0]]), 0)[0][0, 0] == pytest.approx(1, abs=1e-6)
    t = np.linspace(0, 3 / min(poles), 20)[None]
    (one,), (other,) = response.jet(t, 0), impulse_response(each[::-1]).jet(t, 0)
    np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6 * np.abs(one).max())


@budget(40)
@given(st.data())
def test_closed_form_and_samples_agree(data: st.DataObject) -> None:
    """Of linear eyes of any poles under any pulse-step."""
    poles: tuple[Any, ...] = (data.draw(st.floats(5, 300)),)
    if data.draw(st.booleans()):
        poles = second_order_poles(data.draw(st.floats(10, 300)), data.draw(st.floats(0.3, 3)))
    shape = (1, 1)
    command = PulseStep(
        *(np.full(shape, data.draw(st.floats(*ends))) for ends in ((-9, 9), (20, 90), (-9, 9), (4, 40)))
    )
    assume(abs(command.D - command.F).item() > 0.1)
    response = LinearResponse(1.5, poles, data.draw(st.floats(0, 0.02)), command)
    found = measure_closed_form(response)
    step_s, samples = 2e-4, 5000
    angle, speed = sampled_response(1.5, poles, response.dead_time, command.sample(step_s, samples)[..., 0], step_s)
    t = step_s * np.arange(samples)
    # Between samples the command is a straight line: off by h^2/8 of its bend, times 2.2, the most that a damping of
    # 0.3 makes of that (the integral of the absolute impulse response).
    bend = np.abs(np.diff(command.rate(t)[0, :, 0])).max() / step_s
    np.testing.assert_allclose(angle, response.angle(t[None]), rtol=0, atol=1.5 * 2.2 * step_s**2 / 8 * bend + 1e-9)
    sampled = measure_angle(t, angle, speed, response.final, "yaw", np.zeros(1, bool))
    assert sampled.overshoot[0] == pytest.approx(found.overshoot[0], abs=2e-2)
    assert sampled.peak_velocity_deg_s[0] == pytest.approx(found.peak_velocity_deg_s[0], rel=5e-2)


@budget(60)
@given(st.data())
def test_motors_keep_to_their_limits(data: st.DataObject) -> None:
    """Whatever they are told; in a mirror too. What they can do they do, and change nothing."""
    limits = [data.draw(st.one_of(st.none(), st.floats(1, 1e4))) for _ in range(2)]
    acceleration = data.draw(st.one_of(st.none(), st.floats(1e3, 1e6)))
    motors = [Motor(str(k), speed_limit=limit, acceleration_limit=acceleration) for k, limit in enumerate(limits)]
    told = 40 * data.draw(some((2, 30, 2)))
    start = told[:, 0] + data.draw(some((2, 2)))
    taken, limited = follow(told, motors, 0.001, start)
    assert np.isfinite(taken).all()
    np.testing.assert_array_equal(taken[~limited], told[~limited])
    np.testing.assert_array_equal(follow(-told, motors, 0.001, -start)[0], -taken)
    fastest, hardest = peaks(
        taken[limited], 0.001, np.where([limit or acceleration for limit in limits], start, told[:, 0])[limited]
    )
    for k, limit in enumerate(limits):
        assert limit is None or (fastest[:, k] <= limit * (1 + 1e-6)).all()
        assert acceleration is None or limit is None or (hardest[:, k] <= acceleration * (1 + 1e-6)).all()


# --- measures and rewards -------------------------------------------------------------------------


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    """Of orientations that turn smoothly, some of them failed."""
    count, samples = draw(few), draw(st.integers(1, 40))
    angles = 60 * smooth(draw, (count, 3), samples)
    orientation = rotations.from_euler(angles[..., 0], angles[..., 1] / 2, angles[..., 2] / 4)
    velocity = 300 * smooth(draw, (count, 3), samples)
    motor = 20 * smooth(draw, (count, 1), samples)
    failed = draw(arrays(bool, count))
    for values in (orientation, velocity, motor):
        values[failed] = nan
    return Trajectory(0.001 * np.arange(samples), orientation, velocity, motor, motor, None, failed, (Motor("a"),))


@budget(80)
@given(trajectories(), st.sampled_from(["orientation", "gaze"]))
def test_measures_of_any_movement(trajectory: Trajectory, of: Any) -> None:
    """In their bounds, in a mirror, a moment later, and of parts as of the whole."""
    final = trajectory.orientation[:, len(trajectory.time) // 2]
    found = measure(trajectory, final, of=of)
    np.testing.assert_array_equal(found.failed, trajectory.failed)
    good = found[~found.failed]
    assert ((good.settling_time_s >= 0) & (good.settling_time_s <= trajectory.time[-1] + 1e-12)).all()
    assert (good.overshoot >= 0).all()
    assert (good.amplitude_deg >= 0).all()
    assert not ((good.skewness < 0) | (good.skewness > 1 + 1e-9)).any()
    for i in range(len(trajectory)):
        one = measure(trajectory[i], final[[i]], of=of)
        np.testing.assert_allclose(one.settling_time_s[0], found.settling_time_s[i], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(one.overshoot[0], found.overshoot[i], rtol=1e-7, atol=1e-9)
    mirror = np.array([1.0, -1, 1, -1])
    mirrored = Trajectory(
        trajectory.time, mirror * trajectory.orientation, trajectory.angular_velocity * [-1, 1, -1], trajectory.command,
        trajectory.motor, None, trajectory.failed, trajectory.motors,
    )  # fmt: skip
    other = measure(mirrored, mirror * final, of=of)
    np.testing.assert_allclose(other.settling_time_s, found.settling_time_s, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(other.peak_velocity_deg_s, found.peak_velocity_deg_s, rtol=1e-9)


@budget(80)
@given(st.data())
def test_measures_of_an_angle_know_no_size_and_no_time(data: st.DataObject) -> None:
    """Twice the saccade has twice the speed and the same duration; one that begins later settles as much later."""
    samples = data.draw(st.integers(2, 60))
    angle = smooth(data.draw, (2, 1), samples)[..., 0]
    angle = angle - angle[:, :1]
    t, final = 0.001 * np.arange(samples), angle[:, -1]
    assume((np.abs(final) > 1e-3).all())
    speed, none = np.gradient(angle, 0.001, axis=1), np.zeros(2, bool)
    one = measure_angle(t, angle, speed, final, "yaw", none)
    twice = measure_angle(t, -2 * angle, -2 * speed, -2 * final, "yaw", none)
    np.testing.assert_allclose(twice.amplitude_deg, 2 * one.amplitude_deg, rtol=1e-12)
    np.testing.assert_allclose(twice.peak_velocity_deg_s, 2 * one.peak_velocity_deg_s, rtol=1e-12)
    np.testing.assert_allclose(twice.settling_time_s, one.settling_time_s, rtol=1e-9)
    np.testing.assert_allclose(twice.overshoot, one.overshoot, rtol=1e-9, atol=1e-12)
    waits = [np.pad(path, ((0, 0), (5, 0))) for path in (angle, speed)]
    later = measure_angle(0.001 * np.arange(samples + 5), *waits, final, "yaw", none)
    np.testing.assert_allclose(later.settling_time_s, one.settling_time_s + 0.005, rtol=1e-9)


@budget(60)
@given(trajectories())
def test_oblique_measures_and_tails_of_any_movement(trajectory: Trajectory) -> None:
    measures = measure(trajectory, of="gaze")
    failed = trajectory.failed
    for values in (oblique.path_deviation(trajectory, measures), oblique.torsion_blip(trajectory, measures)):
        assert values.shape == (len(trajectory),)
        assert not (values < 0).any()
        assert np.isnan(values[failed]).all()
    correlation = oblique.component_correlation(trajectory, measures)
    assert not (np.abs(correlation) > 1 + 1e-9).any()
    durations = oblique.component_durations(trajectory, measures)
    assert not ((durations < 0) | (durations > trajectory.time[-1] + 1e-12)).any()
    tail = tail_of(trajectory, trajectory.orientation[:, -1], np.nan_to_num(trajectory.motor[:, -1]))
    assert (tail.rate >= 0).all()
    assert (tail.doubt >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(tail.end, axis=1), 1, atol=1e-9)


class Asked:
    """A movement that is asked for its energy and its force."""

    def __init__(self, energy: Array, force: Array | None) -> None:
        self.energy, self.excess_force = (lambda: energy), (lambda: force)


@budget(80)
@given(st.sampled_from(sorted(JUDGES)), st.data())
def test_rewards_of_any_measures(name: str, data: st.DataObject) -> None:
    """At most 0, and a saccade that failed is worse in each term than any that did not."""
    judge, positive = JUDGES[name], st.floats(0, 1e6)
    failed = np.array([True, False])
    q = unit(data.draw(some((2, 4)).filter(lambda q: (np.abs(q).max(axis=1) > 0.01).all())))
    numbers = {
        key: data.draw(some((2,), positive)) for key in ("amplitude_deg", "settling_time_s", "peak_velocity_deg_s")
    }
    measures = Measures(
        q.copy(),
        q,
        overshoot=data.draw(some((2,), st.floats(0, 9))),
        skewness=np.zeros(2),
        settled=~failed,
        failed=failed,
        **numbers,
    )
    for values in vars(measures).values():
        if values.dtype == float:
            values[failed] = nan
    energy, force = data.draw(some((2,), positive)), data.draw(some((2,), positive))
    energy[failed] = force[failed] = data.draw(st.sampled_from([nan, inf, 0.0]))
    target = unit(data.draw(some((2, 4)).filter(lambda q: (np.abs(q).max(axis=1) > 0.01).all())))
    movement: Any = Asked(energy, data.draw(st.sampled_from([force, None])))
    weights = judge.weights(
        data.draw(st.lists(st.floats(0, 1e3), min_size=len(judge.names), max_size=len(judge.names)).filter(any))
    )
    reward = judge.reward(movement, measures, target, weights)
    assert np.isfinite(reward.total).all()
    for term, values in reward.terms.items():
        assert (values <= 0).all()
        if term in ("accuracy", "duration", "overshoot"):
            assert values[0] <= values[1]
    assert np.isfinite(log_reward(reward.total)).all()


@cache
def batch_of(name: str) -> SaccadeBatch:
    return SaccadeBatch(SaccadeTask.of_case(plant_of(name), weights=(1e8, 1.0, 1e5, 1e5), horizon_s=0.1))


@budget(20)
@given(st.sampled_from(sorted(PLANTS)), st.data())
def test_environments_take_any_action(name: str, data: st.DataObject) -> None:
    batch, random = batch_of(name), np.random.default_rng(data.draw(st.integers(0, 9)))
    batch.draw(2, random)
    actions = data.draw(some((2, len(batch.task.actions.numbers)), anything))
    reward, observation = batch.perform(actions, random)
    assert (np.isfinite(reward) & (reward <= 0)).all()
    assert np.isfinite(observation).all()
    np.testing.assert_array_equal(batch.described()["failed"], np.isnan(actions).any(axis=1))


# --- angles ---------------------------------------------------------------------------------------


@budget(100)
@given(some((3, 3), st.floats(-179, 179)))
def test_angles_and_back(angles: Array) -> None:
    yaw, pitch, roll = angles.T * [[1], [0.49], [1]]
    q = rotations.from_euler(yaw, pitch, roll)
    np.testing.assert_allclose(rotations.to_euler(q), [yaw, pitch, roll], atol=1e-6)
    for a, b in ((q, q[::-1]), (-q, q[::-1])):
        apart = rotations.angle_between(a, b)
        np.testing.assert_allclose(rotations.angle_between(b, a), apart, atol=1e-9)
        assert ((apart >= 0) & (apart <= 180)).all()
    np.testing.assert_allclose(rotations.angle_between(q, -q), 0, atol=1e-9)
    gaze = rotations.gaze(q)
    np.testing.assert_allclose(np.linalg.norm(gaze, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(gaze, rotations.rotation(q).apply([1.0, 0, 0]), atol=1e-12)


@budget(100)
@given(some((3, 2), st.floats(-85, 85)), some((3,), st.floats(-60, 60)))
def test_directions_torsion_and_shifts_and_back(angles: Array, torsion: Array) -> None:
    direction = listing.directions(*angles.T)
    q = listing.with_torsion(direction, torsion)
    np.testing.assert_allclose(listing.torsion(q), torsion, atol=1e-7)
    np.testing.assert_allclose(rotations.gaze(q), direction, atol=1e-9)
    for origin in (np.array([1.0, 0, 0]), direction[::-1]):
        np.testing.assert_allclose(oblique.toward(oblique.seen_from(direction, origin), origin), direction, atol=1e-7)


nested = st.recursive(
    st.one_of(
        anything, st.none(), st.text(max_size=2), st.booleans(), st.complex_numbers(), st.integers(), st.binary()
    ),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=8,
)


@budget(150)
@given(nested, nested)
def test_anything_is_an_array_of_numbers_or_refused(one: object, other: object) -> None:
    for make in (
        lambda: as_numbers("it", one),
        lambda: State(one, other),  # type: ignore[arg-type]  # anything
        lambda: State([[1, 0, 0, 0]], [[0.0]], one),  # type: ignore[arg-type]
        lambda: Sampled(one, other),  # type: ignore[arg-type]
        lambda: PulseStep(one, [[50.0]], other, [[10.0]]),  # type: ignore[arg-type]
        lambda: plant_of("lpf").move(one, None, other),  # type: ignore[arg-type]
    ):
        try:
            make()
        except InputError as error:
            assert len(str(error)) < 600  # noqa: PT017  # raised or not, by the example
