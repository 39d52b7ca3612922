"""Files of motor commands: in the plant's own columns at its step, or in the language of a rig's driver.

What is written is where the motors really go, first where they rest. In the driver's language it is at the driver's
rate, inside the motors' limits from row to row, and goes on until they stand.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.cli.tables import number, say
from orient_eye.commands.motor_file import Wiring, write_command, write_driver
from orient_eye.constants import LONGEST_S
from orient_eye.errors import InputError
from orient_eye.motor import Motor, ranges, rests
from orient_eye.plants.limited_motor import follow, peaks

if TYPE_CHECKING:
    from orient_eye.plants import Plant
    from orient_eye.state import State
    from orient_eye.task.saccade import Outcome, SaccadeTask

Array = NDArray[np.float64]
_STANDS_DEG = 1e-3
_SAME_DEG = 1e-9
_BACK_S, _BACK_DEG_S = 1.0, 60.0  # a way back takes this long at least; its pace where no limit is known
_SHARE = 0.5  # of a motor's limits, that a way back uses
_STEEPEST, _HARDEST = 1.875, 10 / 3**0.5  # speed and acceleration of minimum jerk at most, of 1 deg in 1 s


@dataclass(frozen=True)
class Written:
    """A command that was written.

    Attributes:
        file: of it.
        rows: how many.
        step_s: between them.
        motors: that it moves, with their limits.
        speed: largest of each [deg/s], (motors,).
        acceleration: largest of each [deg/s^2], (motors,).
    """

    file: Path
    rows: int
    step_s: float
    motors: tuple[Motor, ...]
    speed: Array
    acceleration: Array

    @property
    def too_fast(self) -> bool:
        """Whether a row is beyond a limit of its motor."""
        tolerance = 1 + 1e-6
        speed, acceleration = (
            np.array([limit or np.inf for limit in limits])
            for limits in zip(*((m.speed_limit, m.acceleration_limit) for m in self.motors), strict=True)
        )
        return bool((self.speed > tolerance * speed).any() or (self.acceleration > tolerance * acceleration).any())

    def to_plain(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "file": str(self.file),
            "rows": self.rows,
            "rate_hz": 1 / self.step_s,
            "duration_s": (self.rows - 1) * self.step_s,
            "beyond_limits": self.too_fast,
            "motors": {
                motor.name: {
                    "peak_speed_deg_s": float(speed),
                    "speed_limit_deg_s": motor.speed_limit,
                    "peak_acceleration_deg_s2": float(acceleration),
                    "acceleration_limit_deg_s2": motor.acceleration_limit,
                }
                for motor, speed, acceleration in zip(self.motors, self.speed, self.acceleration, strict=True)
            },
        }

    def say(self, what: str) -> None:
        """In words: how long, how fast, how hard."""
        moved = [
            f"{motor.name} at most {_of(speed, motor.speed_limit, 'deg/s')}, "
            f"{_of(acceleration, motor.acceleration_limit, 'deg/s²')}"
            for motor, speed, acceleration in zip(self.motors, self.speed, self.acceleration, strict=True)
            if speed > 0
        ]
        words = "; ".join(moved) or "nothing moves"
        told = f"{what} in {self.file}: {self.rows} rows at {1 / self.step_s:g} Hz; {words}"
        say(f"beyond its motors' limits: {told}" if self.too_fast else told, "red" if self.too_fast else "")


def _of(value: float, limit: float | None, unit: str) -> str:
    return f"{number(value, '.0f')} {unit} (no limit known)" if limit is None else f"{value:.0f} of {limit:.0f} {unit}"


def command_path(task: "SaccadeTask", outcome: "Outcome", start: "State", saccade: int) -> Array:
    """Where the motors go until they stand, at the plant's step, (rows, motors) [deg].

    Raises:
        InputError: the saccade failed, or its motors do not come to stand.
    """
    plant = task.plant
    if outcome.measures.failed[saccade]:
        raise InputError(f"saccade {saccade + 1} failed, so there is no motor command to write; leave it out")
    path, final = outcome.movement.trajectory().motor[saccade], final_of(plant, outcome, saccade)
    which = np.array([saccade])
    horizon = (len(path) - 1) * plant.step_s
    while np.abs(path[-1] - final).max() > _STANDS_DEG:
        horizon *= 2
        if horizon > LONGEST_S:
            raise InputError(f"the motors of saccade {saccade + 1} do not come to stand within {LONGEST_S:g} s")
        command: Any = outcome.command
        path = plant.move(command[which], start[which], horizon).trajectory().motor[0]
    return path


def final_of(plant: "Plant", outcome: "Outcome", saccade: int) -> Array:
    """Where the motors of a saccade come to stand [deg], (motors,)."""
    low, high = ranges(plant.motors).T
    return np.asarray(np.clip(outcome.command.final[saccade], low, high))


def at_drivers_rate(path: Array, final: Array, step_s: float, wiring: Wiring) -> Array:
    """A path at a plant's step (rows, motors) at the driver's rate, inside the limits from row to row, to its end."""
    limits = wiring.limited
    low, high = ranges(limits).T
    every = wiring.step_s
    times = every * np.arange(int(np.ceil((len(path) - 1) * step_s / every - 1e-9)) + 1)
    own = step_s * np.arange(len(path))
    told = np.clip(np.stack([np.interp(times, own, column) for column in path.T], axis=1), low, high)
    end = np.clip(final, low, high)
    more = 1
    while more * every < LONGEST_S:
        held = np.concatenate([told, np.repeat(end[None], more, axis=0)])
        taken = follow(held[None], limits, every)[0][0]
        away = np.flatnonzero((np.abs(taken - end) > _SAME_DEG).any(axis=1))
        stands = int(away[-1]) + 1 if away.size else 0
        if stands < len(taken):
            return taken[: max(stands + 1, 2)]
        more *= 2
    raise InputError(f"rig {wiring.rig.name!r} does not reach the end of the command within {LONGEST_S:g} s")


def way_back(start: Array, motors: Sequence[Motor], step_s: float) -> Array:
    """From where motors stand (motors,) to their rest by minimum jerk, within half their limits, (rows, motors).

    Source: Flash and Hogan 1985, 10 s^3 - 15 s^4 + 6 s^5.
    """
    lasts, rest = _BACK_S, rests(motors)
    for motor, way in zip(motors, np.abs(start - rest), strict=True):
        pace = min(_BACK_DEG_S, _SHARE * (motor.speed_limit or np.inf))
        lasts = max(lasts, _STEEPEST * way / pace)
        if motor.acceleration_limit:
            lasts = max(lasts, float(np.sqrt(_HARDEST * way / (_SHARE * motor.acceleration_limit))))
    rows = int(np.ceil(lasts / step_s)) + 1
    share = np.linspace(0, 1, rows)[:, None]
    moved = share**3 * (10 - 15 * share + 6 * share**2)
    return np.asarray((1 - moved) * start + moved * rest)


def write(path: Path, plant: "Plant", wiring: Wiring | None, positions: Array) -> Written:
    """Write positions of the plant's motors (rows, motors) [deg], at the plant's step or at the driver's rate."""
    step_s = plant.step_s if wiring is None else wiring.step_s
    time = np.arange(len(positions)) * np.float64(step_s)
    if wiring is None:
        write_command(path, plant.motors, time, positions)
        speed, acceleration = peaks(positions[None], step_s)
        return Written(path, len(time), step_s, plant.motors, speed[0], acceleration[0])
    write_driver(path, wiring, time, positions)
    columns = wiring.to_driver(positions)
    motors = tuple(
        Motor(m.name, "deg", m.range, m.range, m.speed_limit, m.acceleration_limit) for m in wiring.rig.motors
    )
    degrees = np.stack([motor.from_driver(columns[motor.column]) for motor in wiring.rig.motors], axis=-1)
    speed, acceleration = peaks(degrees[None], step_s)
    return Written(path, len(time), step_s, motors, speed[0], acceleration[0])


def written_path(task: "SaccadeTask", outcome: "Outcome", start: "State", saccade: int, wiring: Wiring | None) -> Array:
    """What is written of a saccade, (rows, motors) [deg]: in the plant's columns up to its horizon."""
    if wiring is None:
        if outcome.measures.failed[saccade]:
            raise InputError("the saccade failed, so there is no motor command to write; leave --command out")
        return outcome.movement.trajectory().motor[saccade]
    path = command_path(task, outcome, start, saccade)
    return at_drivers_rate(path, final_of(task.plant, outcome, saccade), task.plant.step_s, wiring)
