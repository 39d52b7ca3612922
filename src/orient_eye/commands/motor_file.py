"""A motor command as a table: columns t_s and one for each motor (tau2_deg for motor2), any sampling.

    command = read_command("command.csv", plant.motors)
    plant.move(command)

The first row is where the motors rest; between rows the command is a straight line, two rows at the same
time are a jump. Motors whose columns are left out stand where they rest.

With a `Wiring` the table is in the language of a rig's driver: its motors, units and rate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import likely_milliseconds
from orient_eye.commands import path_energy
from orient_eye.constants import LONGEST_S
from orient_eye.errors import InputError
from orient_eye.files import write_table
from orient_eye.motor import Motor, names, rests
from orient_eye.rig import Rig, RigMotor
from orient_eye.tables import Table, read_table

Array = NDArray[np.float64]
_STILL_DEG = 1e-6
_FINEST_S = 1e-4  # of the grid on which the energy of a written command is taken


@dataclass(frozen=True)
class Wiring:
    """How the motors of a plant stand for those of a rig.

    Attributes:
        rig: with the language of its driver.
        motors: of the plant.
        axis: whose drive the plant's one motor is; None where the plant's motors are the rig's, by name.
    """

    rig: Rig
    motors: tuple[Motor, ...]
    axis: str | None = None

    @property
    def step_s(self) -> float:
        """Interval at which the driver takes positions [s]."""
        return 1 / self.rig.command_rate_hz

    @property
    def columns(self) -> dict[str, RigMotor]:
        """Of the driver, each with its motor."""
        return {motor.column: motor for motor in self.rig.motors}

    @property
    def needed(self) -> list[str]:
        """Columns of the motors that stand for the plant's."""
        used = names(self.motors) if self.axis is None else tuple(self.rig.shares(self.axis))
        return [column for column, motor in self.columns.items() if motor.name in used]

    @property
    def limited(self) -> tuple[Motor, ...]:
        """The plant's motors with the rig's limits; of motors in counts so much less that rounding keeps them."""
        if self.axis is None:
            return tuple(self._limited(motor.name, motor.name, 1.0) for motor in self.motors)
        shares = self.rig.shares(self.axis)
        each = [self._limited(self.motors[0].name, name, share) for name, share in shares.items()]
        return (_narrowest(each),)

    def _limited(self, name: str, rigs: str, share: float) -> Motor:
        """A motor of which the rig's moves by a share."""
        motor = self.rig.motor(rigs)
        speed, acceleration = motor.speed_limit, motor.acceleration_limit
        if motor.unit == "counts":  # whole counts a row: then rounded positions keep the limit too
            count = 1 / abs(motor.units_per_deg)
            row, rows = count / self.step_s, count / self.step_s**2
            speed = speed if speed is None or speed < row else np.floor(speed / row * (1 + 1e-12)) * row
            acceleration = acceleration if acceleration is None or acceleration < 4 * rows else acceleration - 2 * rows
        low, high = sorted(end / share for end in motor.range)
        speed, acceleration = (None if limit is None else float(limit / abs(share)) for limit in (speed, acceleration))
        return Motor(name, "deg", (low, high), (low, high), speed, acceleration)

    def to_driver(self, positions: Array) -> dict[str, Array]:
        """The driver's columns, (rows,) each, for positions of the plant's motors (rows, motors) [deg].

        Counts are whole, and inside the motor's range. Motors that stand for none of the plant's are at their zero.
        """
        if self.axis is None:
            at = dict(zip(names(self.motors), positions.T, strict=True))
        else:
            at = {name: share * positions[:, 0] for name, share in self.rig.shares(self.axis).items()}
        told = {}
        for column, motor in self.columns.items():
            numbers = motor.to_driver(at.get(motor.name, np.zeros(len(positions))))
            told[column] = _counts(motor, numbers) if motor.unit == "counts" else numbers
        return told

    def from_driver(self, columns: Mapping[str, Array]) -> Array:
        """Positions of the plant's motors (rows, motors) [deg] from the driver's columns.

        Raises:
            InputError: a column is missing.
        """
        if self.axis is not None:
            return self.rig.from_driver(self.axis, columns)[:, None]
        missing = [name for name in self.needed if name not in columns]
        if missing:
            raise InputError(f"rig {self.rig.name!r} needs the columns {', '.join(missing)}")
        motors = [self.rig.motor(motor.name) for motor in self.motors]
        return np.stack([motor.from_driver(columns[motor.column]) for motor in motors], axis=-1)


def _counts(motor: RigMotor, numbers: Array) -> Array:
    """Whole counts inside the motor's range; halves all go the same way, so that no step grows by rounding."""
    low, high = sorted(motor.to_driver(np.array(motor.range)).tolist())
    return np.clip(np.floor(numbers + 0.5), np.ceil(low - 1e-9), np.floor(high + 1e-9))


def _narrowest(motors: Sequence[Motor]) -> Motor:
    """A motor that keeps the limits of all."""
    low, high = max(motor.range[0] for motor in motors), min(motor.range[1] for motor in motors)
    speeds, accelerations = (
        [limit for motor in motors if (limit := getattr(motor, name)) is not None]
        for name in ("speed_limit", "acceleration_limit")
    )
    slowest, softest = min(speeds, default=None), min(accelerations, default=None)
    return Motor(motors[0].name, "deg", (low, high), (low, high), slowest, softest)


@dataclass(frozen=True)
class WrittenCommand:
    """One command that somebody wrote down.

    Attributes:
        time: [s], from 0, not falling, (rows,).
        positions: of all motors of a plant, (rows, motors).
    """

    time: Array
    positions: Array
    saturates = False

    def __len__(self) -> int:
        return 1

    @property
    def duration_s(self) -> float:
        """Of the rows."""
        return float(self.time[-1])

    def peaks(self) -> tuple[Array, Array]:
        """Largest speed between rows and acceleration from row to row of each motor, from rest, (motors,) each."""
        lasts, ways = np.diff(self.time)[:, None], np.abs(np.diff(self.positions, axis=0))
        if not len(lasts):
            return np.zeros(ways.shape[1]), np.zeros(ways.shape[1])
        with np.errstate(divide="ignore", invalid="ignore"):
            speed = np.where(ways > 0, np.diff(self.positions, axis=0) / lasts, 0.0)
            between = 0.5 * (lasts + np.concatenate([lasts[:1], lasts[:-1]]))
            change = np.diff(speed, axis=0, prepend=0.0)
            acceleration = np.where(change == 0, 0.0, change / between)  # a jump's is infinite, or none at all
        return np.abs(speed).max(axis=0), np.nan_to_num(np.abs(acceleration), nan=np.inf).max(axis=0)

    @property
    def rest(self) -> Array:
        """Where the motors stand before the command, (1, motors)."""
        return self.positions[:1]

    @property
    def final(self) -> Array:
        """The last row, (1, motors)."""
        return self.positions[-1:]

    def sample(self, step_s: float, samples: int) -> Array:
        """See `orient_eye.commands.Command`; of two rows at the same time the later holds from that time on."""
        at = step_s * np.arange(samples)
        after = np.searchsorted(self.time, at + 1e-12, side="right")
        low, high = np.clip(after - 1, 0, len(self.time) - 1), np.clip(after, 0, len(self.time) - 1)
        span = self.time[high] - self.time[low]
        share = np.clip(np.where(span > 0, (at - self.time[low]) / np.where(span > 0, span, 1), 0.0), 0, 1)[:, None]
        values = self.positions[low] + share * (self.positions[high] - self.positions[low])
        return np.asarray(values[None])

    def energy(self) -> Array:
        """Of the straight lines; a jump is taken as one of 0.1 ms."""
        samples = round(self.duration_s / _FINEST_S) + 1
        return path_energy(self.sample(_FINEST_S, samples), _FINEST_S)

    @property
    def too_fast(self) -> NDArray[np.bool_]:
        """Nothing was to be kept."""
        return np.zeros(1, bool)


def read_command(
    path: str | Path, motors: Sequence[Motor], wiring: Wiring | None = None, *, horizon_s: float | None = None
) -> WrittenCommand:
    """Read a command for a plant with these motors.

    Args:
        path: of the table.
        motors: of the plant.
        wiring: to read a table in the language of a rig's driver; one whose columns are the plant's own is read as
            it is without.
        horizon_s: how long the last row will be held at least; with one a single row is a command too.

    Raises:
        InputError: missing file, unknown or missing columns, cells that are no numbers, time that goes back, no
            duration, or a motor commanded that the plant lacks.
    """
    own = {motor.column: i for i, motor in enumerate(motors)}
    columns = list(own) if wiring is None else wiring.needed
    table = read_table(path, ",".join(["t_s", *columns]))
    if "t_s" not in table:
        has, needs = ", ".join(table.columns), ", ".join(columns)
        raise InputError(f"{path} has the columns {has}; it needs t_s [s] and {needs}")
    time = table.rising_time(strictly=False)
    lasts = float(time[-1] - time[0])
    if lasts > LONGEST_S or (lasts <= 0 and horizon_s is None):
        raise InputError(
            f"{path}: a command lasts up to one hour, this one {lasts:g} s; t_s is in s, and what is held for a while "
            "stands in two rows"
        )
    if asked := likely_milliseconds(len(time), lasts):
        raise InputError(f"{path}: {asked}")
    in_rigs = wiring is not None and (set(wiring.needed) & set(table.columns) or not set(own) & set(table.columns))
    positions = _drivers(path, table, wiring) if wiring is not None and in_rigs else _plants(path, table, motors)
    return WrittenCommand(time - time[0], positions)


def _plants(path: str | Path, table: Table, motors: Sequence[Motor]) -> Array:
    """Positions (rows, motors) from the plant's own columns; a motor without one stands at its rest."""
    columns = [motor.column for motor in motors]
    given = [name for name in table.columns if name != "t_s"]
    unknown = [name for name in given if name not in columns and not (_of_motor(name) and not table[name].any())]
    if unknown:
        raise InputError(
            f"{path}: this plant cannot be commanded by {', '.join(unknown)}; its columns are t_s, "
            f"{', '.join(columns)} (columns of other motors must be 0)"
        )
    if not set(given) & set(columns):
        raise InputError(f"{path} commands no motor; add a column, one of {', '.join(columns)}")
    positions = np.tile(rests(motors), (len(table.lines), 1))
    for index, name in enumerate(columns):
        if name in table:
            positions[:, index] = table[name]
    return positions


def _drivers(path: str | Path, table: Table, wiring: Wiring) -> Array:
    """Positions (rows, motors) from the driver's columns."""
    given = [name for name in table.columns if name != "t_s"]
    unknown = [name for name in given if name not in wiring.columns]
    missing = [name for name in wiring.needed if name not in given]
    if unknown or missing:
        wrong = f"has no {', '.join(missing)}" if missing else f"has {', '.join(unknown)}, which is no motor's"
        raise InputError(
            f"{path} {wrong}; the columns for rig {wiring.rig.name!r} are t_s, {', '.join(wiring.needed)} (those of "
            "its other motors must stand at their zero)"
        )
    for name in given:
        motor = wiring.columns[name]
        moved = np.abs(motor.from_driver(table[name]))
        if name not in wiring.needed and (moved > _STILL_DEG + 0.5 / abs(motor.units_per_deg)).any():
            raise InputError(
                f"{path} moves {motor.name}, but the plant is moved by {', '.join(wiring.needed)} alone; leave {name} "
                f"out, or at its zero, {motor.zero:g}"
            )
    return wiring.from_driver({name: table[name] for name in given})


def write_command(path: str | Path, motors: Sequence[Motor], time: Array, positions: Array) -> Path:
    """Write a command: time (rows,) [s] and positions (rows, motors) of these motors."""
    columns = [motor.column for motor in motors]
    return write_table(
        path,
        [
            {"t_s": f"{t:.9g}", **{name: f"{x:.9g}" for name, x in zip(columns, row, strict=True)}}
            for t, row in zip(time, positions, strict=True)
        ],
    )


def write_driver(path: str | Path, wiring: Wiring, time: Array, positions: Array) -> Path:
    """Write a command in the language of a rig's driver: time (rows,) [s], positions (rows, motors) of the plant's."""
    columns = wiring.to_driver(positions)
    told = list(zip(*columns.values(), strict=True))
    return write_table(
        path,
        [
            {"t_s": f"{t:.9g}", **{name: f"{x:.12g}" for name, x in zip(columns, row, strict=True)}}
            for t, row in zip(time, told, strict=True)
        ],
    )


def _of_motor(column: str) -> bool:
    return column.startswith("tau") and column.endswith("_deg")
