"""Orientation of the eye: unit quaternions, scalar first (w, x, y, z), eye to head coordinates.

Head frame: x forward, y left, z up. Yaw turns about z (positive: to the left), pitch about y
(positive: down), roll (torsion) about x; the eye is turned by roll first, then pitch, then yaw
(Fick's order). The work is scipy's; this file fixes the conventions.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
FORWARD = np.array([1.0, 0.0, 0.0, 0.0])
"""Orientation of the eye that looks straight ahead."""


def rotation(orientation: ArrayLike) -> Rotation:
    """scipy's rotation of orientations (..., 4)."""
    return Rotation.from_quat(np.asarray(orientation, dtype=float), scalar_first=True)


def from_yaw(yaw_deg: ArrayLike) -> Array:
    """Orientations (..., 4) of an eye turned by yaw [deg] (...) about z."""
    half = np.deg2rad(np.asarray(yaw_deg, dtype=float)) / 2
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def from_euler(yaw_deg: ArrayLike, pitch_deg: ArrayLike, roll_deg: ArrayLike) -> Array:
    """Orientations (..., 4) from yaw, pitch, roll [deg], each (...)."""
    angles = np.stack(np.broadcast_arrays(yaw_deg, pitch_deg, roll_deg), axis=-1).astype(float)
    turned = Rotation.from_euler("ZYX", angles.reshape(-1, 3), degrees=True)
    return turned.as_quat(scalar_first=True).reshape(*angles.shape[:-1], 4)


def to_euler(orientation: ArrayLike) -> tuple[Array, Array, Array]:
    """Yaw, pitch, roll [deg], each (...), of orientations (..., 4). NaN gives NaN."""
    w, x, y, z = np.moveaxis(np.asarray(orientation, dtype=float), -1, 0)
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return np.rad2deg(yaw), np.rad2deg(pitch), np.rad2deg(roll)


def angle_between(a: ArrayLike, b: ArrayLike) -> Array:
    """Angle [deg] (...) of the rotation between orientations a and b (..., 4).

    From the chord between the quaternions, so that small angles keep full precision.
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    chord = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    return np.rad2deg(4 * np.arcsin(np.clip(chord / 2, 0, 1)))
