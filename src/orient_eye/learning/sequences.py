"""Saccades one after the other, each from where the one before came to rest: what becomes of torsion.

    start, target = drawn(task, 1, 200, random)      # sequences, saccades
    made = sequence(task, policy.act, target, start)
    listing_numbers(made)["ends"]["sd_deg"]          # how thick Listing's plane is

A single saccade begins with the torsion it is given; in a sequence with that which the saccades before it left.
"""

from collections.abc import Callable
from collections.abc import Sequence as Rows
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import listing, rotations
from orient_eye.errors import InputError
from orient_eye.learning.directions import angles_toward
from orient_eye.learning.evaluation import Act
from orient_eye.motor import names, ranges, redundant
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import (
    component_correlation,
    component_durations,
    end_of_shift,
    path_deviation,
    torsion_blip,
    toward,
)
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants.fixation import Fixations, knows_elastics
from orient_eye.state import State
from orient_eye.statics import degrees_per_motor
from orient_eye.task.generator_actions import GeneratorActions
from orient_eye.task.residual_actions import ResidualActions
from orient_eye.task.saccade import Outcome, SaccadeTask
from orient_eye.task.table import outcome_columns

Array = NDArray[np.float64]
FIRST = (1, 2, 5, 10, 20, 50, 100, 200, 500)
"""After so many saccades it is told how far torsion has come."""
FEWEST = 8
"""Ends through which a twisted plane is fitted."""
_RULES = {"least force": "of the least force", "listing": "zero", "fick": "of Fick's gimbal"}
_PULLS = 1e-6  # deg of a motor for a degree of torsion
_POOL = 200  # directions among which a start at Fick's torsion is looked for, a sequence


@dataclass(frozen=True)
class Sequence:
    """Saccades one after the other; several sequences side by side, the whole first one in the first rows.

    Attributes:
        task: in which they were made.
        sequences: how many.
        start: of each saccade, of (sequences x saccades).
        target: desired orientations, (sequences x saccades, 4).
        trajectory: of the saccades.
        measures: of what the task looks at.
        columns: as `orient_eye.task.table.outcome_columns`.
    """

    task: SaccadeTask
    sequences: int
    start: State
    target: Array
    trajectory: Trajectory
    measures: Measures
    columns: dict[str, Any]

    def __len__(self) -> int:
        """Saccades of each sequence."""
        return len(self.target) // self.sequences

    def first(self, count: int) -> Array:
        """Ends of the first saccades of every sequence, (n, 4)."""
        return self.measures.final.reshape(self.sequences, -1, 4)[:, :count].reshape(-1, 4)


def sequence(
    task: SaccadeTask,
    act: Act,
    target: Array,
    start: State,
    progress: Callable[[float], None] | None = None,
) -> Sequence:
    """Make sequences of saccades: each starts where the one before comes to rest, its motors where they stand.

    Args:
        task: whose saccades they are.
        act: chooses the actions.
        target: desired orientations, (sequences, saccades, 4).
        start: of the first saccades, of (sequences,).
        progress: is told the share that is done.

    Raises:
        InputError: other shapes, or a saccade that failed.
    """
    target = np.asarray(target, dtype=float)
    if target.ndim != 3 or target.shape[::2] != (len(start), 4) or not target.size:
        raise InputError(
            f"{len(start)} sequences have targets ({len(start)}, saccades, 4) with one saccade or more, got "
            f"{target.shape}"
        )
    low, high = ranges(task.plant.motors).T
    starts, outcomes, columns = [start], [], []
    for step in range(target.shape[1]):
        here, aim = starts[-1], target[:, step]
        action = act(here.orientation, aim)
        outcome = task.perform(here, action, aim)
        _require_sound(outcome, step)
        starts.append(State(outcome.measures.final, np.clip(outcome.command.final, low, high)))
        outcomes.append((outcome.movement.trajectory(), outcome.measures))
        columns.append(outcome_columns(task, here, aim, action, outcome))
        if progress is not None:
            progress((step + 1) / target.shape[1])
    order = np.arange(target[..., 0].size).reshape(target.shape[1::-1]).T.ravel()  # the steps' rows, by sequence
    return Sequence(
        task,
        len(start),
        State(*(np.concatenate([getattr(s, name) for s in starts[:-1]])[order] for name in ("orientation", "motor"))),
        target.reshape(-1, 4),
        _joined([trajectory for trajectory, _ in outcomes])[order],
        Measures(**{n: np.concatenate([vars(m)[n] for _, m in outcomes])[order] for n in vars(outcomes[0][1])}),
        {name: np.concatenate([c[name] for c in columns])[order] for name in columns[0]},
    )


def drawn(task: SaccadeTask, sequences: int, saccades: int, random: np.random.Generator) -> tuple[State, Array]:
    """Eyes that look straight ahead with the least force, (sequences,), and targets (sequences, saccades, 4).

    Targets have any eccentricity inside the cone as often as any other, so that they are densest straight ahead, as
    where people look. How thick a plane is that is twisted depends on that: evenly over the cone it is 1.3 times as
    thick.

    Raises:
        InputError: numbers below 1, or targets about one axis only.
    """
    if sequences < 1 or saccades < 1:
        raise InputError(f"a sequence has one saccade or more, got {sequences} sequences of {saccades}")
    if len(task.targets.angles) < 2:
        raise InputError(
            f"Listing's law is about saccades in all directions, these are among {task.targets.name} targets; choose a "
            "policy for gaze targets (orient-eye train --targets gaze)"
        )
    n = sequences * saccades
    away, around = task.targets.limit_deg * random.uniform(size=n), 2 * np.pi * random.uniform(size=n)
    shift = away[:, None] * np.stack([np.cos(around), np.sin(around)], axis=-1)
    target = task.targets.orientation(angles_toward(task.targets, toward(shift)))
    ahead = task.targets.orientation(np.zeros((sequences, len(task.targets.angles))))
    return task.targets.rest(ahead), target.reshape(sequences, saccades, 4)


def ficks_starts(task: SaccadeTask, sequences: int, random: np.random.Generator) -> State:
    """Eyes at rest with the torsion of Fick's gimbal, (sequences,), where that is farthest from Listing's.

    Raises:
        InputError: the motors hold it in too few of the directions that are drawn.
    """
    direction = rotations.gaze(task.targets.draw(_POOL * sequences, random)[1])
    torsion = listing.ficks_torsion(direction)
    orientation = listing.with_torsion(direction, torsion)
    held = np.isfinite(task.plant.held(orientation, names(task.plant.motors))).all(axis=1)
    if held.sum() < sequences:
        raise InputError(f"the motors of plant {task.plant.name!r} hold no eye at Fick's torsion; start straight ahead")
    farthest = np.argsort(np.where(held, -np.abs(torsion), np.inf))[:sequences]
    return task.targets.rest(orientation[farthest])


def listing_numbers(made: Sequence) -> dict[str, Any]:
    """What the saccades of sequences tell of Listing's law and of their paths; plain values.

    `ends` and `on_the_way` (all samples up to the settling times) are planes through orientations, as
    `orient_eye.listing.Plane`; `least_force` and `fick` are those of the same directions of gaze with these torsions;
    `usual` that of the usual command alone (None where the actions have none; of actions that take D from the statics
    what these impose), `first` how it came about.

    Raises:
        InputError: fewer than eight saccades.
    """
    ends, gaze = made.measures.final, rotations.gaze(made.measures.final)
    if len(ends) < FEWEST:
        raise InputError(f"a plane and its twist need {FEWEST} saccades or more, got {len(ends)}")
    surface, actions = least_force(made.task), made.task.actions
    usual = actions.fixations if isinstance(actions, (ResidualActions, GeneratorActions)) else None
    off = np.full(len(ends), np.nan) if surface is None else listing.torsion(ends) - surface.torsion(gaze)
    blip, deviation = (of(made.trajectory, made.measures) for of in (torsion_blip, path_deviation))
    correlation = component_correlation(made.trajectory, made.measures)
    error = gaze_error(made)
    aims = rotations.gaze(made.target)
    return {
        "saccades": len(ends),
        "sequences": made.sequences,
        "ends": _plane(ends),
        "on_the_way": _plane(on_the_way(made)),
        "least_force": None if surface is None else _plane(surface.orientation(gaze)),
        "usual": None if usual is None else _plane(usual.orientation(aims)),
        "fick": _plane(listing.with_torsion(gaze, listing.ficks_torsion(gaze))),
        "beside_least_force_deg": None if surface is None else _told(off, mean=np.mean, sd=np.std),
        "first": _first(made, off),
        "gaze_error_deg": _told(error, mean=np.mean, median=np.median, largest=np.max),
        "path_deviation": _told(deviation, median=np.median, p95=_p95),
        "component_correlation": _told(correlation, median=np.median, least=np.min),
        "torsion_blip_deg": _told(blip, median=np.median, p95=_p95, largest=np.max),
        "not_settled": int((~made.measures.settled).sum()),
    }


def stretching(made: Sequence, act: Act) -> dict[str, Any]:
    """How much longer the parts of oblique saccades take than saccades of their size alone, from the same starts.

    Only where the saccade alone stays inside the cone of targets, and neither part is below 30 % of the other. Plain
    values: how many parts were compared, and the median of the ratio of the smaller parts, and of the larger ones.
    """
    task, gaze = made.task, rotations.gaze(made.start.orientation)
    took = component_durations(made.trajectory, made.measures, task.band)
    shift = end_of_shift(made.trajectory, made.measures)
    ratio = np.full(took.shape, np.nan)
    for part in range(2):
        goal = toward(np.where(np.arange(2) == part, shift, 0.0), gaze)
        away = rotations.angle_between_directions(goal, [1.0, 0.0, 0.0])
        compared = np.flatnonzero(np.isfinite(took).all(axis=1) & (away <= task.targets.limit_deg))
        if compared.size:
            eccentric = rotations.to_euler(listing.with_torsion(goal[compared], 0.0))[:2]
            aim, start = task.targets.orientation(np.stack(eccentric, axis=-1)), made.start[compared]
            alone = task.perform(start, act(start.orientation, aim), aim).measures
            ratio[compared, part] = took[compared, part] / alone.settling_time_s
    smaller = np.abs(shift).argmin(axis=1)[:, None]
    parts = {"smaller": smaller, "larger": 1 - smaller}
    found = {name: np.take_along_axis(ratio, part, axis=1) for name, part in parts.items()}
    return {
        name: _told(values, median=np.median) | {"compared": int(np.isfinite(values).sum())}
        for name, values in found.items()
    }


def torsion_columns(made: Sequence) -> dict[str, Any]:
    """Columns of `Sequence.columns` with the number of the sequence and of the saccade before them, and more after.

    Torsion where it began and where it ended, the latter also beside that of the least force; how far the gaze ended
    from its target; blip, deviation from the straight path, and correlation of the components.
    """
    ends = made.measures.final
    surface = least_force(made.task)
    beside = {} if surface is None else {
        "beside_least_force_deg": listing.torsion(ends) - surface.torsion(rotations.gaze(ends))
    }  # fmt: skip
    return {
        "sequence": 1 + np.arange(len(ends)) // len(made),
        "saccade": 1 + np.arange(len(ends)) % len(made),
        **made.columns,
        "start_torsion_deg": listing.torsion(made.start.orientation),
        "final_torsion_deg": listing.torsion(ends),
        **beside,
        "gaze_error_deg": gaze_error(made),
        "torsion_blip_deg": torsion_blip(made.trajectory, made.measures),
        "path_deviation": path_deviation(made.trajectory, made.measures),
        "component_correlation": component_correlation(made.trajectory, made.measures),
    }


def imposed(task: SaccadeTask) -> str:
    """In words what the actions and the reward say of torsion before anything is learned."""
    actions, elastics = task.actions, knows_elastics(task.plant)
    force = task.weights.get("force", 0.0) if elastics else 0.0
    judged = (
        f"the reward favours that of the least force (weight {force:g})" if force else "the reward knows no torsion"
    )
    if task.judge == "orientation":
        judged = "the reward wants the target's whole orientation, torsion too"
    if isinstance(actions, GeneratorActions):
        return (
            "Imposed on torsion: at rest all of it. The actions tell B and k0; the motors go where the statics hold "
            f"the target, at the torsion {_rule(task)}. So Listing's law at rest is that of the statics, and nothing "
            "of it is learned, whatever the reward says of it."
        )
    if not isinstance(actions, ResidualActions):
        return f"Imposed on torsion: by the actions nothing, they tell D outright; {judged}."
    shift = {number.motor: number.high for number in actions.numbers if number.symbol == "D_shift"}
    turn = np.linalg.lstsq(degrees_per_motor(task.plant).T, [1.0, 0.0, 0.0], rcond=None)[0]  # a degree of torsion
    worth = min(
        shift[name] / abs(by) for name, by in zip(names(task.plant.motors), turn, strict=True) if abs(by) > _PULLS
    )
    told = ", ".join(f"{name} {high:.3g}" for name, high in shift.items())
    return (
        "Imposed on torsion: the policy's actions are told from a usual command, which holds the target at the torsion "
        f"{_rule(task)}, and may shift its D by up to {told} deg to either side, straight ahead {worth:.2g} "
        f"deg of torsion; {judged}."
    )


def _rule(task: SaccadeTask) -> str:
    """With which torsion the actions hold targets, as `orient_eye.plants.fixation.fixate` does, in words."""
    rule = getattr(task.actions, "rule", None) or ("least force" if knows_elastics(task.plant) else "listing")
    if rule == "least force" and redundant(task.plant.motors):
        return "of the least change of the motors from their pretension"
    return _RULES[rule]


def least_force(task: SaccadeTask) -> Fixations | None:
    """The fixations of least force; None where no elastics are known."""
    return Fixations.of(task.plant) if knows_elastics(task.plant) else None


def on_the_way(made: Sequence) -> Array:
    """Orientations from the starts to the settling times, (n, 4)."""
    inside = made.trajectory.time <= made.measures.settling_time_s[:, None]
    return np.asarray(made.trajectory.orientation[inside])


def gaze_error(made: Sequence) -> Array:
    """Angle between where the gaze came to rest and the target [deg], (sequences x saccades,)."""
    return rotations.angle_between_directions(rotations.gaze(made.measures.final), rotations.gaze(made.target))


def _first(made: Sequence, off: Array) -> list[dict[str, Any]]:
    """After some saccades, over all sequences: the plane of the ends so far, and the last ends beside least force."""
    counts = [count for count in FIRST if count < len(made)] + [len(made)]
    last = off.reshape(made.sequences, -1)
    return [
        {"saccades": n, **_plane(made.first(n)), "last_beside_least_force_deg": _told(last[:, n - 1], of=_size)["of"]}
        for n in counts
        if n * made.sequences >= FEWEST
    ]


def _plane(orientation: Array) -> dict[str, float]:
    plane = listing.fit_plane(orientation)
    left, down = plane.tilt_deg
    return {
        "sd_deg": plane.sd_deg,
        "tilt_left_deg": left,
        "tilt_down_deg": down,
        "twist": plane.twist,
        "twisted_sd_deg": plane.twisted_sd_deg,
    }


def _size(values: Array) -> float:
    return float(np.abs(values).mean())


def _p95(values: Array) -> float:
    return float(np.percentile(values, 95))


def _told(values: Array, **of: Any) -> dict[str, float | None]:
    """Numbers of the values that there are."""
    known = values[np.isfinite(values)]
    return {name: float(how(known)) if known.size else None for name, how in of.items()}


def _joined(parts: Rows[Trajectory]) -> Trajectory:
    """Batches of saccades as one."""
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("orientation", "angular_velocity", "command", "motor", "failed")
    }
    tension = [part.tension for part in parts if part.tension is not None]
    return replace(parts[0], **arrays, tension=np.concatenate(tension) if tension else None)


def _require_sound(outcome: Outcome, step: int) -> None:
    if outcome.measures.failed.any():
        raise InputError(
            f"saccade {step + 1} of sequence {int(outcome.measures.failed.argmax()) + 1} failed, so nothing can follow "
            "it; make a shorter sequence, or see the saccade with orient-eye predict"
        )
