"""The linear surrogate of an eye: its numbers and its file (thesis 3.11; second order and dead time for rigs).

Surrogate(1.4758, 17.5)                          # K w0 / (s + w0), what the thesis calls the LPF
Surrogate(1.9, wn=12.0, zeta=0.9, dead_time=0.008, motor="servo", axis="pitch")
Surrogate.load("surrogate.json")                 # what `orient-eye sysid` wrote, or a shipped one by its name
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from orient_eye.constants import ANGLES
from orient_eye.errors import InputError
from orient_eye.files import write_text
from orient_eye.motor import Motor
from orient_eye.resources import data_folder

_FORMATS = ("orient-eye surrogate 2", "orient-eye surrogate 1")
_LARGEST_BYTES = 16 * 2**20


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

    def __post_init__(self) -> None:
        first, second = self.w0 is not None, self.wn is not None and self.zeta is not None
        told = {name: getattr(self, name) for name in ("K", "w0", "wn", "zeta", "dead_time")}
        if first == second or (self.wn is None) != (self.zeta is None):
            raise InputError(f"a surrogate has w0, or wn and zeta, got {told}")
        rates = [self.w0] if first else [self.wn, self.zeta]
        if not (np.isfinite(self.K) and self.K != 0 and all(r is not None and 0 < r < np.inf for r in rates)):
            raise InputError(f"a surrogate needs a finite gain K != 0 and positive w0, or wn and zeta, got {told}")
        if not 0 <= self.dead_time < np.inf:
            raise InputError(f"the dead time is not negative, got {self.dead_time} s")
        if self.axis not in ANGLES:
            raise InputError(f"an axis is yaw, pitch or roll, got {self.axis!r}")
        for name in ("range", "amplitudes"):
            value = getattr(self, name)
            object.__setattr__(self, name, None if value is None else (float(value[0]), float(value[1])))
        intervals = {str(name): (float(ends[0]), float(ends[1])) for name, ends in dict(self.intervals).items()}
        object.__setattr__(self, "intervals", intervals)
        self.as_motor()  # which checks range and limits

    def as_motor(self, working: tuple[float, float] = (-np.inf, np.inf)) -> Motor:
        """Its motor, with the limits that are known; `working` is where a policy may send it [deg]."""
        bounds = (-np.inf, np.inf) if self.range is None else self.range
        return Motor(self.motor, "deg", bounds, working, self.speed_limit, self.acceleration_limit)

    def to_plain(self) -> dict[str, Any]:
        """Plain values; what is not given is left out."""
        plain = {"format": _FORMATS[0], **asdict(self)}
        defaults = {f.name: f.default for f in fields(self)}
        return {k: v for k, v in plain.items() if k == "details" or (v != defaults.get(k) and v != {})}

    def save(self, path: str | Path) -> Path:
        """Write the JSON file."""
        return write_text(path, json.dumps(self.to_plain(), indent=2) + "\n")

    @classmethod
    def load(cls, path: str | Path) -> "Surrogate":
        """Read the JSON file, or a shipped surrogate by its name ("thesis").

        Raises:
            InputError: missing, or not a surrogate.
        """
        shipped = shipped_surrogates()
        file = shipped.get(str(path), Path(path))
        try:
            if file.stat().st_size > _LARGEST_BYTES:
                raise ValueError("it is larger than any surrogate")
            content = json.loads(file.read_text(encoding="utf-8"))
            if content.pop("format") not in _FORMATS:
                raise ValueError(f"its format is not {_FORMATS[0]!r}")
            return cls(**content)
        except (OSError, KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
            raise InputError(
                f"{path} is no surrogate ({error}); give a surrogate.json written by orient-eye sysid, "
                f"or a shipped one: {', '.join(shipped)}"
            ) from error


def shipped_surrogates() -> dict[str, Path]:
    """Names and files of the surrogates that come with orient-eye."""
    return {file.stem: file for file in sorted(data_folder("models").glob("surrogates/*.json"))}
