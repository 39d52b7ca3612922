"""The steps that the owner of a rig should record, inside its limits, in the language of its driver.

plan = plan_steps(rig, "yaw")
plan[0].time, plan[0].drive                      # rest, step, hold, slowly back
write_plan(plan, rig, "yaw", folder, "rig.toml") # one table a step, and how to record
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.files import write_table, write_text
from orient_eye.motor import Motor
from orient_eye.rig import Rig

Array = NDArray[np.float64]
SHARES = (0.15, 0.3, 0.5)
"""Amplitudes of the steps, of the way from rest to the nearer end of the range; each in both directions."""
REST_S, HOLD_S = 0.5, 2.0
"""Before a step, and after the longest at least: longer than an eye takes to settle."""
_BACK_DEG_S = 20.0  # slow: no eye is thrown about
_OF_LIMIT = 0.9  # so that the motor can follow
_MIDDLE = 0.8  # of the range: outside it 0 deg is too near an end to step from


@dataclass(frozen=True)
class PlannedStep:
    """One step to record.

    Attributes:
        name: of its file.
        amplitude_deg: of the drive, from rest.
        time: [s], at the driver's rate, (rows,).
        drive: position [deg], (rows,).
        until_s: when the hold ends; the same of all, so that one time cuts every recording.
    """

    name: str
    amplitude_deg: float
    time: Array
    drive: Array
    until_s: float


def plan_steps(rig: Rig, axis: str) -> tuple[PlannedStep, ...]:
    """Steps of three amplitudes in both directions.

    Each rests, steps as fast as nine tenths of the drive's limits let it (in one row where no speed limit is known),
    holds until the same time, and goes back slowly.

    Raises:
        InputError: the rig does not turn the axis, or its range is not known.
    """
    motor = rig.drive(axis)
    low, high = motor.range
    if not (isfinite(low) and isfinite(high)):
        raise InputError(
            f"rig {rig.name!r} says no range of the motors of {axis} ({motor.name}), so no step is known to be safe; "
            "add range = [low, high] in deg to each of them in the rig file"
        )
    middle, half = (low + high) / 2, (high - low) / 2
    rest = 0.0 if abs(middle) <= _MIDDLE * half else middle
    room = min(high - rest, rest - low)
    steps, step_s = [], 1 / rig.command_rate_hz
    sizes = [float(f"{share * room:.2g}") for share in SHARES]
    stands = max(len(_rise(motor, size, step_s)) for size in sizes) + round(HOLD_S / step_s)  # rows from the step on
    for size in sizes:
        for sign in (1, -1):
            time, drive = _path(motor, rest, sign * size, step_s, stands)
            until = step_s * (round(REST_S / step_s) + stands)
            steps.append(
                PlannedStep(f"step_{'plus' if sign > 0 else 'minus'}_{size:g}", sign * size, time, drive, until)
            )
    return tuple(steps)


def _path(motor: Motor, rest: float, amplitude: float, step_s: float, stands: int) -> tuple[Array, Array]:
    """Times and positions of the drive, which steps and holds over as many rows as it `stands`."""
    way = _rise(motor, abs(amplitude), step_s)
    back_deg_s = min(_BACK_DEG_S, _OF_LIMIT * (motor.speed_limit or np.inf))
    seconds = np.pi / 2 * abs(amplitude) / back_deg_s
    if motor.acceleration_limit:
        seconds = max(seconds, np.pi * np.sqrt(abs(amplitude) / (2 * _OF_LIMIT * motor.acceleration_limit)))
    back = (1 + np.cos(np.pi * np.linspace(0, 1, int(np.ceil(seconds / step_s)) + 1))) / 2 * abs(amplitude)
    resting, holding = round(REST_S / step_s), stands - len(way)
    parts = [np.zeros(resting), way, np.full(holding, abs(amplitude)), back, np.zeros(resting)]
    drive = rest + np.sign(amplitude) * np.concatenate(parts)
    time = step_s * np.arange(len(drive), dtype=float)
    return time, np.asarray(drive, float)


def _rise(motor: Motor, size: float, step_s: float) -> Array:
    """From rest by a size [deg], samples, the last there: accelerating, at the speed limit, braking."""
    speed = _OF_LIMIT * (motor.speed_limit or np.inf)
    acceleration = _OF_LIMIT * (motor.acceleration_limit or np.inf)
    if not isfinite(speed) and not isfinite(acceleration):
        return np.array([0.0, size])
    if not isfinite(acceleration):
        rows = int(np.ceil(size / speed / step_s - 1e-9))
        return np.linspace(0, size, rows + 1)
    top = min(speed, np.sqrt(size * acceleration))
    gaining = top / acceleration
    cruising = size / top - gaining
    t = step_s * np.arange(int(np.ceil((2 * gaining + cruising) / step_s)) + 1)
    up = np.minimum(t, gaining)
    down = np.clip(t - gaining - cruising, 0, gaining)
    there = acceleration * up**2 / 2 + top * np.clip(t - gaining, 0, cruising) + top * down - acceleration * down**2 / 2
    return np.asarray(np.minimum(there, size))


def write_plan(
    steps: Sequence[PlannedStep], rig: Rig, axis: str, folder: Path, rig_file: str = "rig.toml"
) -> list[str]:
    """Write one table a step, columns t_s and those of all motors in the driver's units, and README.md.

    Numbers in counts are whole. README.md says what to run then, with the file of the rig.

    Returns:
        Names of the files.
    """
    files = []
    for step in steps:
        columns = rig.to_driver(axis, step.drive)
        forms = {m.column: ".0f" if m.unit == "counts" else ".9g" for m in rig.motors}
        rows = [
            {"t_s": f"{t:.9g}", **{name: f"{values[k]:{forms[name]}}" for name, values in columns.items()}}
            for k, t in enumerate(step.time)
        ]
        write_table(folder / f"{step.name}.csv", rows)
        files.append(f"{step.name}.csv")
    write_text(folder / "README.md", how_to_record(steps, rig, axis, rig_file))
    return [*files, "README.md"]


def how_to_record(steps: Sequence[PlannedStep], rig: Rig, axis: str, rig_file: str) -> str:
    """How to record these steps, and what to run then; Markdown."""
    motor = rig.drive(axis)
    columns = ", ".join(rig.motor(name).column for name in rig.axes[axis])
    tables = ", ".join(f"`{s.name}.csv`" for s in steps)
    until = min(s.until_s for s in steps)
    names = " ".join(f"recorded/{s.name}.csv" for s in steps)
    known = (("speed", motor.speed_limit, "deg/s"), ("acceleration", motor.acceleration_limit, "deg/s²"))
    limits = [f"{name} up to {value:g} {unit}" for name, value, unit in known if value]
    told = (
        f"{' and '.join(limits)}, of which they take nine tenths"
        if motor.speed_limit or motor.acceleration_limit
        else "no speed limit is known, so they jump from one row to the next"
    )
    return f"""\
# Steps to record: {axis} of rig {rig.name}

{tables}: {len(steps)} steps of {motor.name} between {motor.range[0]:g} and {motor.range[1]:g} deg ({told}). Each rests,
steps, holds, and goes slowly back to rest.

For each table:

1. Bring the motors slowly to its first row and let the eye come to rest.
2. Send one row every {1000 / rig.command_rate_hz:g} ms ({rig.command_rate_hz:g} a second).
3. Log, from the first row on and at 100 rows a second or more (any spacing, gaps are no harm):
   - `t_s`, the time of each row, s, from one clock for motors and eye;
   - `{columns}`, where the motors *are*, by their own sensors, not what they were sent;
   - `{axis}_deg`, the angle of the eye, deg; or its orientation, `q_w, q_x, q_y, q_z`.
4. Save it as a table of its own (commas between cells, the names above in the first line).

The first half second is rest, and is needed: movements are measured from it. After {until:.3f} s the way back begins,
which `--until` leaves out:

    orient-eye sysid --rig {rig_file} --axis {axis} --until {until:.3f} --recording {names}
"""
