"""Tables that people bring: CSV files of numbers with a header, read in one way everywhere.

    table = read_table("command.csv", "t_s,tau2_deg")
    table["t_s"]                                     # (rows,), finite numbers, or an error that names the line

Commas, semicolons or tabs between cells (with semicolons or tabs also decimal commas), any line ends, UTF-8 or
UTF-16, blank lines and lines that begin with # are skipped. An empty cell is NaN and matters only where its
column is used.
"""

import csv
import io
import math
from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import shown
from orient_eye.errors import InputError
from orient_eye.files import read_bytes, unreadable

Array = NDArray[np.float64]
_LARGEST_BYTES = 256 * 2**20
_HINT = "give a text file"
_MOST_LINES, _LONGEST_LINE = 5_000_000, 100_000
_LARGEST = 1e20  # of numbers: no measurement comes near, and no square or product of a few overflows
_SHORTEST_S = 1e-9
MISSING = frozenset(("", ".", "-", "n/a", "na", "nan", "null", "none"))
"""What other people's tables write where there is no value, in small letters."""


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
            InputError: there is none, or a cell is no finite number, or one beyond any measurement.
        """
        if name not in self.columns:
            raise InputError(f"{self.path} has no column {name}; it has {listed(self.columns)}")
        column = self.columns[name]
        bad = np.flatnonzero(~(np.abs(column) <= _LARGEST))
        if bad.size:
            what = f"beyond {_LARGEST:g}" if np.isfinite(column[bad[0]]) else "not a finite number"
            raise InputError(f"{self.path}, line {self.lines[bad[0]]}: {name} is {what}; mend that row")
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
        falls = np.flatnonzero(change < _SHORTEST_S if strictly else change < 0)
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
    return lines_of(path, read_bytes(path, most=_LARGEST_BYTES, hint=_HINT))


def lines_of(path: str | Path, content: bytes) -> list[tuple[int, str]]:
    """The lines of a file with this content; as `read_lines`."""
    try:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
        kept = []
        for number, line in enumerate(io.StringIO(text, newline=None), start=1):
            if number > _MOST_LINES or len(line) > _LONGEST_LINE:
                raise ValueError(f"it has more than {_MOST_LINES:,} lines, or one of {_LONGEST_LINE:,} characters")
            if line.strip(" \n") and not line.lstrip().startswith("#"):
                kept.append((number, line.removesuffix("\n")))
    except ValueError as error:
        raise unreadable(path, error, _HINT) from error
    return kept


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
    header, separator = header_of(path, lines, example)
    return numbers(path, header, lines[1:], separator)


def header_of(path: str | Path, lines: list[tuple[int, str]], example: str) -> tuple[tuple[str, ...], str]:
    """Names of the columns in the first line, and what stands between cells; arguments and errors as `table_of`'s."""
    if not lines:
        raise InputError(f"{path} is empty; it needs a header ({example}) and rows of numbers below")
    separator = max((",", ";", "\t"), key=lines[0][1].count)
    try:
        header = tuple(name.strip() for name in next(csv.reader([lines[0][1]], delimiter=separator)))
    except csv.Error as error:
        raise InputError(f"{path} has no header that can be read ({error}); it needs {example}") from error
    if len(set(header)) != len(header):
        raise InputError(f"{path}: a column stands twice in the header {listed(header)}; name each once")
    if all(_number(name, separator) is not None for name in header):
        raise InputError(f"{path} begins with numbers; its first line must name the columns: {example}")
    if len(lines) < 2:
        raise InputError(f"{path} has no rows of numbers below its header; the header reads {listed(header)}")
    return header, separator


def some_columns(
    path: str | Path, header: tuple[str, ...], lines: list[tuple[int, str]], separator: str, names: Iterable[str]
) -> Table:
    """The named columns of lines whose other cells may hold anything; a missing value (`MISSING`) is NaN.

    Raises:
        InputError: a row of another length, or a cell of these columns that is neither a number nor missing.
    """
    places = {name: header.index(name) for name in names}
    values = array("d")
    for line, text in lines:
        cells = next(csv.reader([text], delimiter=separator)) if '"' in text else text.split(separator)
        _check_length(path, line, cells, header)
        for name, j in places.items():
            cell = cells[j].strip()
            value = math.nan if cell.lower() in MISSING else _number(cell, separator)
            if value is None:
                raise InputError(f"{path}, line {line}: {name} is {shown(cell)}, not a number")
            values.append(value)
    columns = np.array(values).reshape(-1, len(places)).T
    return Table(Path(path), dict(zip(places, columns, strict=True)), tuple(line for line, _ in lines))


def _check_length(path: str | Path, line: int, cells: list[str], header: tuple[str, ...]) -> None:
    if len(cells) != len(header):
        raise InputError(
            f"{path}, line {line}: {len(cells)} cells, but there are {len(header)} columns "
            f"({listed(header)}); the file may be cut off there"
        )


def numbers(path: str | Path, header: tuple[str, ...], lines: list[tuple[int, str]], separator: str | None) -> Table:
    """The table of lines with their numbers; separator None for blanks.

    Raises:
        InputError: a row of another length, or a cell that is no number.
    """
    values = array("d")
    for line, text in lines:
        cells = text.split(separator)
        _check_length(path, line, cells, header)
        for j, cell in enumerate(cells):
            value = _number(cell, separator) if cell.strip() else math.nan
            if value is None:
                raise InputError(f"{path}, line {line}: {header[j]} is {shown(cell.strip())}, not a number")
            values.append(value)
    columns = np.array(values).reshape(-1, len(header)).T
    return Table(Path(path), dict(zip(header, columns, strict=True)), tuple(line for line, _ in lines))


def listed(names: Iterable[str]) -> str:
    """Names for a message, of many columns the first."""
    return shorten(", ".join(names), 500, placeholder=" ...")


def _number(cell: str, separator: str | None) -> float | None:
    text = cell.strip().strip('"')
    if "_" in text:  # which Python reads as a separator of thousands
        return None
    try:
        return float(text if separator == "," else text.replace(",", "."))
    except ValueError:
        return None
