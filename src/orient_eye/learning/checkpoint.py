"""Everything a training run needs to go on as if it had never stopped, in one file.

Networks, optimizers, replay buffer, counters, the saccades in progress and the states of all random generators: a
safetensors file, as a policy's, of arrays, plain values and a hash of both, nothing that could run. It is written
whole or not at all, and the one before it is kept: where the newest is damaged or missing, a run goes on from that one.
"""

import json
import math
import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
import torch
from numpy.typing import NDArray

from orient_eye.checks import real, whole
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.files import digest, explained, finite, parse_json, read_arrays, write_atomically
from orient_eye.learning.config import TrainSettings
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import OneStepSAC
from orient_eye.state import State

NAME = "checkpoint.safetensors"
PREVIOUS = "checkpoint-previous.safetensors"
DAMAGED = "checkpoint-damaged.safetensors"
"""Whereto one that could not be read is moved, when the one before it takes its place."""
COLUMNS = (
    "update", "saccades", "elapsed_s", "reward_mean", "gap_mean", "gap_p95", "temperature", "q_loss", "policy_loss",
    "failed",
)  # fmt: skip
"""Of metrics.csv."""
_FORMAT, _PLAIN, _HASH = "orient-eye checkpoint 1", "orient-eye", "sha256"
_MOMENTS = ("step", "exp_avg", "exp_avg_sq")  # what Adam remembers
_ELSE_BYTES = 64 * 2**20  # in a checkpoint beside the replay buffer: 4 MB, and 100 bytes for each saccade begun


@dataclass(frozen=True)
class Counters:
    """What a run has counted and measured.

    Attributes:
        evaluated: updates at the last evaluation, -1 before the first.
        failed: saccades.
        elapsed: time spent [s].
        rows: of metrics.csv.
        rewards: mean ones of the rollouts since the last evaluation.

    Raises:
        InputError: one that no run can have.
    """

    evaluated: int
    failed: int
    elapsed: float
    rows: list[dict[str, float]]
    rewards: list[float]

    def __post_init__(self) -> None:
        whole("evaluated", self.evaluated, -1)
        whole("failed", self.failed, 0)
        real("elapsed", self.elapsed, 0)
        for row in self.rows:
            if tuple(row) != COLUMNS:
                raise InputError(f"its metrics have the columns {list(row)}, not {list(COLUMNS)}")
        for value in [*self.rewards, *(value for row in self.rows for value in row.values())]:
            if not isinstance(value, float | int):
                raise InputError(f"its metrics are no numbers: {value!r}")


@dataclass(frozen=True)
class Found:
    """Where a run was when its checkpoint was taken.

    Attributes:
        name: of the file.
        updates: done.
        counters: of the loop.
        damage: why the newest checkpoint was not taken; "" if it was.
    """

    name: str
    updates: int
    counters: Counters
    damage: str = ""


@dataclass(frozen=True)
class _Content:
    """Of a checkpoint that fits."""

    arrays: dict[str, NDArray[Any]]
    rollouts: int
    generators: dict[str, Any]
    counters: Counters


def save_checkpoint(
    folder: Path, settings: TrainSettings, model: OneStepSAC, env: SaccadeVecEnv, counters: Counters
) -> Path:
    """Write the checkpoint of a run between two updates; the newest until now becomes the previous one.

    Args:
        folder: of the run.
        settings: of the run.
        model: the algorithm.
        env: its environment, with saccades begun.
        counters: of the loop.

    Raises:
        InputError: it cannot be written.
    """
    arrays = _arrays(model, env)
    told = {
        "format": _FORMAT,
        "settings": asdict(settings),
        "rollouts": model.num_timesteps // env.num_envs,
        "generators": {name: random.bit_generator.state for name, random in _generators(model, env).items()},
        "counters": asdict(counters),
    }
    plain = {_PLAIN: json.dumps(finite(told))}
    content = safetensors.numpy.save(arrays, {**plain, _HASH: digest(arrays, plain)})

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())  # before the newest loses its name
        with suppress(FileNotFoundError):  # the first
            os.replace(folder / NAME, folder / PREVIOUS)

    return write_atomically(folder / NAME, write)


def load_checkpoint(folder: Path, settings: TrainSettings, model: OneStepSAC, env: SaccadeVecEnv) -> Found:
    """Put a run back where its newest checkpoint was taken, or the previous one where that is damaged or missing.

    Args:
        folder: of the run.
        settings: of the run.
        model: the algorithm, new.
        env: its environment.

    Raises:
        InputError: there is no checkpoint that is whole and fits the settings.
    """
    name, damage = NAME, ""
    try:
        content = _read(folder / NAME, settings, model, env)
    except InputError as error:
        name, damage = PREVIOUS, str(error)
        try:
            content = _read(folder / PREVIOUS, settings, model, env)
        except InputError as another:
            raise InputError(f"cannot go on: {error}. The one before it: {another}. Start a new run") from error
        with explained(folder / NAME):  # else the next checkpoint would put the damaged one in the place of this one
            with suppress(FileNotFoundError):
                os.replace(folder / NAME, folder / DAMAGED)
            os.replace(folder / PREVIOUS, folder / NAME)
    _restore(content, settings, model, env)
    return Found(name, model._n_updates, content.counters, damage)


def _read(path: Path, settings: TrainSettings, model: OneStepSAC, env: SaccadeVecEnv) -> _Content:
    """A checkpoint that is whole and fits, or an InputError."""
    most = _buffer(model).rows.nbytes + _ELSE_BYTES + 100 * env.num_envs
    arrays, metadata = read_arrays(path, most=most, hint="the checkpoint is damaged or missing")
    try:
        plain = {_PLAIN: metadata[_PLAIN]}
        if metadata[_HASH] != digest(arrays, plain):
            raise InputError("its checksum is wrong")
        told = parse_json(plain[_PLAIN])
        if told["format"] != _FORMAT:
            raise InputError(f"it is of the format {told['format']!r}, not {_FORMAT!r}")
        ours = json.loads(json.dumps(finite(asdict(settings))))
        if told["settings"] != ours:
            differ = [name for name, value in ours.items() if told["settings"].get(name) != value]
            raise InputError(f"it is of a run with other settings: {', '.join(differ) or 'more of them'}")
        rollouts = whole("rollouts", told["rollouts"], 0, settings.rollouts)
        content = _Content(arrays, rollouts, told["generators"], _counters(told["counters"]))
        _check(content, model, env)
    except (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
        raise InputError(f"the checkpoint {path} is damaged, or of another version: {error}") from error
    return content


def _counters(told: dict[str, Any]) -> Counters:
    """Those of a checkpoint, in which None stands for what is not a number."""
    rows = [{name: math.nan if value is None else value for name, value in row.items()} for row in told["rows"]]
    rewards = [math.nan if value is None else value for value in told["rewards"]]
    return Counters(**{**told, "rows": rows, "rewards": rewards})


def _check(content: _Content, model: OneStepSAC, env: SaccadeVecEnv) -> None:
    """Whether all of it fits: names, types and shapes of arrays, and the states of generators."""
    usual, buffer = _arrays(model, env), _buffer(model)
    rows = min(content.rollouts * env.num_envs, buffer.buffer_size)
    usual["rows"] = np.broadcast_to(np.float32(0), (rows, buffer.rows.shape[1]))
    given = {name: (array.dtype, array.shape) for name, array in content.arrays.items()}
    wrong = [name for name, array in usual.items() if given.get(name) != (array.dtype, array.shape)]
    if wrong or len(given) != len(usual):
        raise InputError(f"its arrays are not those of this run: {', '.join(wrong) or 'there are more of them'}")
    for name, array in content.arrays.items():
        if name.startswith(("policy.", "temperature", "start.", "target")) and not np.isfinite(array).all():
            raise InputError(f"its array {name} holds numbers that are not finite")
    for name in _generators(model, env):
        scratch = np.random.default_rng()
        scratch.bit_generator.state = content.generators[name]
        if scratch.bit_generator.state != content.generators[name]:
            raise InputError(f"the state of its generator {name} is none")
    torch.Generator().set_state(torch.from_numpy(content.arrays["random"].copy()))


def _restore(content: _Content, settings: TrainSettings, model: OneStepSAC, env: SaccadeVecEnv) -> None:
    """Put a run where a checkpoint, which fits, was taken."""
    tensors = {name: torch.from_numpy(array.copy()) for name, array in content.arrays.items()}
    model.policy.load_state_dict({name: tensors[f"policy.{name}"] for name in model.policy.state_dict()})
    if model.log_ent_coef is not None:
        model.log_ent_coef.data.copy_(tensors["temperature"])
    for name, optimizer in _optimizers(model).items():
        moments = {moment: tensors[f"{name}.{moment}"] for moment in _MOMENTS}
        optimizer.load_state_dict({**optimizer.state_dict(), "state": {0: moments}})
    buffer, saccades = _buffer(model), content.rollouts * env.num_envs
    buffer.rows[: len(content.arrays["rows"])] = content.arrays["rows"]
    buffer.pos, buffer.full = saccades % buffer.buffer_size, saccades >= buffer.buffer_size
    model.num_timesteps = saccades
    model._n_updates = settings.updates_per_rollout * max(0, content.rollouts - settings.warmup_rollouts)
    start = State(*(content.arrays[f"start.{part}"] for part in ("orientation", "motor", "angular_velocity")))
    model._last_obs = env.begin(start, content.arrays["target"])
    for name, random in _generators(model, env).items():
        random.bit_generator.state = content.generators[name]
    torch.set_rng_state(tensors["random"])
    if model.device.type == "cuda":
        torch.cuda.set_rng_state(tensors["cuda_random"], model.device)


def _arrays(model: OneStepSAC, env: SaccadeVecEnv) -> dict[str, NDArray[Any]]:
    """All arrays of a checkpoint, by name."""
    tensors = {f"policy.{name}": tensor for name, tensor in model.policy.state_dict().items()}
    if model.log_ent_coef is not None:
        tensors["temperature"] = model.log_ent_coef
    for name, optimizer in _optimizers(model).items():
        vector = optimizer.param_groups[0]["params"][0]
        none = {"step": torch.zeros(()), "exp_avg": torch.zeros_like(vector), "exp_avg_sq": torch.zeros_like(vector)}
        state = optimizer.state.get(vector) or none  # before its first step
        tensors |= {f"{name}.{moment}": state[moment] for moment in _MOMENTS}
    tensors["random"] = torch.get_rng_state()
    if model.device.type == "cuda":
        tensors["cuda_random"] = torch.cuda.get_rng_state(model.device)
    start, buffer = env.batch.start, _buffer(model)
    assert start is not None
    arrays = {name: tensor.detach().cpu().numpy() for name, tensor in tensors.items()}
    arrays |= {f"start.{part}": getattr(start, part) for part in ("orientation", "motor", "angular_velocity")}
    arrays |= {"target": env.batch.target, "rows": buffer.rows[: buffer.size()]}
    return {name: np.asarray(array, order="C") for name, array in arrays.items()}


def _optimizers(model: OneStepSAC) -> dict[str, torch.optim.Optimizer]:
    """Of one tensor each (`network.flatten`)."""
    found = {"actor": model.actor.optimizer, "critic": model.critic.optimizer}
    return found if model.ent_coef_optimizer is None else {**found, "temperature": model.ent_coef_optimizer}


def _generators(model: OneStepSAC, env: SaccadeVecEnv) -> dict[str, np.random.Generator]:
    return {"buffer": _buffer(model).random, "env": env.random, "actions": model.action_space.np_random}


def _buffer(model: OneStepSAC) -> OneStepReplayBuffer:
    assert isinstance(model.replay_buffer, OneStepReplayBuffer)
    return model.replay_buffer
