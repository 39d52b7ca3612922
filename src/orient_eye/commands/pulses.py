"""The pulses of the pulse-step generator (thesis 4.3): one entry in `PULSES` each.

A pulse is a sum of terms c t^n exp(-p t), given for a motor that is to move by 1 deg (D - F = 1). Command,
rate, energy, responses and their derivatives follow from the terms (`exponentials`). A pulse with an onset
rate C may say what C holds the motor to a speed limit.

Symbols of the thesis: B decay of the pulse [1/s], k0 gain of the integrator [1/s], C rate of the pulse's onset
[1/s], A its height, V the motor's speed limit [deg/s].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from orient_eye.constants import SPEED_LIMIT
from orient_eye.registry import Registry

if TYPE_CHECKING:  # the names are listed without NumPy
    import numpy as np
    from numpy.typing import NDArray

    from orient_eye.commands.exponentials import ExponentialSum

    Array = NDArray[np.float64]


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


PULSES: Registry[Pulse] = Registry(
    "pulse",
    {name: f"orient_eye.commands.thesis_pulses:VARIANT_{name}" for name in "123"}
    | {"smooth": "orient_eye.commands.smooth_pulse:SMOOTH"},
    Pulse,
)
"""Name to pulse."""


def keeps_speed_limit(
    pulse: Pulse, step: Array, B: Array, k0: Array, speed_limit: float = SPEED_LIMIT
) -> NDArray[np.bool_]:
    """Whether some C holds commands to the speed limit, (saccades, motors); arguments as `varying_C`'s.

    A pulse without an onset has no C that could.
    """
    import numpy as np

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
    import numpy as np

    assert pulse.onset is not None
    size = np.maximum(np.abs(step), 1e-9)
    feasible = pulse.onset.keeps(size, B, k0, speed_limit)
    with np.errstate(divide="ignore", invalid="ignore"):
        C = pulse.onset.varying(size, B, k0, speed_limit)
    return np.where(feasible, C, pulse.onset.nearest(size, B, k0, speed_limit))
