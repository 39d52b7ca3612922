"""orient-eye train."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.learning.config import PRESETS, TrainConfig

if TYPE_CHECKING:
    from orient_eye.task.saccade import SaccadeTask


@dataclass(frozen=True)
class Train:
    """Train a saccade policy with Soft Actor-Critic, on the surrogate or on the whole eye.

    Leaves a run directory: configuration, metrics, policy and its card, pictures, and a Rerun recording of evaluation
    saccades at several stages. Ctrl-C stops cleanly; --resume goes on. It ends with a table of learned
    actions beside the best ones a search finds.

    $ orient-eye train

    $ orient-eye train --plant mujoco --case 2-varying --out runs/my-run

    $ orient-eye train --surrogate runs/sysid-1/surrogate.json --end-point-error 0.5 --robust

    $ orient-eye train --resume runs/my-run
    """

    config: TrainConfig = field(default_factory=TrainConfig)
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/train-DATE-TIME)")] = None
    """Run directory, new or empty."""
    resume: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """Run directory to go on with; takes the run's own configuration."""
    quiet: bool = False
    """Show no progress bar."""
    checkpoint_every: float = 20.0
    """Seconds between checkpoints, from which --resume goes on after a crash."""

    def run(self) -> dict[str, Any]:
        """Train or resume."""
        from orient_eye.cli.learned import say_result
        from orient_eye.cli.tables import say
        from orient_eye.errors import InputError

        if self.resume and (self.config != TrainConfig() or self.out):
            raise InputError("--resume takes the run's own configuration and directory; leave the other options out")
        from orient_eye.learning.training import Interrupted, resume, train

        try:
            if self.resume:
                result = resume(self.resume, quiet=self.quiet, checkpoint_s=self.checkpoint_every)
            else:
                result = train(
                    self.config, self.out, quiet=self.quiet, checkpoint_s=self.checkpoint_every, begun=self._say
                )
        except Interrupted as stopped:
            say(str(stopped))
            raise SystemExit(stopped.code) from None
        say_result(result)
        if "robust" in result:
            _say_robust(result)
        say(f"in {result['out']}: README.md (the policy's card), policy.png, learning.png, recording.rrd")
        say(f"look at the saccades: orient-eye view {result['out']}/recording.rrd")
        return result

    def _say(self, task: "SaccadeTask") -> None:
        """What is trained, and whether a few updates more or less were quicker."""
        from orient_eye.cli.tables import say

        _say_task(task)
        settings, usual = self.config.resolved(task), PRESETS[self.config.preset]["updates_per_rollout"]
        if self.config.updates_per_rollout is None and settings.updates_per_rollout < usual:
            few = settings.updates_per_rollout
            made = "singly" if few == 1 else f"{few} at a time"
            say(f"{settings.updates} updates are performed {made}; a multiple of {usual} is quicker")


def _say_task(task: "SaccadeTask") -> None:
    """Bounds, weights, where they are from, and how they differ from the thesis'."""
    from orient_eye.cli.tables import say
    from orient_eye.task.known_weights import bounds, compared_with_thesis

    units = dict(zip(task.actions.names, (n.unit for n in task.actions.numbers), strict=True))
    told = (f"{name} from {low:.4g} to {high:.4g} {units[name]}".rstrip() for name, (low, high) in bounds(task).items())
    say(f"actions: {', '.join(told)}")
    weights = ", ".join(f"{name} {value:.3g}" for name, value in task.weights.items())
    say(f"weights of the reward: {weights}; {task.weights_from}")
    if task.judge == "orientation":
        say(compared_with_thesis(task))


def _say_robust(result: dict[str, Any]) -> None:
    """What robustness costs, and what it buys."""
    from orient_eye.cli.tables import say

    learned, nominal = result["robust"]["policy"], result["robust"]["best_of_nominal"]

    def told(what: dict[str, float]) -> str:
        return (
            f"end point off by {what['error_deg_mean']:.2f} deg, at worst {what['error_deg_worst']:.2f}; overshoot "
            f"{what['overshoot_mean']:.2%}, at worst {what['overshoot_worst']:.2%}; settles in "
            f"{what['duration_ms_mean']:.0f} ms"
        )

    say(f"what robustness costs on the nominal plant: a mean reward gap of {result['gap_mean']:.2%}")
    say(f"over the intervals ({result['robust']['eyes']} eyes): {told(learned)}")
    say(f"the best actions for the nominal plant there: {told(nominal)}")
