"""orient-eye train."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from orient_eye.learning.config import TrainConfig


@dataclass(frozen=True)
class Train:
    """Train a saccade policy with Soft Actor-Critic, on the surrogate or on the whole eye.

    Leaves a run directory: configuration, metrics, policy, pictures, and a Rerun recording of evaluation
    saccades at several stages. Ctrl-C stops cleanly; --resume goes on. It ends with a table of learned
    actions beside the best ones a search finds.
    """

    config: TrainConfig = field(default_factory=TrainConfig)
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/train-DATE-TIME)")] = None
    """Run directory, new or empty."""
    resume: Path | None = None
    """Run directory to go on with; takes the run's own configuration."""
    quiet: bool = False
    """No progress bar."""
    checkpoint_every: float = 20.0
    """Seconds between checkpoints, from which --resume goes on after a crash."""

    def run(self) -> dict[str, Any]:
        """Train or resume."""
        from orient_eye.cli import say
        from orient_eye.errors import InputError

        if self.resume and (self.config != TrainConfig() or self.out):
            raise InputError("--resume takes the run's own configuration and directory; leave the other options out")
        from orient_eye.learning.training import Interrupted, resume, train

        try:
            if self.resume:
                result = resume(self.resume, quiet=self.quiet, checkpoint_s=self.checkpoint_every)
            else:
                result = train(self.config, self.out, quiet=self.quiet, checkpoint_s=self.checkpoint_every)
        except Interrupted as stopped:
            say(str(stopped))
            raise SystemExit(130) from None
        say_result(result)
        say(f"in {result['out']}: policy.png, learning.png, recording.rrd")
        say(f"look at the saccades: orient-eye view {result['out']}/recording.rrd")
        return result


def say_result(result: dict[str, Any]) -> None:
    """The table, the gaps and the failures of a training or an evaluation."""
    from orient_eye.cli import say

    say(learned_table(result))
    say(
        f"mean reward gap to the searched optimum over {result['pairs']} random saccades: "
        f"{100 * result['gap_mean']:.2f} % (95th percentile {100 * result['gap_p95']:.2f} %)"
    )
    if result["failed_saccades"]:
        say(f"[red]{result['failed_saccades']} simulated saccades failed and got the worst reward[/red]")


def learned_table(result: dict[str, Any]) -> Any:
    """Learned actions beside the best ones found, for people; result has `plant` and `table`."""
    from rich.table import Table

    table = Table(title=f"learned | best action found, plant {result['plant']}")
    for name in ("amplitude", "B [1/s]", r"D - F \[deg]", "k0 [1/s]", "reward", "gap", "duration", "peak velocity"):
        table.add_column(name, justify="right")
    for row in result["table"]:
        table.add_row(
            f"{row['amplitude_deg']:.0f} deg",
            f"{row['B']:.2f} | {row['B_best']:.2f}",
            f"{row['step_deg']:.3f} | {row['step_deg_best']:.3f}",
            f"{row['k0']:.2f} | {row['k0_best']:.2f}",
            f"{row['reward']:.0f} | {row['reward_best']:.0f}",
            f"{100 * row['gap']:.2f} %",
            f"{row['duration_ms']:.0f} ms",
            f"{row['peak_velocity_deg_s']:.0f} deg/s",
        )
    return table
