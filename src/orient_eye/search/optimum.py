"""The best action for a saccade, by search: the yardstick for everything learned.

    found = find_optimum(task, start, target, np.random.default_rng(0))
    found.action, found.reward

Simplices from the best of a sample in each basin, begun anew around what they found, for many saccades side by side,
so that every step is one batch of the plant; in between each saccade tries what was found for those most like it. It
needs no gradient, so that neither the cliff of the reward in k0 (an overshoot costs decades) nor the kink of the
settling time misleads it. Of nine numbers, evolution strategies do the same (`search.evolution`). What the search knows
of the numbers of an action stands in the task's action space.

A plant that has a quicker twin is searched on the twin. What is told is the plant's own reward, and where that is not
the twin's, the search goes on on the plant.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from orient_eye.checks import real
from orient_eye.search.evolution import evolve
from orient_eye.search.simplex import around, climb
from orient_eye.state import State
from orient_eye.task.actions import ActionSpace
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
_SAMPLE = 40  # actions a saccade, of three numbers
_NEAR_LIKELY = 1.5  # of a number's `fine`: spread around a value that is likely
_APART = 1 / 6  # of a range: from there on an action is on another side of a cliff
_LIKE = 4  # saccades whose actions are tried
_DOUBT = 1e-3  # of a plant on which saccades of many numbers are searched
_TWINS = 1e-4  # of |R|: as far as a twin's reward may be from the plant's own


class _Round(NamedTuple):
    """Simplices begun anew.

    Attributes:
        simplices: a saccade, around its best actions.
        iterations: of actions of three numbers.
        step: to the simplex' other corners, in units of a number's `fine`.
        along: as the last simplex lies, larger: where that has found a ridge, the new one goes along it.
    """

    simplices: int
    iterations: int
    step: float
    along: bool = False


_ROUNDS = (
    _Round(5, 20, 5.0),
    _Round(2, 40, 2.0),
    _Round(1, 40, 6.0, along=True),
    _Round(1, 40, 3.0, along=True),
    _Round(1, 30, 1.0),
    _Round(1, 30, 0.3),
)
_FEW = 5  # numbers: of more than these, evolutions
_GENERATIONS = ((8, 35, 1.0), (2, 60, 0.7), (1, 200, 0.3))
"""Of every round: evolutions of a saccade, their generations, and how wide they begin in units of `fine`."""
_ACROSS = 0.05  # of its step, by which one along a ridge is wide


@dataclass(frozen=True)
class Optimum:
    """The best actions found.

    Attributes:
        action: in units, (saccades, numbers).
        reward: their total reward, (saccades,).
        evaluations: how many saccades the search performed, on the plant and its twin.
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
    effort: float = 1.0,
    progress: Callable[[float], None] | None = None,
) -> Optimum:
    """Search the best action of each saccade.

    Args:
        task: plant, command and reward. The best actions are those of its plain task (`SaccadeTask.plain`): what its
            own actions know of usual commands is where the search begins, and not where it ends.
        start: where each saccade begins, of (saccades,).
        target: desired orientations, (saccades, 4).
        random: generator of the search.
        effort: times the usual number of saccades; with more of them it finds what few find.
        progress: called with the share of the work done, 0 to 1.

    Raises:
        InputError: an effort that is none.
    """
    real("the effort of a search", effort, 0.01, 1000.0, advice="1 is the usual one")
    usual, task, twin = task.actions, task.plain, task.plant.twin()
    if usual is not task.actions:
        twin = copy.copy(task.plant) if twin is None else twin
        twin.doubt = _DOUBT
    search = _Search(task if twin is None else replace(task, plant=twin), start, target, random, effort, progress)
    x, value = search.run(usual)
    performed = search.performed
    if twin is not None:
        own = _Search(task, start, target, random, effort)
        own_value = own.judge(x[:, None])[:, 0]
        performed += own.performed
        # Where the twin is not quite this eye its best may lie beyond a cliff: there the plant itself goes on.
        off = np.flatnonzero(np.abs(own_value - value) > _TWINS * np.abs(own_value))
        value = own_value
        if len(off):
            own = _Search(task, start[off], target[off], random, effort)
            x[off], value[off] = own.go_on(x[off], own_value[off])
            performed += own.performed
    return Optimum(task.actions.from_unit(2 * x - 1), value, performed)


class _Search:
    """One search. Actions are in the unit box; those of a saccade are (saccades, actions, numbers)."""

    def __init__(
        self,
        task: SaccadeTask,
        start: State,
        target: Array,
        random: np.random.Generator,
        effort: float,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self.task, self.start, self.target, self.random, self.progress = task, start, target, random, progress
        numbers = task.actions.numbers
        self.saccades, self.size, self.performed = len(target), len(numbers), 0
        self.fine = np.array([number.fine for number in numbers])
        cliff = np.array([number.cliff for number in numbers])
        self.cliff = cliff if cliff.any() else ~cliff
        self.effort = effort * (1.0 if self.size > _FEW else (self.size / 3) ** 0.5)
        steps = [g for _, g, _ in _GENERATIONS] if self.size > _FEW else [each.iterations for each in _ROUNDS]
        self.left = self.rounds = sum(map(self._times, steps))

    def _times(self, usual: int) -> int:
        return max(1, round(usual * self.effort))

    def run(self, first: ActionSpace) -> tuple[Array, Array]:
        """The best actions (saccades, numbers) and their values.

        Args:
            first: actions from which half of the sample is drawn, where they are not the task's own.
        """
        if self.size > _FEW:
            return self._evolved(first)
        # Most candidates have likely numbers (D: they end near the target): the search is about the others.
        likely = (self.task.actions.to_unit(self.task.actions.likely(self.target)) + 1) / 2
        known = np.asarray(np.isfinite(likely).all(axis=0))
        usual, every = np.where(known, likely, 0.0), np.arange(self.saccades)
        alike = self._alike()
        best, value = self._basins(*self._sample(usual, known, first), _ROUNDS[0].simplices)
        last = best[:, :1]
        for i, each in enumerate(_ROUNDS):
            if i and alike.shape[1]:
                # What is best for others is best here as a difference from what is usual there.
                tried = np.clip((best[:, 0] - usual)[alike] + usual[:, None], 0, 1)
                best, value = _merged(best, value, tried, self.judge(tried))
            simplices = min(each.simplices, best.shape[1])
            points, values = self._climb(self._simplices(best[:, :simplices], last, each), each)
            last = points[every, values[:, :, 0].argmax(axis=1)]
            best, value = _best_first(points[:, :, 0], values[:, :, 0])
        return best[:, 0], value[:, 0]

    def _evolved(self, first: ActionSpace) -> tuple[Array, Array]:
        """The same of many numbers, by evolution: from several basins, then again from the best and what is alike."""
        likely = (self.task.actions.to_unit(self.task.actions.likely(self.target)) + 1) / 2
        known, alike = np.asarray(np.isfinite(likely).all(axis=0)), self._alike()
        usual = np.where(known, likely, 0.0)
        best, value = _best_first(*self._sample(usual, known, first))
        for strains, generations, spread in _GENERATIONS:
            found = evolve(
                partial(self._perform_strains, strains),
                best[:, :strains].reshape(-1, self.size),
                spread * self.fine,
                self._times(generations),
                self.random,
                self._advance,
            )
            best, value = _best_first(*(each.reshape(self.saccades, strains, *each.shape[1:]) for each in found))
            if alike.shape[1]:
                tried = np.clip((best[:, 0] - usual)[alike] + usual[:, None], 0, 1)
                best, value = _merged(best, value, tried, self.judge(tried))
        return best[:, 0], value[:, 0]

    def go_on(self, x: Array, value: Array) -> tuple[Array, Array]:
        """Better actions (saccades, numbers) near such ones, and their values; as good ones at least."""
        best, value = x[:, None], value[:, None]
        for each in _ROUNDS[-2:]:
            points, values = self._climb(self._simplices(best, best, each), each)
            best, value = points[:, :, 0], values[:, :, 0]
        return best[:, 0], value[:, 0]

    def judge(self, actions: Array) -> Array:
        """Rewards (saccades, actions)."""
        rows = np.repeat(np.arange(self.saccades), actions.shape[1])
        return self._perform(actions.reshape(-1, self.size), rows).reshape(self.saccades, -1)

    def _perform(self, actions: Array, rows: NDArray[np.intp]) -> Array:
        self.performed += len(rows)
        units = self.task.actions.from_unit(2 * actions - 1)
        return self.task.perform(self.start[rows], units, self.target[rows]).reward.total

    def _perform_strains(self, strains: int, actions: Array, rows: NDArray[np.intp]) -> Array:
        """Of several evolutions a saccade."""
        return self._perform(actions, rows // strains)

    def _sample(self, usual: Array, known: NDArray[np.bool_], first: ActionSpace) -> tuple[Array, Array]:
        """Actions all over the box, but for numbers that are likely, and their values; half of them by `first`."""
        count = max(_ROUNDS[0].simplices, round(_SAMPLE * self.effort))
        shape = (self.saccades, count, self.size)
        cells = self.random.permuted(np.broadcast_to(np.arange(count)[:, None], shape), axis=1)
        x = (cells + self.random.random(shape)) / count
        near = usual[:, None] + _NEAR_LIKELY * self.fine * self.random.normal(size=shape)
        own = np.where(known, np.clip(near, 0, 1), x)
        if first is not self.task.actions:
            rows, half = np.repeat(np.arange(self.saccades), count // 2), x[:, : count // 2].reshape(-1, self.size)
            told = first.as_plain(self.start[rows], self.target[rows], first.from_unit(2 * half - 1))
            own[:, : count // 2] = (self.task.actions.to_unit(told).reshape(self.saccades, -1, self.size) + 1) / 2
        return own, self.judge(own)

    def _basins(self, x: Array, value: Array, count: int) -> tuple[Array, Array]:
        """The best action, then each time the best on another side of a cliff (without one, elsewhere)."""
        each, left, chosen = np.arange(self.saccades), value.copy(), []
        for _ in range(count):
            chosen.append(left.argmax(axis=1))
            off = np.abs(x - x[each, chosen[-1]][:, None])[..., self.cliff]
            left[(off < _APART).all(axis=2)] = -np.inf
        which = np.stack(chosen, axis=1)
        return x[each[:, None], which], value[each[:, None], which]

    def _alike(self) -> NDArray[np.intp]:
        """For each saccade those with the nearest starts and targets, (saccades, a few)."""
        ends = [q * np.where(q[:, :1] < 0, -1, 1) for q in (self.start.orientation, self.target)]
        places = np.concatenate(ends, axis=1)
        places_of_others = list(range(2, min(_LIKE + 1, self.saccades) + 1))  # the first is the saccade itself
        if not places_of_others:
            return np.empty((self.saccades, 0), int)
        return np.asarray(cKDTree(places).query(places, places_of_others)[1])

    def _simplices(self, best: Array, last: Array, each: _Round) -> Array:
        """Simplices (saccades, simplices, numbers + 1, numbers) around actions (saccades, simplices, numbers).

        Args:
            best: the actions.
            last: of each saccade the best simplex before, (saccades, numbers + 1, numbers).
            each: how large and where along.
        """
        saccades, simplices, size = best.shape
        steps = each.step * self.fine
        points = around(best.reshape(-1, size), steps, self.random).reshape(saccades, simplices, size + 1, size)
        if not each.along:
            return points
        lies = last[:, None] - last[:, None, :1]
        long = np.abs(lies / steps).max(axis=(2, 3), keepdims=True)
        along = best[:, :, None] + lies / np.maximum(long, 1e-9) + _ACROSS * (points - points[:, :, :1])
        return np.clip(along, 0, 1)

    def _climb(self, points: Array, each: _Round) -> tuple[Array, Array]:
        """Simplices (saccades, simplices, numbers + 1, numbers) uphill, and their values."""
        saccades, simplices, corners, size = points.shape
        points, values = climb(
            lambda x, which: self._perform(x, which // simplices),
            points.reshape(-1, corners, size),
            self._times(each.iterations),
            self._advance,
        )
        return points.reshape(saccades, simplices, corners, size), values.reshape(saccades, simplices, corners)

    def _advance(self) -> None:
        self.left -= 1
        if self.progress:
            self.progress(1 - self.left / self.rounds)


def _best_first(x: Array, value: Array) -> tuple[Array, Array]:
    order = np.argsort(-value, axis=1, kind="stable")
    return np.take_along_axis(x, order[..., None], axis=1), np.take_along_axis(value, order, axis=1)


def _merged(x: Array, value: Array, others: Array, their_value: Array) -> tuple[Array, Array]:
    """Actions with the best of others put first, where that is better than all of them."""
    winner, each = their_value.argmax(axis=1), np.arange(len(x))
    best = their_value[each, winner]
    wins = best > value[:, 0]
    value = np.concatenate([np.where(wins, best, -np.inf)[:, None], value], axis=1)
    return _best_first(np.concatenate([others[each, winner][:, None], x], axis=1), value)
