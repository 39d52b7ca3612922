"""Listing's plane, and torsion over time."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import DATA, MODEL, tidy
from orient_eye.figures.gaze.style import colours, end_ms
from orient_eye.listing import Plane, fit_plane, rotation_vectors, torsion
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import torsion_blip, transient_torsion
from orient_eye.movement.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def listing_plane(
    orientation: Array, during: Array | None = None, compared: Mapping[str, Array] | None = None
) -> Figure:
    """Orientations at rest as rotation vectors, from the side and from above, and how their plane is twisted.

    Angles are 2 atan(r). In the third panel Listing's law is a level line, and Fick's gimbal falls by 1 a degree.

    Args:
        orientation: at the ends of saccades, (n, 4), at least four; the plane is fitted to them.
        during: on the way, (..., 4), drawn as points; None leaves them out.
        compared: other orientations (n, 4) by a name, as those of least force, or those of another law.
    """
    ends, plane = orientation.reshape(-1, 4), fit_plane(orientation)
    figure = Figure(figsize=(15, 5.6), layout="constrained")
    side, above, twist = figure.subplots(1, 3)
    drawn: list[tuple[str, Array, dict[str, Any]]]
    drawn = [] if during is None else [("on the way", during.reshape(-1, 4), {"color": "0.75", "ms": 1.5})]
    for k, (name, q) in enumerate((compared or {}).items()):
        drawn.append((name, q.reshape(-1, 4), {"color": colormaps["Dark2"](k), "ms": 4}))
    drawn += [("ends", ends, {"color": DATA, "ms": 5})]
    for name, q, style in drawn:
        r = rotation_vectors(q)
        x, y, z = np.rad2deg(2 * np.arctan(r)).T
        side.plot(x, y, ".", label=name, **style)
        above.plot(z, x, ".", label=name, **style)
        twist.plot(np.rad2deg(2 * r[:, 1] * r[:, 2]), x, ".", **style)
    _draw_plane(plane, side, above, twist, rotation_vectors(ends))
    _frame(side, above, twist)
    yaw, pitch = plane.tilt_deg
    told = f"sd {plane.sd_deg:.2f} deg, tilt {yaw:.1f} deg left, {pitch:.1f} deg down, twist {plane.twist:.2f}"
    if during is not None:
        told += f"; sd on the way {fit_plane(during).sd_deg:.2f} deg"
    figure.suptitle(f"Listing's plane: {told}")
    figure.legend(
        *side.get_legend_handles_labels(), loc="outside lower center", ncols=6, frameon=False, fontsize="small"
    )
    return figure


def _draw_plane(plane: Plane, side: "Axes", above: "Axes", twist: "Axes", r: Array) -> None:
    """The fitted plane where it cuts the page, and the fitted twist."""

    def angle(vector: Array) -> Array:
        return np.asarray(np.rad2deg(2 * np.arctan(vector)))

    y, z = (np.array([np.nanmin(r[:, k]), np.nanmax(r[:, k])]) for k in (1, 2))
    style: dict[str, Any] = {"color": MODEL, "lw": 1.3}
    side.plot(angle(plane.offset + plane.by_y * y), angle(y), **style, label="fitted plane")
    above.plot(angle(z), angle(plane.offset + plane.by_z * z), **style)
    product = r[:, 1] * r[:, 2]
    ends = np.array([np.nanmin(product), np.nanmax(product)])
    for slope, dashes, name in ((plane.twist, "-", "fitted"), (0, ":", "Listing"), (-1, "--", "Fick")):
        colour = MODEL if name == "fitted" else "black"
        twist.plot(np.rad2deg(2 * ends), angle(plane.offset + slope * ends), dashes, color=colour, lw=1.2, label=name)


def _frame(side: "Axes", above: "Axes", twist: "Axes") -> None:
    side.set(xlabel="torsion [deg]", ylabel="vertical, positive down [deg]", title="from the side")
    above.set(xlabel="horizontal, positive left [deg]", ylabel="torsion [deg]", title="from above")
    twist.set(xlabel=r"2 $r_y r_z$ [deg]", ylabel="torsion [deg]", title="twist")
    for axes in (side, above):
        axes.set_aspect("equal", adjustable="datalim")
    side.invert_yaxis()
    above.invert_xaxis()
    twist.legend(frameon=False, fontsize="small")
    for axes in (side, above, twist):
        tidy(axes)


def torsion_over_time(trajectory: Trajectory, measures: Measures) -> Figure:
    """Torsion of saccades over time, and how far it is beside the way from its start to its end.

    A dot is a settling time of the gaze, from which on torsion may go on.

    Args:
        trajectory: of the saccades, one colour each.
        measures: of their gaze.
    """
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True)
    time, settling = 1e3 * trajectory.time, 1e3 * measures.settling_time_s
    for axes, values in ((left, torsion(trajectory.orientation)), (right, transient_torsion(trajectory, measures))):
        for colour, saccade, then in zip(colours(len(values)), values, settling, strict=True):
            axes.plot(time, saccade, color=colour, lw=1.3)
            if then <= time[-1]:
                axes.plot(then, np.interp(then, time, saccade), ".", color=colour, ms=8)
        axes.axhline(0, color="black", lw=0.6)
        axes.set(xlabel="time [ms]", xlim=(0, end_ms(trajectory, measures)))
        tidy(axes)
    blip = torsion_blip(trajectory, measures)
    left.set(ylabel="torsion [deg]", title="torsion")
    right.set(
        ylabel="torsion beside the straight way [deg]",
        title=f"blips: median {np.nanmedian(blip):.2f}, largest {np.nanmax(blip):.2f} deg",
    )
    return figure
