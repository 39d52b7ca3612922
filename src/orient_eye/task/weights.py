"""Reward weights from the saccade that should be optimal, thesis section 4.4.5.

    weights = solve_weights(SaccadeTask.of_case(make_plant("lpf"), "2-varying"))

Choose the optimal command of one saccade, set lambda_e = 1, and the other three weights solve
grad R = 0 over (B, D, k0) at that command (4.47); gradients by central differences. Tables and what
they depend on: docs/weights.md.
"""

from dataclasses import astuple, dataclass, replace

import numpy as np

from orient_eye.errors import InputError
from orient_eye.plants import Plant
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.surrogate import Surrogate
from orient_eye.task.reward import Weights
from orient_eye.task.saccade import K0_RANGE, SaccadeTask, horizontal

_THESIS_D = 20.33  # deg; 30 deg / K = 20.328 on the thesis' surrogate, which the thesis takes as 20.33


@dataclass(frozen=True)
class ChosenSaccade:
    """The saccade that should be optimal; the thesis' choice by default.

    Attributes:
        start_yaw_deg: where it begins.
        target_yaw_deg: where it should end.
        B: [1/s].
        D: [deg]; None for the motor position at which the eye rests on the target, which for the thesis' saccade
            on its own low-pass plant is 20.33 deg as printed.
        k0: [1/s]; None for the value below which this saccade overshoots: the cut-off frequency on a low-pass
            plant (the thesis' 17.5), and found by bisection on another plant.
    """

    start_yaw_deg: float = 0.0
    target_yaw_deg: float = 30.0
    B: float = 35.0
    D: float | None = None
    k0: float | None = None


@dataclass(frozen=True)
class Steps:
    """Half-widths of the central differences.

    Those of B and D hardly matter: on the low-pass plant the weights keep three digits from a tenth of these
    steps to five times as much; on a plant sampled every 1 ms much smaller ones see the samples.

    That of k0 is a choice. Below the cut-off frequency the overshoot grows like (w0 - k0)^(B / (B - w0)), the
    square at B = 2 w0, and above it is zero: its slope at k0 = w0 is 0. What the central difference finds is
    proportional to its step, so lambda_o falls about as 1 / step, and the saccade that is truly optimal
    with the solved weights has its k0 a quarter to a third of a step below the chosen one.
    """

    B: float = 0.2
    """1/s"""
    D: float = 0.02
    """deg"""
    k0: float = 0.05
    """1/s"""

    def __post_init__(self) -> None:
        if not all(np.isfinite(step) and step > 0 for step in astuple(self)):
            raise InputError(f"steps of the differences must be positive, got B {self.B}, D {self.D}, k0 {self.k0}")


def solve_weights(task: SaccadeTask, chosen: ChosenSaccade | None = None, steps: Steps | None = None) -> Weights:
    """The weights for which the chosen saccade is optimal on this plant, with this pulse and band.

    Args:
        task: plant, pulse, settling band; its own weights do not matter.
        chosen: the saccade.
        steps: of the differences.

    Raises:
        InputError: no such saccade on this plant, or the equations have no solution with positive weights.
    """
    chosen, steps = resolve(task, chosen or ChosenSaccade()), steps or Steps()
    start, target = task.fixate(horizontal(chosen.start_yaw_deg)), horizontal(chosen.target_yaw_deg)
    at = np.array([chosen.B, chosen.D, chosen.k0], float)
    width = np.array(astuple(steps))
    moved = np.concatenate([at + np.diag(width), at - np.diag(width)])
    found = task.perform(start[np.zeros(6, int)], moved[:, None, :], np.repeat(target, 6, axis=0))
    if not found.measures.settled.all():
        raise InputError(
            f"with B = {at[0]:g}, D = {at[1]:.4g}, k0 = {at[2]:g} the eye does not settle within {task.horizon_s:g} s "
            f"on plant {task.plant.name!r}; choose another saccade or a wider band"
        )
    reward = found.reward
    terms = np.stack([reward.accuracy, reward.energy, reward.duration, reward.overshoot], axis=1)
    gradient = (terms[:3] - terms[3:]) / (2 * width[:, None])
    try:
        solution = np.linalg.solve(gradient[:, [0, 2, 3]], -gradient[:, 1])
    except np.linalg.LinAlgError as error:
        raise InputError(
            "a term of the reward does not change around the chosen saccade, so its weight is undetermined; choose "
            "k0 at the plant's cut-off frequency, where the overshoot sets in, or larger steps"
        ) from error
    accuracy, duration, overshoot = (float(x) for x in solution)
    if min(accuracy, duration, overshoot) < 0:
        raise InputError(
            f"no positive weights make B = {at[0]:g}, D = {at[1]:.4g}, k0 = {at[2]:g} optimal: accuracy "
            f"{accuracy:.3g}, duration {duration:.3g}, overshoot {overshoot:.3g}; choose another saccade"
        )
    return replace(task.weights, accuracy=accuracy, energy=1.0, duration=duration, overshoot=overshoot)


def resolve(task: SaccadeTask, chosen: ChosenSaccade) -> ChosenSaccade:
    """The chosen saccade with D and k0 as they are on this task's plant.

    Raises:
        InputError: no saccade at all, an orientation the eye cannot hold, or no onset of overshoot.
    """
    if not np.isfinite([x for x in astuple(chosen) if x is not None]).all():
        raise InputError(f"the chosen saccade must be finite numbers, got {chosen}")
    if max(abs(chosen.start_yaw_deg), abs(chosen.target_yaw_deg)) >= 180:
        raise InputError(
            f"yaw lies between -180 and 180 deg, got {chosen.start_yaw_deg:g} and {chosen.target_yaw_deg:g}"
        )
    if chosen.start_yaw_deg == chosen.target_yaw_deg:
        raise InputError(f"the chosen saccade begins and ends at {chosen.start_yaw_deg:g} deg; choose another target")
    D = chosen.D
    if D is None:
        as_in_the_thesis = (chosen.start_yaw_deg, chosen.target_yaw_deg) == (0, 30) and _is_thesis_surrogate(task.plant)
        D = _THESIS_D if as_in_the_thesis else float(task.lands_on(horizontal(chosen.target_yaw_deg))[0, 0])
    return replace(chosen, D=D, k0=_onset_of_overshoot(task, chosen, D) if chosen.k0 is None else chosen.k0)


def _is_thesis_surrogate(plant: Plant) -> bool:
    thesis = Surrogate.load("thesis")
    return isinstance(plant, LowPassPlant) and (plant.surrogate.K, plant.surrogate.w0) == (thesis.K, thesis.w0)


def _onset_of_overshoot(task: SaccadeTask, chosen: ChosenSaccade, D: float) -> float:
    """The largest k0 [1/s] with which the chosen saccade still overshoots."""
    if isinstance(task.plant, LowPassPlant):
        return task.plant.surrogate.w0  # where zero and pole cancel (4.2)
    start, target = task.fixate(horizontal(chosen.start_yaw_deg)), horizontal(chosen.target_yaw_deg)
    low, high = K0_RANGE
    for _ in range(4):  # sixteen at a time: each round narrows the bracket to a fifteenth
        k0 = np.linspace(low, high, 16)
        action = np.stack(np.broadcast_arrays(chosen.B, D, k0), axis=-1)[:, None]
        over = task.perform(start[np.zeros(16, int)], action, np.repeat(target, 16, axis=0)).measures.overshoot > 0
        if not over[0] or over[-1]:
            raise InputError(
                f"with B = {chosen.B:g} 1/s the overshoot does not set in between k0 = {low:g} and {high:g} 1/s on "
                f"plant {task.plant.name!r}; choose k0 yourself, or another B"
            )
        last = int(np.flatnonzero(over)[-1])
        low, high = k0[last], k0[last + 1]
    return float(low)
