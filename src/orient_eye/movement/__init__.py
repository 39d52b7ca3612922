"""What a plant returns: a movement of the eye that measures itself.

    movement = plant.move(command, start)
    movement.measure().settling_time_s               # (saccades,)
    movement.energy()                                # of what the motors really did
    movement.trajectory()                            # the batch over time

A movement is either sampled (`SampledMovement`) or a closed form, which stands in its plant's file.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands import Command, path_energy
from orient_eye.constants import BAND
from orient_eye.movement.measures import Measures, View, measure
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]


class Movement(Protocol):
    """A batch of saccades as they were made.

    Attributes:
        saturated: True where a motor was told to go beyond its mechanical range and stayed at it, (saccades,).
        limited: True where a limit of speed or acceleration kept a motor from where it was told to be, (saccades,).
    """

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """See the class."""
        ...

    @property
    def limited(self) -> NDArray[np.bool_]:
        """See the class."""
        ...

    def measure(self, band: float = BAND, of: View = "orientation") -> Measures:
        """Settling time, overshoot and the others, of the orientation or of the gaze alone.

        Args:
            band: settling band, share of the amplitude.
            of: "orientation", or "gaze", for which torsion does not count.
        """
        ...

    def energy(self) -> Array:
        """Integral of the squared speeds of the motors as they moved [deg^2/s], (saccades,); thesis 4.35."""
        ...

    def trajectory(self) -> Trajectory:
        """The movement over time."""
        ...


def energy_of(command: Command, motor: Array, time: Array, changed: NDArray[np.bool_]) -> Array:
    """Energy (saccades,) of a command; where limits changed it, of the path (saccades, time, motors) that was taken."""
    told = command.energy()
    if not changed.any():
        return told
    return np.where(changed, path_energy(motor, float(time[1] - time[0])), told)


@dataclass(frozen=True)
class SampledMovement:
    """A movement known at samples.

    Attributes:
        sampled: its trajectory.
        command: what the motors were told.
        saturated: see `Movement`.
        limited: see `Movement`.
        rest: orientations (saccades, 4) in which the eye rests when its motors stand at (saccades, motors).
    """

    sampled: Trajectory
    command: Command
    saturated: NDArray[np.bool_]
    limited: NDArray[np.bool_]
    rest: Callable[[Array], Array]

    @cached_property
    def final(self) -> Array:
        """Orientations in which the eye comes to rest, (saccades, 4): so a short horizon does not shift them."""
        low, high = np.array([motor.range for motor in self.sampled.motors]).T
        return self.rest(np.clip(self.command.final, low, high))

    def measure(self, band: float = BAND, of: View = "orientation") -> Measures:
        """See `Movement.measure`; interpolated between samples, so that measures are continuous in the command."""
        return measure(self.sampled, self.final, band=band, of=of)

    def energy(self) -> Array:
        """See `Movement.energy`: the command's own where the motors followed it, else that of the path they took."""
        return energy_of(self.command, self.sampled.motor, self.sampled.time, self.saturated | self.limited)

    def trajectory(self) -> Trajectory:
        """See `Movement.trajectory`."""
        return self.sampled
