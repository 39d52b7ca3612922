"""The command line as a user types it: help pages, JSON on standard output, errors without tracebacks."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

COMMANDS = (
    "simulate", "view", "sysid", "train", "models", "predict", "evaluate", "export", "optimum", "weights", "validate",
)  # fmt: skip


def run(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "orient_eye", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)


def command_file(folder: Path) -> Path:
    path = folder / "command.csv"
    path.write_text("t_s,tau2_deg\n0,0\n0,8\n0.3,8\n")
    return path


def test_help_lists_every_command() -> None:
    page = run("--help")
    assert page.returncode == 0
    for name in COMMANDS:
        assert f"• {name} " in page.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_every_command(name: str) -> None:
    page = run(name, "--help")
    assert page.returncode == 0
    assert f"usage: orient-eye {name}" in page.stdout


def test_help_imports_nothing_heavy() -> None:
    program = (
        "import sys\nfrom orient_eye.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "heavy = {'torch', 'mujoco', 'scipy', 'rerun', 'matplotlib', 'trimesh', 'stable_baselines3'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_json_is_all_of_standard_output(tmp_path: Path) -> None:
    done = run("simulate", "--motor", command_file(tmp_path), "--out", tmp_path / "run", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["final_yaw_pitch_roll_deg"][0] == pytest.approx(11.7, abs=0.2)
    for name in ("trajectory.csv", "trajectory.npz", "trajectory.rrd", "trajectory.png", "run.json", "result.json"):
        assert (tmp_path / "run" / name).stat().st_size > 0
    header = (tmp_path / "run" / "trajectory.csv").read_text().splitlines()[0]
    assert header.startswith("t_s,q_w,q_x,q_y,q_z,yaw_deg,pitch_deg,roll_deg,omega_x_deg_s")
    assert "tau1_deg,tau2_deg,tau3_deg,tension_motor1_upper_N" in header


@pytest.mark.parametrize("plant", ["lpf", "tavares"])
def test_simulate_on_other_plants(plant: str, tmp_path: Path) -> None:
    done = run("simulate", "--plant", plant, "--motor", command_file(tmp_path), "--out", tmp_path / "run", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["final_yaw_pitch_roll_deg"][0] == pytest.approx(11.7, abs=0.3)


def test_validate_says_whether_it_passed() -> None:
    done = run("validate", "--random-runs", "2", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["passed"] is True


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "--motor", "nosuch.csv"], "cannot read nosuch.csv"),
        (["simulate", "--motor", "{command}", "--eye", "fish"], "unknown eye 'fish'"),
        (["simulate", "--motor", "{command}", "--plant", "lpf", "--gravity"], "--gravity does nothing on plant 'lpf'"),
        (["simulate", "--motor", "{far}"], "mechanical range"),
        (["simulate", "--motor", "{command}", "--out", "."], "not an empty folder"),
        (["train", "--updates", "0"], "--updates must be at least 1"),
        (["train", "--surrogate", "nosuch"], "nosuch is no surrogate"),
        (["train", "--resume", "nosuch"], "no run directory"),
        (["train", "--resume", "nosuch", "--seed", "3"], "leave the other options out"),
        (["predict", "nosuch", "--start", "0", "--target", "5"], "nosuch"),
        (["view", "nosuch.rrd"], "nosuch.rrd"),
        (["sysid", "--recording", "nosuch.csv"], "nosuch.csv"),
        (["sysid", "--recording", "nosuch.csv", "--amplitudes", "3"], "--amplitudes is for a plant"),
        (["optimum", "--start", "0", "--target", "500"], "500"),
        (["validate", "--random-runs", "-1"], "--random-runs"),
    ],
)
def test_bad_input_is_one_clear_error(arguments: list[str], words: str, tmp_path: Path) -> None:
    (tmp_path / "far.csv").write_text("t_s,tau2_deg\n0,0\n0.1,120\n")
    places = {"{command}": command_file(tmp_path), "{far}": tmp_path / "far.csv"}
    done = run(*(places.get(a, a) for a in arguments), "--json", cwd=tmp_path)
    assert done.returncode == 2
    assert words in json.loads(done.stdout)["error"]
    assert "error:" in done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["command.csv", "far.csv"]


def test_version() -> None:
    import orient_eye

    assert run("--version").stdout.strip() == orient_eye.__version__
