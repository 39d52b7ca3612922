"""What the plants on the compiled kernel have in common: its eye, its torques and its threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.eyes.elastics import Elastics
from orient_eye.eyes.model import STANDARD_GRAVITY
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.limits import Limits
from orient_eye.resources import cores
from orient_eye.rig import Rig
from orient_eye.rotations import rotation

Array = NDArray[np.float64]
_WORTH_A_THREAD = 2000  # torques: 0.3 ms, a few times what starting it takes
_SLICES = 4  # a thread: they end together on a busy machine too


class CompiledPlant(ElasticPlant):
    """An elastic eye whose motion `orient_eye.plants.elastic_kernel` computes.

    Args:
        options: keywords of the plant, which its identity shows: `eye` and `gravity` among them.
        pretension: at which its motors rest, of those that it has keyframes for.
        rig: whose motors limit those of the same names: a TOML file, a shipped rig, or the limits by motor.
        threads: that share a batch; 0 for one a core.

    Raises:
        InputError: unknown eye, pretension or rig, tendons on another kind of path, a number of threads that is none,
            or no Numba.
    """

    def __init__(
        self, options: dict[str, Any], *, pretension: float | None, rig: Rig | Limits | str | Path | None, threads: int
    ) -> None:
        self._kernel = self._compiled()
        super().__init__(options, step_s=self.step_s, threads=threads, pretension=pretension, rig=rig)
        self.elastics = Elastics.from_model(self.model)
        self._weightless = self._eye()
        pull = -self.elastics.mass * STANDARD_GRAVITY if options["gravity"] else 0
        weight = np.array([self.elastics.centre_of_mass, [0, 0, pull]])
        self._weighed = self._weightless._replace(weight=weight)
        self._fit_to_limits()

    def _compiled(self) -> ModuleType:
        """The kernel; Numba is imported with it, and not before."""
        try:
            import_module("numba")
        except ImportError as error:
            raise InputError(
                f"plant {self.name!r} is compiled by Numba, which cannot be imported ({error}): pip install numba, or "
                "take plant 'mujoco'"
            ) from error
        return import_module("orient_eye.plants.elastic_kernel")

    def _eye(self) -> Any:
        """The kernel's, without weight; its lines are the elastics here."""
        e = self.elastics
        centre, axis, sliding = e.arm_centre[e.motor], e.arm_axis[e.motor], e.slides[e.motor, None]
        along = (axis * e.arm_end).sum(axis=1, keepdims=True) * axis
        arm = np.stack(
            [
                centre + np.where(sliding, e.arm_end, along),
                np.where(sliding, 0, e.arm_end - along),
                np.where(sliding, axis, np.cross(axis, e.arm_end)),
            ],
            axis=1,
        )
        wound = e.wound != 0
        arm[wound, 0] = e.via[wound]  # nothing of the cable lies behind it but what is wound up
        return self._kernel.Eye(
            insertion=np.array(e.insertion),
            via=np.array(e.via),
            arm=arm,
            elastic=np.stack([e.stiffness, e.rest_length, e.wound], axis=1),
            pulls=np.searchsorted(np.sort(e.motor), np.arange(len(e.slides) + 1)),
            pulled=np.argsort(e.motor, kind="stable"),
            slides=e.slides,
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

    def tension(self, orientation: Array, motor: Array) -> Array:
        """See `orient_eye.plants.elastic.ElasticPlant`."""
        return self._still(self._weightless, rotation(orientation).as_matrix(), motor)[1]

    def _still(self, eye: Any, turn: Array, motor: Array) -> tuple[Array, Array]:
        torque, tension = np.empty((len(motor), 3)), np.empty((len(motor), len(self.elastics.motor)))
        turns = np.require(np.broadcast_to(turn, (len(motor), 3, 3)), float, ["C", "W"])
        self._kernel.still(eye, turns, motor * self.elastics.per_degree, torque, tension)
        return torque, tension

    def _in_slices(self, saccades: int, torques: int, move: Callable[[slice], None]) -> None:
        """Move saccades, by slices in as many threads as that many torques are worth."""
        threads = min(self.threads or cores(), torques // _WORTH_A_THREAD)
        if threads < 2:
            move(slice(None))
            return
        size = -(-saccades // (_SLICES * threads))
        with ThreadPoolExecutor(threads) as pool:  # of this call: none is shared, none is missing in a forked child
            list(pool.map(move, (slice(first, first + size) for first in range(0, saccades, size))))
