"""Maps of where an eye can look, at which torsion, and what its motors do for it."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from orient_eye.statics import Workspace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_RING_DEG = 10
_LEVELS = 13
_INSIDE = 0.9  # of the largest cone: at its edge torsion is forced, and large


def workspace(space: Workspace, limit_deg: float) -> Figure:
    """Where the eye can look: how much torsion it can choose there, and how far the motors turn for the least force.

    Args:
        space: of the eye.
        limit_deg: of a cone that is drawn dashed.
    """
    figure = Figure(figsize=(12.5, 5.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    held = space.held
    _draw(left, space, held.range[:, 1] - held.range[:, 0], limit_deg, "viridis")
    left.set_title("largest less least torsion [deg]", fontsize="medium")
    _draw(right, space, np.abs(held.motor).max(axis=1), limit_deg, "magma_r")
    right.set_title("farthest motor, at the torsion of least force [deg]", fontsize="medium")
    figure.suptitle(f"Directions that the motors hold: all up to {space.reach_deg.min():.1f} deg from straight ahead")
    return figure


def torsion_maps(space: Workspace, limit_deg: float) -> Figure:
    """Torsion of the least force over the directions of gaze, and the least and the largest that the motors hold.

    Args:
        space: of the eye.
        limit_deg: of a cone that is drawn dashed.
    """
    figure = Figure(figsize=(17, 5.4), layout="constrained")
    held = space.held
    columns = {
        "of the least force": held.torsion,
        "least that is held": held.range[:, 0],
        "largest that is held": held.range[:, 1],
    }
    for axes, (name, values) in zip(figure.subplots(1, 3), columns.items(), strict=True):
        _draw(axes, space, values, limit_deg, "RdBu_r", even=True)
        axes.set_title(name, fontsize="medium")
    figure.suptitle("Torsion [deg]")
    return figure


def _draw(axes: "Axes", space: Workspace, values: Array, limit_deg: float, colours: str, *, even: bool = False) -> None:
    """Values (n,) as the eye sees them, left on the left; `even`: a scale about 0 that suits the inside."""
    around = np.concatenate([space.shift, space.shift[:, :1]], axis=1)
    shown = values.reshape(space.shift.shape[:2])
    shown = np.concatenate([shown, shown[:, :1]], axis=1)
    inside = np.linalg.norm(around, axis=-1) <= _INSIDE * space.reach_deg.min()
    most = float(np.abs(shown[inside]).max())
    levels = np.linspace(-most if even else shown.min(), most if even else shown.max(), _LEVELS).round(9) + 0.0
    extend = "both" if even else "neither"
    drawn = axes.contourf(around[..., 0], around[..., 1], shown, levels, cmap=colours, extend=extend)
    axes.figure.colorbar(drawn, ax=axes, shrink=0.85, format="%.1f")
    axes.plot(*around[-1].T, color="black", lw=1)
    style: dict[str, Any] = {"fill": False, "color": "black"}
    for ring in np.arange(_RING_DEG, space.reach_deg.max(), _RING_DEG):
        axes.add_patch(Circle((0, 0), ring, lw=0.4, alpha=0.35, **style))
    axes.add_patch(Circle((0, 0), limit_deg, lw=1.3, ls="--", **style))
    edge = 1.04 * space.reach_deg.max()
    axes.set(
        xlim=(edge, -edge), ylim=(-edge, edge), aspect="equal", xlabel="gaze to the left [deg], as the eye sees it",
        ylabel="gaze up [deg]",
    )  # fmt: skip
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(2 * _RING_DEG))
    axes.spines[["top", "right"]].set_visible(False)
