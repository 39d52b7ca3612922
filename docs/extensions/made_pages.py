"""Reference pages that are made at every build: a command's from its `--help`, a package's from its docstrings.

They stand in docs/reference/commands and docs/reference/python, which git ignores; a page whose command or package is
gone goes too. The pages docs/reference/commands.md and python.md get the lists of them.
"""

import ast
import inspect
import io
import os
import pkgutil
import re
import shutil
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from textwrap import dedent
from unittest import mock

from sphinx.application import Sphinx

import orient_eye
from orient_eye.cli import COMMANDS, main
from orient_eye.registry import load

_WIDTH = 92
"""Columns of a help page: as many as a line of the site has."""
_GROUP = re.compile(r"^ (\S.*?) *\n -{9,} *\n", re.MULTILINE)
"""Title and rule of a group of options."""
_ON_ITS_OWN = "small"
"""Name of the page of the modules that belong to no package."""
_INSIDE = {"cached", "checks", "cli", "figures", "progress", "resources", "run_directory", "tables", "words"}
"""Modules and packages that only this package itself has a use for; the command line has pages of its own."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("builder-inited", _make)
    app.connect("source-read", _list)
    return {"parallel_read_safe": True}


def _make(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "reference"
    _write(folder / "commands", dict(commands()))
    _write(folder / "python", dict(packages()))


def _list(app: Sphinx, name: str, source: list[str]) -> None:
    if name == "reference/commands":
        source[0] += _listed_commands()
    elif name == "reference/python":
        source[0] += f"\n```{{eval-rst}}\n{_listed_names()}```\n"
    else:
        return
    app.env.note_reread()  # what is listed may be other at the next build


def _write(folder: Path, pages: dict[str, str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        if old.name not in pages:
            shutil.rmtree(old) if old.is_dir() else old.unlink()
    for name, text in pages.items():
        page = folder / name
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def commands() -> Iterator[tuple[str, str]]:
    """Name and text of each command's page."""
    for name, place in COMMANDS.items():
        summary, _, rest = (inspect.getdoc(load(place)) or "").partition("\n")
        options = "".join(f"\n## {title.capitalize()}\n\n```text\n{told}\n```\n" for title, told in _options(name))
        yield f"{name}.md", f"# orient-eye {name}\n\n{summary}\n{_as_markdown(rest)}\n{options}"


def _listed_commands() -> str:
    summaries = {name: (inspect.getdoc(load(place)) or "").splitlines()[0] for name, place in COMMANDS.items()}
    rows = "".join(f"| [{name}](commands/{name}.md) | {summary} |\n" for name, summary in summaries.items())
    pages = "".join(f"commands/{name}\n" for name in COMMANDS)
    return f"\n| command | |\n|---|---|\n{rows}\n```{{toctree}}\n:hidden:\n\n{pages}```\n"


def _options(name: str) -> Iterator[tuple[str, str]]:
    """Title and text of each group of options on a command's help page.

    Raises:
        RuntimeError: the page has none, because it is written otherwise than this reads it.
    """
    with (
        mock.patch.dict(os.environ, {"COLUMNS": str(_WIDTH), "NO_COLOR": "1"}),
        redirect_stdout(io.StringIO()) as page,  # of no encoding, so that groups have no boxes around them
        suppress(SystemExit),
    ):
        main([name, "--help"])
    _, *parts = _GROUP.split(page.getvalue())
    if not parts:
        raise RuntimeError(f"orient-eye {name} --help has no options:\n{page.getvalue()}")
    for title, told in zip(parts[::2], parts[1::2], strict=True):
        lines = [line.strip() and line[1:].rstrip() for line in told.strip("\n").splitlines()]
        yield title, dedent("\n".join(line for line in lines if set(line.strip()) != {"-"})).strip("\n")


def _as_markdown(docstring: str) -> str:
    """A command's docstring: lines that begin with $ are command lines."""
    return re.sub(r"(?:^\$ .*\n*)+", lambda lines: _block(lines[0]), docstring, flags=re.MULTILINE)


def _block(lines: str) -> str:
    told = [line.removeprefix("$ ") for line in lines.splitlines() if line]
    return "\n```sh\n" + "\n".join(told) + "\n```\n\n"


def packages() -> Iterator[tuple[str, str]]:
    """Name and text of each package's page."""
    for page, names in modules():
        title = "Modules that stand alone" if page == _ON_ITS_OWN else f"orient_eye.{page}"
        parts = [_section(name, "=" if name == f"orient_eye.{page}" else "-") for name in names]
        yield f"{page}.rst", (f"{title}\n{'=' * len(title)}\n\n" if page == _ON_ITS_OWN else "") + "\n".join(parts)


def _listed_names() -> str:
    rows = "".join(f"   * - :py:obj:`{name} <{home}>`\n     - {words}\n" for name, home, words in public())
    pages = "".join(f"   python/{page}\n" for page, _ in modules())
    return (
        ".. automodule:: orient_eye\n   :no-members:\n\n"
        f".. list-table::\n\n{rows}\n.. toctree::\n   :hidden:\n\n{pages}"
    )


def _section(module: str, line: str) -> str:
    return f"{module}\n{line * len(module)}\n\n.. automodule:: {module}\n"


def modules() -> Iterator[tuple[str, list[str]]]:
    """Each package with its modules, and those that belong to none."""
    alone = []
    for found in pkgutil.iter_modules(orient_eye.__path__, "orient_eye."):
        name = found.name.removeprefix("orient_eye.")
        if name in _INSIDE or name.startswith("_"):
            continue
        if found.ispkg:
            inside = pkgutil.walk_packages(import_module(found.name).__path__, f"{found.name}.")
            yield name, [found.name, *sorted(module.name for module in inside)]
        else:
            alone.append(found.name)
    yield _ON_ITS_OWN, alone


def public() -> Iterator[tuple[str, str, str]]:
    """Of each name of `orient_eye`: the name, where it is described, and the first line that is said of it."""
    for name, home in sorted(homes().items(), key=lambda pair: pair[0].lower()):
        thing = getattr(orient_eye, name)
        module = home.removesuffix(f".{name}")
        words = inspect.getdoc(thing) if _has_docstring(thing) else _said_of(module, name)
        yield name, home, (words or "").split("\n\n")[0].replace("\n", " ")


def homes() -> dict[str, str]:
    """Each name of `orient_eye` to its full name in the module where it is described."""
    stub = ast.parse(Path(orient_eye.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    found = {}
    for node in stub.body:
        for name in node.names if isinstance(node, ast.ImportFrom) else ():
            thing = getattr(orient_eye, name.name)
            module = thing.__module__ if _has_docstring(thing) else f"orient_eye.{node.module}"
            found[name.name] = f"{module}.{name.name}"
    return found


def _has_docstring(thing: object) -> bool:
    return inspect.isclass(thing) or inspect.isroutine(thing)


def _said_of(module: str, name: str) -> str | None:
    """The docstring that follows an assignment in a module."""
    body = ast.parse(inspect.getsource(import_module(module))).body
    for node, following in pairwise(body):
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            value = getattr(following, "value", None)
            return str(value.value) if isinstance(value, ast.Constant) else None
    return None
