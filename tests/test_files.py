"""What is read and written: motor commands, trajectories, surrogates; whole or not at all, and errors that help."""

import io
import json
import os
import shutil
import socket
import stat
import subprocess
import sys
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fuzzing import budget
from orient_eye import files
from orient_eye.commands.motor_file import WrittenCommand, read_command, write_command
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model, model_hash
from orient_eye.files import (
    read_bytes,
    read_json,
    remove_leftovers,
    write_atomically,
    write_json,
    write_table,
    write_text,
)
from orient_eye.motor import Motor
from orient_eye.movement.trajectory import Trajectory, concatenate
from orient_eye.plants import Plant, make_plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.recording import record
from orient_eye.resources import data_folder, user_cache
from orient_eye.rotations import from_yaw
from orient_eye.run_directory import RunDirectory, versions
from orient_eye.surrogate import Surrogate

Array = NDArray[np.float64]

posix = pytest.mark.skipif(os.name != "posix", reason="permissions, links and pipes are POSIX'")


def run(code: str, *arguments: str | Path, check: bool = True, **options: Any) -> "subprocess.CompletedProcess[str]":
    """Python code in a process of its own."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.run([sys.executable, "-c", code, *map(str, arguments)], text=True, check=check, **options)


# --- motor commands -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def eye() -> Plant:
    return make_plant("mujoco")


def write(folder: Path, text: str) -> Path:
    path = folder / "command.csv"
    path.write_text(text, encoding="utf-8")
    return path


def told(path: Path, plant: Plant, horizon_s: float | None = None) -> Array:
    """What a plant tells its motors when it performs the file, (time, motors)."""
    return plant.move(read_command(path, plant.motors), horizon_s=horizon_s).trajectory().command[0]


def test_command_is_straight_lines_at_the_plants_step(tmp_path: Path, eye: Plant) -> None:
    path = write(tmp_path, "t_s,tau1_deg,tau2_deg,tau3_deg\n0,0,1,0\n0.0105,0,11.5,-3\n0.02,5,11.5,0\n")
    command = read_command(path, eye.motors)
    assert (len(command), command.duration_s, command.saturates) == (1, 0.02, False)
    knots = [0, 0.0105, 0.02]
    for step_s, samples in ((0.001, 21), (0.0002, 101), (0.0007, 50)):
        t = step_s * np.arange(samples)
        expected = [np.interp(t, knots, values) for values in ([0, 0, 5], [1, 11.5, 11.5], [0, -3, 0])]
        sampled = command.sample(step_s, samples)
        assert sampled.shape == (1, samples, 3)
        np.testing.assert_allclose(sampled[0].T, expected, rtol=0, atol=1e-12)
    moved = eye.move(command).trajectory()
    np.testing.assert_allclose(moved.time, 0.001 * np.arange(21), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(moved.command, command.sample(0.001, 21))


@settings(deadline=None, max_examples=40, derandomize=True)
@given(
    gaps=st.lists(st.floats(0.0003, 0.05), min_size=1, max_size=8),
    start=st.floats(-2, 100),
    seed=st.integers(0, 2**30),
)
def test_uneven_sampling(tmp_path_factory: pytest.TempPathFactory, gaps: list[float], start: float, seed: int) -> None:
    """Any sampling, from any time on: numpy's interpolation of the same rows."""
    t = start + np.concatenate([[0], np.cumsum(gaps)])
    assume(t[-1] - t[0] >= 2e-3)
    tau = np.random.default_rng(seed).uniform(-40, 40, len(t))
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(t.tolist(), tau.tolist(), strict=True))
    command = told(write(tmp_path_factory.mktemp("csv"), f"t_s,tau2_deg\n{rows}\n"), LinearPlant())[:, 0]
    assert len(command) == round((t[-1] - t[0]) / 0.001) + 1
    at = t[0] + 0.001 * np.arange(len(command))
    np.testing.assert_allclose(command, np.interp(at, t, tau), rtol=0, atol=1e-7)


def test_jumps(tmp_path: Path) -> None:
    """Two rows at one time: the later holds from that time on; the first row is the rest before it."""
    path = write(tmp_path, "t_s,tau2_deg\n0,5\n0,20\n0.003,20\n0.003,7\n0.003,8\n0.0055,8\n0.0055,-1\n0.008,-1\n")
    plant = LinearPlant()
    np.testing.assert_array_equal(told(path, plant)[:, 0], [20, 20, 20, 8, 8, 8, -1, -1, -1])
    command = read_command(path, plant.motors)
    np.testing.assert_array_equal(command.rest, [[5]])
    np.testing.assert_array_equal(command.final, [[-1]])


def test_the_last_row_is_held_and_the_horizon_cuts(tmp_path: Path) -> None:
    path = write(tmp_path, "t_s,tau2_deg\n0,0\n0.004,8\n")
    plant = LinearPlant()
    np.testing.assert_allclose(told(path, plant, 0.006)[:, 0], [0, 2, 4, 6, 8, 8, 8], atol=1e-9)
    np.testing.assert_allclose(told(path, plant, 0.002)[:, 0], [0, 2, 4], atol=1e-9)
    still = write(tmp_path, "t_s,tau2_deg\n0,12\n0.001,12\n")
    np.testing.assert_array_equal(told(still, plant, 0.003)[:, 0], [12] * 4)


def test_energy_of_a_written_command() -> None:
    """Of straight lines the sum of step^2 / duration, over all motors."""
    command = WrittenCommand(np.array([0, 0.01, 0.05]), np.array([[0.0, 1.0], [5.0, 1.0], [-5.0, 3.0]]))
    np.testing.assert_allclose(command.energy(), [25 / 0.01 + 100 / 0.04 + 4 / 0.04], rtol=1e-9)
    assert command.too_fast.tolist() == [False]


def test_columns_in_any_order_and_motors_left_out(tmp_path: Path, eye: Plant) -> None:
    path = write(tmp_path, "tau3_deg, t_s ,tau1_deg\n1,0,4\n2,0.001,5\n")
    np.testing.assert_array_equal(told(path, eye), [[4, 0, 1], [5, 0, 2]])
    command = read_command(path, eye.motors)
    np.testing.assert_array_equal(command.rest, [[4, 0, 1]])
    np.testing.assert_array_equal(command.final, [[5, 0, 2]])


def test_columns_are_named_as_the_motors(tmp_path: Path) -> None:
    path = write(tmp_path, "t_s,servo_mm,tau12_deg\n0,1,2\n0.5,3,4\n")
    motors = (Motor("motor12"), Motor("servo", "mm"))
    np.testing.assert_array_equal(read_command(path, motors).positions, [[2, 1], [4, 3]])
    with pytest.raises(InputError, match=r"cannot be commanded by servo_mm; its columns are t_s, tau12_deg "):
        read_command(path, motors[:1])


def test_a_motor_the_plant_lacks_may_stand_at_0(tmp_path: Path) -> None:
    path = write(tmp_path, "t_s,tau1_deg,tau2_deg,tau3_deg\n0,0,1,0\n0.001,0,2,0\n")
    np.testing.assert_array_equal(told(path, LinearPlant()), [[1], [2]])
    path = write(tmp_path, "t_s,tau1_deg,tau2_deg,tau3_deg\n0,0,1,0\n0.001,0,2,0.5\n")
    message = r"this plant cannot be commanded by tau3_deg; its columns are t_s, tau2_deg \(.* must be 0\)"
    with pytest.raises(InputError, match=message):
        read_command(path, LinearPlant().motors)


def test_spreadsheets_byte_order_mark_and_blank_lines(tmp_path: Path) -> None:
    path = tmp_path / "command.csv"
    path.write_bytes("\ufefft_s,tau2_deg\r\n0,1\r\n\r\n0.001,2\r\n\r\n".encode())
    np.testing.assert_array_equal(told(path, LinearPlant()), [[1], [2]])
    path.write_bytes("t_s;tau2_deg\r\n0;1,5\r\n0,001;2\r\n".encode("utf-16"))
    np.testing.assert_array_equal(told(path, LinearPlant()), [[1.5], [2]])


def test_a_written_command_is_read_again(tmp_path: Path, eye: Plant) -> None:
    time, positions = np.array([0, 0, 0.125, 0.5]), np.array([[1.5, 0, 2], [0, 0, 1], [3, 1, 2], [4, -5, 0.25]])
    path = write_command(tmp_path / "new" / "command.csv", eye.motors, time, positions)
    command = read_command(path, eye.motors)
    np.testing.assert_array_equal(command.time, time)
    np.testing.assert_array_equal(command.positions, positions)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"is empty; it needs a header \(t_s,tau1_deg,tau2_deg,tau3_deg\) and rows of numbers"),
        ("t_s,tau2_deg\n", "has no rows of numbers below its header; the header reads t_s, tau2_deg"),
        ("time,tau2_deg\n0,1\n1,2\n", r"has the columns time, tau2_deg; it needs t_s \[s\] and tau1_deg, tau2"),
        ("0,1\n1,2\n", "begins with numbers; its first line must name the columns: t_s,tau1_deg"),
        ("t_s,tau2_deg\n0,1\n0.1,abc\n", r"line 3: tau2_deg is 'abc', not a number"),
        ("t_s,tau2_deg\n0,1\n0.1\n", r"line 3: 1 cells, but there are 2 columns \(t_s, tau2_deg\)"),
        ("t_s,tau2_deg\n0,1,9\n0.1,2,9\n", "line 2: 3 cells, but there are 2 columns"),
        ("t_s,tau2_deg\n0,1\n0.1,nan\n", "line 3: tau2_deg is not a finite number; mend that row"),
        ("t_s,tau2_deg\n0,1\n0.1,\n", "line 3: tau2_deg is not a finite number"),
        ("t_s,tau2_deg\n0,inf\n0.1,2\n", "line 2: tau2_deg is not a finite number"),
        ("t_s,tau2_deg\n0,1\n-inf,2\n", "line 3: t_s is not a finite number"),
        ("t_s,tau2_deg,tau7_deg\n0,1,0\n0.1,2,\n", "line 3: tau7_deg is not a finite number"),
        ("t_s,tau2_deg\n0,1\n0.2,2\n0.1,2\n", "line 4: time must rise .* t_s = 0.1 follows 0.2; sort the rows"),
        ("t_s,tau2_deg,tau2_deg\n0,1,1\n0.1,2,2\n", "a column stands twice in the header t_s, tau2_deg, tau2_deg"),
        ("t_s,tau7_deg\n0,1\n0.1,2\n", r"cannot be commanded by tau7_deg; its columns are t_s, tau1"),
        ("t_s,velocity\n0,0\n0.1,0\n", "cannot be commanded by velocity"),
        ("t_s\n0\n0.1\n", "commands no motor; add a column, one of tau1_deg, tau2_deg, tau3_deg"),
        ("t_s,tau7_deg\n0,0\n0.1,0\n", "commands no motor"),
        ("t_s,tau2_deg\n0,1\n", "a command lasts up to one hour, this one 0 s"),
        ("t_s,tau2_deg\n0,1\n5000,1\n", "a command lasts up to one hour, this one 5000 s"),
    ],
)
def test_bad_command_files_are_refused(tmp_path: Path, eye: Plant, text: str, message: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=message):
        read_command(path, eye.motors)


def test_every_error_names_the_file(tmp_path: Path, eye: Plant) -> None:
    for text in ("", "time\n0\n", "t_s,tau2_deg\n0,x\n", "t_s,tau7_deg\n0,1\n1,1\n", "t_s\n0\n1\n"):
        path = write(tmp_path, text)
        with pytest.raises(InputError, match=r"command\.csv"):
            read_command(path, eye.motors)


def test_line_numbers_count_blank_lines(tmp_path: Path, eye: Plant) -> None:
    """The number is the editor's, so that the line is found."""
    with pytest.raises(InputError, match="line 5"):
        read_command(write(tmp_path, "t_s,tau2_deg\n\n0,1\n\n0.1,abc\n"), eye.motors)
    with pytest.raises(InputError, match="line 6: time must rise"):
        read_command(write(tmp_path, "t_s,tau2_deg\n\n0,1\n0.2,1\n\n0.1,1\n"), eye.motors)


def test_files_that_cannot_be_read(tmp_path: Path, eye: Plant) -> None:
    with pytest.raises(InputError, match=r"cannot read .*nowhere\.csv"):
        read_command(tmp_path / "nowhere.csv", eye.motors)
    with pytest.raises(InputError, match="cannot read"):
        read_command(tmp_path, eye.motors)
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\x93NUMPY\x01\x00" * 50)
    with pytest.raises(InputError, match=r"cannot read .*binary\.csv: .*; give a text file"):
        read_command(binary, eye.motors)
    binary.write_bytes(b"\xff\xfe\x00\x01" * 50)  # begins as UTF-16 does
    with pytest.raises(InputError, match=r"binary\.csv has no rows"):
        read_command(binary, eye.motors)


# --- inputs of any kind ---------------------------------------------------------------------------


def fifo(folder: Path) -> Path:
    path = folder / "pipe"
    os.mkfifo(path)
    return path


@posix
def test_what_a_unix_user_gives_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Links, pipes of a slow writer, a shell's <(...), /dev/stdin, /dev/null; all up to their end."""
    monkeypatch.setattr(files, "_PATIENCE_S", 0.3)
    content = b"line\n" * 100_000  # more than a pipe holds
    real = tmp_path / "real.txt"
    real.write_bytes(content)
    (tmp_path / "link.txt").symlink_to("real.txt")
    assert read_bytes(tmp_path / "link.txt", most=len(content), hint="") == content
    assert read_bytes("/dev/null", most=10, hint="") == b""

    def write_late(path: Path | int) -> None:
        with open(path, "wb") as pipe:
            time.sleep(0.6)  # longer than one waits for somebody to come
            pipe.write(content)

    pipe, (end, other) = fifo(tmp_path), os.pipe()
    with ThreadPoolExecutor(2) as writers:
        writers.submit(write_late, pipe)
        writers.submit(write_late, other)
        assert read_bytes(pipe, most=len(content), hint="") == content
        assert read_bytes(f"/dev/fd/{end}", most=len(content), hint="") == content
    os.close(end)
    code = (
        "import sys; from orient_eye.files import read_bytes; print(len(read_bytes('/dev/stdin', most=9**9, hint='')))"
    )
    assert run(code, input="x" * 200_000).stdout == "200000\n"


@posix
@pytest.mark.parametrize("kind", ["pipe", "endless", "folder", "socket", "nul", "loop", "nowhere", "too long", "below"])
def test_what_cannot_be_read_says_so_in_seconds(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_PATIENCE_S", 0.2)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "file").write_text("")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        path, why = {
            "pipe": (fifo(tmp_path), "it is a pipe, and nobody writes to it"),
            "endless": ("/dev/zero", "it is larger than 1 MB"),
            "folder": (tmp_path, "Is a directory"),
            "socket": ("socket", "No such device"),
            "nul": ("a\0b", "a file name holds no NUL"),
            "loop": ("loop", "symbolic links"),
            "nowhere": ("nowhere", "No such file or directory"),
            "too long": ("x" * 300, "name too long"),
            "below": ("file/x", "Not a directory"),
        }[kind]
        begun = time.monotonic()
        with pytest.raises(InputError, match=rf"^cannot read .*{why}.*; give another$") as caught:
            read_bytes(path, most=2**20, hint="give another")
        assert time.monotonic() - begun < 5
        assert "Errno" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    ["", "{", "NaN", "[1, -Infinity]", "1e400", '{"a": 1' + "0" * 400 + "}", "[" * 100_000, "[" * 101 + "]" * 101,
     '"\\ud800"', "\xff", '{"a": ' * 5000],
)  # fmt: skip
def test_json_that_no_file_of_ours_holds(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.json"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(InputError, match=r"^cannot read .*a\.json: .*; give another$") as caught:
        read_json(path, hint="give another")
    assert len(str(caught.value)) < 1000


@given(
    value=st.recursive(
        st.none() | st.booleans() | st.integers(-(10**20), 10**20) | st.floats(-1e300, 1e300) | st.text(),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
        max_leaves=8,
    )
)
@budget(50)
def test_json_comes_back(tmp_path_factory: pytest.TempPathFactory, value: Any) -> None:
    assert read_json(write_json(tmp_path_factory.mktemp("json") / "a.json", value), hint="") == value


def test_numbers_that_json_does_not_have_are_null(tmp_path: Path) -> None:
    path = write_json(tmp_path / "a.json", {"a": np.array([1.0, np.nan]), "b": (np.inf, np.int64(2)), "c": tmp_path})
    assert read_json(path, hint="") == {"a": [1.0, None], "b": [None, 2], "c": str(tmp_path)}


# --- eyes -----------------------------------------------------------------------------------------


@posix
def test_eyes_that_were_edited_or_cut_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each says what is wrong with which file, and MuJoCo leaves no log in the working folder."""
    monkeypatch.chdir(tmp_path)
    good = (data_folder("eye_mjcf") / "eye3.xml").read_text(encoding="utf-8")
    (tmp_path / "meshes").symlink_to(data_folder("eye_mjcf") / "meshes")
    path = tmp_path / "own.xml"
    path.write_text(good, encoding="utf-8")
    assert model_hash(build_model(str(path))) == model_hash(build_model("thesis"))
    for text, told in {
        good[: len(good) // 2]: "XML",
        good.replace('joint="motor2"', 'joint="other"'): "it has no joint 'other'",
        good.replace('<joint name="eye"', '<joint name="ball"'): "it has no joint 'eye'",
        good.replace('name="orientation"', 'name="facing"'): "orientation",
        good.replace("sclera.stl", "nowhere.stl"): "nowhere.stl",
        good.replace('damping="', 'damping="nan" user="', 1): "friction nan",
        good.replace('damping="0.02"', 'damping="0"'): "friction 0",
        good.replace('armature="1"', 'armature="0"'): "motor 'motor1' has armature 0",
        "": "own.xml",
        "<mujoco/>": "it has no body 'eye'",
    }.items():
        assert text != good
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=rf"own\.xml(?s:.*)({told})(?s:.*)(howto/eye\.md|is no eye)"):
            build_model(str(path))
    path.unlink()
    for make in (lambda: os.mkfifo(path), lambda: (path.unlink(), path.mkdir())):
        make()
        with pytest.raises(InputError, match=r"own\.xml is no eye: there is no such file; give an MJCF file"):
            build_model(str(path))
    assert sorted(each.name for each in tmp_path.iterdir()) == ["meshes", "own.xml"]


def test_a_user_without_a_home_has_a_cache_until_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless(*_: str) -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr("platformdirs.user_cache_path", homeless)
    one = write_text(user_cache("weights") / "a.json", "{}")
    assert one == user_cache("weights") / "a.json"
    code = """
import platformdirs
def homeless(*_):
    raise RuntimeError
platformdirs.user_cache_path = homeless
from orient_eye.resources import user_cache
print(user_cache("weights"))
"""
    assert not Path(run(code).stdout.strip()).parent.exists()


# --- trajectories ---------------------------------------------------------------------------------


def trajectory(saccades: int = 3) -> Trajectory:
    """MuJoCo's, the last saccade failed."""
    plant = MujocoPlant(threads=1)
    command = np.tile(np.linspace(0, 9, 12)[None, :, None], (saccades, 1, 3))
    if saccades > 1:
        command[-1, 5, 0] = np.nan
    return plant.move(command).trajectory()


def flat(saccades: int, samples: int, step_s: float = 0.001) -> Trajectory:
    """Of a plant without tendons."""
    return LinearPlant(step_s=step_s).move(np.ones((saccades, samples, 1))).trajectory()


def same(one: Trajectory, other: Trajectory) -> None:
    for name, value in vars(one).items():
        found = getattr(other, name)
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(found, value, err_msg=name)
            assert found.dtype == value.dtype
        else:
            assert found == value


def as_stored(one: Trajectory) -> Trajectory:
    """Of the motors, names and units are kept."""
    return replace(one, motors=tuple(Motor(motor.name, motor.unit) for motor in one.motors))


def test_units_of_motors_are_kept(tmp_path: Path) -> None:
    one = replace(flat(1, 5), motors=(Motor("servo", "mm"),))
    assert Trajectory.load_npz(one.save_npz(tmp_path / "servo.npz")).motors == one.motors


@pytest.mark.parametrize("kind", ["tendons", "none"])
def test_trajectory_npz_round_trip(tmp_path: Path, kind: str) -> None:
    """Bit for bit, failed saccades included, and nothing that needs pickle."""
    one = trajectory() if kind == "tendons" else flat(2, 5)
    path = one.save_npz(tmp_path / "new" / "folder" / "saccades.npz")
    assert path == tmp_path / "new" / "folder" / "saccades.npz"
    same(as_stored(one), Trajectory.load_npz(path))
    absent = {"motors"} if one.tension is not None else {"motors", "tension"}
    with np.load(path, allow_pickle=False) as file:
        assert set(file.files) == set(vars(one)) - absent | {"motor_names", "motor_units"}
        assert "O" not in {file[name].dtype.kind for name in file.files}
    assert [p.name for p in path.parent.iterdir()] == ["saccades.npz"]


def test_npz_under_any_name(tmp_path: Path) -> None:
    """The file has the name that was asked for, whatever its ending, and lies there alone."""
    one = trajectory()
    path = one.save_npz(tmp_path / "saccades")
    same(as_stored(one), Trajectory.load_npz(path))
    assert [p.name for p in tmp_path.iterdir()] == ["saccades"]


def test_trajectory_csv_round_trip(tmp_path: Path) -> None:
    one = trajectory()[0]
    one = replace(one, command=one.command + 0.5)  # so that it stands apart from the motors
    path = one.to_csv(tmp_path / "trajectory.csv")
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0] == (
        "t_s,q_w,q_x,q_y,q_z,yaw_deg,pitch_deg,roll_deg,omega_x_deg_s,omega_y_deg_s,omega_z_deg_s,"
        "tau1_deg,tau2_deg,tau3_deg,command_tau1_deg,command_tau2_deg,command_tau3_deg,tension_motor1_upper_N,tension_motor1_lower_N,tension_motor2_right_N,"
        "tension_motor2_left_N,tension_motor3_upper_N,tension_motor3_lower_N"
    )
    table = np.genfromtxt(path, delimiter=",", names=True)
    assert len(table) == len(one.time)
    assert one.tension is not None
    expected = [one.time, *one.orientation[0].T, one.yaw_deg[0], one.pitch_deg[0], one.roll_deg[0]]
    expected += [*one.angular_velocity[0].T, *one.motor[0].T, *one.command[0].T, *one.tension[0].T]
    for name, column in zip(table.dtype.names, expected, strict=True):
        np.testing.assert_allclose(table[name], column, rtol=1e-8, atol=1e-12, err_msg=name)


def test_a_trajectorys_csv_is_a_command(tmp_path: Path) -> None:
    """Its tau columns can be simulated again: the rest of the columns is taken out first."""
    plant = LinearPlant()
    one = plant.move(np.linspace(0, 9, 12)[None, :, None]).trajectory()
    lines = one.to_csv(tmp_path / "trajectory.csv").read_text(encoding="utf-8").splitlines()
    keep = [lines[0].split(",").index(name) for name in ("t_s", Motor("motor2").column)]
    text = "\n".join(",".join(line.split(",")[i] for i in keep) for line in lines)
    again = plant.move(read_command(write(tmp_path, text), plant.motors)).trajectory()
    np.testing.assert_allclose(again.motor, one.motor, atol=1e-7)
    np.testing.assert_allclose(again.orientation, one.orientation, atol=1e-9)


def test_csv_of_a_batch_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"one saccade, this trajectory has 3; pick one: trajectory\[0\]"):
        trajectory().to_csv(tmp_path / "trajectory.csv")
    assert list(tmp_path.iterdir()) == []


def bad_npz(folder: Path) -> dict[str, bytes]:
    one = trajectory(1)
    good = one.save_npz(folder / "good.npz")

    def told(**other: Array) -> bytes:
        return replace(one, **other).save_npz(folder / "told.npz").read_bytes()

    def packed(name: str, content: bytes) -> bytes:
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(name, content)
        return file.getvalue()

    header = b"\x93NUMPY\x01\x00" + (118).to_bytes(2, "little")
    hole = one.orientation.copy()
    hole[0, 3] = np.nan
    other = folder / "other.npz"
    np.savez(other, a=np.zeros(3))
    pickled = folder / "pickled.npz"
    np.savez(pickled, motor_names=np.array([{}], dtype=object))
    array = folder / "array.npy"
    np.save(array, np.zeros(3))
    whole = good.read_bytes()
    return {
        "other arrays": other.read_bytes(),
        "pickle": pickled.read_bytes(),
        "one array": array.read_bytes(),
        "half a file": whole[: len(whole) // 2],
        "nothing": b"",
        "text": b"t_s,q_w\n0,1\n",
        "damaged": whole[:200] + bytes(100) + whole[300:],
        "a strange header": packed("tendon_names.npy", header + b"(" * 118),
        "a bomb": packed("tendon_names.npy", bytes(2**24)).replace((2**24).to_bytes(4, "little"), b"\xff\xff\xff\xff"),
        "NaN": told(orientation=hole),
        "a tiny eye": told(orientation=one.orientation * 1e-300),
        "a huge eye": told(orientation=one.orientation * 1e200),
        "another shape": told(motor=one.motor[:, :-1]),
        "whole numbers": told(motor=np.ones(one.motor.shape, int)),
        "time that goes back": told(time=-one.time),
        "time in years": told(time=one.time * 1e9),
    }


def test_files_that_are_no_trajectory_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    for kind, content in bad_npz(tmp_path).items():
        path.write_bytes(content)
        with pytest.raises(
            InputError, match=r"bad\.npz is not a trajectory file: .*; give an \.npz file that orient-eye"
        ):
            pytest.fail(f"{kind}: {Trajectory.load_npz(path)}")


def test_a_missing_trajectory_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot read .*nowhere\.npz: No such file or directory; give an \.npz"):
        Trajectory.load_npz(tmp_path / "nowhere.npz")


def test_picking_and_joining_saccades() -> None:
    one = trajectory()
    assert len(one) == 3
    assert len(one[1]) == 1
    np.testing.assert_array_equal(one[-1].failed, [True])
    np.testing.assert_array_equal(one[1:].motor, one.motor[1:])
    np.testing.assert_array_equal(one[~one.failed].orientation, one.orientation[:2])
    same(one, concatenate([one[0], one[1:]]))
    without = flat(2, 12)
    same(concatenate([without[0], without[1]]), without)
    slower = flat(2, 12, step_s=0.002)
    for first, other in ((one, without), (one, slower), (without, slower)):
        with pytest.raises(InputError, match="same plant and the same times"):
            concatenate([first, other])


# --- atomic writes --------------------------------------------------------------------------------


def test_a_failed_write_keeps_the_old_file(tmp_path: Path) -> None:
    path = write_text(tmp_path / "result.json", "old")

    def fail(temporary: Path) -> None:
        temporary.write_text("half of the n", encoding="utf-8")
        raise OSError("no space left")

    with pytest.raises(InputError, match=r"cannot write .*result\.json: no space left; name another file"):
        write_atomically(path, fail)
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, RuntimeError, InputError])
def test_an_interrupted_write_keeps_the_old_file(tmp_path: Path, error: type[BaseException]) -> None:
    path = write_text(tmp_path / "result.json", "old")

    def interrupt(temporary: Path) -> None:
        raise error("this one")

    with pytest.raises(error, match=r"^this one$"):
        write_atomically(path, interrupt)
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_old_file_is_there_until_the_new_one_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_text(tmp_path / "result.txt", "old")
    done: list[str] = []

    def look(temporary: Path) -> None:
        assert temporary.parent == tmp_path  # the same file system: the last step is one renaming
        assert temporary.suffix == ".txt"
        temporary.write_text("new", encoding="utf-8")
        assert path.read_text(encoding="utf-8") == "old"

    def noted(name: str) -> None:
        function = getattr(os, name)

        def call(*arguments: Any) -> None:
            done.append(name)
            function(*arguments)

        monkeypatch.setattr(os, name, call)

    noted("fsync")
    noted("replace")
    assert write_atomically(path, look) == path
    assert path.read_text(encoding="utf-8") == "new"
    assert list(tmp_path.iterdir()) == [path]
    assert done == ["fsync", "replace"]


@posix
def test_folders_are_made_and_permissions_are_the_users(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        path = write_text(tmp_path / "a" / "b" / "note.txt", "grüße")
        assert path.read_bytes() == "grüße".encode()
        assert path.stat().st_mode & 0o777 == 0o640
        path.chmod(0o604)
        write_text(path, "new")
        assert path.stat().st_mode & 0o777 == 0o604
    finally:
        os.umask(before)


@posix
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("file/out.txt", "Not a directory; a file stands where a folder is needed"),
        ("file/new/out.txt", "Not a directory; a file stands where a folder is needed"),
        (f"{'n' * 300}.txt", "name too long; shorten it"),
        (f"{'n' * 300}/out.txt", "name too long; shorten it"),
        ("folder", "Is a directory; name a file in it"),
        ("nul\0.txt", r"cannot write '.*nul\\x00\.txt'?.*: a file name holds no NUL"),
        ("loop/out.txt", "symbolic links; name another file"),
    ],
)
def test_places_where_no_file_can_be(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "file").write_text("old")
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError, match=message):
        write_text(tmp_path / name, "new")
    if name != "folder":
        with pytest.raises(InputError, match=message):
            RunDirectory.create(tmp_path / name / "run", "simulate", {})
    assert sorted(tmp_path.rglob("*")) == before


@posix
def test_places_that_may_not_be_written(tmp_path: Path) -> None:
    """By a user without privileges, whatever the tests run as."""
    code = """
import os
from pathlib import Path
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model, model_hash
from orient_eye.files import write_text
from orient_eye.run_directory import RunDirectory
if os.getuid() == 0:
    os.setuid(65534)
for write in (
    lambda: write_text("closed/out.txt", "new"),
    lambda: write_text("closed/new/out.txt", "new"),
    lambda: write_text("kept.txt", "new"),
    lambda: RunDirectory.create(Path("closed/run"), "simulate", {}),
):
    try:
        write()
    except InputError as error:
        print(error)
"""
    closed, kept = tmp_path / "closed", write_text(tmp_path / "kept.txt", "old")
    closed.mkdir()
    for path, mode in ((closed, 0o555), (kept, 0o444), (tmp_path, 0o777)):
        path.chmod(mode)
    lines = run(code, cwd=tmp_path).stdout.splitlines()
    assert len(lines) == 4
    assert all("Permission denied; name a place that you may write to" in line for line in lines)
    assert kept.read_text() == "old"
    assert sorted(tmp_path.rglob("*")) == [closed, kept]


@posix
def test_symbolic_links_are_followed(tmp_path: Path) -> None:
    real = write_text(tmp_path / "store" / "real.txt", "old")
    link = tmp_path / "link.txt"
    link.symlink_to("store/real.txt")
    assert write_text(link, "new") == link
    assert link.is_symlink()
    assert real.read_text() == "new"
    dangling = tmp_path / "later.txt"
    dangling.symlink_to("store/later.txt")
    write_text(dangling, "new")
    assert (tmp_path / "store" / "later.txt").read_text() == "new"
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["later.txt", "later.txt", "link.txt", "real.txt", "store"]


@posix
def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.npz"
    os.mkfifo(pipe)
    with ThreadPoolExecutor(1) as reader:
        content = reader.submit(pipe.read_bytes)
        write_atomically(pipe, lambda temporary: np.savez(temporary, a=np.arange(3)))
    np.testing.assert_array_equal(np.load(io.BytesIO(content.result()))["a"], [0, 1, 2])
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert list(tmp_path.iterdir()) == [pipe]


@posix
def test_a_pipe_that_nobody_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_PATIENCE_S", 0.2)
    with pytest.raises(InputError, match=r"pipe: .*; it is a pipe that nobody reads"):
        write_text(fifo(tmp_path), "anything")
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="no /dev/full, the device that is always full")
def test_a_device_is_written_to(tmp_path: Path) -> None:
    """One of our own for root, whom nothing keeps from replacing those of the machine."""
    device = tmp_path / "out.txt"
    if os.getuid():
        device.symlink_to("/dev/full")
    else:
        try:
            os.mknod(device, 0o666 | stat.S_IFCHR, os.stat("/dev/full").st_rdev)
        except PermissionError:
            pytest.skip("no device may be made here")
    with pytest.raises(InputError, match=r"out\.txt: No space left on device; make room there"):
        write_text(device, "anything")
    assert device.is_char_device()
    assert list(tmp_path.iterdir()) == [device]


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="no /dev/stdout")
@pytest.mark.parametrize("name", ["link.txt", "out.txt"])
def test_standard_output_is_not_cut_off(tmp_path: Path, name: str) -> None:
    """Neither a pipe nor a file that the shell sends it to, under any name."""
    code = """
import sys
from orient_eye.files import write_text
print("before", flush=True)
write_text(sys.argv[1], "table\\n")
print("after")
"""
    out, link = tmp_path / "out.txt", tmp_path / "link.txt"
    link.symlink_to("/dev/stdout")
    with out.open("w") as file:
        run(code, tmp_path / name, stdout=file)
    assert out.read_text() == "before\ntable\nafter\n"
    if name == "link.txt":
        assert run(code, link).stdout == "before\ntable\nafter\n"


@posix
def test_leftovers_of_killed_processes(tmp_path: Path) -> None:
    """All of them, in folders below too, and nothing else."""
    code = """
import os, sys
from orient_eye.files import write_atomically
for name in sys.argv[1:]:
    if os.fork() == 0:
        write_atomically(name, lambda temporary: os._exit(9))
    os.wait()
"""
    kept = [write_text(tmp_path / name, "kept") for name in (".hidden", ".tmp-orient-eye.txt", "a-0123.tmp-orient-eye")]
    run(code, "metrics.csv", "stages/000.npz", "no suffix", f"{'ü' * 120}.txt", f"long.{'x' * 200}", cwd=tmp_path)
    assert len([path for path in tmp_path.rglob("*") if path.is_file()]) == 8
    removed = remove_leftovers(tmp_path)
    assert len(removed) == 5
    assert {path.suffix for path in removed} == {".csv", ".npz", ".tmp-orient-eye", ".txt"}
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == sorted(kept)
    assert remove_leftovers(tmp_path) == remove_leftovers(tmp_path / "nowhere") == []


def test_a_run_names_what_computes_and_what_stores_weights() -> None:
    found = versions()
    for package in ("mujoco", "numpy", "torch", "safetensors"):
        assert found[package] == metadata.version(package)


def test_table(tmp_path: Path) -> None:
    path = write_table(tmp_path / "table.csv", [{"a": 1, "b": "x,y"}, {"a": 2.5, "b": None}])
    assert path.read_bytes().replace(b"\r", b"") == b'a,b\n1,"x,y"\n2.5,\n'
    with pytest.raises(InputError, match=r"table\.csv: a table needs at least one row"):
        write_table(path, [])
    assert path.read_text().startswith("a,b")


def test_a_recording_that_came_out_damaged_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the SDK returns: an older one stays."""
    path = record(tmp_path / "a.rrd", flat(1, 5))
    whole = path.read_bytes()
    for damaged in (whole[:-3], whole[3:], b""):
        monkeypatch.setattr("orient_eye.recording.stream._recorded", lambda *_, found=damaged: found)
        with pytest.raises(InputError, match=r"a\.rrd: the recording came out damaged; name another file"):
            record(path, flat(1, 5))
    assert path.read_bytes() == whole
    assert list(tmp_path.iterdir()) == [path]


FILL = """
import sys
from pathlib import Path
import numpy as np
from matplotlib.figure import Figure
from orient_eye import figures, files
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model, model_hash
from orient_eye.plants.linear import LinearPlant
from orient_eye.recording import record
from orient_eye.resources import data_folder, user_cache

folder = Path(sys.argv[1])
noise = np.random.default_rng(0).random(30_000)
figure = Figure(figsize=(9, 9))
figure.subplots().imshow(noise.reshape(150, 200))
writers = {
    "out.txt": lambda path: files.write_text(path, str(noise.tolist())),
    "out.csv": lambda path: files.write_table(path, [{"noise": x} for x in noise]),
    "out.npz": lambda path: files.write_atomically(path, lambda file: np.savez(file, noise)),
    "out.png": lambda path: figures.save(figure, path),
    "out.rrd": lambda path: record(path, LinearPlant().move(np.ones((2, 400, 1))).trajectory()),
}
for name in writers:
    (folder / name).write_text("old")
if sys.argv[2] == "limit":
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536))
for name, write in writers.items():
    try:
        write(folder / name)
        print(name, "was written")
    except InputError as error:
        print(error)
assert sorted(path.name for path in folder.iterdir()) == sorted(writers)
assert {path.read_text() for path in folder.iterdir()} == {"old"}
"""


@posix
def test_a_full_disk_leaves_every_old_file(tmp_path: Path) -> None:
    """A disk of 64 KiB; where none may be mounted, files of 64 KiB at most."""
    script = tmp_path / "fill.py"
    script.write_text(FILL, encoding="utf-8")
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["unshare", "--mount", "sh", "-c", 'mount -t tmpfs -o size=64k tmpfs "$0" && exec "$@"', str(folder)]
    mounts = shutil.which("unshare") is not None and not subprocess.run([*mount, "true"], check=False).returncode
    command = [sys.executable, str(script), str(folder), "disk" if mounts else "limit"]
    done = subprocess.run([*mount, *command] if mounts else command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    reason = "No space left on device" if mounts else "File too large"
    for line, suffix in zip(done.stdout.splitlines(), ("txt", "csv", "npz", "png", "rrd"), strict=True):
        assert f"out.{suffix}: {reason}; make room there or name another place" in line


def test_a_failed_trajectory_write_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = trajectory(1)
    path = one.save_npz(tmp_path / "saccades.npz")
    before = path.read_bytes()

    def fail(file: Any, **arrays: Any) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(InputError, match="disk full"):
        trajectory(1).save_npz(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


# --- surrogates -----------------------------------------------------------------------------------


def test_surrogate_round_trip(tmp_path: Path) -> None:
    details = {"amplitudes": [1.0, 2.0], "n": 3}
    one = Surrogate(-1.23456789012345, 17.499999999999, "motor1", "a rig, Ünit 2", details=details)
    path = one.save(tmp_path / "surrogate.json")
    assert Surrogate.load(path) == Surrogate.load(str(path)) == one
    assert json.loads(path.read_text(encoding="utf-8"))["K"] == one.K


def test_second_order_surrogate_round_trip(tmp_path: Path) -> None:
    limits: dict[str, Any] = {"range": (-30.0, 25.0), "speed_limit": 400.0, "acceleration_limit": 9000.0}
    one = Surrogate(1.9, None, "pan", wn=12.0, zeta=0.9, dead_time=0.008, axis="pitch", amplitudes=(1, 20), **limits)
    assert Surrogate.load(one.save(tmp_path / "surrogate.json")) == one


def test_shipped_surrogate_is_the_thesis() -> None:
    """Thesis 3.3.1."""
    shipped = Surrogate.load("thesis")
    assert (shipped.K, shipped.w0, shipped.motor) == (1.4758, 17.5, "motor2")
    assert "thesis" in shipped.source


GOOD: dict[str, Any] = {"format": "orient-eye surrogate 1", "K": 1.4, "w0": 17.0}


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[1, 2]",
        "3",
        "null",
        "{}",
        json.dumps(GOOD | {"format": "orient-eye surrogate 3"}),
        json.dumps({k: v for k, v in GOOD.items() if k != "K"}),
        json.dumps(GOOD | {"damping": 0.7}),
        json.dumps(GOOD | {"K": "1.4"}),
        json.dumps(GOOD | {"w0": "17"}),
        "\ud800".encode("utf-8", "surrogatepass").decode("latin-1"),
    ],
)
def test_files_that_are_no_surrogate_are_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "surrogate.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(
        InputError, match=r"surrogate\.json( is no surrogate \(|: ).*orient-eye sysid.*shipped.*: mujoco, thesis"
    ):
        Surrogate.load(path)


@pytest.mark.parametrize(
    "values",
    [
        {"K": 0}, {"w0": 0}, {"w0": -17.5}, {"K": 1e300}, {"w0": 1e-300}, {"dead_time": -1}, {"dead_time": "0"},
        {"motor": 3}, {"details": []}, {"rig": "rig.toml"}, {"axis": "tilt"}, {"axis": []}, {"range": [1, 2, 3]},
        {"range": 5}, {"range": ["a", "b"]}, {"intervals": {"K": 1}}, {"speed_limit": 0}, {"w0": True},
    ],
)  # fmt: skip
def test_impossible_surrogates_are_refused(tmp_path: Path, values: dict[str, float]) -> None:
    (name,) = values
    with pytest.raises(InputError, match=rf"{name}|a rig|{{'K': 0.*}}"):
        Surrogate(**({"K": 1.4, "w0": 17.5} | values))
    path = tmp_path / "surrogate.json"
    path.write_text(json.dumps(GOOD | values), encoding="utf-8")
    with pytest.raises(InputError, match=r"surrogate\.json is no surrogate \(.*got .*\); give"):
        Surrogate.load(path)


@pytest.mark.parametrize("values", [{"w0": None}, {"wn": 3.0}, {"zeta": 0.7}, {"wn": 3.0, "zeta": 0.7}])
def test_a_surrogate_is_of_one_order(tmp_path: Path, values: dict[str, Any]) -> None:
    path = tmp_path / "surrogate.json"
    path.write_text(json.dumps(GOOD | values), encoding="utf-8")
    with pytest.raises(InputError, match=r"a surrogate has a gain K .*, and w0, or wn and zeta, got"):
        Surrogate.load(path)


def test_a_missing_surrogate_is_refused(tmp_path: Path) -> None:
    for name, told in ((tmp_path / "nowhere.json", "there is no such file"), ("thesys", "there is no such file"),
                       (tmp_path, "Is a directory"), ("nul\0", "there is no such file")):  # fmt: skip
        with pytest.raises(InputError, match=rf"{told}; give .*shipped.*: mujoco, thesis"):
            Surrogate.load(name)


def test_horizontal_orientations_of_the_csv_are_the_yaw(tmp_path: Path) -> None:
    one = LinearPlant(Surrogate(1.0, 10.0)).move(np.full((1, 3, 1), 25.0)).trajectory()
    table = np.genfromtxt(one.to_csv(tmp_path / "t.csv"), delimiter=",", names=True)
    np.testing.assert_allclose(table["yaw_deg"], 25, rtol=1e-8)
    np.testing.assert_allclose([table["q_w"][0], table["q_z"][0]], from_yaw(25.0)[[0, 3]], rtol=1e-8)
