"""What all plants have in common that are stepped through time."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands import Command, as_command
from orient_eye.constants import HORIZON_S, LONGEST_S, STEP_S
from orient_eye.errors import InputError
from orient_eye.motor import Motor, names, ranges
from orient_eye.movement import Movement, SampledMovement, energy_of
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import SIMULATED, Pace, Plant, PulseRates
from orient_eye.plants.limited_motor import follow
from orient_eye.rotations import FORWARD
from orient_eye.state import State

if TYPE_CHECKING:
    import mujoco

Array = NDArray[np.float64]
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
        return Given(self.command[which], *(part[which] for part in parts))  # type: ignore[index, arg-type]


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


class SimulatedPlant(ABC):
    """A plant that is stepped: see `orient_eye.plants.Plant` for its members.

    A subclass sets `name` and `motors` and writes `run`, `rest`, `hold` and `identity`.
    """

    name: str
    motors: tuple[Motor, ...]
    step_s: float = STEP_S
    horizon_s: float | None = HORIZON_S
    pace: Pace = SIMULATED
    slow_pole: float | None = None
    pulse_rates: PulseRates | None = None
    tendons: tuple[str, ...] = ()

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
        given = self.prepare(as_command(command, self.step_s), start, horizon_s)
        orientation, velocity, tension, diverged = self.run(given.motor, given.start)
        failed = given.failed | diverged
        motor = given.motor
        for array in (orientation, velocity, motor, *(() if tension is None else (tension,))):
            array[failed] = np.nan
        sampled = Trajectory(
            self.times(motor.shape[1]), orientation, velocity, given.told, motor, tension, failed,
            motors=self.motors, tendon_names=self.tendons,
        )  # fmt: skip
        return SampledMovement(sampled, given.command, given.saturated, given.limited, self.rest)

    def times(self, samples: int) -> Array:
        """Of the samples [s]."""
        return np.arange(samples) * np.float64(self.step_s)

    def samples(self, command: Command, horizon_s: float | None) -> int:
        """How many samples a movement has.

        Raises:
            InputError: a horizon that is none.
        """
        if horizon_s is not None and not 0 < horizon_s <= LONGEST_S:
            raise InputError(f"a horizon lies between 0 and {LONGEST_S:g} s, got {horizon_s}")
        told = (horizon_s, command.duration_s, self.horizon_s, HORIZON_S)
        duration = next(seconds for seconds in told if seconds is not None)
        return round(duration / self.step_s) + 1

    def prepare(self, command: Command, start: State | None, horizon_s: float | None) -> "Given":
        """What the motors are told and do, and where the eyes start.

        Raises:
            InputError: another number of motors or starts, or a written command outside the mechanical range.
        """
        told = command.sample(self.step_s, self.samples(command, horizon_s))
        held, saturated = self._within_range(command, told)
        failed = np.asarray(~np.isfinite(told).all(axis=(1, 2)))
        held = np.where(failed[:, None, None], 0.0, held)
        if start is None:
            start = State(self.rest(held[:, 0]), held[:, 0])
        if start.motor.shape != (len(command), len(self.motors)):
            raise InputError(
                f"{len(command)} saccades of plant {self.name!r} start with as many eyes of {len(self.motors)} motors, "
                f"got motor positions {start.motor.shape}"
            )
        failed |= ~start.finite
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
