"""A figure of the report: what it is called, what to see in it, and a function of the evidence that draws it.

    EXHIBITS = {"4.4": Exhibit("4 Commands", "Pulse of variant 1", "It rises ...", draw)}

`draw` gets the `Evidence` and returns a `Drawn`: a matplotlib Figure, or an Altair chart where looking closer helps,
and the number that sums it up.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from orient_eye.report.evidence import Evidence


@dataclass(frozen=True)
class Drawn:
    """A figure that was drawn.

    Attributes:
        figure: a matplotlib Figure or an Altair chart.
        says: the number that sums it up, a sentence.
    """

    figure: Any
    says: str


@dataclass(frozen=True)
class Exhibit:
    """A figure of the report.

    Attributes:
        chapter: heading under which it stands.
        title: what it shows, and of what.
        caption: what to see in it, and what is not human about it.
        draw: makes it.
    """

    chapter: str
    title: str
    caption: str
    draw: Callable[[Evidence], Drawn]
