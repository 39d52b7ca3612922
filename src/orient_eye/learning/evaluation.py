"""A policy held against the best action any search finds: the reward gap.

The gap of a saccade is (R* - R) / |R*|, with R* the reward of the searched optimum.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.search.optimum import Optimum
from orient_eye.search.optimum_cache import searched_optimum
from orient_eye.task.saccade import Fixation, Outcome, SaccadeTask, horizontal

Array = NDArray[np.float64]
Act = Callable[[Array, Array], Array]
"""From starts and targets (saccades, 4) to actions (saccades, driven, 3)."""
TABLE_AMPLITUDES_DEG = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0)
"""Amplitudes of the table at the end of a run; symmetric saccades."""
_SEED = 2021


@dataclass(frozen=True)
class Yardstick:
    """Saccades whose optimum is known.

    Attributes:
        task: plant, command and reward.
        start_yaw_deg: (saccades,).
        target_yaw_deg: (saccades,).
        start: the same as fixations.
        target: the same as orientations.
        optimum: best actions and rewards found.
    """

    task: SaccadeTask
    start_yaw_deg: Array
    target_yaw_deg: Array
    start: Fixation
    target: Array
    optimum: Optimum

    @classmethod
    def search(
        cls,
        task: SaccadeTask,
        start_yaw_deg: Array,
        target_yaw_deg: Array,
        progress: Callable[[float], None] | None = None,
    ) -> "Yardstick":
        """Search the optimum of saccades between these gaze directions [deg], each (saccades,), or remember it."""
        optimum = searched_optimum(task, start_yaw_deg, target_yaw_deg, progress=progress)
        start = task.fixate(horizontal(start_yaw_deg))
        return cls(task, start_yaw_deg, target_yaw_deg, start, horizontal(target_yaw_deg), optimum)

    def __getitem__(self, which: slice) -> "Yardstick":
        index = np.arange(len(self.target))[which]
        optimum = Optimum(self.optimum.action[which], self.optimum.reward[which], self.optimum.evaluations)
        yaw = self.start_yaw_deg[which], self.target_yaw_deg[which]
        return Yardstick(self.task, *yaw, self.start[index], self.target[which], optimum)

    def perform(self, act: Act) -> tuple[Array, Outcome, Array]:
        """The policy's actions (saccades, driven, 3), what came of them, and the gaps (saccades,)."""
        action = act(self.start.orientation, self.target)
        outcome = self.task.perform(self.start, action, self.target)
        gap = (self.optimum.reward - outcome.reward.total) / np.abs(self.optimum.reward)
        return action, outcome, gap

    def to_plain(self) -> dict[str, Any]:
        """Plain values, for a run's directory."""
        return {
            "start_yaw_deg": self.start_yaw_deg.tolist(),
            "target_yaw_deg": self.target_yaw_deg.tolist(),
            "action": self.optimum.action.tolist(),
            "reward": self.optimum.reward.tolist(),
            "evaluations": self.optimum.evaluations,
        }


def evaluation_saccades(
    task: SaccadeTask, count: int, progress: Callable[[float], None] | None = None
) -> tuple[Yardstick, Yardstick]:
    """Random saccades over the whole range, and symmetric ones of the table's amplitudes.

    They depend on nothing but their number, so that runs can be compared and their optimum is searched once.
    """
    start, target = task.draw_yaw(count, np.random.default_rng(_SEED))
    half = np.array(TABLE_AMPLITUDES_DEG) / 2
    both = Yardstick.search(task, np.concatenate([start, -half]), np.concatenate([target, half]), progress)
    return both[:count], both[count:]


def gap_summary(yardstick: Yardstick, action: Array, outcome: Outcome, gap: Array) -> dict[str, Any]:
    """How far a policy's saccades are from the optimum, in plain values.

    Args:
        yardstick: the saccades.
        action: what the policy chose, as `Yardstick.perform` returns it.
        outcome: what came of it.
        gap: the gaps.
    """
    large = np.abs(yardstick.target_yaw_deg - yardstick.start_yaw_deg) > 5
    off = np.abs(action - yardstick.optimum.action)[large]
    return {
        "pairs": len(gap),
        "gap_mean": float(gap.mean()),
        "gap_p95": float(np.quantile(gap, 0.95)),
        "gap_max": float(gap.max()),
        "reward_mean": float(outcome.reward.total.mean()),
        "distance_from_optimum_above_5_deg": dict(
            zip(["B", "D", "k0"], off.mean(axis=(0, 1)).tolist() if large.any() else [None] * 3, strict=True)
        ),
    }


def amplitude_table(yardstick: Yardstick, act: Act) -> list[dict[str, float]]:
    """One row a saccade: the learned action, the best one found, rewards, gap, and the measures."""
    action, outcome, gap = yardstick.perform(act)
    best, F = yardstick.optimum.action, yardstick.start.motor[:, yardstick.task.driven_index]
    measures = outcome.measures
    return [
        {
            "amplitude_deg": float(yardstick.target_yaw_deg[i] - yardstick.start_yaw_deg[i]),
            "B": float(action[i, 0, 0]),
            "B_best": float(best[i, 0, 0]),
            "step_deg": float(action[i, 0, 1] - F[i, 0]),
            "step_deg_best": float(best[i, 0, 1] - F[i, 0]),
            "k0": float(action[i, 0, 2]),
            "k0_best": float(best[i, 0, 2]),
            "reward": float(outcome.reward.total[i]),
            "reward_best": float(yardstick.optimum.reward[i]),
            "gap": float(gap[i]),
            "duration_ms": float(1e3 * measures.settling_time_s[i]),
            "peak_velocity_deg_s": float(measures.peak_velocity_deg_s[i]),
            "skewness": float(measures.skewness[i]),
            "overshoot": float(measures.overshoot[i]),
        }
        for i in range(len(gap))
    ]
