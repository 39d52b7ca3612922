"""`orient-eye view`: show a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from orient_eye.errors import InputError


@dataclass(frozen=True)
class View:
    """Show a recording of saccades in the Rerun viewer.

    The first tab compares all saccades, then each has its own; space plays and pauses, at a tenth of the
    speed. Without a screen: --web serves it to a browser on this machine, --screenshot saves a picture.

    $ orient-eye view runs/first/trajectory.rrd

    $ orient-eye view runs/first/trajectory.rrd --screenshot eye.png --at 0.05
    """

    file: Annotated[Path, tyro.conf.Positional]
    """The recording, NAME.rrd."""
    web: bool = False
    """Serve it to a browser on this machine, until interrupted."""
    screenshot: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """Save a picture (PNG) instead of opening a window."""
    at: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(default: the end)")] = None
    """Instant of the picture, s."""
    tab: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...", help_behavior_hint="(default: the first)")] = ()
    """Tab of the picture: its name, or a group's and then the saccade's."""
    size: tuple[int, int] = (1600, 900)
    """Width and height of the picture, pixels."""

    def run(self) -> dict[str, Any]:
        """Show the recording; returns when it is closed."""
        self._check()
        from orient_eye.cli.tables import say
        from orient_eye.recording import viewer

        result: dict[str, Any] = {"file": str(self.file)}
        if self.screenshot is not None:
            missing = viewer.screenshot(self.file, self.screenshot, at_s=self.at, tab=self.tab, size=self.size)
            for report in missing:
                say(f"not shown: {report}", "yellow")
            say(f"in {self.screenshot}")
            result |= {"screenshot": str(self.screenshot), "not_shown": missing}
        elif self.web:

            def announce(address: str) -> None:
                say("Open this address in a browser on this machine; Ctrl+C ends it.")
                say(address)

            result["address"] = viewer.serve(self.file, announce)
        else:
            viewer.open_window(self.file)
        return result

    def _check(self) -> None:
        from orient_eye.cli.places import check_outputs
        from orient_eye.files import unreadable
        from orient_eye.resources import printable

        if self.file.is_dir():
            raise InputError(f"{printable(self.file)} is a folder; name the recording in it, NAME.rrd")
        try:
            if self.file.exists() and not self.file.is_file():  # a pipe would keep us waiting
                raise OSError("it is no file")
            with self.file.open("rb") as file:
                recording = file.read(3) == b"RRF"
        except (OSError, ValueError) as error:
            raise unreadable(self.file, error, "orient-eye simulate writes recordings") from error
        if not recording:
            raise InputError(
                f"{printable(self.file)} is not a recording: give a file NAME.rrd, as orient-eye simulate writes"
            )
        if self.screenshot is not None and self.screenshot.suffix != ".png":
            raise InputError(f"a picture is a file NAME.png, got {self.screenshot.name!r}")
        if self.web and self.screenshot is not None:
            raise InputError("--web and --screenshot exclude each other: give one")
        check_outputs({"--screenshot": self.screenshot}, {"the recording": self.file})
