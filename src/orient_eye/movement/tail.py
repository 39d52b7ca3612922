"""What is left of a saccade where its samples end: an exponential way to its end, once it has become one.

    tail = tail_of(trajectory, final, stands)
    tail.sure(amplitude, overshoot, band)            # (saccades,): nothing else can come; else step on

A motion of several parts, of which a slow one is to turn the eye back later, does not pass through an exponential.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye import rotations
from orient_eye.constants import DOUBT
from orient_eye.movement.trajectory import Trajectory
from orient_eye.rotations import rotation

Array = NDArray[np.float64]
_WINDOW_S = 0.1  # the last samples, through which the exponential has to pass
_POINTS = 9  # of it
_HIDDEN = 10.0  # what passes by the exponential by so little may be so many times as much
_FEIGNED = 100.0  # and more if it leads to an end beside where the eye rests, which a slow part of the motion feigns
_ASIDE = 1e-6  # of the amplitude, and _LEAST: how far that may lie beside, as MuJoCo's motors yield a little
_LEAST = np.deg2rad(2e-5)
_SMALL_DEG = 0.01  # amplitude below which doubt is held against this one
_FARTHER = 0.2  # of an overshoot: doubt that makes it no larger
_STANDS = 1e-4  # of its travel: a motor this near its end has done all its work but for 1e-8


@dataclass(frozen=True)
class Tail:
    """The rest of saccades after their last sample: a turn beyond the end that shrinks as exp(-rate t).

    Attributes:
        way: that turn at the last sample, rotation vector in the head frame [rad], (saccades, 3).
        end: where the eye is going, (saccades, 4): where it comes to rest, or just beside.
        rate: [1/s], (saccades,); 0 where the last samples do not approach the end.
        doubt: how far from that way the eye may still be [rad], (saccades,); inf where a motor is on its way.
    """

    way: Array
    end: Array
    rate: Array
    doubt: Array

    def sure(self, amplitude_deg: Array, overshoot: Array, band: float, doubt: float = DOUBT) -> NDArray[np.bool_]:
        """Of which saccades the tail changes nothing that was measured but as it says, (saccades,).

        Either nothing else than the exponential is left, or the eye has been farther beyond its end than the doubt
        reaches, and stays inside the band.

        Args:
            amplitude_deg: of the saccades, (saccades,); NaN where they failed.
            overshoot: up to the last sample, share of the amplitude, (saccades,).
            band: settling band, share of the amplitude.
            doubt: share of the amplitude by which a measure may be wrong.
        """
        amplitude = np.deg2rad(amplitude_deg)
        with np.errstate(invalid="ignore"):
            inside = np.linalg.norm(self.way, axis=1) + self.doubt < band * amplitude
            limit = doubt * np.where(inside, 1.0, band) * np.maximum(amplitude, np.deg2rad(_SMALL_DEG))
            farther = inside & (self.doubt <= _FARTHER * overshoot * amplitude)
            return np.asarray((self.doubt <= limit) | farther | np.isnan(amplitude))


def tail_of(trajectory: Trajectory, final: Array, stands: Array) -> Tail:
    """How sampled saccades go on.

    Args:
        trajectory: of saccades that go on.
        final: where the eyes come to rest, (saccades, 4).
        stands: where the motors come to stand, (saccades, motors).
    """
    count, samples = trajectory.orientation.shape[:2]
    failed = trajectory.failed | ~np.isfinite(final).all(axis=1)
    final = np.where(failed[:, None], rotations.FORWARD, final)
    step_s = float(trajectory.time[1]) if samples > 1 else _WINDOW_S
    back = max(1, round(_WINDOW_S / (_POINTS - 1) / step_s)) * np.arange(_POINTS)[::-1]
    rows = samples - 1 - np.minimum(back, samples - 1)
    q = np.where(failed[:, None, None], rotations.FORWARD, trajectory.orientation[:, rows])
    off = (rotation(q.reshape(-1, 4)) * rotation(np.repeat(final, _POINTS, axis=0)).inv()).as_rotvec()
    off, back_s = off.reshape(count, _POINTS, 3), np.asarray(back * step_s, float)

    misfit, rate = _misfit(off, back_s)
    aside = _limit(off)
    misfit_aside, rate_aside = _misfit(off - aside[:, None], back_s)
    start = np.where(failed[:, None], rotations.FORWARD, trajectory.orientation[:, 0])
    amplitude = np.deg2rad(rotations.angle_between(start, final))
    near = np.linalg.norm(aside, axis=1) <= _ASIDE * amplitude + _LEAST
    astray = near & (_FEIGNED * misfit_aside < misfit)
    aside[~astray] = 0.0
    doubt = _HIDDEN * np.where(astray, _FEIGNED * misfit_aside, misfit)
    travel = np.abs(trajectory.motor - stands[:, None]).max(axis=1)
    arrived = (np.abs(trajectory.motor[:, -1] - stands) <= _STANDS * travel).all(axis=1) & (back[0] < samples)
    beside = (Rotation.from_rotvec(aside) * rotation(final)).as_quat(scalar_first=True)
    return Tail(
        way=off[:, -1] - aside,
        end=np.where(astray[:, None], beside, final),
        rate=np.where(astray, rate_aside, rate),
        doubt=np.where(failed, 0.0, np.where(arrived, doubt, np.inf)),
    )


def _limit(off: Array) -> Array:
    """Where vectors (saccades, points, 3) lead that approach something exponentially (Aitken), (saccades, 3)."""
    first, second = off[:, _POINTS // 2] - off[:, 0], off[:, -1] - off[:, _POINTS // 2]
    square = (first**2).sum(axis=1)
    share = np.clip((first * second).sum(axis=1) / np.where(square > 0, square, 1), 0.0, 0.99)
    return np.asarray(off[:, -1] + second * (share / (1 - share))[:, None])


def _misfit(off: Array, back_s: Array) -> tuple[Array, Array]:
    """Largest distance from the exponential to 0 through the last of vectors (saccades, points, 3), and its rate.

    Of vectors that do not become shorter the largest, and 0.


    Args:
        off: the vectors.
        back_s: how long before the last, (points,).
    """
    length = np.linalg.norm(off, axis=2)
    known = (length[:, 0] > length[:, -1]) & (length[:, -1] > 0)
    ratio = np.where(known, length[:, 0], 1) / np.where(known, length[:, -1], 1)
    rate = np.log(ratio) / back_s[0]
    passes = off[:, -1:] * np.exp(rate[:, None] * back_s)[..., None]
    misfit = np.linalg.norm(off - passes, axis=2).max(axis=1)
    return np.where(known, misfit, length.max(axis=1)), rate
