"""The best action for a saccade, by search: the yardstick for everything learned.

    found = find_optimum(task, start, target, np.random.default_rng(0))
    found.action, found.reward

Differential evolution over the box of actions and scans along its coordinates at the end, for many saccades
side by side, so that every step is one batch of the plant. It needs no gradient, so that neither the cliff of
the reward in k0 (an overshoot costs decades) nor the kink of the settling time misleads it. What it knows of the
numbers of an action stands in the task's action space.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
_ISLANDS = 3
_RESTARTS = {0.3: 1.0, 0.55: 0.3, 0.8: 0.1}  # share of the generations: spread around the best
_NEAR_LIKELY = 0.003  # of a number's range: spread around a value that is likely
_SCANS = (1.0, 0.2, 0.04, 0.008, 0.0016)  # half-widths of the scans at the end, shares of the ranges


@dataclass(frozen=True)
class Optimum:
    """The best actions found.

    Attributes:
        action: in units, (saccades, numbers).
        reward: their total reward, (saccades,).
        evaluations: how many saccades the search performed.
    """

    action: Array
    reward: Array
    evaluations: int


def find_optimum(
    task: SaccadeTask,
    start: State,
    target: Array,
    random: np.random.Generator,
    *,
    population: int = 48,
    generations: int = 60,
    progress: Callable[[float], None] | None = None,
) -> Optimum:
    """Search the best action of each saccade.

    Args:
        task: plant, command and reward.
        start: where each saccade begins, of (saccades,).
        target: desired orientations, (saccades, 4).
        random: generator of the search.
        population: candidates a saccade, a multiple of 3.
        generations: of the search.
        progress: called with the share of the work done, 0 to 1.
    """
    if population % _ISLANDS or population < 4 * _ISLANDS:
        raise InputError(f"the population must be a multiple of {_ISLANDS}, at least {4 * _ISLANDS}, got {population}")
    saccades, actions = len(target), task.actions
    size = len(actions.numbers)
    rows = np.repeat(np.arange(saccades), population)
    many_starts, many_targets = start[rows], target[rows]

    def judge(candidates: Array) -> Array:
        many = actions.from_unit(2 * candidates.reshape(-1, size) - 1)
        return task.perform(many_starts, many, many_targets).reward.total.reshape(saccades, population)

    x = _spread(random, (saccades, population, size))
    # Most candidates have likely numbers (D: they end near the target): the rest of the search is about the others.
    likely = (actions.to_unit(actions.likely(target)) + 1) / 2
    known = np.isfinite(likely).all(axis=0)
    near = random.normal(likely[:, None, known], _NEAR_LIKELY, (saccades, population, int(known.sum())))
    anywhere = (np.arange(population) // _ISLANDS % 6 == 5)[:, None]
    x[..., known] = np.where(anywhere, x[..., known], np.clip(near, 0, 1))
    # Islands begin in one stratum of a number with a cliff (k0) each and breed only among themselves: the basins on
    # both sides of the cliff stay alive. Each begins anew around its best candidate, closer every time, so that one
    # that settled too early moves on.
    island = np.arange(population) % _ISLANDS
    cliff = np.array([number.cliff for number in actions.numbers])
    x[..., cliff] = (x[..., cliff] + island[:, None]) / _ISLANDS
    value = judge(x)
    mates = np.array([np.flatnonzero(island == i) for i in island])
    each, columns = np.arange(saccades)[:, None], np.arange(population)
    restarts = {round(share * generations): spread for share, spread in _RESTARTS.items()}
    rounds = generations + len(_SCANS) * size
    fine = np.array([number.fine for number in actions.numbers])
    for generation in range(generations):
        if progress:
            progress((generation + 1) / rounds)
        best = np.take_along_axis(mates[None], value[:, mates].argmax(axis=2)[..., None], axis=2)[..., 0]
        if generation in restarts:
            closer = fine * restarts[generation]
            moved = np.clip(x[each, best] + random.normal(size=x.shape) * closer, 0, 1)
            x = np.where((best == columns)[..., None], x, moved)
            value = judge(x)
            continue
        chosen = random.integers(mates.shape[1], size=(2, saccades, population))
        one, two = mates[columns, chosen[0]], mates[columns, chosen[1]]
        # "current to best / 1 / bin", with a scale drawn anew for each candidate.
        scale = random.uniform(0.3, 0.9, (saccades, population, 1))
        mutant = np.clip(x + scale * (x[each, best] - x) + scale * (x[each, one] - x[each, two]), 0, 1)
        crossed = random.random(x.shape) < 0.9
        crossed[each, columns, random.integers(size, size=(saccades, population))] = True
        trial = np.where(crossed, mutant, x)
        trial_value = judge(trial)
        better = trial_value >= value
        x, value = np.where(better[..., None], trial, x), np.where(better, trial_value, value)
    x, value = _scan(x, value, judge, lambda done: progress and progress((generations + done) / rounds))
    winner = value.argmax(axis=1)
    action = actions.from_unit(2 * x[np.arange(saccades), winner] - 1)
    return Optimum(action, value.max(axis=1), saccades * population * (rounds + 1))


def _scan(
    x: Array, value: Array, judge: Callable[[Array], Array], progress: Callable[[int], object]
) -> tuple[Array, Array]:
    """Scan from the best candidates along one coordinate at a time, the widest scans first.

    The way out where all islands have settled in a basin that is not the best.

    Args:
        x: candidates in the unit box, (saccades, population, size).
        value: of the candidates, (saccades, population).
        judge: gives the value of candidates.
        progress: called with the number of scans done.

    Returns:
        The candidates of the last scan and their values.
    """
    _, population, size = x.shape
    offsets = np.concatenate([[0.0], np.linspace(-1, 1, population - 1)])
    for done, (width, coordinate) in enumerate(itertools.product(_SCANS, range(size)), start=1):
        x = np.repeat(np.take_along_axis(x, value.argmax(axis=1)[:, None, None], axis=1), population, axis=1)
        x[..., coordinate] = np.clip(x[..., coordinate] + width * offsets, 0, 1)
        value = judge(x)
        progress(done)
    return x, value


def _spread(random: np.random.Generator, shape: tuple[int, int, int]) -> Array:
    """Latin hypercube samples in the unit box, one design a saccade."""
    saccades, population, size = shape
    cells = random.permuted(np.broadcast_to(np.arange(population)[:, None], (saccades, population, size)), axis=1)
    return (cells + random.random(shape)) / population
