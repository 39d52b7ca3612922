"""How cost grows, as ratios with generous margins: twice as much takes not much more than twice the time and memory.

CPU time of this process, one thread, the least of rounds in turn: other work on the machine changes little. The curves
themselves, and where they bend, are in `benchmarks/growth.py`.
"""

import time
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from orient_eye.commands import Sampled
from orient_eye.plants import make_plant
from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
COUNTS = {"lpf": 1000, "tavares": 100, "mujoco": 30}
ROUNDS = 5


@pytest.fixture(scope="module")
def tasks() -> dict[str, SaccadeTask]:
    """Case 1 on every plant of ours, one thread."""
    return {name: SaccadeTask.of_case(make_plant(name, **({} if name == "lpf" else {"threads": 1}))) for name in COUNTS}


def chosen(task: SaccadeTask, count: int) -> tuple[State, Array, Array]:
    """Starts, actions and targets of saccades of all sizes: a few, over and over."""
    random, which = np.random.default_rng(0), np.arange(count) % 20
    start, target = saccades(task.targets, *random.uniform(-30, 30, (2, 20, 1)))
    action = task.actions.likely(target)
    action[:, 0], action[:, 2] = 35, 18
    return start[which], action[which], target[which]


def least_cpu_s(*work: Callable[[], Any]) -> list[float]:
    """CPU time of each, done in turn, after one round that warms up."""
    taken = []
    for _ in range(ROUNDS + 1):
        taken.append([])
        for do in work:
            began = time.process_time()
            do()
            taken[-1].append(time.process_time() - began)
    return [min(each) for each in zip(*taken[1:], strict=True)]


def peak(work: Callable[[], Any]) -> int:
    """Most bytes that were allocated at a time, beyond what there was."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def performing(task: SaccadeTask, count: int) -> Callable[[], Any]:
    start, action, target = chosen(task, count)
    return lambda: task.perform(start, action, target)


@pytest.mark.parametrize("plant", COUNTS)
def test_twice_the_saccades_take_at_most_three_times_the_time(plant: str, tasks: dict[str, SaccadeTask]) -> None:
    few, many = least_cpu_s(*(performing(tasks[plant], n * COUNTS[plant]) for n in (1, 2)))
    assert many < 3 * few


@pytest.mark.parametrize("plant", COUNTS)
def test_memory_grows_with_the_saccades_and_no_faster(plant: str, tasks: dict[str, SaccadeTask]) -> None:
    few, many = (peak(performing(tasks[plant], n * COUNTS[plant])) for n in (1, 2))
    assert 1.5 * few < many < 2.5 * few


def test_a_saccade_in_closed_form_needs_a_tenth_of_a_sampled_ones_memory(tasks: dict[str, SaccadeTask]) -> None:
    """501 samples of at least 22 numbers each, against those that measure one."""
    closed, sampled = (peak(performing(tasks[name], 200)) / 200 for name in ("lpf", "tavares"))
    assert 88e3 < sampled < 1e6
    assert closed < 0.1 * sampled


def test_what_is_batched_needs_no_more_than_a_batch(tasks: dict[str, SaccadeTask]) -> None:
    task, count = tasks["tavares"], 200
    start, action, target = chosen(task, count)

    def by_batches() -> None:
        for first in range(0, count, 50):
            part = slice(first, first + 50)
            task.perform(start[part], action[part], target[part])

    assert peak(by_batches) < 0.5 * peak(performing(task, count))


@pytest.mark.parametrize("plant", ["tavares", "mujoco"])
def test_twice_the_horizon_takes_at_most_three_times_the_time(plant: str, tasks: dict[str, SaccadeTask]) -> None:
    moved = tasks[plant].plant
    command, start = still(COUNTS[plant], 2001)
    assert len(moved.motors) == 3
    short, long = least_cpu_s(*(lambda s=s: moved.move(command, start, s) for s in (1.0, 2.0)))
    assert long < 3 * short


def still(count: int, samples: int) -> tuple[Sampled, State]:
    """Motor 2 moves on a straight line from rest and stays."""
    positions = np.zeros((count, samples, 3))
    positions[:, :, 1] = np.minimum(np.arange(samples) * 0.1, 10)
    return Sampled(positions, 0.001), State(np.tile([1.0, 0, 0, 0], (count, 1)), np.zeros((count, 3)))


def test_the_compiled_plant_makes_at_least_three_times_mujocos_steps(tasks: dict[str, SaccadeTask]) -> None:
    """With a wide margin: how many times it is, docs/performance.md says."""
    command, start = still(30, 501)
    compiled, mujoco = least_cpu_s(
        *(lambda name=name: tasks[name].plant.move(command, start) for name in ("tavares", "mujoco"))
    )
    assert 3 * compiled < mujoco
