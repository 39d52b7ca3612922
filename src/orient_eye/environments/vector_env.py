"""Many saccades a step for Gymnasium, in one batch of the plant.

envs = gymnasium.make_vec("OrientEye/Saccade-v0", 512, "vector_entry_point", plant="lpf")
observations, infos = envs.reset(seed=0)
observations, rewards, terminations, truncations, infos = envs.step(actions)
"""

from typing import Any, ClassVar

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from orient_eye.checks import whole
from orient_eye.environments.batch import MOST_SACCADES, RENDER_MODES, SaccadeBatch, check_render_mode, make_task
from orient_eye.errors import InputError
from orient_eye.plants import Plant
from orient_eye.task.saccade import SaccadeTask


class SaccadeVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """`SaccadeEnv` many times over, in one batch.

    Every step ends all episodes and begins new ones (autoreset mode SAME_STEP): the observations are those of
    the new saccades, and `infos["final_obs"]` has those of the ended ones, `infos["final_info"]` the columns of
    `orient_eye.task.table`, each (num_envs,). Starts and targets come from one generator, so that the same seed gives
    the same saccades whatever the plant.

    Args:
        num_envs: saccades in the batch.
        plant: as in `SaccadeEnv`, and so are the others.
        plant_options: keywords of that plant.
        log_reward: give the log reward.
        render_mode: "rgb_array" or "rgb_array_list", as in `SaccadeEnv`, for each saccade; or None.
        task_options: keywords of `orient_eye.task.saccade.SaccadeTask.of_case`.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]  # gymnasium's own form
        "render_modes": [mode for mode in RENDER_MODES if mode != "human"],
        "render_fps": 30,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        plant: Plant | SaccadeTask | str = "lpf",
        *,
        plant_options: dict[str, Any] | None = None,
        log_reward: bool = False,
        render_mode: str | None = None,
        **task_options: Any,
    ) -> None:
        if render_mode == "human":
            raise InputError("render_mode 'human' shows one saccade; use gymnasium.make, or 'rgb_array_list'")
        self.render_mode = check_render_mode(render_mode)
        self.num_envs = whole("num_envs", num_envs, 1, MOST_SACCADES, advice="so many saccades are one batch")
        self.task = make_task(plant, plant_options, task_options)
        self.batch = SaccadeBatch(self.task, log_reward=log_reward)
        self.single_observation_space, self.single_action_space = self.batch.spaces()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin new saccades everywhere, drawn, or chosen by options as in `SaccadeEnv`: one value, or one for each."""
        super().reset(seed=seed)
        return self.batch.draw(self.num_envs, self.np_random, options), {}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Perform the saccades (num_envs, numbers) and begin new ones."""
        rewards, ended = self.batch.perform(actions, self.np_random)
        every = np.ones(self.num_envs, bool)
        infos = {"final_obs": ended, "_final_obs": every, "final_info": self.batch.described(), "_final_info": every}
        observations = self.batch.draw(self.num_envs, self.np_random)
        return observations, rewards, every, ~every, infos

    def render(self) -> Any:
        """For each saccade, the frames of its last movement, or a picture of where its eye is."""
        if self.render_mode == "rgb_array":
            return tuple(self.batch.picture(i) for i in range(self.num_envs))
        if self.render_mode == "rgb_array_list":
            return tuple(self.batch.frames(i) or [self.batch.picture(i)] for i in range(self.num_envs))
        return None
