"""`orient-eye sysid`: identify the eye from step responses of a plant or of a rig."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from orient_eye.sysid import Identification

_AMPLITUDES = tuple(float(a) for a in range(1, 26))
_HELD_OUT = (1.5, 4.5, 9.5, 14.5, 19.5, 24.5)

_OF_RECORDINGS = ("recording", "rig", "motor", "axis", "row_times", "until", "model", "force", "out")


def _default(words: str, metavar: str | None = None) -> Any:
    return tyro.conf.arg(help_behavior_hint=f"(default: {words})", metavar=metavar)


@dataclass(frozen=True)
class Sysid:
    """Identify the eye from step responses: the linear surrogate that commands are learned on.

    On a plant: steps of one motor over a range of amplitudes, as thesis section 3.3 does. With --recording:
    measured step responses, from CSV files or logs of the real eye (formats: docs/sysid.md); with --rig the motors
    as their driver tells them (docs/rigs.md). First and second order, without and with dead time, are fitted and
    compared. The run directory holds surrogate.json (for `orient-eye train --surrogate FILE`), every fit as a table,
    pictures, a recording, and for recordings rig.toml: the rig, or a first description of it to fill in.
    With --plan: what to record, as commands inside the rig's limits. With --all-motors: a surrogate of the plant that
    all its motors turn (surrogate_3d.json, for `orient-eye train --plant modal --surrogate FILE`).

    $ orient-eye sysid

    $ orient-eye sysid --plant lpf --amplitudes 2 5 10 20

    $ orient-eye sysid --all-motors --plant tavares

    $ orient-eye sysid --recording step1.csv step2.csv

    $ orient-eye sysid --plan --rig rig.toml --axis pitch --out plan

    $ orient-eye sysid --recording step1.csv step2.csv --rig rig.toml --axis pitch

    $ orient-eye sysid --recording runs/simulate-1/trajectory.csv --motor motor2 --axis yaw

    $ orient-eye sysid --physical --recording step1.csv step2.csv --eye thesis
    """

    plant: str = "mujoco"
    """Plant to identify; not used with --recording."""
    plant_options: dict[str, Any] = field(default_factory=dict)
    amplitudes: Annotated[tuple[float, ...] | None, _default("1 2 3 ... 25", "AMPLITUDE ...")] = None
    """Steps to fit, deg of motor from where it rests."""
    held_out: Annotated[tuple[float, ...] | None, _default("1.5 4.5 9.5 14.5 19.5 24.5", "AMPLITUDE ...")] = None
    """Steps to predict, not to fit, deg of motor. Recordings are left out one at a time instead."""
    recording: Annotated[
        tuple[Path, ...] | None, tyro.conf.arg(metavar="FILE ...", help_behavior_hint="(optional)")
    ] = None
    """Measured step responses, instead of a plant: CSV files or logs of the prototype."""
    rig: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """Description of the recorded rig (TOML, docs/rigs.md), or a shipped one: prototype. A plant gets its limits."""
    plan: bool = False
    """Write the steps to record, instead of identifying: needs --rig."""
    motor: Annotated[str | None, _default("one that turns the eye; of a CSV file motor_deg, else tau2_deg")] = None
    """Motor that steps; of a CSV file the motor whose column it is."""
    axis: Annotated[
        Literal["yaw", "pitch", "roll"] | None,
        _default("what the motor turns; of a CSV file eye_deg, of a prototype log the rotation of its movement"),
    ] = None
    """Angle of the eye that is watched, and that the rig's drive turns."""
    model: Annotated[
        Literal["best", "first_order", "first_order_dead_time", "second_order", "second_order_dead_time"] | None,
        _default("first_order, as in the thesis; of rigs and recordings best"),
    ] = None
    """Model of the surrogate; best is the one that describes the data best."""
    force: bool = False
    """Go on although the numbers look wrong, and write a surrogate that the data do not determine."""
    row_times: Literal["even", "row-by-row", "nominal"] = "even"
    """Time of a prototype log, which has none: one interval from its motors, each row by itself, or 10 ms."""
    until: Annotated[float | None, _default("the whole recording")] = None
    """Leave out of recordings what comes after this time, s: a sensor that creeps long after the step."""
    all_motors: bool = False
    """Identify a plant with all its motors, three or more: three linear modes, about roll, pitch and yaw."""
    seed: Annotated[int | None, _default("0")] = None
    """Of the movements that --all-motors draws."""
    physical: bool = False
    """Fit the MJCF of --eye to the recordings instead (docs/sysid.md, Physical parameters), and write it."""
    frozen: Annotated[tuple[str, ...] | None, _default("stiffness_horizontal and the rest lengths", "NAME ...")] = None
    """Parameters that --physical leaves as they are: angles tell only ratios of stiffness to friction."""
    out: Annotated[Path | None, _default("runs/sysid-DATE-TIME")] = None
    """Run directory, new or empty."""

    def run(self) -> dict[str, Any]:
        """Identify, write the run directory, and return the numbers."""
        from orient_eye.run_directory import RunDirectory
        from orient_eye.sysid.report import write_report

        if self.all_motors:
            from orient_eye.cli.sysid_modes import modes_of

            return modes_of(self)
        if self.seed is not None:
            raise InputError("--seed is for --all-motors; leave it out, or say --all-motors")
        if self.plan:
            return self._plan()
        if self.physical:
            from orient_eye.cli.sysid_physical import physical_of

            return physical_of(self)
        if self.frozen is not None:
            raise InputError("--frozen is for --physical; leave it out, or say --physical")
        found = self._plant() if self.recording is None else self._recordings(self.recording)
        config = self if self.recording is None else {name: getattr(self, name) for name in _OF_RECORDINGS}
        run = RunDirectory.create(self.out, "sysid", config)
        result = {**write_report(found, run.path, self.force), "out": str(run.path)}
        _tell(found, result)
        self._say_what_is_next(found, run.path)
        return result

    def _say_what_is_next(self, found: "Identification", folder: Path) -> None:
        """Where there is no rig, how to make one.

        Raises:
            InputError: the data do not determine the surrogate, and it is not forced.
        """
        from orient_eye.cli.tables import say

        if self.recording is not None and found.rig is None:
            files = " ".join(map(str, self.recording))
            files += "" if self.until is None else f" --until {self.until:g}"
            say(
                f"rig: {folder}/rig.toml is a first description of your rig. Its motor is in deg, without limits; fill "
                f"in what is a comment there, then: orient-eye sysid --recording {files} --rig {folder}/rig.toml"
            )
        if found.undetermined and not self.force:
            raise InputError(
                f"these data do not determine the surrogate, so none was written (fits and pictures are in {folder}): "
                f"{found.surrogate_model.title}: {'; '.join(found.undetermined)}. Record several steps of different "
                "size in both directions, each with a rest before, the motor's measured position at 100 rows a second "
                f"or more, until the eye stands (orient-eye sysid --plan --rig {self.rig or f'{folder}/rig.toml'} "
                "writes such steps, once the rig's motors have their range in it); or choose "
                "a simpler --model; or say --force"
            )

    def _plan(self) -> dict[str, Any]:
        """Write the steps to record."""
        from orient_eye.cli.tables import column, say, table
        from orient_eye.rig import Rig
        from orient_eye.run_directory import RunDirectory
        from orient_eye.sysid.motor_columns import axis_of
        from orient_eye.sysid.plan import plan_steps, write_plan

        if self.rig is None:
            raise InputError(
                "--plan needs the rig, whose limits it keeps: --rig and its file (docs/rigs.md shows one), or --rig "
                "prototype"
            )
        if self.recording is not None:
            raise InputError("--plan writes what to record; leave --recording out")
        rig = Rig.load(self.rig)
        axis = axis_of(rig, self.axis)
        steps = plan_steps(rig, axis)
        run = RunDirectory.create(self.out, "sysid-plan", {"rig": self.rig, "axis": axis, "plan": True})
        files = write_plan(steps, rig, axis, run.path, self.rig)
        rows = [
            {"file": f"{s.name}.csv", "amplitude_deg": s.amplitude_deg, "until_s": s.until_s, "s": float(s.time[-1])}
            for s in steps
        ]
        columns = {
            "file": lambda row: row["file"],
            "step [deg]": column("amplitude_deg", "+.4g"),
            "way back from [s]": column("until_s", ".3f"),
            "lasts [s]": column("s", ".2f"),
        }
        say(table(f"Steps of {rig.drive_name(axis)} to record.", columns, rows, left=("file",)))
        say(f"in {run.path}; how to record them: {run.path}/README.md")
        return {"out": str(run.path), "rig": self.rig, "axis": axis, "steps": rows, "files": files}

    def _recordings(self, paths: tuple[Path, ...]) -> "Identification":
        from orient_eye.rig import Rig
        from orient_eye.sysid import identify_recordings, read_recordings

        if not paths:
            raise InputError("--recording names no file; name one or more, or leave it out to identify a plant")
        given = ["plant"] if self.plant != Sysid.plant else [*self.plant_options]
        given += [name for name in ("amplitudes", "held_out") if getattr(self, name) is not None]
        for name in given:
            raise InputError(f"--{name.replace('_', '-')} is for a plant; leave it out beside --recording")
        rig = None if self.rig is None else Rig.load(self.rig)
        steps = read_recordings(paths, self.motor, self.axis, self.row_times, self.until, rig)
        return identify_recordings(steps, rig, self.model or "best", self.force)

    def _plant(self) -> "Identification":
        from orient_eye.plants import make_plant
        from orient_eye.sysid import identify_plant

        if self.until is not None:
            raise InputError("--until is for recordings; leave it out, or give --recording")
        limits = {} if self.rig is None else {"rig": self.rig}
        plant = make_plant(self.plant, **self.plant_options, **limits)
        amplitudes = _AMPLITUDES if self.amplitudes is None else self.amplitudes
        held_out = _HELD_OUT if self.held_out is None else self.held_out
        return identify_plant(plant, amplitudes, held_out, self.motor, self.axis, self.model)


def _tell(found: "Identification", result: dict[str, Any]) -> None:
    from orient_eye.cli.tables import say
    from orient_eye.plants.linear_response import second_order_poles

    say(_steps_table(found))
    say(_models_table(found))
    if found.held_out_fit:
        what = "surrogate on steps not fitted" if found.held_out else "surrogate's model, predicted from the others"
        say(f"{what} (rms in deg, R²):")
        say(", ".join(f"{h.name}: {h.rms_deg:.3f}, {h.r_squared:.5f}" for h in found.held_out_fit))
    for warning in found.warnings:
        say(f"note: {warning}", "yellow")
    if "surrogate.json" not in result["files"]:
        return
    number = found.surrogate
    told = []
    for parameter in found.surrogate_model.parameters:
        value, (low, high) = getattr(number, parameter.name), number.intervals.get(parameter.name, (nan, nan))
        unit = parameter.unit.removeprefix("deg/deg")
        told.append(f"{parameter.name} = {value:.5g} ± {(high - low) / 2:.2g} {unit}".rstrip())
    if number.zeta is not None and number.zeta >= 1 and number.wn is not None:
        slow, fast = second_order_poles(number.wn, number.zeta)
        told[-1] += f", poles {slow:.4g} and {fast:.4g} rad/s"
    say(
        f"surrogate, {found.surrogate_model.title}: {', '.join(told)} (95 %); {number.motor} turns {number.axis}; in "
        f"{result['out']}/surrogate.json"
    )


def _steps_table(found: "Identification") -> "Table":
    from orient_eye.cli.tables import table

    rows = [{"step": step, "fit": fit} for step, (fit, *_) in zip(found.steps, found.fits, strict=True)]
    columns = {
        "step": lambda row: row["step"].name.removesuffix(" deg"),
        "motor": lambda row: f"{row['step'].amplitude_deg:.4g}",
        "K": lambda row: str(row["fit"]["K"]),
        "w0 [rad/s]": lambda row: str(row["fit"]["w0"]),
        "rms [deg]": lambda row: f"{row['fit'].rms_deg:.3f}",
        "R²": lambda row: f"{row['fit'].r_squared:.4f}",
    }
    return table("First-order model, each step fitted by itself (± 95 %).", columns, rows, left=("step",))


def _models_table(found: "Identification") -> "Table":
    from rich.text import Text

    from orient_eye.cli.tables import Cell, Row, table

    least, best = min(row.aicc for row in found.compared), found.preferred

    def name(row: Any) -> Text:
        title = row["of"].fit.model.title
        return Text.assemble((title, "bold"), "\npreferred") if row["of"] is best else Text(title)

    def parameters(row: Any) -> str:
        return "\n".join(
            f"{e.parameter.name} = {e} {e.parameter.unit.removeprefix('deg/deg')}".rstrip()
            + (" (at its bound)" if e.at_bound else "")
            for e in row["of"].fit.estimates
        )

    columns: dict[str, Callable[[Row], Cell]] = {
        "model": name,
        "parameters (± 95 %)": parameters,
        "rms\n[deg]": lambda row: f"{row['of'].fit.rms_deg:.3f}",
        "AICc": lambda row: f"+{row['of'].aicc - least:.1f}",
        "held out\nrms [deg]": lambda row: f"{row['of'].held_out_rms_deg:.3f}" if row["of"].held_out else "-",
    }
    title = "Models compared, each fitted to all steps together (AICc: above the least)."
    made = table(title, columns, [{"of": row} for row in found.compared], left=("model", "parameters (± 95 %)"))
    made.show_lines = True
    return made
