"""orient-eye sweep."""

import io
import re
import textwrap
import tomllib
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.checks import shown
from orient_eye.cli.options import Several
from orient_eye.learning.config import TrainConfig

if TYPE_CHECKING:
    from rich.table import Table

    from orient_eye.cli.tables import Cell, Row
    from orient_eye.learning.sweep_results import RunState

_LARGEST = 2**20  # bytes of a file of options
_EXAMPLE = '[options] with case = ["1", "2-fixed"] and seed = [0, 1, 2]'


@dataclass(frozen=True)
class Sweep:
    """Train many policies: all combinations of the options that have several values.

    Every run is what orient-eye train leaves with these options, in a folder of its own. The same command again, or
    --resume, does what is missing: runs that are done are kept, those that were stopped or killed go on, those that
    failed are tried again. At the end there are sweep.csv, result.json, and sweep.png with the spread over the seeds.

    $ orient-eye sweep --out runs/sweep --case 1 2-fixed --seed 0 1 2

    $ orient-eye sweep sweep.toml --out runs/sweep --jobs 8

    $ orient-eye sweep --resume runs/sweep

    $ orient-eye sweep --out shared/sweep --seed 0 1 2 --engine ray --address head:6379
    """

    file: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="[FILE.toml]")] = None
    """A file with the options in place of the command line's (docs/sweep.md)."""
    grid: Annotated[dict[str, tuple[Any, ...]], Several(TrainConfig)] = field(default_factory=dict)
    """Options of the runs."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/sweep-DATE-TIME)")] = None
    """Folder of the sweep: new, empty, or of the same sweep, which then goes on."""
    resume: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """Folder of a sweep to go on with; takes the sweep's own options."""
    jobs: Annotated[int | None, tyro.conf.arg(help_behavior_hint="(default: one for each core)")] = None
    """Runs at a time, each in a process with its share of the cores; with 1 in this process."""
    engine: str = "local"
    """Where the runs are carried out: processes of this machine, or a Ray cluster (docs/sweep.md)."""
    address: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(default: a Ray of its own here)")] = None
    """Of the cluster, with --engine ray: auto, HOST:PORT or ray://HOST:PORT."""
    quiet: bool = False
    """Show no table while it goes on."""
    checkpoint_every: float = 20.0
    """Seconds between checkpoints of a run, from which it goes on after a crash."""

    def run(self) -> dict[str, Any]:
        """Begin or go on."""
        from orient_eye.cli.options import check_plant_options
        from orient_eye.cli.tables import say
        from orient_eye.errors import InputError
        from orient_eye.learning.engines import ENGINES, jobs_of
        from orient_eye.learning.grid import named, plant_options, product_of
        from orient_eye.learning.sweep import Sweep as Folder
        from orient_eye.learning.training import Interrupted, check_interval
        from orient_eye.progress import live

        check_interval(self.checkpoint_every)  # before there is a folder
        jobs_of(self.jobs, 1)
        if self.resume and (self.file or self.grid or self.out):
            raise InputError("--resume takes the sweep's own options and folder; leave the other options out")
        if self.file and self.grid:
            told = ", ".join(self.grid)
            raise InputError(f"the options stand in {self.file} or on the command line, not in both; leave {told} out")
        engine = ENGINES[self.engine](self.address)
        if self.resume:
            sweep = Folder.open(self.resume)
        else:
            runs = read_runs(self.file) if self.file else product_of(self.grid)
            for plant, *options in {(run.get("plant", TrainConfig.plant), *plant_options(run)) for run in runs}:
                check_plant_options(plant, options)
            sweep = Folder.begin(named(runs), self.out)
        done = sum(state.state == "done" for state in sweep.states())
        say(f"{len(sweep.runs)} runs in {sweep.folder}" + (f", {done} done already" if done else ""))
        try:
            with live(quiet=self.quiet) as screen:
                show = None if screen is None else lambda states: screen(live_table(states))
                result = sweep.carry_out(jobs=self.jobs, engine=engine, checkpoint_s=self.checkpoint_every, show=show)
        except Interrupted as stopped:
            say(str(stopped))
            raise SystemExit(stopped.code) from None
        _say(result)
        return result


def _say(result: Mapping[str, Any]) -> None:
    from orient_eye.cli.tables import column, number, say, table

    def between(row: Mapping[str, Any]) -> str:
        low, high = (number(100 * row[end], ".2f") for end in ("low", "high"))
        return "-" if row["runs"] < 2 else f"{low} to {high} %"

    if result["settings"]:
        columns = {
            "setting": lambda row: row["setting"],
            "runs": column("runs", "d"),
            "mean gap": column("gap_mean", ".2f", " %", 100),
            "95 % interval": between,
        }
        title = "Mean reward gap to the searched optimum: interquartile mean over the runs of a setting."
        say(table(title, columns, result["settings"], left=("setting",)))
    for name, notes in result["notes"].items():
        say(f"{name}: {'; '.join(notes)}", "yellow")
    for name, why in result["failed"].items():
        say(f"error: {name}: {why}", "red")
    if result["failed"]:
        say(f"to try them again: orient-eye sweep --resume {result['out']}")
    pictures = ", sweep.png" if result["settings"] else ""
    say(f"in {result['out']}: sweep.csv, result.json{pictures}, and a run directory a run")


def live_table(states: "list[RunState]") -> "Table":
    """How a sweep stands: what runs and what failed, below how many are done."""
    from orient_eye.cli.tables import number, table

    count = {state: sum(each.state == state for each in states) for state in ("done", "running", "failed")}
    title = f"{count['done']} of {len(states)} done, {count['running']} running, {count['failed']} failed"
    columns: dict[str, Callable[[Row], Cell]] = {
        "run": lambda row: row["run"],
        "update": lambda row: number(row["state"].update, "d"),
        "mean gap": lambda row: number(row["state"].gap_mean, ".2%"),
        "": lambda row: row["state"].why,
    }
    rows = [{"run": each.name, "state": each} for each in states if each.state in ("running", "failed")]
    return table(title, columns, rows, left=("run", ""))


def read_runs(file: Path) -> list[dict[str, Any]]:
    """The runs of a TOML file: the grid of [options], or of each of [[runs]] with [options] for what it leaves out.

    Raises:
        InputError: it cannot be read, or an option or a value is none.
    """
    from orient_eye.errors import InputError
    from orient_eye.files import read_bytes, unreadable
    from orient_eye.learning.grid import product_of

    hint = f"give a TOML file: {_EXAMPLE}"
    try:
        content = tomllib.loads(read_bytes(file, most=_LARGEST, hint=hint).decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise error if isinstance(error, InputError) else unreadable(file, error, hint) from error
    options, tables = content.pop("options", {}), content.pop("runs", [{}])
    if content:
        raise InputError(f"{file}: unknown {', '.join(content)}; a sweep has the tables [options] and [[runs]]")
    if not isinstance(options, dict) or not isinstance(tables, list) or not all(isinstance(t, dict) for t in tables):
        raise InputError(f"{file}: options is one table, [options], and runs are several, [[runs]]; {hint}")
    shared = _values(file, options)
    return [run for each in tables for run in product_of(shared | _values(file, each))]


def _values(file: Path, told: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
    """Values of the options of one table, read as the command line reads them."""
    found: dict[str, tuple[Any, ...]] = {}
    for name, value in told.items():
        found |= _values_of_one(file, name, value)
    return found


def _values_of_one(file: Path, name: str, value: Any) -> dict[str, tuple[Any, ...]]:
    from orient_eye.errors import InputError

    if isinstance(value, list) and value and all(isinstance(each, bool | list | dict) for each in value):
        parts = [_values_of_one(file, name, each) for each in value]
        for each, part in zip(value, parts, strict=True):
            (values,) = part.values() or ((),)
            if isinstance(each, list) and (len(values) != 1 or not isinstance(values[0], tuple)):
                raise InputError(
                    f"{file}: {name} = {shown(value)}: a list in a list is one value of several numbers, which "
                    f"{name} has not; write its values side by side, {name} = [A, B]"
                )
        (key,) = {key for part in parts for key in part} or {name}
        return {key: tuple(one for part in parts for one in part.get(key, (False,)))}
    if value is False:
        return {}
    words = [] if value is True else _words(value)
    flag = f"--{name.replace('_', '-')}"
    said = io.StringIO()
    try:
        with redirect_stderr(said), redirect_stdout(said):  # a help page too
            read = _parsed([flag, *words])
    except SystemExit:
        why = textwrap.shorten(re.sub(r"-{5,}|[│╭╮╰╯─]", " ", said.getvalue()), 300, placeholder=" ...")
        raise InputError(f"{file}: {name} = {shown(value)} is no option of orient-eye train: {why}") from None
    if len(read) != 1:
        raise InputError(f"{file}: {name} = {shown(value)} is not one option with its values")
    return read


def _words(value: Any) -> list[str]:
    if isinstance(value, dict):
        return [str(word) for pair in value.items() for word in pair]
    return [str(word) for word in value] if isinstance(value, list) else [str(value)]


def _parsed(words: list[str]) -> dict[str, tuple[Any, ...]]:
    from orient_eye.cli.options import parse

    return parse(_Options, words, program="orient-eye sweep").grid


@dataclass(frozen=True)
class _Options:
    """Options of the runs of a sweep."""

    grid: Annotated[dict[str, tuple[Any, ...]], Several(TrainConfig)] = field(default_factory=dict)
