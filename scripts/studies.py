"""What the thesis left open, with three seeds: trains what is missing, and writes models/studies.json.

    python scripts/studies.py runs/studies           # runs that are done are kept; interrupted ones go on

The studies, which `orient-eye report` draws:

- hiding: the two cases with varying C, in which the thesis' policies hid at the largest k0, with this project's reward
  scale and temperature, without them, and, with one seed, with the thesis' own preset (learning rate 1e-5, raw reward,
  automatic temperature; a batch of 1024 instead of 8196 and 20 000 updates instead of 300 000: minutes).
- amplitude: what is learned on the whole eye, whose gain and cut-off frequency depend on the amplitude.
- transfer: policies of the low-pass eye on the MuJoCo eye, as they are and after a short training there.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray

from orient_eye.files import write_text
from orient_eye.learning.evaluation import Yardstick, evaluation_saccades, told_numbers, told_values
from orient_eye.learning.figures.saccades import Saccades
from orient_eye.learning.policy import Policy
from orient_eye.plants import make_plant
from orient_eye.tables import read_table

ROOT = Path(__file__).resolve().parents[1]
RUN = "result.json"
VARYING = ("2-varying", "3-varying")
WITHOUT = ("--reward-scale", "raw", "--temperature", "auto")
THESIS = ("--preset", "thesis", "--batch-size", "1024", "--updates", "20000")
SHORT_UPDATES = 800
SIZES_DEG = np.array([1, 2, 3, 5, 7.5, 10, 15, 20, 25, 30, 35, 40, 50, 60], float)
SAME_EYE = "tavares"
"""The compiled reference, on which the whole eye is learned; MuJoCo's judges."""


@dataclass(frozen=True)
class Studies:
    """Train what is missing, and write what it came to."""

    folder: Annotated[Path, tyro.conf.Positional]
    """Where the runs go."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of the runs."""
    out: Path = ROOT / "models" / "studies.json"
    """What the report reads."""


def main(options: Studies) -> None:
    """Train, judge, write."""
    found = {
        "hiding": [
            hiding(options.folder, kind, case, seed)
            for seed in options.seeds
            for case in VARYING
            for kind in ("with", "without", *(("thesis",) if seed == options.seeds[0] else ()))
        ],
        "amplitude": [amplitude(options.folder, seed) for seed in options.seeds],
        "transfer": [transfer(options.folder, seed) for seed in options.seeds],
    }
    write_text(options.out, json.dumps(found, indent=1) + "\n")


def hiding(folder: Path, kind: str, case: str, seed: int) -> dict[str, Any]:
    """One run of a case with varying C: its course, and the k0 that it came to."""
    more = {"with": (), "without": WITHOUT, "thesis": THESIS}[kind]
    run = trained(folder / f"{kind}-{case}-seed{seed}", "--case", case, "--seed", str(seed), *more)
    course = read_table(run / "metrics.csv", "update,saccades,gap_mean").columns
    policy = Policy.load(run)
    made = Saccades.symmetric(policy.task(), policy, SIZES_DEG)
    return {
        "kind": kind,
        "case": case,
        "seed": seed,
        "saccades": course["saccades"].tolist(),
        "gap": rounded(course["gap_mean"]),
        "size_deg": made.size_deg.tolist(),
        "k0": rounded(numbers(made)["k0"]),
    }


def amplitude(folder: Path, seed: int) -> dict[str, Any]:
    """What a policy learned on the whole eye puts out for each size, and what is best."""
    policy = Policy.load(on_eye(folder, seed))
    made = Saccades.symmetric(policy.task(), policy, SIZES_DEG)
    best = Yardstick.search(made.task, made.start, made.target).optimum.action
    ours, others = numbers(made), numbers(Saccades(made.task, made.start, made.target, best))
    told = {key: rounded(ours[key]) for key in ours} | {f"{key}_best": rounded(others[key]) for key in others}
    return {"seed": seed, "size_deg": made.size_deg.tolist(), **told}


def transfer(folder: Path, seed: int) -> dict[str, Any]:
    """A policy of the low-pass eye on the MuJoCo eye, as it is and after a short training, beside one learned there."""
    simple = trained(folder / f"lpf-1-seed{seed}", "--case", "1", "--seed", str(seed))
    short = trained(
        folder / f"from-lpf-seed{seed}",
        *(
            "--plant",
            SAME_EYE,
            "--case",
            "1",
            "--seed",
            str(seed),
            "--updates",
            str(SHORT_UPDATES),
            "--from",
            str(simple),
        ),
    )
    runs = {"zero-shot": simple, "short": short, "direct": on_eye(folder, seed)}
    return {"seed": seed, **{name: judged(Policy.load(run)) for name, run in runs.items()}}


def judged(policy: Policy) -> dict[str, float]:
    """On the MuJoCo eye."""
    pairs = mujoco_pairs()
    _, outcome, gap = pairs.perform(policy.act)
    wanted = pairs.task.targets.angles_of(pairs.target)[:, 0]
    off = np.abs(pairs.task.targets.angles_of(outcome.measures.final)[:, 0] - wanted)
    took = policy.manifest["result"]
    return {
        "gap_mean": float(gap.mean()),
        "gap_p95": float(np.quantile(gap, 0.95)),
        "error_mean_deg": float(off.mean()),
        "overshoot_max": float(outcome.measures.overshoot.max()),
        "saccades": took["saccades"],
        "train_s": took["train_s"],
    }


@cache
def mujoco_pairs() -> Yardstick:
    """Random saccades on the MuJoCo eye with their searched optimum."""
    task = Policy.load("mujoco-1").task(make_plant("mujoco"))
    return evaluation_saccades(task, task.plant.evaluation_pairs)[0]


def on_eye(folder: Path, seed: int) -> Path:
    """A policy learned on the whole eye."""
    return trained(folder / f"eye-1-seed{seed}", "--plant", SAME_EYE, "--case", "1", "--seed", str(seed))


def numbers(made: Saccades) -> dict[str, NDArray[np.float64]]:
    """Numbers of the actions, positions by how far they are from the start."""
    values = told_values(made.task, made.start, made.action)
    return {
        told.key: np.abs(values[:, told.index]) if told.from_start else values[:, told.index]
        for told in told_numbers(made.task)
    }


def trained(run: Path, *options: str) -> Path:
    """The run directory of a training, made unless it is there."""
    if not (run / RUN).exists():
        told: Sequence[str] = ("--resume", str(run)) if (run / "run.json").exists() else ("--out", str(run), *options)
        print("training", run.name, file=sys.stderr)
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run([sys.executable, "-m", "orient_eye", "train", "--quiet", *told], check=True, env=environment)
    return run


def rounded(values: NDArray[np.float64]) -> list[float]:
    """Five digits, which is more than anybody sees."""
    return [float(f"{value:.5g}") for value in values]


if __name__ == "__main__":
    main(tyro.cli(Studies))
