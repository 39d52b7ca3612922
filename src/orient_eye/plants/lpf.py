"""The low-pass surrogate of the eye, in closed form (thesis 3.11).

theta' = w0 (K tau - theta) for the yaw theta and the position tau of one motor. `simulate` takes any
sampled command, taken as straight lines between samples, and is exact; `respond` gives the response to
a pulse-step as a function of time, with no sampling at all.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from orient_eye import rotations
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.movement.trajectory import EyeState, Trajectory
from orient_eye.plants import check_command, check_start
from orient_eye.surrogate import Surrogate

Array = NDArray[np.float64]


class LowPassPlant:
    """The surrogate as a plant; see `orient_eye.plants.Plant`.

    Args:
        surrogate: its numbers, a file of them, or the name of a shipped one.
        step_s: interval between samples [s].
    """

    name = "lpf"

    def __init__(self, surrogate: Surrogate | str | Path = "thesis", *, step_s: float = 0.001) -> None:
        self.surrogate = surrogate if isinstance(surrogate, Surrogate) else Surrogate.load(surrogate)
        self.step_s = step_s
        self.motors: tuple[str, ...] = (self.surrogate.motor,)
        self.motor_range_deg = np.array([[-np.inf, np.inf]])
        self.action_range_deg = np.array([[-80.0, 80.0]])  # thesis 4.3.1

    def identity(self) -> dict[str, Any]:
        """Name and numbers of the surrogate."""
        return {"plant": self.name, "K": self.surrogate.K, "w0": self.surrogate.w0, "motor": self.surrogate.motor}

    def simulate(self, command: Array, start: EyeState | None = None) -> Trajectory:
        """Run a batch of saccades; see `orient_eye.plants.Plant.simulate`.

        Raises:
            InputError: also for a start that is not a horizontal orientation.
        """
        command = check_command(self, command)
        K, w0 = self.surrogate.K, self.surrogate.w0
        tau = command[..., 0]
        theta0 = K * tau[:, 0] if start is None else self._yaw(check_start(start, len(command))[0])
        # Exact for straight lines between samples: theta goes on as r theta + K (a tau_k + b tau_k+1).
        x = w0 * self.step_s
        r, mean = np.exp(-x), -np.expm1(-x) / x
        theta = np.empty_like(tau)
        theta[:, 0] = theta0
        drive = K * ((mean - r) * tau[:, :-1] + (1 - mean) * tau[:, 1:])
        theta[:, 1:] = lfilter([1.0], [1.0, -r], drive, axis=1, zi=(r * theta0)[:, None])[0]
        return self._trajectory(self._times(tau.shape[1]), theta, w0 * (K * tau - theta), command)

    def respond(self, command: PulseStep) -> "LowPassResponse":
        """Response to pulse-steps, from rest at their F, in closed form."""
        return LowPassResponse(self.surrogate, command)

    def trajectory(self, command: PulseStep, samples: int) -> Trajectory:
        """The closed-form response to pulse-steps, sampled."""
        t, response = self._times(samples), self.respond(command)
        return self._trajectory(t, response.yaw(t[None]), response.rate(t[None]), command.position(t))

    def _times(self, samples: int) -> Array:
        return np.arange(samples) * np.float64(self.step_s)

    def _trajectory(self, t: Array, yaw: Array, rate: Array, motor: Array) -> Trajectory:
        motor = motor.copy()
        failed = np.asarray(~(np.isfinite(yaw).all(axis=1) & np.isfinite(motor).all(axis=(1, 2))))
        velocity = np.stack([np.zeros_like(rate), np.zeros_like(rate), rate], axis=-1)
        orientation = rotations.from_yaw(yaw)
        for array in (orientation, velocity, motor):
            array[failed] = np.nan
        return Trajectory(t, orientation, velocity, motor, None, failed, self.motors)

    def rest_orientation(self, motor: Array) -> Array:
        """Orientations in which the eye rests; see `orient_eye.plants.Plant`."""
        return rotations.from_yaw(self.surrogate.K * np.asarray(motor, float)[:, 0])

    def rest_motor(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """Motor positions that hold these orientations; see `orient_eye.plants.Plant`."""
        return self._yaw(np.asarray(orientation, float))[:, None] / self.surrogate.K

    @staticmethod
    def _yaw(orientation: Array) -> Array:
        yaw, pitch, roll = rotations.to_euler(orientation)
        if (np.maximum(np.abs(pitch), np.abs(roll)) > 1e-6).any():
            raise InputError(
                "the low-pass plant moves horizontally only: start and target need pitch and roll 0, got pitch "
                f"{pitch[np.abs(pitch).argmax()]:.3g} and roll {roll[np.abs(roll).argmax()]:.3g} deg"
            )
        return yaw


@dataclass(frozen=True)
class LowPassResponse:
    """Yaw over time of the surrogate under pulse-steps, from rest.

    With P the integral of the pulse p and y its low-pass response, theta = K F + K (k0 P + (1 - k0/w0) y):
    the response to P is the integral of y, which is P - y/w0. At k0 = w0 pole and zero cancel (4.2) and
    y drops out.
    """

    surrogate: Surrogate
    command: PulseStep

    @property
    def start(self) -> Array:
        """Initial yaw K F [deg], (saccades,)."""
        return self.surrogate.K * self.command.F[:, 0]

    @property
    def final(self) -> Array:
        """Final yaw K D [deg], (saccades,)."""
        return self.surrogate.K * self.command.D[:, 0]

    def yaw(self, t: Array) -> Array:
        """Yaw [deg] at times t [s], (saccades or 1, time)."""
        return self.start[:, None] + (self.final - self.start)[:, None] * self.motion(t)[0]

    def rate(self, t: Array) -> Array:
        """Yaw velocity [deg/s] at times t [s], (saccades or 1, time)."""
        return (self.final - self.start)[:, None] * self.motion(t)[1]

    def motion(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Share x of the way from start to final, and its first three derivatives by time.

        Defined also for a saccade of size 0. From y' = w0 (p - y) follow x' = w0 p - (w0 - k0) y and on.

        Args:
            t: times [s], (saccades or 1, time).

        Returns:
            x, and its derivatives in 1/s, 1/s^2 and 1/s^3, each (saccades, time).
        """
        t, shape, w0 = t[:, None], self.command.shape, self.surrogate.w0
        k0 = self.command.k0[..., None]
        P, p, y = shape.integral(t), shape(t), shape.low_pass(w0, t)
        slope = shape.derivative()
        p1, p2 = slope(t), slope.derivative()(t)
        y1 = w0 * (p - y)
        x = k0 * P + (1 - k0 / w0) * y
        x1 = w0 * p - (w0 - k0) * y
        x2 = w0 * p1 - (w0 - k0) * y1
        x3 = w0 * p2 - (w0 - k0) * w0 * (p1 - y1)
        return x[:, 0], x1[:, 0], x2[:, 0], x3[:, 0]
