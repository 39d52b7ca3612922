"""How antagonists work together over saccades."""

import numpy as np
from numpy.typing import NDArray

from orient_eye.movement.measures import Measures
from orient_eye.movement.trajectory import Trajectory


def antagonist_correlation(trajectory: Trajectory, measures: Measures, pairs: NDArray[np.intp]) -> list[float]:
    """How changes of antagonists' motors from the start correlate, over all samples up to the settling times, (pairs,).

    -1 where one gives what the other takes, 1 where they wind up together; NaN where one never moves.

    Args:
        trajectory: of the saccades.
        measures: of their gaze.
        pairs: of antagonists, indices among the motors, (pairs, 2).
    """
    inside = (trajectory.time <= measures.settling_time_s[:, None]) & ~trajectory.failed[:, None]
    change = (trajectory.motor - trajectory.motor[:, :1])[inside]
    with np.errstate(invalid="ignore"):
        return [float(np.asarray(np.corrcoef(change[:, pair].T))[0, 1]) for pair in pairs]
