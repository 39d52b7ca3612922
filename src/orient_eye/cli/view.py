"""`orient-eye view`: show a recording."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from orient_eye.cli import say
from orient_eye.errors import InputError


@dataclass(frozen=True)
class View:
    """Show a recording of saccades in the Rerun viewer.

    The first tab compares all saccades, then each has its own; space plays and pauses, at a tenth of the
    speed. Without a screen: --web serves it to a browser on this machine, --screenshot saves a picture.

    Examples:
        orient-eye view runs/first/trajectory.rrd
        orient-eye view runs/first/trajectory.rrd --screenshot eye.png --at 0.05
    """

    file: Annotated[Path, tyro.conf.Positional]
    """Recording, NAME.rrd."""
    web: bool = False
    """Serve it to a browser on this machine, until interrupted."""
    screenshot: Path | None = None
    """Save a picture (PNG) instead of opening a window."""
    at: float | None = None
    """Instant of the picture, s; the end by default."""
    tab: tuple[str, ...] = ()
    """Tab of the picture: its name, or a group's and then the saccade's; the first by default."""
    size: tuple[int, int] = (1600, 900)
    """Width and height of the picture, pixels."""

    def run(self) -> dict[str, Any]:
        """Show the recording; returns when it is closed."""
        self._check()
        from orient_eye.recording import viewer

        result: dict[str, Any] = {"file": str(self.file)}
        if self.screenshot is not None:
            missing = viewer.screenshot(self.file, self.screenshot, at_s=self.at, tab=self.tab, size=self.size)
            for report in missing:
                print(f"not shown: {report}", file=sys.stderr)
            say(f"wrote {self.screenshot}")
            result |= {"screenshot": str(self.screenshot), "not_shown": missing}
        elif self.web:
            say("Open this address in a browser on this machine; Ctrl+C ends it.")
            result["address"] = viewer.serve(self.file, lambda address: print(address, file=sys.stderr, flush=True))
        else:
            viewer.open_window(self.file)
        return result

    def _check(self) -> None:
        if self.file.is_dir():
            raise InputError(f"{self.file} is a folder; name the recording in it, NAME.rrd")
        if not self.file.is_file():
            raise InputError(f"{self.file} does not exist; `orient-eye simulate` writes recordings, NAME.rrd")
        with self.file.open("rb") as file:
            recording = file.read(3) == b"RRF"
        if not recording:
            raise InputError(f"{self.file} is not a recording: give a file NAME.rrd, as `orient-eye simulate` writes")
        if self.screenshot is not None and self.screenshot.suffix != ".png":
            raise InputError(f"a picture is a file NAME.png, got {self.screenshot.name!r}")
        if self.web and self.screenshot is not None:
            raise InputError("--web and --screenshot exclude each other: give one")
