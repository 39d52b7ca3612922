"""Measures of saccades in all directions, on paths whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from orient_eye.listing import with_torsion
from orient_eye.motor import Motor
from orient_eye.movement.measures import Measures, measure
from orient_eye.movement.oblique import (
    component_correlation,
    component_durations,
    end_of_shift,
    gaze_components,
    gaze_shift,
    path_deviation,
    seen_from,
    shift_velocity,
    torsion_blip,
    transient_torsion,
)
from orient_eye.movement.trajectory import Trajectory
from orient_eye.rotations import gaze

Array = NDArray[np.float64]
TIME = 0.001 * np.arange(301)
LASTS = 0.1  # s
LAW = settings(deadline=None, max_examples=60, derandomize=True)
NEAR = st.tuples(st.floats(-40, 40), st.floats(-40, 40))  # left and up [deg]
EVERY = (path_deviation, component_correlation, component_durations, torsion_blip)


def ease(t: Array | float) -> Array:
    """From 0 to 1 within LASTS, smoothly (minimum jerk)."""
    s = np.clip(np.asarray(t) / LASTS, 0, 1)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def rate(t: Array | float) -> Array:
    """Derivative of `ease` [1/s]."""
    s = np.clip(np.asarray(t) / LASTS, 0, 1)
    return np.asarray(30 * s**2 * (1 - s) ** 2 / LASTS)


def quaternion(turn: Rotation) -> Array:
    return np.asarray(turn.as_quat(scalar_first=True))


def without_torsion(left: Array | float, up: Array | float) -> Rotation:
    """The shortest turn from straight ahead, by scipy."""
    left, up = np.broadcast_arrays(left, up)
    return Rotation.from_rotvec(np.stack([np.zeros_like(left), -up, left], axis=-1), degrees=True)


def of(orientation: Array, velocity: Array | None = None) -> Trajectory:
    """A batch (saccades, time, 4); the angular velocity by central differences unless given."""
    count, samples = orientation.shape[:2]
    if velocity is None:
        before, after = (Rotation.from_quat(q.reshape(-1, 4), scalar_first=True) for q in
                         (np.roll(orientation, 1, axis=1), np.roll(orientation, -1, axis=1)))  # fmt: skip
        velocity = np.rad2deg((after * before.inv()).as_rotvec()).reshape(count, samples, 3) / (TIME[2] - TIME[0])
        velocity[:, [0, -1]] = 0
    motor = np.zeros((count, samples, 1))
    return Trajectory(
        TIME[:samples], orientation, velocity, motor, motor, None, np.zeros(count, bool), (Motor("motor1"),)
    )


def turned(start: Rotation, axis: Array, angle_deg: float) -> Trajectory:
    """One saccade: a turn about a fixed axis of the head."""
    vector = angle_deg * ease(TIME)[:, None] * axis
    path = quaternion(Rotation.from_rotvec(vector, degrees=True) * start)
    return of(path[None], (angle_deg * rate(TIME)[:, None] * axis)[None])


def by_components(left: Array, up: Array, torsion_deg: Array | float = 0.0) -> Trajectory:
    """One saccade whose gaze is to the left and up [deg] (time,) of straight ahead."""
    return of(with_torsion(gaze(quaternion(without_torsion(left, up))), torsion_deg)[None])


def measured(trajectory: Trajectory) -> Measures:
    return measure(trajectory, of="gaze")


# --- components -----------------------------------------------------------------------------------


@LAW
@given(origin=NEAR, shift=st.tuples(st.floats(-90, 90), st.floats(-90, 90)))
def test_components_undo_the_shortest_turn(origin: tuple[float, float], shift: tuple[float, float]) -> None:
    there = without_torsion(*origin)
    ahead = np.array([1.0, 0, 0])
    direction = (there * without_torsion(*shift)).apply(ahead)
    np.testing.assert_allclose(seen_from(direction, there.apply(ahead)), shift, atol=1e-6)
    np.testing.assert_allclose(seen_from(without_torsion(*shift).apply(ahead)), shift, atol=1e-6)


def test_left_and_up_are_positive() -> None:
    looks = np.array([[1.0, 1, 0], [1, 0, 1]]) / np.sqrt(2)  # 45 deg to the left (y), 45 deg up (z)
    np.testing.assert_allclose(seen_from(looks), [[45, 0], [0, 45]], atol=1e-12)


def test_gaze_components_and_shift_of_a_saccade() -> None:
    trajectory = by_components(5 + 10 * ease(TIME), -8 * ease(TIME))
    np.testing.assert_allclose(gaze_components(trajectory)[0, [0, -1]], [[5, 0], [15, -8]], atol=1e-9)
    np.testing.assert_allclose(gaze_shift(trajectory)[0, 0], [0, 0], atol=1e-9)
    np.testing.assert_allclose(gaze_shift(trajectory)[0, -1], end_of_shift(trajectory, measured(trajectory))[0])


@pytest.mark.parametrize("seed", range(3))
def test_velocity_is_the_derivative_of_the_shift(seed: int) -> None:
    """On curved ways with torsion."""
    rng = np.random.default_rng(seed)
    wave = rng.uniform(-0.3, 0.3, (4, 3)) @ np.stack([ease(TIME), np.sin(20 * TIME), np.cos(13 * TIME)])
    trajectory = of(quaternion(Rotation.from_rotvec(wave[:3].T))[None])
    inner = slice(2, -2)
    central = np.gradient(gaze_shift(trajectory), TIME, axis=1)
    np.testing.assert_allclose(shift_velocity(trajectory)[:, inner], central[:, inner], rtol=2e-3, atol=0.05)


# --- a straight path ------------------------------------------------------------------------------


@LAW
@example(origin=(10.0, 20.0), roll=3.0, way=np.rad2deg(np.arctan(0.302)), angle=20.0)
@example(origin=(10.0, 20.0), roll=3.0, way=np.rad2deg(np.arctan(0.298)), angle=20.0)
@given(origin=NEAR, roll=st.floats(-20, 20), way=st.floats(0, 360), angle=st.floats(1, 70))
def test_a_turn_about_an_axis_square_to_the_gaze_is_straight(
    origin: tuple[float, float], roll: float, way: float, angle: float
) -> None:
    there = without_torsion(*origin)
    toward = np.array([np.cos(np.deg2rad(way)), np.sin(np.deg2rad(way))])  # left, up
    axis = there.apply([0.0, -toward[1], toward[0]])
    trajectory = turned(there * Rotation.from_rotvec([roll, 0, 0], degrees=True), axis, angle)
    measures = measured(trajectory)
    assert path_deviation(trajectory, measures)[0] < 1e-9
    np.testing.assert_allclose(gaze_shift(trajectory)[0], angle * ease(TIME)[:, None] * toward, atol=1e-9)
    np.testing.assert_allclose(shift_velocity(trajectory)[0], angle * rate(TIME)[:, None] * toward, atol=1e-6 * angle)
    ratio = np.abs(toward).min() / np.abs(toward).max()
    if abs(ratio - 0.3) > 1e-9:
        expected = 1.0 if ratio > 0.3 else np.nan
        np.testing.assert_allclose(component_correlation(trajectory, measures), expected, rtol=1e-9)
        settles = LASTS * brentq(lambda s: ease(s * LASTS) - 0.99, 0, 1)
        compared = np.abs(toward) >= 0.3 * np.abs(toward).max()
        durations = np.where(compared, settles, np.nan)
        np.testing.assert_allclose(component_durations(trajectory, measures)[0], durations, atol=5e-5)


# --- a curved one ---------------------------------------------------------------------------------


@LAW
@given(up=st.floats(5, 50), half=st.floats(2, 40), head=st.tuples(*[st.floats(-3, 3)] * 3))
def test_deviation_of_a_circle_of_latitude(up: float, half: float, head: tuple[float, float, float]) -> None:
    """The great circle between its ends rises above it, by spherical trigonometry, in any head frame."""
    turn = Rotation.from_rotvec(head)
    start = turn * Rotation.from_euler("ZY", [-half, -up], degrees=True)
    trajectory = turned(start, turn.apply([0.0, 0, 1]), 2 * half)
    e, a = np.deg2rad(up), np.deg2rad(half)
    rise = np.rad2deg(np.arctan(np.tan(e) / np.cos(a)) - e)
    amplitude = np.rad2deg(2 * np.arcsin(np.cos(e) * np.sin(a)))
    np.testing.assert_allclose(path_deviation(trajectory, measured(trajectory)), rise / amplitude, rtol=1e-6)


@pytest.mark.parametrize("late", [0.005, 0.02, 0.05])
@pytest.mark.parametrize("toward", [(12.0, 10.0), (-12.0, 10.0), (12.0, -6.0)])
def test_a_component_that_starts_late(late: float, toward: tuple[float, float]) -> None:
    left, up = toward
    trajectory = by_components(left * ease(TIME - late), up * ease(TIME))
    measures = measured(trajectory)
    one, other = component_durations(trajectory, measures)[0]
    assert one - other == pytest.approx(late, abs=1e-5)
    inside = np.less_equal(TIME, measures.settling_time_s[0])
    known = np.corrcoef(rate(TIME - late)[inside], rate(TIME)[inside])[0, 1]
    assert component_correlation(trajectory, measures)[0] == pytest.approx(known, abs=2e-3)


def test_a_stretched_component_lasts_as_long_as_it_was_stretched() -> None:
    trajectory = by_components(5 * ease(TIME / 2), 9 * ease(TIME))
    alone = by_components(5 * ease(TIME), 0 * TIME)
    stretched, whole = (component_durations(made, measured(made))[0, 0] for made in (trajectory, alone))
    assert stretched / whole == pytest.approx(2, rel=1e-3)


# --- torsion --------------------------------------------------------------------------------------


@LAW
@given(
    ends=st.tuples(st.floats(-3, 3), st.floats(-3, 3)), blip=st.floats(-2, 2), way=st.tuples(*[st.floats(4, 30)] * 2)
)
def test_a_blip_beside_the_torsion_that_changes_with_the_gaze(
    ends: tuple[float, float], blip: float, way: tuple[float, float]
) -> None:
    bump = blip * np.sin(np.pi * np.clip(TIME / 0.06, 0, 1)) ** 2  # largest at 30 ms
    later = 5 * np.sin(np.pi * np.clip((TIME - 0.15) / 0.1, 0, 1)) ** 2  # long after the saccade
    torsion = ends[0] + (ends[1] - ends[0]) * ease(TIME) + bump + later
    trajectory = by_components(way[0] * ease(TIME), way[1] * ease(TIME), torsion)
    measures = measured(trajectory)
    np.testing.assert_allclose(transient_torsion(trajectory, measures)[0], bump + later, atol=1e-6)
    np.testing.assert_allclose(torsion_blip(trajectory, measures), abs(blip), atol=1e-6)


# --- what has no answer ---------------------------------------------------------------------------


def test_failed_and_still_saccades_are_nan_and_stay_alone() -> None:
    parts = [by_components(x * ease(TIME - 0.01), 9 * ease(TIME)) for x in (5.0, 8.0)]
    good = of(np.concatenate([part.orientation for part in parts]))
    broken = np.full((1, len(TIME), 4), np.nan)
    still = by_components(1e-10 * ease(TIME), 1e-10 * ease(TIME)).orientation
    both = of(np.concatenate([good.orientation, still]))
    batch = replace(
        both,
        orientation=np.concatenate([both.orientation, broken]),
        angular_velocity=np.concatenate([both.angular_velocity, broken[..., :3]]),
        command=np.concatenate([both.command, broken[..., :1]]),
        motor=np.concatenate([both.motor, broken[..., :1]]),
        failed=np.array([False, False, False, True]),
    )
    measures = measured(batch)
    for quantity in EVERY:
        found = quantity(batch, measures)
        np.testing.assert_array_equal(found[:2], quantity(good, measured(good)), err_msg=quantity.__name__)
        assert np.isfinite(found[:2]).all()
        assert np.isnan(found[3]).all()
        if quantity is not component_durations:
            assert np.isnan(found[2])
    assert (component_durations(batch, measures)[2] == 0).all()
