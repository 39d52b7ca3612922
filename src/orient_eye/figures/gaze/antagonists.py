"""Muscles that pull against each other, over time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from orient_eye.figures import tidy
from orient_eye.figures.gaze.style import end_ms, palette, way
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import end_of_shift
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
Pairs = NDArray[np.intp]


def antagonists_over_time(
    trajectory: Trajectory, measures: Measures, pairs: Pairs, correlation: Sequence[float] | None = None
) -> Figure:
    """Angles and tensions of antagonists over time, and what two share and what parts them.

    Two antagonists have one colour. The agonist of a saccade is the one whose tension grows against that of the other,
    where they are the farthest apart before it settles; it is drawn solid. Below stands the mean of their tensions, the
    co-contraction, solid, beside half the difference, agonist less antagonist, the reciprocal part, dashed.

    Args:
        trajectory: of the saccades, a column each; of an eye whose motors wind up a cable each, in their order.
        measures: of their gaze.
        pairs: of antagonists, indices among the motors, (pairs, 2).
        correlation: of the changes of antagonists (`antagonist_correlation`), (pairs,), to be told; None for nothing.
    """
    assert trajectory.tension is not None
    time, names, unit = 1e3 * trajectory.time, trajectory.motor_names, trajectory.motors[0].unit
    figure = Figure(figsize=(1.6 + 4.2 * len(trajectory), 10.5), layout="constrained")
    rows = figure.subplots(3, len(trajectory), sharex=True, sharey="row", squeeze=False)
    until = trajectory.time <= measures.settling_time_s[:, None]
    for column, end, motor, tension, inside in zip(
        rows.T, end_of_shift(trajectory, measures), trajectory.motor, trajectory.tension, until, strict=True
    ):
        angle, pull, parts = column
        for (one, other), colour in zip(pairs.tolist(), palette(len(pairs)), strict=True):
            apart = (tension[:, one] - tension[:, other])[inside]
            apart = apart - apart[0]
            agonist, antagonist = (one, other) if apart[np.abs(apart).argmax()] >= 0 else (other, one)
            label = f"{names[agonist]} (dashed {names[antagonist]})"
            for axes, values in ((angle, motor), (pull, tension)):
                axes.plot(time, values[:, agonist], color=colour, lw=1.6, label=label)
                axes.plot(time, values[:, antagonist], color=colour, lw=1.3, ls="--")
            mean, half = (tension[:, agonist] + sign * tension[:, antagonist] for sign in (1, -1))
            parts.plot(time, mean / 2, color=colour, lw=1.6)
            parts.plot(time, half / 2, color=colour, lw=1.3, ls="--")
        angle.set_title(way(end), fontsize="medium")
        angle.legend(frameon=False, fontsize="small", title="agonist", title_fontsize="small")
        parts.set_xlabel("time [ms]")
        for axes in column:
            tidy(axes)
    for axes, label in zip(rows[:, 0], (f"motor [{unit}]", "tension [N]", "parts of the tension [N]"), strict=True):
        axes.set_ylabel(label)
    rows[0, 0].set_xlim(0, end_ms(trajectory, measures))
    kinds = (("co-contraction: mean of two antagonists", "-"), ("reciprocal part: half their difference", "--"))
    figure.legend(
        [Line2D([], [], color="0.3", ls=dashes) for _, dashes in kinds],
        [words for words, _ in kinds],
        loc="outside lower center",
        ncols=2,
        frameon=False,
        fontsize="small",
    )
    told = ""
    if correlation is not None:
        each = (f"{'/'.join(names[i] for i in pair)} {r:.3f}" for pair, r in zip(pairs, correlation, strict=True))
        told = f"\ncorrelation of their motors' changes over all evaluation saccades: {', '.join(each)}"
    figure.suptitle(f"Agonists and antagonists{told}")
    return figure
