"""Step responses from files: a table of numbers, `trajectory.csv` of `orient-eye simulate`, the rig's logs.

    steps = read_recordings(paths)                                  # columns t_s, motor_deg, eye_deg
    steps = read_recordings(paths, axis="pitch", rig=Rig.load("rig.toml"))  # the motors as their driver tells them

The formats are described in docs/sysid.md. A log of the prototype is recognised by its content:
13 columns separated by blanks, no header (see `prototype_log.py`).
"""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.rig import Rig
from orient_eye.sysid import prototype_log
from orient_eye.sysid.motor_columns import axis_of, driven_by_motor, driven_by_rig
from orient_eye.sysid.recording_checks import noise_of
from orient_eye.sysid.step_response import StepResponse, axis_angle
from orient_eye.tables import Table, numbers, read_lines, table_of

Array = NDArray[np.float64]
MIN_ROWS = 8
_EXAMPLE = "t_s,motor_deg,eye_deg"
_QUATERNION = ("q_w", "q_x", "q_y", "q_z")
_STANDS_DEG = 1e-9  # less is no movement
_STARTED = 0.005  # of the motor's way: then it has begun to move


def read_recordings(
    paths: Sequence[Path],
    motor: str | None = None,
    axis: str | None = None,
    row_times: str = "even",
    until: float | None = None,
    rig: Rig | None = None,
) -> tuple[StepResponse, ...]:
    """Read several recordings; see `read_recording`.

    Args:
        paths: of the files.
        motor: see `read_recording`.
        axis: see `read_recording`.
        row_times: see `read_recording`.
        until: leave out what comes after this time [s], in the clock of the files; None for nothing.
        rig: see `read_recording`.

    Raises:
        InputError: also when a file is named twice, or fewer than 8 rows are left.
    """
    refuse_twice(paths)
    steps = tuple(read_recording(path, motor, axis, row_times, rig) for path in paths)
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


def refuse_twice(paths: Sequence[Path]) -> None:
    """Raise InputError where a file is named twice, by any names."""
    there = [os.path.realpath(path) for path in paths if os.path.exists(path)]
    for path in there:
        if there.count(path) > 1:
            raise InputError(f"{os.path.basename(path)} is named twice; a recording counts once")


def read_recording(
    path: Path,
    motor: str | None = None,
    axis: str | None = None,
    row_times: str = "even",
    rig: Rig | None = None,
) -> StepResponse:
    """Read one recorded step response.

    Args:
        path: a table, or a log of the prototype.
        motor: whose column drives the eye (motor2: tau2_deg); None: the column motor_deg, else tau2_deg.
        axis: which angle of the eye is measured: yaw, pitch or roll; None: the column eye_deg, else that of
            the three that turns most, and in a prototype log the rotation about the axis of its movement, up positive.
        row_times: how the time of a prototype log is told: one of `prototype_log.ROW_TIMES`.
        rig: that was recorded: its drive of the axis is what moves the eye, in the sense of the rig; None where
            the table tells its one motor in deg.

    Raises:
        InputError: unreadable, no such columns, fewer than 8 rows, numbers that are not finite, time that
            does not rise, a motor that does not move, or a motor beside a rig.
    """
    if rig is not None and motor is not None:
        raise InputError(f"the rig {rig.name!r} says what drives the eye; leave the motor {motor!r} out")
    lines = read_lines(path)
    if lines and prototype_log.recognised(lines[0][1]):
        step, table = log_of(path, lines, axis, row_times)
        step = step if rig is None else prototype_log.in_the_rigs_sense(step, table, rig, axis)
    else:
        step = _from_table(_long_enough(table_of(path, lines, _EXAMPLE)), motor, axis, rig)
    return _moving(step)


def log_of(
    path: Path, lines: list[tuple[int, str]], axis: str | None = None, row_times: str = "even"
) -> tuple[StepResponse, Table]:
    """The step response of a prototype log's lines, and its table; arguments and errors as `read_recording`'s."""
    table = _long_enough(numbers(path, prototype_log.COLUMNS, lines, None))
    step = prototype_log.step_response(Path(path).name, table.stack(prototype_log.COLUMNS), axis, row_times)
    return _moving(step), table


def _moving(step: StepResponse) -> StepResponse:
    if np.ptp(step.motor_deg) < _STANDS_DEG:
        raise InputError(
            f"{step.name}: the motor does not move, so nothing can be identified; the recording must begin at rest, "
            "before the step"
        )
    return step


def _long_enough(table: Table) -> Table:
    if len(table.lines) < MIN_ROWS:
        raise InputError(
            f"{table.path} has {len(table.lines)} rows of numbers; a step response needs at least {MIN_ROWS}"
        )
    return table


def _from_table(table: Table, motor: str | None, axis: str | None, rig: Rig | None) -> StepResponse:
    time = times_of(table)
    axis = axis if rig is None else axis_of(rig, axis)
    driven = driven_by_motor(table, motor) if rig is None else driven_by_rig(table, rig, axis or "yaw")
    eye_name, eye, orientation = eye_of(table, axis)
    resting = _resting(time, driven.position)
    rest = float(driven.position[resting].mean()), float(eye[resting].mean())
    source = {"file": table.path.name, "format": "csv", "motor": driven.columns, "eye": eye_name, "rows": len(time)}
    return StepResponse(
        name=table.path.name,
        time=time,
        motor_deg=driven.position - rest[0],
        eye_deg=eye - rest[1],
        orientation=orientation,
        motors=driven.motors,
        drive=driven.name,
        axis=axis or (None if eye_name == "eye_deg" else eye_name.split("_")[0].split(" ")[0]),
        rest=rest,
        turned=_turned(table, orientation),
        source=source,
        warnings=driven.warnings,
    )


def times_of(table: Table) -> Array:
    """Times of the rows [s], rising.

    Raises:
        InputError: no column t_s, or time that does not rise.
    """
    if "t_s" not in table:
        other = [name for name in ("t_ms", "time_ms", "t_us", "t", "time", "time_s") if name in table]
        what = f"; name {other[0]} t_s and give it in s" if other else ""
        raise InputError(f"{table.path} has no column t_s, the time in s; it has {', '.join(table.columns)}{what}")
    return table.rising_time()


def _resting(time: Array, position: Array) -> NDArray[np.bool_]:
    """Rows of rest: those before time 0, else those before the motor moves, at least the first."""
    if time[0] < 0:
        return np.asarray(time < 0)
    begun = np.abs(position - position[0]) > max(_STARTED * np.ptp(position), 4 * noise_of(time, position))
    first = int(begun.argmax()) if begun.any() else 1
    return np.asarray(np.arange(len(time)) < max(first - 1, 1))


def _turned(table: Table, orientation: Array | None) -> dict[str, float]:
    """How far the eye turned in each angle that the table tells [deg]."""
    if orientation is not None:
        turned = (rotations.rotation(orientation) * rotations.rotation(orientation[0]).inv()).as_rotvec(degrees=True)
        return {axis: float(np.ptp(turned[:, rotations.AXES[axis]])) for axis in AXES}
    told = {axis: table.columns[f"{axis}_deg"] for axis in AXES if f"{axis}_deg" in table}
    return {axis: float(np.ptp(angle)) for axis, angle in told.items() if np.isfinite(angle).all()}


def eye_of(table: Table, axis: str | None) -> tuple[str, Array, Array | None]:
    """The measured angle of the eye: where it is from, its values [deg] (rows,), and orientations (rows, 4) or None.

    Args:
        table: of a recording.
        axis: yaw, pitch or roll; None for the column eye_deg, else that of the three that turns most.

    Raises:
        InputError: no such column, or quaternions that are none.
    """
    orientation = None
    if all(name in table for name in _QUATERNION):
        orientation = table.stack(_QUATERNION)
        norm = np.linalg.norm(orientation, axis=-1, keepdims=True)
        if (np.abs(norm - 1) > 0.01).any():
            raise InputError(
                f"{table.path}: {', '.join(_QUATERNION)} must be unit quaternions, got a length of {norm.min():.3g}"
            )
        orientation = orientation / norm
    if axis is None and "eye_deg" in table:
        return "eye_deg", table["eye_deg"], orientation
    turned = _turned(table, orientation)
    axis = axis or max(turned, key=turned.__getitem__, default="yaw")
    name = f"{axis}_deg"
    if name in table:
        return name, np.unwrap(table[name], period=360.0), orientation
    if orientation is not None:
        angle = axis_angle(rotations.rotation(orientation).as_quat(scalar_first=True), axis)
        return f"{axis} of q_w..q_z", angle, orientation
    if "eye_deg" in table:
        return "eye_deg", table["eye_deg"], orientation
    radians = [c for c in table.columns if c.endswith("_rad") and c.split("_")[0] in ("eye", *AXES)]
    advice = f"; {radians[0]} is in rad: multiply it by 57.29578 and name it eye_deg" if radians else ""
    raise InputError(
        f"{table.path} has no angle of the eye: no column eye_deg, {name}, or {', '.join(_QUATERNION)}; it has "
        f"{', '.join(table.columns)}{advice}. See docs/sysid.md for the format"
    )
