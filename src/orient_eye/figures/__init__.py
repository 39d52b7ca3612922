"""Pictures of results: matplotlib Figures, and what they have in common.

    save(figure_3_5(found), "figure_3_5.png")

No pyplot, so nothing global: figures can be made in threads and without a screen.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from orient_eye.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DATA, MODEL, OTHER = "#1f4e9c", "#d1495b", "#2a9d6f"
"""Colours of what was measured, of the model that is held against it, and of another model."""
_DPI = 130


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure to a file, its format from the name, atomically."""
    return write_atomically(path, lambda temporary: figure.savefig(temporary, dpi=_DPI))


def tidy(axes: "Axes") -> None:
    """A light grid, and no frame above and to the right."""
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
