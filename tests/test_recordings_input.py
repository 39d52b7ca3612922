"""Recorded step responses: the CSV format, what `simulate` writes, logs as the prototype writes them, and bad input.

The logs are of a simulated rig (scripts/make_prototype_log.py). Those of the real one have no licence and are no part
of the project; where they are at hand, in ../shared, what they say is tested too.
"""

import json
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from make_prototype_log import Logs, Rig, main, make_logs, text
from orient_eye import rotations
from orient_eye.cli.sysid import Sysid
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model, motors
from orient_eye.plants import make_plant
from orient_eye.rig import Rig as Described
from orient_eye.rig import RigMotor
from orient_eye.surrogate import Surrogate
from orient_eye.sysid import StepResponse, identify_recordings, prototype_log, read_recording, read_recordings
from orient_eye.sysid.fit import fit_model
from orient_eye.sysid.models import MODELS
from orient_eye.sysid.physical_recordings import read_physical
from orient_eye.sysid.recording_checks import doubts_of, warnings_of
from orient_eye.sysid.replay import replay
from orient_eye.sysid.report import write_report
from orient_eye.tables import read_table

PROTOTYPE = Path(__file__).resolve().parents[2] / "shared" / "data" / "prototype_steps"
of_the_prototype = pytest.mark.skipif(
    not PROTOTYPE.is_dir(),
    reason="the prototype's logs have no licence and are not here: ../shared/data/prototype_steps",
)
RIG = Rig()
STEPS_DEG = (17.5, 35.0, 52.5, 70.0)


def table(rows: int = 30, **columns: object) -> str:
    time = np.linspace(0, 0.6, rows)
    data = {"t_s": time, "motor_deg": 3 + 10 * (time > 0), "eye_deg": 1 + 15 * (1 - np.exp(-17.5 * time)), **columns}
    data = {name: values for name, values in data.items() if values is not None}
    lines = [",".join(str(v) for v in row) for row in zip(*data.values(), strict=True)]
    return "\n".join([",".join(data), *lines]) + "\n"


def written(folder: Path, text: str, name: str = "step.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


# --- CSV ------------------------------------------------------------------------------------------------


def test_movement_is_measured_from_the_first_row(tmp_path: Path) -> None:
    step = read_recording(written(tmp_path, "# made by hand\n\n" + table()))
    assert (step.motor_deg[0], step.eye_deg[0], step.amplitude_deg) == (0, 0, 10)
    assert step.settled_gain == pytest.approx(1.5, abs=0.001)


def test_rows_before_time_0_are_rest(tmp_path: Path) -> None:
    time = np.linspace(-0.1, 0.6, 36)
    rng = np.random.default_rng(0)
    eye = 5 + np.where(time > 0, 15.0, 0.0) + 0.1 * rng.normal(size=36)
    step = read_recording(written(tmp_path, table(36, t_s=time, motor_deg=10 * (time > 0), eye_deg=eye)))
    assert step.eye_deg[time < 0].mean() == pytest.approx(0, abs=1e-12)
    assert step.eye_deg[-1] == pytest.approx(15, abs=0.3)


def test_what_simulate_writes_is_read_and_identified(tmp_path: Path) -> None:
    plant = make_plant("mujoco")
    command = np.zeros((1, 801, 3))
    command[:, 1:, 1] = 10.0
    path = plant.move(command).trajectory()[0].to_csv(tmp_path / "trajectory.csv")
    found = identify_recordings(read_recordings([path], "motor2", "yaw"), model="first_order")
    gain, w0 = found.surrogate.K, found.surrogate.w0
    assert gain == pytest.approx(1.4672, rel=1e-3)
    assert w0 == pytest.approx(17.567, rel=0.01)  # the arm takes one step of 1 ms, not none
    assert read_recording(path).source["motor"] == "tau2_deg"
    np.testing.assert_allclose(read_recording(path, axis="pitch").eye_deg, 0, atol=1e-3)
    with pytest.raises(InputError, match="motor does not move"):
        read_recording(path, motor="motor1")


def test_angles_come_from_the_quaternion_where_there_is_no_column(tmp_path: Path) -> None:
    yaw = np.deg2rad(np.linspace(0, 20, 30)) / 2
    quaternion = {"q_w": np.cos(yaw), "q_x": 0 * yaw, "q_y": 0 * yaw, "q_z": np.sin(yaw)}
    step = read_recording(written(tmp_path, table(eye_deg=None, **quaternion)))
    np.testing.assert_allclose(step.eye_deg, np.linspace(0, 20, 30), atol=1e-9)
    assert step.orientation is not None


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_what_spreadsheets_write_is_read(separator: str, encoding: str, tmp_path: Path) -> None:
    plain = read_recording(written(tmp_path, table()))
    path = tmp_path / "german.csv"
    text = table().replace(",", separator).replace(".", ",").replace("\n", "\r\n")
    path.write_bytes(text.encode(encoding))
    german = read_recording(path)
    for name in ("time", "motor_deg", "eye_deg"):
        np.testing.assert_array_equal(getattr(german, name), getattr(plain, name))


@pytest.mark.parametrize("motor", ["motor_deg", "tau2_deg", "tau9_deg"])
def test_recordings_of_the_whole_orientation_are_replayed(motor: str, tmp_path: Path) -> None:
    """t_s, motor_deg, q_w, q_x, q_y, q_z, as docs/sysid.md has it: the motor may have no name of ours."""
    yaw = np.deg2rad(15 * (1 - np.exp(-17.5 * np.linspace(0, 0.6, 30)))) / 2
    quaternion = {"q_w": np.cos(yaw), "q_x": 0 * yaw, "q_y": 0 * yaw, "q_z": np.sin(yaw)}
    columns = {"motor_deg": None, "eye_deg": None, motor: 10.0 * (np.arange(30) > 0), **quaternion}
    path = written(tmp_path, table(**columns))
    chosen = "motor9" if motor == "tau9_deg" else None
    steps = read_recordings([path], chosen)
    shown = replay(steps)
    assert [each.column for each in shown.motors] == [motor]
    np.testing.assert_allclose(shown.yaw_deg[0, [0, -1]], np.rad2deg(2 * yaw)[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(shown.motor[0, [0, -1], 0], [0, 10])
    result = write_report(identify_recordings(steps), tmp_path)
    assert "recording.rrd" in result["files"]
    nameless = replay([replace(step, motors={}) for step in steps])
    assert nameless.motor.shape == (1, len(nameless.time), 0)


def test_a_motor_that_a_recording_does_not_name_is_not_known() -> None:
    time, turned = np.linspace(0, 0.6, 30), np.tile([1.0, 0, 0, 0], (30, 1))
    steps = [StepResponse(name, time, time, time, turned, {name: time}) for name in ("pan", "tilt")]
    shown = replay(steps)
    assert shown.motor_names == ("pan", "tilt")
    assert np.isnan(shown.motor).all(axis=1).tolist() == [[False, True], [True, False]]


BAD = {
    "": "is empty",
    "t_s,motor_deg,eye_deg\n": "no rows of numbers",
    "1,2,3\n" * 9: "must name the columns: t_s,motor_deg,eye_deg",
    table(7): "7 rows of numbers; a step response needs at least 8",
    table(eye_deg=None): "no angle of the eye",
    table(motor_deg=None): "no column motor_deg or tau2_deg",
    table(t_s=None): "no column t_s",
    table().replace("motor_deg", "eye_deg"): "a column stands twice",
    table()[:-20] + "\n0.7,1": "2 cells, but there are 3 columns",
    table().replace(",13,", ",thirteen,", 1): "line 3: motor_deg is 'thirteen'",
    table().replace(",13,", ",nan,", 1): "line 3: motor_deg is not a finite number",
    table().replace(",13,", ",,", 1): "line 3: motor_deg is not a finite number; mend",
    table(t_s=np.linspace(0.6, 0, 30)): "time must rise",
    table(t_s=np.full(30, 0.5)): "time must rise",
    table(motor_deg=np.full(30, 10.0)): "must begin at rest",
    table(eye_deg=None, q_w=np.full(30, 2.0), q_x=np.zeros(30), q_y=np.zeros(30), q_z=np.zeros(30)): "unit quaternions",
}


@pytest.mark.parametrize("text", BAD, ids=BAD.values())
def test_bad_files_are_refused_with_the_reason(text: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=BAD[text]) as caught:
        read_recording(path)
    assert "step.csv" in str(caught.value)


def test_an_eye_that_does_not_move_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="eye does not move"):
        identify_recordings([read_recording(written(tmp_path, table(eye_deg=np.full(30, 4.0))))])


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    for path in (tmp_path / "none.csv", tmp_path, tmp_path / "binary.csv"):
        with pytest.raises(InputError, match=r"cannot read .*give a text file"):
            read_recording(path)
    good = written(tmp_path, table())
    with pytest.raises(InputError, match="named twice"):
        read_recordings([good, tmp_path / ".." / tmp_path.name / "step.csv"])
    with pytest.raises(InputError, match=r"2 rows until 0\.03 s"):
        read_recordings([good], until=0.03)


def test_recordings_through_links_and_pipes(tmp_path: Path) -> None:
    """As files are: also a log read for all motors, which a pipe gives only once. A link is no second recording."""
    good = written(tmp_path, table(motor_deg=None, tau2_deg=10.0 * (T > 0), yaw_deg=EYE))
    log = made_files(tmp_path)[0]
    link = tmp_path / "link.csv"
    link.symlink_to(good)
    with pytest.raises(InputError, match=r"step\.csv is named twice"):
        read_recordings([good, link])
    three = motors(build_model(visual=False))
    for path, read in (
        (good, read_recording),
        (good, lambda each: read_physical(each, three)),
        (log, lambda each: read_physical(each, three)),
    ):
        with subprocess.Popen(["cat", path], stdout=subprocess.PIPE) as shell:
            assert shell.stdout is not None
            through = read(Path(f"/dev/fd/{shell.stdout.fileno()}"))
        np.testing.assert_array_equal(through.time, read(path).time)


@pytest.mark.parametrize("column", ["t_s", "motor_deg", "eye_deg"])
@pytest.mark.parametrize("factor", [1e-300, 1e200])
def test_numbers_that_overflow_when_they_are_used(column: str, factor: float, tmp_path: Path) -> None:
    """Named, or so small that they do no harm."""
    values = {"t_s": T, "motor_deg": 10.0 * (T > 0), "eye_deg": EYE}[column] * factor
    path = written(tmp_path, table(**{column: values}))
    if column == "eye_deg" and factor < 1:
        assert "are these radians" in " ".join(doubts_of(read_recording(path)))
    else:
        with pytest.raises(InputError, match=rf"step\.csv.*({column} is beyond 1e\+20|time must rise|does not move)"):
            read_recording(path)


def test_recordings_that_tell_little_are_warned_of(tmp_path: Path) -> None:
    time = np.linspace(0, 0.6, 30)
    moving = read_recording(written(tmp_path, table(motor_deg=20 * time)))
    assert "moves until the end" in " ".join(warnings_of(moving))
    creeping = read_recording(written(tmp_path, table(eye_deg=15 * (1 - np.exp(-60 * time)) + 3 * time)))
    assert "creeps" in " ".join(warnings_of(creeping))
    coarse = read_recording(written(tmp_path, table(eye_deg=15.0 * (time > 0.05))))
    assert "only 0 rows" in " ".join(warnings_of(coarse))
    assert warnings_of(read_recording(written(tmp_path, table()))) == []


# --- the rig's own language -----------------------------------------------------------------------------

BENCH = Described(
    "bench",
    (
        RigMotor("left", "counts", 11.4, zero=512, range=(-40, 40), speed_limit=300, acceleration_limit=9000),
        RigMotor("right", "rad", sign=-1, zero=0.1, range=(-50, 50), speed_limit=400),
    ),
    {"pitch": {"left": 1.0, "right": -1.0}, "yaw": {"left": 1.0, "right": 1.0}},
    command_rate_hz=200,
)


def bench_eye(time: np.ndarray, drive: np.ndarray) -> np.ndarray:
    """A second order with dead time, by scipy."""
    K, wn, zeta, late = 1.6, 22.0, 0.7, 0.006

    def slope(t: float, state: np.ndarray) -> list[float]:
        return [state[1], wn * wn * (K * np.interp(t - late, time, drive) - state[0]) - 2 * zeta * wn * state[1]]

    rest = [K * drive[0], 0.0]
    return solve_ivp(slope, (time[0], time[-1]), rest, t_eval=time, max_step=5e-3).y[0]


@pytest.mark.parametrize(
    "columns",
    [("left_counts", "right_rad"), ("left_deg", "right_rad"), ("left_deg", "right_deg"), ("left - right_deg",)],
)
def test_the_drive_is_read_in_any_of_the_rigs_units(columns: tuple[str, ...], tmp_path: Path) -> None:
    drive = 20.0 * (np.arange(30) > 2)
    told = BENCH.to_driver("pitch", drive) | {"left_deg": drive / 2, "right_deg": -drive / 2, "left - right_deg": drive}
    text = table(motor_deg=None, eye_deg=None, **{c: told[c] for c in columns}, pitch_deg=1.5 * drive)
    step = read_recording(written(tmp_path, text), axis="pitch", rig=BENCH)
    np.testing.assert_allclose(step.motor_deg, drive, atol=1e-9)
    assert (step.drive, step.axis) == ("left - right", "pitch")
    assert not any("other axes" in w for w in step.warnings)


def test_what_a_rig_needs_is_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path, table(motor_deg=None, left_counts=np.arange(30)))
    with pytest.raises(InputError, match="turns pitch, yaw: name one of these by --axis"):
        read_recording(path, rig=BENCH)
    with pytest.raises(InputError, match=r"needs the columns right_rad \(or right_deg\)"):
        read_recording(path, axis="yaw", rig=BENCH)
    with pytest.raises(InputError, match="leave the motor 'motor2' out"):
        read_recording(path, "motor2", "yaw", rig=BENCH)
    one = Described("one", (RigMotor("servo"), RigMotor("other")), {"yaw": {"servo": 1.0}})
    moving = table(motor_deg=None, servo_deg=10.0 * (np.arange(30) > 0), other_deg=np.linspace(0, 5, 30))
    step = read_recording(written(tmp_path, moving), rig=one)
    assert "motors of other axes move too (other by 5.0 deg)" in " ".join(step.warnings)


def test_planned_steps_come_back_as_the_rig_that_did_them(tmp_path: Path) -> None:
    """The plan's tables through an eye of scipy's, rows dropped, and what was recorded through the command."""
    BENCH.save(tmp_path / "rig.toml")
    rig = str(tmp_path / "rig.toml")
    plan = Sysid(plan=True, rig=rig, axis="pitch", out=tmp_path / "plan").run()
    assert {"README.md", *(s["file"] for s in plan["steps"])} == set(plan["files"])
    random, paths = np.random.default_rng(0), []
    for row in plan["steps"][:4]:
        told = read_table(tmp_path / "plan" / row["file"], "")
        eye = bench_eye(told["t_s"], BENCH.from_driver("pitch", told.columns))
        kept = random.random(len(eye)) > 0.3
        columns = {"motor_deg": None, "eye_deg": None, **told.columns, "pitch_deg": eye}
        text = table(**{name: None if v is None else v[kept] for name, v in columns.items()})
        paths.append(written(tmp_path, text, row["file"]))
    until = max(row["until_s"] for row in plan["steps"])
    out = tmp_path / "run"
    result = Sysid(recording=tuple(paths), rig=rig, axis="pitch", until=until, out=out).run()
    assert result["model"] == "second_order_dead_time"
    assert (result["K"], result["wn"], result["zeta"]) == pytest.approx((1.6, 22.0, 0.7), rel=0.02)
    assert result["dead_time"] == pytest.approx(0.006, abs=0.0015)
    number = Surrogate.load(out / "surrogate.json")
    assert (number.motor, number.axis, number.range) == ("left - right", "pitch", (-80, 80))
    assert (number.speed_limit, number.acceleration_limit) == (600, 18000)
    assert Described.from_plain(number.rig or {}, "surrogate") == BENCH == Described.load(out / "rig.toml")


def test_a_plan_and_a_rig_are_asked_for_what_they_need(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--plan needs the rig"):
        Sysid(plan=True).run()
    with pytest.raises(InputError, match="leave --recording out"):
        Sysid(plan=True, rig="prototype", recording=(tmp_path / "x.csv",)).run()


def test_without_a_rig_a_first_one_is_written_and_goes_on(tmp_path: Path) -> None:
    path = written(tmp_path, table())
    first = Sysid(recording=(path,), axis="pitch", out=tmp_path / "first").run()
    text = (tmp_path / "first" / "rig.toml").read_text()
    asked = ("# command_rate_hz", "# range", "# speed_limit", "# acceleration_limit")
    assert all(any(line.startswith(key) for line in text.splitlines()) for key in asked)
    assert "from 3 to 13" in text
    rig = Described.load(tmp_path / "first" / "rig.toml")
    assert rig == Described("my-rig", (RigMotor("motor"),), {"pitch": {"motor": 1.0}})
    again = Sysid(recording=(path,), rig=str(tmp_path / "first" / "rig.toml"), out=tmp_path / "again").run()
    assert again["K"] == first["K"]
    assert (again["axis"], again["motor"]) == ("pitch", "motor")
    config = json.loads((tmp_path / "again" / "run.json").read_text())["config"]
    assert "plant" not in config
    assert config["recording"] == [str(path)]


def test_an_axis_that_nobody_said_is_said(tmp_path: Path) -> None:
    found = identify_recordings([read_recording(written(tmp_path, table()))])
    assert "nobody said which axis" in " ".join(found.warnings)
    tilted = table(eye_deg=None, roll_deg=15 * (1 - np.exp(-17.5 * np.linspace(0, 0.6, 30))))
    assert read_recording(written(tmp_path, tilted)).axis == "roll"


@pytest.mark.parametrize("axis", ["yaw", "pitch", "roll"])
def test_measured_and_fitted_eyes_are_shown_where_only_an_angle_was_recorded(axis: str, tmp_path: Path) -> None:
    steps = read_recordings([written(tmp_path, table())], axis=axis)
    found = identify_recordings(steps)
    measured, fitted = replay(steps), replay(steps, found.answer)
    for shown, angle in ((measured, steps[0].eye_deg), (fitted, found.answer(steps[0]))):
        angles = dict(zip(("yaw", "pitch", "roll"), rotations.to_euler(shown.orientation[0]), strict=True))
        np.testing.assert_allclose(angles.pop(axis)[[0, -1]], angle[[0, -1]], atol=1e-6)
        np.testing.assert_allclose(list(angles.values()), 0, atol=1e-9)
    assert "recording.rrd" in write_report(found, tmp_path)["files"]


# --- what is probably wrong -----------------------------------------------------------------------------

T = np.linspace(0, 0.6, 30)
EYE = 1 + 15 * (1 - np.exp(-17.5 * T))
TURNED = np.deg2rad(EYE - 1) / 2
PITCHED = {"q_w": np.cos(TURNED), "q_x": 0 * T, "q_y": np.sin(TURNED), "q_z": 0 * T}
DOUBTFUL: dict[str, dict[str, object]] = {
    "radians.*read in deg": {"eye_deg": np.deg2rad(EYE)},
    "motor moves by 0.175.*radians.*motor_deg": {"motor_deg": np.deg2rad(10.0) * (T > 0)},
    "motor moves by 0.175.*eye turns by 0.262": {
        "motor_deg": np.deg2rad(10.0) * (T > 0), "eye_deg": np.deg2rad(EYE),
    },
    "are these ms": {"t_s": 1000 * T},
    "recording lasts .*are these ms": {"t_s": np.linspace(0, 1100, 30)},
    "stands at 512 to 626.*counts": {"motor_deg": 512.0 + 114 * (T > 0)},
    "eye turns by 853.*counts": {"eye_deg": EYE * 853 / 15},
    "15 deg in pitch and 0 deg in yaw.*--axis pitch": PITCHED,
}  # fmt: skip


@pytest.mark.parametrize("words", DOUBTFUL)
def test_input_that_is_probably_wrong_is_named(words: str, tmp_path: Path) -> None:
    step = read_recording(written(tmp_path, table(**DOUBTFUL[words])))
    with pytest.raises(InputError, match=rf"step.csv: .*{words}.*--force"):
        identify_recordings([step])
    assert not doubts_of(read_recording(written(tmp_path, table())))


def test_who_insists_gets_a_note_instead(tmp_path: Path) -> None:
    step = read_recording(written(tmp_path, table(motor_deg=512.0 + 114 * (T > 0))))
    found = identify_recordings([step], force=True)
    assert "are these counts" in " ".join(found.warnings)


NAMED = {
    table(motor_deg=None, motor_rad=0.2 * T): "For motor_rad: .*rig file.*name the column motor_deg",
    table(motor_deg=None, motor_counts=200 * T): "For motor_counts: .*--rig",
    table(t_s=None, t_ms=1000 * T): "no column t_s.*name t_ms t_s and give it in s",
    table(eye_deg=None, eye_rad=0.2 * T): "eye_rad is in rad: multiply it by 57.29578 and name it eye_deg",
}


@pytest.mark.parametrize("text", NAMED, ids=NAMED.values())
def test_columns_in_other_units_are_named(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=NAMED[text]):
        read_recording(written(tmp_path, text))


@pytest.mark.parametrize("step_deg", [3.0, 10.0, 30.0])
def test_a_standing_motor_with_noise_raises_no_alarm(step_deg: float, tmp_path: Path) -> None:
    random, time = np.random.default_rng(8), np.arange(-0.2, 1.0, 0.01)
    for _ in range(40):
        noise = 0.05 * random.normal(size=(2, len(time)))
        motor = step_deg * np.clip(time / 0.05, 0, 1) + noise[0]
        eye = 1.5 * step_deg * (1 - np.exp(-17 * np.maximum(time - 0.02, 0))) + noise[1]
        step = read_recording(written(tmp_path, table(t_s=time, motor_deg=motor, eye_deg=eye)))
        assert warnings_of(step) == []
        assert doubts_of(step) == []


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_motor_that_still_moves_is_seen_through_noise(noise: float, tmp_path: Path) -> None:
    random, time = np.random.default_rng(9), np.arange(-0.2, 1.0, 0.01)
    for end in (0.95, 1.5):
        motor = 10 * np.clip(time / end, 0, 1) + noise * random.normal(size=len(time))
        step = read_recording(written(tmp_path, table(t_s=time, motor_deg=motor, eye_deg=1.4 * motor)))
        assert any("moves until the end" in w for w in warnings_of(step))


def test_noise_that_hides_the_step_is_said(tmp_path: Path) -> None:
    motor = 2.0 * (T > 0) + 0.2 * np.random.default_rng(1).normal(size=30)
    step = read_recording(written(tmp_path, table(motor_deg=motor, eye_deg=EYE)))
    assert any("make larger steps" in w for w in warnings_of(step))


# --- logs as the prototype writes them ------------------------------------------------------------------


def made_log(rig: Rig = RIG, step_deg: float = 35.0, **options: int) -> np.ndarray:
    return make_logs(rig, [step_deg], np.random.default_rng(0), **options)[0]


def made_files(folder: Path, rig: Rig = RIG, **options: int) -> list[Path]:
    tables = make_logs(rig, STEPS_DEG, np.random.default_rng(0), **options)
    return [written(folder, text(log), f"made_{step:g}.txt") for step, log in zip(STEPS_DEG, tables, strict=True)]


@pytest.mark.parametrize(
    "rig",
    [
        Rig(),
        Rig(gain=1.2, wn=40.0, zeta=0.8, dead_time_s=0.02, row_interval_s=0.009, velocity_lag_s=0.010),
        Rig(gain=0.6, wn=25.0, zeta=0.95, dead_time_s=0.03, row_interval_s=0.014),
    ],
    ids=["like the prototype", "quick log", "like eve_v3"],
)
def test_a_rig_is_found_in_its_logs(rig: Rig, tmp_path: Path) -> None:
    steps = read_recordings(made_files(tmp_path, rig))
    for step in steps:
        assert step.source["row_interval_ms"] == pytest.approx(1e3 * rig.row_interval_s, rel=0.03)
        assert step.source["velocity_lag_ms"] == pytest.approx(1e3 * rig.velocity_lag_s, abs=1)
        assert step.settled_gain == pytest.approx(rig.gain, rel=0.01)
    found = identify_recordings(steps)
    fit = found.preferred.fit
    assert fit.model.name == "second_order_dead_time"
    assert fit["K"].value == pytest.approx(rig.gain, rel=0.002)
    assert fit["wn"].value == pytest.approx(rig.wn, rel=0.03)
    assert fit["zeta"].value == pytest.approx(rig.zeta, abs=0.04)  # rows this far apart hide bends of the motors
    assert fit["dead_time"].value == pytest.approx(rig.dead_time_s, abs=0.001)
    gain = found.surrogate.K
    assert gain == pytest.approx(rig.gain, rel=0.02)


def residuals(path: Path) -> tuple[float, float]:
    model = MODELS["second_order_dead_time"]
    even, row_by_row = (
        fit_model(model, read_recordings([path], row_times=how, until=0.3)).rms_deg for how in ("even", "row-by-row")
    )
    return even, row_by_row


def test_rows_timed_one_by_one_leave_the_greater_residual(tmp_path: Path) -> None:
    """The velocity column lags, so that path over velocity is no time."""
    for path in made_files(tmp_path, Rig(eye_interval_s=0.010)):
        even, row_by_row = residuals(path)
        assert even < 0.5 * row_by_row


def test_a_made_log_is_in_the_form_of_the_prototypes() -> None:
    log = made_log(Rig(eye_noise_deg=0.0), 70.0)
    assert prototype_log.recognised(text(log).splitlines()[0])
    position, velocity = prototype_log.motor_positions(log), prototype_log.motor_velocities(log)
    np.testing.assert_allclose(position[-1], [35, 0, -35], atol=0.05)
    np.testing.assert_array_equal(velocity[:, 0], -velocity[:, 2])
    assert (velocity[:, 0] >= 0).all()
    assert velocity.max() == pytest.approx(349, abs=5)
    assert (np.diff(position[:, 0]) <= 349 * 0.0115 + prototype_log.POSITION_UNIT_DEG).all()
    step = prototype_log.step_response("made", log)
    assert step.eye_deg[-1] == pytest.approx(0.75 * 70, abs=0.05)
    np.testing.assert_allclose(step.source["axis_of_movement"], [0.0504, -0.9975, -0.0504], atol=1e-4)
    assert "Euler" not in " ".join(step.warnings)


def test_made_logs_are_the_same_every_time(tmp_path: Path) -> None:
    for folder in ("first", "second"):
        main(Logs(tmp_path / folder, steps=(20.0, 40.0), rows=30))
    names = sorted(path.name for path in (tmp_path / "first").iterdir())
    assert names == ["made_log_20.txt", "made_log_40.txt"]
    for name in names:
        log = (tmp_path / "first" / name).read_text()
        assert log == (tmp_path / "second" / name).read_text()
        assert "-0 " not in log
        assert np.loadtxt(tmp_path / "first" / name).shape == (30, 13)
    for steps in ([-5.0], [125.0], 20.0, [float("nan")]):
        with pytest.raises(InputError, match="above 0 and below 124 deg"):
            make_logs(Rig(), steps, np.random.default_rng(0))
    with pytest.raises(InputError, match="at least 2 rows"):
        made_log(rows=1)


def test_what_is_odd_about_a_log_is_said() -> None:
    def said(log: np.ndarray) -> str:
        return " ".join(warnings_of(prototype_log.step_response("made", log)))

    log = made_log(rows=101)
    whole = said(log[:100])
    assert "the log has no time" in whole
    assert "misses a sample" not in whole
    assert "Euler" not in whole
    edited = log[:100].copy()
    edited[21:58:3, 11] += 1.7
    assert "Euler columns differ from the quaternion by up to 1.7 deg in 13 rows (22 to 58)" in said(edited)
    missing = np.hstack([log[:100, :6], np.delete(log, 6, axis=0)[:, 6:]])
    assert "misses a sample before row 7:" in said(missing)


def test_a_sensor_with_a_clock_of_its_own_misses_samples(tmp_path: Path) -> None:
    steps = read_recordings(made_files(tmp_path, Rig(eye_interval_s=0.010)))
    assert all("misses a sample" in " ".join(step.warnings) for step in steps)
    fit = fit_model(MODELS["second_order_dead_time"], steps)
    assert fit["K"].value == pytest.approx(0.75, rel=0.002)  # and little else is right: docs/sysid.md


def test_dropped_rows_leave_the_gain_and_show_in_the_interval() -> None:
    log = made_log()
    whole, cut = (prototype_log.step_response("made", t).source for t in (log, np.delete(log, 6, axis=0)))
    assert cut["row_interval_half_width_ms"] > 3 * whole["row_interval_half_width_ms"]
    rig = Rig(row_interval_s=0.010)
    logs = make_logs(rig, np.full(40, 35.0), np.random.default_rng(0), dropped=15)
    steps = [prototype_log.step_response("made", log) for log in logs]
    assert np.mean([step.source["row_interval_ms"] for step in steps]) == pytest.approx(10 * 114 / 99, rel=0.05)
    for step in steps:
        gain = fit_model(MODELS["first_order"], [step])["K"].value
        assert (gain, step.settled_gain) == pytest.approx((0.75, 0.75), rel=0.01)


def test_a_log_with_every_other_row_dropped_moves_in_half_the_rows() -> None:
    def moving_rows(dropped: int) -> float:
        logs = make_logs(RIG, np.full(200, 70.0), np.random.default_rng(1), dropped=dropped)
        way = np.stack([prototype_log.motor_positions(log)[:, 0] for log in logs])
        assert (way[:, 0] == 0).all()
        return ((way > 1) & (way < 34)).sum() / len(logs)

    assert moving_rows(dropped=99) == pytest.approx(moving_rows(dropped=0) / 2, rel=0.05)


@pytest.mark.parametrize("interval_s", [0.008, 0.0115, 0.02])
def test_time_of_a_log_is_found(interval_s: float) -> None:
    step = prototype_log.step_response("made", made_log(Rig(row_interval_s=interval_s)))
    assert step.source["row_interval_ms"] == pytest.approx(1e3 * interval_s, rel=0.03)
    assert step.source["velocity_lag_ms"] == pytest.approx(16, abs=2.5)
    assert step.settled_gain == pytest.approx(0.75, rel=0.01)
    np.testing.assert_allclose(np.diff(step.time), step.source["row_interval_ms"] / 1e3)


def test_motors_that_hardly_move_leave_the_nominal_time() -> None:
    log = made_log()
    log[:, 3:6] = 0
    step = prototype_log.step_response("made", log)
    np.testing.assert_allclose(np.diff(step.time), 0.010)
    assert "10 ms apart" in " ".join(step.warnings)


def test_negative_velocities_are_decoded() -> None:
    row = np.zeros((1, 13))
    row[0, 3:6] = 1524, 500, 0
    np.testing.assert_allclose(prototype_log.motor_velocities(row), [[-333.0, 333.0, 0]])


def test_a_cut_log_is_refused(tmp_path: Path) -> None:
    log = text(made_log())
    with pytest.raises(InputError, match="cells, but there are 13 columns"):
        read_recording(written(tmp_path, log[:2000], "cut.txt"))
    with pytest.raises(InputError, match="position2 is 'x'"):
        read_recording(written(tmp_path, " x ".join(log.rsplit(" 510 ", 1)), "word.txt"))


@pytest.mark.parametrize("rig", [None, "prototype"])
def test_logs_are_of_the_prototypes_pitch_drive(rig: str | None, tmp_path: Path) -> None:
    described = None if rig is None else Described.load(rig)
    steps = read_recordings(made_files(tmp_path), rig=described)
    down = -1 if rig else 1  # in the rig's sense positive pitch is down, and these steps go up
    assert [step.amplitude_deg * down for step in steps] == pytest.approx(STEPS_DEG, abs=0.3)
    number = identify_recordings(steps, described).surrogate
    assert (number.K, number.axis, number.motor) == (pytest.approx(0.75, rel=0.002), "pitch", "motor1 + motor3")
    assert (number.speed_limit, number.range) == (698.0, (-90.0, 90.0))
    pitch = replay(steps).pitch_deg
    np.testing.assert_allclose((pitch[:, -1] - pitch[:, 0]) * -down, [s.eye_deg[-1] for s in steps], rtol=0.03)


def test_command_on_logs(tmp_path: Path) -> None:
    out, logs = tmp_path / "run", made_files(tmp_path)
    result = Sysid(recording=tuple(logs), out=out).run()
    assert result["K"] == pytest.approx(0.75, rel=0.01)
    assert set(result["files"]) == {f.name for f in out.iterdir()} - {"run.json"}
    assert (out / "recordings.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "recording.rrd").stat().st_size > 1000
    assert [h["name"] for h in result["held_out"]] == [path.name for path in logs]


# --- what the real logs say -----------------------------------------------------------------------------


@of_the_prototype
@pytest.mark.parametrize("counts", [100, 200, 300, 400])
def test_vertical_gain_of_the_prototype(counts: int) -> None:
    step = read_recording(PROTOTYPE / f"LTI_dyn_step_{counts}.txt")
    found = identify_recordings([step])
    for gain in (found.surrogate.K, found.preferred.fit["K"].value, step.settled_gain):
        assert gain == pytest.approx(0.75, abs=0.05)
    assert step.source["row_interval_ms"] == pytest.approx(11.5, abs=0.6)  # the same in every log


@of_the_prototype
@pytest.mark.parametrize("counts", [100, 200, 300, 400])
def test_the_prototypes_eye_speaks_for_even_rows(counts: int) -> None:
    even, row_by_row = residuals(PROTOTYPE / f"LTI_dyn_step_{counts}.txt")
    assert even < 0.5 * row_by_row


@of_the_prototype
def test_what_is_odd_about_the_prototypes_logs_is_said() -> None:
    first, second = (" ".join(warnings_of(read_recording(PROTOTYPE / f"LTI_dyn_step_{n}.txt"))) for n in (200, 300))
    assert "Euler" not in first
    assert "misses a sample" not in first
    assert "Euler columns differ from the quaternion by up to 1.7 deg in 37 rows (22 to 58)" in second
    assert "misses a sample before row 9" in second
    assert "the log has no time" in first


@of_the_prototype
@pytest.mark.parametrize(("counts", "step_deg"), [(100, 17.4), (200, 34.7), (300, 52.4), (400, 70.9)])
def test_made_motors_are_as_fast_as_the_real_ones(counts: int, step_deg: float) -> None:
    real = np.loadtxt(PROTOTYPE / f"LTI_dyn_step_{counts}.txt")
    peaks = [np.abs(prototype_log.motor_velocities(log)).max() for log in (real, made_log(step_deg=step_deg))]
    assert peaks[1] == pytest.approx(peaks[0], rel=0.05)
