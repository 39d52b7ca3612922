"""Saccades over time."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import save, tidy
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
_COMMAND = "command of "
_SAME = 1e-6  # of a motor's unit


def draw_trajectory(trajectory: Trajectory, path: str | Path, pairs: NDArray[np.intp] | None = None) -> Path:
    """The first saccade of a batch over time: motors, orientation, angular velocity, tensions where there are any.

    The command of a motor is drawn where the motor was elsewhere, grey and dashed.

    Args:
        trajectory: of the saccades.
        path: of the picture.
        pairs: of antagonists among motors that wind up a cable each, in their order, (pairs, 2): two have one colour,
            the second is dashed. None for other eyes.
    """
    panels: dict[str, dict[str, Array]] = {}
    for i, motor in enumerate(trajectory.motors):
        panel, was, told = f"motor [{motor.unit}]", trajectory.motor[0, :, i], trajectory.command[0, :, i]
        panels.setdefault(panel, {})[motor.name] = was
        if (np.abs(was - told) > _SAME).any():
            panels[panel][f"{_COMMAND}{motor.name}"] = told
    panels["orientation [deg]"] = {
        "yaw": trajectory.yaw_deg[0], "pitch": trajectory.pitch_deg[0], "roll": trajectory.roll_deg[0]
    }  # fmt: skip
    panels["angular velocity [deg/s]"] = dict(zip("xyz", trajectory.angular_velocity[0].T, strict=True))
    if trajectory.tension is not None:
        panels["tension [N]"] = dict(zip(trajectory.tendon_names, trajectory.tension[0].T, strict=True))
    figure = Figure(figsize=(10, 2 * len(panels)), layout="constrained")
    all_axes = figure.subplots(len(panels), 1, sharex=True)
    muscles = {} if pairs is None else _of_muscles(trajectory, pairs)
    order = {name: place for place, name in enumerate(muscles)}
    for axes, (label, curves) in zip(all_axes, panels.items(), strict=True):
        for name in sorted(curves, key=lambda name: order.get(name.removeprefix(_COMMAND), 0)):
            of_command = {"color": "0.5", "ls": ":" if muscles else "--", "lw": 0.9}
            style = of_command if name.startswith(_COMMAND) else {"lw": 1.4} | muscles.get(name, {})
            axes.plot(trajectory.time, curves[name], label=name, **style)
        axes.set_ylabel(label)
        tidy(axes)
        axes.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    all_axes[-1].set_xlabel("time [s]")
    return save(figure, path)


def _of_muscles(trajectory: Trajectory, pairs: NDArray[np.intp]) -> dict[str, dict[str, Any]]:
    """How antagonists are drawn, by name, two after each other; of motors and tensions alike."""
    return {
        trajectory.motor_names[i]: {"color": f"C{k}", "ls": dash}
        for k, pair in enumerate(pairs.tolist())
        for i, dash in zip(pair, ("-", "--"), strict=True)
    }
