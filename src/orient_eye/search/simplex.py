"""Nelder and Mead's simplex, many of them side by side in the unit box: every step is one batch.

    points, values = climb(judge, around(best, steps, random), 40)

Where a reward is a cliff on one side and a gentle slope on the other, a simplex finds the edge in a third of the
evaluations of an evolution strategy: it has no spread that must first learn how thin the edge is. Only the comparison
of values counts, so that a reward over decades is as good as its logarithm.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Judge = Callable[[Array, Rows], Array]
"""From points (points, size) in the unit box, and to which simplex each belongs (points,), to values (points,)."""
_STRETCH, _SHRINK = 2.0, 0.5


def around(best: Array, steps: Array, random: np.random.Generator) -> Array:
    """Simplices (simplices, size + 1, size): points `best`, and from each a step along each number inside the box.

    Args:
        best: (simplices, size).
        steps: of each number, (size,).
        random: chooses the ways.
    """
    step = steps * random.choice([-1.0, 1.0], size=best.shape)
    step = np.where((best + step > 1) | (best + step < 0), -step, step)
    corners = best[:, None] + np.eye(best.shape[1]) * step[:, None]
    return np.clip(np.concatenate([best[:, None], corners], axis=1), 0, 1)


def climb(
    judge: Judge, points: Array, iterations: int, advance: Callable[[], object] = lambda: None
) -> tuple[Array, Array]:
    """Move every simplex uphill; points beyond the box are put on its faces.

    Args:
        judge: gives the values.
        points: the simplices, (simplices, size + 1, size).
        iterations: steps of each.
        advance: called after every iteration.

    Returns:
        Points (simplices, size + 1, size) and their values (simplices, size + 1), the best of each first.
    """
    count, corners, size = points.shape
    every = np.arange(count)
    value = judge(points.reshape(-1, size), np.repeat(every, corners)).reshape(count, corners)
    points, value = _sorted(points, value)
    for _ in range(iterations):
        best, second, worst = value[:, 0], value[:, -2], value[:, -1]
        middle = points[:, :-1].mean(axis=1)
        away = middle - points[:, -1]
        one = np.clip(middle + away, 0, 1)
        one_value = judge(one, every)
        leads, enough = one_value > best, one_value > second
        outside = one_value > worst
        # Beyond where it leads; between the middle and the better of the two where it is no better than the others.
        factor = np.where(leads, _STRETCH, np.where(outside, _SHRINK, -_SHRINK))
        two, two_value = np.clip(middle + factor[:, None] * away, 0, 1), np.full(count, -np.inf)
        asked = np.flatnonzero(leads | ~enough)
        if len(asked):
            two_value[asked] = judge(two[asked], asked)
        second_is_better = two_value > np.where(outside, one_value, worst)
        moves = second_is_better | enough
        chosen = np.where(second_is_better[:, None], two, one)
        points[:, -1] = np.where(moves[:, None], chosen, points[:, -1])
        value[:, -1] = np.where(moves, np.where(second_is_better, two_value, one_value), worst)
        stuck = np.flatnonzero(~moves)
        if len(stuck):
            points[stuck, 1:] = points[stuck, :1] + _SHRINK * (points[stuck, 1:] - points[stuck, :1])
            again = judge(points[stuck, 1:].reshape(-1, size), np.repeat(stuck, corners - 1))
            value[stuck, 1:] = again.reshape(-1, corners - 1)
        points, value = _sorted(points, value)
        advance()
    return points, value


def _sorted(points: Array, value: Array) -> tuple[Array, Array]:
    order = np.argsort(-value, axis=1, kind="stable")
    return np.take_along_axis(points, order[..., None], axis=1), np.take_along_axis(value, order, axis=1)
