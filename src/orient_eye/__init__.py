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
| a direction of gaze | `Fixations`, `torsion`, `with_torsion`, `fit_plane` (docs/gaze.md) |
| a saccade | `SaccadeTask`, `Outcome`, `saccades`, `make_targets`, `TARGETS`, `CASES`, `Case`, `JUDGES` |
| the best action | `find_optimum`, `searched_optimum`, `solve_weights` |
| an environment | `gymnasium.make("OrientEye/Saccade-v0")`, `SaccadeEnv`, `SaccadeVectorEnv`; `SaccadeVecEnv` for SB3 |
| a policy | `Policy`, `train`, `TrainConfig` |
| a rig | `identify_plant`, `identify_recordings`, `read_recordings`, `Surrogate`; `identify_modes`, `ModalSurrogate` |
| a picture | `record`, `record_sequence` (Rerun), `frames`, `write_film` |

Names are loaded when they are first used: importing orient_eye loads neither NumPy, MuJoCo nor torch.
"""

import sys
from importlib import metadata
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

import lazy_loader

__version__ = metadata.version("orient-eye")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)  # the names stand in __init__.pyi


def _register() -> None:
    import gymnasium

    gymnasium.register(
        id="OrientEye/Saccade-v0",
        entry_point="orient_eye.environments.saccade_env:SaccadeEnv",
        vector_entry_point="orient_eye.environments.vector_env:SaccadeVectorEnv",
    )


class _OnceImported(MetaPathFinder):
    """Registers the environment when somebody imports gymnasium, for whose import --help need not wait."""

    def find_spec(self, fullname: str, path: Any = None, target: ModuleType | None = None) -> ModuleSpec | None:
        if fullname != "gymnasium":
            return None
        others = (finder.find_spec(fullname, path, target) for finder in sys.meta_path if finder is not self)
        spec = next((found for found in others if found is not None), None)
        if spec is None or spec.loader is None:
            return None
        loader, execute = spec.loader, spec.loader.exec_module

        def and_register(module: ModuleType) -> None:
            execute(module)
            sys.meta_path.remove(self)
            loader.__dict__.pop("exec_module")
            _register()

        vars(loader)["exec_module"] = and_register
        return spec


if "gymnasium" in sys.modules:
    _register()
else:
    sys.meta_path.insert(0, _OnceImported())
