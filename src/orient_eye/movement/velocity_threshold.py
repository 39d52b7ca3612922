"""When a saccade begins and ends as those of people are measured: while its speed is above a threshold.

    bout = above(trajectory)                         # 30 deg/s
    bout.duration_s, bout.acceleration_share
    bouts(time, speed)                               # all of one long recording

The thesis' duration (`measures.settling_time_s`) ends where the eye stays within a band around its end, which is
later: the numbers of people and ours can be compared only where both are measured alike.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.movement.measures import View
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
THRESHOLD_DEG_S = 30.0
"""Of eye trackers and of most studies."""


@dataclass(frozen=True)
class Bout:
    """The part of saccades around their peak velocity that is faster than a threshold; every field is (saccades,).

    NaN where a saccade failed, is never so fast, or is still so fast when its samples end.

    Attributes:
        onset_s: when the speed rises above the threshold; 0 where the eye is faster from the beginning.
        offset_s: when it falls below.
        peak_velocity_deg_s: largest sampled speed.
        acceleration_share: time from onset to peak velocity / duration; 0.5 is symmetric.
    """

    onset_s: Array
    offset_s: Array
    peak_velocity_deg_s: Array
    acceleration_share: Array

    @property
    def duration_s(self) -> Array:
        """From onset to offset."""
        return self.offset_s - self.onset_s


def speed_of(trajectory: Trajectory, of: View = "orientation") -> Array:
    """Speed [deg/s] of the whole eye or of its gaze, (saccades, time)."""
    velocity = trajectory.angular_velocity
    if of == "gaze":
        gaze = rotations.gaze(trajectory.orientation)
        velocity = velocity - (velocity * gaze).sum(axis=-1, keepdims=True) * gaze
    return np.asarray(np.linalg.norm(velocity, axis=-1))


def above(trajectory: Trajectory, threshold_deg_s: float = THRESHOLD_DEG_S, of: View = "orientation") -> Bout:
    """Measure sampled saccades by a velocity threshold, interpolated between samples.

    Args:
        trajectory: of any plant.
        threshold_deg_s: speed.
        of: whether the speed is that of the whole eye or of its gaze.
    """
    time, speed = trajectory.time, speed_of(trajectory, of)
    known = ~trajectory.failed & np.isfinite(speed).all(axis=1)
    speed = np.where(known[:, None], speed, 0.0)
    rows, top = np.arange(len(speed)), speed.argmax(axis=1)
    below, index = speed < threshold_deg_s, np.arange(speed.shape[1])
    before = np.where(below & (index < top[:, None]), index, -1).max(axis=1)
    after = np.where(below & (index > top[:, None]), index, len(index)).min(axis=1)
    known &= (speed[rows, top] >= threshold_deg_s) & (after < len(index))

    def crossing(slow: NDArray[np.intp], fast: NDArray[np.intp]) -> Array:
        slow, fast = np.clip(slow, 0, len(index) - 1), np.clip(fast, 0, len(index) - 1)
        low, high = speed[rows, slow], speed[rows, fast]
        share = np.clip((threshold_deg_s - low) / np.where(high > low, high - low, 1.0), 0, 1)
        return np.asarray(time[slow] + share * (time[fast] - time[slow]))

    onset = np.where(before < 0, time[0], crossing(before, before + 1))
    offset = crossing(after, after - 1)
    found = np.where(known, np.stack([onset, offset, speed[rows, top], time[top]]), np.nan)
    onset, offset, peak, at = found
    return Bout(onset, offset, peak, (at - onset) / np.where(offset > onset, offset - onset, np.nan))


def bouts(time: Array, speed: Array, threshold_deg_s: float = THRESHOLD_DEG_S) -> Bout:
    """All parts of one recording that are faster than a threshold, in their order; every field is (bouts,).

    NaN where one begins or ends in a gap, or with the recording. Times are interpolated between samples.

    Args:
        time: [s], (samples,).
        speed: [deg/s], (samples,), NaN in gaps.
        threshold_deg_s: speed.
    """
    edges = np.diff((speed >= threshold_deg_s).astype(int), prepend=0, append=0)
    first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    around = np.concatenate([[np.nan], speed, [np.nan]])
    moments = np.concatenate([time[:1], time, time[-1:]])

    def crossing(slow: NDArray[np.intp], fast: NDArray[np.intp]) -> Array:
        """NaN beside a gap; both count from `around`."""
        share = (threshold_deg_s - around[slow]) / (around[fast] - around[slow])
        return np.asarray(moments[slow] + share * (moments[fast] - moments[slow]))

    onset, offset = crossing(first, first + 1), crossing(last + 2, last + 1)
    top = np.array([i + int(speed[i : j + 1].argmax()) for i, j in zip(first, last, strict=True)], int)
    whole = np.isfinite(onset) & np.isfinite(offset)
    found = np.where(whole, np.stack([onset, offset, speed[top], time[top]]), np.nan)
    onset, offset, peak, at = found
    return Bout(onset, offset, peak, (at - onset) / (offset - onset))
