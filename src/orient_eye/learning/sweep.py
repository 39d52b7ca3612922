"""Many trainings as one folder of run directories, which can be taken up again.

    runs = named(product_of({"case": ("1", "2-fixed"), "seed": (0, 1, 2)}))
    result = Sweep.begin(runs, Path("runs/sweep")).carry_out(jobs=2)

The folder holds sweep.json (the options of every run, versions) and a run directory a run, as `orient-eye train` leaves
it; at the end sweep.csv (a row a run), result.json (a spread a setting) and sweep.png. One sweep at a time works in it.
"""

import json
import shlex
import shutil
import signal
import sys
import textwrap
import threading
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from orient_eye.errors import Ended, InputError
from orient_eye.files import explained, finite, parse_json, read_json, write_json
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.engines import ENGINES, LOST, Crew, Engine
from orient_eye.learning.grid import Options, config_of, without_seed
from orient_eye.learning.loop import CHECKPOINT_S, StopRequest
from orient_eye.learning.sweep_results import Results, RunState
from orient_eye.learning.training import Interrupted, alone, check_interval, prepared
from orient_eye.learning.workers import DONE, FAILED, MOST_LOST, RUNNING, STOPPED, WAITING, Board, perform
from orient_eye.run_directory import unnamed, versions

NAME = "sweep.json"
_BOARD = ".board"
_HINT = "this is no folder of a sweep, name one"
_SHOWN_S = 0.5

Show = Callable[[list[RunState]], object]
"""Called twice a second with how it stands with every run."""


@dataclass(frozen=True)
class Sweep:
    """A sweep and its folder.

    Attributes:
        folder: of the sweep.
        runs: name to options.
    """

    folder: Path
    runs: Mapping[str, Options]

    @classmethod
    def begin(cls, runs: Mapping[str, Options], folder: Path | None = None) -> "Sweep":
        """A new sweep, or one of the same runs that has begun.

        Args:
            runs: name to options, from `orient_eye.learning.grid.named`.
            folder: new, empty, or of the same sweep; None for runs/sweep-DATE-TIME.

        Raises:
            InputError: a run that cannot be, or the folder is taken by something else, or cannot be made.
        """
        _check(runs)  # before the folder: bad input leaves nothing behind
        runs = {name: _plain(options) for name, options in runs.items()}
        folder = folder or unnamed("sweep")
        with explained(folder):
            folder.mkdir(parents=True, exist_ok=True)
        with alone(folder):
            if (folder / NAME).exists():
                there = cls._read(folder)
                if there.runs != runs:
                    other = f"{folder} is of another sweep, of {len(there.runs)} runs: {', '.join(there.runs)}"
                    raise InputError(
                        textwrap.shorten(other, 400, placeholder=" ...")
                        + "; name another folder with --out, or go on with that one by --resume"
                    )
            elif any(folder.iterdir()):
                raise InputError(
                    f"{folder} exists and is not an empty folder; name another with --out, or move it away"
                )
            else:
                now = datetime.now().astimezone().isoformat(timespec="seconds")
                told = {"command": "sweep", "command_line": shlex.join(sys.argv), "started": now, "runs": runs}
                write_json(folder / NAME, {**told, "versions": versions()})
        return cls(folder, runs)

    @classmethod
    def open(cls, folder: Path) -> "Sweep":
        """A sweep that has begun.

        Raises:
            InputError: there is none in the folder, or one that cannot be.
        """
        found = cls._read(folder)
        _check(found.runs)
        return found

    @classmethod
    def _read(cls, folder: Path) -> "Sweep":
        content = read_json(folder / NAME, hint=_HINT)
        runs = content.get("runs") if isinstance(content, dict) else None
        if not isinstance(runs, dict) or not runs or not all(isinstance(each, dict) for each in runs.values()):
            raise InputError(f"{folder / NAME} names no runs; {_HINT}")
        for name in runs:
            if Path(name).name != name or name.startswith("."):
                raise InputError(f"{folder / NAME}: {name!r} is no name of a run; {_HINT}")
        return cls(folder, runs)

    def carry_out(
        self,
        *,
        jobs: int | None = None,
        engine: Engine | None = None,
        checkpoint_s: float = CHECKPOINT_S,
        show: Show | None = None,
    ) -> dict[str, Any]:
        """Do what is missing, and say what came of it all.

        Args:
            jobs: runs at a time, each in a process of its own with its share of the cores; on this machine one is done
                in this process. None for one a core.
            engine: where the runs are carried out (`orient_eye.learning.engines`); None for this machine.
            checkpoint_s: seconds between checkpoints of a run.
            show: is kept informed.

        Returns:
            The content of result.json; "passed" is False where a run failed.

        Raises:
            InputError: another process works in the folder, or it cannot be written, or not by all of a cluster.
            Interrupted: Ctrl-C, or a signal to end; what is begun has its checkpoint.
        """
        check_interval(checkpoint_s)
        engine = ENGINES["local"](None) if engine is None else engine
        with alone(self.folder):
            place = self._board()
            try:
                with engine.crew(jobs, len(self.runs), place) as crew:
                    board = Board(place, crew.parent) if crew.parent else Board(place.absolute(), None, Path.cwd())
                    with self._shown(board, show):
                        self._perform(board, crew, checkpoint_s)
                states = self.states(board)
            finally:
                shutil.rmtree(place, ignore_errors=True)
            return Results(self.folder, self.runs).write(states)

    def states(self, board: Board | None = None) -> list[RunState]:
        """How it stands with every run."""
        return self._states(board, {})

    def _states(self, board: Board | None, over: dict[str, RunState]) -> list[RunState]:
        """The same, without a look at the runs that are over, which are then remembered there."""
        results, found = Results(self.folder, self.runs), []
        known = set() if board is None else board.known()
        for name in self.runs:
            if name in over:
                found.append(over[name])
                continue
            told = board.told(name) if board is not None and name in known else {"state": WAITING}
            done = results.done(name)
            state = DONE if done else told["state"]
            state = WAITING if state == DONE and not done else state
            update, gap = results.course(name) if state == RUNNING else (None, None)
            found.append(RunState(name, state, update, gap, told.get("why", ""), tuple(told.get("notes", ()))))
            if state in (DONE, FAILED):
                over[name] = found[-1]
        return found

    def _board(self) -> Path:
        """A new folder for the board."""
        place = self.folder / _BOARD
        with explained(place):
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir()
        return place

    def _perform(self, board: Board, crew: Crew, checkpoint_s: float) -> None:
        """Carry out what is missing, again where workers were lost.

        Raises:
            Interrupted: this process was told to end.
        """
        results = Results(self.folder, self.runs)
        configs = {name: config_of(self.runs[name]) for name in self._in_turn()}
        try:
            with _here() if crew.here else _Stopping(board) as request:
                for _ in range(MOST_LOST * len(configs)):  # in each of which one at least lost a worker
                    told = {name: board.told(name)["state"] for name in configs}
                    left = [name for name in configs if told[name] not in (DONE, FAILED) and not results.done(name)]
                    if not left or board.stopped:
                        break
                    try:
                        self._hand_out({name: configs[name] for name in left}, board, crew, checkpoint_s)
                    except BrokenProcessPool:  # a worker of this machine was lost, and those beside it with it
                        continue
                    if not any(board.told(name)["state"] == STOPPED for name in left):
                        break
            if request.signal is not None:
                raise Ended(request.signal)
        except KeyboardInterrupt as end:
            raise Interrupted(self.folder, end.number if isinstance(end, Ended) else signal.SIGINT, "sweep") from None

    def _hand_out(self, configs: Mapping[str, TrainConfig], board: Board, crew: Crew, checkpoint_s: float) -> None:
        """Have workers carry out runs.

        Raises:
            BrokenProcessPool: workers were lost.
        """
        folder = self.folder if crew.parent else self.folder.absolute()  # another machine works somewhere else
        work = (
            delayed(perform)(name, config, folder / name, board, checkpoint_s, crew.share)
            for name, config in configs.items()
        )
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="A worker stopped while some jobs")  # and another took its place
            parallel = Parallel(n_jobs=crew.jobs, pre_dispatch=crew.jobs, batch_size=1, max_nbytes=None)
            for name, came in zip(configs, parallel(work), strict=True):
                if came == LOST:
                    board.tell(name, FAILED, "its workers were killed again and again; do they start, is memory short?")

    def _in_turn(self) -> list[str]:
        """Names of the runs, the first of each setting first: what it searches, the others of that setting find."""
        seen: Counter[str] = Counter()
        place = {}
        for name, options in self.runs.items():
            setting = repr(without_seed(options))
            place[name] = seen[setting]
            seen[setting] += 1
        return sorted(self.runs, key=lambda name: place[name])

    @contextmanager
    def _shown(self, board: Board, show: Show | None) -> Iterator[None]:
        """Keep somebody informed while the block lasts."""
        if show is None:
            yield
            return
        over = threading.Event()
        ended: dict[str, RunState] = {}

        def inform() -> None:
            while not over.wait(_SHOWN_S):
                show(self._states(board, ended))

        informing = threading.Thread(target=inform, daemon=True)
        informing.start()
        try:
            yield
        finally:
            over.set()
            informing.join()


class _Stopping(StopRequest):
    """Tells the board too."""

    def __init__(self, board: Board) -> None:
        super().__init__()
        self.board = board

    def _handle(self, number: int, frame: Any) -> None:
        super()._handle(number, frame)
        self.board.stop()


@contextmanager
def _here() -> Iterator[StopRequest]:
    """In this process a training stops by itself."""
    yield StopRequest()


def _check(runs: Mapping[str, Options]) -> None:
    """Find all that is wrong with the options of runs.

    Raises:
        InputError: names the run.
    """
    known: dict[str, Any] = {}
    for name, options in runs.items():
        try:
            setting = config_of(without_seed(options))
            key = repr(setting)
            if key not in known:
                known[key] = prepared(setting)[1]
            replace(known[key], seed=options.get("seed", 0))
        except InputError as error:
            raise InputError(f"run {name}: {error}" if len(runs) > 1 else str(error)) from error
        except (AttributeError, LookupError, TypeError, ValueError) as error:  # of a sweep.json that somebody wrote
            raise InputError(f"run {name}: these options are none: {error}") from error


def _plain(options: Options) -> Options:
    """As sweep.json holds them.

    Raises:
        InputError: a number is not finite.
    """
    try:
        return parse_json(json.dumps(options, allow_nan=False, default=finite))
    except ValueError as error:
        raise InputError(f"options of a sweep are finite numbers, got {options}") from error
