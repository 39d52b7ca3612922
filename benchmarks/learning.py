"""Updates a second of OneStepSAC against stock Stable-Baselines3 SAC: ratios within one run.

    python benchmarks/learning.py [--device cuda]

Same environment, networks 128-128-32, batch 512, a replay buffer of 8192 saccades; blocks of updates in
turn. The last line is the time of the matrix products alone that one update of ours needs. On another device
than the CPU, the CPU competes too. Threads of torch wait badly: measure on a machine with nothing else to do.
"""

import argparse
import itertools
import time
from typing import Any

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.logger import Logger

from orient_eye.environments.saccade_env import SaccadeVecEnv
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import GazeFeatures, OneStepSAC, falling_temperature

NETS = [128, 128, 32]
DEFAULT = "OneStepSAC, 1 critic, 1 torch thread (default)"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Speed of the learning.")
    parser.add_argument("--batch", type=int, default=512)
    parser.add_argument("--updates", type=int, default=200, help="a block")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--device", default="cpu")
    options = parser.parse_args()
    env = SaccadeVecEnv(128, "lpf", log_reward=True, seed=0)
    stock = SAC("MlpPolicy", env, policy_kwargs={"net_arch": NETS}, **common(options.batch, options.device))
    one, two = (ours(env, critics, options.batch, options.device) for critics in (1, 2))
    threads = torch.get_num_threads()
    contestants = {
        f"stock SB3 SAC, 2 critics, {threads} torch threads": (stock, threads),
        "stock SB3 SAC, 2 critics, 1 torch thread": (stock, 1),
        f"OneStepSAC, 1 critic, {threads} torch threads": (one, threads),
        DEFAULT: (one, 1),
        "OneStepSAC, 2 critics, 1 torch thread": (two, 1),
    }
    if options.device != "cpu":
        contestants["the default, but on the CPU"] = (ours(env, 1, options.batch, "cpu"), 1)
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
    policy = {"net_arch": NETS, "features_extractor_class": GazeFeatures, "n_critics": critics}
    return OneStepSAC(
        "MlpPolicy",
        env,
        temperature=falling_temperature(),
        replay_buffer_class=OneStepReplayBuffer,
        policy_kwargs={**policy, "optimizer_kwargs": {"fused": True}},
        **common(batch, device),
    )


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
