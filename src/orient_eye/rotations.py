"""Orientation of the eye: unit quaternions, scalar first (w, x, y, z), eye to head coordinates.

Head frame: x forward, y left, z up. Yaw turns about z (positive: to the left), pitch about y
(positive: down), roll (torsion) about x; the eye is turned by roll first, then pitch, then yaw
(Fick's order). The work is scipy's; this file fixes the conventions.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from orient_eye.constants import ANGLES

Array = NDArray[np.float64]
FORWARD = np.array([1.0, 0.0, 0.0, 0.0])
"""Orientation of the eye that looks straight ahead."""


def rotation(orientation: ArrayLike) -> Rotation:
    """scipy's rotation of orientations (..., 4)."""
    return Rotation.from_quat(np.asarray(orientation, dtype=float), scalar_first=True)


AXES = dict(zip(ANGLES, (2, 1, 0), strict=True))
"""An angle, and the axis it turns about among x, y, z."""


def about(axis: str, angle_deg: ArrayLike) -> Array:
    """Orientations (..., 4) of an eye turned by an angle [deg] (...) about one axis: yaw, pitch or roll."""
    half = np.deg2rad(np.asarray(angle_deg, dtype=float)) / 2
    turned = np.zeros((*half.shape, 4))
    turned[..., 0], turned[..., 1 + AXES[axis]] = np.cos(half), np.sin(half)
    return turned


def from_yaw(yaw_deg: ArrayLike) -> Array:
    """Orientations (..., 4) of an eye turned by yaw [deg] (...) about z."""
    return about("yaw", yaw_deg)


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
    near = np.where(np.einsum("...k,...k", a, b) < 0, -1.0, 1.0)[..., None]
    apart = a - near * b
    chord = np.sqrt(np.einsum("...k,...k", apart, apart))
    return np.rad2deg(4 * np.arcsin(np.clip(chord / 2, 0, 1)))


def gaze(orientation: ArrayLike) -> Array:
    """Direction of gaze, a unit vector (..., 3) in the head frame, of orientations (..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(orientation, dtype=float), -1, 0)
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=-1)


def angle_between_directions(a: ArrayLike, b: ArrayLike) -> Array:
    """Angle [deg] (...) between unit vectors (..., 3), precise for small angles."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return np.rad2deg(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))
