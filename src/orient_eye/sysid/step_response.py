"""One step response: what the motor did and how far the eye followed.

A plant, a CSV file and a log of the rig all come down to this.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError

Array = NDArray[np.float64]
_LARGEST_DEG = 1e6  # even of a motor that tells counts


@dataclass(frozen=True)
class StepResponse:
    """Movement of the eye after a movement of its motor, both measured from rest.

    Before the first sample motor and eye stand at 0; at the first sample the motor is at
    `motor_deg[0]` (0 for a recording that begins at rest, the amplitude for an ideal step) and
    between samples it moves along straight lines.

    Attributes:
        name: for tables and pictures: the file's name, or the amplitude.
        time: [s], rising, any spacing, (samples,).
        motor_deg: position of the motor from its rest position [deg], (samples,).
        eye_deg: position of the eye from its rest position [deg], (samples,).
        orientation: unit quaternion w, x, y, z where the source has one, (samples, 4).
        motors: positions of named motors of the eye where the source has them [deg], each (samples,).
        drive: name of the motor, or of the sum of several, that `motor_deg` is.
        axis: about which `eye_deg` turns: yaw, pitch or roll; None where nobody said.
        about: that axis as a unit vector in the head frame where it is none of these three, (3,).
        rest: motor and eye at rest as they were read [deg], before they were measured from there.
        turned: how far the eye turned in yaw, pitch and roll [deg], as far as the source tells.
        source: where it comes from, plain values.
        warnings: what the reader noticed.
    """

    name: str
    time: Array
    motor_deg: Array
    eye_deg: Array
    orientation: Array | None = None
    motors: dict[str, Array] = field(default_factory=dict)
    drive: str = "motor"
    axis: str | None = None
    about: Array | None = None
    rest: tuple[float, float] = (0.0, 0.0)
    turned: dict[str, float] = field(default_factory=dict)
    source: dict[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        shapes = {self.time.shape, self.motor_deg.shape, self.eye_deg.shape}
        if len(shapes) != 1 or self.time.ndim != 1:
            raise InputError(f"{self.name}: time, motor and eye need one length, got shapes {sorted(shapes)}")
        if not all(np.isfinite(a).all() for a in (self.time, self.motor_deg, self.eye_deg)):
            raise InputError(f"{self.name}: time, motor and eye must be finite numbers; remove rows that are not")
        if max(np.abs(a).max(initial=0) for a in (self.motor_deg, self.eye_deg)) > _LARGEST_DEG:
            raise InputError(f"{self.name}: nothing turns by more than {_LARGEST_DEG:g} deg; motor and eye are in deg")
        if not (np.diff(self.time) > 0).all():
            raise InputError(f"{self.name}: time must rise from row to row; sort the rows and remove repeated ones")

    def until(self, time: float) -> "StepResponse":
        """Its samples up to a time [s]."""
        kept = self.time <= time
        return replace(
            self,
            time=self.time[kept],
            motor_deg=self.motor_deg[kept],
            eye_deg=self.eye_deg[kept],
            orientation=None if self.orientation is None else self.orientation[kept],
            motors={name: values[kept] for name, values in self.motors.items()},
        )

    @property
    def largest_deg(self) -> float:
        """Farthest that the motor goes from rest [deg], whether or not it comes back."""
        return float(np.abs(self.motor_deg).max())

    @property
    def axis_vector(self) -> Array:
        """The axis of `eye_deg`, a unit vector in the head frame, (3,)."""
        return np.eye(3)[rotations.AXES[self.axis or "yaw"]] if self.about is None else self.about

    @property
    def amplitude_deg(self) -> float:
        """Where the motor ends: mean of the last twentieth of the time [deg]."""
        return float(self.motor_deg[self._end].mean())

    @property
    def settled_gain(self) -> float:
        """End of the eye over end of the motor, without any model of the dynamics [deg/deg]."""
        return float(self.eye_deg[self._end].mean()) / self.amplitude_deg if self.amplitude_deg else float("nan")

    @property
    def _end(self) -> NDArray[np.bool_]:
        late: NDArray[np.bool_] = self.time >= self.time[-1] - 0.05 * (self.time[-1] - self.time[0])
        return late


def axis_angle(orientation: Array, axis: str) -> Array:
    """Yaw, pitch or roll [deg] (..., time), without jumps at 180 deg, of orientations (..., time, 4)."""
    return np.unwrap(rotations.to_euler(orientation)[AXES.index(axis)], period=360.0)
