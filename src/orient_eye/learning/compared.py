"""A recording of gaze held against a policy: main sequences, both found by the same velocity threshold.

found = compare(record, policy.task(), policy)
found.of["recording"].main_sequence(), found.of["policy"].main_sequence()
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.exchange.gaze import LEAST_DEG, Found, GazeRecord
from orient_eye.exchange.record import recorded
from orient_eye.human import people
from orient_eye.learning.policy import Policy
from orient_eye.movement.main_sequence import MainSequence
from orient_eye.movement.velocity_threshold import THRESHOLD_DEG_S
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.table import rows_of
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
AT_DEG = (2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0)
"""Amplitudes of the table."""
_ABOUT = 0.1  # share of an amplitude
_FEWEST, _SPREAD = 3, 1.5
_SIZES = 16


@dataclass(frozen=True)
class Compared:
    """Saccades of a recording and of a policy.

    Attributes:
        of: "recording" and "policy" to their saccades, found alike.
        fit: the same, and "people", to their main sequences.
        threshold_deg_s: by which they were found.
    """

    of: dict[str, Found]
    fit: dict[str, MainSequence]
    threshold_deg_s: float

    def rows(self) -> list[dict[str, Any]]:
        """Peak velocity [deg/s] and duration [ms] at each of `AT_DEG` where there are saccades, one row an amplitude.

        Of the recording the median of saccades of about that amplitude, of the policy straight lines between its own,
        of people their fit.
        """
        (recording, policy), people = self.of.values(), self.fit["people"]
        order = np.argsort(policy.amplitude_deg)
        own = policy.amplitude_deg[order]
        rows = []
        for size in AT_DEG:
            near = np.abs(recording.amplitude_deg / size - 1) <= _ABOUT
            if near.any() and own[0] <= size <= own[-1]:
                recorded_ms, made_ms = 1e3 * recording.duration_s[near], 1e3 * policy.duration_s[order]
                rows.append(
                    {
                        "amplitude_deg": size,
                        "recorded": int(near.sum()),
                        "recording_peak_velocity_deg_s": float(np.median(recording.peak_velocity_deg_s[near])),
                        "recording_duration_ms": float(np.median(recorded_ms)),
                        "policy_peak_velocity_deg_s": float(np.interp(size, own, policy.peak_velocity_deg_s[order])),
                        "policy_duration_ms": float(np.interp(size, own, made_ms)),
                        "people_peak_velocity_deg_s": float(people.peak_velocity(size)),
                        "people_duration_ms": float(people.duration_ms(size)),
                    }
                )
        return rows

    def saccade_rows(self) -> list[dict[str, Any]]:
        """All saccades, one row each."""
        return [
            {"of": who, **row}
            for who, found in self.of.items()
            for row in rows_of(
                {
                    "onset_s": found.onset_s,
                    "amplitude_deg": found.amplitude_deg,
                    "peak_velocity_deg_s": found.peak_velocity_deg_s,
                    "duration_ms": 1e3 * found.duration_s,
                }
            )
        ]


def compare(
    record: GazeRecord,
    task: SaccadeTask,
    policy: Policy,
    threshold_deg_s: float = THRESHOLD_DEG_S,
    least_deg: float = LEAST_DEG,
) -> Compared:
    """Find the saccades of a recording, make the policy's of the same amplitudes, and measure both alike.

    The policy's go around straight ahead. They are sampled at the recording's rate, smoothed and found as its own are:
    what sampling and smoothing take from a peak, they take from both.

    Args:
        record: of a person or of another robot.
        task: on which the policy's are made.
        policy: that makes them.
        threshold_deg_s: speed above which gaze makes a saccade.
        least_deg: smaller saccades are left out.

    Raises:
        InputError: the recording has fewer than three saccades or all of one size, or the policy makes none of their
            amplitudes.
    """
    found = record.saccades(threshold_deg_s, least_deg)
    if len(found) < _FEWEST:
        rest = ", ".join(f"{count} {why}" for why, count in found.left_out.items() if count)
        raise InputError(
            f"{len(found)} saccades were found, a main sequence needs at least {_FEWEST}"
            + (f"; left out: {rest}" if rest else "")
            + f"; gaze is read in deg, and saccades are faster than {threshold_deg_s:g} deg/s"
        )
    low, high = float(found.amplitude_deg.min()), float(found.amplitude_deg.max())
    if high < _SPREAD * low:
        raise InputError(
            f"all {len(found)} saccades have {low:.1f} to {high:.1f} deg; a main sequence needs amplitudes that differ "
            f"by a factor of {_SPREAD:g} or more"
        )
    largest = 2 * task.targets.limit_deg
    sizes = np.geomspace(low, min(high, largest), _SIZES) if low < largest else np.empty(0)
    made = _of_policy(record, task, policy, sizes, (threshold_deg_s, least_deg))
    if made is None or len(made) < _FEWEST:
        raise InputError(
            f"the recording's saccades have {low:.1f} to {high:.1f} deg, of which the policy makes fewer than "
            f"{_FEWEST}; it makes them up to {largest:.1f} deg: name another policy"
        )
    both = {"recording": found, "policy": made}
    fits = {who: each.main_sequence() for who, each in both.items()} | {"people": people()}
    return Compared(both, fits, threshold_deg_s)


def _of_policy(
    record: GazeRecord, task: SaccadeTask, policy: Policy, sizes: Array, threshold: tuple[float, float]
) -> Found | None:
    ends = task.targets.symmetric(sizes)
    if not len(ends[0]):
        return None
    start, target = saccades(task.targets, *ends)
    made = task.trajectory(start, policy.act(start.orientation, target), target)
    return recorded(made, record.rate_hz).gaze().saccades(*threshold)
