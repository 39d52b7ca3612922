"""Least squares with everything needed to judge the result.

    fit = fit_model(MODELS["first_order"], steps)     # one set of parameters for all these steps
    fit["K"].value, fit["K"].interval, fit.rms_deg, fit.warnings

The confidence intervals come from the curvature of the sum of squares (covariance s^2 (J'J)^-1) and
the t-distribution. They assume that the model is right and that its residuals are noise of one size.
Residuals of neighbouring samples are alike when the model is not quite right: their lag-1
autocorrelation r is measured and the samples are counted as n (1 - r)/(1 + r), which widens the
intervals. They still say nothing of errors that every sample shares: calibration, time base, drift.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from orient_eye.errors import InputError
from orient_eye.sysid.models import Model, Parameter
from orient_eye.sysid.step_response import StepResponse

Array = NDArray[np.float64]
CONFIDENCE = 0.95
_ILL_CONDITIONED = 1e4  # of the Jacobian with columns of unit length; 1 is best
_MAX_EVALUATIONS = 60  # flat valleys, where a parameter cannot be told, take forever otherwise
_SEARCH_SAMPLES = 400  # of each step, in the search for a starting point


@dataclass(frozen=True)
class Estimate:
    """A parameter and how well the data tell it.

    Attributes:
        parameter: its name, unit and bounds.
        value: least squares.
        half_width: of the 95 % confidence interval; infinite where the data cannot tell.
        at_bound: whether it sits on a bound; the interval means little then.
    """

    parameter: Parameter
    value: float
    half_width: float
    at_bound: bool

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval."""
        return self.value - self.half_width, self.value + self.half_width

    def __str__(self) -> str:
        if self.half_width < 1e-6 * abs(self.value) + 1e-9:
            return f"{round(self.value, 8):.6g}"
        if not self.half_width < 100 * abs(self.value) + 0.1:
            return f"{self.value:.3g} ± {self.half_width:.0e}"
        places = int(np.clip(1 - np.floor(np.log10(self.half_width)), 0, 6))
        return f"{self.value:.{places}f} ± {self.half_width:.{places}f}"


@dataclass(frozen=True)
class Fit:
    """A model with the parameters that fit a set of step responses best.

    Attributes:
        model: what was fitted.
        estimates: in the order of the model's parameters.
        rms_deg: root mean square of the residual [deg].
        r_squared: 1 - residual / variance of the data about its mean, over all steps together.
        samples: number of residuals.
        effective_samples: how many independent ones they are worth.
        autocorrelation: lag-1, of the residuals.
        condition: number of the Jacobian with columns of unit length.
        warnings: for people.
    """

    model: Model
    estimates: tuple[Estimate, ...]
    rms_deg: float
    r_squared: float
    samples: int
    effective_samples: float
    autocorrelation: float
    condition: float
    warnings: tuple[str, ...]

    def __getitem__(self, name: str) -> Estimate:
        return self.estimates[self.model.names.index(name)]

    @property
    def values(self) -> Array:
        """Of the parameters, (parameters,)."""
        return np.array([e.value for e in self.estimates])

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Why the data do not tell these parameters, for people; empty where they do."""
        found = []
        for e in self.estimates:
            told = f"{e.parameter.name} = {e} {e.parameter.unit}".rstrip()
            if e.at_bound and not _none_seen(e):
                found.append(f"{told} sits on its bound ({e.parameter.low:g} to {e.parameter.high:g})")
            elif not e.half_width < abs(e.value) and not _none_seen(e):
                found.append(f"{told} has an interval as wide as itself")
        if self.condition > _ILL_CONDITIONED:
            found.append(f"parameters cannot be told apart: condition number {self.condition:.1e} (1 is best)")
        return tuple(found)

    @property
    def shows_dead_time(self) -> bool:
        """Whether it has a dead time, whose interval does not reach 0."""
        last = self.estimates[-1]
        return last.parameter.name == "dead_time" and last.interval[0] > 0 and not last.at_bound

    def response(self, step: StepResponse) -> Array:
        """The fitted model's answer to the motor movement of a step [deg], (samples,)."""
        return self.model.response(self.values, step)


def fit_model(model: Model, steps: Sequence[StepResponse], start: Array | None = None) -> Fit:
    """Fit one set of parameters to all steps at once; every sample counts the same.

    Args:
        model: one of `MODELS`.
        steps: measured responses.
        start: values to start from; None searches the model's grid of starts.

    Raises:
        InputError: fewer samples than the model has parameters, or a motor or eye that does not move.
    """
    samples = sum(len(s.time) for s in steps)
    if samples <= len(model.parameters):
        raise InputError(
            f"{_names(steps)}: {samples} samples cannot tell {len(model.parameters)} parameters; record more rows"
        )
    for step in steps:
        if np.ptp(step.motor_deg) == 0 and step.motor_deg[0] == 0:
            raise InputError(f"{step.name}: the motor does not move, so nothing can be identified; record a step")
    eye = np.concatenate([s.eye_deg for s in steps])
    if np.ptp(eye) == 0:
        raise InputError(f"{_names(steps)}: the eye does not move, so nothing can be identified; check the column")
    low, high = (np.array([getattr(p, side) for p in model.parameters]) for side in ("low", "high"))
    if start is None:
        start = _search(model, steps)
    start = np.clip(start, low + 1e-9 * (high - low), high - 1e-9 * (high - low))

    def residual(values: Array) -> Array:
        difference: Array = np.concatenate([model.response(values, s) for s in steps]) - eye
        return difference

    solution = optimize.least_squares(
        residual,
        start,
        jac="3-point",
        bounds=(low, high),
        x_scale=_scale(model, start),
        ftol=1e-12,
        xtol=1e-12,
        gtol=1e-12,
        max_nfev=_MAX_EVALUATIONS,
    )
    fit = _judged(model, steps, solution.x, solution.fun, solution.jac)
    if solution.status == 0:
        unfinished = f"{model.title}: the search stopped after {_MAX_EVALUATIONS} steps, in a flat valley"
        return replace(fit, warnings=(*fit.warnings, unfinished))
    return fit


def _search(model: Model, steps: Sequence[StepResponse]) -> Array:
    """Best of the model's starting points; K follows from the others by linear least squares."""
    thin = [_thinned(s) for s in steps]
    eye = np.concatenate([s.eye_deg for s in thin])
    best, best_cost = np.zeros(0), np.inf
    for shape in itertools.product(*(p.starts for p in model.parameters[1:])):
        unit = np.concatenate([model.shape_response(np.array(shape), s) for s in thin])
        gain = float(unit @ eye / max(float(unit @ unit), 1e-300))
        cost = float(np.sum((eye - gain * unit) ** 2))
        if cost < best_cost:
            best, best_cost = np.array([gain, *shape]), cost
    return best


def _thinned(step: StepResponse) -> StepResponse:
    every = -(-len(step.time) // _SEARCH_SAMPLES)
    return StepResponse(step.name, step.time[::every], step.motor_deg[::every], step.eye_deg[::every])


def _scale(model: Model, start: Array) -> Array:
    typical = {"K": 1.0, "dead_time": 0.01}
    return np.array([typical.get(p.name, abs(v)) for p, v in zip(model.parameters, start, strict=True)])


def _judged(model: Model, steps: Sequence[StepResponse], values: Array, residual: Array, jacobian: Array) -> Fit:
    count, parameters = jacobian.shape
    squares = float(residual @ residual)
    correlation = autocorrelation(np.split(residual, np.cumsum([len(s.time) for s in steps])[:-1]))
    effective = effective_samples(count, correlation, parameters)
    norms = np.linalg.norm(jacobian, axis=0)
    singular = np.linalg.svd(jacobian / np.where(norms > 0, norms, 1), compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    if condition < 1e12 and (norms > 0).all():
        variance = squares / (count - parameters) * np.diag(np.linalg.inv(jacobian.T @ jacobian)) * count / effective
        half = stats.t.ppf((1 + CONFIDENCE) / 2, effective - parameters) * np.sqrt(variance)
    else:
        half = np.full(parameters, np.inf)
    estimates = tuple(
        Estimate(p, float(v), float(h), _at_bound(p, float(v)))
        for p, v, h in zip(model.parameters, values, half, strict=True)
    )
    eye = np.concatenate([s.eye_deg for s in steps])
    return Fit(
        model,
        estimates,
        rms_deg=float(np.sqrt(squares / count)),
        r_squared=1 - squares / float(np.sum((eye - eye.mean()) ** 2)),
        samples=count,
        effective_samples=effective,
        autocorrelation=correlation,
        condition=condition,
        warnings=tuple(_warnings(model, estimates, condition)),
    )


def autocorrelation(residuals: Sequence[Array]) -> float:
    """Lag-1 autocorrelation of residuals within each step, between 0 and 1."""
    power = sum(float(r @ r) for r in residuals)
    return float(np.clip(sum(float(r[1:] @ r[:-1]) for r in residuals) / power, 0, 1)) if power > 0 else 0.0


def effective_samples(count: int, correlation: float, parameters: int) -> float:
    """Independent samples that count autocorrelated ones are worth, always 2 more than the parameters."""
    return float(max(count * (1 - correlation) / (1 + correlation), parameters + 2))


def _at_bound(parameter: Parameter, value: float) -> bool:
    near = 1e-4 * (parameter.high - parameter.low)
    return min(value - parameter.low, parameter.high - value) < min(near, 0.01 * abs(value) + 1e-6)


def _none_seen(estimate: Estimate) -> bool:
    """Whether it is a dead time of 0, which is what an eye without one has."""
    return estimate.parameter.name == "dead_time" and estimate.at_bound and estimate.value < estimate.parameter.high / 2


def _warnings(model: Model, estimates: tuple[Estimate, ...], condition: float) -> list[str]:
    found, untold = [], []
    for e in estimates:
        p = e.parameter
        if _none_seen(e):
            found.append("dead_time sits on its bound 0: these data show none")
        elif e.at_bound:
            found.append(f"{p.name} = {e.value:.4g} sits on its bound ({p.low:g} to {p.high:g}): do not trust it")
        elif not e.half_width < abs(e.value):
            untold.append(f"{p.name} = {e} {p.unit}".rstrip())
    if untold:
        found.append(f"cannot be told from these data (95 %): {', '.join(untold)}")
    if condition > _ILL_CONDITIONED:
        found.append(f"parameters cannot be told apart: condition number {condition:.1e} (1 is best)")
    return [f"{model.title}: {text}" for text in found]


def _names(steps: Sequence[StepResponse]) -> str:
    return ", ".join(s.name for s in steps) or "no recording"
