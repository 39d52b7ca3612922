"""Saccades in all directions: train three seeds on the compiled eye, and judge them on MuJoCo.

    python scripts/gaze_results.py runs/gaze                # what is done is kept
    python scripts/gaze_results.py runs/gaze --parts learn judge --seeds 0
    python scripts/gaze_results.py runs/six --eye six --case smooth --parts learn judge    # of the six-motor eye

Parts: `learn` (orient-eye train --plant tavares --targets gaze), `judge` (100 saccades from within 20 deg of straight
ahead to within 30 deg, or 25 deg with six motors, on MuJoCo, beside the optimum searched over the whole box of actions,
and a sequence of 200), `surrogates` (policies learned on the linear and on the inertia-free eye, carried over as they
are, but for the usual command, which is the eye's own, and after fine-tuning), `fick` (policies that begin at the
torsion of Fick's gimbal, on both presets, with and without the weight of the force).
Every part prints its table; `result.json` in the folder has the numbers.
"""

import json
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from orient_eye.files import write_text
from orient_eye.learning.card import write_card
from orient_eye.learning.evaluation import (
    Yardstick,
    amplitude_table,
    carry_optimum,
    evaluation_saccades,
    gap_summary,
)
from orient_eye.learning.judged import measure_policy
from orient_eye.learning.policy import Policy
from orient_eye.learning.sequences import drawn, ficks_starts, listing_numbers, sequence, stretching
from orient_eye.plants import make_plant
from orient_eye.progress import progress_bar
from orient_eye.statics import cables_of
from orient_eye.task.gaze_targets import GazeTargets
from orient_eye.task.saccade import SaccadeTask

Part = Literal["learn", "judge", "surrogates", "fick"]
ROOT = Path(__file__).resolve().parents[1]
START_DEG, PAIRS, SACCADES, SEED = 20.0, 100, 200, 7
FICK_WEIGHTS = {"force": 3e5, "no force": 0.0}


@dataclass(frozen=True)
class Results:
    """Train, judge and print."""

    folder: Annotated[Path, tyro.conf.Positional]
    """Where the runs go; those already there are not run again."""
    parts: tuple[Part, ...] = ("learn", "judge", "surrogates", "fick")
    """What is done."""
    eye: str = "thesis"
    """Of `learn` and `judge`."""
    case: str = "1"
    """The same."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Of the runs on the compiled eye."""
    updates: int | None = None
    """Of every run; the usual number unless given."""
    pairs: int = PAIRS
    """Saccades on which policies are judged."""
    ship: bool = False
    """Copy the best policy of the compiled eye, and of the thesis' eye also that of the linear one, into
    models/policies."""


def main(options: Results) -> None:
    """Do the parts in their order."""
    for part in options.parts:
        found = {"learn": learn, "judge": judge, "surrogates": surrogates, "fick": fick}[part](options)
        path = options.folder / "result.json"
        before = json.loads(path.read_text()) if path.exists() else {}
        write_text(path, json.dumps({**before, part: found}, indent=1) + "\n")
    if options.ship:
        ship(options)


def ship(options: Results) -> None:
    """Policies with the optimum of their evaluation saccades."""
    seeds = [options.folder / f"tavares-gaze-seed{seed}" for seed in options.seeds]
    best = min(seeds, key=lambda run: json.loads((run / "result.json").read_text())["gap_mean"])
    runs = {"tavares-gaze": best, "modal-gaze": options.folder / "modal-gaze"}
    for name, run in (runs if options.eye == "thesis" else {f"{options.eye}-gaze": best}).items():
        policy = Policy.load(run)
        searched = evaluation_saccades(policy.task(), policy.manifest["result"]["pairs"])  # as the search is today
        pairs, rows = (each.bettered(policy.act) for each in searched)
        found = {**gap_summary(pairs, *pairs.perform(policy.act)), "table": amplitude_table(rows, policy.act)}
        told = {**policy.manifest, "result": {**policy.manifest["result"], **found}}
        policy = replace(policy, manifest=told)
        goal = policy.save(ROOT / "models" / "policies" / name).parent
        carry_optimum(pairs, rows, goal)
        write_card(policy, goal, shipped=True)
        shutil.copy(run / "metrics.csv", goal)
        print(f"{goal}: from {run.name}, gap {found['gap_mean']:.4f}", file=sys.stderr)


def train(options: Results, name: str, *told: str) -> Path:
    """One training run, gone on with if it was interrupted; returns its folder."""
    out = options.folder / name
    if (out / "result.json").exists():
        return out
    resumed = (out / "run.json").exists()
    updates = [] if options.updates is None else ["--updates", str(options.updates)]
    given = ["--resume", str(out)] if resumed else [*told, *updates, "--out", str(out)]
    print("training", name, file=sys.stderr)
    began = time.monotonic()
    command = [sys.executable, "-m", "orient_eye", "train", "--quiet", *given]
    done = subprocess.run(command, check=False, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)} ended with code {done.returncode}:\n{done.stderr}")
    write_text(out / "seconds.json", json.dumps(None if resumed else round(time.monotonic() - began, 1)))
    return out


def learn(options: Results) -> list[dict[str, Any]]:
    """Policies of the compiled eye."""
    rows = []
    for seed in options.seeds:
        told = ("--plant", "tavares", "--eye", options.eye, "--targets", "gaze", "--case", options.case)
        out = train(options, f"tavares-gaze-seed{seed}", *told, "--seed", str(seed))
        result = json.loads((out / "result.json").read_text())
        seconds = json.loads((out / "seconds.json").read_text())
        rows.append({"seed": seed, "train_s": result["train_s"], "command_s": seconds, **gaps(result)})
    print(table(rows, "| seed | training [s] | command [s] | mean gap | 95th percentile |"))
    return rows


def judge(options: Results) -> list[dict[str, Any]]:
    """The same on MuJoCo."""
    rows = []
    for seed in options.seeds:
        policy = Policy.load(options.folder / f"tavares-gaze-seed{seed}")
        plant = make_plant("mujoco", eye=options.eye)
        numbers = judged(policy, options.pairs, options.eye, options.case)
        rows.append({"seed": seed, **numbers, **in_sequence(policy, policy.task(plant))})
        print(json.dumps(rows[-1], indent=1))
    return rows


def judged(policy: Policy, pairs: int, eye: str = "thesis", case: str = "1") -> dict[str, Any]:
    """A policy on MuJoCo, beside the best actions of the eye's own task."""
    own = SaccadeTask.of_case(make_plant("mujoco", eye=eye), case, targets="gaze")
    near = GazeTargets(own.plant, limit_deg=START_DEG)
    random = np.random.default_rng(SEED)
    start, target = near.draw(pairs, random)[0], own.targets.draw(pairs, random)[1]
    with progress_bar("searching the optimum", quiet=False) as advance:
        best = Yardstick.search(own, start, target, advance)
    mine = replace(own, actions=policy.task(own.plant).actions)
    yardstick = Yardstick(mine, start, target, best.optimum)
    numbers, _ = measure_policy(policy, yardstick, yardstick[:6])
    told = {name: value for name, value in numbers.items() if name not in ("numbers", "table")}
    cables = cables_of(own.plant)
    if cables is not None:
        _, made, _ = yardstick.perform(policy.act)
        held = cables.state(made.measures.final, made.command.final).good
        told["ends_slack_or_unstable"] = int((~held).sum())
    return told


def in_sequence(policy: Policy, task: SaccadeTask, sequences: int = 1, *, from_fick: bool = False) -> dict[str, Any]:
    """Two hundred saccades one after the other."""
    random = np.random.default_rng(SEED)
    start, target = drawn(task, sequences, SACCADES, random)
    if from_fick:
        start = ficks_starts(task, sequences, random)
    made = sequence(task, policy.act, target, start)
    return {"sequence": listing_numbers(made), "stretching": stretching(made, policy.act)}


def surrogates(options: Results) -> list[dict[str, Any]]:
    """Policies of surrogates on MuJoCo, without and with a short fine-tuning on the compiled eye."""
    rows = []
    for plant in ("modal", "viscous"):
        out = train(options, f"{plant}-gaze", "--plant", plant, "--targets", "gaze")
        tuned = train(options, f"{plant}-gaze-tuned", "--plant", "tavares", "--targets", "gaze", "--from", str(out))
        for name, run in (("as it is", out), ("tuned", tuned)):
            result = json.loads((run / "result.json").read_text())
            told = judged(Policy.load(run), options.pairs)
            error = told["gaze_error_mean_deg"]
            rows.append(
                {"plant": plant, "policy": name, "train_s": result["train_s"], **gaps(told), "error_deg": error}
            )
    print(
        table(rows, "| learned on | carried over | training [s] | mean gap | 95th percentile | end-point error [deg] |")
    )
    return rows


def fick(options: Results) -> list[dict[str, Any]]:
    """Policies whose usual command holds Fick's torsion: what becomes of it."""
    rows = []
    for eye in ("thesis", "eve_v3"):
        for name, weight in FICK_WEIGHTS.items():
            weights = ["4.08e7", "1", "5.53e5", "5e6", str(weight)]
            told = ("--plant", "tavares", "--eye", eye, "--targets", "gaze", "--torsion", "fick", "--weights", *weights)
            out = train(options, f"fick-{eye}-{name.replace(' ', '-')}", *told, "--evaluation-pairs", "2")
            policy = Policy.load(out)
            task = policy.task(make_plant("mujoco", eye=eye))
            for where in (False, True):
                made = in_sequence(policy, task, from_fick=where)["sequence"]
                rows.append(
                    {
                        "eye": eye,
                        "reward": name,
                        "starts": "Fick" if where else "ahead",
                        "usual_sd": made["usual"]["sd_deg"],
                        "usual_twist": made["usual"]["twist"],
                        "sd_deg": made["ends"]["sd_deg"],
                        "twist": made["ends"]["twist"],
                        "on_the_way_sd_deg": made["on_the_way"]["sd_deg"],
                    }
                )
    print(table(rows, "| eye | reward | starts | usual sd | usual twist | sd of ends | twist | sd on the way |"))
    return rows


def gaps(result: dict[str, Any]) -> dict[str, float]:
    """Of a result."""
    return {"gap_mean": result["gap_mean"], "gap_p95": result["gap_p95"]}


def table(rows: list[dict[str, Any]], heading: str) -> str:
    """Markdown."""
    lines = [heading, "|" + "---|" * (heading.count("|") - 1)]
    lines += [
        "| " + " | ".join(f"{v:.4g}" if isinstance(v, float) else str(v) for v in row.values()) + " |" for row in rows
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main(tyro.cli(Results))
