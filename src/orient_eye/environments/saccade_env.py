"""Saccades as a reinforcement-learning environment: one episode is one saccade is one step.

    env = gymnasium.make("OrientEye/Saccade-v0", plant="mujoco")
    observation, info = env.reset(seed=0, options={"start_yaw_deg": 0.0, "target_yaw_deg": 20.0})
    observation, reward, terminated, truncated, info = env.step(action)

`SaccadeEnv` is the Gymnasium environment, `SaccadeVecEnv` the same for Stable-Baselines3, with as many
saccades a step as wanted in one batch of the plant. Both are thin: `SaccadeTask` does the work.
"""

from dataclasses import asdict
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from orient_eye.errors import InputError
from orient_eye.plants import Plant, make_plant
from orient_eye.rotations import to_euler
from orient_eye.task.saccade import Fixation, Outcome, SaccadeTask, horizontal

Array = NDArray[np.float64]
_REFERENCE_REWARD = 1e5  # where the log reward is 0: the cost of a large saccade done well


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


def to_action(task: SaccadeTask, scaled: NDArray[Any]) -> Array:
    """B, D, k0 (saccades, driven, 3) from scaled actions in [-1, 1] (saccades, 3 driven)."""
    shares = (np.clip(np.asarray(scaled, float), -1, 1) + 1) / 2
    low, high = task.action_low, task.action_high
    return low + shares.reshape(len(shares), *low.shape) * (high - low)


def to_scaled(task: SaccadeTask, action: Array) -> Array:
    """The inverse of `to_action`."""
    low, high = task.action_low, task.action_high
    return (2 * (action - low) / (high - low) - 1).reshape(len(action), -1)


def _task(
    plant: Plant | SaccadeTask | str, plant_options: dict[str, Any] | None, task_options: dict[str, Any]
) -> SaccadeTask:
    if isinstance(plant, SaccadeTask):
        if plant_options or task_options:
            raise InputError("plant and task options go with a plant; this task is made already")
        return plant
    if isinstance(plant, str):
        plant = make_plant(plant, **(plant_options or {}))
    elif plant_options:
        raise InputError("plant_options go with a plant's name; this plant is made already")
    return SaccadeTask.of_case(plant, **{"case": "1", **task_options})


class SaccadeEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Turn the eye from one gaze direction to another with one open-loop motor command.

    ## Observation (8 numbers, float32)
    | index | what | range |
    |---|---|---|
    | 0 to 3 | orientation of the eye, quaternion w, x, y, z | -1 .. 1 |
    | 4 to 7 | desired orientation, quaternion w, x, y, z | -1 .. 1 |

    ## Action (3 numbers a driven motor, float32, each in -1 .. 1)
    | index | what | -1 | +1 |
    |---|---|---|---|
    | 0 | B, decay of the pulse | 18 1/s | 80 1/s |
    | 1 | D, final motor position | -80 deg (lpf), -40 deg (mujoco, tavares) | +80, +40 deg |
    | 2 | k0, gain of the integrator | 5 1/s | 40 1/s |

    ## Reward
    lambda_a R_a + lambda_e R_e + lambda_d R_d + lambda_o R_o (thesis 4.32; `orient_eye.task.reward`), between
    -1e10 and 0: about -7e4 for a good saccade of 30 deg. With `log_reward=True`, -log10 of its size in
    units of 1e5, which has the same optimal policy and is easier to learn.

    ## Start and end of an episode
    Start and target are drawn uniformly from +-35 deg of yaw, or chosen:
    `reset(options={"start_yaw_deg": 0.0, "target_yaw_deg": 20.0})`. The eye rests at the start. The first
    step ends the episode (`terminated`); `info` then holds B, D, k0, the measures and the reward's terms.

    ## Version
    v0: the first.

    Args:
        plant: a name of `orient_eye.plants.PLANTS`, a plant, or a whole task.
        plant_options: keywords of that plant.
        log_reward: give the log reward.
        task_options: the case, a name of `orient_eye.task.cases.CASES` ("1" unless given), and keywords of
            `SaccadeTask` that differ from it: driven, variant, C, weights, speed_limit, band, horizon_s.
    """

    metadata = {"render_modes": []}  # noqa: RUF012  # gymnasium's own form

    def __init__(
        self,
        plant: Plant | SaccadeTask | str = "lpf",
        *,
        plant_options: dict[str, Any] | None = None,
        log_reward: bool = False,
        **task_options: Any,
    ) -> None:
        self.task = _task(plant, plant_options, task_options)
        self.log_reward = log_reward
        self.observation_space, self.action_space = _spaces(self.task)
        self._start: Fixation | None = None
        self._target = np.empty((1, 4))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Rest at a start, drawn or chosen; see the class.

        Raises:
            InputError: unknown options, or a start the eye cannot hold.
        """
        super().reset(seed=seed)
        options = options or {}
        unknown = set(options) - {"start_yaw_deg", "target_yaw_deg"}
        if unknown:
            raise InputError(f"unknown reset options {sorted(unknown)}; there are start_yaw_deg and target_yaw_deg")
        start, target = self.task.draw_yaw(1, self.np_random)
        yaw = [
            _one_angle(name, options.get(name, drawn[0]))
            for name, drawn in (("start_yaw_deg", start), ("target_yaw_deg", target))
        ]
        self._start, self._target = self.task.fixate(horizontal(yaw[0])), horizontal(yaw[1])
        info = {"start_yaw_deg": yaw[0], "target_yaw_deg": yaw[1]}
        return observe(self._start.orientation, self._target)[0], info

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Perform the saccade; the episode ends. The observation then shows where the eye came to rest."""
        if self._start is None:
            raise InputError("reset the environment before a saccade: an episode is one step")
        outcome = self.task.perform(self._start, to_action(self.task, np.asarray(action)[None]), self._target)
        total = outcome.reward.total
        value = float((log_reward(total) if self.log_reward else total)[0])
        final = np.where(outcome.measures.failed[:, None], self._start.orientation, outcome.measures.final)
        self._start = None
        return observe(final, self._target)[0], value, True, False, describe(outcome)[0]


def _one_angle(name: str, value: Any) -> float:
    try:
        angle = float(np.asarray(value, float).reshape(()))
    except (TypeError, ValueError):
        angle = np.nan
    if not np.isfinite(angle):
        raise InputError(f"{name} is one finite number of degrees, got {value!r}")
    return angle


def describe(outcome: Outcome) -> list[dict[str, Any]]:
    """What happened, one dictionary a saccade: action, measures, terms of the reward."""
    command, measures = outcome.command, outcome.measures
    table: dict[str, Any] = {"B": command.B, "D": command.D, "k0": command.k0, "F": command.F}
    table |= {name: value for name, value in asdict(measures).items() if name not in ("final", "at_settling")}
    table |= {f"reward_{name}": value for name, value in asdict(outcome.reward).items()}
    table |= {
        "final_yaw_deg": to_euler(measures.final)[0],
        "saturated": outcome.saturated,
        "too_fast": outcome.too_fast,
    }
    rows = []
    for i in range(len(measures.failed)):
        row = {name: np.squeeze(value[i]) for name, value in table.items()}
        rows.append({name: value.item() if value.ndim == 0 else value for name, value in row.items()})
    return rows


def _spaces(task: SaccadeTask) -> tuple[Any, Any]:
    """Spaces of observation and action, both boxes of float32."""
    return (
        gymnasium.spaces.Box(-1, 1, (8,), np.float32),
        gymnasium.spaces.Box(-1, 1, (3 * len(task.driven),), np.float32),
    )


class SaccadeVecEnv(VecEnv):
    """Many saccades a step for Stable-Baselines3, in one batch of the plant.

    Every step ends all episodes and begins new ones. Start and target come from one generator, so that
    the same seed gives the same saccades whatever the plant.

    Args:
        saccades: environments in the batch.
        plant: a name of `orient_eye.plants.PLANTS`, a plant, or a whole task.
        plant_options: keywords of that plant.
        log_reward: give the log reward.
        seed: of starts and targets.
        task_options: as in `SaccadeEnv`.
    """

    def __init__(
        self,
        saccades: int,
        plant: Plant | SaccadeTask | str = "lpf",
        *,
        plant_options: dict[str, Any] | None = None,
        log_reward: bool = False,
        seed: int | None = None,
        **task_options: Any,
    ) -> None:
        self.task = _task(plant, plant_options, task_options)
        self.log_reward = log_reward
        self.render_mode = None
        super().__init__(saccades, *_spaces(self.task))
        self.random = np.random.default_rng(seed)
        self.outcome: Outcome | None = None
        """Of the last step, for callbacks."""
        self._draw()

    def begin(self, start_yaw_deg: Array, target_yaw_deg: Array) -> NDArray[np.float32]:
        """Begin chosen saccades [deg] (saccades,); returns their observations."""
        self.yaw_deg = (start_yaw_deg, target_yaw_deg)
        self._start, self._target = self.task.fixate(horizontal(start_yaw_deg)), horizontal(target_yaw_deg)
        return observe(self._start.orientation, self._target)

    def _draw(self) -> NDArray[np.float32]:
        return self.begin(*self.task.draw_yaw(self.num_envs, self.random))

    def reset(self) -> VecEnvObs:
        """Begin new saccades everywhere. A seed given by `seed()` takes effect here."""
        if self._seeds[0] is not None:
            self.random = np.random.default_rng(self._seeds[0])
        self._reset_seeds()
        self._reset_options()
        return self._draw()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions, scaled to [-1, 1], (saccades, 3 driven)."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Perform the saccades and begin new ones."""
        outcome = self.task.perform(self._start, to_action(self.task, self._actions), self._target)
        self.outcome = outcome
        final = np.where(outcome.measures.failed[:, None], self._start.orientation, outcome.measures.final)
        ended = observe(final, self._target)
        total = outcome.reward.total
        rewards = (log_reward(total) if self.log_reward else total).astype(np.float32)
        infos: list[dict[str, Any]] = [{"terminal_observation": row, "TimeLimit.truncated": False} for row in ended]
        return self._draw(), rewards, np.ones(self.num_envs, bool), infos

    def close(self) -> None:
        """Nothing to close."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The attribute of this batch, once for each index."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set the attribute of the whole batch."""
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call the method of this batch once for each index."""
        return [getattr(self, method_name)(*method_args, **method_kwargs) for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        """No environment of a batch is wrapped."""
        return [False for _ in self._get_indices(indices)]
