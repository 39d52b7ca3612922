"""The linear surrogate of an eye: its numbers and its file (thesis 3.11; second order and dead time for rigs).

Surrogate(1.4758, 17.5)                          # K w0 / (s + w0), what the thesis calls the LPF
Surrogate(1.9, wn=12.0, zeta=0.9, dead_time=0.008, motor="servo", axis="pitch")
Surrogate.load("surrogate.json")                 # what `orient-eye sysid` wrote, or a shipped one by its name
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from orient_eye.checks import real, shown
from orient_eye.constants import ANGLES
from orient_eye.errors import InputError
from orient_eye.files import read_json, write_json
from orient_eye.motor import Motor
from orient_eye.resources import data_folder, printable, shipped_or_given

_FORMATS = ("orient-eye surrogate 2", "orient-eye surrogate 1")
_BOUNDS = {
    "K": (-1e6, 1e6, "deg/deg"), "w0": (1e-3, 1e6, "rad/s"), "wn": (1e-3, 1e6, "rad/s"), "zeta": (1e-3, 1e3, ""),
    "dead_time": (0.0, 10.0, "s"), "speed_limit": (1e-3, 1e9, "deg/s"), "acceleration_limit": (1e-3, 1e12, "deg/s^2"),
}  # fmt: skip
"""Of the numbers, with their units: none of an eye, an arm or a servo comes near."""
RANGE_DEG = 1e6
"""No motor goes farther."""


@dataclass(frozen=True)
class Surrogate:
    """A linear eye: theta = K w0 / (s + w0) e^(-L s) tau, or K wn^2 / (s^2 + 2 zeta wn s + wn^2) e^(-L s) tau.

    Attributes:
        K: static gain, deg of eye per deg of motor.
        w0: cut-off frequency of the first order [rad/s]; None for the second.
        motor: name of the motor, or of the drive of several, that it describes.
        source: where it comes from, for people: plant and options, or recordings.
        eye: the eye of ours that it stands for, a name of `orient_eye.eyes.EYES`; None for a rig.
        details: what the identification found, plain values.
        wn: natural frequency of the second order [rad/s].
        zeta: its damping ratio.
        dead_time: L [s].
        axis: about which it turns the eye: yaw, pitch or roll.
        range: of the motor [deg]; None where none is known.
        speed_limit: of the motor [deg/s].
        acceleration_limit: of the motor [deg/s^2].
        intervals: 95 % confidence intervals of the numbers, by their name.
        amplitudes: least and largest step of the motor it was found from [deg].
        rig: the description of the rig (`orient_eye.rig.Rig.to_plain`), where there is one.
        rest: where the motor stands when the eye looks straight ahead [deg]: K counts from there.

    Raises:
        InputError: numbers that make no stable eye.
    """

    K: float
    w0: float | None = None
    motor: str = "motor2"
    source: str = ""
    eye: str | None = None
    details: dict[str, Any] = field(default_factory=dict)
    wn: float | None = None
    zeta: float | None = None
    dead_time: float = 0.0
    axis: str = "yaw"
    range: tuple[float, float] | None = None
    speed_limit: float | None = None
    acceleration_limit: float | None = None
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    amplitudes: tuple[float, float] | None = None
    rig: Mapping[str, Any] | None = None
    rest: float = 0.0

    def __post_init__(self) -> None:
        for name in _BOUNDS:
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, number(name, value))
        first, second = self.w0 is not None, self.wn is not None and self.zeta is not None
        if first == second or (self.wn is None) != (self.zeta is None) or abs(self.K) < 1e-6:
            told = {name: getattr(self, name) for name in ("K", "w0", "wn", "zeta")}
            raise InputError(f"a surrogate has a gain K of 1e-6 or more either way, and w0, or wn and zeta, got {told}")
        check_kinds(self, {"motor": str, "source": str, "eye": str | None, "details": dict, "rig": Mapping | None})
        if self.axis not in ANGLES:
            raise InputError(f"an axis is yaw, pitch or roll, got {shown(self.axis)}")
        for name, largest in (("range", RANGE_DEG), ("amplitudes", np.inf)):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, ends(name, value, largest))
        intervals = {str(name): ends(f"intervals, {name},", value) for name, value in dict(self.intervals).items()}
        object.__setattr__(self, "intervals", intervals)
        object.__setattr__(self, "rest", real("rest", self.rest, -RANGE_DEG, RANGE_DEG, unit="deg"))
        self.as_motor()  # which checks range, limits and rest

    def as_motor(self, working: tuple[float, float] = (-np.inf, np.inf)) -> Motor:
        """Its motor, with the limits that are known; `working` is where a policy may send it [deg]."""
        bounds = (-np.inf, np.inf) if self.range is None else self.range
        return Motor(self.motor, "deg", bounds, working, self.speed_limit, self.acceleration_limit, self.rest)

    def to_plain(self) -> dict[str, Any]:
        """Plain values; what is not given is left out."""
        plain = {"format": _FORMATS[0], **asdict(self)}
        defaults = {f.name: f.default for f in fields(self)}
        return {k: v for k, v in plain.items() if k == "details" or (v != defaults.get(k) and v != {})}

    def save(self, path: str | Path) -> Path:
        """Write the JSON file."""
        return write_json(path, self.to_plain())

    @classmethod
    def load(cls, path: str | Path) -> "Surrogate":
        """Read the JSON file, or a shipped surrogate by its name ("thesis").

        Raises:
            InputError: missing, or not a surrogate.
        """
        return load(path, shipped_surrogates(), "surrogate", _FORMATS, lambda plain: cls(**plain), "orient-eye sysid")


T = TypeVar("T")


def load(
    path: str | Path,
    shipped: Mapping[str, Path],
    kind: str,
    formats: Sequence[str],
    make: Callable[[dict[str, Any]], T],
    writer: str,
) -> T:
    """Read a surrogate of some kind from its JSON file.

    Args:
        path: of the file, or the name of a shipped one.
        shipped: files by name.
        kind: what it is, for messages.
        formats: that are read, the present one first.
        make: makes it of the file's content without its format.
        writer: the command that writes such files.

    Raises:
        InputError: there is none, or it is none.
    """
    hint = f"give the file of a {kind} written by {writer}, or a shipped one: {', '.join(shipped)}"
    file = shipped_or_given(path, shipped, kind, hint)
    content = read_json(file, hint=hint)
    try:
        if not isinstance(content, dict) or content.pop("format", None) not in formats:
            raise ValueError(f"its format is not {formats[0]!r}")
        return make(content)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{printable(path)} is no {kind} ({error}); {hint}") from error


def check_kinds(described: object, kinds: Mapping[str, Any]) -> None:
    """Refuse attributes that are of another kind; kinds by their name, as `isinstance` takes them.

    Raises:
        InputError: one is.
    """
    for name, kind in kinds.items():
        if not isinstance(getattr(described, name), kind):
            raise InputError(f"{name} is of the wrong kind, got {shown(getattr(described, name))}; leave it out")


def number(name: str, value: Any) -> float:
    """K, w0, wn, zeta, dead_time or a limit, finite and no less or more than any eye's.

    Raises:
        InputError: it is none.
    """
    low, high, unit = _BOUNDS[name]
    return real(name, value, low, high, unit=unit)


def ends(name: str, value: Any, largest: float = np.inf) -> tuple[float, float]:
    """The two ends of a range or an interval.

    Raises:
        InputError: they are not two finite numbers, or one is larger, either way.
    """
    if not isinstance(value, Sequence) or len(value) != 2:
        raise InputError(f"{name} is two numbers, its ends, got {shown(value)}")
    return real(name, value[0], -largest, largest), real(name, value[1], -largest, largest)


def shipped_surrogates() -> dict[str, Path]:
    """Names and files of the surrogates that come with orient-eye."""
    return {file.stem: file for file in sorted(data_folder("models").glob("surrogates/*.json"))}
