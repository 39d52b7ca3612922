"""The main sequence of saccades: how peak velocity and duration grow with amplitude.

    found = fit_main_sequence(amplitude_deg, peak_velocity_deg_s, duration_s)
    found.V0, found.c, found.D0_ms, found.d_ms, found.k

Peak velocity V = V0 (1 - exp(-A/c)) and duration D = D0 + d A (Bahill, Clark and Stark 1975), and their product
V D = k A, where k tells the shape of the velocity profile.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar

from orient_eye.errors import InputError

Array = NDArray[np.float64]
_LEAST = 3
"""Saccades of a fit: more than its numbers."""


@dataclass(frozen=True)
class MainSequence:
    """Fitted relations.

    Attributes:
        V0: peak velocity of the largest saccades [deg/s].
        c: amplitude at which V is 63 % of V0 [deg].
        D0_ms: duration of the smallest saccades [ms].
        d_ms: slope of the duration [ms/deg].
        k: V D / A.
        V_r2, D_r2: share of the variance that the fits explain; 1 at best.
        k_spread: standard deviation of V D / A.
    """

    V0: float
    c: float
    D0_ms: float
    d_ms: float
    k: float
    V_r2: float
    D_r2: float
    k_spread: float

    def peak_velocity(self, amplitude_deg: ArrayLike) -> Array:
        """V(A) [deg/s]."""
        return np.asarray(exponential(np.asarray(amplitude_deg, float), self.V0, self.c))

    def duration_ms(self, amplitude_deg: ArrayLike) -> Array:
        """D(A) [ms]."""
        return self.D0_ms + self.d_ms * np.asarray(amplitude_deg, float)


def exponential(amplitude_deg: Array, V0: float, c: float) -> Array:
    """V0 (1 - exp(-A/c))."""
    return np.asarray(-V0 * np.expm1(-amplitude_deg / c))


def fit_peak_velocity(amplitude_deg: ArrayLike, peak_velocity_deg_s: ArrayLike) -> tuple[float, float]:
    """V0 [deg/s] and c [deg] of V = V0 (1 - exp(-A/c)), by least squares.

    c is looked for up to 1000 times the largest amplitude, where the curve is a line; V0 follows from it.

    Raises:
        InputError: fewer than three finite values, or none above 0.
    """
    A, V = _finite(amplitude_deg, peak_velocity_deg_s)
    if V.max() <= 0:
        raise InputError(f"peak velocities are above 0, got {V.max():g} deg/s at most; give those of saccades")

    def fit(log_c: float) -> tuple[float, float]:
        shape = -np.expm1(-A / np.exp(log_c))
        V0 = float(shape @ V / (shape @ shape))
        return V0, float(((V - V0 * shape) ** 2).sum())

    bounds = np.log([A.min() / 100, 1000 * A.max()])
    log_c = minimize_scalar(lambda x: fit(x)[1], bounds=bounds, method="bounded", options={"xatol": 1e-9}).x
    return fit(log_c)[0], float(np.exp(log_c))


def fit_main_sequence(amplitude_deg: ArrayLike, peak_velocity_deg_s: ArrayLike, duration_s: ArrayLike) -> MainSequence:
    """Fit all relations by least squares; saccades with a NaN are left out.

    Args:
        amplitude_deg: (saccades,).
        peak_velocity_deg_s: (saccades,).
        duration_s: (saccades,).

    Raises:
        InputError: fewer than three saccades are left, or columns of unequal length.
    """
    A, V, D = _finite(amplitude_deg, peak_velocity_deg_s, duration_s)
    V0, c = fit_peak_velocity(A, V)
    slope, intercept = np.polyfit(A, 1e3 * D, 1)
    product = V * D / A
    return MainSequence(
        V0=V0,
        c=c,
        D0_ms=float(intercept),
        d_ms=float(slope),
        k=float((A * V * D).sum() / (A * A).sum()),
        V_r2=_explained(V, exponential(A, V0, c)),
        D_r2=_explained(1e3 * D, intercept + slope * A),
        k_spread=float(product.std()),
    )


def _finite(*columns: ArrayLike) -> list[Array]:
    """Columns of the saccades that have all their numbers, with an amplitude above 0."""
    each = [np.asarray(column, float).ravel() for column in columns]
    if len({len(column) for column in each}) > 1:
        raise InputError(f"one number a saccade in each, got {', '.join(str(len(column)) for column in each)}")
    table = np.stack(each)
    table = table[:, np.isfinite(table).all(axis=0) & (table[0] > 0)]
    if table.shape[1] < _LEAST:
        raise InputError(
            f"a main sequence needs at least {_LEAST} saccades of some amplitude, with their numbers; got "
            f"{table.shape[1]}: give more"
        )
    return list(table)


def _explained(values: Array, fitted: Array) -> float:
    around = float(((values - values.mean()) ** 2).sum())
    return 1 - float(((values - fitted) ** 2).sum()) / around if around else 1.0
