"""The thesis' simulator (its Algorithm 2) as a compiled kernel: a witness of the MuJoCo eye, and a fast one.

    plant = TavaresPlant()                           # the thesis' integrator, 1 ms
    plant = TavaresPlant(accurate=True)              # Runge-Kutta's method

It shares only the numbers of the MJCF with the MuJoCo plant: torque, integration and frames are
written from the thesis' equations 3.1 to 3.12 (`orient_eye.plants.elastic_kernel`; `tests/numpy_reference.py` has them
in plain NumPy). The author's own program differs from a rigid body with viscous friction in four small ways, which the
option `as_published` brings back: with them its runs come out to 0.0004 deg (`orient-eye validate`). Results do not
depend on the number of threads.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.plants.compiled import CompiledPlant
from orient_eye.plants.limits import Limits
from orient_eye.plants.simulated import Run
from orient_eye.rig import Rig
from orient_eye.state import State

Array = NDArray[np.float64]
_DECAY = 0.6  # of friction in an accurate step, at most


class TavaresPlant(CompiledPlant):
    """The reference simulator as a plant; see `orient_eye.plants.Plant`.

    Safe to share: the kernel holds no state, and each call has threads of its own.

    Args:
        eye: preset, one of `orient_eye.eyes.EYES`, or an MJCF file of the same form.
        accurate: integrate by the classical Runge-Kutta method instead of the thesis' Euler step, the motors on
            straight lines between samples; at 1 ms too, or less where friction stops the eye sooner.
        gravity: add the gravity torque (thesis 3.8).
        as_published: the author's program to the letter. The inertia is turned as printed, R^T I R (3.10,
            it should be R I R^T), there is no gyroscopic torque, a step adds a straight piece to the
            quaternion and normalises it, and the eye stands still while slower than 1e-5 rad/s under
            less than 0.006 N m. Without it: a full rigid body, viscous friction only, exact rotations. Of an eye that
            spindles turn: its torque is 0 while it turns slower than 0.01 rad/s under less than 0.005 N m.
        pretension: the motors rest as the eye's keyframe `pretension_N` says; None for its first, or 0 without one.
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
        pretension: float | None = None,
        rig: Rig | Limits | str | Path | None = None,
        threads: int = 0,
    ) -> None:
        if accurate and as_published:
            raise InputError("as_published is the author's own integrator, which accurate replaces: choose one of them")
        options = {"eye": eye, "gravity": gravity, "as_published": as_published}
        if accurate:  # told only then: what was kept of the thesis' integrator still has this identity
            options["accurate"] = True
        super().__init__(options, pretension=pretension, rig=rig, threads=threads)
        spindles = bool(self.elastics.wound.any())
        self._published = (2 if spindles else 1) if as_published else 0
        decay = self.step_s * self.elastics.friction / np.linalg.eigvalsh(self.elastics.inertia)[0]
        self.substeps = max(1, int(np.ceil(decay / _DECAY))) if accurate else 0

    def run(self, motor: Array, start: State) -> Run:
        """See `orient_eye.plants.simulated.SimulatedPlant`."""
        saccades, samples = motor.shape[:2]
        orientation, velocity = np.empty((saccades, samples, 4)), np.empty((saccades, samples, 3))
        tension, diverged = np.empty((saccades, samples, len(self.tendons))), np.zeros(saccades, bool)
        orientation[:, 0], velocity[:, 0] = start.orientation, np.deg2rad(start.angular_velocity)

        def move(part: slice) -> None:
            self._kernel.run(
                self._weighed, motor[part] * self.elastics.per_degree, orientation[part], velocity[part], tension[part],
                diverged[part], self.step_s, self.substeps, self._published,
            )  # fmt: skip
            np.rad2deg(velocity[part], out=velocity[part])

        self._in_slices(saccades, saccades * samples * max(1, 4 * self.substeps), move)
        return orientation, velocity, tension, diverged
