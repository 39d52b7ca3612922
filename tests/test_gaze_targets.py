"""Gaze targets: what is drawn can be held and lies in the cone, directions there and back, and what is refused."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orient_eye import listing, rotations
from orient_eye.errors import InputError
from orient_eye.plants import Plant, PulseRates, make_plant
from orient_eye.plants.fixation import fixate
from orient_eye.task.gaze_targets import TORSION_DEG, GazeTargets
from orient_eye.task.targets import make_targets, restore_targets, saccades

AHEAD = np.array([1.0, 0.0, 0.0])
ALL = ("motor1", "motor2", "motor3")


@cache
def made(name: str) -> Plant:
    return make_plant(name)


@cache
def targets_of(name: str) -> GazeTargets:
    found = make_targets("gaze", made(name))
    assert isinstance(found, GazeTargets)
    return found


# --- drawing ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["tavares", "modal", "viscous"])
def test_what_is_drawn_can_be_held_and_lies_in_the_cone(name: str) -> None:
    plant, targets = made(name), targets_of(name)
    start, target = targets.draw(2000, np.random.default_rng(1))
    np.testing.assert_allclose(rotations.angle_between(plant.rest(start.motor), start.orientation), 0, atol=1e-5)
    low, high = np.array([motor.working for motor in plant.motors]).T
    assert ((start.motor >= low) & (start.motor <= high)).all()
    assert (start.angular_velocity == 0).all()
    ends = rotations.gaze(start.orientation), rotations.gaze(target)
    for away in (rotations.angle_between_directions(each, AHEAD) for each in ends):
        assert 29 < away.max() <= 30
        assert np.mean(away < 30 / np.sqrt(2)) == pytest.approx(0.5, abs=0.04)  # evenly over the disc
    for component in (ends[0][:, 1:], ends[1][:, 1:]):
        assert component.mean(axis=0) == pytest.approx([0, 0], abs=0.03)
    some = slice(0, 100)
    off = listing.torsion(start.orientation[some]) - fixate(plant, ends[0][some])[0]
    assert 0.9 * TORSION_DEG < np.abs(off).max() <= TORSION_DEG + 1e-3
    assert np.mean(off) == pytest.approx(0, abs=0.2 * TORSION_DEG)
    np.testing.assert_allclose(listing.torsion(target[some]), fixate(plant, ends[1][some])[0], atol=2e-3)


def test_the_same_seed_draws_the_same() -> None:
    one, other = (targets_of("modal").draw(5, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one[0].orientation, other[0].orientation)
    np.testing.assert_array_equal(one[1], other[1])


def test_where_motors_hold_less_less_is_drawn() -> None:
    """eve_v3 holds 2.5 deg of torsion 35 up, and 35-35 not at all without torsion (specification)."""
    plant = make_plant("tavares", eye="eve_v3")
    targets = make_targets("gaze", plant, limit_deg=60.0, torsion_deg=20.0)
    assert isinstance(targets, GazeTargets)
    assert targets.limit_deg == targets.reach_deg < 50
    assert 0 < targets.torsion_deg < 20
    start, _ = targets.draw(300, np.random.default_rng(0))
    assert np.isfinite(plant.held(start.orientation, ALL)).all()


def test_a_plants_own_rates_and_horizon_come_first() -> None:
    assert targets_of("tavares").pulse_rates == PulseRates((12.0, 120.0), (2.0, 60.0))
    assert targets_of("tavares").horizon_s == 0.7
    rig = make_plant("tavares", rig="prototype")
    targets = make_targets("gaze", rig)
    assert targets.pulse_rates == rig.pulse_rates is not None
    assert targets.horizon_s == rig.horizon_s is not None


# --- told by angles ---------------------------------------------------------------------------------------


@settings(deadline=None)
@given(st.floats(0, 45), st.floats(0, 2 * np.pi))
def test_angles_and_orientations_there_and_back(away: float, around: float) -> None:
    targets = targets_of("modal")
    angles = away * np.array([[np.cos(around), np.sin(around)]])
    orientation = targets.orientation(angles)
    np.testing.assert_allclose(rotations.gaze(orientation), listing.directions(*angles.T), atol=1e-12)
    np.testing.assert_allclose(targets.angles_of(orientation), angles, atol=1e-9)


def test_positive_yaw_is_left_and_positive_pitch_down() -> None:
    (gaze,) = rotations.gaze(targets_of("tavares").orientation([[20.0, 10.0]]))
    assert gaze[1] > 0 > gaze[2]


def test_chosen_saccades() -> None:
    start, target = saccades(targets_of("tavares"), [[0.0, 0.0], [5.0, 5.0]], [[10.0, -20.0], [-10.0, 0.0]])
    np.testing.assert_allclose(start.motor[0], 0, atol=0.01)
    np.testing.assert_allclose(rotations.to_euler(target)[0], [10, -10], atol=1e-9)
    with pytest.raises(InputError, match=r"shape \(saccades, 2: yaw_deg, pitch_deg\), got \(1, 1\)"):
        saccades(targets_of("tavares"), [[0.0]], [[10.0]])


@pytest.mark.parametrize("name", ["tavares", "modal"])
def test_chosen_sizes_are_those_asked_for(name: str) -> None:
    targets = targets_of(name)
    size = np.array([5.0, 20.0, 50.0, 80.0])
    start, target = targets.of_sizes(size, 5)
    assert start.shape == target.shape == (15, 2)  # 80 is more than the cone holds
    between = rotations.angle_between_directions(listing.directions(*start.T), listing.directions(*target.T))
    np.testing.assert_allclose(np.sort(between), np.repeat(size[:3], 5), atol=1e-9)
    start, target = targets.symmetric(np.array([10.0, 40.0, 70.0]))
    between = rotations.angle_between_directions(listing.directions(*start.T), listing.directions(*target.T))
    np.testing.assert_allclose(between, [10, 40], atol=1e-9)
    assert (target[:, 0] > 0).all()
    assert (target[:, 1] < 0).all()  # up and to the left
    for ends in (start, target):
        targets.check(ends, "start", drawn=True)


def test_an_identity_restores_the_set() -> None:
    plant = made("modal")
    targets = make_targets("gaze", plant, limit_deg=20.0, torsion_deg=1.0)
    again = restore_targets(targets.identity(), plant, ALL)
    assert again.identity() == targets.identity() == {"targets": "gaze", "limit_deg": 20.0, "torsion_deg": 1.0}
    one, other = (each.draw(3, np.random.default_rng(0))[0].orientation for each in (targets, again))
    np.testing.assert_array_equal(one, other)


# --- what is refused --------------------------------------------------------------------------------------


def test_directions_out_of_reach_are_refused() -> None:
    targets = targets_of("tavares")
    targets.check(np.array([[30.0, 0.0], [0.0, -30.0]]), "target", drawn=True)
    targets.check(np.array([[45.0, 0.0]]), "target")
    with pytest.raises(InputError, match=r"^target at 40, 0 deg \(yaw, pitch\) is 40.0 deg .* learned up to 30.0 deg;"):
        targets.check(np.array([[0.0, 0.0], [40.0, 0.0]]), "target", drawn=True)
    with pytest.raises(InputError, match=r"^start at 0, 60 deg .* 60.0 deg .* 'tavares' can be held up to 50.0 deg;"):
        targets.check(np.array([[0.0, 60.0]]), "start")
    with pytest.raises(InputError, match="nan"):
        targets.check(np.array([[np.nan, 0.0]]), "start")


def test_torsion_out_of_reach_is_refused() -> None:
    targets = targets_of("tavares")
    with pytest.raises(InputError, match=r"is no equilibrium of motors .*: choose one they can hold"):
        targets.rest(listing.with_torsion(AHEAD[None], [40.0]))
    held = targets.rest(listing.with_torsion(AHEAD[None], [8.0]))
    assert listing.torsion(held.orientation) == pytest.approx([8.0])
    assert held.motor[0, 0] == pytest.approx(-held.motor[0, 2], rel=0.05)  # torsion is the two against one another


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"limit_deg": 0.0}, "from 0.001 to 89 deg from straight ahead, got 0"),
        ({"limit_deg": float("nan")}, "got nan"),
        ({"limit_deg": 95.0}, "got 95"),
        ({"torsion_deg": -1.0}, "torsion of starts must be a number from 0 to 89 deg, got -1"),
        ({"driven": ("motor2",)}, r"need all motors of plant 'modal' \(motor1, motor2, motor3\), got motor2; choose"),
        ({"driven": ("motor1", "motor2", "motor4")}, "cannot drive"),
    ],
)
def test_numbers_that_are_none(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_targets("gaze", made("modal"), **options)


def test_a_plant_of_one_axis_has_no_gaze_targets() -> None:
    with pytest.raises(InputError, match=r"plant 'lpf' .* choose targets about one axis"):
        make_targets("gaze", make_plant("lpf"))
