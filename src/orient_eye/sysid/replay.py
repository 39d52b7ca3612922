"""Recorded step responses as a trajectory, so that they can be looked at like a plant's."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Slerp

from orient_eye.motor import Motor
from orient_eye.movement.trajectory import Trajectory
from orient_eye.rotations import rotation
from orient_eye.sysid.step_response import StepResponse

Array = NDArray[np.float64]
_STEP_S = 0.005


def replay(steps: Sequence[StepResponse]) -> Trajectory:
    """Recordings that have orientations, on one clock from 0, as a batch.

    Between rows the eye turns evenly; after its last row a recording stands still. Angular velocity is
    the difference quotient of that. Motors are those that any of the recordings names, NaN where one does not; what
    they were told is not known and taken to be what they did.
    """
    duration = max(float(s.time[-1] - s.time[0]) for s in steps)
    time: Array = _STEP_S * np.arange(round(duration / _STEP_S) + 1, dtype=float)
    motors = tuple(Motor(name) for name in sorted({name for s in steps for name in s.motors}))
    orientation = np.empty((len(steps), time.size, 4))
    velocity = np.zeros((len(steps), time.size, 3))
    motor = np.full((len(steps), time.size, len(motors)), np.nan)
    for i, step in enumerate(steps):
        own = np.clip(time + step.time[0], step.time[0], step.time[-1])
        assert step.orientation is not None
        turning = Slerp(step.time, rotation(step.orientation))(own)
        orientation[i] = turning.as_quat(scalar_first=True)
        velocity[i, 1:] = (turning[1:] * turning[:-1].inv()).as_rotvec(degrees=True) / _STEP_S
        for j, each in enumerate(motors):
            if each.name in step.motors:
                motor[i, :, j] = np.interp(own, step.time, step.motors[each.name])
    return Trajectory(time, orientation, velocity, motor, motor, None, np.zeros(len(steps), bool), motors)
