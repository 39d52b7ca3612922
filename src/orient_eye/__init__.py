"""orient-eye: model, identify and teach a biomimetic robot eye.

    import gymnasium, orient_eye
    env = gymnasium.make("OrientEye/Saccade-v0", plant="mujoco")

Data flows one way: command -> plant -> trajectory -> measures -> reward; environment, trainer,
recorder and command line are thin layers on top. Start reading at `plants/__init__.py`.
"""

from importlib import metadata

import gymnasium

__version__ = metadata.version("orient-eye")

gymnasium.register(id="OrientEye/Saccade-v0", entry_point="orient_eye.environments.saccade_env:SaccadeEnv")
