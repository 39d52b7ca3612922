"""A training run: from a configuration to a run directory with policy, metrics and result.

    result = train(TrainConfig(plant="lpf"), Path("runs/first"))

The run directory holds run.json (configuration, seed, versions), surrogate.json (lpf), metrics.csv,
evaluation.json (the searched optimum), stages/ (evaluation saccades at several stages), checkpoint.pt,
policy.npz and policy.json, result.json, learning.png, policy.png and recording.rrd.
"""

import warnings
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import Progress
from stable_baselines3.common.logger import Logger

from orient_eye.environments.saccade_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.learning.checkpoint import NAME as CHECKPOINT
from orient_eye.learning.checkpoint import load_checkpoint
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.evaluation import Yardstick, amplitude_table, evaluation_saccades, gap_summary
from orient_eye.learning.loop import CHECKPOINT_S, CtrlC, Stop, TrainingLoop, progress_bar
from orient_eye.learning.policy import Policy
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import GazeFeatures, OneStepSAC, falling_temperature
from orient_eye.plants import Plant, chosen_plant
from orient_eye.run_directory import RunDirectory, versions
from orient_eye.surrogate import Surrogate
from orient_eye.task.reward import Weights
from orient_eye.task.saccade import SaccadeTask

_NETS = [128, 128, 32]  # thesis 4.6


class Interrupted(Exception):
    """The run was stopped between two updates; its checkpoint is written."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        super().__init__(f"stopped; go on with: orient-eye train --resume {folder}")


def train(
    config: TrainConfig, out: Path | None = None, *, quiet: bool = False, checkpoint_s: float = CHECKPOINT_S
) -> dict[str, Any]:
    """Run a new training.

    Args:
        config: of the run.
        out: its directory, new or empty; None for runs/train-DATE-TIME.
        quiet: no progress bar.
        checkpoint_s: seconds between checkpoints.

    Returns:
        The content of result.json.

    Raises:
        InputError: bad configuration, or the directory is taken.
        Interrupted: Ctrl-C.
    """
    config = config.resolved()
    plant = _plant(config)  # before the directory: bad input leaves nothing behind
    _task(config, plant)
    run = RunDirectory.create(out, "train", config, seed=config.seed)
    if config.plant == "lpf":
        Surrogate.load(config.surrogate).save(run.path / "surrogate.json")
    return _Run(config, run, plant, checkpoint_s).execute(resume=False, quiet=quiet)


def resume(folder: Path, *, quiet: bool = False, checkpoint_s: float = CHECKPOINT_S) -> dict[str, Any]:
    """Go on with a run that was stopped, to the numbers it would have had.

    From its checkpoint, or from the beginning where it was stopped before the first one.

    Raises:
        InputError: no run, or nothing to go on from.
        Interrupted: Ctrl-C.
    """
    run = RunDirectory(folder)
    description = run.read_json("run.json")
    command = description.get("command") if isinstance(description, dict) else None
    if command != "train":
        raise InputError(f"{folder} is a run of {command!r}, not of train")
    try:
        settings: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in description["config"].items()
        }
        config = TrainConfig(**settings)
    except (AttributeError, KeyError, TypeError) as error:
        raise InputError(f"run.json in {folder} is not of this version of orient-eye: {error}") from error
    config = config.resolved()
    changed = {name: was for name, was in description.get("versions", {}).items() if versions().get(name) != was}
    if changed:
        warnings.warn(f"not the numbers it would have had: the run began with {changed}", stacklevel=2)
    if (folder / "result.json").exists():
        raise InputError(f"{folder} is finished: its result is in result.json; start a new run without --resume")
    surrogate = folder / "surrogate.json"
    plant = _plant(config, surrogate if surrogate.exists() else None)
    begun = (folder / CHECKPOINT).exists()
    return _Run(config, run, plant, checkpoint_s).execute(resume=begun, quiet=quiet)


def _plant(config: TrainConfig, surrogate: Path | None = None) -> Plant:
    return chosen_plant(config.plant, surrogate or config.surrogate, config.eye)


def _task(config: TrainConfig, plant: Plant) -> SaccadeTask:
    assert config.weights
    weights = Weights(*config.weights)
    return SaccadeTask.of_case(plant, config.case, weights=weights, band=config.band, speed_limit=config.speed_limit)


@dataclass
class _Run:
    """One run in progress."""

    config: TrainConfig
    run: RunDirectory
    plant: Plant
    checkpoint_s: float
    task: SaccadeTask = field(init=False)

    def __post_init__(self) -> None:
        self.task = _task(self.config, self.plant)

    def execute(self, *, resume: bool, quiet: bool) -> dict[str, Any]:
        config, folder = self.config, self.run.path
        # Independent streams from the one seed.
        streams = np.random.SeedSequence(config.seed).spawn(4)
        networks, saccades, actions, buffer = (int(stream.generate_state(1)[0]) for stream in streams)
        torch.set_num_threads(1)  # these networks are too small to share
        assert config.saccades_per_update
        assert config.updates
        env = SaccadeVecEnv(config.saccades_per_update, self.task, log_reward=config.reward_scale == "log")
        model = self._model(env, seed=networks, buffer_seed=buffer)
        env.seed(saccades)  # SB3 has given both the seed of the networks
        model.action_space.seed(actions)
        with progress_bar(quiet) as bar:
            yardstick, table = self._yardsticks(bar)
            with CtrlC() as ctrl_c:
                loop = TrainingLoop(folder, env, config.updates, yardstick, table, bar, ctrl_c, self.checkpoint_s)
                if resume:
                    loop.go_on(load_checkpoint(folder, model, env))
                total = (self._warmup_steps() + config.updates) * env.num_envs
                try:
                    left = total - model.num_timesteps
                    model.learn(left, callback=loop, log_interval=10**9, reset_num_timesteps=not resume)
                except Stop:
                    raise Interrupted(folder) from None
                loop.finish()
        return self._conclude(model, yardstick, table, loop)

    def _warmup_steps(self) -> int:
        assert self.config.saccades_per_update
        assert self.config.warmup
        return -(-self.config.warmup // self.config.saccades_per_update)

    def _model(self, env: SaccadeVecEnv, *, seed: int, buffer_seed: int) -> OneStepSAC:
        config = self.config
        assert config.learning_rate
        assert config.last_learning_rate
        assert config.batch_size
        assert config.replay_size
        rate, last = config.learning_rate, config.last_learning_rate
        model = OneStepSAC(
            "MlpPolicy",
            env,
            temperature=falling_temperature(*config.temperature) if isinstance(config.temperature, tuple) else None,
            learning_rate=lambda remaining: rate * max(min(remaining / 0.2, 1.0), last),
            batch_size=config.batch_size,
            buffer_size=config.replay_size,
            replay_buffer_class=OneStepReplayBuffer,
            replay_buffer_kwargs={"seed": buffer_seed},
            learning_starts=self._warmup_steps() * env.num_envs,
            train_freq=1,
            gradient_steps=1,
            seed=seed,
            device=config.device,
            policy_kwargs={
                "net_arch": _NETS,
                "features_extractor_class": GazeFeatures,
                "n_critics": 1,
                "optimizer_kwargs": {"fused": True},
            },
        )
        model.set_logger(Logger(folder=None, output_formats=[]))
        return model

    def _yardsticks(self, bar: Progress) -> tuple[Yardstick, Yardstick]:
        """Random saccades, the same for every run, and the table's amplitudes, with their searched optimum."""
        assert self.config.evaluation_pairs
        job = bar.add_task("searching the optimum", total=1.0, note="")
        pairs, table = evaluation_saccades(
            self.task, self.config.evaluation_pairs, progress=lambda share: bar.update(job, completed=share)
        )
        bar.remove_task(job)
        self.run.write_json("evaluation.json", {"pairs": pairs.to_plain(), "table": table.to_plain()})
        return pairs, table

    def policy(self, model: OneStepSAC, result: dict[str, Any]) -> Policy:
        """The mean of the policy, out of torch."""
        layers = [m for m in [*model.actor.latent_pi, model.actor.mu] if isinstance(m, torch.nn.Linear)]
        weights = tuple(layer.weight.detach().cpu().numpy().T.astype(float) for layer in layers)
        biases = tuple(layer.bias.detach().cpu().numpy().astype(float) for layer in layers)
        manifest = {
            "case": self.config.case,
            "task": self.task.identity(),
            "config": asdict(self.config),
            "versions": versions(),
            "result": result,
        }
        return Policy(weights, biases, self.task.action_low, self.task.action_high, manifest)

    def _conclude(
        self, model: OneStepSAC, yardstick: Yardstick, table: Yardstick, loop: TrainingLoop
    ) -> dict[str, Any]:
        from orient_eye.learning.figures import draw_learning, draw_policy
        from orient_eye.learning.stages import record_stages

        policy = self.policy(model, {})
        result = {
            "out": str(self.run.path),
            "plant": self.config.plant,
            "updates": self.config.updates,
            "saccades": model.num_timesteps,
            "train_s": round(loop.elapsed, 1),
            **gap_summary(yardstick, *yardstick.perform(policy.act)),
            "failed_saccades": loop.failed,
            "table": amplitude_table(table, policy.act),
        }
        found = {key: value for key, value in result.items() if key != "out"}  # no path of this machine
        replace(policy, manifest={**policy.manifest, "result": found}).save(self.run.path)
        draw_learning(self.run.path / "metrics.csv", self.run.path / "learning.png")
        draw_policy(self.task, policy, yardstick, self.run.path / "policy.png")
        record_stages(self.task, self.run.path, table)
        self.run.write_json("result.json", result)
        return result
