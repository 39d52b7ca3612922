"""predict, optimum, weights and evaluate on gaze targets; the written command in MuJoCo alone; and what is refused."""

import ast
import csv
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.cli import _run
from orient_eye.cli.evaluate import Evaluate
from orient_eye.cli.optimum import Optimum
from orient_eye.cli.predict import Predict
from orient_eye.cli.problem import Problem
from orient_eye.cli.saccades import Saccades
from orient_eye.cli.weights import Weights
from orient_eye.commands.motor_file import read_command
from orient_eye.errors import InputError
from orient_eye.learning import evaluation
from orient_eye.learning.policy import Policy
from orient_eye.listing import directions
from orient_eye.plants import make_plant
from orient_eye.search import optimum
from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask
from test_policy import make_policy

Array = NDArray[np.float64]
REPLAY = Path(__file__).parents[1] / "examples" / "replay_command.py"
GAZE = Problem(plant="modal", targets="gaze")

pytestmark = pytest.mark.usefixtures("private_cache")


@pytest.fixture(scope="module", autouse=True)
def short_search() -> Iterator[None]:
    """The optimum is no matter here, so that little is spent on it; and the eye is compiled before the cache is new."""
    make_plant("tavares")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(optimum, "_GENERATIONS", ((2, 4, 1.0), (1, 4, 0.3)))
        patch.setattr(evaluation, "TABLE_IN_ALL_DIRECTIONS", ((10.0, 30.0), (0.0, 45.0)))
        yield


def gentle_policy(task: SaccadeTask) -> Policy:
    """Random networks that say little: commands near the usual ones."""
    policy = make_policy(task, sizes=(6, 8))
    return replace(policy, weights=tuple(0.3 * weight for weight in policy.weights))


@pytest.fixture(scope="module")
def modal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    task = SaccadeTask.of_case(make_plant("modal"), targets="gaze")
    return gentle_policy(task).save(tmp_path_factory.mktemp("modal")).parent


@pytest.fixture(scope="module")
def tavares(tmp_path_factory: pytest.TempPathFactory) -> Path:
    task = SaccadeTask.of_case(make_plant("tavares"), targets="gaze")
    return gentle_policy(task).save(tmp_path_factory.mktemp("tavares")).parent


# --- predict ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("start", "target"), [((0.0, 0.0), (20.0, -10.0)), ((-15.0, 12.0), (10.0, 20.0))])
def test_the_written_command_in_mujoco_alone(
    start: tuple[float, ...], target: tuple[float, ...], tavares: Path, tmp_path: Path
) -> None:
    """A script of numpy and mujoco lands where `predict` says, within 0.05 deg."""
    file = tmp_path / "command.csv"
    (row,) = Predict(str(tavares), Saccades(start, target), command=file).run()["saccades"]
    assert row["settled"] is True
    said = subprocess.run([sys.executable, str(REPLAY), str(file)], capture_output=True, text=True, check=True).stdout
    yaw, pitch, torsion = (float(number) for number in re.findall(r"-?\d+\.\d+", said))
    assert yaw == pytest.approx(row["final_yaw_deg"], abs=0.05)
    assert pitch == pytest.approx(row["final_pitch_deg"], abs=0.05)
    eye = make_plant("mujoco")
    at = eye.rest(np.array([[row[f"D_motor{i}_deg"] for i in (1, 2, 3)]]))
    assert torsion == pytest.approx(float(np.rad2deg(2 * np.arctan(at[0, 1] / at[0, 0]))), abs=0.05)


def test_the_script_imports_nothing_else() -> None:
    tree = ast.parse(REPLAY.read_text())
    imported = {
        name.name.split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names
    }
    imported |= {str(node.module).split(".")[0] for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert imported - set(sys.stdlib_module_names) == {"numpy", "mujoco"}


def test_what_is_predicted_is_what_the_file_does(modal: Path, tmp_path: Path) -> None:
    file = tmp_path / "command.csv"
    saccade = Saccades((5.0, 5.0), (-12.0, -9.0))
    (row,) = Predict(str(modal), saccade, command=file).run()["saccades"]
    eye = make_plant("modal")
    written = read_command(file, eye.motors)
    trajectory = eye.move(written, State(eye.rest(written.rest), written.rest)).trajectory()
    yaw, pitch, _ = rotations.to_euler(trajectory.orientation[0])
    assert [yaw[0], pitch[0]] == pytest.approx([5, 5], abs=1e-3)
    assert [yaw[-1], pitch[-1]] == pytest.approx([row["final_yaw_deg"], row["final_pitch_deg"]], abs=0.1)
    assert row["final_yaw_error_deg"] == pytest.approx(row["final_yaw_deg"] + 12, abs=1e-8)
    with file.open() as text:
        rows = list(csv.DictReader(text))
    assert list(rows[0]) == ["t_s", "tau1_deg", "tau2_deg", "tau3_deg"]
    assert float(rows[-1]["t_s"]) == pytest.approx(0.7)


def test_many_saccades_from_a_table(modal: Path, tmp_path: Path) -> None:
    pairs = tmp_path / "pairs.csv"
    pairs.write_text("start_yaw_deg,start_pitch_deg,target_yaw_deg,target_pitch_deg\n0,0,10,5\n-5,5,0,-20\n")
    result = Predict(str(modal), Saccades(pairs=pairs), out=tmp_path / "out.csv", commands=tmp_path / "all").run()
    assert [row["target_pitch_deg"] for row in result["saccades"]] == pytest.approx([5, -20])
    assert len(list((tmp_path / "all").glob("saccade-*.csv"))) == 2
    with (tmp_path / "out.csv").open() as text:
        assert len(list(csv.DictReader(text))) == 2


# --- the others -------------------------------------------------------------------------------------------


def test_the_best_saccade_and_that_it_is_remembered(tmp_path: Path) -> None:
    out = tmp_path / "best.csv"
    first = Optimum(Saccades((0.0, 0.0), (10.0, -8.0)), GAZE, out=out, quiet=True).run()
    again = Optimum(Saccades((0.0, 0.0), (10.0, -8.0)), GAZE, quiet=True).run()
    assert [first["remembered"], again["remembered"]] == [False, True]
    (row,) = first["saccades"]
    assert again["saccades"] == first["saccades"]
    assert first["task"]["actions"]["actions"] == "pulse-step"
    assert 12 <= row["B_motor1"] <= 120
    assert row["reward"] == pytest.approx(sum(row[f"reward_{name}"] for name in first["task"]["weights"]))
    assert out.read_text().splitlines()[0].startswith("start_yaw_deg,start_pitch_deg,target_yaw_deg")


def test_weights_of_all_directions() -> None:
    """The horizontal ones of the same plant, but for the overshoot, and what the specification chose for the force."""
    (modal,) = Weights(GAZE, case="1").run()["cases"]
    (flat,) = Weights(Problem(plant="modal"), case="1").run()["cases"]
    assert modal["accuracy"] == pytest.approx(flat["accuracy"], rel=1e-6)
    assert modal["duration"] == pytest.approx(flat["duration"], rel=1e-6)
    assert modal["overshoot"] == pytest.approx(0.09 * flat["overshoot"])
    assert modal["force"] == 0
    assert "no weight of the force" in modal["how"]
    (eye,) = Weights(Problem(plant="tavares", targets="gaze"), case="1").run()["cases"]
    found = [eye[name] for name in ("accuracy", "duration", "overshoot", "force")]
    assert found == pytest.approx([4.08e7, 5.53e5, 5e6, 3e5], rel=0.02)


def test_a_policy_is_evaluated(modal: Path, tmp_path: Path) -> None:
    result = Evaluate(str(modal), pairs=6, out=tmp_path / "run", quiet=True).run()
    saved = json.loads((tmp_path / "run" / "result.json").read_text())
    assert saved["pairs"] == result["pairs"] == 6
    with (tmp_path / "run" / "pairs.csv").open() as text:
        rows = list(csv.DictReader(text))
    assert len(rows) == 6
    gaps = [(float(r["reward_best"]) - float(r["reward"])) / abs(float(r["reward_best"])) for r in rows]
    assert np.mean(gaps) == pytest.approx(result["gap_mean"], rel=1e-6)
    for row in rows:
        angles = [[float(row[f"{what}_{a}_deg"]) for a in ("yaw", "pitch")] for what in ("final", "target")]
        off = rotations.angle_between_directions(*directions(*np.array(angles).T))
        assert off < 5
    assert (tmp_path / "run" / "recording.rrd").stat().st_size > 0


# --- what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--start", "0", "0", "--target", "40", "0"], "saccades are learned up to 30.0 deg"),
        (["--start", "0", "80", "--target", "0", "0"], "start at 0, 80 deg"),
        (["--target", "20"], "takes YAW [deg], PITCH [deg]: as many numbers, not 1"),
        (["--target", "nan", "0"], "target at nan, 0 deg"),
        ([], "name a saccade by --start and --target (YAW [deg], PITCH [deg])"),
        (["--target", "10", "0", "--plant", "lpf"], "cannot drive ['motor1', 'motor3']"),
        (["--target", "10", "0", "--plant", "tavares"], "trained for plant modal"),
    ],
)
def test_predict_refuses(
    arguments: list[str], message: str, modal: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = tmp_path / "command.csv"
    command.write_text("kept")
    code = _run(["predict", str(modal), *arguments, "--command", str(command)], as_json=True)
    assert code == 2
    assert message in json.loads(capsys.readouterr().out)["error"]
    assert command.read_text() == "kept"  # nothing is lost


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--start", "0", "0", "--target", "70", "0"], "can be held up to"),
        (["--start", "5", "5", "--target", "5", "5"], "starts at its target"),
        (["--target", "5"], "as many numbers, not 1"),
        (["--target", "5", "5", "--plant", "lpf"], "choose targets about one axis"),
        (["--target", "5", "5", "--weights", "1", "1", "1", "1"], "5 weights"),
        (["--target", "5", "5", "--weights", "1", "1", "1", "1", "1"], "no elastics are known"),
    ],
)
def test_optimum_refuses(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    options = arguments if "--plant" in arguments else [*arguments, "--plant", "modal"]
    assert _run(["optimum", "--targets", "gaze", "--quiet", *options], as_json=True) == 2
    assert message in json.loads(capsys.readouterr().out)["error"]


def test_unknown_motors_and_torsions_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ["train", "--plant", "modal", "--targets", "gaze", "--out", str(tmp_path / "run")]
    assert _run([*run, "--driven", "motor1", "motor2", "motor7"], as_json=True) == 2
    assert "motor7" in json.loads(capsys.readouterr().out)["error"]
    assert _run([*run, "--driven", "motor2"], as_json=True) == 2
    assert "need all motors" in json.loads(capsys.readouterr().out)["error"]
    assert _run([*run, "--from", "lpf-1"], as_json=True) == 2
    assert "begin with one of the same kind" in json.loads(capsys.readouterr().out)["error"]


def test_a_policy_of_another_kind_of_target_does_not_act_here(modal: Path) -> None:
    """One of horizontal saccades is not one of gaze, on the same plant."""
    flat = gentle_policy(SaccadeTask.of_case(make_plant("modal")))
    with pytest.raises(InputError, match=r"gives 3 numbers an action, this task takes 9"):
        flat.require(Policy.load(modal).task())
    with pytest.raises(InputError, match="as many numbers, not 1"):
        Predict(str(modal), Saccades(target=(5.0,))).run()
