"""Measures of a saccade: settling time, peak velocity, skewness, overshoot (thesis 2.1.3, 4.4).

    measured = measure(trajectory, final)            # from samples, any plant
    measured = measure_response(plant.respond(pulse_steps))   # low-pass plant, closed form

Both define every measure alike; the closed form has no sampling error, the sampled one interpolates
between samples so that it too is continuous in the command.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye import rotations
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants.lpf import LowPassResponse
from orient_eye.rotations import rotation

Array = NDArray[np.float64]
BAND = 0.01
"""Settling band: share of the amplitude around the final orientation (thesis 4.4.2)."""


@dataclass(frozen=True)
class Measures:
    """Measures of a batch of saccades; every field has the first axis (saccades,).

    Attributes:
        final: orientation in which the eye comes to rest, (saccades, 4).
        at_settling: orientation at the settling time, (saccades, 4).
        amplitude_deg: angle between start and final orientation.
        settling_time_s: after it the eye stays within the band around the final orientation: the
            saccade's duration t_d.
        peak_velocity_deg_s: largest speed.
        overshoot: share of the amplitude by which the eye goes beyond the final orientation, >= 0.
        skewness: time from peak velocity to the settling time / duration; 0.5 is symmetric, NaN for a
            saccade without duration.
        settled: False where the horizon ended before the eye stayed within the band; the settling time
            is then the horizon.
        failed: True where the simulation failed: the measures are NaN.
    """

    final: Array
    at_settling: Array
    amplitude_deg: Array
    settling_time_s: Array
    peak_velocity_deg_s: Array
    overshoot: Array
    skewness: Array
    settled: NDArray[np.bool_]
    failed: NDArray[np.bool_]


def measure(trajectory: Trajectory, final: Array | None = None, *, band: float = BAND) -> Measures:
    """Measure sampled saccades.

    Args:
        trajectory: of any plant.
        final: orientations in which the eye comes to rest, (saccades, 4): the plant's equilibrium at the
            final motor position; None for the last sample.
        band: settling band, share of the amplitude.
    """
    q, t = trajectory.orientation, trajectory.time
    final = q[:, -1] if final is None else final
    failed = trajectory.failed | ~np.isfinite(final).all(axis=1)
    safe = np.where(failed[:, None, None], rotations.FORWARD, q)
    final = np.where(failed[:, None], rotations.FORWARD, final)

    start = safe[:, 0]
    amplitude = rotations.angle_between(start, final)
    distance = rotations.angle_between(safe, final[:, None])
    settling, index, share, settled = _last_exit(t, distance, band * amplitude)
    rows = np.arange(len(safe))
    before, after = safe[rows, index], safe[rows, np.minimum(index + 1, len(t) - 1)]
    after = after * np.where((before * after).sum(axis=-1, keepdims=True) < 0, -1, 1)
    between = before + share[:, None] * (after - before)  # a millisecond apart: chord and arc agree
    at_settling = between / np.linalg.norm(between, axis=-1, keepdims=True)

    progress = _turn_about(rotation(final) * rotation(start).inv(), start, safe) / np.maximum(amplitude, 1e-9)[:, None]
    peak, _ = _parabolic_peak(t, progress)
    speed = np.linalg.norm(np.where(failed[:, None, None], 0.0, trajectory.angular_velocity), axis=-1)
    peak_speed, peak_time = _parabolic_peak(t, speed)
    moved = amplitude > 1e-9
    return _measures(
        final=final,
        at_settling=at_settling,
        amplitude_deg=amplitude,
        settling_time_s=np.where(moved, settling, 0.0),
        peak_velocity_deg_s=peak_speed,
        overshoot=np.where(moved, np.maximum(peak - 1, 0), 0.0),
        peak_time=peak_time,
        settled=settled | ~moved,
        failed=failed,
    )


def _turn_about(turn: Rotation, start: Array, orientation: Array) -> Array:
    """Angle [deg] (saccades, time) by which orientations are turned from start about the axis of turn."""
    vector = turn.as_rotvec()
    axis = vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-300)
    # With r = q start^-1: the twist about the axis is 2 atan2(r_vec . axis, r_w), both linear in q.
    w, v = start[:, :1], start[:, 1:]
    along = np.concatenate([-(v * axis).sum(axis=-1, keepdims=True), w * axis - np.cross(v, axis)], axis=-1)
    sine, cosine = (np.einsum("ntk,nk->nt", orientation, c) for c in (along, start))
    sign = np.where(cosine < 0, -1.0, 1.0)
    angle: Array = np.rad2deg(2 * np.arctan2(sign * sine, sign * cosine))
    return angle


def _measures(
    *,
    settling_time_s: Array,
    peak_time: Array,
    failed: NDArray[np.bool_],
    settled: NDArray[np.bool_],
    **fields: Array,
) -> Measures:
    with np.errstate(invalid="ignore", divide="ignore"):
        skewness = np.maximum(settling_time_s - peak_time, 0) / settling_time_s
    fields = {**fields, "settling_time_s": settling_time_s, "skewness": skewness}
    for array in fields.values():
        array[failed] = np.nan
    return Measures(**fields, settled=settled & ~failed, failed=failed)


def _last_exit(t: Array, distance: Array, band: Array) -> tuple[Array, NDArray[np.intp], Array, NDArray[np.bool_]]:
    """Time after which distance (saccades, time) stays within band (saccades,).

    Returns:
        The time; the index of the last sample outside; the share of the way to the next sample; and
        whether the last sample of all is inside.
    """
    outside = distance > band[:, None]
    settled = ~outside[:, -1]
    index = np.where(outside.any(axis=1), distance.shape[1] - 1 - outside[:, ::-1].argmax(axis=1), 0)
    rows = np.arange(len(distance))
    following = np.minimum(index + 1, distance.shape[1] - 1)
    here, there = distance[rows, index], distance[rows, following]
    drop = here - there
    share = np.clip(np.where(drop > 0, (here - band) / np.where(drop > 0, drop, 1), 0.0), 0, 1)
    return t[index] + share * (t[following] - t[index]), index, share, settled


def _parabolic_peak(t: Array, values: Array) -> tuple[Array, Array]:
    """Largest value and its time, by the parabola through the largest sample and its neighbours."""
    top = values.argmax(axis=1)
    rows = np.arange(len(values))
    inner = np.clip(top, 1, values.shape[1] - 2) if values.shape[1] > 2 else top
    left, middle, right = (values[rows, np.clip(inner + k, 0, values.shape[1] - 1)] for k in (-1, 0, 1))
    bend = left - 2 * middle + right
    usable = (inner == top) & (bend < 0)
    shift = np.where(usable, 0.5 * (left - right) / np.where(usable, bend, -1.0), 0.0)
    value = np.where(usable, middle - 0.25 * (left - right) * shift, values[rows, top])
    step = t[1] - t[0] if len(t) > 1 else 0.0
    return value, t[top] + shift * step


_GRID = 128  # points in time on which the roots of the closed form are bracketed
_ROUNDS = 8  # of safeguarded Newton


def measure_response(response: LowPassResponse, *, band: float = BAND) -> Measures:
    """Measure the low-pass plant's response to pulse-steps, in closed form.

    Settling time, peak velocity and overshoot are roots of the closed form and its derivatives,
    bracketed on a grid and solved by Newton's method.

    Args:
        response: of the low-pass plant.
        band: settling band, share of the amplitude.
    """
    slowest = np.minimum(response.command.B[:, 0], response.surrogate.w0)
    t = (25 / slowest)[:, None] * np.linspace(0, 1, _GRID) ** 3  # past exp(-25) nothing matters
    progress, rate = response.motion(t)[:2]
    rows, end = np.arange(len(t)), _GRID - 1

    # In columns: the peak velocity, the peak of an overshoot, the last exit from the band.
    fastest, top = np.abs(rate).argmax(axis=1), progress.argmax(axis=1)
    turns = (progress[rows, top] > 1) & (top < end)
    outside = np.abs(progress - 1) > band
    last = end - outside[:, ::-1].argmax(axis=1)
    index = np.stack([fastest, top, last], axis=1)
    low = t[rows[:, None], np.maximum(index - [1, 1, 0], 0)]
    high = t[rows[:, None], np.minimum(index + 1, end)]
    side = np.where(progress[rows, last] > 1, 1.0, -1.0)
    ahead = np.sign(rate[rows, fastest])

    def function_and_slope(s: Array) -> tuple[Array, Array]:
        x, x1, x2, x3 = response.motion(s)
        exit_ = side * (x[:, 2] - 1) - band
        slope = [ahead * x3[:, 0], x2[:, 1], side * x1[:, 2]]
        return np.stack([ahead * x2[:, 0], x1[:, 1], exit_], axis=1), np.stack(slope, axis=1)

    root = _falling_root(low, high, function_and_slope)
    # A crest that leaves the band between two points of the grid: the last exit is behind it.
    crest = response.motion(root)[0][:, 1]
    late = turns & (crest > 1 + band) & (root[:, 2] < root[:, 1])
    if late.any():
        side = np.where(late, 1.0, side)
        low[:, 2] = np.where(late, root[:, 1], low[:, 2])
        high[:, 2] = np.where(late, t[rows, np.minimum(top + 1, end)], high[:, 2])
        root = np.where(late[:, None], _falling_root(low, high, function_and_slope), root)
    root[:, 0] = np.where(fastest == 0, 0.0, root[:, 0])
    at_root, speed_at_root = response.motion(root)[:2]
    overshoot = np.where(turns, np.maximum(at_root[:, 1] - 1, 0), 0.0)

    size = response.final - response.start
    moved = size != 0
    settling = np.where(moved, root[:, 2], 0.0)
    yaw = response.start + size * np.where(moved, at_root[:, 2], 0.0)
    failed = ~(np.isfinite(yaw) & np.isfinite(response.final) & np.isfinite(settling))
    return _measures(
        final=rotations.from_yaw(response.final),
        at_settling=rotations.from_yaw(yaw),
        amplitude_deg=np.abs(size),
        settling_time_s=settling,
        peak_velocity_deg_s=np.abs(size * speed_at_root[:, 0]),
        overshoot=np.where(moved, overshoot, 0.0),
        peak_time=root[:, 0],
        settled=np.ones(len(t), bool),
        failed=failed,
    )


def _falling_root(low: Array, high: Array, f: Callable[[Array], tuple[Array, Array]]) -> Array:
    """Roots of f, which falls from positive at low to negative at high; all arrays alike.

    Newton's method; a step that would leave the bracket halves it instead.
    """
    x = 0.5 * (low + high)
    for _ in range(_ROUNDS):
        value, slope = f(x)
        low, high = np.where(value > 0, x, low), np.where(value > 0, high, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = x - value / slope
        x = np.where((x >= low) & (x <= high), x, 0.5 * (low + high))
    return x
