"""Motors with limits: where a motor goes that is told more than its speed or acceleration allows.

    motor, limited = follow(told, motors, step_s)

The motor moves along straight lines between samples. Where it can be where it is told to be, it is there exactly;
else it goes after the command as fast as its limits let it, braking in time for what is left of the way.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.motor import Motor

Array = NDArray[np.float64]
_TOLERANCE = 1e-9  # of a limit: rounding is not a violation
_CAUGHT_UP = 1e-11  # of the motors' unit


def follow(
    told: Array, motors: Sequence[Motor], step_s: float, start: Array | None = None
) -> tuple[Array, NDArray[np.bool_]]:
    """Where limited motors go.

    Args:
        told: positions (saccades, time, motors) in the motors' units.
        motors: with their limits; a range is not looked at here.
        step_s: interval between samples [s].
        start: where the motors stand at rest before the first sample (saccades, motors); None for where they are told
            to be then.

    Returns:
        Positions (saccades, time, motors), and whether a limit changed them, (saccades,). A motor without limits is
        where it is told to be; one with limits is at its start at the first sample.
    """
    speed = np.array([motor.speed_limit or np.inf for motor in motors])
    acceleration = np.array([motor.acceleration_limit or np.inf for motor in motors])
    limited = np.isfinite(speed) | np.isfinite(acceleration)
    if not limited.any():
        return told, np.zeros(len(told), bool)
    begin = told[:, 0] if start is None else np.where(limited, start, told[:, 0])
    bites = breaks_limit(told, speed, acceleration, step_s, begin)
    if not bites.any():
        return told, bites
    taken = told.copy()
    taken[bites] = _pursue(told[bites], begin[bites], speed, acceleration, step_s)
    return taken, bites


def breaks_limit(
    path: Array, speed: Array, acceleration: Array, step_s: float, start: Array | None = None
) -> NDArray[np.bool_]:
    """Whether paths (saccades, time, motors) from rest at a start break limits (motors,), (saccades,)."""
    fastest, hardest = peaks(path, step_s, start)
    fast = fastest > speed * (1 + _TOLERANCE)
    return np.asarray((fast | (hardest > acceleration * (1 + _TOLERANCE))).any(axis=-1))


def peaks(path: Array, step_s: float, start: Array | None = None) -> tuple[Array, Array]:
    """Largest speed and acceleration along paths (saccades, time, motors) from rest, each (saccades, motors).

    Args:
        path: positions.
        step_s: interval between them [s].
        start: where the motors rest before, (saccades, motors); None for the first position.
    """
    begin = path[:, :1] if start is None else start[:, None]
    velocity = np.diff(path, axis=1, prepend=begin) / step_s
    change = np.diff(velocity, axis=1, prepend=0.0) / step_s
    return np.abs(velocity).max(axis=1, initial=0), np.abs(change).max(axis=1, initial=0)


def _pursue(told: Array, start: Array, speed: Array, acceleration: Array, step_s: float) -> Array:
    """Step by step: the command's own speed, and what closes the gap to it and can still be braked."""
    taken = np.empty_like(told)
    free = ~(np.isfinite(speed) | np.isfinite(acceleration))
    position, velocity = np.where(free, told[:, 0], start), np.zeros_like(start)
    taken[:, 0] = position
    bounded = np.isfinite(acceleration)
    a = np.where(bounded, acceleration, 0.0)
    half, most = 0.5 * a * step_s, np.where(bounded, a * step_s, np.inf)
    # Behind the last sample at which its command breaks a limit, a saccade whose motors have caught up follows it.
    velocities = np.diff(told, axis=1, prepend=told[:, :1]) / step_s
    changes = np.diff(velocities, axis=1, prepend=0.0) / step_s
    over: Any = np.abs(velocities) > speed
    over = (over | (np.abs(changes) > acceleration)).any(axis=2)
    samples = told.shape[1]
    last = samples - 1 - over[:, ::-1].argmax(axis=1)
    last[~over.any(axis=1)] = 0  # but for its start, it keeps them
    behind = np.arange(len(told))  # saccades whose motors have not caught up
    for k in range(samples - 1):
        here, following = told[behind, k], told[behind, k + 1]
        wanted = (following - position) / step_s
        if bounded.any():
            gap = here - position
            # Braking from w by a each step stops within the gap: w (w / a + h) / 2 = gap.
            brake = np.sqrt(half**2 + 2 * a * np.abs(gap)) - half
            pace = np.clip((following - here) / step_s, -speed, speed)
            braked = pace + np.clip(gap / step_s, -brake, brake)
            wanted = np.where(bounded, np.clip(braked, velocity - most, velocity + most), wanted)
        velocity = np.clip(wanted, -speed, speed)
        position = position + step_s * velocity
        taken[behind, k + 1] = position
        near = (k + 1 >= last[behind]) & (np.abs(position - following).max(axis=1) < _CAUGHT_UP)
        if near.any():
            following_pace = velocities[behind, min(k + 2, samples - 1)]
            caught = near & (np.abs(following_pace - velocity) <= most * (1 + _TOLERANCE)).all(axis=1)
            taken[behind[caught], k + 1 :] = told[behind[caught], k + 1 :]
            behind, position, velocity = behind[~caught], position[~caught], velocity[~caught]
        if not len(behind):
            break
    return taken
