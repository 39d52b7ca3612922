"""A stranger's packages, built literally from docs/howto: every command knows what they add."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

PAGES = Path(__file__).parents[1] / "docs" / "howto"
MODULES = {"plant": "spring_eye.py", "pulse": "bell_pulse.py", "eye": "weak_eye.py", "reward": "calm_judge.py"}
FEW = (
    "--updates",
    "30",
    "--saccades-per-update",
    "8",
    "--batch-size",
    "64",
    "--warmup",
    "64",
    "--evaluation-pairs",
    "2",
)
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


def read(page: str) -> str:
    """The text of a page of docs/howto."""
    return (PAGES / f"{page}.md").read_text(encoding="utf-8")


def blocks(page: str) -> dict[str, str]:
    """The files that a page shows, by name."""
    return dict(re.findall(r"^`([\w.]+)`:\n\n```\w+\n(.*?)^```$", read(page), re.M | re.S))


def unnamed(page: str) -> list[str]:
    """The Python that a page shows, which is no file."""
    return re.findall(r"(?<!`:\n\n)^```python\n(.*?)^```$", read(page), re.M | re.S)


def lines(page: str, name: str) -> list[list[str]]:
    """The words of the page's command lines `orient-eye name ...`, without orient-eye and comments."""
    found = re.findall(rf"^ *orient-eye ({name} [^#\n]*)", read(page), re.M)
    return [line.split() for line in found]


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment variables of a process that has the packages installed."""
    sources, site = tmp_path_factory.mktemp("packages"), tmp_path_factory.mktemp("site")
    for page in MODULES:
        (sources / page).mkdir()
        for name, content in blocks(page).items():
            (sources / page / name).write_text(content, encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    packages = [str(sources / page) for page in MODULES]
    subprocess.run([*pip, "--target", str(site), *packages], check=True, capture_output=True, timeout=120)
    return {**os.environ, "PYTHONPATH": str(site), "XDG_CACHE_HOME": str(tmp_path_factory.mktemp("cache"))}


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which they are used."""
    return tmp_path_factory.mktemp("work")


@pytest.fixture(scope="module")
def give(environment: dict[str, str], work: Path) -> Iterator[Give]:
    """Gives command lines, one after another, to a process that has the packages installed; returns what it prints."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], cwd=work, env=environment, text=True,
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


@pytest.fixture
def as_shown(run: Run, work: Path) -> Callable[[str, str], list[dict[str, Any]]]:
    """The results of a page's command lines of one kind, given literally, but for a training's length."""

    def results(page: str, name: str) -> list[dict[str, Any]]:
        found = lines(page, name)
        assert found
        return [run(*words, *(FEW if name == "train" else ())) for words in found]

    for table, content in re.findall(r"^cat > (\w+\.csv) <<'END'\n(.*?)^END$", read("eye"), re.M | re.S):
        (work / table).write_text(content, encoding="utf-8")
    return results


@pytest.mark.parametrize("page", MODULES)
def test_a_page_shows_the_whole_package(page: str) -> None:
    assert set(blocks(page)) == {"pyproject.toml", MODULES[page]}


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
    run("train", "--plant", "spring", "--case", "bell", "--out", "run", *FEW)
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


def test_a_weak_eye(
    run: Run, as_shown: Callable[[str, str], list[dict[str, Any]]], environment: dict[str, str], work: Path
) -> None:
    program = work / "weak_eye.py"
    program.write_text(blocks("eye")["weak_eye.py"], encoding="utf-8")
    subprocess.run([sys.executable, program.name], cwd=work, env=environment, check=True, timeout=60)
    (moved,) = as_shown("eye", "simulate")
    ours = run("simulate", "--motor", "command.csv", "--horizon", "1")
    yaw = [result["final_yaw_pitch_roll_deg"][0] for result in (moved, ours)]
    assert yaw[0] < yaw[1] - 10  # it hangs to the right, away from its weak muscle
    from_file, by_name = as_shown("eye", "listing")
    assert from_file["motors"] == pytest.approx(by_name["motors"], abs=1e-6)
    # The rest, by hand: both elastics are stretched from the arm to the eye, and their torques about z are equal.
    assert from_file["motors"]["motor2"] == pytest.approx(_straight_ahead_deg(), abs=0.01)


def _straight_ahead_deg() -> float:
    """Angle of motor 2 at which the weak elastic and the other hold the eye straight ahead, by their geometry alone."""
    insertion, arm, behind, rest = np.array([0.007, 0.07498]), 0.14, 0.323, 0.24  # m, of eye3.xml

    def torque(angle: float) -> float:
        total = 0.0
        for side, stiffness in ((1, 12.5), (-1, 25.0)):
            eye = insertion * (1, side)
            end = np.array([-behind - side * arm * np.sin(angle), side * arm * np.cos(angle)])
            way = end - eye
            length = float(np.hypot(*way))
            fx, fy = stiffness * (length - rest) * way / length
            total += float(eye[0] * fy - eye[1] * fx)
        return total

    return float(np.rad2deg(brentq(torque, -0.7, 0.7)))


def test_a_calm_judge(as_shown: Callable[[str, str], list[dict[str, Any]]]) -> None:
    usual, patient, none, calm = (found["saccades"][0] for found in as_shown("reward", "optimum"))
    assert patient["duration_ms"] > 1.1 * usual["duration_ms"]
    assert none["peak_velocity_deg_s"] == pytest.approx(usual["peak_velocity_deg_s"], rel=0.01)
    assert calm["peak_velocity_deg_s"] < 0.9 * usual["peak_velocity_deg_s"]
    assert calm["reward_speed"] == pytest.approx(-2000 * (calm["peak_velocity_deg_s"] / 100) ** 2)


def test_the_reward_in_python() -> None:
    known: dict[str, Any] = {}
    for block in unnamed("reward"):
        exec(block, known)
    env = known["Quick"](known["env"])
    env.reset(options={"start_yaw_deg": 0.0, "target_yaw_deg": 20.0})
    assert env.step([0.0, 0.1, 0.0])[1] == -1000.0  # D = 8 deg: far too short
    env.reset(options={"start_yaw_deg": 0.0, "target_yaw_deg": 20.0})
    _, reward, *_, info = env.step([0.0, 13.5 / 80, 0.0])
    assert -300 < reward == -info["duration_ms"] < -100
