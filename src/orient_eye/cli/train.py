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

    $ orient-eye train

    $ orient-eye train --plant mujoco --case 2-varying --out runs/my-run

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
                result = train(self.config, self.out, quiet=self.quiet, checkpoint_s=self.checkpoint_every)
        except Interrupted as stopped:
            say(str(stopped))
            raise SystemExit(stopped.code) from None
        if self.config.weights is None:
            say(f"weights of the reward: {result['weights_from']}")
        say_result(result)
        say(f"in {result['out']}: policy.png, learning.png, recording.rrd")
        say(f"look at the saccades: orient-eye view {result['out']}/recording.rrd")
        return result
