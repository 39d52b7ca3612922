"""The pulse-step motor command, thesis section 4.3.

    command = PulseStep(F=F, B=B, D=D, k0=k0)        # arrays (saccades, motors)
    tau = command.position(t)                        # (saccades, time, motors) [deg]

A pulse p(t) passes beside an integrator of gain k0, tau(s) = p(s) (1 + k0/s) (4.1), and takes a
motor from F to D. Every pulse is a sum of terms c t^n exp(-p t), so tau, its rate, the low-pass
response and the energy need no formula of their own: they are those of `exponentials`.

Symbols of the thesis: F initial and D final motor position [deg], B decay of the pulse [1/s], k0 gain
of the integrator [1/s], C rate of the pulse's onset [1/s], A its height, V the motor's speed limit
[deg/s].
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye.cached import cached_property
from orient_eye.commands.exponentials import ExponentialSum, filter_energy
from orient_eye.commands.pulses import PULSES, Pulse
from orient_eye.errors import InputError
from orient_eye.state import LARGEST, as_numbers, sane

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PulseStep:
    """A batch of pulse-step commands.

    A number that is not finite, or beyond 1e9, or a rate below 1e-9, is taken for NaN: its saccade fails.

    Attributes:
        F: initial motor positions [deg], (saccades, motors).
        B: decay of the pulse [1/s], > 0, (saccades, motors).
        D: final motor positions [deg], (saccades, motors).
        k0: gain of the integrator [1/s], > 0, (saccades, motors).
        pulse: a name of `orient_eye.commands.pulses.PULSES`.
        C: rate of the onset [1/s], (saccades, motors) or a number; for pulses that have one.
        too_fast: whether C was to hold the command to a speed limit and cannot, (saccades,); none unless given.

    Raises:
        InputError: unknown pulse, missing C, B, k0 or C not positive, or what are no real numbers of one shape.
    """

    F: Array
    B: Array
    D: Array
    k0: Array
    pulse: str = "1"
    C: ArrayLike | None = None
    too_fast: NDArray[np.bool_] = None  # type: ignore[assignment]  # never None once made
    saturates = True  # at the motors' mechanical range, as a motor would
    duration_s = None

    def __post_init__(self) -> None:
        onset = self.kind.onset
        if onset and self.C is None:
            raise InputError(f"pulse {self.pulse!r} needs C; the thesis uses {onset.fixed}, or varying_C()")
        told = {"F": self.F, "B": self.B, "D": self.D, "k0": self.k0, "C": 0.0 if self.C is None else self.C}
        values = [as_numbers(name, value) for name, value in told.items()]
        try:
            arrays = np.broadcast_arrays(*values)
        except ValueError as error:
            shapes = ", ".join(str(value.shape) for value in values)
            raise InputError(f"{', '.join(told)} have the shape (saccades, motors), got {shapes}") from error
        for name, array in zip(told, arrays, strict=True):
            if array.ndim != 2:
                raise InputError(f"{name} has the shape (saccades, motors), got {array.shape}")
            positive = name in ("B", "k0") or (name == "C" and onset is not None)
            if positive and (array <= 0).any():
                raise InputError(f"{name} must be positive, got {array.min():g}")
            object.__setattr__(self, name, sane(array, 1 / LARGEST if positive else 0.0))
        known = np.isfinite([getattr(self, name) for name in told]).all(axis=0)
        object.__setattr__(self, "F", np.where(known, self.F, np.nan))  # nor is a motor that stands told so
        given: Any = self.too_fast
        object.__setattr__(self, "too_fast", np.zeros(len(self.F), bool) if given is None else given)

    def __len__(self) -> int:
        return len(self.F)

    def __getitem__(self, which: NDArray[Any]) -> "PulseStep":
        """Some of the saccades."""
        parts: dict[str, Any] = {name: getattr(self, name)[which] for name in ("F", "B", "D", "k0", "C", "too_fast")}
        return PulseStep(pulse=self.pulse, **parts)

    @property
    def kind(self) -> Pulse:
        """The pulse that the name stands for."""
        return PULSES[self.pulse]

    @property
    def final(self) -> Array:
        """D, where the motors come to stand [deg], (saccades, motors)."""
        return self.D

    @cached_property
    def shape(self) -> ExponentialSum:
        """The pulse that takes the motor 1 deg: p(t) / (D - F), batch shape (saccades, motors)."""
        return self.kind.shape(self.B, self.k0, np.asarray(self.C))

    @property
    def step(self) -> Array:
        """D - F [deg], (saccades, motors)."""
        return self.D - self.F

    def pulse_at(self, t: ArrayLike) -> Array:
        """p(t) [deg], (saccades, time, motors), at times t [s] (time,)."""
        return self._by_time(self.step[..., None] * self.shape(_times(t)))

    def position(self, t: ArrayLike) -> Array:
        """Motor positions tau(t) = F + p + k0 times the integral of p [deg], (saccades, time, motors)."""
        times = _times(t)
        at = np.repeat(self.F[..., None], times.size, axis=-1)
        told = self.step.any(axis=0)  # of an eye with several motors often one
        if told.any():
            B, k0, C, step = (np.asarray(x)[:, told] for x in (self.B, self.k0, self.C, self.step))
            pulse, integral = self.kind.shape(B, k0, C).with_integral(times)
            at[:, told] += step[..., None] * (pulse + k0[..., None] * integral)
        return self._by_time(at)

    def rate(self, t: ArrayLike) -> Array:
        """Motor speeds d tau/dt = p' + k0 p [deg/s], (saccades, time, motors)."""
        return self._by_time(self.step[..., None] * self.rate_shape(_times(t)))

    def energy(self) -> Array:
        """Integral of the squared motor speeds over all time and motors [deg^2/s], (saccades,); 4.35."""
        poles = self.kind.poles(self.B, np.asarray(self.C))
        height = self.step * np.prod(np.stack(poles), axis=0) / self.k0
        return (height**2 * filter_energy(poles, self.k0)).sum(axis=-1)

    def sample(self, step_s: float, samples: int) -> Array:
        """Motor positions [deg] (saccades, samples, motors) at 0, step_s, 2 step_s, ... [s]."""
        return self.position(step_s * np.arange(samples))

    @cached_property
    def rate_shape(self) -> ExponentialSum:
        """The motor's speed where it goes 1 deg: rate(t) / (D - F), batch shape (saccades, motors)."""
        return self.shape.derivative() + self.shape.scaled(self.k0)

    @staticmethod
    def _by_time(values: Array) -> Array:
        return np.moveaxis(values, -1, -2)


def _times(t: ArrayLike) -> Array:
    return np.asarray(t, dtype=float)[None, None, :]
