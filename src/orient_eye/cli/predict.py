"""orient-eye predict."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.cli.another_plant import AnotherPlant
from orient_eye.cli.saccades import Saccades

if TYPE_CHECKING:
    from orient_eye.cli.command_files import Written
    from orient_eye.commands.motor_file import Wiring
    from orient_eye.state import State
    from orient_eye.task.saccade import Outcome, SaccadeTask

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")


@dataclass(frozen=True)
class Predict:
    """What a policy does: motor command, expected duration, peak velocity and accuracy of saccades.

    POLICY is a run directory of `orient-eye train`, a policy folder, or the name of a shipped policy
    (`orient-eye models`). What is expected is what the plant does under the command.

    $ orient-eye predict runs/my-run --start 0 --target 20

    $ orient-eye predict runs/my-run --target -15 --command saccade.csv

    $ orient-eye simulate --motor saccade.csv

    $ orient-eye predict tavares-gaze --start -10 5 --target 20 -10

    $ orient-eye predict runs/my-run --pairs pairs.csv --out predicted.csv

    With --rig the motors have the rig's limits, and commands are what its motor driver takes: its units, at its rate,
    until the motors stand.

    $ orient-eye predict runs/my-run --rig rig.toml --target 20 --command there.csv --back back.csv

    $ orient-eye predict runs/my-run --rig rig.toml --pairs pairs.csv --commands commands
    """

    policy: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY")]
    """Run directory, policy folder, or name of a shipped policy."""
    saccades: Saccades = field(default_factory=Saccades)
    command: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: the motor command of the one saccade, as `orient-eye simulate --motor` reads it."""
    commands: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER", help_behavior_hint="(optional)")] = None
    """Folder to write, new or empty: the motor command of each saccade, and index.csv with the table."""
    back: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: a slow, smooth way back from where the one saccade ends to rest, at half the limits."""
    out: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: the result, one row a saccade."""
    another_plant: AnotherPlant = field(default_factory=AnotherPlant)

    def run(self) -> dict[str, Any]:
        """Predict, write the files and print the table."""
        from orient_eye.cli.places import check_outputs, policy_file
        from orient_eye.cli.tables import saccade_columns, say, say_limits, table
        from orient_eye.files import write_table
        from orient_eye.learning.policy import Policy
        from orient_eye.plants.limits import wiring
        from orient_eye.task.table import outcome_rows, with_peaks
        from orient_eye.task.targets import saccades
        from orient_eye.words import plant_in_words

        policy = Policy.load(self.policy)
        inputs = {"--pairs": self.saccades.pairs, "the policy": policy_file(self.policy)}
        check_outputs({"--command": self.command, "--out": self.out, "--back": self.back}, inputs)
        task, differences = self.another_plant.task(policy)
        ends = self.saccades.angles(task.targets, drawn=True)
        self._check_files(len(ends[0]))
        rig, writes = self.another_plant.plant_options.get("rig"), self.command or self.commands or self.back
        wired = wiring(task.plant, rig) if rig is not None and writes else None
        start, target = saccades(task.targets, *ends)
        action = policy.act(start.orientation, target)
        outcome = task.perform(start, action, target)
        rows = with_peaks(task, outcome, outcome_rows(task, start, target, action, outcome))
        title = f"What the policy does on plant {plant_in_words(task.plant.identity())}."
        say(table(title, saccade_columns(task, rows[0]), rows))
        say_limits(task, rows)
        if outcome.measures.failed.any():
            say(f"{int(outcome.measures.failed.sum())} simulated saccades failed: their measures are empty", "red")
        if self.out:
            say(f"in {write_table(self.out, rows)}")
        written = self._write(task, outcome, start, rows, wired)
        return {
            "policy": self.policy,
            "plant": task.plant.identity(),
            "differs_from_training": differences,
            "saccades": rows,
            "written": [each.to_plain() for each in written],
            **{name: str(path) if path else None for name, path in self._files().items()},
        }

    def _files(self) -> dict[str, Path | None]:
        return {"out": self.out, "command": self.command, "commands": self.commands, "back": self.back}

    def _check_files(self, saccades: int) -> None:
        """Refuse one file of many saccades, and a folder that holds something.

        Raises:
            InputError: says which.
        """
        from orient_eye.errors import InputError
        from orient_eye.files import explained

        for option, path, what in (
            ("--command", self.command, "the motor command"),
            ("--back", self.back, "the way back"),
        ):
            if path and saccades != 1:
                raise InputError(
                    f"{option} writes {what} of one saccade, {self.saccades.pairs} has {saccades}; --commands FOLDER "
                    "writes the commands of many"
                )
        if self.commands:
            with explained(self.commands):
                if self.commands.exists() and (not self.commands.is_dir() or any(self.commands.iterdir())):
                    raise InputError(f"--commands {self.commands} is not an empty folder; name a new one")

    def _write(
        self,
        task: "SaccadeTask",
        outcome: "Outcome",
        start: "State",
        rows: list[dict[str, Any]],
        wired: "Wiring | None",
    ) -> "list[Written]":
        """Write the commands that are asked for."""
        from orient_eye.cli.command_files import final_of, way_back, write, written_path
        from orient_eye.cli.tables import say

        written, plant = [], task.plant
        if self.command:
            written.append(write(self.command, plant, wired, written_path(task, outcome, start, 0, wired)))
            written[-1].say("motor command")
            typed = self._to_try(task, limited=wired is not None)
            here = "--plant" in typed or not hasattr(task.plant, "surrogate")
            other = "" if here else " on the MuJoCo eye, not on its surrogate"
            say(f"to try it{other}: {typed}")
        if self.back:
            motors, step_s = (plant.motors, plant.step_s) if wired is None else (wired.limited, wired.step_s)
            back = way_back(final_of(plant, outcome, 0), motors, step_s)
            written.append(write(self.back, plant, wired, back))
            written[-1].say("way back to rest")
        if self.commands:
            written += self._write_all(self.commands, task, outcome, start, rows, wired)
        return written

    def _to_try(self, task: "SaccadeTask", *, limited: bool) -> str:
        """The command that simulates the written one, as it can be typed."""
        import shlex

        from orient_eye.constants import EYE

        words = ["orient-eye", "simulate", "--motor", str(self.command)]
        surrogate = getattr(task.plant, "surrogate", None)
        stranger = surrogate is not None and surrogate.eye is None  # whose motors are none of the default plant's
        file = self._surrogate_file() if stranger else None
        if stranger or limited:
            words += ["--plant", task.plant.name]
        identity = task.plant.identity()
        eye = identity.get("eye") or getattr(surrogate, "eye", None) or EYE
        if eye != EYE:
            words += ["--eye", eye]
        if "pretension" in identity:
            words += ["--pretension", f"{identity['pretension']:g}"]
        if file is not None:
            words += ["--surrogate", file]
        if limited:  # the file ends where the motors stand
            words += ["--rig", str(self.another_plant.plant_options["rig"]), "--horizon", f"{task.horizon_s:g}"]
        missing = ", with the surrogate that the policy has learned on (--surrogate and its file)"
        return shlex.join(words) + (missing if stranger and file is None else "")

    def _surrogate_file(self) -> str | None:
        """The surrogate that was given, or with which its training was typed; None if unknown."""
        import shlex

        from orient_eye.cli.places import policy_file
        from orient_eye.errors import InputError
        from orient_eye.run_directory import RunDirectory

        named = self.another_plant.plant_options.get("surrogate")
        if named is None:
            try:
                typed = shlex.split(RunDirectory(policy_file(self.policy).parent).read_json("run.json")["command_line"])
                named = typed[typed.index("--surrogate") + 1]
            except (InputError, LookupError, TypeError, ValueError):  # a policy by itself, or begun from Python
                return None
        return str(named) if Path(str(named)).is_file() else None

    def _write_all(
        self,
        folder: Path,
        task: "SaccadeTask",
        outcome: "Outcome",
        start: "State",
        rows: list[dict[str, Any]],
        wired: "Wiring | None",
    ) -> "list[Written]":
        """One file a saccade, but for those that failed, and index.csv."""
        from orient_eye.cli.command_files import write, written_path
        from orient_eye.cli.tables import say
        from orient_eye.files import write_table

        written, index = [], []
        digits = len(str(len(rows)))
        for i, row in enumerate(rows):
            if row["failed"]:
                index.append({"file": None, "rows": None, "command_s": None, **row})
                continue
            path = folder / f"saccade-{i + 1:0{digits}d}.csv"
            each = write(path, task.plant, wired, written_path(task, outcome, start, i, wired))
            index.append({"file": path.name, "rows": each.rows, "command_s": (each.rows - 1) * each.step_s, **row})
            written.append(each)
        write_table(folder / "index.csv", index)
        say(f"{len(written)} motor commands in {folder}, listed in {folder / 'index.csv'}")
        for beyond in (each for each in written if each.too_fast):
            beyond.say("motor command")
        return written
