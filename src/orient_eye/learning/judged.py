"""A policy held against the searched optimum, with its files: numbers, a table, pictures, a recording.

pairs, table = evaluation_saccades(task, 300)
numbers, rows = measure_policy(policy, pairs, table)
draw_policy_figures(policy, pairs, table, folder)
record_policy(policy, table, folder / "recording.rrd")
"""

from pathlib import Path
from typing import Any

import numpy as np

from orient_eye.figures import save
from orient_eye.learning import figures
from orient_eye.learning.evaluation import Yardstick, amplitude_table, gap_summary
from orient_eye.learning.policy import Policy
from orient_eye.recording import record
from orient_eye.task.table import outcome_columns, rows_of, with_peaks
from orient_eye.words import plant_in_words


def measure_policy(policy: Policy, pairs: Yardstick, table: Yardstick) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Numbers of all saccades together, and one row a saccade beside its optimum (..._best); plain values.

    Args:
        policy: that acts.
        pairs: random saccades with their optimum.
        table: symmetric ones.
    """
    task, start, target = pairs.task, pairs.start, pairs.target
    action, outcome, gap = pairs.perform(policy.act)
    best = pairs.optimum.action
    ours = outcome_columns(task, start, target, action, outcome)
    others = outcome_columns(task, start, target, best, task.perform(start, best, target))
    beside = {f"{key}_best": v for key, v in others.items() if not key.startswith(("start_", "target_", "F_"))}
    rows = with_peaks(task, outcome, rows_of({**ours, "gap": gap}))
    errors: dict[str, float] = {}
    for angle in task.targets.angles:
        off = np.abs(ours[f"final_{angle.replace('_deg', '_error_deg')}"])
        name = f"{angle.removesuffix('_deg')}_error"
        errors |= {f"{name}_mean_deg": float(np.nanmean(off)), f"{name}_max_deg": float(np.nanmax(off))}
    numbers = {
        **gap_summary(pairs, action, outcome, gap),
        **errors,
        "overshoot_max": float(np.nanmax(outcome.measures.overshoot)),
        "failed_saccades": int(outcome.measures.failed.sum()),
        "limited_saccades": int(outcome.limited.sum()),
        "too_fast_saccades": int(outcome.too_fast.sum()),
        "table": amplitude_table(table, policy.act),
    }
    return numbers, [row | more for row, more in zip(rows, rows_of(beside), strict=True)]


def draw_policy_figures(policy: Policy, pairs: Yardstick, table: Yardstick, folder: Path) -> None:
    """The pictures figure_5_*.png."""
    task = pairs.task
    pictures = {
        "figure_5_1": figures.figure_5_1(policy, pairs, table),
        "figure_5_2": figures.figure_5_2(policy, task),
        "figure_5_3": figures.figure_5_3(policy, task),
        "figure_5_4": figures.figure_5_4(policy, task),
        "figure_5_24": figures.figure_5_24(policy, table),
        "figure_5_25": figures.figure_5_25(policy, pairs),
    }
    for name, figure in pictures.items():
        save(figure, folder / f"{name}.png")


def record_policy(policy: Policy, table: Yardstick, path: Path) -> Path:
    """The table's saccades, the searched optimum beside them; returns the file."""
    task = table.task
    return record(
        path,
        task.trajectory(table.start, policy.act(table.start.orientation, table.target), table.target),
        model=task.plant.drawn(),
        target=table.target,
        titles=[f"{size:g} deg" for size in table.size_deg],
        reference=task.trajectory(table.start, table.optimum.action, table.target),
        notes=f"Saccades of a policy on plant `{plant_in_words(task.plant.identity())}`, in grey with the best action "
        "a search found.",
    )
