"""The three pulses of the thesis (4.3); symbols as in `orient_eye.commands.pulses`."""

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands.exponentials import ExponentialSum, Term
from orient_eye.commands.pulses import Onset, Pulse

Array = NDArray[np.float64]
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


def _root2(size: Array, B: Array, k0: Array, V: float) -> Array:
    """A C = V (4.18), so C = V k0 / (|D - F| B) - B; at most 1e5, for saccades of no size.

    That is the speed at the onset, the largest where k0 <= 2 B + C, as in all of the thesis' ranges.
    """
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


VARIANT_1 = Pulse("A t exp(-B t): variant 1 of the thesis (4.3.1)", _variant1, lambda B, C: (B, B))
VARIANT_2 = Pulse(
    "A exp(-B t) (1 - exp(-C t)): variant 2 of the thesis (4.3.2)",
    _variant2,
    lambda B, C: (B, B + C),
    # The initial speed falls with C: the slowest onset, short of the limit C -> 0, which is variant 1.
    Onset(85.0, _keeps2, _root2, lambda size, B, k0, V: _SLOWEST_ONSET * B),
)
VARIANT_3 = Pulse(
    "A exp(-B t) (1 - exp(-C t) - C t exp(-C t)): variant 3 of the thesis (4.3.3)",
    _variant3,
    lambda B, C: (B, B + C, B + C),
    # The bound on the speed is least at C = B.
    Onset(3.6, _keeps3, _root3, lambda size, B, k0, V: B),
)
