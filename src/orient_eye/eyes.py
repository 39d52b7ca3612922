"""The compiled eye: eye_mjcf/eye3.xml, its presets, and named access to its parts.

A preset is a small change to the one MJCF file, made with MjSpec. `EYES` maps its name to that
change; a new preset is one function and one line here. Constants are read from the compiled model,
never written a second time.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.resources import data_folder

Array = NDArray[np.float64]
STANDARD_GRAVITY = 9.81
"""m/s^2, as in the thesis author's simulator."""


def _thesis(spec: mujoco.MjSpec) -> None:
    """The file as it stands."""


def _eve_v3(spec: mujoco.MjSpec) -> None:
    """The group's second published parameter set (a Simulink model by another author).

    Insertions behind the centre, an inertia ten times larger with products of inertia, and motor 3
    counting the other way.
    """
    eye = spec.body("eye")
    for site in eye.sites:
        if site.name.startswith("eye_"):
            site.pos = [-0.007, *site.pos[1:]]
    eye.inertia = [0, 0, 0]
    eye.fullinertia = [4.759e-4, 4.316e-4, 3.956e-4, -1e-7, 1.11e-5, 0]
    spec.joint("motor3").axis = [0, -1, 0]


EYES: dict[str, Callable[[mujoco.MjSpec], None]] = {"thesis": _thesis, "eve_v3": _eve_v3}


def build_model(
    eye: str = "thesis", *, step_s: float = 0.001, gravity: bool = False, visual: bool = True
) -> mujoco.MjModel:
    """Compile a preset of the eye.

    Args:
        eye: preset, one of `EYES`.
        step_s: integration step [s]; the servos' gains follow it.
        gravity: add the gravity torque of the thesis, Cm x m g (3.8, 3.9), as a constant force at
            the centre of mass. It adds an actuator without control, after the motors'.
        visual: keep meshes and cameras; without them the physics is the same, and `model_hash` does not
            change with the looks.

    Raises:
        InputError: unknown preset, or a step for which the explicit friction would diverge.
    """
    if eye not in EYES:
        raise InputError(f"unknown eye {eye!r}; choose one of {', '.join(EYES)}")
    spec = mujoco.MjSpec.from_file(str(data_folder("eye_mjcf") / "eye3.xml"))
    EYES[eye](spec)
    longest = 2 * min(_inertia_diagonal(spec)) / float(spec.joint("eye").damping[0])
    if not 0 < step_s < longest:
        raise InputError(f"the integration step must be between 0 and {longest:.2g} s, got {step_s} s")
    spec.option.timestep = step_s
    for motor in spec.actuators:
        armature = float(spec.joint(motor.target).armature)
        motor.gainprm[0] = armature / step_s**2
        motor.biasprm[1:3] = [-armature / step_s**2, -armature / step_s]
    if gravity:
        _add_gravity(spec)
    if not visual:
        spec.compiler.discardvisual = True
        for camera in list(spec.cameras):
            spec.delete(camera)
    return spec.compile()


def _inertia_diagonal(spec: mujoco.MjSpec) -> list[float]:
    eye = spec.body("eye")
    return [float(x) for x in (eye.fullinertia[:3] if np.isfinite(eye.fullinertia[0]) else eye.inertia)]


def _add_gravity(spec: mujoco.MjSpec) -> None:
    # The thesis takes the inertia about the centre of rotation and the centre of mass off it, which
    # no rigid body allows (m r^2 alone exceeds that inertia): the weight is a force, not a mass.
    spec.worldbody.add_site(name="head")
    weight = float(spec.body("eye").mass) * STANDARD_GRAVITY
    spec.add_actuator(
        name="gravity",
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target="centre_of_mass",
        refsite="head",
        gear=[0, 0, -1, 0, 0, 0],
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[0] * 10,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=[weight] + [0] * 9,
    )


def motor_names(model: mujoco.MjModel) -> tuple[str, ...]:
    """Names of the actuators that turn a motor's hinge, in the order of `ctrl`."""
    hinged = (model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT).nonzero()[0]
    return tuple(model.actuator(i).name for i in hinged)


def motor_range_deg(model: mujoco.MjModel) -> Array:
    """Mechanical range of each motor [deg], (motors, 2)."""
    return np.rad2deg([model.actuator(name).ctrlrange for name in motor_names(model)])


def tendon_tension(model: mujoco.MjModel, length: Array) -> Array:
    """Tension [N] (..., tendons) of the elastics at these lengths [m]; they pull only (3.2)."""
    return model.tendon_stiffness * np.maximum(length - model.tendon_lengthspring[:, 1], 0)


_PHYSICS = (
    "body_parentid", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia",
    "jnt_type", "jnt_bodyid", "jnt_pos", "jnt_axis", "jnt_range", "jnt_stiffness", "dof_damping", "dof_armature",
    "dof_frictionloss", "site_bodyid", "site_pos", "site_quat", "tendon_stiffness", "tendon_damping",
    "tendon_lengthspring", "wrap_type", "wrap_objid", "wrap_prm", "actuator_trntype", "actuator_trnid",
    "actuator_gear", "actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange",
)  # fmt: skip


def model_hash(model: mujoco.MjModel) -> str:
    """Identity of an eye: SHA-256 over everything that moves it, 16 digits.

    Numbers count to 12 digits and looks do not, so that neither the machine nor another version of MuJoCo
    makes the same eye another one.
    """
    option = model.opt
    numbers = {
        "option": [option.timestep, option.integrator, option.disableflags, *option.gravity],
        **{name: getattr(model, name).ravel() for name in _PHYSICS},
    }
    text = "\n".join(f"{name} {' '.join(f'{x + 0.0:.12g}' for x in values)}" for name, values in numbers.items())
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Elastics:
    """Geometry of a compiled eye as plain arrays, for programs that do not step MuJoCo.

    Attributes:
        insertion: on the eye, eye coordinates [m], (tendons, 3).
        via: fixed via point, head coordinates [m], (tendons, 3); NaN where there is none.
        arm_end: on the arm, arm coordinates [m], (tendons, 3).
        motor: index of the motor that pulls, (tendons,).
        stiffness: [N/m], (tendons,).
        rest_length: [m], (tendons,).
        arm_centre: head coordinates [m], (motors, 3).
        arm_axis: unit vector, (motors, 3).
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
    arm_centre: Array
    arm_axis: Array
    inertia: Array
    friction: float
    mass: float
    centre_of_mass: Array

    @classmethod
    def from_model(cls, model: mujoco.MjModel) -> "Elastics":
        """Read the geometry from the compiled model, following each tendon's path of sites.

        Raises:
            InputError: a tendon with another kind of path.
        """
        eye = model.body("eye").id
        joints = [int(model.actuator(name).trnid[0]) for name in motor_names(model)]
        arms = [int(model.jnt_bodyid[j]) for j in joints]
        insertion, via, arm_end, motor = [], [], [], []
        for tendon in range(model.ntendon):
            start = model.tendon_adr[tendon]
            path = slice(start, start + model.tendon_num[tendon])
            sites = model.wrap_objid[path]
            on_eye = [s for s in sites if model.site_bodyid[s] == eye]
            on_arm = [s for s in sites if model.site_bodyid[s] in arms]
            fixed = [s for s in sites if s not in on_eye and s not in on_arm]
            if (
                (model.wrap_type[path] != mujoco.mjtWrap.mjWRAP_SITE).any()
                or (len(on_eye), len(on_arm)) != (1, 1)
                or len(fixed) > 1
                or any(model.site_bodyid[s] != 0 for s in fixed)
            ):
                raise InputError(
                    f"tendon {model.tendon(tendon).name!r} must run from a site on an arm, past at most one fixed "
                    "site, to a site on the eye; the reference plant knows no other path"
                )
            insertion.append(model.site_pos[on_eye[0]])
            arm_end.append(model.site_pos[on_arm[0]])
            motor.append(arms.index(model.site_bodyid[on_arm[0]]))
            via.append(model.site_pos[fixed[0]] if fixed else np.full(3, np.nan))
        flat = np.zeros(9)
        mujoco.mju_quat2Mat(flat, model.body("eye").iquat)
        turned = flat.reshape(3, 3)
        return cls(
            insertion=np.array(insertion),
            via=np.array(via),
            arm_end=np.array(arm_end),
            motor=np.array(motor),
            stiffness=model.tendon_stiffness.copy(),
            rest_length=model.tendon_lengthspring[:, 1].copy(),
            arm_centre=model.body_pos[arms],
            arm_axis=model.jnt_axis[joints],
            inertia=turned @ np.diag(model.body("eye").inertia) @ turned.T,
            friction=float(model.dof_damping[model.joint("eye").dofadr[0]]),
            mass=float(model.body("eye").mass[0]),
            centre_of_mass=model.site("centre_of_mass").pos.copy(),
        )
