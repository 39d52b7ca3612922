"""Motors and elastics of a few saccades over time."""

from itertools import count
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import tidy
from orient_eye.figures.gaze.style import end_ms, palette, way
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import end_of_shift
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
_SAME = 1e-6  # of a motor's unit
_DASHES = ("-", "--", ":", "-.")


def motors_over_time(trajectory: Trajectory, measures: Measures, pairs: NDArray[np.intp] | None = None) -> Figure:
    """Positions and speeds of the motors, and tensions of the elastics where there are any, over time.

    The command is drawn dotted where a motor was elsewhere. An elastic that is named after a motor has its colour.

    Args:
        trajectory: of the saccades, a column each.
        measures: of their gaze.
        pairs: of antagonists among motors that wind up a cable each, in their order, (pairs, 2): two have one colour,
            the second is dashed. None for other eyes.
    """
    time, unit = 1e3 * trajectory.time, trajectory.motors[0].unit
    speed = np.gradient(trajectory.motor, trajectory.time, axis=1, edge_order=2)
    panels = [(f"motor position [{unit}]", trajectory.motor), (f"motor speed [{unit}/s]", speed)]
    if trajectory.tension is not None:
        panels.append(("tension [N]", trajectory.tension))
    figure = Figure(figsize=(2.2 + 3.2 * len(trajectory), 0.8 + 2.4 * len(panels)), layout="constrained")
    rows = figure.subplots(len(panels), len(trajectory), sharex=True, sharey="row", squeeze=False)
    for line, (label, values), styles in zip(rows, panels, _styles(trajectory, pairs), strict=False):
        for axes, saccade in zip(line, values, strict=True):
            for name, (column, style) in styles.items():
                axes.plot(time, saccade[:, column], lw=1.3, label=name, **style)
            tidy(axes)
        line[0].set_ylabel(label)
        line[-1].legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    elsewhere = (np.abs(trajectory.command - trajectory.motor) > _SAME).any(axis=1)
    for axes, told, apart in zip(rows[0], trajectory.command, np.asarray(elsewhere), strict=True):
        axes.plot(time, told[:, apart], color="0.5", ls=":", lw=1)
    for axes, end in zip(rows[0], end_of_shift(trajectory, measures), strict=True):
        axes.set_title(way(end), fontsize="medium")
    for axes in rows[-1]:
        axes.set_xlabel("time [ms]")
    rows[0, 0].set_xlim(0, end_ms(trajectory, measures))
    return figure


def _styles(trajectory: Trajectory, pairs: NDArray[np.intp] | None) -> list[dict[str, tuple[int, dict[str, Any]]]]:
    """How the curves of each panel are drawn, by name: which column, in which style."""
    motors, tendons = trajectory.motor_names, trajectory.tendon_names
    if pairs is not None:
        muscles = {
            motors[i]: (i, {"color": colour, "ls": dash})
            for pair, colour in zip(pairs.tolist(), palette(len(pairs)), strict=True)
            for i, dash in zip(pair, _DASHES, strict=False)
        }
        return [muscles, muscles, muscles]
    of_motor = dict(zip(motors, palette(len(motors)), strict=True))
    dashes = {motor: count() for motor in motors}
    elastics: dict[str, dict[str, Any]] = {}
    for tendon, colour in zip(tendons, palette(len(tendons)), strict=True):
        motor = next((name for name in motors if tendon.startswith(name)), None)
        if motor is None:
            elastics[tendon] = {"color": colour}
        else:
            elastics[tendon] = {"color": of_motor[motor], "ls": _DASHES[next(dashes[motor]) % len(_DASHES)]}
    driven: dict[str, dict[str, Any]] = {name: {"color": colour} for name, colour in of_motor.items()}
    return [{name: (i, of[name]) for i, name in enumerate(of)} for of in (driven, driven, elastics)]
