"""Where saccades start and where they go: orientations, drawn by a set of targets made for a plant.

    targets = make_targets("horizontal", plant)
    start, target = targets.draw(100, random)        # State, orientations (saccades, 4)
    start, target = targets.saccades([[0.0]], [[20.0]])   # by angles [deg], (saccades, angles)

Another set is a class with the members of `Targets` and a line in `TARGETS`.
"""

import contextlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import rotations
from orient_eye.checks import real, whole
from orient_eye.constants import YAW_LIMIT_DEG
from orient_eye.errors import InputError
from orient_eye.motor import check_driven, names, redundant, rests
from orient_eye.movement.measures import View
from orient_eye.plants import Plant, PulseRates
from orient_eye.plants.turns import turned
from orient_eye.state import State, unit
from orient_eye.task.target_sets import TARGETS

Array = NDArray[np.float64]
LEAST_DEG, MOST = 1e-3, 1_000_000
"""Of a range, a cone, and what a degree of motor turns; saccades drawn at once."""
HORIZON_S = 0.7
"""A saccade up or down takes longer than one to the side."""


class Targets(Protocol):
    """A set of starts and targets.

    Attributes:
        name: key in `TARGETS`.
        angles: what a direction is told by: column names with their unit, ("yaw_deg",).
        driven: motors that can make these saccades.
        of: what of a saccade counts, "orientation" or "gaze".
        limit_deg: how far from straight ahead they are drawn.
        actions: kind of action that suits them, in `orient_eye.task.actions.ACTIONS`.
        pulse_rates: bounds of B and k0 that hold their best pulse-steps; None where the plant's do.
        learning: settings of a training that suit them where they differ from the usual ones
            (`orient_eye.learning.config.TrainConfig`).
        horizon_s: how long such a saccade lasts on a plant that needs a horizon; None for as long as the plant says.
    """

    name: str
    angles: tuple[str, ...]
    driven: tuple[str, ...]
    of: View
    limit_deg: float
    actions: str
    pulse_rates: PulseRates | None
    horizon_s: float | None
    learning: Mapping[str, Any]

    def draw(self, count: int, random: np.random.Generator) -> tuple[State, Array]:
        """Starts, which the plant can hold, and target orientations (count, 4).

        Raises:
            InputError: a count that is none, see `checked_count`.
        """
        ...

    def orientation(self, angles: ArrayLike) -> Array:
        """Orientations (saccades, 4) of directions told by angles (saccades, angles)."""
        ...

    def angles_of(self, orientation: Array) -> Array:
        """Angles (saccades, angles) of orientations (saccades, 4)."""
        ...

    def rest(self, orientation: Array) -> State:
        """Eyes at rest in these orientations (saccades, 4).

        Raises:
            InputError: an orientation that the driven motors cannot hold.
        """
        ...

    def check(self, angles: Array, what: str, *, drawn: bool = False) -> None:
        """Refuse directions (saccades, angles) that the plant cannot hold; if drawn, also those that are never drawn.

        Raises:
            InputError: says which, and what is allowed; `what` is "start" or "target".
        """
        ...

    def of_sizes(self, size_deg: Array, starts: int) -> tuple[Array, Array]:
        """Angles of starts and targets, each (n, angles): every size from points all over the range, both ways."""
        ...

    def symmetric(self, size_deg: Array) -> tuple[Array, Array]:
        """Angles of starts and targets (sizes, angles) of one saccade of each size around straight ahead."""
        ...

    def identity(self) -> dict[str, Any]:
        """What makes this set this one, in plain values: `targets`, its name, and its options."""
        ...


def saccades(targets: Targets, start: ArrayLike, target: ArrayLike) -> tuple[State, Array]:
    """Chosen saccades, by the angles of their starts and targets [deg], each (saccades, angles).

    Raises:
        InputError: other shapes, or a start that the plant cannot hold.
    """
    angles = [np.asarray(a, dtype=float) for a in (start, target)]
    shape = (len(angles[0]), len(targets.angles))
    if any(a.shape != shape for a in angles):
        raise InputError(
            f"saccades among {targets.name} targets have starts and targets of shape (saccades, {shape[1]}: "
            f"{', '.join(targets.angles)}), got {angles[0].shape} and {angles[1].shape}"
        )
    return targets.rest(targets.orientation(angles[0])), targets.orientation(angles[1])


def checked_count(count: int) -> int:
    """How many saccades are drawn, if a computer can make so many at once.

    Raises:
        InputError: it cannot, or that is no number of saccades.
    """
    return whole("the number of saccades", count, 0, MOST, advice=f"{MOST} take 8 GB once they are simulated")


_NAMES = {"yaw": "horizontal", "pitch": "vertical", "roll": "torsional"}
_AXES = {axis: place for place, axis in enumerate(_NAMES)}  # among the angles of `rotations.to_euler`
_PURE = 0.05  # of what a motor turns about the axis, it may turn about the others
_REACH = 0.98  # of what the plant can hold


class AxisTargets:
    """Rotations about one axis of the head, starts and targets drawn evenly from a range (thesis 4.6).

    Args:
        plant: for which they are made.
        name: of the set, as it is registered; None for horizontal, vertical or torsional, after the axis.
        axis: "yaw", "pitch" or "roll".
        limit_deg: of the range, to either side; less where the plant's motors do not reach it.
        driven: motors to use; None for those that turn the eye about this axis alone, or where there is none for
            all that turn it about this axis.

    Raises:
        InputError: no motor of the plant turns the eye about this axis, or there are more motors than axes, which turn
            it about all of them at once.
    """

    of: View = "orientation"
    actions = "pulse-step"
    pulse_rates = None
    learning: Mapping[str, Any] = MappingProxyType({})

    def __init__(
        self,
        plant: Plant,
        *,
        name: str | None = None,
        axis: str = "yaw",
        limit_deg: float = YAW_LIMIT_DEG,
        driven: tuple[str, ...] | None = None,
    ) -> None:
        if axis not in _NAMES:
            raise InputError(f"an axis is {', '.join(_NAMES)}, got {axis!r}")
        if redundant(plant.motors):
            raise InputError(
                f"the {len(plant.motors)} motors of plant {plant.name!r} turn the eye about all axes at once; choose "
                "the targets gaze"
            )
        self.plant, self.name, self.axis, self.angles = plant, name or _NAMES[axis], axis, (f"{axis}_deg",)
        self.driven = _turning(plant, axis) if driven is None else driven
        if not self.driven:
            raise InputError(f"no motor of plant {plant.name!r} turns the eye in {axis}; choose other targets")
        limit_deg = real(f"the range of {self.name} targets", limit_deg, LEAST_DEG, 179.0, unit="deg")
        self.horizon_s = None if axis != "pitch" or plant.horizon_s is None else max(plant.horizon_s, HORIZON_S)
        self.low, self.high = _held(plant, self.driven, axis)
        self.limit_deg = float(min(limit_deg, _REACH * min(-self.low, self.high)))
        if not self.limit_deg > LEAST_DEG:
            raise InputError(
                f"motors {', '.join(self.driven)} of plant {plant.name!r} hold the eye between {self.low:.2f} and "
                f"{self.high:.2f} deg of {axis}, not around straight ahead; choose other targets or motors"
            )

    def identity(self) -> dict[str, Any]:
        """Name and range."""
        return {"targets": self.name, "limit_deg": self.limit_deg}

    def draw(self, count: int, random: np.random.Generator) -> tuple[State, Array]:
        """See `Targets`."""
        count = checked_count(count)
        start, target = random.uniform(-self.limit_deg, self.limit_deg, (2, count, 1))
        return self.rest(self.orientation(start)), self.orientation(target)

    def orientation(self, angles: ArrayLike) -> Array:
        """See `Targets`."""
        return rotations.about(self.axis, np.asarray(angles, dtype=float)[:, 0])

    def angles_of(self, orientation: Array) -> Array:
        """See `Targets`."""
        return rotations.to_euler(orientation)[_AXES[self.axis]][:, None]

    def rest(self, orientation: Array) -> State:
        """See `Targets`."""
        orientation = unit(orientation)
        return State(orientation, self.plant.hold(orientation, self.driven))

    def check(self, angles: Array, what: str, *, drawn: bool = False) -> None:
        """See `Targets`."""
        low, high = (-self.limit_deg, self.limit_deg) if drawn else (self.low, self.high)
        for value in angles[~((angles >= low) & (angles <= high))]:
            can = "saccades are learned" if drawn else f"the eye of plant {self.plant.name!r} can be held"
            raise InputError(
                f"{what} at {value:g} deg: {can} between {low:.1f} and {high:.1f} deg of {self.axis}; choose an "
                "angle in this range"
            )

    def of_sizes(self, size_deg: Array, starts: int) -> tuple[Array, Array]:
        """See `Targets`; sizes that the range does not hold are left out."""
        size_deg = size_deg[size_deg < 2 * self.limit_deg]
        share, size = np.meshgrid(np.linspace(0, 1, starts), size_deg)
        start = (-self.limit_deg + share * (2 * self.limit_deg - size)).ravel()
        ends = start, start + size.ravel()
        return np.concatenate(ends)[:, None], np.concatenate(ends[::-1])[:, None]

    def symmetric(self, size_deg: Array) -> tuple[Array, Array]:
        """See `Targets`; in the positive direction."""
        half = np.asarray(size_deg, dtype=float)[:, None] / 2
        half = half[(half <= self.limit_deg)[:, 0]]
        return -half, half


def _effect(plant: Plant) -> Array:
    """Yaw, pitch and roll [deg] (motors, 3) by which a degree of each motor turns the eye from where it rests."""
    return np.stack(rotations.to_euler(turned(plant).as_quat(scalar_first=True)), axis=-1)


def _turning(plant: Plant, axis: str) -> tuple[str, ...]:
    """Motors that turn the eye from rest about this axis alone, or failing that all that turn it about it."""
    turned = np.abs(_effect(plant))
    about = turned[:, _AXES[axis]]
    others = np.delete(turned, _AXES[axis], axis=1).max(axis=1)
    pure = (about > LEAST_DEG) & (others < _PURE * about)
    chosen = pure if pure.any() else about > np.maximum(LEAST_DEG, _PURE * others)
    return tuple(name for name, is_chosen in zip(names(plant.motors), chosen, strict=True) if is_chosen)


def _held(plant: Plant, driven: tuple[str, ...], axis: str) -> tuple[float, float]:
    """Least and largest angle at which the driven motors can hold the eye inside their working range."""
    motor, effect = np.tile(rests(plant.motors), (33, 1)), _effect(plant)[:, _AXES[axis]]
    for index in check_driven(plant.motors, driven, plant.name):
        low, high = plant.motors[index].working
        sweep = np.linspace(max(low, -1e3), min(high, 1e3), len(motor))
        motor[:, index] = sweep if effect[index] > 0 else sweep[::-1]
    held = np.unwrap(rotations.to_euler(plant.rest(motor))[_AXES[axis]], period=360)
    held = held - 360 * np.round(held[len(held) // 2] / 360)  # straight ahead is in the middle
    return max(float(held.min()), -179.0), min(float(held.max()), 179.0)


def vertical(plant: Plant, **options: Any) -> AxisTargets:
    """Rotations up and down; options as those of `AxisTargets`."""
    return AxisTargets(plant, axis="pitch", **options)


def torsional(plant: Plant, **options: Any) -> AxisTargets:
    """Rotations about the line of sight; options as those of `AxisTargets`."""
    return AxisTargets(plant, axis="roll", **options)


def make_targets(name: str | None, plant: Plant, **options: Any) -> Targets:
    """The set of that name for a plant.

    Args:
        name: one of `TARGETS`; None for the first that the plant can make: horizontal, else vertical, else torsional,
            else gaze.
        plant: for which it is made.
        options: of the set.

    Raises:
        InputError: unknown, or nothing that this plant can do.
    """
    if name is not None:
        return TARGETS[name](plant, **options)
    for candidate in (*_NAMES.values(), "gaze"):
        with contextlib.suppress(InputError):  # the plant does not turn the eye about this axis: the next one
            return TARGETS[candidate](plant, **options)
    return TARGETS["gaze" if redundant(plant.motors) else "horizontal"](plant, **options)


def restore_targets(identity: dict[str, Any], plant: Plant, driven: tuple[str, ...]) -> Targets:
    """The set of an identity, for a plant."""
    options = {key: value for key, value in identity.items() if key != "targets"}
    return make_targets(str(identity["targets"]), plant, driven=driven, **options)
