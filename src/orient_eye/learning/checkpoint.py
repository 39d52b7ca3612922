"""Everything a training run needs to go on as if it had never stopped, in one file.

Networks, optimizers, replay buffer, counters, the saccades in progress and the states of all random generators.
The file is written whole or not at all, and read with torch's loader of plain tensors, which runs no code.
"""

import io
import json
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import numpy as np
import torch

from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.files import write_atomically
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import OneStepSAC
from orient_eye.state import State

NAME = "checkpoint.pt"


def save_checkpoint(folder: Path, model: OneStepSAC, env: SaccadeVecEnv, extra: dict[str, Any]) -> Path:
    """Write the checkpoint of a run between two updates.

    Args:
        folder: of the run.
        model: the algorithm.
        env: its environment, with saccades begun.
        extra: plain values kept beside.

    Raises:
        InputError: it cannot be written.
    """
    buffer = _buffer(model)
    assert env.batch.start is not None
    content = {
        "policy": model.policy.state_dict(),
        "actor_optimizer": model.actor.optimizer.state_dict(),
        "critic_optimizer": model.critic.optimizer.state_dict(),
        "temperature": _temperature(model),
        "rows": torch.from_numpy(buffer.rows[: buffer.size()]),
        "torch_random": torch.get_rng_state(),
        "cuda_random": torch.cuda.get_rng_state_all() if model.device.type == "cuda" else [],
        "plain": json.dumps(
            {
                "buffer_position": buffer.pos,
                "buffer_full": buffer.full,
                "timesteps": model.num_timesteps,
                "updates": model._n_updates,
                "buffer_random": buffer.random.bit_generator.state,
                "env_random": env.random.bit_generator.state,
                "action_random": model.action_space.np_random.bit_generator.state,
                "start": env.batch.start.to_plain(),
                "target": env.batch.target.tolist(),
                "extra": extra,
            }
        ),
    }
    file = io.BytesIO()  # in memory first: what torch says of a full disk is no OSError
    torch.save(content, file)
    return write_atomically(folder / NAME, lambda temporary: temporary.write_bytes(file.getbuffer()))


def load_checkpoint(folder: Path, model: OneStepSAC, env: SaccadeVecEnv) -> dict[str, Any]:
    """Put a run back where its checkpoint was taken; returns what was kept beside.

    Raises:
        InputError: there is no checkpoint, or it does not fit.
    """
    try:
        content = torch.load(folder / NAME, weights_only=True)
        plain = json.loads(content["plain"])
        start, target = State.from_plain(plain["start"]), np.array(plain["target"], dtype=float)
        model.policy.load_state_dict(content["policy"])
        model.actor.optimizer.load_state_dict(content["actor_optimizer"])
        model.critic.optimizer.load_state_dict(content["critic_optimizer"])
        if content["temperature"]:
            assert model.log_ent_coef is not None
            assert model.ent_coef_optimizer is not None
            model.log_ent_coef.data.copy_(content["temperature"]["log"])
            model.ent_coef_optimizer.load_state_dict(content["temperature"]["optimizer"])
        buffer = _buffer(model)
        buffer.rows[: len(content["rows"])] = content["rows"].numpy()
    except (OSError, EOFError, KeyError, TypeError, ValueError, RuntimeError, UnpicklingError) as error:
        raise InputError(f"the checkpoint in {folder} cannot be read, or does not fit this version: {error}") from error
    buffer.pos, buffer.full = plain["buffer_position"], plain["buffer_full"]
    model.num_timesteps, model._n_updates = plain["timesteps"], plain["updates"]
    buffer.random.bit_generator.state = plain["buffer_random"]
    model.action_space.np_random.bit_generator.state = plain["action_random"]
    model._last_obs = env.begin(start, target)
    env.random.bit_generator.state = plain["env_random"]
    torch.set_rng_state(content["torch_random"])
    if model.device.type == "cuda":
        torch.cuda.set_rng_state_all(content["cuda_random"])
    extra: dict[str, Any] = plain["extra"]
    return extra


def _buffer(model: OneStepSAC) -> OneStepReplayBuffer:
    assert isinstance(model.replay_buffer, OneStepReplayBuffer)
    return model.replay_buffer


def _temperature(model: OneStepSAC) -> dict[str, Any] | None:
    """What the automatic rule has learned, where it is in use."""
    if model.log_ent_coef is None or model.ent_coef_optimizer is None:
        return None
    return {"log": model.log_ent_coef.detach(), "optimizer": model.ent_coef_optimizer.state_dict()}
