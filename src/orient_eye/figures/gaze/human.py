"""Human saccades to draw beside ours."""

from typing import TYPE_CHECKING, Any

import numpy as np

from orient_eye.figures import tidy
from orient_eye.figures.gaze.style import HUMAN
from orient_eye.human import human_values, studies

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARKS = dict(zip(studies("peak_velocity", "duration"), "sDv^P", strict=False))


def draw_human(axes: "Axes", *quantities: str) -> None:
    """Values of human saccades with their standard deviations against amplitude, a mark a study."""
    for quantity in quantities:
        of = ", vertical" if quantity.endswith("vertical") else ""
        for study, marker in _MARKS.items():
            rows = human_values(quantity, study)
            amplitude, value, spread = np.array([(r.amplitude_deg, r.value, r.spread) for r in rows]).reshape(-1, 3).T
            style: dict[str, Any] = {"marker": marker, "ls": "", "color": HUMAN, "ms": 5, "capsize": 2}
            if rows:
                style |= {"mfc": "white" if of else HUMAN, "label": f"people{of}: {study}"}
                error = None if np.isnan(spread).all() else np.nan_to_num(spread)
                axes.errorbar(amplitude, value, yerr=error, elinewidth=0.8, **style)


def draw_human_duration(axes: "Axes", largest_deg: float) -> None:
    """Duration of human saccades as a line up to an amplitude."""
    intercept, slope = (human_values(f"duration_{name}")[0] for name in ("intercept", "slope"))
    size = np.array([0, largest_deg])
    label = f"people: {intercept.value:g} ms + {slope.value:g} ms/deg ({slope.study})"
    axes.plot(size, intercept.value + slope.value * size, ":", color=HUMAN, label=label)


def beside_people(peak: "Axes", duration: "Axes", largest_deg: float) -> None:
    """People's values into a main sequence of the gaze, and its axes, up to an amplitude [deg]."""
    draw_human(peak, "peak_velocity", "peak_velocity_vertical")
    draw_human(duration, "duration")
    draw_human_duration(duration, largest_deg)
    peak.set(ylabel="peak velocity of the gaze [deg/s]")
    duration.set(ylabel="duration [ms]")
    for axes in (peak, duration):
        axes.set(xlabel="amplitude [deg]", xlim=(0, 1.04 * largest_deg))
        axes.set_ylim(bottom=0)
        axes.legend(frameon=False, fontsize="small", ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.12))
        tidy(axes)
