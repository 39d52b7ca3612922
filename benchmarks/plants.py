"""Speed of the MuJoCo plant against bare mujoco.rollout: ratios within one run.

    python benchmarks/plants.py

Same model, same steps, same threads, in turn; the median of the ratios counts. The author's own Python
program made 944 steps/s (spec of the project, measured on a machine of the same class).
"""

import argparse
import os
import time

import mujoco
import mujoco.rollout
import numpy as np

from orient_eye.commands.pulse_step import PulseStep
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.rotations import FORWARD
from orient_eye.state import State

AUTHOR_STEPS_PER_S = 944


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Speed of the MuJoCo plant.")
    parser.add_argument("--saccades", type=int, default=512)
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    threads = os.cpu_count() or 1
    random = np.random.default_rng(0)
    n, steps = options.saccades, options.steps
    pulse = PulseStep(
        np.zeros((n, 3)), random.uniform(20, 80, (n, 3)), random.uniform(-15, 15, (n, 3)), np.full((n, 3), 18.0)
    )
    command = np.clip(pulse.sample(0.001, steps + 1), -80, 80)
    plant = MujocoPlant(threads=threads)
    start = State(np.tile(FORWARD, (n, 1)), command[:, 0])

    model = plant.model
    datas = [mujoco.MjData(model) for _ in range(threads)]
    state = np.zeros((n, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    state[:, 1] = 1.0  # time, then qpos: the eye looks ahead
    state[:, 5:8] = np.deg2rad(command[:, 0])
    control = np.deg2rad(command[:, 1:])
    bare = mujoco.rollout.Rollout(nthread=threads)

    ours_s, bare_s = [], []
    for _ in range(options.rounds):
        began = time.perf_counter()
        trajectory = plant.move(command, start).trajectory()
        between = time.perf_counter()
        states, _ = bare.rollout(model, datas, state, control)
        bare_s.append(time.perf_counter() - between)
        ours_s.append(between - began)
    difference = np.abs(np.abs((trajectory.orientation[:, 1:] * states[..., 1:5]).sum(axis=-1)) - 1).max()
    ratio = np.array(bare_s) / np.array(ours_s)
    total = n * steps
    print(f"{n} saccades of {steps} steps, {threads} threads, {options.rounds} rounds")
    print(f"largest difference of the orientations' quaternions: {difference:.0e}")
    print(f"bare mujoco.rollout     {total / np.median(bare_s):10.0f} steps/s")
    print(f"plant 'mujoco'          {total / np.median(ours_s):10.0f} steps/s, with tensions")
    print(f"speed, plant over bare  median {np.median(ratio):.2f}, {ratio.min():.2f} to {ratio.max():.2f}")
    times = total / np.median(ours_s) / AUTHOR_STEPS_PER_S
    print(f"plant over the author's {AUTHOR_STEPS_PER_S} steps/s: {times:.0f} times")


if __name__ == "__main__":
    main()
