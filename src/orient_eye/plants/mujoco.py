"""The whole eye in MuJoCo, batched on the CPU with MuJoCo's own thread pool.

    plant = MujocoPlant()                            # the thesis' integrator, 1 ms
    plant = MujocoPlant(accurate=True)               # five steps of 0.2 ms a sample

The thesis' integrator takes friction explicitly and holds each row of the command for one step. The
accurate setting takes friction implicitly and holds the middle of each short step of the straight line
between rows: against the converged solution that is 20 times nearer (`orient-eye validate`). Results do
not depend on the number of threads.
"""

import ctypes
import os
import threading
import warnings
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.eyes.model import Tendons
from orient_eye.motor import names
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.limits import Limits
from orient_eye.plants.simulated import Run
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.resources import cores
from orient_eye.rig import Rig
from orient_eye.rotations import rotation
from orient_eye.state import State

Array = NDArray[np.float64]
_ACCURATE_SUBSTEPS = 5
_RECORD_BYTES = 8e6  # of one chunk of saccades: stays near the caches, and bounds the memory


class MujocoPlant(ElasticPlant):
    """The elastic eye of `eye_mjcf` as a plant; see `orient_eye.plants.Plant`.

    Safe to share: each call has a batch of MuJoCo's of its own, and a forked child begins with none.

    Args:
        eye: preset, one of `orient_eye.eyes.EYES`, or an MJCF file of the same form.
        accurate: integrate at 0.2 ms, friction implicit, instead of the thesis' explicit 1 ms.
        gravity: add the gravity torque (thesis 3.8), off in the thesis' runs.
        pretension: the motors rest as the eye's keyframe `pretension_N` says; None for its first, or 0 without one.
        rig: whose motors limit those of the same names: a TOML file, a shipped rig, or the limits by motor.
        threads: of the batch; 0 for one a core.

    Raises:
        InputError: unknown eye or rig, or a number of threads that is none.
    """

    name = "mujoco"

    def __init__(
        self,
        eye: str = "thesis",
        *,
        accurate: bool = False,
        gravity: bool = False,
        pretension: float | None = None,
        rig: Rig | Limits | str | Path | None = None,
        threads: int = 0,
    ) -> None:
        self.substeps = _ACCURATE_SUBSTEPS if accurate else 1
        options = {"eye": eye, "accurate": accurate, "gravity": gravity}
        step_s = self.step_s / self.substeps
        super().__init__(options, step_s=step_s, threads=threads, gravity=gravity, pretension=pretension, rig=rig)
        if accurate:
            self.model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
        eye_joint = self.model.joint("eye")
        self._eye_qpos = eye_joint.qposadr[0] + np.arange(4)
        self._eye_qvel = eye_joint.dofadr[0] + np.arange(3)
        actuators = [self.model.actuator(name) for name in names(self.motors)]
        self._motor_ctrl = np.array([each.id for each in actuators])
        # A spindle acts as its control says in the same step, an arm stands there one step later.
        self._arms = np.array([each.trntype[0] == mujoco.mjtTrn.mjTRN_JOINT for each in actuators])
        joints = [self.model.joint(each.trnid[0]) for each in np.array(actuators, dtype=object)[self._arms]]
        self._arm_qpos = np.array([joint.qposadr[0] for joint in joints], dtype=int)
        self._arm_per_degree = np.deg2rad(1) / self.model.actuator_gear[self._motor_ctrl[self._arms], 0]
        self._tendons = Tendons.of(self.model)
        # What is recorded is what the file's sensors measure: MuJoCo's threads then do all the work.
        self._sensed_orientation = self._sensed("orientation")
        self._sensed_velocity = self._sensed("angular_velocity")
        lengths = [self._sensed(f"length_{name}") for name in self.tendons]
        self._sensed_length = np.array([place.start for place in lengths])
        self._pool, self._empty = _Pool(self.model, self.threads or cores()), mujoco.MjData(self.model)
        self._fit_to_limits()

    def _sensed(self, name: str) -> slice:
        """Where a sensor's numbers are in sensordata."""
        sensor = self.model.sensor(name)
        return slice(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))

    def run(self, motor: Array, start: State) -> Run:
        """See `orient_eye.plants.simulated.SimulatedPlant`."""
        saccades, samples = motor.shape[:2]
        orientation, velocity = np.empty((saccades, samples, 4)), np.empty((saccades, samples, 3))
        tension, diverged = np.empty((saccades, samples, len(self.tendons))), np.zeros(saccades, bool)
        for part in self._chunks(saccades, samples):
            with self._pool.batch("run", part.stop - part.start) as batch:
                results = orientation[part], velocity[part], tension[part]
                diverged[part] = self._run(batch, motor[part], start[part], *results)
        return orientation, velocity, tension, diverged

    def _chunks(self, saccades: int, samples: int) -> Iterator[slice]:
        row = 8 * (self.model.nsensordata + self.model.nu)
        size = max(1, int(_RECORD_BYTES / (row * samples * self.substeps)))
        for first in range(0, saccades, size):
            yield slice(first, min(first + size, saccades))

    def _run(
        self, batch: Batch, motor: Array, start: State, orientation: Array, velocity: Array, tension: Array
    ) -> NDArray[np.bool_]:
        """Run one batch into the three arrays; returns which saccades diverged."""
        size, samples = motor.shape[:2]
        # Everything fresh: state, controls, warm start, warnings.
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        batch.warning[:] = 0
        batch.qpos[:, self._eye_qpos] = start.orientation
        batch.qpos[:, self._arm_qpos] = motor[:, 0, self._arms] * self._arm_per_degree
        batch.qvel[:, self._eye_qvel] = rotation(start.orientation).inv().apply(np.deg2rad(start.angular_velocity))

        steps = (samples - 1) * self.substeps
        before_steps = np.empty((size, 0, self.model.nsensordata))
        if steps:
            # Sensors describe the state before a step; the last state is measured afterwards.
            record = batch.rollout(steps, self._control(np.deg2rad(motor)), record=("sensordata",))
            before_steps = record["sensordata"][:, :: self.substeps]
        last = batch.bind("sensordata")
        diverged = (batch.warning > 0).reshape(size, -1).any(axis=1)
        batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL)
        for output, sensed, convert in (
            (orientation, self._sensed_orientation, lambda x: x),
            (velocity, self._sensed_velocity, np.rad2deg),
            (tension, self._sensed_length, lambda x: x),
        ):
            output[:, :-1] = convert(before_steps[..., sensed])
            output[:, -1] = convert(last[:, sensed])
        tension[:] = self._tendons.tension(tension, np.deg2rad(motor))
        return np.asarray(diverged | ~np.isfinite(orientation).all(axis=(1, 2)))

    def _control(self, command: Array) -> Array:
        """Controls [rad] (saccades, steps, nu) that put arms and spindles on the command."""
        saccades, samples = command.shape[:2]
        steps = (samples - 1) * self.substeps
        control = np.zeros((saccades, steps, self.model.nu))
        for ahead in np.unique(self._arms):
            some = self._arms == ahead
            which, told = self._motor_ctrl[some], command[..., some]
            if self.substeps == 1:
                control[..., which] = told[:, 1:] if ahead else told[:, :-1]
            else:  # the middle of this step, or of the one after it
                at = np.minimum((np.arange(steps) + 0.5 + ahead) / self.substeps, samples - 1)
                row = np.minimum(at.astype(int), samples - 2)
                share = (at - row)[:, None]
                control[..., which] = (1 - share) * told[:, row] + share * told[:, row + 1]
        return control

    def twin(self) -> TavaresPlant | None:
        """The compiled reference with the same eye and limits.

        None for an eye whose tendons it does not compute; and where there is no Numba to compile it, with a warning.
        """
        try:
            import_module("numba")
        except ImportError as error:
            warnings.warn(
                f"the best action is searched on MuJoCo itself, many times slower than on plant 'tavares', which Numba "
                f"compiles: it cannot be imported ({error}); pip install numba",
                stacklevel=2,
            )
            return None
        try:
            return TavaresPlant(**self.options, threads=self.threads)
        except InputError:  # tendons on another kind of path: all else this plant has as well
            return None

    def torque(self, orientation: Array, motor: Array) -> Array:
        """See `orient_eye.plants.elastic.ElasticPlant`."""
        passive, actuated = self._still(orientation, motor, "qfrc_passive", "qfrc_actuator")
        return rotation(orientation).apply((passive + actuated)[:, self._eye_qvel])

    def tension(self, orientation: Array, motor: Array) -> Array:
        """See `orient_eye.plants.elastic.ElasticPlant`."""
        (sensed,) = self._still(orientation, motor, "sensordata")
        return self._tendons.tension(sensed[:, self._sensed_length], np.deg2rad(motor))

    def _still(self, orientation: Array, motor: Array, *fields: str) -> list[Array]:
        """Fields (n, size) of MuJoCo's data with the eye and its motors at rest."""
        if not len(orientation):
            return [np.zeros((0, getattr(self._empty, field).size)) for field in fields]
        with self._pool.batch("still", len(orientation)) as batch:  # nothing else ever changes in these
            batch.qpos[:, self._eye_qpos] = orientation
            batch.qpos[:, self._arm_qpos] = motor[:, self._arms] * self._arm_per_degree
            batch.ctrl[:, self._motor_ctrl[~self._arms]] = np.deg2rad(motor[:, ~self._arms])
            bound = [batch.bind(field) for field in fields]
            batch.forward()
            return [np.array(each) for each in bound]


class _Pool:
    """MuJoCo's batches that are not in use: each caller has one of its own, whatever thread or process it is in."""

    def __init__(self, model: mujoco.MjModel, threads: int) -> None:
        self._model, self._threads = model, threads
        self._begin()
        _POOLS.add(self)

    def _begin(self) -> None:
        self._lock = threading.Lock()
        self._idle: dict[str, list[Batch]] = {}

    @contextmanager
    def batch(self, use: str, size: int) -> Iterator[Batch]:
        """A batch of that size, kept for the next call of the same use and size."""
        with self._lock:
            idle = self._idle.setdefault(use, [])
            found = next((i for i, batch in enumerate(idle) if batch.nsim == size), None)
            batch = None if found is None else idle.pop(found)
        if batch is None:
            batch = Batch(self._model, size, self._threads)
        yield batch
        with self._lock:  # one that an error stopped is not used again
            idle.insert(0, batch)
            del idle[_KEPT:]

    def leave(self) -> None:
        """In a forked child: its parent's batches are never used, nor freed, which would wait for their threads."""
        for batch in (each for idle in self._idle.values() for each in idle):
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(batch))
        self._begin()


def _leave_all() -> None:
    for pool in list(_POOLS):
        pool.leave()


_KEPT = 2  # idle batches of a use
_POOLS: "weakref.WeakSet[_Pool]" = weakref.WeakSet()
os.register_at_fork(after_in_child=_leave_all)


def _tell_only_the_console() -> None:
    """Of steps that are unstable; unless told otherwise MuJoCo keeps a log in the working folder as well."""
    config = mujoco.MjLogConfig.get()
    config.logto_file = False
    config.set()


_tell_only_the_console()
