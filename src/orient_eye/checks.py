"""One place that checks a number which a user gave: what it has to be, from where to where, and what to do."""

import math
import numbers
import operator
import reprlib
from typing import Any

from orient_eye.errors import InputError


def real(
    name: str, value: Any, low: float = -math.inf, high: float = math.inf, *, unit: str = "", advice: str = ""
) -> float:
    """The value as a float: a finite number from low to high, both allowed. Neither a bool nor text is a number.

    Raises `InputError` with the name, the bounds in this unit, what was got, and the advice.
    """
    if not isinstance(value, bool) and isinstance(value, numbers.Real):
        try:
            number = float(value)
        except OverflowError:  # a whole number beyond every float
            number = math.inf
        if math.isfinite(number) and low <= number <= high:
            return number
    raise refusal(name, "a number", value, low, high, unit=unit, advice=advice)


def whole(name: str, value: Any, low: float = -math.inf, high: float = math.inf, *, advice: str = "") -> int:
    """The value as an int: a whole number from low to high, both allowed. Neither a bool nor 2.0 is one.

    Raises `InputError` with the name, the bounds, what was got, and the advice.
    """
    if not isinstance(value, bool):
        try:
            number = operator.index(value)
        except TypeError:
            pass
        else:
            if low <= number <= high:
                return number
    raise refusal(name, "a whole number", value, low, high, advice=advice)


def refusal(
    name: str, kind: str, value: object, low: float, high: float, *, unit: str = "", advice: str = ""
) -> InputError:
    """The error of a value that is not of this kind, or not from low to high."""
    if low > -math.inf and high < math.inf:
        kind += f" from {shown(low)} to {shown(high)}"
    elif low > -math.inf:
        kind += f" of at least {shown(low)}"
    elif high < math.inf:
        kind += f" of at most {shown(high)}"
    allowed = " ".join(filter(None, [kind, unit]))
    return InputError(f"{name} must be {allowed}, got {shown(value)}" + (f"; {advice}" if advice else ""))


def likely_milliseconds(rows: int, lasts_s: float, *, many: int = 50) -> str:
    """What to say of so many rows over so many seconds where they are probably milliseconds; else nothing.

    Nobody samples an eye or a motor at less than 2 Hz for many rows.
    """
    apart = lasts_s / max(rows - 1, 1)
    if rows < many or apart < _SLOW_S:
        return ""
    return (
        f"{rows} rows are {apart:.4g} s apart and last {lasts_s:.4g} s: are these ms? t_s is in s, divide by 1000 (a "
        "command that is so slow needs few rows, between which it is a straight line)"
    )


def likely_radians(what: str, largest_deg: float) -> str:
    """What to say of something that moves by so many degrees at most where they are probably radians; else nothing.

    A quarter turn is less than 1.6 rad; a saccade of 1 deg is one all the same, so this is no error by itself.
    """
    if not 0 < largest_deg < _RADIAN:
        return ""
    asked = f"{what} moves by {largest_deg:.3g} deg at most: are these radians?"
    return f"{asked} They are read in deg, multiply by {DEG:.7g}"


def shown(value: object) -> str:
    """A value as a message shows it: a number as people write it, anything else as Python does, and never long."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        text = reprlib.repr(value)
        return text if len(text) <= LONGEST else text[:LONGEST] + "..."
    try:
        number = float(value)
    except OverflowError:
        return "a number too large for any computer"
    return f"{number:.15g}"


LONGEST = 80
"""Characters of a value in a message."""
DEG = 180 / math.pi
"""In a radian."""
_SLOW_S, _RADIAN = 0.5, 1.6
