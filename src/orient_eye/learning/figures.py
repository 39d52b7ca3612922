"""Pictures of a policy and of its training, named after the thesis' figures (its Chapter 5, variant 1).

    save(figure_5_1(policy, yardstick), "figure_5_1.png")

The functions return matplotlib Figures made without pyplot. Where they say "mean over starting points",
saccades of every size start at points spread evenly over the range, to the left and to the right; the
shade is the range of what came out.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.commands.pulse_step import PulseStep
from orient_eye.figures import save
from orient_eye.learning.evaluation import Yardstick
from orient_eye.learning.policy import Policy
from orient_eye.movement.trajectory import EyeState, Trajectory
from orient_eye.plants import plant_in_words
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.resources import data_folder
from orient_eye.task.saccade import K0_RANGE, YAW_RANGE_DEG, Fixation, SaccadeTask, horizontal

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_LEARNED, _BEST, _THIRD, _HUMAN = "#1f4e9c", "#d1495b", "#2a9d6f", "#8a8a8a"
_SHOWN_DEG = np.array([2, 5, 10, 15, 20, 25, 30, 40, 50, 60], float)
_COMPARED_DEG = np.array([10, 20, 40], float)
_SIZES_DEG = np.arange(1.0, 69.0)
_STARTS = 8  # starting points in each direction
_STYLES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))  # of the driven motors


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
    """One page: policy output beside the searched optimum (5.1), saccades (5.2), main sequence (5.4)."""
    figure = Figure(figsize=(15, 8), layout="constrained")
    axes = figure.subplots(2, 3)
    _draw_output(axes[0], policy, yardstick, ("B", "D - F", "k0"))
    shown = _Saccades.symmetric(task, policy, _SHOWN_DEG)
    _draw_yaw(axes[1, 0], shown)
    _draw_speed(axes[1, 1], shown, legend=True)
    _draw_main_sequence(axes[1, 2], task, policy)
    return save(figure, path)


def figure_5_1(policy: Policy, yardstick: Yardstick, table: Yardstick | None = None) -> Figure:
    """B, D - F, k0, and C when it varies, against saccade size: mean over starting points, beside the optimum.

    Thesis Figures 5.1, 5.5, 5.9, 5.10, 5.14, 5.18, 5.19. One row a driven motor.

    Args:
        policy: whose output it is.
        yardstick: saccades over the whole range.
        table: symmetric saccades, drawn apart on a plant that is not linear, where the starting point matters.
    """
    symbols = ("B", "D - F", "k0", "C") if yardstick.task.onset == "varying" else ("B", "D - F", "k0")
    motors = yardstick.task.driven
    figure = Figure(figsize=(4.6 * len(symbols), 4.3 * len(motors)), layout="constrained")
    grid = figure.subplots(len(motors), len(symbols), squeeze=False)
    for index, (row, name) in enumerate(zip(grid, motors, strict=True)):
        _draw_output(row, policy, yardstick, symbols, index)
        if table is not None and not isinstance(table.task.plant, LowPassPlant):
            _draw_symmetric(row, policy, table, symbols, index)
        row[0].legend(frameon=False, fontsize="small")
        if len(motors) > 1:
            row[0].set_title(name, loc="left")
    return _titled(figure, "Policy output against saccade size", policy, yardstick.task)


def figure_5_2(policy: Policy, task: SaccadeTask) -> Figure:
    """Pulse, pulse-step and trajectory of saccades of several sizes (thesis Figures 5.2, 5.6, 5.11, ...)."""
    shown = _Saccades.symmetric(task, policy, _SHOWN_DEG)
    time = shown.trajectory.time
    figure = Figure(figsize=(15, 4.6), layout="constrained")
    pulse, motor, yaw = figure.subplots(1, 3)
    curves = (shown.command.pulse(time), shown.command.position(time) - shown.command.F[:, None])
    for axes, values in zip((pulse, motor), curves, strict=True):
        for colour, saccade in zip(_colours(len(values)), values, strict=True):
            for style, name, line in zip(_STYLES, task.driven, saccade.T, strict=False):
                label = name if len(task.driven) > 1 and saccade is values[0] else None
                axes.plot(1e3 * time, line, color=colour, ls=style, label=label)
    pulse.set(xlabel="time [ms]", ylabel="pulse p [deg]", title="pulse", xlim=(0, 200))
    motor.set(xlabel="time [ms]", ylabel="motor from its start [deg]", title="pulse-step", xlim=(0, 300))
    if len(task.driven) > 1:
        pulse.legend(frameon=False)
    _draw_yaw(yaw, shown)
    yaw.set_title("trajectory")
    yaw.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5), reverse=True)
    _tidy(pulse, motor)
    return _titled(figure, "Saccades of the policy", policy, task)


def figure_5_3(policy: Policy, task: SaccadeTask) -> Figure:
    """The eye under the policy's pulse-step and under a pure step to the target (thesis Figures 5.3, 5.7, ...)."""
    shown = _Saccades.symmetric(task, policy, _COMPARED_DEG)
    stepped = _pure_step(task, shown.start, shown.target, len(shown.trajectory.time))
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    time = 1e3 * shown.trajectory.time
    for i, (colour, size) in enumerate(zip(_colours(len(_COMPARED_DEG)), _COMPARED_DEG, strict=True)):
        for trajectory, style, words in ((shown.trajectory, "-", "pulse-step"), (stepped, "--", "pure step")):
            left.plot(time, trajectory.yaw_deg[i] + size / 2, style, color=colour, label=f"{size:g} deg, {words}")
            right.plot(time, np.linalg.norm(trajectory.angular_velocity[i], axis=-1), style, color=colour)
    left.set(xlabel="time [ms]", ylabel="yaw from the start [deg]", xlim=(0, 300))
    right.set(xlabel="time [ms]", ylabel="angular speed [deg/s]", xlim=(0, 300))
    left.set_ylim(0, 1.02 * _COMPARED_DEG[-1] * 1.3)
    left.legend(frameon=False, fontsize="small", ncols=3, loc="upper center")
    _tidy(left, right)
    return _titled(figure, "Pulse-step against pure step", policy, task)


def figure_5_4(policy: Policy, task: SaccadeTask) -> Figure:
    """Main sequence and velocity profiles, beside human saccades (thesis Figures 5.4, 5.8, 5.13, ...).

    A human saccade ends where its speed falls below a threshold, ours where the eye stays within the
    settling band, which is later.
    """
    figure = Figure(figsize=(13, 8.4), layout="constrained")
    (peak, profiles), (duration, skewness) = figure.subplots(2, 2)
    every = _Saccades.every_size(task, policy)
    measures = task.perform(every.start, every.action, every.target).measures
    size = np.abs(every.size_deg)
    _mean_and_range(peak, size, measures.peak_velocity_deg_s, _LEARNED, "policy")
    _mean_and_range(duration, size, 1e3 * measures.settling_time_s, _LEARNED, "policy")
    order = measures.settling_time_s.argsort()
    skewness.plot(
        1e3 * measures.settling_time_s[order], measures.skewness[order], ".", ms=3, color=_LEARNED, label="policy"
    )
    _draw_human(peak, duration, skewness)
    _draw_speed(profiles, _Saccades.symmetric(task, policy, _SHOWN_DEG), legend=True)
    profiles.set_title("velocity profiles")
    peak.set(xlabel="saccade size [deg]", ylabel="peak velocity [deg/s]", title="main sequence", xlim=(0, 70))
    duration.set(xlabel="saccade size [deg]", ylabel="duration [ms]", xlim=(0, 70))
    skewness.set(xlabel="duration [ms]", ylabel="skewness: deceleration time / duration", ylim=(0.4, 1))
    peak.set_ylim(bottom=0)
    duration.set_ylim(bottom=0)
    for axes in (peak, duration):
        axes.legend(frameon=False, fontsize="small")
    skewness.legend(
        frameon=False, fontsize="small", title="human durations: 21 ms + 2.2 ms/deg", title_fontsize="small"
    )
    _tidy(peak, duration, skewness)
    return _titled(figure, "Main sequence and skewness", policy, task)


def figure_5_24(policy: Policy, table: Yardstick, amplitude_deg: float = 30.0) -> Figure:
    """The reward of one saccade against k0, B and D held at the searched optimum's (thesis Figure 5.24).

    Args:
        policy: its own action is marked.
        table: symmetric saccades of several amplitudes.
        amplitude_deg: which of them; the nearest is taken.
    """
    task = table.task
    which = int(np.abs(table.target_yaw_deg - table.start_yaw_deg - amplitude_deg).argmin())
    one = table[which : which + 1]
    best = one.optimum.action
    k0 = np.linspace(*K0_RANGE, 351)
    rows = np.zeros(len(k0), int)
    action = best[rows].copy()
    action[..., 2] = k0[:, None]
    found = task.perform(one.start[rows], action, one.target[rows]).reward
    learned, outcome, _ = one.perform(policy.act)
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots()
    floor = 0.02 * float(-one.optimum.reward[0])
    terms = {"accuracy": _THIRD, "energy": "#e09f3e", "duration": "#7d5ba6", "overshoot": "#6c757d"}
    for name, colour in terms.items():
        cost = -getattr(task.weights, name) * getattr(found, name)
        if cost.max() > floor:
            axes.plot(k0, np.where(cost > 0, cost, np.nan), "--", lw=1.1, color=colour, label=name)
    axes.plot(k0, -found.total, color="black", lw=1.8, label="total")
    axes.plot(best[0, 0, 2], -one.optimum.reward[0], "D", color=_BEST, ms=7, label="searched optimum")
    axes.plot(learned[0, 0, 2], -outcome.reward.total[0], "o", color=_LEARNED, ms=7, label="policy (its own B and D)")
    axes.set(yscale="log", xlabel="k0 [1/s]", ylabel="cost: - weighted reward", ylim=(floor, None))
    size = one.target_yaw_deg[0] - one.start_yaw_deg[0]
    where = f"B = {best[0, 0, 0]:.1f} 1/s, D = {best[0, 0, 1]:.2f} deg"
    axes.set_title(f"{size:g} deg from {one.start_yaw_deg[0]:g} deg; {where}", fontsize="medium")
    axes.legend(frameon=False, fontsize="small", ncols=2)
    _tidy(axes)
    return _titled(figure, "Reward against k0", policy, task)


def figure_5_25(policy: Policy, yardstick: Yardstick) -> Figure:
    """Energy of the command against saccade size, beside the optimum's (thesis Figure 5.25)."""
    task = yardstick.task
    figure = Figure(figsize=(7.5, 5), layout="constrained")
    axes = figure.subplots()
    size = np.abs(yardstick.target_yaw_deg - yardstick.start_yaw_deg)
    best = task.pulse_step(yardstick.start, yardstick.optimum.action).energy()
    axes.plot(size, best, ".", color=_BEST, ms=6, label="searched optimum")
    every = _Saccades.every_size(task, policy)
    _mean_and_range(axes, np.abs(every.size_deg), every.command.energy(), _LEARNED, "policy")
    axes.set(xlabel="saccade size [deg]", ylabel="energy [deg$^2$/s]", xlim=(0, 70))
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)
    _tidy(axes)
    return _titled(figure, "Energy against saccade size", policy, task)


@dataclass(frozen=True)
class _Saccades:
    """Saccades of a policy: size [deg], start, target, action, command; the trajectory where it is asked for."""

    task: SaccadeTask
    size_deg: Array
    start: Fixation
    target: Array
    action: Array
    command: PulseStep

    @classmethod
    def between(cls, task: SaccadeTask, policy: Policy, start_yaw_deg: Array, target_yaw_deg: Array) -> "_Saccades":
        start, target = task.fixate(horizontal(start_yaw_deg)), horizontal(target_yaw_deg)
        action = policy.act(start.orientation, target)
        return cls(task, target_yaw_deg - start_yaw_deg, start, target, action, task.pulse_step(start, action))

    @classmethod
    def symmetric(cls, task: SaccadeTask, policy: Policy, size_deg: Array) -> "_Saccades":
        """To the left, around straight ahead."""
        return cls.between(task, policy, -size_deg / 2, size_deg / 2)

    @classmethod
    def every_size(cls, task: SaccadeTask, policy: Policy) -> "_Saccades":
        """Of every size, from starting points over the range, in both directions."""
        low, high = YAW_RANGE_DEG
        share, size = np.meshgrid(np.linspace(0, 1, _STARTS), _SIZES_DEG)
        start = (low + share * (high - low - size)).ravel()
        target = start + size.ravel()
        return cls.between(task, policy, np.concatenate([start, target]), np.concatenate([target, start]))

    @property
    def trajectory(self) -> Trajectory:
        return self.task.trajectory(self.start, self.action)


def _pure_step(task: SaccadeTask, start: Fixation, target: Array, samples: int) -> Trajectory:
    """The motors jump to where the eye rests on the target."""
    motor = np.repeat(start.motor[:, None], samples, axis=1)
    motor[:, 1:, task.driven_index] = task.lands_on(target)[:, None]
    return task.plant.simulate(motor, EyeState(start.orientation))


def _draw_output(
    panels: "Sequence[Axes] | NDArray[Any]",
    policy: Policy,
    yardstick: Yardstick,
    symbols: Sequence[str],
    motor: int = 0,
) -> None:
    """What the policy puts out for one motor, a panel a symbol."""
    task = yardstick.task
    every = _Saccades.every_size(task, policy)
    size = np.abs(yardstick.target_yaw_deg - yardstick.start_yaw_deg)
    best = task.pulse_step(yardstick.start, yardstick.optimum.action)
    shown = size >= _SIZES_DEG[0]  # where there is nothing to do, B, k0 and C may be anything
    for axes, symbol in zip(panels, symbols, strict=True):
        theirs, ours = (_output(command, symbol)[:, motor] for command in (best, every.command))
        axes.plot(size[shown], theirs[shown], ".", color=_BEST, ms=6, label="searched optimum")
        _mean_and_range(axes, np.abs(every.size_deg), ours, _LEARNED, "policy, mean over starting points")
        axes.set(xlabel="saccade size [deg]", ylabel=_UNITS[symbol], xlim=(0, 70))
        if symbol == "C" and ours.max() > 30 * ours.min():
            axes.set_yscale("log")
        low, high = axes.get_ylim()
        more = max(_LEAST_SPAN.get(symbol, 0) - (high - low), 0) / 2  # no drama in the second decimal
        axes.set_ylim(low - more, high + more)
        _tidy(axes)
    panels[0].legend(frameon=False, fontsize="small")


def _draw_symmetric(
    panels: "Sequence[Axes] | NDArray[Any]", policy: Policy, table: Yardstick, symbols: Sequence[str], motor: int
) -> None:
    """The same of saccades around straight ahead only."""
    task = table.task
    best = task.pulse_step(table.start, table.optimum.action)
    ours = _Saccades.symmetric(task, policy, _SIZES_DEG).command
    for axes, symbol in zip(panels, symbols, strict=True):
        axes.plot(_SIZES_DEG, _output(ours, symbol)[:, motor], "--", color=_LEARNED, lw=1.2, label="policy, symmetric")
        axes.plot(
            table.target_yaw_deg - table.start_yaw_deg, _output(best, symbol)[:, motor], "D", color=_BEST, ms=6,
            mfc="none", label="searched optimum, symmetric",
        )  # fmt: skip


_LEAST_SPAN = {"B": 10.0, "k0": 4.0}
_UNITS = {"B": "B [1/s]", "D - F": "|D - F| [deg]", "k0": "k0 [1/s]", "C": "C [1/s]"}


def _output(command: PulseStep, symbol: str) -> Array:
    return np.abs(command.step) if symbol == "D - F" else np.asarray(getattr(command, symbol))


def _mean_and_range(axes: "Axes", size: Array, values: Array, colour: str, label: str) -> None:
    """Mean over starting points as a line, their range as a shade."""
    sizes = np.unique(np.round(size, 6))
    groups = [values[np.isclose(size, one)] for one in sizes]
    low, mean, high = np.array([(np.nanmin(g), np.nanmean(g), np.nanmax(g)) for g in groups]).T
    axes.fill_between(sizes, low, high, color=colour, alpha=0.2, lw=0)
    axes.plot(sizes, mean, color=colour, lw=1.8, label=label)


def _draw_yaw(axes: "Axes", shown: _Saccades) -> None:
    trajectory = shown.trajectory
    for yaw, size, colour in zip(trajectory.yaw_deg, shown.size_deg, _colours(len(trajectory)), strict=True):
        axes.plot(1e3 * trajectory.time, yaw + size / 2, color=colour, label=f"{size:g} deg")
    axes.set(xlabel="time [ms]", ylabel="yaw from the start [deg]", xlim=(0, 300))
    _tidy(axes)


def _draw_speed(axes: "Axes", shown: _Saccades, *, legend: bool = False) -> None:
    trajectory = shown.trajectory
    for velocity, size, colour in zip(
        trajectory.angular_velocity, shown.size_deg, _colours(len(trajectory)), strict=True
    ):
        axes.plot(1e3 * trajectory.time, np.linalg.norm(velocity, axis=-1), color=colour, label=f"{size:g} deg")
    axes.set(xlabel="time [ms]", ylabel="angular speed [deg/s]", xlim=(0, 300))
    axes.set_ylim(bottom=0)
    if legend:
        axes.legend(frameon=False, fontsize="small", ncols=2)
    _tidy(axes)


def _draw_main_sequence(axes: "Axes", task: SaccadeTask, policy: Policy) -> None:
    """Peak velocity and duration against size in one panel."""
    every = _Saccades.every_size(task, policy)
    measures = task.perform(every.start, every.action, every.target).measures
    twin = axes.twinx()
    size = np.abs(every.size_deg)
    _mean_and_range(axes, size, measures.peak_velocity_deg_s, _LEARNED, "peak velocity")
    _mean_and_range(twin, size, 1e3 * measures.settling_time_s, _THIRD, "duration")
    axes.set(xlabel="saccade size [deg]", ylabel="peak velocity [deg/s]", title="main sequence", xlim=(0, 70))
    axes.set_ylim(bottom=0)
    twin.set_ylabel("duration [ms]")
    twin.set_ylim(bottom=0)
    axes.yaxis.label.set_color(_LEARNED)
    twin.yaxis.label.set_color(_THIRD)
    _tidy(axes)
    twin.spines["top"].set_visible(False)


def _draw_human(peak: "Axes", duration: "Axes", skewness: "Axes") -> None:
    """Human saccades: peak velocity and duration against size, skewness against duration."""
    with (data_folder("models") / "human" / "main_sequence.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    studies = dict.fromkeys(_study(row) for row in rows)
    markers = dict(zip(studies, "osDv^P", strict=False))
    line = {row["quantity"]: float(row["value"]) for row in rows if row["quantity"].startswith("duration_")}
    for study, marker in markers.items():
        style: dict[str, Any] = {"marker": marker, "ls": "", "color": _HUMAN, "ms": 5, "capsize": 2, "elinewidth": 0.8}
        style["label"] = f"human: {study}"
        for quantity, axes in (("peak_velocity", peak), ("duration", duration), ("acceleration_fraction", skewness)):
            chosen = [row for row in rows if row["quantity"] == quantity and _study(row) == study]
            x, y = (np.array([float(row[name]) for row in chosen]) for name in ("amplitude_deg", "value"))
            spread = np.array([float(row["spread_sd"] or 0) for row in chosen])
            if quantity == "acceleration_fraction":
                x, y = line["duration_intercept"] + line["duration_slope"] * x, 1 - y
            if chosen:
                axes.errorbar(x, y, yerr=spread if spread.any() else None, **style)
    size = np.array([0.0, 70.0])
    words = f"human: {line['duration_intercept']:g} ms + {line['duration_slope']:g} ms/deg (Carpenter 1988)"
    duration.plot(size, line["duration_intercept"] + line["duration_slope"] * size, ":", color=_HUMAN, label=words)


def _study(row: dict[str, str]) -> str:
    """Short name of the study a row of the human data is from."""
    names = {
        "Collewijn": "Collewijn et al. 1988",
        "Andersson": "Andersson et al. 2017",
        "PMC": "100 adults, PMC6143243",
    }
    return next((name for part, name in names.items() if part in row["source"]), row["source"])


def _titled(figure: Figure, title: str, policy: Policy, task: SaccadeTask) -> Figure:
    case = policy.manifest.get("case")
    words = f"case {case}" if case else f"variant {task.variant}"
    figure.suptitle(f"{title}: {words} on {plant_in_words(task.plant.identity())}")
    return figure


def _colours(count: int) -> list[tuple[float, float, float, float]]:
    return [colormaps["viridis"](x) for x in np.linspace(0.05, 0.9, count)]


def _tidy(*axes: "Axes") -> None:
    for panel in axes:
        panel.spines[["top", "right"]].set_visible(False)
        panel.grid(alpha=0.25)
