"""Soft Actor-Critic for episodes of one step, on top of Stable-Baselines3.

A saccade has no next state, so the target of the Q network is the reward itself: no target network, no
second pass of the policy, two networks in the end, as the thesis has it (4.1). The class keeps SB3's
interface: `predict`, `save`, `load`, `learn`, callbacks, loggers.
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch import Tensor, nn

from orient_eye.errors import InputError
from orient_eye.learning.features import GAZE_INPUTS
from orient_eye.learning.network import Network, flatten, take_step
from orient_eye.learning.torch_policy import gaze_features

Array = NDArray[np.float64]
Schedule = Callable[[float], float]
_HALF_LOG_2_PI = 0.5 * math.log(2 * math.pi)


class GazeFeatures(BaseFeaturesExtractor):
    """A fixed change of coordinates before the networks (`gaze_features`): nothing is learned here."""

    def __init__(self, observation_space: Any) -> None:
        super().__init__(observation_space, features_dim=GAZE_INPUTS)

    def forward(self, observations: Tensor) -> Tensor:
        """Features (batch, 6) of observations (batch, 8)."""
        return gaze_features(observations)


def falling_temperature(first: float, last: float, until: float = 0.8) -> Schedule:
    """Entropy temperature that falls geometrically from first to last over the first share of training.

    Returns:
        A function of the remaining share of training, 1 to 0, as SB3's schedules are.
    """
    return lambda remaining: float(first * (last / first) ** min((1 - remaining) / until, 1.0))


class OneStepSAC(SAC):
    """SAC whose episodes are one step long.

    Its zips are loaded by `OneStepSAC.load`; those of stock SAC have another optimizer (`import_sb3` reads
    the policy of either).

    Args:
        policy: as in SAC: networks of ReLU layers, with features that learn nothing.
        env: as in SAC; every step must end its episode.
        temperature: entropy temperature, a function of the remaining share of training; None for `ent_coef`,
            as in SAC.
        policy_waits: updates of the Q network before the first one of the policy, which an untrained Q would spoil
            where it is a good one already.
        settings: the other keywords of SAC.

    Raises:
        InputError: two temperatures, or networks whose gradients are not written out here.
    """

    def __init__(
        self, policy: Any, env: Any, *, temperature: Schedule | None = None, policy_waits: int = 0, **settings: Any
    ) -> None:
        self.temperature, self.policy_waits = temperature, policy_waits
        if temperature is not None:
            if "ent_coef" in settings:
                raise InputError("give temperature or ent_coef, not both")
            settings["ent_coef"] = temperature(1.0)
        super().__init__(policy, env, **settings)

    def _create_aliases(self) -> None:
        super()._create_aliases()
        if self.use_sde:
            raise InputError("OneStepSAC has no state-dependent exploration: leave use_sde out")
        if any(True for _ in self.actor.features_extractor.parameters()):
            raise InputError("OneStepSAC does not train a features extractor: give one without parameters")
        heads = cast(nn.Linear, self.actor.mu), cast(nn.Linear, self.actor.log_std)
        head = nn.Linear(heads[0].in_features, 2 * heads[0].out_features, device=self.device)
        for name in ("weight", "bias"):
            getattr(head, name).data = torch.cat([getattr(layer, name).data for layer in heads])
        policy = nn.Sequential(*self.actor.latent_pi, head)
        for part, parameters in ((self.actor, policy.parameters()), (self.critic, self.critic.parameters())):
            settings = {"lr": self.lr_schedule(1), **self.policy.optimizer_kwargs}
            part.optimizer = self.policy.optimizer_class([flatten(parameters)], **settings)
        for name in ("weight", "bias"):  # SB3's two heads are views of the halves of the one
            both = getattr(head, name)
            for layer, data, gradient in zip(heads, both.data.chunk(2), both.grad.chunk(2), strict=True):
                getattr(layer, name).data, getattr(layer, name).grad = data, gradient
        self._policy = Network(policy)
        self._one = torch.tensor(1 + 1e-6, device=self.device)
        self._q = [Network(cast(Any, q)) for q in self.critic.q_networks]

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Updates of Q and policy from the replay buffer."""
        optimizers = [self.actor.optimizer, self.critic.optimizer]
        if self.ent_coef_optimizer is not None:
            optimizers.append(self.ent_coef_optimizer)
        self._update_learning_rate(optimizers)
        if self.temperature is not None:
            self.ent_coef_tensor.fill_(self.temperature(self._current_progress_remaining))
        q_loss = policy_loss = torch.zeros((), device=self.device)
        # Moments of silent units fade into denormal numbers, at which a processor is many times slower.
        torch.set_flush_denormal(True)
        temperature = self.ent_coef_tensor if self.log_ent_coef is None else self.log_ent_coef.detach().exp()
        for step in range(gradient_steps):
            assert self.replay_buffer is not None
            data = self.replay_buffer.sample(batch_size, env=self._vec_normalize_env)
            with torch.no_grad():
                features = self.actor.extract_features(data.observations, self.actor.features_extractor)
                q_loss = q_loss + self._update_q(features, data.actions, data.rewards)
                if self._n_updates + step >= self.policy_waits:
                    loss, temperature = self._update_policy(features)
                    policy_loss = policy_loss + loss
        torch.set_flush_denormal(False)

        self._n_updates += gradient_steps
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/ent_coef", float(temperature))
        self.logger.record("train/actor_loss", float(policy_loss) / gradient_steps)
        self.logger.record("train/critic_loss", float(q_loss) / gradient_steps)

    def _update_q(self, features: Tensor, actions: Tensor, rewards: Tensor) -> Tensor:
        """One step of Q towards the reward, which is the whole return; returns the mean squared error."""
        known = torch.cat([features, actions], dim=1)
        loss = torch.zeros((), device=self.device)
        for q in self._q:
            values = q.forward(known)
            loss = loss + torch.nn.functional.mse_loss(values[-1], rewards)
            error = values[-1] - rewards
            q.backward(values, error.mul_(2 / len(error)), of_parameters=True, of_input=False)
        take_step(self.critic.optimizer)
        return loss

    def _update_policy(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """One step of the policy towards temperature * log density - Q; returns that loss and the temperature.

        Actions are a = tanh(u), u = mean + std * noise, with the density of the squashed Gaussian.
        """
        outputs = self._policy.forward(features)
        mean, raw = outputs[-1].chunk(2, dim=1)
        log_std = raw.clamp(LOG_STD_MIN, LOG_STD_MAX)
        noise = torch.randn_like(log_std)
        spread = log_std.exp().mul_(noise)
        actions = (mean + spread).tanh_()
        n, size = actions.shape
        slope = torch.addcmul(self._one, actions, actions, value=-1)  # 1 - a^2, kept off zero as SB3 does
        entropy = torch.addcmul(log_std, noise, noise, value=0.5).add_(slope.log()).sum() / n + size * _HALF_LOG_2_PI
        temperature = self._temperature_step(entropy)

        drawn = torch.cat([features, actions], dim=1)
        passes = [q.forward(drawn) for q in self._q]
        value, worst = torch.cat([v[-1] for v in passes], dim=1).min(dim=1, keepdim=True)
        by_drawn = [
            q.backward(v, (worst == i) * (-1 / n), of_parameters=False, of_input=True)
            for i, (q, v) in enumerate(zip(self._q, passes, strict=True))
        ]
        by_action = functools.reduce(torch.add, by_drawn)[:, -size:]
        pull = temperature / n
        by_u = torch.ops.aten.tanh_backward((actions / slope).mul_(2 * pull).add_(by_action), actions)
        by_log_std = (by_u * spread).sub_(pull).mul_(raw == log_std)  # nothing where it was clamped
        by_outputs = torch.cat([by_u, by_log_std], dim=1)
        self._policy.backward(outputs, by_outputs, of_parameters=True, of_input=False)
        take_step(self.actor.optimizer)
        return -(temperature * entropy + value.sum() / n), temperature

    def begin_with(self, weights: Sequence[Array], biases: Sequence[Array], spread: float) -> None:
        """Put a policy in the place of the random one.

        Args:
            weights: of its layers, (inputs, outputs) each, the last one's for the mean.
            biases: of the layers.
            spread: standard deviation of its actions before they are squashed.

        Raises:
            InputError: layers of other shapes.
        """
        layers = [m for m in [*self.actor.latent_pi, self.actor.mu] if isinstance(m, nn.Linear)]
        shapes = [tuple(layer.weight.shape[::-1]) for layer in layers]
        if [np.shape(weight) for weight in weights] != shapes:
            raise InputError(f"the policy to begin with has layers {[np.shape(w) for w in weights]}, not {shapes}")
        with torch.no_grad():
            for layer, weight, bias in zip(layers, weights, biases, strict=True):
                layer.weight.copy_(torch.as_tensor(weight.T))
                layer.bias.copy_(torch.as_tensor(bias))
            log_std = cast(nn.Linear, self.actor.log_std)
            log_std.weight.zero_()
            log_std.bias.fill_(math.log(spread))

    def finite(self) -> bool:
        """Whether the parameters of both networks are finite numbers."""
        vectors = [part.optimizer.param_groups[0]["params"][0] for part in (self.actor, self.critic)]
        return all(bool(vector.sum().isfinite()) for vector in vectors)

    def _temperature_step(self, entropy: Tensor) -> Tensor:
        """The temperature of this update; under SB3's automatic rule it learns first."""
        if self.ent_coef_optimizer is None or self.log_ent_coef is None:
            return self.ent_coef_tensor
        temperature = self.log_ent_coef.detach().exp()
        assert isinstance(self.target_entropy, float)
        self.log_ent_coef.grad = (entropy - self.target_entropy).reshape(1)
        self.ent_coef_optimizer.step()
        return temperature

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "_policy", "_q", "_one"]
