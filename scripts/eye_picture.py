"""The picture at the top of README.md: a saccade of a shipped policy on the whole eye, as the viewer shows it.

    python scripts/eye_picture.py                          # docs/pictures/eye.png

The viewer's own bars are cut off, and the colours are 256.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import tyro
from PIL import Image

from orient_eye.errors import InputError
from orient_eye.files import write_atomically
from orient_eye.learning.policy import Policy
from orient_eye.plants import make_plant
from orient_eye.recording import record
from orient_eye.recording.viewer import screenshot
from orient_eye.task.targets import saccades

_ABOVE, _BELOW = 65, 31  # pixels: the viewer's menu and tabs, its timeline


@dataclass(frozen=True)
class EyePicture:
    """Perform the saccade, record it, and take its picture."""

    out: Path = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "eye.png"
    """The picture, PNG."""
    policy: str = "tavares-gaze"
    """A policy of gaze targets."""
    start: tuple[float, float] = (-20.0, -12.0)
    """Yaw and pitch, deg."""
    target: tuple[float, float] = (20.0, 14.0)
    """Yaw and pitch, deg."""
    at: float = 0.05
    """Instant, s."""
    size: tuple[int, int] = (1480, 960)
    """Width and height of the window, pixels."""


def main(wanted: EyePicture) -> None:
    """Write the picture.

    Raises:
        InputError: no such policy or saccade, or the viewer could not show it all.
    """
    policy, plant = Policy.load(wanted.policy), make_plant("mujoco")
    task = policy.task(plant)
    start, target = saccades(task.targets, [wanted.start], [wanted.target])
    trajectory = task.trajectory(start, policy.act(start.orientation, target), target)
    with TemporaryDirectory(prefix="orient-eye-") as folder:
        recording = record(Path(folder) / "saccade.rrd", trajectory, model=plant.drawn(), titles=["eye"])
        shot = Path(folder) / "shot.png"
        reports = screenshot(recording, shot, at_s=wanted.at, size=wanted.size)
        if reports:
            raise InputError(f"the viewer did not show {'; '.join(reports)}; look at the recording")
        with Image.open(shot) as whole:
            inner = whole.convert("RGB").crop((0, _ABOVE, whole.width, whole.height - _BELOW))
    picture = inner.quantize(256, dither=Image.Dither.NONE)
    write_atomically(wanted.out, lambda file: picture.save(file, optimize=True))


if __name__ == "__main__":
    try:
        main(tyro.cli(EyePicture, description=__doc__))
    except InputError as error:
        sys.exit(f"error: {error}")
