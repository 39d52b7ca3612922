"""The picture of a sweep: how each setting learned, and how far its seeds lie apart."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from orient_eye.figures import save, tidy
from orient_eye.learning.spread import spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from orient_eye.learning.sweep_results import Setting

_MOST = 40  # settings that a page holds
_LEAST = 1e-6  # gap that the logarithm shows


def draw_sweep(settings: "Sequence[Setting]", path: Path) -> Path:
    """Reward gap against updates, and at the end: interquartile means over seeds with 95 % intervals.

    Of more settings than a page holds those with the smallest gaps are shown.
    """
    shown = sorted(settings, key=lambda each: float(spread([each.gaps]).mean))[:_MOST]
    shown = [each for each in settings if each in shown]
    height = max(4.0, 1.6 + 0.28 * len(shown))
    figure = Figure(figsize=(12, height), layout="constrained")
    left, right = figure.subplots(1, 2)
    colours = matplotlib.colormaps["turbo"](np.linspace(0.08, 0.92, len(shown))) if len(shown) > 1 else ["#1f4e9c"]
    for place, (setting, colour) in enumerate(zip(shown, colours, strict=True)):
        _draw_course(left, setting, colour)
        _draw_end(right, setting, place, colour)
    ends = np.maximum(np.concatenate([each.gaps for each in shown]), _LEAST)
    if np.ptp(ends) == 0:  # a logarithmic axis has no room around one point
        right.set_xlim(50 * ends[0], 200 * ends[0])
    left.set(yscale="log", xlabel="updates", ylabel="mean reward gap to the searched optimum [%]")
    few = "" if len(shown) == len(settings) else f" (the {_MOST} best of {len(settings)})"
    right.set(xscale="log", xlabel=f"mean reward gap at the end [%]{few}", ylim=(len(shown) - 0.4, -0.6))
    right.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    right.xaxis.set_major_formatter("{x:g}")
    right.xaxis.set_minor_formatter(NullFormatter())
    right.set_yticks(range(len(shown)), [each.name for each in shown])
    for label, colour in zip(right.get_yticklabels(), colours, strict=True):
        label.set_color(colour)
    for axes in (left, right):
        tidy(axes)
        axes.grid(alpha=0.12, which="minor")
    left.set_title("interquartile mean over seeds, 95 % interval", fontsize=10, loc="left")
    right.set_title("the same, and every run", fontsize=10, loc="left")
    return save(figure, path)


def _draw_course(axes: "Axes", setting: "Setting", colour: Any) -> None:
    found = spread([np.maximum(setting.curves, _LEAST)])
    axes.plot(setting.updates, 100 * found.mean, color=colour, linewidth=1.4)
    axes.fill_between(setting.updates, 100 * found.low, 100 * found.high, color=colour, alpha=0.2, linewidth=0)


def _draw_end(axes: "Axes", setting: "Setting", place: int, colour: Any) -> None:
    gaps = np.maximum(setting.gaps, _LEAST)
    found = spread([gaps])
    axes.plot(100 * gaps, np.full(len(gaps), place), "o", color=colour, markersize=4, alpha=0.45, markeredgewidth=0)
    axes.plot([100 * found.low, 100 * found.high], [place, place], color=colour, linewidth=5, alpha=0.35)
    axes.plot(100 * found.mean, place, "|", color=colour, markersize=13, markeredgewidth=2)
