"""Figures of the thesis' Chapter 2: why an eye needs more than a step."""

import numpy as np
from matplotlib.figure import Figure
from scipy import signal

from orient_eye.figures import DATA, MODEL, tidy
from orient_eye.human import human_values
from orient_eye.report.evidence import Evidence
from orient_eye.report.exhibit import Drawn, Exhibit

T1_S, T2_S, TZ_S = 0.2, 0.02, 0.07
"""Time constants of the human eye and its surroundings (thesis 2.1)."""
_AMPLITUDE_DEG = 10.0
_SETTLED = 0.01


def _figure_2_2(evidence: Evidence) -> Drawn:
    """Step response of the human plant (2.1) beside a saccade as fast as people make it (thesis Figure 2.2)."""
    plant = signal.TransferFunction([TZ_S, 1], [T1_S * T2_S, T1_S + T2_S, 1])
    time, response = signal.step(plant, T=np.linspace(0, 1.2, 1201))
    intercept, slope = (human_values(f"duration_{name}")[0].value for name in ("intercept", "slope"))
    duration = 1e-3 * (intercept + slope * _AMPLITUDE_DEG)
    share = np.clip(time / duration, 0, 1)
    desired = 10 * share**3 - 15 * share**4 + 6 * share**5
    figure = Figure(figsize=(7.5, 4.4), layout="constrained")
    axes = figure.subplots()
    axes.plot(1e3 * time, desired, color=MODEL, label=f"a saccade of 10 deg in {1e3 * duration:.0f} ms, of least jerk")
    axes.plot(1e3 * time, response, color=DATA, label="the plant (2.1) under a step")
    axes.axhspan(1 - _SETTLED, 1 + _SETTLED, color="0.85", lw=0, label="within 1 %")
    axes.set(xlabel="time [ms]", ylabel="share of the amplitude", xlim=(0, 1200), ylim=(0, 1.25))
    axes.legend(frameon=False, loc="upper right", ncols=3, fontsize="small")
    tidy(axes)
    late = time[np.flatnonzero(np.abs(response - 1) > _SETTLED)[-1] + 1]
    return Drawn(
        figure, f"Under a step the eye takes {late:.2f} s to come within 1 %; the saccade {1e3 * duration:.0f} ms."
    )


EXHIBITS = {
    "2.2": Exhibit(
        "2 Why a pulse",
        "Step response of the human eye's plant against a desired saccade",
        "The tissue around the eye is sluggish (time constants 0.2 and 0.02 s, zero at 0.07 s): a step of muscle force "
        "moves it many times too slowly, so the brain sends a pulse as well. The duration of the saccade is that of "
        "people (21 ms + 2.2 ms/deg, Carpenter 1988); its shape, of least jerk, is an idealisation.",
        _figure_2_2,
    )
}
