"""The elastic eye without its inertia: friction times angular velocity is the torque of elastics and weight.

    plant = ViscousPlant()

A non-linear surrogate: it turns in three dimensions, comes to rest where the whole eye does, and its poles drift with
orientation as there. Without inertia nothing in it is fast, so Runge-Kutta steps of second order may be ten samples
long: a fifth of the torques that plant `tavares` works out. How near it comes to that plant `tests/test_viscous.py`
says, how much faster it is `benchmarks/plants.py`. Results do not depend on the number of threads.
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
_STRIDE = 10  # samples in a step, at most
_DECAY = 0.25  # of the fastest mode in a step, at most
_APART = 10.0  # times as fast as the poles of the elastics those of the inertia are: then none is off by a tenth


class ViscousPlant(CompiledPlant):
    """An eye whose inertia is nothing beside its friction; see `orient_eye.plants.Plant`.

    Safe to share: the kernel holds no state, and each call has threads of its own.

    Its angular velocity at each instant follows from orientation and motors: that of a start
    (`orient_eye.state.State`) is ignored. Within a step the motors count by their mean, and the samples lie on a cubic
    between its ends. Trajectories have no tension; `tension` tells it for any of their samples.

    Args:
        eye: preset, one of `orient_eye.eyes.EYES`, or an MJCF file of the same form.
        gravity: add the gravity torque (thesis 3.8).
        pretension: as of `orient_eye.plants.tavares.TavaresPlant`.
        rig: whose motors limit those of the same names: a TOML file, a shipped rig, or the limits by motor.
        threads: that share a batch; 0 for one a core.

    Raises:
        InputError: an eye whose inertia matters, unknown eye or rig, tendons on another kind of path, a number of
            threads that is none, or no Numba.
    """

    name = "viscous"

    def __init__(
        self,
        eye: str = "thesis",
        *,
        gravity: bool = False,
        pretension: float | None = None,
        rig: Rig | Limits | str | Path | None = None,
        threads: int = 0,
    ) -> None:
        super().__init__({"eye": eye, "gravity": gravity}, pretension=pretension, rig=rig, threads=threads)
        self.tendons = ()
        sizes = np.sort(np.abs(self._modes[0]))  # three of the elastics, then three of the inertia
        if not sizes[3] > _APART * sizes[2]:
            raise InputError(
                f"plant 'viscous' leaves out the eye's inertia, so three of its poles have to be {_APART:g} times as "
                f"fast as the others; eye {eye!r} has poles of {', '.join(f'{size:.3g}' for size in sizes)} 1/s: take "
                "plant 'tavares' or 'mujoco'"
            )
        self.stride = int(np.clip(_DECAY / (sizes[2] * self.step_s), 1, _STRIDE))
        self._creep = self._kernel.creep()

    def run(self, motor: Array, start: State) -> Run:
        """See `orient_eye.plants.simulated.SimulatedPlant`."""
        saccades, samples = motor.shape[:2]
        orientation, velocity = np.empty((saccades, samples, 4)), np.empty((saccades, samples, 3))
        diverged = np.zeros(saccades, bool)
        orientation[:, 0] = start.orientation

        def move(part: slice) -> None:
            self._creep(
                self._weighed, motor[part] * self.elastics.per_degree, orientation[part], velocity[part],
                diverged[part], self.step_s, self.stride,
            )  # fmt: skip
            np.rad2deg(velocity[part], out=velocity[part])

        self._in_slices(saccades, 2 * saccades * samples // self.stride, move)
        return orientation, velocity, None, diverged
