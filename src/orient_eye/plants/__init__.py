"""Plants: what a motor command does to the eye.

    plant = make_plant("mujoco")                     # or "lpf", "tavares"
    trajectory = plant.simulate(command)             # command (saccades, time, motors) [deg]

Every plant is a `Plant`; the name picks it from `PLANTS`. To add one, write a class with these
members and put it in that table: environment, trainer, sysid and command line then know it.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.movement.trajectory import EyeState, Trajectory

Array = NDArray[np.float64]
ELASTIC_ACTION_RANGE_DEG = 40.0
"""Where a policy may end a saccade of the elastic eye: 61.8 deg of yaw. The straight tendons run inside
the eyeball already at small angles, and past about 50 deg of motor the response bends over; targets
within 35 deg of yaw need 23.5."""


@runtime_checkable
class Plant(Protocol):
    """From a batch of start states and motor commands to a trajectory.

    Attributes:
        name: key in `PLANTS`.
        motors: names, (motors,).
        step_s: interval between the samples of commands and trajectories [s].
        motor_range_deg: mechanical range, (motors, 2) [deg]; commands outside are refused.
        action_range_deg: where a policy may end a saccade (D of the pulse-step), (motors, 2) [deg].
    """

    name: str
    motors: tuple[str, ...]
    step_s: float
    motor_range_deg: Array
    action_range_deg: Array

    def simulate(self, command: Array, start: EyeState | None = None) -> Trajectory:
        """Run a batch of saccades.

        Args:
            command: motor positions [deg], (saccades, time, motors), row k at time k * step_s.
            start: state at time 0; None for the equilibrium of the first row of the command.

        Returns:
            The trajectory at the same times. A saccade that diverged is marked failed and is NaN.

        Raises:
            InputError: wrong shape, or a command outside the mechanical range.
        """
        ...

    def rest_orientation(self, motor: Array) -> Array:
        """Orientations (saccades, 4) in which the eye rests at motor positions [deg] (saccades, motors)."""
        ...

    def rest_motor(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """Motor positions [deg] (saccades, motors) at which the eye rests in these orientations.

        Only the driven motors move, the others stand at 0; the inverse of `rest_orientation`.

        Raises:
            InputError: an orientation that the driven motors cannot hold.
        """
        ...

    def identity(self) -> dict[str, Any]:
        """What makes this plant this one, for manifests: name, options, hash of the model."""
        ...


def _mujoco(**options: Any) -> Plant:
    from orient_eye.plants.mujoco import MujocoPlant

    return MujocoPlant(**options)


def _lpf(**options: Any) -> Plant:
    from orient_eye.plants.lpf import LowPassPlant

    return LowPassPlant(**options)


def _tavares(**options: Any) -> Plant:
    from orient_eye.plants.tavares import TavaresPlant

    return TavaresPlant(**options)


PLANTS: dict[str, Callable[..., Plant]] = {"mujoco": _mujoco, "lpf": _lpf, "tavares": _tavares}
"""Name to plant. Each entry takes the options of its class as keywords."""


def make_plant(name: str, **options: Any) -> Plant:
    """The plant of that name.

    Args:
        name: one of `PLANTS`.
        options: the keywords of its class: `MujocoPlant`, `LowPassPlant`, `TavaresPlant`.

    Raises:
        InputError: unknown name.
    """
    if name not in PLANTS:
        raise InputError(f"unknown plant {name!r}; choose one of {', '.join(PLANTS)}")
    return PLANTS[name](**options)


def chosen_plant(name: str, surrogate: str | Path, eye: str) -> Plant:
    """The plant that the options --plant, --surrogate and --eye choose.

    Args:
        name: one of `PLANTS`.
        surrogate: for lpf: a file, or the name of a shipped one.
        eye: for the others: preset of the eye.

    Raises:
        InputError: unknown, or an option that does nothing on this plant.
    """
    option, given = ("--eye", eye) if name == "lpf" else ("--surrogate", surrogate)
    if given != "thesis":
        raise InputError(f"{option} does nothing on plant {name!r}; leave it out or choose another plant")
    return make_plant(name, surrogate=surrogate) if name == "lpf" else make_plant(name, eye=eye)


def plant_in_words(identity: dict[str, Any]) -> str:
    """A plant's identity for people: "lpf (K = 1.4758, w0 = 17.5)"."""
    options = {key: value for key, value in identity.items() if key not in ("plant", "model", "motor")}
    words = [
        str(value) if key == "eye" else f"{key} = {value_in_words(value)}"
        for key, value in options.items()
        if value is not False
    ]
    return f"{identity.get('plant')} ({', '.join(words)})"


def value_in_words(value: Any) -> str:
    """A plain value for people."""
    if isinstance(value, dict):
        return ", ".join(f"{key} = {value_in_words(item)}" for key, item in value.items())
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(value_in_words, value)) + "]"
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def check_command(plant: Plant, command: Any) -> Array:
    """The command as float64 (saccades, time, motors) inside the plant's mechanical range.

    Rows that are not finite pass: the plant marks such a saccade as failed.

    Raises:
        InputError: wrong shape, or outside the range.
    """
    command = np.asarray(command, dtype=float)
    if command.ndim != 3 or command.shape[2] != len(plant.motors) or command.shape[1] < 1:
        raise InputError(
            f"a command of plant {plant.name!r} has the shape (saccades, time, {len(plant.motors)} motors: "
            f"{', '.join(plant.motors)}), got {command.shape}"
        )
    low, high = plant.motor_range_deg.T
    tolerance = 1e-9 * np.maximum(abs(low), abs(high))
    outside = (command < low - tolerance) | (command > high + tolerance)
    if outside.any():
        saccade, row, motor = (int(i[0]) for i in outside.nonzero())
        raise InputError(
            f"saccade {saccade} sends {plant.motors[motor]} to {command[saccade, row, motor]:.1f} deg at "
            f"{row * plant.step_s:.3f} s; its mechanical range is {low[motor]:.0f} to {high[motor]:.0f} deg: "
            "make the command smaller"
        )
    return command


def check_start(start: EyeState, saccades: int) -> tuple[Array, Array]:
    """Orientation (saccades, 4), normalised, and angular velocity [deg/s] (saccades, 3) of a start.

    Raises:
        InputError: shapes that do not fit the command.
    """
    orientation = np.asarray(start.orientation, dtype=float)
    velocity = np.zeros((saccades, 3)) if start.angular_velocity is None else np.asarray(start.angular_velocity, float)
    if orientation.shape != (saccades, 4) or velocity.shape != (saccades, 3):
        raise InputError(
            f"{saccades} saccades need start orientations of shape ({saccades}, 4) and angular velocities of shape "
            f"({saccades}, 3), got {orientation.shape} and {velocity.shape}"
        )
    norm = np.linalg.norm(orientation, axis=-1, keepdims=True)
    if (norm == 0).any():
        raise InputError("a start orientation is the zero quaternion; looking straight ahead is (1, 0, 0, 0)")
    return orientation / norm, velocity
