"""The runs of a sweep on processes of this machine."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from joblib import parallel_config
from joblib.externals.loky import get_reusable_executor

from orient_eye.errors import InputError
from orient_eye.learning.engines import Crew, jobs_of
from orient_eye.resources import cores


@dataclass(frozen=True)
class Processes:
    """Workers are processes of this machine (loky); one job is done in this process.

    Of a worker that is lost joblib gives up those beside it too.
    """

    @contextmanager
    def crew(self, jobs: int | None, runs: int, board: Path) -> Iterator[Crew]:
        """As `Engine.crew`."""
        jobs = min(jobs_of(jobs, cores()), runs)
        share = max(1, cores() // jobs)
        try:
            with parallel_config(backend="loky", inner_max_num_threads=share):
                yield Crew(jobs, share, parent=os.getpid(), here=jobs == 1)
        finally:
            if jobs > 1:
                get_reusable_executor().shutdown(wait=True, kill_workers=True)  # idle ones: what they did is written


def local(address: str | None = None) -> Processes:
    """This machine.

    Raises:
        InputError: an address, which it has not.
    """
    if address is not None:
        raise InputError(f"the address {address!r} is of a cluster, add --engine ray, or leave it out")
    return Processes()
