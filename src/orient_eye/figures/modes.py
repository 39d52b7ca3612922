"""The picture of an identification of all motors: predicted movements beside the plant's, and the error of all."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye import listing
from orient_eye.figures import DATA, MODEL, OTHER, tidy
from orient_eye.rotations import to_euler
from orient_eye.sysid.modes import RINGS_DEG, ModesIdentification

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_SHOWN = (10, 50, 75, 95)  # percentiles of the error, of the saccades that are drawn
_COLOURS = {"yaw": DATA, "pitch": MODEL, "torsion": OTHER}
_DOTS = 4000
_ORDER = {"first_order": "first order", "second_order": "second order"}


def draw_modes(found: ModesIdentification) -> Figure:
    """Some held-out pulse-steps over time, from a well to a badly predicted one, and the error of all of them."""
    figure = Figure(figsize=(13, 7.5), layout="constrained")
    error = found.error_deg[found.order]
    each = np.sqrt(np.mean(error**2, axis=1))
    shown = [int(np.abs(each - np.percentile(each, share)).argmin()) for share in _SHOWN]
    halves = figure.subfigures(2, 1, squeeze=False, height_ratios=(1.15, 1))
    top, bottom = halves[0, 0], halves[1, 0]
    _movements(top.subplots(1, len(shown), sharey=True), found, shown, each)
    left, right = bottom.subplots(1, 2)
    _by_eccentricity(left, found)
    _over_time(right, found)
    left_out = f"; {found.ran_away} more, fitted or held out, ran away" if found.ran_away else ""
    top.suptitle(
        f"Held-out pulse-steps of all motors: plant (solid) and surrogate (dashed); {len(error)} of them, "
        f"rms {found.rms_deg[found.order]:.2f} deg, largest {error.max():.1f} deg{left_out}"
    )
    return figure


def _movements(row: "Sequence[Axes]", found: ModesIdentification, shown: Sequence[int], rms: Array) -> None:
    time, predicted = 1e3 * found.held_out.time, found.predicted[found.order]
    for axes, i, share in zip(row, shown, _SHOWN, strict=True):
        for (name, true), told in zip(
            _angles(found.held_out.orientation[i]).items(), _angles(predicted[i]).values(), strict=True
        ):
            axes.plot(time, true, color=_COLOURS[name], lw=1.8, label=name)
            axes.plot(time, told, color=_COLOURS[name], lw=1.3, ls=(0, (4, 2)))
        axes.set_title(f"rms {rms[i]:.2f} deg, {share}th percentile", fontsize="medium")
        axes.set_xlabel("time [ms]")
        tidy(axes)
    row[0].set_ylabel("angle [deg]")
    row[-1].legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _angles(orientation: Array) -> dict[str, Array]:
    yaw, pitch, _ = to_euler(orientation)
    return {"yaw": yaw, "pitch": pitch, "torsion": listing.torsion(orientation)}


def _by_eccentricity(axes: "Axes", found: ModesIdentification) -> None:
    """All samples, and the rms of each ring."""
    error, where = found.error_deg[found.order].ravel(), found.eccentricity_deg.ravel()
    some = np.linspace(0, error.size - 1, min(error.size, _DOTS)).round().astype(int)
    axes.plot(where[some], error[some], ".", color="0.6", ms=2, alpha=0.5, label="samples")
    for order, colour in zip(found.orders, (DATA, MODEL), strict=True):
        rings = [row for row in found.rows if row["order"] == order][1:]
        ends = [row["from_deg"] for row in rings] + [rings[-1]["to_deg"] or float(where.max())]
        title, style = f"rms, {_ORDER[order]}", "--"
        if order == found.order:
            title, style = f"{title}: the surrogate", "-"
        axes.stairs([row["rms_deg"] for row in rings], ends, baseline=None, color=colour, lw=2, ls=style, label=title)
    right = 1.02 * float(where.max())
    axes.set(xlabel="eccentricity of the gaze [deg]", ylabel="error [deg]", xlim=(0, right), ylim=(0, None))
    axes.set_xticks([end for end in RINGS_DEG if end < where.max()])
    tidy(axes)
    axes.legend(frameon=False, loc="upper left")


def _over_time(axes: "Axes", found: ModesIdentification) -> None:
    """Median, and what 5 and 95 % stay below, of the surrogate's error."""
    time, error = 1e3 * found.held_out.time, found.error_deg[found.order]
    low, middle, high = np.percentile(error, (5, 50, 95), axis=0)
    axes.fill_between(time, low, high, color=DATA, alpha=0.15, lw=0, label="5 to 95 % of the pulse-steps")
    axes.plot(time, middle, color=DATA, lw=1.8, label="median")
    axes.plot(time, error.max(axis=0), color="0.5", lw=1, ls=":", label="largest")
    axes.set(xlabel="time since the command began [ms]", ylabel="error [deg]", xlim=(0, None), ylim=(0, None))
    tidy(axes)
    axes.legend(frameon=False)
