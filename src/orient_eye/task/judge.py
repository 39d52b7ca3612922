"""How a saccade is judged: named terms with named weights (thesis 4.4).

    R = lambda_a R_a + lambda_e R_e + lambda_d R_d + lambda_o R_o        (4.32)

    judge = JUDGES["orientation"]                    # the thesis' four terms
    reward = judge.reward(movement, measures, target, judge.weights(...))

Every term is at most 0; the weights say how much each matters. A judge has any number of them; another one is a
`Judge` and a line in `JUDGES`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.errors import InputError
from orient_eye.movement import Movement
from orient_eye.movement.measures import Measures, View
from orient_eye.registry import Registry

Array = NDArray[np.float64]
DISCOUNT = 0.6
"""Temporal discount rate [1/s] of the duration term (4.39)."""
IMPATIENT_DISCOUNT = 10.0
"""Of a judge for whom the first hundredth of a second counts more than the next: with the thesis' rate a saccade's time
costs in proportion, and then the best peak velocity grows with the root of the amplitude, whatever the weights; that
of people levels off (`orient_eye.search.human_like`)."""


@dataclass(frozen=True)
class Term:
    """One term of a reward.

    Attributes:
        name: of the term and of its weight.
        value: from the movement, its measures and the target orientations to (saccades,), at most 0.
        failed: its value for a saccade that failed, worse than any that did not; None for the value all the same.
    """

    name: str
    value: Callable[[Movement, Measures, Array], Array]
    failed: float | None = None


@dataclass(frozen=True)
class Reward:
    """What saccades are worth.

    Attributes:
        terms: by name, not weighted, each (saccades,).
        total: their weighted sum, (saccades,).
    """

    terms: dict[str, Array]
    total: Array


@dataclass(frozen=True)
class Judge:
    """Terms, and what of a saccade they look at.

    Attributes:
        of: "orientation", or "gaze", for which torsion does not count.
        terms: in the order in which their weights are told.
    """

    of: View
    terms: tuple[Term, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the terms."""
        return tuple(term.name for term in self.terms)

    @property
    def any_weights(self) -> dict[str, float]:
        """Some weights, for a task whose weights do not matter; none of the force, which not every plant knows."""
        return {name: 0.0 if name == "force" else 1.0 for name in self.names}

    def weights(self, values: Mapping[str, float] | Sequence[float]) -> dict[str, float]:
        """Weights by the name of their term, from such a mapping or from numbers in the order of the terms.

        Raises:
            InputError: other names or another number of them, or weights that are negative, not finite or all 0.
        """
        told = f"the reward has {len(self.terms)} weights, {', '.join(self.names)}; got {values!r}"
        each: Any = values
        try:
            if isinstance(each, str):
                raise TypeError("words")
            given = dict(each) if isinstance(each, Mapping) else dict(zip(self.names, each, strict=True))
            weights = {name: float(given[name]) for name in self.names}
        except (TypeError, ValueError, KeyError) as error:
            raise InputError(told) from error
        if set(given) != set(self.names):
            raise InputError(told)
        if not all(np.isfinite(v) and v >= 0 for v in weights.values()) or not any(weights.values()):
            raise InputError(f"weights must be finite, not negative and not all 0, got {weights}")
        return weights

    def reward(self, movement: Movement, measures: Measures, target: Array, weights: Mapping[str, float]) -> Reward:
        """Judge saccades that were measured; target orientations (saccades, 4)."""
        found = {term.name: term.value(movement, measures, target) for term in self.terms}
        for term in self.terms:
            if term.failed is not None:
                found[term.name] = np.where(measures.failed, term.failed, found[term.name])
        total: Array = np.zeros(len(target))
        for name, value in found.items():
            total = total + weights[name] * value
        return Reward(found, total)


def _accuracy(movement: Movement, measures: Measures, target: Array) -> Array:
    """R_a = -(1 - (q_d . q_s)^2), q_s the orientation at the settling time (4.41): -sin^2 of half the angle."""
    aligned = (target * measures.at_settling).sum(axis=-1)
    # 1 - aligned^2 without cancellation near the target: aligned = cos(angle / 2).
    chord = np.minimum(
        ((target - measures.at_settling) ** 2).sum(axis=-1), ((target + measures.at_settling) ** 2).sum(axis=-1)
    )
    return np.asarray(-(chord / 2) * (1 + np.abs(aligned)))


def _gaze_accuracy(movement: Movement, measures: Measures, target: Array) -> Array:
    """-sin^2 of half the angle between desired and reached gaze: equals R_a where nothing turns about the gaze."""
    wanted, reached = rotations.gaze(target), rotations.gaze(measures.at_settling)
    return np.asarray(-((wanted - reached) ** 2).sum(axis=-1) / 4)


def _energy(movement: Movement, measures: Measures, target: Array) -> Array:
    """R_e = -(integral of the squared motor speed) [deg^2/s] (4.35)."""
    return -np.nan_to_num(movement.energy(), nan=0.0, posinf=0.0)


def _duration(movement: Movement, measures: Measures, target: Array, discount: float = DISCOUNT) -> Array:
    """R_d = -(1 - 1 / (1 + 0.6 t_d)) (4.40), or with another discount rate [1/s]."""
    return np.asarray(-(1 - 1 / (1 + discount * measures.settling_time_s)))


def _overshoot(movement: Movement, measures: Measures, target: Array) -> Array:
    """R_o = -overshoot (4.42)."""
    return -measures.overshoot


def _force(movement: Movement, measures: Measures, target: Array) -> Array:
    """R_f = -(S - S_min) [N^2], S the force of the fixation in which the saccade ends and S_min the least of that gaze.

    0 where no elastics are known. The plain S would draw large saccades short (`orient_eye.plants.fixation`).
    """
    excess = movement.excess_force()
    return np.zeros(len(target)) if excess is None else -np.nan_to_num(np.maximum(excess, 0.0), posinf=0.0)


_ACCURACY, _ENERGY, _OVERSHOOT = (
    Term("accuracy", _accuracy, -1.0),
    Term("energy", _energy),
    Term("overshoot", _overshoot, -10.0),
)
_DURATION = Term("duration", _duration, -1.0)
_HASTE = Term("duration", partial(_duration, discount=IMPATIENT_DISCOUNT), -1.0)

JUDGES: Registry[Judge] = Registry(
    "judge",
    {
        "orientation": Judge("orientation", (_ACCURACY, _ENERGY, _DURATION, _OVERSHOOT)),
        "impatient": Judge("orientation", (_ACCURACY, _ENERGY, _HASTE, _OVERSHOOT)),
        "gaze": Judge(
            "gaze",
            (Term("accuracy", _gaze_accuracy, -1.0), _ENERGY, _DURATION, _OVERSHOOT, Term("force", _force)),
        ),
    },
    Judge,
)
"""Name to judge."""


def plain_reward(reward: Reward, weights: Mapping[str, float]) -> dict[str, Any]:
    """Columns of a table: the total, and each term with its weight, so that they add up; each (saccades,)."""
    return {
        "reward": reward.total,
        **{f"reward_{name}": weights[name] * value for name, value in reward.terms.items()},
    }
