"""Figures of the thesis' Chapter 5: what was learned in each of its five cases, and why two of them failed there."""

from collections.abc import Callable
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import DATA, MODEL, OTHER, tidy
from orient_eye.human import people
from orient_eye.learning.figures import figure_5_1, figure_5_2, figure_5_3, figure_5_4
from orient_eye.learning.figures.movement import pure_step
from orient_eye.learning.figures.output import draw_energy
from orient_eye.motor import names
from orient_eye.movement.main_sequence import fit_main_sequence
from orient_eye.movement.measures import measure
from orient_eye.report.evidence import Evidence, Judged
from orient_eye.report.exhibit import Drawn, Exhibit
from orient_eye.task.solved_weights import action_of

Array = NDArray[np.float64]
OF_CASE = {
    "1": ("5.1 Variant 1", "5.1", None, "5.2", "5.3", "5.4"),
    "2-fixed": ("5.2.1 Variant 2, C fixed", "5.5", None, "5.6", "5.7", "5.8"),
    "2-varying": ("5.2.2 Variant 2, C varying", "5.9", "5.10", "5.11", "5.12", "5.13"),
    "3-fixed": ("5.3.1 Variant 3, C fixed", "5.14", None, "5.15", "5.16", "5.17"),
    "3-varying": ("5.3.2 Variant 3, C varying", "5.18", "5.19", "5.20", "5.21", "5.22"),
}
"""Case to its chapter, and the thesis' numbers of its figures: output, C, signals, against a step, main sequence."""
_DISCUSSION = "5.4 Discussion"
_B, _D_DEG, _TARGET_DEG = 35.0, 20.33, 30.0
_K0 = np.linspace(10.0, 40.0, 301)


def output(judged: Judged) -> Drawn:
    """Numbers of the action against size (5.1, 5.5, 5.9, 5.14, 5.18)."""
    gap = 100 * judged.gap
    return Drawn(
        figure_5_1(judged.policy, judged.pairs, judged.table, only=("B", "D", "k0")),
        f"Over {len(gap)} random saccades the mean reward gap to the searched optimum is {gap.mean():.2f} %, the 95th "
        f"percentile {np.quantile(gap, 0.95):.2f} %.",
    )


def onset(judged: Judged) -> Drawn:
    """C against size (5.10, 5.19)."""
    made = judged.sizes
    C = made.outcome.command.C[:, names(judged.task.plant.motors).index(judged.task.actions.numbers[0].motor)]  # type: ignore[attr-defined]  # as of every case with a C
    return Drawn(
        figure_5_1(judged.policy, judged.pairs, judged.table, only=("C",)),
        f"C is at most {C.max():.3g} 1/s, at {made.size_deg[C.argmax()]:g} deg, and {C[-1]:.3g} 1/s at "
        f"{made.size_deg[-1]:g} deg.",
    )


def signals(judged: Judged) -> Drawn:
    """Pulse, command and movement (5.2, 5.6, 5.11, 5.15, 5.20)."""
    measures = judged.sizes.outcome.measures
    return Drawn(
        figure_5_2(judged.policy, judged.task),
        f"Saccades settle in {1e3 * np.nanmin(measures.settling_time_s):.0f} to "
        f"{1e3 * np.nanmax(measures.settling_time_s):.0f} ms and overshoot by at most "
        f"{np.nanmax(measures.overshoot):.2%}.",
    )


def against_step(judged: Judged) -> Drawn:
    """Beside a pure step of the motor (5.3, 5.7, 5.12, 5.16, 5.21)."""
    made = judged.sizes
    stepped = measure(pure_step(made), made.target)
    faster = stepped.settling_time_s / made.outcome.measures.settling_time_s
    return Drawn(
        figure_5_3(judged.policy, judged.task),
        f"A step takes {np.nanmax(faster):.1f} times as long to settle as the policy's command for "
        f"{made.size_deg[np.nanargmax(faster)]:g} deg, and {np.nanmin(faster):.1f} times for "
        f"{made.size_deg[np.nanargmin(faster)]:g} deg.",
    )


def main_sequence(judged: Judged) -> Drawn:
    """Main sequence and velocity profiles (5.4, 5.8, 5.13, 5.17, 5.22)."""
    fit = fit_main_sequence(
        judged.sizes.outcome.measures.amplitude_deg, judged.bout.peak_velocity_deg_s, judged.bout.duration_s
    )
    return Drawn(
        figure_5_4(judged.policy, judged.task),
        f"V0 = {fit.V0:.0f} deg/s, c = {fit.c:.1f} deg; by a velocity threshold D = {fit.D0_ms:.0f} ms + "
        f"{fit.d_ms:.2f} ms/deg; V D / A = {fit.k:.2f} (people: {people().k:.2f}).",
    )


def _figure_5_23(evidence: Evidence) -> Drawn:
    """Cost of the training saccades while the two cases with varying C learn (thesis Figure 5.23)."""
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    says = []
    for axes, case in zip(figure.subplots(1, 2), ("2-varying", "3-varying"), strict=True):
        judged = evidence.policy("lpf", case)
        course = judged.course
        axes.semilogy(
            course["saccades"], -course["reward_mean"], color=DATA, label="training saccades, with exploration"
        )
        best = -float(judged.pairs.optimum.reward.mean())
        axes.axhline(best, color=MODEL, ls="--", label="searched optimum of other random saccades")
        axes.set(xlabel="saccades", ylabel="cost: - mean reward", title=f"case {case}")
        axes.legend(frameon=False, fontsize="small")
        tidy(axes)
        says.append(f"case {case} ends {100 * course['gap_mean'][-1]:.2f} % from it")
    return Drawn(figure, f"On the evaluation saccades, beside the searched optimum of the same: {', '.join(says)}.")


def _figure_5_24(evidence: Evidence) -> Drawn:
    """Reward of a saccade of 30 deg against k0, B and D held at the thesis' numbers (thesis Figure 5.24)."""
    figure = Figure(figsize=(12, 4.6), layout="constrained")
    says = []
    for axes, case in zip(figure.subplots(1, 2), ("2-varying", "3-varying"), strict=True):
        task = evidence.policy("lpf", case).task
        targets = task.targets
        start = targets.rest(targets.orientation(np.zeros((1, 1))))
        target = targets.orientation(np.full((1, 1), _TARGET_DEG))
        rows = np.zeros(len(_K0), int)
        action = np.stack([action_of(task, _B, (_D_DEG,), k0) for k0 in _K0])
        reward = task.perform(start[rows], action, target[rows]).reward
        for (name, values), colour in zip(reward.terms.items(), (OTHER, "#e09f3e", "#7d5ba6", "#355070"), strict=False):
            cost = -task.weights[name] * values
            axes.plot(_K0, np.where(cost > 0, cost, np.nan), "--", lw=1.1, color=colour, label=name)
        axes.plot(_K0, -reward.total, color="black", lw=1.8, label="total")
        best = int(reward.total.argmax())
        axes.plot(_K0[best], -reward.total[best], "D", color=MODEL, label=f"least: k0 = {_K0[best]:.1f} 1/s")
        least = -reward.total[best]
        axes.set(yscale="log", ylim=(1e-4 * least, 500 * least), xlabel="k0 [1/s]", ylabel="cost: - weighted reward")
        axes.set_title(f"case {case}: 30 deg, B = {_B:g} 1/s, D = {_D_DEG:g} deg")
        axes.legend(frameon=False, fontsize="small", ncols=3, loc="upper center")
        tidy(axes)
        right = _K0 > 25
        says.append(
            f"case {case}: best at k0 = {_K0[best]:.1f}; beyond 25 the cost is at least "
            f"{-reward.total[right].max() / least:.2f} times that"
        )
    return Drawn(figure, f"{'; '.join(says)}.".capitalize())


def _figure_5_25(evidence: Evidence) -> Drawn:
    """Energy of the command against size for three variants side by side (thesis Figure 5.25)."""
    figure = Figure(figsize=(13, 4.2), layout="constrained")
    panels = figure.subplots(1, 3)
    at_30 = []
    for axes, case in zip(panels, ("1", "2-fixed", "3-fixed"), strict=True):
        judged = evidence.policy("lpf", case)
        draw_energy(axes, judged.policy, judged.pairs)
        axes.set_title(f"case {case}")
        size, energy = judged.sizes.size_deg, judged.sizes.outcome.command.energy()
        at_30.append(float(energy[np.abs(size - 30).argmin()]))
        axes.legend(frameon=False, fontsize="small", loc="upper left")
    panels[0].set_ylabel("energy [deg$^2$/s]")
    one, two, three = at_30
    return Drawn(figure, f"At 30 deg: {one:.3g}, {two:.3g} and {three:.3g} deg²/s, each for weights of its own.")


CAPTIONS: dict[Callable[[Judged], Drawn], tuple[str, str]] = {
    output: (
        "What the policy puts out against saccade size",
        "Lines are means over starting points, shades their range, points the best action a search finds. D - F is "
        "proportional to the size, k0 cancels the plant's pole, and B falls with size: large saccades are slower on "
        "purpose, to save energy. B stands at its upper bound for small saccades, where people have no such bound.",
    ),
    onset: (
        "Onset rate C against saccade size",
        "C is what brings the motor to its speed limit in every saccade: the larger one is, the slower its onset has "
        "to be. For the smallest, B stands at its bound and the limit asks for less. People recruit more motor "
        "neurons for larger saccades instead of driving all of them in every one.",
    ),
    signals: (
        "Pulse, motor command and movement for several sizes",
        "The pulse lasts longer the larger the saccade, and the step below it holds the eye. The command begins "
        "abruptly with variants 1 and 2; the nerves' does not.",
    ),
    against_step: (
        "Saccades under the policy's command and under a pure step",
        "Under a step all sizes take about as long; with a pulse small ones take less, as in people, and the largest "
        "more. A step begins almost at once with its highest speed, which no muscle does.",
    ),
    main_sequence: (
        "Main sequence, velocity profiles and skewness, beside people",
        "Peak velocity and duration grow with size as in people. The thesis' duration, drawn here and in the skewness, "
        "ends where the eye stays within 1 % of its end; those of people end at a velocity threshold, "
        "earlier. Acceleration takes a smaller share of ours than of people's small saccades.",
    ),
}


_OF_VARYING_2 = (
    " Beyond 42 deg the best action itself jumps to the largest k0 and a faster onset: so slow a command costs less at "
    "the speed limit. There, and only there, the thesis' policy was right to go."
)
_OF_VARYING_3 = (
    "C follows from a bound on the motor's speed (4.31), which the motor stays below. Up to 7 deg B stands at its own "
    "bound and C grows with size; from there it falls, as larger saccades need a slower onset. People recruit more "
    "motor neurons for larger saccades instead."
)
"""What is so of these cases alone."""


def _exhibits() -> dict[str, Exhibit]:
    kinds = (output, onset, signals, against_step, main_sequence)
    found = {}
    for case, (chapter, *numbers) in OF_CASE.items():
        for number, kind in zip(numbers, kinds, strict=True):
            if number is not None:
                title, caption = CAPTIONS[kind]
                if case == "2-varying" and kind in (output, onset):
                    caption += _OF_VARYING_2
                if case == "3-varying" and kind is onset:
                    caption = _OF_VARYING_3
                found[number] = Exhibit(
                    chapter, f"{title}: low-pass eye, case {case}", caption, partial(_of, kind, case)
                )
    return found


def _of(kind: Callable[[Judged], Drawn], case: str, evidence: Evidence) -> Drawn:
    return kind(evidence.policy("lpf", case))


EXHIBITS = {
    **_exhibits(),
    "5.23": Exhibit(
        _DISCUSSION,
        "How the two cases learn in which the thesis failed",
        "Cost of the training saccades, on a logarithmic scale. In the thesis it stopped falling after 50 000 "
        "saccades, at the largest k0; here it goes on to the optimum. The last part of the way is exploration, which "
        "shrinks.",
        _figure_5_23,
    ),
    "5.24": Exhibit(
        _DISCUSSION,
        "Cost of a saccade of 30 deg against k0, B and D held",
        "Below w0 = 17.5 overshoot makes a cliff; above it the slope is gentle. A policy that explores is punished "
        "on one side only, and hides at large k0.",
        _figure_5_24,
    ),
    "5.25": Exhibit(
        _DISCUSSION,
        "Energy against saccade size for three cases",
        "Each case has weights of its own, so this compares the chosen saccades more than the pulses. People's muscles "
        "spend energy on holding too; here only the motor's movement counts.",
        _figure_5_25,
    ),
}
