"""The command line: one file a command, each a frozen dataclass that tyro turns into options.

A command's fields are its options, their docstrings the help, and `run()` does the work and returns
the result as a dictionary of plain values. No command imports another. What they share:

    options.py      plants, their options, cases, targets: made from the registries
    saccades.py     --start, --target and --pairs
    tables.py       words and tables for people, on standard error
    surroundings.py signals, standard streams, folders of libraries

With `--json` the result goes to standard output, and nothing else does. Heavy libraries are imported
inside `run`, so that `orient-eye --help` answers at once.
"""

import inspect
import json
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Protocol

from orient_eye.errors import Ended, InputError

COMMANDS = {
    "simulate": "orient_eye.cli.simulate:Simulate",
    "view": "orient_eye.cli.view:View",
    "sysid": "orient_eye.cli.sysid:Sysid",
    "train": "orient_eye.cli.train:Train",
    "sweep": "orient_eye.cli.sweep:Sweep",
    "models": "orient_eye.cli.models:Models",
    "predict": "orient_eye.cli.predict:Predict",
    "check": "orient_eye.cli.check:Check",
    "evaluate": "orient_eye.cli.evaluate:Evaluate",
    "export": "orient_eye.cli.export:Export",
    "convert": "orient_eye.cli.convert:Convert",
    "compare": "orient_eye.cli.compare:Compare",
    "optimum": "orient_eye.cli.optimum:Optimum",
    "listing": "orient_eye.cli.listing:Listing",
    "weights": "orient_eye.cli.weights:Weights",
    "report": "orient_eye.cli.report:Report",
    "validate": "orient_eye.cli.validate:Validate",
}
"""Name to "module:class", in the order of the help page."""

_DESCRIPTION = """Simulate, identify and train a biomimetic robot eye.

Every command takes --help, and --json to print its result for programs on standard output."""


class Command(Protocol):
    """What every command is."""

    def run(self) -> dict[str, Any]:
        """Do the work; returns the result, plain values. `passed` False makes the exit code 1."""
        ...


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point of `orient-eye`; exits with 2 on bad input, 130 when interrupted, 128 + its number at a signal."""
    from orient_eye.cli.surroundings import streams

    given = list(sys.argv[1:] if arguments is None else arguments)
    with streams():
        code = _run([a for a in given if a != "--json"], as_json="--json" in given)
    sys.exit(code)


def _run(arguments: list[str], *, as_json: bool) -> int:
    """Run a command line; returns the exit code."""
    from orient_eye.cli.surroundings import signals
    from orient_eye.cli.tables import say

    try:
        with signals():
            code = _done(arguments, as_json=as_json)
            sys.stdout.flush()  # here, where an error is told
            return code
    except (InputError, MemoryError) as error:
        told = f"not enough memory ({error}); ask for less at once" if isinstance(error, MemoryError) else str(error)
        say(f"error: {told}", style="red")
        with suppress(InputError, BrokenPipeError):  # which may be what is told
            if as_json:
                print(json.dumps({"error": told}))
        return 2
    except KeyboardInterrupt as end:
        say("interrupted")
        return 128 + (end.number if isinstance(end, Ended) else signal.SIGINT)
    except BrokenPipeError:
        return 1


def _done(arguments: list[str], *, as_json: bool) -> int:
    """Do what a command line says, and print the result; returns the exit code."""
    from orient_eye.cli.surroundings import folders

    if "--version" in arguments:
        from orient_eye import __version__

        print(__version__)
        return 0
    try:
        if not arguments or arguments[0] not in COMMANDS:
            return _list_commands(arguments)
        from orient_eye.cli.options import parse

        command = parse(_command(arguments[0]), arguments[1:], program=f"orient-eye {arguments[0]}")
        with folders():
            result = command.run()
    except SystemExit as end:  # after a help page, or a table of what is wrong with the options
        return int(end.code or 0)
    if as_json:
        from orient_eye.files import finite

        print(json.dumps(finite(result), indent=2, default=str))
    return 1 if result.get("passed") is False else 0


def _command(name: str) -> Any:
    from orient_eye.registry import load

    return load(COMMANDS[name])


def _list_commands(arguments: list[str]) -> int:
    """The page of all commands, or what is wrong with arguments that begin with none of them; exits."""
    import operator
    from dataclasses import make_dataclass
    from typing import Annotated, Union

    import tyro

    members = []
    for name in COMMANDS:
        summary = (inspect.getdoc(_command(name)) or "").splitlines()[0]
        stands_for = make_dataclass(name, [])
        # Union and Annotated, made by program: a type checker reads neither from variables.
        members.append(operator.getitem(Annotated, (stands_for, tyro.conf.subcommand(name, description=summary))))
    page: Any = operator.getitem(Union, tuple(members))
    tyro.cli(page, prog="orient-eye", args=arguments, description=_DESCRIPTION)
    raise InputError(f"name a command first: {', '.join(COMMANDS)}")
