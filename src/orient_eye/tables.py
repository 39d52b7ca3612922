"""Tables that people bring: CSV files of numbers with a header, read in one way everywhere.

    table = read_table("command.csv", "t_s,tau2_deg")
    table["t_s"]                                     # (rows,), finite numbers, or an error that names the line

Commas, semicolons or tabs between cells (with semicolons or tabs also decimal commas), any line ends, UTF-8 or
UTF-16, blank lines and lines that begin with # are skipped. An empty cell is NaN and matters only where its
column is used.
"""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError

Array = NDArray[np.float64]
_LARGEST_BYTES = 256 * 2**20


@dataclass(frozen=True)
class Table:
    """A table of numbers.

    Attributes:
        path: where it is from, for messages.
        columns: by name, each (rows,).
        lines: line of each row in the file.
    """

    path: Path
    columns: dict[str, Array]
    lines: tuple[int, ...]

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> Array:
        """A column of finite numbers.

        Raises:
            InputError: there is none, or a cell is no finite number.
        """
        if name not in self.columns:
            raise InputError(f"{self.path} has no column {name}; it has {', '.join(self.columns)}")
        column = self.columns[name]
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            raise InputError(f"{self.path}, line {self.lines[bad[0]]}: {name} is not a finite number; mend that row")
        return column

    def stack(self, names: tuple[str, ...]) -> Array:
        """Columns of finite numbers side by side, (rows, columns)."""
        return np.stack([self[name] for name in names], axis=-1)

    def rising_time(self, name: str = "t_s", *, strictly: bool = True) -> Array:
        """A column of times that rise from row to row; unless strictly, two rows may have the same time.

        Raises:
            InputError: as a column, or where time goes back.
        """
        time = self[name]
        change = np.diff(time)
        falls = np.flatnonzero(change <= 0 if strictly else change < 0)
        if falls.size:
            k = int(falls[0])
            raise InputError(
                f"{self.path}, line {self.lines[k + 1]}: time must rise from row to row, but {name} = "
                f"{time[k + 1]:g} follows {time[k]:g}; sort the rows"
                + (" and remove repeated ones" if strictly else "")
            )
        return time


def read_lines(path: str | Path) -> list[tuple[int, str]]:
    """The lines of a text file with their numbers, without blank ones and comments.

    Raises:
        InputError: it cannot be read, or is larger than any table of ours.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST_BYTES + 1)
        if len(content) > _LARGEST_BYTES:
            raise ValueError(f"it is larger than {_LARGEST_BYTES // 2**20} MB")
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}; give a text file") from error
    lines = enumerate(text.splitlines(), start=1)
    return [(i, line) for i, line in lines if line.strip(" ") and not line.lstrip().startswith("#")]


def read_table(path: str | Path, example: str) -> Table:
    """Read a table.

    Args:
        path: of the file.
        example: of its header, for messages.

    Raises:
        InputError: unreadable, no header, no rows, a row of another length, or a cell that is no number.
    """
    return table_of(path, read_lines(path), example)


def table_of(path: str | Path, lines: list[tuple[int, str]], example: str) -> Table:
    """The table of a file's lines, header first; arguments and errors as `read_table`'s."""
    if not lines:
        raise InputError(f"{path} is empty; it needs a header ({example}) and rows of numbers below")
    separator = max((",", ";", "\t"), key=lines[0][1].count)
    try:
        header = [name.strip() for name in next(csv.reader([lines[0][1]], delimiter=separator))]
    except csv.Error as error:
        raise InputError(f"{path} has no header that can be read ({error}); it needs {example}") from error
    if len(set(header)) != len(header):
        raise InputError(f"{path}: a column stands twice in the header {', '.join(header)}; name each once")
    if all(_number(name, separator) is not None for name in header):
        raise InputError(f"{path} begins with numbers; its first line must name the columns: {example}")
    if len(lines) < 2:
        raise InputError(f"{path} has no rows of numbers below its header; the header reads {', '.join(header)}")
    return numbers(path, tuple(header), lines[1:], separator)


def numbers(path: str | Path, header: tuple[str, ...], lines: list[tuple[int, str]], separator: str | None) -> Table:
    """The table of lines with their numbers; separator None for blanks.

    Raises:
        InputError: a row of another length, or a cell that is no number.
    """
    values = np.empty((len(lines), len(header)))
    for k, (line, text) in enumerate(lines):
        cells = text.split(separator)
        if len(cells) != len(header):
            raise InputError(
                f"{path}, line {line}: {len(cells)} cells, but there are {len(header)} columns "
                f"({', '.join(header)}); the file may be cut off there"
            )
        for j, cell in enumerate(cells):
            value = _number(cell, separator) if cell.strip() else math.nan
            if value is None:
                raise InputError(f"{path}, line {line}: {header[j]} is {cell.strip()!r}, not a number")
            values[k, j] = value
    return Table(Path(path), dict(zip(header, values.T, strict=True)), tuple(line for line, _ in lines))


def _number(cell: str, separator: str | None) -> float | None:
    text = cell.strip().strip('"')
    if "_" in text:  # which Python reads as a separator of thousands
        return None
    try:
        return float(text if separator == "," else text.replace(",", "."))
    except ValueError:
        return None
