"""What surrounds a command: signals, standard streams and folders, so that no command has to think of them."""

import io
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from types import FrameType
from typing import Any, TextIO

from orient_eye.errors import Ended, InputError
from orient_eye.files import explained

_NARROWEST = 40
"""Columns of a terminal, as told to those that write tables and help pages: in fewer, help would go on for ever."""
_KEEPERS = {"MPLCONFIGDIR": "matplotlib", "TORCHINDUCTOR_CACHE_DIR": "torch"}
"""Variables by which libraries are told where to keep what they keep, and a folder for it in our cache folder."""


@contextmanager
def signals() -> Iterator[None]:
    """In this block SIGTERM and SIGHUP raise `Ended`, once; where they are ignored, as under `nohup`, they stay so."""
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():  # only there may handlers be set
        numbers = []
    before = {number: signal.getsignal(number) for number in numbers}
    before = {number: handler for number, handler in before.items() if handler is not signal.SIG_IGN}
    came: list[int] = []

    def end(number: int, _: FrameType | None) -> None:
        came.append(number)
        for each in before:
            signal.signal(each, signal.SIG_IGN)  # what is done in `finally` is done; Ctrl-C breaks even that off
        raise Ended(number)

    try:
        for number in before:
            signal.signal(number, end)
        yield
        if came:  # and some library took what was raised for its own
            raise Ended(came[0])
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Stream(io.FileIO):
    """A standard stream that cannot be written to says so once, or never."""

    def __init__(self, number: int, *, forgiving: bool) -> None:
        super().__init__(number, "w", closefd=False)
        self.forgiving = forgiving

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:  # whoever read it, `head` say, has enough
            if not self.forgiving:
                self.forgiving = True
                raise
        except OSError as error:
            if not self.forgiving:
                self.forgiving = True  # the rest is lost too
                words = error.strerror or error
                raise InputError(f"cannot write to standard output: {words}; send it elsewhere") from error
        return memoryview(data).nbytes


@contextmanager
def streams() -> Iterator[None]:
    """In this block words on standard error that cannot be written are lost, and the work is not.

    Standard output that cannot be written raises InputError, or BrokenPipeError where its reader is gone. A closed
    stream gets a file, so that no other gets its number and what is printed; what cannot be encoded is escaped.
    """
    columns = max(_NARROWEST, shutil.get_terminal_size().columns)
    while (number := os.open(os.devnull, os.O_RDONLY)) <= 2:
        os.set_inheritable(number, True)
    os.close(number)
    before = sys.stdout, sys.stderr
    if sys.stdout is sys.__stdout__:
        sys.stdout = _text(_Stream(1, forgiving=False), before[0])
    if sys.stderr is sys.__stderr__:
        sys.stderr = _text(_Stream(2, forgiving=True), before[1])
    try:
        with _variable("COLUMNS", str(columns)) if columns == _NARROWEST else nullcontext():
            yield
    finally:
        sys.stdout, sys.stderr = before


def _text(stream: _Stream, like: TextIO | None) -> TextIO:
    encoding = like.encoding if like else "utf-8"
    return io.TextIOWrapper(io.BufferedWriter(stream), encoding, "backslashreplace", line_buffering=True)


@contextmanager
def folders() -> Iterator[None]:
    """In this block libraries keep what they keep in our cache folder; where there is none, until the block ends.

    Raises:
        InputError: there is none, and no temporary folder can be made; or the working directory is gone.
    """
    try:
        os.getcwd()
    except FileNotFoundError:
        raise InputError("the working directory is gone; go to another one (cd)") from None
    from platformdirs import user_cache_path

    with ExitStack() as stack:

        def temporary() -> Path:
            with explained("a temporary file"):
                return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="orient-eye-")))

        try:
            cache = user_cache_path("orient-eye")
        except RuntimeError:  # nobody's home
            stack.enter_context(_variable("XDG_CACHE_HOME", temporary()))
            cache = user_cache_path("orient-eye")
        for variable in _KEEPERS.keys() - os.environ.keys():
            kept = cache / _KEEPERS[variable]
            stack.enter_context(_variable(variable, kept if _writable(kept) else temporary()))
        yield


@contextmanager
def _variable(name: str, value: object) -> Iterator[None]:
    """A variable of the environment that has this value in the block."""
    before = os.environ.get(name)
    os.environ[name] = str(value)
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)
