"""The evidence as one document: the thesis' figures shown again, the newer eyes beside them, and how human it all is.

    write_report(Path("report"), Evidence())         # index.html, figures/*.svg and *.png, human.csv

Each figure is an `Exhibit` in the registry `EXHIBITS`: a function of the `Evidence`, which loads or computes everything
once. Another eye adds its own there.
"""

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from orient_eye.files import write_table
from orient_eye.report.evidence import Evidence
from orient_eye.report.exhibits import EXHIBITS
from orient_eye.report.likeness import human_table, likenesses
from orient_eye.report.page import save_figure, write_page

_TITLE = "Saccades of a biomimetic robot eye: the evidence"
_INTRODUCTION = (
    "A thesis taught Soft Actor-Critic to move a robot eye in human-like saccades, by one pulse-step command each, "
    "on a low-pass surrogate of the eye. Here each of its figures is drawn again from what orient-eye computes, with "
    "what was wrong in it corrected; then the same on the whole eye in MuJoCo and in all directions; and last how "
    "human it is."
)


def chosen_figures(names: Sequence[str] | None) -> tuple[str, ...]:
    """Ids of figures in the order of the report; all for None.

    Raises:
        InputError: one that there is not.
    """
    for name in names or ():
        EXHIBITS[name]
    return tuple(name for name in EXHIBITS if names is None or name in names)


def write_report(
    folder: Path,
    evidence: Evidence,
    figures: Sequence[str] | None = None,
    progress: Callable[[float, str], object] | None = None,
) -> dict[str, Any]:
    """Draw figures and write the page.

    Args:
        folder: where index.html, figures/ and human.csv go.
        evidence: what the figures are functions of.
        figures: ids; None for all.
        progress: called with the share that is done and with what is being drawn.

    Returns:
        What each figure says, and the table of human-likeness; plain values.

    Raises:
        InputError: an unknown figure, or nothing can be written there.
    """
    names = chosen_figures(figures)
    shown = {}
    for i, name in enumerate(names):
        if progress is not None:
            progress(i / len(names), f"figure {name}")
        drawn = EXHIBITS[name].draw(evidence)
        shown[name] = EXHIBITS[name], drawn, save_figure(drawn, folder / "figures", name)
    rows: list[dict[str, Any]] = []
    if "human" in names:
        rows = [one.row() for one in likenesses(evidence)]
        write_table(folder / "human.csv", rows)
    made = f"Made by orient-eye report on {datetime.now():%d %B %Y}."
    write_page(folder / "index.html", shown, human_table(rows), _TITLE, _INTRODUCTION, made)
    return {"figures": {name: drawn.says for name, (_, drawn, _) in shown.items()}, "human": rows}


__all__ = ["EXHIBITS", "Evidence", "chosen_figures", "write_report"]
