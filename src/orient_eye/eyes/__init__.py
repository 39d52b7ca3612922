"""Eyes: an MJCF file each, and what a preset changes in it.

A variation of an eye is a function on its `MjSpec` and a line in `EYES`; another eye is another file of the same
form. `orient_eye.eyes.model.build_model` compiles one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from orient_eye.eyes.presets import eve_v3
from orient_eye.registry import Registry

if TYPE_CHECKING:
    import mujoco


@dataclass(frozen=True)
class Eye:
    """An entry of `EYES`.

    Attributes:
        summary: what it is, for people.
        file: MJCF, in `eye_mjcf` or with its whole path.
        change: what differs from the file; None for nothing.
    """

    summary: str
    file: Path
    change: "Callable[[mujoco.MjSpec], None] | None" = None


EYES: Registry[Eye] = Registry(
    "eye",
    {
        "thesis": Eye("the thesis' eye: three motors, six elastics", Path("eye3.xml")),
        "eve_v3": Eye("the group's second parameter set", Path("eye3.xml"), eve_v3),
        "six": Eye("the group's cable eye: six motors, one for each muscle", Path("eye6.xml")),
    },
    Eye,
)
"""Name to eye."""
