"""The linear surrogate of an eye that all its motors turn: three low-pass plants in parallel, and their file.

    surrogate = ModalSurrogate.load("thesis-3d")     # shipped, or what `orient-eye sysid --all-motors` wrote
    surrogate.modes["pitch"].K                       # deg about y per deg of each motor

The eye is told by its rotation vector v = 2 tan(theta / 2) n [deg], turned by theta about the unit vector n (twice that
of Haustein 1989, so that for small turns it is the angle). Each of its components obeys an equation of its own,
v_i' = w_i ((K tau)_i - v_i) or the one of second order: the thesis' low-pass filter (3.11) about x, y and z. The
positions tau of the motors count from where they rest.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import listing
from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.files import write_json
from orient_eye.motor import Motor
from orient_eye.resources import data_folder
from orient_eye.surrogate import RANGE_DEG, check_kinds, ends, load, number

Array = NDArray[np.float64]
MODES = ("roll", "pitch", "yaw")
"""The axes x, y and z, in this order."""
_FORMAT = "orient-eye modal surrogate 1"
_WORKING_DEG = 40.0  # as of the arms of the eyes it stands for


@dataclass(frozen=True)
class Mode:
    """How the eye answers about one axis.

    Attributes:
        K: static gain of each motor, deg of eye per deg of motor, (motors,).
        w0: cut-off frequency of the first order [rad/s]; None for the second.
        wn: natural frequency of the second order [rad/s].
        zeta: its damping ratio.

    Raises:
        InputError: numbers that make no stable eye.
    """

    K: tuple[float, ...]
    w0: float | None = None
    wn: float | None = None
    zeta: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", tuple(number("K", gain) for gain in self.K))
        rates = {name: getattr(self, name) for name in ("w0", "wn", "zeta")}
        given = {name: rate for name, rate in rates.items() if rate is not None}
        if set(given) not in ({"w0"}, {"wn", "zeta"}):
            raise InputError(f"a mode has a positive w0, or positive wn and zeta, got {rates}")
        for name, rate in given.items():
            object.__setattr__(self, name, number(name, rate))
        if max(map(abs, self.K), default=0.0) < 1e-6:
            raise InputError(f"a mode needs finite gains, one of them not 0 (1e-6 or more), got K = {list(self.K)}")


@dataclass(frozen=True)
class ModalSurrogate:
    """A linear eye of three modes.

    Attributes:
        motors: names, (motors,).
        modes: about x, y and z, by `MODES`.
        ranges: mechanical, of each motor [deg], (motors,) pairs; None where none is known.
        dead_time: of all modes [s].
        eye: the eye of ours that it stands for, a name of `orient_eye.eyes.EYES`; None for another.
        source: where it comes from, for people.
        details: what the identification found, plain values.
        rest: where each motor stands when the eye looks straight ahead [deg], (motors,); () for 0.

    Raises:
        InputError: modes or gains that are missing, or numbers that make no stable eye.
    """

    motors: tuple[str, ...]
    modes: Mapping[str, Mode]
    ranges: tuple[tuple[float, float], ...] | None = None
    dead_time: float = 0.0
    eye: str | None = None
    source: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)
    rest: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if set(self.modes) != set(MODES):
            raise InputError(f"a modal surrogate has the modes {', '.join(MODES)}, got {', '.join(self.modes)}")
        object.__setattr__(self, "motors", tuple(self.motors))
        object.__setattr__(self, "modes", {axis: self.modes[axis] for axis in MODES})
        check_kinds(self, {"source": str, "eye": str | None, "details": Mapping})
        if not all(isinstance(name, str) for name in self.motors):
            raise InputError(f"motors have names, got {self.motors}")
        ranges = None if self.ranges is None else tuple(ends("range", each, RANGE_DEG) for each in self.ranges)
        object.__setattr__(self, "ranges", ranges)
        object.__setattr__(self, "dead_time", number("dead_time", self.dead_time))
        rest = tuple(real("rest", at, -RANGE_DEG, RANGE_DEG, unit="deg") for at in self.rest) or (0.0,) * len(
            self.motors
        )
        object.__setattr__(self, "rest", rest)
        each = {axis: len(mode.K) for axis, mode in self.modes.items()}
        if ranges is not None:
            each["ranges"] = len(ranges)
        each["rest"] = len(rest)
        if not self.motors or any(count != len(self.motors) for count in each.values()):
            raise InputError(f"a modal surrogate of {len(self.motors)} motors has as many of each number, got {each}")
        self.as_motors()  # which checks the ranges, and that the motors rest inside

    @property
    def K(self) -> Array:
        """Gains, deg of eye per deg of motor, (3, motors)."""
        return np.array([mode.K for mode in self.modes.values()])

    def as_motors(self) -> tuple[Motor, ...]:
        """Its motors, (motors,); as of the eyes, a policy may send an arm to 40 deg, a wound spindle anywhere."""
        ranges = self.ranges or ((-np.inf, np.inf),) * len(self.motors)
        arm = (-_WORKING_DEG, _WORKING_DEG)
        return tuple(
            Motor(name, "deg", each, each if rest else arm, rest=rest)
            for name, each, rest in zip(self.motors, ranges, self.rest, strict=True)
        )

    def to_plain(self) -> dict[str, Any]:
        """Plain values; numbers that are not there are left out."""
        modes = {
            axis: {name: value for name, value in asdict(mode).items() if value is not None} | {"K": list(mode.K)}
            for axis, mode in self.modes.items()
        }
        ranges = None if self.ranges is None else [list(ends) for ends in self.ranges]
        told = {
            "motors": list(self.motors), "modes": modes, "ranges": ranges, "dead_time": self.dead_time or None,
            "rest": list(self.rest) if any(self.rest) else None, "eye": self.eye, "source": self.source or None,
            "details": dict(self.details) or None,
        }  # fmt: skip
        return {key: value for key, value in told.items() if value is not None}

    @classmethod
    def from_plain(cls, content: Mapping[str, Any]) -> "ModalSurrogate":
        """The surrogate that `to_plain` wrote.

        Raises:
            TypeError, KeyError, AttributeError, ValueError: it did not; `InputError` is a ValueError.
        """
        return cls(**{**content, "modes": {axis: Mode(**mode) for axis, mode in content["modes"].items()}})

    def save(self, path: str | Path) -> Path:
        """Write the JSON file."""
        return write_json(path, {"format": _FORMAT, **self.to_plain()})

    @classmethod
    def load(cls, path: str | Path) -> "ModalSurrogate":
        """Read the JSON file, or a shipped surrogate by its name ("thesis-3d").

        Raises:
            InputError: missing, or not a modal surrogate.
        """
        writer = "orient-eye sysid --all-motors"
        return load(path, shipped_modal_surrogates(), "modal surrogate", (_FORMAT,), cls.from_plain, writer)


def shipped_modal_surrogates() -> dict[str, Path]:
    """Names and files of the modal surrogates that come with orient-eye."""
    return {file.stem: file for file in sorted(data_folder("models").glob("surrogates_3d/*.json"))}


def as_vector(orientation: ArrayLike) -> Array:
    """Rotation vectors 2 tan(theta / 2) n [deg] (..., 3) of orientations (..., 4); infinite at half a turn."""
    return np.asarray(2 * np.rad2deg(listing.rotation_vectors(orientation)))


def as_orientation(vector: Array) -> Array:
    """Orientations (..., 4) of rotation vectors [deg] (..., 3)."""
    half = np.deg2rad(vector) / 2
    q = np.concatenate([np.ones((*half.shape[:-1], 1)), half], axis=-1)
    return np.asarray(q / np.sqrt(_dot(q, q))[..., None])


def angular_velocity(vector: Array, rate: Array) -> Array:
    """Angular velocity in the head frame [deg/s] (..., 3): 2 (r' + r x r') / (1 + r^2) (Haustein 1989).

    Args:
        vector: rotation vectors 2 r [deg], (..., 3).
        rate: their time derivatives [deg/s], (..., 3).
    """
    r = np.deg2rad(vector) / 2
    return np.asarray((rate + np.cross(r, rate)) / (1 + _dot(r, r))[..., None])


def vector_rate(vector: Array, velocity: Array) -> Array:
    """The inverse of `angular_velocity`: rates of rotation vectors [deg/s] (..., 3)."""
    r = np.deg2rad(vector) / 2
    return np.asarray(velocity + np.cross(velocity, r) + _dot(r, velocity)[..., None] * r)


def _dot(one: Array, other: Array) -> Array:
    """Of vectors (..., n), the same in any batch."""
    return np.asarray(np.einsum("...i,...i->...", one, other))
