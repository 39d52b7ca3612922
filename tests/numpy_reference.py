"""The simulators of the thesis (its Algorithm 2) and of the cable eye in plain NumPy: the witness of plant `tavares`.

Written from the thesis' equations 3.1 to 3.12, a batch at a time; it shares only the numbers of `Elastics` with the
kernel. The constants of static friction are written a second time here.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye.eyes.elastics import Elastics
from orient_eye.plants.simulated import Run
from orient_eye.rotations import rotation
from orient_eye.state import State

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NumpyReference:
    """An eye that hinges or spindles turn.

    Attributes:
        elastics: of the eye.
        gravity: add the gravity torque (thesis 3.8).
        as_published: the authors' programs to the letter; see `orient_eye.plants.tavares.TavaresPlant`.
        step_s: of the integration.
    """

    elastics: Elastics
    gravity: bool = False
    as_published: bool = False
    step_s: float = 0.001

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
        end = np.where(e.wound[:, None] != 0, e.via, end)  # a spindle's cable is wound up behind its head point
        insertion = np.einsum("nij,tj->nti", turn, e.insertion)
        pulled_to = np.where(np.isnan(e.via), end, e.via)
        span = pulled_to - insertion
        distance = np.linalg.norm(span, axis=-1)
        length = distance + np.linalg.norm(end - pulled_to, axis=-1) + e.wound * angle[:, e.motor]
        tension = e.stiffness * np.maximum(length - e.rest_length, 0)
        force = (tension / distance)[..., None] * span
        return np.cross(insertion, force).sum(axis=1), tension

    def torque(self, orientation: Array, motor: Array) -> Array:
        """All torques but friction [N m] (n, 3) at orientations (n, 4) and motors [deg] (n, motors)."""
        turn = rotation(orientation).as_matrix()
        torque, _ = self.elastic_torque(turn, motor)
        weight = np.array([0, 0, -9.81 * self.elastics.mass * self.gravity])
        return torque + np.cross(turn @ self.elastics.centre_of_mass, weight)

    def run(self, motor: Array, start: State) -> Run:
        """As `orient_eye.plants.simulated.SimulatedPlant.run`."""
        saccades, samples = motor.shape[:2]
        out_q, out_w = np.empty((saccades, samples, 4)), np.empty((saccades, samples, 3))
        out_t = np.empty((saccades, samples, len(self.elastics.motor)))
        q, omega = start.orientation.copy(), np.deg2rad(start.angular_velocity)
        for k in range(samples):
            turn = rotation(q).as_matrix()
            _, tension = self.elastic_torque(turn, motor[:, k])
            out_q[:, k], out_w[:, k], out_t[:, k] = q, np.rad2deg(omega), tension
            q, omega = self._advance(turn, q, omega, self.torque(q, motor[:, k]))
        return out_q, out_w, out_t, np.zeros(saccades, bool)

    def _advance(self, turn: Array, q: Array, omega: Array, torque: Array) -> tuple[Array, Array]:
        """One step of Algorithm 2: omega first, then q with the new omega."""
        omega = omega + self.step_s * self.acceleration(turn, omega, torque)
        if self.elastics.wound.any() or not self.as_published:
            return (Rotation.from_rotvec(self.step_s * omega) * rotation(q)).as_quat(scalar_first=True), omega
        q = q + self.step_s * rate(q, omega)
        return q / np.linalg.norm(q, axis=-1, keepdims=True), omega

    def acceleration(self, turn: Array, omega: Array, torque: Array) -> Array:
        """Angular acceleration [rad/s^2] (n, 3), head frame; 3.9 to 3.11."""
        turned_back = np.swapaxes(turn, -1, -2)
        resisted = torque - self.elastics.friction * omega
        if self.as_published and self.elastics.wound.any():
            still = np.linalg.norm(omega, axis=-1) < 0.01
            weak = np.linalg.norm(resisted, axis=-1) < 0.005
            resisted = np.where((still & weak)[:, None], 0, resisted)
        if self.as_published and not self.elastics.wound.any():
            inertia = turned_back @ self.elastics.inertia @ turn
            still = np.linalg.norm(omega, axis=-1) < 1e-5
            weak = np.linalg.norm(torque, axis=-1) < 0.006
            resisted = np.where((still & weak)[:, None], 0, resisted)
        else:
            inertia = turn @ self.elastics.inertia @ turned_back
            resisted = resisted - np.cross(omega, (inertia @ omega[..., None])[..., 0])
        return np.asarray(np.linalg.solve(inertia, resisted[..., None])[..., 0])


def rate(q: Array, omega: Array) -> Array:
    """Derivative of orientations (n, 4): 1/2 (0, omega) q, 3.12."""
    scalar = -(omega * q[:, 1:]).sum(axis=-1, keepdims=True)
    return np.concatenate([scalar, q[:, :1] * omega + np.cross(omega, q[:, 1:])], axis=-1) / 2
