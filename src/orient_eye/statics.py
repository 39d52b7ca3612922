"""Statics of gaze: where an eye can look, with which torsion, and what its motors have to do for it.

    reach(plant).min()                               # the largest cone that the eye holds [deg]
    held = Held.of(plant, cone(30.0))
    fit_plane(held.orientation).twist                # of Listing's plane of the fixations of least force

Of an eye with more motors than axes, by a criterion of `orient_eye.plants.cables`:

    Ends.of(cables_of(plant)).reach_deg              # up to which angle it stays, and its cables are taut
    Postures.of(cables_of(plant), cone(30.0), "least-force", 1.0).motor

All within the motors' working ranges. Left and up are those of `orient_eye.movement.oblique.seen_from`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye import listing, rotations
from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.motor import names, rests
from orient_eye.movement.oblique import toward
from orient_eye.plants import Plant
from orient_eye.plants.cables import CRITERIA, Cables, Holding
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.fixation import best_torsion, fixate, knows_elastics

Array = NDArray[np.float64]
_AHEAD = np.array([1.0, 0.0, 0.0])
_AROUND, _RINGS = 36, 10
_HALVINGS = 11  # of an interval: to some hundredths of a degree
_FARTHEST_DEG = 40.0  # of torsion, from that of least force
_TURN = 0.5  # of a motor's unit, to either side
_LEVELS = 5  # of each motor, at which it is looked how far the eye goes
_POINTS = 14  # of a grid, from straight ahead to its edge
_STRAIGHT = listing.with_torsion(_AHEAD[None], 0.0)
_SIDEWAYS_DEG = np.arange(0.0, 90.1, 2.5)  # at which it is looked whether an eye with more motors than axes stays
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


def cables_of(plant: Plant) -> Cables | None:
    """How a plant with more motors than axes shares the work; None for one that has nothing to share."""
    plant = plant.twin() or plant
    if not isinstance(plant, ElasticPlant) or not plant.redundant:
        return None
    if not plant.wound:
        raise InputError(
            f"the {len(plant.motors)} motors of plant {plant.name!r} are more than the axes, and not all of them wind "
            "up cables: of such an eye no statics are told; choose an eye with three arms, or with spindles alone"
        )
    return plant.cables


@dataclass(frozen=True)
class Postures:
    """How an eye with more motors than axes holds directions of gaze, by a criterion.

    Attributes:
        direction: unit vectors, (n, 3).
        torsion: [deg], (n,).
        motor: (n, motors).
        cost: what the criterion makes of it, in its unit, (n,).
        tension: [N], (n, tendons).
        stiffness: by how much the cables turn the eye back [N m/rad], head frame, (n, 3, 3).
        state: whether the eye stays there, and whether a cable hangs.
    """

    direction: Array
    torsion: Array
    motor: Array
    cost: Array
    tension: Array
    stiffness: Array
    state: Holding

    @classmethod
    def of(
        cls,
        cables: Cables,
        direction: Array,
        criterion: str = "least-change",
        co_contraction: float | None = None,
        torsion: Array | None = None,
    ) -> "Postures":
        """Of an eye that looks along directions (n, 3), also where it does not stay.

        Args:
            cables: of the eye.
            direction: of gaze.
            criterion: of `orient_eye.plants.cables.CRITERIA`.
            co_contraction: mean angle of antagonists [rad], for a criterion that has one; None for their pretension.
            torsion: [deg], (n,); None for the one that costs least.

        Raises:
            InputError: an unknown criterion, or a co-contraction that is none.
        """
        if torsion is None:
            torsion = best_torsion(lambda tried: cables.posture(tried, criterion, co_contraction)[1], direction)
        orientation = listing.with_torsion(direction, torsion)
        motor, cost = cables.posture(orientation, criterion, co_contraction)
        return cls(
            direction,
            torsion,
            motor,
            cost,
            cables.tension(orientation, motor),
            cables.stiffness(orientation, motor),
            cables.state(orientation, motor, working(cables)),
        )

    @property
    def orientation(self) -> Array:
        """(n, 4)."""
        return listing.with_torsion(self.direction, self.torsion)

    def correlation(self, pairs: NDArray[np.intp]) -> Array:
        """Of antagonists (pairs, 2) over the directions: their angles, and their tensions, (pairs, 2)."""
        both = [[np.corrcoef(of[:, i], of[:, j])[0, 1] for i, j in pairs] for of in (self.motor, self.tension)]
        return np.array(both).T


@dataclass(frozen=True)
class Ends:
    """Where an eye with more motors than axes no longer holds its gaze, by a criterion, from the left over up.

    Attributes:
        unstable_deg: angle from straight ahead from which it would turn farther, (around,); infinite where it never
            does before a cable hangs.
        slack_deg: from which a cable hangs, (around,).
        range_deg: from which a motor would leave its range, (around,).
    """

    unstable_deg: Array
    slack_deg: Array
    range_deg: Array

    @classmethod
    def of(cls, cables: Cables, criterion: str = "least-change", co_contraction: float | None = None) -> "Ends":
        """As `Postures.of`.

        Raises:
            InputError: the eye does not even look straight ahead.
        """
        ahead = Postures.of(cables, _AHEAD[None], criterion, co_contraction)
        if not ahead.state.good[0]:
            raise InputError(
                f"plant {cables.plant!r} does not look straight ahead by {criterion}: {ahead.state.fault(0)}; choose "
                "less co-contraction, or another criterion"
            )

        def faults(away_deg: Array) -> NDArray[np.bool_]:
            """Unstable, slack, out of range, at angles (..., around); (..., around, 3)."""
            direction = toward(away_deg[..., None] * _around()).reshape(-1, 3)
            state = Postures.of(cables, direction, criterion, co_contraction).state
            slack = state.slack | ~state.balanced
            found = np.stack([~slack & (state.stiffness <= 0), slack, ~state.inside], axis=-1)
            return found.reshape(*away_deg.shape, 3)

        tried = faults(np.repeat(_SIDEWAYS_DEG[:, None], _AROUND, axis=1))
        first = tried.argmax(axis=0)
        low, step = _SIDEWAYS_DEG[np.maximum(first - 1, 0)], float(_SIDEWAYS_DEG[1])
        for _ in range(_HALVINGS - 3):
            step /= 2
            for kind in range(3):
                there = faults(low[:, kind] + step)[:, kind]
                low[:, kind] += np.where(there, 0.0, step)
        low[~tried.any(axis=0)] = np.inf
        return cls(*low.T)

    @property
    def reach_deg(self) -> Array:
        """Up to which angle from straight ahead it holds its gaze, (around,)."""
        return np.minimum(self._all.min(axis=0), _SIDEWAYS_DEG[-1])

    @property
    def cause(self) -> list[str]:
        """What ends it, for people."""
        words = np.array(["unstable", "a cable hangs", "a motor's range", "none up to 90 deg"])
        return [str(each) for each in words[np.where(np.isinf(self._all.min(axis=0)), 3, self._all.argmin(axis=0))]]

    def rings(self, count: int) -> Array:
        """To the left and up [deg], (1 + count, around, 2): from straight ahead to where each way ends."""
        return np.linspace(0, 1, count + 1)[:, None, None] * (self.reach_deg[:, None] * self.toward)

    @property
    def _all(self) -> Array:
        return np.stack([self.unstable_deg, self.slack_deg, self.range_deg])

    @property
    def toward(self) -> Array:
        """Unit vectors to the left and up, (around, 2)."""
        return _around()


@dataclass(frozen=True)
class Softening:
    """How stiff an eye with more motors than axes is straight ahead, at one co-contraction or another.

    Attributes:
        co_contraction: mean angle of antagonists [rad], (n,).
        about: stiffness about x, y, z (torsion, pitch, yaw) [N m/rad], (n, 3).
        least: about the axis where it is softest [N m/rad], (n,).
    """

    co_contraction: Array
    about: Array
    least: Array

    @classmethod
    def of(cls, cables: Cables, co_contraction: Array) -> "Softening":
        """At co-contractions (n,) [rad], each pair wound up by as much.

        Raises:
            InputError: one that is none.
        """
        motor = np.concatenate(
            [cables.posture(_STRAIGHT, "co-contraction", each)[0] for each in co_contraction.tolist()]
        )
        straight = np.repeat(_STRAIGHT, len(motor), axis=0)
        about = np.diagonal(cables.stiffness(straight, motor), axis1=1, axis2=2)
        return cls(co_contraction, np.asarray(about), cables.state(straight, motor).stiffness)

    @property
    def unstable_from(self) -> float:
        """Co-contraction [rad] from which straight ahead is not stable; infinite where it always is."""
        bad = np.flatnonzero(self.least <= 0)
        if not bad.size or not bad[0]:
            return -np.inf if bad.size else np.inf
        at = slice(bad[0] - 1, bad[0] + 1)
        return float(np.interp(0.0, -self.least[at], self.co_contraction[at]))


def working(cables: Cables) -> Array:
    """Working ranges of its motors, (motors, 2)."""
    return np.array([motor.working for motor in cables.motors])


def check_criterion(cables: Cables | None, criterion: str | None, co_contraction: float | None) -> None:
    """Refuse what says nothing about an eye.

    Raises:
        InputError: a criterion of an eye that shares no work, or a co-contraction of a criterion that has none.
    """
    if cables is None:
        if criterion is not None or co_contraction is not None:
            raise InputError(
                "a criterion, and a co-contraction, say how more motors than axes share the work; choose an eye that "
                "has more (six), or leave them out"
            )
    elif co_contraction is not None and not CRITERIA[criterion or next(iter(CRITERIA))].co_contraction:
        has = ", ".join(name for name in CRITERIA if CRITERIA[name].co_contraction)
        raise InputError(f"the criterion {criterion or next(iter(CRITERIA))} has no co-contraction; choose {has}")


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
    moved, at = _TURN * np.eye(len(plant.motors)), rests(plant.motors)
    ahead, behind = (rotations.rotation(plant.rest(at + side * moved)) for side in (1, -1))
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
