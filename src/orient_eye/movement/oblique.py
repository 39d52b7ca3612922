"""Measures of saccades in all directions: how straight the gaze goes, whether its components go together, and torsion.

    measures = movement.measure(of="gaze")
    path_deviation(trajectory, measures)             # (saccades,), share of the amplitude
    component_correlation(trajectory, measures)      # (saccades,), 1 where both go in step

Components are told by the shortest turn from one direction of gaze to another: its angle [deg], shared out to the left
and up as its way is. So both are alike, and on the great circle through where a saccade began they keep one ratio.
Positive is to the left and UP, as the field draws it, while pitch is positive down (`orient_eye.rotations`).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import rotations
from orient_eye.constants import BAND
from orient_eye.listing import torsion, with_torsion
from orient_eye.movement.measures import Measures, measure_angle
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
_AHEAD = np.array([1.0, 0.0, 0.0])
_COMPARED = 0.3  # of the larger component: a smaller one is too near an axis to be compared with it
_STILL_DEG = 1e-9  # of amplitude, as in `orient_eye.movement.measures`
_NEAR = 1e-8  # square of an angle [rad^2] so small that the stretch does not change


def seen_from(direction: ArrayLike, origin: ArrayLike = _AHEAD) -> Array:
    """How far to the left and up [deg] (..., 2) directions lie of an origin.

    Seen from straight ahead the eccentricity is the length of (left, up), and they are the rotation vector, in degrees
    of its angle, of the orientation without torsion: (0, -up, left). Elsewhere left and up are turned along with it.

    Args:
        direction: unit vectors, head frame, not opposite to the origin, (..., 3).
        origin: as the directions, and not straight back.
    """
    beside, along = _parts(np.asarray(direction, dtype=float), np.asarray(origin, dtype=float))
    return np.asarray(np.rad2deg(beside * _stretch(beside, along)))


def toward(shift: ArrayLike, origin: ArrayLike = _AHEAD) -> Array:
    """Directions (..., 3) so far to the left and up [deg] (..., 2) of an origin (..., 3).

    The inverse of `seen_from`.
    """
    shift = np.asarray(shift, dtype=float)
    away = np.deg2rad(np.linalg.norm(shift, axis=-1, keepdims=True))
    local = np.concatenate([np.cos(away), np.sinc(away / np.pi) * np.deg2rad(shift)], axis=-1)
    origin = np.broadcast_to(np.asarray(origin, dtype=float), local.shape)
    turned = rotations.rotation(with_torsion(origin, 0.0).reshape(-1, 4))
    return np.asarray(turned.apply(local.reshape(-1, 3)).reshape(local.shape))


def gaze_components(trajectory: Trajectory) -> Array:
    """Where the gaze is, to the left and up of straight ahead [deg], (saccades, time, 2)."""
    return seen_from(rotations.gaze(trajectory.orientation))


def gaze_shift(trajectory: Trajectory) -> Array:
    """Where the gaze is, to the left and up of where the saccade began [deg], (saccades, time, 2)."""
    gaze = rotations.gaze(trajectory.orientation)
    return seen_from(gaze, gaze[:, :1])


def shift_velocity(trajectory: Trajectory) -> Array:
    """Speed of the components of `gaze_shift` [deg/s], (saccades, time, 2), from the angular velocity."""
    gaze = rotations.gaze(trajectory.orientation)
    beside, along = _parts(gaze, gaze[:, :1])
    beside_rate, along_rate = _parts(np.cross(trajectory.angular_velocity, gaze), gaze[:, :1])
    stretch, square = _stretch(beside, along), (beside**2).sum(axis=-1, keepdims=True)
    slope = (along * stretch - 1) / np.maximum(square, _NEAR)  # of the stretch, along `along`
    return np.asarray(stretch * beside_rate + beside * slope * along_rate)


def end_of_shift(trajectory: Trajectory, measures: Measures) -> Array:
    """Where the gaze comes to rest, to the left and up of where the saccade began [deg], (saccades, 2)."""
    return seen_from(rotations.gaze(measures.final), rotations.gaze(trajectory.orientation[:, 0]))


def path_deviation(trajectory: Trajectory, measures: Measures) -> Array:
    """Largest distance of the gaze from the great circle from start to end, share of the amplitude, (saccades,).

    Within the saccade, up to its settling time; NaN where the gaze did not move or the saccade failed.

    Args:
        trajectory: of the saccades.
        measures: of their gaze.
    """
    gaze, end = rotations.gaze(trajectory.orientation), rotations.gaze(measures.final)
    amplitude = rotations.angle_between_directions(gaze[:, 0], end)
    square = np.cross(gaze[:, 0], end)
    with np.errstate(invalid="ignore", divide="ignore"):
        square /= np.linalg.norm(square, axis=-1, keepdims=True)
    aside = np.rad2deg(np.arcsin(np.clip((gaze * square[:, None]).sum(axis=-1), -1, 1)))
    moved = amplitude > _STILL_DEG
    return np.where(moved, _largest(aside, trajectory, measures) / np.where(moved, amplitude, 1), np.nan)


def component_correlation(trajectory: Trajectory, measures: Measures) -> Array:
    """Correlation over time of how fast the two components of the gaze approach their ends, (saccades,).

    From the start to the settling time: 1 where the components go in step, as they do on a straight path. NaN where the
    smaller component is below 30 % of the larger, where the gaze did not move, and where the saccade failed.

    Args:
        trajectory: of the saccades, at even times.
        measures: of their gaze.
    """
    end = end_of_shift(trajectory, measures)
    inside = ~_after(trajectory, measures)[..., None]
    velocity = np.where(inside, shift_velocity(trajectory) * np.sign(end)[:, None], 0.0)
    off = np.where(inside, velocity - velocity.sum(axis=1, keepdims=True) / inside.sum(axis=1, keepdims=True), 0.0)
    size = np.sqrt((off**2).sum(axis=1).prod(axis=-1))
    known = _compared(end).all(axis=-1) & (size > 0)
    return np.where(known, off.prod(axis=-1).sum(axis=1) / np.where(known, size, 1), np.nan)


def component_durations(trajectory: Trajectory, measures: Measures, band: float = BAND) -> Array:
    """Time after which each component stays within the band around its own end [s], (saccades, 2): left, up.

    Component stretching is that the smaller component of an oblique saccade takes longer than a saccade of its size
    along an axis (Smit, Van Opstal & Van Gisbergen 1990, Exp Brain Res 81:325): compare with the duration of that one.
    NaN of a component below 30 % of the other, and where the saccade failed; the horizon where it came first.

    Args:
        trajectory: of the saccades.
        measures: of their gaze.
        band: share of the component.
    """
    shift, velocity, end = gaze_shift(trajectory), shift_velocity(trajectory), end_of_shift(trajectory, measures)
    alone = [
        measure_angle(trajectory.time, shift[..., k], velocity[..., k], end[:, k], axis, measures.failed, band=band)
        for k, axis in enumerate(("yaw", "pitch"))
    ]
    return np.where(_compared(end), np.stack([one.settling_time_s for one in alone], axis=-1), np.nan)


def transient_torsion(trajectory: Trajectory, measures: Measures) -> Array:
    """Torsion beside the straight line from its start to its end [deg], (saccades, time).

    The line is followed with the gaze's progress along the great circle, not with time: torsion that changes in step
    with the gaze, as on a tilted plane, is none of it. NaN where the gaze did not move or the saccade failed.

    Args:
        trajectory: of the saccades.
        measures: of their gaze.
    """
    end, turned = end_of_shift(trajectory, measures), torsion(trajectory.orientation)
    square = (end**2).sum(axis=-1)
    square = np.where(square > _STILL_DEG**2, square, np.nan)
    progress = (gaze_shift(trajectory) * end[:, None]).sum(axis=-1) / square[:, None]
    return np.asarray(turned - turned[:, :1] - progress * (torsion(measures.final) - turned[:, 0])[:, None])


def torsion_blip(trajectory: Trajectory, measures: Measures) -> Array:
    """Largest `transient_torsion` up to the settling time [deg], (saccades,).

    In people such blips out of Listing's plane reach 1 to 2 deg (Straumann et al. 1995, Vision Res 35:3321).
    """
    return _largest(transient_torsion(trajectory, measures), trajectory, measures)


def _parts(vector: Array, origin: Array) -> tuple[Array, Array]:
    """Left and up (..., 2) of vectors in a frame turned to an origin by the shortest way, and what is along it."""
    along = (vector * origin).sum(axis=-1, keepdims=True)
    return vector[..., 1:] - (vector[..., :1] + along) / (1 + origin[..., :1]) * origin[..., 1:], along


def _stretch(beside: Array, along: Array) -> Array:
    """An angle over its sine, (..., 1), by its sines (..., 2) and its cosine (..., 1)."""
    angle = np.arctan2(np.linalg.norm(beside, axis=-1, keepdims=True), along)
    return np.asarray(1 / np.sinc(angle / np.pi))


def _compared(end: Array) -> NDArray[np.bool_]:
    """Which components (saccades, 2) are no mere by-product of the other."""
    size = np.abs(end)
    return np.asarray(size >= _COMPARED * size.max(axis=-1, keepdims=True))


def _after(trajectory: Trajectory, measures: Measures) -> NDArray[np.bool_]:
    """Which samples (saccades, time) come after the saccade; of failed ones, which have no numbers, none."""
    return np.asarray(trajectory.time > measures.settling_time_s[:, None])


def _largest(values: Array, trajectory: Trajectory, measures: Measures) -> Array:
    """Largest size (saccades,) of values (saccades, time) within the saccade."""
    return np.asarray(np.where(_after(trajectory, measures), 0.0, np.abs(values)).max(axis=1))
