"""The reward of a saccade, thesis section 4.4: accuracy, energy, duration, overshoot.

    R = lambda_a R_a + lambda_e R_e + lambda_d R_d + lambda_o R_o        (4.32)

All four terms are at most 0; the weights say how much each matters.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.movement.measures import Measures

Array = NDArray[np.float64]
DISCOUNT = 0.6
"""Temporal discount rate [1/s] of the duration term (4.39)."""


@dataclass(frozen=True)
class Weights:
    """Weights of the reward's terms (4.32).

    The defaults are those of case 1 on the low-pass plant; `orient_eye.task.cases` has every case's.
    """

    accuracy: float = 2.66e7
    """lambda_a"""
    energy: float = 1.0
    """lambda_e"""
    duration: float = 5.12e5
    """lambda_d"""
    overshoot: float = 2.3e8
    """lambda_o"""

    def __post_init__(self) -> None:
        values = (self.accuracy, self.energy, self.duration, self.overshoot)
        if not all(np.isfinite(v) and v >= 0 for v in values):
            raise InputError(f"weights must be finite and not negative, got {values}")


@dataclass(frozen=True)
class Reward:
    """The reward's terms, unweighted, and their weighted total, each (saccades,).

    Attributes:
        accuracy: R_a = -(1 - (q_d . q_s)^2), q_s the orientation at the settling time (4.41).
        energy: R_e = -(integral of the squared motor speed) [deg^2/s] (4.35).
        duration: R_d = -(1 - 1 / (1 + 0.6 t_d)) (4.40).
        overshoot: R_o = -overshoot (4.42).
        total: weighted sum (4.32).
    """

    accuracy: Array
    energy: Array
    duration: Array
    overshoot: Array
    total: Array


def reward(measures: Measures, energy: Array, target: Array, weights: Weights) -> Reward:
    """Judge saccades.

    A saccade that failed is worse than any that did not: no accuracy, endless duration, an overshoot of ten
    amplitudes.

    Args:
        measures: of the saccades.
        energy: of their commands [deg^2/s], (saccades,).
        target: desired orientations, (saccades, 4).
        weights: of the terms.
    """
    failed = measures.failed
    aligned = (target * measures.at_settling).sum(axis=-1)
    # 1 - aligned^2 without cancellation near the target: aligned = cos(angle / 2).
    chord = np.minimum(
        ((target - measures.at_settling) ** 2).sum(axis=-1), ((target + measures.at_settling) ** 2).sum(axis=-1)
    )
    accuracy = np.where(failed, -1.0, -(chord / 2) * (1 + np.abs(aligned)))
    duration = np.where(failed, -1.0, -(1 - 1 / (1 + DISCOUNT * measures.settling_time_s)))
    overshoot = np.where(failed, -10.0, -measures.overshoot)
    spent = -np.nan_to_num(np.asarray(energy, float), nan=0.0, posinf=0.0)
    total = (
        weights.accuracy * accuracy
        + weights.energy * spent
        + weights.duration * duration
        + weights.overshoot * overshoot
    )
    return Reward(accuracy, spent, duration, overshoot, total)
