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

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye.commands.exponentials import ExponentialSum, Term, filter_energy
from orient_eye.errors import InputError

Array = NDArray[np.float64]
SPEED_LIMIT = 7200.0
"""V of the thesis [deg/s] (after 4.18)."""
_SLOWEST_ONSET = 1e-2  # of B: below it variants 2 and 3 differ from their limit C -> 0 by less than 1 %


def _variant1(B: Array, k0: Array, C: Array) -> ExponentialSum:
    """A t exp(-B t), 4.3; A = (D - F) B^2 / k0 (4.9)."""
    return ExponentialSum((Term(B**2 / k0, 1, B),))


def _variant2(B: Array, k0: Array, C: Array) -> ExponentialSum:
    """A exp(-B t) (1 - exp(-C t)), 4.11; A = (D - F) B (B + C) / (C k0) (4.15)."""
    A = B * (B + C) / (C * k0)
    return ExponentialSum((Term(A, 0, B), Term(-A, 0, B + C)))


def _variant3(B: Array, k0: Array, C: Array) -> ExponentialSum:
    """A exp(-B t) (1 - exp(-C t) - C t exp(-C t)), 4.19; A = (D - F) B (B + C)^2 / (C^2 k0).

    The thesis prints that amplitude with B (B + C^2) in 4.24, which is a misprint.
    """
    A = B * (B + C) ** 2 / (C**2 * k0)
    return ExponentialSum((Term(A, 0, B), Term(-A, 0, B + C), Term(-A * C, 1, B + C)))


PULSES: dict[int, Callable[[Array, Array, Array], ExponentialSum]] = {1: _variant1, 2: _variant2, 3: _variant3}
"""Variant to the pulse that takes a motor 1 deg (D - F = 1), from B, k0 and C."""
POLES: dict[int, Callable[[Array, Array], tuple[Array, ...]]] = {
    1: lambda B, C: (B, B),
    2: lambda B, C: (B, B + C),
    3: lambda B, C: (B, B + C, B + C),
}
"""Variant to the poles of its pulse, from B and C (4.4, 4.12, 4.21): p(s) = (D - F) / k0 times the product
of p / (s + p)."""
FIXED_C = {2: 85.0, 3: 3.6}
"""The thesis' values of C [1/s] (5.2.1, 5.3.1)."""


def varying_C(variant: int, step: Array, B: Array, k0: Array, speed_limit: float = SPEED_LIMIT) -> Array:
    """C [1/s] that brings the motor's speed to the limit V, (saccades, motors).

    Variant 2: A C = V (4.18), so C = V k0 / (|D - F| B) - B. Variant 3: the smaller root of
    A C / e + A k0 C^2 / (B + C)^2 = V, a bound on the speed (4.31).

    A command can be so large that no C keeps the limit. Then C is what comes nearest: in variant 2,
    where the initial speed falls with C, the slowest onset (C = 0.01 B, short of the limit C -> 0, in
    which the pulse becomes that of variant 1); in variant 3 the C = B at which the bound is least;
    `keeps_speed_limit` tells such commands.
    Both are continuous with the feasible values. Variant 3 too keeps C >= 0.01 B, for saccades so small
    that the limit asks for less. A saccade of size 0 has C at its bound.

    Args:
        variant: 2 or 3.
        step: D - F [deg].
        B: [1/s].
        k0: [1/s].
        speed_limit: V [deg/s].
    """
    size = np.maximum(np.abs(step), 1e-9)
    feasible = keeps_speed_limit(variant, step, B, k0, speed_limit)
    if variant == 2:
        C = speed_limit * k0 / (size * B) - B
        return np.where(feasible, np.minimum(C, 1e5), _SLOWEST_ONSET * B)
    # a (B + C)^2 = W C, with a = |D - F| B / (k0 e) and W = V - |D - F| B
    a, W = size * B / (k0 * np.e), speed_limit - size * B
    root = np.sqrt(np.where(feasible, W**2 - 4 * a * B * W, 0.0))
    C = np.where(feasible, 2 * a * B**2 / np.where(feasible, W - 2 * a * B + root, 1.0), B)
    return np.maximum(C, _SLOWEST_ONSET * B)


def keeps_speed_limit(
    variant: int, step: Array, B: Array, k0: Array, speed_limit: float = SPEED_LIMIT
) -> NDArray[np.bool_]:
    """Whether some C holds a command to the speed limit, by the bounds that `varying_C` solves; its arguments."""
    size = np.maximum(np.abs(step), 1e-9)
    if variant == 2:
        return speed_limit * k0 / (size * B) - B >= _SLOWEST_ONSET * B
    return 4 * size * B**2 / (k0 * np.e) < speed_limit - size * B


@dataclass(frozen=True)
class PulseStep:
    """A batch of pulse-step commands.

    Attributes:
        F: initial motor positions [deg], (saccades, motors).
        B: decay of the pulse [1/s], > 0, (saccades, motors).
        D: final motor positions [deg], (saccades, motors).
        k0: gain of the integrator [1/s], > 0, (saccades, motors).
        variant: of the pulse, one of `PULSES`.
        C: rate of the onset [1/s], (saccades, motors) or a number; variants 2 and 3.

    Raises:
        InputError: unknown variant, missing C, or B, k0, C not positive.
    """

    F: Array
    B: Array
    D: Array
    k0: Array
    variant: int = 1
    C: ArrayLike | None = None

    def __post_init__(self) -> None:
        if self.variant not in PULSES:
            raise InputError(f"unknown pulse variant {self.variant!r}; choose one of {list(PULSES)}")
        if self.variant in FIXED_C and self.C is None:
            raise InputError(f"variant {self.variant} needs C; the thesis uses {FIXED_C[self.variant]}, or varying_C()")
        arrays = np.broadcast_arrays(
            *(np.asarray(a, float) for a in (self.F, self.B, self.D, self.k0, 0.0 if self.C is None else self.C))
        )
        for name, array in zip(("F", "B", "D", "k0", "C"), arrays, strict=True):
            object.__setattr__(self, name, array)
            if array.ndim != 2:
                raise InputError(f"{name} has the shape (saccades, motors), got {array.shape}")
            positive = name in ("B", "k0") or (name == "C" and self.variant in FIXED_C)
            if positive and (array <= 0).any():
                raise InputError(f"{name} must be positive, got {array.min():g}")

    @cached_property
    def shape(self) -> ExponentialSum:
        """The pulse that takes the motor 1 deg: p(t) / (D - F), batch shape (saccades, motors)."""
        return PULSES[self.variant](self.B, self.k0, np.asarray(self.C))

    @property
    def step(self) -> Array:
        """D - F [deg], (saccades, motors)."""
        return self.D - self.F

    def pulse(self, t: ArrayLike) -> Array:
        """p(t) [deg], (saccades, time, motors), at times t [s] (time,)."""
        return self._by_time(self.step[..., None] * self.shape(_times(t)))

    def position(self, t: ArrayLike) -> Array:
        """Motor positions tau(t) = F + p + k0 times the integral of p [deg], (saccades, time, motors)."""
        times = _times(t)
        moved = self.shape(times) + self.k0[..., None] * self.shape.integral(times)
        return self._by_time(self.F[..., None] + self.step[..., None] * moved)

    def rate(self, t: ArrayLike) -> Array:
        """Motor speeds d tau/dt = p' + k0 p [deg/s], (saccades, time, motors)."""
        return self._by_time(self.step[..., None] * self._rate_shape(_times(t)))

    def energy(self) -> Array:
        """Integral of the squared motor speeds over all time and motors [deg^2/s], (saccades,); 4.35."""
        poles = POLES[self.variant](self.B, np.asarray(self.C))
        height = self.step * np.prod(np.stack(poles), axis=0) / self.k0
        return (height**2 * filter_energy(poles, self.k0)).sum(axis=-1)

    def sample(self, step_s: float, samples: int) -> Array:
        """Motor positions [deg] (saccades, samples, motors) at 0, step_s, 2 step_s, ... [s]."""
        return self.position(step_s * np.arange(samples))

    @cached_property
    def _rate_shape(self) -> ExponentialSum:
        return self.shape.derivative() + self.shape.scaled(self.k0)

    @staticmethod
    def _by_time(values: Array) -> Array:
        return np.moveaxis(values, -1, -2)


def _times(t: ArrayLike) -> Array:
    return np.asarray(t, dtype=float)[None, None, :]
