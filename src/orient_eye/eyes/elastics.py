"""The geometry of a compiled eye as plain arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.eyes.model import Tendons, motors
from orient_eye.motor import names

Array = NDArray[np.float64]
_TAKE = "take plant 'mujoco'"
_NOT_KNOWN = f"the compiled plants know no other path; {_TAKE}"


@dataclass(frozen=True)
class Elastics:
    """Geometry of a compiled eye as plain arrays, for programs that do not step MuJoCo.

    Attributes:
        insertion: on the eye, eye coordinates [m], (tendons, 3).
        via: fixed via point, head coordinates [m], (tendons, 3); NaN where there is none.
        arm_end: on the arm, from its centre, the motor at 0 [m], head coordinates, (tendons, 3); of a cable that a
            spindle winds up, 0.
        motor: index of the motor that pulls, (tendons,).
        stiffness: [N/m], (tendons,).
        rest_length: [m], (tendons,).
        wound: by a spindle, of the cable's length [m/rad], (tendons,); 0 for an arm's.
        arm_centre: a point of the motor's axis, head coordinates [m], (motors, 3); of a spindle, 0.
        arm_axis: unit vector, head coordinates, (motors, 3); of a spindle, 0.
        slides: whether an arm goes along its axis, instead of turning about it, (motors,); of a spindle, True.
        per_degree: how far a motor's arm goes for a degree of it [rad or m], or its spindle turns [rad], (motors,).
        inertia: about the centre of rotation at rest [kg m^2], (3, 3).
        friction: isotropic [N m s/rad].
        mass: of the eye [kg].
        centre_of_mass: eye coordinates [m], (3,).
    """

    insertion: Array
    via: Array
    arm_end: Array
    motor: NDArray[np.intp]
    stiffness: Array
    rest_length: Array
    wound: Array
    arm_centre: Array
    arm_axis: Array
    slides: NDArray[np.bool_]
    per_degree: Array
    inertia: Array
    friction: float
    mass: float
    centre_of_mass: Array

    @classmethod
    def from_model(cls, model: mujoco.MjModel) -> "Elastics":
        """Read the geometry from the compiled model, following each tendon's path of sites.

        Raises:
            InputError: a tendon with another kind of path, an arm on a moving body, an eye not at the origin, or
                forces that none of these arrays has.
        """
        eye, tendons = model.body("eye").id, Tendons.of(model)
        if model.body_parentid[eye] or model.body_pos[eye].any() or model.jnt_pos[model.joint("eye").id].any():
            raise InputError(f"the eye does not turn about the origin of the head; {_NOT_KNOWN}")
        actuators = [model.actuator(name) for name in names(motors(model))]
        if others := _others(model, actuators):
            raise InputError(f"the eye has {', '.join(others)}; the compiled plants know nothing of it; {_TAKE}")
        arms = [_Arm.of(model, int(each.trnid[0])) if _on_joint(each) else None for each in actuators]
        bodies = [None if arm is None else arm.body for arm in arms]
        insertion, via, arm_end, motor = [], [], [], []
        for tendon in range(model.ntendon):
            start = model.tendon_adr[tendon]
            path = slice(start, start + model.tendon_num[tendon])
            sites = model.wrap_objid[path]
            on_eye = [s for s in sites if model.site_bodyid[s] == eye]
            on_arm = [s for s in sites if model.site_bodyid[s] in bodies]
            fixed = [s for s in sites if model.site_bodyid[s] == 0]
            spindle = int(tendons.motor[tendon])
            if (
                (model.wrap_type[path] != mujoco.mjtWrap.mjWRAP_SITE).any()
                or len(on_eye) + len(on_arm) + len(fixed) != len(sites)
                or len(on_eye) != 1
                or (len(on_arm), len(fixed)) not in ([(1, 0), (1, 1)] if spindle < 0 else [(0, 1)])
            ):
                raise InputError(
                    f"tendon {model.tendon(tendon).name!r} must run from a site on an arm, past at most one fixed "
                    "site, to a site on the eye, or where a motor winds it up from a fixed site to the eye; "
                    f"{_NOT_KNOWN}"
                )
            insertion.append(model.site_pos[on_eye[0]])
            via.append(model.site_pos[fixed[0]] if fixed else np.full(3, np.nan))
            motor.append(bodies.index(model.site_bodyid[on_arm[0]]) if on_arm else spindle)
            arm = arms[motor[-1]]
            arm_end.append(np.zeros(3) if arm is None else arm.turn @ (model.site_pos[on_arm[0]] - arm.anchor))
        turned = _matrix(model.body("eye").iquat)
        return cls(
            insertion=np.array(insertion),
            via=np.array(via),
            arm_end=np.array(arm_end),
            motor=np.array(motor),
            stiffness=tendons.stiffness,
            rest_length=tendons.rest_length,
            wound=tendons.wound,
            arm_centre=np.array([np.zeros(3) if arm is None else arm.centre for arm in arms]),
            arm_axis=np.array([np.zeros(3) if arm is None else arm.axis for arm in arms]),
            slides=np.array([arm is None or arm.slides for arm in arms]),
            per_degree=np.deg2rad(1) / np.array([each.gear[0] for each in actuators]),
            inertia=turned @ np.diag(model.body("eye").inertia) @ turned.T,
            friction=float(model.dof_damping[model.joint("eye").dofadr[0]]),
            mass=float(model.body("eye").mass[0]),
            centre_of_mass=model.site("centre_of_mass").pos.copy(),
        )


@dataclass(frozen=True)
class _Arm:
    """Of a motor: its body, how that is turned in the head, the joint's anchor on it, and its axis in the head."""

    body: int
    turn: Array
    anchor: Array
    centre: Array
    axis: Array
    slides: bool

    @classmethod
    def of(cls, model: mujoco.MjModel, joint: int) -> "_Arm":
        body = int(model.jnt_bodyid[joint])
        if model.body_parentid[body]:
            raise InputError(f"arm {model.body(body).name!r} moves with another body; {_NOT_KNOWN}")
        turn, anchor = _matrix(model.body_quat[body]), model.jnt_pos[joint].copy()
        centre = model.body_pos[body] + turn @ anchor
        slides = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
        return cls(body, turn, anchor, centre, turn @ model.jnt_axis[joint], bool(slides))


def _others(model: mujoco.MjModel, actuators: Sequence[Any]) -> list[str]:
    """What moves an eye in MuJoCo and stands in no array of `Elastics`."""
    eye, elastic = model.joint("eye"), model.tendon_stiffness > 0
    own = eye.dofadr[0] + np.arange(3)
    arms = [each for each in actuators if _on_joint(each)]
    joints = [model.joint(each.trnid[0]) for each in arms]
    found: dict[str, list[Any]] = {
        "an inertial off its centre": [model.body("eye").ipos],
        "a stiffness of its joint": [eye.stiffness, model.jnt_stiffnesspoly[eye.id]],
        "a stiffness that is no constant": [model.tendon_stiffnesspoly],
        "a damping of its tendons or motors, or one that is no constant": [
            model.tendon_damping, model.tendon_dampingpoly, model.actuator_damping, model.dof_dampingpoly[own]
        ],
        "an armature": [model.dof_armature[own], model.tendon_armature, model.actuator_armature],
        "a friction loss": [model.dof_frictionloss[own], model.tendon_frictionloss],
        "a springlength that begins above 0": [model.tendon_lengthspring[elastic, 0]],
        "a ref of a motor's joint": [model.qpos0[each.qposadr] for each in joints],
        "a forcerange of a servo": [each.forcelimited for each in arms],
        "a medium around it": [model.opt.density, model.opt.viscosity],
    }  # fmt: skip
    return [what for what, values in found.items() if any(np.any(value) for value in values)]


def _on_joint(actuator: Any) -> bool:
    return bool(actuator.trntype[0] == mujoco.mjtTrn.mjTRN_JOINT)


def _matrix(quaternion: Array) -> Array:
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, quaternion)
    return flat.reshape(3, 3)
