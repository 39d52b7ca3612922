"""orient-eye evaluate."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.cli.another_plant import AnotherPlant

if TYPE_CHECKING:
    from orient_eye.learning.evaluation import Yardstick
    from orient_eye.learning.policy import Policy


@dataclass(frozen=True)
class Evaluate:
    """Hold a policy against the best actions a search finds, over the whole range of saccades.

    POLICY is a run directory of `orient-eye train`, a policy folder, or the name of a shipped policy
    (`orient-eye models`). Leaves a run directory: result.json, pairs.csv (every saccade beside its optimum),
    pictures named after the thesis' figures of its Chapter 5, and a Rerun recording with the optimum in grey.
    The searched optimum is kept in the user's cache.

    $ orient-eye evaluate runs/my-run

    $ orient-eye evaluate runs/my-run --plant mujoco --force
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")]
    """Run directory, policy folder, or name of a shipped policy."""
    pairs: Annotated[int | None, tyro.conf.arg(help_behavior_hint="(default: 300 in closed form, 60 simulated)")] = None
    """Number of random saccades, always the same ones, as in training runs."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/evaluate-DATE-TIME)")] = None
    """Run directory, new or empty."""
    another_plant: AnotherPlant = field(default_factory=AnotherPlant)
    quiet: bool = False
    """Show no progress bar."""

    def run(self) -> dict[str, Any]:
        """Search the optimum, measure the policy, and write the run directory."""
        from dataclasses import asdict

        from orient_eye.cli.learned import say_result
        from orient_eye.cli.tables import say
        from orient_eye.errors import InputError
        from orient_eye.learning.evaluation import evaluation_saccades
        from orient_eye.learning.policy import Policy
        from orient_eye.progress import progress_bar
        from orient_eye.run_directory import RunDirectory

        policy = Policy.load(self.policy)
        task, differences = self.another_plant.task(policy)
        count = task.plant.pace.evaluation_pairs if self.pairs is None else self.pairs
        if count < 1:
            raise InputError(f"--pairs must be at least 1, got {count}")
        run = RunDirectory.create(self.out, "evaluate", {**asdict(self), "pairs": count})
        with progress_bar("searching the optimum", quiet=self.quiet) as advance:
            pairs, table = evaluation_saccades(task, count, advance)
        result = {
            "out": str(run.path),
            "policy": self.policy,
            "plant": task.plant.name,
            "task": task.identity(),
            "differs_from_training": differences,
            **_measure(policy, pairs, table, run.path / "pairs.csv"),
        }
        _draw(policy, pairs, table, run.path)
        _record(policy, table, run.path / "recording.rrd")
        run.write_json("result.json", result)
        say_result(result)
        for angle in (name.removesuffix("_deg") for name in task.targets.angles):
            mean, most = (result[f"{angle}_error_{of}_deg"] for of in ("mean", "max"))
            say(f"final {angle} off by {mean:.3f} deg in the mean, {most:.3f} deg at most")
        say(f"in {run.path}: result.json, pairs.csv, figure_5_*.png, recording.rrd")
        say(f"look at the saccades: orient-eye view {run.path}/recording.rrd")
        return result


def _measure(policy: "Policy", pairs: "Yardstick", table: "Yardstick", path: Path) -> dict[str, Any]:
    """The numbers of result.json; pairs.csv is written on the way."""
    import numpy as np

    from orient_eye.cli.tables import say_limits, with_peaks
    from orient_eye.files import write_table
    from orient_eye.learning.evaluation import amplitude_table, gap_summary
    from orient_eye.task.table import outcome_columns, rows_of

    task, start, target = pairs.task, pairs.start, pairs.target
    action, outcome, gap = pairs.perform(policy.act)
    best = pairs.optimum.action
    ours = outcome_columns(task, start, target, action, outcome)
    others = outcome_columns(task, start, target, best, task.perform(start, best, target))
    beside = {f"{key}_best": v for key, v in others.items() if not key.startswith(("start_", "target_", "F_"))}
    rows = with_peaks(task, outcome, rows_of({**ours, "gap": gap}))
    write_table(path, [row | more for row, more in zip(rows, rows_of(beside), strict=True)])
    say_limits(task, rows)
    errors: dict[str, float] = {}
    for angle in task.targets.angles:
        off = np.abs(ours[f"final_{angle.replace('_deg', '_error_deg')}"])
        name = f"{angle.removesuffix('_deg')}_error"
        errors |= {f"{name}_mean_deg": float(np.nanmean(off)), f"{name}_max_deg": float(np.nanmax(off))}
    return {
        **gap_summary(pairs, action, outcome, gap),
        **errors,
        "overshoot_max": float(np.nanmax(outcome.measures.overshoot)),
        "failed_saccades": int(outcome.measures.failed.sum()),
        "limited_saccades": int(outcome.limited.sum()),
        "too_fast_saccades": int(outcome.too_fast.sum()),
        "table": amplitude_table(table, policy.act),
    }


def _draw(policy: "Policy", pairs: "Yardstick", table: "Yardstick", folder: Path) -> None:
    from orient_eye.figures import save
    from orient_eye.learning import figures

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


def _record(policy: "Policy", table: "Yardstick", path: Path) -> None:
    """The table's saccades, the searched optimum beside them."""
    from orient_eye.recording import record
    from orient_eye.words import plant_in_words

    task = table.task
    record(
        path,
        task.trajectory(table.start, policy.act(table.start.orientation, table.target), table.target),
        model=task.plant.drawn(),
        target=table.target,
        titles=[f"{size:g} deg" for size in table.size_deg],
        reference=task.trajectory(table.start, table.optimum.action, table.target),
        notes=f"Saccades of a policy on plant `{plant_in_words(task.plant.identity())}`, in grey with the best action "
        "a search found.",
    )
