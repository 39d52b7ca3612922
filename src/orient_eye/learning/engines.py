"""Where the runs of a sweep are carried out: on this machine, or on a cluster.

    engine = ENGINES["ray"]("head:6379")             # reaches for the cluster
    with engine.crew(jobs=None, runs=20, board=folder) as crew:
        joblib.Parallel(crew.jobs, ...)              # on the engine's backend of joblib

An engine is a joblib backend with what belongs to it: how many runs at a time, how many cores each, who ends workers
whose sweep is gone. Everything else of a sweep is the same on all of them.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from orient_eye.checks import whole
from orient_eye.registry import Registry

LOST = "lost"
"""What an engine has for a run that it handed out again and again, and each worker was lost."""
_MOST_JOBS = 1024


@dataclass(frozen=True)
class Crew:
    """The workers of a sweep.

    Attributes:
        jobs: runs at a time.
        share: cores of each run.
        parent: process whose children the workers are, and which they do not outlive; None where the engine itself ends
            the workers of a process that is gone.
        here: the runs are carried out by this process, one after the other.
    """

    jobs: int
    share: int
    parent: int | None
    here: bool = False


class Engine(Protocol):
    """Where runs are carried out."""

    def crew(self, jobs: int | None, runs: int, board: Path) -> AbstractContextManager[Crew]:
        """Workers, for as long as the block lasts; in it `joblib.Parallel` hands work to them.

        A run whose worker is lost is handed out again, by the engine itself or, where it cannot, after
        `BrokenProcessPool`; if the engine gives it up, its result is `LOST`.

        Args:
            jobs: runs at a time; None for what the engine has cores for.
            runs: that there are.
            board: folder in which workers and the one who waits leave word for each other.

        Raises:
            InputError: there are no such workers, or they do not see the folder.
        """
        ...


ENGINES: Registry[Callable[[str | None], Engine]] = Registry(
    "engine",
    {"local": "orient_eye.learning.processes:local", "ray": "orient_eye.learning.cluster:on_ray"},
)
"""Name to what makes the engine of an address (None for none); it raises InputError where there is none."""


def jobs_of(jobs: int | None, cores: int) -> int:
    """The number of runs at a time; one for each core where none is given.

    Raises:
        InputError: it is none.
    """
    return whole("the number of runs at a time", min(cores, _MOST_JOBS) if jobs is None else jobs, 1, _MOST_JOBS)
