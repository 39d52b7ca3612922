"""orient-eye evaluate."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.cli.predict import AnotherPlant

if TYPE_CHECKING:
    from orient_eye.learning.evaluation import Yardstick
    from orient_eye.learning.policy import Policy
    from orient_eye.task.saccade import SaccadeTask


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
    pairs: Annotated[int | None, tyro.conf.arg(help_behavior_hint="(default: 300 on lpf, 60 on other plants)")] = None
    """Random saccades, always the same, as in training runs."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/evaluate-DATE-TIME)")] = None
    """Run directory, new or empty."""
    another_plant: AnotherPlant = field(default_factory=AnotherPlant)
    quiet: bool = False
    """No progress bar."""

    def run(self) -> dict[str, Any]:
        """Search the optimum, measure the policy, and write the run directory."""
        from dataclasses import asdict

        from orient_eye.cli import say
        from orient_eye.cli.train import say_result
        from orient_eye.errors import InputError
        from orient_eye.learning.policy import Policy
        from orient_eye.plants.lpf import LowPassPlant
        from orient_eye.run_directory import RunDirectory

        policy = Policy.load(self.policy)
        task, differences = self.another_plant.task(policy)
        count = (300 if isinstance(task.plant, LowPassPlant) else 60) if self.pairs is None else self.pairs
        if count < 1:
            raise InputError(f"--pairs must be at least 1, got {count}")
        run = RunDirectory.create(self.out, "evaluate", {**asdict(self), "pairs": count})
        pairs, table = self._search(task, count)
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
        mean, most = (result[f"yaw_error_{name}_deg"] for name in ("mean", "max"))
        say(f"final yaw off by {mean:.3f} deg in the mean, {most:.3f} deg at most")
        say(f"in {run.path}: result.json, pairs.csv, figure_5_*.png, recording.rrd")
        say(f"look at the saccades: orient-eye view {run.path}/recording.rrd")
        return result

    def _search(self, task: "SaccadeTask", count: int) -> "tuple[Yardstick, Yardstick]":
        from rich.console import Console
        from rich.progress import Progress

        from orient_eye.learning.evaluation import evaluation_saccades

        console = Console(stderr=True)
        with Progress(console=console, transient=True, disable=self.quiet or not console.is_terminal) as bar:
            job = bar.add_task("searching the optimum", total=1.0)
            return evaluation_saccades(task, count, progress=lambda share: bar.update(job, completed=share))


def _measure(policy: "Policy", pairs: "Yardstick", table: "Yardstick", path: Path) -> dict[str, Any]:
    """The numbers of result.json; pairs.csv is written on the way."""
    import numpy as np

    from orient_eye.cli.predict import saccade_rows
    from orient_eye.files import write_table
    from orient_eye.learning.evaluation import amplitude_table, gap_summary
    from orient_eye.rotations import to_euler

    action, outcome, gap = pairs.perform(policy.act)
    rows = saccade_rows(pairs.task, pairs.start_yaw_deg, pairs.target_yaw_deg, outcome)
    best = pairs.task.perform(pairs.start, pairs.optimum.action, pairs.target)
    best_rows = saccade_rows(pairs.task, pairs.start_yaw_deg, pairs.target_yaw_deg, best)
    same = ("start_yaw_deg", "target_yaw_deg", "F")
    beside = [{f"{k}_best": v for k, v in row.items() if not k.startswith(same)} for row in best_rows]
    write_table(path, [{**row, "gap": float(g), **other} for row, g, other in zip(rows, gap, beside, strict=True)])
    yaw_error = np.abs(to_euler(outcome.measures.final)[0] - pairs.target_yaw_deg)
    return {
        **gap_summary(pairs, action, outcome, gap),
        "yaw_error_mean_deg": float(np.nanmean(yaw_error)),
        "yaw_error_max_deg": float(np.nanmax(yaw_error)),
        "overshoot_max": float(np.nanmax(outcome.measures.overshoot)),
        "failed_saccades": int(outcome.measures.failed.sum()),
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
    from orient_eye.plants import plant_in_words
    from orient_eye.recording import model_of, record

    task = table.task
    record(
        path,
        task.trajectory(table.start, policy.act(table.start.orientation, table.target)),
        model=model_of(task.plant.identity()),
        target=table.target,
        titles=[f"{a:g} deg" for a in table.target_yaw_deg - table.start_yaw_deg],
        reference=task.trajectory(table.start, table.optimum.action),
        notes=f"Saccades of a policy on plant `{plant_in_words(task.plant.identity())}`, in grey with the best action "
        "a search found.",
    )
