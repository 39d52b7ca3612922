"""Torsion of the eye, and Listing's law: orientations at rest lie in a plane of rotation vectors.

    torsion(orientation)                             # [deg], 0 for an eye that obeys Listing's law
    with_torsion(direction, 0.0)                     # the orientation that Listing's law gives a direction of gaze
    fit_plane(orientation).sd_deg                    # the thickness of Listing's plane

The rotation vector of an orientation turned by theta about the unit vector n is r = tan(theta / 2) n (Haustein 1989).
Torsion is told as 2 atan(r_x): the angle by which the eye is rolled about its line of sight out of the orientation
without torsion, which one turn about an axis square to straight ahead makes (Listing).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import rotations

Array = NDArray[np.float64]


def rotation_vectors(orientation: ArrayLike) -> Array:
    """r = tan(theta / 2) n (..., 3) of orientations (..., 4); theta below 180 deg."""
    q = np.asarray(orientation, dtype=float)
    return np.asarray(q[..., 1:] / q[..., :1])


def torsion(orientation: ArrayLike) -> Array:
    """2 atan(r_x) [deg] (...) of orientations (..., 4)."""
    q = np.asarray(orientation, dtype=float)
    sign = np.where(q[..., 0] < 0, -1.0, 1.0)
    return np.asarray(np.rad2deg(2 * np.arctan2(sign * q[..., 1], sign * q[..., 0])))


def directions(yaw_deg: ArrayLike, pitch_deg: ArrayLike) -> Array:
    """Directions of gaze, unit vectors (..., 3), at a yaw and a pitch [deg], each (...)."""
    return rotations.gaze(rotations.from_euler(yaw_deg, pitch_deg, 0.0))


def with_torsion(direction: ArrayLike, torsion_deg: ArrayLike) -> Array:
    """Orientations (..., 4) that look along directions with a torsion.

    Args:
        direction: unit vectors, head frame, not straight back, (..., 3).
        torsion_deg: (...).
    """
    x, y, z = np.moveaxis(np.asarray(direction, dtype=float), -1, 0)
    half = np.deg2rad(np.asarray(torsion_deg, dtype=float)) / 2
    c, s = np.cos(half), np.sin(half)
    # Without torsion (1 + x, 0, -z, y), normalised; then rolled about the line of sight.
    q = np.stack(np.broadcast_arrays((1 + x) * c, (1 + x) * s, -z * c + y * s, y * c + z * s), axis=-1)
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


def ficks_torsion(direction: ArrayLike) -> Array:
    """Torsion [deg] (...) of an eye that Fick's gimbal turns to directions (..., 3): yaw, then pitch, and no roll."""
    x, y, z = np.moveaxis(np.asarray(direction, dtype=float), -1, 0)
    yaw, pitch = np.rad2deg(np.arctan2(y, x)), np.rad2deg(np.arcsin(np.clip(-z, -1, 1)))
    return torsion(rotations.from_euler(yaw, pitch, 0.0))


@dataclass(frozen=True)
class Plane:
    """Listing's plane through orientations: r_x = offset + by_y r_y + by_z r_z, and how it is twisted.

    Attributes:
        offset: r_x straight ahead.
        by_y: slope along r_y.
        by_z: slope along r_z.
        sd_deg: standard deviation of the torsion about the plane: the plane's thickness.
        twist: coefficient of r_y r_z where it is added to the plane; 0 for Listing's law, -1 for Fick's gimbal, 1 for
            Helmholtz'.
        twisted_sd_deg: standard deviation about the surface so twisted.
    """

    offset: float
    by_y: float
    by_z: float
    sd_deg: float
    twist: float
    twisted_sd_deg: float

    @property
    def tilt_deg(self) -> tuple[float, float]:
        """By how much the plane is turned: its normal's yaw (positive: to the left) and pitch (positive: down)."""
        return float(np.rad2deg(np.arctan(-self.by_y))), float(np.rad2deg(np.arctan(self.by_z)))


def fit_plane(orientation: ArrayLike) -> Plane:
    """The plane of least squares through orientations (n, 4), at least four that do not lie on a line.

    Args:
        orientation: as they are; rows with NaN are left out.
    """
    q = np.asarray(orientation, dtype=float).reshape(-1, 4)
    r = rotation_vectors(q[np.isfinite(q).all(axis=1)])
    flat = np.stack([np.ones(len(r)), r[:, 1], r[:, 2]], axis=1)
    twisted = np.concatenate([flat, (r[:, 1] * r[:, 2])[:, None]], axis=1)
    plane, surface = (np.linalg.lstsq(a, r[:, 0], rcond=None)[0] for a in (flat, twisted))
    thickness, left = (np.rad2deg(2 * np.std(r[:, 0] - a @ b)) for a, b in ((flat, plane), (twisted, surface)))
    offset, by_y, by_z = plane.tolist()
    return Plane(offset, by_y, by_z, float(thickness), float(surface[3]), float(left))
