"""Figures of the thesis' Chapter 3: the eye, and the low-pass surrogate that is identified on it."""

import numpy as np

from orient_eye.figures.identification import figure_3_5, figure_3_6
from orient_eye.report.evidence import Evidence
from orient_eye.report.exhibit import Drawn, Exhibit

_CHAPTER = "3 The eye and its surrogate"
_SHOWN_DEG = (5.0, 10.0, 15.0, 20.0, 25.0)


def _figure_3_5(evidence: Evidence) -> Drawn:
    found = evidence.identification
    at = [step.amplitude_deg for step in found.steps]
    K, w0 = ([fits[0][symbol].value for fits in found.fits] for symbol in ("K", "w0"))
    return Drawn(
        figure_3_5(found),
        f"From {min(at):g} to {max(at):g} deg of motor, K goes from {K[0]:.3f} to {K[-1]:.3f}, and w0 from {w0[0]:.1f} "
        f"to {w0[-1]:.1f} 1/s; the thesis took 1.4758 and 17.5.",
    )


def _figure_3_6(evidence: Evidence) -> Drawn:
    found = evidence.identification
    amplitude = np.array([step.amplitude_deg for step in found.steps])
    shown = np.array([int(np.abs(amplitude - size).argmin()) for size in _SHOWN_DEG])
    off = [float(np.sqrt(np.mean((found.steps[i].eye_deg - found.answer(found.steps[i])) ** 2))) for i in shown]
    return Drawn(figure_3_6(found, shown), f"The surrogate is off by {min(off):.2f} to {max(off):.2f} deg rms.")


EXHIBITS = {
    "3.5": Exhibit(
        _CHAPTER,
        "K and w0 against the amplitude of the motor's step, MuJoCo eye",
        "A linear eye would have level lines. The elastics make the gain K and above all the cut-off frequency w0 "
        "depend on the amplitude: large movements are slower. The thesis takes one K and one w0 for all.",
        _figure_3_5,
    ),
    "3.6": Exhibit(
        _CHAPTER,
        "Step responses of the MuJoCo eye beside the surrogate's",
        "The surrogate moves like the eye to within a fraction of a degree, worst where w0 is far from the "
        "mean one; what it misses is what a policy trained on it does not know.",
        _figure_3_6,
    ),
}
