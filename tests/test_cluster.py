"""Sweeps on Ray: a cluster of two machines on this one, workers and commands killed, addresses where nobody is."""

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.learning import cluster as ours
from orient_eye.learning import sweep as sweeps
from orient_eye.learning.cluster import OnRay, on_ray
from orient_eye.learning.sweep import Sweep
from orient_eye.learning.sweep_results import RunState
from orient_eye.learning.training import Interrupted
from orient_eye.learning.workers import MOST_LOST, Board, perform
from test_checkpoint import assert_same
from test_sweep import alone, quickly, runs_of  # noqa: F401  (fixtures)

pytest.importorskip("ray")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are looked for in /proc")


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """Two machines with a core each; the address."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {**ours._QUIET, "RAY_AUTH_MODE": "disabled"}.items():
            patch.setenv(name, value)
        from ray.cluster_utils import Cluster

        folder, memory = ours._short_folder(), 8 * 10**7
        head = {"num_cpus": 1, "include_dashboard": False, "object_store_memory": memory}
        patch.setenv("RAY_TMPDIR", str(folder))
        machines = Cluster(head_node_args=head)
        try:
            machines.add_node(num_cpus=1, object_store_memory=memory)
            yield machines.address
        finally:
            machines.shutdown()
            shutil.rmtree(folder)


def noting(work: Callable[..., None], killed: str = "") -> Callable[..., None]:
    """Every worker leaves its number, in `RUN.pids` beside the run; the first of one run is killed at a checkpoint."""

    def perform(run: str, config: Any, out: Path, *given: Any) -> None:
        from orient_eye.learning import loop

        file = out.parent / f"{run}.pids"
        saved, first = loop.save_checkpoint, not file.exists()

        def save_and_die(*arguments: Any) -> None:
            saved(*arguments)
            os.kill(os.getpid(), signal.SIGKILL)

        with file.open("a") as told:
            told.write(f"{os.getpid()}\n")
        if run == killed and first:
            loop.save_checkpoint = save_and_die
        work(run, config, out, *given)

    return perform


def pids(folder: Path, run: str) -> list[int]:
    file = folder / f"{run}.pids"
    return [int(line) for line in file.read_text().split()] if file.exists() else []


def is_there(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until(happens: Callable[[], bool], seconds: float = 120) -> None:
    patient = time.monotonic() + seconds
    while not happens():
        assert time.monotonic() < patient, "it never happened"
        time.sleep(0.02)


# --- workers --------------------------------------------------------------------------------------


def test_a_run_lost_with_its_worker_goes_on_in_another(
    cluster: str,
    quickly: None,  # noqa: F811
    alone: Mapping[int, Path],  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """From its checkpoint, to the numbers of `train`; the one beside it notices nothing."""
    folder = tmp_path / "out"
    sweep = Sweep.begin(runs_of(updates=(240,), seed=(0, 1)), folder)
    monkeypatch.setattr(sweeps, "perform", noting(sweeps.perform, killed="seed0"))
    states: list[list[RunState]] = []
    result = sweep.carry_out(engine=on_ray(cluster), checkpoint_s=0.2, show=states.append)
    assert capfd.readouterr().out == ""
    assert (result["done"], result["passed"]) == (2, True)
    assert [len(pids(folder, f"seed{seed}")) for seed in (0, 1)] == [2, 1]
    assert len({*pids(folder, "seed0"), os.getpid()}) == 3
    assert "resumed" in json.loads((folder / "seed0" / "run.json").read_text())
    assert any(state.state == "running" and state.update for told in states for state in told)
    for seed, one in alone.items():
        assert_same(folder / f"seed{seed}", one)
    assert not (folder / ".board").exists()


@pytest.mark.parametrize(
    ("cpus", "jobs", "share"),
    [
        ((5, 5), 3, 2),  # of 3 each only two would fit
        ((5, 5), 2, 5),
        ((5, 5), 4, 2),
        ((5, 5), 5, 1),
        ((5, 5), 10, 1),
        ((5, 5), 11, 1),  # one waits
        ((5, 5), 1, 5),
        ((1, 64), 8, 8),
        ((1, 64), 9, 7),
        ((3, 7, 16), 4, 5),
        ((1, 1), 1, 1),
    ],
)
def test_runs_share_the_cores_so_that_all_fit(cpus: tuple[int, ...], jobs: int, share: int) -> None:
    assert ours.share_of(cpus, jobs) == share


def test_no_larger_share_would_fit() -> None:
    """Against runs put on machines one by one."""
    random = np.random.default_rng(0)

    def fit(cpus: list[int], jobs: int, share: int) -> bool:
        left = list(cpus)
        for _ in range(jobs):
            i = max(range(len(left)), key=left.__getitem__)
            left[i] -= share
            if left[i] < 0:
                return False
        return True

    for _ in range(200):
        cpus = random.integers(1, 20, random.integers(1, 6)).tolist()
        jobs = int(random.integers(1, sum(cpus) + 1))
        share = ours.share_of(cpus, jobs)
        assert fit(cpus, jobs, share)
        assert not any(fit(cpus, jobs, more) for more in range(share + 1, 21))


def test_a_run_that_always_loses_its_worker_fails(tmp_path: Path) -> None:
    """Counted on the board, wherever its workers are."""
    board = Board(tmp_path, None)
    for lost in range(MOST_LOST):
        assert board.told("run")["lost"] == max(lost - 1, 0)
        board.tell("run", "running", lost=lost)
    board.tell("run", "running", lost=MOST_LOST - 1)
    perform("run", Any, tmp_path / "run", board, 20.0, 1)
    assert board.told("run")["state"] == "failed"
    assert f"killed {MOST_LOST} times" in board.told("run")["why"]
    assert not (tmp_path / "run").exists()


def test_a_run_whose_workers_die_before_they_begin_fails(
    cluster: str,
    quickly: None,  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Handed out so many times and no more; the other runs are done."""
    work = noting(sweeps.perform)

    def perform(run: str, config: Any, out: Path, *given: Any) -> None:
        if run == "seed0":
            with (out.parent / f"{run}.pids").open("a") as told:
                told.write(f"{os.getpid()}\n")
            os.kill(os.getpid(), signal.SIGKILL)
        work(run, config, out, *given)

    monkeypatch.setattr(sweeps, "perform", perform)
    monkeypatch.setattr(ours, "_RETRIES", 2)
    folder = tmp_path / "out"
    result = Sweep.begin(runs_of(seed=(0, 1)), folder).carry_out(engine=OnRay(cluster))
    assert list(result["failed"]) == ["seed0"]
    assert "killed again and again" in result["failed"]["seed0"]
    assert result["done"] == 1
    assert len(pids(folder, "seed0")) == 3


def test_a_machine_that_came_later_and_does_not_see_the_folder(tmp_path: Path) -> None:
    """It must not look as if the sweep were over."""
    with pytest.raises(InputError, match=f"of the cluster does not see {tmp_path / 'out'}"):
        perform("run", Any, tmp_path / "out" / "run", Board(tmp_path / "out" / ".board", None), 20.0, 1)


def drive(folder: str, address: str | None) -> None:
    """What a process that is to be killed does: go on with a sweep."""
    from test_sweep import quick

    sweeps.perform = noting(quick())  # type: ignore[assignment]
    try:
        Sweep.open(Path(folder)).carry_out(engine=on_ray(address), checkpoint_s=0.2)
    except Interrupted as stopped:
        sys.exit(stopped.code)


@contextlib.contextmanager
def driven(folder: Path, address: str | None, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of its own session that goes on with a sweep."""
    kept = (
        {name: value for name, value in os.environ.items() if name != "RAY_AUTH_MODE"}
        if address is None
        else os.environ
    )
    program = f"import test_cluster; test_cluster.drive({str(folder)!r}, {address!r})"
    process = subprocess.Popen(
        [sys.executable, "-c", program], cwd=Path(__file__).parent, env={**kept, **environment},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def test_ctrl_c_leaves_checkpoints_and_no_process(
    quickly: None,  # noqa: F811
    tmp_path: Path,
) -> None:
    """On a Ray of its own, sent to everyone at the terminal."""
    folder, temporary = tmp_path / "out", Path(f"/tmp/{os.getpid()}")
    temporary.mkdir()
    try:
        Sweep.begin(runs_of(updates=(10**5,)), folder)
        with driven(folder, None, TMPDIR=str(temporary), HOME=str(tmp_path)) as process:
            metrics = folder / "usual" / "metrics.csv"
            wait_until(lambda: metrics.exists() or process.poll() is not None)
            os.killpg(process.pid, signal.SIGINT)
            said = process.communicate(timeout=120)[0].decode()
        assert process.returncode == 130, said
        assert said == ""
        assert (folder / "usual" / "checkpoint.safetensors").exists()
        assert not (folder / ".board").exists()
        wait_until(lambda: not any(map(is_there, pids(folder, "usual"))))
        assert not list(temporary.glob("orient-eye-*"))
        assert not (tmp_path / ".ray").exists()
    finally:
        subprocess.run(["rm", "-r", str(temporary)], check=True)


def test_killed_itself_it_is_taken_up_again(
    cluster: str,
    quickly: None,  # noqa: F811
    alone: Mapping[int, Path],  # noqa: F811
    tmp_path: Path,
) -> None:
    """Ray ends the run of a process that is gone; the sweep goes on without Ray."""
    folder = tmp_path / "out"
    sweep = Sweep.begin(runs_of(updates=(240,), seed=(0,)), folder)
    with driven(folder, cluster) as process:
        wait_until((folder / "usual" / "checkpoint.safetensors").exists)
        process.kill()
        process.wait()
        (worker,) = pids(folder, "usual")
        wait_until(lambda: not is_there(worker))
    if not (folder / "usual" / "result.json").exists():  # the run may have been quicker
        assert sweep.carry_out(jobs=1)["passed"]
    assert_same(folder / "usual", alone[0])


STRANGER = """
import sys, ray
ray.init(sys.argv[1], logging_level="CRITICAL", log_to_driver=False)
sys.exit(ray.get(ray.remote(lambda: 42).remote()))
"""
OWNER = f"""
import os, subprocess, sys
from orient_eye.learning import cluster
cluster.on_ray(None)
with cluster._connected(None):
    import ray
    address = ray.get_runtime_context().gcs_address
    for told in ({{}}, {{"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": cluster._password()}}):
        environment = {{**os.environ, "RAY_NUM_REDIS_GET_RETRIES": "2", **told}}
        print(subprocess.run([sys.executable, "-c", {STRANGER!r}, address], env=environment).returncode)
"""


def test_a_ray_of_its_own_is_nobody_elses(tmp_path: Path) -> None:
    """Whatever the environment says of passwords and clusters; who knows the password gets in."""
    told = {"RAY_AUTH_MODE": "disabled", "RAY_ADDRESS": "127.0.0.1:1", "HOME": str(tmp_path), **ours._QUIET}
    owner = subprocess.run(
        [sys.executable, "-c", OWNER], env={**os.environ, **told}, capture_output=True, timeout=120, check=True
    )
    assert owner.stdout.split() == [b"1", b"42"], owner.stderr.decode()


# --- what cannot be -------------------------------------------------------------------------------


def refused(capsys: pytest.CaptureFixture[str], tmp_path: Path, *words: str) -> str:
    """What a command says that it refuses, in the words of --json; it begins nothing."""
    with pytest.raises(SystemExit) as ended:
        main(["sweep", "--seed", "0", "1", "--out", str(tmp_path / "out"), "--json", *words])
    assert ended.value.code == 2
    assert not (tmp_path / "out").exists()
    return str(json.loads(capsys.readouterr().out)["error"])


def test_an_address_where_nobody_is(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    began = time.monotonic()
    for address in (f"127.0.0.1:{port}", f"ray://127.0.0.1:{port}"):
        said = refused(capsys, tmp_path, "--engine", "ray", "--address", address)
        assert f"nobody answers at {address}" in said
        assert "ray start --head" in said
    assert time.monotonic() - began < 60
    for address in ("head", "head:0", "head:99999", "ray://", "a b:1", ""):
        assert "is no address of a Ray cluster" in refused(capsys, tmp_path, "--engine", "ray", "--address", address)
    assert "add --engine ray" in refused(capsys, tmp_path, "--address", "127.0.0.1:6379")


def test_an_address_of_something_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ours, "_SILENT_S", 4.0)
    with socket.create_server(("127.0.0.1", 0)) as other, pytest.raises(InputError, match="no Ray answers at"):
        on_ray(f"127.0.0.1:{other.getsockname()[1]}")


def test_without_ray(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    assert 'pip install "orient-eye[cluster]"' in refused(capsys, tmp_path, "--engine", "ray")


def test_a_machine_that_sees_another_folder_or_has_another_version(cluster: str, tmp_path: Path) -> None:
    """Nothing is begun."""
    folder = tmp_path / "out"
    sweep = Sweep.begin(runs_of(seed=(0, 1)), folder)

    def elsewhere(board: Path, token: str, node: str) -> tuple[str, bool]:
        return ours._seen(Path("/nonexistent") / board.relative_to("/"), token, node)

    def older(*_: Any) -> tuple[str, bool]:
        return "0.0.1", True

    def without(*_: Any) -> tuple[str, bool]:
        raise ModuleNotFoundError("No module named 'orient_eye'")

    for seen, message in (
        (elsewhere, f"does not see {folder}; name a folder that all machines share"),
        (older, r"has orient-eye 0\.0\.1, here is .*; install the same"),
        (without, r"has no orient-eye that works: .*No module named 'orient_eye'"),
    ):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(ours, "_seen", seen)
            with pytest.raises(InputError, match=message):
                sweep.carry_out(engine=OnRay(cluster))
        assert [file.name for file in folder.iterdir()] == ["sweep.json"]
