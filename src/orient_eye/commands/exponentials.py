"""Sums of terms c t^n exp(-p t): the algebra in which every pulse and its consequences are closed.

A pulse of the pulse-step generator (thesis 4.3) is such a sum. Its derivative is one again; its
integral and its low-pass response follow below, accurate also where p meets the cut-off frequency of
the plant and the textbook formulas divide zero by zero.

What a linear system of several poles, real or complex, makes of such a sum is a sum of the same kind:
`Modes`, whose coefficients are found once a saccade, so that a point in time costs one exponential a
rate. They stay accurate where poles meet: see `Modes.through`.

Coefficients c and rates p are arrays of one common batch shape (...); times t have the shape
(..., time) and results too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = NDArray[Any]
"""Real or complex."""


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

    def with_integral(self, t: Array) -> tuple[Array, Array]:
        """Value at times t (..., time), and the integral from 0 to t, exact to rounding of its limit."""
        value = integral = np.zeros(())
        for x in self.terms:
            c, z = x.c[..., None], x.p[..., None] * t
            decay = np.exp(-z)
            value = value + c * t**x.n * decay
            series = np.ones_like(z)  # sum of z^k / k! up to n
            for k in range(x.n, 0, -1):
                series = 1 + series * z / k
            integral = integral + factorial(x.n) * c / x.p[..., None] ** (x.n + 1) * (1 - series * decay)
        return value, integral

    def through(self, poles: Sequence[complex | Numbers]) -> "Modes":
        """Response, from rest, of the system with these poles and static gain 1 to this sum; see `Modes.through`."""
        modes: list[Mode] = []
        for p in {id(x.p): x.p for x in self.terms}.values():
            of_rate = [x for x in self.terms if x.p is p]
            a = np.zeros((1 + max(x.n for x in of_rate), *p.shape))
            for x in of_rate:
                a[x.n] += x.c * factorial(x.n)
            modes.append(Mode(p, a))
        return Modes(tuple(modes)).through(poles)

    def part(self, place: int) -> "ExponentialSum":
        """The sums at one place of the last axis of the batch."""
        return ExponentialSum(tuple(Term(x.c[..., place], x.n, x.p[..., place]) for x in self.terms))

    def __add__(self, other: "ExponentialSum") -> "ExponentialSum":
        return ExponentialSum(self.terms + other.terms)

    def scaled(self, factor: Array | float) -> "ExponentialSum":
        """The sum times a factor (...)."""
        return ExponentialSum(tuple(Term(x.c * factor, x.n, x.p) for x in self.terms))


def overlap(a: ExponentialSum, b: ExponentialSum) -> Array:
    """Integral over all time of the product of two sums, (...)."""
    found: Array = np.zeros(())
    for x in a.terms:
        for y in b.terms:
            found = found + x.c * y.c * factorial(x.n + y.n) / (x.p + y.p) ** (x.n + y.n + 1)
    return found


@dataclass(frozen=True)
class Mode:
    """The real part of exp(-p t) times the sum over n of a[n] t^n / n!.

    In Laplace terms the sum of a[n] / (s + p)^(n + 1). p (...) has a positive real part; a is
    (orders, ...). Both are real or complex.
    """

    p: Numbers
    a: Numbers


@dataclass(frozen=True)
class Modes:
    """The sum of its modes, for t >= 0, of one common batch shape (...)."""

    modes: tuple[Mode, ...]

    def jet(self, t: Array, derivatives: int) -> tuple[Array, ...]:
        """Value at times t (..., time) and its first derivatives, each (..., time)."""
        shape = np.broadcast_shapes(*(m.p.shape for m in self.modes), t.shape[:-1])
        by_row = Modes(tuple(Mode(*(_by_row(x, shape) for x in (m.p, m.a))) for m in self.modes))
        times = np.broadcast_to(t, (*shape, t.shape[-1])).reshape(-1, t.shape[-1])
        if times.size * len(self.modes) * _ORDERS <= _CHUNK:
            values = by_row._jet(times, derivatives, None)
            return tuple(np.moveaxis(values, 1, 0).reshape(derivatives + 1, *shape, t.shape[-1]))
        values = np.empty((len(times), derivatives + 1, t.shape[-1]))
        # Rows with poles that nearly meet have long polynomials; the others need not carry them.
        long = np.zeros(len(times), bool)
        for m in by_row.modes:
            long |= (m.a[_SHORT:] != 0).any(axis=0)
        for index, orders in ((np.flatnonzero(~long), _SHORT), (np.flatnonzero(long), None)):
            chunk = max(1, _CHUNK // max(1, t.shape[-1] * len(self.modes) * (1 if orders else _ORDERS)))
            for start in range(0, len(index), chunk):
                part = slice(None) if len(index) == len(times) <= chunk else index[start : start + chunk]
                values[part] = by_row[part]._jet(times[part], derivatives, orders)
        return tuple(np.moveaxis(values, 1, 0).reshape(derivatives + 1, *shape, t.shape[-1]))

    def _jet(self, t: Array, derivatives: int, orders: int | None) -> Array:
        """(rows, derivatives + 1, time), as coefficients (rows, derivatives + 1, functions) times functions of t."""
        coefficients: list[Array] = []
        functions: list[Array] = []
        for m in self.modes:
            a = m.a[:orders]
            a = a[: 1 + int((a != 0).any(axis=1).nonzero()[0].max(initial=0))]  # the others add nothing
            of_value = [a]
            for _ in range(derivatives):
                of_value.append(_derivative(m.p, of_value[-1]))
            by_order = np.moveaxis(np.stack(of_value), 2, 0)
            wave = np.exp(-m.p.real[:, None] * t)
            waves = [(wave, by_order.real)]
            if np.iscomplexobj(m.p):
                angle = m.p.imag[:, None] * t
                waves = [(wave * np.cos(angle), by_order.real), (wave * np.sin(angle), by_order.imag)]
            for function, coefficient in waves:
                functions.append(function)
                for n in range(1, len(a)):
                    functions.append(functions[-1] * (t / n))
                coefficients.extend(np.moveaxis(coefficient, -1, 0))
        total = np.zeros((len(t), derivatives + 1, t.shape[-1]))
        for coefficient, function in zip(coefficients, functions, strict=True):
            total += coefficient[..., None] * function[:, None]
        return total

    def tail(self) -> "Modes":
        """The integral from t to infinity."""
        return Modes(tuple(Mode(m.p, _backward(m.a, 1 / m.p) / m.p) for m in self.modes))

    def through(self, poles: Sequence[complex | Numbers]) -> "Modes":
        """Response, from rest, of the system with these poles and static gain 1: the product of w / (s + w).

        Poles are taken one after the other. A mode of rate p passes w / (s + w), d = p - w, as its
        partial fractions, which lose digits as w / d does, or where w is near to p, or to a pole that
        the mode took in before, by

            1 / (s + w) = 1 / (s + p) + d / (s + p)^2 + d^2 / (s + p)^3 + ...

        whose terms fall as (|d| / p)^k at every t. So nothing is singular where any number of poles
        meet, of the system, of the sum, or of both.

        Args:
            poles: w, each a number or (...): one real, or two, real or in every row a conjugate pair.
        """
        shape = self.modes[0].p.shape
        rates = [np.broadcast_to(np.asarray(w), shape) for w in poles]
        modes, taken_in = list(self.modes), [[m.p] for m in self.modes]
        for w in rates:
            own = np.zeros(shape)
            for i, m in enumerate(modes):
                near = np.any([np.abs(x - w) <= _NEAR * m.p.real for x in taken_in[i]], axis=0)
                modes[i], residue = _low_pass(m, w, near)
                taken_in[i].append(np.where(near, w, np.inf))
                own = own + residue
            modes.append(Mode(w, own[None]))
            taken_in.append([w])
        if any(map(np.iscomplexobj, rates)):
            *others, first, second = modes
            # The real part of b exp(-conj(w) t) is that of conj(b) exp(-w t).
            pair = first.p.imag != 0
            joined = np.where(pair, second.a.conj(), 0)
            first = Mode(first.p, first.a + _longer(joined, len(first.a)))
            second = Mode(second.p.real, np.where(pair, 0, second.a).real)
            modes = [*(Mode(m.p, m.a.real) for m in others), first, second]
        return Modes(tuple(m for m in modes if m.a.any()))

    def scaled(self, factor: Array | float) -> "Modes":
        """The sum times a factor (...)."""
        return Modes(tuple(Mode(m.p, m.a * factor) for m in self.modes))

    def plus(self, other: "Modes") -> "Modes":
        """The sum of two with the same rates and orders."""
        return Modes(tuple(Mode(m.p, m.a + o.a) for m, o in zip(self.modes, other.modes, strict=True)))

    def __getitem__(self, rows: NDArray[np.intp] | slice) -> "Modes":
        """Rows of the first axis of the batch."""
        return Modes(tuple(Mode(m.p[rows], m.a[:, rows]) for m in self.modes))


_SHORT = 5  # orders of modes with no pole nearby: n <= 2 and two exact coincidences
_NEAR = 0.05  # of p: less loses digits to partial fractions, more needs more orders
_ORDERS = 20  # of modes with poles nearby: where five meet 15 powers of d / p are left
_CHUNK = 2**16  # numbers at a time: what stays in the cache


def impulse_response(poles: Sequence[Numbers]) -> Modes:
    """Of the product of p / (s + p) over one or more poles, the first of them real; each (...).

    A pulse so made of its poles loses no digits where they nearly meet, as the sum of its terms does.
    """
    first, *others = poles
    return Modes((Mode(first, first[None]),)).through(others)


def _low_pass(mode: Mode, w: Numbers, near: NDArray[np.bool_]) -> tuple[Mode, Numbers]:
    """Response of w / (s + w) to a mode: the mode with other coefficients, and that of exp(-w t), 0 where w is near."""
    gap = mode.p - w
    divisor = np.where(near, 1, gap)
    quotient = _backward(np.where(near, 0, mode.a), 1 / divisor) * (w / divisor)
    a = -quotient
    if near.any():
        a = _longer(a, _ORDERS if gap[near].any() else len(a) + 1)
        power = np.zeros_like(quotient[0])
        for n in range(1, len(a)):
            power = gap * power + (w * mode.a[n - 1] if n <= len(mode.a) else 0)
            a[n] = np.where(near, power, a[n])
    return Mode(mode.p, a), quotient[0]


def _backward(a: Numbers, factor: Numbers) -> Numbers:
    """r[n] = a[n] + factor r[n + 1]."""
    r = np.array(a + 0 * factor)
    for n in reversed(range(len(a) - 1)):
        r[n] += factor * r[n + 1]
    return r


def _derivative(p: Numbers, a: Numbers) -> Numbers:
    b = -p * a
    b[:-1] += a[1:]
    return np.asarray(b)


def _longer(a: Numbers, orders: int) -> Numbers:
    """a with zeros behind, or cut."""
    b = np.zeros((orders, *a.shape[1:]), a.dtype)
    b[: len(a)] = a[:orders]
    return b


def _by_row(x: Numbers, shape: tuple[int, ...]) -> Numbers:
    """x (..., shape) with the axes of shape made one."""
    leading = x.shape[: x.ndim - len(shape)]
    return np.broadcast_to(x, (*leading, *shape)).reshape(*leading, -1)


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
