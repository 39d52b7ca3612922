"""The main sequence and the velocity threshold, held against saccades whose numbers are known in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orient_eye import rotations
from orient_eye.errors import InputError
from orient_eye.human import human_values, people, studies
from orient_eye.motor import Motor
from orient_eye.movement.main_sequence import fit_main_sequence, fit_peak_velocity
from orient_eye.movement.trajectory import Trajectory
from orient_eye.movement.velocity_threshold import above, bouts, speed_of

STEP = 1e-3


def turning(yaw: np.ndarray, rate: np.ndarray) -> Trajectory:
    """Saccades (saccades, time) about the vertical axis."""
    velocity = np.zeros((*rate.shape, 3))
    velocity[..., 2] = rate
    motor = np.zeros((*yaw.shape, 1))
    failed = np.zeros(len(yaw), bool)
    time = STEP * np.arange(yaw.shape[1])
    return Trajectory(time, rotations.from_yaw(yaw), velocity, motor, motor, None, failed, (Motor("m", "deg"),))


def half_sine(amplitude: float, duration: float, rest: float = 0.05) -> Trajectory:
    """Speed V sin(pi t / T), V = A pi / (2 T), after a rest and before another."""
    time = STEP * np.arange(round((duration + 2 * rest) / STEP) + 1) - rest
    inside = np.clip(time, 0, duration)
    yaw = amplitude * (1 - np.cos(np.pi * inside / duration)) / 2
    rate = amplitude * np.pi / (2 * duration) * np.sin(np.pi * inside / duration)
    return turning(yaw[None], rate[None])


@given(st.floats(2, 40), st.floats(0.02, 0.2))
def test_a_half_sine_is_above_the_threshold_as_long_as_its_formula_says(amplitude: float, duration: float) -> None:
    peak = amplitude * np.pi / (2 * duration)
    bout = above(half_sine(amplitude, duration))
    if peak < 1.05 * 30:
        return
    wanted = duration * (1 - 2 * np.arcsin(30 / peak) / np.pi)
    assert bout.duration_s[0] == pytest.approx(wanted, abs=2 * STEP)
    assert bout.acceleration_share[0] == pytest.approx(0.5, abs=STEP / wanted + 1e-3)
    assert bout.peak_velocity_deg_s[0] == pytest.approx(peak, rel=0.01)


def test_bouts_of_one_long_recording_are_those_of_its_saccades_alone() -> None:
    apart = [half_sine(amplitude, 0.03 + 0.002 * amplitude) for amplitude in (5, 10, 20)]
    speed = np.concatenate([speed_of(each)[0] for each in apart])
    starts = STEP * np.cumsum([0, *(each.time.size for each in apart[:-1])])
    found, alone = bouts(STEP * np.arange(speed.size), speed), [above(each) for each in apart]
    np.testing.assert_allclose(found.onset_s, [b.onset_s[0] + s for b, s in zip(alone, starts, strict=True)], atol=1e-9)
    for key in ("duration_s", "peak_velocity_deg_s", "acceleration_share"):
        np.testing.assert_allclose(getattr(found, key), [getattr(b, key)[0] for b in alone], atol=1e-9, err_msg=key)


def test_bouts_beside_a_gap_or_an_end_are_not_measured() -> None:
    fast, slow, gap = [0.0, 60, 60, 0], [0.0] * 3, [np.nan]
    speed = np.array([60, 0, *fast, *slow, 60, *gap, *fast, *gap, 60, 0, *fast[:-1]])
    found = bouts(STEP * np.arange(speed.size), speed)
    assert np.isfinite(found.onset_s).tolist() == [False, True, False, True, False, False]
    np.testing.assert_allclose(found.onset_s[1], 2.5 * STEP)
    np.testing.assert_allclose(found.duration_s[1], 2 * STEP)
    for none in (np.zeros(9), np.full(9, np.nan)):
        assert bouts(STEP * np.arange(9), none).onset_s.shape == (0,)


def test_what_is_slow_or_goes_on_or_failed_has_no_bout_and_leaves_the_others_alone() -> None:
    one = half_sine(10, 0.05)
    orientation, velocity, motor = (
        np.repeat(part, 4, axis=0) for part in (one.orientation, one.angular_velocity, one.motor)
    )
    velocity[1] *= 0.01
    velocity[2, -60:] = [0, 0, 100]
    velocity[3] = np.nan
    failed = np.array([False, False, False, True])
    batch = Trajectory(one.time, orientation, velocity, motor, motor, None, failed, one.motors)
    found = above(batch)
    assert np.isnan(found.duration_s).tolist() == [False, True, True, True]
    assert found.duration_s[0] == above(one).duration_s[0]


def test_rolling_about_the_line_of_sight_is_no_speed_of_the_gaze() -> None:
    one = half_sine(10, 0.05)
    ahead = np.broadcast_to(rotations.FORWARD, one.orientation.shape)
    rolling = np.roll(one.angular_velocity, 1, axis=-1)
    rolled = Trajectory(one.time, ahead, rolling, one.motor, one.motor, None, one.failed, one.motors)
    assert speed_of(rolled).max() > 100
    assert speed_of(rolled, "gaze").max() == pytest.approx(0, abs=1e-9)


@given(st.floats(200, 900), st.floats(2, 20), st.floats(5, 60), st.floats(0.5, 6))
def test_the_numbers_that_made_a_main_sequence_are_found_again(V0: float, c: float, D0: float, d: float) -> None:
    amplitude = np.array([1, 2, 4, 7, 10, 15, 20, 30, 40.0])
    peak, duration = V0 * (1 - np.exp(-amplitude / c)), 1e-3 * (D0 + d * amplitude)
    found = fit_main_sequence(amplitude, peak, duration)
    assert (found.V0, found.c, found.D0_ms, found.d_ms) == pytest.approx((V0, c, D0, d), rel=1e-3)
    np.testing.assert_allclose(found.peak_velocity(amplitude), peak, rtol=1e-3)
    assert found.V_r2 == pytest.approx(1, abs=1e-6)
    assert found.D_r2 == pytest.approx(1, abs=1e-6)


def test_saccades_without_numbers_are_left_out_of_a_fit_and_too_few_are_refused() -> None:
    amplitude = np.array([1, 2, 4, 8, 16.0, 20])
    peak = 500 * (1 - np.exp(-amplitude / 5))
    with_holes = np.append(peak, np.nan)
    assert fit_peak_velocity(np.append(amplitude, 7), with_holes) == pytest.approx((500, 5), rel=1e-4)
    with pytest.raises(InputError, match=r"at least 3 saccades.*got 2"):
        fit_main_sequence(amplitude[:2], peak[:2], peak[:2])
    with pytest.raises(InputError, match="one number a saccade in each, got 6, 5"):
        fit_peak_velocity(amplitude, peak[:5])
    with pytest.raises(InputError, match="peak velocities are above 0, got 0 deg/s"):
        fit_peak_velocity(amplitude, 0 * peak)


def test_people_are_told_with_their_sources() -> None:
    """The fitted curve is within the scatter of the values, and 10 deg take some 43 ms."""
    assert set(studies("peak_velocity")) >= {"Andersson et al. 2017", "Collewijn et al. 1988", "Hopf et al. 2018"}
    rows = [
        row
        for study in studies()
        for quantity in ("peak_velocity", "duration")
        for row in human_values(quantity, study)
    ]
    assert all(row.source and row.population and row.unit for row in rows)
    human = people()
    told = {row.amplitude_deg: row.value for row in human_values("peak_velocity", "Andersson et al. 2017")}
    np.testing.assert_allclose(human.peak_velocity(list(told)), list(told.values()), rtol=0.07)
    assert human.duration_ms(10) == pytest.approx(43, abs=2)
