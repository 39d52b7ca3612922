"""How the eye moves under a policy: saccades over time."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import tidy
from orient_eye.learning.figures.saccades import (
    SHOWN_DEG,
    Saccades,
    beside,
    colours,
    draw_turned,
    speed,
    titled,
    turned,
    until_ms,
)
from orient_eye.learning.policy import Policy
from orient_eye.movement.trajectory import Trajectory
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
_COMPARED_DEG = np.array([10, 20, 40], float)
_STYLES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))  # of the driven motors


def figure_5_2(policy: Policy, task: SaccadeTask) -> Figure:
    """Pulse if there is one, command and progress of saccades of several sizes (thesis Figures 5.2, 5.6, 5.11, ...)."""
    shown = Saccades.symmetric(task, policy, SHOWN_DEG)
    time, command = shown.trajectory.time, shown.outcome.command
    motors = task.plant.motors
    driven = [i for i, motor in enumerate(motors) if motor.name in {n.motor for n in task.actions.numbers}]
    told = command.sample(task.plant.step_s, len(time)) - shown.start.motor[:, None]
    curves: dict[str, Array] = {"motor command from its start": told}
    if hasattr(command, "pulse_at"):
        curves = {"pulse": command.pulse_at(time), **curves}
    figure = Figure(figsize=(5 * (len(curves) + 1), 4.6), layout="constrained")
    *panels, progress = figure.subplots(1, len(curves) + 1)
    for axes, (title, values) in zip(panels, curves.items(), strict=True):
        for k, (colour, saccade) in enumerate(zip(colours(len(values)), values, strict=True)):
            for style, i in zip(_STYLES, driven, strict=False):
                label = motors[i].name if len(driven) > 1 and k == 0 else None
                axes.plot(1e3 * time, saccade[:, i], color=colour, ls=style, label=label)
        axes.set(
            xlabel="time [ms]",
            ylabel=f"{title} [{motors[driven[0]].unit}]",
            title=title,
            xlim=(0, 200 if title == "pulse" else until_ms(shown)),
        )
        if len(driven) > 1:
            axes.legend(frameon=False)
        tidy(axes)
    draw_turned(progress, shown)
    progress.set_title("trajectory")
    progress.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5), reverse=True)
    return titled(figure, "Saccades of the policy", policy, task)


def figure_5_3(policy: Policy, task: SaccadeTask) -> Figure:
    """The eye under the policy's command and under a pure step to the target (thesis Figures 5.3, 5.7, ...)."""
    shown = Saccades.symmetric(task, policy, _COMPARED_DEG)
    stepped = pure_step(shown)
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for i, (colour, size) in enumerate(zip(colours(len(shown.target)), shown.size_deg, strict=True)):
        for trajectory, style, words in ((shown.trajectory, "-", "policy"), (stepped, "--", "pure step")):
            time = 1e3 * trajectory.time
            left.plot(time, turned(trajectory)[i], style, color=colour, label=f"{size:g} deg, {words}")
            right.plot(time, speed(trajectory)[i], style, color=colour)
    left.set(xlabel="time [ms]", ylabel="angle turned [deg]", xlim=(0, until_ms(shown)))
    right.set(xlabel="time [ms]", ylabel="angular speed [deg/s]", xlim=(0, until_ms(shown)))
    left.set_ylim(bottom=0)
    beside(figure, *left.get_legend_handles_labels())
    tidy(left)
    tidy(right)
    return titled(figure, "Motor command of the policy against a pure step", policy, task)


def pure_step(shown: Saccades) -> Trajectory:
    """The motors jump to where the eye rests on the target."""
    task = shown.task
    motor = np.repeat(task.targets.rest(shown.target).motor[:, None], len(shown.trajectory.time), axis=1)
    motor[:, 0] = shown.start.motor
    return task.plant.move(motor, shown.start).trajectory()
