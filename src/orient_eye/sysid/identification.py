"""The whole identification: fits of single steps, the comparison of models, the surrogate.

found = identify_plant(make_plant("mujoco"), amplitudes=range(1, 26))
found = identify_recordings(read_recordings(paths))
found.surrogate.save("surrogate.json")
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from orient_eye.errors import InputError
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import Plant
from orient_eye.surrogate import Surrogate
from orient_eye.sysid.comparison import Compared, HeldOut, compare, predict, preferred
from orient_eye.sysid.fit import CONFIDENCE, Fit, fit_model
from orient_eye.sysid.models import MODELS
from orient_eye.sysid.plant_steps import plant_steps
from orient_eye.sysid.recording_checks import warnings_of
from orient_eye.sysid.step_response import StepResponse
from orient_eye.words import plant_in_words

REFERENCE_DEG = 10.0
"""The thesis takes w0 from the step of this amplitude (section 3.3.1)."""


@dataclass(frozen=True)
class Identification:
    """What was found.

    Attributes:
        steps: the responses that were fitted.
        fits: one set of fits for each step: first order for a plant, every model for a recording.
        compared: every model, fitted to all steps together.
        surrogate: the low-pass surrogate.
        K_half_width: 95 % half width of its K.
        w0_half_width: 95 % half width of its w0 [rad/s].
        held_out: steps that were not fitted; for recordings none, each is left out in turn instead.
        held_out_fit: how the surrogate predicts them; for recordings, how the first-order fit to the
            others predicts each.
        warnings: for people.
        plant: that was identified; None for recordings.
        trajectory: of its steps.
    """

    steps: tuple[StepResponse, ...]
    fits: tuple[tuple[Fit, ...], ...]
    compared: tuple[Compared, ...]
    surrogate: Surrogate
    K_half_width: float
    w0_half_width: float
    held_out: tuple[StepResponse, ...]
    held_out_fit: tuple[HeldOut, ...]
    warnings: tuple[str, ...]
    plant: Plant | None = None
    trajectory: Trajectory | None = None

    @property
    def preferred(self) -> Compared:
        """The model that describes the data best; see `comparison.preferred`."""
        return preferred(self.compared)


def identify_plant(
    plant: Plant,
    amplitudes: Sequence[float],
    held_out: Sequence[float] = (),
    motor: str | None = None,
    axis: str | None = None,
) -> Identification:
    """Identify a plant as the thesis does (section 3.3.1, Figures 3.5 and 3.6).

    K of the surrogate minimises the sum over all amplitudes A of (K(A) A - K A)^2; w0 is that of the
    amplitude nearest to 10 deg.

    Args:
        plant: any.
        amplitudes: of the steps to fit, in the motor's unit.
        held_out: of the steps to judge by; those among `amplitudes` are left out.
        motor: that steps; None for one that turns the eye about the axis.
        axis: yaw, pitch or roll; None for what the motor, or the plant, turns: see `plant_steps`.

    Raises:
        InputError: see `plant_steps` and `fit_model`.
    """
    asked = [float(a) for a in amplitudes]
    if not asked:
        raise InputError("no step amplitude given; name at least one, in deg of motor, as 5 10 20")
    done = plant_steps(plant, [*asked, *(float(a) for a in held_out if float(a) not in asked)], motor, axis)
    steps, judges = done.steps[: len(asked)], done.steps[len(asked) :]
    fits = tuple((fit_model(MODELS["first_order"], [step]),) for step in steps)
    A = np.array(asked)
    K = np.array([fit["K"].value for (fit,) in fits])
    gain = float(np.sum(K * A**2) / np.sum(A**2))
    scatter = math.sqrt(np.sum((A * (K - gain)) ** 2) / max(len(A) - 1, 1) / np.sum(A**2))
    half = stats.t.ppf((1 + CONFIDENCE) / 2, len(A) - 1) * scatter if len(A) > 1 else fits[0][0]["K"].half_width
    nearest = int(np.abs(np.abs(A) - REFERENCE_DEG).argmin())
    w0 = fits[nearest][0]["w0"]
    compared = compare(steps, judges)
    warnings = [*done.warnings, *(f"{s.name}: {w}" for s, (f,) in zip(steps, fits, strict=True) for w in f.warnings)]
    if abs(abs(A[nearest]) - REFERENCE_DEG) > 0.5:
        warnings.append(
            f"w0 of the surrogate is that at {A[nearest]:g} {done.motor.unit}, the step nearest to {REFERENCE_DEG:g}"
        )
    unit, identity = done.motor.unit, plant.identity()
    source = (
        f"steps of {done.motor.name} to {_listed(A)} {unit} on {plant_in_words(identity)}; "
        f"K: least squares over all amplitudes, w0: at {A[nearest]:g} {unit}"
    )
    number = Surrogate(
        gain,
        w0.value,
        done.motor.name,
        source,
        eye=identity.get("eye"),
        details={"plant": identity},
        axis=done.axis,
    )
    held_out_fit = tuple(
        predict(s.name, MODELS["first_order"].response(np.array([number.K, number.w0]), s), s) for s in judges
    )
    return Identification(
        steps=steps,
        fits=fits,
        compared=compared,
        surrogate=number,
        K_half_width=float(half),
        w0_half_width=w0.half_width,
        held_out=judges,
        held_out_fit=held_out_fit,
        warnings=tuple(warnings),
        plant=plant,
        trajectory=done.trajectory[: len(asked)],
    )


def identify_recordings(steps: Sequence[StepResponse]) -> Identification:
    """Identify recorded step responses.

    The surrogate is the first-order fit to all of them together. Each recording is left out in turn
    to see how the others predict it.

    Args:
        steps: from `read_recordings`.

    Raises:
        InputError: see `fit_model`.
    """
    fits = tuple(tuple(fit_model(model, [s]) for model in MODELS.values()) for s in steps)
    compared = compare(steps)
    joint, best = compared[0], preferred(compared)
    warnings = [w for s in steps for w in warnings_of(s)]
    shown = dict.fromkeys(("first_order", best.fit.model.name))
    for s, group in zip(steps, fits, strict=True):
        warnings += [f"{s.name}: {w}" for f in group if f.model.name in shown for w in f.warnings]
    if len(steps) > 1:
        warnings += [f"all: {w}" for row in compared if row.fit.model.name in shown for w in row.fit.warnings]
    if best is not joint:
        warnings.append(
            f"{best.fit.model.title} describes these data better than the first-order surrogate "
            f"(residual {best.fit.rms_deg:.2f} instead of {joint.fit.rms_deg:.2f} deg)"
        )
    if len(steps) == 1:
        warnings.append("one recording only: nothing is held out, and the models are judged by AICc alone")
    drives = sorted({str(s.source.get("motor", "")) for s in steps})
    number = Surrogate(
        joint.fit["K"].value,
        joint.fit["w0"].value,
        ", ".join(drives),
        f"first-order fit to {len(steps)} recordings together: {', '.join(s.name for s in steps)}",
    )
    return Identification(
        steps=tuple(steps),
        fits=fits,
        compared=compared,
        surrogate=number,
        K_half_width=joint.fit["K"].half_width,
        w0_half_width=joint.fit["w0"].half_width,
        held_out=(),
        held_out_fit=joint.held_out,
        warnings=tuple(warnings),
    )


def _listed(amplitudes: Any) -> str:
    values = [f"{a:g}" for a in amplitudes]
    return ", ".join(values) if len(values) <= 4 else f"{values[0]}, {values[1]}, ..., {values[-1]}"
