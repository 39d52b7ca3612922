"""Reward weights from the saccade that should be optimal, thesis section 4.4.5.

    weights = solve_weights(SaccadeTask.of_case(make_plant("lpf"), "2-varying"))

Choose the optimal command of one saccade, set lambda_e = 1, and the other weights solve grad R = 0 over
(B, D, k0) at that command (4.47); gradients by central differences. Where several motors are driven, their B,
their k0, and D - F in proportion, are moved together. Tables and what they depend on: docs/weights.md.
"""

from __future__ import annotations

from dataclasses import asdict, astuple, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.state import State

if TYPE_CHECKING:  # what a task is made of knows the task's weights: the task imports this, not the other way round
    from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
_THESIS_PLANT = {"plant": "lpf", "K": 1.4758, "w0": 17.5, "motor": "motor2"}
_THESIS_D = 20.33  # deg, as printed; 30 deg / K = 20.328
_SYMBOLS = ("B", "D", "k0")
_RATES = (0.01, 1e4)  # 1/s, of B and k0 that somebody chooses
_STEPS = (1e-4, 5.0)  # half-widths of differences: less sees rounding, more another saccade
_SHOWS = 1e-6  # share of the amplitude
_LARGEST_DEG, _LEAST_DEG = 30.0, 0.01  # of the chosen saccade


@dataclass(frozen=True)
class ChosenSaccade:
    """The saccade that should be optimal; the thesis' choice by default.

    Attributes:
        start: where it begins: angles of the task's targets [deg]; None for straight ahead.
        target: where it should end; None for 30 deg along the first angle, or as far as the targets go.
        B: [1/s].
        D: of each driven motor; None for the positions at which the eye rests on the target, which for the thesis'
            saccade on its own low-pass plant is 20.33 deg as printed.
        k0: [1/s]; None for the value below which this saccade overshoots: the pole that k0 cancels on a linear plant
            with one (the thesis' 17.5), and found by bisection on another plant.

    Raises:
        InputError: numbers that are none.
    """

    start: tuple[float, ...] | None = None
    target: tuple[float, ...] | None = None
    B: float = 35.0
    D: tuple[float, ...] | None = None
    k0: float | None = None

    def __post_init__(self) -> None:
        for symbol, rate in (("B", self.B), ("k0", self.k0)):
            if rate is not None:
                real(f"{symbol} of the chosen saccade", rate, *_RATES, unit="1/s")
        for angles in (self.start, self.target, self.D):
            for angle in angles or ():
                real("an angle of the chosen saccade", angle, -180.0, 180.0, unit="deg")


@dataclass(frozen=True)
class Resolved:
    """A chosen saccade with everything found on a task's plant.

    Attributes:
        chosen: with no None left.
        start: the eye, (1,).
        target: orientation, (1, 4).
        action: (numbers,).
    """

    chosen: ChosenSaccade
    start: State
    target: Array
    action: Array


@dataclass(frozen=True)
class Steps:
    """Half-widths of the central differences.

    Those of B and D hardly matter: on the low-pass plant the weights keep three digits from a tenth of these
    steps to five times as much; on a plant sampled every 1 ms much smaller ones see the samples.

    That of k0 is a choice. Below the cut-off frequency the overshoot grows like (w0 - k0)^(B / (B - w0)), the
    square at B = 2 w0, and above it is zero: its slope at k0 = w0 is 0. What the central difference finds is
    proportional to its step, so lambda_o falls about as 1 / step, and the saccade that is truly optimal
    with the solved weights has its k0 a quarter to a third of a step below the chosen one.
    """

    B: float = 0.2
    """1/s"""
    D: float = 0.02
    """deg"""
    k0: float = 0.05
    """1/s"""

    def __post_init__(self) -> None:
        for symbol, step in asdict(self).items():
            real(f"the step of the difference in {symbol}", step, *_STEPS)


def solve_weights(
    task: SaccadeTask, chosen: ChosenSaccade | None = None, steps: Steps | None = None
) -> dict[str, float]:
    """The weights for which the chosen saccade is optimal on this plant, with this pulse and band.

    Args:
        task: plant, pulse, settling band; its own weights do not matter.
        chosen: the saccade.
        steps: of the differences.

    Raises:
        InputError: no such saccade on this plant, or the equations have no solution with positive weights.
    """
    return solve_at(task, resolve(task, chosen or ChosenSaccade()), steps or Steps())


def solve_at(task: SaccadeTask, saccade: Resolved, steps: Steps) -> dict[str, float]:
    """The weights for which a resolved saccade is optimal; see `solve_weights`."""
    for symbol, step in (("B", steps.B), ("k0", steps.k0)):
        value = getattr(saccade.chosen, symbol)
        real(f"the step of the difference in {symbol}", step, high=0.9 * value, advice=f"{symbol} is {value:g} 1/s")
    width = _widths(task, saccade, steps)
    moved = np.concatenate([saccade.action + width, saccade.action - width])
    which = np.zeros(len(moved), int)
    found = task.perform(saccade.start[which], moved, saccade.target[which])
    command = told(task, saccade.action)
    if not found.measures.settled.all():
        raise InputError(
            f"with {command} the eye does not settle within {task.horizon_s:g} s on plant {task.plant.name!r}; choose "
            "another saccade or a wider band"
        )
    terms = found.reward.terms
    size = np.array(astuple(steps))
    gradient = {name: (value[: len(width)] - value[len(width) :]) / (2 * size) for name, value in terms.items()}
    names = [name for name in gradient if name != "energy"]
    if "energy" not in gradient or len(names) != len(size):
        raise InputError(
            f"three derivatives, by B, D and k0, give three weights beside that of the energy, but this reward has "
            f"the terms {', '.join(gradient)}; give the weights"
        )
    try:
        solution = np.linalg.solve(np.stack([gradient[name] for name in names], axis=1), -gradient["energy"])
    except np.linalg.LinAlgError as error:
        raise InputError(
            "a term of the reward does not change around the chosen saccade, so its weight is undetermined; choose "
            "k0 at the plant's cut-off frequency, where the overshoot sets in, or larger steps"
        ) from error
    weights = dict(zip(names, solution.tolist(), strict=True))
    if not min(weights.values()) >= 0:
        values = ", ".join(f"{name} {value:.3g}" for name, value in weights.items())
        raise InputError(f"no positive weights make {command} optimal: {values}; choose another saccade")
    return {name: weights.get(name, 1.0) for name in terms}


def resolve(task: SaccadeTask, chosen: ChosenSaccade) -> Resolved:
    """The chosen saccade with D and k0 as they are on this task's plant.

    Raises:
        InputError: actions without B, D and k0, no saccade at all, an orientation the eye cannot hold, or no onset
            of overshoot.
    """
    symbols = [number.symbol for number in task.actions.numbers]
    if not set(symbols) == set(_SYMBOLS):
        raise InputError(f"4.4.5 speaks of B, D and k0; these actions are {', '.join(symbols)}: give the weights")
    count = len(task.targets.angles)
    begin = chosen.start if chosen.start is not None else (0.0,) * count
    end = chosen.target
    if end is None:
        end = (min(_LARGEST_DEG, task.targets.limit_deg), *[0.0] * (count - 1))
    targets = task.targets
    for what, angles in (("start", begin), ("target", end)):
        targets.check(np.array([angles], float), what)
    if np.abs(np.subtract(begin, end)).max() < _LEAST_DEG:
        raise InputError(f"the chosen saccade begins at {begin} and ends at {end} deg; choose another target")
    start, target = targets.rest(targets.orientation([begin])), targets.orientation([end])
    D = chosen.D
    if D is None:
        printed = (tuple(begin), tuple(end)) == ((0.0,), (30.0,)) and task.plant.identity() == _THESIS_PLANT
        at = task.actions.likely(target)[0]
        D = (_THESIS_D,) if printed else tuple(at[[s == "D" for s in symbols]].tolist())
    if len(D) != symbols.count("D"):
        raise InputError(f"D is one number for each of the {symbols.count('D')} driven motors, got {D}")
    if chosen.D is not None:
        for number, value in zip((n for n in task.actions.numbers if n.symbol == "D"), D, strict=True):
            real(f"D of {number.motor}", value, number.low, number.high, unit=number.unit)
    chosen = replace(chosen, start=tuple(begin), target=tuple(end), D=D)
    k0 = _onset_of_overshoot(task, chosen, start, target) if chosen.k0 is None else chosen.k0
    chosen = replace(chosen, k0=k0)
    return Resolved(chosen, start, target, action_of(task, chosen.B, D, k0))


def action_of(task: SaccadeTask, B: float, D: tuple[float, ...], k0: float) -> Array:
    """The action (numbers,) with this B and k0 for every driven motor."""
    final = iter(D)
    value = {"B": lambda: B, "D": lambda: next(final), "k0": lambda: k0}
    return np.array([value[number.symbol]() for number in task.actions.numbers], dtype=float)


def _widths(task: SaccadeTask, saccade: Resolved, steps: Steps) -> Array:
    """Moves (3, numbers) of B, D and k0 of all driven motors together."""
    numbers = task.actions.numbers
    F = {motor.name: saccade.start.motor[0, i] for i, motor in enumerate(task.plant.motors)}
    way = np.array([saccade.action[i] - F[n.motor] if n.symbol == "D" else 0.0 for i, n in enumerate(numbers)])
    largest = np.abs(way).max()
    way = way / largest if largest else np.array([float(n.symbol == "D") for n in numbers])
    of = {symbol: np.array([float(n.symbol == symbol) for n in numbers]) for symbol in _SYMBOLS}
    return np.stack([steps.B * of["B"], steps.D * way, steps.k0 * of["k0"]])


def told(task: SaccadeTask, action: Array) -> str:
    """An action in words: "B = 35, D = 20.33, k0 = 17.5"."""
    return ", ".join(f"{name} = {value:.4g}" for name, value in zip(task.actions.names, action, strict=True))


def _onset_of_overshoot(task: SaccadeTask, chosen: ChosenSaccade, start: State, target: Array) -> float:
    """The largest k0 [1/s] with which the chosen saccade overshoots by more than measures are exact to."""
    if task.plant.slow_pole is not None:
        return task.plant.slow_pole  # where zero and pole cancel (4.2)
    assert chosen.D is not None
    bounds = [(n.low, n.high) for n in task.actions.numbers if n.symbol == "k0"]
    low, high = min(b[0] for b in bounds), max(b[1] for b in bounds)
    first, last = low, high
    which = np.zeros(16, int)
    for _ in range(4):  # sixteen at a time: each round narrows the bracket to a fifteenth
        k0 = np.linspace(low, high, 16)
        actions = np.stack([action_of(task, chosen.B, chosen.D, k) for k in k0])
        over = task.perform(start[which], actions, target[which]).measures.overshoot > _SHOWS
        if not over[0] or over[-1]:
            raise InputError(
                f"with B = {chosen.B:g} 1/s the overshoot does not set in between k0 = {first:g} and {last:g} 1/s on "
                f"plant {task.plant.name!r}; choose k0 yourself, or another B"
            )
        found = int(np.flatnonzero(over)[-1])
        low, high = k0[found], k0[found + 1]
    return float(low)
