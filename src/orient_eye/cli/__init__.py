"""The command line: one file a command, each a frozen dataclass that tyro turns into options.

A command's fields are its options, their docstrings the help, and `run()` does the work and returns
the result as a dictionary of plain values. Words for people go to standard error (`say`); with
`--json` the result goes to standard output, and nothing else does. Heavy libraries are imported
inside `run`, so that `orient-eye --help` answers at once.
"""

import inspect
import json
import operator
import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any, Protocol, Union, cast

from orient_eye.errors import InputError


class Command(Protocol):
    """What every command is."""

    def run(self) -> dict[str, Any]:
        """Do the work; returns the result."""
        ...


def _commands(chosen: Sequence[str]) -> Any:
    """The union type of all commands, in the order of the help page."""
    import tyro

    from orient_eye.cli.evaluate import Evaluate
    from orient_eye.cli.export import Export
    from orient_eye.cli.models import Models
    from orient_eye.cli.optimum import OptimumCommand
    from orient_eye.cli.predict import Predict
    from orient_eye.cli.simulate import Simulate
    from orient_eye.cli.sysid import Sysid
    from orient_eye.cli.train import Train
    from orient_eye.cli.validate import Validate
    from orient_eye.cli.view import View
    from orient_eye.cli.weights import WeightsCommand

    named = {
        "simulate": Simulate,
        "view": View,
        "sysid": Sysid,
        "train": Train,
        "models": Models,
        "predict": Predict,
        "evaluate": Evaluate,
        "export": Export,
        "optimum": OptimumCommand,
        "weights": WeightsCommand,
        "validate": Validate,
    }
    # Union and Annotated, made by program: a type checker reads neither from variables.
    members = [
        operator.getitem(
            Annotated, (command, tyro.conf.subcommand(name, description=_summary(command, full=name in chosen)))
        )
        for name, command in named.items()
    ]
    return operator.getitem(Union, tuple(members))


def _summary(command: type, *, full: bool) -> str:
    """The first line of a command's docstring for the list of commands, all of it for its own page."""
    text = inspect.getdoc(command) or ""
    return text if full else text.splitlines()[0]


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point of `orient-eye`; exits with 2 on bad input, 130 when interrupted."""
    try:
        _run(list(sys.argv[1:] if arguments is None else arguments))
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read our output, `head` say, has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def _run(arguments: list[str]) -> None:
    import tyro
    from rich.markup import escape

    from orient_eye.run_directory import plain

    as_json = "--json" in arguments
    if "--version" in arguments:
        from orient_eye import __version__

        print(__version__)
        return
    command: Command = tyro.cli(
        cast(type[Any], _commands(arguments)),
        prog="orient-eye",
        args=[a for a in arguments if a != "--json"],
        description=_DESCRIPTION,
        config=(
            tyro.conf.OmitSubcommandPrefixes,
            tyro.conf.OmitArgPrefixes,
            tyro.conf.FlagCreatePairsOff,
            tyro.conf.DisallowNone,
        ),
    )
    try:
        result = command.run()
    except InputError as error:
        say(f"[red]error:[/red] {escape(str(error))}")
        if as_json:
            print(json.dumps({"error": str(error)}))
        sys.exit(2)
    except KeyboardInterrupt:
        say("interrupted")
        sys.exit(130)
    if as_json:
        print(json.dumps(result, indent=2, default=plain))
    if result.get("passed") is False:
        sys.exit(1)


_DESCRIPTION = """Simulate, identify and train a biomimetic robot eye.

Every command takes --help, and --json to print its result for programs on standard output."""


def say(message: Any = "") -> None:
    """Print words or a rich table for people, on standard error."""
    from rich.console import Console

    console = Console(stderr=True, highlight=False)
    if not console.is_terminal:
        console.width = 160  # a log file or a pipe: no wrapping at the 80 columns of a missing terminal
    console.print(message)
