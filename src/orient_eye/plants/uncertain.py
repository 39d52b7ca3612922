"""A linear eye whose numbers are known only within intervals: every saccade is made by another eye of them.

    plant = uncertain(LinearPlant("surrogate.json"))         # over the intervals that sysid found
    plant.move(command, random=np.random.default_rng(0))     # each saccade has its own K, poles and dead time

The motor and its limits are those of the nominal plant, and its positions are what the eye starts from: an eye of
another gain rests elsewhere. Without a random generator it is the nominal plant.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.cached import cached_property
from orient_eye.commands import as_command
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.constants import BAND
from orient_eye.errors import InputError
from orient_eye.movement import Movement
from orient_eye.movement.measures import Measures, View, measure_angle, merged
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import Plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.linear_response import (
    LinearResponse,
    measure_closed_form,
    sampled_response,
    second_order_poles,
)
from orient_eye.plants.simulated import Given, GivenMovement
from orient_eye.state import State

Array = NDArray[np.float64]
Intervals = Mapping[str, tuple[float, float]]
NUMBERS = ("K", "w0", "wn", "zeta", "dead_time")


@dataclass(frozen=True)
class Numbers:
    """Numbers of linear eyes, one of each saccade.

    Attributes:
        K: gain, (saccades,).
        poles: [rad/s], one or two, each (saccades,).
        dead_time: [s], (saccades,).
    """

    K: Array
    poles: tuple[NDArray[Any], ...]
    dead_time: Array

    def __getitem__(self, which: NDArray[Any]) -> "Numbers":
        return Numbers(self.K[which], tuple(pole[which] for pole in self.poles), self.dead_time[which])


class UncertainPlant(LinearPlant):
    """The surrogate with numbers drawn evenly from intervals; see `orient_eye.plants.Plant`.

    Safe to share; a random generator is not, so each thread brings its own.

    Args:
        nominal: the plant in the middle.
        intervals: low and high of K, w0, wn, zeta or dead_time [s]; a number without one keeps its value.

    Raises:
        InputError: no interval, one of no number of the plant, or one that holds no eye.
    """

    def __init__(self, nominal: LinearPlant, intervals: Intervals) -> None:
        super().__init__(nominal.surrogate, step_s=nominal.step_s)
        nominal_numbers = {name: getattr(nominal.surrogate, name) for name in NUMBERS}
        known = [name for name, value in nominal_numbers.items() if value is not None]
        if not intervals or set(intervals) - set(known):
            raise InputError(
                f"intervals of this plant's numbers are of {', '.join(known)}, got {', '.join(intervals) or 'none'}; "
                "sysid writes them into surrogate.json"
            )
        self.intervals: dict[str, tuple[float, float]] = {}
        for name in known:
            low, high = intervals.get(name, (nominal_numbers[name],) * 2)
            if name == "dead_time":
                low, high = max(low, 0.0), max(high, 0.0)
            one_sign = low * high > 0 or name == "dead_time"
            if not (np.isfinite([low, high]).all() and low <= high and one_sign):
                raise InputError(
                    f"{name} lies between {low:g} and {high:g}: the recordings do not tell it, and no policy can be "
                    "robust to that; record more or larger steps"
                )
            self.intervals[name] = (float(low), float(high))

    def draw(self, count: int, random: np.random.Generator) -> Numbers:
        """Numbers of this many eyes."""
        drawn = {name: random.uniform(low, high, count) for name, (low, high) in self.intervals.items()}
        poles = (drawn["w0"],) if "w0" in drawn else second_order_poles(drawn["wn"], drawn["zeta"])
        return Numbers(drawn["K"], poles, drawn["dead_time"])

    def move(
        self,
        command: Any,
        start: State | None = None,
        horizon_s: float | None = None,
        random: np.random.Generator | None = None,
    ) -> Movement:
        """Perform a batch of saccades; see `orient_eye.plants.Plant`. The eyes start at rest."""
        if random is None:
            return super().move(command, start, horizon_s)
        given = self.prepare(as_command(command, self.step_s), start, horizon_s)
        return UncertainMovement(self, given, self.draw(len(given.motor), random))

    def identity(self) -> dict[str, Any]:
        """That of the nominal plant, and the intervals."""
        return {**super().identity(), "intervals": {name: list(ends) for name, ends in self.intervals.items()}}


def uncertain(plant: Plant, intervals: Intervals | None = None) -> UncertainPlant:
    """A plant with numbers drawn from intervals.

    Args:
        plant: a linear one.
        intervals: of its numbers; None for the 95 % intervals that its surrogate came with.

    Raises:
        InputError: another plant, or no intervals.
    """
    if not isinstance(plant, LinearPlant):
        raise InputError(f"plant {plant.name!r} has no identified intervals; give a surrogate that sysid wrote")
    if intervals is None:
        has = {name for name in NUMBERS if getattr(plant.surrogate, name) is not None}
        intervals = {name: ends for name, ends in plant.surrogate.intervals.items() if name in has}
        if not intervals:
            raise InputError("this surrogate has no intervals; take one that sysid wrote from recordings")
    return UncertainPlant(plant, intervals)


@dataclass(frozen=True)
class UncertainMovement(GivenMovement):
    """Saccades of eyes that each have their own numbers; see `orient_eye.movement.Movement`.

    Attributes:
        plant: that moved.
        given: command and path of the motor.
        numbers: of the eyes.
    """

    plant: UncertainPlant
    given: Given
    numbers: Numbers

    @cached_property
    def sampled(self) -> NDArray[np.bool_]:
        """Which are not pulse-steps that the motor follows, and so not in closed form, (saccades,)."""
        given = self.given
        if not isinstance(given.command, PulseStep):
            return np.ones(len(given.motor), bool)
        return given.saturated | given.limited | given.failed

    def measure(self, band: float = BAND, of: View = "orientation") -> Measures:
        """See `orient_eye.movement.Movement`; of eyes that turn about one axis."""
        which = self.sampled
        if which.all():
            return self._measure_sampled(which, band)
        closed = self._measure_closed(~which, band)
        return merged(which, self._measure_sampled(which, band), closed) if which.any() else closed

    def _measure_closed(self, which: NDArray[np.bool_], band: float) -> Measures:
        numbers = self.numbers[which]
        command = self.given.command
        assert isinstance(command, PulseStep)
        command = self.plant.from_rest(command[which])
        response = LinearResponse(numbers.K, numbers.poles, numbers.dead_time, command)
        return measure_closed_form(response, band, self.plant.surrogate.axis)

    def _measure_sampled(self, which: NDArray[np.bool_], band: float) -> Measures:
        angle, rate = self._sample(which)
        low, high = self.plant.motors[0].range
        stands = np.clip(self.given.command.final[which, 0], low, high)
        final = self.numbers.K[which] * (stands - self.plant.surrogate.rest)
        failed = self.given.failed[which] | ~np.isfinite(final)
        time = self.plant.times(angle.shape[1])
        return measure_angle(time, angle, rate, final, self.plant.surrogate.axis, failed, band=band)

    def _sample(self, which: NDArray[np.bool_]) -> tuple[Array, Array]:
        numbers, rest = self.numbers[which], self.plant.surrogate.rest
        motor, before = self.given.motor[which, :, 0] - rest, self.given.start.motor[which, 0] - rest
        return sampled_response(numbers.K, numbers.poles, numbers.dead_time, motor, self.plant.step_s, before)

    def trajectory(self) -> Trajectory:
        """The movement at the plant's samples."""
        given = self.given
        angle, rate = self._sample(np.ones(len(given.motor), bool))
        orientation, velocity = self.plant.turned(angle, rate)
        motor = given.motor.copy()
        for array in (orientation, velocity, motor):
            array[given.failed] = np.nan
        time = self.plant.times(motor.shape[1])
        return Trajectory(time, orientation, velocity, given.told, motor, None, given.failed, self.plant.motors)
