"""What happens between two updates of a training run: progress, metrics, stages, checkpoints, a stop."""

import signal
import time
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback

from orient_eye.environments.batch import observe
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import Ended, InputError
from orient_eye.files import explained, write_table
from orient_eye.learning.checkpoint import COLUMNS, Counters, Found, save_checkpoint
from orient_eye.learning.config import TrainSettings
from orient_eye.learning.evaluation import Yardstick
from orient_eye.learning.sac import OneStepSAC
from orient_eye.progress import Advance

Array = NDArray[np.float64]
STAGES = (0.0, 0.1, 0.25, 0.5, 1.0)
"""Shares of the training at which evaluation saccades are recorded."""
_EVALUATIONS = 50  # a run
CHECKPOINT_S = 20.0
"""Seconds between checkpoints."""


class TrainingLoop(BaseCallback):
    """Progress, metrics, stages and checkpoints, always between two updates."""

    def __init__(
        self,
        folder: Path,
        env: SaccadeVecEnv,
        settings: TrainSettings,
        yardstick: Yardstick,
        table: Yardstick,
        advance: Advance,
        request: "StopRequest",
        checkpoint_s: float,
    ) -> None:
        super().__init__()
        self.checkpoint_s = checkpoint_s
        self.folder, self.env, self.yardstick, self.table, self.request = folder, env, yardstick, table, request
        self.settings, self.updates, self.advance = settings, settings.updates, advance
        rollouts = settings.updates // settings.updates_per_rollout
        self.every = max(1, rollouts // _EVALUATIONS) * settings.updates_per_rollout
        self.rows: list[dict[str, float]] = []
        self.rewards: list[float] = []
        self.failed, self.elapsed = 0, 0.0
        self.began = self.resumed = self.saved = time.monotonic()
        self.done_before, self.evaluated = 0, -1

    @property
    def algorithm(self) -> OneStepSAC:
        """The one that learns."""
        assert isinstance(self.model, OneStepSAC)
        return self.model

    def go_on(self, found: Found) -> None:
        """Take up the counters of a checkpoint."""
        counters = found.counters
        self.rows, self.failed, self.rewards = counters.rows, counters.failed, counters.rewards
        self.evaluated, self.done_before = counters.evaluated, found.updates
        self.began -= counters.elapsed

    def _on_rollout_start(self) -> None:
        self._between_updates()

    def _on_step(self) -> bool:
        assert self.env.outcome is not None
        self.failed += int(self.env.outcome.measures.failed.sum())
        self.rewards.append(float(self.env.outcome.reward.total.mean()))
        return True

    def _between_updates(self) -> None:
        n = self.algorithm._n_updates
        self.elapsed = time.monotonic() - self.began
        self._require_finite()
        if n % self.every == 0 and n != self.evaluated:
            self._evaluate(n)
        if self.rows:
            speed = (n - self.done_before) / max(time.monotonic() - self.resumed, 1e-9)
            row = self.rows[-1]
            note = f"gap {100 * row['gap_mean']:.2f} %"
            if len(self.rows) > 1:  # before, nothing was learned from
                note = f"reward {row['reward_mean']:.3g}  {note}  {speed:.0f} updates/s"
            if self.failed:
                note += f"  {self.failed} saccades failed"
            self.advance(n / self.updates, note)
        if self.request.signal is not None:
            self._save()
            raise Ended(self.request.signal)
        if time.monotonic() - self.saved > self.checkpoint_s:
            self._save()

    def finish(self) -> None:
        """The last evaluation and checkpoint.

        Raises:
            Ended: a stop was asked for meanwhile.
        """
        self.elapsed = time.monotonic() - self.began
        self._require_finite()
        if self.evaluated != self.updates:
            self._evaluate(self.updates)
        self._save()
        if self.request.signal is not None:
            raise Ended(self.request.signal)

    def _require_finite(self) -> None:
        if not self.algorithm.finite():
            raise InputError(
                f"the training diverged at update {self.algorithm._n_updates}: the networks hold numbers that are not "
                "finite; start a new run with a smaller learning rate"
            )

    def _save(self) -> None:
        counters = Counters(self.evaluated, self.failed, self.elapsed, self.rows, self.rewards)
        save_checkpoint(self.folder, self.settings, self.algorithm, self.env, counters)
        self.saved = time.monotonic()

    def _act(self, start: Array, target: Array) -> Array:
        scaled, _ = self.algorithm.predict(observe(start, target), deterministic=True)
        return self.env.task.actions.from_unit(scaled)

    def _evaluate(self, n: int) -> None:
        _, _, gap = self.yardstick.perform(self._act)
        logged = self.algorithm.logger.name_to_value
        nothing = float("nan")
        row = (
            n,
            self.num_timesteps,
            round(self.elapsed, 2),
            float(np.mean(self.rewards)) if self.rewards else nothing,
            float(gap.mean()),
            float(np.quantile(gap, 0.95)),
            *(float(logged.get(f"train/{name}", nothing)) for name in ("ent_coef", "critic_loss", "actor_loss")),
            self.failed,
        )
        self.rows.append(dict(zip(COLUMNS, row, strict=True)))
        self.rewards = []
        self.evaluated = n
        self._write_metrics()
        for stage in STAGES:
            if n == (self.updates if stage == 1 else self.every * round(stage * self.updates / self.every)):
                self._record_stage(stage)

    def _record_stage(self, stage: float) -> None:
        start, target = self.table.start, self.table.target
        trajectory = self.env.task.trajectory(start, self._act(start.orientation, target), target)
        trajectory.save_npz(self.folder / "stages" / f"{round(100 * stage):03d}.npz")

    def _write_metrics(self) -> None:
        write_table(self.folder / "metrics.csv", self.rows)
        self._tensorboard()

    def _tensorboard(self) -> None:
        try:
            from torch.utils.tensorboard import SummaryWriter
        except ImportError:
            return  # an optional extra
        row, folder = self.rows[-1], self.folder / "tensorboard"
        with explained(folder):
            if not hasattr(self, "writer"):  # after a resume it tells anew what came after the checkpoint
                self.writer = SummaryWriter(str(folder), purge_step=int(row["update"]))
            for name, value in row.items():
                self.writer.add_scalar(name, value, int(row["update"]))
            self.writer.flush()


class StopRequest:
    """Ctrl-C, or a signal to end, asks for a stop at the next update; sent again it stops at once, by `Ended`.

    Attributes:
        signal: that was received; None as long as there is none.
        now: the one that is heeded at present, in this process.
    """

    now: "ClassVar[StopRequest | None]" = None

    def __init__(self) -> None:
        self.signal: int | None = None
        self.before: dict[int, Any] = {}

    def __enter__(self) -> "StopRequest":
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            try:
                if signal.getsignal(number) not in (signal.SIG_IGN, None):  # as nohup has it, or not of Python
                    self.before[number] = signal.signal(number, self._handle)
            except ValueError:  # not in the main thread: Python's own handlers stay
                break
        StopRequest.now = self
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        StopRequest.now = None
        for number, handler in self.before.items():
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.signal is not None:
            raise Ended(number)
        self.signal = number
