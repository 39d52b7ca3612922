"""A policy held against the best action any search finds: the reward gap.

The gap of a saccade is (R* - R) / |R*|, with R* the reward of the searched optimum.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.search.optimum import Optimum
from orient_eye.search.optimum_cache import searched_optimum, task_key
from orient_eye.search.optimum_file import NAME, Found, write_optimum
from orient_eye.state import State
from orient_eye.task.saccade import Outcome, SaccadeTask

Array = NDArray[np.float64]
Act = Callable[[Array, Array], Array]
"""From starts and targets (saccades, 4) to actions in units (saccades, numbers)."""
TABLE_AMPLITUDES_DEG = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0)
"""Amplitudes of the table at the end of a run; symmetric saccades."""
LARGE_DEG = 5.0
"""Above this size the distance from the best action is told: of smaller ones B and k0 hardly matter."""
_SEED = 2021


@dataclass(frozen=True)
class Yardstick:
    """Saccades whose optimum is known.

    Attributes:
        task: plant, actions and reward.
        start: of the eyes, of (saccades,).
        target: desired orientations, (saccades, 4).
        optimum: best actions and rewards found.
    """

    task: SaccadeTask
    start: State
    target: Array
    optimum: Optimum

    @classmethod
    def search(
        cls,
        task: SaccadeTask,
        start: State,
        target: Array,
        progress: Callable[[float], None] | None = None,
        carried: Path | None = None,
    ) -> "Yardstick":
        """Take the optimum of saccades from a file that travels, remember it, or search it."""
        return cls(task, start, target, searched_optimum(task, start, target, progress=progress, carried=carried))

    def __getitem__(self, which: slice) -> "Yardstick":
        optimum = Optimum(self.optimum.action[which], self.optimum.reward[which], self.optimum.evaluations)
        return Yardstick(self.task, self.start[which], self.target[which], optimum)

    @property
    def size_deg(self) -> Array:
        """Angle from start to target, (saccades,)."""
        return rotations.angle_between(self.start.orientation, self.target)

    def perform(self, act: Act) -> tuple[Array, Outcome, Array]:
        """The policy's actions (saccades, numbers), what came of them, and the gaps (saccades,)."""
        action = act(self.start.orientation, self.target)
        outcome = self.task.perform(self.start, action, self.target)
        gap = (self.optimum.reward - outcome.reward.total) / np.abs(self.optimum.reward)
        return action, outcome, gap


def evaluation_saccades(
    task: SaccadeTask,
    count: int,
    progress: Callable[[float], None] | None = None,
    carried: Path | None = None,
) -> tuple[Yardstick, Yardstick]:
    """Random saccades over the whole range, and symmetric ones of the table's amplitudes, as far as the range goes.

    They depend on nothing but the targets and their number, so that runs can be compared and their optimum is
    searched once. Fewer than are usual on the plant are the first of those.

    Args:
        task: plant, command and reward.
        count: of the random ones.
        progress: called with the share of a search that is done, where one is needed.
        carried: file with an optimum that travels with a policy, where there is one.
    """
    targets = task.targets
    start, target = targets.draw(max(count, task.plant.evaluation_pairs), np.random.default_rng(_SEED))
    start, target = start[:count], target[:count]
    angles = targets.symmetric(np.array(TABLE_AMPLITUDES_DEG))
    if not len(angles[0]):
        angles = targets.symmetric(np.array([2 * targets.limit_deg]))
    low, high = map(targets.orientation, angles)
    start = targets.rest(np.concatenate([start.orientation, low]))
    both = Yardstick.search(task, start, np.concatenate([target, high]), progress, carried)
    return both[:count], both[count:]


def carry_optimum(pairs: Yardstick, table: Yardstick, folder: Path) -> Path:
    """Write the optimum of evaluation saccades beside a policy, with which it travels; returns the file."""
    starts = [np.concatenate(part) for part in zip(*(_parts(y.start) for y in (pairs, table)), strict=True)]
    action, reward, target = (
        np.concatenate(part)
        for part in zip(*((y.optimum.action, y.optimum.reward, y.target) for y in (pairs, table)), strict=True)
    )
    optimum = Optimum(action, reward, pairs.optimum.evaluations)
    return write_optimum(folder / NAME, Found(task_key(pairs.task), State(*starts), target, optimum))


def _parts(state: State) -> tuple[Array, Array, Array]:
    return state.orientation, state.motor, state.angular_velocity


@dataclass(frozen=True)
class Told:
    """A number of an action as tables and pictures tell it: a position from where its motor starts, D - F for D.

    Attributes:
        key: for tables: "B", "step_deg"; of several motors "B_motor1", "step_motor1_deg".
        label: for people: "B", "D - F".
        unit: "1/s".
        motor: that it commands; "" for several.
        from_start: whether it is told from where the motor starts.
        index: among the action's numbers.
    """

    key: str
    label: str
    unit: str
    motor: str
    from_start: bool
    index: int

    @property
    def title(self) -> str:
        """Label with unit."""
        return f"{self.label} [{self.unit}]"


def told_numbers(task: SaccadeTask) -> tuple[Told, ...]:
    """How the numbers of a task's actions are told."""
    units = {motor.name: motor.unit for motor in task.plant.motors}
    several = len({number.motor for number in task.actions.numbers}) > 1
    told = []
    for i, (name, number) in enumerate(zip(task.actions.names, task.actions.numbers, strict=True)):
        position = units.get(number.motor) == number.unit
        step = f"step_{number.motor}_{number.unit}" if several else f"step_{number.unit}"
        label = f"{number.symbol} - F" if position else number.symbol
        told.append(Told(step if position else name, label, number.unit, number.motor, position, i))
    return tuple(told)


def told_values(task: SaccadeTask, start: State, action: Array) -> Array:
    """Actions (saccades, numbers) as `told_numbers` tells them."""
    values = action.copy()
    column = {motor.name: i for i, motor in enumerate(task.plant.motors)}
    for told in told_numbers(task):
        if told.from_start:
            values[:, told.index] -= start.motor[:, column[told.motor]]
    return values


def gap_summary(yardstick: Yardstick, action: Array, outcome: Outcome, gap: Array) -> dict[str, Any]:
    """How far a policy's saccades are from the optimum, in plain values.

    Args:
        yardstick: the saccades.
        action: what the policy chose, as `Yardstick.perform` returns it.
        outcome: what came of it.
        gap: the gaps.

    Returns:
        The gaps; how far the action's numbers are from the best ones, by name; and `numbers`, how they are told in
        `amplitude_table`: key, label and unit of each.
    """
    large = yardstick.size_deg > LARGE_DEG
    off = np.abs(action - yardstick.optimum.action)[large]
    names = yardstick.task.actions.names
    return {
        "pairs": len(gap),
        "gap_mean": float(gap.mean()),
        "gap_p95": float(np.quantile(gap, 0.95)),
        "gap_max": float(gap.max()),
        "reward_mean": float(outcome.reward.total.mean()),
        "distance_from_optimum_above_5_deg": dict(
            zip(names, off.mean(axis=0).tolist() if large.any() else [None] * len(names), strict=True)
        ),
        "numbers": [{"key": n.key, "label": n.label, "unit": n.unit} for n in told_numbers(yardstick.task)],
    }


def amplitude_table(yardstick: Yardstick, act: Act) -> list[dict[str, float]]:
    """One row a saccade: amplitude, the numbers of the learned and of the best action, rewards, gap and measures.

    The numbers stand under their keys (`told_numbers`), the best ones under KEY_best.
    """
    task = yardstick.task
    action, outcome, gap = yardstick.perform(act)
    measures = outcome.measures
    ours, best = (told_values(task, yardstick.start, a) for a in (action, yardstick.optimum.action))
    columns: dict[str, Array] = {"amplitude_deg": yardstick.size_deg.round(9)}
    for number in told_numbers(task):
        columns |= {number.key: ours[:, number.index], f"{number.key}_best": best[:, number.index]}
    columns |= {
        "reward": outcome.reward.total,
        "reward_best": yardstick.optimum.reward,
        "gap": gap,
        "duration_ms": 1e3 * measures.settling_time_s,
        "peak_velocity_deg_s": measures.peak_velocity_deg_s,
        "skewness": measures.skewness,
        "overshoot": measures.overshoot,
    }
    return [{name: float(values[i]) for name, values in columns.items()} for i in range(len(gap))]
