"""What a sweep's workers do, and the board by which they and the one who waits for them know of each other.

A worker carries out one run after the other, each as `train` or `resume` does. It heeds no signal of a terminal: the
one who waits is told to stop, writes that on the board, and every worker then stops its training at the next update,
with a checkpoint. On this machine it does so too when the one who waits is gone, and ends; on a cluster it is ended.
"""

import os
import platform
import signal
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

from orient_eye.errors import Ended, InputError
from orient_eye.files import read_json, write_json, write_text
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.loop import StopRequest
from orient_eye.resources import share_cores

WAITING, RUNNING, DONE, STOPPED, FAILED = "waiting", "running", "done", "stopped", "failed"
"""How it stands with a run."""
MOST_LOST = 5
"""Workers in a row that a run may lose, before it counts as what kills them."""
_LOOKS_S = 0.2
_PATIENCE_S = 20.0
_BUSY = threading.Lock()


@dataclass(frozen=True)
class Board:
    """A folder with a small file a run: how it stands, and why; and one that says stop.

    Attributes:
        folder: of the board.
        waits: process that waits for the workers, their parent; None on a cluster.
        cwd: folder in which it stands, to which workers of a cluster go; None where they stand there too.
    """

    folder: Path
    waits: int | None
    cwd: Path | None = None

    def tell(self, run: str, state: str, why: str = "", notes: tuple[str, ...] = (), lost: int = 0) -> None:
        """Write how it stands with a run; what cannot be written is not told.

        Args:
            run: its name.
            state: of it.
            why: it failed.
            notes: warnings of the training.
            lost: workers that did not come to its end.
        """
        with suppress(InputError):
            write_json(self.folder / f"{run}.json", {"state": state, "why": why, "notes": notes, "lost": lost})

    def told(self, run: str) -> dict[str, Any]:
        """What was told last of a run."""
        try:
            found = read_json(self.folder / f"{run}.json", hint="")
        except InputError:
            found = None
        return found if isinstance(found, dict) else {"state": WAITING, "why": "", "notes": [], "lost": 0}

    def known(self) -> set[str]:
        """Runs of which something was told."""
        return {file.removesuffix(".json") for file in os.listdir(self.folder) if file.endswith(".json")}

    def stop(self) -> None:
        """Have all workers stop."""
        write_text(self.folder / "stop", "")

    @property
    def apart(self) -> bool:
        """Whether this process is not the one that waits."""
        return self.waits is None or os.getpid() != self.waits

    @property
    def abandoned(self) -> bool:
        """Whether the process that waited for this worker is gone; on a cluster this one is then ended."""
        return self.waits is not None and os.getppid() != self.waits

    @property
    def stopped(self) -> bool:
        """Whether workers are to stop, or the sweep is over."""
        return (self.folder / "stop").exists() or not self.folder.exists()


def perform(run: str, config: TrainConfig, out: Path, board: Board, checkpoint_s: float, cores: int) -> None:
    """Carry out one run, and tell the board how it ended.

    Args:
        run: its name.
        config: of a new training; one that has begun goes on with its own.
        out: its run directory.
        board: of the sweep.
        checkpoint_s: seconds between checkpoints.
        cores: of the machine, for this worker's threads.

    Raises:
        InputError: a machine of the cluster, one that joined it later, does not see the folder.
    """
    if board.waits is None and not board.folder.is_dir():
        raise InputError(f"machine {platform.node()} of the cluster does not see {board.folder.parent}")
    if board.stopped or (out / "result.json").exists():
        return
    told = board.told(run)
    lost = told["lost"] + (told["state"] in (RUNNING, STOPPED))
    if lost >= MOST_LOST:
        board.tell(run, FAILED, f"its worker, or one beside it, was killed {lost} times; is memory short?")
        return
    board.tell(run, RUNNING, lost=lost)
    try:
        with _working(board, cores) if board.apart else _here(), warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("default")
            _take_up(config, out, checkpoint_s)
        notes = tuple(str(each.message) for each in heard if each.category is UserWarning)
        board.tell(run, DONE, notes=notes)
    except KeyboardInterrupt:
        if not board.apart:
            raise
        board.tell(run, STOPPED, lost=lost)
    except Exception as error:  # of another package's plant, say: the other runs go on
        board.tell(run, FAILED, str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}")


def _take_up(config: TrainConfig, out: Path, checkpoint_s: float) -> None:
    """Begin a run or go on with it.

    Raises:
        InputError: it cannot be done.
        Ended: it was stopped, and can go on.
    """
    from orient_eye.learning.checkpoint import NAME, PREVIOUS
    from orient_eye.learning.training import Interrupted, resume, train

    _wait_for(out)
    about = out / "run.json"
    if about.exists() and not any((out / name).exists() for name in (NAME, PREVIOUS, "metrics.csv")):
        try:
            read_json(about, hint="")
        except InputError:  # killed while it was written
            about.unlink()
    try:
        if about.exists():
            resume(out, quiet=True, checkpoint_s=checkpoint_s)
        else:
            train(config, out, quiet=True, checkpoint_s=checkpoint_s)
    except Interrupted as stopped:
        raise Ended(stopped.code - 128) from None


def _wait_for(out: Path) -> None:
    """Until a worker whose sweep was killed has left a run, or for some seconds."""
    from orient_eye.learning.training import alone

    patient = time.monotonic() + _PATIENCE_S
    while out.is_dir() and time.monotonic() < patient:
        try:
            with alone(out):
                return
        except InputError:
            time.sleep(_LOOKS_S)


@contextmanager
def _here() -> Iterator[None]:
    """In the process that waits, everything is as it is."""
    yield


@contextmanager
def _working(board: Board, cores: int) -> Iterator[None]:
    """In this block a worker ends by what the board says alone, and has its share of the machine."""
    share_cores(cores)
    if board.cwd is not None:
        with suppress(OSError):  # a machine that has no such folder
            os.chdir(board.cwd)
    if board.waits is not None:
        _end_with(board.waits)
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)}
    before[signal.SIGTERM] = signal.signal(signal.SIGTERM, _end)
    over = threading.Event()

    def look() -> None:
        while not over.wait(_LOOKS_S):
            if board.stopped or board.abandoned:
                asked = StopRequest.now
                if asked is None or asked.signal is None:  # twice would be at once, without a checkpoint
                    os.kill(os.getpid(), signal.SIGTERM)
                return

    looking = threading.Thread(target=look, daemon=True)
    looking.start()
    try:
        with _BUSY:
            yield
    finally:
        over.set()
        looking.join()
        for number, handler in before.items():
            signal.signal(number, handler)


@cache
def _end_with(parent: int) -> None:
    """End this process when that one is gone, as soon as it has nothing to do: nobody gives it more, or ends it."""

    def look() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOKS_S)
        with _BUSY:
            os._exit(1)

    threading.Thread(target=look, daemon=True).start()


def _end(number: int, _: FrameType | None) -> None:
    raise Ended(number)
