"""`orient-eye sysid --physical`: fit an eye's MJCF to recordings and write it down."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orient_eye.errors import InputError

if TYPE_CHECKING:
    from orient_eye.cli.sysid import Sysid
    from orient_eye.rig import Rig
    from orient_eye.sysid.physical import PhysicalFit
    from orient_eye.sysid.physical_recordings import Measured

FITTED, PICTURE, RECORDING = "eye.xml", "recordings.png", "recording.rrd"
_OTHERS = ("amplitudes", "held_out", "motor", "axis", "model")  # options of the other ways to identify


def physical_of(command: "Sysid") -> dict[str, Any]:
    """What `orient-eye sysid --physical` does with its options.

    Raises:
        InputError: no recording, options that say nothing here, or see `physical`.
    """
    from orient_eye.rig import Rig

    options = dict(command.plant_options)
    eye = options.pop("eye", "thesis")
    if not command.recording:
        raise InputError("--physical fits an eye to recordings; name them: --recording FILE ...")
    given = [*(["plant"] if command.plant != "mujoco" else options)]
    for name in (*given, *(name for name in _OTHERS if getattr(command, name) is not None)):
        raise InputError(f"--{name.replace('_', '-')} says nothing to --physical; leave it out")
    return physical(
        command.recording,
        eye,
        command.frozen,
        command.out,
        row_times=command.row_times,
        until=command.until,
        rig=None if command.rig is None else Rig.load(command.rig),
        force=command.force,
    )


def physical(
    recordings: Sequence[Path],
    eye: str,
    frozen: Sequence[str] | None,
    out: Path | None,
    *,
    row_times: str = "even",
    until: float | None = None,
    rig: "Rig | None" = None,
    force: bool = False,
) -> dict[str, Any]:
    """Fit, write the fitted eye, physical.json, a picture and a recording into a run directory, and tell.

    Args:
        recordings: files, see `orient_eye.sysid.physical_recordings.read_physical`.
        eye: to start from, preset or MJCF file.
        frozen: parameters that keep the eye's value; None for the horizontal stiffness and rest lengths.
        out: run directory; None for runs/sysid-DATE-TIME.
        row_times: of prototype logs.
        until: leave out what comes later [s].
        rig: whose motors' units the recordings are in; None for deg.
        force: write the eye even with parameters that the recordings do not determine.

    Returns:
        What physical.json holds.

    Raises:
        InputError: the recordings do not determine the parameters and it is not forced (all but the eye is there
            then), or see `fit_physical`, `read_physical` and `RunDirectory.create`.
    """
    from orient_eye.cli.tables import say
    from orient_eye.run_directory import RunDirectory
    from orient_eye.sysid.fitted_eye import summary, write_eye
    from orient_eye.sysid.physical import fit_physical
    from orient_eye.sysid.physical_recordings import read_recordings

    measured = read_recordings(recordings, eye, row_times, until, rig)
    fit = fit_physical(measured, eye, frozen)
    told: dict[str, Any] = {"physical": True, "recording": list(recordings), "eye": eye, "frozen": list(fit.frozen)}
    told |= {"row_times": row_times, "until": until, "rig": rig and rig.name, "force": force}
    run = RunDirectory.create(out, "sysid", told)
    open_ends = tuple(dict.fromkeys([*fit.at_bound, *fit.undetermined]))
    if fit.ill_conditioned and not open_ends:
        open_ends = tuple(e.parameter.name for e in fit.estimates)
    written = force or not open_ends
    model = str(run.path / FITTED) if written else None
    files = [] if model is None else write_eye(fit, model)
    pictures = _show(fit, measured, run.path)
    result: dict[str, Any] = {**summary(fit), "model": model, "files": pictures, "out": str(run.path)}
    run.write_json("physical.json", result)
    _tell(fit)
    say(f"measured and fitted: {run.path}/{PICTURE}; orient-eye view {run.path}/{RECORDING}")
    if model is None:
        raise InputError(
            f"these recordings do not determine {', '.join(open_ends)}, so no eye was written (the fit is in "
            f"{run.path}): record movements of other axes, or name with --frozen also those that are to keep the "
            "eye's own value, or say --force"
        )
    if files:
        say(f"note: {FITTED} still refers to {', '.join(files)}; copy what it needs beside it", "yellow")
    say(f"fitted eye: {model} (orient-eye train --plant mujoco --eye {model})")
    return result


def _show(fit: "PhysicalFit", measured: "Sequence[Measured]", folder: Path) -> list[str]:
    """The picture and the recording of what was measured and what the fitted eye does; names of the files."""
    from orient_eye.eyes.model import build_model, motors
    from orient_eye.figures import save
    from orient_eye.figures.identification import fitted_eye
    from orient_eye.recording import record
    from orient_eye.sysid.fitted_eye import replayed

    model = build_model(fit.eye)
    save(fitted_eye(fit, measured, [motor.name for motor in motors(model)]), folder / PICTURE)
    trajectory, reference = replayed(fit, measured)
    values = ", ".join(f"{e.parameter.name} {e} {e.parameter.unit}" for e in fit.estimates)
    notes = f"Recorded movements, in grey those of the fitted eye ({values}), drawn as the eye {Path(fit.eye).name}."
    titles = [each.name for each in measured]
    record(folder / RECORDING, trajectory, model=model, titles=titles, reference=reference, notes=notes)
    return [PICTURE, RECORDING]


def _tell(fit: "PhysicalFit") -> None:
    from orient_eye.cli.tables import say, table

    rows = [
        {"name": e.parameter.name, "value": f"{e} {e.parameter.unit}", "note": _note(fit, e.parameter.name)}
        for e in fit.estimates
    ]
    rows += [{"name": name, "value": f"{value:.6g}", "note": "frozen"} for name, value in fit.frozen.items()]
    columns = {
        "parameter": lambda row: row["name"],
        "value (± 95 %)": lambda row: row["value"],
        "": lambda row: row["note"],
    }
    say(table(f"Eye {fit.eye}, fitted to the recordings.", columns, rows, left=("parameter", "value (± 95 %)", "")))
    say("angles tell only ratios of stiffness to friction: all of these are relative to what is frozen")
    say(f"residual {fit.rms_deg:.4f} deg rms, condition number {fit.condition:.3g} (1 is best)")
    if fit.held_out:
        each = ", ".join(f"{h.name}: {h.rms_deg:.4f}" for h in fit.held_out)
        say(f"each predicted from the others: {fit.held_out_rms_deg:.4f} deg rms ({each})")
    for warning in fit.warnings:
        say(f"note: {warning}", "yellow")


def _note(fit: "PhysicalFit", name: str) -> str:
    return "at its bound" if name in fit.at_bound else "undetermined" if name in fit.undetermined else ""
