"""What the environments have in common: a batch of saccades, begun, performed and described."""

import inspect
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye.errors import InputError
from orient_eye.motor import names
from orient_eye.plants import Plant, make_plant
from orient_eye.state import State, as_numbers, unit
from orient_eye.task.saccade import Outcome, SaccadeTask
from orient_eye.task.table import outcome_columns

Array = NDArray[np.float64]
_REFERENCE_REWARD = 1e5  # where the log reward is 0: the cost of a large saccade done well
MOST_SACCADES = 1_000_000
"""In one batch: more fill the memory of most computers."""
RENDER_MODES = ("human", "rgb_array", "rgb_array_list")


def log_reward(total: Array) -> Array:
    """-log10(-R / 1e5): the reward on a scale on which its decades weigh alike.

    It grows with R, and an episode is one step on a deterministic plant, so the optimal policy is that
    of R itself. A reward of 0 counts as -1.
    """
    shaped: Array = -np.log10(np.maximum(-total, 1.0) / _REFERENCE_REWARD)
    return shaped


def observe(start: Array, target: Array) -> NDArray[np.float32]:
    """The state of thesis 4.2: quaternions of start and target, (saccades, 8)."""
    return np.concatenate([start, target], axis=-1).astype(np.float32)


def make_task(
    plant: Plant | SaccadeTask | str, plant_options: Mapping[str, Any] | None, task_options: Mapping[str, Any]
) -> SaccadeTask:
    """The task that an environment's arguments describe.

    Args:
        plant: a name of `orient_eye.plants.PLANTS`, a plant, or a whole task.
        plant_options: keywords of that plant.
        task_options: keywords of `SaccadeTask.of_case`, the case ("1" unless given) among them.

    Raises:
        InputError: options that do not go together, or that there are none of.
    """
    if isinstance(plant, SaccadeTask):
        if plant_options or task_options:
            raise InputError("plant and task options go with a plant; this task is made already")
        return plant
    if isinstance(plant, str):
        plant = make_plant(plant, **(plant_options or {}))
    elif plant_options:
        raise InputError("plant_options go with a plant's name; this plant is made already")
    known = [name for name in inspect.signature(SaccadeTask.of_case).parameters if name != "plant"]
    unknown = sorted(set(task_options) - set(known))
    if unknown:
        raise InputError(f"the environment has no option {', '.join(unknown)}; of a task it has {', '.join(known)}")
    return SaccadeTask.of_case(plant, **task_options)


class SaccadeBatch:
    """Saccades that are begun together and performed together.

    Args:
        task: plant, actions, targets and reward.
        log_reward: give the log reward.

    Attributes:
        start: of the saccades in progress; None where there are none.
        target: their desired orientations, (saccades, 4).
        outcome: of the last ones performed; None before.
    """

    def __init__(self, task: SaccadeTask, *, log_reward: bool = False) -> None:
        self.task, self.log_reward = task, log_reward
        self.start: State | None = None
        self.target: Array = np.empty((0, 4))
        self.outcome: Outcome | None = None

    def spaces(self) -> tuple[Any, Any]:
        """Boxes of the observation of one saccade and of its action, float32."""
        size = len(self.task.actions.numbers)
        return gymnasium.spaces.Box(-1, 1, (8,), np.float32), gymnasium.spaces.Box(-1, 1, (size,), np.float32)

    def begin(self, start: State, target: Array) -> NDArray[np.float32]:
        """Begin chosen saccades; returns their observations (saccades, 8)."""
        self.start, self.target = start, target
        return observe(start.orientation, target)

    def draw(
        self, count: int, random: np.random.Generator, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin saccades, drawn from the targets or chosen.

        Args:
            count: of saccades.
            random: what is not chosen is drawn from it.
            options: `start_ANGLE` and `target_ANGLE` for the angles of the task's targets [deg] (start_yaw_deg), or
                `start` and `target`, orientations w, x, y, z; each for one saccade, or one for each.

        Raises:
            InputError: unknown options, or a start or target that the eye cannot hold.
        """
        start, target = self.task.targets.draw(count, random)
        if options:
            start, target = self._chosen(count, start, target, dict(options))
        return self.begin(start, target)

    def _chosen(self, count: int, start: State, target: Array, options: dict[str, Any]) -> tuple[State, Array]:
        targets, orientations = self.task.targets, [start.orientation, target]
        for k, name in enumerate(("start", "target")):
            before = len(options)
            if name in options:
                orientations[k] = _numbers(name, options.pop(name), (count, 4))
            elif any(f"{name}_{angle}" in options for angle in targets.angles):
                told = targets.angles_of(orientations[k])
                for i, angle in enumerate(targets.angles):
                    key = f"{name}_{angle}"
                    if key in options:
                        told[:, i] = _numbers(key, options.pop(key), (count,))
                orientations[k] = targets.orientation(told)
            if len(options) < before:
                targets.check(targets.angles_of(unit(orientations[k])), name)
        if options:
            known = [f"{name}_{angle}" for name in ("start", "target") for angle in targets.angles]
            raise InputError(
                f"unknown reset options {sorted(options)}; there are {', '.join(known)} [deg], and start and target "
                "(orientations w, x, y, z)"
            )
        return targets.rest(orientations[0]), unit(orientations[1])

    def perform(
        self, scaled: ArrayLike, random: np.random.Generator | None = None
    ) -> tuple[Array, NDArray[np.float32]]:
        """Perform the saccades.

        Args:
            scaled: actions in -1 .. 1, (saccades, numbers); of one that is NaN the saccade fails.
            random: of a plant that is noisy.

        Returns:
            Rewards (saccades,), and observations of where the eyes came to rest (saccades, 8).

        Raises:
            InputError: none is in progress, or actions of another shape, or what are no real numbers.
        """
        if self.start is None:
            raise InputError("reset the environment before a saccade: an episode is one step")
        shape, scaled = (len(self.start), len(self.task.actions.numbers)), as_numbers("actions", scaled)
        if scaled.shape != shape:
            raise InputError(f"actions have the shape {shape}, got {scaled.shape}")
        start, self.start = self.start, None
        self.began = start
        self.action = self.task.actions.from_unit(scaled)
        outcome = self.task.perform(start, self.action, self.target, random)
        self.outcome = outcome
        total = outcome.reward.total
        final = np.where(outcome.measures.failed[:, None], start.orientation, outcome.measures.final)
        return log_reward(total) if self.log_reward else total, observe(final, self.target)

    def described(self) -> dict[str, Any]:
        """What happened, each (saccades,): the columns of `orient_eye.task.table.outcome_columns`."""
        assert self.outcome is not None
        return outcome_columns(self.task, self.began, self.target, self.action, self.outcome)

    def frames(self, saccade: int = 0, **options: Any) -> list[NDArray[np.uint8]]:
        """The last movement as pictures; options are those of `orient_eye.recording.frames.frames`."""
        from orient_eye.recording.frames import frames

        if self.outcome is None:
            return []
        return frames(self.outcome.movement.trajectory()[saccade], self.task.plant.drawn(), **options)

    def picture(self, saccade: int = 0) -> NDArray[np.uint8]:
        """The eye where it is: at the start of the saccade in progress, or at the end of the last one."""
        from orient_eye.recording.frames import still

        if self.start is not None:
            orientation, motor = self.start.orientation[saccade], self.start.motor[saccade]
        elif self.outcome is not None:
            trajectory = self.outcome.movement.trajectory()
            orientation, motor = trajectory.orientation[saccade, -1], trajectory.motor[saccade, -1]
        else:
            raise InputError("reset the environment before it can be drawn")
        motors = dict(zip(names(self.task.plant.motors), motor.tolist(), strict=True))
        return still(self.task.plant.drawn(), orientation, motors)


def check_render_mode(mode: str | None) -> str | None:
    """A render mode of ours.

    Raises:
        InputError: another.
    """
    if mode is not None and mode not in RENDER_MODES:
        raise InputError(f"unknown render mode {mode!r}; choose one of {', '.join(RENDER_MODES)}, or None")
    return mode


def _numbers(name: str, value: Any, shape: tuple[int, ...]) -> Array:
    try:
        numbers = np.broadcast_to(np.asarray(value, dtype=float).reshape((-1, *shape[1:])), shape).copy()
    except (TypeError, ValueError):
        numbers = np.full(shape, np.nan)
    if not np.isfinite(numbers).all():
        each = "one finite number of degrees" if len(shape) == 1 else "an orientation of four finite numbers"
        many = f", or one for each of the {shape[0]} saccades" if shape[0] > 1 else ""
        raise InputError(f"{name} is {each}{many}, got {value!r}")
    return numbers
