"""Perform very many saccades on all cores, in batches, and keep their measures as Parquet.

    python examples/many_saccades.py --saccades 1000000
    python examples/many_saccades.py --saccades 100000 --plant tavares --out runs/many

Starts, targets and pulses are drawn at random, of each file from a seed of its own, so that any file can be made again
alone; the step is the one that lands on the target. A file is written whole or not at all; given again, the command
makes those that are missing. pandas, polars, DuckDB and R read the folder as one table. docs/scale.md reckons from it
what 10^9 saccades would need.
"""

import argparse
import math
import os
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from joblib import Parallel, delayed

import orient_eye as oe
from orient_eye.files import write_atomically
from orient_eye.resources import share_cores
from orient_eye.task.table import outcome_columns

BATCH = 1000  # saccades at once: docs/performance.md
FILE = 10 * BATCH  # saccades in a file


def perform(plant: str, number: int, folder: Path) -> tuple[Path, float]:
    """Perform the saccades of one file, and write what was measured of them; returns the file, and the CPU time [s]."""
    path, began = folder / f"saccades-{number:06d}.parquet", time.process_time()
    if path.exists():
        return path, 0.0
    share_cores(1)  # one batch a core: threads inside it would only wait for each other
    task = oe.SaccadeTask.of_case(oe.make_plant(plant), "1")
    random, tables = np.random.default_rng([2026, number]), []
    for _ in range(FILE // BATCH):
        start, target = oe.saccades(task.targets, *random.uniform(-30, 30, (2, BATCH, 1)))
        drawn, likely = random.uniform(-1, 1, (BATCH, len(task.actions.numbers))), task.actions.likely(target)
        action = np.where(np.isnan(likely), task.actions.from_unit(drawn), likely)
        outcome = task.perform(start, action, target)
        tables.append(pa.table(outcome_columns(task, start, target, action, outcome)))
    write_atomically(path, lambda temporary: pq.write_table(pa.concat_tables(tables), temporary))
    return path, time.process_time() - began


def main() -> None:
    """Perform, and print what it took."""
    parser = argparse.ArgumentParser(description="Very many saccades on all cores.")
    parser.add_argument("--saccades", type=int, default=100_000, help=f"rounded up to whole files of {FILE}")
    parser.add_argument("--plant", default="lpf")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    parser.add_argument("--out", type=Path, default=Path("runs/many-saccades"), help="folder of the files")
    given = parser.parse_args()
    folder = given.out / given.plant
    folder.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    work = (delayed(perform)(given.plant, k, folder) for k in range(math.ceil(given.saccades / FILE)))
    files, cpu = zip(*Parallel(n_jobs=given.jobs, batch_size=1)(work), strict=True)
    took, size = time.perf_counter() - began, sum(file.stat().st_size for file in files)
    rows = sum(pq.read_metadata(file).num_rows for file in files)
    each = f"{1e6 * sum(cpu) / rows:.1f} us of CPU time and {size / rows:.0f} bytes a saccade"
    print(f"{rows} saccades on {given.plant}, {given.jobs} processes: {took:.1f} s, {each}")


if __name__ == "__main__":
    main()
