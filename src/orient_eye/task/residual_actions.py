"""Actions that are told as differences from a usual pulse-step: what is hard in three dimensions is then near zero.

    actions = ResidualActions(plant, driven=("motor1", "motor2", "motor3"))
    actions.plain                                    # the same commands by B, D and k0 themselves
    actions.as_plain(start, target, action)

The usual command sends each motor where the eye holds the target, with the pole it mostly moves as k0, and a B that
falls with the amplitude; it knows nothing of energy, duration or overshoot. What a policy learns is how to do better.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.commands import Command
from orient_eye.plants import Plant, PulseRates
from orient_eye.plants.fixation import Fixations, Rule
from orient_eye.plants.turns import turned
from orient_eye.state import State
from orient_eye.task.actions import ActionSpace, Number, PulseStepActions

Array = NDArray[np.float64]
USUAL_B, FALLS = 200.0, 0.6
"""B = 200 A^-0.6 [1/s] of a saccade of A deg: as the searched optima of the thesis' eye fall."""
_LARGEST_DEG, _SMALLEST_DEG = 90.0, 1.0
_B, _K0 = 0.6, 0.4  # of the natural logarithm, to either side
_TURN_DEG = 4.5  # to either side, by which D may turn the eye; more where another motor can turn it back


class ResidualActions(ActionSpace):
    """Ratios of B and k0 to the usual ones, and shifts of D from the usual one, for each driven motor.

    Args:
        plant: whose motors are commanded.
        driven: all of them.
        pulse: as of `PulseStepActions`.
        C: the same.
        speed_limit: the same.
        rates: the same.
        rule: with which torsion the usual D holds the target (`orient_eye.plants.fixation`); None for the least force.

    Raises:
        InputError: as `PulseStepActions`, or motors that do not turn the eye in all directions.
    """

    kind = "residual"

    def __init__(
        self,
        plant: Plant,
        driven: Sequence[str],
        pulse: str = "1",
        C: float | str | None = None,
        speed_limit: float | None = None,
        rates: PulseRates | Mapping[str, Sequence[float]] | None = None,
        rule: Rule | None = None,
    ) -> None:
        self._plain = PulseStepActions(plant, driven, pulse, C, speed_limit, rates)
        self.rule: Rule | None = None if rule == "least force" else rule  # one law, one identity
        self.fixations = Fixations.of(plant, self.rule)
        numbers = np.array(self._plain.numbers, dtype=object).reshape(-1, 3)
        known = plant.motor_rates()[self._plain.index]
        low, high = np.array([(k0.low, k0.high) for k0 in numbers[:, 2]]).T
        self._k0 = np.clip(np.where(np.isfinite(known), known, np.sqrt(low * high)), low, high)
        turn = np.abs(turned(plant).as_rotvec(degrees=True)[self._plain.index])
        rivals = np.bincount(turn.argmax(axis=1), minlength=3)[turn.argmax(axis=1)]
        reach = [float(f"{shift:.6g}") for shift in _TURN_DEG * rivals / turn.max(axis=1)]  # on any machine
        self.numbers = tuple(
            number
            for (_, D, _), shift in zip(numbers, reach, strict=True)
            for number in (
                Number("B_ratio", "", D.motor, np.exp(-_B), np.exp(_B), log=True, fine=0.1),
                Number("D_shift", D.unit, D.motor, -shift, shift, fine=0.02),
                Number("k0_ratio", "", D.motor, np.exp(-_K0), np.exp(_K0), log=True, fine=0.1, cliff=True),
            )
        )

    @property
    def plain(self) -> ActionSpace:
        """See `orient_eye.task.actions.ActionSpace`."""
        return self._plain

    def identity(self) -> dict[str, Any]:
        """Kind, rule of torsion, and what the commands are made of."""
        return {
            **self._plain.identity(),
            "actions": self.kind,
            "rule": self.rule,
            "low": self.low.tolist(),
            "high": self.high.tolist(),
        }

    def as_plain(self, start: State, target: Array, action: Array) -> Array:
        """See `orient_eye.task.actions.ActionSpace`; inside the bounds of B, D and k0."""
        ratio_or_shift = np.asarray(action, float).reshape(len(start), -1, 3)
        ends = rotations.gaze(start.orientation), rotations.gaze(target)
        size = np.clip(rotations.angle_between_directions(*ends), _SMALLEST_DEG, _LARGEST_DEG)
        D = self.fixations.motor(ends[1])[:, self._plain.index]
        plain = np.stack(
            [
                USUAL_B * size[:, None] ** -FALLS * ratio_or_shift[..., 0],
                D + ratio_or_shift[..., 1],
                self._k0 * ratio_or_shift[..., 2],
            ],
            axis=-1,
        ).reshape(len(start), -1)
        return np.clip(plain, self._plain.low, self._plain.high)

    def command(self, start: State, target: Array, action: Array) -> Command:
        """The pulse-step of all motors."""
        return self._plain.command(start, target, self.as_plain(start, target, action))

    def likely(self, target: Array) -> Array:
        """Nothing shifted; the ratios are not known."""
        found = np.full((len(target), len(self.numbers)), np.nan)
        found[:, 1::3] = 0.0
        return found
