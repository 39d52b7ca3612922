"""The linear surrogate of an eye with all its motors as a plant, exact on straight lines between samples.

    plant = ModalPlant()                             # the thesis' eye
    plant = ModalPlant("runs/sysid-1/surrogate_3d.json")

Each component of the rotation vector is a low-pass plant of its own (`orient_eye.modal_surrogate`), whose answer is
known in closed form (`linear_response.sampled_response`); only the rotation vector's way to the orientation is not
linear. So a second of it costs three filters.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands import checked_step
from orient_eye.constants import HORIZON_S, STEP_S
from orient_eye.errors import InputError
from orient_eye.modal_surrogate import ModalSurrogate, Mode, angular_velocity, as_orientation, as_vector, vector_rate
from orient_eye.motor import check_driven, rests
from orient_eye.plants.linear_response import free_response, sampled_response, second_order_poles
from orient_eye.plants.simulated import Run, SimulatedPlant
from orient_eye.state import State

if TYPE_CHECKING:
    import mujoco

Array = NDArray[np.float64]
_HELD_DEG = 1e-6
_NEARLY_SETTLED = 3.0  # time constants of the slowest mode: a good saccade is over


class ModalPlant(SimulatedPlant):
    """Three low-pass plants in parallel as a plant; see `orient_eye.plants.Plant`. Safe to share: nothing changes.

    Args:
        surrogate: its numbers, a file of them, or the name of a shipped one.
        step_s: interval between samples [s].

    Raises:
        InputError: no such surrogate.
    """

    name = "modal"

    def __init__(self, surrogate: ModalSurrogate | str | Path = "thesis-3d", *, step_s: float = STEP_S) -> None:
        self.surrogate = surrogate if isinstance(surrogate, ModalSurrogate) else ModalSurrogate.load(surrogate)
        self.step_s = checked_step(step_s)
        self.motors = self.surrogate.as_motors()
        self.resumes = not self.surrogate.dead_time  # else the eye remembers where its motors were
        slow = [min(map(complex, poles_of(mode)), key=abs) for mode in self.surrogate.modes.values()]
        self._rates = np.abs(slow)
        settled = _NEARLY_SETTLED / np.real(slow).min() + self.surrogate.dead_time
        self.horizon_s = max(HORIZON_S, float(np.ceil(10 * settled) / 10))

    def identity(self) -> dict[str, Any]:
        """Name and numbers of the surrogate, and the eye it stands for."""
        told = self.surrogate.to_plain()
        return {"plant": self.name, **{key: told[key] for key in told if key not in ("source", "details")}}

    def drawn(self) -> "mujoco.MjModel":
        """The eye it stands for, or a ball where it stands for none of ours."""
        from orient_eye.eyes.model import ball, build_model

        return build_model(self.surrogate.eye) if self.surrogate.eye else ball()

    def run(self, motor: Array, start: State) -> Run:
        """See `orient_eye.plants.simulated.SimulatedPlant`."""
        time = self.times(motor.shape[1])
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of an absurd start, which is marked
            at = as_vector(start.orientation)
            rate = vector_rate(at, start.angular_velocity)
            wanted, before = self._wanted(motor), self._wanted(start.motor)
            vector, speed = np.empty((2, *wanted.shape))
            for i, mode in enumerate(self.surrogate.modes.values()):
                poles, own = poles_of(mode), (..., i)
                forced = sampled_response(1.0, poles, self.surrogate.dead_time, wanted[own], self.step_s, before[own])
                free = free_response(poles, at[own] - before[own], rate[own], time)
                vector[own], speed[own] = forced[0] + free[0], forced[1] + free[1]
            orientation, velocity = as_orientation(vector), angular_velocity(vector, speed)
        diverged = ~(np.isfinite(orientation).all(axis=(1, 2)) & np.isfinite(velocity).all(axis=(1, 2)))
        # Half a turn away there is no rotation vector: of a start next to it no unit quaternion is left.
        diverged |= (np.abs((orientation**2).sum(axis=-1) - 1) > 1e-6).any(axis=1)
        return orientation, velocity, None, np.asarray(diverged)

    def rest(self, motor: Array) -> Array:
        """See `orient_eye.plants.Plant`."""
        return as_orientation(self._wanted(np.asarray(motor, float)))

    def hold(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`; of motors that can do it in many ways, the least change from their rest."""
        motor, off = self._inverse(orientation, driven)
        held = off < _HELD_DEG
        if not held.all():
            worst = int((~held).argmax())
            raise InputError(
                f"the motors {', '.join(driven)} of plant {self.name!r} cannot hold orientation "
                f"{np.round(np.asarray(orientation, float)[worst], 4).tolist()} (w, x, y, z), they come within "
                f"{off[worst]:.3g} deg: choose one they can hold, or drive more motors"
            )
        return motor

    def held(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`."""
        motor, off = self._inverse(orientation, driven)
        low, high = np.array([each.working for each in self.motors]).T
        within = (off < _HELD_DEG) & ((motor >= low) & (motor <= high)).all(axis=1)
        return np.where(within[:, None], motor, np.nan)

    def motor_rates(self) -> Array:
        """See `orient_eye.plants.Plant`: of the axis about which a motor turns the eye most."""
        return self._rates[np.abs(self.surrogate.K).argmax(axis=0)]

    def _wanted(self, motor: Array) -> Array:
        """Rotation vectors [deg] (..., 3) to which motors at (..., motors) draw the eye; the same in any batch."""
        return np.asarray(np.einsum("ij,...j->...i", self.surrogate.K, motor - rests(self.motors)))

    def _inverse(self, orientation: Array, driven: tuple[str, ...]) -> tuple[Array, Array]:
        """Positions (saccades, motors) that come nearest, the others at rest, and how far off they are [deg]."""
        index = check_driven(self.motors, driven, self.name)
        with np.errstate(divide="ignore", invalid="ignore"):  # half a turn is not held
            vector = as_vector(orientation)
            motor = np.tile(rests(self.motors), (len(vector), 1))
            motor[:, index] += vector @ np.linalg.pinv(self.surrogate.K[:, index]).T
            return motor, np.asarray(np.linalg.norm(self._wanted(motor) - vector, axis=1))


def poles_of(mode: Mode) -> tuple[complex, ...]:
    """Its poles w [rad/s], one or two, as `linear_response` takes them."""
    if mode.w0 is not None:
        return (mode.w0,)
    assert mode.wn is not None
    assert mode.zeta is not None
    return tuple(pole.item() for pole in second_order_poles(mode.wn, mode.zeta))


def restore(identity: dict[str, Any]) -> ModalPlant:
    """The plant of an identity; see `ModalPlant.identity`.

    Raises:
        InputError: it is that of no modal plant.
    """
    try:
        return ModalPlant(ModalSurrogate.from_plain({key: told for key, told in identity.items() if key != "plant"}))
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"this is no identity of plant 'modal' ({error}): take one that `identity` gave") from error
