"""The command line as a user types it: help pages, JSON on standard output, errors without tracebacks."""

import ast
import inspect
import io
import itertools
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import fields, is_dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orient_eye.cli import COMMANDS, main
from orient_eye.cli.options import REGISTRIES, parse
from orient_eye.cli.places import check_outputs
from orient_eye.cli.simulate import Simulate
from orient_eye.cli.sysid import Sysid
from orient_eye.cli.tables import say, table
from orient_eye.cli.train import Train
from orient_eye.cli.view import View
from orient_eye.errors import Ended, InputError
from orient_eye.learning.config import TrainConfig
from orient_eye.motor import rests
from orient_eye.plants import PLANTS, Option, PlantKind, make_plant
from orient_eye.registry import load
from orient_eye.rotations import to_euler
from orient_eye.task.cases import CASES

SHARED = [
    "orient_eye.cli.problem:Problem",
    "orient_eye.cli.saccades:Saccades",
    "orient_eye.cli.another_plant:AnotherPlant",
]
"""Options that several commands have."""


def run(
    *arguments: object, cwd: Path | None = None, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """What a command line says, in this process, or in one of its own that has this environment too."""
    command = list(map(str, arguments))
    if env is not None:
        program = [sys.executable, "-m", "orient_eye", *command]
        return subprocess.run(program, capture_output=True, text=True, cwd=cwd, env={**os.environ, **env}, check=False)
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err), chdir(cwd or "."), pytest.raises(SystemExit) as end:
        main(command)
    assert isinstance(end.value.code, int)
    return subprocess.CompletedProcess(command, end.value.code, out.getvalue(), err.getvalue())


def command_file(folder: Path) -> Path:
    path = folder / "command.csv"
    path.write_text("t_s,tau2_deg\n0,0\n0,8\n0.3,8\n")
    return path


# --- help -----------------------------------------------------------------------------------------


def test_help_lists_every_command() -> None:
    page = run("--help")
    assert page.returncode == 0
    for name in COMMANDS:
        assert f"• {name} " in page.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_help_page(name: str) -> None:
    page = run(name, "--help")
    assert page.returncode == 0
    assert f"usage: orient-eye {name} " in page.stdout


@pytest.mark.parametrize("place", [*COMMANDS.values(), "orient_eye.learning.config:TrainConfig", *SHARED])
def test_every_option_is_told_in_words(place: str) -> None:
    command = load(place)
    (body,) = (node.body for node in ast.parse(inspect.getsource(command)).body if isinstance(node, ast.ClassDef))
    told = {
        node.target.id: inspect.cleandoc(after.value.value)
        for node, after in itertools.pairwise(body)
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
        and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
    }  # fmt: skip
    for field in fields(command):
        if field.name not in ("plant_options", "another_plant", "config", "problem", "saccades"):
            words = told[field.name]
            assert len(words.split()) >= 3, field.name
            assert words.endswith("."), field.name
    assert is_dataclass(command)


def test_words_that_are_no_command() -> None:
    for arguments in (["nosuch"], [], ["--plant", "lpf"]):
        done = run(*arguments)
        assert done.returncode == 2
        assert "simulate" in done.stderr
        assert "Traceback" not in done.stderr


# --- options from the registries ------------------------------------------------------------------


@pytest.mark.parametrize("name", ["simulate", "sysid", "train", "predict", "evaluate", "optimum", "weights"])
def test_what_is_registered_is_offered(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    springs = Option("springs", int, 6, "Number of springs.")
    kind = PlantKind(
        "a toy",
        "nowhere:Toy",
        (springs, Option("eye", str, "left", "Which eye."), Option("wet", bool, False, "In water.")),
    )
    monkeypatch.setitem(PLANTS._own, "toy", kind)
    for registry in ("case", "targets", "pulse"):
        monkeypatch.setitem(REGISTRIES[registry]._own, f"my_{registry}", "nowhere:THING")
    command = load(COMMANDS[name])
    with pytest.raises(SystemExit):
        parse(command, ["--help"])
    page = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert ",toy}" in page
    assert "--springs INT Number of springs. For toy; default 6." in page
    assert "For mujoco, tavares, viscous; default thesis. Which eye. For toy; default left." in page
    assert "--wet In water. For toy." in page
    choices = {"train": ("case", "targets"), "optimum": ("case", "targets", "pulse")}
    choices["weights"] = choices["optimum"]
    for registry in choices.get(name, ()):
        assert f"my_{registry}}}" in page
    required = {"simulate": ["--motor", "x.csv"], "predict": ["P"], "evaluate": ["P"]}.get(name, [])
    parsed = parse(command, [*required, "--plant", "toy", "--springs", "3", "--wet"])
    holder: Any = next(
        (getattr(parsed, part) for part in ("config", "another_plant", "problem") if hasattr(parsed, part)), parsed
    )
    assert (holder.plant, holder.plant_options) == ("toy", {"springs": 3, "wet": True})


def test_options_of_another_plant_are_refused() -> None:
    with pytest.raises(InputError, match="--as-published does nothing on plant 'mujoco'; leave it out or choose"):
        parse(Simulate, ["--motor", "x.csv", "--as-published"])
    parsed = parse(Simulate, ["--motor", "x.csv", "--accurate", "--eye", "eve_v3"])
    assert parsed == Simulate(Path("x.csv"), plant_options={"accurate": True, "eye": "eve_v3"})


def test_train_is_its_configuration() -> None:
    arguments = "--plant tavares --gravity --case 2-varying --updates 7 --weights 1 2 3 4 --temperature auto --out x"
    config = TrainConfig(
        "tavares", {"gravity": True}, "2-varying", updates=7, weights=(1.0, 2.0, 3.0, 4.0), temperature="auto"
    )
    assert parse(Train, arguments.split()) == Train(config, Path("x"))
    assert parse(Train, []) == Train()


def test_a_broken_plant_of_another_package_is_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    added = {
        "broken": EntryPoint("broken", "no_such_module:PLANT", "orient_eye.plants"),
        "wrong": EntryPoint("wrong", "math:pi", "orient_eye.plants"),
    }
    monkeypatch.setattr(PLANTS, "_added", added)
    monkeypatch.setattr(PLANTS, "_own", dict(PLANTS._own))
    clash = PlantKind(
        "clashes", "nowhere:Clash", (Option("out", str, "", "Taken."), Option("eye", int, 1, "Other type."))
    )
    monkeypatch.setitem(PLANTS._own, "clash", clash)
    parsed = parse(Simulate, ["--motor", "x.csv", "--plant", "tavares", "--gravity"])
    assert parsed.plant_options == {"gravity": True}
    told = capsys.readouterr().err
    assert "plant 'broken' is left out" in told
    assert "plant 'wrong' is left out" in told
    assert "plant 'clash' cannot have its option --out" in told
    assert "plant 'clash' cannot have its option --eye" in told


OTHER = """
from dataclasses import replace
from orient_eye.commands.pulses import PULSES
from orient_eye.plants import Option, PlantKind
from orient_eye.task.cases import Case

PLANT = PlantKind("a stiffer eye", "other:make", (Option("stiff", float, 1.0, "How stiff it is."),))
PULSE = replace(PULSES["1"], summary="the same again")
CASE = Case("again")

def make(stiff=1.0):
    from orient_eye.plants.linear import LinearPlant
    from orient_eye.surrogate import Surrogate

    class Stiffer(LinearPlant):
        name = "stiffer"

        def identity(self):
            return {"plant": "stiffer", "stiff": stiff}

    return Stiffer(Surrogate(1.5, 17.5 * stiff, eye="thesis"))

def targets(plant, **options):
    from orient_eye.task.targets import AxisTargets

    return AxisTargets(plant, **{"name": "near", "limit_deg": 20.0, **options})
"""
POINTS = """
[orient_eye.plants]
stiffer = other:PLANT
broken = other:NOTHING
[orient_eye.cases]
again = other:CASE
broken = other:NOTHING
[orient_eye.pulses]
again = other:PULSE
[orient_eye.targets]
near = other:targets
"""


@pytest.fixture
def other_package(tmp_path: Path) -> dict[str, str]:
    """The environment of a process in which another package is installed that adds one of each."""
    (tmp_path / "other.py").write_text(OTHER)
    info = tmp_path / "other-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(POINTS)
    return {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}


def test_another_package_adds_one_of_each(other_package: dict[str, str], tmp_path: Path) -> None:
    stiff = ("--plant", "stiffer", "--stiff", "1.2")
    motor = ("--motor", command_file(tmp_path), "--out", tmp_path / "moved")
    done = run("simulate", *stiff, *motor, "--json", env=other_package)
    assert done.returncode == 0, done.stderr
    assert "plant 'broken' is left out" in done.stderr
    assert json.loads(done.stdout)["plant"] == {"plant": "stiffer", "stiff": 1.2}
    assert json.loads(done.stdout)["final_yaw_pitch_roll_deg"][0] == pytest.approx(12, abs=0.1)
    done = run("weights", *stiff, "--pulse", "again", "--targets", "near", "--json", env=other_package)
    (row,) = json.loads(done.stdout)["cases"]
    assert (row["pulse"], row["D"], row["k0"]) == ("again", pytest.approx(20 / 1.5), pytest.approx(21))
    done = run("weights", "--json", env=other_package)
    assert [row["case"] for row in json.loads(done.stdout)["cases"]] == [*CASES, "again"]
    assert "case 'broken' is left out" in done.stderr
    options = "--updates 2 --warmup 8 --batch-size 8 --saccades-per-update 8 --evaluation-pairs 2"
    trained = (*stiff, "--case", "again", "--targets", "near", *options.split(), "--out", tmp_path / "trained")
    done = run("train", *trained, "--json", env=other_package)
    assert done.returncode == 0, done.stderr
    assert "solved by thesis 4.4.5 at B = 35, D = 13.33, k0 = 21" in done.stderr
    amplitudes = [round(r["amplitude_deg"]) for r in json.loads(done.stdout)["table"]]
    assert amplitudes == [5, 10, 20, 30]
    done = run("predict", tmp_path / "trained", "--target", "21", env=other_package)
    assert done.returncode == 2
    assert "between -20.0 and 20.0 deg" in done.stderr


# --- results --------------------------------------------------------------------------------------


def test_json_is_all_of_standard_output(tmp_path: Path) -> None:
    done = run("simulate", "--motor", command_file(tmp_path), "--out", tmp_path / "run", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["final_yaw_pitch_roll_deg"][0] == pytest.approx(11.7, abs=0.2)
    for name in ("trajectory.csv", "trajectory.npz", "trajectory.rrd", "trajectory.png", "run.json", "result.json"):
        assert (tmp_path / "run" / name).stat().st_size > 0
    header = (tmp_path / "run" / "trajectory.csv").read_text().splitlines()[0]
    assert header.startswith("t_s,q_w,q_x,q_y,q_z,yaw_deg,pitch_deg,roll_deg,omega_x_deg_s")
    assert "tau1_deg,tau2_deg,tau3_deg,command_tau1_deg" in header
    assert "command_tau3_deg,tension_motor1_upper_N" in header


@pytest.mark.parametrize("plant", ["lpf", "tavares"])
def test_simulate_on_other_plants(plant: str, tmp_path: Path) -> None:
    done = run("simulate", "--plant", plant, "--motor", command_file(tmp_path), "--out", tmp_path / "run", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["final_yaw_pitch_roll_deg"][0] == pytest.approx(11.7, abs=0.3)


@pytest.mark.parametrize(("pretension", "yaw"), [(1, -4.2), (2, -10.0)])
def test_simulate_the_six_motor_eye(pretension: int, yaw: float, tmp_path: Path) -> None:
    """A motor without a column stands at its pretension, and the eye begins where the first row holds it."""
    told = make_plant("tavares", eye="six", pretension=pretension).motors
    motor = {each.name: each.rest for each in told}
    file, ends = tmp_path / "spindles.csv", motor["LR"] + 10
    file.write_text(f"t_s,LR_deg\n0,{ends}\n0.02,{ends}\n0.1,{motor['LR']}\n")
    words = f"--eye six --pretension {pretension} --motor {file} --out {tmp_path / 'run'}"
    parse(Simulate, words.split()).run()
    with np.load(tmp_path / "run" / "trajectory.npz") as found:
        begins, moved = to_euler(found["orientation"][0, 0]), found["motor"][0]
        speed = np.linalg.norm(found["angular_velocity"][0, :20], axis=1)
    assert begins[0] == pytest.approx(yaw, abs=0.05)
    assert speed.max() < 1e-6
    np.testing.assert_allclose(np.ptp(moved, axis=0), [0, 0, 0, 10, 0, 0], atol=1e-9)
    np.testing.assert_allclose(moved[-1], list(motor.values()), atol=1e-9)
    header = (tmp_path / "run" / "trajectory.csv").read_text().splitlines()[0]
    assert "IR_deg,MR_deg,SR_deg,LR_deg,IO_deg,SO_deg,command_IR_deg" in header


@pytest.mark.parametrize(("unit", "pretension"), [("rad", 1), ("rad", 2), ("deg", 1)])
def test_spindle_angles_in_radians_are_asked_about(
    unit: str, pretension: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of a small movement in degrees are not."""
    motors = make_plant("tavares", eye="six", pretension=pretension).motors
    rest = rests(motors) if unit == "deg" else np.deg2rad(rests(motors))
    moved = rest + 0.3 * (np.eye(6)[1] - np.eye(6)[3])
    rows = ("t_s", *(each.column for each in motors)), (0, *rest), (0.1, *moved)
    file = tmp_path / "spindles.csv"
    file.write_text("\n".join(",".join(map(str, row)) for row in rows))
    Simulate(file, "tavares", {"eye": "six", "pretension": pretension}, out=tmp_path / "run").run()
    assert ("are these radians?" in capsys.readouterr().err) == (unit == "rad")


def test_simulate_holds_the_last_row_up_to_the_horizon(tmp_path: Path) -> None:
    short = Simulate(command_file(tmp_path), "lpf", horizon=0.1, out=tmp_path / "short").run()
    long = Simulate(command_file(tmp_path), "lpf", horizon=2.0, out=tmp_path / "long").run()
    assert (short["samples"], long["samples"]) == (101, 2001)
    assert long["final_yaw_pitch_roll_deg"][0] == pytest.approx(8 * 1.4758, abs=1e-5)
    for horizon in (0.0, -1.0, float("nan"), float("inf"), 1e9):
        with pytest.raises(InputError, match=r"--horizon must be a number from .* to 3600 s"):
            Simulate(command_file(tmp_path), "lpf", horizon=horizon).run()


def test_validate_says_whether_it_passed() -> None:
    done = run("validate", "--random-runs", "2", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["passed"] is True


def test_sysid_takes_every_option_of_its_plant(tmp_path: Path) -> None:
    arguments = "--plant tavares --eye eve_v3 --amplitudes 5 10 --held-out 7 --out"
    result = parse(Sysid, [*arguments.split(), str(tmp_path / "run")]).run()
    assert result["source"].endswith("on tavares (eve_v3); K: least squares over all amplitudes, w0: at 10 deg")
    assert json.loads((tmp_path / "run" / "run.json").read_text())["config"]["plant_options"] == {"eye": "eve_v3"}


class Result:
    def __init__(self, result: Any) -> None:
        self.result = result

    def run(self) -> Any:
        if isinstance(self.result, BaseException):
            raise self.result
        return self.result


@pytest.mark.parametrize(
    ("result", "code", "printed"),
    [
        (
            {"x": float("nan"), "y": [np.inf, np.float64(1)], "z": np.arange(2)},
            0,
            {"x": None, "y": [None, 1], "z": [0, 1]},
        ),
        ({"passed": False}, 1, {"passed": False}),
        (InputError("[red]no[/b]"), 2, {"error": "[red]no[/b]"}),
        (KeyboardInterrupt(), 130, None),
        (Ended(15), 143, None),
        (MemoryError("8 TiB"), 2, {"error": "not enough memory (8 TiB); ask for less at once"}),
    ],
)
def test_exit_codes_and_json(
    result: Any, code: int, printed: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("orient_eye.cli.options.parse", lambda *_, **__: Result(result))
    with pytest.raises(SystemExit) as end:
        main(["models", "--json"])
    assert end.value.code == code
    out, err = capsys.readouterr()
    assert (json.loads(out) if out else None) == printed
    assert ("interrupted" in err) == (code > 128)
    assert (f"error: {printed['error']}" in err) if code == 2 else "error" not in err


# --- errors ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "--motor", "nosuch.csv"], "cannot read nosuch.csv"),
        (["simulate", "--motor", "{command}", "--eye", "fish"], "unknown eye 'fish'"),
        (["simulate", "--motor", "{command}", "--plant", "lpf", "--gravity"], "--gravity does nothing on plant 'lpf'"),
        (["simulate", "--motor", "{far}"], "mechanical range"),
        (["simulate", "--motor", "{command}", "--out", "."], "not an empty folder"),
        (["simulate", "--motor", "{command}", "--out", "command.csv/x"], "command.csv/x"),
        (["train", "--updates", "0"], "updates must be a whole number from 1"),
        (["train", "--surrogate", "nosuch"], "nosuch is no surrogate"),
        (["train", "--resume", "nosuch"], "no run directory"),
        (["train", "--resume", "nosuch", "--seed", "3"], "leave the other options out"),
        (["train", "--weights", "0", "0", "0", "0"], "not all 0"),
        (["train", "--checkpoint-every", "nan"], "the time between checkpoints must be a number"),
        (["predict", "nosuch", "--start", "0", "--target", "5"], "nosuch"),
        (["view", "nosuch.rrd"], "nosuch.rrd"),
        (["view", "."], "is a folder"),
        (["sysid", "--recording", "nosuch.csv"], "nosuch.csv"),
        (["sysid", "--recording", "nosuch.csv", "--amplitudes", "3"], "--amplitudes is for a plant"),
        (["sysid", "--recording", "nosuch.csv", "--gravity"], "--gravity is for a plant"),
        (["sysid", "--recording"], "--recording names no file"),
        (["sysid", "--until", "3"], "--until is for recordings"),
        (["optimum", "--start", "0", "--target", "500"], "500"),
        (["validate", "--random-runs", "-1"], "random runs must be a whole number"),
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


@pytest.mark.parametrize("name", ["a[/b]", "[red]x", "smile :smile:", "[link=x]y[/link]"])
def test_markup_in_paths_is_a_name(name: str, tmp_path: Path) -> None:
    out = tmp_path / f"{name}.run"
    done = run("simulate", "--plant", "lpf", "--motor", command_file(tmp_path), "--out", out)
    assert done.returncode == 0, done.stderr
    assert f"in {out}: trajectory.csv" in done.stderr
    assert (out / "result.json").exists()
    missing = run("simulate", "--motor", tmp_path / f"{name}.csv")
    assert (missing.returncode, f"{name}.csv" in missing.stderr) == (2, True)


def test_text_is_printed_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    long = "[bold]" + "x" * 300
    say(long, "red")
    say(table("[i]title[/]", {"[b]": lambda row: row["cell"]}, [{"cell": "[/nothing]"}]))
    told = capsys.readouterr().err
    for words in (long, "[i]title[/]", "[b]", "[/nothing]"):
        assert words in told


def test_no_file_is_lost(tmp_path: Path) -> None:
    here, link, folder = tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / "folder"
    here.touch()
    link.symlink_to(here)
    folder.mkdir()
    check_outputs({"--out": here, "--command": tmp_path / "c.csv", "--none": None}, {"--pairs": None})
    check_outputs({"--out": Path("/dev/null"), "--command": Path("/dev/null")}, {})
    for outputs, inputs, words in (
        ({"--out": here}, {"--pairs": link}, "--out and --pairs name the same file"),
        ({"--out": link}, {"--pairs": here}, "--out and --pairs"),
        ({"--out": folder / ".." / "new.csv", "--command": tmp_path / "new.csv"}, {}, "--command and --out"),
        ({"--out": folder}, {}, "--out .* is a folder"),
    ):
        with pytest.raises(InputError, match=words):
            check_outputs(outputs, inputs)


def test_recordings_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "a.rrd").write_bytes(b"RRF and nothing")
    (tmp_path / "b.rrd").write_bytes(b"")
    for file, options, words in (
        (tmp_path / "b.rrd", {}, "is not a recording"),
        (Path("a\0b"), {}, "cannot read"),
        (tmp_path / "a.rrd" / "c.rrd", {}, "cannot read"),
        (tmp_path / "a.rrd", {"screenshot": Path("a.jpg")}, "NAME.png"),
        (tmp_path / "a.rrd", {"web": True, "screenshot": Path("a.png")}, "exclude each other"),
        (tmp_path / "a.rrd", {"screenshot": Path("a.png"), "size": (0, 10)}, "width must be"),
    ):
        with pytest.raises(InputError, match=words):
            View(file, **options).run()


def test_version() -> None:
    import orient_eye

    assert run("--version").stdout.strip() == orient_eye.__version__
