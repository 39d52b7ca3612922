"""What the plants of the elastic eye have in common: its compiled model, and where it comes to rest."""

from abc import abstractmethod
from functools import cached_property
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye.constants import HORIZON_S
from orient_eye.errors import InputError
from orient_eye.eyes import model as eyes
from orient_eye.motor import check_driven, ranges
from orient_eye.plants import PulseRates, equilibrium
from orient_eye.plants.limits import Limits, are_limited, limited, limits_of, travel_s
from orient_eye.plants.simulated import SimulatedPlant
from orient_eye.rig import Rig
from orient_eye.rotations import rotation

Array = NDArray[np.float64]
_TURN = 1e-4  # rad, of the difference quotients of the torque


class ElasticPlant(SimulatedPlant):
    """An eye that elastics turn.

    Args:
        options: keywords of the plant, which its identity shows: `eye` among them.
        step_s: of the integration.
        threads: that share a batch; 0 for one a core.
        gravity: with the gravity torque as an actuator of the model.
        rig: whose motors limit those of the same names, or its limits in plain values; the identity then shows them.

    Raises:
        InputError: an eye, a rig or a number of threads that is none, or a rig's motor that the eye has not.
    """

    resumes = True

    def __init__(
        self,
        options: dict[str, Any],
        *,
        step_s: float,
        threads: int = 0,
        gravity: bool = False,
        rig: Rig | Limits | str | Path | None = None,
    ) -> None:
        if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or threads < 0:
            raise InputError(f"threads are a whole number, 0 for one a core, got {threads!r}")
        self.threads = int(threads)
        self.model = eyes.build_model(options["eye"], step_s=step_s, gravity=gravity, visual=False)
        own = eyes.motors(self.model)
        limits = {} if rig is None else limits_of(rig, own, self.name)
        self.motors = limited(own, limits)
        self.options = {**options, "rig": limits} if limits else options
        self.tendons = tuple(self.model.tendon(i).name for i in range(self.model.ntendon))

    def __getstate__(self) -> dict[str, Any]:
        return {**self.options, "threads": self.threads}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]  # models and compiled code are made again in the process

    def _fit_to_limits(self) -> None:
        """Horizon and bounds of pulses that suit limited motors; at the end of a constructor, as it asks torques."""
        if are_limited(self.motors):
            self.horizon_s = float(np.ceil(10 * (HORIZON_S + travel_s(self.motors))) / 10)
            self.pulse_rates = PulseRates.around(self.rates())

    @abstractmethod
    def torque(self, orientation: Array, motor: Array) -> Array:
        """All torques but friction [N m] (n, 3), head frame, on an eye at rest in orientations (n, 4)."""

    def identity(self) -> dict[str, Any]:
        """Name, options and hash of the compiled model."""
        return {"plant": self.name, **self.options, "model": self._model_hash}

    def rates(self) -> list[float]:
        """Sizes of the poles [1/s] of the eye linearised at rest; of a mode that does not swing the slower one."""
        at = np.zeros((1, len(self.motors)))
        rest = self.rest(at)
        turns = np.concatenate([np.eye(3), -np.eye(3)]) * _TURN
        turned = (Rotation.from_rotvec(turns) * rotation(np.repeat(rest, 6, axis=0))).as_quat(scalar_first=True)
        torque = self.torque(turned, np.repeat(at, 6, axis=0))
        stiffness = -(torque[:3] - torque[3:]).T / (2 * _TURN)
        inertia, friction = self._inertia_and_friction(rest[0])
        still, unit = np.zeros((3, 3)), np.eye(3)
        motion = np.block([[still, unit], [-np.linalg.solve(inertia, stiffness), -np.linalg.solve(inertia, friction)]])
        poles = np.linalg.eigvals(motion)
        swings = np.abs(poles.imag) > 1e-6 * np.abs(poles)
        slow = np.sort(np.abs(poles[~swings]))
        sizes = [*slow[: (len(slow) + 1) // 2], *np.abs(poles[swings & (poles.imag > 0)])]
        return sorted(float(f"{size:.4g}") for size in sizes)  # the same bounds of actions on any machine

    def _inertia_and_friction(self, orientation: Array) -> tuple[Array, Array]:
        """Of the eye, head frame, (3, 3) each."""
        data, eye = mujoco.MjData(self.model), self.model.joint("eye")
        data.qpos[eye.qposadr[0] + np.arange(4)] = orientation
        mujoco.mj_forward(self.model, data)
        whole = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, whole)
        own = eye.dofadr[0] + np.arange(3)
        turn = rotation(orientation).as_matrix()
        return turn @ whole[np.ix_(own, own)] @ turn.T, turn @ np.diag(self.model.dof_damping[own]) @ turn.T

    @cached_property
    def _model_hash(self) -> str:
        return eyes.model_hash(self.model)

    def drawn(self) -> mujoco.MjModel:
        """Its own eye, with its shapes."""
        return eyes.build_model(self.options["eye"])

    def rest(self, motor: Array) -> Array:
        """See `orient_eye.plants.Plant`."""
        return equilibrium.rest_orientation(self.torque, motor)

    def hold(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`."""
        index = check_driven(self.motors, driven, self.name)
        return equilibrium.rest_motor(self.torque, orientation, len(self.motors), index, ranges(self.motors))
