"""Forms of the six-motor eye's command held against each other, by the best saccades that a search finds of each.

    python scripts/command_forms.py                  # 18 saccades; half an hour on two cores
    python scripts/command_forms.py --saccades 6 --forms generators each

The same weights, saccades and effort for all: `each` has B, D and k0 of each motor (18 numbers), `pairs` and `axes`
one B and k0 for each pair of antagonists, or for the muscles that turn the eye sideways and the others (6, 4; D from
the statics), `generators` one for each direction of gaze and a trim (5). The ratio is the mean
reward over that of the first row: above 1 is worse.
"""

import json
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tyro

from orient_eye import listing, rotations
from orient_eye.commands.pulses import PULSES
from orient_eye.files import write_text
from orient_eye.movement.oblique import path_deviation
from orient_eye.plants import make_plant
from orient_eye.search.optimum import find_optimum
from orient_eye.task.actions import ActionSpace, PulseStepActions
from orient_eye.task.generator_actions import GeneratorActions
from orient_eye.task.saccade import SaccadeTask

Form = Literal["each", "pairs", "axes", "generators"]


@dataclass(frozen=True)
class Forms:
    """Search, and print a table."""

    forms: tuple[Form, ...] = ("each", "pairs", "axes", "generators")
    """Which."""
    pulses: tuple[str, ...] = ("1", "2", "3", "smooth")
    """With which pulses; the fixed C of those that have one."""
    saccades: int = 18
    """Drawn from the cone."""
    effort: float = 1.0
    """Of the search."""
    seed: int = 0
    """Of saccades and search."""
    out: Path | None = None
    """A JSON file for the rows."""


def main(options: Forms) -> None:
    """All forms with all pulses."""
    plant = make_plant("tavares", eye="six")
    task = SaccadeTask.of_case(plant, "smooth")
    start, target = task.targets.draw(options.saccades, np.random.default_rng(options.seed))
    rows: list[dict[str, Any]] = []
    first = None
    for form in options.forms:
        for pulse in options.pulses:
            told = replace(task, actions=actions(task, form, pulse))
            began = time.monotonic()
            best = find_optimum(told, start, target, np.random.default_rng(options.seed), effort=options.effort)
            first = best.reward if first is None else first
            made = told.perform(start, best.action, target)
            measures, trajectory = made.measures, told.trajectory(start, best.action, target)
            size = rotations.angle_between_directions(*(rotations.gaze(q) for q in (start.orientation, target)))
            slope, intercept = np.polyfit(size, 1e3 * measures.settling_time_s, 1)
            error = rotations.angle_between_directions(rotations.gaze(measures.at_settling), rotations.gaze(target))
            motor = trajectory.motor
            speeds = np.abs(np.diff(motor, axis=1)).max(axis=(1, 2)) / plant.step_s
            rows.append(
                {
                    "form": form,
                    "numbers": best.action.shape[1],
                    "pulse": pulse,
                    "reward": best.reward.mean(),
                    "ratio": best.reward.mean() / first.mean(),
                    "ratio_worst": float((best.reward / first).max()),
                    "ms_per_deg": slope,
                    "ms_at_0": intercept,
                    "slowest_ms": 1e3 * measures.settling_time_s.max(),
                    "error_at_settling_deg": error.mean(),
                    "path_deviation_median": float(np.median(path_deviation(trajectory, measures))),
                    "plane_sd_deg": listing.fit_plane(measures.final).sd_deg,
                    "motor_deg_s": float(np.median(speeds)),
                    "search_s": time.monotonic() - began,
                }
            )
            print(json.dumps(rows[-1]), file=sys.stderr)
    print(table(rows))
    if options.out is not None:
        write_text(options.out, json.dumps(rows, indent=1) + "\n")


def actions(task: SaccadeTask, form: Form, pulse: str) -> ActionSpace:
    """The form's actions."""
    onset = PULSES[pulse].onset
    C = None if onset is None else onset.fixed
    rates, driven = task.targets.pulse_rates, task.targets.driven
    if form == "each":
        return PulseStepActions(task.plant, driven, pulse, C, rates=rates)
    kind = "directions" if form == "generators" else form
    return GeneratorActions(task.plant, driven, pulse, C, rates=rates, generators=kind)


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(rows[0]) + " |", "|" + "---|" * len(rows[0])]
    shown = (" | ".join(f"{v:.4g}" if isinstance(v, float) else str(v) for v in row.values()) for row in rows)
    return "\n".join([*lines, *(f"| {row} |" for row in shown)])


if __name__ == "__main__":
    main(tyro.cli(Forms))
