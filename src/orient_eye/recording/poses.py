"""Where an eye's bodies and tendons stand during saccades, from the compiled model.

poses = pose(model, trajectory)                  # every saccade, every sample, at once
"""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.eyes.model import Tendons, motors
from orient_eye.motor import names, rests
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Poses:
    """Where everything stands; meaningless in saccades that failed.

    Attributes:
        position: of each body, head coordinates [m], (saccades, time, bodies, 3).
        orientation: of each body, unit quaternion w, x, y, z, (saccades, time, bodies, 4).
        tension: of the model's tendons [N], (saccades, time, tendons).
        path: points of all tendons, head coordinates [m], (saccades, time, points, 3).
        path_object: what each point lies on, -2 where a pulley splits the tendon, (saccades, time, points).
        path_start: first point of each tendon, (saccades, time, tendons).
        path_count: number of points of each tendon, (saccades, time, tendons).
    """

    position: Array
    orientation: Array
    tension: Array
    path: Array
    path_object: NDArray[np.int32]
    path_start: NDArray[np.int32]
    path_count: NDArray[np.int32]

    def strips(self, saccade: int, rows: slice) -> tuple[list[Array], NDArray[np.intp], NDArray[np.intp]]:
        """The tendons of a saccade as line strips, sample after sample of these rows.

        Returns:
            The strips, each (points, 3) [m]; the tendon each belongs to, (strips,); how many strips
            each sample has, (rows,).
        """
        strips: list[Array] = []
        tendons: list[int] = []
        counts: list[int] = []
        path, pulley = self.path[saccade, rows], self.path_object[saccade, rows] == -2
        start, count = self.path_start[saccade, rows].tolist(), self.path_count[saccade, rows].tolist()
        for row in range(len(path)):
            before = len(strips)
            for tendon, (first, length) in enumerate(zip(start[row], count[row], strict=True)):
                parts = [path[row, first : first + length]]
                cuts = pulley[row, first : first + length].nonzero()[0]
                if cuts.size:
                    ends = np.unique(np.concatenate([cuts, cuts + 1]))
                    parts = [part for part in np.split(parts[0], ends) if len(part) > 1]
                strips += parts
                tendons += [tendon] * len(parts)
            counts.append(len(strips) - before)
        return strips, np.array(tendons, np.intp), np.array(counts, np.intp)

    def middle(self, saccade: int) -> Array:
        """Middle of the last piece of each tendon of a saccade [m], (time, tendons, 3)."""
        last = (self.path_start + self.path_count)[saccade, ..., None] - 1
        one, other = (np.take_along_axis(self.path[saccade], point, axis=1) for point in (last, last - 1))
        return np.asarray((one + other) / 2)


def pose(model: mujoco.MjModel, trajectory: Trajectory) -> Poses:
    """Poses of all bodies and tendons; motors that the trajectory does not have, or not know (NaN), stand at rest.

    A model without motors shows only how the eye turns.

    The tension is the trajectory's own where it names the model's tendons, else that of the elastics
    at their length in this pose.

    Raises:
        InputError: the model has no ball joint "eye", or it has motors and lacks one of the trajectory's.
    """
    own = names(motors(model))
    unknown = [name for name in trajectory.motor_names if name not in own]
    if own and unknown:
        raise InputError(
            f"the trajectory moves {', '.join(unknown)}, the model to draw has the motors {', '.join(own)}: pass the "
            "eye of the trajectory's plant, plant.drawn()"
        )
    joints = [model.joint(i).name for i in range(model.njnt)]
    if "eye" not in joints:
        raise InputError(f'the model to draw needs a ball joint "eye", it has {", ".join(joints)}')
    batch = Batch(model, trajectory.orientation[..., 0].size)
    fields = ("xpos", "xquat", "ten_length", "wrap_xpos", "wrap_obj", "ten_wrapadr", "ten_wrapnum")
    bound = {name: batch.bind(name) for name in fields}
    batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
    ok = ~np.repeat(trajectory.failed, trajectory.time.size)
    eye = int(model.joint("eye").qposadr[0]) + np.arange(4)
    batch.qpos[np.ix_(ok, eye)] = trajectory.orientation.reshape(-1, 4)[ok]
    rest = np.deg2rad(rests(motors(model)))
    control = np.tile(rest, (*trajectory.orientation.shape[:2], 1))
    for i, name in enumerate(trajectory.motor_names):
        if name in own:
            actuator, known = model.actuator(name), trajectory.motor[..., i]
            angle = np.where(np.isfinite(known), np.deg2rad(known), rest[own.index(name)])
            control[..., own.index(name)] = angle
            if actuator.trntype[0] == mujoco.mjtTrn.mjTRN_JOINT:
                joint = model.joint(actuator.trnid[0])
                batch.qpos[ok, joint.qposadr[0]] = (angle / float(actuator.gear[0])).ravel()[ok]
    batch.forward(stage=mujoco.mjtStage.mjSTAGE_POS)

    def shaped(name: str, *shape: int) -> Any:
        return bound[name].reshape(*trajectory.orientation.shape[:2], *shape)

    tension = Tendons.of(model).tension(shaped("ten_length", model.ntendon), control)
    if trajectory.tension is not None and set(tendon_names(model)) <= set(trajectory.tendon_names):
        tension = trajectory.tension[..., [trajectory.tendon_names.index(name) for name in tendon_names(model)]]
    return Poses(
        position=shaped("xpos", model.nbody, 3),
        orientation=shaped("xquat", model.nbody, 4),
        tension=tension,
        path=shaped("wrap_xpos", 2 * model.nwrap, 3),
        path_object=shaped("wrap_obj", 2 * model.nwrap),
        path_start=shaped("ten_wrapadr", model.ntendon),
        path_count=shaped("ten_wrapnum", model.ntendon),
    )


def tendon_names(model: mujoco.MjModel) -> tuple[str, ...]:
    """Names of the tendons, (tendons,)."""
    return tuple(model.tendon(i).name or f"tendon{i}" for i in range(model.ntendon))
