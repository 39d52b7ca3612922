"""Human saccades to draw beside ours (models/human/main_sequence.csv)."""

import csv
from typing import TYPE_CHECKING, Any

import numpy as np

from orient_eye.figures.gaze.style import HUMAN
from orient_eye.resources import data_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STUDIES = {
    "PMC6143243": ("s", "100 adults, PMC6143243"),
    "Collewijn": ("D", "Collewijn et al. 1988"),
    "Andersson": ("v", "Andersson et al. 2017"),
}
"""By a part of the source in the table: mark and name."""


def draw_human(axes: "Axes", *quantities: str) -> None:
    """Values of human saccades with their standard deviations against amplitude, a mark a study."""
    for quantity in quantities:
        of = ", vertical" if quantity.endswith("vertical") else ""
        for part, (marker, name) in _STUDIES.items():
            rows = [row for row in _rows(quantity) if part in row["source"]]
            columns = ("amplitude_deg", "value", "spread_sd")
            amplitude, value, spread = (np.array([float(row[column] or 0) for row in rows]) for column in columns)
            style: dict[str, Any] = {"marker": marker, "ls": "", "color": HUMAN, "ms": 5, "capsize": 2}
            if rows:
                style |= {"mfc": "white" if of else HUMAN, "label": f"human{of}: {name}"}
                axes.errorbar(amplitude, value, yerr=spread if spread.any() else None, elinewidth=0.8, **style)


def draw_human_duration(axes: "Axes", largest_deg: float) -> None:
    """Duration of human saccades as a line up to an amplitude."""
    intercept, slope = (float(_rows(f"duration_{name}")[0]["value"]) for name in ("intercept", "slope"))
    size = np.array([0, largest_deg])
    label = f"human: {intercept:g} ms + {slope:g} ms/deg (Carpenter 1988)"
    axes.plot(size, intercept + slope * size, ":", color=HUMAN, label=label)


def _rows(quantity: str) -> list[dict[str, str]]:
    with (data_folder("models") / "human" / "main_sequence.csv").open(encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["quantity"] == quantity]
