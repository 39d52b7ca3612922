"""Step responses of a plant: the thesis' experiment (section 3.3.1)."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.checks import real, whole
from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.motor import Motor, check_driven, rests
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import Plant
from orient_eye.state import State
from orient_eye.sysid.step_response import StepResponse, axis_angle

Array = NDArray[np.float64]
DURATION_S = 0.8
"""Of each response, as in the thesis author's program; longer of an eye that has not gone most of the way then."""
_LONGEST_S = 8.0
_MOST_OF_IT = 3.0  # time constants: 95 %
_PARTS = 16  # of the way of a step, at each of which the eye has to find a rest nearby
_AWAY, _AWAY_DEG = 3.0, 60.0  # so many times as far as the gain has it, and so far: it went to another rest
_MOST, _LEAST_DEG = 1000, 0.01  # steps, and how small one may be to be a step
_TURN_DEG = 1.0  # of a motor, to see how far it turns the eye
_TURNS_DEG = 1e-3  # of the eye for a motor at 1: less is rounding
_ALIKE = 1e-6  # of motors that mirror each other, the first


@dataclass(frozen=True)
class PlantSteps:
    """Responses of a plant to ideal steps.

    Attributes:
        motor: that stepped.
        axis: angle of the eye that was watched.
        amplitudes: of the steps, from where the motor rests, without those that ran away.
        steps: one for each amplitude.
        trajectory: the same as a batch of saccades.
        warnings: what is unusual about the amplitudes.
    """

    motor: Motor
    axis: str
    amplitudes: tuple[float, ...]
    steps: tuple[StepResponse, ...]
    trajectory: Trajectory
    warnings: tuple[str, ...]


def plant_steps(
    plant: Plant, amplitudes: Sequence[float], motor: str | None = None, axis: str | None = None
) -> PlantSteps:
    """Step one motor by each amplitude and watch the eye: for 0.8 s, or for three time constants of the motor's pole.

    The eye starts at rest with all motors at theirs; the stepped motor stands off its rest by the amplitude from time 0
    on. One with limits is told to from the second sample on, and goes there as fast as it can. Steps from which the eye
    runs away, as it is not stable on its way, are left out and told.

    Args:
        plant: any of `orient_eye.plants.PLANTS`.
        amplitudes: from the motor's rest, in its unit, 0.01 or more to either side, inside its mechanical range.
        motor: name of the motor that steps; None for the one that turns the eye most purely about the axis.
        axis: angle of the eye that is watched: yaw, pitch or roll; None for the angle that the motor turns most, or
            without a motor the first of these three that the plant turns.

    Raises:
        InputError: a motor or an axis the plant has not, amplitudes it cannot do, a simulation that diverged, or steps
            that all run away.
    """
    name, axis = _chosen(plant, motor, axis)
    (index,) = check_driven(plant.motors, [name], plant.name)
    stepped = plant.motors[index]
    asked = _checked(amplitudes, stepped)
    away = _runs_away(plant, index, asked)
    amplitudes = [a for a, gone in zip(asked, away, strict=True) if not gone]
    warnings = _warnings(amplitudes, stepped)
    if away.any():
        gone = listed(sorted(np.array(asked)[away], key=abs))
        told = f"plant {plant.name!r} runs away from steps of {stepped.name} by {gone} {stepped.unit}"
        if not amplitudes:
            raise InputError(f"{told}: it has no rest near where its gain has it; choose smaller steps")
        warnings.append(f"{told}: it has no rest near where its gain has it; they are left out")
    samples = round(_duration_s(plant, index) / plant.step_s) + 1
    still = np.tile(rests(plant.motors), (len(amplitudes), 1))
    command = np.repeat(still[:, None], samples, axis=1)
    limited = stepped.speed_limit is not None or stepped.acceleration_limit is not None
    command[:, int(limited) :, index] += np.array(amplitudes)[:, None]
    trajectory = plant.move(command, State(plant.rest(still), still)).trajectory()
    if trajectory.failed.any():
        bad = ", ".join(f"{a:g}" for a, failed in zip(amplitudes, trajectory.failed, strict=True) if failed)
        raise InputError(f"plant {plant.name!r} diverged for steps of {bad} {stepped.unit}; leave them out")
    angle = axis_angle(trajectory.orientation, axis)
    steps = tuple(
        StepResponse(
            name=f"{amplitude:g} {stepped.unit}",
            time=trajectory.time,
            motor_deg=trajectory.motor[i, :, index] - stepped.rest,
            eye_deg=angle[i] - angle[i, 0],
            orientation=trajectory.orientation[i],
        )
        for i, amplitude in enumerate(amplitudes)
    )
    return PlantSteps(stepped, axis, tuple(amplitudes), steps, trajectory, tuple(warnings))


def listed(amplitudes: Sequence[float]) -> str:
    """For people: of many the first two and the last."""
    values = [f"{a:g}" for a in amplitudes]
    return ", ".join(values) if len(values) <= 4 else f"{values[0]}, {values[1]}, ..., {values[-1]}"


def _duration_s(plant: Plant, index: int) -> float:
    """How long a step of a motor is watched [s]."""
    rate = float(plant.motor_rates()[index])
    needed = _MOST_OF_IT / rate if rate > 0 else 0.0
    return min(max(DURATION_S, float(np.ceil(10 * needed) / 10)), _LONGEST_S)


def _runs_away(plant: Plant, index: int, amplitudes: Sequence[float]) -> NDArray[np.bool_]:
    """Whether the eye, followed on the way of a step, comes to where only a rest far away is left, (steps,)."""
    share = np.concatenate([[0.0], np.arange(1, _PARTS + 1) / _PARTS])
    motor = np.tile(rests(plant.motors), (len(amplitudes), len(share), 1))
    motor[..., index] += np.array(amplitudes)[:, None] * share
    unit = np.tile(rests(plant.motors), (2, 1))
    unit[1, index] += _TURN_DEG
    gain = _turned(_rest(plant, unit[None]))[0, 1] / _TURN_DEG
    turned = _turned(_rest(plant, motor))
    expected = gain * np.abs(np.array(amplitudes))[:, None] * share
    return np.asarray((~(turned <= np.maximum(_AWAY_DEG, _AWAY * expected))).any(axis=1))


def _rest(plant: Plant, motor: Array) -> Array:
    """Orientations (n, m, 4) at motors (n, m, motors); NaN where the eye finds no rest."""
    rows = motor.reshape(-1, motor.shape[-1])
    try:
        found = plant.rest(rows)
    except InputError:
        found = np.full((len(rows), 4), np.nan)
        for i, row in enumerate(rows):
            with contextlib.suppress(InputError):
                found[i] = plant.rest(row[None])[0]
    return np.asarray(found).reshape(*motor.shape[:-1], 4)


def _turned(orientation: Array) -> Array:
    """Angle [deg] (n, m) between each orientation (n, m, 4) and the first of its row."""
    return rotations.angle_between(orientation, orientation[:, :1])


def _chosen(plant: Plant, motor: str | None, axis: str | None) -> tuple[str, str]:
    """Name of the motor that steps and the angle that is watched, where they are not said."""
    if axis is not None and axis not in AXES:
        raise InputError(f"unknown angle {axis!r} of the eye; choose one of {', '.join(AXES)}")
    ones = np.concatenate([np.zeros((1, len(plant.motors))), np.eye(len(plant.motors))])
    angles = np.stack(rotations.to_euler(plant.rest(rests(plant.motors) + _TURN_DEG * ones)), axis=-1)
    turned = np.abs(angles[1:] - angles[0])  # (motors, 3), by each motor
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
    low, high = np.clip(np.subtract(motor.range, motor.rest), -360.0, 360.0)
    off = f" from where it rests, at {motor.rest:g} {motor.unit}" if motor.rest else ""
    beyond = f"that is the mechanical range of {motor.name}{off}; choose smaller amplitudes"
    values = [real("the amplitude of a step", a, low, high, unit=motor.unit, advice=beyond) for a in amplitudes]
    for a in values:
        if abs(a) < _LEAST_DEG:
            raise InputError(f"a step of {a:g} {motor.unit} shows nothing; choose {_LEAST_DEG:g} {motor.unit} or more")
    if len(set(values)) != len(values):
        raise InputError(f"an amplitude is named twice among {', '.join(f'{a:g}' for a in values)}; name each once")
    return values


def _warnings(amplitudes: list[float], motor: Motor) -> list[str]:
    low, high = np.subtract(motor.working, motor.rest)
    beyond = [f"{a:g}" for a in amplitudes if not low <= a <= high]
    if not beyond:
        return []
    return [
        f"steps to {', '.join(beyond)} {motor.unit} leave the working range of {motor.name}, {low:g} to {high:g} "
        f"{motor.unit}: past it an elastic eye bends over, and no linear model fits"
    ]
