"""The search of nine numbers: evolution on known functions, and the best saccades against scipy's own search."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from orient_eye.plants import make_plant
from orient_eye.search.evolution import evolve
from orient_eye.search.optimum import find_optimum
from orient_eye.search.second_search import agreement, second_search
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
PEAKS = np.array([[0.3] * 6, [0.7, 0.2, 0.5, 0.6, 0.4, 0.9], [0.5] * 6])
STEPS = np.full(6, 0.1)


def hills(x: Array, which: NDArray[np.intp]) -> Array:
    """A hill of its own for each evolution, a hundred times as steep one way as another, and its axes turned."""
    turned = (x - PEAKS[which]) @ np.linalg.qr(np.random.default_rng(5).normal(size=(6, 6)))[0]
    return np.asarray(-(turned**2 @ np.geomspace(1, 100, 6)))


def test_evolutions_find_each_its_own_peak() -> None:
    points, values = evolve(hills, np.full((3, 6), 0.5), STEPS, 120, np.random.default_rng(0))
    np.testing.assert_allclose(points, PEAKS, atol=0.01)
    np.testing.assert_array_equal(values, hills(points, np.arange(3)))
    assert (values > -1e-4).all()


def test_a_peak_outside_is_sought_at_the_edge_of_the_box() -> None:
    seen = []

    def slope(x: Array, which: NDArray[np.intp]) -> Array:
        seen.append(x)
        return np.asarray(x[:, 0] - ((x[:, 1:] - 0.5) ** 2).sum(axis=1))

    points, _ = evolve(slope, np.full((1, 6), 0.5), STEPS, 100, np.random.default_rng(0))
    assert points[0] == pytest.approx([1, *[0.5] * 5], abs=0.01)
    every = np.concatenate(seen)
    assert ((every >= 0) & (every <= 1)).all()


def test_a_curved_ridge_is_followed() -> None:
    """Rosenbrock's, of five numbers, its peak at 1 on a box from -2 to 2."""

    def ridge(x: Array, which: NDArray[np.intp]) -> Array:
        z = 4 * x - 2
        return np.asarray(-(100 * (z[:, 1:] - z[:, :-1] ** 2) ** 2 + (1 - z[:, :-1]) ** 2).sum(axis=1))

    points, values = evolve(ridge, np.full((1, 5), 0.5), np.full(5, 0.05), 500, np.random.default_rng(1))
    assert values[0] > -1e-3
    np.testing.assert_allclose(points, 0.75, atol=0.01)


def test_the_same_seed_finds_the_same_and_each_generation_is_told() -> None:
    told: list[None] = []
    one = evolve(hills, np.full((3, 6), 0.5), STEPS, 7, np.random.default_rng(2), lambda: told.append(None))
    other = evolve(hills, np.full((3, 6), 0.5), STEPS, 7, np.random.default_rng(2))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)
    assert len(told) == 7
    assert not np.array_equal(one[0], evolve(hills, np.full((3, 6), 0.5), STEPS, 7, np.random.default_rng(3))[0])


# --- saccades ---------------------------------------------------------------------------------------------


@cache
def task_of(plant: str) -> SaccadeTask:
    weights = {"accuracy": 4.08e7, "energy": 1.0, "duration": 5.53e5, "overshoot": 5e6, "force": 0.0}
    if plant == "tavares":
        weights["force"] = 3e5
    return SaccadeTask.of_case(make_plant(plant), targets="gaze", weights=weights)


def test_the_search_is_about_the_whole_box_and_told_plainly() -> None:
    """Nothing near it is better, and neither what residual actions know nor where they end bounds it."""
    task = task_of("modal")
    start, target = saccades(task.targets, [[0.0, 0.0]], [[12.0, -9.0]])
    done: list[float] = []
    found = find_optimum(task, start, target, np.random.default_rng(0), effort=0.5, progress=done.append)
    plain = task.plain
    assert found.action.shape == (1, 9)
    assert ((found.action >= plain.actions.low) & (found.action <= plain.actions.high)).all()
    assert done[-1] == 1
    assert done == sorted(done)
    own = plain.perform(start, found.action, target).reward.total
    assert own == pytest.approx(found.reward, rel=1e-6)
    usual = task.perform(start, task.actions.from_unit(np.zeros((1, 9))), target).reward.total
    assert found.reward[0] > usual[0]
    random = np.random.default_rng(1)
    unit = plain.actions.to_unit(found.action) + random.normal(size=(400, 9)) * random.choice([0.1, 0.01], (400, 1))
    one = np.zeros(400, int)
    around = plain.perform(start[one], plain.actions.from_unit(unit), target[one]).reward.total
    assert around.max() < found.reward[0] + 2e-3 * abs(found.reward[0])


@pytest.mark.slow
@pytest.mark.usefixtures("short_second_search")
@pytest.mark.parametrize("plant", ["modal", "tavares"])
def test_two_independent_searches_agree(plant: str) -> None:
    task = task_of(plant)
    start, target = saccades(task.targets, [[-15.0, 10.0]], [[15.0, -10.0]])
    found = find_optimum(task, start, target, np.random.default_rng(0))
    _, reward = second_search(task.plain, start, target)
    assert reward <= found.reward[0] + agreement(task) * abs(found.reward[0])
    assert reward == pytest.approx(found.reward[0], rel=0.02)
