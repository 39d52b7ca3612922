"""The weights of a task whose owner gives none: shipped, remembered, or solved on its plant, and by what rule.

    task = with_known_weights(task)
    task.weights, task.weights_from                  # "solved by thesis 4.4.5 at B = 35, ..."

In this order:

1. Shipped in `models/weights.json`, for the plants of the thesis.
2. Remembered in the user's cache, from an earlier solution.
3. Thesis 4.4.5: the saccade of 30 deg with B = 35 and the k0 at which its overshoot sets in is optimal.
4. Where that has no solution: 4.4.5 at the fastest saccade of 30 deg that overshoots by 1 % at most.
5. Where that has none either, `by_rule`. So also, at once, on a plant with pulse rates of its own (a rig): B = 35 is
   the thesis' choice for the thesis' eye, and where a motor is at its limits the equations are singular.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.files import read_json, write_json
from orient_eye.motor import redundant
from orient_eye.plants.fixation import knows_elastics
from orient_eye.resources import data_folder, user_cache
from orient_eye.task.actions import B_RANGE, K0_RANGE, PulseStepActions
from orient_eye.task.judge import JUDGES
from orient_eye.task.solved_weights import ChosenSaccade, Resolved, Steps, action_of, resolve, solve_at, told
from orient_eye.task.targets import make_targets

if TYPE_CHECKING:
    from orient_eye.task.saccade import Outcome, SaccadeTask

Array = NDArray[np.float64]
_RULE = "4"  # changes when what is below does
OVERSHOOT = 0.01
"""Overshoot that the reference saccade may have."""
DURATION_SHARE = 2.9
"""Weighted duration over weighted energy at the reference saccade, by `by_rule`: as at the thesis' own (4.4.5)."""
OVERSHOOT_SHARE = 0.1
"""What 1 % of overshoot costs by `by_rule`, in units of what the reference saccade costs: what stays within the
settling band is cheap, what leaves it costs time."""
WORTH = 2.0
"""What standing still costs by `by_rule`, in units of what a saccade of 5 deg costs."""
ERROR_DEG, ERROR_AT_DEG = 0.25, 5.0
"""End-point error with which one can live, and the size of the saccade."""
ERROR_SHARE = 0.05
"""What that error costs by `by_rule` at least, in units of what that saccade costs: a policy is a few percent from the
best, and may not spend them on the end point."""
SLOW_OVERSHOOT = 0.09
"""Weight of the overshoot of saccades in all directions, over that of horizontal ones."""
FORCE = 0.0075
"""Weight of the force of fixations [1/N^2] over that of the accuracy."""
CABLES = {"accuracy": 3e9, "energy": 1.0, "duration": 2.5e7, "overshoot": 1e8, "force": 1e7}
"""Weights on an eye with more motors than axes. By 4.4.5 on B, the scale of D - F and k0 of saccades to the sides of
the six-motor eye at B = 45 accuracy came to 1.5e9 to 4.2e9, duration to 1.7e7 to 3.7e7, overshoot to 0.7e8 to 1.7e8;
that of saccades up and down has no solution. The force weighs the motors' squared change beyond the least, 1/rad^2."""
_GRID, _ROUNDS = 24, 4  # of the search of the fastest saccade


def with_known_weights(task: SaccadeTask) -> SaccadeTask:
    """The same task with weights, and words on where they are from.

    Raises:
        InputError: the plant makes no saccade by which weights could be set.
    """
    shipped = _key(task)  # which hold for any horizon and range
    for entry in _shipped():
        if entry["of"] == shipped:
            return replace(task, weights=entry["weights"], weights_from=entry["from"])
    identity = task.identity()
    key = {**identity, "weights": None, "rule": _RULE, "version": metadata.version("orient-eye")}
    name = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:24]
    file = user_cache("weights") / f"{name}.json"
    kept = _read(file, key)
    if kept is None:
        weights, where = solve(task)
        kept = {"of": key, "weights": weights, "from": where}
        with contextlib.suppress(InputError):  # a folder that cannot be written costs the next solution, nothing else
            write_json(file, kept)
    return replace(task, weights=kept["weights"], weights_from=kept["from"])


def solve(task: SaccadeTask, error_deg: float | None = None) -> tuple[dict[str, float], str]:
    """Weights solved on the task's plant, and where they are from, in words; steps 3 to 5 above."""
    if "force" in task.weights:
        return in_all_directions(task, error_deg)
    if task.plant.pulse_rates is not None or error_deg is not None:
        return by_rule(task, ERROR_DEG if error_deg is None else error_deg)
    try:
        saccade = resolve(task, ChosenSaccade())
        return solve_at(task, saccade, Steps()), f"solved by thesis 4.4.5 at {told(task, saccade.action)}"
    except InputError:
        saccade, _ = fastest(task)
    try:
        weights = solve_at(task, saccade, Steps())
        command = told(task, saccade.action)
        return weights, f"solved by thesis 4.4.5 at the fastest saccade with {OVERSHOOT:.0%} overshoot, {command}"
    except InputError:
        return by_rule(task)


def in_all_directions(task: SaccadeTask, error_deg: float | None = None) -> tuple[dict[str, float], str]:
    """Weights of a task whose targets are directions of gaze, from the same plant's saccades about one axis.

    Accuracy and duration weigh as there. Overshoot weighs `SLOW_OVERSHOOT` of that: where the eye is slow, up and down,
    4.4.5 gives so little, the best saccade is the same, and the cliff below the best k0 is gentler. The force of
    fixations weighs `FORCE` in proportion to the accuracy, and nothing where no elastics are known.

    Args:
        task: its weights do not matter.
        error_deg: end-point error with which one can live [deg], at 5 deg; None for 4.4.5.
    """
    if redundant(task.plant.motors):
        force = {} if knows_elastics(task.plant) else {"force": 0.0}
        return {**CABLES, **force}, "rounded from thesis 4.4.5 on the six-motor eye at B = 45 (docs/six.md)"
    targets, plain = make_targets(None, task.plant), task.actions.plain
    of_pulse = {key: plain.identity().get(key) for key in ("pulse", "C", "speed_limit")}
    options = {key: value for key, value in of_pulse.items() if value is not None}
    actions = PulseStepActions(task.plant, targets.driven, **options)
    some = JUDGES[targets.of].any_weights
    simple = replace(task, actions=actions, targets=targets, judge=targets.of, weights=some)
    if error_deg is None:
        simple = with_known_weights(simple)
        found, where = dict(simple.weights), simple.weights_from
    else:
        found, where = solve(simple, error_deg)
    elastics = knows_elastics(task.plant)
    weights = {
        **found,
        "overshoot": SLOW_OVERSHOOT * found["overshoot"],
        "force": FORCE * found["accuracy"] if elastics else 0.0,
    }
    unknown = "" if elastics else "; no weight of the force, as no elastics are known"
    return weights, f"of {targets.name} saccades, the overshoot's times {SLOW_OVERSHOOT:g}{unknown} ({where})"


def fastest(task: SaccadeTask, size_deg: float | None = None) -> tuple[Resolved, Outcome]:
    """The saccade that settles first with `OVERSHOOT` at most, by search over B and k0; D rests on the target.

    Args:
        task: its weights do not matter.
        size_deg: of the saccade, from straight ahead; None for 30 deg or as far as the targets go.

    Raises:
        InputError: no saccade settles.
    """
    target = None if size_deg is None else (size_deg, *[0.0] * (len(task.targets.angles) - 1))
    at = resolve(task, ChosenSaccade(target=target, k0=1.0))  # D is what is needed of it
    D = at.chosen.D
    assert D is not None
    bounds = {n.symbol: (n.low, n.high) for n in task.actions.numbers}
    window: dict[str, Array] = {name: np.log(bounds[name]) for name in ("B", "k0")}
    best: Array = np.zeros(0)
    for _ in range(_ROUNDS):
        grids = (np.linspace(window[name][0], window[name][1], _GRID) for name in ("B", "k0"))
        pairs = np.exp(np.stack([g.ravel() for g in np.meshgrid(*grids)], axis=1))
        which = np.zeros(len(pairs), int)
        actions = np.stack([action_of(task, B, D, k0) for B, k0 in pairs])
        measures = task.perform(at.start[which], actions, at.target[which]).measures
        late = np.where(measures.settled & ~measures.failed, measures.settling_time_s, np.inf)
        cost = np.where(measures.overshoot <= OVERSHOOT, late, late + 10 + 1e3 * np.nan_to_num(measures.overshoot))
        best = pairs[cost.argmin()]
        if not np.isfinite(cost.min()):
            raise InputError(
                f"no pulse-step brings the eye of plant {task.plant.name!r} to rest within {task.horizon_s:g} s, so "
                "its weights cannot be solved; give the weights"
            )
        for name, value in zip(("B", "k0"), best, strict=True):
            half = 0.15 * (window[name][1] - window[name][0])
            low, high = np.log(bounds[name])
            window[name] = np.clip([np.log(value) - half, np.log(value) + half], low, high)
    action = action_of(task, float(best[0]), D, float(best[1]))
    found = replace(at, action=action, chosen=replace(at.chosen, B=float(best[0]), k0=float(best[1])))
    return found, task.perform(found.start, action[None], found.target)


def by_rule(task: SaccadeTask, error_deg: float = ERROR_DEG) -> tuple[dict[str, float], str]:
    """Weights in stated proportions at the fastest saccades, and where they are from, in words.

    The reference is the fastest saccade of 30 deg, or as far as the targets go. Energy has weight 1. The duration of
    the reference weighs `DURATION_SHARE` times its energy, and 1 % of overshoot `OVERSHOOT_SHARE` times both. The
    accuracy weighs as much as the largest of these demands:

    - A saccade of 5 deg, and the reference, end `error_deg` short where energy saved and accuracy lost balance: energy
      E grows with the square of the amplitude a, so its slope is 2 E / a, and that of lambda_a sin^2(d / 2) is
      lambda_a d / 2 [rad].
    - To end `error_deg` off costs `ERROR_SHARE` of a saccade of 5 deg.
    - A saccade of 5 deg is worth its cost `WORTH` times over: else the best is not to move.

    Args:
        task: its weights do not matter.
        error_deg: end-point error with which one can live [deg], at 5 deg.

    Raises:
        InputError: an error that is none, a reward with other terms than the thesis', or no saccade that settles.
    """
    if not 0 < error_deg < 90:
        raise InputError(f"the end-point error that one can live with is positive, got {error_deg} deg")
    saccade, large = fastest(task)
    _, small = fastest(task, min(ERROR_AT_DEG, task.targets.limit_deg))
    if set(large.reward.terms) != {"accuracy", "energy", "duration", "overshoot"}:
        raise InputError(f"no rule sets the weights of {', '.join(large.reward.terms)}; give the weights")
    terms = [{name: float(-value[0]) for name, value in o.reward.terms.items()} for o in (small, large)]
    moved = [float(np.deg2rad(o.measures.amplitude_deg[0])) for o in (small, large)]
    duration = DURATION_SHARE * terms[1]["energy"] / terms[1]["duration"]
    balance = max(4 * t["energy"] / (a * np.deg2rad(error_deg)) for t, a in zip(terms, moved, strict=True))
    cost = terms[0]["energy"] + duration * terms[0]["duration"]
    felt = ERROR_SHARE * cost / np.sin(np.deg2rad(error_deg) / 2) ** 2
    worth = WORTH * cost / np.sin(moved[0] / 2) ** 2
    weights = {
        "accuracy": float(max(balance, felt, worth)),
        "energy": 1.0,
        "duration": duration,
        "overshoot": OVERSHOOT_SHARE * (1 + DURATION_SHARE) * terms[1]["energy"] / OVERSHOOT,
    }
    return weights, f"by rule (docs/weights.md) at the fastest saccade, {told(task, saccade.action)}"


def bounds(task: SaccadeTask) -> dict[str, tuple[float, float]]:
    """Low and high of the action's numbers, by name."""
    actions = task.actions
    return {name: (float(n.low), float(n.high)) for name, n in zip(actions.names, actions.numbers, strict=True)}


def compared_with_thesis(task: SaccadeTask) -> str:
    """One line: how bounds and weights differ from those of the thesis' low-pass eye in the same case."""
    own = {(n.symbol, n.low, n.high) for n in task.actions.plain.numbers}
    of_thesis = {"B": B_RANGE, "k0": K0_RANGE}
    differ = [s for s, ends in of_thesis.items() if any(symbol == s and (lo, hi) != ends for symbol, lo, hi in own)]
    told = [f"{s} from {of_thesis[s][0]:g} to {of_thesis[s][1]:g} 1/s" for s in differ]
    actions = task.actions.plain.identity()
    for entry in _shipped():
        key = entry["of"]
        same = all(key["actions"].get(name) == actions.get(name) for name in ("actions", "pulse", "C"))
        if key["plant"]["plant"] == "lpf" and same and (key["judge"], key["band"]) == (task.judge, task.band):
            shares = {name: task.weights[name] / value for name, value in entry["weights"].items()}
            told += [f"{1 / r:.2g} times the weight of {name}" for name, r in shares.items() if r and abs(r - 1) > 0.01]
            break
    else:
        told.append("no weights for this case" if task.judge == "orientation" else "no saccades in all directions")
    return f"the thesis' eye has {', '.join(told)}" if told else "bounds and weights are those of the thesis' eye"


def _key(task: SaccadeTask) -> dict[str, Any]:
    """What shipped weights are of, in plain values."""
    identity = task.plain.identity()
    actions = {key: value for key, value in identity["actions"].items() if key not in ("low", "high", "rates")}
    kept = {key: identity[key] for key in ("plant", "judge", "band")}
    return {**kept, "actions": actions, "targets": task.targets.name}


def _read(file: Path, key: dict[str, Any]) -> dict[str, Any] | None:
    try:
        kept: dict[str, Any] = read_json(file, hint="solve them again")
        kept["weights"] = JUDGES[key["judge"]].weights(kept["weights"])
        return kept if kept["of"] == key and isinstance(kept["from"], str) else None
    except (ValueError, KeyError, TypeError, AttributeError):  # none, or damaged: solve again
        return None


def _shipped() -> list[dict[str, Any]]:
    shipped: list[dict[str, Any]] = read_json(data_folder("models") / "weights.json", hint="install orient-eye again")
    return shipped
