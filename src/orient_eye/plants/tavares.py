"""The thesis' simulator (its Algorithm 2) in plain NumPy: an independent witness of the MuJoCo eye.

It shares only the numbers of the MJCF with the MuJoCo plant: torque, integration and frames are
written from the thesis' equations 3.1 to 3.12, a batch at a time. The author's own program differs from
a rigid body with viscous friction in four small ways, which the option `as_published` brings back: with
them its runs come out to 0.0004 deg (`orient-eye validate`).
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye.eyes.elastics import Elastics
from orient_eye.eyes.model import STANDARD_GRAVITY
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.limits import Limits
from orient_eye.plants.simulated import Run
from orient_eye.rig import Rig
from orient_eye.rotations import FORWARD, rotation
from orient_eye.state import State

Array = NDArray[np.float64]
STATIC_FRICTION = 0.006
"""N m, in the author's program, while the eye turns slower than `STATIC_SPEED`."""
STATIC_SPEED = 1e-5
"""rad/s."""
_DIVERGED = 1e4  # rad/s: a thousand times the fastest saccade


class TavaresPlant(ElasticPlant):
    """The reference simulator as a plant; see `orient_eye.plants.Plant`.

    Args:
        eye: preset, one of `orient_eye.eyes.EYES`, or an MJCF file of the same form.
        gravity: add the gravity torque (thesis 3.8).
        as_published: the author's program to the letter. The inertia is turned as printed, R^T I R (3.10,
            it should be R I R^T), there is no gyroscopic torque, a step adds a straight piece to the
            quaternion and normalises it, and the eye stands still while slower than 1e-5 rad/s under
            less than 0.006 N m. Without it: a full rigid body, viscous friction only, exact rotations.
        rig: whose motors limit those of the same names: a TOML file, a shipped rig, or the limits by motor.
    """

    name = "tavares"

    def __init__(
        self,
        eye: str = "thesis",
        *,
        gravity: bool = False,
        as_published: bool = False,
        rig: Rig | Limits | str | Path | None = None,
    ) -> None:
        super().__init__({"eye": eye, "gravity": gravity, "as_published": as_published}, step_s=self.step_s, rig=rig)
        self.elastics = Elastics.from_model(self.model)
        self._fit_to_limits()

    def elastic_torque(self, turn: Array, motor: Array) -> tuple[Array, Array]:
        """Torque of the elastics [N m] (n, 3) and their tension [N] (n, tendons); 3.2 to 3.5.

        Args:
            turn: rotation matrices of the eye, (n, 3, 3).
            motor: positions [deg], (n, motors).
        """
        e = self.elastics
        angle = np.deg2rad(motor)
        arm = Rotation.from_rotvec((angle[..., None] * e.arm_axis).reshape(-1, 3)).as_matrix()
        arm = arm.reshape(*angle.shape, 3, 3)
        end = np.einsum("ntij,tj->nti", arm[:, e.motor], e.arm_end) + e.arm_centre[e.motor]
        insertion = np.einsum("nij,tj->nti", turn, e.insertion)
        pulled_to = np.where(np.isnan(e.via), end, e.via)
        span = pulled_to - insertion
        distance = np.linalg.norm(span, axis=-1)
        length = distance + np.linalg.norm(end - pulled_to, axis=-1)
        tension = e.stiffness * np.maximum(length - e.rest_length, 0)
        force = (tension / distance)[..., None] * span
        return np.cross(insertion, force).sum(axis=1), tension

    def torque(self, orientation: Array, motor: Array) -> Array:
        """See `orient_eye.plants.elastic.ElasticPlant`."""
        turn = rotation(orientation).as_matrix()
        torque, _ = self.elastic_torque(turn, motor)
        return torque + self._gravity_torque(turn)

    def _gravity_torque(self, turn: Array) -> Array:
        if not self.options["gravity"]:
            return np.zeros((len(turn), 3))
        weight = np.array([0, 0, -self.elastics.mass * STANDARD_GRAVITY])
        return np.cross(turn @ self.elastics.centre_of_mass, weight)

    def run(self, motor: Array, start: State) -> Run:
        """See `orient_eye.plants.simulated.SimulatedPlant`."""
        saccades, samples = motor.shape[:2]
        out_q, out_w = np.empty((saccades, samples, 4)), np.empty((saccades, samples, 3))
        out_t = np.empty((saccades, samples, len(self.tendons)))
        q, omega = start.orientation.copy(), np.deg2rad(start.angular_velocity)
        diverged = np.zeros(saccades, bool)
        for k in range(samples):
            gone = ~(np.abs(omega).max(axis=1, initial=0) < _DIVERGED)
            diverged |= gone
            q[gone], omega[gone] = FORWARD, 0
            turn = rotation(q).as_matrix()
            torque, tension = self.elastic_torque(turn, motor[:, k])
            out_q[:, k], out_w[:, k], out_t[:, k] = q, np.rad2deg(omega), tension
            q, omega = self._advance(turn, q, omega, torque + self._gravity_torque(turn))
        return out_q, out_w, out_t, diverged

    def _advance(self, turn: Array, q: Array, omega: Array, torque: Array) -> tuple[Array, Array]:
        """One step of Algorithm 2: omega first, then q with the new omega."""
        h, turned_back = self.step_s, np.swapaxes(turn, -1, -2)
        resisted = torque - self.elastics.friction * omega
        if self.options["as_published"]:
            inertia = turned_back @ self.elastics.inertia @ turn
            still = np.linalg.norm(omega, axis=-1) < STATIC_SPEED
            weak = np.linalg.norm(torque, axis=-1) < STATIC_FRICTION
            resisted = np.where((still & weak)[:, None], 0, resisted)
        else:
            inertia = turn @ self.elastics.inertia @ turned_back
            resisted = resisted - np.cross(omega, (inertia @ omega[..., None])[..., 0])
        omega = omega + h * np.linalg.solve(inertia, resisted[..., None])[..., 0]
        if not self.options["as_published"]:
            return (Rotation.from_rotvec(h * omega) * rotation(q)).as_quat(scalar_first=True), omega
        rate = np.concatenate(  # 1/2 (0, omega) q
            [-(omega * q[:, 1:]).sum(axis=-1, keepdims=True), q[:, :1] * omega + np.cross(omega, q[:, 1:])], axis=-1
        )
        q = q + 0.5 * h * rate
        return q / np.linalg.norm(q, axis=-1, keepdims=True), omega
