"""One saccade from command to reward, a batch at a time, on any plant.

    task = SaccadeTask.of_case(make_plant("mujoco"), "1")
    start = task.fixate(horizontal([0, 0]))          # the eye rests there
    outcome = task.perform(start, action, horizontal([10, 20]))   # action (saccades, driven, 3): B, D, k0

The low-pass plant is measured in closed form, every other plant from its sampled trajectory.
"""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye.commands.pulse_step import FIXED_C, SPEED_LIMIT, PulseStep, keeps_speed_limit, varying_C
from orient_eye.errors import InputError
from orient_eye.movement.measures import BAND, Measures, measure, measure_response
from orient_eye.movement.trajectory import EyeState, Trajectory
from orient_eye.plants import Plant
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.rotations import from_yaw
from orient_eye.task.reward import Reward, Weights, reward

Array = NDArray[np.float64]
B_RANGE = (18.0, 80.0)
"""Bounds of B in the action [1/s]."""
K0_RANGE = (5.0, 40.0)
"""Bounds of k0 in the action [1/s]."""
YAW_RANGE_DEG = (-35.0, 35.0)
"""Starts and targets are drawn from here (thesis 4.6)."""


@dataclass(frozen=True)
class Fixation:
    """Where saccades start: an eye at rest.

    Attributes:
        orientation: (saccades, 4).
        motor: positions that hold it [deg], (saccades, motors).
    """

    orientation: Array
    motor: Array

    def __getitem__(self, which: NDArray[np.intp]) -> "Fixation":
        return Fixation(self.orientation[which], self.motor[which])


@dataclass(frozen=True)
class Outcome:
    """What came of a batch of saccades.

    Attributes:
        command: the pulse-steps.
        measures: of the eye's movement.
        reward: its terms and total.
        saturated: True where the command reached beyond a motor's mechanical range and stayed at it.
        too_fast: True where C varies and no C holds the command to the speed limit.
    """

    command: PulseStep
    measures: Measures
    reward: Reward
    saturated: NDArray[np.bool_]
    too_fast: NDArray[np.bool_]


@dataclass(frozen=True)
class SaccadeTask:
    """A plant, the kind of command it gets, and how the result is judged.

    Attributes:
        plant: any plant.
        driven: motors the policy commands; the others stand at 0.
        variant: of the pulse.
        C: onset rate [1/s] of variants 2 and 3; None for the thesis' fixed value, "varying" for the value
            that brings the motor to the speed limit.
        speed_limit: V [deg/s], for a varying C.
        weights: of the reward; unless given, those of case 1 on the low-pass plant, whatever the plant and
            variant: `of_case` knows the others.
        band: settling band, share of the amplitude.
        horizon_s: how long a simulated saccade lasts; the low-pass plant has no horizon.
    """

    plant: Plant
    driven: tuple[str, ...] = ("motor2",)
    variant: int = 1
    C: float | str | None = None
    speed_limit: float = SPEED_LIMIT
    weights: Weights = field(default_factory=Weights)
    band: float = BAND
    horizon_s: float = 0.5

    def __post_init__(self) -> None:
        missing = [name for name in self.driven if name not in self.plant.motors]
        if missing or not self.driven:
            raise InputError(
                f"plant {self.plant.name!r} has the motors {', '.join(self.plant.motors)}; cannot drive {missing}"
            )
        if isinstance(self.C, str) and self.C != "varying":
            raise InputError(f"C is a number [1/s], 'varying' or nothing, got {self.C!r}")
        if not (self.speed_limit > 0 and self.horizon_s > 0):
            raise InputError(f"speed limit and horizon must be positive, got {self.speed_limit} and {self.horizon_s}")
        if not 0 < self.band < 1:
            raise InputError(f"the settling band is a share of the amplitude between 0 and 1, got {self.band}")

    @classmethod
    def of_case(cls, plant: Plant, case: str, **options: Any) -> "SaccadeTask":
        """One of the thesis' five cases (`orient_eye.task.cases.CASES`) on a plant.

        Args:
            plant: any plant.
            case: its name.
            options: attributes that differ from the case's.

        Raises:
            InputError: unknown case.
        """
        from orient_eye.task.cases import get_case

        chosen = get_case(case)
        of_case = {"variant": chosen.variant, "C": chosen.C, "weights": chosen.weights(plant.name)}
        return cls(plant, **{**of_case, **options})

    def identity(self) -> dict[str, Any]:
        """Everything that decides what an action is worth, in plain values: for manifests and caches."""
        return {
            "plant": self.plant.identity(),
            "driven": list(self.driven),
            "variant": self.variant,
            "C": self.onset,
            "speed_limit": self.speed_limit if self.onset == "varying" else None,
            "weights": asdict(self.weights),
            "band": self.band,
            "horizon_s": None if isinstance(self.plant, LowPassPlant) else self.horizon_s,
            "low": self.action_low.tolist(),
            "high": self.action_high.tolist(),
        }

    @property
    def onset(self) -> float | str | None:
        """C as it is used: a number, "varying", or None in variant 1."""
        return FIXED_C[self.variant] if self.C is None and self.variant in FIXED_C else self.C

    @property
    def action_low(self) -> Array:
        """Lower bounds of B, D, k0, (driven, 3)."""
        return self._bounds(0)

    @property
    def action_high(self) -> Array:
        """Upper bounds of B, D, k0, (driven, 3)."""
        return self._bounds(1)

    def _bounds(self, end: int) -> Array:
        D = self.plant.action_range_deg[self.driven_index, end]
        return np.stack([np.full_like(D, B_RANGE[end]), D, np.full_like(D, K0_RANGE[end])], axis=-1)

    @property
    def driven_index(self) -> list[int]:
        """Indices of the driven motors among the plant's."""
        return [self.plant.motors.index(name) for name in self.driven]

    def fixate(self, orientation: Array) -> Fixation:
        """Rest in orientations (saccades, 4), held by the driven motors.

        Raises:
            InputError: an orientation the driven motors cannot hold.
        """
        return Fixation(orientation, self.plant.rest_motor(orientation, self.driven))

    def lands_on(self, target: Array) -> Array:
        """D [deg] of each driven motor at which the eye rests on targets (saccades, 4); (saccades, driven)."""
        return self.plant.rest_motor(target, self.driven)[:, self.driven_index]

    def pulse_step(self, start: Fixation, action: Array) -> PulseStep:
        """The motor command of an action.

        Args:
            start: where the eye rests; its motor positions are F.
            action: B [1/s], D [deg], k0 [1/s] of each driven motor, (saccades, driven, 3).
        """
        B, D, k0 = (np.asarray(action, float)[..., i] for i in range(3))
        F = start.motor[:, self.driven_index]
        C: ArrayLike | None = None
        if self.variant in FIXED_C:
            C = self.onset
            if C == "varying":
                C = varying_C(self.variant, D - F, B, k0, self.speed_limit)
        return PulseStep(F, B, D, k0, self.variant, C)

    def perform(self, start: Fixation, action: Array, target: Array) -> Outcome:
        """Command, move, measure and judge a batch of saccades.

        Args:
            start: where the eye rests.
            action: B, D, k0 of each driven motor, (saccades, driven, 3).
            target: desired orientations, (saccades, 4).
        """
        command = self.pulse_step(start, action)
        if isinstance(self.plant, LowPassPlant):
            measures = measure_response(self.plant.respond(command), band=self.band)
            saturated = np.zeros(len(action), bool)
        else:
            trajectory, saturated = self._simulate(start, command)
            final = start.motor.copy()
            final[:, self.driven_index] = command.D
            measures = measure(trajectory, self.plant.rest_orientation(final), band=self.band)
        found = reward(measures, command.energy(), target, self.weights)
        return Outcome(command, measures, found, saturated, self._too_fast(command))

    def _too_fast(self, command: PulseStep) -> NDArray[np.bool_]:
        if self.onset != "varying":
            return np.zeros(len(command.B), bool)
        step = command.D - command.F
        return ~np.all(keeps_speed_limit(self.variant, step, command.B, command.k0, self.speed_limit), axis=1)

    def trajectory(self, start: Fixation, action: Array) -> Trajectory:
        """The eye's movement under an action, sampled over the horizon."""
        command = self.pulse_step(start, action)
        if isinstance(self.plant, LowPassPlant):
            return self.plant.trajectory(command, self._samples)
        return self._simulate(start, command)[0]

    @property
    def _samples(self) -> int:
        return round(self.horizon_s / self.plant.step_s) + 1

    def _simulate(self, start: Fixation, command: PulseStep) -> tuple[Trajectory, NDArray[np.bool_]]:
        motor = np.repeat(start.motor[:, None], self._samples, axis=1)
        motor[..., self.driven_index] = command.sample(self.plant.step_s, self._samples)
        low, high = self.plant.motor_range_deg.T
        held = np.clip(motor, low, high)
        saturated = ((motor < low) | (motor > high)).any(axis=(1, 2))
        return self.plant.simulate(held, EyeState(start.orientation)), saturated

    def draw_yaw(self, count: int, random: np.random.Generator) -> tuple[Array, Array]:
        """Yaw of starts and targets [deg], each (count,), uniform over +-35 deg (thesis 4.6)."""
        start, target = random.uniform(*YAW_RANGE_DEG, (2, count))
        return start, target


def horizontal(yaw_deg: ArrayLike) -> Array:
    """Orientations (saccades, 4) of horizontal gaze directions [deg] (saccades,)."""
    return from_yaw(np.atleast_1d(np.asarray(yaw_deg, float)))
