"""A motor command as a table: columns t_s and one for each motor (tau2_deg for motor2), any sampling.

    command = read_command("command.csv", plant.motors)
    plant.move(command)

The first row is where the motors rest; between rows the command is a straight line, two rows at the same
time are a jump. Motors whose columns are left out stay at 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands import path_energy
from orient_eye.errors import InputError
from orient_eye.files import write_table
from orient_eye.motor import Motor
from orient_eye.tables import read_table

Array = NDArray[np.float64]
LONGEST_S = 3600.0
"""The longest command [s]."""
_FINEST_S = 1e-4  # of the grid on which the energy of a written command is taken


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


def read_command(path: str | Path, motors: Sequence[Motor]) -> WrittenCommand:
    """Read a command for a plant with these motors.

    Raises:
        InputError: missing file, unknown or missing columns, cells that are no numbers, time that goes back, no
            duration, or a motor commanded that the plant lacks.
    """
    columns = {motor.column: i for i, motor in enumerate(motors)}
    table = read_table(path, ",".join(["t_s", *columns]))
    if "t_s" not in table:
        has, needs = ", ".join(table.columns), ", ".join(columns)
        raise InputError(f"{path} has the columns {has}; it needs t_s [s] and {needs}")
    time = table.rising_time(strictly=False)
    given = [name for name in table.columns if name != "t_s"]
    unknown = [name for name in given if name not in columns and not (_of_motor(name) and not table[name].any())]
    if unknown:
        raise InputError(
            f"{path}: this plant cannot be commanded by {', '.join(unknown)}; its columns are t_s, "
            f"{', '.join(columns)} (columns of other motors must be 0)"
        )
    if not set(given) & set(columns):
        raise InputError(f"{path} commands no motor; add a column, one of {', '.join(columns)}")
    if not 0 < time[-1] - time[0] <= LONGEST_S:
        raise InputError(
            f"{path}: a command lasts between one step and one hour, this one {time[-1] - time[0]:g} s; t_s is in s"
        )
    positions = np.zeros((len(time), len(columns)))
    for name, index in columns.items():
        if name in table:
            positions[:, index] = table[name]
    return WrittenCommand(time - time[0], positions)


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


def _of_motor(column: str) -> bool:
    return column.startswith("tau") and column.endswith("_deg")
