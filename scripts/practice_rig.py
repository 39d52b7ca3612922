"""A rig to practise on: it performs command files and records what its motors and its eye did.

    python scripts/practice_rig.py recorded plan/step_*.csv

It is the rig of docs/rigs.md, whose `left` speaks in counts and `right` in rad. Motors go where they are told, by
straight lines from row to row, and stand at the last for half a second more. The eye is a differential equation, its
parameters below, and knows nothing of `orient_eye`'s plants, so what is found can be held against what was put in.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from orient_eye.errors import InputError
from orient_eye.files import write_table
from orient_eye.tables import read_table

Array = NDArray[np.float64]
COLUMNS = ("left_counts", "right_rad")
AFTER_S = 0.5


@dataclass(frozen=True)
class Eye:
    """An eye of second order that left - right turns down, and what reads it."""

    gain: float = 1.6
    """Eye per left - right, deg/deg."""
    wn: float = 22.0
    """Natural frequency, rad/s."""
    zeta: float = 0.7
    """Damping."""
    dead_time_s: float = 0.006
    """Behind its motors, s."""
    noise_deg: float = 0.05
    """Of its sensor, standard deviation, deg."""
    dropped: float = 0.4
    """Share of the rows that the log lost."""

    def follow(self, time: Array, drive: Array) -> Array:
        """Where it is [deg] while left - right goes this way [deg], from rest, (rows,)."""

        def slope(t: float, state: Array) -> list[float]:
            pull = self.gain * np.interp(t - self.dead_time_s, time, drive) - state[0]
            return [state[1], self.wn**2 * pull - 2 * self.zeta * self.wn * state[1]]

        rest = [self.gain * drive[0], 0.0]
        return np.asarray(solve_ivp(slope, (time[0], time[-1]), rest, t_eval=time, max_step=2e-3, rtol=1e-6).y[0])


def perform(command: Path, eye: Eye, random: np.random.Generator) -> list[dict[str, float]]:
    """Rows of what was recorded of a command.

    Raises:
        InputError: the file is no command of this rig.
    """
    table = read_table(command, "t_s,left_counts,right_rad")
    told = table.stack(COLUMNS)
    step_s = float(np.median(np.diff(table["t_s"])))
    more = round(AFTER_S / step_s)
    time = np.append(table["t_s"], table["t_s"][-1] + step_s * np.arange(1, more + 1))
    left, right = np.concatenate([told, np.repeat(told[-1:], more, axis=0)]).T
    drive = (left - 512) / 11.4 - np.rad2deg(0.1 - right)
    seen = eye.follow(time, drive) + eye.noise_deg * random.standard_normal(len(time))
    columns = np.column_stack([time, left, right, seen])[random.random(len(time)) >= eye.dropped]
    return [dict(zip(("t_s", *COLUMNS, "pitch_deg"), row, strict=True)) for row in columns.tolist()]


def main(
    folder: Annotated[Path, tyro.conf.Positional],
    commands: Annotated[tuple[Path, ...], tyro.conf.Positional],
    eye: Eye = Eye(),
    seed: int = 0,
) -> None:
    """Perform command files one after the other; recordings of the same names are written into a folder.

    Args:
        folder: of the recordings.
        commands: CSV files in the rig's units.
        eye: of the rig.
        seed: of the noise and of the rows that are lost.
    """
    random = np.random.default_rng(seed)
    for command in commands:
        print(write_table(folder / command.name, perform(command, eye, random)))


if __name__ == "__main__":
    try:
        tyro.cli(main)
    except InputError as error:
        sys.exit(f"error: {error}")
