"""How motors turn the resting eye."""

import numpy as np
from scipy.spatial.transform import Rotation

from orient_eye.motor import rests
from orient_eye.plants import Plant
from orient_eye.rotations import rotation


def turned(plant: Plant) -> Rotation:
    """By how much a unit of each motor turns the eye from where it rests, head frame, (motors,)."""
    count = len(plant.motors)
    at = plant.rest(rests(plant.motors) + np.eye(count + 1, count, -1))
    return rotation(at[1:]) * rotation(at[0]).inv()
