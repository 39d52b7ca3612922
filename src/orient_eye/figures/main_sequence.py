"""Main sequences beside each other."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from orient_eye.exchange.gaze import Found
from orient_eye.figures import DATA, MODEL, tidy
from orient_eye.movement.main_sequence import MainSequence

_COLOURS = {"recording": DATA, "policy": MODEL, "people": "0.5"}


def beside(of: Mapping[str, Found], fit: Mapping[str, MainSequence], names: Mapping[str, str]) -> Figure:
    """Peak velocity and duration of saccades against their amplitude: dots, and the fits as curves.

    Args:
        of: "recording" and "policy" to saccades.
        fit: the same, and "people", to main sequences.
        names: of each, for the legend.
    """
    figure = Figure(figsize=(10, 4.6), layout="constrained")
    panels = figure.subplots(1, 2)
    largest = max(float(found.amplitude_deg.max()) for found in of.values())
    size = np.linspace(0, 1.05 * largest, 200)
    for who, sequence in fit.items():
        style = {"color": _COLOURS[who], "lw": 1.4, "ls": "--" if who == "people" else "-"}
        label = None if who in of else names[who]
        panels[0].plot(size, sequence.peak_velocity(size), label=label, **style)
        panels[1].plot(size, sequence.duration_ms(size), label=label, **style)
    for who, found in of.items():
        style = {"color": _COLOURS[who], "ms": 4, "alpha": 0.7}
        label = f"{names[who]}: {len(found)} saccades"
        panels[0].plot(found.amplitude_deg, found.peak_velocity_deg_s, "o", label=label, **style)
        panels[1].plot(found.amplitude_deg, 1e3 * found.duration_s, "o", label=label, **style)
    for axes, what in zip(panels, ("peak velocity [deg/s]", "duration [ms]"), strict=True):
        axes.set(xlabel="amplitude [deg]", ylabel=what, xlim=(0, 1.05 * largest), ylim=(0, None))
        tidy(axes)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", frameon=False, ncols=2)
    figure.suptitle("Main sequence: saccades as the velocity threshold finds them, and fits")
    return figure
