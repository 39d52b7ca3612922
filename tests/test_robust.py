"""Robust training: a run that was killed and resumed draws the same eyes, and ends in the same numbers."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy

from conftest import without_pictures
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.training import resume, train
from orient_eye.surrogate import Surrogate

RIG = Surrogate(
    1.9, wn=12.0, zeta=0.9, dead_time=0.008, motor="servo", axis="pitch", range=(-60, 60), speed_limit=350.0,
    intervals={"K": (1.8, 2.0), "wn": (10.5, 13.5), "zeta": (0.75, 1.05), "dead_time": (0.002, 0.014)},
)  # fmt: skip
TINY: dict[str, Any] = {
    "weights": (1e7, 1.0, 1e4, 1e5),
    **{"updates": 80, "saccades_per_update": 8, "warmup": 64, "batch_size": 64, "evaluation_pairs": 3},
}
PROGRAM = """
import ast
import sys
from pathlib import Path
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.training import Interrupted, train
config = TrainConfig(**ast.literal_eval(sys.argv[2]))
try:
    train(config, Path(sys.argv[1]), quiet=True, checkpoint_s=0.05)
except Interrupted as stopped:
    sys.exit(stopped.code)
"""


pytestmark = pytest.mark.usefixtures("private_cache")


@pytest.fixture(autouse=True, scope="module")
def plain() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        without_pictures(patch)
        yield


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    surrogate = RIG.save(tmp_path_factory.mktemp("rig") / "surrogate.json")
    return {"plant_options": {"surrogate": str(surrogate)}, "robust": True, **TINY}


@pytest.fixture(scope="module")
def whole(config: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was never stopped."""
    folder = tmp_path_factory.mktemp("whole") / "run"
    train(TrainConfig(**config), folder, quiet=True)
    return folder


def networks(folder: Path) -> dict[str, np.ndarray]:
    return safetensors.numpy.load_file(folder / "policy.safetensors")


def metrics(folder: Path) -> list[list[str]]:
    """Rows of metrics.csv without the wall clock."""
    rows = [line.split(",") for line in (folder / "metrics.csv").read_text().splitlines()]
    clock = rows[0].index("elapsed_s")
    return [row[:clock] + row[clock + 1 :] for row in rows]


@pytest.mark.parametrize(("how", "code"), [(signal.SIGKILL, -9), (signal.SIGTERM, 143)])
def test_killed_and_resumed_is_the_run_never_stopped(
    how: signal.Signals, code: int, whole: Path, config: dict[str, Any], tmp_path: Path
) -> None:
    stopped = tmp_path / "run"
    command = [sys.executable, "-c", PROGRAM, str(stopped), repr(config)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not (stopped / "checkpoint.safetensors").exists() and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(how)
    assert process.wait(60) == code
    assert not (stopped / "result.json").exists()
    resume(stopped, quiet=True)
    assert json.loads((stopped / "run.json").read_text())["config"]["robust"]["K"] == [1.8, 2.0]
    for name, array in networks(whole).items():
        np.testing.assert_array_equal(networks(stopped)[name], array)
    assert metrics(stopped) == metrics(whole)
    costs = [json.loads((folder / "result.json").read_text())["robust"] for folder in (stopped, whole)]
    assert costs[0] == costs[1]


def test_the_eyes_that_are_drawn_matter(whole: Path, config: dict[str, Any], tmp_path: Path) -> None:
    """So the runs above are not the same because nothing was drawn."""
    folder = tmp_path / "plain"
    train(TrainConfig(**{**config, "robust": False}), folder, quiet=True)
    assert not np.array_equal(networks(folder)["weight0"], networks(whole)["weight0"])
    assert "robust" not in json.loads((folder / "result.json").read_text())
