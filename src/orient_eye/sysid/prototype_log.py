"""Logs of the real three-motor eye (project ORIENT): 13 columns, no header, no time.

Positions and velocities of the three motors in counts, the eye's quaternion, three Euler angles. The
drive of a vertical movement is motor 1 - motor 3, each from its first row, in the direction of its
counts (motor 3 counts the other way, so both add up).

Time. The log has none; rows were meant to be 10 ms apart. Over a movement the motors' path divided by
their mean logged velocity gives 11.4 to 12.0 ms a row in every log we have, for both motors. Row by row
that ratio does not work: it falls from 45 ms at the start of every movement to 2 ms at its end, since the
logged velocity lags the logged position. With a lag T, the path between two rows dt apart is

    p[k+1] - p[k] = dt (v[k] + v[k+1])/2 + T (v[k+1] - v[k])

and least squares over both motors gives dt and T together. The eye agrees: with even rows the best linear
model leaves a fraction of the residual that it leaves with row-by-row times (docs/sysid.md has numbers).
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.rig import Rig
from orient_eye.rotations import rotation, to_euler
from orient_eye.sysid.step_response import StepResponse, axis_angle
from orient_eye.tables import Table

Array = NDArray[np.float64]
COLUMNS = (
    *(f"position{i}" for i in (1, 2, 3)),
    *(f"velocity{i}" for i in (1, 2, 3)),
    *("q_w", "q_x", "q_y", "q_z"),
    *("euler1_deg", "euler2_deg", "euler3_deg"),
)
ROW_TIMES = ("even", "row-by-row", "nominal")
"""even: one interval for all rows, found together with the lag; row-by-row: each interval from its own two
rows, no lag; nominal: 10 ms."""
POSITION_UNIT_DEG = 90 / 1024
CENTRE = 512
VELOCITY_UNIT_DEG_S = 0.111 * 6  # 0.111 rpm
NOMINAL_INTERVAL_S = 0.010
_FORMAT = "log of the ORIENT prototype"
_NEGATIVE = 1024  # added to a negative velocity
_SLOW_DEG_S = 3.0  # a motor that stands flickers by one count
_PLAUSIBLE_S = (0.002, 0.1)


def recognised(line: str) -> bool:
    """Whether a first line belongs to such a log."""
    try:
        return "," not in line and len([float(cell) for cell in line.split()]) == len(COLUMNS)
    except ValueError:
        return False


def motor_positions(table: Array) -> Array:
    """Positions of the motors from their first row [deg], in the direction of their counts, (rows, 3)."""
    return (table[:, 0:3] - table[0, 0:3]) * POSITION_UNIT_DEG


def motor_velocities(table: Array) -> Array:
    """Logged velocities [deg/s], in the direction of the counts, (rows, 3)."""
    counts = table[:, 3:6]
    return np.where(counts >= _NEGATIVE, _NEGATIVE - counts, counts) * VELOCITY_UNIT_DEG_S


def step_response(name: str, table: Array, axis: str | None = None, row_times: str = "even") -> StepResponse:
    """A log as a step response of the vertical movement.

    Args:
        name: of the log.
        table: its 13 columns, (rows, 13).
        axis: yaw, pitch or roll; None for the rotation about the axis of the movement, up positive.
        row_times: one of `ROW_TIMES`.

    Raises:
        InputError: quaternions that are not of unit length, or an unknown row_times.
    """
    if row_times not in ROW_TIMES:
        raise InputError(f"row times are told {', '.join(ROW_TIMES)}; got {row_times!r}")
    quaternion = table[:, 6:10]
    if (np.abs(np.linalg.norm(quaternion, axis=1) - 1) > 0.01).any():
        raise InputError(f"{name}: columns 7 to 10 of a prototype log are unit quaternions, these are not")
    position = motor_positions(table)
    time, found, warnings = _times(table, row_times)
    if axis is None:
        eye, about = _about_main_axis(quaternion)
        found |= {"axis_of_movement": np.round(about, 4).tolist()}
    else:
        eye = axis_angle(quaternion, axis)
        eye = eye - eye[0]
    drive = position[:, 0] - position[:, 2]
    warnings += _missed_eye_samples(eye, drive) + _retouched(table)
    source: dict[str, Any] = {
        "file": name,
        "format": _FORMAT,
        "motor": "motor1 - motor3",
        "eye": f"{axis} of the quaternion" if axis else "rotation about the axis of the movement, up positive",
        "rows": len(table),
        **found,
    }
    return StepResponse(
        name=name,
        time=time,
        motor_deg=drive,
        eye_deg=eye,
        orientation=quaternion,
        motors=_model_motors(table),
        drive="motor1 - motor3",
        axis=axis or "pitch",
        about=np.array(found["axis_of_movement"]) if axis is None else None,
        turned={each: float(np.ptp(axis_angle(quaternion, each))) for each in AXES} if axis else {},
        source=source,
        warnings=tuple(warnings),
    )


def in_the_rigs_sense(step: StepResponse, table: Table, rig: Rig, axis: str | None) -> StepResponse:
    """The same log driven by a rig's drive of an axis, None for pitch; the eye turns in the sense of that axis.

    Raises:
        InputError: the rig does not turn this axis, or has not the motors of the log.
    """
    about = axis or "pitch"
    rig.shares(about)
    counts = {f"motor{i}_counts": table[f"position{i}"] for i in (1, 2, 3)}
    drive = rig.from_driver(about, counts)
    way = -1.0 if axis is None else 1.0  # up, as the log is read, is where pitch is negative
    return replace(
        step,
        motor_deg=drive - drive[0],
        eye_deg=way * step.eye_deg,
        motors={m.name: m.from_driver(counts[m.column]) for m in rig.motors if m.column in counts},
        drive=rig.drive_name(about),
        about=None if step.about is None else way * step.about,
        source={**step.source, "motor": rig.drive_name(about)},
    )


def is_log(step: StepResponse) -> bool:
    """Whether a step response was read from such a log."""
    return step.source.get("format") == _FORMAT


def _model_motors(table: Array) -> dict[str, Array]:
    """Motor angles in the sense of the model, where positive tau1 and tau3 turn the eye down."""
    angle = (table[:, 0:3] - CENTRE) * POSITION_UNIT_DEG
    return {"motor1": -angle[:, 0], "motor2": angle[:, 1], "motor3": angle[:, 2]}


def _about_main_axis(quaternion: Array) -> tuple[Array, Array]:
    """Rotation from the first row [deg] along the axis of the largest one, and that axis (head frame)."""
    turned = (rotation(quaternion) * rotation(quaternion[0]).inv()).as_rotvec(degrees=True)
    size = np.linalg.norm(turned, axis=1)
    if size.max() == 0:
        return size, np.array([0.0, -1.0, 0.0])
    axis = turned[size.argmax()] / size.max()
    if axis[1] > 0:  # pitch is positive down
        axis = -axis
    return turned @ axis, axis


def _times(table: Array, how: str) -> tuple[Array, dict[str, Any], list[str]]:
    """Times of the rows [s], what they rest on, and warnings."""
    rows = len(table)
    interval = np.full(rows - 1, NOMINAL_INTERVAL_S)
    path = np.diff(motor_positions(table)[:, [0, 2]], axis=0)
    velocity = motor_velocities(table)[:, [0, 2]]
    mean, change = (velocity[1:] + velocity[:-1]) / 2, np.diff(velocity, axis=0)
    moving = (np.abs(mean) > _SLOW_DEG_S).any(axis=1)
    found: dict[str, Any] = {"row_times": how}
    warnings: list[str] = []
    if how == "even" and moving.sum() >= 4:
        estimate, half = _interval_and_lag(path.ravel(), mean.ravel(), change.ravel())
        if _PLAUSIBLE_S[0] < estimate[0] < _PLAUSIBLE_S[1]:
            interval[:] = estimate[0]
            found |= {
                "row_interval_ms": 1e3 * float(estimate[0]),
                "row_interval_half_width_ms": 1e3 * float(half[0]),
                "velocity_lag_ms": 1e3 * float(estimate[1]),
                "velocity_lag_half_width_ms": 1e3 * float(half[1]),
            }
            warnings.append(
                f"the log has no time: rows taken {1e3 * estimate[0]:.1f} ± {1e3 * half[0]:.1f} ms (95 %) apart; "
                f"rates and dead times share that {100 * half[0] / estimate[0]:.0f} %, which no interval below includes"
            )
        else:
            how = "implausible"
    elif how == "row-by-row":
        interval[moving] = (path * mean).sum(axis=1)[moving] / (mean**2).sum(axis=1)[moving]
        interval = np.clip(interval, 0.001, None)
        warnings.append("row-by-row times ignore that the logged velocity lags the position; see docs/sysid.md")
    if how in ("implausible", "nominal") or not moving.any():
        warnings.append("rows are taken to be 10 ms apart, as they were meant to be; the motors do not confirm it")
    return np.append(0.0, np.cumsum(interval)), found, warnings


def _interval_and_lag(path: Array, mean: Array, change: Array) -> tuple[Array, Array]:
    """Least squares of path = dt mean + T change, and half widths of the 95 % intervals [s]."""
    columns = np.stack([mean, change], axis=1)
    moving = np.abs(columns).sum(axis=1) > 0
    columns, path = columns[moving], path[moving]
    estimate, *_ = np.linalg.lstsq(columns, path, rcond=None)
    freedom = len(path) - 2
    variance = float(np.sum((path - columns @ estimate) ** 2)) / freedom
    half = stats.t.ppf(0.975, freedom) * np.sqrt(variance * np.diag(np.linalg.pinv(columns.T @ columns)))
    return estimate, half


def _missed_eye_samples(eye: Array, drive: Array) -> list[str]:
    """Rows into which the eye went about twice as far as into the rows beside it, while the motors did not."""
    jump, push = np.abs(np.diff(eye)), np.abs(np.diff(drive))
    beside, pushed = (jump[2:] + jump[:-2]) / 2, (push[2:] + push[:-2]) / 2
    strange = (jump[1:-1] > 1.7 * beside) & (jump[1:-1] > 0.05 * np.abs(eye).max()) & (push[1:-1] < 1.4 * pushed)
    rows = [int(k) + 3 for k in np.flatnonzero(strange)]
    if not rows:
        return []
    return [f"the eye's angle misses a sample before row {', '.join(map(str, rows))}: it jumps where the motors do not"]


def _retouched(table: Array) -> list[str]:
    """Rows whose Euler angles are not those of their quaternion."""
    yaw, pitch, roll = to_euler(table[:, 6:10])
    off = np.abs(table[:, 10:13] - np.stack([roll, pitch, yaw], axis=1)).max(axis=1)
    rows = np.flatnonzero(off > 0.01)
    if not rows.size:
        return []
    return [
        f"the Euler columns differ from the quaternion by up to {off.max():.1f} deg in {rows.size} rows "
        f"({rows[0] + 1} to {rows[-1] + 1}); the quaternion is used"
    ]
