"""Words and tables for people, on standard error. Everything that is printed for people goes through `say`.

Text is printed as it is: nothing in a path or a message is markup, and what would command a terminal is escaped. What
is to be coloured says so by a style.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:  # --help does not wait for rich
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from orient_eye.task.saccade import SaccadeTask

Row: TypeAlias = Mapping[str, Any]
Cell: TypeAlias = "str | Text"
_WIDTH = 200  # of a log file or a pipe: no wrapping at the 80 columns of a missing terminal
_WORDS = 16  # characters that a column of words has at least


def say(message: "str | Table" = "", style: str = "") -> None:
    """Print words, in a style of rich ("red"), or a table."""
    from rich.console import Console

    console = Console(stderr=True, highlight=False, markup=False, emoji=False)
    if not console.is_terminal:
        console.width = _WIDTH
    if isinstance(message, str):
        console.print(_tame(message), style=style or None, soft_wrap=True)
    elif _fits(message, console.width):
        console.print(message)
    else:
        _say_in_lines(message, console)


def _fits(made: "Table", width: int) -> bool:
    """Whether nothing of a table would be cut off; words may go over several lines."""
    inside = sum(
        max(len(line) for cell in (each.header, *each.cells) for line in str(cell).splitlines() or [""])
        if each.no_wrap
        else _WORDS
        for each in made.columns
    )
    return inside + 3 * len(made.columns) + 1 <= width


def _say_in_lines(made: "Table", console: "Console") -> None:
    """A table too wide for the terminal: a row after the other, with a line for each column."""
    from rich.padding import Padding
    from rich.table import Table

    console.print(made.title, style="bold")
    for row in zip(*(each.cells for each in made.columns), strict=True):
        lines = Table.grid(padding=(0, 2))
        for each, cell in zip(made.columns, row, strict=True):
            lines.add_row(each.header, cell)
        console.print(Padding(lines, (0, 0, 1, 2)))


def _tame(text: str) -> str:
    """Text with what no terminal should be sent escaped: control characters other than the end of a line."""
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text)


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

    made = Table(title=_tame(title), title_justify="left", title_style="bold")
    for place, heading in enumerate(columns):
        words = heading in left
        made.add_column(heading, justify="left" if words else "right", no_wrap=not words or not place, overflow="fold")
    for row in rows:
        cells = (cell(row) for cell in columns.values())
        made.add_row(*(_tame(words) if isinstance(words, str) else words for words in cells))
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
    actions = task.actions.plain
    driven = dict.fromkeys(told_of.motor for told_of in actions.numbers if told_of.motor)
    if len(driven) > 1:
        columns["motor"] = lambda row: "\n".join(driven)
    columns |= {f"F [{unit}]": _stacked(keys, ".3f") for unit, keys in _starts(row).items()}
    keys: dict[str, list[str]] = {}
    for name, told_of in zip(actions.names, actions.numbers, strict=True):
        key = name if name in row else f"{name}_{told_of.unit}"
        heading = f"{told_of.symbol} [{told_of.unit}]" if told_of.unit else told_of.symbol
        keys.setdefault(heading, []).append(key)
    columns |= {heading: _stacked(of_motors, ".5g") for heading, of_motors in keys.items()}
    for key in row:
        if key == "C" or key.startswith("C_"):
            columns[f"{key} [1/s]"] = _onset(key)
    for what, (key, unit) in _PEAKS.items():
        peaks = [(name, f"{key}_limit{name.removeprefix(key)}") for name in row if _is_peak(name, key)]
        if peaks and (key == "motor_speed" or any(row[limit] is not None for _, limit in peaks)):
            columns[f"{what} [{unit}]"] = _beside(peaks)
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


_PEAKS = {"motor speed": ("motor_speed", "deg/s"), "motor acc.": ("motor_acceleration", "deg/s²")}
"""Heading to key and unit; the columns are motor_speed_deg_s, motor_speed_limit_deg_s, of several with their names."""


def _starts(row: Row) -> dict[str, list[str]]:
    """Keys of where motors start, by their unit."""
    found: dict[str, list[str]] = {}
    for key in row:
        if key.startswith("F_"):
            found.setdefault(key.rsplit("_", 1)[1], []).append(key)
    return found


def _stacked(keys: Sequence[str], form: str) -> Callable[[Row], Cell]:
    """Numbers of several motors, one below the other."""
    return lambda row: "\n".join(number(row[key], form) for key in keys)


def _is_peak(name: str, key: str) -> bool:
    return name.startswith(f"{key}_") and not name.startswith(f"{key}_limit_")


def _onset(key: str) -> Callable[[Row], Cell]:
    """C, in red where it cannot hold the command to the speed limit."""

    def cell(row: Row) -> Cell:
        from rich.text import Text

        told = number(row[key], ".4g")
        return Text(f"{told}\ntoo fast", "red") if row["too_fast"] else told

    return cell


def _beside(told: Sequence[tuple[str, str]]) -> Callable[[Row], Cell]:
    """What motors do beside what they can, marked where that changed the command; keys of both."""

    def cell(row: Row) -> Cell:
        from rich.text import Text

        words = [
            number(row[key], ".0f") + ("" if row[limit] is None else f" of {row[limit]:.0f}") for key, limit in told
        ]
        return Text("\n".join((*words, "limited")), "yellow") if row["limited"] else "\n".join(words)

    return cell


def say_limits(task: "SaccadeTask", rows: Sequence[Row]) -> None:
    """In words what a limit did to the commands of saccades; nothing where none did anything."""
    count = {name: sum(bool(row[name]) for row in rows) for name in ("too_fast", "limited", "saturated")}
    if count["too_fast"]:
        V = getattr(task.actions.plain, "speed_limit", None)
        limit = "its speed limit" if V is None else f"the speed limit of {V:g} deg/s"
        say(f"too fast: no C holds {count['too_fast']} of {len(rows)} commands to {limit}", "red")
    if count["limited"]:
        say(
            f"limited: in {count['limited']} of {len(rows)} saccades the motors cannot do what the command says, and "
            "go after it as fast as they can",
            "yellow",
        )
    if count["saturated"]:
        say(f"saturated: {count['saturated']} of {len(rows)} commands are cut off at the motors' range", "yellow")
