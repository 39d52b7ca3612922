"""How the eye holds a direction: least force by scipy, torsion's range by the specification, fits by their plants."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from orient_eye.errors import InputError
from orient_eye.listing import directions, ficks_torsion, fit_plane, with_torsion
from orient_eye.motor import names
from orient_eye.plants import Plant, make_plant
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.fixation import Fixations, fixate
from orient_eye.rotations import angle_between, angle_between_directions, gaze
from orient_eye.statics import Held

Array = NDArray[np.float64]
ALL = ("motor1", "motor2", "motor3")
SOME = directions([0.0, 20.0, -25.0, 8.0], [0.0, 10.0, -15.0, 30.0])


@pytest.fixture(scope="module")
def eye() -> ElasticPlant:
    plant = make_plant("tavares")
    assert isinstance(plant, ElasticPlant)
    return plant


@pytest.fixture(scope="module")
def usual(eye: ElasticPlant) -> Fixations:
    return Fixations.of(eye)


@cache
def made(name: str) -> Plant:
    return make_plant(name)


@cache
def fixations(name: str) -> Fixations:
    return Fixations.of(made(name))


def force_by_name(eye: ElasticPlant, direction: Array, torsion_deg: float) -> float:
    """Of one fixation [N^2], its elastics paired by their names: motor1_upper with motor1_lower, ..."""
    orientation = with_torsion(direction[None], [torsion_deg])
    tension = eye.tension(orientation, eye.hold(orientation, ALL))[0]
    pairs: dict[str, list[float]] = {}
    for name, value in zip(eye.tendons, tension.tolist(), strict=True):
        pairs.setdefault(name.split("_")[0], []).append(value)
    assert sorted(map(len, pairs.values())) == [2, 2, 2]
    return float(sum((one - other) ** 2 for one, other in pairs.values()))


# --- the least force --------------------------------------------------------------------------------------


def test_the_least_force_is_scipys(eye: ElasticPlant, usual: Fixations) -> None:
    found, motor, force = fixate(eye, SOME)
    for i, direction in enumerate(SOME):
        least = minimize_scalar(lambda t, d=direction: force_by_name(eye, d, t), bounds=(-6, 6), method="bounded")
        assert found[i] == pytest.approx(least.x, abs=2e-3)
        assert force[i] == pytest.approx(least.fun, rel=1e-6)
        np.testing.assert_allclose(motor[i], eye.hold(with_torsion(direction[None], found[[i]]), ALL)[0], atol=1e-9)
    assert usual.torsion(SOME) == pytest.approx(found, abs=1e-3)
    assert usual.force(SOME) == pytest.approx(force, rel=1e-4, abs=1e-5)


def test_the_plants_force_is_that_of_its_elastics(eye: ElasticPlant) -> None:
    orientation = with_torsion(SOME, [0.0, 2.0, -3.0, 1.0])
    told = eye.force(orientation, eye.hold(orientation, ALL))
    by_name = [force_by_name(eye, d, t) for d, t in zip(SOME, [0.0, 2.0, -3.0, 1.0], strict=True)]
    assert told == pytest.approx(by_name, rel=1e-9)
    excess = eye.excess_force(np.concatenate([orientation, [[np.nan] * 4]]), np.zeros((5, 3)))
    assert excess is not None
    assert np.isnan(excess[-1])


@pytest.mark.parametrize("eye_name", ["thesis", "eve_v3"])
def test_no_torsion_holds_a_gaze_with_less(eye_name: str) -> None:
    """Excess force is at least 0 wherever the eye can be held, up to what the fit is off."""
    plant = make_plant("tavares", eye=eye_name)
    assert isinstance(plant, ElasticPlant)
    least = Fixations.of(plant)
    random = np.random.default_rng(0)
    away, around = random.uniform(0, 15, 200), random.uniform(0, 2 * np.pi, 200)
    direction = directions(away * np.cos(around), away * np.sin(around))
    orientation = with_torsion(direction, least.torsion(direction) + random.uniform(-1, 1, 200))
    motor = plant.held(orientation, ALL)
    held = np.isfinite(motor).all(axis=1)
    assert held.sum() > 150
    excess = plant.excess_force(orientation[held], motor[held])
    assert excess is not None
    scale = np.median(excess)
    assert excess.min() > -0.01 * scale


@pytest.mark.parametrize(("eye_name", "sd", "twist"), [("thesis", 0.43, -0.196), ("eve_v3", 0.36, -0.166)])
def test_the_law_of_least_force_is_that_of_the_specification(eye_name: str, sd: float, twist: float) -> None:
    """Numbers of an independent program; here over gaze drawn evenly within 35 deg of straight ahead."""
    random = np.random.default_rng(0)
    away, around = 35 * np.sqrt(random.uniform(size=3000)), random.uniform(0, 2 * np.pi, 3000)
    away = np.deg2rad(away)
    direction = np.stack([np.cos(away), np.sin(away) * np.cos(around), np.sin(away) * np.sin(around)], axis=1)
    plane = fit_plane(Fixations.of(make_plant("tavares", eye=eye_name)).orientation(direction))
    assert plane.sd_deg == pytest.approx(sd, abs=0.03)
    assert plane.twist == pytest.approx(twist, abs=0.005)
    assert plane.tilt_deg == pytest.approx((0, 0), abs=0.1)  # the eye is its own mirror image


# --- the fits ---------------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 1), st.floats(0, 2 * np.pi))
def test_a_fit_holds_the_eye_where_it_says(share: float, around: float) -> None:
    eye = made("tavares")
    fit = fixations("tavares")
    away = np.deg2rad(fit.limit_deg * share)
    direction = np.array([[np.cos(away), np.sin(away) * np.cos(around), np.sin(away) * np.sin(around)]])
    rests = eye.rest(fit.motor(direction))
    assert angle_between(rests, fit.orientation(direction)) == pytest.approx([0], abs=0.01)
    assert angle_between_directions(gaze(rests), direction) == pytest.approx([0], abs=0.01)


def test_beyond_its_cone_a_fit_tells_the_nearest_inside(usual: Fixations) -> None:
    edge, beyond = directions([usual.limit_deg], [0.0]), directions([80.0], [0.0])
    np.testing.assert_allclose(usual.motor(beyond), usual.motor(edge), atol=1e-9)


def test_other_rules(eye: ElasticPlant) -> None:
    assert Fixations.of(eye, "listing").torsion(SOME) == pytest.approx([0] * 4, abs=1e-9)
    fick = Fixations.of(eye, "fick")
    assert fick.torsion(SOME) == pytest.approx(ficks_torsion(SOME), abs=1e-4)
    yaw, pitch = (g.ravel() for g in np.meshgrid(*[np.linspace(-20, 20, 9)] * 2))
    assert fit_plane(fick.orientation(directions(yaw, pitch))).twist == pytest.approx(-1, abs=1e-3)
    assert (fick.force(SOME[1:]) > Fixations.of(eye).force(SOME[1:])).all()


def test_mujoco_is_held_the_same_way(usual: Fixations) -> None:
    told, motor, force = fixate(make_plant("mujoco"), SOME)
    assert told == pytest.approx(usual.torsion(SOME), abs=2e-3)
    np.testing.assert_allclose(motor, usual.motor(SOME), atol=0.01)
    assert force == pytest.approx(usual.force(SOME), rel=1e-3, abs=1e-5)


def test_a_plant_without_elastics_is_held_without_torsion() -> None:
    plant = made("modal")
    assert plant.force(np.empty((0, 4)), np.empty((0, 3))) is None
    told, motor, force = fixate(plant, SOME)
    assert told.tolist() == force.tolist() == [0.0] * 4
    np.testing.assert_allclose(gaze(plant.rest(motor)), SOME, atol=1e-9)
    assert fixations("modal").force(SOME) == pytest.approx([0] * 4, abs=1e-12)


# --- reach ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "gazes", "expected"),
    [
        ("thesis", ((0, 0), (0, -35), (35, -35)), ((-11.5, 11.5), (-9.5, 9.5), (-6.5, 11.5))),
        ("eve_v3", ((0, 0), (0, -35), (35, -35)), ((-13.0, 13.0), (-2.5, 2.5), (0.5, 3.5))),
    ],
)
def test_the_torsion_that_motors_reach(name: str, gazes: Array, expected: Array) -> None:
    """Of an independent program, to half a degree; which of the two oblique ends is which depends on the side."""
    found = Held.of(make_plant("tavares", eye=name), directions(*np.array(gazes, float).T)).range
    oblique = found[2] if abs(found[2, 0] - expected[2][0]) < 1 else -found[2, ::-1]
    np.testing.assert_allclose(np.vstack([found[:2], oblique]), expected, atol=0.51)


def test_a_direction_out_of_reach_has_no_torsion(eye: ElasticPlant) -> None:
    assert np.isnan(Held.of(eye, directions([85.0], [0.0])).range).all()
    assert np.isnan(np.concatenate([each.ravel() for each in fixate(eye, directions([85.0], [0.0]))[1:]])).all()


@pytest.mark.parametrize("name", ["tavares", "modal", "mujoco", "viscous"])
def test_held_is_hold_inside_the_working_range(name: str) -> None:
    plant = made(name)
    orientation = with_torsion(SOME, [0.0, 1.0, -1.0, 0.5])
    np.testing.assert_allclose(plant.held(orientation, ALL), plant.hold(orientation, ALL), atol=1e-9)
    np.testing.assert_allclose(angle_between(plant.rest(plant.held(orientation, ALL)), orientation), 0, atol=1e-5)
    rolled = with_torsion(SOME[:1], [25.0])
    assert np.isnan(plant.held(np.concatenate([rolled, orientation[:1]]), ALL)).all(axis=1).tolist() == [True, False]


@pytest.mark.parametrize("name", ["tavares", "viscous"])
def test_motors_follow_the_poles_of_the_specification(name: str) -> None:
    assert made(name).motor_rates() == pytest.approx([5.10, 18.35, 5.10], rel=2e-3)


def test_a_plant_that_turns_about_one_axis_holds_no_cone() -> None:
    plant = make_plant("lpf")
    assert len(names(plant.motors)) == 1
    with pytest.raises(InputError, match=r"do not hold the eye in every direction .* choose targets about one axis"):
        Fixations.of(plant)


def test_an_unknown_rule_is_refused(eye: ElasticPlant) -> None:
    with pytest.raises(InputError, match=r"torsion .* least force, listing, fick.* 'donders'"):
        Fixations.of(eye, "donders")  # type: ignore[arg-type]  # as a stranger's file may have it
