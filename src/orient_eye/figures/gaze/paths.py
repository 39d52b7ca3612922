"""Paths of the gaze."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.figures.gaze.style import colours
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import gaze_components, path_deviation, seen_from
from orient_eye.movement.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_RING_DEG = 10


def gaze_paths(trajectory: Trajectory, measures: Measures, target: Array | None = None) -> Figure:
    """Paths of the gaze beside the great circles from start to end, and how far they deviate.

    Args:
        trajectory: of the saccades, one colour each.
        measures: of their gaze.
        target: where they were to go, orientations (saccades, 4) whose gaze counts; None leaves the marks out.
    """
    figure = Figure(figsize=(7.2, 7.4), layout="constrained")
    axes = figure.subplots()
    draw_paths(axes, trajectory, measures, target)
    deviation = 100 * path_deviation(trajectory, measures)
    known = deviation[np.isfinite(deviation)]
    words = f": median {np.median(known):.1f} %, largest {known.max():.1f} % of the amplitude" if known.size else ""
    axes.set_title(f"Deviation from the straight path{words}", fontsize="medium")
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize="small"
    )
    return figure


def draw_paths(axes: "Axes", trajectory: Trajectory, measures: Measures, target: Array | None = None) -> None:
    """Paths, starts, targets and great circles in one panel, as the eye sees them, over circles of eccentricity."""
    path, end = gaze_components(trajectory), seen_from(rotations.gaze(measures.final))
    every = [path.reshape(-1, 2), end]
    if target is not None:
        aim = seen_from(rotations.gaze(target))
        every.append(aim)
        axes.plot(*aim.T, "+", color="black", ms=11, mew=1.3, label="target", zorder=4)
    for colour, saccade, straight in zip(colours(len(path)), path, _straight(trajectory, measures), strict=True):
        axes.plot(*straight.T, color="0.55", lw=0.9, ls=(0, (4, 3)), zorder=2)
        axes.plot(*saccade.T, color=colour, lw=1.7, zorder=3)
    axes.plot([], [], color="0.55", lw=0.9, ls=(0, (4, 3)), label="great circle from start to end")
    axes.plot([], [], color=colours(1)[0], lw=1.7, label="path of the gaze")
    axes.plot(*path[:, 0].T, "o", color="black", mfc="white", ms=6, label="start", zorder=4)
    axes.plot(*end.T, "o", color="black", ms=3, label="end", zorder=5)
    _draw_rings(axes, float(np.nanmax(np.linalg.norm(np.concatenate(every), axis=-1), initial=1.0)))


def _draw_rings(axes: "Axes", eccentricity_deg: float) -> None:
    """Circles of eccentricity all 10 deg, and axes of one scale with equal ticks, left on the left."""
    count = int(np.ceil(round(eccentricity_deg, 6) / _RING_DEG))
    limit = _RING_DEG * count + 1
    for ring in range(1, count + 1):
        axes.add_patch(Circle((0, 0), _RING_DEG * ring, fill=False, color="0.85", lw=0.8, zorder=1))
    axes.axhline(0, color="0.85", lw=0.8, zorder=1)
    axes.axvline(0, color="0.85", lw=0.8, zorder=1)
    axes.set(
        xlim=(limit, -limit), ylim=(-limit, limit), aspect="equal", xlabel="gaze to the left [deg], as the eye sees it",
        ylabel="gaze up [deg]",
    )  # fmt: skip
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(_RING_DEG))
    axes.spines[["top", "right"]].set_visible(False)


def _straight(trajectory: Trajectory, measures: Measures) -> Array:
    """Great circles from start to end, left and up of straight ahead [deg], (saccades, points, 2)."""
    start, end = rotations.gaze(trajectory.orientation[:, 0]), rotations.gaze(measures.final)
    share = np.linspace(0, 1, 33)[:, None]
    angle = np.deg2rad(rotations.angle_between_directions(start, end))[:, None, None]
    between = start[:, None] * np.sinc((1 - share) * angle / np.pi) * (1 - share)
    between += end[:, None] * np.sinc(share * angle / np.pi) * share
    return seen_from(between / np.linalg.norm(between, axis=-1, keepdims=True))
