"""The progress bar of everything that takes long, and the live picture of what is more than a bar.

    with progress_bar("searching the optimum", quiet=quiet) as advance:
        searched_optimum(task, start, target, progress=advance)

Bars that follow one another stand in blocks of their own.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console, RenderableType
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn


class Advance(Protocol):
    """Moves a bar."""

    def __call__(self, share: float, note: str = "") -> None:
        """Show the share of the work that is done, 0 to 1, and a note behind the bar."""
        ...


@contextmanager
def progress_bar(words: str, *, quiet: bool = False) -> Iterator[Advance]:
    """A bar on standard error that goes away when the block ends; none where that is no terminal, or if quiet.

    Args:
        words: what is being done.
        quiet: show nothing.
    """
    console = Console(stderr=True)
    fields = "{task.description}", "{task.percentage:>3.0f} %", "{task.fields[note]}"
    told, share, note = (TextColumn(field, markup=False) for field in fields)
    columns = told, BarColumn(), share, TimeRemainingColumn(), note
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as bar:
        job = bar.add_task(words, total=1.0, note="")

        def advance(share: float, note: str = "") -> None:
            bar.update(job, completed=share, note=note)

        yield advance


@contextmanager
def live(*, quiet: bool = False) -> Iterator[Callable[[RenderableType], None] | None]:
    """What shows a table on standard error, in place of the one before, until the block ends.

    None where that is no terminal, or if quiet.
    """
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield None
        return
    with Live(console=console, transient=True, auto_refresh=False) as screen:
        yield lambda what: screen.update(what, refresh=True)
