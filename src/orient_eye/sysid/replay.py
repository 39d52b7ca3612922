"""Recorded step responses as a trajectory, so that they can be looked at like a plant's."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from orient_eye.motor import Motor
from orient_eye.movement.trajectory import Trajectory
from orient_eye.rotations import rotation
from orient_eye.sysid.step_response import StepResponse

Array = NDArray[np.float64]
_STEP_S = 0.005


def replay(steps: Sequence[StepResponse], answer: Callable[[StepResponse], Array] | None = None) -> Trajectory:
    """Recordings on one clock from 0, as a batch.

    An eye is where its orientation was recorded, else turned by its angle about its axis. Between rows it turns
    evenly; after its last row a recording stands still. Angular velocity is the difference quotient of that. Motors
    are those that any of the recordings names, NaN where one does not; what they were told is not known and taken to
    be what they did.

    Args:
        steps: the recordings.
        answer: the angles [deg] (samples,) that a model answers to a step; the eyes then turn by these instead, from
            where the recorded ones rest.
    """
    duration = max(float(s.time[-1] - s.time[0]) for s in steps)
    time: Array = _STEP_S * np.arange(round(duration / _STEP_S) + 1, dtype=float)
    motors = tuple(Motor(name) for name in sorted({name for s in steps for name in s.motors}))
    orientation = np.empty((len(steps), time.size, 4))
    velocity = np.zeros((len(steps), time.size, 3))
    motor = np.full((len(steps), time.size, len(motors)), np.nan)
    for i, step in enumerate(steps):
        own = np.clip(time + step.time[0], step.time[0], step.time[-1])
        turning = Slerp(step.time, _orientations(step, answer))(own)
        orientation[i] = turning.as_quat(scalar_first=True)
        velocity[i, 1:] = (turning[1:] * turning[:-1].inv()).as_rotvec(degrees=True) / _STEP_S
        for j, each in enumerate(motors):
            if each.name in step.motors:
                motor[i, :, j] = np.interp(own, step.time, step.motors[each.name])
    return Trajectory(time, orientation, velocity, motor, motor, None, np.zeros(len(steps), bool), motors)


def _orientations(step: StepResponse, answer: Callable[[StepResponse], Array] | None) -> Rotation:
    if step.orientation is not None and answer is None:
        return rotation(step.orientation)
    angle = step.eye_deg if answer is None else answer(step)
    turned = Rotation.from_rotvec(angle[:, None] * step.axis_vector, degrees=True)
    if step.orientation is None:
        return turned
    resting = rotation(step.orientation[int(np.abs(step.eye_deg[: max(len(angle) // 10, 1)]).argmin())])
    return turned * resting
