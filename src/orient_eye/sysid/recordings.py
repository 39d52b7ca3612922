"""Step responses from files: a table of numbers, `trajectory.csv` of `orient-eye simulate`, the rig's logs.

    steps = [read_recording(path) for path in paths]

The formats are described in docs/sysid.md. A log of the prototype is recognised by its content:
13 columns separated by blanks, no header (see `prototype_log.py`).
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.errors import InputError
from orient_eye.motor import Motor
from orient_eye.sysid import prototype_log
from orient_eye.sysid.step_response import AXES, StepResponse, axis_angle
from orient_eye.tables import Table, numbers, read_lines, table_of

Array = NDArray[np.float64]
MIN_ROWS = 8
_EXAMPLE = "t_s,motor_deg,eye_deg"
_UNNAMED = Motor("motor")  # its column is motor_deg
_USUAL = Motor("motor2")
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
        path: a table, or a log of the prototype.
        motor: whose column drives the eye (motor2: tau2_deg); None: the column motor_deg, else tau2_deg.
        axis: which angle of the eye is measured: yaw, pitch or roll; None: the column eye_deg, else yaw,
            and in a prototype log the rotation about the axis of its movement, up positive.
        row_times: how the time of a prototype log is told: one of `prototype_log.ROW_TIMES`.

    Raises:
        InputError: unreadable, no such columns, fewer than 8 rows, numbers that are not finite, time that
            does not rise, or a motor that does not move.
    """
    lines = read_lines(path)
    if lines and prototype_log.recognised(lines[0][1]):
        table = _long_enough(numbers(path, prototype_log.COLUMNS, lines, None))
        step = prototype_log.step_response(Path(path).name, table.stack(prototype_log.COLUMNS), axis, row_times)
    else:
        step = _from_table(_long_enough(table_of(path, lines, _EXAMPLE)), motor, axis)
    if float(np.ptp(step.motor_deg)) == 0:
        raise InputError(
            f"{path}: the motor does not move, so nothing can be identified; the recording must begin at rest, "
            "before the step"
        )
    return step


def _long_enough(table: Table) -> Table:
    if len(table.lines) < MIN_ROWS:
        raise InputError(
            f"{table.path} has {len(table.lines)} rows of numbers; a step response needs at least {MIN_ROWS}"
        )
    return table


def _from_table(table: Table, motor: str | None, axis: str | None) -> StepResponse:
    time = table.rising_time()
    rest = time < 0 if time[0] < 0 else np.arange(len(time)) == 0
    drive = Motor(motor) if motor else _UNNAMED if _UNNAMED.column in table else _USUAL
    position = table[drive.column]
    orientation = None
    if all(name in table for name in _QUATERNION):
        orientation = table.stack(_QUATERNION)
        norm = np.linalg.norm(orientation, axis=-1, keepdims=True)
        if (np.abs(norm - 1) > 0.01).any():
            raise InputError(
                f"{table.path}: {', '.join(_QUATERNION)} must be unit quaternions, got a length of {norm.min():.3g}"
            )
        orientation = orientation / norm
    eye_name, eye = _eye(table, orientation, axis)
    # Times are read as seconds; a step of the eye is over in far less than 50 rows of 0.5 s.
    slow = float(np.median(np.diff(time))) > 0.5
    return StepResponse(
        name=table.path.name,
        time=time,
        motor_deg=position - position[rest].mean(),
        eye_deg=eye - eye[rest].mean(),
        orientation=orientation,
        motors={m.name: table.columns[m.column] for m in (drive, *_numbered(table))},
        source={"file": table.path.name, "format": "csv", "motor": drive.column, "eye": eye_name, "rows": len(time)},
        warnings=("rows are more than 0.5 s apart; are the times in ms? t_s is in s",) if slow else (),
    )


def _numbered(table: Table) -> list[Motor]:
    """The motors whose columns are there: tau1_deg and so on."""
    possible = [Motor(f"motor{i}") for i in range(1, len(table.columns) + 1)]
    return [motor for motor in possible if motor.column in table]


def _eye(table: Table, orientation: Array | None, axis: str | None) -> tuple[str, Array]:
    """Name and values of the measured angle of the eye."""
    if axis is None and "eye_deg" in table:
        return "eye_deg", table["eye_deg"]
    axis = axis or "yaw"
    name = f"{axis}_deg"
    if name in table:
        return name, np.unwrap(table[name], period=360.0)
    if orientation is not None and axis in AXES:
        return f"{axis} of q_w..q_z", axis_angle(rotations.rotation(orientation).as_quat(scalar_first=True), axis)
    raise InputError(
        f"{table.path} has no angle of the eye: no column eye_deg, {name}, or {', '.join(_QUATERNION)}; it has "
        f"{', '.join(table.columns)}. See docs/sysid.md for the format"
    )
