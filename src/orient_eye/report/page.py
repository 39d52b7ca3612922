"""The report as one HTML file that needs nothing else: pictures and scripts stand in it, no address leads out of it."""

import base64
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure

from orient_eye.files import write_atomically, write_text
from orient_eye.report.exhibit import Drawn, Exhibit

_STYLE: Any = {"svg.hashsalt": "orient-eye", "svg.fonttype": "path"}
"""The same figure gives the same bytes."""
_NO_METADATA: dict[str, Any] = {"Date": None, "Creator": None}
_PNG_SCALE = 2


@dataclass(frozen=True)
class Table:
    """A table of the page.

    Attributes:
        chapter: under which it stands.
        columns: headings.
        rows: cells as words.
        note: what it says.
    """

    chapter: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str


def svg_of(drawn: Drawn) -> bytes:
    """The figure as SVG."""
    if isinstance(drawn.figure, Figure):
        content = io.BytesIO()
        with rc_context(_STYLE):
            drawn.figure.savefig(content, format="svg", metadata=_NO_METADATA)
        return content.getvalue()
    import vl_convert

    return vl_convert.vegalite_to_svg(drawn.figure.to_dict()).encode()


def save_figure(drawn: Drawn, folder: Path, name: str) -> bytes:
    """Write NAME.svg and NAME.png; returns the SVG.

    Raises:
        InputError: they cannot be written.
    """
    svg = svg_of(drawn)
    write_atomically(folder / f"{name}.svg", lambda file: file.write_bytes(svg))
    if isinstance(drawn.figure, Figure):
        figure = drawn.figure
        write_atomically(folder / f"{name}.png", lambda file: figure.savefig(file, dpi=130))
    else:
        import vl_convert

        png = vl_convert.vegalite_to_png(drawn.figure.to_dict(), scale=_PNG_SCALE)
        write_atomically(folder / f"{name}.png", lambda file: file.write_bytes(png))
    return svg


def write_page(
    path: Path,
    shown: Mapping[str, tuple[Exhibit, Drawn, bytes]],
    tables: Sequence[Table],
    title: str,
    introduction: str,
    made: str,
) -> Path:
    """Write the page.

    Args:
        path: the HTML file.
        shown: id of each figure to what it is, what was drawn, and its SVG.
        tables: after the figures of their chapters.
        title: of the page.
        introduction: a paragraph below it.
        made: how and when the page was made.

    Raises:
        InputError: it cannot be written.
    """
    chapters = dict.fromkeys((*(exhibit.chapter for exhibit, _, _ in shown.values()), *(t.chapter for t in tables)))
    told = [
        {
            "title": chapter,
            "anchor": re.sub(r"\W+", "-", chapter.lower()).strip("-"),
            "figures": [_told(*item) for item in shown.items() if item[1][0].chapter == chapter],
            "table": next((table for table in tables if table.chapter == chapter), None),
        }
        for chapter in chapters
    ]
    interactive = any(not isinstance(drawn.figure, Figure) for _, drawn, _ in shown.values())
    template = jinja2.Environment(autoescape=True).from_string(
        (resources.files("orient_eye.report") / "page.html").read_text(encoding="utf-8")
    )
    page = template.render(
        title=title, introduction=introduction, chapters=told, made=made, script=_script() if interactive else ""
    )
    return write_text(path, page)


def _told(name: str, what: tuple[Exhibit, Drawn, bytes]) -> dict[str, Any]:
    exhibit, drawn, svg = what
    interactive = not isinstance(drawn.figure, Figure)
    spec = Markup(json.dumps(_spec(drawn)).replace("<", "\\u003c")) if interactive else None
    return {
        "id": name,
        "title": exhibit.title,
        "caption": exhibit.caption,
        "says": drawn.says,
        "svg": base64.b64encode(svg).decode(),
        "spec": spec,
    }


def _spec(drawn: Drawn) -> dict[str, Any]:
    """Of an Altair chart, without the address of its schema."""
    return {key: value for key, value in drawn.figure.to_dict().items() if key != "$schema"}


def _script() -> Markup:
    """Vega and Vega-Lite, which draw the interactive charts."""
    import vl_convert

    bundle = vl_convert.javascript_bundle()  # type: ignore[call-arg]  # without a snippet all of it, against its stub
    return Markup(bundle.replace("</script", "<\\/script"))
