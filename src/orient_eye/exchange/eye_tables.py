"""A person's recording of gaze, from a table: text or Parquet, or a recording by BIDS with its sidecar.

record = read_gaze("eyelink.csv", GazeColumns(time="t", x="gx", y="gy", unit="ms"))
"""

import gzip
import io
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import DEG, likely_radians
from orient_eye.errors import InputError
from orient_eye.exchange import parquet
from orient_eye.exchange.gaze import GazeRecord
from orient_eye.files import read_bytes, read_json, unreadable
from orient_eye.tables import Table, header_of, lines_of, listed, some_columns

Array = NDArray[np.float64]
UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
"""Of time, in seconds."""
SLOWEST_HZ, FASTEST_HZ = 100.0, 10_000.0
USUAL = {
    "time": ("t_s", "timestamp", "time", "t"),
    "x": ("x_coordinate", "x_deg", "x"),
    "y": ("y_coordinate", "y_deg", "y"),
}
"""Names of columns that are looked for where none is given."""
_LARGEST_BYTES = 512 * 2**20
_HINT = "give a table (CSV, TSV, Parquet) with a column of time and one or two of gaze in deg"
_BIDS = ".tsv.gz"
_GAP = 1.5  # steps
_UNEVEN, _SHARE = 0.3, 0.05  # of a step; of the steps
_HALF_TURN_DEG = 180.0
_MOST = 50_000_000


@dataclass(frozen=True)
class GazeColumns:
    """Which columns tell what.

    Attributes:
        time: name of the column; None for a usual name, as for x and y.
        x: of the gaze to the right [deg].
        y: of the gaze up [deg]; where there is none, the gaze is horizontal.
        unit: of time, one of `UNITS`.
    """

    time: str | None = None
    x: str | None = None
    y: str | None = None
    unit: str = "s"

    def among(self, path: str | Path, header: tuple[str, ...]) -> dict[str, str]:
        """What is told, and the column that tells it.

        Raises:
            InputError: a named column is missing, or none has a usual name.
        """
        found = {}
        for what, usual in USUAL.items():
            named = getattr(self, what)
            if named is not None and named not in header:
                raise InputError(f"{path} has no column {named}; it has {listed(header)}")
            known = [name for name in usual if name in header]
            if named is None and not known and what != "y":
                told = "time" if what == "time" else "horizontal gaze"
                raise InputError(
                    f"{path} has no column of {told}: none is called {', '.join(usual)}, it has {listed(header)}; "
                    f"name it by --{what}"
                )
            if named is not None or known:
                found[what] = named or known[0]
        if len(set(found.values())) < len(found):
            raise InputError(f"time, x and y are different columns, got {', '.join(found.values())}; name each once")
        return found


def read_gaze(path: str | Path, columns: GazeColumns | None = None) -> GazeRecord:
    """Read a recording; its rate is found, and samples that are missing or NaN are gaps.

    Text has a header, its other columns may hold anything. A file NAME.tsv.gz has none: it is one of BIDS, with its
    columns in NAME.json.

    Args:
        path: of the table.
        columns: which tell what; None for usual names, and seconds.

    Raises:
        InputError: unreadable, no such column, words among the numbers, time that does not rise, is probably in
            another unit or is not even, a rate out of bounds, or angles that are none.
    """
    columns = columns or GazeColumns()
    table, names = _read(path, columns)
    time = table.rising_time(names["time"]) * UNITS[columns.unit]
    angles = np.stack([table.columns[names[what]] for what in ("x", "y") if what in names])
    _check_angles(path, angles)
    if len(angles) == 1:
        angles = np.concatenate([angles, np.where(np.isfinite(angles), 0.0, np.nan)])
    step = _step(path, time, columns.unit)
    return _even(path, time, angles, step)


def probably_radians(record: GazeRecord) -> str:
    """What to say of gaze that is probably in radians; else nothing."""
    largest = float(np.nanmax(np.abs([record.horizontal_deg, record.vertical_deg])))
    return likely_radians("the gaze", largest)


def _read(path: str | Path, columns: GazeColumns) -> tuple[Table, dict[str, str]]:
    content = read_bytes(path, most=_LARGEST_BYTES, hint=_HINT)
    found: dict[str, str] = {}

    def choose(header: tuple[str, ...]) -> tuple[str, ...]:
        found.update(columns.among(path, header))
        return tuple(found.values())

    if content.startswith(parquet.MAGIC):
        return parquet.read_columns(path, content, choose), found
    if str(path).endswith(_BIDS):
        header, lines, separator = _header_of_bids(path), lines_of(path, _unpacked(path, content)), "\t"
    else:
        lines = lines_of(path, content)
        header, separator = header_of(path, lines, ",".join(usual[0] for usual in USUAL.values()))
        lines = lines[1:]
    if not lines:
        raise InputError(f"{path} has no rows; {_HINT}")
    return some_columns(path, header, lines, separator, choose(header)), found


def _unpacked(path: str | Path, content: bytes) -> bytes:
    try:
        with gzip.open(io.BytesIO(content)) as file:
            plain = file.read(_LARGEST_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise unreadable(path, error, _HINT) from error
    if len(plain) > _LARGEST_BYTES:
        raise InputError(f"{path} unpacks to more than {_LARGEST_BYTES // 2**20} MB; give a shorter recording")
    return plain


def _header_of_bids(path: str | Path) -> tuple[str, ...]:
    sidecar = str(path).removesuffix(_BIDS) + ".json"
    told = read_json(sidecar, hint=f"{path} has no header, its columns stand in that file")
    header = told.get("Columns") if isinstance(told, dict) else None
    if not (isinstance(header, list) and all(isinstance(name, str) for name in header)):
        raise InputError(f"{sidecar} names no Columns of {path}; it is no sidecar of a recording")
    return tuple(header)


def _check_angles(path: str | Path, angles: Array) -> None:
    known = angles[~np.isnan(angles)]
    if not np.isfinite(angles).all(axis=0).any():
        raise InputError(f"{path} has no sample of gaze with all its numbers: all are gaps; {_HINT}")
    if not np.isfinite(known).all():
        raise InputError(f"{path}: gaze holds infinite numbers; leave a cell empty where it is not known")
    if np.abs(known).max() > _HALF_TURN_DEG:
        raise InputError(
            f"{path}: gaze goes up to {np.abs(known).max():.4g} deg, at most {_HALF_TURN_DEG:g} are an angle; are "
            f"these pixels? Convert them to degrees: atan(offset / distance), {DEG:.7g} deg in a radian"
        )


def _step(path: str | Path, time: Array, unit: str) -> float:
    """Mean time between samples that follow each other [s]."""
    steps = np.diff(time)
    if not steps.size:
        raise InputError(f"{path} has one row; a recording needs many")
    usual = float(np.median(steps))
    steps = steps[steps <= _GAP * usual]
    step = float(steps.mean())
    for other, seconds in UNITS.items():
        hz = UNITS[unit] / (step * seconds)
        if not SLOWEST_HZ <= 1 / step <= FASTEST_HZ and SLOWEST_HZ <= hz <= FASTEST_HZ:
            raise InputError(
                f"{path}: rows are {step:.4g} s apart, {1 / step:.4g} Hz: is time in {other}? Then say --time-unit "
                f"{other} ({hz:.4g} Hz); from {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz are read"
            )
    if not SLOWEST_HZ <= 1 / step <= FASTEST_HZ:
        raise InputError(
            f"{path} is sampled at {1 / step:.4g} Hz; the speed of a saccade is known from {SLOWEST_HZ:g} to "
            f"{FASTEST_HZ:g} Hz"
        )
    uneven = float((np.abs(steps - step) > _UNEVEN * step).mean())
    if uneven > _SHARE:
        raise InputError(
            f"{path} is not sampled evenly: {100 * uneven:.0f} % of the steps are off {1e3 * step:.4g} ms by more than "
            f"{100 * _UNEVEN:.0f} %; resample it at one rate"
        )
    return step


def _even(path: str | Path, time: Array, angles: Array, step: float) -> GazeRecord:
    """Straight lines between samples, at even times; NaN between samples of which one is missing or far."""
    count = round((time[-1] - time[0]) / step) + 1
    if count > _MOST:
        raise InputError(f"{path} lasts {time[-1] - time[0]:.4g} s, {count} samples; at most {_MOST} are read")
    at = np.minimum(time[0] + step * np.arange(count), time[-1])
    before = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    width = time[before + 1] - time[before]
    share = (at - time[before]) / width
    value = np.where(share > 0, (1 - share) * angles[:, before] + share * angles[:, before + 1], angles[:, before])
    value = np.where((width > _GAP * step) & (share > 0) & (share < 1), np.nan, value)
    return GazeRecord(at, value[0], value[1], 1 / step)
