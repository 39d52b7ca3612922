"""What a plant returns: a movement of the eye that measures itself.

    movement = plant.move(command, start)
    movement.measure().settling_time_s               # (saccades,)
    movement.energy()                                # of what the motors really did
    movement.trajectory()                            # the batch over time

A movement is either sampled (`SampledMovement`) or a closed form, which stands in its plant's file.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from orient_eye.cached import cached_property
from orient_eye.commands import Command, path_energy
from orient_eye.constants import BAND, DOUBT
from orient_eye.movement.measures import Measures, View, measure, merged, merged_rows
from orient_eye.movement.tail import Tail, tail_of
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

    def excess_force(self) -> Array | None:
        """Force of the fixation in which it ends, beyond the least that holds this gaze [N^2], (saccades,).

        None on a plant of which no elastics are known (`orient_eye.plants.fixation`).
        """
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


def _known(rest: Array, motor: Array) -> Array:
    return rest


def _unknown(orientation: Array, motor: Array) -> None:
    return None


@dataclass(frozen=True)
class SampledMovement:
    """A movement known at samples.

    Attributes:
        sampled: its trajectory.
        command: what the motors were told.
        saturated: see `Movement`.
        limited: see `Movement`.
        rest: orientations (saccades, 4) in which the eye rests when its motors stand at (saccades, motors).
        excess: of orientations (saccades, 4) held by motors at (saccades, motors), see `Movement.excess_force`.
        endless: whether the saccades go on after their samples, and what follows counts; else it is as if there were
            nothing.
        further: of saccades that go on, some of them (an index) over a longer time; None where this is the longest.
        doubt: share of the amplitude by which a measure may be wrong because a saccade that goes on was not stepped on.
    """

    sampled: Trajectory
    command: Command
    saturated: NDArray[np.bool_]
    limited: NDArray[np.bool_]
    rest: Callable[[Array], Array]
    excess: Callable[[Array, Array], Array | None] = _unknown
    endless: bool = False
    further: "Callable[[NDArray[np.intp]], SampledMovement] | None" = None
    doubt: float = DOUBT

    @cached_property
    def stands(self) -> Array:
        """Where the motors come to stand, (saccades, motors)."""
        low, high = np.array([motor.range for motor in self.sampled.motors]).T
        return np.clip(self.command.final, low, high)

    @cached_property
    def final(self) -> Array:
        """Orientations in which the eye comes to rest, (saccades, 4): so a short horizon does not shift them."""
        return self.rest(self.stands)

    @cached_property
    def tail(self) -> Tail | None:
        """How the saccades go on; None where nothing follows that counts."""
        return tail_of(self.sampled, self.final, self.stands) if self.endless else None

    def measure(self, band: float = BAND, of: View = "orientation") -> Measures:
        """See `Movement.measure`; interpolated between samples, so that measures are continuous in the command.

        Of saccades that go on they do not depend on where the samples end: what may still do something is stepped on.
        """
        found = measure(self.sampled, self.final, band=band, of=of, tail=self.tail)
        if self.tail is None or self.further is None:
            return found
        goes_on = ~self.tail.sure(found.amplitude_deg, found.overshoot, band, self.doubt)
        if not goes_on.any():
            return found
        movement, rows = self._later(goes_on)
        far = movement.measure(band, of)[rows]
        in_time = far.settled & (far.settling_time_s <= self.sampled.time[-1])
        return merged(goes_on, replace(far, settled=in_time), found[~goes_on])

    def energy(self) -> Array:
        """See `Movement.energy`: the command's own where the motors followed it, else that of the path they took."""
        energy = energy_of(self.command, self.sampled.motor, self.sampled.time, self.saturated | self.limited)
        if self.tail is None or self.further is None:
            return energy
        moving = np.isinf(self.tail.doubt)
        if moving.any():
            movement, rows = self._later(moving)
            energy = merged_rows(moving, movement.energy()[rows], energy[~moving])
        return energy

    def excess_force(self) -> Array | None:
        """See `Movement.excess_force`."""
        return self.excess(self.final, self.stands)

    def _later(self, which: NDArray[np.bool_]) -> "tuple[SampledMovement, NDArray[np.bool_]]":
        """A longer movement that has these saccades, kept for the next question, and which of its own they are."""
        assert self.further is not None
        if not self._kept or (which & ~self._kept[0][0]).any():
            rest = partial(_known, self.final[which])
            self._kept[:] = [(which, replace(self.further(np.flatnonzero(which)), rest=rest))]
        kept, movement = self._kept[0]
        return movement, which[kept]

    @cached_property
    def _kept(self) -> "list[tuple[NDArray[np.bool_], SampledMovement]]":
        return []

    def trajectory(self) -> Trajectory:
        """See `Movement.trajectory`."""
        return self.sampled
