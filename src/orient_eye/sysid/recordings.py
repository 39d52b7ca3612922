"""Step responses from files: the plain CSV format, `trajectory.csv` of `orient-eye simulate`, the rig's logs.

    steps = [read_recording(path) for path in paths]

The formats are described in docs/sysid.md. A log of the prototype is recognised by its content:
13 columns separated by blanks, no header (see `prototype_log.py`).
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.errors import InputError
from orient_eye.movement.trajectory import motor_column
from orient_eye.sysid import prototype_log
from orient_eye.sysid.step_response import AXES, StepResponse, axis_angle

Array = NDArray[np.float64]
MIN_ROWS = 8
_MOTORS = tuple(f"motor{i}" for i in range(1, 7))
_QUATERNION = ("q_w", "q_x", "q_y", "q_z")


def read_recordings(
    paths: Sequence[Path],
    motor: str | None = None,
    axis: str | None = None,
    row_times: str = "even",
    until: float | None = None,
) -> tuple[StepResponse, ...]:
    """Read several recordings; see `read_recording`.

    Args:
        paths: of the files.
        motor: see `read_recording`.
        axis: see `read_recording`.
        row_times: see `read_recording`.
        until: leave out what comes after this time [s], in the clock of the files; None for nothing.

    Raises:
        InputError: also when a file is named twice, or fewer than 8 rows are left.
    """
    resolved = [path.resolve() for path in paths]
    for path in resolved:
        if resolved.count(path) > 1:
            raise InputError(f"{path.name} is named twice; a recording counts once")
    steps = tuple(read_recording(path, motor, axis, row_times) for path in paths)
    if until is None:
        return steps
    for step in steps:
        rows = int((step.time <= until).sum())
        if rows < MIN_ROWS or np.ptp(step.motor_deg[:rows]) == 0:
            raise InputError(
                f"{step.name} has {rows} rows until {until:g} s; at least {MIN_ROWS} are needed, with a motor that "
                "moves: name a later time"
            )
    return tuple(step.until(until) for step in steps)


def read_recording(
    path: Path, motor: str | None = None, axis: str | None = None, row_times: str = "even"
) -> StepResponse:
    """Read one recorded step response.

    Args:
        path: a CSV file, or a log of the prototype.
        motor: whose column drives the eye (motor2: tau2_deg); None: the column motor_deg, else tau2_deg.
        axis: which angle of the eye is measured: yaw, pitch or roll; None: the column eye_deg, else yaw,
            and in a prototype log the rotation about the axis of its movement, up positive.
        row_times: how the time of a prototype log is told: one of `prototype_log.ROW_TIMES`.

    Raises:
        InputError: unreadable, no such columns, fewer than 8 rows, numbers that are not finite, time that
            does not rise, or a motor that does not move.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the recording {path}: {error}; give a text file, see docs/sysid.md") from error
    lines = [(i, line.strip()) for i, line in enumerate(text.splitlines(), start=1)]
    lines = [(i, line) for i, line in lines if line and not line.startswith("#")]
    if not lines:
        raise InputError(f"{path} is empty; a recording has a header line and at least {MIN_ROWS} rows")
    if prototype_log.recognised(lines[0][1]):
        table = _numbers(path, [(i, line.split()) for i, line in lines], prototype_log.COLUMNS)
        for name, column in zip(prototype_log.COLUMNS, table.T, strict=True):
            _column(path, {name: column}, name)
        step = prototype_log.step_response(Path(path).name, table, axis, row_times)
    else:
        header = [name.strip() for name in lines[0][1].split(",")]
        if "t_s" not in header:
            raise InputError(
                f"{path} has no column t_s; its first line reads {lines[0][1][:60]!r}. A recording is a table with "
                "commas between its cells, and its first line names the columns: see docs/sysid.md"
            )
        if len(set(header)) != len(header):
            raise InputError(f"{path} names a column twice: {', '.join(header)}; name each once")
        table = _numbers(path, [(i, line.split(",")) for i, line in lines[1:]], tuple(header))
        step = _from_table(path, dict(zip(header, table.T, strict=True)), motor, axis)
    if float(np.ptp(step.motor_deg)) == 0:
        raise InputError(
            f"{path}: the motor does not move, so nothing can be identified; the recording must begin at rest, "
            "before the step"
        )
    return step


def _numbers(path: Path, rows: list[tuple[int, list[str]]], columns: tuple[str, ...]) -> Array:
    """All cells as numbers (rows, columns); an empty cell is NaN and matters only where it is used."""
    if len(rows) < MIN_ROWS:
        raise InputError(f"{path} has {len(rows)} rows of numbers; a step response needs at least {MIN_ROWS}")
    table = np.empty((len(rows), len(columns)))
    for k, (line, cells) in enumerate(rows):
        if len(cells) != len(columns):
            raise InputError(
                f"{path}, line {line}: {len(cells)} cells, but there are {len(columns)} columns "
                f"({', '.join(columns)}); the file may be cut off there"
            )
        for j, cell in enumerate(cells):
            try:
                table[k, j] = float(cell) if cell.strip() else math.nan
            except ValueError:
                raise InputError(f"{path}, line {line}: {columns[j]} is {cell.strip()!r}, not a number") from None
    return table


def _from_table(path: Path, table: dict[str, Array], motor: str | None, axis: str | None) -> StepResponse:
    time = _column(path, table, "t_s")
    falls = np.flatnonzero(np.diff(time) <= 0)
    if falls.size:
        k = int(falls[0])
        raise InputError(
            f"{path}: time must rise from row to row, but t_s = {time[k + 1]:g} follows {time[k]:g} (rows {k + 1}, "
            f"{k + 2}); sort the rows and remove repeated ones"
        )
    rest = time < 0 if time[0] < 0 else np.arange(len(time)) == 0
    motor_name = motor_column(motor) if motor else "motor_deg" if "motor_deg" in table else motor_column("motor2")
    drive = _column(path, table, motor_name)
    orientation = None
    if all(name in table for name in _QUATERNION):
        orientation = np.stack([_column(path, table, name) for name in _QUATERNION], axis=-1)
        norm = np.linalg.norm(orientation, axis=-1, keepdims=True)
        if (np.abs(norm - 1) > 0.01).any():
            raise InputError(f"{path}: q_w, q_x, q_y, q_z must be unit quaternions, got a length of {norm.min():.3g}")
        orientation = orientation / norm
    eye_name, eye = _eye(path, table, orientation, axis)
    # Times are read as seconds; a step of the eye is over in far less than 50 rows of 0.5 s.
    slow = float(np.median(np.diff(time))) > 0.5
    return StepResponse(
        name=Path(path).name,
        time=time,
        motor_deg=drive - drive[rest].mean(),
        eye_deg=eye - eye[rest].mean(),
        orientation=orientation,
        motors={m: table[motor_column(m)] for m in _MOTORS if motor_column(m) in table},
        source={"file": Path(path).name, "format": "csv", "motor": motor_name, "eye": eye_name, "rows": len(time)},
        warnings=("rows are more than 0.5 s apart; are the times in ms? t_s is in s",) if slow else (),
    )


def _eye(path: Path, table: dict[str, Array], orientation: Array | None, axis: str | None) -> tuple[str, Array]:
    """Name and values of the measured angle of the eye."""
    if axis is None and "eye_deg" in table:
        return "eye_deg", _column(path, table, "eye_deg")
    axis = axis or "yaw"
    name = f"{axis}_deg"
    if name in table:
        return name, np.unwrap(_column(path, table, name), period=360.0)
    if orientation is not None and axis in AXES:
        return f"{axis} of q_w..q_z", axis_angle(rotations.rotation(orientation).as_quat(scalar_first=True), axis)
    raise InputError(
        f"{path} has no angle of the eye: no column eye_deg, {name}, or q_w, q_x, q_y, q_z; it has {', '.join(table)}. "
        "See docs/sysid.md for the format"
    )


def _column(path: Path, table: dict[str, Array], name: str) -> Array:
    if name not in table:
        hint = "; choose with --motor" if name.startswith(("tau", "motor")) else "; see docs/sysid.md for the format"
        raise InputError(f"{path} has no column {name}; it has {', '.join(table)}{hint}")
    column = table[name]
    if not np.isfinite(column).all():
        row = int((~np.isfinite(column)).argmax()) + 1
        raise InputError(f"{path}: {name} is not a finite number in row {row}; remove or mend that row")
    return column
