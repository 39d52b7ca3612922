"""Actions of an eye that has more motors than axes: pulse-step generators that its motors share, D from the statics.

    actions = GeneratorActions(plant, driven=("IR", "MR", "SR", "LR", "IO", "SO"), pulse="smooth")
    actions.names                                    # ("B_sideways", "k0_sideways", "B_updown", "k0_updown", "trim")
    actions.plain                                    # the same by B and k0 themselves

Each motor goes to where the eye is held in the target's direction (`orient_eye.plants.fixation`): the end point needs
no learning, and Listing's law at rest is that of the statics, imposed. Two generators share the work, as in the
brainstem: what carries the gaze sideways (there the paramedian pontine reticular formation) drives the horizontal
recti, what carries it up or down and rolls it (the rostral interstitial nucleus of the medial longitudinal fasciculus)
drives all muscles. So the horizontal recti, which hold the eye's yaw while the others turn it up or down, do it in time
with them. What turns the eye up or down kicks it aside a little, and that dies away slowly; so the generator for
sideways may aim beside the target by a share of the amplitude, the trim, which the other one takes back. With one
generator for each group of motors they cannot do either, and some saccades up or down take five times as long.

A policy's numbers are the trim, and ratios to usual ones, as in `orient_eye.task.residual_actions`; those of the plain
actions are B, k0 and the trim.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from orient_eye import listing, rotations
from orient_eye.cached import cached_property
from orient_eye.commands import Command
from orient_eye.commands.generators import Generators
from orient_eye.commands.pulses import PULSES
from orient_eye.errors import InputError
from orient_eye.plants import Plant, PulseRates
from orient_eye.plants.cables import muscles_of
from orient_eye.plants.fixation import Fixations, Rule
from orient_eye.plants.turns import turned
from orient_eye.state import State
from orient_eye.task.actions import ActionSpace, Number, PulseStepActions

Array = NDArray[np.float64]
Kind = Literal["directions", "axes", "pairs"]
"""What generators are for: a direction of gaze, or a group of motors, those that turn the eye sideways and the others,
or each pair of antagonists."""
RATES = PulseRates((15.0, 220.0), (2.0, 50.0))
"""Hold the best pulse-steps of the six-motor eye."""
_SIDEWAYS = 2  # among the axes of a turn: about z
_DIRECTIONS = ("sideways", "updown")
_LARGEST_DEG, _SMALLEST_DEG = 90.0, 1.0
_TRIM = 0.1  # of the amplitude, to either side


class GeneratorActions(ActionSpace):
    """B and k0 of each generator; of directions also the trim.

    Args:
        plant: whose motors are commanded.
        driven: all of them.
        pulse: as of `PulseStepActions`.
        C: the same, but for a varying one: a motor follows several generators, whose C cannot keep its speed limit.
        speed_limit: the same, without effect here.
        rates: as of `PulseStepActions`.
        rule: with which torsion the motors hold a target (`orient_eye.plants.fixation`); None for the least force.
        generators: what they are for.

    Raises:
        InputError: as `PulseStepActions`, an unknown kind of generators, a varying C, or motors that do not turn the
            eye in all directions.
    """

    kind = "generators"

    def __init__(
        self,
        plant: Plant,
        driven: Sequence[str],
        pulse: str = "1",
        C: float | str | None = None,
        speed_limit: float | None = None,
        rates: PulseRates | Mapping[str, Sequence[float]] | None = None,
        rule: Rule | None = None,
        generators: Kind = "directions",
    ) -> None:
        if C == "varying":
            raise InputError(
                "a motor follows several generators here, so no onset rate C brings it to its speed limit; choose a "
                "case with a fixed C, or without one"
            )
        self.each = PulseStepActions(plant, driven, pulse, C, speed_limit, rates)
        self.rule: Rule | None = None if rule == "least force" else rule  # one law, one identity
        if generators not in get_args(Kind):
            raise InputError(f"generators are for {', '.join(get_args(Kind))}, got {generators!r}")
        self.generators, self.fixations = generators, Fixations.of(plant, self.rule)
        self.members = _members(plant, self.each.index, generators)
        self.numbers = self._numbers()

    def _numbers(self) -> tuple[Number, ...]:
        bounds = {number.symbol: number for number in self.each.numbers}
        groups = ("_".join(self.each.plant.motors[i].name for i in some) for some in self.members)
        return tuple(
            Number(symbol, "1/s", name, bounds[symbol].low, bounds[symbol].high, True, fine, symbol == "k0")
            for name in (_DIRECTIONS if self.generators == "directions" else groups)
            for symbol, fine in (("B", 0.05), ("k0", 0.03))
        ) + ((Number("trim", "", "", -_TRIM, _TRIM, fine=0.05),) if self.generators == "directions" else ())

    def identity(self) -> dict[str, Any]:
        """Kind, what generators are for, rule of torsion, motors, pulse, C, and bounds."""
        each = {key: value for key, value in self.each.identity().items() if key != "speed_limit"}
        bounds = {"low": self.low.tolist(), "high": self.high.tolist()}
        return {**each, "actions": self.kind, "generators": self.generators, "rule": self.rule, **bounds}

    def ways(self, start: State, target: Array) -> Array:
        """By how much each generator takes each motor, (saccades, generators, motors).

        Of directions: from start to target along two sides of a rectangle of yaw and pitch, the mean of both orders,
        what the muscles that turn the eye sideways do along the side of yaw is the generator's for sideways, and all
        else is the other's.
        """
        ends = rotations.gaze(start.orientation), rotations.gaze(target)
        to = self.fixations.motor(ends[1])
        whole = to - start.motor
        if self.generators != "directions":
            masks = np.zeros((len(self.members), whole.shape[1]))
            for mask, some in zip(masks, self.members, strict=True):
                mask[some] = 1
            return np.asarray(whole[:, None] * masks)
        (yaw, pitch), (yaw_to, pitch_to) = (rotations.to_euler(q)[:2] for q in (start.orientation, target))
        from_, first, then = (
            self.fixations.motor(listing.directions(*at)) for at in ((yaw, pitch), (yaw_to, pitch), (yaw, pitch_to))
        )
        sideways = np.zeros_like(whole)
        horizontal = self.members[0]
        sideways[:, horizontal] = ((first - from_ + to - then) / 2)[:, horizontal]
        return np.stack([sideways, whole - sideways], axis=1)

    def aside(self, target: Array) -> Array:
        """By how much motors that turn the eye sideways move for a degree of yaw at the target, (saccades, motors)."""
        yaw, pitch = rotations.to_euler(target)[:2]
        away = rotations.angle_between_directions(rotations.gaze(target), [1.0, 0.0, 0.0])
        yaw = np.where(away > self.fixations.limit_deg - 1, yaw - np.sign(yaw), yaw)  # both sides inside what is known
        ends = (self.fixations.motor(listing.directions(yaw + side, pitch)) for side in (0.5, -0.5))
        found = np.subtract(*ends)
        others = np.setdiff1d(np.arange(found.shape[1]), self.members[0])
        found[:, others] = 0.0
        return np.asarray(found)

    def command(self, start: State, target: Array, action: Array) -> Command:
        """The motors' command."""
        told, ways = np.asarray(action, float), self.ways(start, target)
        if self.generators == "directions":
            told, trim = told[:, :-1], told[:, -1] * _size(start, target)
            ways = ways + np.array([1.0, -1.0])[:, None] * (trim[:, None] * self.aside(target))[:, None]
        told = told.reshape(len(start), -1, 2)
        return Generators(start.motor, ways, told[..., 0], told[..., 1], self.each.pulse, self.each.C)

    def likely(self, target: Array) -> Array:
        """Nothing is known."""
        return np.full((len(target), len(self.numbers)), np.nan)


USUAL_B, FALLS, SIDEWAYS = 143.0, 0.53, 0.33
"""B = 143 n A^-0.53 exp(-0.33 s) [1/s] of a saccade of A deg whose share s is sideways and a pulse of n poles: fitted
to the searched optima of 96 saccades of the six-motor eye."""
AT_START, OF_RATE = 0.7, (0.92, 1.24)
"""k0 over the rates by which the eye turns back about z and y, where the saccade starts to the power of 0.7 times where
it ends to the power of 0.3: the same optima. Those of 64 others lie between 0.87 and 1.29 times the usual k0 sideways,
at the 5th and 95th percentiles, and between 0.65 and 1.90 up and down, where it often hardly matters."""
OF_POLE = 0.9
"""k0 over the pole by which the eye follows the motors at rest, on a plant of which only that is known."""
_B, _K0 = 0.35, (0.3, 0.5)  # of the natural logarithm, to either side: the best inside costs 0.03 % more in the mean


class GeneratorRatios(GeneratorActions):
    """Ratios of the numbers of `GeneratorActions` to usual ones.

    The usual B falls with the amplitude, the usual k0 follows how fast the eye turns back where the saccade starts and
    ends: this eye is twice as slow at its nose as at its temple.
    """

    kind = "generator-ratios"

    def _numbers(self) -> tuple[Number, ...]:
        plain, k0 = super()._numbers(), _K0 if self.generators == "directions" else (_K0[1],) * len(self.members)
        widths = (far for each in k0 for far in (_B, each))
        ratios = tuple(
            replace(number, symbol=f"{number.symbol}_ratio", unit="", low=np.exp(-far), high=np.exp(far), fine=0.1)
            for number, far in zip(plain, widths, strict=False)
        )
        return ratios + plain[len(ratios) :]

    @cached_property
    def plain(self) -> GeneratorActions:
        """See `orient_eye.task.actions.ActionSpace`."""
        each = self.each
        return GeneratorActions(
            each.plant, each.driven, each.pulse, each.C, None, each.rates, self.rule, self.generators
        )

    def as_plain(self, start: State, target: Array, action: Array) -> Array:
        """See `orient_eye.task.actions.ActionSpace`; inside the bounds of B and k0."""
        action = np.asarray(action, float)
        ratio = action[:, : 2 * len(self.members)].reshape(len(start), -1, 2)
        ends = rotations.gaze(start.orientation), rotations.gaze(target)
        size = np.clip(_size(start, target), _SMALLEST_DEG, _LARGEST_DEG)
        way = np.abs(ends[1] - ends[0])
        sideways = way[:, 1] / np.maximum(np.hypot(way[:, 1], way[:, 2]), 1e-12)
        B = self._B_of_1_deg * size**-FALLS * np.exp(-SIDEWAYS * sideways)
        plain = np.stack([B[:, None] * ratio[..., 0], self._usual_k0(ends) * ratio[..., 1]], axis=-1)
        plain = np.concatenate([plain.reshape(len(start), -1), action[:, 2 * len(self.members) :]], axis=1)
        return np.clip(plain, self.plain.low, self.plain.high)

    @cached_property
    def _B_of_1_deg(self) -> float:
        one = np.ones((1, 1))
        return USUAL_B * len(PULSES[self.each.pulse].poles(one, one))

    def _usual_k0(self, ends: tuple[Array, Array]) -> Array:
        """From directions of start and target, (saccades, generators)."""
        plant, fixations = self.each.plant, self.fixations
        if self.generators == "directions":
            rates = (plant.turning_rates(fixations.orientation(end), fixations.motor(end)) for end in ends)
            known = [np.maximum(each[:, [2, 1]], 1e-3) for each in rates if each is not None]
            if len(known) == len(ends):
                return np.asarray(OF_RATE * known[0] ** AT_START * known[1] ** (1 - AT_START))
        at_rest = np.log(plant.motor_rates())
        return OF_POLE * np.exp([[at_rest[some].mean() for some in self.members]])

    def command(self, start: State, target: Array, action: Array) -> Command:
        """The motors' command."""
        return self.plain.command(start, target, self.as_plain(start, target, action))


def _size(start: State, target: Array) -> Array:
    """Amplitudes [deg], (saccades,)."""
    return rotations.angle_between_directions(rotations.gaze(start.orientation), rotations.gaze(target))


def _members(plant: Plant, index: Sequence[int], generators: Kind) -> list[list[int]]:
    """Motors of each group; of directions those whose poles are the generators'."""
    if generators == "pairs":
        muscles = muscles_of(plant)
        if muscles is None:
            raise InputError(
                f"the motors of plant {plant.name!r} are not pairs of antagonists; take generators for axes"
            )
        return [list(pair) for pair in muscles.pairs.tolist()]
    sideways = np.abs(turned(plant).as_rotvec()).argmax(axis=1) == _SIDEWAYS
    kinds = [[i for i in index if sideways[i] == kind] for kind in (True, False)]
    if not all(kinds):
        raise InputError(f"no motors of plant {plant.name!r} turn the eye sideways, or no others; take other actions")
    return kinds
