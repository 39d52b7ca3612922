"""orient-eye weights."""

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.cli.problem import Problem

if TYPE_CHECKING:
    from collections.abc import Callable

    from orient_eye.cli.tables import Row
    from orient_eye.plants import Plant
    from orient_eye.task.cases import Case
    from orient_eye.task.solved_weights import ChosenSaccade, Steps
    from orient_eye.task.targets import Targets


def _found(words: str, metavar: str | None = None) -> Any:
    return tyro.conf.arg(help_behavior_hint=f"(default: {words})", metavar=metavar)


@dataclass(frozen=True)
class Weights:
    """Solve the weights of the reward for which a chosen saccade is optimal (thesis 4.4.5).

    With lambda_e = 1 the other three make the gradient of the reward over B, D and k0 vanish at the chosen
    command. Where that has no solution, the weights that such a plant comes with are shown, and by what rule.
    What they depend on: docs/weights.md.

    $ orient-eye weights --band 0.00707

    $ orient-eye weights --plant mujoco --case 1

    $ orient-eye weights --human
    """

    problem: Problem = field(default_factory=Problem)
    case: str = "all"
    """Learning case: the pulse of the motor command, and how its onset rate C is chosen; or all of them."""
    start: Annotated[tuple[float, ...] | None, _found("straight ahead", "ANGLE ...")] = None
    """Direction in which the chosen saccade begins, deg: one number for horizontal targets."""
    target: Annotated[tuple[float, ...] | None, _found("30, or as far as the targets go", "ANGLE ...")] = None
    """Direction in which it should end, deg."""
    B: Annotated[float | None, _found("35")] = None
    """B of the chosen saccade, 1/s."""
    D: Annotated[tuple[float, ...] | None, _found("found on the plant", "POSITION ...")] = None
    """Final position of each driven motor, deg: where the eye rests on the target (20.33, the thesis' number, on its
    plant)."""
    k0: Annotated[float | None, _found("found on the plant")] = None
    """k0 of the chosen saccade, 1/s: below it this saccade overshoots (17.5 on the thesis' plant)."""
    step_B: float = 0.2
    """Half-width of the central difference in B, 1/s."""
    step_D: float = 0.02
    """Half-width of the central difference in D, deg."""
    step_k0: float = 0.05
    """Half-width of the central difference in k0, 1/s; lambda_o is about inversely proportional to it."""

    human: bool = False
    """Search the weights whose best saccades have the main sequence of people, over all pulses and two rates at which
    time is discounted: the inverse problem."""
    like: Annotated[tuple[float, ...] | None, _found("people's", "V0 C D0 D")] = None
    """With --human: your own main sequence, V = V0 (1 - exp(-A/c)) [deg/s, deg] and D = D0 + d A [ms, ms/deg]."""
    quiet: bool = False
    """Show no progress bar."""

    def run(self) -> dict[str, Any]:
        """Solve and print the table."""
        from dataclasses import asdict

        from orient_eye.cli.tables import column, say, table
        from orient_eye.task.judge import JUDGES
        from orient_eye.task.solved_weights import Steps

        plant, targets = self.problem.made()
        if self.human or self.like is not None:
            return self._nearest_to_people(plant, targets)
        terms = [name for name in JUDGES[targets.of].names if name != "energy"]
        steps = Steps(self.step_B, self.step_D, self.step_k0)
        rows = [self._solve(plant, targets, name, case, steps) for name, case in self._cases(plant, targets).items()]
        solved = [k for k in rows[0] if k.split("_")[0] in ("D", "k0") and any(row[k] is not None for row in rows)]
        columns = {
            "case": lambda row: row["case"],
            **{f"lambda_{name[0]} ({name})": _weight(name) for name in terms},
            **{key: column(key) for key in solved},
            "how": lambda row: row["how"],
        }
        title = f"Weights of the reward on plant {plant.name}, band {self.problem.band:g}; lambda_e (energy) is 1."
        say(table(title, columns, rows, left=("case", "how")))
        return {
            "plant": plant.identity(),
            "targets": targets.identity(),
            "band": self.problem.band,
            "steps": asdict(steps),
            "cases": rows,
        }

    def _nearest_to_people(self, plant: "Plant", targets: "Targets") -> dict[str, Any]:
        from orient_eye.cli.weights_human import nearest_to_people
        from orient_eye.errors import InputError

        if not self.human:
            raise InputError("--like says which main sequence --human comes near to; give --human too")
        own = {"human", "like", "quiet", "problem"}
        said = [f.name for f in fields(self) if f.name not in own and getattr(self, f.name) != f.default]
        said += [name for name in ("pulse", "C", "speed_limit") if getattr(self.problem, name) is not None]
        if said:
            raise InputError(
                f"--human searches over pulses and weights itself; leave --{said[0].replace('_', '-')} out"
            )
        return nearest_to_people(plant, targets, self.like, self.problem.band, quiet=self.quiet)

    def _cases(self, plant: "Plant", targets: "Targets") -> "dict[str, str | Case]":
        """The cases that were asked for, by what to call them."""
        from orient_eye.cli.tables import say
        from orient_eye.errors import InputError
        from orient_eye.task.cases import CASES
        from orient_eye.task.judge import JUDGES

        if self.problem.pulse is not None or self.problem.C is not None:
            return {f"pulse {self.problem.pulse}": self.problem.case(None if self.case == "all" else self.case)}
        if self.case != "all":
            return {self.case: self.case}
        cases: dict[str, str | Case] = {}
        left_out: dict[str, InputError] = {}
        for name in CASES:
            try:
                self.problem.task(plant, targets, CASES[name], JUDGES[targets.of].any_weights)
                cases[name] = CASES[name]
            except InputError as error:  # another package's, or none of these targets
                left_out[name] = error
        if not cases:
            raise next(iter(left_out.values()))
        for name, why in left_out.items():
            say(f"note: case {name!r} is left out: {why}", "yellow")
        return cases

    def _solve(
        self, plant: "Plant", targets: "Targets", name: str, case: "str | Case", steps: "Steps"
    ) -> dict[str, Any]:
        """One row: the case, its weights, the saccade they are solved at, and how."""
        import numpy as np

        from orient_eye.errors import InputError
        from orient_eye.task.cases import CASES
        from orient_eye.task.judge import JUDGES
        from orient_eye.task.known_weights import solve, with_known_weights
        from orient_eye.task.solved_weights import Steps, resolve, solve_at

        dummy = JUDGES[targets.of].any_weights
        task = self.problem.task(plant, targets, case, dummy)
        row = {"case": name, **{key: task.actions.identity().get(key) for key in ("pulse", "C")}}
        chosen, usual = self._chosen(targets), Weights()._chosen(targets)
        weights, how, action = {}, "thesis 4.4.5", np.full(len(task.actions.names), np.nan)
        try:
            resolved = resolve(task, chosen)
            weights, action = solve_at(task, resolved, steps), resolved.action
        except InputError as error:
            if chosen != usual or steps != Steps():
                raise InputError(f"case {name}: {error}") from error
        if chosen == usual and steps == Steps():
            own = (CASES[case] if isinstance(case, str) else case).judge is not None  # and weights that go with it
            kept = with_known_weights(task) if own or not weights else None
            known, where = solve(task) if kept is None else (dict(kept.weights), kept.weights_from)
            if known != weights:  # told by another saccade, which stands in the words
                weights, how, action = known, where, np.full(len(action), np.nan)
        told = [float(value) if np.isfinite(value) else None for value in action]
        return {**row, **weights, **dict(zip(task.actions.names, told, strict=True)), "how": how}

    def _chosen(self, targets: "Targets") -> "ChosenSaccade":
        from orient_eye.cli.saccades import direction
        from orient_eye.task.solved_weights import ChosenSaccade

        start, target = (
            None if given is None else direction(targets.angles, given, what)
            for given, what in ((self.start, "start"), (self.target, "target"))
        )
        return ChosenSaccade(start, target, D=self.D, k0=self.k0, **({} if self.B is None else {"B": self.B}))


def _weight(name: str) -> "Callable[[Row], str]":
    return lambda row: f"{row[name]:.2e}".replace("e+0", "e")
