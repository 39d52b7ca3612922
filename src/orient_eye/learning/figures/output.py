"""What a policy puts out, against the size of the saccade, beside the searched optimum."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import tidy
from orient_eye.learning.evaluation import Yardstick, told_numbers, told_values
from orient_eye.learning.figures.saccades import (
    BEST,
    LEARNED,
    SIZES_DEG,
    Saccades,
    beside,
    mean_and_range,
    size_axis,
    titled,
)
from orient_eye.learning.policy import Policy
from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_LEAST_SHARE = 0.15  # of a number's range that a panel shows, at least where it is no position
_WIDE = 30.0  # largest over least value from which on a panel without bounds is logarithmic


def figure_5_1(
    policy: Policy, yardstick: Yardstick, table: Yardstick | None = None, only: Sequence[str] | None = None
) -> Figure:
    """The numbers of the action, and C where it varies, against saccade size: mean over starting points, and optimum.

    Thesis Figures 5.1, 5.5, 5.9, 5.10, 5.14, 5.18, 5.19. One row a driven motor.

    Args:
        policy: whose output it is.
        yardstick: saccades over the whole range.
        table: symmetric saccades, drawn apart on a plant that is not linear, where the starting point matters.
        only: symbols that are shown ("C"); None for all.
    """
    task = yardstick.task
    output = _Output.of(policy, yardstick)
    keys = [key for key in output.keys if only is None or key[1].split()[0] in only]
    motors = list(dict.fromkeys(motor for motor, _ in keys))
    rows = [[key for key in keys if key[0] == motor] for motor in motors]
    most = max(map(len, rows))
    figure = Figure(figsize=(max(4.6 * most, 7.0), 4.3 * len(rows)), layout="constrained")
    for motor, keys, panels in zip(motors, rows, figure.subplots(len(rows), most, squeeze=False), strict=True):
        for axes, key in zip(panels, keys, strict=False):
            output.draw(axes, key)
            if table is not None and task.plant.slow_pole is None:
                _draw_symmetric(axes, key, policy, table)
        for unused in panels[len(keys) :]:
            unused.set_visible(False)
        if len(motors) > 1:
            panels[0].set_title(motor, loc="left")
    beside(figure, *figure.axes[0].get_legend_handles_labels())
    return titled(figure, "Policy output against saccade size", policy, task)


def figure_5_25(policy: Policy, yardstick: Yardstick) -> Figure:
    """Energy of the command against saccade size, beside the optimum's (thesis Figure 5.25)."""
    figure = Figure(figsize=(7.5, 5), layout="constrained")
    axes = figure.subplots()
    draw_energy(axes, policy, yardstick)
    axes.set(ylabel="energy [deg$^2$/s]")
    axes.legend(frameon=False, loc="upper left")
    return titled(figure, "Energy against saccade size", policy, yardstick.task.plain)


def draw_energy(axes: "Axes", policy: Policy, yardstick: Yardstick) -> None:
    """Energy against size, of a policy and of the optimum."""
    task = yardstick.task.plain
    best = task.actions.command(yardstick.start, yardstick.target, yardstick.optimum.action).energy()
    axes.plot(yardstick.size_deg, best, ".", color=BEST, ms=6, label="searched optimum")
    every = Saccades.every_size(yardstick.task, policy)
    energy = task.actions.command(every.start, every.target, every.action).energy()
    mean_and_range(axes, every.size_deg, energy, LEARNED, "policy")
    size_axis(axes, task)
    axes.set_ylim(bottom=0)
    tidy(axes)


def draw_output(panels: "NDArray[Any]", policy: Policy, yardstick: Yardstick) -> None:
    """What the policy puts out, the first numbers of its action, a panel each."""
    output = _Output.of(policy, yardstick)
    for axes, key in zip(panels, output.keys, strict=False):
        output.draw(axes, key)
    panels[0].legend(frameon=False, fontsize="small")


Key = tuple[str, str]
"""Motor, and what it is of it: "B [1/s]"."""


@dataclass(frozen=True)
class _Output:
    """What a policy puts out for saccades of every size, and what is best."""

    yardstick: Yardstick
    best: dict[Key, Array]
    every: Saccades
    ours: dict[Key, Array]

    @classmethod
    def of(cls, policy: Policy, yardstick: Yardstick) -> "_Output":
        task, every = yardstick.task.plain, Saccades.every_size(yardstick.task, policy)
        best = _quantities(task, yardstick.start, yardstick.target, yardstick.optimum.action)
        return cls(yardstick, best, every, _quantities(task, every.start, every.target, every.action))

    @property
    def keys(self) -> list[Key]:
        return [key for key in self.best if key in self.ours]

    def draw(self, axes: "Axes", key: Key) -> None:
        """One quantity against the size."""
        size, task = self.yardstick.size_deg, self.yardstick.task.plain
        shown = size >= SIZES_DEG[0]  # where there is nothing to do, B, k0 and C may be anything
        axes.plot(size[shown], self.best[key][shown], ".", color=BEST, ms=6, label="searched optimum")
        values = self.ours[key]
        mean_and_range(axes, self.every.size_deg, values, LEARNED, "policy")
        size_axis(axes, task)
        number = next((told for told in told_numbers(task) if (told.motor, told.title) == key), None)
        axes.set(ylabel=f"|{number.label}| [{number.unit}]" if number and number.from_start else key[1])
        if number is None and values.min() > 0 and values.max() > _WIDE * values.min():
            axes.set_yscale("log")
        bounds = None if number is None or number.from_start else task.actions.numbers[number.index]
        if bounds is not None and not bounds.log:  # no drama in the second decimal
            low, high = axes.get_ylim()
            more = max(_LEAST_SHARE * (bounds.high - bounds.low) - (high - low), 0) / 2
            axes.set_ylim(low - more, high + more)
        tidy(axes)


def _draw_symmetric(axes: "Axes", key: Key, policy: Policy, table: Yardstick) -> None:
    """The same of saccades around straight ahead only."""
    task, shown = table.task.plain, Saccades.symmetric(table.task, policy, SIZES_DEG)
    best = _quantities(task, table.start, table.target, table.optimum.action)
    ours = _quantities(task, shown.start, shown.target, shown.action)
    axes.plot(shown.size_deg, ours[key], "--", color=LEARNED, lw=1.2, label="policy, symmetric")
    axes.plot(table.size_deg, best[key], "D", color=BEST, ms=6, mfc="none", label="searched optimum, symmetric")


def _quantities(task: SaccadeTask, start: State, target: Array, action: Array) -> dict[Key, Array]:
    """The numbers of actions, positions by how far they are from the start; and C, where it is not the same for all."""
    values, found = told_values(task, start, action), {}
    for number in told_numbers(task):
        column = values[:, number.index]
        found[number.motor, number.title] = np.abs(column) if number.from_start else column
    C = getattr(task.actions.command(start, target, action), "C", None)
    for i, motor in enumerate(task.plant.motors):
        if C is not None and np.ndim(C) and motor.name in {m for m, _ in found} and np.ptp(C[:, i]) > 0:
            found[motor.name, "C [1/s]"] = C[:, i]
    return found
