"""What a sweep costs: how its wall time grows with runs and workers, and what is left of each run.

    python benchmarks/sweeps.py [--quick] [--updates 100]

Every row is an `orient-eye sweep` of short trainings on the low-pass eye, from the command to its end, on processes of
this machine and on a Ray of its own (where that is installed). The optimum is searched before. A straight line through
the rows of as many workers says what a sweep costs before its first run (a worker starts and imports meanwhile), and
what each round of runs costs, as many as there are workers; what of it is training, the run directories know. CPU time
is that of the command and of the workers that it waited for (Ray's are not its own): on a busy machine read this, and
ratios within one run of the program.
"""

import argparse
import importlib.util
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

PLAN = {("local", 1): (1, 2, 4), ("local", 2): (2, 4, 8), ("ray", 1): (1, 2, 4), ("ray", 2): (2, 4, 8)}
"""Engine and workers to numbers of runs."""


class Row(NamedTuple):
    """Of one sweep: seconds from beginning to end, of CPU time, and of the trainings in it, together."""

    engine: str
    jobs: int
    runs: int
    wall_s: float
    cpu_s: float
    train_s: float


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="What a sweep costs.")
    parser.add_argument("--quick", action="store_true", help="this machine's processes alone, of each the least two")
    parser.add_argument("--updates", type=int, default=100, help="of each training")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        first = sweep(folder, "local", 1, 1, options.updates)  # searches the optimum
        print(f"{'engine':8} {'workers':>8} {'runs':>6} {'wall [s]':>10} {'CPU [s]':>10} {'training, a run [s]':>20}")
        rows = []
        for engine, jobs, runs in planned(quick=options.quick):
            row = sweep(folder, engine, jobs, runs, options.updates)
            rows.append(row)
            cpu = f"{row.cpu_s:10.1f}" if engine == "local" else f"{'':10}"
            print(f"{engine:8} {jobs:8} {runs:6} {row.wall_s:10.1f} {cpu} {row.train_s / runs:20.1f}", flush=True)
        say_lines(rows)
        print(f"\nthe first sweep, with the search of the optimum: {first.wall_s:.1f} s")
        say_sizes(next(folder.glob("local-2-*")) / "seed0")


def planned(*, quick: bool) -> Iterator[tuple[str, int, int]]:
    """Engine, workers and runs of each row."""
    for (engine, jobs), counts in PLAN.items():
        if engine == "local" or (not quick and importlib.util.find_spec("ray")):
            for runs in counts[: 2 if quick else None]:
                yield engine, jobs, runs


def sweep(folder: Path, engine: str, jobs: int, runs: int, updates: int) -> Row:
    """Sweep in a process of its own."""
    out = Path(tempfile.mkdtemp(dir=folder, prefix=f"{engine}-{jobs}-"))
    words = f"sweep --updates {updates} --engine {engine} --jobs {jobs} --out {out} --quiet --json --seed"
    command = [sys.executable, "-m", "orient_eye", *words.split(), *map(str, range(runs))]
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=environment)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if done.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stderr}")
    results = [json.loads(file.read_text()) for file in out.glob("*/result.json")]
    assert len(results) == runs
    return Row(engine, jobs, runs, wall, cpu, sum(result["train_s"] for result in results))


def say_lines(rows: list[Row]) -> None:
    """Of as many workers each: what a sweep costs at first, and then each round of runs."""
    groups: dict[tuple[str, int], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row.engine, row.jobs].append(row)
    told = f"{'before [s]':>11} {'a round [s]':>12} {'beyond training [s]':>20} {'runs a minute':>14}"
    print(f"\n{'engine':8} {'workers':>8} {told}")
    for (engine, jobs), group in groups.items():
        rounds = [row.runs / row.jobs for row in group]
        each, before = np.polyfit(rounds, [row.wall_s for row in group], 1)
        training = sum(row.train_s for row in group) / sum(row.runs for row in group)
        print(f"{engine:8} {jobs:8} {before:11.1f} {each:12.1f} {each - training:20.1f} {60 * jobs / each:14.1f}")
    alone = [row for row in rows if row.engine == "local" and row.jobs == 1]
    each, before = np.polyfit([row.runs for row in alone], [row.cpu_s for row in alone], 1)
    print(f"CPU time of one worker on this machine: {before:.1f} s, and {each:.1f} s a run")


def say_sizes(run: Path) -> None:
    """What is in a run directory, largest first."""
    sizes = {str(file.relative_to(run)): file.stat().st_size for file in run.rglob("*") if file.is_file()}
    told = ", ".join(f"{name} {size / 1e6:.2f}" for name, size in sorted(sizes.items(), key=lambda item: -item[1])[:5])
    print(f"a run directory: {sum(sizes.values()) / 1e6:.1f} MB ({told})")


if __name__ == "__main__":
    main()
