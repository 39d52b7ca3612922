"""Statics of gaze: where an eye can look, with which torsion, and what its motors have to do for it.

    reach(plant).min()                               # the largest cone that the eye holds [deg]
    held = Held.of(plant, cone(30.0))
    fit_plane(held.orientation).twist                # of Listing's plane of the fixations of least force

All within the motors' working ranges. Left and up are those of `orient_eye.movement.oblique.seen_from`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye import listing, rotations
from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.motor import names
from orient_eye.movement.oblique import toward
from orient_eye.plants import Plant
from orient_eye.plants.fixation import fixate, knows_elastics

Array = NDArray[np.float64]
_AHEAD = np.array([1.0, 0.0, 0.0])
_AROUND, _RINGS = 36, 10
_HALVINGS = 11  # of an interval: to some hundredths of a degree
_FARTHEST_DEG = 40.0  # of torsion, from that of least force
_TURN = 0.5  # of a motor's unit, to either side
_LEVELS = 5  # of each motor, at which it is looked how far the eye goes
_POINTS = 14  # of a grid, from straight ahead to its edge
_FORCES = "choose plant mujoco, tavares or viscous"


@dataclass(frozen=True)
class Held:
    """How an eye holds directions of gaze.

    Attributes:
        direction: unit vectors, (n, 3).
        torsion: of the least force [deg], (n,); NaN where the motors hold the direction at no torsion (see `reach`).
        motor: of the least force, (n, motors); NaN the same.
        force: the least [N^2] (`orient_eye.plants.fixation`), (n,); NaN the same.
        range: least and largest torsion up to which the motors hold the direction [deg], (n, 2); NaN the same.
    """

    direction: Array
    torsion: Array
    motor: Array
    force: Array
    range: Array

    @classmethod
    def of(cls, plant: Plant, direction: Array) -> "Held":
        """Of a plant, looking along directions (n, 3).

        Raises:
            InputError: of the plant no elastics are known, or its motors do not turn the eye about all axes.
        """
        require_elastics(plant)
        plant = plant.twin() or plant
        torsion, motor, force = fixate(plant, direction)
        torsion = np.where(np.isfinite(force), torsion, np.nan)
        return cls(direction, torsion, motor, force, _range(plant, direction, torsion))

    @property
    def orientation(self) -> Array:
        """Of least force, (n, 4)."""
        return listing.with_torsion(self.direction, self.torsion)


@dataclass(frozen=True)
class Workspace:
    """Where an eye can look.

    Attributes:
        reach_deg: see `reach`, (around,).
        shift: to the left and up of straight ahead [deg], (rings, around, 2): the first ring is straight ahead, the
            last one the edge.
        held: of all of them, n of rings times around.
    """

    reach_deg: Array
    shift: Array
    held: Held

    @classmethod
    def of(cls, plant: Plant) -> "Workspace":
        """Of a plant.

        Raises:
            InputError: as `Held.of`.
        """
        require_elastics(plant)
        far = reach(plant)
        shift = np.linspace(0, 1, _RINGS + 1)[:, None, None] * (far[:, None] * _around())
        return cls(far, shift, Held.of(plant, toward(shift).reshape(-1, 3)))


def require_elastics(plant: Plant) -> None:
    """Refuse a plant whose fixations have no force, or that leaves no torsion open.

    Raises:
        InputError: says why.
    """
    if not knows_elastics(plant):
        raise InputError(f"of plant {plant.name!r} no elastics are known, so no torsion is of least force; {_FORCES}")
    turn = degrees_per_motor(plant)
    if np.linalg.matrix_rank(turn, tol=1e-3) < 3:
        raise InputError(
            f"the motors of plant {plant.name!r} ({', '.join(names(plant.motors))}) do not turn the eye about all "
            "three axes; choose an eye whose motors do"
        )


def degrees_per_motor(plant: Plant) -> Array:
    """By how much the resting eye turns about x, y, z (torsion, down, left) for a degree of each motor, (motors, 3)."""
    moved = _TURN * np.eye(len(plant.motors))
    ahead, behind = (rotations.rotation(plant.rest(side * moved)) for side in (1, -1))
    return np.asarray((ahead * behind.inv()).as_rotvec(degrees=True) / (2 * _TURN))


def cone(limit_deg: float) -> Array:
    """Directions all over a cone around straight ahead, evenly, (n, 3).

    Raises:
        InputError: a cone that is none.
    """
    real("the limit of a cone", limit_deg, 0.1, 90.0, unit="deg")
    line = np.linspace(-limit_deg, limit_deg, 2 * _POINTS + 1)
    shift = np.stack(np.meshgrid(line, line), axis=-1)
    return toward(shift[np.linalg.norm(shift, axis=-1) <= limit_deg + 1e-9])


def extent(plant: Plant) -> float:
    """How far from straight ahead the motors turn the gaze at most, within their working ranges, [deg]."""
    levels = [np.linspace(*motor.working, _LEVELS) for motor in plant.motors]
    motor = np.stack(np.meshgrid(*levels), axis=-1).reshape(-1, len(levels))
    gaze = rotations.gaze((plant.twin() or plant).rest(motor))
    return float(rotations.angle_between_directions(gaze, _AHEAD).max())


def reach(plant: Plant) -> Array:
    """Up to which angle from straight ahead the eye holds directions [deg], (around,), from the left over up.

    The least of them is that of the largest cone. At the very edge the motors hold a direction at few torsions: where
    these span less than 3 deg they may be missed, so that the reach may fall short by a degree or two.
    """
    plant = plant.twin() or plant
    low, step = np.zeros(_AROUND), extent(plant)
    for _ in range(_HALVINGS):
        step /= 2
        held = np.isfinite(fixate(plant, toward((low + step)[:, None] * _around()))[2])
        low = np.where(held, low + step, low)
    return low


def _around() -> Array:
    """Unit vectors to the left and up, (around, 2)."""
    angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _range(plant: Plant, direction: Array, torsion: Array) -> Array:
    """Least and largest torsion (n, 2), from one that is held (n,) outwards."""
    ends, step = np.repeat(torsion[:, None], 2, axis=1), _FARTHEST_DEG
    known = np.flatnonzero(np.isfinite(torsion))
    for _ in range(_HALVINGS):
        step /= 2
        farther = ends[known] + step * np.array([-1.0, 1.0])
        orientation = listing.with_torsion(np.repeat(direction[known], 2, axis=0), farther.ravel())
        held = np.isfinite(plant.held(orientation, names(plant.motors))).all(axis=1).reshape(-1, 2)
        ends[known] = np.where(held, farther, ends[known])
    return ends
