"""orient-eye predict."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.table import Table

    from orient_eye.learning.policy import Policy
    from orient_eye.task.saccade import Outcome, SaccadeTask

    Array = NDArray[np.float64]

_OWN = tyro.conf.arg(help_behavior_hint="(default: the policy's own)")
_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")
_MOTOR_COLUMNS = ("tau1_deg", "tau2_deg", "tau3_deg")  # what `orient-eye simulate --motor` reads


@dataclass(frozen=True)
class AnotherPlant:
    """To use the policy on another plant than its own."""

    plant: Annotated[Literal["lpf", "mujoco", "tavares"] | None, _OWN] = None
    """The plant; one the policy was not trained on is refused without --force."""
    surrogate: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(default: thesis)")] = None
    """For --plant lpf: a surrogate.json written by sysid, or the name of a shipped one."""
    eye: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(default: thesis)")] = None
    """For --plant mujoco and tavares: preset of the eye."""
    force: bool = False
    """Use the policy although the plant is not the one it was trained on."""

    def task(self, policy: "Policy") -> "tuple[SaccadeTask, list[str]]":
        """The task on that plant, and in words what differs from the one the policy was trained on.

        Raises:
            InputError: something differs, and it is not forced.
        """
        from orient_eye.cli import say
        from orient_eye.errors import InputError
        from orient_eye.plants import chosen_plant

        if self.plant is None and (self.surrogate or self.eye):
            raise InputError("--surrogate and --eye say more about --plant; without it the policy's own plant is used")
        plant = (
            None if self.plant is None else chosen_plant(self.plant, self.surrogate or "thesis", self.eye or "thesis")
        )
        task = policy.task(plant)
        differences = policy.require(task, force=self.force)
        if differences:
            say(f"[yellow]forced: this policy was trained for {'; '.join(differences)}[/yellow]")
        return task, differences


@dataclass(frozen=True)
class Predict:
    """What a policy does: motor command, expected duration, peak velocity and accuracy of saccades.

    POLICY is a run directory of `orient-eye train`, a policy folder, or the name of a shipped policy
    (`orient-eye models`). What is expected is what the plant does under the command.

    $ orient-eye predict runs/my-run --start 0 --target 20

    $ orient-eye predict runs/my-run --target -15 --command saccade.csv

    $ orient-eye simulate --motor saccade.csv

    $ orient-eye predict runs/my-run --pairs pairs.csv --out predicted.csv
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")]
    """Run directory, policy folder, or name of a shipped policy."""
    start: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(default: 0)")] = None
    """Yaw at which the saccade begins, deg, positive to the left."""
    target: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(required without --pairs)")] = None
    """Yaw at which it should end, deg."""
    pairs: Annotated[Path | None, _OPTIONAL] = None
    """Many saccades instead: a CSV file with the columns start_yaw_deg and target_yaw_deg."""
    command: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: the motor command of the one saccade, as `orient-eye simulate --motor` reads it."""
    out: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: the result, one row a saccade."""
    another_plant: AnotherPlant = field(default_factory=AnotherPlant)

    def run(self) -> dict[str, Any]:
        """Predict, write the files and print the table."""
        from orient_eye.cli import say
        from orient_eye.errors import InputError
        from orient_eye.learning.policy import Policy
        from orient_eye.task.saccade import horizontal

        start_yaw, target_yaw = self._saccades()
        if self.command and len(start_yaw) != 1:
            raise InputError(f"--command writes the motor command of one saccade, {self.pairs} has {len(start_yaw)}")
        policy = Policy.load(self.policy)
        task, differences = self.another_plant.task(policy)
        start, target = task.fixate(horizontal(start_yaw)), horizontal(target_yaw)
        action = policy.act(start.orientation, target)
        outcome = task.perform(start, action, target)
        rows = saccade_rows(task, start_yaw, target_yaw, outcome)
        say(_table(rows, task))
        if outcome.measures.failed.any():
            say(f"[red]{int(outcome.measures.failed.sum())} simulated saccades failed: their measures are empty[/red]")
        if self.out:
            from orient_eye.files import write_table

            write_table(self.out, rows)
            say(f"in {self.out}")
        if self.command:
            _write_command(self.command, task.trajectory(start, action))
            say(f"motor command in {self.command}: orient-eye simulate --motor {self.command}")
        return {
            "policy": self.policy,
            "plant": task.plant.identity(),
            "differs_from_training": differences,
            "saccades": rows,
            "out": str(self.out) if self.out else None,
            "command": str(self.command) if self.command else None,
        }

    def _saccades(self) -> "tuple[Array, Array]":
        """Yaw of starts and targets [deg], inside the range of the training."""
        import numpy as np

        from orient_eye.cli.optimum import read_pairs
        from orient_eye.errors import InputError
        from orient_eye.task.saccade import YAW_RANGE_DEG

        if self.pairs and (self.start is not None or self.target is not None):
            raise InputError("give --pairs, or --start and --target, not both")
        if self.pairs:
            start, target = read_pairs(self.pairs)
        elif self.target is None:
            raise InputError("name a saccade by --target YAW [deg] and --start YAW, or many by --pairs FILE.csv")
        else:
            start, target = np.array([self.start or 0.0]), np.array([self.target])
        low, high = YAW_RANGE_DEG
        for name, yaw in (("start", start), ("target", target)):
            for value in yaw[~((yaw >= low) & (yaw <= high))]:
                raise InputError(
                    f"{name} at {value:g} deg: policies are trained between {low:g} and {high:g} deg of yaw and know "
                    "nothing of what is beyond; choose an angle in this range"
                )
        return start, target


def saccade_rows(
    task: "SaccadeTask", start_yaw: "Array", target_yaw: "Array", outcome: "Outcome"
) -> list[dict[str, Any]]:
    """One row a saccade, plain values, None where there is none; of several driven motors B_motor1, B_motor2, ..."""
    import numpy as np

    from orient_eye.rotations import to_euler

    command, measures = outcome.command, outcome.measures
    numbers: dict[str, Array] = {"start_yaw_deg": start_yaw, "target_yaw_deg": target_yaw}
    for index, motor in enumerate(task.driven):
        of_motor = "" if len(task.driven) == 1 else f"_{motor}"
        symbols = {"F_deg": command.F, "B": command.B, "D_deg": command.D, "k0": command.k0}
        symbols["C"] = np.full_like(command.B, np.nan) if task.onset is None else np.asarray(command.C, float)
        numbers |= {f"{name}{of_motor}": values[:, index] for name, values in symbols.items()}
    final = to_euler(measures.final)[0]
    numbers |= {
        "final_yaw_deg": final,
        "final_yaw_error_deg": final - target_yaw,
        "duration_ms": 1e3 * measures.settling_time_s,
        "peak_velocity_deg_s": measures.peak_velocity_deg_s,
        "overshoot": measures.overshoot,
        "skewness": measures.skewness,
        "reward": outcome.reward.total,
    }
    flags = {"settled": measures.settled, "saturated": outcome.saturated, "too_fast": outcome.too_fast}
    flags["failed"] = measures.failed
    return [
        {name: float(values[i]) if np.isfinite(values[i]) else None for name, values in numbers.items()}
        | {name: bool(values[i]) for name, values in flags.items()}
        for i in range(len(start_yaw))
    ]


def _write_command(path: Path, trajectory: Any) -> None:
    """The motor command of one saccade at the plant's step; its first row is the rest position."""
    from orient_eye.files import write_table
    from orient_eye.movement.trajectory import motor_column

    columns = {motor_column(name): trajectory.motor[0, :, i] for i, name in enumerate(trajectory.motor_names)}
    names = [*_MOTOR_COLUMNS, *(name for name in columns if name not in _MOTOR_COLUMNS)]
    rows = [
        {"t_s": f"{t:.9g}", **{name: f"{columns[name][i]:.9g}" if name in columns else "0" for name in names}}
        for i, t in enumerate(trajectory.time)
    ]
    write_table(path, rows)


def _table(rows: list[dict[str, Any]], task: "SaccadeTask") -> "Table":
    from rich.markup import escape
    from rich.table import Table

    from orient_eye.plants import plant_in_words

    units = {"F": "deg", "B": "1/s", "D": "deg", "k0": "1/s", "C": "1/s"}
    keys = [key for key in rows[0] if key.split("_")[0] in units and rows[0][key] is not None]
    table = Table(title=f"expected on plant {plant_in_words(task.plant.identity())}")
    heads = [f"{key.replace('_deg', '')} [{units[key.split('_')[0]]}]" for key in keys]
    for name in ("saccade [deg]", *heads, "ends at", "off by", "duration", "peak velocity", "goes beyond", "reward"):
        table.add_column(escape(name), justify="right")
    for row in rows:
        saccade = f"{row['start_yaw_deg']:g} to {row['target_yaw_deg']:g}"
        fast = " (too fast)" if row["too_fast"] else ""
        command = (f"{row[key]:.4g}{fast}" if key.startswith("C") else f"{row[key]:.3f}" for key in keys)
        if row["failed"]:
            table.add_row(saccade, *command, "failed")
            continue
        table.add_row(
            saccade,
            *command,
            f"{row['final_yaw_deg']:.2f} deg",
            f"{row['final_yaw_error_deg']:+.3f} deg",
            f"{row['duration_ms']:.1f} ms" + ("" if row["settled"] else " (not settled)"),
            f"{row['peak_velocity_deg_s']:.0f} deg/s",
            f"{100 * row['overshoot']:.3f} %",
            f"{row['reward']:.0f}",
        )
    return table
