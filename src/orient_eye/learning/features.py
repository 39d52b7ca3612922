"""What the networks of a policy see: part of the format of policy files."""

import numpy as np
from numpy.typing import NDArray

from orient_eye.rotations import rotation

Array = NDArray[np.float64]
GAZE_INPUTS, QUATERNION_INPUTS = 6, 8
"""Inputs of the first layer: `gaze_features`, or the quaternions of start and target as they are."""
UNIT_DEG = 35.0
"""Unit of the rotation vectors."""


def gaze_features(start: Array, target: Array) -> Array:
    """Rotation vectors of the start and of the turn from start to target, in units of 35 deg, (saccades, 6).

    For gaze directions the quaternions themselves differ in the second digit only.

    Args:
        start: orientations, (saccades, 4).
        target: desired orientations, (saccades, 4).
    """
    turn = rotation(target) * rotation(start).inv()
    vectors = [rotation(start).as_rotvec(degrees=True), turn.as_rotvec(degrees=True)]
    return np.concatenate(vectors, axis=-1) / UNIT_DEG
