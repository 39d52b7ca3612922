"""Stream a command that `orient-eye predict --rig` wrote to a motor driver, at the rig's rate.

    orient-eye predict POLICY --rig rig.toml --target 20 --command there.csv --back back.csv
    python examples/stream_command.py there.csv --rig rig.toml

As it stands it prints what it would send. For a rig, write a class with the one method `send` that hands the positions
to your driver, and give it to `stream`. Before the first row is sent every row is held against the motors' range.
Ctrl-C holds the motors where they are: the last row is sent once more, and nothing after it.
"""

import argparse
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.rig import Rig
from orient_eye.tables import read_table


class Driver(Protocol):
    """What takes positions: yours."""

    def send(self, positions: Mapping[str, float]) -> None:
        """Send the motors there; motor's name to position, in the driver's units. Returns at once."""
        ...


@dataclass
class FakeDriver:
    """Remembers what it was sent, and when; prints it if told to.

    Attributes:
        clock: [s].
        loud: print.
        sent: times and positions.
    """

    clock: Callable[[], float] = time.perf_counter
    loud: bool = False
    sent: list[tuple[float, dict[str, float]]] = field(default_factory=list)

    def send(self, positions: Mapping[str, float]) -> None:
        """See `Driver`."""
        self.sent.append((self.clock(), dict(positions)))
        if self.loud:
            print(", ".join(f"{name} {value:g}" for name, value in positions.items()))


@dataclass(frozen=True)
class Rows:
    """A command in the driver's units.

    Attributes:
        time: [s], from 0, (rows,).
        positions: motor's name to its positions, (rows,).
    """

    time: NDArray[np.float64]
    positions: dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Streamed:
    """How the streaming went.

    Attributes:
        rows: that were sent.
        late: rows sent later than half an interval after their time, and by how much [s].
        interrupted: stopped by Ctrl-C, the motors holding the last row.
    """

    rows: int
    late: dict[int, float]
    interrupted: bool


def read_rows(path: str | Path, rig: Rig) -> Rows:
    """Read a command, and refuse one that a motor of the rig cannot reach.

    Raises:
        InputError: no such table, a column that is no motor's or a motor without one, time that does not rise, or a
            position outside a motor's range.
    """
    table = read_table(path, ",".join(["t_s", *(motor.column for motor in rig.motors)]))
    strange = set(table.columns) - {"t_s", *(motor.column for motor in rig.motors)}
    if strange:
        raise InputError(f"{path}: {', '.join(sorted(strange))} is no column of rig {rig.name!r}; write it with --rig")
    moment = table.rising_time()
    for motor in rig.motors:
        low, high = sorted(motor.to_driver(np.array(motor.range)).tolist())
        slack = 1e-9 * max(1.0, *(abs(end) for end in (low, high) if np.isfinite(end)))
        outside = np.flatnonzero(~((table[motor.column] >= low - slack) & (table[motor.column] <= high + slack)))
        if outside.size:
            row = int(outside[0])
            raise InputError(
                f"{path}, line {table.lines[row]}: {motor.column} = {table[motor.column][row]:g} is outside the range "
                f"of {motor.name}, {low:g} to {high:g}; nothing was sent"
            )
    return Rows(moment - moment[0], {motor.name: table[motor.column] for motor in rig.motors})


def stream(
    rows: Rows,
    driver: Driver,
    *,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> Streamed:
    """Send each row at its time.

    Args:
        rows: from `read_rows`.
        driver: takes them.
        clock: [s].
        sleep: for so many seconds.
    """
    late: dict[int, float] = {}
    allowed = 0.5 * float(np.diff(rows.time).min(initial=np.inf))
    last: dict[str, float] = {}
    sent = 0
    begin = clock()
    try:
        for k, due in enumerate(rows.time.tolist()):
            wait = begin + due - clock()
            if wait > 0:
                sleep(wait)
            behind = clock() - begin - due
            if behind > allowed:
                late[k] = behind
            last = {name: float(values[k]) for name, values in rows.positions.items()}
            driver.send(last)
            sent += 1
    except KeyboardInterrupt:
        if last:
            driver.send(last)
        return Streamed(sent, late, interrupted=True)
    return Streamed(sent, late, interrupted=False)


def main(arguments: list[str] | None = None) -> Streamed:
    """Read, stream to the fake driver, and say how it went."""
    parser = argparse.ArgumentParser(description="Stream a motor command at the rig's rate (to a fake driver).")
    parser.add_argument("command", help="CSV file written by orient-eye predict --rig")
    parser.add_argument("--rig", required=True, help="the rig's TOML file, or a shipped one")
    given = parser.parse_args(arguments)
    try:
        done = stream(read_rows(given.command, Rig.load(given.rig)), FakeDriver(loud=True))
    except InputError as error:
        parser.error(str(error))
    print(f"{done.rows} rows sent" + (", then stopped: the motors hold the last one" if done.interrupted else ""))
    for row, behind in done.late.items():
        print(f"row {row} was {1e3 * behind:.1f} ms late")
    return done


if __name__ == "__main__":
    main()
