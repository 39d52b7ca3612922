"""Words and tables for people, on standard error. Everything that is printed for people goes through `say`.

Text is printed as it is: nothing in a path or a message is markup. What is to be coloured says so by a style.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:  # --help does not wait for rich
    from rich.table import Table
    from rich.text import Text

    from orient_eye.task.saccade import SaccadeTask

Row: TypeAlias = Mapping[str, Any]
Cell: TypeAlias = "str | Text"
_WIDTH = 160  # of a log file or a pipe: no wrapping at the 80 columns of a missing terminal


def say(message: "str | Table" = "", style: str = "") -> None:
    """Print words, in a style of rich ("red"), or a table."""
    from rich.console import Console

    console = Console(stderr=True, highlight=False, markup=False, emoji=False)
    if not console.is_terminal:
        console.width = _WIDTH
    console.print(message, style=style or None, soft_wrap=isinstance(message, str))


def table(
    title: str, columns: Mapping[str, Callable[[Row], Cell]], rows: Sequence[Row], left: Sequence[str] = ()
) -> "Table":
    """A table of rows.

    Args:
        title: a sentence that says what stands in it.
        columns: heading to what a cell says of a row.
        rows: of the table.
        left: headings of the columns that hold words.
    """
    from rich.table import Table

    made = Table(title=title, title_justify="left", title_style="bold")
    for heading in columns:
        made.add_column(heading, justify="left" if heading in left else "right")
    for row in rows:
        made.add_row(*(cell(row) for cell in columns.values()))
    return made


def number(value: Any, form: str = ".5g", unit: str = "") -> str:
    """A number with its unit, "-" where there is none."""
    return "-" if value is None else f"{value:{form}}{unit}"


def column(key: str, form: str = ".5g", unit: str = "", scale: int = 1) -> Callable[[Row], str]:
    """A column of numbers out of the rows' key."""
    return lambda row: number(None if row.get(key) is None else scale * row[key], form, unit)


def saccade_columns(task: "SaccadeTask", row: Row, *, terms: bool = False) -> dict[str, Callable[[Row], Cell]]:
    """Columns of `orient_eye.task.table.outcome_rows`, for `table`.

    Args:
        task: whose saccades they are.
        row: one of the rows.
        terms: show also the weighted terms of the reward.
    """
    angles = task.targets.angles

    def told(what: str, row: Row) -> str:
        return ", ".join(number(row[f"{what}_{angle}"], ".4g") for angle in angles)

    def settling(row: Row) -> str:
        return number(row["duration_ms"], ".1f", " ms") + ("" if row["settled"] or row["failed"] else " (not settled)")

    def off(row: Row) -> str:
        errors = (row[f"final_{angle.replace('_deg', '_error_deg')}"] for angle in angles)
        return ", ".join(number(error, "+.3f") for error in errors)

    columns: dict[str, Callable[[Row], Cell]] = {
        "saccade [deg]": lambda row: f"{told('start', row)} to {told('target', row)}"
    }
    for key in row:
        if key.startswith("F_"):
            columns[f"{key.rsplit('_', 1)[0]} [{key.rsplit('_', 1)[1]}]"] = column(key, ".3f")
    for name, told_of in zip(task.actions.names, task.actions.numbers, strict=True):
        columns[f"{name} [{told_of.unit}]"] = column(name if name in row else f"{name}_{told_of.unit}")
    for key in row:
        if key == "C" or key.startswith("C_"):
            columns[f"{key} [1/s]"] = lambda row, key=key: (
                number(row[key], ".4g")
                + (  # type: ignore[misc]
                    " (too fast)" if row["too_fast"] else ""
                )
            )
    columns["reward"] = column("reward", ".0f")
    if terms:
        columns |= {name: column(f"reward_{name}", ".0f") for name in task.weights}
    return columns | {
        "ends at [deg]": lambda row: "failed" if row["failed"] else told("final", row),
        "off by [deg]": off,
        "settles in": settling,
        "peak velocity": column("peak_velocity_deg_s", ".0f", " deg/s"),
        "goes beyond": column("overshoot", ".4f", " %", 100),
    }
