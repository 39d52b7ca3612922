"""Pictures of a recording at several instants, tabs and window sizes, without a screen.

    python scripts/screenshot_recording.py saccades.rrd --at 0.02 0.1 --tabs "+20°" "75 %/+20°"

Look at them after a change of the layout. Exits with 1 when the viewer reports something it cannot show.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from orient_eye.errors import InputError
from orient_eye.recording.viewer import screenshot


@dataclass(frozen=True)
class Screenshots:
    """Save pictures of a recording as NAME-TAB-WIDTHxHEIGHT-INSTANTms.png."""

    file: Annotated[Path, tyro.conf.Positional]
    """Recording, NAME.rrd."""
    out: Path = Path("out")
    """Folder of the pictures."""
    at: tuple[float, ...] = (0.05,)
    """Instants, s."""
    tabs: tuple[str, ...] = ("",)
    """Names of tabs, as TAB or GROUP/TAB; the first tab is the empty name."""
    sizes: tuple[tuple[int, int], ...] = ((1600, 900),)
    """Width and height of the window, pixels."""


def main(wanted: Screenshots) -> int:
    """Take all pictures; returns how many views the viewer could not show."""
    faults = 0
    for width, height in wanted.sizes:
        for tab in wanted.tabs:
            for at in wanted.at:
                name = "-".join([wanted.file.stem, tab.replace("/", "-") or "first", f"{width}x{height}"])
                picture = wanted.out / f"{name}-{1000 * at:.0f}ms.png"
                path = tuple(filter(None, tab.split("/")))
                reports = screenshot(wanted.file, picture, at_s=at, tab=path, size=(width, height))
                print(picture, *reports, sep="\n  ")
                faults += len(reports)
    return faults


if __name__ == "__main__":
    try:
        sys.exit(1 if main(tyro.cli(Screenshots)) else 0)
    except InputError as error:
        sys.exit(f"error: {error}")
