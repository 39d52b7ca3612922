"""Muscles of a compiled eye: tendons with a motor each, that turn the eye two by two against each other."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.eyes.model import Tendons, motors
from orient_eye.motor import names
from orient_eye.rotations import about

_TURN_DEG = 0.01


@dataclass(frozen=True)
class Muscles:
    """Tendons of an eye that a motor each winds up, in the motors' order.

    Attributes:
        names: of their motors, (tendons,).
        pairs: antagonists straight ahead, indices among the tendons, (pairs, 2), in their order.
    """

    names: tuple[str, ...]
    pairs: NDArray[np.intp]

    @classmethod
    def of(cls, model: mujoco.MjModel) -> "Muscles | None":
        """Those of a model; None where not every tendon has a motor of its own and an antagonist."""
        wound = Tendons.of(model).motor
        if not model.ntendon or (wound != np.arange(model.ntendon)).any():
            return None
        turn = _turns(model)
        turn = turn / np.linalg.norm(turn, axis=1, keepdims=True)
        other = (turn @ turn.T).argmin(axis=1)
        if (other[other] != np.arange(len(other))).any():
            return None
        pairs = [(i, j) for i, j in enumerate(other.tolist()) if i < j]
        return cls(names(motors(model))[: model.ntendon], np.array(pairs))


def _turns(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Whereto each tendon turns the eye, head frame, (tendons, 3): by how much it is shorter after turns about axes."""
    data = mujoco.MjData(model)
    eye = int(model.joint("eye").qposadr[0])
    lengths = []
    for axis, angle in (("roll", 0.0), *((axis, _TURN_DEG) for axis in ("roll", "pitch", "yaw"))):
        data.qpos[eye : eye + 4] = about(axis, angle)
        mujoco.mj_fwdPosition(model, data)
        lengths.append(data.ten_length.copy())
    return np.asarray((lengths[0] - np.array(lengths[1:])).T)
