"""What the thesis left open, from the studies that `scripts/studies.py` makes with three seeds each."""

import numpy as np
from matplotlib.figure import Figure

from orient_eye.figures import DATA, MODEL, OTHER, tidy
from orient_eye.learning.figures.saccades import beside
from orient_eye.report.evidence import Evidence
from orient_eye.report.exhibit import Drawn, Exhibit

_CHAPTER = "What the thesis left open"
_KINDS = {
    "with": (DATA, "logarithm of the reward, falling temperature"),
    "without": (MODEL, "raw reward, automatic temperature"),
    "thesis": (OTHER, "the thesis' preset"),
}
_AT_DEG = 30.0


def _hiding(evidence: Evidence) -> Drawn:
    """Gap while learning, and k0 at the end, with and without the cure."""
    figure = Figure(figsize=(12, 8), layout="constrained")
    found = evidence.studies["hiding"]
    at_30: dict[str, list[float]] = {}
    for row, case in zip(figure.subplots(2, 2), ("2-varying", "3-varying"), strict=True):
        course, output = row
        for run in (run for run in found if run["case"] == case):
            colour, words = _KINDS[run["kind"]]
            label = words if run["seed"] == 0 else None
            later = np.array(run["saccades"]) > 0
            course.loglog(
                np.array(run["saccades"])[later], 100 * np.array(run["gap"])[later], color=colour, lw=1.2, label=label
            )
            output.plot(run["size_deg"], run["k0"], ".-", color=colour, lw=1.2)
            k0 = float(np.interp(_AT_DEG, run["size_deg"], run["k0"]))
            at_30.setdefault(run["kind"], []).append(k0)
        course.set(xlabel="saccades", ylabel="mean reward gap [%]", title=f"case {case}: while learning")
        output.axhline(17.5, color="black", ls=":", lw=1, label="w0 = 17.5 1/s")
        output.set(
            xlabel="saccade size [deg]", ylabel="k0 [1/s]", ylim=(5, 42), title=f"case {case}: k0 that it came to"
        )
        for axes in row:
            tidy(axes)
    (lines, labels), (more, others) = (axes.get_legend_handles_labels() for axes in figure.axes[:2])
    beside(figure, [*lines, *more], [*labels, *others])
    told = "; ".join(f"{_KINDS[kind][1]}, {min(k0):.1f} to {max(k0):.1f}" for kind, k0 in at_30.items())
    return Drawn(figure, f"k0 that was learned for 30 deg, where 17.5 is best: {told}.")


def _amplitude(evidence: Evidence) -> Drawn:
    """k0 and D against amplitude on the whole eye, beside w0 and K of its step responses."""
    runs, found = evidence.studies["amplitude"], evidence.identification
    step = np.array([each.amplitude_deg for each in found.steps])
    K, w0 = (np.array([fits[0][symbol].value for fits in found.fits]) for symbol in ("K", "w0"))
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    for run in runs:
        size, first = np.array(run["size_deg"]), run["seed"] == 0
        left.plot(size, run["k0"], color=DATA, label="learned (three seeds)" if first else None)
        right.plot(size, size / np.array(run["step_deg"]), color=DATA)
    best = runs[0]
    left.plot(best["size_deg"], best["k0_best"], ".", color=MODEL, ms=7, label="searched optimum")
    right.plot(best["size_deg"], np.array(best["size_deg"]) / np.array(best["step_deg_best"]), ".", color=MODEL, ms=7)
    left.plot(K * step, w0, "--", color=OTHER, label="first-order fit of step responses: w0, K")
    right.plot(K * step, K, "--", color=OTHER)
    left.set(xlabel="saccade size [deg]", ylabel="k0, and w0 [1/s]")
    right.set(xlabel="saccade size [deg]", ylabel="size / (D - F), and K [deg/deg]")
    for axes in (left, right):
        tidy(axes)
    beside(figure, *left.get_legend_handles_labels())
    low, high = (float(np.interp(a, best["size_deg"], best["k0_best"])) for a in (5, 30))
    fit = [float(np.interp(a, K * step, w0)) for a in (5, 30)]
    return Drawn(
        figure,
        f"From 5 to 30 deg the best k0 goes from {low:.1f} to {high:.1f} 1/s, w0 from {fit[0]:.1f} to {fit[1]:.1f}.",
    )


def _transfer(evidence: Evidence) -> Drawn:
    """Gap and end-point error on the MuJoCo eye of policies learned elsewhere."""
    runs = evidence.studies["transfer"]
    stages = {
        "zero-shot": "learned on lpf",
        "short": "and a short\ntraining on the eye",
        "direct": "learned on the eye",
    }
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    says = []
    for axes, key, label, scale in zip(
        figure.subplots(1, 2), ("gap_mean", "error_mean_deg"),
        ("mean reward gap [%]", "end point off in the mean [deg]"), (100, 1), strict=True,
    ):  # fmt: skip
        values = np.array([[scale * run[stage][key] for stage in stages] for run in runs])
        for i, (run, row) in enumerate(zip(runs, values, strict=True)):
            axes.plot(np.arange(len(stages)) + 0.06 * (i - 1), row, "o-", lw=0.8, label=f"seed {run['seed']}")
        axes.set(ylabel=label, xticks=range(len(stages)), xticklabels=list(stages.values()))
        if key == "gap_mean":
            axes.set_yscale("log")
        else:
            axes.set_ylim(bottom=0)
        axes.legend(frameon=False, fontsize="small")
        tidy(axes)
        says.append(" to ".join(f"{value:.2g}" for value in values.mean(axis=0)[:2]))
    seconds = np.mean([run["short"]["train_s"] for run in runs])
    return Drawn(
        figure,
        f"A short training ({runs[0]['short']['saccades']} saccades, {seconds:.0f} s) takes the mean gap from "
        f"{says[0]} %, and the end point's error from {says[1]} deg.",
    )


EXHIBITS = {
    "k0-amplitude": Exhibit(
        _CHAPTER,
        "k0 and D learned on the whole eye, beside w0 and K of its step responses",
        "The thesis expected k0 to follow w0 on a non-linear eye, and did not show it: the best k0 falls with "
        "amplitude too, half as steeply, as a saccade around straight ahead goes only half as far from there as a "
        "step of its size. Size / (D - F) stays near the K of small steps; small saccades end short of the target on "
        "purpose, as the last tenths of a degree cost more energy than their accuracy is worth.",
        _amplitude,
    ),
    "transfer": Exhibit(
        _CHAPTER,
        "Policies of the low-pass eye on the MuJoCo eye",
        "What is learned on the surrogate overshoots a little on the whole eye, which the reward punishes hard; a "
        "short training there mends most of that, and a whole one the rest.",
        _transfer,
    ),
    "hiding": Exhibit(
        _CHAPTER,
        "Why the thesis' two cases with varying C failed, and the cure",
        "The raw reward has a cliff on one side of the best k0 and a gentle slope on the other, so a policy that "
        "explores stays far from the cliff. On the logarithm of the reward the cliff weighs less; and a temperature "
        "that falls lets exploration end. Same cases, weights and seeds; of the thesis' preset one seed, with a batch "
        "of 1024 and 20 000 updates.",
        _hiding,
    ),
}
