"""A policy held against the best action any search finds: the reward gap.

The gap of a saccade is (R* - R) / |R*|, with R* the reward of the searched optimum.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.learning.directions import in_all_directions, opposite, size_deg, way_in_words
from orient_eye.search.optimum import Optimum
from orient_eye.search.optimum_cache import searched_optimum, task_key
from orient_eye.search.optimum_file import NAME, Found, write_optimum
from orient_eye.state import State
from orient_eye.task.saccade import Outcome, SaccadeTask
from orient_eye.task.targets import Targets

Array = NDArray[np.float64]
Act = Callable[[Array, Array], Array]
"""From starts and targets (saccades, 4) to actions in units (saccades, numbers)."""
TABLE_AMPLITUDES_DEG = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0)
"""Amplitudes of the table at the end of a run; symmetric saccades."""
TABLE_IN_ALL_DIRECTIONS = (5.0, 10.0, 30.0), (0.0, 45.0, 90.0)
"""Amplitudes of the table in all directions, and whereto: 0 left, 90 deg up."""
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
        optimum: best actions of the plain task (`SaccadeTask.plain`) and rewards found.
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
        found = searched_optimum(task, start, target, progress=progress, carried=carried)
        return cls(task, start, target, found)

    def __getitem__(self, which: slice) -> "Yardstick":
        optimum = Optimum(self.optimum.action[which], self.optimum.reward[which], self.optimum.evaluations)
        return Yardstick(self.task, self.start[which], self.target[which], optimum)

    @property
    def size_deg(self) -> Array:
        """Angle from start to target, or where saccades go in all directions that of their gaze, (saccades,)."""
        return size_deg(self.task, self.start.orientation, self.target)

    @property
    def ways(self) -> list[str] | None:
        """Whereto saccades go in words; None where they all go about one axis."""
        return way_in_words(self.start.orientation, self.target) if in_all_directions(self.task) else None

    @property
    def titles(self) -> list[str]:
        """Of the saccades in a recording: "30 deg", and whereto in all directions."""
        ways = self.ways or [""] * len(self.target)
        return [f"{size:g} deg {way}".rstrip() for size, way in zip(self.size_deg.round(6), ways, strict=True)]

    def plain(self, action: Array) -> Array:
        """Actions (saccades, numbers) told as those of the plain task."""
        return self.task.actions.as_plain(self.start, self.target, action)

    def bettered(self, act: Act) -> "Yardstick":
        """With the actions of a policy where the search has missed better ones: of several motors it sometimes does."""
        action, outcome, gap = self.perform(act)
        wins = gap < 0
        best = np.where(wins[:, None], self.plain(action), self.optimum.action)
        reward = np.where(wins, outcome.reward.total, self.optimum.reward)
        return replace(self, optimum=replace(self.optimum, action=best, reward=reward))

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

    In all directions those of the table go to the left, up, and obliquely.

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
    sizes, around = TABLE_IN_ALL_DIRECTIONS if in_all_directions(task) else (TABLE_AMPLITUDES_DEG, None)
    angles = _symmetric(targets, np.array(sizes), around)
    if not len(angles[0]):
        angles = _symmetric(targets, np.array([2 * targets.limit_deg]), around)
    low, high = map(targets.orientation, angles)
    start = targets.rest(np.concatenate([start.orientation, low]))
    both = Yardstick.search(task, start, np.concatenate([target, high]), progress, carried)
    return both[:count], both[count:]


def _symmetric(targets: Targets, sizes: Array, around_deg: Sequence[float] | None) -> tuple[Array, Array]:
    """Angles of starts and targets of every size that the range holds, in every direction where there are several."""
    if around_deg is None:
        return targets.symmetric(sizes)
    around, size = np.meshgrid(around_deg, sizes[sizes <= 2 * targets.limit_deg], indexing="ij")
    return opposite(targets, size.ravel(), around.ravel())


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
    units, actions = {motor.name: motor.unit for motor in task.plant.motors}, task.actions.plain
    several = len({number.motor for number in actions.numbers}) > 1
    told = []
    for i, (name, number) in enumerate(zip(actions.names, actions.numbers, strict=True)):
        position = units.get(number.motor) == number.unit
        step = f"step_{number.motor}_{number.unit}" if several else f"step_{number.unit}"
        label = f"{number.symbol} - F" if position else number.symbol
        told.append(Told(step if position else name, label, number.unit, number.motor, position, i))
    return tuple(told)


def told_values(task: SaccadeTask, start: State, action: Array) -> Array:
    """Actions of the plain task (saccades, numbers) as `told_numbers` tells them."""
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
    off = np.abs(yardstick.plain(action) - yardstick.optimum.action)[large]
    names = yardstick.task.actions.plain.names
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


def amplitude_table(yardstick: Yardstick, act: Act) -> list[dict[str, Any]]:
    """One row a saccade: amplitude, the numbers of the learned and of the best action, rewards, gap and measures.

    The numbers stand under their keys (`told_numbers`), the best ones under KEY_best; in all directions `direction`
    says whereto the saccade goes.
    """
    task = yardstick.task
    action, outcome, gap = yardstick.perform(act)
    measures = outcome.measures
    ours, best = (told_values(task, yardstick.start, a) for a in (yardstick.plain(action), yardstick.optimum.action))
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
    told = [{}] * len(gap) if yardstick.ways is None else [{"direction": way} for way in yardstick.ways]
    return [{**told[i], **{name: float(values[i]) for name, values in columns.items()}} for i in range(len(gap))]
