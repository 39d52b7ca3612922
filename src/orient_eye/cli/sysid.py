"""`orient-eye sysid`: identify the eye from step responses of a plant or of a rig."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from orient_eye.sysid import Identification

_AMPLITUDES = tuple(float(a) for a in range(1, 26))
_HELD_OUT = (1.5, 4.5, 9.5, 14.5, 19.5, 24.5)


def _default(words: str, metavar: str | None = None) -> Any:
    return tyro.conf.arg(help_behavior_hint=f"(default: {words})", metavar=metavar)


@dataclass(frozen=True)
class Sysid:
    """Identify the eye from step responses: gain K and cut-off w0 of its low-pass surrogate.

    On a plant: steps of one motor over a range of amplitudes, as thesis section 3.3 does. With --recording:
    measured step responses, from CSV files or logs of the real eye (formats: docs/sysid.md). First and
    second order, without and with dead time, are fitted and compared. The run directory holds
    surrogate.json (for `orient-eye train --plant lpf --surrogate FILE`), every fit as a table, pictures
    and a recording.

    $ orient-eye sysid

    $ orient-eye sysid --plant lpf --amplitudes 2 5 10 20

    $ orient-eye sysid --recording step1.csv step2.csv

    $ orient-eye sysid --recording runs/simulate-1/trajectory.csv --motor motor2 --axis yaw
    """

    plant: str = "mujoco"
    """Plant to identify; not used with --recording."""
    plant_options: dict[str, Any] = field(default_factory=dict)
    amplitudes: Annotated[tuple[float, ...] | None, _default("1 2 3 ... 25", "AMPLITUDE ...")] = None
    """Steps to fit, deg of motor."""
    held_out: Annotated[tuple[float, ...] | None, _default("1.5 4.5 9.5 14.5 19.5 24.5", "AMPLITUDE ...")] = None
    """Steps to predict, not to fit, deg of motor. Recordings are left out one at a time instead."""
    recording: Annotated[
        tuple[Path, ...] | None, tyro.conf.arg(metavar="FILE ...", help_behavior_hint="(optional)")
    ] = None
    """Measured step responses, instead of a plant: CSV files or logs of the prototype."""
    motor: Annotated[str | None, _default("one that turns the eye; of a CSV file motor_deg, else tau2_deg")] = None
    """Motor that steps; of a CSV file the motor whose column it is."""
    axis: Annotated[
        Literal["yaw", "pitch", "roll"] | None,
        _default("what the motor turns; of a CSV file eye_deg, of a prototype log the rotation of its movement"),
    ] = None
    """Angle of the eye that is watched."""
    row_times: Literal["even", "row-by-row", "nominal"] = "even"
    """Time of a prototype log, which has none: one interval from its motors, each row by itself, or 10 ms."""
    until: Annotated[float | None, _default("the whole recording")] = None
    """Leave out of recordings what comes after this time, s: a sensor that creeps long after the step."""
    out: Annotated[Path | None, _default("runs/sysid-DATE-TIME")] = None
    """Run directory, new or empty."""

    def run(self) -> dict[str, Any]:
        """Identify, write the run directory, and return the numbers."""
        from orient_eye.run_directory import RunDirectory
        from orient_eye.sysid.report import write_report

        found = self._plant() if self.recording is None else self._recordings(self.recording)
        run = RunDirectory.create(self.out, "sysid", self)
        result = {**write_report(found, run.path), "out": str(run.path)}
        _tell(found, result)
        return result

    def _recordings(self, paths: tuple[Path, ...]) -> "Identification":
        from orient_eye.sysid import identify_recordings, read_recordings

        if not paths:
            raise InputError("--recording names no file; name one or more, or leave it out to identify a plant")
        given = ["plant"] if self.plant != Sysid.plant else [*self.plant_options]
        given += [name for name in ("amplitudes", "held_out") if getattr(self, name) is not None]
        for name in given:
            raise InputError(f"--{name.replace('_', '-')} is for a plant; leave it out beside --recording")
        return identify_recordings(read_recordings(paths, self.motor, self.axis, self.row_times, self.until))

    def _plant(self) -> "Identification":
        from orient_eye.plants import make_plant
        from orient_eye.sysid import identify_plant

        if self.until is not None:
            raise InputError("--until is for recordings; leave it out, or give --recording")
        plant = make_plant(self.plant, **self.plant_options)
        amplitudes = _AMPLITUDES if self.amplitudes is None else self.amplitudes
        held_out = _HELD_OUT if self.held_out is None else self.held_out
        return identify_plant(plant, amplitudes, held_out, self.motor, self.axis)


def _tell(found: "Identification", result: dict[str, Any]) -> None:
    from orient_eye.cli.tables import say

    say(_steps_table(found))
    say(_models_table(found))
    if found.held_out_fit:
        what = "surrogate on steps not fitted" if found.held_out else "first order, predicted from the others"
        say(f"{what} (rms in deg, R²):")
        say(", ".join(f"{h.name}: {h.rms_deg:.3f}, {h.r_squared:.5f}" for h in found.held_out_fit))
    for warning in found.warnings:
        say(f"note: {warning}", "yellow")
    number = found.surrogate
    say(
        f"surrogate: K = {number.K:.4f} ± {found.K_half_width:.2g}, w0 = {number.w0:.3f} ± "
        f"{found.w0_half_width:.2g} rad/s (95 %), in {result['out']}/surrogate.json"
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
