"""The whole eye in MuJoCo, batched on the CPU with MuJoCo's own thread pool.

    plant = MujocoPlant()                            # the thesis' integrator, 1 ms
    plant = MujocoPlant(accurate=True)               # five steps of 0.2 ms a sample

The thesis' integrator takes friction explicitly and holds each row of the command for one step. The
accurate setting takes friction implicitly and holds the middle of each short step of the straight line
between rows: against the converged solution that is 20 times nearer (`orient-eye validate`). Results do
not depend on the number of threads.
"""

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from orient_eye import eyes
from orient_eye.movement.trajectory import EyeState, Trajectory
from orient_eye.plants import ELASTIC_ACTION_RANGE_DEG, check_command, check_start, equilibrium
from orient_eye.rotations import rotation

Array = NDArray[np.float64]
_ACCURATE_SUBSTEPS = 5
_RECORD_BYTES = 8e6  # of one chunk of saccades: stays near the caches, and bounds the memory


class MujocoPlant:
    """The elastic eye of `eye_mjcf/eye3.xml` as a plant; see `orient_eye.plants.Plant`.

    Args:
        eye: preset, one of `orient_eye.eyes.EYES`.
        accurate: integrate at 0.2 ms, friction implicit, instead of the thesis' explicit 1 ms.
        gravity: add the gravity torque (thesis 3.8), off in the thesis' runs.
        threads: of the batch; 0 for one a core.
    """

    name = "mujoco"
    step_s = 0.001

    def __init__(self, eye: str = "thesis", *, accurate: bool = False, gravity: bool = False, threads: int = 0) -> None:
        self.options = {"eye": eye, "accurate": accurate, "gravity": gravity}
        self.threads = threads
        self.substeps = _ACCURATE_SUBSTEPS if accurate else 1
        self.model = eyes.build_model(eye, step_s=self.step_s / self.substeps, gravity=gravity, visual=False)
        self.motors = eyes.motor_names(self.model)
        self.motor_range_deg = eyes.motor_range_deg(self.model)
        self.action_range_deg = np.clip(self.motor_range_deg, -ELASTIC_ACTION_RANGE_DEG, ELASTIC_ACTION_RANGE_DEG)
        self.tendons = tuple(self.model.tendon(i).name for i in range(self.model.ntendon))
        if accurate:
            self.model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        self._model_hash = eyes.model_hash(self.model)
        eye_joint = self.model.joint("eye")
        self._eye_qpos = eye_joint.qposadr[0] + np.arange(4)
        self._eye_qvel = eye_joint.dofadr[0] + np.arange(3)
        hinges = [self.model.joint(self.model.actuator(name).trnid[0]) for name in self.motors]
        self._motor_qpos = np.array([hinge.qposadr[0] for hinge in hinges])
        self._motor_ctrl = np.array([self.model.actuator(name).id for name in self.motors])
        # What is recorded is what the file's sensors measure: MuJoCo's threads then do all the work.
        self._sensed_orientation = self._sensed("orientation")
        self._sensed_velocity = self._sensed("angular_velocity")
        lengths = [self._sensed(f"length_{name}") for name in self.tendons]
        self._sensed_length = np.array([place.start for place in lengths])
        self._batches: dict[str, Batch] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.options, "threads": self.threads}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]  # models and batches are rebuilt in the process

    def identity(self) -> dict[str, Any]:
        """Name, options and hash of the compiled model."""
        return {"plant": self.name, **self.options, "model": self._model_hash}

    def _sensed(self, name: str) -> slice:
        """Where a sensor's numbers are in sensordata."""
        sensor = self.model.sensor(name)
        return slice(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))

    def simulate(self, command: Array, start: EyeState | None = None) -> Trajectory:
        """Run a batch of saccades; see `orient_eye.plants.Plant.simulate`."""
        command = check_command(self, command)
        finite = np.asarray(np.isfinite(command).all(axis=(1, 2)))
        motor = np.where(finite[:, None, None], command, 0.0)
        if start is None:
            start = EyeState(self.rest_orientation(motor[:, 0]))
        orientation, velocity = check_start(start, len(command))
        finite &= np.isfinite(orientation).all(axis=1) & np.isfinite(velocity).all(axis=1)
        orientation[~finite], velocity[~finite] = [1, 0, 0, 0], 0

        saccades, samples = command.shape[:2]
        result = Trajectory(
            time=np.arange(samples) * np.float64(self.step_s),
            orientation=np.empty((saccades, samples, 4)),
            angular_velocity=np.empty((saccades, samples, 3)),
            motor=motor,
            tension=np.empty((saccades, samples, len(self.tendons))),
            failed=~finite,
            motor_names=self.motors,
            tendon_names=self.tendons,
        )
        for part in self._chunks(saccades, samples):
            self._run(part, motor, orientation, velocity, result)
        for array in (result.orientation, result.angular_velocity, result.motor, result.tension):
            assert array is not None
            array[result.failed] = np.nan
        return result

    def _chunks(self, saccades: int, samples: int) -> Iterator[slice]:
        row = 8 * (self.model.nsensordata + self.model.nu)
        size = max(1, int(_RECORD_BYTES / (row * samples * self.substeps)))
        for first in range(0, saccades, size):
            yield slice(first, min(first + size, saccades))

    def _batch(self, use: str, size: int) -> Batch:
        """A batch of that size, kept for the next call of the same use."""
        batch = self._batches.get(use)
        if batch is None or batch.nsim != size:
            batch = self._batches[use] = Batch(self.model, size, self.threads)
        return batch

    def _run(self, part: slice, motor: Array, orientation: Array, velocity: Array, result: Trajectory) -> None:
        command = np.deg2rad(motor[part])
        size, samples = command.shape[:2]
        batch = self._batch("simulate", size)
        # Everything fresh: state, controls, warm start, warnings.
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        batch.warning[:] = 0
        batch.qpos[:, self._eye_qpos] = orientation[part]
        batch.qpos[:, self._motor_qpos] = command[:, 0]
        eye_frame = rotation(orientation[part]).inv().apply(np.deg2rad(velocity[part]))
        batch.qvel[:, self._eye_qvel] = eye_frame

        steps = (samples - 1) * self.substeps
        before_steps = np.empty((size, 0, self.model.nsensordata))
        if steps:
            # An arm stands where ctrl says one step later, so each step is sent the next instant. Sensors
            # describe the state before a step; the last state is measured afterwards.
            record = batch.rollout(steps, self._control(command), record=("sensordata",))
            before_steps = record["sensordata"][:, :: self.substeps]
        last = batch.bind("sensordata")
        diverged = (batch.warning > 0).reshape(size, -1).any(axis=1)
        batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL)
        assert result.tension is not None
        for output, sensed, convert in (
            (result.orientation, self._sensed_orientation, lambda x: x),
            (result.angular_velocity, self._sensed_velocity, np.rad2deg),
            (result.tension, self._sensed_length, self._tension),
        ):
            output[part, :-1] = convert(before_steps[..., sensed])
            output[part, -1] = convert(last[:, sensed])
        result.failed[part] |= diverged | ~np.isfinite(result.orientation[part]).all(axis=(1, 2))

    def _tension(self, length: Array) -> Array:
        return eyes.tendon_tension(self.model, length)

    def _control(self, command: Array) -> Array:
        """Controls [rad] (saccades, steps, nu) that put the arms on the command."""
        saccades, samples = command.shape[:2]
        steps = (samples - 1) * self.substeps
        control = np.zeros((saccades, steps, self.model.nu))
        if self.substeps == 1:
            control[..., self._motor_ctrl] = command[:, 1:]
        else:  # the middle of the step after this one
            at = np.minimum((np.arange(steps) + 1.5) / self.substeps, samples - 1)
            row = np.minimum(at.astype(int), samples - 2)
            share = (at - row)[:, None]
            control[..., self._motor_ctrl] = (1 - share) * command[:, row] + share * command[:, row + 1]
        return control

    def _torque(self, orientation: Array, motor: Array) -> Array:
        batch = self._batch("torque", len(orientation))  # nothing but qpos ever changes in this one
        batch.qpos[:, self._eye_qpos] = orientation
        batch.qpos[:, self._motor_qpos] = np.deg2rad(motor)
        passive, actuated = batch.bind("qfrc_passive"), batch.bind("qfrc_actuator")
        batch.forward()
        in_eye_frame = (passive + actuated)[:, self._eye_qvel]
        return rotation(orientation).apply(in_eye_frame)

    def rest_orientation(self, motor: Array) -> Array:
        """Orientations in which the eye rests; see `orient_eye.plants.Plant`."""
        return equilibrium.rest_orientation(self._torque, motor)

    def rest_motor(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """Motor positions that hold these orientations; see `orient_eye.plants.Plant`."""
        index = [self.motors.index(name) for name in driven]
        return equilibrium.rest_motor(self._torque, orientation, len(self.motors), index, self.motor_range_deg)
