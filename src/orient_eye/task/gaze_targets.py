"""Saccades in all directions: from anywhere in a cone around straight ahead to anywhere in it, by all motors.

    targets = make_targets("gaze", plant)
    start, target = saccades(targets, [[0.0, 0.0]], [[20.0, -10.0]])      # yaw, pitch [deg]; pitch is positive down

A target is a direction of gaze. The orientation that stands for it has the torsion at which the eye holds it with the
least force, but what the eye does about its line of sight is free: the reward looks at the gaze.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import listing, rotations
from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.motor import check_driven, names, redundant
from orient_eye.movement.measures import View
from orient_eye.plants import Plant, PulseRates
from orient_eye.plants.fixation import Fixations
from orient_eye.state import State, unit
from orient_eye.task import generator_actions
from orient_eye.task.targets import HORIZON_S, LEAST_DEG, checked_count

Array = NDArray[np.float64]
LIMIT_DEG, REDUNDANT_LIMIT_DEG = 30.0, 25.0
"""Starts and targets are drawn up to this angle from straight ahead: the second of an eye with more motors than axes,
which is not stable far to the side of its nose."""
TORSION_DEG = 0.6
"""Starts have up to so much torsion more or less than that of the least force, as a saccade may have ended."""
RATES = PulseRates((12.0, 120.0), (2.0, 60.0))
"""Hold the best pulse-steps in all directions: the eye is slower up and down than to the sides."""
_LEARNING: Mapping[str, Any] = MappingProxyType(
    {
        "updates": 26_000,
        "batch_size": 1024,
        "replay_size": 150_000,
        "temperature": (0.02, 3e-4),
        "doubt": 1e-3,
        "evaluation_pairs": 24,
    }
)
_LEARNING_OF_MORE: Mapping[str, Any] = MappingProxyType(
    {
        **_LEARNING,
        "updates": 72_000,
        "batch_size": 512,
        "learning_rate": 0.002,
        "saccades_per_update": 4,
        "updates_per_rollout": 32,
    }
)
"""Of more motors than axes."""
_AROUND = 32  # directions at the edge of the cone, at which it is looked what the motors can hold
_LESS = 0.8  # times the torsion, until they can


class GazeTargets:
    """Directions of gaze in a cone, drawn evenly; see `orient_eye.task.targets.Targets`.

    Args:
        plant: for which they are made.
        name: of the set, as it is registered.
        limit_deg: of the cone; less where the motors do not hold it; None for the usual one.
        torsion_deg: of drawn starts, about that of the least force; less where the motors do not hold it.
        driven: motors to use; None for all.

    Raises:
        InputError: motors that do not turn the eye in all directions, or numbers that are none.
    """

    angles = ("yaw_deg", "pitch_deg")
    of: View = "gaze"

    def __init__(
        self,
        plant: Plant,
        *,
        name: str = "gaze",
        limit_deg: float | None = None,
        torsion_deg: float = TORSION_DEG,
        driven: tuple[str, ...] | None = None,
    ) -> None:
        many = redundant(plant.motors)
        self.actions = "generator-ratios" if many else "residual"
        limit_deg = (REDUNDANT_LIMIT_DEG if many else LIMIT_DEG) if limit_deg is None else limit_deg
        limit_deg = real("the cone of gaze targets", limit_deg, LEAST_DEG, 89.0, unit="deg from straight ahead")
        torsion_deg = real("torsion of starts", torsion_deg, 0.0, 89.0, unit="deg")
        self.plant, self.name = plant, name
        self.driven = names(plant.motors) if driven is None else driven
        if len(check_driven(plant.motors, self.driven, plant.name)) < len(plant.motors):
            raise InputError(
                f"gaze targets need all motors of plant {plant.name!r} ({', '.join(names(plant.motors))}), got "
                f"{', '.join(self.driven)}; choose other targets, or leave driven out"
            )
        self.fixations = Fixations.of(plant)
        self.reach_deg = self.fixations.limit_deg
        self.limit_deg = float(min(limit_deg, self.reach_deg))
        self.torsion_deg = self._held(torsion_deg)
        self.pulse_rates = plant.pulse_rates or (generator_actions.RATES if many else RATES)
        self.horizon_s = None if plant.horizon_s is None else max(plant.horizon_s, HORIZON_S)

    @property
    def learning(self) -> Mapping[str, Any]:
        """See `orient_eye.task.targets.Targets`."""
        return _LEARNING_OF_MORE if redundant(self.plant.motors) else _LEARNING

    def _held(self, torsion_deg: float) -> float:
        """The torsion that the motors hold, both ways, all around the edge of the cone."""
        around = 2 * np.pi * np.arange(_AROUND) / _AROUND
        edge = _directions(np.full(_AROUND, self.limit_deg), around)
        usual = self.fixations.torsion(edge)
        while torsion_deg > 0.01:
            both = np.concatenate([listing.with_torsion(edge, usual + side * torsion_deg) for side in (-1, 1)])
            if np.isfinite(self.plant.held(both, self.driven)).all():
                return float(torsion_deg)
            torsion_deg *= _LESS
        return 0.0

    def identity(self) -> dict[str, Any]:
        """Name, cone and torsion."""
        return {"targets": self.name, "limit_deg": self.limit_deg, "torsion_deg": self.torsion_deg}

    def draw(self, count: int, random: np.random.Generator) -> tuple[State, Array]:
        """See `orient_eye.task.targets.Targets`."""
        away, around, torsion = random.uniform(size=(3, 2, checked_count(count)))
        start, target = (
            _directions(self.limit_deg * np.sqrt(a), 2 * np.pi * b) for a, b in zip(away, around, strict=True)
        )
        rolled = self.fixations.torsion(start) + self.torsion_deg * (2 * torsion[0] - 1)
        return self.rest(listing.with_torsion(start, rolled)), self.fixations.orientation(target)

    def orientation(self, angles: ArrayLike) -> Array:
        """See `orient_eye.task.targets.Targets`; with the torsion of the least force."""
        yaw, pitch = np.asarray(angles, dtype=float).T
        return self.fixations.orientation(listing.directions(yaw, pitch))

    def angles_of(self, orientation: Array) -> Array:
        """See `orient_eye.task.targets.Targets`."""
        return np.stack(rotations.to_euler(orientation)[:2], axis=-1)

    def rest(self, orientation: Array) -> State:
        """See `orient_eye.task.targets.Targets`."""
        orientation = unit(orientation)
        return State(orientation, self.plant.hold(orientation, self.driven))

    def check(self, angles: Array, what: str, *, drawn: bool = False) -> None:
        """See `orient_eye.task.targets.Targets`."""
        limit = self.limit_deg if drawn else self.reach_deg
        away = rotations.angle_between_directions(listing.directions(*angles.T), [1.0, 0.0, 0.0])
        for told, far in zip(angles[~(away <= limit + 1e-9)], away[~(away <= limit + 1e-9)], strict=True):
            can = "saccades are learned" if drawn else f"the eye of plant {self.plant.name!r} can be held"
            raise InputError(
                f"{what} at {told[0]:g}, {told[1]:g} deg (yaw, pitch) is {far:.1f} deg from straight ahead: {can} up "
                f"to {limit:.1f} deg; choose a direction inside that cone"
            )

    def of_sizes(self, size_deg: Array, starts: int) -> tuple[Array, Array]:
        """See `orient_eye.task.targets.Targets`; around straight ahead, in directions all around."""
        size_deg = size_deg[size_deg < 2 * self.limit_deg]
        around, size = (g.ravel() for g in np.meshgrid(2 * np.pi * np.arange(starts) / starts, size_deg))
        return self._opposite(size / 2, around)

    def symmetric(self, size_deg: Array) -> tuple[Array, Array]:
        """See `orient_eye.task.targets.Targets`; oblique ones, up and to the left."""
        half = np.asarray(size_deg, dtype=float) / 2
        half = half[half <= self.limit_deg]
        return self._opposite(half, np.full(half.shape, np.pi / 4))

    def _opposite(self, half_deg: Array, around: Array) -> tuple[Array, Array]:
        """Angles of starts and targets on either side of straight ahead."""
        ends = (
            rotations.to_euler(listing.with_torsion(_directions(half_deg, way), 0.0))
            for way in (around + np.pi, around)
        )
        start, target = (np.stack(end[:2], axis=-1) for end in ends)
        return start, target


def _directions(away_deg: Array, around: Array) -> Array:
    """Directions (n, 3) at an angle from straight ahead [deg] and around it [rad], from left over up."""
    away = np.deg2rad(away_deg)
    return np.stack([np.cos(away), np.sin(away) * np.cos(around), np.sin(away) * np.sin(around)], axis=-1)
