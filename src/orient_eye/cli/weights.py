"""orient-eye weights."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    from orient_eye.plants import Plant
    from orient_eye.task.weights import ChosenSaccade, Steps

_ON_THE_PLANT = tyro.conf.arg(help_behavior_hint="(default: found on the plant)")


@dataclass(frozen=True)
class WeightsCommand:
    """Solve the weights of the reward for which a chosen saccade is optimal (thesis 4.4.5).

    With lambda_e = 1 the other three make the gradient of the reward over B, D and k0 vanish at the chosen
    command. What they depend on: docs/weights.md.

    $ orient-eye weights --band 0.00707

    $ orient-eye weights --plant mujoco --case 1
    """

    plant: Literal["lpf", "mujoco", "tavares"] = "lpf"
    """The low-pass surrogate, the MuJoCo eye, or the NumPy reference."""
    case: Literal["all", "1", "2-fixed", "2-varying", "3-fixed", "3-varying"] = "all"
    """Pulse of the motor command and its onset rate C: one of the thesis' five cases, or all of them."""
    surrogate: str = "thesis"
    """For lpf: a surrogate.json written by sysid, or the name of a shipped one."""
    eye: str = "thesis"
    """For mujoco and tavares: preset of the eye."""
    band: float = 0.01
    """Settling band, share of the amplitude; 0.00707 comes to the thesis' printed weights."""
    speed_limit: float = 7200.0
    """Motor speed to which a varying C brings the command, deg/s."""
    start: float = 0.0
    """Yaw at which the chosen saccade begins, deg."""
    target: float = 30.0
    """Yaw at which it should end, deg."""
    B: float = 35.0
    """Its B, 1/s."""
    D: Annotated[float | None, _ON_THE_PLANT] = None
    """Its final motor position, deg: where the eye rests on the target (20.33, the thesis' number, on its plant)."""
    k0: Annotated[float | None, _ON_THE_PLANT] = None
    """Its k0, 1/s: below it this saccade overshoots (17.5 on the thesis' plant)."""
    step_B: float = 0.2
    """Half-width of the central difference in B, 1/s."""
    step_D: float = 0.02
    """In D, deg."""
    step_k0: float = 0.05
    """In k0, 1/s; lambda_o is about inversely proportional to it."""

    def run(self) -> dict[str, Any]:
        """Solve and print the table."""
        from rich.table import Table

        from orient_eye.cli import say
        from orient_eye.plants import chosen_plant
        from orient_eye.task.cases import CASES
        from orient_eye.task.weights import ChosenSaccade, Steps

        chosen = ChosenSaccade(self.start, self.target, self.B, self.D, self.k0)
        steps = Steps(self.step_B, self.step_D, self.step_k0)
        plant = chosen_plant(self.plant, self.surrogate, self.eye)
        names = list(CASES) if self.case == "all" else [self.case]
        rows = [self._solve(plant, name, chosen, steps) for name in names]
        saccade = f"{self.start:g} to {self.target:g} deg with B = {self.B:g} 1/s"
        table = Table("case", title=f"{saccade}, plant {plant.name}, band {self.band:g}; lambda_e = 1")
        for name in ("lambda_a", "lambda_d", "lambda_o", r"D \[deg]", "k0 [1/s]"):
            table.add_column(name, justify="right")
        for row in rows:
            weights = (f"{row[name]:.2e}".replace("e+0", "e") for name in ("accuracy", "duration", "overshoot"))
            table.add_row(row["case"], *weights, f"{row['D']:.3f}", f"{row['k0']:.3f}")
        say(table)
        return {
            "plant": plant.identity(),
            "band": self.band,
            "start_yaw_deg": self.start,
            "target_yaw_deg": self.target,
            "steps": {"B": self.step_B, "D": self.step_D, "k0": self.step_k0},
            "cases": rows,
        }

    def _solve(self, plant: "Plant", case: str, chosen: "ChosenSaccade", steps: "Steps") -> dict[str, Any]:
        """One row: the case, its weights, and the resolved saccade."""
        from dataclasses import asdict

        from orient_eye.errors import InputError
        from orient_eye.task.saccade import SaccadeTask
        from orient_eye.task.weights import resolve, solve_weights

        task = SaccadeTask.of_case(plant, case, band=self.band, speed_limit=self.speed_limit)
        try:
            resolved = resolve(task, chosen)
            weights = solve_weights(task, resolved, steps)
        except InputError as error:
            raise InputError(f"case {case}: {error}") from error
        return {
            "case": case,
            "variant": task.variant,
            "C": task.onset,
            **asdict(weights),
            "B": resolved.B,
            "D": resolved.D,
            "k0": resolved.k0,
        }
