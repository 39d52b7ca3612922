"""The compiled eye: an MJCF file of `eye_mjcf`, changed as a preset says, with named access to its parts.

    model = build_model("eve_v3")                    # a name of `orient_eye.eyes.EYES`, or an MJCF file
    motors(model)                                    # what turns it, read from the model
    Tendons.of(model)                                # what pulls it

Constants are read from the compiled model, never written a second time.
"""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.eyes import EYES
from orient_eye.files import read_bytes, unreadable
from orient_eye.motor import Motor
from orient_eye.resources import data_folder, printable

Array = NDArray[np.float64]
_LARGEST_BYTES = 16 * 2**20
STANDARD_GRAVITY = 9.81
"""m/s^2, as in the thesis author's simulator."""
WORKING_RANGE_DEG = 40.0
"""Where a policy may send a motor of the elastic eye: 61.8 deg of yaw. The straight tendons run inside the
eyeball already at small angles, and past about 50 deg of motor the response bends over; targets within 35 deg
of yaw need 23.5."""


def _tell_only_the_console() -> None:
    """Of strange models and unstable steps: MuJoCo's own choice is a log in the working folder as well."""
    config = mujoco.MjLogConfig.get()
    config.logto_file = False
    config.set()


_tell_only_the_console()


def build_model(
    eye: str = "thesis", *, step_s: float = 0.001, gravity: bool = False, visual: bool = True
) -> mujoco.MjModel:
    """Compile an eye.

    Args:
        eye: preset, one of `EYES`, or an MJCF file of the same form (docs/howto/eye.md).
        step_s: integration step [s]; the servos' gains follow it.
        gravity: add the gravity torque of the thesis, Cm x m g (3.8, 3.9), as a constant force at
            the centre of mass. It adds an actuator without control, after the motors'.
        visual: keep meshes and cameras; without them the physics is the same, and `model_hash` does not
            change with the looks.

    Raises:
        InputError: unknown preset, a file that is no such model, or a step for which the explicit friction
            would diverge.
    """
    spec = load_spec(eye)
    try:
        inertia, friction = min(_inertia_diagonal(spec)), float(_joint(spec, "eye").damping[0])
        if not (0 < inertia < np.inf and 0 < friction < np.inf):
            raise ValueError(f"it has inertia {inertia:g} and friction {friction:g}, not both above 0")
        longest = 2 * inertia / friction
        if not 0 < step_s < longest:
            raise InputError(f"the integration step must be between 0 and {longest:.2g} s, got {step_s} s")
        spec.option.timestep = step_s
        for motor in spec.actuators:
            if motor.trntype == mujoco.mjtTrn.mjTRN_TENDON:
                continue  # a spindle: it is where its control says
            # An arm stands where its control says one step later: `eye3.xml` has the reason.
            if motor.biastype != mujoco.mjtBias.mjBIAS_AFFINE:
                raise ValueError(f"motor {motor.name!r} on a joint is no `position` servo")
            armature, gear = float(_joint(spec, motor.target).armature), float(motor.gear[0])
            if not (0 < armature < np.inf and 0 < abs(gear) < np.inf):
                raise ValueError(f"motor {motor.name!r} has armature {armature:g} and gear {gear:g}, not both above 0")
            motor.gainprm[0] = armature / (gear * step_s) ** 2
            motor.biasprm[1:3] = [-motor.gainprm[0], -motor.gainprm[0] * step_s]
        if gravity:
            _add_gravity(spec)
        if not visual:
            spec.compiler.discardvisual = True
            for camera in list(spec.cameras):
                spec.delete(camera)
        model = spec.compile()
        _check_parts(model)
    except (ValueError, KeyError, AttributeError) as error:  # a part is not there, or does not compile
        if isinstance(error, InputError):
            raise
        raise InputError(f"eye {eye!r} is no eye of this form: {error}; see docs/howto/eye.md") from error
    return model


def ball() -> mujoco.MjModel:
    """An eye without motors or tendons, to draw what has none."""
    return mujoco.MjSpec.from_file(str(data_folder("eye_mjcf") / "ball.xml")).compile()


def load_spec(eye: str) -> mujoco.MjSpec:
    """An eye that is not compiled: a preset, one of `EYES`, or an MJCF file.

    Raises:
        InputError: unknown, or a file that cannot be read.
    """
    if eye not in EYES:
        file = Path(eye)
        if file.suffix != ".xml":
            raise InputError(f"unknown eye {eye!r}; choose one of {', '.join(EYES)}, or an MJCF file NAME.xml")
        return _read(file)
    preset = EYES[eye]
    spec = _read(preset.file if preset.file.is_absolute() else data_folder("eye_mjcf") / preset.file)
    if preset.change is not None:
        preset.change(spec)
    return spec


def _read(file: Path) -> mujoco.MjSpec:
    hint = "give an MJCF file (docs/howto/eye.md), with its meshes beside it"
    if not os.path.isfile(file):  # a pipe has nothing beside it
        raise InputError(f"{printable(file)} is no eye: there is no such file; {hint}")
    read_bytes(file, most=_LARGEST_BYTES, hint=hint)
    try:
        return mujoco.MjSpec.from_file(str(file))
    except ValueError as error:
        raise unreadable(file, error, hint) from error


def _check_parts(model: mujoco.MjModel) -> None:
    """Raise KeyError unless all is there that a plant asks for, ValueError unless it moves, by finite numbers."""
    for name in ("orientation", "angular_velocity"):
        model.sensor(name)
    for i in range(model.ntendon):
        model.sensor(f"length_{model.tendon(i).name}")
    model.site("gaze"), model.site("centre_of_mass")
    if model.joint("eye").type != mujoco.mjtJoint.mjJNT_BALL or model.body("eye").quat[0] != 1:
        raise ValueError("its body 'eye' must stand straight, without a quat or other turn, on a ball joint 'eye'")
    if not len(_motor_ids(model)):
        raise ValueError("it has no motor: no actuator of a joint or a tendon")
    Tendons.of(model)
    endless = [name for name in _PHYSICS if not np.isfinite(getattr(model, name)).all()]
    if endless:
        raise ValueError(f"it holds NaN or infinity: {', '.join(endless)}")


def _joint(spec: mujoco.MjSpec, name: str) -> mujoco.MjsJoint:
    joint = spec.joint(name)
    if joint is None:
        raise ValueError(f"it has no joint {name!r}")
    return joint


def _inertia_diagonal(spec: mujoco.MjSpec) -> list[float]:
    eye = spec.body("eye")
    if eye is None:
        raise ValueError("it has no body 'eye'")
    return [float(x) for x in (eye.fullinertia[:3] if np.isfinite(eye.fullinertia[0]) else eye.inertia)]


def _add_gravity(spec: mujoco.MjSpec) -> None:
    # The thesis takes the inertia about the centre of rotation and the centre of mass off it, which
    # no rigid body allows (m r^2 alone exceeds that inertia): the weight is a force, not a mass.
    spec.worldbody.add_site(name="head")
    for key in spec.keys:
        key.ctrl = [*key.ctrl, 0.0]
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


def motors(model: mujoco.MjModel, pretension: float | None = None) -> tuple[Motor, ...]:
    """What turns the eye: the actuators of joints and tendons, in the order of `ctrl`; their controls are angles.

    A motor rests where a keyframe has it: the key `pretension_N` of a pretension N, or the model's first key.

    Args:
        model: compiled.
        pretension: which key; None for the first.

    Raises:
        InputError: no such key.
    """
    rest = np.rad2deg(_rest_control(model, pretension))
    found = []
    for i in _motor_ids(model):
        low, high = np.rad2deg(model.actuator_ctrlrange[i]).tolist()
        limits = (low, high) if model.actuator_ctrllimited[i] else (-np.inf, np.inf)
        of_arm = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        at = float(rest[i])
        working = (at - WORKING_RANGE_DEG, at + WORKING_RANGE_DEG) if of_arm else limits
        found.append(Motor(model.actuator(i).name, "deg", limits, working, rest=at))
    return tuple(found)


def _motor_ids(model: mujoco.MjModel) -> NDArray[np.intp]:
    return np.isin(model.actuator_trntype, (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_TENDON)).nonzero()[0]


def pretensions(model: mujoco.MjModel) -> tuple[str, ...]:
    """Names N of its keys pretension_N."""
    keys = (model.key(i).name for i in range(model.nkey))
    return tuple(key.removeprefix(_PRETENSION) for key in keys if key.startswith(_PRETENSION))


def _rest_control(model: mujoco.MjModel, pretension: float | None) -> Array:
    """Of all actuators, (nu,)."""
    if pretension is None:
        return np.array(model.key_ctrl[0]) if model.nkey else np.zeros(model.nu)
    known = pretensions(model)
    these = f"choose one of {', '.join(known)}" if known else "its motors rest at 0; leave the pretension out"
    told = f"{real('the pretension', pretension, advice=these):g}"
    if told not in known:
        raise InputError(f"the eye has no pretension {told}: {these}")
    return np.array(model.key(f"{_PRETENSION}{told}").ctrl)


@dataclass(frozen=True)
class Tendons:
    """What pulls the eye: tension = stiffness max(0, length + wound control - rest length), 3.2.

    Attributes:
        stiffness: [N/m], (tendons,).
        rest_length: [m], (tendons,).
        motor: whose spindle winds it up, as an index among `motors`, (tendons,); -1 where none does: an arm may pull.
        wound: by how much, [m/rad], (tendons,).
    """

    stiffness: Array
    rest_length: Array
    motor: NDArray[np.intp]
    wound: Array

    @classmethod
    def of(cls, model: mujoco.MjModel) -> "Tendons":
        """Those of a model.

        Raises:
            ValueError: an actuator on a tendon that is no spindle: `eye6.xml` has the form.
        """
        stiffness, rest = model.tendon_stiffness.copy(), model.tendon_lengthspring[:, 1].copy()
        motor, wound = np.full(model.ntendon, -1), np.zeros(model.ntendon)
        for place, i in enumerate(_motor_ids(model)):
            if model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_TENDON:
                continue
            tendon, name, bias = int(model.actuator_trnid[i, 0]), model.actuator(i).name, model.actuator_biasprm[i]
            if stiffness[tendon] or motor[tendon] >= 0:
                pulled = model.tendon(tendon).name
                raise ValueError(f"tendon {pulled!r} is wound up by motor {name!r}, and pulled otherwise as well")
            if faults := _no_spindle(model, i):
                raise ValueError(
                    f"motor {name!r} on a tendon is no spindle: {'; '.join(faults)} (eye6.xml has the form)"
                )
            stiffness[tendon], rest[tendon] = -bias[1], bias[0] / -bias[1]
            motor[tendon], wound[tendon] = place, model.actuator_gainprm[i, 0] / bias[1]
        return cls(stiffness, rest, motor, wound)

    def tension(self, length: Array, control: Array) -> Array:
        """Tension [N] (..., tendons) at lengths [m] (..., tendons), the motors' controls at (..., motors) [rad]."""
        stretch = length - self.rest_length
        if self.wound.any():
            stretch = stretch + self.wound * control[..., self.motor]
        return self.stiffness * np.maximum(stretch, 0)


def _no_spindle(model: mujoco.MjModel, i: int) -> list[str]:
    """What is wrong with an actuator on a tendon."""
    _, stiffness, damping = model.actuator_biasprm[i, :3]
    gain, gear, (low, high) = model.actuator_gainprm[i, 0], model.actuator_gear[i, 0], model.actuator_forcerange[i]
    fixed = model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_FIXED
    affine = model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE
    faults = {
        "its gain must be fixed, -k r, and its bias affine, k l, -k, 0 (stiffness k, rest length l, radius r)": not (
            fixed and affine
        ),
        f"its stiffness, -biasprm[1], must be above 0, got {-stiffness:g}": not stiffness < 0,
        f"its damping, biasprm[2], must be 0, got {damping:g}": damping != 0,
        "its gain is 0, so that it winds nothing up": gain == 0,
        f"its gear must be 1, got {gear:g}": gear != 1,
        "it has dynamics of its own": model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE,
        f"it must pull and never push, forcerange {-_PULL:g} (or below) to 0, got {low:g} to {high:g}": not (
            model.actuator_forcelimited[i] and high == 0 and low <= -_PULL
        ),
        "it needs a ctrlrange": not model.actuator_ctrllimited[i],
    }
    return [fault for fault, there in faults.items() if there]


def pairs(model: mujoco.MjModel) -> NDArray[np.intp] | None:
    """The two elastics that each motor pulls against one another, (motors, 2); None where they are not pairs."""
    if (model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON).any():
        return None
    arms = [int(model.jnt_bodyid[model.actuator(motor.name).trnid[0]]) for motor in motors(model)]
    pulled: list[list[int]] = [[] for _ in arms]
    for tendon in range(model.ntendon):
        start = model.tendon_adr[tendon]
        path = slice(start, start + model.tendon_num[tendon])
        sites = model.wrap_objid[path][model.wrap_type[path] == mujoco.mjtWrap.mjWRAP_SITE]
        for body in {int(model.site_bodyid[site]) for site in sites} & set(arms):
            pulled[arms.index(body)].append(tendon)
    return np.array(pulled) if all(len(each) == 2 for each in pulled) else None


_PRETENSION = "pretension_"
_IF_ANY = ("key_ctrl", "actuator_forcerange", "tendon_armature")  # later ones: an eye without them is the one it was
_PULL = 1000.0  # N, that a spindle's actuator may pull at least: tensions never come to it
_PHYSICS = (
    "body_parentid", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia",
    "jnt_type", "jnt_bodyid", "jnt_pos", "jnt_axis", "jnt_range", "jnt_stiffness", "dof_damping", "dof_armature",
    "dof_frictionloss", "site_bodyid", "site_pos", "site_quat", "tendon_stiffness", "tendon_damping",
    "tendon_lengthspring", "wrap_type", "wrap_objid", "wrap_prm", "actuator_trntype", "actuator_trnid",
    "actuator_gear", "actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange",
)  # fmt: skip


def side(model: mujoco.MjModel) -> str:
    """Which eye of a head it is, "left" or "right": the custom text `side` of its file; left where it says nothing.

    Raises:
        InputError: another text.
    """
    i = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, "side")
    if i < 0:
        return "left"
    begin = model.text_adr[i]
    told = model.text_data[begin : begin + model.text_size[i] - 1].decode(errors="replace")
    if told not in ("left", "right"):
        raise InputError(f"the custom text 'side' of an eye is left or right, got {told!r}")
    return told


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
    numbers |= {name: values for name in _IF_ANY if (values := getattr(model, name).ravel()).any()}
    text = "\n".join(f"{name} {' '.join(f'{x + 0.0:.12g}' for x in values)}" for name, values in numbers.items())
    return hashlib.sha256(text.encode()).hexdigest()[:16]
