"""orient-eye evaluate."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from orient_eye.cli.another_plant import AnotherPlant

MOST = 10_000
"""Saccades."""


@dataclass(frozen=True)
class Evaluate:
    """Hold a policy against the best actions a search finds, over the whole range of saccades.

    POLICY is a run directory of `orient-eye train`, a policy folder, or the name of a shipped policy
    (`orient-eye models`). Leaves a run directory: result.json, pairs.csv (every saccade beside its optimum),
    pictures named after the thesis' figures of its Chapter 5 (for gaze targets: paths and components of the gaze, main
    sequence, Listing's plane, torsion, motors), and a Rerun recording with the optimum in grey.
    The searched optimum travels with the policy, for its own plant and saccades; others are searched, and kept in the
    user's cache.

    $ orient-eye evaluate runs/my-run

    $ orient-eye evaluate runs/my-run --plant mujoco --force
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")]
    """Run directory, policy folder, or name of a shipped policy."""
    pairs: Annotated[int | None, tyro.conf.arg(help_behavior_hint="(default: as many as its training)")] = None
    """Number of random saccades, always the same ones, as in training runs; where something differs from its training
    by default 300 in closed form, 30 on a rig, 60 simulated, and 24 between gaze targets."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/evaluate-DATE-TIME)")] = None
    """Run directory, new or empty."""
    another_plant: AnotherPlant = field(default_factory=AnotherPlant)
    quiet: bool = False
    """Show no progress bar."""

    def run(self) -> dict[str, Any]:
        """Search the optimum, measure the policy, and write the run directory."""
        from dataclasses import asdict

        from orient_eye.checks import whole
        from orient_eye.cli.learned import say_gaze, say_result
        from orient_eye.cli.places import policy_file
        from orient_eye.cli.tables import say, say_limits
        from orient_eye.files import write_table
        from orient_eye.learning.directions import in_all_directions
        from orient_eye.learning.evaluation import evaluation_saccades
        from orient_eye.learning.gaze_numbers import PLANE_OF
        from orient_eye.learning.judged import draw_policy_figures, measure_policy, record_policy
        from orient_eye.learning.policy import Policy
        from orient_eye.progress import progress_bar
        from orient_eye.run_directory import RunDirectory
        from orient_eye.search.optimum_file import NAME

        policy = Policy.load(self.policy)
        task, differences = self.another_plant.task(policy)
        trained = None if differences else policy.manifest.get("result", {}).get("pairs")
        usual = trained or task.targets.learning.get("evaluation_pairs", task.plant.evaluation_pairs)
        count = usual if self.pairs is None else self.pairs
        gaze = in_all_directions(task)
        least = PLANE_OF if gaze else 1
        whole("--pairs", count, least, MOST, advice="for each the best saccade is searched")
        run = RunDirectory.create(self.out, "evaluate", {**asdict(self), "pairs": count})
        with progress_bar("searching the optimum", quiet=self.quiet) as advance:
            carried = policy_file(self.policy).with_name(NAME)
            pairs, table = evaluation_saccades(task, count, advance, carried)
        numbers, rows = measure_policy(policy, pairs, table)
        result = {
            "out": str(run.path),
            "policy": self.policy,
            "plant": task.plant.name,
            "task": task.identity(),
            "differs_from_training": differences,
            **numbers,
        }
        write_table(run.path / "pairs.csv", rows)
        drawn = draw_policy_figures(policy, pairs, table, run.path)
        record_policy(policy, table, run.path / "recording.rrd")
        run.write_json("result.json", result)
        say_limits(task, rows)
        say_result(result)
        if gaze:
            say_gaze(result)
        else:
            for angle in (name.removesuffix("_deg") for name in task.targets.angles):
                mean, most = (result[f"{angle}_error_{of}_deg"] for of in ("mean", "max"))
                say(f"final {angle} off by {mean:.3f} deg in the mean, {most:.3f} deg at most")
        say(f"in {run.path}: result.json, pairs.csv, {', '.join(drawn)}, recording.rrd")
        say(f"look at the saccades: orient-eye view {run.path}/recording.rrd")
        return result
