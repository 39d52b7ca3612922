"""One saccade from command to reward, a batch at a time, on any plant.

    task = SaccadeTask.of_case(make_plant("mujoco"), "1")
    start, target = saccades(task.targets, [[0.0]], [[20.0]])
    outcome = task.perform(start, action, target)    # action (saccades, numbers): B, D, k0

Command, movement, measures, reward: each is asked of the part that knows it, and none is asked what kind it is.
"""

import inspect
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import real
from orient_eye.commands import Command
from orient_eye.constants import BAND, HORIZON_S, LONGEST_S, STEP_S
from orient_eye.errors import InputError
from orient_eye.movement import Movement
from orient_eye.movement.measures import Measures
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import Plant, PulseRates, restore_plant
from orient_eye.plants.fixation import knows_elastics
from orient_eye.state import State, unit
from orient_eye.task.actions import ACTIONS, K0_RANGE, ActionSpace, restore_actions
from orient_eye.task.cases import CASES, Case
from orient_eye.task.judge import JUDGES, Reward
from orient_eye.task.known_weights import with_known_weights
from orient_eye.task.targets import Targets, make_targets, restore_targets

Array = NDArray[np.float64]
LEAST_BAND = 1e-4
"""Share of the amplitude: into a narrower band a saccade settles by what its simulation rounds."""


@dataclass(frozen=True)
class Outcome:
    """What came of a batch of saccades.

    Attributes:
        command: what the motors were told.
        movement: what the eye did.
        measures: of the movement.
        reward: its terms and total.
    """

    command: Command
    movement: Movement
    measures: Measures
    reward: Reward

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Where the command reached beyond a motor's mechanical range and the motor stayed at it, (saccades,)."""
        return self.movement.saturated

    @property
    def limited(self) -> NDArray[np.bool_]:
        """Where a limit of speed or acceleration kept a motor from where it was told to be, (saccades,)."""
        return self.movement.limited

    @property
    def too_fast(self) -> NDArray[np.bool_]:
        """Where C was to hold the command to a speed limit and none does, (saccades,)."""
        return self.command.too_fast


@dataclass(frozen=True)
class SaccadeTask:
    """A plant, what an action on it means, which saccades are to be made, and how they are judged.

    Attributes:
        plant: any plant.
        actions: what an action means.
        targets: starts and targets.
        weights: of the judge's terms, by name.
        judge: a name of `orient_eye.task.judge.JUDGES`.
        band: settling band, share of the amplitude.
        horizon_s: how long a saccade lasts on a plant that needs a horizon, and in every trajectory.
        weights_from: where the weights are from, for people.
    """

    plant: Plant
    actions: ActionSpace
    targets: Targets
    weights: Mapping[str, float]
    judge: str = "orientation"
    band: float = BAND
    horizon_s: float = HORIZON_S
    weights_from: str = "given"

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", JUDGES[self.judge].weights(self.weights))
        real("the horizon", self.horizon_s, STEP_S, LONGEST_S, unit="s", advice="a saccade is over in 0.5 s")
        real("the settling band", self.band, LEAST_BAND, 1 - LEAST_BAND, advice="it is a share of the amplitude")

    def _force_known(self) -> "SaccadeTask":
        """Itself, if nothing is to be judged of which the plant knows nothing."""
        if self.weights.get("force") and not knows_elastics(self.plant):
            raise InputError(
                f"of plant {self.plant.name!r} no elastics are known, so that the force of a fixation cannot be "
                "judged: choose plant mujoco, tavares or viscous, or give it the weight 0"
            )
        return self

    @property
    def plain(self) -> "SaccadeTask":
        """The same task with actions that are told without regard to the saccade."""
        return self if self.actions.plain is self.actions else replace(self, actions=self.actions.plain)

    @classmethod
    def of_case(
        cls,
        plant: Plant,
        case: str | Case = "1",
        *,
        targets: str | Targets | None = None,
        driven: Sequence[str] | None = None,
        weights: Mapping[str, float] | Sequence[float] | None = None,
        judge: str | None = None,
        actions: str | None = None,
        action_options: Mapping[str, Any] | None = None,
        band: float = BAND,
        speed_limit: float | None = None,
        horizon_s: float | None = None,
    ) -> "SaccadeTask":
        """A learning case on a plant.

        Args:
            plant: any plant.
            case: a name of `orient_eye.task.cases.CASES`, or a case.
            targets: a name of `orient_eye.task.targets.TARGETS`, or a set made for this plant; None for horizontal
                ones, or on a plant that turns the eye otherwise what it can make.
            driven: motors that the action commands; None for those that the targets need.
            weights: of the reward's terms, by name or in their order; None for those of the case on this plant, which
                are solved where nobody has solved them (`orient_eye.task.known_weights`).
            judge: a name of `orient_eye.task.judge.JUDGES`; None for that of the targets.
            actions: a name of `orient_eye.task.actions.ACTIONS`; None for the kind that suits the targets.
            action_options: further keywords of that kind.
            band: settling band, share of the amplitude.
            speed_limit: V [deg/s], for a varying C; None for the motors' own.
            horizon_s: of a simulated saccade; None for the plant's own.

        Raises:
            InputError: an unknown name, or numbers that are none.
        """
        case = CASES[case] if isinstance(case, str) else case
        if targets is None or isinstance(targets, str):
            targets = make_targets(targets, plant, driven=None if driven is None else tuple(driven))
        make, options = ACTIONS[actions or targets.actions], dict(action_options or {})
        if targets.pulse_rates is not None:
            options["rates"] = targets.pulse_rates
        elif case.B is not None and plant.pulse_rates is None:
            options["rates"] = PulseRates(case.B, K0_RANGE)
        unknown = set(options) - set(inspect.signature(make).parameters)
        if unknown:
            raise InputError(
                f"{actions or targets.actions!r} actions, of {targets.name} targets, have no option "
                f"{', '.join(sorted(unknown))}; leave it out, or choose other targets"
            )
        meant = make(plant, driven or targets.driven, pulse=case.pulse, C=case.C, speed_limit=speed_limit, **options)
        if case.judge is not None and JUDGES[case.judge].of != JUDGES[targets.of].of:
            raise InputError(
                f"the case's judge looks at {JUDGES[case.judge].of}, {targets.name} targets are of "
                f"{JUDGES[targets.of].of}; choose another case, or other targets"
            )
        judge = judge or case.judge or targets.of
        told = JUDGES[judge].weights(JUDGES[judge].any_weights if weights is None else weights)
        if horizon_s is None:
            horizon_s = targets.horizon_s or plant.horizon_s or HORIZON_S
        task = cls(plant, meant, targets, told, judge, band, horizon_s)
        if weights is not None:
            return task._force_known()
        return with_known_weights(task)

    def identity(self) -> dict[str, Any]:
        """Everything that decides what an action is worth, in plain values: for manifests and caches."""
        identity = {
            "plant": self.plant.identity(),
            "actions": self.actions.identity(),
            "targets": self.targets.identity(),
            "judge": self.judge,
            "weights": dict(self.weights),
            "band": self.band,
            "horizon_s": None if self.plant.horizon_s is None else self.horizon_s,
        }
        plain: dict[str, Any] = json.loads(json.dumps(identity))
        return plain

    @classmethod
    def restore(cls, identity: Mapping[str, Any], plant: Plant | None = None) -> "SaccadeTask":
        """The task of an identity.

        Args:
            identity: from `identity`.
            plant: the same actions, targets and reward on this plant instead; its horizon is then the plant's own.

        Raises:
            InputError: it describes no task of this version.
        """
        try:
            own = restore_plant(identity["plant"]) if plant is None else plant
            targets = restore_targets(identity["targets"], own, tuple(identity["actions"]["driven"]))
            horizon_s = identity["horizon_s"] if plant is None else targets.horizon_s or own.horizon_s
            task = cls(
                own,
                restore_actions(identity["actions"], own),
                targets,
                identity["weights"],
                str(identity["judge"]),
                float(identity["band"]),
                float(horizon_s or HORIZON_S),
            )
            return task._force_known()
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"this describes no task of this version ({error!r})") from error

    def perform(self, start: State, action: Array, target: Array, random: np.random.Generator | None = None) -> Outcome:
        """Command, move, measure and judge a batch of saccades.

        Args:
            start: of the eyes.
            action: in units, (saccades, numbers).
            target: desired orientations, (saccades, 4).
            random: of a plant that is noisy.
        """
        count, numbers = len(start), len(self.actions.numbers)
        if np.shape(action) != (count, numbers) or np.shape(target) != (count, 4):
            raise InputError(
                f"{count} saccades have actions ({count}, {numbers}) and targets ({count}, 4), got {np.shape(action)} "
                f"and {np.shape(target)}"
            )
        judge, target = JUDGES[self.judge], unit(target)
        command = self.actions.command(start, target, action)
        movement = self.plant.move(command, start, self.horizon_s, random)
        measures = movement.measure(self.band, judge.of)
        return Outcome(command, movement, measures, judge.reward(movement, measures, target, self.weights))

    def trajectory(
        self, start: State, action: Array, target: Array, random: np.random.Generator | None = None
    ) -> Trajectory:
        """The movement under an action over time; arguments as `perform`'s."""
        return self.plant.move(self.actions.command(start, target, action), start, self.horizon_s, random).trajectory()
