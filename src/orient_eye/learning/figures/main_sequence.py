"""Peak velocity, duration and skewness of saccades, beside those of people."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import tidy
from orient_eye.human import human_values, studies
from orient_eye.learning.figures.saccades import (
    HUMAN,
    LEARNED,
    SHOWN_DEG,
    THIRD,
    Saccades,
    draw_speed,
    mean_and_range,
    size_axis,
    titled,
)
from orient_eye.learning.policy import Policy
from orient_eye.task.saccade import SaccadeTask

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def figure_5_4(policy: Policy, task: SaccadeTask) -> Figure:
    """Main sequence and velocity profiles, beside human saccades (thesis Figures 5.4, 5.8, 5.13, ...).

    A human saccade ends where its speed falls below a threshold, ours where the eye stays within the
    settling band, which is later.
    """
    figure = Figure(figsize=(13, 8.4), layout="constrained")
    (peak, profiles), (duration, skewness) = figure.subplots(2, 2)
    every = Saccades.every_size(task, policy)
    measures = every.outcome.measures
    mean_and_range(peak, every.size_deg, measures.peak_velocity_deg_s, LEARNED, "policy")
    mean_and_range(duration, every.size_deg, 1e3 * measures.settling_time_s, LEARNED, "policy")
    order = measures.settling_time_s.argsort()
    skewness.plot(
        1e3 * measures.settling_time_s[order], measures.skewness[order], ".", ms=3, color=LEARNED, label="policy"
    )
    largest_deg = 2 * task.targets.limit_deg
    _draw_human(peak, duration, skewness, largest_deg)
    draw_speed(profiles, Saccades.symmetric(task, policy, SHOWN_DEG))
    profiles.set_title("velocity profiles")
    peak.set(ylabel="peak velocity [deg/s]", title="main sequence")
    duration.set(ylabel="duration [ms]")
    skewness.set(xlabel="duration [ms]", ylabel="skewness: deceleration time / duration", ylim=(0.4, 1))
    for axes in (peak, duration):
        size_axis(axes, task)
        axes.set_ylim(bottom=0)
        axes.legend(frameon=False, fontsize="small")
    skewness.legend(
        frameon=False, fontsize="small", title="durations of people: 21 ms + 2.2 ms/deg", title_fontsize="small"
    )
    for axes in (peak, duration, skewness):
        tidy(axes)
    return titled(figure, "Main sequence and skewness", policy, task)


def draw_main_sequence(axes: "Axes", policy: Policy, task: SaccadeTask) -> None:
    """Peak velocity and duration against size in one panel."""
    every = Saccades.every_size(task, policy)
    measures = every.outcome.measures
    twin = axes.twinx()
    mean_and_range(axes, every.size_deg, measures.peak_velocity_deg_s, LEARNED, "peak velocity")
    mean_and_range(twin, every.size_deg, 1e3 * measures.settling_time_s, THIRD, "duration")
    size_axis(axes, task)
    axes.set(ylabel="peak velocity [deg/s]", title="main sequence")
    axes.set_ylim(bottom=0)
    twin.set_ylabel("duration [ms]")
    twin.set_ylim(bottom=0)
    axes.yaxis.label.set_color(LEARNED)
    twin.yaxis.label.set_color(THIRD)
    tidy(axes)
    twin.spines["top"].set_visible(False)


def _draw_human(peak: "Axes", duration: "Axes", skewness: "Axes", largest_deg: float) -> None:
    """Human saccades: peak velocity and duration against size, skewness against duration."""
    intercept, slope = (human_values(f"duration_{name}")[0] for name in ("intercept", "slope"))
    for study, marker in zip(studies(), "osDv^P", strict=False):
        style: dict[str, Any] = {"marker": marker, "ls": "", "color": HUMAN, "ms": 5, "capsize": 2, "elinewidth": 0.8}
        style["label"] = f"people: {study}"
        for quantity, axes in (("peak_velocity", peak), ("duration", duration), ("acceleration_fraction", skewness)):
            chosen = human_values(quantity, study)
            x, y, spread = np.array([(row.amplitude_deg, row.value, row.spread) for row in chosen]).reshape(-1, 3).T
            if quantity == "acceleration_fraction":
                x, y = intercept.value + slope.value * x, 1 - y
            if chosen:
                axes.errorbar(x, y, yerr=None if np.isnan(spread).all() else np.nan_to_num(spread), **style)
    size = np.array([0.0, largest_deg])
    words = f"people: {intercept.value:g} ms + {slope.value:g} ms/deg ({slope.study})"
    duration.plot(size, intercept.value + slope.value * size, ":", color=HUMAN, label=words)
