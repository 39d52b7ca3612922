"""A second search of the best action, by another program: it checks the first."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution, minimize

from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
_NUMBERS = 3  # of the thesis' action
_AGREEMENT, _OF_MANY = 1e-3, 5e-3


def agreement(task: SaccadeTask) -> float:
    """Of |R*|: as far as the second search may be better before the first counts as wrong; more of many numbers."""
    return _AGREEMENT if len(task.actions.plain.numbers) <= _NUMBERS else _OF_MANY


def second_search(task: SaccadeTask, start: State, target: Array) -> tuple[Array, float]:
    """The best action (numbers,) of one saccade and its reward, by scipy's optimisers.

    Differential evolution, then Nelder and Mead's simplex around the best; once for either half of the range of
    a number with a cliff (k0), since one alone may end on the wrong side of the overshoot; over the whole box, and
    longer, where several have one. It shares with `orient_eye.search.optimum` only the task, and knows nothing of where
    the optimum should be.

    Args:
        task: plant, command and reward.
        start: of the eye, (1,).
        target: desired orientation, (1, 4).
    """
    numbers = task.actions.numbers
    cliff = np.array([number.cliff for number in numbers])

    def loss(x: Array) -> Array:
        """Minus the rewards (candidates,) of actions (numbers, candidates), shares of the box."""
        which = np.zeros(x.shape[1], int)
        many = task.actions.from_unit(2 * x.T - 1)
        return -task.perform(start[which], many, target[which]).reward.total

    found: list[tuple[float, Array]] = []
    more = len(numbers) / _NUMBERS
    for half in ((0.0, 0.5), (0.5, 1.0)) if cliff.sum() <= 1 else ((0.0, 1.0),):
        bounds = [half if steep else (0.0, 1.0) for steep in cliff]
        evolved = differential_evolution(
            loss,
            bounds,
            vectorized=True,
            updating="deferred",
            rng=1,
            popsize=16,
            maxiter=round(120 * more),
            tol=1e-6,
            polish=False,
        )
        steps = np.diag([2e-3 if number.cliff else 0.4 * number.fine for number in numbers])
        found += [(float(evolved.fun), evolved.x), _polished(loss, evolved.x, bounds, steps, float(evolved.fun))]
    least, x = min(found, key=lambda pair: pair[0])
    return task.actions.from_unit(2 * x[None] - 1)[0], -least


def _polished(
    loss: Callable[[Array], Array], x: Array, bounds: list[tuple[float, float]], steps: Array, value: float
) -> tuple[float, Array]:
    corners = x + np.vstack([np.zeros(len(x)), steps])
    highest = [high for _, high in bounds]
    polished = minimize(
        lambda at: float(loss(at[:, None])[0]),
        x,
        method="Nelder-Mead",
        bounds=bounds,
        options={
            "initial_simplex": np.where(corners > highest, 2 * x - corners, corners),
            "xatol": 1e-7,
            "fatol": 1e-6 * abs(value),
            "maxfev": round(200 * (len(x) / _NUMBERS) ** 2),
        },
    )
    return float(polished.fun), polished.x
