"""The command line: one file a command, each a frozen dataclass that tyro turns into options.

A command's fields are its options, their docstrings the help, and `run()` does the work and returns
the result as a dictionary of plain values. No command imports another. What they share:

    options.py      plants, their options, cases, targets: made from the registries
    saccades.py     --start, --target and --pairs
    tables.py       words and tables for people, on standard error

With `--json` the result goes to standard output, and nothing else does. Heavy libraries are imported
inside `run`, so that `orient-eye --help` answers at once.
"""

import inspect
import json
import os
import sys
from collections.abc import Sequence
from typing import Any, Protocol

from orient_eye.errors import InputError

COMMANDS = {
    "simulate": "orient_eye.cli.simulate:Simulate",
    "view": "orient_eye.cli.view:View",
    "sysid": "orient_eye.cli.sysid:Sysid",
    "train": "orient_eye.cli.train:Train",
    "models": "orient_eye.cli.models:Models",
    "predict": "orient_eye.cli.predict:Predict",
    "check": "orient_eye.cli.check:Check",
    "evaluate": "orient_eye.cli.evaluate:Evaluate",
    "export": "orient_eye.cli.export:Export",
    "optimum": "orient_eye.cli.optimum:Optimum",
    "listing": "orient_eye.cli.listing:Listing",
    "weights": "orient_eye.cli.weights:Weights",
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
    """Entry point of `orient-eye`; exits with 2 on bad input, 130 when interrupted."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    as_json = "--json" in given
    try:
        code = _run([a for a in given if a != "--json"], as_json=as_json)
        sys.stdout.flush()
    except BrokenPipeError:  # whoever read our output, `head` say, has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    sys.exit(code)


def _run(arguments: list[str], *, as_json: bool) -> int:
    """Run a command line; returns the exit code."""
    from orient_eye.cli.tables import say

    if "--version" in arguments:
        from orient_eye import __version__

        print(__version__)
        return 0
    try:
        if not arguments or arguments[0] not in COMMANDS:
            return _list_commands(arguments)
        from orient_eye.cli.options import parse

        result = parse(_command(arguments[0]), arguments[1:], program=f"orient-eye {arguments[0]}").run()
    except InputError as error:
        say(f"error: {error}", style="red")
        if as_json:
            print(json.dumps({"error": str(error)}))
        return 2
    except KeyboardInterrupt:
        say("interrupted")
        return 130
    if as_json:
        from orient_eye.run_directory import plain

        # JSON has no NaN and no infinity.
        result = json.loads(json.dumps(result, default=plain), parse_constant=lambda _: None)
        print(json.dumps(result, indent=2))
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
