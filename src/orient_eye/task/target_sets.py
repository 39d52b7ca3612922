"""The names of the sets of targets, without anything that computes: the command line lists them."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from orient_eye.registry import Registry

if TYPE_CHECKING:
    from orient_eye.task.targets import Targets

TARGETS: "Registry[Callable[..., Targets]]" = Registry(
    "target",
    {
        "horizontal": "orient_eye.task.targets:AxisTargets",
        "vertical": "orient_eye.task.targets:vertical",
        "torsional": "orient_eye.task.targets:torsional",
        "gaze": "orient_eye.task.gaze_targets:GazeTargets",
    },
)
"""Name to a set; each takes the plant, and options of its own."""
