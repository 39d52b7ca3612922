"""Soft Actor-Critic for episodes of one step, on top of Stable-Baselines3.

A saccade has no next state, so the target of the Q network is the reward itself: no target network, no
second pass of the policy, two networks in the end, as the thesis has it (4.1). The class keeps SB3's
interface: `predict`, `save`, `load`, `learn`, callbacks, loggers.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor
from torch.nn import functional

from orient_eye.saccade import YAW_RANGE_DEG

Schedule = Callable[[float], float]
_GAZE_RANGE_RAD = float(np.deg2rad(YAW_RANGE_DEG[1]))


class GazeFeatures(BaseFeaturesExtractor):
    """A fixed change of coordinates before the networks: nothing is learned here.

    From the quaternions of start and target to the rotation vectors of the start and of the turn from
    start to target, in units of 35 deg: for gaze directions the quaternions differ in the second digit
    only.
    """

    def __init__(self, observation_space: Any) -> None:
        super().__init__(observation_space, features_dim=6)

    def forward(self, observations: Tensor) -> Tensor:
        """Features (batch, 6) of observations (batch, 8)."""
        a, b = observations[:, :4], observations[:, 4:]
        aw, av, bw, bv = a[:, :1], a[:, 1:], b[:, :1], b[:, 1:]
        # turn = b a^-1
        w = aw * bw + (av * bv).sum(dim=1, keepdim=True)
        v = aw * bv - bw * av + torch.linalg.cross(av, bv)
        return torch.cat([_rotation_vector(aw, av), _rotation_vector(w, v)], dim=1) / _GAZE_RANGE_RAD


def _rotation_vector(w: Tensor, v: Tensor) -> Tensor:
    size = torch.linalg.vector_norm(v, dim=1, keepdim=True)
    angle = 2 * torch.atan2(size, w.abs()) * torch.sign(w)
    return v * torch.where(size > 1e-7, angle / size.clamp_min(1e-7), 2 * torch.ones_like(size))


def falling_temperature(first: float = 1.0, last: float = 3e-3, until: float = 0.8) -> Schedule:
    """Entropy temperature that falls geometrically from first to last over the first share of training.

    Returns:
        A function of the remaining share of training, 1 to 0, as SB3's schedules are.
    """
    return lambda remaining: float(first * (last / first) ** min((1 - remaining) / until, 1.0))


class OneStepSAC(SAC):
    """SAC whose episodes are one step long.

    Args:
        policy: as in SAC.
        env: as in SAC; every step must end its episode.
        temperature: entropy temperature, a function of the remaining share of training; None for SB3's
            automatic rule.
        settings: the other keywords of SAC.
    """

    def __init__(self, policy: Any, env: Any, *, temperature: Schedule | None = None, **settings: Any) -> None:
        self.temperature = temperature
        if temperature is not None:
            settings["ent_coef"] = temperature(1.0)
        super().__init__(policy, env, **settings)

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Updates of Q and policy from the replay buffer."""
        self.policy.set_training_mode(True)
        optimizers = [self.actor.optimizer, self.critic.optimizer]
        if self.ent_coef_optimizer is not None:
            optimizers.append(self.ent_coef_optimizer)
        self._update_learning_rate(optimizers)
        if self.temperature is not None:
            self.ent_coef_tensor = torch.tensor(self.temperature(self._current_progress_remaining), device=self.device)
        q_parameters = list(self.critic.parameters())
        q_losses, policy_losses = [], []
        for _ in range(gradient_steps):
            assert self.replay_buffer is not None
            data = self.replay_buffer.sample(batch_size)
            # Q: the reward is the whole return.
            q_loss = sum(functional.mse_loss(q, data.rewards) for q in self.critic(data.observations, data.actions))
            assert isinstance(q_loss, Tensor)
            self.critic.optimizer.zero_grad()
            q_loss.backward()
            self.critic.optimizer.step()

            # Policy: maximise Q plus temperature times entropy; Q's own gradients are not needed.
            actions, log_probability = self.actor.action_log_prob(data.observations)
            temperature = self._temperature_step(log_probability)
            for parameter in q_parameters:
                parameter.requires_grad_(False)
            q = torch.cat(self.critic(data.observations, actions), dim=1).min(dim=1).values
            policy_loss = (temperature * log_probability - q).mean()
            self.actor.optimizer.zero_grad()
            policy_loss.backward()
            self.actor.optimizer.step()
            for parameter in q_parameters:
                parameter.requires_grad_(True)
            q_losses.append(q_loss.detach())
            policy_losses.append(policy_loss.detach())

        self._n_updates += gradient_steps
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/ent_coef", float(temperature))
        self.logger.record("train/actor_loss", float(torch.stack(policy_losses).mean()))
        self.logger.record("train/critic_loss", float(torch.stack(q_losses).mean()))

    def _temperature_step(self, log_probability: Tensor) -> Tensor:
        """The temperature of this update; under SB3's automatic rule it learns first."""
        if self.ent_coef_optimizer is None or self.log_ent_coef is None:
            return self.ent_coef_tensor
        temperature = self.log_ent_coef.detach().exp()
        assert isinstance(self.target_entropy, float)
        loss = -(self.log_ent_coef * (log_probability.detach() + self.target_entropy)).mean()
        self.ent_coef_optimizer.zero_grad()
        loss.backward()
        self.ent_coef_optimizer.step()
        return temperature

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "temperature"]
