"""What every training run leaves: its course, and one page about its policy."""

import csv
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from orient_eye.figures import save, tidy
from orient_eye.learning.directions import in_all_directions
from orient_eye.learning.evaluation import Yardstick
from orient_eye.learning.figures.gaze import gaze_page
from orient_eye.learning.figures.main_sequence import draw_main_sequence
from orient_eye.learning.figures.output import draw_output
from orient_eye.learning.figures.saccades import LEARNED, SHOWN_DEG, Saccades, draw_speed, draw_turned
from orient_eye.learning.policy import Policy


def draw_learning(metrics: Path, path: Path) -> Path:
    """Reward and gap against updates (thesis Figure 5.23), from a run's metrics.csv."""
    with metrics.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.semilogy(column["update"], -column["reward_mean"], color=LEARNED)
    left.set(xlabel="updates", ylabel="- mean reward of the training saccades")
    for name, style, words in (("gap_mean", "-", "mean"), ("gap_p95", ":", "95th percentile")):
        right.semilogy(column["update"], 100 * np.maximum(column[name], 1e-6), style, color=LEARNED, label=words)
    right.set(xlabel="updates", ylabel="reward gap to the searched optimum [%]")
    right.legend(frameon=False)
    for axes in (left, right):
        tidy(axes)
    return save(figure, path)


def draw_policy(policy: Policy, yardstick: Yardstick, path: Path) -> Path:
    """One page: policy output beside the searched optimum (5.1), saccades (5.2), main sequence (5.4).

    In all directions: paths and components of the gaze, main sequence, Listing's plane, torsion, reward gap.
    """
    task = yardstick.task
    if in_all_directions(task):
        return save(gaze_page(policy, yardstick), path)
    figure = Figure(figsize=(15, 8), layout="constrained")
    axes = figure.subplots(2, 3)
    draw_output(axes[0], policy, yardstick)
    shown = Saccades.symmetric(task, policy, SHOWN_DEG)
    draw_turned(axes[1, 0], shown)
    draw_speed(axes[1, 1], shown)
    draw_main_sequence(axes[1, 2], policy, task)
    return save(figure, path)
