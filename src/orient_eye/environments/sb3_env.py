"""Many saccades a step for Stable-Baselines3, in one batch of the plant.

env = SaccadeVecEnv(128, "lpf", log_reward=True)
SAC("MlpPolicy", env).learn(10_000)
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from orient_eye.checks import whole
from orient_eye.environments.batch import MOST_SACCADES, SaccadeBatch, check_render_mode, make_task
from orient_eye.errors import InputError
from orient_eye.plants import Plant
from orient_eye.state import State
from orient_eye.task.saccade import Outcome, SaccadeTask
from orient_eye.task.table import rows_of

Array = NDArray[np.float64]


class SaccadeVecEnv(VecEnv):
    """`SaccadeEnv` many times over, for Stable-Baselines3.

    Every step ends all episodes and begins new ones. Start and target come from one generator, so that
    the same seed gives the same saccades whatever the plant.

    Args:
        saccades: environments in the batch.
        plant: a name of `orient_eye.plants.PLANTS`, a plant, or a whole task.
        plant_options: keywords of that plant.
        log_reward: give the log reward.
        seed: of starts and targets, 0 or more.
        render_mode: "rgb_array" or None.
        infos: give `info` of every saccade, the row of `orient_eye.task.table`; without, only what SB3 needs, which
            is quicker.
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
        render_mode: str | None = None,
        infos: bool = True,
        **task_options: Any,
    ) -> None:
        saccades = whole("saccades", saccades, 1, MOST_SACCADES, advice="so many are one batch; the plant comes second")
        if seed is not None:
            seed = whole("seed", seed, 0)
        if render_mode not in (None, "rgb_array"):
            raise InputError(f"SB3 renders 'rgb_array' or nothing, got {render_mode!r}")
        self.render_mode = check_render_mode(render_mode)
        self.task = make_task(plant, plant_options, task_options)
        self.batch = SaccadeBatch(self.task, log_reward=log_reward)
        self.infos = infos
        super().__init__(saccades, *self.batch.spaces())
        self.random = np.random.default_rng(seed)
        self._draw()

    @property
    def log_reward(self) -> bool:
        """Whether it gives the log reward."""
        return self.batch.log_reward

    @log_reward.setter
    def log_reward(self, value: bool) -> None:
        self.batch.log_reward = value

    @property
    def outcome(self) -> Outcome | None:
        """Of the last step, for callbacks."""
        return self.batch.outcome

    def begin(self, start: State, target: Array) -> NDArray[np.float32]:
        """Begin chosen saccades; returns their observations."""
        return self.batch.begin(start, target)

    def _draw(self, options: dict[str, Any] | None = None) -> NDArray[np.float32]:
        return self.batch.draw(self.num_envs, self.random, options)

    def reset(self) -> VecEnvObs:
        """Begin new saccades everywhere. A seed given by `seed()` and options given by `set_options()` take effect.

        Raises:
            InputError: options that are not the same keys for every saccade, or unknown.
        """
        if self._seeds[0] is not None:
            self.random = np.random.default_rng(self._seeds[0])
        given = [options or {} for options in self._options]
        self._reset_seeds()
        self._reset_options()
        return self._draw(self._as_one(given))

    @staticmethod
    def _as_one(each: list[dict[str, Any]]) -> dict[str, Any] | None:
        """The options of all saccades, as one."""
        if any(set(options) != set(each[0]) for options in each):
            raise InputError("set_options: give the same keys for every saccade, or the same options for all")
        return {key: np.array([options[key] for options in each]) for key in each[0]} or None

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions, scaled to [-1, 1], (saccades, numbers)."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Perform the saccades and begin new ones."""
        rewards, ended = self.batch.perform(self._actions, self.random)
        told = rows_of(self.batch.described(), missing=np.nan) if self.infos else [{} for _ in ended]
        infos: list[dict[str, Any]] = [
            {**row, "terminal_observation": final, "TimeLimit.truncated": False}
            for row, final in zip(told, ended, strict=True)
        ]
        return self._draw(), rewards.astype(np.float32), np.ones(self.num_envs, bool), infos

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """A picture of every eye where it is."""
        return [self.batch.picture(i) for i in range(self.num_envs)]

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
