"""Recordings for `physical`: an eye's angles about any axes, and where its motors were.

recordings = read_recordings(paths, "thesis")                       # tables, or logs of the prototype
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model, motors
from orient_eye.motor import Motor, rests
from orient_eye.rig import Rig
from orient_eye.rotations import rotation, to_euler
from orient_eye.sysid import prototype_log
from orient_eye.sysid.recordings import MIN_ROWS, log_of, refuse_twice
from orient_eye.tables import read_lines, table_of

Array = NDArray[np.float64]
_STANDS_DEG = 1e-9  # less is no movement
_QUATERNION = ("q_w", "q_x", "q_y", "q_z")


@dataclass(frozen=True)
class Measured:
    """A recorded movement of an eye and its motors.

    Attributes:
        name: of the file.
        time: [s], rising, any spacing, (rows,).
        motor: measured positions of all motors of the eye [deg], (rows, motors).
        axes: which angles were measured, of yaw, pitch, roll.
        angles: [deg], (rows, axes).
        warnings: of the reader.
    """

    name: str
    time: Array
    motor: Array
    axes: tuple[str, ...]
    angles: Array
    warnings: tuple[str, ...] = ()

    def until(self, time: float) -> "Measured":
        """Its rows up to a time [s]."""
        kept = self.time <= time
        if kept.sum() < MIN_ROWS or not np.ptp(self.motor[kept], axis=0).any():
            raise InputError(
                f"{self.name} has {kept.sum()} rows until {time:g} s; at least {MIN_ROWS} are needed, with a motor "
                "that moves: name a later time"
            )
        return replace(self, time=self.time[kept], motor=self.motor[kept], angles=self.angles[kept])


def read_recordings(
    paths: Sequence[Path],
    eye: str = "thesis",
    row_times: str = "even",
    until: float | None = None,
    rig: Rig | None = None,
) -> tuple[Measured, ...]:
    """Read recordings of an eye; see `read_physical`.

    Args:
        paths: of the files.
        eye: whose motors they are.
        row_times: see `read_physical`.
        until: leave out what comes after this time [s], in the clock of the files; None for nothing.
        rig: see `read_physical`.

    Raises:
        InputError: also when a file is named twice, or fewer than 8 rows are left.
    """
    refuse_twice(paths)
    eye_motors = motors(build_model(eye, visual=False))
    read = tuple(read_physical(Path(path), eye_motors, row_times, rig) for path in paths)
    return read if until is None else tuple(each.until(until) for each in read)


def read_physical(path: Path, eye_motors: Sequence[Motor], row_times: str = "even", rig: Rig | None = None) -> Measured:
    """Read a recording: a table as `orient-eye simulate` writes it, or a log of the prototype.

    Columns: t_s; a motor's (tau2_deg) where it moved, motors without one stand at rest; q_w, q_x, q_y, q_z, or any of
    yaw_deg, pitch_deg, roll_deg. Others are ignored.

    Args:
        path: of the file.
        eye_motors: of the eye that is to be fitted.
        row_times: of a prototype log, see `recordings.read_recording`.
        rig: whose motors of the same names tell their positions in their driver's units, in its columns.

    Raises:
        InputError: unreadable, no such columns, fewer than 8 rows, time that does not rise, or motors that stand.
    """
    lines = read_lines(path)
    if lines and prototype_log.recognised(lines[0][1]):
        step, _ = log_of(path, lines, row_times=row_times)
        if step.orientation is None or any(motor.name not in step.motors for motor in eye_motors):
            raise InputError(f"{path}: the prototype has motor1, motor2 and motor3, this eye has others; give a table")
        driven = np.stack([step.motors[motor.name] for motor in eye_motors], axis=-1)
        return Measured(step.name, step.time, driven, AXES, angles_of(step.orientation), step.warnings)
    table = table_of(path, lines, "t_s,tau2_deg,yaw_deg,pitch_deg,roll_deg")
    if len(table.lines) < MIN_ROWS:
        raise InputError(f"{path} has {len(table.lines)} rows of numbers; a recording needs at least {MIN_ROWS}")
    time = table.rising_time()
    motor = np.tile(rests(eye_motors), (len(time), 1))
    spoken = {} if rig is None else {m.name: m for m in rig.motors}
    columns = {m.name: spoken[m.name].column if m.name in spoken else m.column for m in eye_motors}
    for i, each in enumerate(eye_motors):
        if columns[each.name] in table:
            told = table[columns[each.name]]
            motor[:, i] = spoken[each.name].from_driver(told) if each.name in spoken else told
    if (np.ptp(motor, axis=0) < _STANDS_DEG).all():
        raise InputError(
            f"{path}: no motor of this eye moves; its columns are {', '.join(columns.values())}, the file has "
            f"{', '.join(table.columns)}"
        )
    if all(name in table for name in _QUATERNION):
        quaternion = table.stack(_QUATERNION)
        if (np.abs(np.linalg.norm(quaternion, axis=-1) - 1) > 0.01).any():
            raise InputError(f"{path}: {', '.join(_QUATERNION)} must be unit quaternions, some are not")
        return Measured(path.name, time, motor, AXES, angles_of(quaternion))
    axes = tuple(axis for axis in AXES if f"{axis}_deg" in table)
    if not axes:
        raise InputError(
            f"{path} has no angle of the eye: no column yaw_deg, pitch_deg, roll_deg, or {', '.join(_QUATERNION)}; it "
            f"has {', '.join(table.columns)}"
        )
    angles = np.stack([np.unwrap(table[f"{axis}_deg"], period=360.0) for axis in axes], axis=-1)
    return Measured(path.name, time, motor, axes, angles)


def angles_of(orientation: Array) -> Array:
    """Yaw, pitch, roll [deg] (..., time, 3) without jumps, of orientations (..., time, 4)."""
    return np.unwrap(np.stack(to_euler(rotation(orientation).as_quat(scalar_first=True)), axis=-1), period=360, axis=-2)
