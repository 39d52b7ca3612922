"""Pictures of a training run, after the thesis' Figures 5.1 to 5.4 and 5.23."""

import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.figures import save
from orient_eye.learning.evaluation import Yardstick
from orient_eye.learning.policy import Policy
from orient_eye.saccade import SaccadeTask, horizontal

Array = NDArray[np.float64]
_LEARNED, _BEST, _THIRD = "#1f4e9c", "#d1495b", "#2a9d6f"
_SIZES = np.array([2, 5, 10, 15, 20, 25, 30, 40, 50, 60], float)


def draw_learning(metrics: Path, path: Path) -> Path:
    """Reward and gap against updates (thesis Figure 5.23), from a run's metrics.csv."""
    with metrics.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.semilogy(column["update"], -column["reward_mean"], color=_LEARNED)
    left.set(xlabel="updates", ylabel="- mean reward of the training saccades")
    right.semilogy(column["update"], 100 * np.maximum(column["gap_mean"], 1e-6), color=_LEARNED, label="mean")
    right.semilogy(
        column["update"], 100 * np.maximum(column["gap_p95"], 1e-6), color=_LEARNED, ls=":", label="95th percentile"
    )
    right.set(xlabel="updates", ylabel="reward gap to the searched optimum [%]")
    right.legend(frameon=False)
    _tidy(left, right)
    return save(figure, path)


def draw_policy(task: SaccadeTask, policy: Policy, yardstick: Yardstick, path: Path) -> Path:
    """Policy output against saccade size beside the searched optimum (5.1); saccades (5.2); main sequence (5.4)."""
    figure = Figure(figsize=(15, 8), layout="constrained")
    axes = figure.subplots(2, 3)
    amplitude = np.abs(yardstick.target_yaw_deg - yardstick.start_yaw_deg)
    learned, outcome, _ = yardstick.perform(policy.act)
    best, F = yardstick.optimum.action, yardstick.start.motor[:, task.driven_index]
    outputs = {
        "B [1/s]": (learned[:, 0, 0], best[:, 0, 0]),
        "|D - F| [deg]": (np.abs(learned[:, 0, 1] - F[:, 0]), np.abs(best[:, 0, 1] - F[:, 0])),
        "k0 [1/s]": (learned[:, 0, 2], best[:, 0, 2]),
    }
    order = amplitude.argsort()
    for panel, (label, (ours, theirs)) in zip(axes[0], outputs.items(), strict=True):
        panel.plot(amplitude[order], theirs[order], ".", color=_BEST, ms=7, label="searched optimum")
        panel.plot(amplitude[order], ours[order], ".", color=_LEARNED, ms=4, label="policy")
        panel.set(xlabel="saccade size [deg]", ylabel=label)
        panel.legend(frameon=False)

    start = task.fixate(horizontal(-_SIZES / 2))
    action = policy.act(start.orientation, horizontal(_SIZES / 2))
    trajectory = task.trajectory(start, action)
    colours = _colours(len(_SIZES))
    for yaw, size, colour in zip(trajectory.yaw_deg, _SIZES, colours, strict=True):
        axes[1, 0].plot(1e3 * trajectory.time, yaw + size / 2, color=colour, label=f"{size:g} deg")
    axes[1, 0].set(xlabel="time [ms]", ylabel="yaw from the start [deg]", xlim=(0, 400))
    for velocity, colour in zip(trajectory.angular_velocity, colours, strict=True):
        axes[1, 1].plot(1e3 * trajectory.time, np.linalg.norm(velocity, axis=-1), color=colour)
    axes[1, 1].set(xlabel="time [ms]", ylabel="angular speed [deg/s]", xlim=(0, 400))
    axes[1, 0].legend(frameon=False, fontsize="small", ncols=2)
    panel, twin = axes[1, 2], axes[1, 2].twinx()
    panel.plot(amplitude, outcome.measures.peak_velocity_deg_s, ".", color=_LEARNED, label="peak velocity")
    twin.plot(amplitude, 1e3 * outcome.measures.settling_time_s, ".", color=_THIRD, label="duration")
    panel.set(xlabel="saccade size [deg]", ylabel="peak velocity [deg/s]", title="main sequence")
    panel.set_ylim(bottom=0)
    twin.set_ylabel("duration [ms]")
    twin.set_ylim(bottom=0)
    panel.yaxis.label.set_color(_LEARNED)
    twin.yaxis.label.set_color(_THIRD)
    _tidy(*axes.ravel())
    return save(figure, path)


def _colours(count: int) -> list[tuple[float, float, float, float]]:
    from matplotlib import colormaps

    return [colormaps["viridis"](x) for x in np.linspace(0.05, 0.9, count)]


def _tidy(*axes: object) -> None:
    for panel in axes:
        panel.spines[["top", "right"]].set_visible(False)  # type: ignore[attr-defined]
        panel.grid(alpha=0.25)  # type: ignore[attr-defined]
