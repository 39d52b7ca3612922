"""Step responses of a plant: the thesis' experiment (section 3.3.1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.checks import real, whole
from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.motor import Motor, check_driven
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import Plant
from orient_eye.state import State
from orient_eye.sysid.step_response import StepResponse, axis_angle

Array = NDArray[np.float64]
DURATION_S = 0.8
"""Of each response, as in the thesis author's program."""
_MOST, _LEAST_DEG = 1000, 0.01  # steps, and how small one may be to be a step
_TURNS_DEG = 1e-3  # of the eye for a motor at 1: less is rounding
_ALIKE = 1e-6  # of motors that mirror each other, the first


@dataclass(frozen=True)
class PlantSteps:
    """Responses of a plant to ideal steps.

    Attributes:
        motor: that stepped.
        axis: angle of the eye that was watched.
        steps: one for each amplitude.
        trajectory: the same as a batch of saccades.
        warnings: what is unusual about the amplitudes.
    """

    motor: Motor
    axis: str
    steps: tuple[StepResponse, ...]
    trajectory: Trajectory
    warnings: tuple[str, ...]


def plant_steps(
    plant: Plant, amplitudes: Sequence[float], motor: str | None = None, axis: str | None = None
) -> PlantSteps:
    """Step one motor to each amplitude and watch the eye for 0.8 s.

    The eye starts at rest with all motors at 0; the stepped motor stands at the amplitude from time 0 on. One with
    limits is told to from the second sample on, and goes there as fast as it can.

    Args:
        plant: any of `orient_eye.plants.PLANTS`.
        amplitudes: in the motor's unit, 0.01 or more to either side, inside its mechanical range.
        motor: name of the motor that steps; None for the one that turns the eye most purely about the axis.
        axis: angle of the eye that is watched: yaw, pitch or roll; None for the angle that the motor turns most, or
            without a motor the first of these three that the plant turns.

    Raises:
        InputError: a motor or an axis the plant has not, amplitudes it cannot do, or a simulation that diverged.
    """
    name, axis = _chosen(plant, motor, axis)
    (index,) = check_driven(plant.motors, [name], plant.name)
    stepped = plant.motors[index]
    amplitudes = _checked(amplitudes, stepped)
    samples = round(DURATION_S / plant.step_s) + 1
    command = np.zeros((len(amplitudes), samples, len(plant.motors)))
    limited = stepped.speed_limit is not None or stepped.acceleration_limit is not None
    command[:, int(limited) :, index] = np.array(amplitudes)[:, None]
    still = np.zeros((len(amplitudes), len(plant.motors)))
    trajectory = plant.move(command, State(plant.rest(still), still)).trajectory()
    if trajectory.failed.any():
        bad = ", ".join(f"{a:g}" for a, failed in zip(amplitudes, trajectory.failed, strict=True) if failed)
        raise InputError(f"plant {plant.name!r} diverged for steps of {bad} {stepped.unit}; leave them out")
    angle = axis_angle(trajectory.orientation, axis)
    steps = tuple(
        StepResponse(
            name=f"{amplitude:g} {stepped.unit}",
            time=trajectory.time,
            motor_deg=trajectory.motor[i, :, index],
            eye_deg=angle[i] - angle[i, 0],
            orientation=trajectory.orientation[i],
        )
        for i, amplitude in enumerate(amplitudes)
    )
    return PlantSteps(stepped, axis, steps, trajectory, tuple(_warnings(amplitudes, stepped)))


def _chosen(plant: Plant, motor: str | None, axis: str | None) -> tuple[str, str]:
    """Name of the motor that steps and the angle that is watched, where they are not said."""
    if axis is not None and axis not in AXES:
        raise InputError(f"unknown angle {axis!r} of the eye; choose one of {', '.join(AXES)}")
    ones = np.concatenate([np.zeros((1, len(plant.motors))), np.eye(len(plant.motors))])
    angles = np.stack(rotations.to_euler(plant.rest(ones)), axis=-1)
    turned = np.abs(angles[1:] - angles[0])  # (motors, 3), by each motor at 1
    if motor is not None:
        (index,) = check_driven(plant.motors, [motor], plant.name)
        return motor, axis or AXES[int(turned[index].argmax())]
    about = AXES.index(axis) if axis else int((turned.max(axis=0) > _TURNS_DEG).argmax())
    turns = turned[:, about] > _TURNS_DEG
    if not turns.any():
        raise InputError(f"no motor of plant {plant.name!r} turns the eye in {AXES[about]}; watch another angle")
    share = np.where(turns, turned[:, about], 0) / np.maximum(turned.sum(axis=1), _TURNS_DEG)
    return plant.motors[int((share > share.max() - _ALIKE).argmax())].name, AXES[about]


def _checked(amplitudes: Sequence[float], motor: Motor) -> list[float]:
    whole("the number of steps", len(amplitudes), 1, _MOST, advice="each is fitted by itself; name fewer")
    low, high = np.clip(motor.range, -360.0, 360.0)
    beyond = f"that is the mechanical range of {motor.name}; choose smaller amplitudes"
    values = [real("the amplitude of a step", a, low, high, unit=motor.unit, advice=beyond) for a in amplitudes]
    for a in values:
        if abs(a) < _LEAST_DEG:
            raise InputError(f"a step of {a:g} {motor.unit} shows nothing; choose {_LEAST_DEG:g} {motor.unit} or more")
    if len(set(values)) != len(values):
        raise InputError(f"an amplitude is named twice among {', '.join(f'{a:g}' for a in values)}; name each once")
    return values


def _warnings(amplitudes: list[float], motor: Motor) -> list[str]:
    low, high = motor.working
    beyond = [f"{a:g}" for a in amplitudes if not low <= a <= high]
    if not beyond:
        return []
    return [
        f"steps to {', '.join(beyond)} {motor.unit} leave the working range of {motor.name}, {low:g} to {high:g} "
        f"{motor.unit}: past it an elastic eye bends over, and no linear model fits"
    ]
