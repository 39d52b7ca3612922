"""What a sweep's workers do, and the board by which they and the one who waits for them know of each other.

A worker carries out one run after the other, each as `train` or `resume` does. It heeds no signal of a terminal: the
one who waits is told to stop, writes that on the board, and every worker then stops its training at the next update,
with a checkpoint. It does so too when the one who waits is gone.
"""

import os
import signal
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from orient_eye.errors import Ended, InputError
from orient_eye.files import read_json, write_json, write_text
from orient_eye.learning.config import TrainConfig
from orient_eye.resources import share_cores

WAITING, RUNNING, DONE, STOPPED, FAILED = "waiting", "running", "done", "stopped", "failed"
"""How it stands with a run."""
_LOOKS_S = 0.2
_PATIENCE_S = 20.0


@dataclass(frozen=True)
class Board:
    """A folder with a small file a run: how it stands, and why; and one that says stop.

    Attributes:
        folder: of the board.
        waits: process that waits for the workers.
    """

    folder: Path
    waits: int

    def tell(self, run: str, state: str, why: str = "", notes: tuple[str, ...] = ()) -> None:
        """Write how it stands with a run; what cannot be written is not told."""
        with suppress(InputError):
            write_json(self.folder / f"{run}.json", {"state": state, "why": why, "notes": notes})

    def told(self, run: str) -> dict[str, Any]:
        """What was told last of a run."""
        try:
            found = read_json(self.folder / f"{run}.json", hint="")
        except InputError:
            found = None
        return found if isinstance(found, dict) else {"state": WAITING, "why": "", "notes": []}

    def stop(self) -> None:
        """Have all workers stop."""
        write_text(self.folder / "stop", "")

    @property
    def abandoned(self) -> bool:
        """Whether the process that waited for this worker is gone."""
        return os.getppid() != self.waits

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
    """
    if board.stopped:
        return
    apart = os.getpid() != board.waits
    board.tell(run, RUNNING)
    try:
        with _working(board, cores) if apart else _here(), warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("default")
            _take_up(config, out, checkpoint_s)
        notes = tuple(str(each.message) for each in heard if each.category is UserWarning)
        board.tell(run, DONE, notes=notes)
    except KeyboardInterrupt:
        if not apart:
            raise
        if board.abandoned:
            os._exit(1)  # nobody gives this worker anything to do, nor has it end
        board.tell(run, STOPPED)
    except Exception as error:  # of another package's plant, say: the other runs go on
        told = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        board.tell(run, FAILED, told)


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
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGHUP)}
    before[signal.SIGTERM] = signal.signal(signal.SIGTERM, _end)
    over = threading.Event()

    def look() -> None:
        while not over.wait(_LOOKS_S):
            if board.stopped or board.abandoned:
                os.kill(os.getpid(), signal.SIGTERM)
                return

    looking = threading.Thread(target=look, daemon=True)
    looking.start()
    try:
        yield
    finally:
        over.set()
        looking.join()
        for number, handler in before.items():
            signal.signal(number, handler)


def _end(number: int, _: FrameType | None) -> None:
    raise Ended(number)
