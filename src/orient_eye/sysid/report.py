"""What an identification leaves behind: surrogate, tables, pictures, recording.

summary = write_report(found, run.path)
"""

import csv
import io
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.figures import save
from orient_eye.figures.identification import figure_3_5, figure_3_6, recorded_steps
from orient_eye.files import write_text
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import make_plant
from orient_eye.recording import record
from orient_eye.rig import to_toml
from orient_eye.state import State
from orient_eye.sysid.comparison import Compared, HeldOut
from orient_eye.sysid.first_rig import first_rig
from orient_eye.sysid.fit import Fit
from orient_eye.sysid.identification import Identification
from orient_eye.sysid.models import MODELS
from orient_eye.sysid.replay import replay

_SHOWN_STEPS = 9  # of a plant, in the recording and in Figure 3.6


def write_report(found: Identification, folder: Path, force: bool = False) -> dict[str, Any]:
    """Write all files of an identification into a folder.

    surrogate.json, unless the data do not tell its numbers and it is not forced; fits.json and fits.csv, every fit
    with its parameters and intervals; figure_3_5.png and figure_3_6.png for a plant, recordings.png for recordings;
    recording.rrd; and for recordings rig.toml, the rig or a first description of it.

    Returns:
        The result as plain values, with the names of the files.
    """
    result = summary(found)
    told = ("steps", "models", "held_out", "warnings")
    details = {**found.surrogate.details, **{key: result[key] for key in told}}
    details["data"] = [s.source for s in found.steps if s.source]
    files = []
    if force or not found.undetermined:
        replace(found.surrogate, details=details).save(folder / "surrogate.json")
        files.append("surrogate.json")
    if found.plant is None:
        rig = first_rig(found.steps, found.surrogate.axis) if found.rig is None else to_toml(found.rig)
        write_text(folder / "rig.toml", rig)
        files.append("rig.toml")
    entries = list(_entries(found))
    write_text(folder / "fits.json", json.dumps(entries, indent=2) + "\n")
    write_text(folder / "fits.csv", _csv(entries))
    files += ["fits.json", "fits.csv", *_pictures(found, folder), *_recording(found, folder)]
    return {**result, "files": files}


def summary(found: Identification) -> dict[str, Any]:
    """The result as plain values, for `--json`, without NaN or infinity."""
    number = found.surrogate
    by_model = {row.fit.model.name: row for row in found.compared}
    least = min(row.aicc for row in found.compared)
    numbers: dict[str, Any] = {}
    for name in found.surrogate_model.names:
        numbers |= {name: getattr(number, name), f"{name}_interval": list(number.intervals.get(name, (None, None)))}
    return {
        "model": found.surrogate_model.name,
        **numbers,
        "axis": number.axis,
        "motor": number.motor,
        "amplitudes_deg": None if number.amplitudes is None else list(number.amplitudes),
        "undetermined": list(found.undetermined),
        "source": number.source,
        "steps": [_step(found, i) for i in range(len(found.steps))],
        "models": {name: _model(row, least) for name, row in by_model.items()},
        "preferred": found.preferred.fit.model.name,
        "held_out": [_held_out(h) for h in found.held_out_fit],
        "warnings": list(found.warnings),
    }


def _step(found: Identification, index: int) -> dict[str, Any]:
    """One step with its first-order fit."""
    step, fit = found.steps[index], found.fits[index][0]
    row: dict[str, Any] = {"name": step.name, "amplitude_deg": step.amplitude_deg}
    row["settled_gain"] = _finite(step.settled_gain)  # no number where the motor came back
    for e in fit.estimates:
        row |= {e.parameter.name: e.value, f"{e.parameter.name}_interval": _interval(e.value, e.half_width)}
    return row | {"rms_deg": fit.rms_deg, "r_squared": fit.r_squared}


def _model(row: Compared, least: float) -> dict[str, Any]:
    fit = row.fit
    return {
        **{e.parameter.name: e.value for e in fit.estimates},
        **{f"{e.parameter.name}_interval": _interval(e.value, e.half_width) for e in fit.estimates},
        "rms_deg": fit.rms_deg,
        "r_squared": fit.r_squared,
        "aicc_above_least": _finite(row.aicc - least),
        "held_out_rms_deg": _finite(row.held_out_rms_deg),
        "held_out": [_held_out(h) for h in row.held_out],
        "warnings": list(fit.warnings),
    }


def _held_out(judged: HeldOut) -> dict[str, Any]:
    return {"name": judged.name, "rms_deg": judged.rms_deg, "r_squared": judged.r_squared}


def _interval(value: float, half_width: float) -> list[float | None]:
    return [_finite(value - half_width), _finite(value + half_width)]


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _entries(found: Identification) -> Iterator[dict[str, Any]]:
    """Every fit, flat."""
    for step, fits in zip(found.steps, found.fits, strict=True):
        for fit in fits:
            yield _entry(step.name, step.amplitude_deg, fit)
    for row in found.compared:
        held_out = {"held_out_rms_deg": _finite(row.held_out_rms_deg), "aicc": _finite(row.aicc)}
        yield _entry("all", None, row.fit) | held_out


def _entry(name: str, amplitude: float | None, fit: Fit) -> dict[str, Any]:
    entry: dict[str, Any] = {"fitted_to": name, "amplitude_deg": amplitude, "model": fit.model.name}
    for e in fit.estimates:
        low, high = _interval(e.value, e.half_width)
        symbol = e.parameter.name
        entry |= {symbol: e.value, f"{symbol}_low": low, f"{symbol}_high": high, f"{symbol}_at_bound": e.at_bound}
    return entry | {
        "rms_deg": fit.rms_deg,
        "r_squared": fit.r_squared,
        "samples": fit.samples,
        "effective_samples": fit.effective_samples,
        "autocorrelation": fit.autocorrelation,
        "condition": _finite(fit.condition),
        "warnings": list(fit.warnings),
    }


def _csv(entries: list[dict[str, Any]]) -> str:
    symbols = dict.fromkeys(p.name for model in MODELS.values() for p in model.parameters)
    columns = ["fitted_to", "amplitude_deg", "model"]
    columns += [f"{s}{end}" for s in symbols for end in ("", "_low", "_high", "_at_bound")]
    columns += ["rms_deg", "r_squared", "samples", "effective_samples", "autocorrelation", "condition"]
    columns += ["aicc", "held_out_rms_deg", "warnings"]
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({**e, "warnings": "; ".join(e["warnings"])} for e in entries)
    return out.getvalue()


def _pictures(found: Identification, folder: Path) -> list[str]:
    if found.trajectory is None:
        save(recorded_steps(found), folder / "recordings.png")
        return ["recordings.png"]
    save(figure_3_5(found), folder / "figure_3_5.png")
    save(figure_3_6(found, _shown(len(found.steps))), folder / "figure_3_6.png")
    return ["figure_3_5.png", "figure_3_6.png"]


def _recording(found: Identification, folder: Path) -> list[str]:
    model, steps = None, list(found.steps)
    reference: Trajectory | None
    if found.trajectory is not None and found.plant is not None:
        model = found.plant.drawn()
        shown = _shown(len(found.steps))
        trajectory, steps = found.trajectory[shown], [found.steps[i] for i in shown]
        reference = _surrogate_trajectory(found, trajectory)
        notes = "Step responses of the plant"
        notes += "" if reference is None else ", in grey the surrogate's"
    else:
        trajectory, reference = replay(steps), replay(steps, found.answer)
        notes = (
            f"Recorded step responses, in grey the fitted {found.surrogate_model.title}; the ball stands for the eye "
            "of the rig"
        )
    titles = [s.name for s in steps]
    record(folder / "recording.rrd", trajectory, model=model, titles=titles, reference=reference, notes=notes)
    return ["recording.rrd"]


def _shown(count: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, min(count, _SHOWN_STEPS)).round().astype(int))


def _surrogate_trajectory(found: Identification, trajectory: Trajectory) -> Trajectory | None:
    """The surrogate moved as the plant's motor did; None where it cannot follow."""
    plant = make_plant("lpf", surrogate=found.surrogate, step_s=float(trajectory.time[1]))
    motor = trajectory.motor[..., [trajectory.motor_names.index(found.surrogate.motor)]]
    resting = np.full_like(motor[:, 0], found.surrogate.rest)
    at_rest = State(trajectory.orientation[:, 0], resting)  # from which an ideal step jumps
    try:
        return plant.move(motor, at_rest).trajectory()
    except InputError:  # an eye that starts turned about another axis, as under gravity
        return None
