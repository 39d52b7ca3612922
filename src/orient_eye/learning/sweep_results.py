"""What came of a sweep: a row a run, a spread a setting, a picture.

    results = Results(Path("runs/sweep"), runs)
    results.settings()[0].gaps                       # mean reward gap of each seed
    results.write(states)                            # sweep.csv, result.json, sweep.png

All of it is read from the run directories.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from orient_eye.errors import InputError
from orient_eye.files import read_json, remove_leftovers, write_json, write_table
from orient_eye.learning.grid import Options, named, without_seed
from orient_eye.learning.spread import Spread, spread
from orient_eye.learning.workers import DONE, FAILED

_KEPT = "updates", "saccades", "train_s", "gap_mean", "gap_p95", "failed_saccades"


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
class Results:
    """Of the runs in a sweep's folder.

    Attributes:
        folder: of the sweep.
        runs: name to options.
    """

    folder: Path
    runs: Mapping[str, Options]

    def done(self, name: str) -> bool:
        """Whether a run has its result."""
        return (self.folder / name / "result.json").exists()

    def course(self, name: str) -> tuple[int | None, float | None]:
        """Update and gap of a run's last evaluation; None before the first."""
        try:
            last = _metrics(self.folder / name)[-1]
            return int(last["update"]), float(last["gap_mean"])
        except (OSError, LookupError, ValueError):  # it has not begun
            return None, None

    def settings(self) -> list[Setting]:
        """The runs that are done, by setting.

        Raises:
            InputError: a result cannot be read.
        """
        groups: dict[str, list[str]] = {}
        for name, options in self.runs.items():
            groups.setdefault(repr(without_seed(options)), []).append(name)
        settings = named([without_seed(self.runs[names[0]]) for names in groups.values()])
        found = []
        for setting, names in zip(settings, groups.values(), strict=True):
            done = [name for name in names if self.done(name)]
            if not done:
                continue
            gaps = np.array([self._result(name)["gap_mean"] for name in done], float)
            rows = [_metrics(self.folder / name) for name in done]
            points = min(map(len, rows))
            curves = np.array([[float(row["gap_mean"]) for row in of[:points]] for of in rows])
            updates = np.array([float(row["update"]) for row in rows[0][:points]])
            found.append(Setting(setting, without_seed(self.runs[done[0]]), tuple(done), gaps, updates, curves))
        return found

    def write(self, states: list[RunState]) -> dict[str, Any]:
        """Write sweep.csv, result.json and sweep.png; returns the content of result.json.

        Raises:
            InputError: a result cannot be read, or a file cannot be written.
        """
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
        rows = []
        for state in states:
            given = {option: _cell(self.runs[state.name].get(option, "")) for option in options}
            result = self._result(state.name) if state.state == DONE else {}
            found = {key: result.get(key, "") for key in _KEPT}
            rows.append({"run": state.name, "state": state.state, **given, **found, "why": state.why})
        return rows

    def _result(self, name: str) -> dict[str, Any]:
        found = read_json(self.folder / name / "result.json", hint=f"move {self.folder / name} away, and go on")
        if not isinstance(found, dict) or not isinstance(found.get("gap_mean"), int | float):
            raise InputError(f"{self.folder / name} holds no result of a training; move it away, and go on")
        return found


def _metrics(run: Path) -> list[dict[str, str]]:
    with (run / "metrics.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _told(found: Spread) -> dict[str, float]:
    return {"gap_mean": float(found.mean), "low": float(found.low), "high": float(found.high)}


def _cell(value: Any) -> Any:
    return " ".join(map(str, value)) if isinstance(value, list) else value
