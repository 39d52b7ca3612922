"""Saccades as an eye tracker records them: one recording at one rate, the saccades one after the other.

record = recorded(trajectory, rate_hz=500)
record.gaze(noise_deg=0.02, random=np.random.default_rng(0)).saccades()
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.exchange.gaze import GazeRecord
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
REST_S, GAP_S = 0.2, 0.1
SLOWEST_HZ, FASTEST_HZ = 1.0, 100_000.0
_MOST = 50_000_000  # samples: 2 GB
_EVEN = 1e-3  # of a step


@dataclass(frozen=True)
class EyeRecord:
    """One recording.

    Attributes:
        rate_hz: samples in a second.
        orientation: unit quaternions w, x, y, z, eye to head, (samples, 4); NaN in gaps and where a saccade failed.
        starts_s: when each saccade's own time is 0 [s], (saccades,).
    """

    rate_hz: float
    orientation: Array
    starts_s: Array

    @property
    def time(self) -> Array:
        """[s], from 0, (samples,)."""
        return np.arange(len(self.orientation)) / self.rate_hz

    def gaze(self, noise_deg: float = 0.0, random: np.random.Generator | None = None) -> GazeRecord:
        """Where the eye looks; with a random generator, with white noise of this sd on both angles [deg]."""
        yaw, pitch, _ = rotations.to_euler(self.orientation)
        angles = np.stack([-yaw, -pitch])
        if random is not None:
            angles = angles + noise_deg * random.standard_normal(angles.shape)
        return GazeRecord(self.time, angles[0], angles[1], self.rate_hz)


def recorded(
    trajectory: Trajectory, rate_hz: float | None = None, rest_s: float = REST_S, gap_s: float = GAP_S
) -> EyeRecord:
    """Saccades one after the other, with a rest before each and a gap between two.

    In the rest the eye stands where the saccade starts; in the gap, in which it would be set to the next start, nothing
    is recorded. Between samples of the trajectory quaternions go straight.

    Args:
        trajectory: of any plant.
        rate_hz: samples in a second; None for that of the trajectory.
        rest_s: before each saccade [s].
        gap_s: between two [s].

    Raises:
        InputError: a rate out of bounds, none where the trajectory has none of its own, or too many samples.
    """
    time = trajectory.time
    rate = _own_rate(time) if rate_hz is None else real("the rate", rate_hz, SLOWEST_HZ, FASTEST_HZ, unit="Hz")
    rest, gap = round(rest_s * rate), round(gap_s * rate)
    moving = int(np.floor(time[-1] * rate * (1 + 1e-9) + 1e-9)) + 1
    samples = rest + moving + gap
    if len(trajectory) * samples > _MOST:
        raise InputError(
            f"{len(trajectory)} saccades at {rate:g} Hz are {len(trajectory) * samples} samples, at most {_MOST} are "
            "written at once; take a lower rate or fewer saccades"
        )
    at = np.clip(np.arange(-rest, moving) / rate, 0, time[-1])
    before = np.clip(np.searchsorted(time, at, side="right") - 1, 0, max(len(time) - 2, 0))
    after = np.minimum(before + 1, len(time) - 1)
    step = time[after] - time[before]
    share = np.where(step > 0, (at - time[before]) / np.where(step > 0, step, 1), 0)[:, None]
    q, then = trajectory.orientation[:, before], trajectory.orientation[:, after]
    near = np.where((q * then).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    between = (1 - share) * q + share * near * then
    block = np.full((len(trajectory), samples, 4), np.nan)
    block[:, : rest + moving] = between / np.linalg.norm(between, axis=-1, keepdims=True)
    starts = (samples * np.arange(len(trajectory)) + rest) / rate
    whole = block.reshape(-1, 4)
    return EyeRecord(rate, whole[: len(whole) - gap], starts)


def _own_rate(time: Array) -> float:
    """Samples in a second of a trajectory's own times (samples,).

    Raises:
        InputError: there is one sample, or they are not even.
    """
    steps = np.diff(time)
    if not steps.size or np.ptp(steps) > _EVEN * steps.mean():
        raise InputError("the saccades' samples have no rate of their own; name one in Hz")
    return real("the rate", float(round(1 / steps.mean(), 6)), SLOWEST_HZ, FASTEST_HZ, unit="Hz")
