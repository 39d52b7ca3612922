"""Velocities of the gaze's components."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import tidy
from orient_eye.figures.gaze.style import HORIZONTAL, VERTICAL, end_ms, way
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import component_correlation, component_durations, end_of_shift, shift_velocity
from orient_eye.movement.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Made = tuple[Trajectory, Measures]


def component_velocities(trajectory: Trajectory, measures: Measures, alone: Sequence[Made] | None = None) -> Figure:
    """Velocities of the two components of a few saccades over time: whether they go together, and how long they take.

    Above in deg/s. Below as shares of each component's way, where components in step lie one upon the other; a
    component that is compared with nothing, being below 30 % of the other, is left out there.

    Args:
        trajectory: of the saccades, a column each.
        measures: of their gaze.
        alone: trajectory and measures of the horizontal parts made alone, and of the vertical ones, in the same order:
            drawn dashed; None leaves them out.
    """
    count = len(trajectory)
    figure = Figure(figsize=(1.2 + 3.4 * count, 6), layout="constrained")
    rows = figure.subplots(2, count, sharex=True, sharey="row", squeeze=False)
    end, correlation = end_of_shift(trajectory, measures), component_correlation(trajectory, measures)
    for i in range(count):
        _draw(rows[:, i], (trajectory, measures), i, {0: "horizontal", 1: "vertical"}, lw=1.6)
        if alone is not None:
            for k, made in enumerate(alone):
                _draw(rows[:, i], made, i, {k: ("horizontal alone", "vertical alone")[k]}, lw=1, ls="--")
        told = "" if np.isnan(correlation[i]) else f"\ncorrelation {correlation[i]:.3f}"
        rows[0, i].set_title(way(end[i]) + told, fontsize="medium")
        rows[0, i].legend(frameon=False, fontsize="small")
        rows[1, i].set_xlabel("time [ms]")
        for axes in rows[:, i]:
            axes.axhline(0, color="black", lw=0.6)
            tidy(axes)
    rows[0, 0].set_ylabel("velocity of the component [deg/s]")
    rows[1, 0].set_ylabel("velocity / way of the component [1/s]")
    rows[0, 0].set_xlim(0, end_ms(trajectory, measures))
    figure.suptitle("Components of the gaze; positive to the left and up")
    return figure


def _draw(panels: "Iterable[Axes]", made: Made, i: int, names: Mapping[int, str], **style: Any) -> None:
    """Named components of saccade i, above as they are and below as shares of their ways."""
    above, below = panels
    trajectory, measures = made[0][i], made[1][np.array([i])]
    velocity, end = shift_velocity(trajectory)[0], end_of_shift(trajectory, measures)[0]
    took = 1e3 * component_durations(trajectory, measures)[0]
    for k, name in names.items():
        compared, colour = np.isfinite(took[k]), (HORIZONTAL, VERTICAL)[k]
        label = f"{name}, {took[k]:.0f} ms" if compared else name
        above.plot(1e3 * trajectory.time, velocity[:, k], color=colour, label=label, **style)
        if compared:
            below.plot(1e3 * trajectory.time, velocity[:, k] / end[k], color=colour, **style)
