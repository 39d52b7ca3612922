"""Pictures of how an eye with more motors than axes shares the work of holding its gaze.

    save(planes({name: Postures.of(cables, cone(30.0), name) for name in CRITERIA}), "planes.png")

Gaze is told to the left and up of straight ahead (`orient_eye.movement.oblique.seen_from`) and drawn as the eye sees
it, left on the left.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from orient_eye.figures import DATA, MODEL, OTHER, tidy
from orient_eye.listing import Plane, fit_plane, rotation_vectors
from orient_eye.motor import Motor
from orient_eye.statics import Ends, Postures, Softening

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Pairs = NDArray[np.intp]
_RING_DEG = 20
_LEVELS = 13
_LEFT = "gaze to the left [deg]"


def reach(ends: Ends, stiffness: Array, limit_deg: float) -> Figure:
    """Up to where the eye holds its gaze, what ends it, and how stiff it is on the way about its softest axis.

    Args:
        ends: of the eye.
        stiffness: on its rings [N m/rad], (rings, around).
        limit_deg: of a cone that is drawn dashed.
    """
    figure = Figure(figsize=(13, 5.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    closed = np.concatenate([ends.toward, ends.toward[:1]])
    causes = {
        "it would turn farther": (ends.unstable_deg, MODEL),
        "a cable hangs": (ends.slack_deg, DATA),
        "a motor would leave its range": (ends.range_deg, OTHER),
    }
    left.fill(*(ends.reach_deg[:, None] * ends.toward).T, color="0.92", label="held")
    for name, (angle, colour) in causes.items():
        shown = np.where(np.isfinite(angle), angle, np.nan)
        left.plot(*(np.append(shown, shown[0])[:, None] * closed).T, color=colour, lw=1.6, label=f"{name} beyond")
    left.legend(frameon=False, fontsize="small", loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)
    left.set_title("what ends it", fontsize="medium")
    ring, soft = (np.concatenate([each, each[:, :1]], axis=1) for each in (ends.rings(len(stiffness) - 1), stiffness))
    drawn = right.contourf(*np.moveaxis(ring, -1, 0), soft, _LEVELS, cmap="viridis")
    figure.colorbar(drawn, ax=right, shrink=0.85)
    right.set_title("stiffness about the softest axis [N m/rad]", fontsize="medium")
    edge = 1.04 * max(float(ends.reach_deg.max()), limit_deg)
    style: dict[str, Any] = {"fill": False, "color": "black"}
    for axes in (left, right):
        for each in np.arange(_RING_DEG, edge, _RING_DEG):
            axes.add_patch(Circle((0, 0), each, lw=0.4, alpha=0.35, **style))
        axes.add_patch(Circle((0, 0), limit_deg, lw=1.3, ls="--", **style))
        axes.set(xlim=(edge, -edge), ylim=(-edge, edge), aspect="equal", xlabel=_LEFT, ylabel="gaze up [deg]")
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(f"Directions that the eye holds: all up to {ends.reach_deg.min():.1f} deg from straight ahead")
    return figure


def planes(found: Mapping[str, Postures]) -> Figure:
    """Listing's plane of each criterion, from the side and from above; what would not stay there is hollow.

    Args:
        found: criterion to postures.
    """
    figure = Figure(figsize=(4 * len(found), 8.2), layout="constrained")
    rows = figure.subplots(2, len(found), squeeze=False, sharex="row", sharey="row")
    for (name, postures), side, above in zip(found.items(), *rows, strict=True):
        q, stays = postures.orientation, postures.state.good
        r = rotation_vectors(q)
        x, y, z = np.rad2deg(2 * np.arctan(r)).T
        for axes, across, over in ((side, x, y), (above, z, x)):
            axes.plot(across[stays], over[stays], ".", color=DATA, ms=3)
            axes.plot(across[~stays], over[~stays], "o", color=DATA, mfc="none", ms=3, lw=0.5)
        plane = fit_plane(q)
        _draw_plane(plane, side, above, r)
        yaw, pitch = plane.tilt_deg
        side.set_title(
            f"{name}\nsd {plane.sd_deg:.2f} deg, tilt {yaw:.1f} left, {pitch:.1f} down\n"
            f"twist {plane.twist:+.2f}; about it sd {plane.twisted_sd_deg:.2f}",
            fontsize="medium",
        )
        side.set(xlabel="torsion [deg]")
        above.set(xlabel="horizontal, positive left [deg]")
    rows[0, 0].set(ylabel="vertical, positive down [deg]")
    rows[1, 0].set(ylabel="torsion [deg]")
    rows[0, 0].invert_yaxis()
    rows[1, 0].invert_xaxis()
    for axes in rows.ravel():
        tidy(axes)
    figure.suptitle("Listing's plane of each criterion: from the side, from above; hollow: not held")
    return figure


def _draw_plane(plane: Plane, side: "Axes", above: "Axes", r: Array) -> None:
    """The fitted plane where it cuts the page."""
    for axes, slope, along, level in ((side, plane.by_y, r[:, 1], False), (above, plane.by_z, r[:, 2], True)):
        ends = np.array([along.min(), along.max()])
        way = np.rad2deg(2 * np.arctan(ends)), np.rad2deg(2 * np.arctan(plane.offset + slope * ends))
        axes.plot(*(way if level else way[::-1]), color=MODEL, lw=1.3)


def meridians(
    horizontal: tuple[Array, Postures], vertical: tuple[Array, Postures], motors: Sequence[Motor], pairs: Pairs
) -> Figure:
    """Angles of antagonists, and their tensions, along the horizontal and the vertical meridian.

    Args:
        horizontal: gaze to the left [deg], (n,), and how it is held; what is not held is left out.
        vertical: gaze up, the same.
        motors: of the eye, a cable each.
        pairs: of antagonists, (pairs, 2).
    """
    figure = Figure(figsize=(4 * len(pairs), 11), layout="constrained")
    rows = figure.subplots(4, len(pairs), squeeze=False, sharey="row")
    told = (("angle [deg]", "motor"), ("tension [N]", "tension"))
    ways = ((_LEFT, horizontal), ("gaze up [deg]", vertical))
    panels = [(way, at, of) for way, at in ways for of in told]
    for row, (way, (angle, postures), (unit, attribute)) in zip(rows, panels, strict=True):
        values = np.where(postures.state.good[:, None], getattr(postures, attribute), np.nan)
        for axes, pair in zip(row, pairs, strict=True):
            for i, colour in zip(pair, (DATA, MODEL), strict=True):
                axes.plot(angle, values[:, i], color=colour, lw=1.6, label=motors[i].name)
            axes.set(xlabel=way)
            axes.legend(frameon=False, fontsize="small")
            if way == _LEFT:
                axes.invert_xaxis()
            tidy(axes)
        row[0].set(ylabel=unit)
    figure.suptitle("Antagonists along the meridians")
    return figure


def antagonists(found: Mapping[str, Array], pairs: Sequence[str]) -> Figure:
    """How antagonists' angles, and their tensions, correlate over the directions of gaze.

    Args:
        found: criterion to correlations of angles and tensions, (pairs, 2).
        pairs: their names.
    """
    figure = Figure(figsize=(12, 4.4), layout="constrained")
    wide = 0.8 / len(found)
    for k, (axes, of) in enumerate(zip(figure.subplots(1, 2, sharey=True), ("angles", "tensions"), strict=True)):
        for j, (name, values) in enumerate(found.items()):
            axes.bar(np.arange(len(pairs)) + (j + 0.5) * wide - 0.4, values[:, k], 0.9 * wide, label=name)
        axes.axhline(0, color="black", lw=0.8)
        axes.set(title=of, ylim=(-1.05, 1.05))
        axes.set_xticks(np.arange(len(pairs)), pairs)
        tidy(axes)
    figure.axes[0].set(ylabel="correlation of antagonists")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle("Antagonists: -1 where they work against each other, 1 where they work together")
    return figure


def stiffness(softening: Softening, away_deg: Array, least: Mapping[float, Array]) -> Figure:
    """Stiffness straight ahead against co-contraction, and to the left and right at some co-contractions.

    Args:
        softening: of the eye.
        away_deg: to the left, (n,).
        least: co-contraction [rad] to the stiffness there about the softest axis [N m/rad], (n,).
    """
    figure = Figure(figsize=(12, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    for about, name, colour in zip(softening.about.T, ("torsion", "pitch", "yaw"), (OTHER, MODEL, DATA), strict=True):
        left.plot(softening.co_contraction, about, color=colour, lw=1.6, label=f"about the axis of {name}")
    left.plot(softening.co_contraction, softening.least, "k--", lw=1, label="about the softest axis")
    end = softening.unstable_from
    if np.isfinite(end):
        left.axvline(end, color="0.5", lw=1)
        left.annotate(
            f"unstable from {end:.2f} rad", (end, 0.02), (-6, 4), textcoords="offset points", rotation=90,
            ha="right", va="bottom", fontsize="small",
        )  # fmt: skip
    left.set(
        xlabel="co-contraction: mean angle of antagonists [rad]", ylabel="stiffness [N m/rad]", title="straight ahead"
    )
    for shade, (each, values) in zip(np.linspace(0.75, 0.0, len(least)), least.items(), strict=True):
        right.plot(away_deg, values, color=str(shade), lw=1.6, label=f"{each:g} rad")
    right.set(xlabel=_LEFT, ylabel="stiffness about the softest axis [N m/rad]", title="along the horizontal meridian")
    right.invert_xaxis()
    for axes in (left, right):
        axes.axhline(0, color="black", lw=0.8)
        axes.legend(frameon=False, fontsize="small")
        tidy(axes)
    figure.suptitle("Stiffness and co-contraction")
    return figure
