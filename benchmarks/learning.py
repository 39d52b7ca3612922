"""Updates a second of OneStepSAC against stock Stable-Baselines3 SAC: ratios within one run.

    python benchmarks/learning.py [--batch 1024] [--device cuda]

Same environment, networks 128-128-32, batch 512, a replay buffer of 8192 saccades; blocks of updates in
turn. The autograd twin makes the same updates as ours, by torch's autograd (docs/decisions/0003-networks-by-hand.md).
The last line is the time of the matrix products alone that one update of ours needs. On another device than the CPU,
the CPU competes too. Threads of torch wait badly: measure on a machine with nothing else to do.
"""

import argparse
import itertools
import time
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.logger import Logger
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch import nn

from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import GazeFeatures, OneStepSAC, falling_temperature

NETS = [128, 128, 32]
DEFAULT = "OneStepSAC, 1 critic, 1 torch thread (default)"


class AutogradTwin(SAC):
    """The updates of `OneStepSAC` with one critic, by autograd: no target network, features once a batch."""

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Updates of Q and policy from the replay buffer."""
        actor, q = self.actor, self.critic.q_networks[0]
        self._update_learning_rate([actor.optimizer, self.critic.optimizer])
        assert self.replay_buffer is not None
        weights = list(actor.parameters())
        torch.set_flush_denormal(True)
        for _ in range(gradient_steps):
            data = self.replay_buffer.sample(batch_size)
            with torch.no_grad():
                features = actor.extract_features(data.observations, actor.features_extractor)
            self.critic.optimizer.zero_grad()
            nn.functional.mse_loss(q(torch.cat([features, data.actions], dim=1)), data.rewards).backward()
            self.critic.optimizer.step()
            latent = actor.latent_pi(features)
            log_std = actor.log_std(latent).clamp(LOG_STD_MIN, LOG_STD_MAX)
            noise = torch.randn_like(log_std)
            actions = torch.tanh(actor.mu(latent) + log_std.exp() * noise)
            entropy = (log_std + 0.5 * noise**2 + torch.log(1 - actions**2 + 1e-6)).sum(dim=1).mean()
            value = q(torch.cat([features, actions], dim=1)).mean()
            actor.optimizer.zero_grad()
            (-self.ent_coef_tensor * entropy - value).backward(inputs=weights)
            actor.optimizer.step()
        torch.set_flush_denormal(False)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Speed of the learning.")
    parser.add_argument("--batch", type=int, default=512)
    parser.add_argument("--updates", type=int, default=200, help="a block")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, help="of torch, beside one; 1 leaves these rows out; default: all cores")
    options = parser.parse_args()
    env = SaccadeVecEnv(128, "lpf", log_reward=True, seed=0, infos=False)
    stock = SAC("MlpPolicy", env, policy_kwargs={"net_arch": NETS}, **common(options.batch, options.device))
    one, two = (ours(env, critics, options.batch, options.device) for critics in (1, 2))
    twin = AutogradTwin("MlpPolicy", env, ent_coef=1.0, **alike(1), **common(options.batch, options.device))
    threads = options.threads or torch.get_num_threads()
    contestants: dict[str, tuple[SAC, int]] = {
        f"stock SB3 SAC, 2 critics, {threads} torch threads": (stock, threads),
        "stock SB3 SAC, 2 critics, 1 torch thread": (stock, 1),
        f"OneStepSAC, 1 critic, {threads} torch threads": (one, threads),
        DEFAULT: (one, 1),
        "autograd twin, 1 critic, 1 torch thread": (twin, 1),
        "OneStepSAC, 2 critics, 1 torch thread": (two, 1),
    }
    if options.device != "cpu":
        contestants["the default, but on the CPU"] = (ours(env, 1, options.batch, "cpu"), 1)
    if threads == 1:
        contestants = {name: entry for name, entry in contestants.items() if "torch threads" not in name}
    for model in {id(model): model for model, _ in contestants.values()}.values():
        model.set_logger(Logger(folder=None, output_formats=[]))
        fill(model, env)
    seconds: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(options.rounds + 1):
        for name, (model, count) in contestants.items():
            torch.set_num_threads(count)
            began = time.perf_counter()
            model.train(options.updates, options.batch)
            if options.device != "cpu":
                torch.cuda.synchronize()
            seconds[name].append((time.perf_counter() - began) / options.updates)
    times = {name: np.array(s[1:]) for name, s in seconds.items()}  # the first round warms up
    reference = next(iter(times.values()))
    print(
        f"batch {options.batch}, blocks of {options.updates} updates, {options.rounds} rounds, device {options.device}"
    )
    for name, s in times.items():
        ratio = reference / s
        print(
            f"{name:48s} {1e3 * np.median(s):6.2f} ms an update, {np.median(ratio):5.2f} times stock "
            f"({ratio.min():.2f} to {ratio.max():.2f})"
        )
    torch.set_num_threads(1)
    products = matrix_products(options.batch, options.device)
    own = float(np.median(times[DEFAULT]))
    name = "the matrix products of one such update alone"
    print(f"{name:48s} {1e3 * products:6.2f} ms: {100 * products / own:.0f} % of it")


def common(batch: int, device: str) -> dict[str, Any]:
    """What all contestants have alike."""
    return {"buffer_size": 300_000, "batch_size": batch, "seed": 0, "device": device, "learning_rate": 1e-3}


def ours(env: SaccadeVecEnv, critics: int, batch: int, device: str) -> OneStepSAC:
    """Ours, as `orient-eye train` makes it."""
    return OneStepSAC("MlpPolicy", env, temperature=falling_temperature(), **alike(critics), **common(batch, device))


def alike(critics: int) -> dict[str, Any]:
    """What ours and its autograd twin have alike."""
    policy = {"net_arch": NETS, "features_extractor_class": GazeFeatures, "n_critics": critics}
    return {
        "replay_buffer_class": OneStepReplayBuffer,
        "policy_kwargs": {**policy, "optimizer_kwargs": {"fused": True}},
    }


def fill(model: SAC, env: SaccadeVecEnv) -> None:
    """Put random saccades into the replay buffer."""
    random = np.random.default_rng(0)
    assert model.replay_buffer is not None
    observation = env.reset()
    for _ in range(64):
        action = random.uniform(-1, 1, (env.num_envs, env.action_space.shape[0])).astype(np.float32)
        following, reward, done, infos = env.step(action)
        model.replay_buffer.add(observation, following, action, reward, done, infos)
        observation = following


def matrix_products(batch: int, device: str, rounds: int = 300) -> float:
    """Seconds of the products of one update: Q forward and backward, policy forward and backward through Q."""
    q, policy = [9, *NETS, 1], [6, *NETS, 6]
    x = {size: torch.randn(batch, size, device=device) for size in {*q, *policy}}
    pairs = [*itertools.pairwise(q), *itertools.pairwise(policy)]
    w = {pair: torch.randn(*pair, device=device) for pair in pairs}

    def forward(sizes: list[int]) -> None:
        for a, b in itertools.pairwise(sizes):
            x[a] @ w[a, b]

    def backward(sizes: list[int], *, of_weights: bool, of_input: bool) -> None:
        for layer, (a, b) in enumerate(itertools.pairwise(sizes)):
            if of_weights:
                x[a].T @ x[b]
            if of_input or layer:
                x[b] @ w[a, b].T

    began = 0.0
    for i in range(rounds + 20):
        if i == 20:
            began = time.perf_counter()
        forward(q)
        backward(q, of_weights=True, of_input=False)
        forward(policy)
        forward(q)
        backward(q, of_weights=False, of_input=True)
        backward(policy, of_weights=True, of_input=False)
    if device != "cpu":
        torch.cuda.synchronize()
    return (time.perf_counter() - began) / rounds


if __name__ == "__main__":
    main()
