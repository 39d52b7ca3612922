"""The replay buffer of one-step episodes: state, action, reward, and nothing of a next state."""

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from stable_baselines3.common.utils import get_device
from stable_baselines3.common.vec_env import VecNormalize


class OneStepReplayBuffer(ReplayBuffer):
    """A ring of the newest saccades, with its own random generator; SB3's interface.

    Args:
        buffer_size: saccades it holds.
        observation_space: of the environment.
        action_space: of the environment.
        device: where samples go.
        n_envs: saccades added at a time.
        optimize_memory_usage: accepted for SB3; there is no next state to save.
        seed: of the sampling.
    """

    def __init__(
        self,
        buffer_size: int,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        device: torch.device | str = "auto",
        n_envs: int = 1,
        optimize_memory_usage: bool = False,
        seed: int | None = None,
        **_: Any,
    ) -> None:
        assert isinstance(observation_space, spaces.Box)
        assert isinstance(action_space, spaces.Box)
        self.buffer_size = max(buffer_size, n_envs)
        self.observation_space, self.action_space = observation_space, action_space
        self.device = get_device(device)
        self.n_envs = n_envs
        self.handle_timeout_termination = False  # SB3 asks when a buffer is loaded
        self.random = np.random.default_rng(seed)
        # One float32 row a saccade: observation, action, reward.
        self.observation_size, self.action_size = observation_space.shape[0], action_space.shape[0]
        width = self.observation_size + self.action_size + 1
        self.rows: NDArray[np.float32] = np.zeros((self.buffer_size, width), np.float32)
        self.pos, self.full = 0, False

    def size(self) -> int:
        """Saccades in the buffer."""
        return self.buffer_size if self.full else self.pos

    def reset(self) -> None:
        """Forget everything."""
        self.pos, self.full = 0, False

    def add(
        self,
        obs: NDArray[Any],
        next_obs: NDArray[Any],
        action: NDArray[Any],
        reward: NDArray[Any],
        done: NDArray[Any],
        infos: list[dict[str, Any]],
    ) -> None:
        """Add saccades; next_obs, done and infos say nothing here."""
        new = np.concatenate([obs, action, reward[:, None]], axis=1, dtype=np.float32)
        where = (self.pos + np.arange(len(new))) % self.buffer_size
        self.rows[where] = new
        self.full = self.full or self.pos + len(new) >= self.buffer_size
        self.pos = (self.pos + len(new)) % self.buffer_size

    def sample(self, batch_size: int, env: VecNormalize | None = None) -> ReplayBufferSamples:
        """Saccades drawn uniformly, with replacement, normalised where `env` does so."""
        drawn = self.random.integers(self.size(), size=batch_size)
        taken = self.rows.take(drawn, axis=0)
        if env is not None:
            taken[:, : self.observation_size] = np.asarray(env.normalize_obs(taken[:, : self.observation_size]))
            taken[:, -1] = env.normalize_reward(taken[:, -1])
        rows = torch.from_numpy(taken).to(self.device)
        observations = rows[:, : self.observation_size]
        actions = rows[:, self.observation_size : -1]
        rewards = rows[:, -1:]
        return ReplayBufferSamples(observations, actions, observations, torch.ones_like(rewards), rewards)
