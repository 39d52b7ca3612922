"""How time and memory grow: with saccades, horizon, threads, motors and the length of recordings; where they bend.

    python benchmarks/growth.py [--quick] [--out runs/growth.png] [--memory-gb 4] [--longest-s 30]

Every point is a process of its own, forked from one that has made the plant, so that its peak of memory is its own.
A cost is held against a + b x: below x = a / b, the bend, a call costs what it costs whatever it does; above it, every
one more costs the same as the last, and the slope of the two largest in a double logarithmic picture is 1. What would
take longer or more memory than allowed is not measured but foretold, from the largest that was. CPU time is that of
all threads; on a busy machine read this, not the wall time.
"""

import argparse
import gc
import multiprocessing
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray
from scipy.optimize import nnls

import orient_eye as oe
from orient_eye.constants import STEP_S
from orient_eye.figures import save, tidy
from orient_eye.sysid import StepResponse

Array = NDArray[np.float64]
Work = Callable[[], object]
COLOURS = ("#1f4e9c", "#d1495b", "#2a9d6f", "#edae49", "#7d5ba6", "#555555")
BATCH = 1000
_VISIBLE = 5e6  # bytes: less than that is what the process has at hand
_UNIT = 1 if sys.platform == "darwin" else 1024  # of ru_maxrss


class Cost(NamedTuple):
    """Of one point: seconds of the clock and of the CPU, bytes of memory at the peak and of what was written."""

    wall_s: float
    cpu_s: float
    memory: float
    written: float = 0.0


@dataclass(frozen=True)
class Series:
    """What grows, and what it costs.

    Attributes:
        panel: of the picture, the same for all that grow alike.
        name: of the line.
        of: what is counted.
        work: amount to what is to be done, prepared.
        bounded: whether memory does not grow.
        costs: amount to what was measured.
        foretold: amount to what was not.
    """

    panel: str
    name: str
    of: str
    work: Mapping[float, Callable[[], Work]]
    bounded: bool = False
    costs: dict[float, Cost] = field(default_factory=dict)
    foretold: dict[float, Cost] = field(default_factory=dict)

    def measure(self, longest_s: float, most_bytes: float) -> None:
        """Measure what may be, from the smallest up, and print a row each."""
        last: tuple[float, Cost] | None = None
        for x, prepare in self.work.items():
            if last is not None and x > last[0]:
                more = x / last[0]
                expected = Cost(*(more * value for value in last[1]))
                if self.bounded:
                    expected = expected._replace(memory=last[1].memory)
                if expected.wall_s > longest_s or expected.memory > most_bytes:
                    self.foretold[x] = expected
                    self._say(x, expected, "foretold")
                    continue
            self.costs[x] = measured(prepare)
            last = x, self.costs[x]
            self._say(x, self.costs[x])

    def _say(self, x: float, cost: Cost, note: str = "") -> None:
        written = f"{cost.written / 1e6:10.3f}" if cost.written else f"{'':10}"
        print(
            f"{self.panel:20} {self.name:24} {x:10g} {cost.wall_s:10.4f} {cost.cpu_s:10.4f} {cost.memory / 1e6:10.1f} "
            f"{written} {1e6 * cost.cpu_s / x:12.1f} {note}",
            flush=True,
        )

    def bend(self) -> float:
        """Amount below which the call itself costs more CPU time than what it does."""
        fixed, each = straight(self.costs, "cpu_s")
        return fixed / each if each > 0 else float("inf")

    def slope(self, what: str) -> float:
        """Of the logarithm between the two largest amounts; NaN where there is nothing to see."""
        if len(self.costs) < 2:
            return float("nan")
        (x0, one), (x1, two) = sorted(self.costs.items())[-2:]
        a, b = getattr(one, what), getattr(two, what)
        return float(np.log(b / a) / np.log(x1 / x0)) if min(a, b) > 0 else float("nan")


def straight(costs: Mapping[float, Cost], what: str) -> tuple[float, float]:
    """a and b of the cost a + b x, neither negative, that is relatively nearest to what was measured."""
    x, y = np.array(list(costs)), np.array([getattr(cost, what) for cost in costs.values()])
    weight = 1 / np.maximum(y, 1e-12)
    fixed, each = nnls(np.stack([weight, x * weight], axis=1), y * weight)[0]
    return float(fixed), float(each)


def measured(prepare: Callable[[], Work]) -> Cost:
    """The cost in a forked process: the least of some rounds, the fewer the longer they take."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_measure, args=(prepare, sender))
    process.start()
    sender.close()
    try:
        return Cost(*receiver.recv())
    except EOFError:
        raise SystemExit("a measurement ended before its time, probably for want of memory") from None
    finally:
        process.join()


def _measure(prepare: Callable[[], Work], sender: Any) -> None:
    work = prepare()
    gc.collect()
    before, costs = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, []
    while not costs or (len(costs) < 5 and sum(cost.wall_s for cost in costs) < 0.3):
        wall, cpu = time.perf_counter(), time.process_time()
        written = work()
        took = time.perf_counter() - wall, time.process_time() - cpu
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        costs.append(Cost(*took, (peak - before) * _UNIT, written if isinstance(written, int) else 0))
    least = min(cost.wall_s for cost in costs), min(cost.cpu_s for cost in costs)
    sender.send((*least, costs[0].memory, costs[0].written))


# --- what is measured -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Problem:
    """Horizontal saccades of case 1 on a plant."""

    name: str
    threads: int = 1
    motors: int = 1
    horizon_s: float = 0.5

    @property
    def task(self) -> oe.SaccadeTask:
        """With all motors driven or the one that it takes."""
        driven = None if self.motors == 1 else ("motor1", "motor2", "motor3")
        given = {"weights": (1.0, 1.0, 1.0, 1.0), "driven": driven, "horizon_s": self.horizon_s}
        return oe.SaccadeTask.of_case(plant_of(self.name, self.threads), "1", **given)

    def saccades(self, count: int) -> tuple[oe.State, Array, Array]:
        """Starts, actions and targets: a hundred over and over."""
        start, action, target = some_saccades(self.name, self.motors)
        which = np.arange(count) % len(action)
        return start[which], action[which], target[which]


@cache
def plant_of(name: str, threads: int = 1) -> oe.Plant:
    """A plant, made once."""
    return oe.make_plant(name, **({} if name == "lpf" else {"threads": threads}))


@cache
def some_saccades(name: str, motors: int) -> tuple[oe.State, Array, Array]:
    """A hundred of all sizes, good ones."""
    task, random = Problem(name, motors=motors).task, np.random.default_rng(0)
    start, target = oe.saccades(task.targets, *random.uniform(-30, 30, (2, 100, 1)))
    action = task.actions.likely(target)
    action[:, 0::3], action[:, 2::3] = random.uniform([[[30.0]], [[16.0]]], [[[40.0]], [[20.0]]], (2, 100, motors))
    return start, action, target


def perform(problem: Problem, count: int, batch: int | None = None) -> Work:
    """Performing saccades from command to reward, all at once or batch by batch, of which only rewards are kept."""
    task, (start, action, target) = problem.task, problem.saccades(count)

    def work() -> None:
        for first in range(0, count, batch or count):
            part = slice(first, first + (batch or count))
            outcome = task.perform(start[part], action[part], target[part])
            assert np.isfinite(outcome.reward.total).all()

    return work


def move(problem: Problem, count: int) -> Work:
    """Moving the eye and nothing else: what its threads share."""
    task, (start, action, target) = problem.task, problem.saccades(count)
    command = task.actions.command(start, target, action)
    return lambda: task.plant.move(command, start, task.horizon_s)


def record(problem: Problem, count: int, folder: Path) -> Work:
    """Writing a recording of saccades."""
    start, action, target = problem.saccades(count)
    trajectory, model = problem.task.trajectory(start, action, target), plant_of(problem.name).drawn()
    path = folder / "recording.rrd"

    def work(some: slice = slice(None)) -> int:
        oe.record(path, trajectory[some], model=model, target=target[some])
        return path.stat().st_size

    work(slice(1))  # the imports
    return work


def save_one(problem: Problem, kind: str, folder: Path) -> Work:
    """Writing one saccade as NPZ or CSV."""
    trajectory, path = problem.task.trajectory(*problem.saccades(1)), folder / f"saccade.{kind}"

    def work() -> int:
        (trajectory.save_npz if kind == "npz" else trajectory.to_csv)(path)
        return path.stat().st_size

    return work


def identify(rows: int) -> Work:
    """Identifying two recorded steps of a first-order eye with noise, of so many rows each."""

    def steps(rows: int) -> list[StepResponse]:
        random, time_s, made = np.random.default_rng(0), np.linspace(0, 1, rows), []
        for size in (5.0, 10.0):
            eye = 1.5 * size * (1 - np.exp(-17.5 * time_s)) + random.normal(0, 0.01, rows)
            made.append(StepResponse(f"{size:g}", time_s, np.full(rows, size), eye, axis="yaw"))
        return made

    oe.identify_recordings(steps(300))  # the imports
    recorded = steps(rows)
    return lambda: oe.identify_recordings(recorded)


def all_series(quick: bool, folder: Path) -> Iterator[Series]:
    """What grows."""
    plants = {name: Problem(name) for name in ("lpf", "tavares", "mujoco")}
    for problem in plants.values():  # what is made here is there in the processes that measure
        perform(problem, 10)()
    counts = {name: [100, 1000, 10_000] if quick else [10**power for power in range(2, 7)] for name in plants}
    if quick:
        counts |= {"tavares": [100, 300, 1000], "mujoco": [100, 300]}
    for name, problem in plants.items():
        work = {n: partial(perform, problem, n) for n in counts[name]}
        yield Series("saccades", name, "saccades", work)
        work = {n: partial(perform, problem, n, BATCH) for n in counts[name] if n >= BATCH}
        if name == "lpf" or not quick:
            yield Series("saccades", f"{name}, by {BATCH}", "saccades", work, bounded=True)
    for name, problem in plants.items():
        horizons = (0.25, 0.5, 1.0) if quick else (0.25, 0.5, 1.0, 2.0, 4.0)
        work = {h: partial(perform, replace(problem, horizon_s=h), 100) for h in horizons}
        yield Series("horizon [s]", f"{name}, 100 saccades", "s", work)
    for name, count in {"tavares": 1000, "mujoco": 200}.items():
        cores = sorted({1, 2, os.cpu_count() or 1})
        for what, of in {"move": move, "perform": perform}.items():
            work = {threads: partial(of, replace(plants[name], threads=threads), count) for threads in cores}
            yield Series("threads", f"{name}, {what} {count}", "threads", work)
    for name, count in {"tavares": 1000, "mujoco": 200}.items():
        work = {motors: partial(perform, replace(plants[name], motors=motors), count) for motors in (1, 3)}
        yield Series("motors driven", f"{name}, {count} saccades", "motors", work)
    for name in ("lpf", "tavares"):
        work = {n: partial(record, plants[name], n, folder) for n in ((1, 10) if quick else (1, 3, 10, 30, 100))}
        yield Series("saccades in an .rrd", name, "saccades", work)
    lengths = (0.5, 2.0) if quick else (0.25, 1.0, 4.0, 10.0)
    samples = {round(h / STEP_S) + 1: replace(plants["tavares"], horizon_s=h) for h in lengths}
    work = {n: partial(record, problem, 1, folder) for n, problem in samples.items()}
    yield Series("samples", "tavares, .rrd", "samples", work)
    for kind in ("npz", "csv"):
        work = {n: partial(save_one, problem, kind, folder) for n, problem in samples.items()}
        yield Series("samples", f"tavares, .{kind}", "samples", work)
    rows = (300, 3000) if quick else (100, 300, 1000, 3000, 10_000, 30_000)
    yield Series("rows to identify", "sysid, two recordings", "rows", {n: partial(identify, n) for n in rows})


# --- what is told ---------------------------------------------------------------------------------


def main() -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description="How time and memory grow.")
    parser.add_argument("--quick", action="store_true", help="fewer and smaller points")
    parser.add_argument("--out", type=Path, default=Path("runs/growth.png"), help="the picture")
    parser.add_argument("--memory-gb", type=float, default=4.0, help="at most, of a point")
    parser.add_argument("--longest-s", type=float, default=30.0, help="at most, of a point")
    options = parser.parse_args()
    print(
        f"{'what grows':20} {'of':24} {'how many':>10} {'wall [s]':>10} {'CPU [s]':>10} {'peak [MB]':>10} "
        f"{'file [MB]':>10} {'CPU/each [us]':>12}"
    )
    with tempfile.TemporaryDirectory() as folder:
        found = list(all_series(options.quick, Path(folder)))
        for series in found:
            series.measure(options.longest_s, 1e9 * options.memory_gb)
    print("\nslopes between the two largest, and the bend where it was crossed")
    for series in found:
        say_growth(series)
    print(f"\nin {save(drawn(found), options.out)}")


def say_growth(series: Series) -> None:
    """One line: how a series grows."""
    if series.of in ("threads", "motors"):
        first, *others = sorted(series.costs)
        told = ", ".join(
            f"{x:g}: {series.costs[x].wall_s / series.costs[first].wall_s:.2f} of the wall time, "
            f"{series.costs[x].cpu_s / series.costs[first].cpu_s:.2f} of the CPU time"
            for x in others
        )
        print(f"{series.panel:20} {series.name:24} {told}")
        return
    most = max(series.costs)
    cost = series.costs[most]
    bend = series.bend()
    told = [f"CPU {series.slope('cpu_s'):.2f}"]
    if most > bend > min(series.costs):
        told.append(f"bend at {bend:.3g} {series.of}")
    if cost.memory > _VISIBLE and not series.bounded:
        told.append(f"memory {series.slope('memory'):.2f}, {cost.memory / most / 1e3:.3g} kB each")
    if cost.written:
        told.append(f"file {series.slope('written'):.2f}, {cost.written / most / 1e3:.3g} kB each")
    print(f"{series.panel:20} {series.name:24} {'; '.join(told)}")


def drawn(found: Iterable[Series]) -> Figure:
    """Time over what grows in a panel each, memory beside it for the saccades."""
    panels: dict[str, list[Series]] = {}
    for series in found:
        panels.setdefault(series.panel, []).append(series)
    figure = Figure(figsize=(16, 8), layout="constrained")
    axes = iter(figure.subplots(2, 4).flat)
    for panel, lines in panels.items():
        whats = {"cpu_s": "CPU time [s]", "memory": "peak of memory [MB]"}
        if panel == "threads":
            whats = {"wall_s": "wall time [s]"}
        elif panel != "saccades":
            whats = {"cpu_s": "CPU time [s]"}
        for what, label in whats.items():
            draw(next(axes), lines, what, panel, label)
    for left in axes:
        left.set_axis_off()
    return figure


def draw(axes: Any, lines: Iterable[Series], what: str, panel: str, label: str) -> None:
    """One panel; hollow is what was foretold, dotted the straight cost that was fitted."""
    unit, ticks = 1e-6 if what == "memory" else 1.0, set[float]()
    few = panel in ("threads", "motors driven")
    for colour, series in zip(COLOURS, lines, strict=False):

        def values(costs: Mapping[float, Cost]) -> tuple[Array, Array]:
            return np.array(list(costs), float), np.array([unit * getattr(cost, what) for cost in costs.values()])

        axes.plot(*values(series.costs), "o-", color=colour, ms=4, label=series.name)
        axes.plot(*values(series.foretold), "o", color=colour, ms=5, mfc="none")
        ticks |= {*series.costs, *series.foretold}
        if what == "cpu_s" and not few:
            at = np.geomspace(min(series.costs), max(series.costs), 50)
            fixed, each = straight(series.costs, what)
            axes.plot(at, fixed + each * at, ":", color=colour, lw=1)
    if few:
        axes.set_ylim(bottom=0)
    else:
        axes.set(xscale="log", yscale="log")
    if max(ticks) < 50 * min(ticks):  # no decade to be read
        axes.set_xticks(sorted(ticks), [f"{x:g}" for x in sorted(ticks)])
        axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(panel)
    axes.set_ylabel(label)
    tidy(axes)
    axes.legend(frameon=False, fontsize="small")


if __name__ == "__main__":
    main()
