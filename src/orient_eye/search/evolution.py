"""Evolution strategies (CMA-ES, package `cmaes`), many of them side by side in the unit box: every step is one batch.

    points, values = evolve(judge, best, steps, 100, random)

Of three numbers a simplex finds the edge of a cliff sooner (docs/decisions/0002); in nine it loses its shape on the
way, while an evolution strategy learns how the numbers hang together.
"""

from collections.abc import Callable

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from orient_eye.search.simplex import Judge

Array = NDArray[np.float64]
_OFFSPRING = 10


def evolve(
    judge: Judge,
    points: Array,
    steps: Array,
    generations: int,
    random: np.random.Generator,
    advance: Callable[[], object] = lambda: None,
) -> tuple[Array, Array]:
    """The best that evolutions from these points find, and its values.

    Args:
        judge: gives the values.
        points: where they begin, (evolutions, size).
        steps: first spread of each number, (size,).
        generations: of each.
        random: seeds them.
        advance: called after every generation.

    Returns:
        Points (evolutions, size) and their values (evolutions,).
    """
    count, size = points.shape
    box = np.tile([0.0, 1.0], (size, 1)) / steps[:, None]
    seeds = random.integers(0, 2**31, size=(count,)).tolist()
    strategies = [
        CMA(points[i] / steps, 1.0, bounds=box, seed=seeds[i], population_size=_OFFSPRING) for i in range(count)
    ]
    every = np.arange(count)
    which = np.repeat(every, _OFFSPRING)
    best, value = points.copy(), judge(points, every)
    for _ in range(generations):
        asked = np.array([[strategy.ask() for _ in range(_OFFSPRING)] for strategy in strategies])
        found = judge(np.clip(asked * steps, 0, 1).reshape(-1, size), which).reshape(count, -1)
        for strategy, tried, values in zip(strategies, asked, found, strict=True):
            strategy.tell([(point, -value) for point, value in zip(tried, values.tolist(), strict=True)])
        winner = found.argmax(axis=1)
        better = found[every, winner] > value
        best[better] = np.clip(asked[every, winner] * steps, 0, 1)[better]
        value[better] = found[every, winner][better]
        advance()
    return best, value
