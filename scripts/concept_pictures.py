"""The pictures of docs/concepts.md, drawn from the package itself: ten seconds.

    python scripts/concept_pictures.py               # into docs/pictures

A command with the movement that it makes and its measures; main sequences beside people's; the reward's cliff; the
eye beside its surrogate; torsion and Listing's plane.
"""

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import matplotlib as mpl
import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye import listing, rotations
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.figures import DATA, MODEL, OTHER, tidy
from orient_eye.files import write_atomically
from orient_eye.human import human_values, people, studies
from orient_eye.learning.policy import Policy
from orient_eye.movement.velocity_threshold import THRESHOLD_DEG_S, above, speed_of
from orient_eye.plants import make_plant
from orient_eye.plants.fixation import Fixations
from orient_eye.sysid.identification import identify_plant
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
TARGET_DEG = 20.0
GREY, LIGHT = "0.45", "0.75"


def saccade() -> Figure:
    """A pulse-step command, and what of its movement is measured."""
    policy = Policy.load("lpf-1")
    task = policy.task()
    start, target = saccades(task.targets, [[0.0]] * 3, [[TARGET_DEG]] * 3)
    action = policy.act(start.orientation, target)
    action[1:, 2] = 15.0, 21.0  # the same with too small and with too large a k0
    outcome = task.perform(start, action, target)
    measures, trajectory = outcome.measures, outcome.movement.trajectory()
    ms, yaw = 1e3 * trajectory.time, trajectory.yaw_deg
    figure = Figure(figsize=(9, 6.2), layout="constrained")
    (told, eye), (speed, close) = figure.subplots(2, 2)

    assert isinstance(outcome.command, PulseStep)
    _draw_command(told, trajectory.time, outcome.command)
    settling, final = 1e3 * measures.settling_time_s[0], trajectory.yaw_deg[0, -1]
    eye.plot(ms, yaw[0], color=DATA, lw=2.2)
    eye.axhline(final, color=LIGHT, lw=1, zorder=0)
    eye.annotate("", (250, 0), (250, final), arrowprops={"arrowstyle": "<->", "color": GREY})
    eye.text(257, final / 2, f"amplitude\n{measures.amplitude_deg[0]:.1f} deg", color=GREY, va="center")
    eye.axvline(settling, color=GREY, lw=1, ls=":")
    eye.text(settling - 5, 1, f"settles in {settling:.0f} ms", color=GREY, rotation=90, ha="right")
    eye.set(title="What the eye does", ylabel="yaw [deg]")

    fast, bout = speed_of(trajectory)[0], above(trajectory)
    onset, offset = 1e3 * bout.onset_s[0], 1e3 * bout.offset_s[0]
    speed.plot(ms, fast, color=DATA, lw=2.2)
    speed.axhline(THRESHOLD_DEG_S, color=LIGHT, lw=1, zorder=0)
    speed.annotate("", (onset, THRESHOLD_DEG_S), (offset, THRESHOLD_DEG_S),
                   arrowprops={"arrowstyle": "<->", "color": MODEL, "shrinkA": 0, "shrinkB": 0})  # fmt: skip
    speed.text(offset + 6, THRESHOLD_DEG_S + 6, f"{offset - onset:.0f} ms above {THRESHOLD_DEG_S:.0f} deg/s:\n"
               "the duration as of people", color=MODEL)  # fmt: skip
    top = ms[fast.argmax()]
    speed.text(top + 14, 0.97 * fast.max(), f"peak velocity {measures.peak_velocity_deg_s[0]:.0f} deg/s", color=DATA)
    speed.set(title="How fast", ylabel="speed [deg/s]")

    band = task.band * measures.amplitude_deg[0]
    close.axhspan(final - band, final + band, color=LIGHT, alpha=0.35, lw=0)
    for row, colour in ((1, MODEL), (2, OTHER), (0, DATA)):
        close.plot(ms, yaw[row], color=colour, lw=2.2 if row == 0 else 1.4)
    close.axvline(settling, color=GREY, lw=1, ls=":")
    close.text(4, final, f"band: {100 * task.band:.0f} % of\nthe amplitude", color=GREY, va="center")
    peak = yaw[1].argmax()
    close.text(ms[peak] + 16, yaw[1, peak] + 0.02, f"k0 = {action[1, 2]:.0f}: overshoot "
               f"{100 * measures.overshoot[1]:.1f} %,\nsettles in {1e3 * measures.settling_time_s[1]:.0f} ms",
               color=MODEL)  # fmt: skip
    close.text(212, final - 3.6 * band, f"k0 = {action[2, 2]:.0f}: creeps,\n"
               f"settles in {1e3 * measures.settling_time_s[2]:.0f} ms", color=OTHER)  # fmt: skip
    close.set(title="Its end, enlarged", ylabel="yaw [deg]", ylim=(final - 5 * band, yaw[1].max() + 2.5 * band))
    for axes in (told, eye, speed, close):
        axes.set(xlim=(0, 360), xlabel="time [ms]")
        axes.grid(visible=False)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_command(axes: Axes, time: Array, command: PulseStep) -> None:
    """The first command of a batch, its pulse, and what the integrator adds."""
    ms, pulse, position = 1e3 * time, command.pulse_at(time)[0, :, 0], command.position(time)[0, :, 0]
    B, D, k0 = command.B[0, 0], command.D[0, 0], command.k0[0, 0]
    axes.plot(ms, position, color=DATA, lw=2.2)
    axes.plot(ms, pulse, color=MODEL, lw=1.4)
    axes.plot(ms, position - pulse, color=OTHER, lw=1.4)
    axes.axhline(D, color=LIGHT, lw=1, zorder=0)
    axes.text(355, D - 1.1, f"D = {D:.1f} deg: there the motor stays", color=GREY, ha="right", va="top")
    axes.text(105, 2.2, f"pulse, gone at rate B = {B:.0f} 1/s", color=MODEL)
    axes.text(84, 6.4, f"k0 times its integral, k0 = {k0:.1f} 1/s", color=OTHER)
    axes.text(68, 16.3, "command: their sum", color=DATA)
    axes.set(title="What the motor is told", ylabel="motor [deg]")


def main_sequence() -> Figure:
    """Peak velocity and duration over amplitude, of people and of two policies, all by the same threshold."""
    size = np.array([2.0, 4, 6, 8, 10, 13, 16, 20, 25, 30])
    figure = Figure(figsize=(9, 3.8), layout="constrained")
    velocity, duration = figure.subplots(1, 2)
    for name, colour, words in (("lpf-1", DATA, "policy of the thesis' case 1"), ("lpf-human", OTHER, "case human")):
        policy = Policy.load(name)
        task = policy.task()
        start, target = saccades(task.targets, *task.targets.symmetric(size))
        outcome = task.perform(start, policy.act(start.orientation, target), target)
        bout = above(outcome.movement.trajectory())
        style = {"color": colour, "lw": 1.8, "marker": "o", "ms": 3.5}
        velocity.plot(outcome.measures.amplitude_deg, bout.peak_velocity_deg_s, label=words, **style)
        duration.plot(outcome.measures.amplitude_deg, 1e3 * bout.duration_s, **style)
    for study, mark in zip(studies("peak_velocity", "duration"), "osD", strict=False):
        for axes, quantity in ((velocity, "peak_velocity"), (duration, "duration")):
            rows = [row for row in human_values(quantity, study) if row.amplitude_deg <= size[-1]]
            label = f"people, {study}" if axes is velocity and rows else None
            axes.plot([row.amplitude_deg for row in rows], [row.value for row in rows], mark, color=GREY, ms=5,
                      label=label)  # fmt: skip
    line = np.linspace(0, size[-1], 100)
    velocity.plot(line, people().peak_velocity(line), "--", color=GREY, lw=1)
    duration.plot(line, people().duration_ms(line), "--", color=GREY, lw=1)
    velocity.set(ylabel="peak velocity [deg/s]", title="The larger, the faster, up to a limit")
    duration.set(ylabel=f"duration above {THRESHOLD_DEG_S:.0f} deg/s [ms]", title="and the longer, along a line")
    velocity.legend(frameon=False, fontsize="small")
    for axes in (velocity, duration):
        axes.set(xlabel="amplitude [deg]", xlim=(0, size[-1] + 1), ylim=(0, None))
        tidy(axes)
    return figure


def cliff() -> Figure:
    """The cost of a saccade over k0 and over D, by terms of the reward."""
    policy = Policy.load("lpf-1")
    task = policy.task()
    figure = Figure(figsize=(9, 3.9), layout="constrained")
    colours = dict(zip(task.weights, (OTHER, GREY, DATA, MODEL), strict=True))
    panels = figure.subplots(1, 2, sharey=True)
    start, target = _one(task, 1)
    best = policy.act(start.orientation, target)[0]
    spans = {"k0": np.linspace(10, 30, 401), "D": np.linspace(best[1] - 4, best[1] + 4, 401)}
    for axes, (name, span) in zip(panels, spans.items(), strict=True):
        place = task.actions.names.index(name)
        start, target = _one(task, len(span))
        action = np.tile(best, (len(span), 1))
        action[:, place] = span
        reward = task.perform(start, action, target).reward
        for term, colour in colours.items():
            axes.plot(span, -task.weights[term] * reward.terms[term], color=colour, lw=1.4, label=term)
        axes.plot(span, -reward.total, color="black", lw=2.2, label="all: minus the reward")
        axes.axvline(best[place], color=LIGHT, lw=1, zorder=0)
        axes.set(yscale="log", ylim=(3e2, 3e7), xlim=(span[0], span[-1]))
        axes.spines[["top", "right"]].set_visible(False)
    for axes, x, words in ((panels[0], 12.5, "overshoots"), (panels[0], 24, "creeps"), (panels[1], 10.4, "too short"),
                           (panels[1], 16.4, "too far")):  # fmt: skip
        axes.text(x, 3e5, words, color=GREY, ha="center")
    panels[0].set(xlabel="k0 [1/s]", ylabel="cost", title="A cliff on one side, a slope on the other")
    panels[1].set(xlabel="D [deg of the motor]", title="Where the eye ends: a valley")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    return figure


def _one(task: SaccadeTask, times: int) -> tuple[Any, Array]:
    """The same saccade, many times."""
    return saccades(task.targets, [[0.0]] * times, [[TARGET_DEG]] * times)


def surrogate() -> Figure:
    """The MuJoCo eye beside the linear one that its steps tell."""
    found = identify_plant(make_plant("mujoco"), (5.0, 10.0, 20.0))
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    axes = figure.subplots()
    for step in found.steps:
        axes.plot(1e3 * step.time, step.eye_deg, color=DATA, lw=2.2)
        axes.plot(1e3 * step.time, found.answer(step), color=MODEL, lw=1.4, ls="--")
        axes.annotate(f"motor steps {step.amplitude_deg:.0f} deg", (400, step.eye_deg[-1]), (0, -14),
                      textcoords="offset points", color=GREY, ha="right")  # fmt: skip
    axes.plot([], [], color=DATA, lw=2.2, label="the eye in MuJoCo")
    axes.plot([], [], color=MODEL, lw=1.4, ls="--",
              label=f"surrogate: K = {found.surrogate.K:.3f}, w0 = {found.surrogate.w0:.1f} rad/s")  # fmt: skip
    axes.set(xlabel="time [ms]", ylabel="eye [deg]", xlim=(-10, 400))
    axes.legend(frameon=False, loc="center right", bbox_to_anchor=(1, 0.62))
    tidy(axes)
    return figure


def torsion() -> Figure:
    """Nine directions of gaze with two torsions, as one sees them from behind the eye; and their planes."""
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    seen, plane = figure.subplots(1, 2, width_ratios=(1, 1.05))
    rules: dict[str, tuple[str, Callable[[Array], Array]]] = {
        "Fick: a gimbal, yaw then pitch": (MODEL, lambda d: listing.with_torsion(d, listing.ficks_torsion(d))),
        "least force of the elastics": (OTHER, Fixations.of(make_plant("tavares")).orientation),
        "Listing: no torsion": (DATA, lambda d: listing.with_torsion(d, np.zeros(len(d)))),
    }
    sides = np.array([-30.0, 0, 30])
    nine = listing.directions(*(grid.ravel() for grid in np.meshgrid(sides, sides)))
    for colour, rule in rules.values():
        if colour != OTHER:  # hardly to be told from Listing's
            for orientation in rule(nine):
                _draw_cross(seen, orientation, colour)
    seen.set(aspect="equal", xlim=(-1.0, 1.0), ylim=(-1.0, 1.0), title="Looking in nine directions")
    seen.axis("off")
    angle = np.linspace(-30, 30, 13)
    wide = listing.directions(*(grid.ravel() for grid in np.meshgrid(angle, angle)))
    wide = wide[rotations.angle_between_directions(wide, np.array([1.0, 0, 0])) <= 30]
    for words, (colour, rule) in rules.items():
        r = listing.rotation_vectors(rule(wide))
        plane.plot(np.rad2deg(2 * np.arctan(r[:, 0])), -np.rad2deg(2 * np.arctan(r[:, 1])), "o", color=colour, ms=3.5,
                   label=words)  # fmt: skip
    plane.set(xlabel="torsion [deg]", ylabel="up [deg]", title="Rotation vectors, seen from the side", xlim=(-5, 5))
    tidy(plane)
    figure.legend(*plane.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def _draw_cross(axes: Axes, orientation: Array, colour: str) -> None:
    """What is a cross on the pupil straight ahead, where the eye looks: left on the left, up above."""
    matrix = rotations.rotation(orientation).as_matrix()
    gaze, left, up = matrix.T
    for arm in (left, up):
        ends = np.stack([gaze - 0.17 * arm, gaze + 0.17 * arm])
        axes.plot(-1.45 * ends[:, 1], 1.45 * ends[:, 2], color=colour, lw=2, solid_capstyle="round")


DRAWN: dict[str, Callable[[], Figure]] = {
    "saccade": saccade, "main-sequence": main_sequence, "cliff": cliff, "surrogate": surrogate, "torsion": torsion,
}  # fmt: skip
"""Name to picture."""


def main(out: Annotated[Path, tyro.conf.Positional] = PICTURES) -> None:
    """Draw all pictures.

    Args:
        out: folder for concept-NAME.svg.
    """
    style: dict[Any, Any] = {"svg.fonttype": "none", "svg.hashsalt": "orient-eye", "axes.titlesize": 11}
    with mpl.rc_context(style):
        for name, draw in DRAWN.items():
            path = out / f"concept-{name}.svg"
            write_atomically(path, partial(draw().savefig, metadata={"Date": None}))
            print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    try:
        tyro.cli(main)
    except InputError as error:
        sys.exit(f"error: {error}")
