"""A policy held against the searched optimum, with its files: numbers, a table, pictures, a recording.

pairs, table = evaluation_saccades(task, 300)
numbers, rows = measure_policy(policy, pairs, table)
draw_policy_figures(policy, pairs, table, folder)
record_policy(policy, table, folder / "recording.rrd")
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.figures import save
from orient_eye.learning import figures
from orient_eye.learning.directions import in_all_directions
from orient_eye.learning.evaluation import Yardstick, amplitude_table, gap_summary
from orient_eye.learning.figures.saccades import Saccades
from orient_eye.learning.gaze_numbers import gaze_numbers, stretching
from orient_eye.learning.policy import Policy
from orient_eye.movement.antagonists import antagonist_correlation
from orient_eye.plants.cables import muscles_of
from orient_eye.recording import record
from orient_eye.task.table import outcome_columns, rows_of, with_peaks
from orient_eye.words import plant_in_words

Array = NDArray[np.float64]


def measure_policy(policy: Policy, pairs: Yardstick, table: Yardstick) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Numbers of all saccades together, and one row a saccade beside its optimum (..._best); plain values.

    In all directions also numbers of the gaze and of torsion (`orient_eye.learning.gaze_numbers`), those of the optimum
    as ..._best.

    Args:
        policy: that acts.
        pairs: random saccades with their optimum.
        table: symmetric ones.
    """
    task, start, target = pairs.task, pairs.start, pairs.target
    action, outcome, gap = pairs.perform(policy.act)
    best = pairs.optimum.action
    ours = outcome_columns(task, start, target, action, outcome)
    others = outcome_columns(task.plain, start, target, best, task.plain.perform(start, best, target))
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
        **(_of_gaze(policy, pairs, pairs.plain(action)) if in_all_directions(task) else {}),
        "overshoot_max": float(np.nanmax(outcome.measures.overshoot)),
        "failed_saccades": int(outcome.measures.failed.sum()),
        "limited_saccades": int(outcome.limited.sum()),
        "too_fast_saccades": int(outcome.too_fast.sum()),
        "table": amplitude_table(table, policy.act),
    }
    return numbers, [row | more for row, more in zip(rows, rows_of(beside), strict=True)]


def _of_gaze(policy: Policy, pairs: Yardstick, action: Array) -> dict[str, float | None]:
    """Numbers of the gaze and of torsion under the policy's plain actions (saccades, numbers), and under the best."""
    made, best = (Saccades(pairs.task.plain, pairs.start, pairs.target, a) for a in (action, pairs.optimum.action))
    ours = {**gaze_numbers(made), **stretching(pairs.task, policy, made), **_of_antagonists(made)}
    return ours | {f"{name}_best": value for name, value in gaze_numbers(best).items()}


def _of_antagonists(made: Saccades) -> dict[str, float]:
    """How the motors of antagonists correlate, by their names; none where an eye has no such muscles."""
    muscles = muscles_of(made.task.plant)
    if muscles is None:
        return {}
    found = antagonist_correlation(made.trajectory, made.of_gaze, muscles.pairs)
    named = ("_".join(muscles.names[i] for i in pair) for pair in muscles.pairs.tolist())
    return {f"antagonist_correlation_{name}": value for name, value in zip(named, found, strict=True)}


def draw_policy_figures(policy: Policy, pairs: Yardstick, table: Yardstick, folder: Path) -> list[str]:
    """The pictures that suit the task, named after what they show; returns their names."""
    task = pairs.task
    pictures = (
        figures.gaze_pictures(policy, pairs)
        if in_all_directions(task)
        else {
            "policy_output": figures.figure_5_1(policy, pairs, table),
            "saccades": figures.figure_5_2(policy, task),
            "pure_step": figures.figure_5_3(policy, task),
            "main_sequence": figures.figure_5_4(policy, task),
            "energy": figures.figure_5_25(policy, pairs),
        }
    )
    pictures["reward_against_k0"] = figures.figure_5_24(policy, table)
    return [save(figure, folder / f"{name}.png").name for name, figure in pictures.items()]


def record_policy(policy: Policy, table: Yardstick, path: Path) -> Path:
    """The table's saccades, the searched optimum beside them; returns the file."""
    task = table.task
    return record(
        path,
        task.trajectory(table.start, policy.act(table.start.orientation, table.target), table.target),
        model=task.plant.drawn(),
        target=table.target,
        titles=table.titles,
        reference=task.plain.trajectory(table.start, table.optimum.action, table.target),
        notes=f"Saccades of a policy on plant `{plant_in_words(task.plant.identity())}`, in grey with the best action "
        "a search found.",
    )
