"""The geometry of a compiled eye as plain arrays."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.eyes.model import motors
from orient_eye.motor import names

Array = NDArray[np.float64]


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
        joints = [int(model.actuator(name).trnid[0]) for name in names(motors(model))]
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
