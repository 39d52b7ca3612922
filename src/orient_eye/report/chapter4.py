"""Figures of the thesis' Chapter 4: pulses, and what overshoot inside the settling band would buy."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.commands.pulse_step import PulseStep
from orient_eye.commands.pulses import PULSES
from orient_eye.constants import BAND
from orient_eye.figures import DATA, MODEL, tidy
from orient_eye.plants import make_plant
from orient_eye.report.evidence import Evidence
from orient_eye.report.exhibit import Drawn, Exhibit

Array = NDArray[np.float64]
_CHAPTER = "4 Commands and reward"
_B, _D, _K0 = 35.0, 20.33, 17.5  # of the saccade of 30 deg for which the thesis solves its weights (4.4.5)
_TIME_S = np.linspace(0, 0.3, 601)
_FORMULA = {
    "1": r"$A\,t\,e^{-Bt}$",
    "2": r"$A\,e^{-Bt}(1-e^{-Ct})$",
    "3": r"$A\,e^{-Bt}(1-e^{-Ct}-Ct\,e^{-Ct})$",
}


def _of_pulse(evidence: Evidence, pulse: str | None) -> Drawn:
    """A pulse for 30 deg; None for the bare exponential (thesis Figures 4.3 to 4.6)."""
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    if pulse is None:
        height, label, C = _D * _B / _K0, r"$A\,e^{-Bt}$", None
        values = height * np.exp(-_B * _TIME_S)
    else:
        onset = PULSES[pulse].onset
        C = None if onset is None else onset.fixed
        one = np.ones((1, 1))
        command = PulseStep(F=0 * one, B=_B * one, D=_D * one, k0=_K0 * one, pulse=pulse, C=C)
        values, label = command.pulse_at(_TIME_S)[0, :, 0], _FORMULA[pulse]
    axes.plot(1e3 * _TIME_S, values, color=DATA, label=label)
    axes.fill_between(1e3 * _TIME_S, values, color=DATA, alpha=0.1, lw=0, label="its area, (D - F) / k0")
    axes.set(xlabel="time [ms]", ylabel="pulse of the motor [deg]", xlim=(0, 300))
    axes.set_ylim(0, 1.15 * values.max())
    axes.legend(frameon=False)
    tidy(axes)
    top = int(values.argmax())
    with_C = "" if C is None else f", C = {C:g}"
    return Drawn(
        figure, f"With B = {_B:g}{with_C} 1/s it is highest, {values[top]:.1f} deg, after {1e3 * _TIME_S[top]:.0f} ms."
    )


def _figure_4_9(evidence: Evidence) -> Drawn:
    """A saccade that overshoots within the settling band settles sooner (thesis Figure 4.9)."""
    plant = make_plant("lpf")
    columns = np.ones((2, 1))
    k0 = np.array([[_K0], [_K0 * 0.88]])
    command = PulseStep(F=0 * columns, B=_B * columns, D=_D * columns, k0=k0)
    movement = plant.move(command)
    measures, trajectory = movement.measure(BAND), movement.trajectory()
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    whole, close = figure.subplots(1, 2)
    share = trajectory.yaw_deg / measures.amplitude_deg[:, None]
    for axes in (whole, close):
        axes.axhspan(1 - BAND, 1 + BAND, color="0.85", lw=0, label=f"settling band, {BAND:.0%}")
        for i, (colour, words) in enumerate(((DATA, "k0 = w0: no overshoot"), (MODEL, "k0 < w0: overshoot"))):
            axes.plot(1e3 * trajectory.time, share[i], color=colour, label=f"{words} {measures.overshoot[i]:.2%}")
            axes.axvline(
                1e3 * measures.settling_time_s[i],
                color=colour,
                ls=":",
                label=f"settles in {1e3 * measures.settling_time_s[i]:.0f} ms",
            )
        axes.set(xlabel="time [ms]", ylabel="share of the amplitude", xlim=(0, 400))
        tidy(axes)
    close.set(ylim=(0.97, 1.02), title="the band, closer")
    whole.legend(frameon=False, fontsize="small", loc="lower right")
    early = 1e3 * (measures.settling_time_s[0] - measures.settling_time_s[1])
    return Drawn(figure, f"An overshoot of {measures.overshoot[1]:.2%} would settle {early:.0f} ms sooner.")


def _pulse(title: str, caption: str, pulse: str | None) -> Exhibit:
    return Exhibit(_CHAPTER, title, caption, partial(_of_pulse, pulse=pulse))


EXHIBITS = {
    "4.3": _pulse(
        "The exponential that all pulses fall with",
        "It begins at its height: a motor would have to jump there at once, so every variant multiplies it with an "
        "onset.",
        None,
    ),
    "4.4": _pulse(
        "Pulse of variant 1",
        "It begins at zero but with a kink: the motor's speed jumps. Neurons do not fire so abruptly either.",
        "1",
    ),
    "4.5": _pulse(
        "Pulse of variant 2, C fixed",
        "The onset rate C = 85 1/s is separate from the decay B; the motor's speed still jumps at the beginning.",
        "2",
    ),
    "4.6": _pulse(
        "Pulse of variant 3, C fixed",
        "It begins with zero slope: a motor starts from rest, and muscle force rises smoothly, as in people. C = 3.6 "
        "1/s.",
        "3",
    ),
    "4.9": Exhibit(
        _CHAPTER,
        "Overshoot inside the settling band, low-pass eye",
        "A saccade with k0 below the plant's w0 goes beyond its end by less than the band, and so counts as settled "
        "sooner. The reward's overshoot term is there to make that not worth while; people undershoot rather.",
        _figure_4_9,
    ),
}
