"""Pages that stand outside docs, where GitHub looks for them, are part of the site too; links lead where they do there.

They are copied to docs/elsewhere, which git ignores. In every page a link to one of them, to a folder that has a
README, or from one of them, is turned to where that is on the site. A README has the pages below it as chapters.
"""

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
_COPIES = "docs/elsewhere"
_COPIED = ("CONTRIBUTING.md", "CHANGELOG.md", "models/README.md", "models/policies/**/*.md")
_LINK = re.compile(r"(?<=\]\()(?!\w+:|#)([^()\s#]+)")


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("builder-inited", _copy, priority=400)
    app.connect("source-read", _turn)
    return {"parallel_read_safe": True}


def copied() -> list[str]:
    """Paths of the pages outside docs, from the top."""
    return sorted(path.relative_to(ROOT).as_posix() for pattern in _COPIED for path in ROOT.glob(pattern))


def _copy(app: Sphinx) -> None:
    del app
    wanted = {ROOT / _COPIES / path: (ROOT / path).read_text(encoding="utf-8") for path in copied()}
    for old in [path for path in (ROOT / _COPIES).rglob("*.md") if path not in wanted]:
        old.unlink()
    for page, text in wanted.items():
        page.parent.mkdir(parents=True, exist_ok=True)
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def _turn(app: Sphinx, name: str, source: list[str]) -> None:
    page = Path(app.env.doc2path(name)).relative_to(ROOT).as_posix()
    if page.endswith(".md"):
        source[0] = _LINK.sub(lambda link: on_site(page, link[1]), source[0])
    if page.endswith("/README.md"):
        app.env.note_reread()  # there may be others at the next build
        folder = (ROOT / page).parent
        below = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.md"))
        chapters = "\n".join(path.removesuffix(".md") for path in below if path != "README.md")
        source[0] += f"\n```{{toctree}}\n:hidden:\n\n{chapters}\n```\n" if chapters else ""


def on_site(page: str, link: str) -> str:
    """Where a link leads on the site, from a page of it.

    Args:
        page: path from the top, of the copy where it is one.
        link: as it stands in the page.
    """
    home = page.removeprefix(f"{_COPIES}/")
    target = os.path.normpath(os.path.join(os.path.dirname(home), link))
    if target == "README.md":
        target = "docs/index.md"
    if (ROOT / target / "README.md").is_file():
        target = f"{target}/README.md"
    if target in copied():
        target = f"{_COPIES}/{target}"
    return os.path.relpath(target, os.path.dirname(page))
