"""Saccades in all directions: which tasks have them, how some are chosen, and how they are named.

start, target = opposite(task.targets, [20.0], [45.0])      # angles: 20 deg to the left and up, through the middle
way_in_words(start.orientation, target)                     # "left and up"
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import listing, rotations
from orient_eye.movement.oblique import seen_from, toward
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import Targets

Array = NDArray[np.float64]
_OBLIQUE = np.tan(np.deg2rad(22.5))  # of the larger component, from which on the smaller one is named


def in_all_directions(task: SaccadeTask) -> bool:
    """Whether saccades do more than go to and fro about one axis: then what is told of them is told of the gaze."""
    return len(task.targets.angles) > 1


def size_deg(task: SaccadeTask, start: Array, target: Array) -> Array:
    """Sizes of saccades (n,) between orientations (n, 4): of the turn, or in all directions of that of the gaze."""
    if in_all_directions(task):
        return rotations.angle_between_directions(rotations.gaze(start), rotations.gaze(target))
    return rotations.angle_between(start, target)


def angles_toward(targets: Targets, direction: Array) -> Array:
    """Angles (n, angles) by which targets tell directions of gaze (n, 3)."""
    return targets.angles_of(listing.with_torsion(direction, 0.0))


def opposite(targets: Targets, size: ArrayLike, around_deg: ArrayLike) -> tuple[Array, Array]:
    """Angles of starts and targets (n, angles) on either side of straight ahead.

    Args:
        targets: that tell them.
        size: of the saccades [deg], (n,).
        around_deg: whereto: 0 left, 90 up, (n,).
    """
    around = np.deg2rad(np.asarray(around_deg, dtype=float))
    half = np.asarray(size, dtype=float)[:, None] / 2 * np.stack([np.cos(around), np.sin(around)], axis=-1)
    return angles_toward(targets, toward(-half)), angles_toward(targets, toward(half))


def way_in_words(start: Array, target: Array) -> list[str]:
    """Whereto saccades go between orientations (n, 4): "left", "right and down"."""
    shift = seen_from(rotations.gaze(target), rotations.gaze(start))
    named = np.abs(shift) >= _OBLIQUE * np.abs(shift).max(axis=-1, keepdims=True)
    names = np.where(shift > 0, ["left", "up"], ["right", "down"])
    return [" and ".join(name[which]) for name, which in zip(names, named, strict=True)]
