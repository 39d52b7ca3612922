"""orient-eye optimum."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.cli.problem import Problem
from orient_eye.cli.saccades import Saccades, refuse_no_saccade

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from orient_eye.search.optimum import Optimum as Found
    from orient_eye.state import State
    from orient_eye.task.saccade import SaccadeTask

    Array = NDArray[np.float64]


@dataclass(frozen=True)
class Optimum:
    """Search the best action for a saccade: B, D and k0 with the largest reward, on any plant.

    Simplices from the best of a sample over the whole box of actions; of several motors' numbers, evolution strategies.
    What was found is kept in the user's cache and remembered when the same saccades are asked for again. --check
    searches once more by another program and exits with 1 when that finds something better by more than 0.1 % (0.5 %
    where several motors are driven).

    $ orient-eye optimum --start 0 --target 30

    $ orient-eye optimum --plant tavares --targets gaze --start 0 0 --target 20 -10

    $ orient-eye optimum --plant mujoco --case 2-varying --start -10 --target 15 --check

    $ orient-eye optimum --pairs pairs.csv --out best.csv
    """

    saccades: Saccades = field(default_factory=Saccades)
    problem: Problem = field(default_factory=Problem)
    case: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(default: 1)")] = None
    """Learning case: the pulse of the motor command, and how its onset rate C is chosen."""
    weights: Annotated[
        tuple[float, ...] | None,
        tyro.conf.arg(metavar="WEIGHT ...", help_behavior_hint="(default: those of the case on the plant)"),
    ] = None
    """Weights of the reward: accuracy, energy, duration, overshoot (thesis 4.32; orient-eye weights), and of gaze
    targets force."""
    check: bool = False
    """Search a second time, independently: scipy's differential evolution, polished by Nelder and Mead's simplex."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """CSV file to write: the result, one row a saccade."""
    quiet: bool = False
    """Show no progress bar."""

    def run(self) -> dict[str, Any]:
        """Search, or remember, and print the table."""
        from orient_eye.cli.places import check_outputs
        from orient_eye.cli.tables import column, saccade_columns, say, say_limits, table
        from orient_eye.task.table import outcome_rows, with_peaks
        from orient_eye.task.targets import saccades

        check_outputs({"--out": self.out}, {"--pairs": self.saccades.pairs})
        case = self.problem.case(self.case)
        plant, targets = self.problem.made()
        start, target = saccades(targets, *self.saccades.angles(targets, moving=True))
        refuse_no_saccade(start, target)
        own = self.problem.task(plant, targets, case, self.weights)
        best, remembered = self._search(own, start, target)
        task = own.plain
        outcome = task.perform(start, best.action, target)
        rows = with_peaks(task, outcome, outcome_rows(task, start, target, best.action, outcome))
        result: dict[str, Any] = {
            "task": task.identity(),
            "weights_from": task.weights_from,
            "remembered": remembered,
            "evaluations": best.evaluations,
        }
        if self.check:
            result |= self._second_search(task, start, target, rows)
        if self.weights is None:
            say(f"weights of the reward: {task.weights_from}")
        what = "remembered from an earlier search" if remembered else f"searched with {best.evaluations} saccades"
        columns = saccade_columns(task, rows[0], terms=True)
        if self.check:
            columns["second search"] = column("check_gain", "+.4f", " %", 100)
        named = f"case {case}" if isinstance(case, str) else f"pulse {case.pulse}"
        say(table(f"The best saccades on plant {plant.name}, {named}, with the weighted terms: {what}.", columns, rows))
        say_limits(task, rows)
        if self.check:
            say(
                f"second search: better by at most {100 * result['check_largest_gain']:.2g} %, worse by at most "
                f"{100 * result['check_largest_loss']:.2g} %"
            )
        if self.out:
            from orient_eye.files import write_table

            write_table(self.out, rows)
            say(f"in {self.out}")
        return {**result, "out": str(self.out) if self.out else None, "saccades": rows}

    def _search(self, task: "SaccadeTask", start: "State", target: "Array") -> "tuple[Found, bool]":
        """The optimum, and whether it was remembered."""
        from orient_eye.progress import progress_bar
        from orient_eye.search.optimum_cache import searched_optimum

        remembered = True
        with progress_bar("searching the optimum", quiet=self.quiet) as advance:

            def progress(share: float) -> None:
                nonlocal remembered
                remembered = False
                advance(share)

            return searched_optimum(task, start, target, progress=progress), remembered

    def _second_search(
        self, task: "SaccadeTask", start: "State", target: "Array", rows: list[dict[str, Any]]
    ) -> dict[str, Any]:
        """The second search's numbers, added to the rows, and the largest differences."""
        from orient_eye.progress import progress_bar
        from orient_eye.search.second_search import agreement, second_search

        gains = []
        with progress_bar("searching again", quiet=self.quiet) as advance:
            for i, row in enumerate(rows):
                action, reward = second_search(task, start[i : i + 1], target[i : i + 1])
                gains.append((reward - row["reward"]) / max(abs(row["reward"]), 1.0))
                row |= {f"check_{name}": float(value) for name, value in zip(task.actions.names, action, strict=True)}
                row |= {"check_reward": reward, "check_gain": gains[-1]}
                advance((i + 1) / len(rows))
        return {
            "passed": max(gains) <= agreement(task),
            "check_largest_gain": max(*gains, 0.0),
            "check_largest_loss": max(*(-g for g in gains), 0.0),
        }
