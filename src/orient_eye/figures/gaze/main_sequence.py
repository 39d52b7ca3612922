"""Main sequence by direction."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures.gaze.human import beside_people
from orient_eye.figures.gaze.style import HORIZONTAL, OBLIQUE, VERTICAL, axial
from orient_eye.movement.main_sequence import fit_peak_velocity
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import end_of_shift
from orient_eye.movement.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_LEAST = 3  # saccades through which a line is drawn


def main_sequence(trajectory: Trajectory, measures: Measures) -> Figure:
    """Peak velocity and duration against amplitude, apart by direction, beside people.

    Within 15 deg of the horizontal or the vertical a saccade counts as one of that direction. A line is drawn through
    three saccades of a direction and more. Where peak velocity does not saturate among them (c beyond the largest), V0
    means nothing, and the slope V0 / c is written.

    A human saccade ends where its speed falls below a threshold, ours where the gaze stays within the settling band,
    which is later.

    Args:
        trajectory: of the saccades.
        measures: of their gaze.
    """
    figure = Figure(figsize=(12.5, 6.2), layout="constrained")
    peak, duration = figure.subplots(1, 2)
    end = end_of_shift(trajectory, measures)
    usable = np.isfinite(end).all(axis=1) & measures.settled & (measures.amplitude_deg > 0)
    horizontal, vertical = axial(end)
    directions: tuple[tuple[str, dict[str, Any], NDArray[np.bool_]], ...] = (
        ("horizontal", {"color": HORIZONTAL, "marker": "o"}, horizontal),
        ("vertical", {"color": VERTICAL, "marker": "^"}, vertical),
        ("oblique", {"color": OBLIQUE, "marker": "x"}, ~(horizontal | vertical)),
    )
    largest = float(np.max(measures.amplitude_deg, where=usable, initial=5.0))
    for name, style, chosen in directions:
        some = measures[chosen & usable]
        _draw_peak(peak, some, name, style)
        _draw_duration(duration, some, name, style)
    beside_people(peak, duration, largest)
    figure.suptitle("Main sequence by direction")
    return figure


def _draw_peak(axes: "Axes", some: Measures, name: str, style: dict[str, Any]) -> None:
    amplitude, peak = some.amplitude_deg, some.peak_velocity_deg_s
    if len(peak) >= _LEAST:
        V0, c = fit_peak_velocity(amplitude, peak)
        reached = c < amplitude.max()
        told = f"$V_0$ = {V0:.0f} deg/s, c = {c:.1f} deg" if reached else f"{V0 / c:.1f} deg/s a deg, no saturation"
        size = np.linspace(0, amplitude.max(), 100)
        axes.plot(size, -V0 * np.expm1(-size / c), color=style["color"], lw=1.2)
        name = f"{name}: {told}"
    if len(peak):
        axes.plot(amplitude, peak, ls="", mfc="none", ms=5, label=name, **style)


def _draw_duration(axes: "Axes", some: Measures, name: str, style: dict[str, Any]) -> None:
    amplitude, duration = some.amplitude_deg, 1e3 * some.settling_time_s
    if len(duration) >= _LEAST:
        slope, intercept = np.polyfit(amplitude, duration, 1)
        size = np.array([0, amplitude.max()])
        axes.plot(size, intercept + slope * size, color=style["color"], lw=1.2)
        name = f"{name}: {intercept:.0f} ms + {slope:.1f} ms/deg"
    if len(duration):
        axes.plot(amplitude, duration, ls="", mfc="none", ms=5, label=name, **style)
