"""An algorithm of Stable-Baselines3, as it comes, learns saccades on the low-pass eye in about a minute.

    python examples/stock_sb3.py
    python examples/stock_sb3.py --steps 500

Prints the mean reward of the same saccades before and after, and the mean k0, which is about 17.5 1/s of the best
actions: far above, the policy hides from the cliff of the reward. What `orient-eye train` does better, and how much, is
in docs/learning.md.
"""

import argparse

import gymnasium
import numpy as np
import torch
from stable_baselines3 import SAC

import orient_eye  # noqa: F401  (registers the environment)


def main(steps: int = 3000, judged: int = 200) -> tuple[float, float]:
    """Train, and print.

    Args:
        steps: saccades to learn from.
        judged: saccades by which the policy is judged, always the same.

    Returns:
        The mean log reward before and after.
    """
    torch.set_num_threads(1)  # these networks are too small to share
    env = gymnasium.make("OrientEye/Saccade-v0", plant="lpf", log_reward=True)
    model = SAC(
        "MlpPolicy",
        env,
        learning_rate=3e-3,
        batch_size=256,
        learning_starts=min(200, steps // 2),
        policy_kwargs={"net_arch": [64, 64]},
        seed=0,
        device="cpu",
    )
    before, k0 = means(model, env, judged)
    print(f"before: mean log reward {before:.3f} over {judged} saccades, k0 {k0:.1f} 1/s")
    model.learn(steps)
    after, k0 = means(model, env, judged)
    print(f"after {steps} saccades: {after:.3f}, k0 {k0:.1f} 1/s; one more is a cost ten times smaller")
    return before, after


def means(model: SAC, env: gymnasium.Env, judged: int) -> tuple[float, float]:
    """Mean reward and k0 [1/s] of the policy's best guess, without exploration."""
    rewards, k0s = [], []
    for seed in range(judged):
        observation, _ = env.reset(seed=seed)
        action, _ = model.predict(observation, deterministic=True)
        _, reward, _, _, info = env.step(action)
        rewards.append(float(reward))
        k0s.append(info["k0"])
    return float(np.mean(rewards)), float(np.mean(k0s))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Stock SB3 on OrientEye/Saccade-v0.")
    parser.add_argument("--steps", type=int, default=3000, help="saccades to learn from")
    main(parser.parse_args().steps)
