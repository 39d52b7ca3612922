"""Where saccades start: the eye and its motors, at rest or in motion."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError

Array = NDArray[np.float64]
LARGEST = 1e9
"""deg, deg/s, 1/s: a larger number is as good as none, and only makes others overflow."""


@dataclass(frozen=True)
class State:
    """The state of a batch of eyes at one instant.

    Attributes:
        orientation: unit quaternions w, x, y, z, (saccades, 4); normalised here. The zero quaternion is none, and NaN.
        motor: positions of all motors of the plant, which rest there, in their units, (saccades, motors).
        angular_velocity: head frame [deg/s], (saccades, 3); unless given, at rest.

    Raises:
        InputError: shapes that do not fit, or what are no real numbers.
    """

    orientation: Array
    motor: Array
    angular_velocity: Array = None  # type: ignore[assignment]  # never None once made

    def __post_init__(self) -> None:
        orientation, motor = as_numbers("orientations", self.orientation), as_numbers("motor positions", self.motor)
        count = len(orientation) if orientation.ndim else 0
        velocity = np.zeros((count, 3)) if self.angular_velocity is None else self.angular_velocity
        velocity = as_numbers("angular velocities", velocity)
        shapes = (orientation.shape, velocity.shape, motor.shape[:1])
        if shapes != ((count, 4), (count, 3), (count,)) or motor.ndim != 2:
            raise InputError(
                f"a state of {count} eyes has orientations ({count}, 4), angular velocities ({count}, 3) and motor "
                f"positions ({count}, motors), got {orientation.shape}, {velocity.shape} and {motor.shape}"
            )
        none = ~orientation.any(axis=1, keepdims=True)
        object.__setattr__(self, "orientation", unit(np.where(none, np.nan, orientation)))
        object.__setattr__(self, "motor", motor)
        object.__setattr__(self, "angular_velocity", velocity)

    def __len__(self) -> int:
        return len(self.orientation)

    def __getitem__(self, which: NDArray[np.intp] | slice | list[int]) -> "State":
        return State(self.orientation[which], self.motor[which], self.angular_velocity[which])

    def to_plain(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        return {name: getattr(self, name).tolist() for name in self.__dataclass_fields__}

    @classmethod
    def from_plain(cls, content: dict[str, Any]) -> "State":
        """The state that `to_plain` wrote."""
        if not content["orientation"]:
            return cls(np.empty((0, 4)), np.empty((0, 0)))
        return cls(**{name: np.array(content[name], dtype=float) for name in cls.__dataclass_fields__})

    @property
    def finite(self) -> NDArray[np.bool_]:
        """Whether all numbers of each eye are finite, (saccades,)."""
        parts = (self.orientation, self.motor, self.angular_velocity)
        return np.asarray(np.isfinite(np.concatenate(parts, axis=1)).all(axis=1))


def as_numbers(what: str, values: Any) -> Array:
    """Real numbers as an array of floats.

    Args:
        what: they are, for messages.
        values: an array or nested lists.

    Raises:
        InputError: rows of different lengths, or something else: text, truth values, complex numbers, objects.
    """
    try:
        array = np.asarray(values)
    except (TypeError, ValueError, RuntimeError) as error:
        raise InputError(f"{what} must be an array of real numbers, and this is none: {error}") from error
    if array.dtype.kind not in "iuf":
        raise InputError(f"{what} must be an array of real numbers, got one of {array.dtype}")
    return array.astype(float, copy=False)


def sane(numbers: Array, least: float = 0.0) -> Array:
    """Numbers, and NaN where they are none, or their size is below the least or beyond `LARGEST`."""
    size = np.abs(numbers)
    return np.where((size >= least) & (size <= LARGEST), numbers, np.nan)


def unit(orientation: Array) -> Array:
    """Orientations (saccades, 4) of unit length.

    Raises:
        InputError: one is the zero quaternion.
    """
    size = np.abs(orientation).max(axis=-1, keepdims=True, initial=0)  # first, so that no norm overflows
    if (size == 0).any():
        raise InputError("an orientation is the zero quaternion; looking straight ahead is (1, 0, 0, 0)")
    with np.errstate(invalid="ignore"):
        scaled = np.where((size > 0.1) & (size < 10), orientation, orientation / size)
        norm = np.linalg.norm(scaled, axis=-1, keepdims=True)
        # What is of unit length already keeps its very bits, so that a state read from a file is the same one.
        unit: Array = np.where(np.abs(norm - 1) < 1e-12, scaled, scaled / norm)
    return unit
