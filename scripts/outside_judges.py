"""Saccades of policies, sampled and with noise, as other people's programs find them: their numbers over ours.

    pip install "orient-eye[judges]"
    python scripts/outside_judges.py                       # prints the table of docs/judges.md: half a minute
    python scripts/outside_judges.py --policies runs/my-run --rate 1000 --noise 0.01

Ours are those of the simulated movement itself, without sampling and noise: amplitude from the first to the last
sample, peak velocity, and how long the gaze is faster than 30 deg/s.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.exchange.gaze import GazeRecord
from orient_eye.exchange.record import EyeRecord, recorded
from orient_eye.learning.policy import Policy
from orient_eye.movement.trajectory import Trajectory
from orient_eye.movement.velocity_threshold import THRESHOLD_DEG_S, above
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
SIZES_DEG = np.array([2, 3, 5, 7, 10, 14, 20, 27, 35], float)
_SHORTEST_MS = 10
_FACTOR = 6  # by which pymovements multiplies its threshold


@dataclass(frozen=True)
class Events:
    """Saccades that a program found; every field is (events,), times in s."""

    onset_s: Array
    offset_s: Array
    amplitude_deg: Array
    peak_velocity_deg_s: Array


@dataclass(frozen=True)
class Judgement:
    """What a program found of known saccades.

    Attributes:
        found: share of the saccades that an event overlaps.
        others: events that overlap none.
        amplitude, peak_velocity, duration: of the largest event that overlaps, over ours, (saccades,); NaN where none
            does.
    """

    found: float
    others: int
    amplitude: Array
    peak_velocity: Array
    duration: Array


def of_policy(name: str, sizes_deg: Array = SIZES_DEG) -> Trajectory:
    """Saccades of a policy around straight ahead."""
    policy = Policy.load(name)
    task = policy.task()
    start, target = saccades(task.targets, *task.targets.symmetric(sizes_deg))
    return task.trajectory(start, policy.act(start.orientation, target), target)


def judged(events: Events, record: EyeRecord, trajectory: Trajectory) -> Judgement:
    """Events of a recording held against the saccades that it is made of."""
    bout = above(trajectory, of="gaze")
    onset, offset = (record.starts_s + moment for moment in (bout.onset_s, bout.offset_s))
    looks = rotations.gaze(trajectory.orientation)
    ours = (
        rotations.angle_between_directions(looks[:, 0], looks[:, -1]),
        bout.peak_velocity_deg_s,
        bout.duration_s,
    )
    overlaps = (events.onset_s[None] <= offset[:, None]) & (events.offset_s[None] >= onset[:, None])
    if not overlaps.size:
        return Judgement(0.0, 0, *np.full((3, len(trajectory)), np.nan))
    largest = np.where(overlaps, events.amplitude_deg, -np.inf).argmax(axis=1)
    theirs = (events.amplitude_deg, events.peak_velocity_deg_s, events.offset_s - events.onset_s)
    found = overlaps.any(axis=1)
    ratios = (np.where(found, of_them[largest] / of_us, np.nan) for of_them, of_us in zip(theirs, ours, strict=True))
    return Judgement(float(found.mean()), int((~overlaps.any(axis=0)).sum()), *ratios)


# --- the judges -----------------------------------------------------------------------------------


def by_ours(gaze: GazeRecord) -> Events:
    """What `orient-eye compare` finds in the same samples."""
    found = gaze.saccades()
    return Events(found.onset_s, found.offset_s, found.amplitude_deg, found.peak_velocity_deg_s)


def _pymovements(gaze: GazeRecord, method: str, **options: Any) -> Events:
    """Saccades that a detector of pymovements finds; of `ivt`, what lies between two fixations."""
    import polars
    import pymovements as pm

    frame = polars.DataFrame({"time": 1e3 * gaze.time, "x": gaze.horizontal_deg, "y": gaze.vertical_deg})
    experiment = pm.gaze.Experiment(sampling_rate=gaze.rate_hz)
    read = pm.Gaze(frame, experiment=experiment, time_column="time", time_unit="ms", position_columns=["x", "y"])
    read.pos2vel("savitzky_golay", window_length=7, degree=2)
    read.detect(method, **options)
    if method == "ivt":
        read.events = pm.Events(polars.DataFrame(_between(read.events.frame, gaze)))
    read.compute_event_properties(["amplitude", "peak_velocity"])
    events = read.events.frame.filter(polars.col("name") == "saccade")
    columns = (events[name].to_numpy().astype(float) for name in ("onset", "offset", "amplitude", "peak_velocity"))
    onset, offset, amplitude, peak = columns
    return Events(onset / 1e3, offset / 1e3, amplitude, peak)


def _between(fixations: Any, gaze: GazeRecord) -> dict[str, Any]:
    """What lies between two fixations of a frame of pymovements, and in no gap; times in ms."""
    onset, offset = fixations["offset"].to_numpy()[:-1], fixations["onset"].to_numpy()[1:]
    first, last = (np.searchsorted(1e3 * gaze.time, moment - 1e-6) for moment in (onset, offset))
    gaps = np.concatenate([[0], np.cumsum(np.isnan(gaze.horizontal_deg))])
    whole = gaps[last + 1] == gaps[first]
    return {"name": ["saccade"] * int(whole.sum()), "onset": onset[whole], "offset": offset[whole]}


def by_engbert(gaze: GazeRecord) -> Events:
    """pymovements, threshold from the noise: Engbert and Kliegl 2003, as Engbert et al. 2015 tell it."""
    return _pymovements(gaze, "microsaccades", threshold="engbert2015", minimum_duration=_SHORTEST_MS)


def by_fixed_threshold(gaze: GazeRecord) -> Events:
    """pymovements, the same at 30 deg/s."""
    each = THRESHOLD_DEG_S / _FACTOR
    return _pymovements(gaze, "microsaccades", threshold=(each, each), minimum_duration=_SHORTEST_MS)


def by_ivt(gaze: GazeRecord) -> Events:
    """pymovements, what lies between fixations of at least 40 ms by I-VT at 30 deg/s: Salvucci and Goldberg 2000."""
    return _pymovements(gaze, "ivt", velocity_threshold=THRESHOLD_DEG_S, minimum_duration=40)


def by_remodnav(gaze: GazeRecord) -> Events:
    """REMoDNaV: Dar, Wagner and Hanke 2021."""
    from remodnav import EyegazeClassifier

    logging.getLogger("remodnav").setLevel(logging.WARNING)
    classifier = EyegazeClassifier(px2deg=1.0, sampling_rate=gaze.rate_hz)
    samples = np.rec.fromarrays([gaze.horizontal_deg, gaze.vertical_deg], names="x,y")
    events = classifier(classifier.preproc(samples, savgol_length=0.019, savgol_polyord=2))
    found = [event for event in events if event["label"] in ("SACC", "ISAC")]
    columns = (
        np.array([event[key] for event in found], float) for key in ("start_time", "end_time", "amp", "peak_vel")
    )
    return Events(*columns)


JUDGES: dict[str, Callable[[GazeRecord], Events]] = {
    "orient-eye, from the samples": by_ours,
    "pymovements, engbert2015": by_engbert,
    "pymovements, 30 deg/s": by_fixed_threshold,
    "pymovements, I-VT 30 deg/s": by_ivt,
    "REMoDNaV": by_remodnav,
}


@dataclass(frozen=True)
class Options:
    """Sample, judge, print."""

    policies: tuple[str, ...] = ("lpf-1", "lpf-human", "mujoco-1", "tavares-gaze", "modal-gaze", "six-gaze")
    """Shipped policies, or run directories."""
    rate: float = 500.0
    """Samples in a second, Hz."""
    noise: float = 0.02
    """Standard deviation of the noise on both angles, deg."""
    seed: int = 0
    """Of the noise."""


def main(options: Options) -> None:
    """Print a Markdown table, one row a policy and a judge."""
    print("| policy | judge | found | others | amplitude | peak velocity | duration |")
    print("|---|---|---|---|---|---|---|")
    for name in options.policies:
        trajectory = of_policy(name)
        record = recorded(trajectory, options.rate)
        gaze = record.gaze(options.noise, np.random.default_rng(options.seed))
        for judge, find in JUDGES.items():
            found = judged(find(gaze), record, trajectory)
            ratios = " | ".join(_spread(each) for each in (found.amplitude, found.peak_velocity, found.duration))
            count = round(found.found * len(trajectory))
            print(f"| {name} | {judge} | {count} of {len(trajectory)} | {found.others} | {ratios} |", flush=True)


def _spread(ratio: Array) -> str:
    """Median, and the smallest and the largest."""
    known = ratio[np.isfinite(ratio)]
    return f"{np.median(known):.2f} ({known.min():.2f} to {known.max():.2f})" if known.size else "-"


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
