"""The linear eye of three modes: against an integrator of its equations, known truth, and the thesis' eye."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from orient_eye.cli.sysid import Sysid
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model, motors
from orient_eye.figures.modes import draw_modes
from orient_eye.modal_surrogate import (
    MODES,
    ModalSurrogate,
    Mode,
    angular_velocity,
    as_orientation,
    as_vector,
    vector_rate,
)
from orient_eye.plants import make_plant, restore_plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.modal import ModalPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.rotations import angle_between, from_euler, from_yaw, rotation
from orient_eye.state import State
from orient_eye.surrogate import Surrogate
from orient_eye.sysid.modes import identify_modes

Array = NDArray[np.float64]
NAMES = ("motor1", "motor2", "motor3")
GAINS = ((-0.16, 0.0, 0.16), (1.5, 0.0, 1.6), (0.02, 1.45, 0.0))
RATES: tuple[dict[str, float], ...] = ({"w0": 12.0}, {"wn": 22.0, "zeta": 0.4}, {"wn": 30.0, "zeta": 1.7})
MIXED = ModalSurrogate(NAMES, {axis: Mode(K, **w) for axis, K, w in zip(MODES, GAINS, RATES, strict=True)})
FIRST = ModalSurrogate(NAMES, {axis: Mode(K, w) for axis, K, w in zip(MODES, GAINS, (12.0, 5.0, 16.0), strict=True)})


def paths(seed: int, saccades: int, samples: int, step_s: float) -> Array:
    """Motors that wander, (saccades, samples, 3)."""
    rng = np.random.default_rng(seed)
    wander = rng.normal(size=(saccades, samples, 3)).cumsum(axis=1)
    return np.asarray(rng.uniform(-5, 5, (saccades, 1, 3)) + 150 * step_s * wander)


# --- the plant ------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=10, derandomize=True)
@given(seed=st.integers(0, 2**30), surrogate=st.sampled_from([MIXED, FIRST]))
def test_its_equations_integrated(seed: int, surrogate: ModalSurrogate) -> None:
    """From a start that neither rests nor stands where its motors do."""
    step_s, samples, rng = 0.004, 60, np.random.default_rng(seed)
    time, motor = step_s * np.arange(samples), paths(seed, 1, samples, step_s)
    r0, omega = rng.uniform(-0.2, 0.2, 3), rng.uniform(-200, 200, 3)
    start = State(np.append(1.0, r0)[None], motor[:, 0] + 3.0, omega[None])
    found = ModalPlant(surrogate, step_s=step_s).move(motor, start).trajectory()

    K, rad = np.array(GAINS), np.deg2rad(omega)
    begun = [*np.rad2deg(2 * r0), *np.rad2deg(rad + np.cross(rad, r0) + r0 * (r0 @ rad))]  # Haustein 1989, inverted

    def slope(t: float, state: Array) -> Array:
        away = K @ [np.interp(t, time, each) for each in motor[0].T] - state[:3]
        rate, change = np.zeros(3), np.zeros(3)
        for i, mode in enumerate(surrogate.modes.values()):
            if mode.w0 is not None:
                rate[i] = mode.w0 * away[i]
            else:
                assert mode.wn is not None
                assert mode.zeta is not None
                rate[i] = state[3 + i]
                change[i] = mode.wn**2 * away[i] - 2 * mode.zeta * mode.wn * rate[i]
        return np.concatenate([rate, change])

    solved = solve_ivp(slope, (0, time[-1]), begun, t_eval=time, rtol=1e-8, atol=1e-8, max_step=step_s)
    r = np.deg2rad(solved.y[:3].T) / 2
    size = np.linalg.norm(r, axis=1, keepdims=True)
    turned = Rotation.from_rotvec(2 * np.arctan(size) * r / size)
    assert angle_between(found.orientation[0], turned.as_quat(scalar_first=True)).max() < 1e-4


@settings(deadline=None, max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**30))
def test_the_angular_velocity_of_a_rotation_vector(seed: int) -> None:
    """By a difference quotient of the rotation; and back."""
    rng, h = np.random.default_rng(seed), 1e-5
    vector, rate = rng.uniform(-60, 60, (4, 3)), rng.uniform(-300, 300, (4, 3))
    before, after = (rotation(as_orientation(vector + side * h * rate)) for side in (-1, 1))
    omega = angular_velocity(vector, rate)
    np.testing.assert_allclose(omega, (after * before.inv()).as_rotvec(degrees=True) / (2 * h), atol=1e-3)
    np.testing.assert_allclose(vector_rate(vector, omega), rate, atol=1e-10)
    np.testing.assert_allclose(as_vector(-as_orientation(vector)), vector, atol=1e-12)


def test_small_horizontal_saccades_are_the_low_pass_plants() -> None:
    """For which the rotation vector is the angle."""
    F, D = np.zeros((2, 1, 3))
    D[0, 1] = 0.2
    command = PulseStep(F, np.full_like(F, 40.0), D, np.full_like(F, 15.0))
    yaw = ModalPlant(FIRST).move(command, horizon_s=0.3).trajectory().yaw_deg
    alone = PulseStep(*(getattr(command, name)[:, [1]] for name in ("F", "B", "D", "k0")))
    low_pass = LinearPlant(Surrogate(1.45, 16.0)).move(alone.sample(0.001, 301)).trajectory().yaw_deg
    np.testing.assert_allclose(yaw, low_pass, atol=1e-6)


@pytest.mark.parametrize("surrogate", [MIXED, FIRST])
def test_it_resumes(surrogate: ModalSurrogate) -> None:
    plant, motor = ModalPlant(surrogate), paths(1, 3, 200, 0.001)
    whole = plant.move(motor).trajectory()
    there = State(whole.orientation[:, 90], motor[:, 90], whole.angular_velocity[:, 90])
    rest = plant.move(motor[:, 90:], there).trajectory()
    assert angle_between(rest.orientation, whole.orientation[:, 90:]).max() < 1e-9
    np.testing.assert_allclose(rest.angular_velocity, whole.angular_velocity[:, 90:], atol=1e-7)
    assert plant.resumes


def test_a_dead_time_shifts() -> None:
    late, motor = ModalPlant(replace(FIRST, dead_time=0.02)), paths(2, 3, 150, 0.001)
    prompt = ModalPlant(FIRST).move(motor).trajectory().orientation
    found = late.move(motor).trajectory().orientation
    assert angle_between(found[:, 20:], prompt[:, :-20]).max() < 1e-9
    assert angle_between(found[:, :20], prompt[:, :1]).max() < 1e-9
    assert not late.resumes


def test_what_motors_cannot_hold_is_refused() -> None:
    plant = ModalPlant(FIRST)
    with pytest.raises(InputError, match=r"motors motor2 of plant 'modal' cannot hold orientation .* drive more"):
        plant.hold(from_euler([0.0], [10.0], [0.0]), ("motor2",))
    far = np.stack([from_yaw(10.0), from_yaw(70.0)])
    held = plant.held(far, NAMES)
    np.testing.assert_allclose(plant.rest(held[:1]), far[:1], atol=1e-12)
    assert np.isnan(held[1]).all()  # beyond the working range
    np.testing.assert_array_equal(plant.motor_rates(), [5.0, 16.0, 5.0])


@settings(deadline=None, max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**30), motors=st.integers(3, 7))
def test_motors_that_rest_elsewhere_make_the_same_eye(seed: int, motors: int) -> None:
    """All counts from where they rest, and of all ways to hold an orientation theirs is the least change from there."""
    rng = np.random.default_rng(seed)
    K, rest, called = rng.normal(size=(3, motors)), rng.uniform(-90, 90, motors), tuple(f"m{i}" for i in range(motors))
    at_zero = ModalSurrogate(called, {axis: Mode(tuple(k), 9.0) for axis, k in zip(MODES, K, strict=True)})
    one, other = ModalPlant(at_zero), ModalPlant(replace(at_zero, rest=tuple(rest)))
    assert tuple(motor.rest for motor in other.motors) == pytest.approx(tuple(rest))
    motor, r = rng.uniform(-8, 8, (2, 30, motors)), np.append(1.0, rng.uniform(-0.1, 0.1, 3))
    start = State(np.tile(r, (2, 1)), motor[:, 0] + 1.0)
    moved = one.move(motor, start).trajectory()
    same = other.move(motor + rest, replace(start, motor=start.motor + rest)).trajectory()
    np.testing.assert_allclose(same.orientation, moved.orientation, atol=1e-9)
    np.testing.assert_allclose(same.angular_velocity, moved.angular_velocity, atol=1e-6)

    held = other.hold(one.rest(motor[:, 0]), called)
    assert angle_between(other.rest(held), one.rest(motor[:, 0])).max() < 1e-5
    np.testing.assert_allclose(held - rest, one.hold(one.rest(motor[:, 0]), called), atol=1e-9)
    assert (np.linalg.norm(held - rest, axis=1) <= np.linalg.norm(motor[:, 0], axis=1) + 1e-9).all()
    some = other.held(other.rest(rest + motor[:, 0] * (np.arange(motors) < 3)), called[:3])
    np.testing.assert_allclose(some[:, 3:], np.tile(rest[3:], (2, 1)))  # who is not driven stands at rest
    again = restore_plant(json.loads(json.dumps(other.identity())))
    assert (again.identity(), again.motors) == (other.identity(), other.motors)
    assert "rest" not in one.identity()


# --- identification -------------------------------------------------------------------------------

gains = st.lists(
    st.one_of(st.just(0.0), st.floats(0.1, 2), st.floats(-2, -0.1)), min_size=3, max_size=3
).filter(any)  # fmt: skip


@settings(deadline=None, max_examples=8, derandomize=True)
@given(K=st.tuples(gains, gains, gains), w0=st.tuples(*[st.floats(3, 60)] * 3), seed=st.integers(0, 2**30))
def test_a_known_eye_is_found(K: tuple[list[float], ...], w0: tuple[float, ...], seed: int) -> None:
    assume(np.linalg.cond(K) < 30)
    truth = ModalSurrogate(NAMES, {a: Mode(tuple(k), w) for a, k, w in zip(MODES, K, w0, strict=True)})
    found = identify_modes(ModalPlant(truth), np.random.default_rng(seed), fitted=8, held_out=4)
    np.testing.assert_allclose(found.surrogate.K, K, rtol=1e-5)
    # Gains are kept to six digits: up to 5e-6 of the 60 deg that an eye turns are off, and the poles take their share.
    np.testing.assert_allclose([mode.w0 for mode in found.surrogate.modes.values()], w0, rtol=1e-4)
    assert found.order == "first_order"
    assert found.rms_deg["first_order"] < 60 * 3 * 5e-6


def test_a_known_eye_of_second_order_is_found() -> None:
    rates = ((21.0, 0.5), (23.0, 0.3), (40.0, 0.9))
    truth = ModalSurrogate(NAMES, {a: Mode(k, None, *w) for a, k, w in zip(MODES, GAINS, rates, strict=True)})
    found = identify_modes(ModalPlant(truth), np.random.default_rng(0), fitted=8, held_out=4)
    assert found.order == "second_order"
    told = [(mode.wn, mode.zeta) for mode in found.surrogate.modes.values()]
    np.testing.assert_allclose(np.array(told, dtype=float), rates, rtol=1e-5)
    row = found.rows[0]
    assert (row["order"], row["from_deg"], row["to_deg"]) == ("first_order", 0, None)
    assert row["rms_deg"] > 1
    assert sum(r["samples"] for r in found.rows if r["order"] == "first_order") == 2 * row["samples"]


SIX = ("IR", "MR", "SR", "LR", "IO", "SO")


@settings(deadline=None, max_examples=4, derandomize=True)
@given(seed=st.integers(0, 2**30), w0=st.tuples(*[st.floats(4, 60)] * 3))
def test_a_known_eye_of_six_motors_is_found(seed: int, w0: tuple[float, ...]) -> None:
    """Each gain by itself, though three motors would do to hold the eye."""
    rng = np.random.default_rng(seed)
    K = rng.choice((-1, 1), (3, 6)) * rng.uniform(0.3, 1, (3, 6)) * np.array([0.2, 0.3, 0.7])[:, None]
    assume(np.linalg.cond(K) < 10)
    modes = {axis: Mode(tuple(k), w) for axis, k, w in zip(MODES, K, w0, strict=True)}
    truth = ModalSurrogate(SIX, modes, ((-300.0, 600.0),) * 6, rest=tuple(rng.uniform(50, 120, 6)))
    found = identify_modes(ModalPlant(truth), np.random.default_rng(seed), fitted=8, held_out=4)
    np.testing.assert_allclose(found.surrogate.K, K, rtol=1e-5)
    assert (found.surrogate.rest, found.surrogate.ranges) == (truth.rest, truth.ranges)
    np.testing.assert_allclose([mode.w0 for mode in found.surrogate.modes.values()], w0, rtol=1e-3)
    assert found.order == "first_order"
    assert found.rms_deg["first_order"] < 60 * 6 * 5e-6
    assert (found.workspace_deg, found.ran_away) == (35.0, 0)


def test_an_eye_that_runs_away_is_identified_where_it_stays() -> None:
    """The six-motor eye is not stable from 28 deg to the left at pretension 2: seven tenths of that are asked for."""
    plant = make_plant("tavares", eye="six", pretension=2.0)
    found = identify_modes(plant, np.random.default_rng(0), fitted=30, held_out=60, order="first_order")
    assert 17 < found.workspace_deg < 20
    assert found.ran_away > 0
    assert found.surrogate.details["ran_away"] == found.ran_away
    assert 90 - found.ran_away <= len(found.held_out) + 30 <= 90
    assert found.surrogate.rest == tuple(motor.rest for motor in plant.motors)
    assert "more, fitted or held out, ran away" in draw_modes(found).subfigs[0].get_suptitle()
    slow, fast = (found.surrogate.modes[axis].w0 for axis in ("yaw", "pitch"))
    assert slow is not None
    assert fast is not None
    assert slow < 2.2
    assert fast > 10


def test_an_eye_that_its_motors_hardly_hold_is_refused() -> None:
    modes = {axis: Mode(k, 9.0) for axis, k in zip(MODES, np.eye(3, 4).tolist(), strict=True)}
    tight = ModalSurrogate(("a", "b", "c", "d"), modes, ((9.5, 10.5),) * 4, rest=(10.0,) * 4)
    with pytest.raises(InputError, match="the motors of plant 'modal' do not hold it next to straight ahead"):
        identify_modes(ModalPlant(tight), np.random.default_rng(0))


def test_the_shipped_surrogate_is_the_six_motor_eyes() -> None:
    """Pulse-steps of a policy's kind: motors that change least, k0 near the poles."""
    eye, plant, rng = TavaresPlant("six", threads=1), make_plant("modal", surrogate="six-3d"), np.random.default_rng(5)
    assert plant.motors == eye.motors
    far, way = 28 * np.sqrt(rng.uniform(size=120)), rng.uniform(-np.pi, np.pi, 120)
    q = from_euler(far * np.cos(way), far * np.sin(way), 0 * far)
    F, D = eye.hold(q, SIX).reshape(2, 60, 6)
    command = PulseStep(F, rng.uniform(20, 70, F.shape), D, np.tile([18.0, 4.5, 18.0, 4.5, 18.0, 18.0], (60, 1)))
    start = State(eye.rest(F), F)
    true, told = (p.move(command, start, 0.7).trajectory().orientation for p in (eye, plant))
    assert np.sqrt(np.mean(angle_between(true, told) ** 2)) < 2.6
    assert angle_between(true[:, 0], true[:, -1]).mean() > 20
    np.testing.assert_allclose(plant.rest(rest_of(eye)), eye.rest(rest_of(eye)), atol=1e-6)


def rest_of(plant: TavaresPlant) -> Array:
    return np.array([[motor.rest for motor in plant.motors]])


def test_an_eye_of_one_motor_is_refused() -> None:
    with pytest.raises(InputError, match="the 1 motors of plant 'lpf' turn the eye about 1 independent axes"):
        identify_modes(LinearPlant(), np.random.default_rng(0))
    with pytest.raises(InputError, match="an order is best, first_order, second_order, got 'third'"):
        identify_modes(ModalPlant(FIRST), np.random.default_rng(0), order="third")
    with pytest.raises(InputError, match="pulse-steps fitted must be a whole number from 1 to 10000, got 0"):
        identify_modes(ModalPlant(FIRST), np.random.default_rng(0), fitted=0)


def test_the_shipped_surrogate_is_the_thesis_eyes() -> None:
    """Pulse-steps between gazes up to 35 deg from straight ahead, with torsions up to 3 deg."""
    eye, plant, rng = TavaresPlant(threads=1), make_plant("modal"), np.random.default_rng(11)
    assert plant.motors == motors(build_model("thesis"))
    drawn = rng.uniform(-1, 1, (200, 3))
    torsion, up, left = (drawn[np.linalg.norm(drawn[:, 1:], axis=1) < 1][:120] * [19, 22, 24]).T
    F, D = np.stack([(up - torsion) / 2, left, (up + torsion) / 2], axis=1).reshape(2, 60, 3)
    command = PulseStep(F, rng.uniform(20, 70, F.shape), D, np.tile([4.5, 16.0, 4.5], (60, 1)))
    start = State(eye.rest(F), F)
    true, told = (p.move(command, start, 0.7).trajectory().orientation for p in (eye, plant))
    error = angle_between(true, told)
    assert np.sqrt(np.mean(error**2)) < 1.6
    assert 25 < angle_between(true[:, 0], true[:, -1]).mean() < 40


@pytest.mark.parametrize("model", [None, "second_order"])
def test_the_command(tmp_path: Path, model: Any) -> None:
    out = tmp_path / "run"
    result = Sysid(plant="modal", all_motors=True, model=model, seed=3, out=out).run()
    assert result["order"] == (model or "first_order")
    assert {file.name for file in out.iterdir()} == {"run.json", *result["files"]}
    found = ModalSurrogate.load(out / "surrogate_3d.json")
    np.testing.assert_allclose(found.K, ModalSurrogate.load("thesis-3d").K, atol=1e-9)
    assert json.loads((out / "report.json").read_text())["rms_deg"] == result["rms_deg"]
    assert len((out / "residuals.csv").read_text().splitlines()) == 401
    again = make_plant("modal", surrogate=str(out / "surrogate_3d.json"))
    np.testing.assert_allclose(again.motor_rates(), make_plant("modal").motor_rates(), rtol=0.02)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"recording": (Path("x.csv"),)}, "--recording says nothing to --all-motors"),
        ({"physical": True}, "--physical says nothing to --all-motors"),
        ({"model": "first_order_dead_time"}, "first_order or second_order, without dead time"),
        ({"all_motors": False, "seed": 1}, "--seed is for --all-motors"),
    ],
)
def test_options_that_say_nothing_are_refused(options: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        Sysid(**{"all_motors": True, **options}).run()


# --- the file -------------------------------------------------------------------------------------


@pytest.mark.parametrize("surrogate", [MIXED, FIRST])
def test_round_trip(tmp_path: Path, surrogate: ModalSurrogate) -> None:
    ranges = ((-80.0, 80.0), (-70.0, 80.0), (-1.0, 2.0))
    one = replace(surrogate, ranges=ranges, dead_time=0.01, eye="thesis", source="Ünit", details={"n": [1, 2.5]})
    wound = replace(one, rest=(57.8, -60.0, 0.5))
    assert [motor.working for motor in wound.as_motors()] == list(ranges)
    for each in (one, surrogate, wound):
        assert ModalSurrogate.load(each.save(tmp_path / "surrogate_3d.json")) == each
    assert [motor.working for motor in one.as_motors()] == [(-40, 40), (-40, 40), (-1, 2)]


GOOD = {"format": "orient-eye modal surrogate 1", **FIRST.to_plain()}


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "Expecting value"),
        ("[1, 2]", "format"),
        (json.dumps(GOOD | {"format": "orient-eye surrogate 1"}), "format"),
        (json.dumps(GOOD | {"bogus": 1}), "bogus"),
        (json.dumps({k: v for k, v in GOOD.items() if k != "modes"}), "modes"),
        (json.dumps(GOOD | {"modes": {"yaw": {"K": [1], "w0": 3}}}), "has the modes roll, pitch, yaw, got yaw"),
        (json.dumps(GOOD | {"motors": ["a", "b"]}), "of 2 motors has as many of each number"),
        (json.dumps(GOOD | {"ranges": [[-1, 1]]}), "has as many of each number"),
        (json.dumps(GOOD | {"dead_time": -1}), "dead_time must be a number from 0 to 10 s"),
        (json.dumps(GOOD | {"rest": [57.0]}), "has as many of each number"),
        (json.dumps(GOOD | {"rest": [1, 2, "3"]}), "rest must be a number from"),
        (json.dumps(GOOD | {"rest": [1, 2, 1e7]}), "rest must be a number from"),
        (json.dumps(GOOD | {"rest": 57.0}), "not iterable"),
        (json.dumps(GOOD | {"rest": [0, 0, 9], "ranges": [[-1, 1]] * 3}), "'motor3' rests inside its range"),
    ],
)
def test_files_that_are_no_modal_surrogate_are_refused(tmp_path: Path, content: str, told: str) -> None:
    path = tmp_path / "surrogate_3d.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=rf"surrogate_3d\.json(?s:.*){told}.*--all-motors.*shipped.*thesis-3d"):
        ModalSurrogate.load(path)
    with pytest.raises(InputError, match=r"nowhere is no modal surrogate"):
        ModalSurrogate.load("nowhere")


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ({"w0": 0.0}, "w0 must be a number from 0.001"),
        ({"w0": 3.0, "wn": 3.0, "zeta": 1.0}, "positive w0, or"),
        ({"wn": 3.0}, "positive w0, or"),
        ({}, "positive w0, or"),
        ({"w0": np.inf}, "w0 must be a number from 0.001"),
        ({"w0": 3.0, "K": (0.0, 0.0)}, "finite gains, one of them not 0"),
        ({"w0": 3.0, "K": (np.nan, 1.0)}, "K must be a number from"),
    ],
)
def test_impossible_modes_are_refused(numbers: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        Mode(**{"K": (1.0, 2.0), **numbers})


def test_a_start_next_to_half_a_turn_fails_alone() -> None:
    start = State(np.array([[7.458e-155, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]), np.zeros((2, 3)))
    moved = ModalPlant(FIRST).move(np.zeros((2, 5, 3)), start).trajectory()
    assert moved.failed.tolist() == [True, False]
    np.testing.assert_allclose(np.linalg.norm(moved.orientation[1], axis=-1), 1)
