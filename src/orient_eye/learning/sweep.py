"""Many trainings as one folder of run directories, which can be taken up again.

    runs = named(product_of({"case": ("1", "2-fixed"), "seed": (0, 1, 2)}))
    result = Sweep.begin(runs, Path("runs/sweep")).carry_out(jobs=2)

The folder holds sweep.json (the options of every run, versions) and a run directory a run, as `orient-eye train` leaves
it; at the end sweep.csv (a row a run), result.json (a spread a setting) and sweep.png. One sweep at a time works in it.
"""

import csv
import json
import os
import shlex
import shutil
import signal
import sys
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

import numpy as np
from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky import get_reusable_executor

from orient_eye.checks import whole
from orient_eye.errors import Ended, InputError
from orient_eye.files import explained, finite, parse_json, read_json, remove_leftovers, write_json, write_table
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.grid import Options, config_of, named, without_seed
from orient_eye.learning.loop import CHECKPOINT_S, StopRequest
from orient_eye.learning.spread import Spread, spread
from orient_eye.learning.training import Interrupted, alone, check_interval, prepared
from orient_eye.learning.workers import DONE, FAILED, RUNNING, STOPPED, WAITING, Board, perform
from orient_eye.resources import cores
from orient_eye.run_directory import versions

NAME = "sweep.json"
_BOARD = ".board"
_HINT = "this is no folder of a sweep, name one"
_MOST_LOST = 5  # workers in a row, before a run counts as what kills them
_SHOWN_S = 0.5
_MOST_JOBS = 1024


@dataclass(frozen=True)
class RunState:
    """How it stands with a run.

    Attributes:
        name: of the run.
        state: waiting, running, done, stopped or failed.
        update: of its last evaluation; None before the first.
        gap_mean: of that evaluation.
        why: it failed.
        notes: warnings of the training.
    """

    name: str
    state: str
    update: int | None = None
    gap_mean: float | None = None
    why: str = ""
    notes: tuple[str, ...] = ()


Show = Callable[[list[RunState]], object]
"""Called twice a second with how it stands with every run."""


@dataclass(frozen=True)
class Setting:
    """The runs that differ in their seed alone.

    Attributes:
        name: what distinguishes it from the others.
        options: of its runs, without the seed.
        runs: names of those that are done.
        gaps: their mean reward gaps, (runs,).
        updates: of the evaluations, (points,).
        curves: mean reward gap at each, (runs, points).
    """

    name: str
    options: Options
    runs: tuple[str, ...]
    gaps: np.ndarray
    updates: np.ndarray
    curves: np.ndarray


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
        runs = {name: _plain(options) for name, options in runs.items()}
        _check(runs)  # before the folder: bad input leaves nothing behind
        folder = folder or Path("runs") / f"sweep-{datetime.now():%Y%m%d-%H%M%S}"
        with explained(folder):
            folder.mkdir(parents=True, exist_ok=True)
        with alone(folder):
            if (folder / NAME).exists():
                there = cls._read(folder)
                if there.runs != runs:
                    raise InputError(
                        f"{folder} is of another sweep, of {len(there.runs)} runs: {', '.join(there.runs)}"[:400]
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
        self, *, jobs: int | None = None, checkpoint_s: float = CHECKPOINT_S, show: Show | None = None
    ) -> dict[str, Any]:
        """Do what is missing, and say what came of it all.

        Args:
            jobs: runs at a time, each in a process of its own with its share of the cores; with 1 in this process. None
                for one a core.
            checkpoint_s: seconds between checkpoints of a run.
            show: is kept informed.

        Returns:
            The content of result.json; "passed" is False where a run failed.

        Raises:
            InputError: another process works in the folder, or it cannot be written.
            Interrupted: Ctrl-C, or a signal to end; what is begun has its checkpoint.
        """
        check_interval(checkpoint_s)
        jobs = min(jobs_of(jobs), len(self.runs))
        with alone(self.folder):
            board = self._board()
            try:
                with self._shown(board, show):
                    self._perform(board, jobs, checkpoint_s)
                states = self.states(board)
            finally:
                shutil.rmtree(board.folder, ignore_errors=True)
            return self._conclude(states)

    def states(self, board: Board | None = None) -> list[RunState]:
        """How it stands with every run."""
        found = []
        for name in self.runs:
            told = {"state": WAITING} if board is None else board.told(name)
            done = (self.folder / name / "result.json").exists()
            state = DONE if done else told["state"]
            state = WAITING if state == DONE and not done else state
            update, gap = self._course(name) if state == RUNNING else (None, None)
            found.append(RunState(name, state, update, gap, told.get("why", ""), tuple(told.get("notes", ()))))
        return found

    def settings(self) -> list[Setting]:
        """The runs that are done, by setting."""
        groups: dict[str, list[str]] = {}
        for name, options in self.runs.items():
            groups.setdefault(repr(without_seed(options)), []).append(name)
        settings = named([without_seed(self.runs[names[0]]) for names in groups.values()])
        found = []
        for setting, names in zip(settings, groups.values(), strict=True):
            done = [name for name in names if (self.folder / name / "result.json").exists()]
            if not done:
                continue
            gaps = np.array([self._result(name)["gap_mean"] for name in done], float)
            rows = [_metrics(self.folder / name) for name in done]
            points = min(map(len, rows))
            curves = np.array([[float(row["gap_mean"]) for row in of[:points]] for of in rows])
            updates = np.array([float(row["update"]) for row in rows[0][:points]])
            found.append(Setting(setting, without_seed(self.runs[done[0]]), tuple(done), gaps, updates, curves))
        return found

    # --- the work ---------------------------------------------------------------------------------

    def _board(self) -> Board:
        board = Board(self.folder / _BOARD, os.getpid())
        with explained(board.folder):
            shutil.rmtree(board.folder, ignore_errors=True)
            board.folder.mkdir()
        return board

    def _perform(self, board: Board, jobs: int, checkpoint_s: float) -> None:
        """Carry out what is missing, again where workers were lost.

        Raises:
            Interrupted: this process was told to end.
        """
        lost: Counter[str] = Counter()
        configs = {name: config_of(self.runs[name]) for name in self._in_turn()}
        try:
            with _Stopping(board) if jobs > 1 else _here() as request:
                while True:
                    told = {name: board.told(name)["state"] for name in configs}
                    left = [name for name in configs if told[name] not in (DONE, FAILED) and not self._done(name)]
                    if not left or board.stopped:
                        break
                    try:
                        self._hand_out({name: configs[name] for name in left}, board, jobs, checkpoint_s)
                    except BrokenProcessPool:
                        self._count(lost, left, board)
                    else:
                        if not any(board.told(name)["state"] == STOPPED for name in left):
                            break
                        self._count(lost, left, board)
            if request.signal is not None:
                raise Ended(request.signal)
        except KeyboardInterrupt as end:
            raise Interrupted(self.folder, end.number if isinstance(end, Ended) else signal.SIGINT, "sweep") from None
        finally:
            if jobs > 1:
                get_reusable_executor().shutdown(wait=True, kill_workers=True)  # idle ones: what they did is written

    def _hand_out(self, configs: Mapping[str, TrainConfig], board: Board, jobs: int, checkpoint_s: float) -> None:
        """Have workers carry out runs, on processes of this machine.

        Raises:
            BrokenProcessPool: a worker was lost, and those beside it with it.
        """
        share = max(1, cores() // jobs)
        work = (
            delayed(perform)(name, config, self.folder / name, board, checkpoint_s, share)
            for name, config in configs.items()
        )
        with warnings.catch_warnings(), parallel_config(backend="loky", inner_max_num_threads=share):
            warnings.filterwarnings("ignore", message="A worker stopped while some jobs")  # and another took its place
            Parallel(n_jobs=jobs, batch_size=1, max_nbytes=None)(work)

    def _count(self, lost: Counter[str], left: list[str], board: Board) -> None:
        """Have runs that lost their worker wait for another, unless they lost one too often."""
        for name in left:
            if board.told(name)["state"] not in (RUNNING, STOPPED):
                continue
            lost[name] += 1
            if lost[name] < _MOST_LOST:
                board.tell(name, WAITING)
            else:
                board.tell(
                    name, FAILED, f"its worker, or one beside it, was killed {_MOST_LOST} times; is memory short?"
                )

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

        def inform() -> None:
            while not over.wait(_SHOWN_S):
                show(self.states(board))

        informing = threading.Thread(target=inform, daemon=True)
        informing.start()
        try:
            yield
        finally:
            over.set()
            informing.join()

    # --- what came of it --------------------------------------------------------------------------

    def _conclude(self, states: list[RunState]) -> dict[str, Any]:
        from orient_eye.learning.figures.sweep import draw_sweep

        remove_leftovers(self.folder)
        write_table(self.folder / "sweep.csv", self._rows(states))
        settings = self.settings()
        if settings:
            draw_sweep(settings, self.folder / "sweep.png")
        failed = {state.name: state.why for state in states if state.state == FAILED}
        result = {
            "out": str(self.folder),
            "runs": len(self.runs),
            "done": sum(state.state == DONE for state in states),
            "failed": failed,
            "notes": {state.name: list(state.notes) for state in states if state.notes},
            "settings": [
                {"setting": each.name, "options": each.options, "runs": len(each.runs), **_told(spread([each.gaps]))}
                for each in settings
            ],
            "all": _told(spread([each.gaps for each in settings])) if settings else None,
            "passed": not failed,
        }
        write_json(self.folder / "result.json", result)
        return result

    def _rows(self, states: list[RunState]) -> list[dict[str, Any]]:
        """Of sweep.csv."""
        options = list(dict.fromkeys(option for run in self.runs.values() for option in run))
        kept = "updates", "saccades", "train_s", "gap_mean", "gap_p95", "failed_saccades"
        rows = []
        for state in states:
            given = {option: _cell(self.runs[state.name].get(option, "")) for option in options}
            result = self._result(state.name) if state.state == DONE else {}
            found = {key: result.get(key, "") for key in kept}
            rows.append({"run": state.name, "state": state.state, **given, **found, "why": state.why})
        return rows

    def _done(self, name: str) -> bool:
        return (self.folder / name / "result.json").exists()

    def _result(self, name: str) -> dict[str, Any]:
        found = read_json(self.folder / name / "result.json", hint=f"move {self.folder / name} away, and go on")
        if not isinstance(found, dict) or not isinstance(found.get("gap_mean"), int | float):
            raise InputError(f"{self.folder / name} holds no result of a training; move it away, and go on")
        return found

    def _course(self, name: str) -> tuple[int | None, float | None]:
        """Update and gap of a run's last evaluation."""
        try:
            last = _metrics(self.folder / name)[-1]
            return int(last["update"]), float(last["gap_mean"])
        except (OSError, LookupError, ValueError):  # it has not begun
            return None, None


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


def jobs_of(jobs: int | None) -> int:
    """The number of runs at a time; one for each core where none is given.

    Raises:
        InputError: it is none.
    """
    return whole("the number of runs at a time", cores() if jobs is None else jobs, 1, _MOST_JOBS)


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
    """As sweep.json holds them."""
    return parse_json(json.dumps(finite(options)))


def _metrics(run: Path) -> list[dict[str, str]]:
    with (run / "metrics.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _told(found: Spread) -> dict[str, float]:
    return {"gap_mean": float(found.mean), "low": float(found.low), "high": float(found.high)}


def _cell(value: Any) -> Any:
    return " ".join(map(str, value)) if isinstance(value, list) else value
