"""The inverse problem: with which weights is the best main sequence nearest to a wanted one, people's for example?

    found = nearest(task, people())                  # of a case on a plant
    found.weights, found.peak_velocity               # over the wanted one, 1 for the same

Only one number is searched: energy weighs 1, and the three other weights grow or shrink together from those of thesis
4.4.5. Accuracy and overshoot weigh so much that the best saccade ends on its target without overshoot; what is left is
how much time is worth against energy.

Why no more can be had of the thesis' reward: the energy of a command grows as A^2 B^n of amplitude A and pulse rate B,
and a saccade lasts in proportion to 1 / B. Where time costs in proportion to its length, the best B falls as
A^(-2/(n+1)); with n = 3 of variant 1 as A^(-1/2), so that peak velocity, A B, grows as A^(1/2) and never levels off.
The thesis' duration term is a hyperbola (4.39), but with its rate of 0.6 1/s it is straight over the length of a
saccade. A judge with a rate of 10 1/s bends it (`orient_eye.task.judge.IMPATIENT_DISCOUNT`): long saccades hurry less.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from orient_eye.errors import InputError
from orient_eye.movement.main_sequence import MainSequence
from orient_eye.movement.velocity_threshold import Bout, above
from orient_eye.search.optimum import find_optimum
from orient_eye.task.judge import JUDGES
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
AT_DEG = (5.0, 10.0, 20.0)
"""Amplitudes at which main sequences are compared."""
NEAR_VELOCITY, NEAR_DURATION = 0.1, 0.2
"""Shares by which peak velocity and duration may be off and still count as near."""
_FACTORS = (0.5, 300.0)
"""Times the usual weights, between which is searched."""
_SEARCHES = 12


@dataclass(frozen=True)
class Nearest:
    """The weights of a task with which the best saccades are nearest to a main sequence.

    Attributes:
        task: with these weights.
        factor: times the usual ones, energy apart.
        amplitude_deg: of the compared saccades, around straight ahead.
        peak_velocity: over the wanted one, (amplitudes,).
        duration: the same, above the velocity threshold.
        acceleration_share: of the duration.
        action: the best one, (amplitudes, numbers).
        motor_speed_deg_s: largest speed of any motor.
    """

    task: SaccadeTask
    factor: float
    amplitude_deg: Array
    peak_velocity: Array
    duration: Array
    acceleration_share: Array
    action: Array
    motor_speed_deg_s: float

    @property
    def off(self) -> float:
        """How far off at worst, in units of what still counts as near: at most 1 if all are."""
        return _off(self.peak_velocity, self.duration)

    @property
    def prevents(self) -> str:
        """What keeps it from being nearer, in words."""
        worst = {"velocity": np.abs(np.log(self.peak_velocity)) / np.log1p(NEAR_VELOCITY),
                 "duration": np.abs(np.log(self.duration)) / np.log1p(NEAR_DURATION)}  # fmt: skip
        if self.off <= 1:
            return "nothing: near enough at every amplitude"
        bound = next(number.high for number in self.task.actions.numbers if number.symbol == "B")
        if np.isclose(self.action[:, 0], bound).any():
            return "B at its bound"
        what = max(worst, key=lambda name: float(worst[name].max()))
        if what == "velocity" and self.peak_velocity[-1] > self.peak_velocity[0]:
            return "time costs in proportion, so that peak velocity does not level off (discount rate)"
        return "the pulse's tail: too long for its speed"


def nearest(
    task: SaccadeTask,
    wanted: MainSequence,
    random: np.random.Generator,
    amplitudes_deg: Sequence[float] = AT_DEG,
    progress: Callable[[float], object] | None = None,
) -> Nearest:
    """Search the weights of a task.

    Args:
        task: plant, actions and judge; its weights are the usual ones.
        wanted: main sequence to come near to.
        random: of the searches of best actions.
        amplitudes_deg: where the two are compared.
        progress: called with the share of the work that is done.

    Raises:
        InputError: targets about no single axis, or a range that does not hold the amplitudes.
    """
    amplitude = np.asarray(amplitudes_deg, float)
    if JUDGES[task.judge].of != "orientation":
        raise InputError("main sequences are compared of saccades about one axis; choose horizontal targets")
    if amplitude.max() > 2 * task.targets.limit_deg:
        raise InputError(
            f"the targets of plant {task.plant.name!r} reach {task.targets.limit_deg:g} deg to either side, so there "
            f"is no saccade of {amplitude.max():g} deg around straight ahead; compare smaller ones"
        )
    start, target = saccades(task.targets, *task.targets.symmetric(amplitude))
    seed = int(random.integers(2**63))
    done = 0

    def at(log_factor: float) -> Nearest:
        nonlocal done
        factor = float(np.exp(log_factor))
        weights = {name: value if name == "energy" else factor * value for name, value in task.weights.items()}
        one = replace(task, weights=weights)
        best = find_optimum(one, start, target, np.random.default_rng(seed)).action
        outcome = one.perform(start, best, target)
        trajectory = outcome.movement.trajectory()
        bout: Bout = above(trajectory)
        done += 1
        if progress is not None:
            progress(min(1.0, done / (_SEARCHES + 1)))
        speed = np.abs(np.diff(trajectory.motor, axis=1)).max(initial=0.0) / task.plant.step_s
        return Nearest(
            one,
            factor,
            amplitude,
            bout.peak_velocity_deg_s / wanted.peak_velocity(amplitude),
            1e3 * bout.duration_s / wanted.duration_ms(amplitude),
            bout.acceleration_share,
            best,
            float(speed),
        )

    found = minimize_scalar(
        lambda x: at(x).off, bounds=np.log(_FACTORS), method="bounded", options={"maxiter": _SEARCHES, "xatol": 0.02}
    )
    return at(float(found.x))


def _off(peak_velocity: Array, duration: Array) -> float:
    off = [np.abs(np.log(peak_velocity)) / np.log1p(NEAR_VELOCITY), np.abs(np.log(duration)) / np.log1p(NEAR_DURATION)]
    return float(np.nan_to_num(np.concatenate(off), nan=100.0).max())
