"""orient-eye optimum."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.table import Table

    from orient_eye.search.optimum import Optimum
    from orient_eye.task.saccade import SaccadeTask

    Array = NDArray[np.float64]

_AGREEMENT = 1e-3  # of |R*|: as far as the second search may be better before the first counts as wrong
_PAIR_COLUMNS = ("start_yaw_deg", "target_yaw_deg")


@dataclass(frozen=True)
class OptimumCommand:
    """Search the best action for a saccade: B, D and k0 with the largest reward, on any plant.

    Differential evolution over the whole box of actions. What was found is kept in the user's cache and
    remembered when the same saccades are asked for again. --check searches once more by another program and exits
    with 1 when that finds something better by more than 0.1 %.

    $ orient-eye optimum --start 0 --target 30

    $ orient-eye optimum --plant mujoco --case 2-varying --start -10 --target 15 --check

    $ orient-eye optimum --pairs pairs.csv --out best.csv
    """

    start: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(required without --pairs)")] = None
    """Yaw at which the saccade begins, deg."""
    target: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(required without --pairs)")] = None
    """Yaw at which it should end, deg."""
    pairs: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """Many saccades instead: a CSV file with the columns start_yaw_deg and target_yaw_deg."""
    plant: Literal["lpf", "mujoco", "tavares"] = "lpf"
    """The low-pass surrogate, the MuJoCo eye, or the NumPy reference."""
    case: Literal["1", "2-fixed", "2-varying", "3-fixed", "3-varying"] = "1"
    """Pulse of the motor command and its onset rate C: one of the thesis' five cases."""
    surrogate: str = "thesis"
    """For lpf: a surrogate.json written by sysid, or the name of a shipped one."""
    eye: str = "thesis"
    """For mujoco and tavares: preset of the eye."""
    speed_limit: float = 7200.0
    """Motor speed to which a varying C brings the command, deg/s."""
    weights: Annotated[
        tuple[float, float, float, float] | None,
        tyro.conf.arg(help_behavior_hint="(default: those of the case on the plant)"),
    ] = None
    """Weights of the reward: accuracy, energy, duration, overshoot (thesis 4.32; orient-eye weights)."""
    band: float = 0.01
    """Settling band, share of the amplitude."""
    check: bool = False
    """Search a second time, independently: scipy's differential evolution, polished by Nelder and Mead's simplex."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """CSV file of the result, one row a saccade."""
    quiet: bool = False
    """No progress bar."""

    def run(self) -> dict[str, Any]:
        """Search, or remember, and print the table."""
        from orient_eye.cli import say
        from orient_eye.errors import InputError
        from orient_eye.plants import chosen_plant
        from orient_eye.task.reward import Weights
        from orient_eye.task.saccade import SaccadeTask

        start, target = self._saccades()
        if self.out and self.out.is_dir():
            raise InputError(f"--out {self.out} is a folder; name a CSV file in it")
        task = SaccadeTask.of_case(
            chosen_plant(self.plant, self.surrogate, self.eye),
            self.case,
            band=self.band,
            speed_limit=self.speed_limit,
            **({"weights": Weights(*self.weights)} if self.weights else {}),
        )
        _check_yaw(task, start, target)
        best, remembered = self._search(task, start, target)
        rows = _rows(task, start, target, best)
        what = "remembered from an earlier search" if remembered else f"searched with {best.evaluations} saccades"
        say(f"optimum on plant {self.plant}, case {self.case}: {what}")
        result: dict[str, Any] = {"task": task.identity(), "remembered": remembered, "evaluations": best.evaluations}
        if self.check:
            result |= self._second_search(task, start, target, rows)
        say(_table(rows))
        if self.check:
            say(
                f"second search: better by at most {100 * result['check_largest_gain']:.2g} %, worse by at most "
                f"{100 * result['check_largest_loss']:.2g} %"
            )
        if self.out:
            from orient_eye.files import write_table

            write_table(self.out, rows)
            say(f"in {self.out}")
        return {**result, "out": str(self.out) if self.out else None, "saccades": rows}

    def _saccades(self) -> "tuple[Array, Array]":
        import numpy as np

        from orient_eye.errors import InputError

        if self.pairs and (self.start is not None or self.target is not None):
            raise InputError("give --pairs, or --start and --target, not both")
        if self.pairs:
            return read_pairs(self.pairs)
        if self.start is None or self.target is None:
            raise InputError("name a saccade by --start YAW and --target YAW [deg], or many by --pairs FILE.csv")
        return np.array([self.start]), np.array([self.target])

    def _search(self, task: "SaccadeTask", start: "Array", target: "Array") -> "tuple[Optimum, bool]":
        """The optimum, and whether it was remembered."""
        from orient_eye.search.optimum_cache import searched_optimum

        remembered = True
        with _progress_bar(self.quiet) as bar:
            job = bar.add_task("searching the optimum", total=1.0, visible=False)

            def progress(share: float) -> None:
                nonlocal remembered
                remembered = False
                bar.update(job, completed=share, visible=True)

            return searched_optimum(task, start, target, progress=progress), remembered

    def _second_search(
        self, task: "SaccadeTask", start: "Array", target: "Array", rows: list[dict[str, Any]]
    ) -> dict[str, Any]:
        """The second search's numbers, added to the rows, and the largest differences."""
        gains = []
        with _progress_bar(self.quiet) as bar:
            for i, row in enumerate(bar.track(rows, description="searching again")):
                action, reward = second_search(task, float(start[i]), float(target[i]))
                gain = (reward - row["reward"]) / max(abs(row["reward"]), 1.0)
                gains.append(gain)
                row |= {"check_B": action[0], "check_D": action[1], "check_k0": action[2]}
                row |= {"check_reward": reward, "check_gain": gain}
        return {
            "passed": max(gains) <= _AGREEMENT,
            "check_largest_gain": max(*gains, 0.0),
            "check_largest_loss": max(*(-g for g in gains), 0.0),
        }


def second_search(task: "SaccadeTask", start_yaw_deg: float, target_yaw_deg: float) -> tuple[list[float], float]:
    """The best action of one saccade [B, D, k0] and its reward, by scipy's optimisers.

    Differential evolution, then Nelder and Mead's simplex around the best; once for either half of the range of
    k0, since one alone may end on the wrong side of the overshoot. It shares with `orient_eye.search.optimum` only
    the task, and knows nothing of where the optimum should be.
    """
    import numpy as np
    from scipy.optimize import differential_evolution, minimize

    from orient_eye.task.saccade import horizontal

    start, goal = task.fixate(horizontal(start_yaw_deg)), horizontal(target_yaw_deg)
    low, high = task.action_low[0], task.action_high[0]

    def loss(x: "Array") -> "Array":
        """Minus the rewards (candidates,) of actions (3, candidates), shares of the box."""
        action = low + x.T * (high - low)
        many = np.zeros(len(action), int)
        return -task.perform(start[many], action[:, None], goal[many]).reward.total

    found = []
    for half in ((0, 0.5), (0.5, 1)):
        bounds = [(0, 1), (0, 1), half]
        evolved = differential_evolution(
            loss, bounds, vectorized=True, updating="deferred", rng=1, popsize=16, maxiter=120, tol=1e-6, polish=False
        )
        corners = evolved.x + np.vstack([np.zeros(3), np.diag([2e-2, 2e-4, 2e-3])])
        polished = minimize(
            lambda x: float(loss(x[:, None])[0]),
            evolved.x,
            method="Nelder-Mead",
            bounds=bounds,
            options={
                "initial_simplex": np.where(corners > [1, 1, half[1]], 2 * evolved.x - corners, corners),
                "xatol": 1e-7,
                "fatol": 1e-6 * abs(evolved.fun),
                "maxfev": 200,
            },
        )
        found += [(float(search.fun), search.x) for search in (evolved, polished)]
    least, x = min(found, key=lambda pair: pair[0])
    return (low + x * (high - low)).tolist(), -least


def read_pairs(path: Path) -> "tuple[Array, Array]":
    """Yaw of starts and targets [deg], each (saccades,), from a CSV file; further columns are ignored.

    Raises:
        InputError: unreadable, a column missing, no rows, or values that are no finite numbers.
    """
    import csv

    import numpy as np

    from orient_eye.errors import InputError

    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = [(i, row) for i, row in enumerate(csv.reader(file), start=1) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"cannot read {path}: {error}") from error
    header = [name.strip() for name in rows[0][1]] if rows else []
    if any(header.count(name) != 1 for name in _PAIR_COLUMNS):
        raise InputError(
            f"{path} needs the columns {' and '.join(_PAIR_COLUMNS)} once each, got {', '.join(header) or 'nothing'}"
        )
    if len(rows) < 2:
        raise InputError(f"{path} has no saccades; add rows below the header")
    columns = [header.index(name) for name in _PAIR_COLUMNS]
    pairs = np.empty((len(rows) - 1, 2))
    for k, (line, row) in enumerate(rows[1:]):
        try:
            pairs[k] = [float(row[i]) for i in columns]
        except (ValueError, IndexError) as error:
            raise InputError(f"{path}, line {line}: start and target are numbers [deg], got {row}") from error
        if not np.isfinite(pairs[k]).all():
            raise InputError(f"{path}, line {line}: start and target must be finite, got {row}")
    return pairs[:, 0], pairs[:, 1]


def _check_yaw(task: "SaccadeTask", start: "Array", target: "Array") -> None:
    """Refuse what is no saccade, or none an action can make: the eye must rest there with D inside its bounds."""
    import numpy as np

    from orient_eye.errors import InputError
    from orient_eye.rotations import to_euler

    motor = np.zeros((33, len(task.plant.motors)))
    motor[:, task.driven_index[0]] = np.linspace(task.action_low[0, 1], task.action_high[0, 1], len(motor))
    held = np.unwrap(to_euler(task.plant.rest_orientation(motor))[0], period=360)
    held -= 360 * np.round(held[len(held) // 2] / 360)  # straight ahead is in the middle
    low, high = max(held.min(), -179.0), min(held.max(), 179.0)
    for name, yaw in (("start", start), ("target", target)):
        for value in yaw[~((yaw >= low) & (yaw <= high))]:
            raise InputError(
                f"{name} at {value:g} deg: the eye of plant {task.plant.name!r} can be held between {low:.1f} and "
                f"{high:.1f} deg of yaw; choose an angle in this range"
            )
    for value in target[start == target]:
        raise InputError(f"start and target are both {value:g} deg: a saccade goes from one gaze direction to another")


def _rows(task: "SaccadeTask", start_yaw: "Array", target_yaw: "Array", best: "Optimum") -> list[dict[str, Any]]:
    """One row a saccade, plain values; the terms of the reward are weighted and add up to it."""
    import numpy as np

    from orient_eye.rotations import to_euler
    from orient_eye.task.saccade import horizontal

    start = task.fixate(horizontal(start_yaw))
    outcome = task.perform(start, best.action, horizontal(target_yaw))
    terms, weights, measures = outcome.reward, task.weights, outcome.measures
    final, C = to_euler(measures.final)[0], np.asarray(outcome.command.C, float)
    return [
        {
            "start_yaw_deg": float(start_yaw[i]),
            "target_yaw_deg": float(target_yaw[i]),
            "F_deg": float(outcome.command.F[i, 0]),
            "B": float(best.action[i, 0, 0]),
            "D_deg": float(best.action[i, 0, 1]),
            "k0": float(best.action[i, 0, 2]),
            "C": None if task.onset is None else float(C[i, 0]),
            "reward": float(terms.total[i]),
            "reward_accuracy": float(weights.accuracy * terms.accuracy[i]),
            "reward_energy": float(weights.energy * terms.energy[i]),
            "reward_duration": float(weights.duration * terms.duration[i]),
            "reward_overshoot": float(weights.overshoot * terms.overshoot[i]),
            "final_yaw_deg": float(final[i]),
            "duration_ms": float(1e3 * measures.settling_time_s[i]),
            "peak_velocity_deg_s": float(measures.peak_velocity_deg_s[i]),
            "overshoot": float(measures.overshoot[i]),
        }
        for i in range(len(start_yaw))
    ]


def _table(rows: list[dict[str, Any]]) -> "Table":
    from rich.markup import escape
    from rich.table import Table

    table = Table()
    shown: dict[str, Callable[[dict[str, Any]], str]] = {
        "saccade [deg]": lambda r: f"{r['start_yaw_deg']:g} to {r['target_yaw_deg']:g}",
        "B [1/s]": lambda r: f"{r['B']:.2f}",
        "D [deg]": lambda r: f"{r['D_deg']:.3f}",
        "k0 [1/s]": lambda r: f"{r['k0']:.3f}",
        "C [1/s]": lambda r: f"{r['C']:.4g}",
        "reward": lambda r: f"{r['reward']:.0f}",
        "accuracy": lambda r: f"{r['reward_accuracy']:.0f}",
        "energy": lambda r: f"{r['reward_energy']:.0f}",
        "duration": lambda r: f"{r['reward_duration']:.0f}",
        "overshoot": lambda r: f"{r['reward_overshoot']:.0f}",
        "t_d": lambda r: f"{r['duration_ms']:.1f} ms",
        "peak velocity": lambda r: f"{r['peak_velocity_deg_s']:.0f} deg/s",
        "goes beyond": lambda r: f"{100 * r['overshoot']:.4f} %",
        "second search": lambda r: f"{100 * r['check_gain']:+.4f} %",
    }
    if rows[0]["C"] is None:
        del shown["C [1/s]"]
    if "check_gain" not in rows[0]:
        del shown["second search"]
    for name in shown:
        table.add_column(escape(name), justify="right")
    for row in rows:
        table.add_row(*(text(row) for text in shown.values()))
    return table


def _progress_bar(quiet: bool) -> Any:
    """A bar on standard error that goes away when it is done, or nothing."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    return Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal)
