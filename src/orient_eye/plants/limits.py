"""What a rig's motors can do, put on the motors of a plant: range, largest speed and acceleration.

    limits = limits_of("rig.toml", motors, "mujoco") # plain values by motor, for identities
    motors = limited(motors, limits)

An elastic eye has motors of its own, and a rig's motor of the same name limits one. A surrogate has one motor, the
drive of its axis, and the rig says what that can do.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from orient_eye import rotations
from orient_eye.commands.motor_file import Wiring
from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.motor import Motor, names, rests
from orient_eye.plants import Plant
from orient_eye.rig import Rig
from orient_eye.surrogate import Surrogate

Limits = Mapping[str, Mapping[str, Any]]
"""Motor to its `range`, `speed_limit` and `acceleration_limit`, those that are known."""
_LEAST_DEG = 1e-3  # by which a degree of a motor turns the eye


def as_rig(rig: Rig | str | Path) -> Rig:
    """A rig, from its file or the name of a shipped one."""
    return rig if isinstance(rig, Rig) else Rig.load(rig)


def limits_of(rig: Rig | Limits | str | Path, motors: Sequence[Motor], plant: str) -> dict[str, dict[str, Any]]:
    """Limits of a plant's motors by the rig's motors of the same names, plain values; ranges are cut with the plant's.

    Args:
        rig: or its limits, as this function gives them.
        motors: of the plant.
        plant: its name, for messages.

    Raises:
        InputError: a motor that the plant has not, no range in common, or one in which a motor does not rest.
    """
    given = rig if isinstance(rig, Mapping) else _limits_by_motor(as_rig(rig))
    strange = [name for name in given if name not in names(motors)]
    if strange:
        raise InputError(
            f"the rig's motors {', '.join(strange)} are none of plant {plant!r}, whose motors are "
            f"{', '.join(names(motors))}; name them alike, or use a surrogate identified on the rig"
        )
    found: dict[str, dict[str, Any]] = {}
    for motor in motors:
        told = dict(given.get(motor.name, {}))
        if set(told) - {"range", "speed_limit", "acceleration_limit"}:
            raise InputError(f"motor {motor.name!r} has the limits range, speed_limit, acceleration_limit, got {told}")
        if "range" in told:
            low, high = (float(end) for end in told["range"])
            told["range"] = [max(low, motor.range[0]), min(high, motor.range[1])]
            if motor.rest and not told["range"][0] <= motor.rest <= told["range"][1]:
                raise InputError(
                    f"the rig lets motor {motor.name!r} go from {low:g} to {high:g} {motor.unit}, but it stands "
                    f"at {motor.rest:.4g} when the eye looks straight ahead: choose a range around that"
                )
        if told:
            found[motor.name] = told
    limited(motors, found)
    return found


def _limits_by_motor(rig: Rig) -> dict[str, dict[str, Any]]:
    """Of the motors that turn the eye."""
    turning = {name for drive in rig.axes.values() for name in drive}
    found = {}
    for motor in rig.motors:
        told: dict[str, Any] = {"speed_limit": motor.speed_limit, "acceleration_limit": motor.acceleration_limit}
        told = {key: float(value) for key, value in told.items() if value is not None}
        if any(map(isfinite, motor.range)):
            told["range"] = list(motor.range)
        if motor.name in turning:
            found[motor.name] = told
    return found


def limited(motors: Sequence[Motor], limits: Limits) -> tuple[Motor, ...]:
    """Motors with limits.

    Raises:
        InputError: a range or limit that is none.
    """
    told = [dict(limits.get(motor.name, {})) for motor in motors]
    for each in told:
        if "range" in each:
            each["range"] = (each["range"][0], each["range"][1])
    return tuple(replace(motor, **each) for motor, each in zip(motors, told, strict=True))


def limited_surrogate(surrogate: Surrogate, rig: Rig | str | Path | None) -> Surrogate:
    """A surrogate whose motor has the limits of its axis' drive on a rig.

    Args:
        surrogate: any.
        rig: None for the one inside the surrogate, if there is one; what that does not know stays.

    Raises:
        InputError: a rig that does not turn this axis, or drives it otherwise than the one inside the surrogate.
    """
    inside = None if surrogate.rig is None else Rig.from_plain(surrogate.rig, "the rig inside the surrogate")
    described = inside if rig is None else as_rig(rig)
    if described is None:
        return surrogate
    drive, axis = described.drive(surrogate.axis), surrogate.axis
    if inside is not None and dict(inside.axes.get(axis, {})) != dict(described.axes[axis]):
        raise InputError(
            f"the surrogate was identified with the {axis} drive {dict(inside.axes.get(axis, {}))}, rig "
            f"{described.name!r} has {dict(described.axes[axis])}; give the rig it was identified with"
        )
    known: dict[str, Any] = {"speed_limit": drive.speed_limit, "acceleration_limit": drive.acceleration_limit}
    known["range"] = drive.range if any(map(isfinite, drive.range)) else None
    return replace(surrogate, **{key: value for key, value in known.items() if rig is not None or value is not None})


def are_limited(motors: Sequence[Motor]) -> bool:
    """Whether one has a limit of speed or acceleration."""
    return any(motor.speed_limit or motor.acceleration_limit for motor in motors)


def travel_s(motors: Sequence[Motor]) -> float:
    """How long the slowest motor takes from one end of its working range to the other [s]; 0 without limits."""
    longest = 0.0
    for motor in motors:
        span = motor.working[1] - motor.working[0]
        travel = span / motor.speed_limit if motor.speed_limit else 0.0
        if motor.acceleration_limit:
            travel += 2 * float(np.sqrt(span / motor.acceleration_limit))
        longest = max(longest, travel)
    return longest


def wiring(plant: Plant, rig: Rig | str | Path) -> Wiring:
    """How the motors of a plant stand for those of a rig: by name, or its one motor for the drive of its axis.

    Raises:
        InputError: neither.
    """
    described = as_rig(rig)
    if len(plant.motors) == 1:
        one, zero = (rotations.rotation(plant.rest(rests(plant.motors)[None] + by)) for by in (1.0, 0.0))
        turned = one * zero.inv()
        angles = np.abs(rotations.to_euler(turned.as_quat(scalar_first=True)))[:, 0]
        axis = AXES[int(angles.argmax())]
        if angles.max() > _LEAST_DEG and axis in described.axes:
            return Wiring(described, plant.motors, axis)
    strange = [name for name in names(plant.motors) if name not in [motor.name for motor in described.motors]]
    if strange:
        raise InputError(
            f"plant {plant.name!r} is moved by {', '.join(names(plant.motors))}; rig {described.name!r} has the motors "
            f"{', '.join(motor.name for motor in described.motors)} and turns {', '.join(described.axes)}: use a plant "
            "identified on this rig, or name the motors alike"
        )
    return Wiring(described, plant.motors)
