"""The Rerun viewer for a recording: a window, a page for the browser, or a picture without a screen.

Every viewer listens on this machine only (127.0.0.1), sends no usage statistics and ends with us.
"""

import importlib.resources
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from urllib.parse import quote

from orient_eye.errors import InputError
from orient_eye.files import write_atomically
from orient_eye.recording.scene import TIMELINE

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient

_LOCAL = "127.0.0.1"
_START_S, _SETTLE_S, _END_S = 30.0, 15.0, 5.0


def open_window(file: Path) -> None:
    """Show a recording in a window, and return when it is closed.

    Raises:
        InputError: there is no screen, or the viewer fails.
    """
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
    with _viewer("--bind", _LOCAL, "--port", "auto", str(file), quiet=False) as process:
        yield process


def serve(file: Path, announce: Callable[[str], object]) -> str:
    """Serve a recording to browsers on this machine until interrupted; announce gets the address of the page.

    Returns:
        The address.

    Raises:
        InputError: the server fails.
    """
    page, data = _free_port(), _free_port()
    address = f"http://{_LOCAL}:{page}?url={quote(f'rerun+http://{_LOCAL}:{data}/proxy', safe='')}"
    options = ["--serve-web", "--bind", _LOCAL, "--port", str(data), "--web-viewer-port", str(page)]
    with _viewer(*options, str(file)) as server:
        announce(address)
        with suppress(KeyboardInterrupt):
            _wait(server)
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
        InputError: no such tab, the viewer does not start, or the picture cannot be written.
    """
    with _headless(file, size) as viewer:
        if tab:
            _activate(viewer, tab)
        state = viewer.get_state()
        timeline = next(t for t in state.recordings[0].timelines if t.name == TIMELINE)
        at = (timeline.end or 0) / 1e9 if at_s is None else at_s  # ns
        viewer.set_time(TIMELINE, duration=at, play_state="paused")
        image, earlier, deadline = b"", b"-", time.monotonic() + _SETTLE_S
        while image != earlier and time.monotonic() < deadline:
            time.sleep(0.3)  # data is loaded on demand
            image, earlier = viewer.take_screenshot(), image
        write_atomically(picture, lambda temporary: temporary.write_bytes(image))
        return [f"{view.name}: {report}" for view in viewer.get_state().views for report in view.reports]


@contextmanager
def _viewer(*arguments: str, quiet: bool = True, log: IO[bytes] | None = None) -> "Iterator[subprocess.Popen[bytes]]":
    """The viewer as a process that has ended when the block has, also where SIGTERM or SIGHUP ends us."""
    environment = {name: value for name, value in os.environ.items() if name != "FORCE_RERUN_ANALYTICS"}
    environment["CI"] = "1"  # the one variable that turns its usage statistics off, and it keeps no file of them
    if quiet:
        environment["RUST_LOG"] = "error"  # messages would stand in the picture
    with _signals_raise():
        process = subprocess.Popen([_executable(), *arguments], env=environment, stdout=log, stderr=log)
        try:
            yield process
        finally:
            process.terminate()
            try:
                process.wait(_END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@contextmanager
def _signals_raise() -> Iterator[None]:
    """SIGTERM and SIGHUP raise SystemExit in this block, so that what stands in `finally` is done."""

    def end(number: int, _: object) -> None:
        sys.exit(128 + number)

    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():  # only there may handlers be set
        numbers = []
    numbers = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]  # nohup ignores SIGHUP
    for number in numbers:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in numbers:
            signal.signal(number, signal.SIG_DFL)


def _wait(process: "subprocess.Popen[bytes]") -> None:
    """Until the viewer ends."""
    code = process.wait()
    if code:
        raise InputError(f"the Rerun viewer failed (exit code {code}); what it said stands above")


def _executable() -> str:
    """The viewer that was installed with rerun-sdk."""
    folder = Path(str(importlib.resources.files("rerun_cli")))
    names = ("Rerun.app/Contents/MacOS/Rerun", "rerun.exe", "rerun")
    return next(str(folder / name) for name in names if (folder / name).exists())


def _free_port() -> int:
    with socket.create_server((_LOCAL, 0)) as probe:
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def _headless(file: Path, size: tuple[int, int]) -> Iterator["ViewerClient"]:
    from rerun.experimental import ViewerClient

    port = _free_port()
    options = ["--headless", "--bind", _LOCAL, "--port", str(port), "--window-size", f"{size[0]}x{size[1]}"]
    with tempfile.TemporaryFile() as log, _viewer(*options, str(file), log=log) as process:
        viewer = _connect(ViewerClient, process, port)
        if viewer is None:
            log.seek(0)
            raise InputError(
                "the Rerun viewer did not start without a screen; on Debian and Ubuntu it needs the packages "
                "mesa-vulkan-drivers libvulkan1 libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6 "
                f"libxrandr2. It said: {log.read().decode(errors='replace').strip()[-500:]}"
            )
        yield viewer
        viewer.run_command("ui.quit")
        process.wait(_SETTLE_S)


def _connect(client: Any, process: "subprocess.Popen[bytes]", port: int) -> "ViewerClient | None":
    """The client of a viewer that has loaded its recording, or None."""
    deadline = time.monotonic() + _START_S
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.2)
        try:
            viewer: ViewerClient = client.connect(f"rerun+http://{_LOCAL}:{port}/proxy")
            state = viewer.get_state()
        except (ConnectionError, OSError, RuntimeError, ValueError):
            continue
        if state.recordings and state.recordings[0].timelines and not state.loading:
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
