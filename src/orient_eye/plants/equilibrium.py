"""Where an eye comes to rest: Newton's method on the torque, a batch at a time."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye.errors import InputError
from orient_eye.rotations import FORWARD, angle_between, rotation

Array = NDArray[np.float64]
Torque = Callable[[Array, Array], Array]
"""Torque [N m] (n, 3) on an eye at rest in orientations (n, 4) with motors [deg] at (n, motors)."""

_STEP = 1e-6  # rad, of the difference quotients
_TOLERANCE = 1e-12  # N m; a degree is worth about 5e-3
_ITERATIONS = 40
_FAR_DEG = 60.0
_TURN = 1e-4  # rad, of the difference quotients of the stiffness
_STRIDES = (0.7, 0.1)  # rad, at most in an iteration: the second where the first does not come to rest


def stiffness(torque: Torque, orientation: Array, motor: Array) -> Array:
    """By how much the torque turns an eye back [N m/rad], head frame, (n, 3, 3).

    Args:
        torque: on the eye.
        orientation: (n, 4).
        motor: [deg], (n, motors).
    """
    turns = np.concatenate([np.eye(3), -np.eye(3)]) * _TURN
    here = rotation(np.repeat(orientation, 6, axis=0))
    turned = (Rotation.from_rotvec(np.tile(turns, (len(motor), 1))) * here).as_quat(scalar_first=True)
    found = torque(turned, np.repeat(motor, 6, axis=0)).reshape(-1, 2, 3, 3)
    return np.asarray(-np.swapaxes(found[:, 0] - found[:, 1], 1, 2) / (2 * _TURN))


def least_stiffness(torque: Torque, orientation: Array, motor: Array) -> Array:
    """Of an eye at rest [N m/rad], (n,), about the axis where it is softest: not above 0 it is not stable.

    Arguments as `stiffness`'.
    """
    K = stiffness(torque, orientation, motor)
    return np.asarray(np.linalg.eigvalsh((K + np.swapaxes(K, 1, 2)) / 2)[:, 0])


def rest_orientation(torque: Torque, motor: Array, ahead: Array) -> Array:
    """Orientations (n, 4) in which an eye comes to rest; NaN where a position is none.

    Args:
        torque: on the eye.
        motor: positions [deg], (n, motors).
        ahead: positions [deg] (motors,) at which it rests straight ahead; the eye is followed on the way from there.

    Raises:
        InputError: no equilibrium was found from straight ahead.
    """
    motor = np.asarray(motor, dtype=float)
    known = np.asarray(np.isfinite(motor).all(axis=1))
    motor = np.where(known[:, None], motor, ahead)
    # Along a path from straight ahead, so that Newton's method stays on the branch the eye would follow.
    far = np.abs(motor - ahead).max(axis=1, keepdims=True, initial=1e-9)
    parts = max(1, int(np.ceil(far.max(initial=0.0) / 40.0)))
    orientation = np.tile(FORWARD, (len(motor), 1))
    for part in range(1, parts + 1):
        orientation = _newton_orientation(
            torque, ahead + (motor - ahead) * np.minimum(1, 40.0 * part / far), orientation
        )
    orientation[~known] = np.nan
    return orientation


def _newton_orientation(torque: Torque, motor: Array, orientation: Array) -> Array:
    for stride in np.repeat(_STRIDES, _ITERATIONS):
        residual = torque(orientation, motor)
        moving = np.abs(residual).max(axis=-1, initial=0.0) >= _TOLERANCE  # each row stops by itself
        if not moving.any():
            return orientation
        columns = []
        for axis in np.eye(3):
            turned = Rotation.from_rotvec(_STEP * axis) * rotation(orientation)
            columns.append((torque(turned.as_quat(scalar_first=True), motor) - residual) / _STEP)
        # Elastics pull towards less energy: along it also where the eye would not stay.
        slope = np.stack(columns, axis=-1)
        size, ways = np.linalg.eigh((slope + np.swapaxes(slope, -1, -2)) / 2)
        along = (np.swapaxes(ways, -1, -2) @ residual[..., None])[..., 0]
        change = (ways @ (along / np.maximum(np.abs(size), 1e-12))[..., None])[..., 0]
        length = np.linalg.norm(change, axis=-1, keepdims=True)
        change *= np.minimum(1, stride / np.maximum(length, 1e-300))
        change[~moving] = 0
        orientation = np.where(
            moving[:, None],
            (Rotation.from_rotvec(change) * rotation(orientation)).as_quat(scalar_first=True),
            orientation,
        )
    if np.abs(residual).max() < 1e-9:  # as near as the difference quotients come
        return orientation
    worst = int(np.abs(residual).max(axis=-1).argmax())
    raise InputError(f"no equilibrium found for motors at {np.round(motor[worst], 2).tolist()} deg; turn them less far")


def rest_motor(torque: Torque, orientation: Array, ahead: Array, driven: list[int], limit: Array) -> Array:
    """Motor positions [deg] (n, motors) that hold orientations (n, 4), the others where they are straight ahead.

    Gauss-Newton over the driven motors, inside limit (motors, 2) [deg].

    Raises:
        InputError: an orientation that these motors cannot hold.
    """
    motor, held = held_motor(torque, orientation, ahead, driven, limit)
    if not held.all():
        worst = int(held.argmin())
        raise InputError(
            f"orientation {np.round(orientation[worst], 4).tolist()} (w, x, y, z) is no equilibrium of motors "
            f"{[i + 1 for i in driven]} within their range: choose one they can hold"
        )
    return motor


def held_motor(
    torque: Torque, orientation: Array, ahead: Array, driven: list[int], limit: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """As `rest_motor`, and which of the orientations are held, (n,).

    Raises:
        InputError: numbers that are not finite.
    """
    orientation = np.asarray(orientation, dtype=float)
    if not np.isfinite(orientation).all():
        raise InputError("an orientation to hold holds numbers that are not finite")
    motor = np.tile(ahead, (len(orientation), 1))
    step = np.rad2deg(_STEP)
    moving = np.ones(len(orientation), bool)  # each row stops by itself
    for _ in range(_ITERATIONS):
        if not moving.any():
            break
        residual = torque(orientation, motor)
        columns = []
        for index in driven:
            moved = motor.copy()
            moved[:, index] += step
            columns.append((torque(orientation, moved) - residual) / step)
        slope = np.stack(columns, axis=-1)
        normal = np.swapaxes(slope, -1, -2)
        square = normal @ slope + 1e-18 * np.eye(len(driven))  # a motor at its limit may pull on nothing
        change = -np.linalg.solve(square, normal @ residual[..., None])[..., 0]
        change[~moving] = 0
        motor[:, driven] = np.clip(motor[:, driven] + np.clip(change, -20, 20), *limit[driven].T)
        moving &= np.abs(change).max(axis=1, initial=0.0) >= 1e-10
    residual = np.abs(torque(orientation, motor)).max(axis=-1, initial=0.0)
    bad = ~(residual < 1e-7)
    # Far from straight ahead the torque also vanishes where the eye would never come to rest.
    far = np.flatnonzero(~bad & (angle_between(orientation, FORWARD) > _FAR_DEG))
    if far.size:
        bad[far] = angle_between(rest_orientation(torque, motor[far], ahead), orientation[far]) > 1e-4
    return motor, ~bad
