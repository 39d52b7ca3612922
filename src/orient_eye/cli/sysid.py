"""`orient-eye sysid`: identify the eye from step responses of a plant or of a rig."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.cli import say
from orient_eye.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from orient_eye.plants import Plant
    from orient_eye.sysid import Identification

_AMPLITUDES = tuple(float(a) for a in range(1, 26))
_HELD_OUT = (1.5, 4.5, 9.5, 14.5, 19.5, 24.5)


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

    plant: Literal["mujoco", "lpf", "tavares"] = "mujoco"
    """Plant to identify; not used with --recording."""
    amplitudes: tuple[float, ...] = _AMPLITUDES
    """Steps to fit, deg of motor."""
    held_out: tuple[float, ...] = _HELD_OUT
    """Steps to predict, not to fit, deg of motor. Recordings are left out one at a time instead."""
    accurate: bool = False
    """Integrate plant mujoco at 0.2 ms instead of the thesis' 1 ms."""
    recording: tuple[Path, ...] = ()
    """Measured step responses, instead of a plant: CSV files or logs of the prototype."""
    motor: str | None = None
    """Motor that steps. Default: motor2; of a CSV file the column motor_deg, else tau2_deg."""
    axis: Literal["yaw", "pitch", "roll"] | None = None
    """Angle of the eye. Default: yaw; of a CSV file eye_deg, of a prototype log the rotation of its movement."""
    row_times: Literal["even", "row-by-row", "nominal"] = "even"
    """Time of a prototype log, which has none: one interval from its motors, each row by itself, or 10 ms."""
    until: float | None = None
    """Leave out of recordings what comes after this time, s: a sensor that creeps long after the step."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/sysid-DATE-TIME)")] = None
    """Run directory, new or empty."""

    def run(self) -> dict[str, Any]:
        """Identify, write the run directory, and return the numbers."""
        from orient_eye.run_directory import RunDirectory
        from orient_eye.sysid import identify_plant, identify_recordings, read_recordings
        from orient_eye.sysid.report import write_report

        if self.recording:
            default = Sysid()
            for name in ("plant", "amplitudes", "held_out", "accurate"):
                if getattr(self, name) != getattr(default, name):
                    raise InputError(f"--{name.replace('_', '-')} is for a plant; leave it out beside --recording")
            steps = read_recordings(self.recording, self.motor, self.axis, self.row_times, self.until)
            found = identify_recordings(steps)
        else:
            plant = self._plant()
            motor, axis = self.motor or "motor2", self.axis or "yaw"
            found = identify_plant(plant, self.amplitudes, self.held_out, motor, axis)
        run = RunDirectory.create(self.out, "sysid", self)
        result = {**write_report(found, run.path), "out": str(run.path)}
        self._tell(found, result)
        return result

    def _plant(self) -> "Plant":
        from orient_eye.plants import make_plant

        if self.accurate and self.plant != "mujoco":
            raise InputError(f"--accurate is a setting of plant mujoco, not of {self.plant}; leave it out")
        return make_plant(self.plant, **({"accurate": True} if self.accurate else {}))

    def _tell(self, found: "Identification", result: dict[str, Any]) -> None:
        say(_steps_table(found))
        say(_models_table(found))
        if found.held_out_fit:
            what = "surrogate on steps not fitted" if found.held_out else "first order, predicted from the others"
            say(f"{what} (rms in deg, R²):")
            say(_escaped(", ".join(f"{h.name}: {h.rms_deg:.3f}, {h.r_squared:.5f}" for h in found.held_out_fit)))
        for warning in found.warnings:
            say(f"[yellow]note:[/yellow] {_escaped(warning)}")
        number = found.surrogate
        say(
            f"surrogate: K = {number.K:.4f} ± {found.K_half_width:.2g}, w0 = {number.w0:.3f} ± "
            f"{found.w0_half_width:.2g} rad/s (95 %), in {_escaped(result['out'])}/surrogate.json"
        )


def _steps_table(found: "Identification") -> "Table":
    from rich.table import Table

    table = Table(title="First order, each step by itself (± 95 %)")
    for name in ("step", "motor", "K", r"w0 \[rad/s]", r"rms \[deg]", "R²"):
        table.add_column(name, justify="left" if name == "step" else "right", no_wrap=name != "step")
    for step, (fit, *_) in zip(found.steps, found.fits, strict=True):
        numbers = (f"{step.amplitude_deg:.4g}", str(fit["K"]), str(fit["w0"]), f"{fit.rms_deg:.3f}")
        table.add_row(_escaped(step.name.removesuffix(" deg")), *numbers, f"{fit.r_squared:.4f}")
    return table


def _models_table(found: "Identification") -> "Table":
    from rich.table import Table

    table = Table(title="All steps together, model by model", show_lines=True)
    for name in ("model", "parameters (± 95 %)", "rms\n\\[deg]", "AICc", "held out\nrms \\[deg]"):
        table.add_column(name, justify="left" if name.startswith(("model", "par")) else "right")
    least = min(row.aicc for row in found.compared)
    best = found.preferred
    for row in found.compared:
        parameters = "\n".join(
            f"{e.parameter.name} = {e} {e.parameter.unit.removeprefix('deg/deg')}".rstrip()
            + (" (at its bound)" if e.at_bound else "")
            for e in row.fit.estimates
        )
        held_out = f"{row.held_out_rms_deg:.3f}" if row.held_out else "-"
        title = f"[bold]{row.fit.model.title}[/bold]\npreferred" if row is best else row.fit.model.title
        table.add_row(title, parameters, f"{row.fit.rms_deg:.3f}", f"+{row.aicc - least:.1f}", held_out)
    return table


def _escaped(text: str) -> str:
    from rich.markup import escape

    return escape(text)
