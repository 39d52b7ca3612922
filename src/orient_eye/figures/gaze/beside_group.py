"""The main sequence of a six-motor eye beside that of the group's published six-motor programs, and of people."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from orient_eye.figures import OTHER
from orient_eye.figures.gaze.human import beside_people
from orient_eye.figures.gaze.style import HORIZONTAL, VERTICAL, axial
from orient_eye.human import human_values, people
from orient_eye.listing import fit_plane
from orient_eye.movement.main_sequence import MainSequence, exponential, fit_main_sequence
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import end_of_shift, path_deviation
from orient_eye.movement.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Range = tuple[float, float]
_LEAST = 3  # saccades of a fit
_GROUP = "the group's programs"


@dataclass(frozen=True)
class Group:
    """What the group published of its six-motor eye under optimal control; ranges over its programs and papers.

    Attributes:
        V0: of V0 (1 - exp(-A / c)) [deg/s].
        c: the same [deg].
        D0_ms: of the duration D0 + d A [ms].
        d_ms: the same [ms/deg].
        end_error_deg: of the gaze.
        plane_sd_deg: of Listing's plane.
        curvature: of the paths, share of the amplitude.
    """

    V0: Range = (288, 337)
    c: Range = (12, 15)
    D0_ms: Range = (56, 58)
    d_ms: Range = (3.5, 3.5)
    end_error_deg: Range = (1.3, 1.9)
    plane_sd_deg: Range = (0.6, 1.0)
    curvature: Range = (0.009, 0.009)


GROUP = Group()
"""Source: the group's published six-motor programs and papers."""


def main_sequence_beside_group(
    every: tuple[Trajectory, Measures], random: tuple[Trajectory, Measures], error_deg: Array
) -> Figure:
    """Peak velocity and duration of horizontal and vertical saccades beside the group's and people's, and a table.

    Args:
        every: saccades of all sizes in all directions, and measures of their gaze.
        random: the saccades on which ends and paths are judged, and measures of their gaze.
        error_deg: of the gaze at rest of those, (saccades,).
    """
    figure = Figure(figsize=(13, 8.4), layout="constrained")
    (peak, duration), (below, _) = figure.subplots(2, 2, height_ratios=[3.2, 1])
    for axes in figure.axes[2:]:
        axes.set_axis_off()
    ours = axial_main_sequences(*every)
    largest = float(np.nanmax(every[1].amplitude_deg, initial=5.0))
    _draw_group(peak, duration, largest)
    for name, (fit, some) in ours.items():
        colour, marker = (HORIZONTAL, "o") if name == "horizontal" else (VERTICAL, "^")
        size = np.linspace(0, some.amplitude_deg.max(initial=0), 100)
        for axes, values in ((peak, some.peak_velocity_deg_s), (duration, 1e3 * some.settling_time_s)):
            axes.plot(some.amplitude_deg, values, marker, color=colour, mfc="none", ms=5, label=name)
        if fit is not None:
            peak.plot(size, fit.peak_velocity(size), color=colour, lw=1.2)
            duration.plot(size, fit.duration_ms(size), color=colour, lw=1.2)
    beside_people(peak, duration, largest)
    rows = {name: _fitted(fit) for name, (fit, _) in ours.items()}
    rows |= {
        _GROUP: [_told(GROUP.V0), _told(GROUP.c), _told(GROUP.D0_ms), _told(GROUP.d_ms, 1)],
        "people": _of_people(),
    }
    _table(figure, below, rows, _judged(*random, error_deg))
    figure.suptitle("Main sequence of the six-motor eye beside the group's and people's")
    return figure


def axial_main_sequences(trajectory: Trajectory, measures: Measures) -> dict[str, tuple[MainSequence | None, Measures]]:
    """Main sequences of horizontal and of vertical saccades; None of fewer than three.

    Args:
        trajectory: of the saccades.
        measures: of their gaze.
    """
    end = end_of_shift(trajectory, measures)
    usable = np.isfinite(end).all(axis=1) & measures.settled & (measures.amplitude_deg > 0)
    found: dict[str, tuple[MainSequence | None, Measures]] = {}
    for name, chosen in zip(("horizontal", "vertical"), axial(end), strict=True):
        some = measures[chosen & usable]
        numbers = some.amplitude_deg, some.peak_velocity_deg_s, some.settling_time_s
        found[name] = (fit_main_sequence(*numbers) if len(some.amplitude_deg) >= _LEAST else None, some)
    return found


def _draw_group(peak: "Axes", duration: "Axes", largest: float) -> None:
    """What lies between the group's numbers."""
    size = np.linspace(0, largest, 100)
    curves = np.array([exponential(size, V0, c) for V0 in GROUP.V0 for c in GROUP.c])
    peak.fill_between(size, curves.min(axis=0), curves.max(axis=0), color=OTHER, alpha=0.25, lw=0, label=_GROUP)
    low, high = (D0 + d * size for D0, d in zip(GROUP.D0_ms, GROUP.d_ms, strict=True))
    duration.fill_between(size, low, high, color=OTHER, alpha=0.6, lw=1.5, label=_GROUP)


def _judged(trajectory: Trajectory, measures: Measures, error_deg: Array) -> dict[str, list[str]]:
    """Of the ends and the paths: error, Listing's plane, curvature, ours and the group's."""
    bend = 100 * float(np.nanmedian(path_deviation(trajectory, measures)))
    ours = [f"{np.nanmean(error_deg):.2f}", f"{fit_plane(measures.final).sd_deg:.2f}", f"{bend:.1f}"]
    bent = (100 * GROUP.curvature[0], 100 * GROUP.curvature[1])
    return {"ours": ours, _GROUP: [_told(each, 1) for each in (GROUP.end_error_deg, GROUP.plane_sd_deg, bent)]}


def _fitted(fit: MainSequence | None) -> list[str]:
    if fit is None:
        return ["-"] * 4
    return [f"{fit.V0:.0f}", f"{fit.c:.1f}", f"{fit.D0_ms:.0f}", f"{fit.d_ms:.1f}"]


def _of_people() -> list[str]:
    human = people()
    D0, d = (human_values(f"duration_{name}")[0].value for name in ("intercept", "slope"))
    return [f"{human.V0:.0f}", f"{human.c:.1f}", f"{D0:.0f}", f"{d:.1f}"]


def _told(between: Range, decimals: int = 0) -> str:
    low, high = (f"{value:.{decimals}f}" for value in between)
    return low if low == high else f"{low} to {high}"


def _table(figure: Figure, left: "Axes", rows: dict[str, list[str]], ends: dict[str, list[str]]) -> None:
    """Two tables below the panels."""
    right = figure.axes[3]
    columns = ["V0 [deg/s]", "c [deg]", "D0 [ms]", "d [ms/deg]"]
    of_ends = ["error at rest [deg]", "sd of Listing's plane [deg]", "path curvature [%]"]
    place = Bbox.from_bounds(0.22, 0, 0.78, 1)
    for axes, told, heads in ((left, rows, columns), (right, ends, of_ends)):
        table = axes.table(cellText=list(told.values()), rowLabels=list(told), colLabels=heads, bbox=place, edges="B")
        table.auto_set_font_size(False)
        table.set_fontsize(9)
