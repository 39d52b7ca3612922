"""Which model describes the data: a fair comparison.

    rows = compare(steps)                    # leave one recording out at a time
    rows = compare(steps, held_out)          # or judge on steps that were not fitted

Two judges. AICc weighs the residual against the number of parameters; it counts the samples as the
independent ones they are worth (see `fit.py`), the same number for all models: that of the model that
fits best, whose residual is nearest to noise. And the error on data that were not fitted, which needs
no such assumption and is the one to believe when they disagree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye.sysid.fit import Fit, effective_samples, fit_model
from orient_eye.sysid.models import MODELS
from orient_eye.sysid.step_response import StepResponse

Array = NDArray[np.float64]
_PERFECT = 1e-6  # of the data's root mean square: smaller residuals are the optimiser's, not the model's


@dataclass(frozen=True)
class HeldOut:
    """How well a fit predicts a step it has not seen.

    Attributes:
        name: of the step.
        rms_deg: root mean square error [deg].
        r_squared: 1 - error / variance of the step's data about their mean.
    """

    name: str
    rms_deg: float
    r_squared: float


@dataclass(frozen=True)
class Compared:
    """One model in the comparison.

    Attributes:
        fit: to all steps at once.
        aicc: corrected Akaike information; smaller is better, only differences mean something.
        held_out: its predictions of steps that were not fitted; empty where there is one step only.
    """

    fit: Fit
    aicc: float
    held_out: tuple[HeldOut, ...]

    @property
    def held_out_rms_deg(self) -> float:
        """Root mean square over the held-out steps [deg], each counting the same; NaN without any."""
        return float(np.sqrt(np.mean([h.rms_deg**2 for h in self.held_out]))) if self.held_out else float("nan")


def compare(steps: Sequence[StepResponse], held_out: Sequence[StepResponse] = ()) -> tuple[Compared, ...]:
    """Fit every model of `MODELS` to all steps together and judge them.

    Args:
        steps: to fit.
        held_out: to predict; empty for leaving out one of the steps at a time.

    Raises:
        InputError: see `fit_model`.
    """
    fits = [fit_model(model, steps) for model in MODELS.values()]
    finest = min(fits, key=lambda f: f.rms_deg)
    most = max(len(f.estimates) for f in fits)
    worth = effective_samples(finest.samples, finest.autocorrelation, most + 1)
    size = float(np.sqrt(np.mean(np.concatenate([s.eye_deg for s in steps]) ** 2)))
    return tuple(
        Compared(f, aicc(max(f.rms_deg, _PERFECT * size), len(f.estimates), worth), _predictions(f, steps, held_out))
        for f in fits
    )


def aicc(rms: float, parameters: int, samples: float) -> float:
    """Akaike's information, corrected for few samples, of a least-squares fit."""
    k = parameters + 1  # and the size of the noise
    return samples * float(np.log(rms**2)) + 2 * k + 2 * k * (k + 1) / (samples - k - 1)


def predict(name: str, answer: Array, step: StepResponse) -> HeldOut:
    """Error of an answer (samples,) to a step's motor movement."""
    error = answer - step.eye_deg
    variance = float(np.sum((step.eye_deg - step.eye_deg.mean()) ** 2))
    return HeldOut(name, float(np.sqrt(np.mean(error**2))), 1 - float(error @ error) / max(variance, 1e-300))


def _predictions(fit: Fit, steps: Sequence[StepResponse], held_out: Sequence[StepResponse]) -> tuple[HeldOut, ...]:
    if held_out:
        return tuple(predict(s.name, fit.response(s), s) for s in held_out)
    if len(steps) < 2:
        return ()
    predictions = []
    for left_out in steps:
        others = [s for s in steps if s is not left_out]
        without = fit_model(fit.model, others, start=fit.values)
        predictions.append(predict(left_out.name, without.response(left_out), left_out))
    return tuple(predictions)


def preferred(rows: Sequence[Compared]) -> Compared:
    """The model to use: the smallest held-out error, and where nothing was held out the smallest AICc.

    Among models within 2 % of the smallest error, the simplest. One whose dead time may as well be 0, by its interval,
    gives way to the same model without.
    """
    if all(row.held_out for row in rows):
        least = min(row.held_out_rms_deg for row in rows)
        floor = _PERFECT * max(row.fit.rms_deg for row in rows) + 1e-9
        best = next(row for row in rows if row.held_out_rms_deg <= 1.02 * least + floor)
    else:
        best = min(rows, key=lambda row: row.aicc)
    if best.fit.shows_dead_time:
        return best
    simpler = best.fit.model.name.removesuffix("_dead_time")
    return next(row for row in rows if row.fit.model.name == simpler)
