"""Docstrings are Google's style with Markdown inside, for people who read the source; Sphinx reads reStructuredText.

Napoleon turns Google's sections. This turns the rest, before it: headings, tables, indented examples, and backticks, of
which those around a name become a link where Sphinx knows the name.
"""

import ast
import re
from collections.abc import Iterator
from itertools import groupby
from operator import itemgetter
from typing import Any

from sphinx.application import Sphinx

from made_pages import homes

_SECTION = re.compile(r"(Args|Attributes|Raises|Returns|Yields):")
_CODE = re.compile(r"(`[^`]+`)")
_FILE = re.compile(r"\w+\.py {2,}\w")
_NAME = re.compile(r"[A-Za-z_][\w.]*")
_ARRAY = re.compile(r"~?(?:numpy\.)?ndarray\[tuple\[~?(?:typing\.)?Any, \.\.\.\], ~?(?:numpy\.)?dtype\[([^\[\]]+)\]\]")
_ARRAY_LIKE = re.compile(r"~?[\w.]*_Buffer \| .*?_NestedSequence\[~?complex \| ~?bytes \| ~?str\]")
_HOMES = homes()
_VALUES = ("attribute", "data", "property")
"""What Napoleon takes for "type: description", where its docstring has a colon."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    told: dict[str, list[str]] = {}

    def before(_: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
        lines[:] = converted(lines)
        told[name] = lines[:]

    def after(_: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
        if what in _VALUES:
            lines[:] = told[name]

    app.connect("autodoc-process-docstring", before, priority=400)  # Napoleon's is 500
    app.connect("autodoc-process-docstring", after, priority=600)
    app.connect("autodoc-process-signature", _short)
    return {"parallel_read_safe": True}


def _short(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """A signature with arrays as the source names them."""
    del app, what, name, thing, options
    texts = [text and _ARRAY_LIKE.sub("ArrayLike", _ARRAY.sub(r"NDArray[\1]", text)) for text in (signature, returned)]
    return texts[0], texts[1]


def converted(lines: list[str]) -> Iterator[str]:
    """Lines of reStructuredText, with Google's sections as they are."""
    for kind, group in groupby(_kinds(_indented(lines)), itemgetter(0)):
        told = [line for _, line in group]
        if kind == "table":
            yield from _table(told)
        elif kind == "block":
            yield from ("", "::", "", *told, "")
        elif kind == "heading":
            yield from ("", f".. rubric:: {told[0].removeprefix('## ')}", "")
        else:
            yield from _inline("\n".join(told)).split("\n")


def _indented(lines: list[str]) -> list[str]:
    """With examples indented that make up a docstring but for its first line: the formatter does not let them be."""
    paragraphs = [list(group) for _, group in groupby(lines, bool)]
    return [f"    {line}" if _is_example(paragraph) else line for paragraph in paragraphs for line in paragraph]


def _is_example(paragraph: list[str]) -> bool:
    """Lines of Python that call something, or a list of files."""
    if all(_FILE.match(line) for line in paragraph):
        return True
    try:
        return any(isinstance(node, ast.Call) for node in ast.walk(ast.parse("\n".join(paragraph))))
    except (SyntaxError, ValueError):
        return False


def _kinds(lines: list[str]) -> Iterator[tuple[str, str]]:
    """What each line is part of."""
    kind, section = "text", False
    for line in lines:
        if line.strip():
            section = bool(_SECTION.fullmatch(line.rstrip())) or (section and line.startswith(" "))
            if line.lstrip().startswith("|"):
                kind = "table"
            elif line.startswith("    ") and not section:
                kind = "block"
            elif line.startswith("## "):
                kind = "heading"
            else:
                kind = "text"
        elif kind != "block":
            kind = "text"
        yield kind, line


def _table(rows: list[str]) -> Iterator[str]:
    """A Markdown table as a list-table, where its first row stands."""
    indent = rows[0][: len(rows[0]) - len(rows[0].lstrip())]
    cells = [[cell.strip() for cell in row.strip().strip("|").split(" | ")] for row in rows]
    heads = int(any(cells[0]))
    yield from ("", f"{indent}.. list-table::", f"{indent}   :header-rows: {heads}", "")
    for row in cells[1 - heads :]:
        if not all(set(cell) <= set("-| ") and cell for cell in row):
            for i, cell in enumerate(row):
                yield f"{indent}   {'*' if i == 0 else ' '} - {_inline(cell)}"
    yield ""


def _inline(line: str) -> str:
    """Backticks as reStructuredText has them, and what would mean something to it alone escaped."""
    parts = _CODE.split(line)
    for i, part in enumerate(parts):
        if i % 2:
            name = part.strip("`")
            made = f":py:obj:`{name} <{_home(name)}>`" if _NAME.fullmatch(name) else f"`{part}`"
            joined = "\\ " if parts[i + 1][:1].isalnum() else ""
            before = "\\ " if parts[i - 1][-1:].isalnum() or parts[i - 1][-1:] in ("-", "=") else ""
            parts[i] = before + made + joined
        else:
            parts[i] = re.sub(r"([*|]|(?<=\w)_(?!\w))", r"\\\1", part)
    return "".join(parts)


def _home(name: str) -> str:
    """Where a name is described: one of `orient_eye`'s own, or something of such."""
    first, dot, rest = name.partition(".")
    return f"{_HOMES.get(first, first)}{dot}{rest}"
