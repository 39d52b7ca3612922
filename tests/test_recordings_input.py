"""Recorded step responses: the CSV format, what `simulate` writes, the prototype's logs, and bad input."""

from pathlib import Path

import numpy as np
import pytest

from orient_eye.cli.sysid import Sysid
from orient_eye.errors import InputError
from orient_eye.plants import make_plant
from orient_eye.sysid import identify_recordings, prototype_log, read_recording, read_recordings
from orient_eye.sysid.fit import fit_model
from orient_eye.sysid.models import MODELS
from orient_eye.sysid.recording_checks import warnings_of

DATA = Path(__file__).parent / "data"
LOGS = sorted(DATA.glob("LTI_dyn_step_*.txt"))


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
    path = plant.simulate(command)[0].to_csv(tmp_path / "trajectory.csv")
    found = identify_recordings(read_recordings([path], "motor2", "yaw"))
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


BAD = {
    "": "is empty",
    "t_s,motor_deg,eye_deg\n": "0 rows",
    table(7): "7 rows of numbers; a step response needs at least 8",
    table().replace(",", ";"): "commas between its cells",
    table(eye_deg=None): "no angle of the eye",
    table(motor_deg=None): "no column tau2_deg",
    table().replace("motor_deg", "eye_deg"): "a column twice",
    table()[:-20] + "\n0.7,1": "2 cells, but there are 3 columns",
    table().replace(",13,", ",thirteen,", 1): "line 3: motor_deg is 'thirteen'",
    table().replace(",13,", ",nan,", 1): "motor_deg is not a finite number in row 2",
    table().replace(",13,", ",,", 1): "motor_deg is not a finite number in row 2",
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
        with pytest.raises(InputError, match="cannot read the recording"):
            read_recording(path)
    good = written(tmp_path, table())
    with pytest.raises(InputError, match="named twice"):
        read_recordings([good, tmp_path / ".." / tmp_path.name / "step.csv"])
    with pytest.raises(InputError, match=r"2 rows until 0\.03 s"):
        read_recordings([good], until=0.03)


def test_recordings_that_tell_little_are_warned_of(tmp_path: Path) -> None:
    time = np.linspace(0, 0.6, 30)
    moving = read_recording(written(tmp_path, table(motor_deg=20 * time)))
    assert "moves until the end" in " ".join(warnings_of(moving))
    creeping = read_recording(written(tmp_path, table(eye_deg=15 * (1 - np.exp(-60 * time)) + 3 * time)))
    assert "creeps" in " ".join(warnings_of(creeping))
    coarse = read_recording(written(tmp_path, table(eye_deg=15.0 * (time > 0.05))))
    assert "only 0 rows" in " ".join(warnings_of(coarse))
    assert warnings_of(read_recording(written(tmp_path, table()))) == []


# --- logs of the prototype ------------------------------------------------------------------------------


@pytest.mark.parametrize("path", LOGS, ids=lambda p: p.stem)
def test_vertical_gain_of_the_prototype(path: Path) -> None:
    step = read_recording(path)
    found = identify_recordings([step])
    for gain in (found.surrogate.K, found.preferred.fit["K"].value, step.settled_gain):
        assert gain == pytest.approx(0.75, abs=0.05)
    assert step.source["row_interval_ms"] == pytest.approx(11.5, abs=0.6)  # the same in every log


@pytest.mark.parametrize("path", LOGS, ids=lambda p: p.stem)
def test_the_eye_speaks_for_even_rows(path: Path) -> None:
    """Rows timed one by one, from a velocity column that lags, leave twice the residual."""
    model = MODELS["second_order_dead_time"]
    even, row_by_row = (
        fit_model(model, read_recordings([path], row_times=how, until=0.3)).rms_deg for how in ("even", "row-by-row")
    )
    assert even < 0.5 * row_by_row


def test_what_is_odd_about_a_log_is_said() -> None:
    first, second = (" ".join(warnings_of(read_recording(DATA / f"LTI_dyn_step_{n}.txt"))) for n in (200, 300))
    assert "Euler" not in first
    assert "misses a sample" not in first
    assert "Euler columns differ from the quaternion by up to 1.7 deg in 37 rows (22 to 58)" in second
    assert "misses a sample before row 9" in second
    assert "the log has no time" in first


def made_log(interval_s: float, lag_s: float, rows: int = 60) -> np.ndarray:
    """A log of motors that turn 20 deg each way, with a velocity that lags by a first-order lag."""
    fine = np.arange(0, interval_s * rows, 1e-4)
    way = 20 / (1 + np.exp(-(fine - 0.2) / 0.02))
    speed, lagging = np.gradient(way, fine), np.zeros_like(fine)
    for k in range(1, fine.size):
        lagging[k] = lagging[k - 1] + 1e-4 / lag_s * (speed[k] - lagging[k - 1])
    at = (np.arange(rows) * interval_s / 1e-4).round().astype(int)
    log = np.zeros((rows, 13))
    position, velocity = way[at] / prototype_log.POSITION_UNIT_DEG, lagging[at] / prototype_log.VELOCITY_UNIT_DEG_S
    log[:, 0], log[:, 2] = (400 + position).round(), (600 - position).round()
    log[:, 3], log[:, 5] = velocity.round(), np.where(velocity.round() > 0, 1024 + velocity.round(), 0)
    half = np.deg2rad(-0.75 * 2 * way[at]) / 2
    log[:, 6], log[:, 8] = np.cos(half), np.sin(half)
    log[:, 11] = np.rad2deg(2 * half)
    return log


@pytest.mark.parametrize("interval_s", [0.008, 0.0115, 0.02])
def test_time_of_a_log_is_found(interval_s: float) -> None:
    step = prototype_log.step_response("made", made_log(interval_s, 0.015))
    assert step.source["row_interval_ms"] == pytest.approx(1e3 * interval_s, rel=0.03)
    assert step.source["velocity_lag_ms"] == pytest.approx(15, abs=2.5)
    assert step.settled_gain == pytest.approx(0.75, rel=0.01)
    np.testing.assert_allclose(np.diff(step.time), step.source["row_interval_ms"] / 1e3)


def test_motors_that_hardly_move_leave_the_nominal_time() -> None:
    log = made_log(0.0115, 0.015)
    log[:, 3:6] = 0
    step = prototype_log.step_response("made", log)
    np.testing.assert_allclose(np.diff(step.time), 0.010)
    assert "10 ms apart" in " ".join(step.warnings)


def test_negative_velocities_are_decoded() -> None:
    row = np.zeros((1, 13))
    row[0, 3:6] = 1524, 500, 0
    np.testing.assert_allclose(prototype_log.motor_velocities(row), [[-333.0, 333.0, 0]])


def test_a_cut_log_is_refused(tmp_path: Path) -> None:
    text = (DATA / "LTI_dyn_step_200.txt").read_text()
    with pytest.raises(InputError, match="cells, but there are 13 columns"):
        read_recording(written(tmp_path, text[:2000], "cut.txt"))
    with pytest.raises(InputError, match="position2 is 'x'"):
        read_recording(written(tmp_path, text.replace(" 509 ", " x ", 1), "word.txt"))


def test_command_on_logs(tmp_path: Path) -> None:
    out = tmp_path / "run"
    result = Sysid(recording=tuple(LOGS), out=out).run()
    assert result["K"] == pytest.approx(0.75, abs=0.05)
    assert set(result["files"]) == {f.name for f in out.iterdir()} - {"run.json"}
    assert (out / "recordings.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "recording.rrd").stat().st_size > 1000
    assert [h["name"] for h in result["held_out"]] == [path.name for path in LOGS]
