"""A motor command as a CSV file: columns t_s, tau1_deg, tau2_deg, tau3_deg, any sampling.

The first row is the rest position; between rows the command is a straight line, two rows at the same
time are a jump. Columns of motors that are left out stay at 0.
"""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.movement.trajectory import motor_column
from orient_eye.plants import Plant

Array = NDArray[np.float64]


def read_command(path: str | Path, plant: Plant, *, horizon_s: float | None = None) -> Array:
    """Read a command, sampled at the plant's step.

    Args:
        path: the CSV file.
        plant: says which motors there are, and the step.
        horizon_s: duration [s]; the last row is held beyond the file's end. None: the file's own.

    Returns:
        Motor positions [deg], (1, time, motors).

    Raises:
        InputError: missing file, unknown or missing columns, numbers that are none, time that goes back,
            or a motor commanded that the plant lacks.
    """
    table, lines = _read_columns(Path(path))
    if "t_s" not in table:
        raise InputError(f"{path} has the columns {', '.join(table)}; it needs t_s [s] and tau1_deg, tau2_deg, ...")
    time = table.pop("t_s")
    columns = {motor_column(name): i for i, name in enumerate(plant.motors)}
    unknown = [c for c in table if c not in columns and not (_is_motor(c) and not table[c].any())]
    if unknown:
        raise InputError(
            f"{path}: plant {plant.name!r} cannot be commanded by {', '.join(unknown)}; its columns are t_s, "
            f"{', '.join(columns)} (columns of other motors must be 0)"
        )
    if not set(table) & set(columns):
        raise InputError(f"{path} commands no motor; add a column, one of {', '.join(columns)}")
    if (np.diff(time) < 0).any():
        line = lines[int(np.flatnonzero(np.diff(time) < 0)[0]) + 1]
        raise InputError(f"{path}, line {line}: t_s goes back; sort the rows by time")
    duration = time[-1] - time[0] if horizon_s is None else horizon_s
    if not 0 < duration <= 3600:
        raise InputError(f"a command lasts between one step and one hour, this one {duration:g} s")
    samples = round(duration / plant.step_s) + 1
    at = time[0] + plant.step_s * np.arange(samples)
    command = np.zeros((1, samples, len(plant.motors)))
    for name, index in columns.items():
        if name in table:
            command[0, :, index] = _interpolate(at, time, table[name])
    return command


def rest_position(path: str | Path, plant: Plant) -> Array:
    """Motor positions of the first row [deg], (1, motors): where the eye rests before the command."""
    table, _ = _read_columns(Path(path))
    return np.array([[table[c][0] if (c := motor_column(name)) in table else 0.0 for name in plant.motors]])


def _interpolate(at: Array, time: Array, values: Array) -> Array:
    """Straight lines; of two rows at the same time the later holds from that time on."""
    after = np.searchsorted(time, at + 1e-12, side="right")
    low, high = np.clip(after - 1, 0, len(time) - 1), np.clip(after, 0, len(time) - 1)
    span = time[high] - time[low]
    share = np.where(span > 0, (at - time[low]) / np.where(span > 0, span, 1), 0.0)
    return values[low] + np.clip(share, 0, 1) * (values[high] - values[low])


def _is_motor(column: str) -> bool:
    return column.startswith("tau") and column.endswith("_deg")


def _read_columns(path: Path) -> tuple[dict[str, Array], list[int]]:
    """Columns by name, and the line of each row."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            lines = [(reader.line_num, row) for row in reader if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot read {path}: {error}") from error
    if len(lines) < 2:
        raise InputError(f"{path} needs a header (t_s,tau1_deg,tau2_deg,tau3_deg) and at least one row of numbers")
    header = [name.strip() for name in lines[0][1]]
    values = []
    for line, row in lines[1:]:
        try:
            numbers = [float(x) for x in row]
        except ValueError as error:
            raise InputError(f"{path}, line {line}: {error}; every value is a number") from error
        if len(numbers) != len(header) or not np.isfinite(numbers).all():
            raise InputError(f"{path}, line {line}: needs {len(header)} finite numbers, got {row}")
        values.append(numbers)
    if len(set(header)) != len(header):
        raise InputError(f"{path}: a column stands twice in the header {', '.join(header)}")
    return dict(zip(header, np.array(values).T, strict=True)), [line for line, _ in lines[1:]]
