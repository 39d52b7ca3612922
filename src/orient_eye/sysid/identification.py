"""The whole identification: fits of single steps, the comparison of models, the surrogate.

found = identify_plant(make_plant("mujoco"), amplitudes=range(1, 26))
found = identify_recordings(read_recordings(paths))
found.surrogate.save("surrogate.json")
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from orient_eye.errors import InputError
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import Plant
from orient_eye.rig import Rig
from orient_eye.surrogate import Surrogate
from orient_eye.sysid.comparison import Compared, HeldOut, compare, predict, preferred
from orient_eye.sysid.fit import CONFIDENCE, Fit, fit_model
from orient_eye.sysid.models import MODELS, Model
from orient_eye.sysid.plant_steps import listed, plant_steps
from orient_eye.sysid.prototype_log import is_log
from orient_eye.sysid.recording_checks import doubts_of, warnings_of
from orient_eye.sysid.step_response import StepResponse
from orient_eye.words import plant_in_words

Array = NDArray[np.float64]
_OFF_DEG = 1.0  # of the eye at rest
REFERENCE_DEG = 10.0
"""The thesis takes w0 from the step of this amplitude (section 3.3.1)."""


@dataclass(frozen=True)
class Identification:
    """What was found.

    Attributes:
        steps: the responses that were fitted.
        fits: one set of fits for each step: first order for a plant, every model for a recording.
        compared: every model, fitted to all steps together.
        surrogate: the linear eye to learn on.
        held_out: steps that were not fitted; for recordings none, each is left out in turn instead.
        held_out_fit: how the surrogate predicts them; for recordings, how the same model, fitted to the others,
            predicts each.
        warnings: for people.
        undetermined: why the data do not tell the surrogate's numbers; empty where they do.
        rig: that was recorded; None for a plant, or where nobody described it.
        plant: that was identified; None for recordings.
        trajectory: of its steps.
    """

    steps: tuple[StepResponse, ...]
    fits: tuple[tuple[Fit, ...], ...]
    compared: tuple[Compared, ...]
    surrogate: Surrogate
    held_out: tuple[StepResponse, ...]
    held_out_fit: tuple[HeldOut, ...]
    warnings: tuple[str, ...]
    undetermined: tuple[str, ...] = ()
    rig: Rig | None = None
    plant: Plant | None = None
    trajectory: Trajectory | None = None

    @property
    def preferred(self) -> Compared:
        """The model that describes the data best; see `comparison.preferred`."""
        return preferred(self.compared)

    @property
    def surrogate_model(self) -> Model:
        """That of the surrogate."""
        return model_of(self.surrogate)

    def answer(self, step: StepResponse) -> Array:
        """The surrogate's answer to the motor movement of a step [deg], (samples,)."""
        return response_of(self.surrogate, step)


def model_of(surrogate: Surrogate) -> Model:
    """The model whose numbers a surrogate has."""
    order = "first_order" if surrogate.w0 is not None else "second_order"
    return MODELS[f"{order}_dead_time" if surrogate.dead_time else order]


def response_of(surrogate: Surrogate, step: StepResponse) -> Array:
    """A surrogate's answer to the motor movement of a step, from rest [deg], (samples,)."""
    model = model_of(surrogate)
    return model.response(np.array([getattr(surrogate, name) for name in model.names], float), step)


def identify_plant(
    plant: Plant,
    amplitudes: Sequence[float],
    held_out: Sequence[float] = (),
    motor: str | None = None,
    axis: str | None = None,
    model: str | None = None,
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
        model: of the surrogate: first_order for the thesis' as above; another of `MODELS`, or best, for the one
            that describes the data best, fitted to all steps together; None for best on a rig, a plant with bounds of
            its own for the pulses, and else for first_order.

    Raises:
        InputError: see `plant_steps` and `fit_model`.
    """
    model = model or ("first_order" if plant.pulse_rates is None else "best")
    asked = list(amplitudes)
    if not asked:
        raise InputError("no step amplitude given; name at least one, in deg of motor, as 5 10 20")
    done = plant_steps(plant, [*asked, *(a for a in held_out if a not in asked)], motor, axis)
    asked = [a for a in asked if a in done.amplitudes]
    if not asked:
        raise InputError(f"no step is left to fit, choose smaller ones: {done.warnings[-1]}")
    steps, judges = done.steps[: len(asked)], done.steps[len(asked) :]
    fits = tuple((fit_model(MODELS["first_order"], [step]),) for step in steps)
    A = np.array(asked, float)
    K = np.array([fit["K"].value for (fit,) in fits])
    gain = float(np.sum(K * A**2) / np.sum(A**2))
    sizes = len(np.unique(np.abs(A)))  # the same step to the other side says nothing new of how gains scatter
    scatter = np.sqrt(np.sum((A * (K - gain)) ** 2) / max(sizes - 1, 1) / np.sum(A**2))
    half = stats.t.ppf((1 + CONFIDENCE) / 2, sizes - 1) * scatter if sizes > 1 else fits[0][0]["K"].half_width
    nearest = int(np.abs(np.abs(A) - REFERENCE_DEG).argmin())
    w0 = fits[nearest][0]["w0"]
    compared = compare(steps, judges)
    warnings = list(done.warnings)
    if model == "first_order":
        warnings += [f"{s.name}: {w}" for s, (f,) in zip(steps, fits, strict=True) for w in f.warnings]
    if model == "first_order" and abs(abs(A[nearest]) - REFERENCE_DEG) > 0.5:
        warnings.append(
            f"w0 of the surrogate is that at {A[nearest]:g} {done.motor.unit}, the step nearest to {REFERENCE_DEG:g}"
        )
    unit, identity = done.motor.unit, plant.identity()
    off = f"by {listed(asked)} {unit} from its rest at {done.motor.rest:.4g} {unit}"
    way = off if done.motor.rest else f"to {listed(asked)} {unit}"
    steps_done = f"steps of {done.motor.name} {way} on {plant_in_words(identity)}"
    undetermined: tuple[str, ...] = ()
    if model == "first_order":
        numbers: dict[str, Any] = {"K": gain, "w0": w0.value}
        widths = {"K": float(half), "w0": w0.half_width}
        numbers["intervals"] = {
            name: (numbers[name] - width, numbers[name] + width) for name, width in widths.items() if isfinite(width)
        }
        how = f"K: least squares over all amplitudes, w0: at {A[nearest]:g} {unit}"
    else:
        chosen = _chosen(compared, model).fit
        numbers, undetermined = _numbers(chosen), chosen.undetermined
        warnings += chosen.warnings
        how = f"{chosen.model.title}, fitted to all together"
    number = Surrogate(
        motor=done.motor.name,
        source=f"{steps_done}; {how}",
        eye=identity.get("eye"),
        details={"plant": identity},
        axis=done.axis,
        speed_limit=done.motor.speed_limit,
        acceleration_limit=done.motor.acceleration_limit,
        amplitudes=(float(np.abs(A).min()), float(np.abs(A).max())),
        rest=done.motor.rest,
        **numbers,
    )
    return Identification(
        steps=steps,
        fits=fits,
        compared=compared,
        surrogate=number,
        held_out=judges,
        held_out_fit=tuple(predict(s.name, response_of(number, s), s) for s in judges),
        warnings=tuple(warnings),
        undetermined=undetermined,
        plant=plant,
        trajectory=done.trajectory[: len(asked)],
    )


def identify_recordings(
    steps: Sequence[StepResponse], rig: Rig | None = None, model: str = "best", force: bool = False
) -> Identification:
    """Identify recorded step responses.

    The surrogate is a model fitted to all of them together. Each recording is left out in turn to see how the others
    predict it.

    Args:
        steps: from `read_recordings`, all about one axis.
        rig: that was recorded; None where nobody described it, or for logs of the prototype, which is known.
        model: of the surrogate: one of `MODELS`, or best, for the one that describes the data best.
        force: go on although the numbers are probably not what they are taken for.

    Raises:
        InputError: see `fit_model`; recordings of different axes or motors; or, unless forced, numbers that are
            probably in another unit or of another axis.
    """
    axis = _one_axis(steps)
    if rig is None and all(is_log(s) for s in steps):
        rig = Rig.load("prototype")
    doubts = [doubt for s in steps for doubt in doubts_of(s)]
    if doubts and not force:
        raise InputError("; ".join(doubts) + ". If the numbers are right as they are, say --force")
    fits = tuple(tuple(fit_model(each, [s]) for each in MODELS.values()) for s in steps)
    compared = compare(steps)
    first, best = compared[0], preferred(compared)
    chosen = _chosen(compared, model)
    warnings = [*doubts, *(w for s in steps for w in warnings_of(s)), *_unlike_zero(steps, chosen.fit)]
    shown = {best.fit.model.name, chosen.fit.model.name}
    for s, group in zip(steps, fits, strict=True):
        warnings += [f"{s.name}: {w}" for f in group if f.model.name in shown for w in f.warnings]
    if len(steps) > 1:
        warnings += [f"all: {w}" for row in compared if row.fit.model.name in shown for w in row.fit.warnings]
    if best is not chosen:
        warnings.append(
            f"{best.fit.model.title} describes these data better than the surrogate's {chosen.fit.model.title} "
            f"(residual {best.fit.rms_deg:.2f} instead of {chosen.fit.rms_deg:.2f} deg)"
        )
    elif best is not first:
        warnings.append(
            f"{best.fit.model.title} describes these data better than the first order of the thesis "
            f"(residual {best.fit.rms_deg:.2f} instead of {first.fit.rms_deg:.2f} deg)"
        )
    if len(steps) == 1:
        warnings.append("one recording only: nothing is held out, and the models are judged by AICc alone")
    if all(s.axis is None for s in steps):
        warnings.append("nobody said which axis the eye turns about: taken to be yaw; say it by --axis")
    drive = None if rig is None else rig.drive(axis)
    sizes = [s.largest_deg for s in steps]
    number = Surrogate(
        motor=steps[0].drive if drive is None else drive.name,
        source=f"{chosen.fit.model.title}, fitted to {len(steps)} recordings together: "
        + ", ".join(s.name for s in steps),
        axis=axis,
        range=drive.range if drive is not None and all(map(isfinite, drive.range)) else None,
        speed_limit=None if drive is None else drive.speed_limit,
        acceleration_limit=None if drive is None else drive.acceleration_limit,
        amplitudes=(min(sizes), max(sizes)),
        rig=None if rig is None else rig.to_plain(),
        **_numbers(chosen.fit),
    )
    return Identification(
        steps=tuple(steps),
        fits=fits,
        compared=compared,
        surrogate=number,
        held_out=(),
        held_out_fit=chosen.held_out,
        warnings=tuple(warnings),
        undetermined=chosen.fit.undetermined,
        rig=rig,
    )


def _one_axis(steps: Sequence[StepResponse]) -> str:
    """The axis that all recordings turn about.

    Raises:
        InputError: there is no recording, or they differ.
    """
    if not steps:
        raise InputError("there is no recording to identify; name one or more")
    for what, found in (("axis", {s.axis or "yaw" for s in steps}), ("drive", {s.drive for s in steps})):
        if len(found) > 1:
            raise InputError(
                f"recordings of one {what} are identified together, these are of {', '.join(sorted(found))}; "
                "identify each by itself"
            )
    return steps[0].axis or "yaw"


def _chosen(compared: Sequence[Compared], model: str) -> Compared:
    """The model of the surrogate among those compared.

    Raises:
        InputError: there is none of that name.
    """
    if model == "best":
        return preferred(compared)
    if model not in MODELS:
        raise InputError(f"a model is best, {', '.join(MODELS)}; got {model!r}")
    return next(row for row in compared if row.fit.model.name == model)


def _numbers(fit: Fit) -> dict[str, Any]:
    """Of a surrogate: the parameters of a fit, and those of their intervals that are finite."""
    intervals = {e.parameter.name: e.interval for e in fit.estimates if isfinite(e.half_width)}
    return {e.parameter.name: e.value for e in fit.estimates} | {"intervals": intervals}


def _unlike_zero(steps: Sequence[StepResponse], fit: Fit) -> list[str]:
    """Says it where the eye at rest does not look where the gain would have it look."""
    off = [s.rest[1] - fit["K"].value * s.rest[0] for s in steps if s.rest != (0.0, 0.0)]
    if len(off) < len(steps) or min(abs(o) for o in off) < _OFF_DEG:
        return []
    middle = float(np.median(off))
    return [
        f"at rest the eye looks {middle:+.1f} deg beside where gain and zero of the motor have it, and a command for a "
        f"target would land so much beside it: the motor should read {middle / fit['K'].value:+.2f} deg more there, "
        "or the eye's sensor so much less"
    ]
