"""Soft Actor-Critic for episodes of one step, on top of Stable-Baselines3.

A saccade has no next state, so the target of the Q network is the reward itself: no target network, no
second pass of the policy, two networks in the end, as the thesis has it (4.1). The class keeps SB3's
interface: `predict`, `save`, `load`, `learn`, callbacks, loggers.
"""

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch import Tensor

from orient_eye.learning.network import Network
from orient_eye.saccade import YAW_RANGE_DEG

Schedule = Callable[[float], float]
_HALF_LOG_2_PI = 0.5 * math.log(2 * math.pi)
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
        turn_w = aw * bw + (av * bv).sum(dim=1, keepdim=True)  # turn = b a^-1
        turn_v = aw * bv - bw * av + torch.linalg.cross(av, bv)
        # Rotation vectors of both at once: angle times axis.
        w, v = torch.stack([aw, turn_w], dim=1), torch.stack([av, turn_v], dim=1)
        size = torch.linalg.vector_norm(v, dim=2, keepdim=True)
        angle = 2 * torch.atan2(size, w.abs()) * torch.sign(w)
        stretch = torch.where(size > 1e-7, angle / size.clamp_min(1e-7), 2.0)
        return (v * stretch).flatten(1) / _GAZE_RANGE_RAD


def falling_temperature(first: float = 1.0, last: float = 1e-3, until: float = 0.8) -> Schedule:
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

    def _create_aliases(self) -> None:
        super()._create_aliases()
        heads = (self.actor.mu, cast(torch.nn.Linear, self.actor.log_std))
        self._policy = (Network(cast(Any, self.actor.latent_pi)), Network([heads[0]]), Network([heads[1]]))
        self._q = [Network(cast(Any, q)) for q in self.critic.q_networks]

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Updates of Q and policy from the replay buffer."""
        optimizers = [self.actor.optimizer, self.critic.optimizer]
        if self.ent_coef_optimizer is not None:
            optimizers.append(self.ent_coef_optimizer)
        self._update_learning_rate(optimizers)
        if self.temperature is not None:
            self.ent_coef_tensor = torch.tensor(self.temperature(self._current_progress_remaining), device=self.device)
        q_losses, policy_losses = [], []
        for _ in range(gradient_steps):
            assert self.replay_buffer is not None
            data = self.replay_buffer.sample(batch_size)
            with torch.no_grad():
                features = self.actor.extract_features(data.observations, self.actor.features_extractor)
                q_losses.append(self._update_q(features, data.actions, data.rewards))
                policy_loss, temperature = self._update_policy(features)
                policy_losses.append(policy_loss)

        self._n_updates += gradient_steps
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/ent_coef", float(temperature))
        self.logger.record("train/actor_loss", float(torch.stack(policy_losses).mean()))
        self.logger.record("train/critic_loss", float(torch.stack(q_losses).mean()))

    def _update_q(self, features: Tensor, actions: Tensor, rewards: Tensor) -> Tensor:
        """One step of Q towards the reward, which is the whole return; returns the mean squared error."""
        known = torch.cat([features, actions], dim=1)
        loss = torch.zeros((), device=self.device)
        for q in self._q:
            values = q.forward(known)
            error = values[-1] - rewards
            q.backward(values, error * (2 / len(error)), of_parameters=True, of_input=False)
            loss = loss + (error**2).mean()
        self.critic.optimizer.step()
        return loss

    def _update_policy(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """One step of the policy towards temperature * log density - Q; returns that loss and the temperature.

        Actions are a = tanh(u), u = mean + std * noise, with the density of the squashed Gaussian.
        """
        trunk, mean, log_std_head = self._policy
        latent = trunk.forward(features)
        raw = log_std_head.forward(latent[-1])
        means = mean.forward(latent[-1])
        log_std = raw[-1].clamp(LOG_STD_MIN, LOG_STD_MAX)
        noise = torch.randn_like(log_std)
        spread = log_std.exp() * noise
        actions = torch.tanh(means[-1] + spread)
        slope = 1 - actions**2
        soft = slope + 1e-6  # as SB3 has it
        log_density = (-0.5 * noise**2 - log_std - _HALF_LOG_2_PI - soft.log()).sum(dim=1)
        temperature = self._temperature_step(log_density)

        drawn = torch.cat([features, actions], dim=1)
        passes = [q.forward(drawn) for q in self._q]
        values = torch.cat([v[-1] for v in passes], dim=1)
        worst = values.argmin(dim=1, keepdim=True)
        by_action = torch.zeros_like(actions)
        for i, (q, v) in enumerate(zip(self._q, passes, strict=True)):
            counts = (worst == i).to(actions.dtype)
            by_action += q.backward(v, counts, of_parameters=False, of_input=True)[:, features.shape[1] :]
        n = len(actions)
        by_u = (temperature * 2 * actions / soft - by_action) * slope / n
        unclamped = (raw[-1] > LOG_STD_MIN) & (raw[-1] < LOG_STD_MAX)
        by_log_std = (by_u * spread - temperature / n) * unclamped
        by_latent = mean.backward(means, by_u, of_parameters=True, of_input=True)
        by_latent = by_latent + log_std_head.backward(raw, by_log_std, of_parameters=True, of_input=True)
        trunk.backward(latent, by_latent, of_parameters=True, of_input=False)
        self.actor.optimizer.step()
        return (temperature * log_density - values.amin(dim=1)).mean(), temperature

    def _temperature_step(self, log_probability: Tensor) -> Tensor:
        """The temperature of this update; under SB3's automatic rule it learns first."""
        if self.ent_coef_optimizer is None or self.log_ent_coef is None:
            return self.ent_coef_tensor
        temperature = self.log_ent_coef.detach().exp()
        assert isinstance(self.target_entropy, float)
        self.log_ent_coef.grad = -(log_probability + self.target_entropy).mean().reshape(1)
        self.ent_coef_optimizer.step()
        return temperature

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "_policy", "_q"]
