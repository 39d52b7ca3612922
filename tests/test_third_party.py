"""A stranger's package, built literally from CONTRIBUTING: every command knows its plant, pulse and case."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).parents[1] / "CONTRIBUTING.md"
Give = Callable[..., str]
Run = Callable[..., Any]

PROGRAM = """
import contextlib, io, json, sys
from orient_eye.cli import main

for line in sys.stdin:
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        try:
            main(json.loads(line))
        except SystemExit as end:
            code = end.code
    print(json.dumps([code, out.getvalue(), error.getvalue()]), flush=True)
"""


def blocks() -> dict[str, str]:
    """The files that the page shows, by name."""
    found = re.findall(r"^`([\w.]+)`:\n\n```\w+\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S)
    return dict(found)


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment variables of a process that has the package installed."""
    source, site = tmp_path_factory.mktemp("spring-eye"), tmp_path_factory.mktemp("site")
    for name, content in blocks().items():
        (source / name).write_text(content, encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*pip, "--target", str(site), str(source)], check=True, capture_output=True, timeout=120)
    return {**os.environ, "PYTHONPATH": str(site), "XDG_CACHE_HOME": str(tmp_path_factory.mktemp("cache"))}


@pytest.fixture(scope="module")
def give(environment: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Give]:
    """Gives command lines, one after another, to a process that has the package installed; returns what it prints."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path_factory.mktemp("work"), env=environment, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    ) as process:  # fmt: skip
        assert process.stdin
        assert process.stdout

        def given(*arguments: str) -> str:
            print(json.dumps(arguments), file=process.stdin, flush=True)
            code, out, error = json.loads(process.stdout.readline())
            assert not code, error
            return out

        yield given


@pytest.fixture
def run(give: Give) -> Run:
    """A command's result."""
    return lambda *arguments: json.loads(give(*arguments, "--json"))


def test_the_page_shows_the_whole_package() -> None:
    assert set(blocks()) == {"pyproject.toml", "spring_eye.py"}


@pytest.mark.parametrize("command", ["simulate", "sysid", "weights", "optimum", "train", "predict", "evaluate"])
def test_help_lists_it(command: str, give: Give) -> None:
    text = give(command, "--help")
    if command not in ("predict", "evaluate"):
        assert "spring" in text
    assert "--stiffness" in text
    if command in ("weights", "optimum", "train"):
        assert "bell" in text


def test_simulate_and_sysid(run: Run, tmp_path: Path) -> None:
    command = tmp_path / "command.csv"
    command.write_text("t_s,servo_deg\n0,0\n0.02,20\n0.5,10\n")
    result = run("simulate", "--plant", "spring", "--motor", str(command), "--horizon", "1")
    assert result["final_yaw_pitch_roll_deg"] == pytest.approx([10, 0, 0], abs=1e-3)
    # Two real poles, 19.1 and 130.9 1/s: the first-order fit comes near the slow one.
    result = run("sysid", "--plant", "spring", "--amplitudes", "5", "10", "20", "--out", "sysid")
    assert result["K"] == pytest.approx(1, abs=0.01)
    assert 14 < result["w0"] < 20
    assert result["models"]["second_order"]["wn"] == pytest.approx(50, rel=0.1)  # steps of 1 ms shift it


def test_weights_and_optimum(run: Run) -> None:
    result = run("weights", "--plant", "spring", "--case", "bell")
    (row,) = result["cases"]
    assert all(row[name] > 0 for name in ("accuracy", "duration", "overshoot"))
    result = run("optimum", "--plant", "spring", "--case", "bell", "--start", "0", "--target", "20", "--check")
    assert result["passed"]
    assert result["saccades"][0]["final_yaw_deg"] == pytest.approx(20, abs=0.6)
    # Stiffer, so another plant, with weights and optimum of its own.
    other = run(
        "optimum", "--plant", "spring", "--stiffness", "3500", "--case", "bell", "--start", "0", "--target", "20"
    )
    assert not other["remembered"]
    assert other["task"]["plant"]["stiffness"] == 3500


def test_train_predict_evaluate(run: Run) -> None:
    few = ("--updates", "30", "--saccades-per-update", "8", "--batch-size", "64", "--warmup", "64")
    run("train", "--plant", "spring", "--case", "bell", "--out", "run", "--evaluation-pairs", "2", *few)
    result = run("predict", "run", "--target", "20", "--command", "saccade.csv")
    assert result["plant"]["plant"] == "spring"
    assert not result["differs_from_training"]
    simulated = run("simulate", "--plant", "spring", "--motor", "saccade.csv", "--horizon", "1.5")
    expected = result["saccades"][0]["final_yaw_deg"]
    assert simulated["final_yaw_pitch_roll_deg"][0] == pytest.approx(expected, abs=0.05)
    result = run("evaluate", "run", "--pairs", "2")
    assert result["pairs"] == 2
    # Nothing of the plant is lost on the way through the policy's file.
    assert result["task"]["plant"] == {"plant": "spring", "stiffness": 2500.0, "damping": 150.0}
