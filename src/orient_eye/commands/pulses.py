"""The pulses of the pulse-step generator (thesis 4.3): one entry in `PULSES` each.

A pulse is a sum of terms c t^n exp(-p t), given for a motor that is to move by 1 deg (D - F = 1). Command,
rate, energy, responses and their derivatives follow from the terms (`exponentials`). A pulse with an onset
rate C may say what C holds the motor to a speed limit.

Symbols of the thesis: B decay of the pulse [1/s], k0 gain of the integrator [1/s], C rate of the pulse's onset
[1/s], A its height, V the motor's speed limit [deg/s].
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands.exponentials import ExponentialSum, Term
from orient_eye.constants import SPEED_LIMIT
from orient_eye.registry import Registry

Array = NDArray[np.float64]
_SLOWEST_ONSET = 1e-2  # of B: below it variants 2 and 3 differ from their limit C -> 0 by less than 1 %


@dataclass(frozen=True)
class Onset:
    """How a pulse with an onset rate C chooses it.

    Attributes:
        fixed: the thesis' value [1/s] (5.2.1, 5.3.1).
        keeps: whether some C holds commands to the speed limit; from |D - F|, B, k0 and V.
        varying: C [1/s] that brings the motor to the speed limit, where one does; from the same.
        nearest: C [1/s] that comes nearest where none does; from the same.
    """

    fixed: float
    keeps: Callable[[Array, Array, Array, float], NDArray[np.bool_]]
    varying: Callable[[Array, Array, Array, float], Array]
    nearest: Callable[[Array, Array, Array, float], Array]


@dataclass(frozen=True)
class Pulse:
    """A kind of pulse.

    Attributes:
        summary: for people.
        shape: the pulse that takes a motor 1 deg, from B, k0 and C, each (saccades, motors).
        poles: of the pulse, from B and C (4.4, 4.12, 4.21): p(s) = (D - F) / k0 times the product of p / (s + p).
        onset: where it has a C; None where it has none.
    """

    summary: str
    shape: Callable[[Array, Array, Array], ExponentialSum]
    poles: Callable[[Array, Array], tuple[Array, ...]]
    onset: Onset | None = None


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


def _root2(size: Array, B: Array, k0: Array, V: float) -> Array:
    """A C = V (4.18), so C = V k0 / (|D - F| B) - B; at most 1e5, for saccades of no size."""
    return np.asarray(np.minimum(V * k0 / (size * B) - B, 1e5))


def _keeps2(size: Array, B: Array, k0: Array, V: float) -> NDArray[np.bool_]:
    return np.asarray(V * k0 / (size * B) - B >= _SLOWEST_ONSET * B)


def _terms3(size: Array, B: Array, k0: Array, V: float) -> tuple[Array, Array]:
    """a and W of a (B + C)^2 = W C, the bound A C / e + A k0 C^2 / (B + C)^2 = V on the speed (4.31)."""
    return size * B / (k0 * np.e), V - size * B


def _root3(size: Array, B: Array, k0: Array, V: float) -> Array:
    """The smaller root of the bound; at least 0.01 B, for saccades so small that the limit asks for less."""
    a, W = _terms3(size, B, k0, V)
    root = np.sqrt(np.maximum(W**2 - 4 * a * B * W, 0.0))
    return np.asarray(np.maximum(2 * a * B**2 / (W - 2 * a * B + root), _SLOWEST_ONSET * B))


def _keeps3(size: Array, B: Array, k0: Array, V: float) -> NDArray[np.bool_]:
    a, W = _terms3(size, B, k0, V)
    return np.asarray(4 * a * B < W)


PULSES: Registry[Pulse] = Registry(
    "pulse",
    {
        "1": Pulse("A t exp(-B t): variant 1 of the thesis (4.3.1)", _variant1, lambda B, C: (B, B)),
        "2": Pulse(
            "A exp(-B t) (1 - exp(-C t)): variant 2 of the thesis (4.3.2)",
            _variant2,
            lambda B, C: (B, B + C),
            # The initial speed falls with C: the slowest onset, short of the limit C -> 0, which is variant 1.
            Onset(85.0, _keeps2, _root2, lambda size, B, k0, V: _SLOWEST_ONSET * B),
        ),
        "3": Pulse(
            "A exp(-B t) (1 - exp(-C t) - C t exp(-C t)): variant 3 of the thesis (4.3.3)",
            _variant3,
            lambda B, C: (B, B + C, B + C),
            # The bound on the speed is least at C = B.
            Onset(3.6, _keeps3, _root3, lambda size, B, k0, V: B),
        ),
    },
    Pulse,
)
"""Name to pulse."""


def keeps_speed_limit(
    pulse: Pulse, step: Array, B: Array, k0: Array, speed_limit: float = SPEED_LIMIT
) -> NDArray[np.bool_]:
    """Whether some C holds commands to the speed limit, (saccades, motors); arguments as `varying_C`'s.

    A pulse without an onset has no C that could.
    """
    if pulse.onset is None:
        return np.zeros(np.shape(step), bool)
    return pulse.onset.keeps(np.maximum(np.abs(step), 1e-9), B, k0, speed_limit)


def varying_C(pulse: Pulse, step: Array, B: Array, k0: Array, speed_limit: float = SPEED_LIMIT) -> Array:
    """C [1/s] that brings the motor's speed to the limit V, (saccades, motors).

    A command can be so large that no C keeps the limit. Then C is what comes nearest, which is continuous with
    the values that keep it; `keeps_speed_limit` tells such commands. A saccade of size 0 has C at its bound.

    Args:
        pulse: one with an onset.
        step: D - F [deg].
        B: [1/s].
        k0: [1/s].
        speed_limit: V [deg/s].
    """
    assert pulse.onset is not None
    size = np.maximum(np.abs(step), 1e-9)
    feasible = pulse.onset.keeps(size, B, k0, speed_limit)
    with np.errstate(divide="ignore", invalid="ignore"):
        C = pulse.onset.varying(size, B, k0, speed_limit)
    return np.where(feasible, C, pulse.onset.nearest(size, B, k0, speed_limit))
