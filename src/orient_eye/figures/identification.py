"""Pictures of an identification, named after the thesis' figures."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import DATA, MODEL, OTHER, tidy
from orient_eye.sysid.identification import Identification

if TYPE_CHECKING:
    from orient_eye.sysid.physical import PhysicalFit
    from orient_eye.sysid.physical_recordings import Measured

_OF_ANGLES = {"yaw": DATA, "pitch": MODEL, "roll": OTHER}


def figure_3_5(found: Identification) -> Figure:
    """K and w0 against the amplitude of the step, with intervals, and the surrogate's (thesis Figure 3.5)."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    amplitude = np.array([s.amplitude_deg for s in found.steps])
    order = amplitude.argsort()
    chosen = {"K": found.surrogate.K, "w0": found.surrogate.w0}  # the latter None of second order
    rest = found.surrogate.rest
    where = f" from its rest at {rest:.4g} deg" if rest else ""
    labels = {"K": "K [deg of eye per deg of motor]", "w0": r"$\omega_0$ [rad/s]"}
    for axes, symbol in zip(figure.subplots(1, 2), labels, strict=True):
        estimates = [fits[0][symbol] for fits in found.fits]
        value = np.array([e.value for e in estimates])
        width = np.array([e.half_width for e in estimates])
        width = np.where(np.isfinite(width), width, np.nan)
        axes.fill_between(
            amplitude[order], (value - width)[order], (value + width)[order], color=DATA, alpha=0.12, lw=0,
            label="95 % interval of the fit",
        )  # fmt: skip
        axes.plot(amplitude[order], value[order], "o-", color=DATA, ms=4, lw=1.2, label="fit of each step")
        told = chosen[symbol]
        if told is not None:
            axes.axhline(told, color=MODEL, ls="--", label=f"surrogate: {told:.4g}")
        axes.set(xlabel=f"step amplitude [deg of motor{where}]", ylabel=labels[symbol])
        axes.ticklabel_format(useOffset=False)
        tidy(axes)
        axes.legend(frameon=False)
    figure.suptitle("First-order fit of each step response")
    return figure


def figure_3_6(found: Identification, shown: Sequence[int] | NDArray[np.intp]) -> Figure:
    """Step responses of the plant beside the surrogate's, and their difference (thesis Figure 3.6).

    Args:
        found: of a plant.
        shown: indices of the steps to draw.
    """
    figure = Figure(figsize=(8, 7), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    colours = colormaps["viridis"](np.linspace(0, 0.9, len(shown)))
    for colour, index in zip(colours, shown, strict=True):
        step = found.steps[index]
        answer = found.answer(step)
        top.plot(step.time, step.eye_deg, color=colour, lw=1.6)
        top.plot(step.time, answer, color=MODEL, lw=1, ls="--")
        bottom.plot(step.time, step.eye_deg - answer, color=colour, lw=1.2)
        top.annotate(
            step.name, (step.time[-1], step.eye_deg[-1]), xytext=(4, 0), textcoords="offset points",
            va="center", fontsize=8, color=colour,
        )  # fmt: skip
    top.plot([], [], color="black", lw=1.6, label="plant")
    top.plot([], [], color=MODEL, ls="--", lw=1, label=f"surrogate, {_numbers(found)}")
    low, high = top.get_ylim()
    top.set_ylim(low, high + 0.1 * (high - low))
    top.legend(frameon=False, loc="upper left", ncols=2)
    top.set(ylabel="movement of the eye [deg]", title="Step responses, by amplitude of the motor's step")
    bottom.axhline(0, color="black", lw=0.6)
    bottom.set(xlabel="time [s]", ylabel="plant - surrogate\n[deg]")
    for axes in (top, bottom):
        tidy(axes)
    return figure


def _numbers(found: Identification) -> str:
    """The surrogate's numbers with their units."""
    told = ((p.name, getattr(found.surrogate, p.name), p.unit) for p in found.surrogate_model.parameters)
    return ", ".join(f"{name} = {value:.4g} {unit.removeprefix('deg/deg')}".rstrip() for name, value, unit in told)


def recorded_steps(found: Identification) -> Figure:
    """Recorded responses with their fits, the motor that drives them, and the residuals."""
    rows = len(found.steps)
    figure = Figure(figsize=(13, 2.9 * rows + 0.6), layout="constrained")
    grid = figure.subplots(rows, 3, squeeze=False, width_ratios=(3, 2, 2))
    best = found.preferred.fit.model.name
    drawn = list(dict.fromkeys(("first_order", best, found.surrogate_model.name)))[-2:]
    styles = dict(zip(drawn, ((MODEL, "--"), (OTHER, "-")), strict=False))
    for line, step, fits in zip(grid, found.steps, found.fits, strict=True):
        eye, residual, motor = line
        eye.plot(step.time, step.eye_deg, "o", color=DATA, ms=3, label="measured")
        for fit in (f for f in fits if f.model.name in drawn):
            colour, style = styles[fit.model.name]
            answer = fit.response(step)
            eye.plot(step.time, answer, style, color=colour, lw=1.3, label=f"{fit.model.title}, K = {fit['K']}")
            residual.plot(
                step.time, step.eye_deg - answer, ".-", color=colour, lw=0.8, ms=3, label=f"rms {fit.rms_deg:.2f} deg"
            )
        motor.plot(step.time, step.motor_deg, ".-", color="black", lw=0.9, ms=3)
        eye.set(title=step.name, ylabel="eye [deg]")
        residual.set(title="measured - fitted", ylabel="residual [deg]")
        motor.set(title=str(step.source.get("motor", "motor")), ylabel="motor [deg]")
        residual.axhline(0, color="black", lw=0.6)
        down = step.eye_deg[-1] < step.eye_deg[0]
        eye.legend(frameon=False, fontsize=8, loc="upper right" if down else "lower right")
        residual.legend(frameon=False, fontsize=8)
        for axes in line:
            tidy(axes)
            axes.set_xlabel("time [s]")
    return figure


def fitted_eye(fit: "PhysicalFit", recordings: "Sequence[Measured]", motors: Sequence[str]) -> Figure:
    """Recorded angles with those of the fitted eye, the residuals, and the motors that move.

    Args:
        fit: to these recordings.
        recordings: with their motors in the order of the names.
        motors: their names.
    """
    figure = Figure(figsize=(13, 2.9 * len(recordings) + 0.6), layout="constrained")
    grid = figure.subplots(len(recordings), 3, squeeze=False, width_ratios=(3, 2, 2))
    for line, recording, residuals in zip(grid, recordings, fit.residuals, strict=True):
        eye, residual, motor = line
        time = recording.time - recording.time[0]
        for i, axis in enumerate(recording.axes):
            off, colour = -residuals[:, i], _OF_ANGLES[axis]
            rms = float(np.sqrt(np.mean(off**2)))
            eye.plot(time, recording.angles[:, i], "o", color=colour, ms=3, alpha=0.45, label=f"{axis}, measured")
            eye.plot(time, recording.angles[:, i] - off, color=colour, lw=1.3, label=f"{axis}, fitted")
            residual.plot(time, off, ".-", color=colour, lw=0.6, ms=3, label=f"{axis}, rms {rms:.2f} deg")
        for name, position in zip(motors, recording.motor.T, strict=True):
            if np.ptp(position):
                motor.plot(time, position, ".-", lw=0.9, ms=3, label=name)
        eye.set(title=recording.name, ylabel="eye [deg]")
        residual.set(title="measured - fitted", ylabel="residual [deg]")
        motor.set(title="motors", ylabel="motor [deg]")
        residual.axhline(0, color="black", lw=0.6)
        for axes in line:
            tidy(axes)
            axes.set_xlabel("time [s]")
            axes.legend(frameon=False, fontsize=8)
    return figure
