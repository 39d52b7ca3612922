"""A sequence of saccades on one page."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.figures import tidy
from orient_eye.figures.gaze.paths import draw_paths
from orient_eye.figures.gaze.style import HORIZONTAL, OBLIQUE, VERTICAL, palette
from orient_eye.listing import torsion
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import gaze_components, seen_from
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]


def saccade_sequence(trajectory: Trajectory, measures: Measures, target: Array) -> Figure:
    """Saccades one after the other: paths of the gaze; gaze with its targets, speed, torsion and motors over time.

    Numbers count the saccades, at their targets and over their times.

    Args:
        trajectory: of the saccades, each of which begins where the one before was when its samples ended.
        measures: of their gaze.
        target: where they were to go, orientations (saccades, 4) whose gaze counts.
    """
    figure = Figure(figsize=(16, 8), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1, 1.25), squeeze=False)[0]
    paths = left.subplots()
    draw_paths(paths, trajectory, measures, target)
    for number, (x, y) in enumerate(seen_from(rotations.gaze(target)), start=1):
        paths.annotate(str(number), (x, y), xytext=(7, 5), textcoords="offset points", fontsize=9)
    left.legend(*paths.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    count, samples = trajectory.orientation.shape[:2]
    time = np.arange(count * samples).reshape(count, samples) * float(trajectory.time[1])
    gaze, aim = gaze_components(trajectory), seen_from(rotations.gaze(target))
    over_time = right.subplots(4, 1, sharex=True)
    where, fast, twisted, motors = over_time
    for k, (name, colour) in enumerate((("left", HORIZONTAL), ("up", VERTICAL))):
        where.plot(time.ravel(), gaze[..., k].ravel(), color=colour, lw=1.4, label=name)
        where.plot(time.ravel(), np.repeat(aim[:, k], samples), ":", color=colour, lw=1, label=f"{name}, target")
    look = rotations.gaze(trajectory.orientation)
    speed = np.linalg.norm(np.cross(trajectory.angular_velocity, look), axis=-1)
    fast.plot(time.ravel(), speed.ravel(), color="black", lw=1.1)
    twisted.plot(time.ravel(), torsion(trajectory.orientation).ravel(), color=OBLIQUE, lw=1.3)
    twisted.axhline(0, color="black", lw=0.6)
    told = trajectory.motor_names
    moved = trajectory.motor.reshape(-1, len(told)).T
    for name, colour, curve in zip(told, palette(len(told)), moved, strict=True):
        motors.plot(time.ravel(), curve, color=colour, lw=1.1, label=name)
    for number, middle in enumerate(time.mean(axis=1), start=1):
        where.annotate(
            str(number), (middle, 1), xycoords=("data", "axes fraction"), xytext=(0, 3), textcoords="offset points",
            ha="center", fontsize=9,
        )  # fmt: skip
    where.set_ylabel("gaze [deg]")
    fast.set_ylabel("speed of the gaze\n[deg/s]")
    twisted.set_ylabel("torsion [deg]")
    motors.set(ylabel=f"motors [{trajectory.motors[0].unit}]", xlabel="time [s]", xlim=(0, time[-1, -1]))
    for axes in (where, motors):
        axes.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    for axes in over_time:
        for begin in time[1:, 0]:
            axes.axvline(begin, color="0.85", lw=0.8, zorder=0)
        tidy(axes)
    return figure
