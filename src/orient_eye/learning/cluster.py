"""The runs of a sweep on a Ray cluster, or on a Ray of its own on this machine.

A run is a Ray task: Ray gives it to whoever has a core free, and one whose worker or machine is lost to another, where
it goes on from its checkpoint while the others are left alone. Ray ends the tasks of a process that is gone.

Not by `ray.util.joblib`: there a worker is given every n-th run, whether it is busy or not, so that others stand idle
(docs/decisions/0009-ray.md).
"""

import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from joblib import parallel_config
from joblib.parallel import ParallelBackendBase

from orient_eye.checks import shown
from orient_eye.errors import InputError
from orient_eye.files import write_text
from orient_eye.learning.engines import LOST, Crew, jobs_of
from orient_eye.learning.workers import MOST_LOST
from orient_eye.resources import cores

_INSTALL = 'Ray is not installed; pip install "orient-eye[cluster]"'
_HINT = "start one by `ray start --head`, or leave --address out for a Ray of its own on this machine (docs/sweep.md)"
_QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # nothing is sent
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",  # and no word about it
    "RAY_DEDUP_LOGS": "0",
}
_STORE = 100 * 2**20  # bytes of Ray's memory for objects, of which there are none
_LONGEST = 40  # characters of a temporary folder in which Ray's sockets have names that are short enough
_CLOSED_S, _SILENT_S = 5.0, 30.0  # until an address counts as one where nobody, or no Ray, answers
_SEEN_S = 60.0  # until a machine has answered, and what it wrote is seen here: a network's file system is slow
_RETRIES = 2 * MOST_LOST  # of workers: `perform` counts those that it has begun in, here are those lost before
_TOKEN = "token"
_MODE = "RAY_AUTH_MODE"


def on_ray(address: str | None = None) -> "OnRay":
    """The Ray cluster at an address, reached for.

    Args:
        address: "auto" for one that this machine is part of, HOST:PORT, or ray://HOST:PORT; None for one of its own.

    Raises:
        InputError: Ray is not installed, or no cluster answers there.
    """
    with _surroundings(None):
        try:
            import ray  # noqa: F401
        except ImportError:
            raise InputError(_INSTALL) from None
    if address is not None:
        _reach(address)
    return OnRay(address)


@dataclass(frozen=True)
class OnRay:
    """Workers are Ray's.

    Ray reads a password once a process: after a Ray of its own, a cluster that wants another password refuses this one.

    Attributes:
        address: of the cluster; None for one of its own.
    """

    address: str | None

    @contextmanager
    def crew(self, jobs: int | None, runs: int, board: Path) -> Iterator[Crew]:
        """As `Engine.crew`."""
        import ray

        with redirect_stdout(_Sieve(sys.stdout)), _connected(self.address):
            try:
                nodes = {node["NodeID"]: node for node in ray.nodes() if node["Alive"] and _cpus(node)}
                if not nodes:
                    raise InputError(f"the cluster at {self.address} has no core to work with; {_HINT}")
                cpus = [_cpus(node) for node in nodes.values()]
                jobs = min(jobs_of(jobs, sum(cpus)), runs)
                share = share_of(cpus, jobs)
                _check(nodes, board)
                with parallel_config(backend=_Tasks(share)):
                    yield Crew(jobs, share, parent=None)
            except (ray.exceptions.RayError, ConnectionError) as error:
                raise InputError(f"the Ray cluster failed: {_brief(error)}; the same command again goes on") from error


def share_of(cpus: Sequence[int], jobs: int) -> int:
    """Cores of each run: the most with which all fit at a time, each on one machine; one where they never do.

    Args:
        cpus: cores of each machine, (machines,).
        jobs: runs at a time.
    """
    return next((share for share in range(max(cpus), 1, -1) if sum(own // share for own in cpus) >= jobs), 1)


class _Tasks(ParallelBackendBase):  # type: ignore[misc]  # joblib has no types
    """joblib on Ray's tasks; of a task that has to be done again joblib does not hear."""

    supports_retrieve_callback = True

    def __init__(self, share: int) -> None:
        super().__init__(nesting_level=0)
        self.share = share

    def effective_n_jobs(self, n_jobs: int) -> int:
        return max(2, n_jobs)  # of one joblib thinks it may do it itself

    def configure(self, *arguments: Any, **more: Any) -> int:
        import ray

        self.task = ray.remote(num_cpus=self.share, max_retries=_RETRIES)(_call)
        return super().configure(*arguments, **more)

    def submit(self, func: Callable[[], Any], callback: Callable[[Any], object] | None = None) -> Any:
        future = self.task.remote(func).future()
        if callback is not None:
            future.add_done_callback(callback)
        return future

    def retrieve_result_callback(self, out: Any) -> Any:
        from ray.exceptions import NodeDiedError, WorkerCrashedError

        try:
            return out.result()
        except (NodeDiedError, WorkerCrashedError):  # once too often; the others go on
            return [LOST]


def _call(work: Callable[[], Any]) -> Any:
    return work()


class _Sieve:
    """A stream without what Ray's own threads print, of workers that were lost say; the rest goes on as it is."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        ray = threading.current_thread().name.startswith("ray_")
        return len(text) if ray else int(self.stream.write(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


@contextmanager
def _connected(address: str | None) -> Iterator[None]:
    """With a driver of Ray in this process, and a Ray of its own where no address is given."""
    import ray

    if ray.is_initialized():
        raise InputError("this process is at work with Ray already; ray.shutdown() first")
    own = None if address else _short_folder()
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        with _surroundings(own):
            try:
                ray.init(**_options(address, own))
            except (ConnectionError, RuntimeError, ValueError, OSError, TimeoutError) as error:
                raise InputError(f"no Ray at {address or 'this machine'}: {_brief(error)}; {_HINT}") from error
            finally:
                for number, handler in before.items():  # Ray has its own
                    signal.signal(number, handler)
        yield
    finally:
        ray.shutdown()
        if own is not None:
            shutil.rmtree(own, ignore_errors=True)


def _options(address: str | None, own: Path | None) -> dict[str, Any]:
    """Of ray.init."""
    quiet = {"logging_level": "CRITICAL", "log_to_driver": False}
    if address is not None:
        return {"address": address, **quiet}
    assert own is not None
    alone = {"address": "local", "num_cpus": cores(), "include_dashboard": False, "object_store_memory": _STORE}
    return {**alone, "_temp_dir": str(own / "ray"), **quiet}


@contextmanager
def _surroundings(own: Path | None) -> Iterator[None]:
    """Environment variables for Ray; of one of its own with a password that nobody else knows."""
    told = _QUIET if own is None else _QUIET | {"RAY_AUTH_TOKEN": _password()}
    before = {name: os.environ.get(name) for name in (*told, _MODE)}
    os.environ.update(told)
    if own is not None:
        os.environ.pop(_MODE, None)  # Ray then turns passwords on itself; told "token" after its import it does not
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@cache
def _password() -> str:
    """Of this process: Ray reads it once, and without one leaves one in the home folder."""
    return secrets.token_hex(32)


def _short_folder() -> Path:
    """A temporary folder, with a path that is short enough for sockets in it."""
    usual = tempfile.gettempdir()
    return Path(tempfile.mkdtemp(prefix="orient-eye-", dir=usual if len(usual) <= _LONGEST else "/tmp"))


_ASK = """
import sys, ray
try:
    ray.init(sys.argv[1], logging_level="CRITICAL", log_to_driver=False)
except Exception as error:
    sys.exit(f"{error}")
"""


def _reach(address: str) -> None:
    """Whether a cluster answers, asked by another process: Ray itself asks for minutes, and may end its process.

    Raises:
        InputError: none does.
    """
    told = re.fullmatch(r"(?:ray://)?\[?([^\[\]/\s]+)\]?:(\d{1,5})", address)
    if address != "auto":
        if told is None or not 0 < int(told[2]) < 2**16:
            raise InputError(
                f"{shown(address)} is no address of a Ray cluster; name auto, HOST:PORT or ray://HOST:PORT"
            )
        try:
            socket.create_connection((told[1], int(told[2])), timeout=_CLOSED_S).close()
        except (OSError, UnicodeError) as error:
            raise InputError(f"nobody answers at {address}: {error}; {_HINT}") from error
    try:
        with _surroundings(None):
            asked = subprocess.run(
                [sys.executable, "-c", _ASK, address], capture_output=True, timeout=_SILENT_S, check=False
            )
    except subprocess.TimeoutExpired:
        raise InputError(f"no Ray answers at {address}, within {_SILENT_S:g} s; {_HINT}") from None
    if asked.returncode:
        raise InputError(f"no Ray at {address}: {_brief(asked.stderr.decode(errors='replace'))}; {_HINT}")


def _check(nodes: Mapping[str, Mapping[str, Any]], board: Path) -> None:
    """That every machine has this version of us, and shares the folder.

    Raises:
        InputError: one has not, or does not.
    """
    import ray
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    ours, token = metadata.version("orient-eye"), secrets.token_hex(16)
    write_text(board / _TOKEN, token)
    asked = {
        ray.remote(num_cpus=0, max_retries=2)(_seen)
        .options(scheduling_strategy=NodeAffinitySchedulingStrategy(node, soft=False))
        .remote(board.absolute(), token, node): node
        for node in nodes
    }
    answered, silent = ray.wait(list(asked), num_returns=len(asked), timeout=_SEEN_S)
    for each in silent:
        raise InputError(f"{_name(nodes[asked[each]])} of the cluster does not answer; look there, or remove it")
    for each in answered:
        name, node = _name(nodes[asked[each]]), asked[each]
        try:
            version, seen = ray.get(each)
        except ray.exceptions.RayError as error:
            what = f'pip install "orient-eye[cluster]=={ours}" there'
            raise InputError(f"{name} of the cluster has no orient-eye that works: {_brief(error)}; {what}") from error
        if version != ours:
            raise InputError(f"{name} of the cluster has orient-eye {version}, here is {ours}; install the same")
        if not seen or not _patiently((board / node).exists):
            raise InputError(
                f"{name} of the cluster does not see {board.parent}; name a folder that all machines share, by --out"
            )


def _seen(board: Path, token: str, node: str) -> tuple[str, bool]:
    """On a machine of the cluster: its version of us, and whether it sees the folder, in which it leaves a sign."""

    def same() -> bool:
        with suppress(OSError):
            return (board / _TOKEN).read_text() == token
        return False

    seen = _patiently(same, _SEEN_S / 4) if board.parent.is_dir() else False
    if seen:
        (board / node).touch()
    return metadata.version("orient-eye"), seen


def _patiently(happens: Callable[[], bool], seconds: float = _SEEN_S) -> bool:
    patient = time.monotonic() + seconds
    while not happens():
        if time.monotonic() > patient:
            return False
        time.sleep(0.1)
    return True


def _cpus(node: Mapping[str, Any]) -> int:
    return int(node["Resources"].get("CPU", 0))


def _name(node: Mapping[str, Any]) -> str:
    return f"machine {node['NodeManagerHostname']} ({node['NodeManagerAddress']})"


def _brief(error: object) -> str:
    """The last line of what Ray says, which has the cause."""
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines() if line.strip()]
    return textwrap.shorten(lines[-1], 300, placeholder=" ...") if lines else type(error).__name__
