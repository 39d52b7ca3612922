"""One place that checks a number: what passes comes out as it went in, all else is refused in words."""

import math
import sys
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from orient_eye.checks import real, shown, whole
from orient_eye.errors import InputError

NO_NUMBER: list[Any] = [True, False, np.True_, "5", "5 deg", "", None, [1.0], np.array([1.0]), {}, 1j, b"1", object()]


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_finite_number_is_real(value: float) -> None:
    assert real("x", value) == value
    assert real("x", np.float64(value)) == value


@given(st.integers())
def test_every_integer_is_whole(value: int) -> None:
    assert whole("x", value) == value


@given(st.floats(), st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_what_passes_lies_in_the_bounds(value: float, a: float, b: float) -> None:
    low, high = sorted((a, b))
    if low <= value <= high:
        assert real("x", value, low, high) == value
    else:
        with pytest.raises(InputError, match=r"^x must be a number from"):
            real("x", value, low, high)


@pytest.mark.parametrize("value", [*NO_NUMBER, math.nan, math.inf, -math.inf, 10**400, -(10**400), Fraction(10**400)])
def test_what_is_no_number_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match=r"^step must be a number"):
        real("step", value)


@pytest.mark.parametrize("value", [*NO_NUMBER, 1.5, 2.0, math.nan, math.inf])
def test_what_is_not_whole_is_refused(value: Any) -> None:
    with pytest.raises(InputError, match=r"^threads must be a whole number"):
        whole("threads", value)


@pytest.mark.parametrize("value", [3, np.int64(3), np.uint8(3)])
def test_numbers_of_any_make_come_out_as_pythons(value: Any) -> None:
    assert type(whole("x", value, 3, 3)) is int
    assert type(real("x", value, 3, 3)) is float
    assert type(real("x", np.float32(0.5))) is float


def test_the_message_says_what_is_allowed_what_was_got_and_what_to_do() -> None:
    with pytest.raises(InputError) as error:
        real("--step", 7, 0.0001, 0.1, unit="s", advice="a step of 0.001 s is usual")
    assert str(error.value) == "--step must be a number from 0.0001 to 0.1 s, got 7; a step of 0.001 s is usual"
    with pytest.raises(InputError, match=r"^pairs must be a whole number of at least 1, got 0$"):
        whole("pairs", 0, 1)
    with pytest.raises(InputError, match=r"^pairs must be a whole number of at most 9, got 10$"):
        whole("pairs", 10, high=9)


@given(st.one_of(st.text(), st.integers(), st.floats(), st.binary(), st.lists(st.integers())))
def test_what_is_shown_is_short(value: object) -> None:
    assert len(shown(value)) < 100


def test_a_number_that_python_does_not_print_is_told_all_the_same() -> None:
    huge = 10 ** (sys.get_int_max_str_digits() + 1)
    with pytest.raises(InputError, match=r"got a number too large"):
        real("x", huge)
    with pytest.raises(InputError, match=r"got a number too large"):
        whole("x", huge, 0, 5)
