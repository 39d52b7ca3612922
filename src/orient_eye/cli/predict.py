"""orient-eye predict."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.cli.another_plant import AnotherPlant
from orient_eye.cli.saccades import Saccades

if TYPE_CHECKING:
    from orient_eye.task.saccade import Outcome, SaccadeTask

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")


@dataclass(frozen=True)
class Predict:
    """What a policy does: motor command, expected duration, peak velocity and accuracy of saccades.

    POLICY is a run directory of `orient-eye train`, a policy folder, or the name of a shipped policy
    (`orient-eye models`). What is expected is what the plant does under the command.

    $ orient-eye predict runs/my-run --start 0 --target 20

    $ orient-eye predict runs/my-run --target -15 --command saccade.csv

    $ orient-eye simulate --motor saccade.csv

    $ orient-eye predict runs/my-run --pairs pairs.csv --out predicted.csv
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")]
    """Run directory, policy folder, or name of a shipped policy."""
    saccades: Saccades = field(default_factory=Saccades)
    command: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: the motor command of the one saccade, as `orient-eye simulate --motor` reads it."""
    out: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: the result, one row a saccade."""
    another_plant: AnotherPlant = field(default_factory=AnotherPlant)

    def run(self) -> dict[str, Any]:
        """Predict, write the files and print the table."""
        from orient_eye.cli.places import check_outputs, policy_file
        from orient_eye.cli.tables import saccade_columns, say, table
        from orient_eye.errors import InputError
        from orient_eye.files import write_table
        from orient_eye.learning.policy import Policy
        from orient_eye.task.table import outcome_rows
        from orient_eye.task.targets import saccades
        from orient_eye.words import plant_in_words

        policy = Policy.load(self.policy)
        inputs = {"--pairs": self.saccades.pairs, "the policy": policy_file(self.policy)}
        check_outputs({"--command": self.command, "--out": self.out}, inputs)
        task, differences = self.another_plant.task(policy)
        ends = self.saccades.angles(task.targets, drawn=True)
        if self.command and len(ends[0]) != 1:
            raise InputError(
                f"--command writes the motor command of one saccade, {self.saccades.pairs} has {len(ends[0])}"
            )
        start, target = saccades(task.targets, *ends)
        action = policy.act(start.orientation, target)
        outcome = task.perform(start, action, target)
        rows = outcome_rows(task, start, target, action, outcome)
        title = f"What the policy does on plant {plant_in_words(task.plant.identity())}."
        say(table(title, saccade_columns(task, rows[0]), rows))
        if outcome.measures.failed.any():
            say(f"{int(outcome.measures.failed.sum())} simulated saccades failed: their measures are empty", "red")
        if self.out:
            say(f"in {write_table(self.out, rows)}")
        if self.command:
            _write_command(self.command, task, outcome)
            say(f"motor command in {self.command}: orient-eye simulate --motor {self.command}")
        return {
            "policy": self.policy,
            "plant": task.plant.identity(),
            "differs_from_training": differences,
            "saccades": rows,
            "out": str(self.out) if self.out else None,
            "command": str(self.command) if self.command else None,
        }


def _write_command(path: Path, task: "SaccadeTask", outcome: "Outcome") -> None:
    """The motor command of one saccade at the plant's step, cut off at the motors' range; first the rest position."""
    import numpy as np

    from orient_eye.commands.motor_file import write_command
    from orient_eye.errors import InputError
    from orient_eye.motor import ranges

    if outcome.measures.failed[0]:
        raise InputError("the saccade failed, so there is no motor command to write; leave --command out")
    trajectory = outcome.movement.trajectory()
    low, high = ranges(task.plant.motors).T
    write_command(path, task.plant.motors, trajectory.time, np.clip(trajectory.command[0], low, high))
