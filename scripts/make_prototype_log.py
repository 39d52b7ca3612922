"""Step responses of a simulated rig, logged as the prototype logs them, with every parameter known.

    python scripts/make_prototype_log.py runs/made_logs
    orient-eye sysid --recording runs/made_logs/*.txt

The logs of the real rig may not be given away; the tests read these instead. The rig is a differential equation
and knows nothing of `orient_eye.sysid`, so what is found in its logs can be held against what was put in.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from orient_eye.errors import InputError
from orient_eye.files import write_text

Array = NDArray[np.float64]

COUNT_DEG = 90 / 1024
COUNT_DEG_S = 0.111 * 360 / 60  # 0.111 rpm
REST_COUNTS = np.array([305.0, 510.0, 706.0])  # 512 is straight ahead
REST = Rotation.from_euler("ZYX", [4.0, 29.5, 1.5], degrees=True)  # the eye looks down
AXIS = np.array([0.05, -0.99, -0.05])  # of the movement, in the head frame: up, and a little aside


@dataclass(frozen=True)
class Rig:
    """Motors 1 and 3 under position control, an eye of second order that they turn up, and a program that logs.

    A motor seeks the speed position_gain (goal - position), at most its limit, and comes to it with a lag. The eye
    follows motor 1 - motor 3 (motor 3 counts the other way, so both add up) after a dead time.
    """

    gain: float = 0.75
    """Eye per motor 1 - motor 3, deg/deg."""
    wn: float = 80.0
    """Natural frequency of the eye, rad/s."""
    zeta: float = 0.35
    """Damping of the eye."""
    dead_time_s: float = 0.012
    """Of the eye behind its motors, s."""
    position_gain: float = 40.0
    """Of the motors, 1/s."""
    motor_lag_s: float = 0.006
    """Of a motor behind the speed it seeks, s."""
    speed_limit_deg_s: float = 349.0
    """Of a motor, deg/s: what the real ones were seen to reach."""
    row_interval_s: float = 0.0115
    """Between rows, s; nominally 0.010."""
    velocity_lag_s: float = 0.016
    """Of the logged velocity behind the motor's own, s."""
    eye_interval_s: float = 0.0
    """Between samples of the eye's sensor, s: a row holds the latest. 0: the sensor answers when it is asked."""
    eye_noise_deg: float = 0.03
    """Standard deviation of the eye's orientation about each axis, deg."""


def make_logs(rig: Rig, steps_deg: ArrayLike, rng: np.random.Generator, rows: int = 100, dropped: int = 0) -> Array:
    """Logs of steps up, from rest.

    Args:
        rig: what moves, and what logs it.
        steps_deg: of motor 1 - motor 3 [deg], (logs,).
        rng: draws where between its first two rows a log's step falls, which rows are dropped, the phase of the eye's
            sensor, and its noise.
        rows: of each log.
        dropped: rows of each log that were due and are missing; never the first.

    Returns:
        (logs, rows, 13): positions of motors 1 to 3 [counts], their velocities [counts; 1024 is added to the size of
        negative ones], quaternion w x y z, Euler angles roll, pitch, yaw [deg].

    Raises:
        InputError: steps that are not positive or leave the counts of the motors, fewer than 2 rows, dropped below 0.
    """
    steps = np.asarray(steps_deg, dtype=float)
    largest = 2 * REST_COUNTS[2] * COUNT_DEG  # motor 3 counts down to 0
    if steps.ndim != 1 or not ((steps > 0) & (steps < largest)).all():
        raise InputError(f"steps are a list of numbers above 0 and below {largest:.0f} deg, got {steps.tolist()}")
    if rows < 2 or dropped < 0:
        raise InputError(f"a log has at least 2 rows and drops 0 or more, got {rows} rows and {dropped} dropped")
    logs = len(steps)
    later = [1 + np.sort(rng.permutation(rows + dropped - 1)[: rows - 1]) for _ in steps]
    due = np.stack([np.append(0, row) for row in later])
    time = (due - rng.uniform(size=(logs, 1))) * rig.row_interval_s
    seen = time
    if rig.eye_interval_s > 0:
        phase = rng.uniform(size=(logs, 1))
        seen = (np.floor(time / rig.eye_interval_s - phase) + phase) * rig.eye_interval_s
    motor, velocity, _ = _motion(rig, steps, time)
    eye = _motion(rig, steps, seen - rig.dead_time_s)[2]

    counting = np.array([1, 0, -1])
    counts = np.round(counting * velocity[..., None] / COUNT_DEG_S) + 0.0  # no -0
    turn = eye[..., None] * AXIS / np.linalg.norm(AXIS) + rig.eye_noise_deg * rng.normal(size=(logs, rows, 3))
    orientation = Rotation.from_rotvec(turn.reshape(-1, 3), degrees=True) * REST
    columns = (
        np.round(REST_COUNTS + counting * motor[..., None] / COUNT_DEG),
        np.where(counts < 0, 1024 - counts, counts),
        orientation.as_quat(canonical=True, scalar_first=True).reshape(logs, rows, 4),
        orientation.as_euler("ZYX", degrees=True)[:, ::-1].reshape(logs, rows, 3),
    )
    return np.concatenate(columns, axis=-1)


def _motion(rig: Rig, steps: Array, time: Array) -> tuple[Array, Array, Array]:
    """Way of a motor [deg], its velocity as logged [deg/s], and the eye without dead time [deg].

    Args:
        rig: that moves.
        steps: of motor 1 - motor 3 at time 0 [deg], (logs,).
        time: [s], (logs, rows); everything is at rest before 0.

    Returns:
        Three arrays (logs, rows).
    """

    def rates(_: float, flat: Array) -> Array:
        way, speed, logged, eye, eye_speed = flat.reshape(5, -1)
        sought = np.clip(rig.position_gain * (steps / 2 - way), -rig.speed_limit_deg_s, rig.speed_limit_deg_s)
        pull = rig.wn**2 * (rig.gain * 2 * way - eye) - 2 * rig.zeta * rig.wn * eye_speed
        state = speed, (sought - speed) / rig.motor_lag_s, (speed - logged) / rig.velocity_lag_s, eye_speed, pull
        return np.concatenate(state)

    at = np.maximum(time, 0.0)
    # Every log's times for all logs: a dense solution has no other way to ask for one's own.
    instants, which = np.unique(at, return_inverse=True)
    start = np.zeros(5 * len(steps))
    # Steps no longer than 5 ms do not jump over the corner of the speed limit.
    run = solve_ivp(rates, (0.0, at.max() + 1e-3), start, "DOP853", instants, rtol=1e-8, atol=1e-8, max_step=5e-3)
    states = run.y.reshape(5, len(steps), -1)
    way, _, logged, eye, _ = np.take_along_axis(states, which.reshape(1, *at.shape), axis=2)
    return way, logged, eye


def text(table: Array) -> str:
    """A log (rows, 13) as the prototype writes it: blanks between cells, six digits, no header, no time."""
    return "".join(" ".join(f"{cell:g}" for cell in row) + "\n" for row in table)


@dataclass(frozen=True)
class Logs:
    """Write logs made_log_STEP.txt of a simulated rig."""

    folder: Annotated[Path, tyro.conf.Positional]
    """Where they go."""
    steps: tuple[float, ...] = (17.5, 35.0, 52.5, 70.0)
    """Of motor 1 - motor 3, deg."""
    rows: int = 100
    """Of each log."""
    dropped: int = 0
    """Rows of each log that are missing."""
    seed: int = 0
    """Of noise, phases, and dropped rows."""
    rig: Rig = Rig()


def main(wanted: Logs) -> None:
    """Write the logs and say where."""
    tables = make_logs(wanted.rig, wanted.steps, np.random.default_rng(wanted.seed), wanted.rows, wanted.dropped)
    for step, table in zip(wanted.steps, tables, strict=True):
        print(write_text(wanted.folder / f"made_log_{step:g}.txt", text(table)))


if __name__ == "__main__":
    try:
        main(tyro.cli(Logs))
    except InputError as error:
        sys.exit(f"error: {error}")
