"""What the pictures of saccades in all directions have in common."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

from orient_eye.figures import DATA, MODEL, OTHER
from orient_eye.movement.measures import Measures
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
HORIZONTAL, VERTICAL, OBLIQUE, HUMAN = DATA, MODEL, OTHER, "#8a8a8a"
_LINGER = 1.25  # of the longest duration is shown
_AXIAL_DEG = 15.0  # from an axis: nearer to it a saccade is no oblique one


def colours(count: int) -> list[tuple[float, float, float, float]]:
    """One for each of some saccades, in order."""
    return [colormaps["viridis"](x) for x in np.linspace(0.05, 0.9, count)]


def end_ms(trajectory: Trajectory, measures: Measures) -> float:
    """Until when pictures over time go [ms]: a little beyond the last settling time, where there are samples."""
    last = _LINGER * np.nanmax(measures.settling_time_s, initial=0.02)
    return float(1e3 * min(last, trajectory.time[-1]))


def way(end: Array) -> str:
    """A shift of the gaze (left, up) [deg] in words."""
    parts = ((end[0], "left", "right"), (end[1], "up", "down"))
    told = [f"{abs(size):.1f} {one if size > 0 else other}" for size, one, other in parts if abs(size) >= 0.05]
    return ", ".join(told) + " [deg]" if told else "no shift"


def axial(shift: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which shifts of the gaze (n, 2), left and up, are horizontal, and which vertical, (n,) each."""
    angle = np.rad2deg(np.arctan2(np.abs(shift[:, 1]), np.abs(shift[:, 0])))
    return angle <= _AXIAL_DEG, angle >= 90 - _AXIAL_DEG


def palette(count: int) -> list[Any]:
    """A colour for each motor or elastic."""
    return [DATA, MODEL, OTHER][:count] if count <= 3 else [colormaps["tab10"](k % 10) for k in range(count)]
