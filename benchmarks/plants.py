"""Speed of the elastic plants: ratios within one run.

    python benchmarks/plants.py

Plant `mujoco` against bare mujoco.rollout, the compiled plant `tavares` against plant `mujoco`, and the surrogate
`viscous` against `tavares`: same eye, same commands, same threads, tensions recorded (`viscous` has none), in turn; the
median of the ratios counts. `run` steps the batch and records it; `move` also looks at the command before and makes a
trajectory after. Then how long making plant `tavares` takes in a fresh process, with what was compiled before and
without. The author's own Python program made 944 steps/s (spec of the project, measured on a machine of the same
class).
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np

from orient_eye.commands.pulse_step import PulseStep
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.plants.viscous import ViscousPlant
from orient_eye.rotations import FORWARD, angle_between
from orient_eye.state import State

AUTHOR_STEPS_PER_S = 944
MAKE = """
import time
from orient_eye.plants.tavares import TavaresPlant
began = time.perf_counter(), time.process_time()
TavaresPlant()
print(time.perf_counter() - began[0], time.process_time() - began[1])
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Speed of the elastic plants.")
    parser.add_argument("--saccades", type=int, default=512)
    parser.add_argument("--steps", type=int, default=500)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    threads = options.threads
    random = np.random.default_rng(0)
    n, steps = options.saccades, options.steps
    pulse = PulseStep(
        np.zeros((n, 3)), random.uniform(20, 80, (n, 3)), random.uniform(-15, 15, (n, 3)), np.full((n, 3), 18.0)
    )
    command = np.clip(pulse.sample(0.001, steps + 1), -80, 80)
    start = State(np.tile(FORWARD, (n, 1)), command[:, 0])
    batch, kernel = MujocoPlant(threads=threads), TavaresPlant(threads=threads)
    viscous = ViscousPlant(threads=threads)
    accurate = MujocoPlant(threads=threads, accurate=True), TavaresPlant(threads=threads, accurate=True)

    model = batch.model
    datas = [mujoco.MjData(model) for _ in range(threads)]
    state = np.zeros((n, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    state[:, 1] = 1.0  # time, then qpos: the eye looks ahead
    state[:, 5:8] = np.deg2rad(command[:, 0])
    control = np.deg2rad(command[:, 1:])
    bare = mujoco.rollout.Rollout(nthread=threads)

    work: dict[str, Callable[[], Any]] = {
        "bare mujoco.rollout": lambda: bare.rollout(model, datas, state, control),
        "mujoco: move": lambda: batch.move(command, start).trajectory(),
        "mujoco: run": lambda: batch.run(command, start),
        "tavares: move": lambda: kernel.move(command, start).trajectory(),
        "tavares: run": lambda: kernel.run(command, start),
        "mujoco, accurate: run": lambda: accurate[0].run(command, start),
        "tavares, accurate: run": lambda: accurate[1].run(command, start),
        "viscous: run": lambda: viscous.run(command, start),
    }
    seconds: dict[str, list[float]] = {name: [] for name in work}
    made = {}
    for _ in range(options.rounds):
        for name, do in work.items():
            began = time.perf_counter()
            made[name] = do()
            seconds[name].append(time.perf_counter() - began)
    print(f"{n} saccades of {steps} steps, {threads} threads, {options.rounds} rounds; plants with tensions")
    for name, each in seconds.items():
        print(f"{name:24} {n * steps / np.median(each):10.0f} steps/s")
    for fast, slow in (
        ("mujoco: move", "bare mujoco.rollout"),
        ("tavares: run", "mujoco: run"),
        ("tavares: move", "mujoco: move"),
        ("tavares, accurate: run", "mujoco, accurate: run"),
        ("viscous: run", "tavares: run"),
    ):
        ratio = np.array(seconds[slow]) / np.array(seconds[fast])
        print(f"{fast} over {slow}: median {np.median(ratio):.2f}, {ratio.min():.2f} to {ratio.max():.2f}")
    times = n * steps / np.median(seconds["mujoco: move"]) / AUTHOR_STEPS_PER_S
    print(f"mujoco: move over the author's {AUTHOR_STEPS_PER_S} steps/s: {times:.0f} times")
    by_batch, by_kernel = made["mujoco: run"][0], made["tavares: run"][0]
    apart = angle_between(by_batch[:, 1:], made["bare mujoco.rollout"][0][..., 1:5]).max()
    print(f"largest angle between plant 'mujoco' and bare: {apart:.0e} deg")
    apart = angle_between(by_batch, by_kernel).max()
    print(f"largest angle between plants 'mujoco' and 'tavares': {apart:.0e} deg")
    with tempfile.TemporaryDirectory() as folder:
        for what in ("compiled", "from the cache"):
            environment = os.environ | {"NUMBA_CACHE_DIR": folder}
            done = subprocess.run([sys.executable, "-c", MAKE], env=environment, capture_output=True, check=True)
            wall, cpu = map(float, done.stdout.split())
            print(
                f"making the first plant 'tavares', {what}: {wall:.1f} s ({cpu:.1f} s of CPU), Numba's import included"
            )


if __name__ == "__main__":
    main()
