"""The thesis' simulator (its Algorithm 2) as a compiled kernel: a witness of the MuJoCo eye, and a fast one.

    plant = TavaresPlant()                           # the thesis' integrator, 1 ms
    plant = TavaresPlant(accurate=True)              # Runge-Kutta's method

It shares only the numbers of the MJCF with the MuJoCo plant: torque, integration and frames are
written from the thesis' equations 3.1 to 3.12 (`orient_eye.plants.elastic_kernel`; `tests/numpy_reference.py` has them
in plain NumPy). The author's own program differs from a rigid body with viscous friction in four small ways, which the
option `as_published` brings back: with them its runs come out to 0.0004 deg (`orient-eye validate`). Results do not
depend on the number of threads. A plant may be used from several Python threads at once, and in a forked child.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.eyes.elastics import Elastics
from orient_eye.eyes.model import STANDARD_GRAVITY
from orient_eye.motor import names
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.limits import Limits
from orient_eye.plants.simulated import Run
from orient_eye.rig import Rig
from orient_eye.rotations import rotation
from orient_eye.state import State

Array = NDArray[np.float64]
_DECAY = 0.6  # of friction in an accurate step, at most
_WORTH_A_THREAD = 2000  # steps: 0.3 ms, a few times what starting it takes
_SLICES = 4  # a thread: they end together on a busy machine too


class TavaresPlant(ElasticPlant):
    """The reference simulator as a plant; see `orient_eye.plants.Plant`.

    Args:
        eye: preset, one of `orient_eye.eyes.EYES`, or an MJCF file of the same form.
        accurate: integrate by the classical Runge-Kutta method instead of the thesis' Euler step, the motors on
            straight lines between samples; at 1 ms too, or less where friction stops the eye sooner.
        gravity: add the gravity torque (thesis 3.8).
        as_published: the author's program to the letter. The inertia is turned as printed, R^T I R (3.10,
            it should be R I R^T), there is no gyroscopic torque, a step adds a straight piece to the
            quaternion and normalises it, and the eye stands still while slower than 1e-5 rad/s under
            less than 0.006 N m. Without it: a full rigid body, viscous friction only, exact rotations.
        rig: whose motors limit those of the same names: a TOML file, a shipped rig, or the limits by motor.
        threads: that share a batch; 0 for one a core.

    Raises:
        InputError: unknown eye or rig, tendons on another kind of path, a number of threads that is none, both
            `accurate` and `as_published`, or no Numba.
    """

    name = "tavares"

    def __init__(
        self,
        eye: str = "thesis",
        *,
        accurate: bool = False,
        gravity: bool = False,
        as_published: bool = False,
        rig: Rig | Limits | str | Path | None = None,
        threads: int = 0,
    ) -> None:
        if accurate and as_published:
            raise InputError("as_published is the author's own integrator, which accurate replaces: choose one of them")
        self._kernel = _compiled()
        options = {"eye": eye, "gravity": gravity, "as_published": as_published}
        if accurate:  # told only then: what was kept of the thesis' integrator still has this identity
            options["accurate"] = True
        super().__init__(options, step_s=self.step_s, threads=threads, rig=rig)
        self.elastics = Elastics.from_model(self.model)
        decay = self.step_s * self.elastics.friction / np.linalg.eigvalsh(self.elastics.inertia)[0]
        self.substeps = max(1, int(np.ceil(decay / _DECAY))) if accurate else 0
        motors = [self.model.actuator(name) for name in names(self.motors)]
        self._per_control = np.deg2rad(1) / np.array([motor.gear[0] for motor in motors])  # joint position a deg
        slides = [self.model.jnt_type[motor.trnid[0]] == mujoco.mjtJoint.mjJNT_SLIDE for motor in motors]
        self._weightless = self._eye(np.array(slides))
        weight = [self.elastics.centre_of_mass, [0, 0, -self.elastics.mass * STANDARD_GRAVITY if gravity else 0]]
        self._weighed = self._weightless._replace(weight=np.array(weight))
        self._fit_to_limits()

    def _eye(self, slides: NDArray[np.bool_]) -> Any:
        """The kernel's, without weight; its lines are the elastics here."""
        e = self.elastics
        centre, axis, sliding = e.arm_centre[e.motor], e.arm_axis[e.motor], slides[e.motor, None]
        along = (axis * e.arm_end).sum(axis=1, keepdims=True) * axis
        arm = np.stack(
            [
                centre + np.where(sliding, e.arm_end, along),
                np.where(sliding, 0, e.arm_end - along),
                np.where(sliding, axis, np.cross(axis, e.arm_end)),
            ],
            axis=1,
        )
        return self._kernel.Eye(
            insertion=np.array(e.insertion),
            via=np.array(e.via),
            arm=arm,
            elastic=np.stack([e.stiffness, e.rest_length], axis=1),
            pulls=np.searchsorted(np.sort(e.motor), np.arange(len(slides) + 1)),
            pulled=np.argsort(e.motor, kind="stable"),
            slides=slides,
            inertia=np.stack([e.inertia, np.linalg.inv(e.inertia)]),
            friction=e.friction,
            weight=np.zeros((2, 3)),
        )

    def elastic_torque(self, turn: Array, motor: Array) -> tuple[Array, Array]:
        """Torque of the elastics [N m] (n, 3) and their tension [N] (n, tendons); 3.2 to 3.5.

        Args:
            turn: rotation matrices of the eye, (n, 3, 3).
            motor: positions [deg], (n, motors).
        """
        return self._still(self._weightless, turn, motor)

    def torque(self, orientation: Array, motor: Array) -> Array:
        """See `orient_eye.plants.elastic.ElasticPlant`."""
        return self._still(self._weighed, rotation(orientation).as_matrix(), motor)[0]

    def _still(self, eye: Any, turn: Array, motor: Array) -> tuple[Array, Array]:
        torque, tension = np.empty((len(motor), 3)), np.empty((len(motor), len(self.tendons)))
        turns = np.require(np.broadcast_to(turn, (len(motor), 3, 3)), float, ["C", "W"])
        self._kernel.still(eye, turns, motor * self._per_control, torque, tension)
        return torque, tension

    def run(self, motor: Array, start: State) -> Run:
        """See `orient_eye.plants.simulated.SimulatedPlant`."""
        saccades, samples = motor.shape[:2]
        orientation, velocity = np.empty((saccades, samples, 4)), np.empty((saccades, samples, 3))
        tension, diverged = np.empty((saccades, samples, len(self.tendons))), np.zeros(saccades, bool)
        orientation[:, 0], velocity[:, 0] = start.orientation, np.deg2rad(start.angular_velocity)

        def move(part: slice) -> None:
            self._kernel.run(
                self._weighed, motor[part] * self._per_control, orientation[part], velocity[part], tension[part],
                diverged[part], self.step_s, self.substeps, bool(self.options["as_published"]),
            )  # fmt: skip
            np.rad2deg(velocity[part], out=velocity[part])

        worth = saccades * samples * max(1, 4 * self.substeps) // _WORTH_A_THREAD
        threads = min(self.threads or os.cpu_count() or 1, worth)
        if threads < 2:
            move(slice(None))
            return orientation, velocity, tension, diverged
        size = -(-saccades // (_SLICES * threads))
        with ThreadPoolExecutor(threads) as pool:  # of this call: none is shared, none is missing in a forked child
            list(pool.map(move, (slice(first, first + size) for first in range(0, saccades, size))))
        return orientation, velocity, tension, diverged


def _compiled() -> ModuleType:
    """The kernel; Numba is imported with it, and not before."""
    try:
        import_module("numba")
    except ImportError as error:
        raise InputError(
            f"plant 'tavares' is compiled by Numba, which cannot be imported ({error}): pip install numba, or take "
            "plant 'mujoco'"
        ) from error
    return import_module("orient_eye.plants.elastic_kernel")
