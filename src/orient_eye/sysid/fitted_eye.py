"""What a physical fit leaves behind: the fitted eye as a file, its numbers, its movement beside the recorded one.

write_eye(fit, "fitted.xml")                     # make_plant("mujoco", eye="fitted.xml")
measured, fitted = replayed(fit, recordings)     # trajectories, for a recording
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.constants import ANGLES as AXES
from orient_eye.eyes.model import build_model, load_spec, motors
from orient_eye.files import write_text
from orient_eye.movement.trajectory import Trajectory
from orient_eye.rotations import from_euler, rotation
from orient_eye.sysid.physical import PhysicalFit, moved
from orient_eye.sysid.physical_recordings import Measured
from orient_eye.sysid.replay import replay
from orient_eye.sysid.step_response import StepResponse

Array = NDArray[np.float64]


def write_eye(fit: PhysicalFit, path: str | Path) -> list[str]:
    """Write the fitted eye as an MJCF file that needs no other: its meshes stand in it.

    MuJoCo writes 6 significant digits; those of the fitted parameters are what was fitted.

    Returns:
        Files that it still refers to, relative to those of the eye it was made from: textures, height fields.

    Raises:
        InputError: it cannot be written.
    """
    spec, values = load_spec(fit.eye), fit.values
    for tendon in spec.tendons:
        default = tendon.default()
        group = "elastics" if default.name == "main" else default.name
        for name, place, index in (("stiffness", "stiffness", 0), ("rest_length", "springlength", 1)):
            if f"{name}_{group}" not in fit.frozen:
                for changed in (default.tendon, tendon):  # in the class, so that the file says it once
                    getattr(changed, place)[index] = values[f"{name}_{group}"]
    if "friction" not in fit.frozen:
        spec.joint("eye").damping[0] = values["friction"]
    _inline_meshes(spec)
    told = [f"{e.parameter.name} = {e} {e.parameter.unit} (95 %)" for e in fit.estimates]
    told += [f"{name} = {value:.6g}, kept" for name, value in fit.frozen.items()]
    comment = f"Eye {Path(fit.eye).name}, fitted to recordings by orient-eye sysid: " + "; ".join(told) + "."
    xml = spec.to_xml()
    write_text(path, f"<!-- {comment.replace('--', '- -')} -->\n{xml}")
    files = (element.get("file") for element in ElementTree.fromstring(xml).iter() if element.tag != "compiler")
    return sorted({file for file in files if file})


def _inline_meshes(spec: mujoco.MjSpec) -> None:
    """Meshes of files as numbers in the MJCF."""
    model = spec.copy().compile()
    for mesh in spec.meshes:
        if not mesh.file:
            continue
        i = model.mesh(mesh.name).id
        corner, face = model.mesh_vertadr[i], model.mesh_faceadr[i]
        corners = model.mesh_vert[corner : corner + model.mesh_vertnum[i]]
        # The compiler puts a mesh into its own frame, scaled.
        placed = rotation(model.mesh_quat[i]).apply(corners) + model.mesh_pos[i]
        mesh.file, mesh.content_type, mesh.scale = "", "", [1, 1, 1]
        mesh.refpos, mesh.refquat = [0, 0, 0], [1, 0, 0, 0]
        mesh.uservert = placed.ravel().tolist()
        mesh.userface = model.mesh_face[face : face + model.mesh_facenum[i]].ravel().tolist()


def summary(fit: PhysicalFit) -> dict[str, Any]:
    """The fit as plain values, for JSON, without NaN or infinity."""

    def finite(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        "eye": fit.eye,
        "fitted": {
            e.parameter.name: {
                "value": e.value,
                "interval": [finite(x) for x in e.interval],
                "unit": e.parameter.unit,
                "bounds": [e.parameter.low, e.parameter.high],
                "at_bound": e.at_bound,
                "undetermined": e.parameter.name in fit.undetermined,
            }
            for e in fit.estimates
        },
        "frozen": fit.frozen,
        "rms_deg": fit.rms_deg,
        "samples": fit.samples,
        "effective_samples": fit.effective_samples,
        "autocorrelation": fit.autocorrelation,
        "condition": finite(fit.condition),
        "held_out": [{"name": h.name, "rms_deg": h.rms_deg, "r_squared": finite(h.r_squared)} for h in fit.held_out],
        "held_out_rms_deg": finite(fit.held_out_rms_deg),
        "warnings": list(fit.warnings),
    }


def replayed(fit: PhysicalFit, recordings: Sequence[Measured]) -> tuple[Trajectory, Trajectory]:
    """The recorded movements and those of the fitted eye, on one clock from 0, a batch each.

    The recorded ones are told from the eye's own zero: the constants that were fitted are taken off. An angle that
    was not recorded is that of the fitted eye.
    """
    names = [motor.name for motor in motors(build_model(fit.eye, visual=False))]
    time, angles = moved(fit, recordings)
    measured, fitted = [], []
    for recording, residual, answer in zip(recordings, fit.residuals, angles, strict=True):
        rows = recording.time - recording.time[0]
        told = _at(rows, time, answer)
        told[:, [AXES.index(axis) for axis in recording.axes]] -= residual
        measured.append(_as_step(recording.name, rows, told, recording.motor, names))
        own = np.append(time[time < rows[-1]], rows[-1])
        motor = _at(own, rows, recording.motor)
        fitted.append(_as_step(recording.name, own, _at(own, time, answer), motor, names))
    return replay(measured), replay(fitted)


def _at(time: Array, known: Array, values: Array) -> Array:
    """Values (known, columns) at other times, (time, columns)."""
    return np.stack([np.interp(time, known, column) for column in values.T], axis=-1)


def _as_step(name: str, time: Array, angles: Array, motor: Array, names: Sequence[str]) -> StepResponse:
    """A movement of angles [deg] (time, 3) and motors [deg] (time, motors) with these names."""
    motors_of = dict(zip(names, motor.T, strict=True))
    return StepResponse(name, time, motor[:, 0], angles[:, 0], orientation=from_euler(*angles.T), motors=motors_of)
