"""A rig described once: its motors, what they turn, and the language of their driver, in one TOML file.

    rig = Rig.load("rig.toml")                       # or a shipped one: "prototype"
    rig.drive("pitch")                               # a Motor: range and limits of that axis' drive [deg]
    rig.to_driver("pitch", path)                     # columns in the driver's units, from a drive [deg]

An axis is turned by one drive u [deg], a weighted sum of motor positions: u = sum of c_i m_i. A drive is spread
over its motors by m_i = c_i u / sum of c^2, the least movement that makes it. The driver's number for a motor at
m [deg] is zero + sign * m * units_per_deg.
"""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite, radians
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import real, shown
from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.files import read_bytes, unreadable, write_text
from orient_eye.motor import Motor
from orient_eye.resources import data_folder, printable, shipped_or_given

Array = NDArray[np.float64]
_UNITS = {"deg": 1.0, "rad": radians(1.0)}
_LARGEST_BYTES = 1 << 20


@dataclass(frozen=True)
class RigMotor:
    """One motor of a rig.

    Attributes:
        name: as in the columns of recordings and commands.
        unit: of the driver: "deg", "rad" or "counts".
        counts_per_deg: of a motor in counts.
        zero: the driver's number where the motor is at 0 deg.
        sign: 1, or -1 for a driver that counts the other way.
        range: least and largest position [deg].
        speed_limit: [deg/s]; None for not known.
        acceleration_limit: [deg/s^2]; None for not known.

    Raises:
        InputError: a value that is none.
    """

    name: str
    unit: str = "deg"
    counts_per_deg: float | None = None
    zero: float = 0.0
    sign: int = 1
    range: tuple[float, float] = (-inf, inf)
    speed_limit: float | None = None
    acceleration_limit: float | None = None

    def __post_init__(self) -> None:
        told = f"motor {self.name!r}"
        if self.unit not in (*_UNITS, "counts"):
            raise InputError(f"{told}: unit is deg, rad or counts, got {self.unit!r}")
        if (self.unit == "counts") != (self.counts_per_deg is not None):
            raise InputError(f"{told}: counts_per_deg belongs to unit = 'counts', got {self.counts_per_deg}")
        if self.counts_per_deg is not None and not 1e-6 <= self.counts_per_deg <= 1e9:
            raise InputError(
                f"{told}: counts_per_deg is positive, from 1e-6 to 1e9, got {self.counts_per_deg}; sign says the "
                "direction"
            )
        if self.sign not in (1, -1):
            raise InputError(f"{told}: sign is 1 or -1, got {shown(self.sign)}")
        object.__setattr__(self, "sign", int(self.sign))
        real(f"{told}: zero", self.zero, -1e12, 1e12)
        low, high = self.range
        if not low < high or any(isfinite(end) and abs(end) > 1e6 for end in self.range):
            raise InputError(f"{told}: range goes from low to high, in deg, up to 1e6 either way, got {[low, high]}")
        for name in ("speed_limit", "acceleration_limit"):
            limit = getattr(self, name)
            if limit is not None and not 1e-3 <= limit <= 1e12:
                raise InputError(
                    f"{told}: {name} is positive, or left out where it is not known, from 0.001 to 1e12, got {limit}"
                )

    @property
    def units_per_deg(self) -> float:
        """Driver's units a degree, with their sign."""
        return self.sign * (self.counts_per_deg or _UNITS.get(self.unit, 1.0))

    @property
    def column(self) -> str:
        """Of its positions in recordings and commands in the driver's units: motor1_counts."""
        return f"{self.name}_{self.unit}"

    def to_driver(self, degrees: Array) -> Array:
        """The driver's numbers for positions [deg]."""
        return np.asarray(self.zero + self.units_per_deg * degrees)

    def from_driver(self, numbers: Array) -> Array:
        """Positions [deg] of the driver's numbers."""
        return np.asarray((numbers - self.zero) / self.units_per_deg)


@dataclass(frozen=True)
class Rig:
    """A rig.

    Attributes:
        name: for people.
        motors: all of them.
        axes: for each axis that can be turned (yaw, pitch, roll), the coefficient of each motor in its drive.
        command_rate_hz: how often its driver takes a new position.
        notes: for people.

    Raises:
        InputError: no motor, names twice, an axis that is none or names an unknown motor, or a rate that is none.
    """

    name: str
    motors: tuple[RigMotor, ...]
    axes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    command_rate_hz: float = 100.0
    notes: str = ""

    def __post_init__(self) -> None:
        names = [motor.name for motor in self.motors]
        if not names or len(set(names)) != len(names):
            raise InputError(f"rig {self.name!r} needs motors, each with a name of its own; got {names}")
        if not self.axes:
            raise InputError(
                f"rig {self.name!r} turns no axis; add [axes] with yaw, pitch or roll, as docs/rigs.md shows"
            )
        for axis, drive in self.axes.items():
            unknown = [name for name in drive if name not in names]
            if axis not in AXES or unknown:
                raise InputError(
                    f"rig {self.name!r}: an axis is yaw, pitch or roll and names motors among {', '.join(names)}; got "
                    f"{axis} = {dict(drive)}"
                )
            if not drive or not all(1e-6 <= abs(c) <= 1e6 for c in drive.values()):
                raise InputError(
                    f"rig {self.name!r}: the coefficients of {axis} are finite and not 0, from 1e-6 to 1e6 either way, "
                    f"got {dict(drive)}"
                )
        if not 1 <= self.command_rate_hz <= 1e5:
            raise InputError(
                f"rig {self.name!r}: command_rate_hz lies between 1 and 100000, got {self.command_rate_hz}"
            )

    def motor(self, name: str) -> RigMotor:
        """The motor of that name."""
        return next(motor for motor in self.motors if motor.name == name)

    def shares(self, axis: str) -> dict[str, float]:
        """How many degrees each motor of an axis moves for a degree of its drive.

        Raises:
            InputError: the rig does not turn this axis.
        """
        if axis not in self.axes:
            raise InputError(f"rig {self.name!r} turns {', '.join(self.axes)}, not {axis}; choose one of these")
        drive = self.axes[axis]
        size = sum(c * c for c in drive.values())
        return {name: c / size for name, c in drive.items()}

    def drive(self, axis: str) -> Motor:
        """The drive of an axis as a motor [deg], with the limits that follow from its motors'."""
        low, high, speed, acceleration = -inf, inf, inf, inf
        for name, share in self.shares(axis).items():
            motor = self.motor(name)
            ends = sorted(end / share for end in motor.range)
            low, high = max(low, ends[0]), min(high, ends[1])
            speed = min(speed, (motor.speed_limit or inf) / abs(share))
            acceleration = min(acceleration, (motor.acceleration_limit or inf) / abs(share))
        limits = (speed if isfinite(speed) else None, acceleration if isfinite(acceleration) else None)
        return Motor(self.drive_name(axis), "deg", (low, high), (low, high), *limits)

    def drive_name(self, axis: str) -> str:
        """Of the drive of an axis: its motor's, or "motor1 - motor3"."""
        words = ""
        for name, c in self.axes[axis].items():
            size = "" if abs(c) == 1 else f"{abs(c):g} "
            words += f" {'-' if c < 0 else '+'} {size}{name}" if words else f"{'-' if c < 0 else ''}{size}{name}"
        return words

    def to_driver(self, axis: str, drive: Array) -> dict[str, Array]:
        """Columns for the driver of a drive over time [deg], in the driver's units; motors of other axes at zero."""
        shares = self.shares(axis)
        return {
            motor.column: motor.to_driver(shares.get(motor.name, 0.0) * np.asarray(drive, float))
            for motor in self.motors
        }

    def from_driver(self, axis: str, columns: Mapping[str, Array]) -> Array:
        """The drive of an axis [deg] from columns in the driver's units.

        Raises:
            InputError: a motor of the axis has no column.
        """
        self.shares(axis)
        drive = self.axes[axis]
        missing = [self.motor(name).column for name in drive if self.motor(name).column not in columns]
        if missing:
            raise InputError(f"the {axis} drive of rig {self.name!r} needs the columns {', '.join(missing)}")
        return np.asarray(sum(c * self.motor(n).from_driver(columns[self.motor(n).column]) for n, c in drive.items()))

    @classmethod
    def load(cls, path: str | Path) -> "Rig":
        """Read a TOML file, or a shipped rig by its name ("prototype").

        Raises:
            InputError: missing, no TOML, or a key or value that is none.
        """
        shipped = {file.stem: file for file in sorted((data_folder("models") / "rigs").glob("*.toml"))}
        hint = f"give a TOML file (docs/rigs.md), or a shipped rig: {', '.join(shipped)}"
        file = shipped_or_given(path, shipped, "rig", hint)
        text = read_bytes(file, most=_LARGEST_BYTES, hint=hint)
        try:
            content = tomllib.loads(text.decode("utf-8-sig"))
        except RecursionError as error:
            raise unreadable(path, ValueError("it is nested too deeply"), hint) from error
        except ValueError as error:
            raise unreadable(path, error, hint) from error
        return cls.from_plain(content, printable(path))

    @classmethod
    def from_plain(cls, content: Mapping[str, Any], source: str) -> "Rig":
        """From the content of a TOML file; `source` is for messages.

        Raises:
            InputError: a key or value that is none.
        """
        known = {"name", "command_rate_hz", "notes", "motors", "axes"}
        if set(content) - known:
            raise InputError(
                f"{source}: unknown keys {sorted(set(content) - known)}; there are {', '.join(sorted(known))}"
            )
        try:
            motors = tuple(_motor(dict(motor), source) for motor in content.get("motors", ()))
            axes = {
                str(a): {str(n): float(c) for n, c in drive.items()} for a, drive in content.get("axes", {}).items()
            }
            rate = float(content.get("command_rate_hz", 100.0))
        except InputError:
            raise
        except (TypeError, ValueError, AttributeError, OverflowError) as error:
            raise InputError(f"{source} describes no rig: {error}; docs/rigs.md shows one") from error
        return cls(str(content.get("name", Path(source).stem)), motors, axes, rate, str(content.get("notes", "")))

    def save(self, path: str | Path) -> Path:
        """Write the TOML file, with what each key means."""
        return write_text(path, to_toml(self))

    def to_plain(self) -> dict[str, Any]:
        """Plain values, as in the TOML file; what is not known is left out."""
        motors = []
        for motor in self.motors:
            row = {
                "name": motor.name, "unit": motor.unit, "counts_per_deg": motor.counts_per_deg, "zero": motor.zero,
                "sign": motor.sign, "range": list(motor.range) if all(map(isfinite, motor.range)) else None,
                "speed_limit": motor.speed_limit, "acceleration_limit": motor.acceleration_limit,
            }  # fmt: skip
            motors.append({key: value for key, value in row.items() if value is not None})
        axes = {axis: dict(drive) for axis, drive in self.axes.items()}
        return {
            "name": self.name,
            "command_rate_hz": self.command_rate_hz,
            "notes": self.notes,
            "motors": motors,
            "axes": axes,
        }


def _motor(content: dict[str, Any], source: str) -> RigMotor:
    known = set(RigMotor.__dataclass_fields__)
    if set(content) - known or "name" not in content:
        raise InputError(
            f"{source}: a motor has a name and the keys {', '.join(sorted(known - {'name'}))}; got {sorted(content)}"
        )
    numbers: dict[str, Any] = {
        key: float(content[key])
        for key in ("counts_per_deg", "zero", "speed_limit", "acceleration_limit")
        if key in content
    }
    if "range" in content:
        if not isinstance(content["range"], list) or len(content["range"]) != 2:
            raise InputError(
                f"{source}: range of motor {content['name']!r} is [low, high] in deg, got {content['range']!r}"
            )
        numbers["range"] = tuple(float(end) for end in content["range"])
    return RigMotor(str(content["name"]), str(content.get("unit", "deg")), sign=content.get("sign", 1), **numbers)


_HEAD = """\
# A rig for orient-eye: docs/rigs.md. Angles in deg; a line that begins with # is something not known: fill it in.
"""


def to_toml(rig: Rig) -> str:
    """A rig as TOML, every key there, those not known as comments."""
    rate = f"command_rate_hz = {rig.command_rate_hz!r}  # new positions a second"
    lines = [_HEAD, f"name = {quoted(rig.name)}", rate]
    if rig.notes:
        lines.append(f"notes = {quoted(rig.notes)}")
    for motor in rig.motors:
        lines += [
            "",
            "[[motors]]",
            f"name = {quoted(motor.name)}",
            f"unit = {quoted(motor.unit)}  # of the driver: deg, rad or counts",
        ]
        if motor.counts_per_deg is not None:
            lines.append(f"counts_per_deg = {motor.counts_per_deg!r}")
        lines += [
            f"zero = {motor.zero!r}  # the driver's number at 0 deg",
            f"sign = {motor.sign}  # -1: it counts the other way",
        ]
        known = all(map(isfinite, motor.range))
        lines.append(
            f"range = [{motor.range[0]!r}, {motor.range[1]!r}]  # deg" if known else "# range = [-60.0, 60.0]  # deg"
        )
        for key, value, unit, example in (
            ("speed_limit", motor.speed_limit, "deg/s", 350.0),
            ("acceleration_limit", motor.acceleration_limit, "deg/s^2", 10000.0),
        ):
            lines.append(f"# {key} = {example!r}  # {unit}" if value is None else f"{key} = {value!r}  # {unit}")
    lines += ["", "[axes]  # what turns the eye: for each axis, its drive as a weighted sum of motors"]
    for axis, drive in rig.axes.items():
        lines.append(f"{axis} = {{ {', '.join(f'{quoted(n)} = {c!r}' for n, c in drive.items())} }}")
    return "\n".join(lines) + "\n"


def quoted(value: str) -> str:
    """A text as TOML writes it."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML escapes as JSON, and this too
