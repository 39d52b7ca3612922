"""What the plants of the elastic eye have in common: its compiled model, and where it comes to rest."""

from abc import abstractmethod
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.cached import cached_property
from orient_eye.checks import whole
from orient_eye.constants import HORIZON_S
from orient_eye.errors import InputError
from orient_eye.eyes import model as eyes
from orient_eye.eyes.muscles import Muscles
from orient_eye.motor import AXES, check_driven, ranges, redundant, rests
from orient_eye.plants import PulseRates, equilibrium
from orient_eye.plants.cables import Cables
from orient_eye.plants.fixation import Fixations
from orient_eye.plants.limits import Limits, are_limited, limited, limits_of, travel_s
from orient_eye.plants.simulated import SimulatedPlant
from orient_eye.plants.turns import turned
from orient_eye.rig import Rig
from orient_eye.rotations import FORWARD, gaze, rotation

Array = NDArray[np.float64]
_MOST_THREADS = 1024
_BALANCED = 1e-5  # N m: a keyframe's digits; a degree is worth about 5e-3


class ElasticPlant(SimulatedPlant):
    """An eye that elastics turn.

    Args:
        options: keywords of the plant, which its identity shows: `eye` among them.
        step_s: of the integration.
        threads: that share a batch; 0 for one a core.
        gravity: with the gravity torque as an actuator of the model.
        pretension: at which its motors rest, of those that the eye has keyframes for; None for the first, or 0.
        rig: whose motors limit those of the same names, or its limits in plain values; the identity then shows them.

    Raises:
        InputError: an eye, a pretension, a rig or a number of threads that is none, or a rig's motor that the eye has
            not.
    """

    resumes = True

    def __init__(
        self,
        options: dict[str, Any],
        *,
        step_s: float,
        threads: int = 0,
        gravity: bool = False,
        pretension: float | None = None,
        rig: Rig | Limits | str | Path | None = None,
    ) -> None:
        self.threads = whole("threads", threads, 0, _MOST_THREADS, advice="0 is one a core")
        self.model = eyes.build_model(options["eye"], step_s=step_s, gravity=gravity, visual=False)
        own = eyes.motors(self.model, pretension)
        if own != eyes.motors(self.model):  # one eye, one identity
            options = {**options, "pretension": None if pretension is None else float(pretension)}
        limits = {} if rig is None else limits_of(rig, own, self.name)
        self.motors = limited(own, limits)
        self.options = {**options, "rig": limits} if limits else options
        self.tendons = tuple(self.model.tendon(i).name for i in range(self.model.ntendon))

    def __getstate__(self) -> dict[str, Any]:
        return {"options": {**self.options, "threads": self.threads}, "doubt": self.doubt}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state["options"])  # type: ignore[misc]  # models and compiled code are made again in the process
        self.doubt = state["doubt"]

    def _fit_to_limits(self) -> None:
        """Horizon and bounds of pulses that suit limited motors; at the end of a constructor, as it asks torques.

        Raises:
            InputError: an eye that spindles turn does not rest straight ahead where its motors rest.
        """
        if self.redundant and self.wound:
            at, ahead = rests(self.motors)[None], FORWARD[None]
            state, torque = self.cables.state(ahead, at), np.abs(self.torque(ahead, at)).max()
            balanced = bool(self.options["gravity"]) or torque < _BALANCED
            if not balanced or state.slack[0] or not state.stiffness[0] > 0:
                raise InputError(
                    f"eye {self.options['eye']!r} does not rest straight ahead, under tension, with its motors at "
                    f"{np.round(at[0], 2).tolist()} deg: give it a keyframe pretension_N that says where they rest "
                    "(docs/howto/eye.md)"
                )
        if are_limited(self.motors):
            self.horizon_s = float(np.ceil(10 * (HORIZON_S + travel_s(self.motors))) / 10)
            self.pulse_rates = PulseRates.around(self.rates())

    @abstractmethod
    def torque(self, orientation: Array, motor: Array) -> Array:
        """All torques but friction [N m] (n, 3), head frame, on an eye at rest in orientations (n, 4)."""

    @abstractmethod
    def tension(self, orientation: Array, motor: Array) -> Array:
        """Tension of the tendons [N] (n, tendons) in orientations (n, 4) with the motors at (n, motors)."""

    def force(self, orientation: Array, motor: Array) -> Array | None:
        """See `orient_eye.plants.Plant`."""
        if self.redundant:
            return np.asarray((np.deg2rad(motor - rests(self.motors)) ** 2).sum(axis=1))
        if self._pairs is None:
            return None
        tension = self.tension(orientation, motor)
        return np.asarray(((tension[:, self._pairs[:, 0]] - tension[:, self._pairs[:, 1]]) ** 2).sum(axis=1))

    def excess_force(self, orientation: Array, motor: Array) -> Array | None:
        """See `orient_eye.movement.Movement`; NaN where an orientation is none."""
        known = np.isfinite(orientation).all(axis=1) & np.isfinite(motor).all(axis=1)
        found = self.force(orientation[known], motor[known])
        if found is None:
            return None
        excess = np.full(len(motor), np.nan)
        excess[known] = found - Fixations.of(self).force(gaze(orientation[known]))
        return excess

    @cached_property
    def _pairs(self) -> NDArray[np.intp] | None:
        return eyes.pairs(self.model)

    @property
    def redundant(self) -> bool:
        """Whether it has more motors than axes, so that they hold an orientation in many ways."""
        return redundant(self.motors)

    @cached_property
    def wound(self) -> bool:
        """Whether spindles alone pull, so that tension and torque follow the motors on straight lines."""
        return bool((eyes.Tendons.of(self.model).motor >= 0).all())

    @cached_property
    def cables(self) -> Cables:
        """How motors that are more than the axes share the work."""
        return Cables(self.name, self.motors, self.torque, self.tension, Muscles.of(self.model))

    def identity(self) -> dict[str, Any]:
        """Name, options and hash of the compiled model."""
        return {"plant": self.name, **self.options, "model": self._model_hash}

    def rates(self) -> list[float]:
        """Sizes of the poles [1/s] of the eye linearised at rest; of a mode that does not swing the slower one."""
        poles, _ = self._modes
        swings = np.abs(poles.imag) > 1e-6 * np.abs(poles)
        slow = np.sort(np.abs(poles[~swings]))
        sizes = [*slow[: (len(slow) + 1) // 2], *np.abs(poles[swings & (poles.imag > 0)])]
        return sorted(float(f"{size:.4g}") for size in sizes)  # the same bounds of actions on any machine

    def turning_rates(self, orientation: Array, motor: Array) -> Array | None:
        """See `orient_eye.plants.Plant`: stiffness over friction."""
        friction = float(self.model.dof_damping[self.model.joint("eye").dofadr[0]])
        stiffness = equilibrium.stiffness(self.torque, orientation, motor)
        return np.asarray(np.diagonal(stiffness, axis1=1, axis2=2) / friction)

    def motor_rates(self) -> Array:
        """See `orient_eye.plants.Plant`."""
        poles, ways = self._modes
        turn = turned(self).as_rotvec().T
        parts = np.linalg.solve(ways, np.concatenate([turn, np.zeros_like(turn)]))
        shares = np.linalg.norm(ways[:3], axis=0)[:, None] * np.abs(parts)
        return np.array([float(f"{rate:.4g}") for rate in np.abs(poles)[shares.argmax(axis=0)]])

    @cached_property
    def _modes(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Poles [1/s] (6,) of the eye linearised at rest and its modes, turn and speed [rad, rad/s] (6, poles)."""
        at = rests(self.motors)[None]
        rest = self.rest(at)
        stiffness = equilibrium.stiffness(self.torque, rest, at)[0]
        inertia, friction = self._inertia_and_friction(rest[0])
        still, unit = np.zeros((3, 3)), np.eye(3)
        motion = np.block([[still, unit], [-np.linalg.solve(inertia, stiffness), -np.linalg.solve(inertia, friction)]])
        poles, ways = np.linalg.eig(motion)
        return poles.astype(complex), ways.astype(complex)

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
        return equilibrium.rest_orientation(self.torque, motor, rests(self.motors))

    def held(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`."""
        index = check_driven(self.motors, driven, self.name)
        working = np.array([motor.working for motor in self.motors])
        if len(index) > AXES and self.wound:
            return self.cables.held(orientation, index, working)
        motor, held = equilibrium.held_motor(self.torque, orientation, rests(self.motors), index, working)
        return np.where(held[:, None], motor, np.nan)

    def hold(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`."""
        index = check_driven(self.motors, driven, self.name)
        if len(index) > AXES and self.wound:
            return self.cables.hold(orientation, index, ranges(self.motors))
        return equilibrium.rest_motor(self.torque, orientation, rests(self.motors), index, ranges(self.motors))
