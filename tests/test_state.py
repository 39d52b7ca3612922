"""States and motors: unit quaternions that keep their bits, plain values and back, ranges that are ranges."""

import json
from math import inf, nan

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.errors import InputError
from orient_eye.motor import Motor, check_driven, names, ranges
from orient_eye.state import State, as_numbers, unit

Array = NDArray[np.float64]

laws = settings(deadline=None, max_examples=100, derandomize=True)
finite = st.floats(allow_nan=False, allow_infinity=False)


def batch(columns: int, elements: st.SearchStrategy[float] = finite) -> st.SearchStrategy[Array]:
    return st.integers(1, 4).flatmap(lambda n: arrays(float, (n, columns), elements=elements))


quaternions = batch(4).filter(lambda q: bool((q != 0).any(axis=1).all()))
tame = batch(4, st.floats(-1, 1)).filter(lambda q: bool((np.abs(q).max(axis=1) > 0.01).all()))


@st.composite
def states(draw: st.DrawFn) -> State:
    n, motors = draw(st.integers(1, 4)), draw(st.integers(1, 3))
    orientation = draw(arrays(float, (n, 4), elements=finite).filter(lambda q: bool((q != 0).any(axis=1).all())))
    parts = [draw(arrays(float, (n, columns), elements=finite)) for columns in (motors, 3)]
    return State(orientation, *parts)


def bits(a: Array) -> bytes:
    return np.ascontiguousarray(a).tobytes()


# --- orientations ---------------------------------------------------------------------------------


@laws
@given(quaternions)
def test_unit_is_of_unit_length_and_idempotent_bit_for_bit(orientation: Array) -> None:
    """Whatever its size: from the least number there is to the largest."""
    once = unit(orientation)
    np.testing.assert_allclose((once**2).sum(axis=1), 1, rtol=0, atol=2e-12)
    assert bits(unit(once)) == bits(once)


@laws
@given(tame, st.floats(1e-280, 1e280), st.sampled_from([-1.0, 1.0]))
def test_a_factor_does_not_turn(orientation: Array, factor: float, sign: float) -> None:
    one, other = unit(orientation), unit(sign * factor * orientation)
    np.testing.assert_allclose(other, sign * one, rtol=0, atol=2e-12)
    assert rotations.angle_between(one, other).max() < 1e-9
    expected = rotations.rotation(orientation).as_matrix()  # scipy normalises by itself
    np.testing.assert_allclose(rotations.rotation(other).as_matrix(), expected, rtol=0, atol=1e-11)


@laws
@given(st.floats(-180, 180), st.floats(5e-324, 1.7e308))
def test_the_smallest_and_largest_factor(yaw_deg: float, factor: float) -> None:
    """As far as the product itself has digits."""
    given_ = factor * rotations.from_yaw([yaw_deg])
    assume(np.abs(given_).max() > 0)
    found = unit(given_)
    scaled = [[float(x) for x in row] for row in given_ / np.abs(given_).max()]
    np.testing.assert_allclose(found, unit(np.array(scaled)), rtol=0, atol=1e-15)
    if factor > 1e-290:
        assert rotations.angle_between(found, rotations.from_yaw([yaw_deg])).max() < 1e-9


@laws
@given(batch(3, st.floats(-170, 170)))
def test_a_unit_quaternion_keeps_its_bits(angles: Array) -> None:
    orientation = rotations.from_euler(angles[:, 0], angles[:, 1] / 2, angles[:, 2])
    assert bits(unit(orientation)) == bits(orientation)
    assert bits(unit(-orientation)) == bits(-orientation)


def test_one_eye_does_not_touch_another() -> None:
    orientation = np.array([[3.0, 0, 4, 0], [nan, 0, 0, 1], [1e-300, 0, 0, 0], [inf, 0, 0, 0]])
    found = unit(orientation)
    np.testing.assert_array_equal(found[[0, 2]], [[0.6, 0, 0.8, 0], [1, 0, 0, 0]])
    assert np.isnan(found[[1, 3]]).any(axis=1).all()
    state = State(orientation, np.zeros((4, 1)))
    assert state.finite.tolist() == [True, False, True, False]


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_the_zero_quaternion_is_none(zero: float) -> None:
    """A target is refused; of a start only its own eye is none."""
    orientation = np.array([[1.0, 0, 0, 0], [zero] * 4])
    with pytest.raises(InputError, match=r"zero quaternion; looking straight ahead is \(1, 0, 0, 0\)"):
        unit(orientation)
    state = State(orientation, np.zeros((2, 1)))
    np.testing.assert_array_equal(state.orientation[0], [1.0, 0, 0, 0])
    assert state.finite.tolist() == [True, False]


@pytest.mark.parametrize(
    "values", [[[1.0], [1.0, 2.0]], None, "abc", [["1", "0"]], [[1j, 0]], np.zeros((1, 2), object), [[True, False]]]
)
def test_real_numbers_and_nothing_else(values: object) -> None:
    with pytest.raises(InputError, match="what it is must be an array of real numbers, "):
        as_numbers("what it is", values)
    with pytest.raises(InputError, match="motor positions must be an array of real numbers"):
        State([[1, 0, 0, 0]], values)  # type: ignore[arg-type]


def test_numbers_of_any_kind_are_floats() -> None:
    for values in ([[1, 2]], np.array([[1, 2]], np.int8), np.array([[1, 2]], ">f4"), np.array([[1, 2]], np.longdouble)):
        found = as_numbers("what it is", values)
        assert found.dtype == float
        np.testing.assert_array_equal(found, [[1.0, 2.0]])


# --- states ---------------------------------------------------------------------------------------

PARTS = ("orientation", "motor", "angular_velocity")


@laws
@given(states())
def test_plain_values_and_back_are_exact(state: State) -> None:
    """Through JSON text too."""
    plain = state.to_plain()
    assert set(plain) == set(PARTS)
    for again in (State.from_plain(plain), State.from_plain(json.loads(json.dumps(plain)))):
        for name in PARTS:
            assert bits(getattr(again, name)) == bits(getattr(state, name)), name


def test_a_state_that_is_not_finite_comes_back() -> None:
    state = State(np.full((1, 4), nan), np.array([[inf]]), np.array([[nan, -inf, 0]]))
    again = State.from_plain(json.loads(json.dumps(state.to_plain())))
    for name in PARTS:
        np.testing.assert_array_equal(getattr(again, name), getattr(state, name))


def test_at_rest_unless_told() -> None:
    state = State([[1, 0, 0, 0]] * 2, [[1, 2, 3]] * 2)  # type: ignore[arg-type]
    assert len(state) == 2
    np.testing.assert_array_equal(state.angular_velocity, np.zeros((2, 3)))
    assert {getattr(state, name).dtype for name in PARTS} == {np.dtype(float)}


@laws
@given(states(), st.data())
def test_some_of_the_eyes(state: State, data: st.DataObject) -> None:
    mask = data.draw(arrays(bool, len(state)))
    for which in (mask, np.flatnonzero(mask), slice(1, None), [0]):
        some = state[which]
        for name in PARTS:
            assert bits(getattr(some, name)) == bits(getattr(state, name)[which]), name


@laws
@given(states(), st.sampled_from(PARTS), st.sampled_from([nan, inf, -inf]), st.data())
def test_finite_looks_at_every_number(state: State, name: str, bad: float, data: st.DataObject) -> None:
    assert state.finite.all()
    parts = {part: getattr(state, part).copy() for part in PARTS}
    row, column = (data.draw(st.integers(0, size - 1)) for size in parts[name].shape)
    parts[name][row, column] = bad
    assert np.flatnonzero(~State(**parts).finite).tolist() == [row]


Q, M, W = np.tile([1.0, 0, 0, 0], (2, 1)), np.zeros((2, 3)), np.zeros((2, 3))


@pytest.mark.parametrize(
    "parts",
    [
        (Q[0], M),
        (Q[:, :3], M),
        (Q[None], M),
        (Q, M[0]),
        (Q, M[:1]),
        (Q, M[None]),
        (Q, np.float64(0)),
        (Q, M, W[:1]),
        (Q, M, W[:, :2]),
        (Q, M, W[0]),
    ],
)
def test_shapes_that_do_not_fit_are_refused(parts: tuple[Array, ...]) -> None:
    with pytest.raises(InputError, match=r"a state of \d eyes has orientations \(\d, 4\), .*, got \("):
        State(*parts)


# --- motors ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "unit", "column"),
    [
        ("motor2", "deg", "tau2_deg"),
        ("motor12", "mm", "tau12_mm"),
        ("motor", "deg", "motor_deg"),
        ("motor2b", "deg", "motor2b_deg"),
        ("2", "deg", "2_deg"),
        ("motor²", "deg", "motor²_deg"),
        ("pan", "mm", "pan_mm"),
    ],
)
def test_columns(name: str, unit: str, column: str) -> None:
    assert Motor(name, unit).column == column


@laws
@given(st.tuples(*[st.floats(allow_nan=False)] * 4))
def test_a_working_range_is_inside_the_mechanical_one(bounds: tuple[float, ...]) -> None:
    low, high, least, most = bounds
    inside = max(low, least), min(high, most)
    if low < high and inside[0] < inside[1]:
        motor = Motor("servo", range=(low, high), working=(least, most))
        assert motor.range == (low, high)
        assert motor.working == inside
        assert ranges((motor, Motor("free"))).tolist() == [[low, high], [-inf, inf]]
    else:
        with pytest.raises(InputError, match="motor 'servo': a range goes from low to high, got"):
            Motor("servo", range=(low, high), working=(least, most))


@pytest.mark.parametrize("limit", [0.0, -1.0, nan, -inf])
def test_limits_are_positive(limit: float) -> None:
    for name in ("speed_limit", "acceleration_limit"):
        with pytest.raises(InputError, match="motor 'servo': a limit is positive, or None, got"):
            Motor("servo", **{name: limit})  # type: ignore[arg-type]


@pytest.mark.parametrize("bounds", [(nan, 1.0), (0.0, nan), (nan, nan)])
def test_a_range_is_of_numbers(bounds: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="a range goes from low to high"):
        Motor("servo", range=bounds)


@pytest.mark.parametrize("bounds", [(nan, 1.0), (0.0, nan), (nan, nan)])
def test_a_working_range_is_of_numbers(bounds: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="a range goes from low to high"):
        Motor("servo", range=(-1.0, 1.0), working=bounds)


def test_driven_motors() -> None:
    motors = (Motor("pan"), Motor("tilt"), Motor("roll"))
    assert names(motors) == ("pan", "tilt", "roll")
    assert check_driven(motors, ("roll", "pan"), "rig") == [2, 0]
    assert ranges(()).shape == (0, 2)
    with pytest.raises(InputError, match=r"plant 'rig' has the motors pan, tilt, roll; cannot drive \['yaw'\]"):
        check_driven(motors, ("pan", "yaw"), "rig")
    with pytest.raises(InputError, match="has the motors pan, tilt, roll"):
        check_driven(motors, (), "rig")
