"""A training run: from a configuration to a run directory with policy, metrics and result.

    result = train(TrainConfig(plant="lpf"), Path("runs/first"))

The run directory holds run.json (settings, seed, versions), metrics.csv, optimum.safetensors (the searched optimum),
stages/ (evaluation saccades at several stages), checkpoint.safetensors and the one before it, policy.safetensors,
README.md (its card), result.json, learning.png, policy.png and recording.rrd. One training at a time works in it.
"""

import copy
import fcntl
import os
import shlex
import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.logger import Logger

from orient_eye.checks import real
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import Ended, InputError
from orient_eye.files import explained, remove_leftovers, unreadable
from orient_eye.learning.card import write_card
from orient_eye.learning.checkpoint import NAME as CHECKPOINT
from orient_eye.learning.checkpoint import PREVIOUS, Found, load_checkpoint
from orient_eye.learning.config import TrainConfig, TrainSettings
from orient_eye.learning.evaluation import Yardstick, amplitude_table, carry_optimum, evaluation_saccades, gap_summary
from orient_eye.learning.loop import CHECKPOINT_S, StopRequest, TrainingLoop
from orient_eye.learning.policy import Policy
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.robust import DRAWS, over_the_interval
from orient_eye.learning.sac import GazeFeatures, OneStepSAC, falling_temperature
from orient_eye.plants.uncertain import uncertain
from orient_eye.progress import progress_bar
from orient_eye.run_directory import RunDirectory, unnamed, versions
from orient_eye.search.optimum_file import NAME as OPTIMUM
from orient_eye.task.known_weights import bounds, compared_with_thesis
from orient_eye.task.saccade import SaccadeTask

_NETS = [128, 128, 32]  # thesis 4.6
_WAITS = 0.3  # of the run, while the policy it began with waits for a Q that knows what it is worth
_SPREAD = 0.05  # of that policy's actions
_FALLING = 0.6  # of the run, at its end, in which the learning rate falls


class Interrupted(Exception):
    """The run was stopped; it can go on.

    Attributes:
        folder: of the run.
        code: with which a program ends after that signal.
    """

    def __init__(self, folder: Path, signal: int, command: str = "train") -> None:
        self.folder, self.code = folder, 128 + signal
        super().__init__(f"stopped; go on with: orient-eye {command} --resume {shlex.quote(str(folder))}")


Begun = Callable[[SaccadeTask], object]
"""Called with the task when a run is about to begin."""


def train(
    config: TrainConfig,
    out: Path | None = None,
    *,
    quiet: bool = False,
    checkpoint_s: float = CHECKPOINT_S,
    begun: Begun | None = None,
) -> dict[str, Any]:
    """Run a new training.

    Args:
        config: of the run.
        out: its directory, new or empty; None for runs/train-DATE-TIME.
        quiet: no progress bar.
        checkpoint_s: seconds between checkpoints.
        begun: called with the task before the work begins.

    Returns:
        The content of result.json.

    Raises:
        InputError: bad configuration, or the directory is taken, or cannot be written.
        Interrupted: Ctrl-C, or a signal to end.
    """
    check_interval(checkpoint_s)
    task, settings = prepared(config)  # before the directory: bad input leaves nothing behind
    out = out or unnamed("train")
    with explained(out):
        out.mkdir(parents=True, exist_ok=True)
    with alone(out):
        run = RunDirectory.create(out, "train", settings, seed=settings.seed)
        if begun is not None:
            begun(task)
        return _Run(settings, task, run, checkpoint_s, quiet).execute(resume=False)


def prepared(config: TrainConfig) -> tuple[SaccadeTask, TrainSettings]:
    """The task and the settings of a run, all that can be wrong with them found.

    Raises:
        InputError: as `train`, of the configuration.
    """
    task = config.make_task()
    settings = config.resolved(task)
    _origin(settings, task)
    return task, settings


def resume(folder: Path, *, quiet: bool = False, checkpoint_s: float = CHECKPOINT_S) -> dict[str, Any]:
    """Go on with a run that was stopped, to the numbers it would have had.

    From its newest checkpoint; from the one before it where that is damaged or missing; from the beginning where it was
    stopped before the first one. run.json keeps under "resumed" from which.

    Raises:
        InputError: no run, nothing to go on from, or it is trained already, by another process.
        Interrupted: Ctrl-C, or a signal to end.
    """
    check_interval(checkpoint_s)
    with alone(folder):
        run = RunDirectory(folder)
        description = run.read_json("run.json")
        command = description.get("command") if isinstance(description, dict) else None
        if command != "train":
            raise InputError(f"{folder} is a run of {command!r}, not of train")
        if (folder / "result.json").exists():
            raise InputError(f"{folder} is finished: its result is in result.json; start a new run instead")
        try:
            settings = TrainSettings.from_plain(description["config"])
            task = settings.make_task()
            changed = {name: was for name, was in description["versions"].items() if versions().get(name) != was}
        except (AttributeError, KeyError, InputError) as error:
            raise InputError(f"cannot go on with run.json in {folder}: {error}") from error
        if changed:
            warnings.warn(f"not the numbers it would have had: the run began with {changed}", stacklevel=2)
        remove_leftovers(folder)
        begun = any((folder / name).exists() for name in (CHECKPOINT, PREVIOUS))
        if not begun and (folder / "metrics.csv").exists():
            warnings.warn(f"{folder} holds no checkpoint: the run begins again", stacklevel=2)
        return _Run(settings, task, run, checkpoint_s, quiet).execute(resume=begun)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Keep other trainings out of a folder, until the block ends, or this process however it does.

    Raises:
        InputError: another one works there, or it is no folder.
    """
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except (OSError, ValueError) as error:
        raise unreadable(folder, error, "this is no run directory, name one") from error
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise InputError(f"another process trains in {folder}; let it end, or name another folder") from error
        except OSError as error:  # a network's file system locks no folder
            warnings.warn(f"nothing keeps another training out of {folder}: {error.strerror}", stacklevel=3)
        yield
    finally:
        os.close(handle)


def _origin(settings: TrainSettings, task: SaccadeTask) -> Policy | None:
    """The policy with which a run begins, where there is one."""
    if not settings.origin:
        return None
    policy = Policy.load(settings.origin)
    policy.require_actions(task)
    return policy.within(task, np.random.default_rng(settings.seed))


def check_interval(checkpoint_s: float) -> None:
    """Raises InputError where that is no time between checkpoints."""
    real("the time between checkpoints", checkpoint_s, 0.01, 1e6, unit="s")


@dataclass(frozen=True)
class _Run:
    """One run in progress."""

    settings: TrainSettings
    task: SaccadeTask
    run: RunDirectory
    checkpoint_s: float
    quiet: bool

    def execute(self, *, resume: bool) -> dict[str, Any]:
        """Train, from the beginning or from a checkpoint; returns the result."""
        try:
            return self._execute(resume=resume)
        except KeyboardInterrupt as end:
            number = end.number if isinstance(end, Ended) else signal.SIGINT
            raise Interrupted(self.run.path, number) from None

    def _execute(self, *, resume: bool) -> dict[str, Any]:
        settings, folder = self.settings, self.run.path
        # Independent streams from the one seed.
        streams = np.random.SeedSequence(settings.seed).spawn(4)
        networks, saccades, actions, buffer = (int(stream.generate_state(1)[0]) for stream in streams)
        torch.set_num_threads(1)  # these networks are too small to share
        env = self._env()
        model = self._model(env, seed=networks, buffer_seed=buffer, resumed=resume)
        env.seed(saccades)  # SB3 has given both the seed of the networks
        model.action_space.seed(actions)
        yardstick, table = self._yardsticks()
        with StopRequest() as request, progress_bar("training", quiet=self.quiet) as advance:
            loop = TrainingLoop(folder, env, settings, yardstick, table, advance, request, self.checkpoint_s)
            if resume:
                found = load_checkpoint(folder, settings, model, env)
                self._tell(found)
                loop.go_on(found)
            left = settings.rollouts * env.num_envs - model.num_timesteps
            model.learn(left, callback=loop, log_interval=10**9, reset_num_timesteps=not resume)
            loop.finish()
        return self._conclude(model, yardstick, table, loop)

    def _tell(self, found: Found) -> None:
        """Say in run.json from where the run goes on, and where that is not the newest checkpoint, warn."""
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        told = {"at": now, "from": found.name, "updates": found.updates, "damage": found.damage}
        description = self.run.read_json("run.json")
        before = description.get("resumed")
        resumed = [*(before if isinstance(before, list) else []), told]
        self.run.write_json("run.json", {**description, "resumed": resumed})
        if found.damage:
            words = f"going on from the checkpoint before the newest, at update {found.updates}: {found.damage}"
            warnings.warn(words, stacklevel=2)

    def _env(self) -> SaccadeVecEnv:
        settings, task = self.settings, self.task
        plant = copy.copy(task.plant)
        plant.doubt = settings.doubt
        task = replace(task, plant=plant)
        if settings.robust:  # each saccade on another eye, drawn from the environment's generator
            task = replace(task, plant=uncertain(task.plant, settings.robust))
        log = settings.reward_scale == "log"
        return SaccadeVecEnv(settings.saccades_per_rollout, task, log_reward=log, infos=False)

    def _model(self, env: SaccadeVecEnv, *, seed: int, buffer_seed: int, resumed: bool = False) -> OneStepSAC:
        settings = self.settings
        rate, last, temperature = settings.learning_rate, settings.last_learning_rate, settings.temperature
        model = OneStepSAC(
            "MlpPolicy",
            env,
            temperature=None if temperature == "auto" else falling_temperature(*temperature),
            learning_rate=lambda remaining: rate * max(min(remaining / _FALLING, 1.0), last),
            batch_size=settings.batch_size,
            buffer_size=settings.replay_size,
            replay_buffer_class=OneStepReplayBuffer,
            replay_buffer_kwargs={"seed": buffer_seed},
            learning_starts=settings.warmup_rollouts * env.num_envs,
            train_freq=1,
            gradient_steps=settings.updates_per_rollout,
            policy_waits=round(_WAITS * settings.updates) if settings.origin else 0,
            seed=seed,
            device=settings.device,
            policy_kwargs={
                "net_arch": _NETS,
                "features_extractor_class": GazeFeatures,
                "n_critics": 1,
                "optimizer_kwargs": {"fused": True, "betas": (0.9, settings.second_moment)},
            },
        )
        model.set_logger(Logger(folder=None, output_formats=[]))
        origin = None if resumed else _origin(settings, self.task)
        if origin is not None:
            model.begin_with(origin.weights, origin.biases, _SPREAD)
        return model

    def _yardsticks(self) -> tuple[Yardstick, Yardstick]:
        """Random saccades, the same for every run, and the table's amplitudes, with their searched optimum."""
        with progress_bar("searching the optimum", quiet=self.quiet) as advance:
            path = self.run.path / OPTIMUM
            pairs, table = evaluation_saccades(self.task, self.settings.evaluation_pairs, advance, path)
        carry_optimum(pairs, table, self.run.path)
        return pairs, table

    def policy(self, model: OneStepSAC) -> Policy:
        """The mean of the policy, out of torch."""
        layers = [m for m in [*model.actor.latent_pi, model.actor.mu] if isinstance(m, torch.nn.Linear)]
        weights = tuple(layer.weight.detach().cpu().numpy().T.astype(float) for layer in layers)
        biases = tuple(layer.bias.detach().cpu().numpy().astype(float) for layer in layers)
        apart = ("task", "weights_from", "case")
        config = {name: value for name, value in asdict(self.settings).items() if name not in apart}
        config["origin"] = Path(self.settings.origin).name  # the policy holds no path of this machine
        return Policy.of_task(
            self.task, weights, biases, case=self.settings.case, config=config, versions=versions(), result={}
        )

    def _conclude(
        self, model: OneStepSAC, yardstick: Yardstick, table: Yardstick, loop: TrainingLoop
    ) -> dict[str, Any]:
        from orient_eye.learning.figures import draw_learning, draw_policy
        from orient_eye.learning.stages import record_stages

        policy = self.policy(model)
        found = {
            "plant": self.task.plant.name,
            "weights": dict(self.task.weights),
            "weights_from": self.task.weights_from,
            "bounds": bounds(self.task),
            "compared_with_thesis": compared_with_thesis(self.task),
            "updates": self.settings.updates,
            "saccades": model.num_timesteps,
            "train_s": round(loop.elapsed, 1),
            **gap_summary(yardstick, *yardstick.perform(policy.act)),
            "failed_saccades": loop.failed,
            "table": amplitude_table(table, policy.act),
        }
        if self.settings.robust:
            plant = uncertain(self.task.plant, self.settings.robust)
            learned = policy.act(yardstick.start.orientation, yardstick.target)
            found["robust"] = {
                "intervals": self.settings.robust,
                "eyes": DRAWS * len(yardstick.target),
                "policy": over_the_interval(yardstick, plant, learned),
                "best_of_nominal": over_the_interval(yardstick, plant, yardstick.optimum.action),
            }
        policy = replace(policy, manifest={**policy.manifest, "result": found})
        policy.save(self.run.path)
        write_card(policy, self.run.path)
        draw_learning(self.run.path / "metrics.csv", self.run.path / "learning.png")
        draw_policy(policy, yardstick, self.run.path / "policy.png")
        record_stages(self.task, self.run.path, table)
        result = {"out": str(self.run.path), **found}  # nor this one
        self.run.write_json("result.json", result)
        return result
