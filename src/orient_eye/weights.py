"""Reward weights from the saccade that should be optimal, thesis section 4.4.5.

    weights = solve_weights(SaccadeTask(make_plant("lpf"), variant=2, C="varying"))

Choose the optimal command of one saccade, set lambda_e = 1, and the other three weights solve
grad R = 0 over (B, D, k0) at that command (4.47); gradients by central differences.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.reward import Weights
from orient_eye.saccade import K0_RANGE, SaccadeTask, horizontal

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ChosenSaccade:
    """The saccade that should be optimal; the thesis' choice by default.

    Attributes:
        start_yaw_deg: where it begins.
        target_yaw_deg: where it should end.
        B: [1/s].
        D: [deg]; None for the motor position at which the eye rests on the target: 20.328 deg on the thesis'
            low-pass plant, of which the thesis prints 20.33.
        k0: [1/s]; None for the value below which this saccade overshoots: the thesis' 17.5 on its low-pass
            plant, where it is the cut-off frequency, and found by bisection on another plant.
    """

    start_yaw_deg: float = 0.0
    target_yaw_deg: float = 30.0
    B: float = 35.0
    D: float | None = None
    k0: float | None = None


@dataclass(frozen=True)
class Steps:
    """Half-widths of the central differences.

    The overshoot has a kink exactly at k0 = w0: it is zero above. Its difference quotient is therefore half
    the slope below, at any step, and bends with the step: lambda_o depends on `k0`.
    """

    B: float = 0.05
    """1/s"""
    D: float = 0.01
    """deg"""
    k0: float = 0.05
    """1/s"""


def solve_weights(task: SaccadeTask, chosen: ChosenSaccade | None = None, steps: Steps | None = None) -> Weights:
    """The weights for which the chosen saccade is optimal on this plant, with this pulse and band.

    Args:
        task: plant, pulse, settling band; its own weights do not matter.
        chosen: the saccade.
        steps: of the differences.

    Raises:
        InputError: the equations have no solution with positive weights.
    """
    chosen, steps = chosen or ChosenSaccade(), steps or Steps()
    start, target = task.fixate(horizontal(chosen.start_yaw_deg)), horizontal(chosen.target_yaw_deg)
    D = float(task.lands_on(target)[0, 0]) if chosen.D is None else chosen.D
    k0 = _onset_of_overshoot(task, chosen, D) if chosen.k0 is None else chosen.k0
    at = np.array([chosen.B, D, k0])
    width = np.array([steps.B, steps.D, steps.k0])
    moved = np.concatenate([at + np.diag(width), at - np.diag(width)])
    found = task.perform(start[np.zeros(6, int)], moved[:, None, :], np.repeat(target, 6, axis=0)).reward
    terms = np.stack([found.accuracy, found.energy, found.duration, found.overshoot], axis=1)
    gradient = (terms[:3] - terms[3:]) / (2 * width[:, None])
    try:
        accuracy, duration, overshoot = np.linalg.solve(gradient[:, [0, 2, 3]], -gradient[:, 1])
    except np.linalg.LinAlgError as error:
        raise InputError(
            "a term of the reward does not change around the chosen saccade, so its weight is undetermined; choose "
            "k0 at the plant's cut-off frequency, where the overshoot sets in, or larger steps"
        ) from error
    if min(accuracy, duration, overshoot) < 0:
        raise InputError(
            f"no positive weights make B = {at[0]:g}, D = {at[1]:.4g}, k0 = {at[2]:g} optimal: accuracy "
            f"{accuracy:.3g}, duration {duration:.3g}, overshoot {overshoot:.3g}; choose another saccade"
        )
    return replace(task.weights, accuracy=accuracy, energy=1.0, duration=duration, overshoot=overshoot)


def _onset_of_overshoot(task: SaccadeTask, chosen: ChosenSaccade, D: float) -> float:
    """The largest k0 [1/s] with which the chosen saccade still overshoots."""
    if isinstance(task.plant, LowPassPlant):
        return task.plant.surrogate.w0  # where zero and pole cancel (4.2)
    start, target = task.fixate(horizontal(chosen.start_yaw_deg)), horizontal(chosen.target_yaw_deg)
    low, high = K0_RANGE
    for _ in range(4):  # sixteen at a time: each round narrows the bracket to a fifteenth
        k0 = np.linspace(low, high, 16)
        action = np.stack([np.full(16, chosen.B), np.full(16, D), k0], axis=-1)[:, None]
        over = task.perform(start[np.zeros(16, int)], action, np.repeat(target, 16, axis=0)).measures.overshoot > 0
        if not over[0] or over[-1]:
            raise InputError(
                f"with B = {chosen.B:g} 1/s the overshoot does not set in between k0 = {low:g} and {high:g} 1/s on "
                f"plant {task.plant.name!r}; choose k0 yourself, or another B"
            )
        last = int(np.flatnonzero(over)[-1])
        low, high = k0[last], k0[last + 1]
    return float(low)
