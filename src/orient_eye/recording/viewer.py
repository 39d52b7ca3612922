"""The Rerun viewer for a recording: a window, a page for the browser, or a picture without a screen.

Every viewer listens on this machine only (127.0.0.1), sends no usage statistics and ends with us.
"""

import importlib.resources
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from urllib.parse import quote

from orient_eye.checks import real, whole
from orient_eye.errors import Ended, InputError
from orient_eye.files import write_atomically
from orient_eye.recording import guard, web_page
from orient_eye.recording.scene import TIMELINE
from orient_eye.recording.web_page import LOCAL
from orient_eye.resources import printable, user_cache

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient

LARGEST = 4096
"""Pixels of a picture's width or height, which takes a machine without a graphics card seconds."""
_FAILURES = (OSError, RuntimeError)  # of the viewer's client
_START_S, _SETTLE_S = 30.0, 15.0


def open_window(file: Path) -> None:
    """Show a recording in a window, and return when it is closed.

    Raises:
        InputError: the recording is damaged, there is no screen, or the viewer fails.
    """
    _verify(file)
    with started(file) as process:
        _wait(process)


@contextmanager
def started(file: Path) -> "Iterator[subprocess.Popen[bytes]]":
    """A window that shows a recording as long as this block lasts.

    Raises:
        InputError: there is no screen.
    """
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError(
            "this machine has no screen (neither DISPLAY nor WAYLAND_DISPLAY is set): see the recording in a browser "
            "(orient-eye view FILE --web), or as a picture (--screenshot PICTURE.png)"
        )
    with _viewer("--bind", LOCAL, "--port", "auto", str(file), quiet=False) as process:
        yield process


def serve(file: Path, announce: Callable[[str], object]) -> str:
    """Serve a recording to browsers on this machine until interrupted; announce gets the address of the page.

    Returns:
        The address.

    Raises:
        InputError: the recording is damaged, or the server fails.
    """
    _verify(file)
    page, data = _free_port(), _free_port()
    options = ["--serve-web", "--bind", LOCAL, "--port", str(data), "--web-viewer-port", str(page)]
    with _viewer(*options, str(file)) as process, web_page.served(page, data) as port:
        address = f"http://{LOCAL}:{port}?url={quote(f'rerun+http://{LOCAL}:{data}/proxy', safe='')}"
        _await(process, page)
        try:
            announce(address)
            _wait(process)
        except Ended:
            raise
        except KeyboardInterrupt:
            pass
    return address


def screenshot(
    file: Path,
    picture: Path,
    *,
    at_s: float | None = None,
    tab: Sequence[str] = (),
    size: tuple[int, int] = (1600, 900),
) -> list[str]:
    """Save the picture of a recording, without a screen.

    Args:
        file: the recording.
        picture: PNG file.
        at_s: instant [s]; None for the end.
        tab: name of the tab, or of the group and of the tab in it; empty for the first.
        size: width and height [px].

    Returns:
        What the viewer could not show; nothing, if all is well.

    Raises:
        InputError: no such instant, size or tab, a damaged recording or none of ours, the viewer does not start, or
            the picture cannot be written.
    """
    for side, pixels in zip(("width", "height"), size, strict=True):
        whole(f"the picture's {side}", pixels, 1, LARGEST)
    with _headless(file, size) as viewer:
        if tab:
            _activate(viewer, tab)
        state = viewer.get_state()
        end = max((t.end or 0) / 1e9 for t in state.recordings[0].timelines if t.name == TIMELINE)  # ns
        at = end if at_s is None else real("the instant of the picture", at_s, 0, end, unit="s")
        viewer.set_time(TIMELINE, duration=at, play_state="paused")
        image, earlier, deadline = b"", b"-", time.monotonic() + _SETTLE_S
        while image != earlier and time.monotonic() < deadline:
            time.sleep(0.3)  # data is loaded on demand
            image, earlier = viewer.take_screenshot(), image
        write_atomically(picture, lambda temporary: temporary.write_bytes(image))
        return [f"{view.name}: {report}" for view in viewer.get_state().views for report in view.reports]


@contextmanager
def _viewer(*arguments: str, quiet: bool = True, log: IO[bytes] | None = None) -> "Iterator[subprocess.Popen[bytes]]":
    """The viewer as a process that has ended when the block has; where we are killed, `guard` ends it."""
    command = [sys.executable, "-I", guard.__file__, _executable(), *arguments]
    # In a session of its own no signal of the terminal reaches it before us.
    options: Any = {"env": _environment(quiet), "stdin": subprocess.PIPE, "start_new_session": True}
    process = subprocess.Popen(command, stdout=log, stderr=log, **options)
    try:
        yield process
    finally:
        process.communicate()  # closes its standard input, which ends it


def _environment(quiet: bool) -> dict[str, str]:
    """Of a viewer that sends no usage statistics, and keeps what it keeps in our cache folder."""
    environment = {name: value for name, value in os.environ.items() if name != "FORCE_RERUN_ANALYTICS"}
    environment["CI"] = "1"  # the one variable that turns its usage statistics off, and it keeps no file of them
    environment |= dict.fromkeys(["XDG_CACHE_HOME", "XDG_DATA_HOME"], str(user_cache("viewer")))
    if quiet:
        environment["RUST_LOG"] = "error"  # messages would stand in the picture
    return environment


def _verify(file: Path) -> None:
    """Rerun's own check of a recording; the viewer would show nothing of a damaged one, or wait."""
    command = [_executable(), "rrd", "verify", str(file)]
    done = subprocess.run(command, env=_environment(quiet=True), capture_output=True, text=True, check=False)
    told = (done.stdout + done.stderr).strip().splitlines()
    if done.returncode or told[-1:] != ["1 file verified without error."]:
        raise InputError(f"{printable(file)} is damaged, or no recording: {' '.join(told)[:300]}; write it anew")


def _wait(process: "subprocess.Popen[bytes]") -> None:
    """Until the viewer ends."""
    code = process.wait()
    if code:
        raise InputError(f"the Rerun viewer failed (exit code {code}); what it said stands above")


def _await(process: "subprocess.Popen[bytes]", port: int) -> None:
    """Until the viewer listens, or ends."""
    deadline = time.monotonic() + _START_S
    while process.poll() is None and time.monotonic() < deadline:
        with socket.socket() as probe:
            if not probe.connect_ex((LOCAL, port)):
                return
        time.sleep(0.05)


def _executable() -> str:
    """The viewer that was installed with rerun-sdk."""
    folder = Path(str(importlib.resources.files("rerun_cli")))
    names = ("Rerun.app/Contents/MacOS/Rerun", "rerun.exe", "rerun")
    return next(str(folder / name) for name in names if (folder / name).exists())


def _free_port() -> int:
    with socket.create_server((LOCAL, 0)) as probe:
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def _headless(file: Path, size: tuple[int, int]) -> Iterator["ViewerClient"]:
    from rerun.experimental import ViewerClient

    _verify(file)
    port = _free_port()
    options = ["--headless", "--bind", LOCAL, "--port", str(port), "--window-size", f"{size[0]}x{size[1]}"]
    with tempfile.TemporaryFile() as log, _viewer(*options, str(file), log=log) as process:
        viewer = _connect(ViewerClient, process, port)
        if viewer is None:
            log.seek(0)
            raise InputError(
                "the Rerun viewer did not start without a screen; on Debian and Ubuntu it needs the packages "
                "mesa-vulkan-drivers libvulkan1 libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6 "
                f"libxrandr2. It said: {log.read().decode(errors='replace').strip()[-500:]}"
            )
        try:
            yield viewer
        except _FAILURES as error:
            raise InputError(f"the Rerun viewer failed: {error}") from error


def _connect(client: Any, process: "subprocess.Popen[bytes]", port: int) -> "ViewerClient | None":
    """The client of a viewer that has loaded its recording, or None.

    Raises:
        InputError: the recording is not ours.
    """
    deadline = time.monotonic() + _START_S
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.2)
        try:
            viewer: ViewerClient = client.connect(f"rerun+http://{LOCAL}:{port}/proxy")
            state = viewer.get_state()
        except (*_FAILURES, ValueError):
            continue
        recording = next(iter(state.recordings), None)
        if recording and recording.timelines and not state.loading:
            if TIMELINE not in [timeline.name for timeline in recording.timelines]:
                raise InputError(f"orient-eye did not write this recording: it lacks the timeline {TIMELINE}")
            return viewer
    return None


def _activate(viewer: "ViewerClient", tab: Sequence[str]) -> None:
    """Bring a tab to the front: the first name is that of a tab, the next of a tab in it."""
    parts = viewer.get_blueprint().blueprint
    inside = f"container/{parts['/viewport']['ViewportBlueprint']['root_container']}"
    for name in tab:
        tabs = parts[f"/{inside}"].get("ContainerBlueprint", {"contents": []})
        names = {_display_name(parts[f"/{path}"]): path for path in tabs["contents"]}
        if name not in names:
            raise InputError(f"the recording has no tab {name!r} there; it has {', '.join(names)}")
        inside = tabs["active_tab"] = names[name]
    viewer.set_blueprint(parts, of="recording")


def _display_name(part: dict[str, Any]) -> str:
    return next((fields["display_name"] for fields in part.values() if "display_name" in fields), "")
