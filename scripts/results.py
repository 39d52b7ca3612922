"""The tables of README.md and docs/learning.md, from a sweep: five cases on the surrogate, one on the eye.

    orient-eye sweep scripts/results.toml --out runs/results          # runs that are done are kept
    python scripts/results.py runs/results

What is learned on `tavares` is judged on `mujoco`. With --write the tables go into the documents, and with --ship the
best run of each case into models/policies. The searched optimum and the card travel with a shipped policy; --optimum
fills in what is missing or no longer true, and --cards writes the cards anew.
"""

import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from orient_eye.files import read_json, write_text
from orient_eye.learning.card import write_card
from orient_eye.learning.evaluation import carry_optimum, evaluation_saccades
from orient_eye.learning.policy import Policy, shipped_policies
from orient_eye.report.evidence import COURSE
from orient_eye.search.optimum_file import NAME

JUDGED = "on-mujoco"
ROOT = Path(__file__).resolve().parents[1]
BEGIN, END = "<!-- scripts/results.py -->", "<!-- end -->"


@dataclass(frozen=True)
class Results:
    """Print the tables of a sweep."""

    folder: Annotated[Path, tyro.conf.Positional] = Path("runs/results")
    """Folder of the sweep."""
    write: bool = False
    """Put the tables into README.md and docs/learning.md."""
    ship: bool = False
    """Copy the best run of each case into models/policies."""
    optimum: bool = False
    """Read no sweep: put the searched optimum beside every shipped policy."""
    cards: bool = False
    """Read no sweep: write the card of every shipped policy."""


def main(options: Results) -> None:
    """Judge what is not judged, then print."""
    if options.optimum or options.cards:
        for name, folder in shipped_policies().items():
            if options.optimum:
                print(f"models/policies/{name}: {carry(folder)}", file=sys.stderr)
            if options.cards:
                print(write_card(Policy.load(folder), folder, shipped=True).relative_to(ROOT), file=sys.stderr)
        return
    judge(options.folder)
    tables = {"README.md": short_table(options.folder), "docs/learning.md": table(options.folder)}
    for name, text in tables.items():
        print(f"{name}:\n\n{text}\n")
        if options.write:
            write(ROOT / name, text)
    if options.ship:
        ship(options.folder)


def judge(folder: Path) -> None:
    """Hold what was learned on tavares against the optimum on mujoco, the same eye, which has the last word."""
    for run in done(folder):
        if run["plant"] == "tavares" and not (run["folder"] / JUDGED / "result.json").exists():
            out = run["folder"] / JUDGED
            shutil.rmtree(out, ignore_errors=True)
            judged = [str(run["folder"]), "--plant", "mujoco", "--force", "--quiet", "--out", str(out)]
            subprocess.run([sys.executable, "-m", "orient_eye", "evaluate", *judged], check=True)


def done(folder: Path) -> list[dict[str, Any]]:
    """Folder, plant, case and seed of each run of the sweep that is done."""
    runs = read_json(folder / "sweep.json", hint="name the folder of a sweep")["runs"]
    usual = {"plant": "lpf", "case": "1", "seed": 0}
    found = [
        {"folder": folder / name, **{key: told.get(key, usual[key]) for key in usual}} for name, told in runs.items()
    ]
    return [run for run in found if (run["folder"] / "result.json").exists()]


def results(folder: Path) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """The results of all runs, by plant and case, by seed."""
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for run in done(folder):
        result = read_json(run["folder"] / "result.json", hint="")
        judged = run["folder"] / JUDGED / "result.json"
        if judged.exists():
            judgement = read_json(judged, hint="")
            result |= {key: judgement[key] for key in ("gap_mean", "gap_p95", "table")}
        found.setdefault((run["plant"], run["case"]), []).append({**result, **run})
    return {key: sorted(found[key], key=lambda run: run["seed"]) for key in sorted(found)}


def table(folder: Path) -> str:
    """The results as a Markdown table: one row a case, the seeds beside one another."""
    lines = [
        "| plant | case | mean gap % | 95th percentile % | B at 30 deg | D - F | k0 | best found |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for (plant, case), runs in results(folder).items():
        rows = [next(row for row in run["table"] if row["amplitude_deg"] == 30) for run in runs]

        def by_seed(values: list[float], digits: int) -> str:
            return ", ".join(f"{value:.{digits}f}" for value in values)

        best = rows[0]
        lines.append(
            f"| {plant} | {case} | {by_seed([100 * r['gap_mean'] for r in runs], 2)} | "
            f"{by_seed([100 * r['gap_p95'] for r in runs], 2)} | {by_seed([r['B'] for r in rows], 2)} | "
            f"{by_seed([r['step_deg'] for r in rows], 3)} | {by_seed([r['k0'] for r in rows], 2)} | "
            f"{best['B_best']:.2f}, {best['step_deg_best']:.3f}, {best['k0_best']:.2f} |"
        )
    return "\n".join(lines)


def short_table(folder: Path) -> str:
    """Gaps alone."""
    lines = ["| plant | case | mean gap, each seed | 95th percentile |", "|---|---|---|---|"]
    for (plant, case), runs in results(folder).items():
        mean, high = (", ".join(f"{100 * run[key]:.2f} %" for run in runs) for key in ("gap_mean", "gap_p95"))
        lines.append(f"| {plant} | {case} | {mean} | {high} |")
    return "\n".join(lines)


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
        write_card(policy, goal, shipped=True)
        print(f"models/policies/{plant}-{case}: from {best.name}", file=sys.stderr)


def carry(folder: Path) -> Path:
    """Put the optimum of a policy's evaluation saccades beside it, searched unless the right one is there."""
    policy = Policy.load(folder)
    pairs, table = evaluation_saccades(policy.task(), policy.manifest["result"]["pairs"], carried=folder / NAME)
    return carry_optimum(pairs, table, folder)


if __name__ == "__main__":
    main(tyro.cli(Results))
