"""A data set of eye tracking by the Brain Imaging Data Structure, BIDS 1.11 (https://bids.neuroimaging.io).

write_bids("dataset", trajectory, subject="robot")

dataset/dataset_description.json, README, participants.tsv, participants.json
dataset/sub-robot/beh/sub-robot_task-saccade_recording-eye1_physio.tsv.gz, .json       the samples
dataset/sub-robot/beh/sub-robot_task-saccade_recording-eye1_physioevents.tsv.gz, .json the saccades
"""

import gzip
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import __version__, listing, rotations
from orient_eye.errors import InputError
from orient_eye.exchange.record import GAP_S, REST_S, recorded
from orient_eye.files import explained, write_atomically, write_json, write_text
from orient_eye.movement.trajectory import Trajectory
from orient_eye.movement.velocity_threshold import THRESHOLD_DEG_S, above

Array = NDArray[np.float64]
VERSION = "1.11.1"
"""Of the standard."""
_MISSING = "n/a"
_DIGITS = ".9g"
_COLUMNS: dict[str, tuple[str, str]] = {
    "timestamp": ("s", "Time since the recording began."),
    "x_coordinate": ("deg", "Horizontal direction of gaze, from straight ahead, positive to the right."),
    "y_coordinate": ("deg", "Elevation of the gaze above the horizontal plane, positive up."),
    "torsion": (
        "deg",
        "2 atan(r_x), r the rotation vector from straight ahead; positive: the upper pole of the eye to its right.",
    ),
    "q_w": ("1", "Orientation, eye to head, a unit quaternion (head: x forward, y left, z up): its scalar part."),
    "q_x": ("1", "Its part along x."),
    "q_y": ("1", "Its part along y."),
    "q_z": ("1", "Its part along z."),
}
_EVENTS: dict[str, tuple[str, str]] = {
    "onset": ("s", f"When the eye becomes faster than {THRESHOLD_DEG_S:g} deg/s, on the timeline of the timestamps."),
    "duration": ("s", f"How long it is faster than {THRESHOLD_DEG_S:g} deg/s."),
    "trial_type": ("", "What it is."),
    "saccade": ("", "Number of the saccade in what was converted, from 1."),
    "amplitude": ("deg", "Angle between the directions of gaze at both ends of the saccade's samples."),
    "peak_velocity": ("deg/s", "Largest speed of the gaze."),
}


def write_bids(
    folder: str | Path,
    trajectory: Trajectory,
    *,
    subject: str = "robot",
    rate_hz: float | None = None,
    source: str = "orient-eye",
    eye: str = "left",
) -> list[Path]:
    """Write a data set of one participant, and one recording of one eye; returns its files.

    The saccades stand one after the other, as `orient_eye.exchange.record.recorded` says; gaps are `n/a`. Saccades that
    failed have no event, nor have those that are never faster than the threshold.

    Args:
        folder: for the data set, new or empty.
        trajectory: saccades of any plant.
        subject: label of the participant, letters and digits.
        rate_hz: samples in a second; None for that of the trajectory.
        source: what the saccades are, in words.
        eye: which it is, left or right (`orient_eye.eyes.model.side`).

    Raises:
        InputError: a label or an eye that is none, a folder that holds something, or what `recorded` refuses.
    """
    if not (subject.isascii() and subject.isalnum()):
        raise InputError(f"the label of a participant is made of letters and digits, got {subject!r}; sub- is added")
    if eye not in ("left", "right"):
        raise InputError(f"a recording is of the left or the right eye, got {eye!r}")
    folder = Path(folder)
    check_folder(folder)
    record = recorded(trajectory, rate_hz)
    stem = folder / f"sub-{subject}" / "beh" / f"sub-{subject}_task-saccade_recording-eye1_physio"
    gaze, q = record.gaze(), record.orientation
    samples = np.column_stack([gaze.time, gaze.horizontal_deg, gaze.vertical_deg, listing.torsion(q), q])
    about = {
        "PhysioType": "eyetrack",
        "RecordedEye": eye,
        "SampleCoordinateSystem": "eye-in-head",
        "SamplingFrequency": record.rate_hz,
        "StartTime": 0,
        "Manufacturer": "orient-eye",
        "SoftwareVersions": __version__,
        "TaskName": "saccade",
        "Description": (
            f"Simulated saccades of a robot eye, without noise: {source}. Before each the eye stands for {REST_S:g} s "
            f"where it starts; between two are {GAP_S:g} s without samples."
        ),
    }
    events = {
        "OnsetSource": "timestamp",
        "TaskName": "saccade",
        "Description": f"Saccades, found where the eye is faster than {THRESHOLD_DEG_S:g} deg/s.",
    }
    return [
        _write_table(stem, samples.tolist()),
        write_json(f"{stem}.json", _sidecar(about, _COLUMNS)),
        _write_table(Path(f"{stem}events"), _event_rows(trajectory, record.starts_s)),
        write_json(f"{stem}events.json", _sidecar(events, _EVENTS)),
        write_text(folder / "participants.tsv", f"participant_id\tspecies\nsub-{subject}\t{_MISSING}\n"),
        write_json(folder / "participants.json", {"species": {"Description": "None: it is a robot's eye."}}),
        write_text(folder / "README", _readme(source, len(trajectory))),
        write_json(folder / "dataset_description.json", _description(source)),
    ]


def check_folder(folder: Path) -> None:
    """Refuse a folder that holds something.

    Raises:
        InputError: it does, or is none.
    """
    with explained(folder):
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder} is not an empty folder; name a new one for the data set")


def _event_rows(trajectory: Trajectory, starts_s: Array) -> list[list[Any]]:
    bout, looks = above(trajectory, of="gaze"), rotations.gaze(trajectory.orientation[:, [0, -1]])
    amplitude = rotations.angle_between_directions(looks[:, 0], looks[:, 1])
    numbers = np.column_stack([starts_s + bout.onset_s, bout.duration_s, amplitude, bout.peak_velocity_deg_s])
    return [
        [onset, duration, "saccade", i, size, peak]
        for i, (onset, duration, size, peak) in enumerate(numbers.tolist(), start=1)
        if np.isfinite(duration)
    ]


def _sidecar(about: Mapping[str, Any], columns: Mapping[str, tuple[str, str]]) -> dict[str, Any]:
    told: dict[str, dict[str, Any]] = {
        name: {"Description": words, **({"Units": unit} if unit else {})} for name, (unit, words) in columns.items()
    }
    if "trial_type" in told:
        told["trial_type"]["Levels"] = {"saccade": "A saccade."}
    return {**about, "Columns": list(columns), **told}


def _write_table(stem: Path, rows: list[list[Any]]) -> Path:
    """Rows without a header, compressed; the same rows give the same file."""
    text = "".join("\t".join(map(_cell, row)) + "\n" for row in rows)
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb", mtime=0) as file:
        file.write(text.encode())
    return write_atomically(f"{stem}.tsv.gz", lambda temporary: temporary.write_bytes(packed.getvalue()))


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return format(value + 0.0, _DIGITS) if np.isfinite(value) else _MISSING
    return str(value)


def _readme(source: str, count: int) -> str:
    return (
        "# Saccades of a robot eye\n\n"
        f"{count} saccades, written by orient-eye {__version__}: {source}.\n\n"
        "The eye is simulated, so the samples have no noise, and torsion and the whole orientation are known. Columns\n"
        "and units are described in the JSON file beside each table; a table of samples has no header. Events are the\n"
        f"saccades, by a threshold of {THRESHOLD_DEG_S:g} deg/s.\n"
    )


def _description(source: str) -> dict[str, Any]:
    return {
        "Name": f"Saccades of a robot eye: {source}",
        "BIDSVersion": VERSION,
        "DatasetType": "raw",
        "Authors": ["orient-eye"],
        "GeneratedBy": [{"Name": "orient-eye", "Version": __version__, "Description": "Simulated saccades."}],
    }
