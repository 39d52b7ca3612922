"""Training over what sysid does not know: every saccade on another eye of the identified intervals.

The networks see only starts, targets and rewards, so they learn the action that is best on average over the
intervals. A policy is judged on the nominal plant, and over the interval (`over_the_interval`).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.learning.evaluation import Yardstick
from orient_eye.plants.uncertain import UncertainPlant

Array = NDArray[np.float64]
DRAWS = 32
"""Eyes drawn for each saccade on which a policy is judged over the interval."""
_SEED = 95


def over_the_interval(yardstick: Yardstick, plant: UncertainPlant, action: Array) -> dict[str, float]:
    """What actions do on eyes of the interval, the same eyes for any actions, in plain values.

    Args:
        yardstick: the saccades.
        plant: whose numbers are drawn.
        action: in units, (saccades, numbers).

    Returns:
        End-point error [deg], overshoot [share of the amplitude] and settling time [ms], each mean and worst, and the
        mean reward.
    """
    task, random = replace(yardstick.task, plant=plant), np.random.default_rng(_SEED)
    outcomes = [task.perform(yardstick.start, action, yardstick.target, random) for _ in range(DRAWS)]
    error = np.array([rotations.angle_between(o.measures.final, yardstick.target) for o in outcomes])
    overshoot = np.array([o.measures.overshoot for o in outcomes])
    settling = 1e3 * np.array([o.measures.settling_time_s for o in outcomes])
    told = {"error_deg": error, "overshoot": overshoot, "duration_ms": settling}
    each = {f"{name}_{how}": float(f(values)) for name, values in told.items() for how, f in _HOW.items()}
    return {"reward_mean": float(np.mean([o.reward.total.mean() for o in outcomes])), **each}


_HOW: dict[str, Callable[[Array], Any]] = {"mean": np.nanmean, "worst": np.nanmax}
