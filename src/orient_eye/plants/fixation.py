"""How an eye holds a direction of gaze with all its motors: at one torsion or another, or with the least force.

    fixations = Fixations.of(plant)
    fixations.torsion(direction)                     # of the least force [deg], directions (n, 3)
    fixations.motor(direction)                       # (n, motors)

Three motors turn an eye about three axes, so a direction of gaze leaves the torsion open. The force of a fixation is
the sum over the motors' pairs of elastics of the squared difference of their tensions [N^2]; one torsion has the least.
Of a plant with more motors than axes it is the squared change of the motors from their pretension [rad^2].
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.polynomial.chebyshev import chebvander2d
from numpy.typing import NDArray

from orient_eye import listing
from orient_eye.errors import InputError
from orient_eye.motor import names, redundant
from orient_eye.plants import Plant

Array = NDArray[np.float64]
Rule = Literal["least force", "listing", "fick"]
"""How the torsion of a fixation is chosen."""
_DEGREE, _SPOKES = 10, 32  # of the fits with as many rings: to 1e-4 deg
_DEGREE_OF_MORE, _SPOKES_OF_MORE = 16, 48  # of more motors than axes: to 7e-4 deg at 40 deg, 3e-5 within 25
_REACHES = np.arange(50.0, 0.0, -5.0)  # deg, tried from the largest
_TORSIONS = np.arange(-12.0, 12.1, 3.0)  # deg, from which the least force is looked for
_TORSIONS_OF_MORE = np.arange(-24.0, 24.1, 3.0)  # their plane is tilted
_ROUNDS = 6


@dataclass(frozen=True)
class Fixations:
    """Torsion, motors and force of fixations as smooth functions of the direction of gaze.

    Attributes:
        limit_deg: angle from straight ahead up to which the eye holds every direction; of one beyond it, the nearest
            inside is told.
        coefficients: of the fits, (terms, 1 + motors + 1).
        degree: of the fits.
    """

    limit_deg: float
    coefficients: Array
    degree: int = _DEGREE

    @classmethod
    def of(cls, plant: Plant, rule: Rule | None = None) -> "Fixations":
        """Those of a plant.

        Args:
            plant: with motors that turn the eye about all axes.
            rule: of the torsion: of the "least force" (on a plant without elastics none), of "listing" (none), or
                "fick", that of a gimbal that turns the eye by yaw, then pitch; None for the first.

        Raises:
            InputError: an unknown rule, or its motors hold no cone of directions.
        """
        if rule is not None and rule not in get_args(Rule):
            raise InputError(f"the torsion of fixations follows {', '.join(get_args(Rule))}, or None, got {rule!r}")
        key = json.dumps([plant.identity(), rule], sort_keys=True)
        if key not in _SOLVED:
            _SOLVED[key] = cls._solved(plant.twin() or plant, rule)
        return _SOLVED[key]

    @classmethod
    def _solved(cls, plant: Plant, rule: Rule | None) -> "Fixations":
        more = redundant(plant.motors)
        degree, spokes = (_DEGREE_OF_MORE, _SPOKES_OF_MORE) if more else (_DEGREE, _SPOKES)
        for limit in _REACHES:
            direction = _cone(limit, degree, spokes)
            edge = np.isfinite(fixate(plant, direction[-spokes:], rule)[1]).all()
            values = np.column_stack(fixate(plant, direction, rule)) if edge else np.full((1, 1), np.nan)
            if np.isfinite(values).all():
                fitted = np.linalg.lstsq(_terms(direction, limit, degree), values, rcond=None)[0]
                return cls(float(limit), fitted, degree)
        raise InputError(
            f"the motors of plant {plant.name!r} ({', '.join(names(plant.motors))}) do not hold the eye in every "
            "direction around straight ahead; choose targets about one axis"
        )

    def _told(self, direction: Array) -> Array:
        if not len(direction):
            return np.empty((0, self.coefficients.shape[1]))
        return np.asarray(_terms(direction, self.limit_deg, self.degree) @ self.coefficients)

    def torsion(self, direction: Array) -> Array:
        """[deg] (n,) at directions (n, 3)."""
        return self._told(direction)[:, 0]

    def orientation(self, direction: Array) -> Array:
        """(n, 4) at directions (n, 3)."""
        return listing.with_torsion(direction, self.torsion(direction))

    def motor(self, direction: Array) -> Array:
        """Positions (n, motors) at directions (n, 3)."""
        return self._told(direction)[:, 1:-1]

    def force(self, direction: Array) -> Array:
        """[N^2 or rad^2] (n,) at directions (n, 3); 0 on a plant without elastics."""
        return self._told(direction)[:, -1]


_SOLVED: dict[str, Fixations] = {}  # of plants of this process, by identity: an eye's never change


def knows_elastics(plant: Plant) -> bool:
    """Whether the force of a fixation is known on this plant."""
    return plant.force(np.empty((0, 4)), np.empty((0, len(plant.motors)))) is not None


def fixate(plant: Plant, direction: Array, rule: Rule | None = None) -> tuple[Array, Array, Array]:
    """Torsion [deg] (n,), motors (n, motors) and force (n,) of fixations; NaN where the motors cannot hold one.

    Args:
        plant: with motors that turn the eye about all axes.
        direction: of gaze, (n, 3).
        rule: as of `Fixations.of`.
    """
    count = len(direction)
    if rule == "fick":
        return _at(plant, direction, listing.ficks_torsion(direction))
    if rule == "listing" or not knows_elastics(plant):
        return _at(plant, direction, np.zeros(count))
    return _at(plant, direction, best_torsion(lambda tried: _held(plant, tried)[1], direction, _tried(plant)))


def best_torsion(cost: Callable[[Array], Array], direction: Array, tried_deg: Array = _TORSIONS_OF_MORE) -> Array:
    """Torsion [deg] (n,) at which it costs least to look along directions (n, 3).

    Args:
        cost: of orientations (n, 4), (n,); NaN or infinite where there is none.
        direction: of gaze.
        tried_deg: torsions from which the least is looked for, equally spaced.
    """
    torsion, step = np.zeros(len(direction)), 0.0
    offsets = tried_deg
    for _ in range(_ROUNDS):
        tried = torsion[:, None] + offsets
        flat = np.repeat(direction, len(offsets), axis=0)
        torsion = _lowest(tried, cost(listing.with_torsion(flat, tried.ravel())).reshape(tried.shape))
        step = (step or float(offsets[1] - offsets[0])) / 3
        offsets = step * np.array([-1.0, 0.0, 1.0])
    return torsion


def _tried(plant: Plant) -> Array:
    return _TORSIONS_OF_MORE if redundant(plant.motors) else _TORSIONS


def _at(plant: Plant, direction: Array, torsion: Array) -> tuple[Array, Array, Array]:
    """Torsion, motors and force at a given torsion (n,)."""
    return torsion, *_held(plant, listing.with_torsion(direction, torsion))


def _held(plant: Plant, orientation: Array) -> tuple[Array, Array]:
    """Motors and force of orientations (n, 4)."""
    motor = plant.held(orientation, names(plant.motors))
    held = np.isfinite(motor).all(axis=1)
    found = plant.force(orientation[held], motor[held])
    force = np.full(len(motor), np.nan)
    force[held] = 0.0 if found is None else found
    return motor, force


def _lowest(x: Array, value: Array) -> Array:
    """Where values (n, points) at equally spaced x (n, points) are least, by the parabola through the least; (n,)."""
    value = np.where(np.isfinite(value), value, np.inf)
    rows, least = np.arange(len(x)), value.argmin(axis=1)
    middle = np.clip(least, 1, x.shape[1] - 2)
    left, here, right = (value[rows, middle + k] for k in (-1, 0, 1))
    with np.errstate(invalid="ignore"):
        bend = left - 2 * here + right
        smooth = (middle == least) & np.isfinite(bend) & (bend > 0)
        shift = np.where(smooth, 0.5 * (left - right) / np.where(smooth, bend, 1.0), 0.0)
    return np.asarray(x[rows, least] + shift * (x[:, 1] - x[:, 0]))


def _cone(limit_deg: float, rings: int, spokes: int) -> Array:
    """Directions all over a cone, denser towards its edge, (n, 3)."""
    away = np.deg2rad(limit_deg) * np.sin(np.pi / 2 * np.arange(1, rings + 1) / rings)
    around = 2 * np.pi * np.arange(spokes) / spokes
    away, around = (g.ravel() for g in np.meshgrid(away, around, indexing="ij"))
    points = np.stack([np.cos(away), np.sin(away) * np.cos(around), np.sin(away) * np.sin(around)], axis=1)
    return np.concatenate([[[1.0, 0.0, 0.0]], points])


def _terms(direction: Array, limit_deg: float, degree: int) -> Array:
    """Chebyshev's polynomials of total degree up to one (n, terms), of directions moved inside the cone."""
    half = np.tan(np.deg2rad(limit_deg) / 2)
    r = listing.rotation_vectors(listing.with_torsion(direction, 0.0))[:, 1:] / half
    r = r / np.maximum(np.linalg.norm(r, axis=1, keepdims=True), 1.0)
    low = np.add.outer(np.arange(degree + 1), np.arange(degree + 1)) <= degree
    return np.asarray(chebvander2d(r[:, 0], r[:, 1], [degree, degree])[:, low.ravel()])
