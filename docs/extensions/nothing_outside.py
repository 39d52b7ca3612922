"""A page of the site loads nothing from elsewhere: no font, script or picture. One that does is a warning."""

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util.logging import getLogger

_OUTSIDE = re.compile(r"(?:https?:)?//", re.IGNORECASE)
_IN_STYLES = re.compile(r"""(?:url\(|@import)\s*["']?((?:https?:)?//[^"')\s]+)""", re.IGNORECASE)
_FOLLOWED = {"a", "area", "form"}
"""Elements whose addresses are visited only when somebody wants to."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True}


def _check(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html":
        for file in sorted(path for path in Path(app.outdir).rglob("*") if path.suffix in (".html", ".css", ".svg")):
            for address in loaded(file.read_text(encoding="utf-8"), style=file.suffix == ".css"):
                getLogger(__name__).warning("%s loads %s", file.relative_to(app.outdir), address)


def loaded(text: str, *, style: bool = False) -> list[str]:
    """Addresses outside the site from which a browser would load something, of a page or a style sheet."""
    if style:
        return _IN_STYLES.findall(text)
    page = _Page()
    page.feed(text)
    return page.found


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self._styles = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._styles = tag == "style"
        self.found += _IN_STYLES.findall(dict(attrs).get("style") or "")
        if tag not in _FOLLOWED and not (tag == "link" and ("rel", "canonical") in attrs):
            self.found += self._addresses(attrs)

    def handle_data(self, data: str) -> None:
        if self._styles:
            self.found += _IN_STYLES.findall(data)

    def _addresses(self, attrs: list[tuple[str, str | None]]) -> Iterator[str]:
        for name, value in attrs:
            given = (value or "").split(",") if name == "srcset" else [value or ""]
            if name in ("src", "srcset", "href", "xlink:href", "data", "poster"):
                yield from (each.strip() for each in given if _OUTSIDE.match(each.strip()))
