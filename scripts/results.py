"""Train the thesis' five cases on the surrogate and variant 1 on the whole eye, three seeds each.

    python scripts/results.py runs/results                  # runs that are done are kept
    python scripts/results.py runs/results --plants lpf --cases 1 --seeds 0

Every run is `orient-eye train` with its defaults, from an empty cache; what is learned on `tavares` is judged on
`mujoco`. Prints the tables of README.md and docs/learning.md; with --write puts them there, and with --ship the best
run of each case into models/policies. The searched optimum travels with a shipped policy; --optimum fills in what is
missing or no longer true.
"""

import concurrent.futures
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from orient_eye.files import write_text
from orient_eye.learning.evaluation import carry_optimum, evaluation_saccades
from orient_eye.learning.policy import Policy, shipped_policies
from orient_eye.report.evidence import COURSE
from orient_eye.search.optimum_file import NAME

ROOT = Path(__file__).resolve().parents[1]
SECONDS = "seconds.json"
"""In a run: how long its command took from an empty cache; null where it was resumed."""
BEGIN, END = "<!-- scripts/results.py -->", "<!-- end -->"


@dataclass(frozen=True)
class Results:
    """Train all cases and print the table."""

    folder: Annotated[Path, tyro.conf.Positional]
    """Where the runs go; those already there are not run again."""
    plants: tuple[str, ...] = ("lpf", "tavares", "mujoco")
    """Plants: lpf learns all five cases, the whole eye variant 1."""
    cases: tuple[str, ...] = ("1", "2-fixed", "2-varying", "3-fixed", "3-varying")
    """Cases that are learned on lpf."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of the runs."""
    parallel: int = 2
    """Runs on lpf at a time, one core each."""
    write: bool = False
    """Put the tables into README.md and docs/learning.md."""
    ship: bool = False
    """Copy the best run of each case into models/policies."""
    optimum: bool = False
    """Train nothing: put the searched optimum beside every shipped policy."""


def main(options: Results) -> None:
    """Run what is missing, then print."""
    if options.optimum:
        for name, folder in shipped_policies().items():
            print(f"models/policies/{name}: {carry(folder)}", file=sys.stderr)
        return
    jobs = [("lpf", case, seed) for seed in options.seeds for case in options.cases if "lpf" in options.plants]
    with concurrent.futures.ThreadPoolExecutor(options.parallel) as pool:
        list(pool.map(lambda job: run(options.folder, *job), jobs))
    for plant in ("tavares", "mujoco"):  # one at a time: these use all cores
        for seed in options.seeds if plant in options.plants else ():
            run(options.folder, plant, "1", seed)
    tables = {"README.md": short_table(options.folder), "docs/learning.md": table(options.folder)}
    for name, text in tables.items():
        print(f"{name}:\n\n{text}\n")
        if options.write:
            write(ROOT / name, text)
    if options.ship:
        ship(options.folder)


def run(folder: Path, plant: str, case: str, seed: int) -> None:
    """One training run, gone on with if it was interrupted."""
    out = folder / f"{plant}-{case}-seed{seed}"
    if (out / SECONDS).exists():
        return
    command = [sys.executable, "-m", "orient_eye"]
    resumed = (out / "run.json").exists()
    told = ["--plant", plant, "--case", case, "--seed", str(seed), "--out", str(out)]
    print("training", out.name, file=sys.stderr)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as cache:  # an empty one, as a newcomer has
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "XDG_CACHE_HOME": cache}
        perform([*command, "train", "--quiet", *(["--resume", str(out)] if resumed else told)], environment)
        seconds = None if resumed else round(time.monotonic() - began, 1)
        if plant == "tavares":  # the same eye, which has the last word
            judged = [str(out), "--plant", "mujoco", "--force", "--quiet", "--out", str(out / "on-mujoco")]
            perform([*command, "evaluate", *judged], environment)
    write_text(out / SECONDS, json.dumps(seconds))


def perform(command: list[str], environment: dict[str, str]) -> None:
    """A command that must succeed."""
    done = subprocess.run(command, check=False, env=environment, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)} ended with code {done.returncode}:\n{done.stderr}")


def results(folder: Path) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """The results of all runs, by plant and case, by seed."""
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for path in folder.glob("*-seed*/result.json"):
        plant, rest = path.parent.name.split("-", 1)
        case, seed = rest.rsplit("-seed", 1)
        result = json.loads(path.read_text(encoding="utf-8"))
        judged = path.parent / "on-mujoco" / "result.json"
        if judged.exists():
            judgement = json.loads(judged.read_text(encoding="utf-8"))
            result |= {key: judgement[key] for key in ("gap_mean", "gap_p95", "table")}
        seconds = json.loads((path.parent / SECONDS).read_text(encoding="utf-8"))
        found.setdefault((plant, case), []).append(
            {**result, "seed": int(seed), "folder": path.parent, "seconds": seconds}
        )
    return {key: sorted(found[key], key=lambda run: run["seed"]) for key in sorted(found)}


def table(folder: Path) -> str:
    """The results as a Markdown table: one row a case, the seeds beside one another."""
    lines = [
        "| plant | case | seconds | mean gap % | 95th percentile % | B at 30 deg | D - F | k0 | best found |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for (plant, case), runs in results(folder).items():
        rows = [next(row for row in run["table"] if row["amplitude_deg"] == 30) for run in runs]

        def by_seed(values: list[float], digits: int) -> str:
            return ", ".join(f"{value:.{digits}f}" for value in values)

        best = rows[0]
        lines.append(
            f"| {plant} | {case} | {told_seconds(runs)} | {by_seed([100 * r['gap_mean'] for r in runs], 2)} | "
            f"{by_seed([100 * r['gap_p95'] for r in runs], 2)} | {by_seed([r['B'] for r in rows], 2)} | "
            f"{by_seed([r['step_deg'] for r in rows], 3)} | {by_seed([r['k0'] for r in rows], 2)} | "
            f"{best['B_best']:.2f}, {best['step_deg_best']:.3f}, {best['k0_best']:.2f} |"
        )
    return "\n".join(lines)


def short_table(folder: Path) -> str:
    """Gaps alone."""
    lines = ["| plant | case | mean gap, each seed | 95th percentile | seconds |", "|---|---|---|---|---|"]
    for (plant, case), runs in results(folder).items():
        mean, high = (", ".join(f"{100 * run[key]:.2f} %" for run in runs) for key in ("gap_mean", "gap_p95"))
        lines.append(f"| {plant} | {case} | {mean} | {high} | {told_seconds(runs)} |")
    return "\n".join(lines)


def told_seconds(runs: list[dict[str, Any]]) -> str:
    """How long the commands took."""
    return ", ".join("resumed" if run["seconds"] is None else f"{run['seconds']:.0f}" for run in runs)


def write(path: Path, text: str) -> None:
    """Put a table in place of the one between the marks of a Markdown file."""
    before, rest = path.read_text(encoding="utf-8").split(BEGIN)
    write_text(path, f"{before}{BEGIN}\n{text}\n{END}{rest.split(END, 1)[1]}")


def ship(folder: Path) -> None:
    """Write the policy with the smallest mean gap of each case into models/policies."""
    for (plant, case), runs in results(folder).items():
        best = runs[int(np.argmin([run["gap_mean"] for run in runs]))]["folder"]
        if plant == "tavares":  # the same eye as mujoco's, whose policy is shipped
            continue
        policy = Policy.load(best)
        goal = policy.save(ROOT / "models" / "policies" / f"{plant}-{case}").parent
        for name in (NAME, COURSE):
            shutil.copy(best / name, goal / name)
        carry(goal)
        print(f"models/policies/{plant}-{case}: from {best.name}", file=sys.stderr)


def carry(folder: Path) -> Path:
    """Put the optimum of a policy's evaluation saccades beside it, searched unless the right one is there."""
    policy = Policy.load(folder)
    pairs, table = evaluation_saccades(policy.task(), policy.manifest["result"]["pairs"], carried=folder / NAME)
    return carry_optimum(pairs, table, folder)


if __name__ == "__main__":
    main(tyro.cli(Results))
