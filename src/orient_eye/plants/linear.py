"""The linear surrogate of an eye as a plant: exact, in closed form wherever its motor can do what it is told.

First order is the thesis' low-pass filter, theta' = w0 (K tau - theta) (3.11); second order and a dead time are
for rigs. A pulse-step from rest gives a movement in closed form, with no sampling at all. Any other command, and
one that a limit of the motor changes, is a path of straight lines between samples, and the eye is exact on those.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.cached import cached_property
from orient_eye.commands import Sampled, as_command, checked_step
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.constants import BAND, HORIZON_S, STEP_S
from orient_eye.errors import InputError
from orient_eye.movement import Movement
from orient_eye.movement.measures import Measures, View, measure, measure_angle, merged, merged_rows
from orient_eye.movement.trajectory import Trajectory, concatenate
from orient_eye.plants import PulseRates
from orient_eye.plants.limits import are_limited, limited_surrogate, travel_s
from orient_eye.plants.linear_response import (
    LinearResponse,
    free_response,
    measure_closed_form,
    sampled_response,
    second_order_poles,
)
from orient_eye.plants.simulated import Given, GivenMovement, Run, SimulatedPlant
from orient_eye.rig import Rig
from orient_eye.state import State
from orient_eye.surrogate import Surrogate, shipped_surrogates

if TYPE_CHECKING:
    import mujoco

Array = NDArray[np.float64]
_WORKING_DEG = 80.0  # thesis 4.3.1
_SAME_DEG = 1e-6
_SETTLED = 10.0  # time constants after which nothing is left


class LinearPlant(SimulatedPlant):
    """The surrogate as a plant; see `orient_eye.plants.Plant`. Safe to share: nothing in it changes.

    Args:
        surrogate: its numbers, a file of them, or the name of a shipped one.
        rig: whose drive of the surrogate's axis limits the motor: a TOML file or a shipped rig; None for the one
            inside the surrogate, if there is one.
        step_s: interval between samples [s].

    Raises:
        InputError: no such surrogate or rig, or a rig that does not turn the surrogate's axis.
    """

    name = "lpf"

    def __init__(
        self,
        surrogate: Surrogate | str | Path = "thesis",
        *,
        rig: Rig | str | Path | None = None,
        step_s: float = STEP_S,
    ) -> None:
        numbers = surrogate if isinstance(surrogate, Surrogate) else Surrogate.load(surrogate)
        numbers = limited_surrogate(numbers, rig)
        self.surrogate, self.step_s = numbers, checked_step(step_s)
        self.motors = (numbers.as_motor((numbers.rest - _WORKING_DEG, numbers.rest + _WORKING_DEG)),)
        self.poles: tuple[Any, ...]
        if numbers.w0 is not None:
            self.poles = (numbers.w0,)
        else:
            assert numbers.wn is not None
            assert numbers.zeta is not None
            self.poles = tuple(p.item() for p in second_order_poles(numbers.wn, numbers.zeta))
        limited = are_limited(self.motors)
        first_order = numbers.w0 is not None and not numbers.dead_time
        self.slow_pole = numbers.w0 if first_order and not limited else None
        self.updates = 10_000
        self.evaluation_pairs = 30 if limited else 300
        self.horizon_s = self._horizon() if limited or numbers.range is not None else None
        as_thesis = first_order and not limited and numbers.eye is not None
        self.pulse_rates = None if as_thesis else PulseRates.around([numbers.w0 or numbers.wn or 0.0])

    def _horizon(self) -> float:
        """Long enough for the largest saccade of a motor that takes its time [s]."""
        travel = travel_s(self.motors)
        slowest = min(complex(pole).real for pole in self.poles)
        return max(HORIZON_S, float(np.ceil(10 * (self.surrogate.dead_time + travel + _SETTLED / slowest)) / 10))

    def identity(self) -> dict[str, Any]:
        """Name and numbers of the surrogate; what it does not have is left out."""
        s = self.surrogate
        numbers = {"K": s.K, "w0": s.w0, "wn": s.wn, "zeta": s.zeta, "dead_time": s.dead_time or None}
        of_motor = {
            "motor": s.motor,
            "axis": None if s.axis == "yaw" else s.axis,
            "range": None if s.range is None else list(s.range),
            "speed_limit": s.speed_limit,
            "acceleration_limit": s.acceleration_limit,
            "rest": s.rest or None,
        }
        told = {**numbers, **of_motor}
        return {"plant": self.name, **{key: value for key, value in told.items() if value is not None}}

    def drawn(self) -> "mujoco.MjModel":
        """The eye it stands for, or a ball where it stands for none of ours."""
        from orient_eye.eyes.model import ball, build_model

        return build_model(self.surrogate.eye) if self.surrogate.eye else ball()

    def move(
        self,
        command: Any,
        start: State | None = None,
        horizon_s: float | None = None,
        random: np.random.Generator | None = None,
    ) -> Movement:
        """Perform a batch of saccades; see `orient_eye.plants.Plant`.

        Raises:
            InputError: also for a start that is turned about another axis.
        """
        if not isinstance(command, PulseStep) or command.F.shape[1] != 1 or not len(command):
            return self._sampled(self.prepare(as_command(command, self.step_s), start, horizon_s))
        closed = ClosedMovement(self, command, self.samples(command, horizon_s))
        rests = self._rests(start, command.F)
        if self.horizon_s is None and rests.all():
            return closed
        given = self.prepare(command, start, horizon_s)
        changed = given.saturated | given.limited | given.failed | ~rests
        if not changed.any():
            return closed
        if changed.all():
            return self._sampled(given)
        some = self._sampled(given[changed])
        return MixedMovement(changed, some, ClosedMovement(self, command[~changed], closed.samples), command)

    def _sampled(self, given: Given) -> "PathMovement":
        """Behind the dead time the eye answers to where its motor stood before time 0, which is that of the start."""
        s = self.surrogate
        motor, before = given.motor[..., 0] - s.rest, given.start.motor[:, 0] - s.rest
        angle, rate = sampled_response(s.K, self.poles, s.dead_time, motor, self.step_s, before)
        off = self._angle(given.start.orientation) - s.K * before
        off = np.where(np.abs(off) < _SAME_DEG, 0.0, off)
        spin = given.start.angular_velocity[:, rotations.AXES[s.axis]]
        if np.abs(off).max(initial=0) > 0 or np.abs(spin).max(initial=0) > 0:
            free = free_response(self.poles, off, spin, self.times(motor.shape[1]))
            angle, rate = angle + free[0], rate + free[1]
        return PathMovement(self, given, angle, rate)

    def run(self, motor: Array, start: State) -> Run:
        """See `orient_eye.plants.simulated.SimulatedPlant`."""
        failed = np.zeros(len(motor), bool)
        movement = self._sampled(Given(Sampled(motor, self.step_s), motor, motor, start, failed, failed, failed))
        return *self.turned(movement.angle, movement.rate), None, failed

    def turned(self, angle: Array, rate: Array) -> tuple[Array, Array]:
        """Orientations (..., 4) and angular velocities [deg/s] (..., 3) of an eye turned about its axis."""
        velocity = np.zeros((*rate.shape, 3))
        velocity[..., rotations.AXES[self.surrogate.axis]] = rate
        return rotations.about(self.surrogate.axis, angle), velocity

    def rest(self, motor: Array) -> Array:
        """See `orient_eye.plants.Plant`."""
        return rotations.about(self.surrogate.axis, self.angle_at(np.asarray(motor, float)[:, 0]))

    def hold(self, orientation: Array, driven: tuple[str, ...] = ()) -> Array:
        """See `orient_eye.plants.Plant`."""
        return self.surrogate.rest + self._angle(np.asarray(orientation, float))[:, None] / self.surrogate.K

    def angle_at(self, motor: Array) -> Array:
        """About the axis [deg] (...), of eyes that rest with the motor at (...) [deg]."""
        return self.surrogate.K * (motor - self.surrogate.rest)

    def from_rest(self, command: PulseStep) -> PulseStep:
        """The same pulse-steps of a motor whose positions count from its rest."""
        rest = self.surrogate.rest
        return replace(command, F=command.F - rest, D=command.D - rest) if rest else command

    def _rests(self, start: State | None, motor: Array) -> NDArray[np.bool_]:
        """Which eyes rest where these motor positions hold them, (saccades,); a start of another shape does not."""
        if start is None or start.motor.shape != motor.shape:
            return np.full(len(motor), start is None)
        off = [rotations.angle_between(self.rest(motor), start.orientation)[:, None], start.motor - motor]
        return np.asarray((np.abs(np.concatenate([*off, start.angular_velocity], axis=1)) < _SAME_DEG).all(axis=1))

    def _angle(self, orientation: Array) -> Array:
        """About the axis [deg], (saccades,)."""
        euler = dict(zip(("yaw", "pitch", "roll"), rotations.to_euler(orientation), strict=True))
        angle = euler.pop(self.surrogate.axis)
        if any((np.abs(other) > 1e-6).any() for other in euler.values()):
            most = ", ".join(f"{name} {other[np.abs(other).argmax()]:.3g} deg" for name, other in euler.items())
            raise InputError(
                f"plant {self.name!r} turns the eye in {self.surrogate.axis} only: start and target need the other "
                f"angles 0, got {most}"
            )
        return angle


def restore(identity: dict[str, Any], rig: Rig | str | Path | None = None) -> LinearPlant:
    """The plant of an identity; with the numbers of a shipped surrogate it stands for the same eye.

    Args:
        identity: see `LinearPlant.identity`.
        rig: whose limits take the place of the identity's.
    """
    numbers = {key: value for key, value in identity.items() if key != "plant"}
    limits = {key: numbers.get(key) for key in ("range", "speed_limit", "acceleration_limit")}
    unlimited = {key: value for key, value in identity.items() if key not in limits}
    shipped = (LinearPlant(name) for name in shipped_surrogates())
    eye = next((plant.surrogate.eye for plant in shipped if plant.identity() == unlimited), None)
    return LinearPlant(Surrogate(**numbers, eye=eye), rig=rig)


@dataclass(frozen=True)
class ClosedMovement:
    """Pulse-steps of the surrogate, measured without sampling; see `orient_eye.movement.Movement`.

    Attributes:
        plant: that moved.
        command: the pulse-steps.
        samples: of its trajectory.
    """

    plant: LinearPlant
    command: PulseStep
    samples: int

    @cached_property
    def response(self) -> LinearResponse:
        """In closed form."""
        s = self.plant.surrogate
        return LinearResponse(s.K, self.plant.poles, s.dead_time, self.plant.from_rest(self.command))

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Nothing bounds this command."""
        return np.zeros(len(self.command), bool)

    @property
    def limited(self) -> NDArray[np.bool_]:
        """Nothing limits it."""
        return np.zeros(len(self.command), bool)

    def energy(self) -> Array:
        """The command's: the motor follows it."""
        return self.command.energy()

    def excess_force(self) -> None:
        """None: of a surrogate no elastics are known."""

    def measure(self, band: float = BAND, of: View = "orientation") -> Measures:
        """See `orient_eye.movement.Movement`; of an eye that turns about one axis."""
        if of == "gaze" and self.plant.surrogate.axis == "roll":  # which does not move it
            return measure(self.trajectory(), self.plant.rest(self.command.D), band=band, of=of)
        return measure_closed_form(self.response, band, self.plant.surrogate.axis)

    def trajectory(self) -> Trajectory:
        """The closed form at the plant's samples."""
        return self._trajectory

    @cached_property
    def _trajectory(self) -> Trajectory:
        t = self.plant.times(self.samples)
        orientation, velocity = self.plant.turned(self.response.angle(t[None]), self.response.rate(t[None]))
        motor = self.command.position(t)
        failed = np.asarray(~(np.isfinite(orientation).all(axis=(1, 2)) & np.isfinite(motor).all(axis=(1, 2))))
        told = motor.copy()
        for array in (orientation, velocity, motor):
            array[failed] = np.nan
        return Trajectory(t, orientation, velocity, told, motor, None, failed, self.plant.motors)


@dataclass(frozen=True)
class PathMovement(GivenMovement):
    """The surrogate along a path of its motor, exact at samples; see `orient_eye.movement.Movement`.

    Attributes:
        plant: that moved.
        given: command and path.
        angle: about the axis [deg], (saccades, time).
        rate: [deg/s], (saccades, time).
    """

    plant: LinearPlant
    given: Given
    angle: Array
    rate: Array

    def measure(self, band: float = BAND, of: View = "orientation") -> Measures:
        """See `orient_eye.movement.Movement`; of an eye that turns about one axis."""
        low, high = self.plant.motors[0].range
        if of == "gaze" and self.plant.surrogate.axis == "roll":
            rest = self.plant.rest(np.clip(self.given.command.final, low, high))
            return measure(self.trajectory(), rest, band=band, of=of)
        final = self.plant.angle_at(np.clip(self.given.command.final[:, 0], low, high))
        failed = self.given.failed | ~np.isfinite(final)
        time = self.plant.times(self.angle.shape[1])
        return measure_angle(time, self.angle, self.rate, final, self.plant.surrogate.axis, failed, band=band)

    def trajectory(self) -> Trajectory:
        """The movement at the plant's samples."""
        given, time = self.given, self.plant.times(self.angle.shape[1])
        orientation, velocity = self.plant.turned(self.angle, self.rate)
        motor = given.motor.copy()
        for array in (orientation, velocity, motor):
            array[given.failed] = np.nan
        return Trajectory(time, orientation, velocity, given.told, motor, None, given.failed, self.plant.motors)


@dataclass(frozen=True)
class MixedMovement:
    """Saccades of which some are limited and the others in closed form, each measured as it would be alone.

    Attributes:
        which: are limited, (saccades,).
        some: those.
        others: the others.
        command: of all.
    """

    which: NDArray[np.bool_]
    some: PathMovement
    others: ClosedMovement
    command: PulseStep

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """See `orient_eye.movement.Movement`."""
        return merged_rows(self.which, self.some.saturated, self.others.saturated)

    @property
    def limited(self) -> NDArray[np.bool_]:
        """See `orient_eye.movement.Movement`."""
        return merged_rows(self.which, self.some.limited, self.others.limited)

    def energy(self) -> Array:
        """See `orient_eye.movement.Movement`."""
        return merged_rows(self.which, self.some.energy(), self.others.energy())

    def excess_force(self) -> None:
        """None: of a surrogate no elastics are known."""

    def measure(self, band: float = BAND, of: View = "orientation") -> Measures:
        """See `orient_eye.movement.Movement`."""
        return merged(self.which, self.some.measure(band, of), self.others.measure(band, of))

    def trajectory(self) -> Trajectory:
        """See `orient_eye.movement.Movement`."""
        both = concatenate([self.some.trajectory(), self.others.trajectory()])
        order = np.concatenate([np.flatnonzero(self.which), np.flatnonzero(~self.which)])
        return both[np.argsort(order)]
