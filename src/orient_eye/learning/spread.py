"""How sure a number is that a few seeds give: interquartile mean and bootstrap interval (Agarwal et al. 2021).

    spread([np.array([0.0030, 0.0031, 0.0040])])     # Spread(mean=0.00337, low=0.0030, high=0.0040)

The interquartile mean leaves a quarter of the runs out at either end, so that one run that fails does not decide it; of
fewer than four runs it is the mean. The interval comes from drawing the runs of every setting again, with replacement
and apart from other settings' (stratified), as rliable does it: R. Agarwal et al., Deep reinforcement learning at the
edge of the statistical precipice, NeurIPS 2021. Of few runs it is too short: of three it cannot reach beyond them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]
_CUT = 0.25
_DRAWS, _LEVEL, _SEED = 2000, 0.95, 2021


@dataclass(frozen=True)
class Spread:
    """An interquartile mean and its 95 % interval; each a number, or (points,) along a curve.

    Attributes:
        mean: of all runs.
        low: of the interval; NaN where no setting has two runs.
        high: of the interval.
    """

    mean: Any
    low: Any
    high: Any


def spread(settings: Sequence[Array]) -> Spread:
    """Of runs, by setting.

    Args:
        settings: of each its runs' results (runs,), or curves (runs, points) of as many points everywhere.
    """
    mean = stats.trim_mean(np.concatenate(settings), _CUT, axis=0)
    if all(len(runs) < 2 for runs in settings):
        nothing = np.full_like(mean, np.nan)
        return Spread(mean, nothing, nothing)
    random = np.random.default_rng(_SEED)
    drawn = [runs[random.integers(len(runs), size=(_DRAWS, len(runs)))] for runs in settings]
    means = stats.trim_mean(np.concatenate(drawn, axis=1), _CUT, axis=1)
    low, high = np.quantile(means, [(1 - _LEVEL) / 2, (1 + _LEVEL) / 2], axis=0)
    return Spread(mean, low, high)
