"""What all plants have in common that are stepped through time."""

import contextlib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import real
from orient_eye.commands import Command, as_command
from orient_eye.constants import DOUBT, HORIZON_S, LONGEST_S, STEP_S
from orient_eye.errors import InputError
from orient_eye.motor import Motor, names, ranges
from orient_eye.movement import Movement, SampledMovement, energy_of
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import EVALUATION_PAIRS, UPDATES, Plant, PulseRates
from orient_eye.plants.limited_motor import follow
from orient_eye.rotations import FORWARD
from orient_eye.state import LARGEST, State, sane

if TYPE_CHECKING:
    import mujoco

Array = NDArray[np.float64]
_LONGER = 1.5  # times as long a saccade goes on that may still do something
_LONGEST = 8.0  # times the plant's horizon, at most; what is left then is extrapolated
Run = tuple[Array, Array, Array | None, NDArray[np.bool_]]


@dataclass(frozen=True)
class Given:
    """A batch of saccades before the eye moves.

    Attributes:
        command: as it was given.
        told: where the motors are told to be, (saccades, time, motors).
        motor: where they are, inside their limits; of failed saccades 0.
        start: of the eyes; of failed saccades straight ahead.
        saturated: cut off by a motor's range, (saccades,).
        limited: changed by a limit of speed or acceleration, (saccades,).
        failed: command or start is not finite, (saccades,).
    """

    command: Command
    told: Array
    motor: Array
    start: State
    saturated: NDArray[np.bool_]
    limited: NDArray[np.bool_]
    failed: NDArray[np.bool_]

    def __getitem__(self, which: NDArray[Any]) -> "Given":
        """Some of the saccades; the command must know how to give some of itself."""
        parts = (self.told, self.motor, self.start, self.saturated, self.limited, self.failed)
        return Given(self.command[which], *(part[which] for part in parts))  # type: ignore[index, arg-type]  # as the docstring asks


@dataclass(frozen=True)
class GivenMovement:
    """What a movement, measured in whatever way, knows from what its motors did; see `orient_eye.movement.Movement`.

    Attributes:
        plant: that moved.
        given: command and path of the motors.
    """

    plant: "SimulatedPlant"
    given: Given

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """See `orient_eye.movement.Movement`."""
        return self.given.saturated

    @property
    def limited(self) -> NDArray[np.bool_]:
        """See `orient_eye.movement.Movement`."""
        return self.given.limited

    def energy(self) -> Array:
        """See `orient_eye.movement.Movement`."""
        given, time = self.given, self.plant.times(self.given.motor.shape[1])
        return energy_of(given.command, given.motor, time, given.saturated | given.limited)

    def excess_force(self) -> Array | None:
        """See `orient_eye.movement.Movement`."""
        return None


@dataclass(frozen=True)
class _Some:
    """Some saccades of a command that cannot give some of itself."""

    command: Command
    which: NDArray[np.intp]
    duration_s = None

    @property
    def saturates(self) -> bool:
        return self.command.saturates

    def __len__(self) -> int:
        return len(self.which)

    def sample(self, step_s: float, samples: int) -> Array:
        return self.command.sample(step_s, samples)[self.which]

    @property
    def final(self) -> Array:
        return self.command.final[self.which]

    def energy(self) -> Array:
        return self.command.energy()[self.which]

    @property
    def too_fast(self) -> NDArray[np.bool_]:
        return self.command.too_fast[self.which]


def _some(command: Command, which: NDArray[np.intp]) -> Command:
    some: Command = command[which] if hasattr(command, "__getitem__") else _Some(command, which)
    return some


class SimulatedPlant(ABC):
    """A plant that is stepped: see `orient_eye.plants.Plant` for its members.

    A subclass sets `name` and `motors` and writes `run`, `rest`, `hold` and `identity`. A saccade that may still change
    a measure where its samples end is stepped on: from its beginning, or from there on a plant that `resumes`, whose
    eye is wholly told by a `State`, also while its motors move.
    """

    name: str
    motors: tuple[Motor, ...]
    step_s: float = STEP_S
    horizon_s: float | None = HORIZON_S
    updates: int = UPDATES
    evaluation_pairs: int = EVALUATION_PAIRS
    slow_pole: float | None = None
    pulse_rates: PulseRates | None = None
    tendons: tuple[str, ...] = ()
    resumes: bool = False
    doubt: float = DOUBT

    @abstractmethod
    def run(self, motor: Array, start: State) -> Run:
        """Step through time.

        Args:
            motor: where the motors stand, (saccades, time, motors), finite and inside their range.
            start: of the eyes, finite.

        Returns:
            Orientation (saccades, time, 4), angular velocity [deg/s] (saccades, time, 3), tension of the tendons [N]
            (saccades, time, tendons) or None, and which saccades diverged (saccades,).
        """

    @abstractmethod
    def rest(self, motor: Array) -> Array:
        """See `orient_eye.plants.Plant`."""

    @abstractmethod
    def hold(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`."""

    @abstractmethod
    def identity(self) -> dict[str, Any]:
        """See `orient_eye.plants.Plant`."""

    def held(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`; one after the other."""
        found = np.full((len(orientation), len(self.motors)), np.nan)
        for i, each in enumerate(orientation):
            with contextlib.suppress(InputError):  # this one is not held
                found[i] = self.hold(each[None], driven)[0]
        return found

    def force(self, orientation: Array, motor: Array) -> Array | None:
        """None: of this plant no elastics are known."""
        return None

    def excess_force(self, orientation: Array, motor: Array) -> Array | None:
        """None: of this plant no elastics are known."""
        return None

    def turning_rates(self, orientation: Array, motor: Array) -> Array | None:
        """None: of this plant no elastics are known."""
        return None

    def motor_rates(self) -> Array:
        """NaN: nothing is known of them."""
        return np.full(len(self.motors), np.nan)

    def twin(self) -> "Plant | None":
        """No other plant is this one."""
        return None

    def drawn(self) -> "mujoco.MjModel":
        """A ball without tendons: this plant has no model of its own."""
        from orient_eye.eyes.model import ball

        return ball()

    def move(
        self,
        command: Any,
        start: State | None = None,
        horizon_s: float | None = None,
        random: np.random.Generator | None = None,
    ) -> Movement:
        """Perform a batch of saccades; see `orient_eye.plants.Plant`."""
        command = as_command(command, self.step_s)
        return self._moved(self.prepare(command, start, horizon_s), start)

    def _moved(self, given: "Given", start: State | None, before: Trajectory | None = None) -> SampledMovement:
        """A movement, and how it goes on where its command has no end; `before` are its first samples."""
        if before is None or not self.resumes:
            orientation, velocity, tension, diverged = self.run(given.motor, given.start)
        else:
            last = len(before.time) - 1
            here = State(before.orientation[:, -1], given.motor[:, last], before.angular_velocity[:, -1])
            orientation, velocity, tension, diverged = self.run(np.ascontiguousarray(given.motor[:, last:]), here)
            orientation = np.concatenate([before.orientation, orientation[:, 1:]], axis=1)
            velocity = np.concatenate([before.angular_velocity, velocity[:, 1:]], axis=1)
            if tension is not None and before.tension is not None:
                tension = np.concatenate([before.tension, tension[:, 1:]], axis=1)
        failed = given.failed | diverged
        motor = given.motor
        for array in (orientation, velocity, motor, *(() if tension is None else (tension,))):
            array[failed] = np.nan
        sampled = Trajectory(
            self.times(motor.shape[1]), orientation, velocity, given.told, motor, tension, failed,
            motors=self.motors, tendon_names=self.tendons,
        )  # fmt: skip

        endless, done = given.command.duration_s is None, motor.shape[1] > round(self._longest_s / self.step_s)
        further = partial(self._further, given.command, start, sampled) if endless and not done else None
        return SampledMovement(
            sampled,
            given.command,
            given.saturated,
            given.limited,
            self.rest,
            self.excess_force,
            endless,
            further,
            self.doubt,
        )

    def _further(
        self, command: Command, start: State | None, before: Trajectory, which: NDArray[np.intp]
    ) -> SampledMovement:
        """Some saccades over a longer time."""
        horizon_s = min(max(_LONGER * float(before.time[-1]), 2 * self.step_s), self._longest_s)
        some, begin = _some(command, which), None if start is None else start[which]
        return self._moved(self.prepare(some, begin, horizon_s), begin, before[which])

    @property
    def _longest_s(self) -> float:
        return min(_LONGEST * (self.horizon_s or HORIZON_S), LONGEST_S)

    def times(self, samples: int) -> Array:
        """Of the samples [s]."""
        return np.arange(samples) * np.float64(self.step_s)

    def samples(self, command: Command, horizon_s: float | None) -> int:
        """How many samples a movement has.

        Raises:
            InputError: a horizon that is none, or a command longer than any movement.
        """
        told = (horizon_s, command.duration_s, self.horizon_s, HORIZON_S)
        duration = real("how long a movement lasts", next(s for s in told if s is not None), 0, LONGEST_S, unit="s")
        return round(duration / self.step_s) + 1

    def prepare(self, command: Command, start: State | None, horizon_s: float | None) -> "Given":
        """What the motors are told and do, and where the eyes start.

        Raises:
            InputError: another number of motors or starts, or a written command outside the mechanical range.
        """
        told = command.sample(self.step_s, self.samples(command, horizon_s))
        failed = np.asarray(~(np.abs(told) <= LARGEST).all(axis=(1, 2)))
        held, saturated = self._within_range(command, np.where(failed[:, None, None], 0.0, told))
        if start is None:
            start = State(self.rest(held[:, 0]), held[:, 0])
        if start.motor.shape != (len(command), len(self.motors)):
            raise InputError(
                f"{len(command)} saccades of plant {self.name!r} start with as many eyes of {len(self.motors)} motors, "
                f"got motor positions {start.motor.shape}"
            )
        begins = np.concatenate([start.orientation, start.motor, start.angular_velocity], axis=1)
        failed |= np.isnan(sane(begins)).any(axis=1)
        begin = np.where(failed[:, None], 0.0, start.motor)
        motor, limited = follow(held, self.motors, self.step_s, begin)
        at = State(
            np.where(failed[:, None], FORWARD, start.orientation),
            begin,
            np.where(failed[:, None], 0.0, start.angular_velocity),
        )
        return Given(command, told, motor, at, saturated, limited, failed)

    def _within_range(self, command: Command, told: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Where the motors go (saccades, time, motors), and which saccades are cut off by their range."""
        if told.shape[2] != len(self.motors):
            raise InputError(
                f"a command of plant {self.name!r} has the shape (saccades, time, {len(self.motors)} motors: "
                f"{', '.join(names(self.motors))}), got {told.shape}"
            )
        low, high = ranges(self.motors).T
        if ((told >= low) & (told <= high)).all():  # as nearly always
            return told, np.zeros(len(told), bool)
        tolerance = 1e-9 * np.maximum(abs(low), abs(high))
        outside = (told < low - tolerance) | (told > high + tolerance)
        if outside.any() and not command.saturates:
            saccade, row, index = (int(i[0]) for i in outside.nonzero())
            motor = self.motors[index]
            raise InputError(
                f"saccade {saccade} sends {motor.name} to {told[saccade, row, index]:.1f} {motor.unit} at "
                f"{row * self.step_s:.3f} s; its mechanical range is {low[index]:.0f} to {high[index]:.0f} "
                f"{motor.unit}: make the command smaller"
            )
        return np.clip(told, low, high), np.asarray(((told < low) | (told > high)).any(axis=(1, 2)) & command.saturates)
