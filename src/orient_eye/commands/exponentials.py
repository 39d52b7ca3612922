"""Sums of terms c t^n exp(-p t): the algebra in which every pulse and its consequences are closed.

A pulse of the pulse-step generator (thesis 4.3) is such a sum. Its derivative is one again; its
integral and its low-pass response follow below, accurate also where p meets the cut-off frequency of
the plant and the textbook formulas divide zero by zero.

Coefficients c and rates p are arrays of one common batch shape (...); times t have the shape
(..., time) and results too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Term:
    """c t^n exp(-p t), with c and p > 0 of batch shape (...)."""

    c: Array
    n: int
    p: Array


@dataclass(frozen=True)
class ExponentialSum:
    """The sum of its terms, for t >= 0."""

    terms: tuple[Term, ...]

    def __call__(self, t: Array) -> Array:
        """Value at times t (..., time)."""
        return sum((x.c[..., None] * t**x.n * np.exp(-x.p[..., None] * t) for x in self.terms), np.zeros(()))

    def derivative(self) -> "ExponentialSum":
        """The derivative with respect to t."""
        terms = []
        for x in self.terms:
            terms.append(Term(-x.c * x.p, x.n, x.p))
            if x.n:
                terms.append(Term(x.c * x.n, x.n - 1, x.p))
        return ExponentialSum(tuple(terms))

    def integral(self, t: Array) -> Array:
        """Integral from 0 to t."""
        parts = (x.c[..., None] * t ** (x.n + 1) * _moment(x.n, x.p[..., None] * t) for x in self.terms)
        return sum(parts, np.zeros(()))

    def low_pass(self, w: Array | float, t: Array) -> Array:
        """Response at t, from rest, of the low-pass w / (s + w) to this sum.

        Each term gives w exp(-w t) times the integral of c s^n exp(-(p - w) s) over 0..t, which has
        no singularity at p = w; written so that neither sign of p - w overflows.
        """
        w = np.asarray(w, dtype=float)[..., None]
        total = np.zeros(())
        for x in self.terms:
            p = x.p[..., None]
            gap = (p - w) * t
            slower = np.exp(-np.minimum(p, w) * t)
            mirrored = gap < 0
            moment = _moment(x.n, np.abs(gap))
            if mirrored.any():
                moment = np.where(mirrored, _mirrored_moment(x.n, np.abs(gap)), moment)
            total = total + x.c[..., None] * w * t ** (x.n + 1) * slower * moment
        return total

    def __add__(self, other: "ExponentialSum") -> "ExponentialSum":
        return ExponentialSum(self.terms + other.terms)

    def scaled(self, factor: Array | float) -> "ExponentialSum":
        """The sum times a factor (...)."""
        return ExponentialSum(tuple(Term(x.c * factor, x.n, x.p) for x in self.terms))


def filter_energy(poles: Sequence[Array], zero: Array) -> Array:
    """Integral over 0..infinity of the square of the impulse response of (s + z) / ((s + p1) (s + p2) ...), (...).

    Parseval's integral for two or three poles. All its terms are positive: nothing cancels where poles
    nearly meet, as it does in the sum over pairs of exponentials.

    Args:
        poles: two or three rates p > 0, each (...).
        zero: z, (...).
    """
    if len(poles) == 2:
        p, q = poles
        return (p * q + zero**2) / (2 * p * q * (p + q))
    p, q, r = poles
    return (p * q * r + zero**2 * (p + q + r)) / (2 * p * q * r * (p + q) * (p + r) * (q + r))


def _moment(n: int, z: Array) -> Array:
    """Integral of u^n exp(-z u) over 0..1, for z >= 0."""
    small = z < _SMALL
    safe = np.where(small, 1.0, z)
    decay = np.exp(-safe)
    value = -np.expm1(-safe) / safe
    for k in range(1, n + 1):
        value = (k * value - decay) / safe
    return _with_series(value, small, z, [1 / (n + k + 1) for k in range(_SERIES)])


def _mirrored_moment(n: int, z: Array) -> Array:
    """Integral of (1 - u)^n exp(-z u) over 0..1, for z >= 0."""
    small = z < _SMALL
    safe = np.where(small, 1.0, z)
    value = -np.expm1(-safe) / safe
    for k in range(1, n + 1):
        value = (1 - k * value) / safe
    # The integral of (1 - u)^n u^k is n! k! / (n + k + 1)!.
    beta = [factorial(n) * factorial(k) / factorial(n + k + 1) for k in range(_SERIES)]
    return _with_series(value, small, z, beta)


_SMALL = 0.5  # above it the recursion over n loses at most two digits for n <= 2
_SERIES = 14  # terms of the power series: the next is below 1e-16 for z up to 0.5


def _with_series(value: Array, small: NDArray[np.bool_], z: Array, moments: list[float]) -> Array:
    """`value`, replaced where z is small by the series of (-z)^k / k! times the k-th moment."""
    if small.any():
        x = z[small]
        total = np.zeros_like(x)
        for k in reversed(range(len(moments))):
            total = total * -x / (k + 1) + moments[k]
        value[small] = total
    return value
