"""The reward around the best action of one saccade."""

import textwrap

import numpy as np
from matplotlib.figure import Figure

from orient_eye.figures import tidy
from orient_eye.learning.evaluation import Yardstick, told_numbers, told_values
from orient_eye.learning.figures.saccades import BEST, LEARNED, THIRD, beside, titled
from orient_eye.learning.policy import Policy

_POINTS = 351
_FLOOR = 1e-4  # of the best cost: what is less does not matter, but accuracy, which is well satisfied, is seen
_TERMS = (THIRD, "#e09f3e", "#7d5ba6", "#6c757d", "#b56576", "#355070")


def figure_5_24(policy: Policy, table: Yardstick, amplitude_deg: float = 30.0) -> Figure:
    """The reward of one saccade against k0, the other numbers held at the searched optimum's (thesis Figure 5.24).

    Of several motors: against that of the motor that goes farthest. Of an action without k0: against the first number
    that has a cliff, or else the last one.

    Args:
        policy: its own action is marked.
        table: symmetric saccades of several amplitudes.
        amplitude_deg: which of them; the nearest is taken.
    """
    task, numbers = table.task.plain, table.task.actions.plain.numbers
    which = int(np.abs(table.size_deg - amplitude_deg).round(6).argmin())
    one = table[which : which + 1]
    best = one.optimum.action
    varied = _varied(one)
    rows = np.zeros(_POINTS, int)
    scaled = np.zeros((_POINTS, len(numbers)))
    scaled[:, varied] = np.linspace(-1, 1, _POINTS)
    action = best[rows].copy()
    action[:, varied] = task.actions.from_unit(scaled)[:, varied]
    found = task.perform(one.start[rows], action, one.target[rows]).reward
    told, outcome, _ = one.perform(policy.act)
    learned = one.plain(told)
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots()
    floor = _FLOOR * float(-one.optimum.reward[0])
    for i, (name, values) in enumerate(found.terms.items()):
        cost = -task.weights[name] * values
        if cost.max() > floor:
            shown = np.where(cost > 0, cost, np.nan)
            axes.plot(action[:, varied], shown, "--", lw=1.1, color=_TERMS[i % len(_TERMS)], label=name)
    axes.plot(action[:, varied], -found.total, color="black", lw=1.8, label="total")
    axes.plot(best[0, varied], -one.optimum.reward[0], "D", color=BEST, ms=7, label="searched optimum")
    axes.plot(
        learned[0, varied], -outcome.reward.total[0], "o", color=LEARNED, ms=7, label="policy (its own other numbers)"
    )
    names = task.actions.names
    axes.set(yscale="log", ylabel="cost: - weighted reward", ylim=(floor, None))
    axes.set(xlabel=f"{names[varied]} [{numbers[varied].unit}]")
    held = ", ".join(
        f"{name} = {best[0, i].round(9):.4g} {numbers[i].unit}" for i, name in enumerate(names) if i != varied
    )
    way = "" if one.ways is None else f" {one.ways[0]}"
    axes.set_title(textwrap.fill(f"saccade of {one.size_deg[0]:.4g} deg{way}; {held}", 90), fontsize="medium")
    beside(figure, *axes.get_legend_handles_labels())
    tidy(axes)
    return titled(figure, f"Reward against {names[varied]}", policy, task)


def _varied(one: Yardstick) -> int:
    """Which number of the action of one saccade, among those with a cliff, is varied."""
    numbers = one.task.actions.plain.numbers
    goes = np.abs(told_values(one.task, one.start, one.optimum.action)[0])
    far = {told.motor: float(goes[told.index]) for told in told_numbers(one.task) if told.from_start}
    cliffs = [i for i, number in enumerate(numbers) if number.cliff]
    return max(cliffs, key=lambda i: far.get(numbers[i].motor, 0.0), default=len(numbers) - 1)
