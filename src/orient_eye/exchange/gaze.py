"""A recording of gaze, ours or a person's, and the saccades that a velocity threshold finds in it.

found = record.saccades()
found.amplitude_deg, found.peak_velocity_deg_s, found.duration_s
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from orient_eye import listing, rotations
from orient_eye.movement.main_sequence import MainSequence, fit_main_sequence
from orient_eye.movement.velocity_threshold import THRESHOLD_DEG_S, bouts

Array = NDArray[np.float64]
SMOOTHED_S, _LEAST_WINDOW, _DEGREE = 0.014, 5, 2
"""Window of the filter that smooths and differentiates, [s] and samples, and the degree of its polynomials."""
SHORTEST_S = 0.01
LEAST_DEG = 1.0
FASTEST_DEG_S = 1200.0
"""What is shorter is noise, what is faster a blink; smaller saccades are left out."""


@dataclass(frozen=True)
class Found:
    """Saccades that were found, in their order; arrays are (saccades,).

    Attributes:
        onset_s, offset_s: when the speed rises above the threshold and falls below it.
        amplitude_deg: between the directions of gaze at both.
        peak_velocity_deg_s: largest speed of the smoothed gaze.
        left_out: how many were none, by the reason.
    """

    onset_s: Array
    offset_s: Array
    amplitude_deg: Array
    peak_velocity_deg_s: Array
    left_out: dict[str, int]

    def __len__(self) -> int:
        return len(self.onset_s)

    @property
    def duration_s(self) -> Array:
        """From onset to offset."""
        return self.offset_s - self.onset_s

    def main_sequence(self) -> MainSequence:
        """Fitted to them; raises InputError of fewer than three."""
        return fit_main_sequence(self.amplitude_deg, self.peak_velocity_deg_s, self.duration_s)


@dataclass(frozen=True)
class GazeRecord:
    """Gaze at one rate.

    Attributes:
        time: [s], (samples,), even.
        horizontal_deg: positive to the right, (samples,); NaN in gaps.
        vertical_deg: positive up, (samples,); NaN in gaps.
        rate_hz: samples in a second.
    """

    time: Array
    horizontal_deg: Array
    vertical_deg: Array
    rate_hz: float

    def smoothed(self) -> tuple[Array, Array]:
        """Both angles [deg] and their rates [deg/s], each (2, samples); NaN in gaps and in what is too short to smooth.

        By a filter of Savitzky and Golay (1964).
        """
        angles = np.stack([self.horizontal_deg, self.vertical_deg])
        window = max(_LEAST_WINDOW, 2 * (round(SMOOTHED_S * self.rate_hz) // 2) + 1)
        known = np.isfinite(angles).all(axis=0)
        edges = np.diff(known.astype(int), prepend=0, append=0)
        smooth, rate = np.full((2, *angles.shape), np.nan)
        for first, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
            if end - first < window:
                continue
            part = angles[:, first:end]
            smooth[:, first:end] = savgol_filter(part, window, _DEGREE)
            rate[:, first:end] = savgol_filter(part, window, _DEGREE, deriv=1, delta=1 / self.rate_hz)
        return smooth, rate

    def saccades(self, threshold_deg_s: float = THRESHOLD_DEG_S, least_deg: float = LEAST_DEG) -> Found:
        """What is faster than a threshold, lasts, and is a saccade of at least this amplitude.

        Those that touch a gap or an end are left out, as are shorter ones, and faster ones than any eye.
        """
        angles, rates = self.smoothed()
        speed = np.hypot(rates[0] * np.cos(np.deg2rad(angles[1])), rates[1])
        found = bouts(self.time, speed, threshold_deg_s)
        at_onset, at_offset = (
            listing.directions(*(np.interp(moment, self.time, angle) for angle in angles))
            for moment in (found.onset_s, found.offset_s)
        )
        amplitude = rotations.angle_between_directions(at_onset, at_offset)
        reasons = {
            "in a gap or at an end": ~np.isfinite(found.duration_s),
            f"shorter than {1e3 * SHORTEST_S:g} ms": found.duration_s < SHORTEST_S,
            f"smaller than {least_deg:g} deg": amplitude < least_deg,
            f"faster than {FASTEST_DEG_S:g} deg/s": found.peak_velocity_deg_s > FASTEST_DEG_S,
        }
        kept, left_out = np.ones(len(amplitude), bool), dict[str, int]()
        for reason, bad in reasons.items():
            left_out[reason] = int((kept & bad).sum())
            kept &= ~bad
        return Found(
            found.onset_s[kept], found.offset_s[kept], amplitude[kept], found.peak_velocity_deg_s[kept], left_out
        )
