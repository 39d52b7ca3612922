"""A motor as it is described by the model of an eye or by a rig: name, unit, range, limits."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError

Array = NDArray[np.float64]
AXES = 3
"""About which an eye turns."""


@dataclass(frozen=True)
class Motor:
    """One motor.

    Attributes:
        name: as in the model.
        unit: of its position, "deg".
        range: mechanical: its least and largest position; may be infinite.
        working: where a policy may send it, inside the range.
        speed_limit: largest speed [unit/s]; None for none.
        acceleration_limit: largest acceleration [unit/s^2]; None for none.
        rest: where it stands when the eye looks straight ahead at ease: 0, or what is nearest to it in the range; or
            its pretension.

    Raises:
        InputError: a range or limit that is none, or a rest outside the range.
    """

    name: str
    unit: str = "deg"
    range: tuple[float, float] = (-inf, inf)
    working: tuple[float, float] = (-inf, inf)
    speed_limit: float | None = None
    acceleration_limit: float | None = None
    rest: float = 0.0

    def __post_init__(self) -> None:
        low, high = self.range
        inside = max(low, self.working[0]), min(high, self.working[1])
        if any(math.isnan(end) for end in (*self.range, *self.working)) or not (low < high and inside[0] < inside[1]):
            raise InputError(f"motor {self.name!r}: a range goes from low to high, got {self.range}, {self.working}")
        object.__setattr__(self, "working", inside)
        if self.rest == 0:  # nobody has said more
            object.__setattr__(self, "rest", min(max(0.0, low), high))
        if not low <= self.rest <= high:
            raise InputError(f"motor {self.name!r} rests inside its range {low:g} to {high:g}, got {self.rest:g}")
        for limit in (self.speed_limit, self.acceleration_limit):
            if limit is not None and not limit > 0:
                raise InputError(f"motor {self.name!r}: a limit is positive, or None, got {limit}")

    @property
    def column(self) -> str:
        """Name of its column in tables: tau2_deg for motor2 (tau is the thesis' symbol), NAME_UNIT for others."""
        number = self.name.removeprefix("motor")
        name = f"tau{number}" if number.isdecimal() and number != self.name else self.name
        return f"{name}_{self.unit}"


def names(motors: Sequence[Motor]) -> tuple[str, ...]:
    """Of the motors."""
    return tuple(motor.name for motor in motors)


def ranges(motors: Sequence[Motor]) -> Array:
    """Mechanical ranges, (motors, 2)."""
    return np.array([motor.range for motor in motors], dtype=float).reshape(-1, 2)


def rests(motors: Sequence[Motor]) -> Array:
    """Where they stand when the eye looks straight ahead at ease, (motors,)."""
    return np.array([motor.rest for motor in motors], dtype=float)


def redundant(motors: Sequence[Motor]) -> bool:
    """Whether they are more than the axes about which an eye turns: then they hold an orientation in many ways."""
    return len(motors) > AXES


def check_driven(motors: Sequence[Motor], driven: Sequence[str], plant: str) -> list[int]:
    """Indices of the driven motors among a plant's.

    Raises:
        InputError: none, one twice, or one the plant has not.
    """
    if len(set(driven)) != len(driven):
        raise InputError(f"a motor is named twice among {', '.join(driven)}; name each once")
    missing = [name for name in driven if name not in names(motors)]
    if missing or not driven:
        raise InputError(f"plant {plant!r} has the motors {', '.join(names(motors))}; cannot drive {missing}")
    return [names(motors).index(name) for name in driven]
