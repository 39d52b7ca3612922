"""The Gymnasium environment of one saccade.

env = gymnasium.make("OrientEye/Saccade-v0", plant="mujoco")
observation, info = env.reset(seed=0, options={"start_yaw_deg": 0.0, "target_yaw_deg": 20.0})
observation, reward, terminated, truncated, info = env.step(action)

In all directions, by three motors: gymnasium.make("OrientEye/Saccade-v0", plant="tavares", targets="gaze").
"""

from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from orient_eye.environments.batch import RENDER_MODES, SaccadeBatch, check_render_mode, make_task
from orient_eye.plants import Plant
from orient_eye.state import as_numbers
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.table import rows_of


class SaccadeEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Turn the eye from one gaze direction to another with one open-loop motor command.

    ## Observation (8 numbers, float32)
    | index | what | range |
    |---|---|---|
    | 0 to 3 | orientation of the eye, quaternion w, x, y, z | -1 .. 1 |
    | 4 to 7 | desired orientation, quaternion w, x, y, z | -1 .. 1 |

    ## Action (the numbers of the task's actions, float32, each in -1 .. 1)
    For each driven motor, on the plants of the thesis (`env.unwrapped.task.actions.numbers` has them on any):
    | index | what | -1 | +1 |
    |---|---|---|---|
    | 0 | B, decay of the pulse | 18 1/s | 80 1/s |
    | 1 | D, final motor position | -80 deg (lpf), -40 deg (mujoco, tavares) | +80, +40 deg |
    | 2 | k0, gain of the integrator | 5 1/s | 40 1/s |

    With `targets="gaze"` all three motors are driven, and their nine numbers are told from a usual command, the action
    of zeros (`orient_eye.task.residual_actions`); on the thesis' eye:
    | index | what | -1 | +1 |
    |---|---|---|---|
    | 0, 3, 6 | B of motor 1, 2, 3, times the usual one | 0.55 | 1.82 |
    | 1, 4, 7 | D, beside the usual one | -5.7, -3.1, -5.7 deg | +5.7, +3.1, +5.7 deg |
    | 2, 5, 8 | k0, times the usual one | 0.67 | 1.49 |

    ## Reward
    lambda_a R_a + lambda_e R_e + lambda_d R_d + lambda_o R_o (thesis 4.32; `orient_eye.task.judge`), between
    -1e10 and 0: about -7e4 for a good saccade of 30 deg. With gaze targets accuracy is that of the gaze, and a fifth
    term is the force of the fixation beyond the least (docs/gaze.md). With `log_reward=True`, -log10 of its size in
    units of 1e5, which has the same optimal policy and is easier to learn.

    ## Start and end of an episode
    Start and target are drawn uniformly from +-35 deg of yaw, or chosen: `reset(options={"start_yaw_deg": 0.0,
    "target_yaw_deg": 20.0})`, or by orientation, `options={"target": [w, x, y, z]}`. Gaze targets lie anywhere up to
    30 deg from straight ahead and have a pitch too, positive down: `start_pitch_deg`, `target_pitch_deg`; an angle that
    is left out is drawn. The eye rests at the start. The first step ends the episode (`terminated`); `info` then holds
    B, D and k0 in units, the measures and the reward's weighted terms (`orient_eye.task.table`).

    ## Pictures
    An episode is one step, so what `render` returns after it is the whole movement: `render_mode="rgb_array_list"`
    gives its frames (before the first step, one of the eye at rest), "rgb_array" a picture of where the eye is,
    "human" opens the movement in Rerun's viewer at every step. `orient_eye.recording.frames.write_film` makes a film.

    ## Version
    v0: the first.

    Args:
        plant: a name of `orient_eye.plants.PLANTS`, a plant, or a whole task.
        plant_options: keywords of that plant.
        log_reward: give the log reward.
        render_mode: "human", "rgb_array", "rgb_array_list", or None.
        task_options: keywords of `orient_eye.task.saccade.SaccadeTask.of_case`: case ("1" unless given), targets,
            driven, weights, judge, actions, action_options, band, speed_limit, horizon_s.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]  # gymnasium's own form
        "render_modes": list(RENDER_MODES),
        "render_fps": 30,
    }

    def __init__(
        self,
        plant: Plant | SaccadeTask | str = "lpf",
        *,
        plant_options: dict[str, Any] | None = None,
        log_reward: bool = False,
        render_mode: str | None = None,
        **task_options: Any,
    ) -> None:
        self.render_mode = check_render_mode(render_mode)
        self.task = make_task(plant, plant_options, task_options)
        self.batch = SaccadeBatch(self.task, log_reward=log_reward)
        self.observation_space, self.action_space = self.batch.spaces()
        self._viewer: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Rest at a start, drawn or chosen; see the class.

        Raises:
            InputError: unknown options, or a start the eye cannot hold.
        """
        super().reset(seed=seed)
        observation = self.batch.draw(1, self.np_random, options)[0]
        assert self.batch.start is not None
        info: dict[str, Any] = {}
        for name, orientation in (("start", self.batch.start.orientation), ("target", self.batch.target)):
            told = self.task.targets.angles_of(orientation)[0]
            info |= {f"{name}_{angle}": float(x) for angle, x in zip(self.task.targets.angles, told, strict=True)}
        return observation, info

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Perform the saccade; the episode ends. The observation then shows where the eye came to rest."""
        reward, observation = self.batch.perform(as_numbers("an action", action)[None], self.np_random)
        info = rows_of(self.batch.described(), missing=np.nan)[0]
        if self.render_mode == "human":
            self.render()
        return observation[0], float(reward[0]), True, False, info

    def render(self) -> Any:
        """The frames of the last movement, a picture, or the viewer; see the class."""
        if self.render_mode == "rgb_array":
            return self.batch.picture()
        if self.render_mode == "rgb_array_list":
            return self.batch.frames() or [self.batch.picture()]
        if self.render_mode == "human" and self.batch.outcome is not None:
            from orient_eye.recording.live import LiveViewer

            self._viewer = self._viewer or LiveViewer()
            self._viewer.show(self.batch.outcome.movement.trajectory(), self.batch.target, self.task.plant.drawn())
        return None

    def close(self) -> None:
        """Close the viewer, where there is one."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None
