"""Step responses of a plant: the thesis' experiment (section 3.3.1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.movement.trajectory import EyeState, Trajectory
from orient_eye.plants import Plant
from orient_eye.sysid.step_response import StepResponse, axis_angle

Array = NDArray[np.float64]
DURATION_S = 0.8
"""Of each response, as in the thesis author's program."""
_BENDS_OVER_DEG = 50.0  # past it the straight tendons run through the eye


@dataclass(frozen=True)
class PlantSteps:
    """Responses of a plant to ideal steps.

    Attributes:
        steps: one for each amplitude.
        trajectory: the same as a batch of saccades.
        warnings: what is unusual about the amplitudes.
    """

    steps: tuple[StepResponse, ...]
    trajectory: Trajectory
    warnings: tuple[str, ...]


def plant_steps(plant: Plant, amplitudes: Sequence[float], motor: str = "motor2", axis: str = "yaw") -> PlantSteps:
    """Step one motor to each amplitude and watch the eye for 0.8 s.

    The eye starts at rest with all motors at 0; the arm of the stepped motor stands at the amplitude
    from time 0 on.

    Args:
        plant: any of `orient_eye.plants.PLANTS`.
        amplitudes: [deg], not 0, inside the motor's mechanical range.
        motor: name of the motor that steps.
        axis: angle of the eye that is watched: yaw, pitch or roll.

    Raises:
        InputError: a motor the plant has not, amplitudes it cannot do, or a simulation that diverged.
    """
    amplitudes = _checked(plant, amplitudes, motor)
    samples = round(DURATION_S / plant.step_s) + 1
    command = np.zeros((len(amplitudes), samples, len(plant.motors)))
    command[:, :, plant.motors.index(motor)] = np.array(amplitudes)[:, None]
    rest = plant.rest_orientation(np.zeros((len(amplitudes), len(plant.motors))))
    trajectory = plant.simulate(command, EyeState(rest))
    if trajectory.failed.any():
        bad = ", ".join(f"{a:g}" for a, failed in zip(amplitudes, trajectory.failed, strict=True) if failed)
        raise InputError(f"plant {plant.name!r} diverged for steps of {bad} deg; leave them out")
    angle = axis_angle(trajectory.orientation, axis)
    steps = tuple(
        StepResponse(
            name=f"{amplitude:g} deg",
            time=trajectory.time,
            motor_deg=np.full(samples, amplitude),
            eye_deg=angle[i] - angle[i, 0],
            orientation=trajectory.orientation[i],
        )
        for i, amplitude in enumerate(amplitudes)
    )
    large = [a for a in amplitudes if abs(a) > _BENDS_OVER_DEG]
    warnings = (
        [f"steps past {_BENDS_OVER_DEG:g} deg of motor ({large}): the elastic eye's response bends over there"]
        if large and plant.name != "lpf"
        else []
    )
    return PlantSteps(steps, trajectory, tuple(warnings))


def _checked(plant: Plant, amplitudes: Sequence[float], motor: str) -> list[float]:
    if motor not in plant.motors:
        raise InputError(f"plant {plant.name!r} has no motor {motor!r}; choose one of {', '.join(plant.motors)}")
    values = [float(a) for a in amplitudes]
    low, high = plant.motor_range_deg[plant.motors.index(motor)]
    for a in values:
        if a == 0 or not np.isfinite(a):
            raise InputError(f"a step of {a:g} deg shows nothing; amplitudes are finite and not 0")
        if not low <= a <= high:
            raise InputError(
                f"a step of {a:g} deg is outside the mechanical range of {motor}, {low:.0f} to {high:.0f} deg; "
                "choose smaller amplitudes"
            )
    if len(set(values)) != len(values):
        raise InputError(f"an amplitude is named twice among {', '.join(f'{a:g}' for a in values)}; name each once")
    return values
