"""orient-eye: model, identify and teach a biomimetic robot eye.

    import orient_eye as oe

    plant = oe.make_plant("mujoco")                                  # or "lpf", "tavares"
    task = oe.SaccadeTask.of_case(plant, "1")                        # command, targets, reward
    start, target = oe.saccades(task.targets, [[0.0]], [[20.0]])     # yaw [deg]
    policy = oe.Policy.load("mujoco-1")                              # shipped, or a run directory
    outcome = task.perform(start, policy.act(start.orientation, target), target)
    outcome.measures.settling_time_s, outcome.reward.total, outcome.movement.trajectory()

Data flows one way: command -> plant -> movement -> measures -> reward; environment, trainer, recorder and command
line are thin layers on top. The first axis of every array is the saccade; angles are degrees, orientations unit
quaternions w, x, y, z from eye to head coordinates. `InputError` says what was got, what is allowed and what to do.

| for | |
|---|---|
| a plant | `make_plant`, `PLANTS`, `Plant`, `Motor`, `State` |
| a command | `PulseStep`, `Sampled`, `read_command`, `PULSES` |
| a movement | `Movement`, `Trajectory`, `Measures`, `measure` |
| a saccade | `SaccadeTask`, `Outcome`, `saccades`, `make_targets`, `TARGETS`, `CASES`, `Case`, `JUDGES` |
| the best action | `find_optimum`, `searched_optimum`, `solve_weights` |
| an environment | `gymnasium.make("OrientEye/Saccade-v0")`, `SaccadeEnv`, `SaccadeVectorEnv`; `SaccadeVecEnv` for SB3 |
| a policy | `Policy`, `train`, `TrainConfig` |
| a rig | `identify_plant`, `identify_recordings`, `read_recordings`, `Surrogate` |
| a picture | `record` (Rerun), `frames`, `write_film` |

Names are loaded when they are first used: importing orient_eye loads neither MuJoCo nor torch.
"""

from importlib import import_module, metadata
from typing import Any

import gymnasium

__version__ = metadata.version("orient-eye")

_PUBLIC = {
    "errors": ["InputError"],
    "motor": ["Motor"],
    "state": ["State"],
    "surrogate": ["Surrogate"],
    "commands": ["Sampled"],
    "commands.motor_file": ["read_command"],
    "commands.pulse_step": ["PulseStep"],
    "commands.pulses": ["PULSES"],
    "movement": ["Movement"],
    "movement.measures": ["Measures", "measure"],
    "movement.trajectory": ["Trajectory"],
    "eyes": ["EYES"],
    "eyes.model": ["build_model"],
    "plants": ["PLANTS", "Plant", "PlantKind", "make_plant"],
    "task.cases": ["CASES", "Case"],
    "task.judge": ["JUDGES", "Judge"],
    "task.saccade": ["Outcome", "SaccadeTask"],
    "task.solved_weights": ["solve_weights"],
    "task.targets": ["TARGETS", "make_targets", "saccades"],
    "search.optimum": ["find_optimum"],
    "search.optimum_cache": ["searched_optimum"],
    "environments.saccade_env": ["SaccadeEnv"],
    "environments.vector_env": ["SaccadeVectorEnv"],
    "environments.sb3_env": ["SaccadeVecEnv"],
    "learning.policy": ["Policy"],
    "learning.config": ["TrainConfig"],
    "learning.training": ["train"],
    "sysid": ["identify_plant", "identify_recordings", "read_recordings"],
    "recording": ["record"],
    "recording.frames": ["frames", "write_film"],
}
_WHERE = {name: module for module, names in _PUBLIC.items() for name in names}

__all__ = ["__version__", *sorted(_WHERE)]  # noqa: PLE0604  # strings, all of them


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module 'orient_eye' has no attribute {name!r}; it offers {', '.join(__all__)}")
    return getattr(import_module(f"orient_eye.{_WHERE[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


gymnasium.register(
    id="OrientEye/Saccade-v0",
    entry_point="orient_eye.environments.saccade_env:SaccadeEnv",
    vector_entry_point="orient_eye.environments.vector_env:SaccadeVectorEnv",
)
