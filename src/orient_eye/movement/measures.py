"""Measures of a saccade: settling time, peak velocity, skewness, overshoot (thesis 2.1.3, 4.4).

    measured = measure(trajectory, final)            # from samples, any plant
    measured = measure(trajectory, final, of="gaze") # torsion does not count

A movement in closed form measures itself (`orient_eye.plants.linear`), by the same definitions.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye import rotations
from orient_eye.constants import BAND
from orient_eye.movement.tail import Tail
from orient_eye.movement.trajectory import Trajectory
from orient_eye.rotations import rotation

Array = NDArray[np.float64]
_ROUNDING = 1e-11  # of the amplitude: an eye that has come to its end and stays there has no overshoot
View = Literal["orientation", "gaze"]
"""What is measured: the whole orientation, or the direction of gaze alone."""


@dataclass(frozen=True)
class Measures:
    """Measures of a batch of saccades; every field has the first axis (saccades,).

    Attributes:
        final: orientation in which the eye comes to rest, (saccades, 4).
        at_settling: orientation at the settling time, (saccades, 4).
        amplitude_deg: angle between start and final orientation, or gaze.
        settling_time_s: after it the eye stays within the band around the final orientation: the
            saccade's duration t_d.
        peak_velocity_deg_s: largest speed.
        overshoot: share of the amplitude by which the eye goes beyond the final orientation, >= 0.
        skewness: time from peak velocity to the settling time / duration; 0.5 is symmetric, NaN for a
            saccade without duration.
        settled: False where the horizon ended before the eye stayed within the band. The settling time is then where
            that came to be all the same, on a saccade that goes on (`orient_eye.movement.SampledMovement`), or the
            horizon.
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

    def __getitem__(self, which: NDArray[Any]) -> "Measures":
        """Some of the saccades."""
        return Measures(**{name: value[which] for name, value in vars(self).items()})


def measure(
    trajectory: Trajectory,
    final: Array | None = None,
    *,
    band: float = BAND,
    of: View = "orientation",
    tail: Tail | None = None,
) -> Measures:
    """Measure sampled saccades.

    Args:
        trajectory: of any plant.
        final: orientations in which the eye comes to rest, (saccades, 4): the plant's equilibrium at the
            final motor position; None for the last sample.
        band: settling band, share of the amplitude.
        of: "orientation": amplitude and distance are angles of rotation, overshoot is progress about the axis from
            start to end. "gaze": they are angles between directions of gaze, and progress along their great circle;
            speed is that of the gaze.
        tail: how the saccades go on after their last sample, to the same end; None where nothing follows that counts.
    """
    q, t = trajectory.orientation, trajectory.time
    final = q[:, -1] if final is None else final
    failed = trajectory.failed | ~np.isfinite(final).all(axis=1)
    safe, velocity = q, trajectory.angular_velocity
    if failed.any():
        safe = np.where(failed[:, None, None], rotations.FORWARD, q)
        final = np.where(failed[:, None], rotations.FORWARD, final)
        velocity = np.where(failed[:, None, None], 0.0, velocity)
    seen = _seen_whole if of == "orientation" else _seen_gaze
    amplitude, distance, turned, speed = seen(safe, final, velocity)
    settling, index, share, settled = _last_exit(t, distance, band * amplitude)
    rows = np.arange(len(safe))
    before, after = safe[rows, index], safe[rows, np.minimum(index + 1, len(t) - 1)]
    after = after * np.where((before * after).sum(axis=-1, keepdims=True) < 0, -1, 1)
    between = before + share[:, None] * (after - before)  # a millisecond apart: chord and arc agree
    at_settling = between / np.linalg.norm(between, axis=-1, keepdims=True)

    peak, _ = _parabolic_peak(t, turned / np.maximum(amplitude, 1e-9)[:, None])
    peak_speed, peak_time = _parabolic_peak(t, speed)
    beyond = np.ones(len(safe))
    if tail is not None:
        ends = np.stack([safe[:, 0], tail.end], axis=1)
        beyond = np.maximum(1, seen(ends, final, np.zeros((len(safe), 2, 3)))[2][:, 1] / np.maximum(amplitude, 1e-9))
        late = ~settled & (tail.rate > 0)
        share = np.where(late, band * amplitude / np.where(late, distance[:, -1], 1), 1.0)
        settling = settling - np.log(share) / np.where(late, tail.rate, 1)
        then = Rotation.from_rotvec(tail.way * share[:, None]) * rotation(final)
        at_settling = np.where(late[:, None], then.as_quat(scalar_first=True), at_settling)
    moved = amplitude > 1e-9
    return finished(
        final=final,
        at_settling=at_settling,
        amplitude_deg=amplitude,
        settling_time_s=np.where(moved, settling, 0.0),
        peak_velocity_deg_s=peak_speed,
        overshoot=np.where(moved & (peak > beyond + _ROUNDING), peak - 1, 0.0),
        peak_time=peak_time,
        settled=settled | ~moved,
        failed=failed,
    )


def measure_angle(
    time: Array, angle: Array, rate: Array, final: Array, axis: str, failed: NDArray[np.bool_], *, band: float = BAND
) -> Measures:
    """Measure sampled saccades of an eye that turns about one axis only; as `measure`, at a fraction of its work.

    Args:
        time: [s], (time,).
        angle: about the axis [deg], (saccades, time).
        rate: [deg/s], (saccades, time).
        final: where the eye comes to rest [deg], (saccades,).
        axis: yaw, pitch or roll.
        failed: which have no numbers, (saccades,).
        band: settling band, share of the amplitude.
    """
    angle, rate = (np.where(failed[:, None], 0.0, values) for values in (angle, rate))
    final = np.where(failed, 0.0, final)
    way = final - angle[:, 0]
    amplitude = np.abs(way)
    settling, index, share, settled = _last_exit(time, np.abs(angle - final[:, None]), band * amplitude)
    rows = np.arange(len(angle))
    before, after = angle[rows, index], angle[rows, np.minimum(index + 1, len(time) - 1)]
    progress = (angle - angle[:, :1]) * (np.sign(way) / np.maximum(amplitude, 1e-9))[:, None]
    peak, _ = _parabolic_peak(time, progress)
    peak_speed, peak_time = _parabolic_peak(time, np.abs(rate))
    moved = amplitude > 1e-9
    return finished(
        final=rotations.about(axis, final),
        at_settling=rotations.about(axis, before + share * (after - before)),
        amplitude_deg=amplitude,
        settling_time_s=np.where(moved, settling, 0.0),
        peak_velocity_deg_s=peak_speed,
        overshoot=np.where(moved, np.maximum(peak - 1, 0), 0.0),
        peak_time=peak_time,
        settled=settled | ~moved,
        failed=failed,
    )


def merged(which: NDArray[np.bool_], some: Measures, others: Measures) -> Measures:
    """Measures of a batch, of which some saccades (saccades,) were measured apart from the others."""
    return Measures(**{name: merged_rows(which, getattr(some, name), value) for name, value in vars(others).items()})


def merged_rows(which: NDArray[np.bool_], some: NDArray[Any], others: NDArray[Any]) -> NDArray[Any]:
    """Values (saccades, ...) of a batch from those of some saccades (saccades,) and of the others."""
    values = np.empty((len(which), *some.shape[1:]), some.dtype)
    values[which], values[~which] = some, others
    return values


def _seen_whole(orientation: Array, final: Array, velocity: Array) -> tuple[Array, Array, Array, Array]:
    """Amplitude (saccades,), and over time distance from the end, turn from the start [deg], and speed [deg/s]."""
    start = orientation[:, 0]
    vector = (rotation(final) * rotation(start).inv()).as_rotvec()
    axis = vector / np.maximum(np.sqrt(_dot(vector, vector)), 1e-300)[:, None]
    # The parts of r = q p^-1 are linear in q; the twist about an axis is 2 atan2(r_vec . axis, r_w).
    of_end, of_start = _over(final), _over(start)
    along = np.stack([of_start[..., 0], _dot(of_start[..., 1:], axis[:, None])], axis=-1)
    parts = orientation @ np.concatenate([of_end, along], axis=-1)
    distance = _whole_angle(np.sqrt(_dot(parts[..., 1:4], parts[..., 1:4])), np.abs(parts[..., 0]))
    sign = np.where(parts[..., 4] < 0, -1.0, 1.0)
    turned = _whole_angle(sign * parts[..., 5], sign * parts[..., 4])
    return rotations.angle_between(start, final), distance, turned, np.sqrt(_dot(velocity, velocity))


def _dot(one: Array, other: Array) -> Array:
    """Of vectors (..., 3): the same in any batch, and numpy's own sum takes three times as long on so short an axis."""
    return np.asarray(one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1] + one[..., 2] * other[..., 2])


def _over(quaternion: Array) -> Array:
    """Matrices (saccades, 4, 4) with which q times the inverse of a quaternion (saccades, 4) is q @ matrix."""
    w, x, y, z = quaternion.T
    return np.moveaxis(np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]]), 2, 0)


def _whole_angle(sine: Array, cosine: Array) -> Array:
    """Angle [deg] from sine and cosine of its half."""
    return np.asarray(np.rad2deg(2 * np.arctan2(sine, cosine)))


def _seen_gaze(orientation: Array, final: Array, velocity: Array) -> tuple[Array, Array, Array, Array]:
    """The same of the direction of gaze."""
    gaze, end = rotations.gaze(orientation), rotations.gaze(final)
    start = gaze[:, 0]
    amplitude = rotations.angle_between_directions(start, end)
    apart = gaze - end[:, None]
    distance = np.rad2deg(2 * np.arcsin(np.minimum(np.sqrt(_dot(apart, apart)) / 2, 1)))
    ahead = end - (end * start).sum(axis=-1, keepdims=True) * start  # along the great circle, where it leaves the start
    ahead /= np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-300)
    along, across = _dot(gaze, ahead[:, None]), _dot(gaze, start[:, None])
    rolling = _dot(velocity, gaze)
    speed = np.sqrt(np.maximum(_dot(velocity, velocity) - rolling**2, 0))
    return amplitude, distance, np.rad2deg(np.arctan2(along, across)), speed


def finished(
    *,
    settling_time_s: Array,
    peak_time: Array,
    failed: NDArray[np.bool_],
    settled: NDArray[np.bool_],
    **fields: Array,
) -> Measures:
    """Measures with the skewness that follows from the others, and NaN where a saccade failed."""
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
    last = values.shape[1] - 1
    left, middle, right = (values[rows, np.clip(top + k, 0, last)] for k in (-1, 0, 1))
    bend = left - 2 * middle + right
    usable = (top > 0) & (top < last) & (bend < 0)
    shift = np.where(usable, 0.5 * (left - right) / np.where(usable, bend, -1.0), 0.0)
    value = np.where(usable, middle - 0.25 * (left - right) * shift, values[rows, top])
    step = t[1] - t[0] if len(t) > 1 else 0.0
    return value, t[top] + shift * step
