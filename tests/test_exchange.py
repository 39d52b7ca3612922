"""Saccades in other people's formats, and their recordings read: against closed forms, and against other readers."""

import csv
import gzip
import json
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from orient_eye import listing, rotations
from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.exchange.bids import write_bids
from orient_eye.exchange.eye_tables import GazeColumns, read_gaze
from orient_eye.exchange.gaze import GazeRecord
from orient_eye.exchange.parquet import write_parquet
from orient_eye.exchange.record import recorded
from orient_eye.motor import Motor
from orient_eye.movement.trajectory import Trajectory

Array = np.ndarray
VALIDATOR = Path(sysconfig.get_path("scripts")) / "bids-validator-deno"
PHYSIO = "sub-robot/beh/sub-robot_task-saccade_recording-eye1_physio"


def turning(yaw: Array, pitch: Array, time: Array, failed: tuple[int, ...] = ()) -> Trajectory:
    """Saccades whose yaw and pitch [deg] (saccades, time) are known, with the angular velocity of small steps."""
    q = rotations.from_euler(yaw, pitch, 0.0)
    spun = rotations.rotation(q[:, 1:].reshape(-1, 4)) * rotations.rotation(q[:, :-1].reshape(-1, 4)).inv()
    turned = np.rad2deg(spun.as_rotvec()).reshape(len(q), -1, 3) / np.diff(time)[:, None]
    velocity = np.concatenate([turned, 0 * turned[:, :1]], axis=1)
    motor, bad = np.zeros((*yaw.shape, 1)), np.isin(np.arange(len(yaw)), failed)
    for array in (q, velocity, motor):
        array[bad] = np.nan
    return Trajectory(time, q, velocity, motor, motor, None, bad, (Motor("m", "deg"),))


def smooth(size: Array, time: Array, lasts_s: float) -> Array:
    """Minimum jerk from -size/2 to size/2 [deg], (saccades, time)."""
    s = np.clip(time / lasts_s, 0, 1)
    return size[:, None] * (s**3 * (10 - 15 * s + 6 * s**2) - 0.5)


TIME = np.arange(0, 0.3, 1e-3)
SIZES = np.array([3.0, 8.0, 15.0])


def three(failed: tuple[int, ...] = ()) -> Trajectory:
    return turning(smooth(SIZES, TIME, 0.06), smooth(-SIZES / 2, TIME, 0.06), TIME, failed)


# --- as an eye tracker records them ---------------------------------------------------------------


def test_a_record_is_the_trajectory_with_rests_and_gaps() -> None:
    trajectory = three()
    record = recorded(trajectory, rest_s=0.05, gap_s=0.02)
    assert record.rate_hz == 1000
    np.testing.assert_allclose(record.starts_s, [0.05, 0.42, 0.79], atol=1e-12)
    for i, start in enumerate(record.starts_s):
        k = round(1000 * start)
        np.testing.assert_allclose(record.orientation[k : k + 300], trajectory.orientation[i], atol=1e-15)
        np.testing.assert_allclose(record.orientation[k - 50 : k], np.tile(trajectory.orientation[i, 0], (50, 1)))
    gap = np.isnan(record.orientation).all(axis=1)
    assert gap.sum() == 2 * 20
    assert not gap[-1]
    gaze = record.gaze()
    looks = rotations.gaze(record.orientation)
    np.testing.assert_allclose(np.rad2deg(np.arctan2(-looks[:, 1], looks[:, 0])), gaze.horizontal_deg, atol=1e-9)
    np.testing.assert_allclose(np.rad2deg(np.arcsin(looks[:, 2])), gaze.vertical_deg, atol=1e-9)


def test_another_rate_samples_the_same_movement() -> None:
    for rate in (500.0, 333.0, 2000.0):
        record = recorded(three(), rate, rest_s=0.1)
        for i, start in enumerate(record.starts_s):
            t = record.time - start
            inside = (t >= 0) & (t <= TIME[-1])
            wanted = smooth(SIZES[i : i + 1], t[inside], 0.06)[0]
            found = rotations.to_euler(record.orientation[inside])[0]
            np.testing.assert_allclose(found, wanted, atol=0.02)  # straight lines over 1 ms of 470 deg/s


def test_noise_is_as_large_as_it_says_and_repeats() -> None:
    record = recorded(three(), 500)
    clean, noisy, again = (record.gaze(0.02, r) for r in (None, *map(np.random.default_rng, (3, 3))))
    off = (noisy.horizontal_deg - clean.horizontal_deg)[np.isfinite(clean.horizontal_deg)]
    assert off.std() == pytest.approx(0.02, rel=0.1)
    np.testing.assert_array_equal(noisy.vertical_deg, again.vertical_deg)


def test_a_rate_that_is_none_is_refused() -> None:
    trajectory = three()
    uneven = turning(trajectory.yaw_deg, trajectory.pitch_deg, TIME**1.01)
    for one, rate, message in (
        (uneven, None, "no rate of their own; name one"),
        (trajectory, 0, "rate must be a number from 1 to 100000 Hz, got 0"),
        (trajectory, np.nan, "rate must be .* got nan"),
    ):
        with pytest.raises(InputError, match=message):
            recorded(one, rate)
    assert recorded(uneven, 500).rate_hz == 500


def test_saccades_of_a_minimum_jerk_are_found_as_its_formula_says() -> None:
    """V = 1.875 A / T; above the threshold as long as 30 s^2 (1 - s)^2 A / T is."""
    size, lasts = np.array([4.0, 10.0, 20.0]), 0.08
    flat = turning(smooth(size, TIME, lasts), np.zeros((3, TIME.size)), TIME)
    found = recorded(flat, 1000).gaze().saccades()
    s = np.linspace(0, 1, 100_001)
    fast = (30 * s**2 * (1 - s) ** 2)[None] * size[:, None] / lasts > 30
    np.testing.assert_allclose(found.peak_velocity_deg_s, 1.875 * size / lasts, rtol=0.02)
    np.testing.assert_allclose(found.duration_s, lasts * fast.mean(axis=1), atol=2e-3)
    travelled = s**3 * (10 - 15 * s + 6 * s**2)
    ends = [np.ptp(travelled[row]) for row in fast]
    np.testing.assert_allclose(found.amplitude_deg, size * ends, rtol=0.01)


def test_what_is_no_saccade_is_left_out_and_counted() -> None:
    time = np.arange(0, 3, 0.002)
    x = np.zeros_like(time)
    for at, size, lasts in ((0.3, 10, 0.05), (0.8, 0.8, 0.03), (1.3, 60, 0.02), (1.8, 10, 0.05), (2.3, 10, 0.05)):
        x += smooth(np.array([size]), time - at, lasts)[0] + size / 2
    x[(time > 1.81) & (time < 1.83)] = np.nan
    found = GazeRecord(time, x, 0 * x, 500.0).saccades()
    np.testing.assert_allclose(found.onset_s, [0.305, 2.305], atol=0.004)
    assert {why: n for why, n in found.left_out.items() if n} == {
        "smaller than 1 deg": 1, "faster than 1200 deg/s": 1, "in a gap or at an end": 2
    }  # fmt: skip


# --- BIDS -----------------------------------------------------------------------------------------


def read_bids(folder: Path, end: str = "") -> tuple[dict[str, Any], dict[str, list[str]]]:
    """A table and its sidecar, as the standard says they are read."""
    about = json.loads((folder / f"{PHYSIO}{end}.json").read_text())
    with gzip.open(folder / f"{PHYSIO}{end}.tsv.gz", "rt") as file:
        rows = list(csv.reader(file, delimiter="\t"))
    return about, dict(zip(about["Columns"], map(list, zip(*rows, strict=True)), strict=True))


def numbers(cells: list[str]) -> Array:
    return np.array([np.nan if cell == "n/a" else float(cell) for cell in cells])


def test_a_data_set_says_what_the_trajectory_does(tmp_path: Path) -> None:
    trajectory = three(failed=(1,))
    written = write_bids(tmp_path / "set", trajectory, source="a test")
    assert sorted(written) == sorted(path for path in (tmp_path / "set").rglob("*") if path.is_file())
    about, columns = read_bids(tmp_path / "set")
    assert list(columns) == ["timestamp", "x_coordinate", "y_coordinate", "torsion", "q_w", "q_x", "q_y", "q_z"]
    wanted = {"PhysioType": "eyetrack", "RecordedEye": "left", "SampleCoordinateSystem": "eye-in-head"}
    assert wanted.items() <= about.items()
    assert (about["SamplingFrequency"], about["StartTime"]) == (1000, 0)
    assert [about[name]["Units"] for name in columns] == ["s", *3 * ["deg"], *4 * ["1"]]
    table = {name: numbers(cells) for name, cells in columns.items()}
    np.testing.assert_allclose(table["timestamp"], np.arange(len(table["timestamp"])) / 1000, atol=1e-9)
    q = np.stack([table[f"q_{part}"] for part in "wxyz"], axis=-1)
    first = slice(200, 500)
    np.testing.assert_allclose(q[first], trajectory.orientation[0], atol=1e-8)
    np.testing.assert_allclose(table["x_coordinate"][first], -trajectory.yaw_deg[0], atol=1e-6)
    np.testing.assert_allclose(table["y_coordinate"][first], -trajectory.pitch_deg[0], atol=1e-6)
    np.testing.assert_allclose(table["torsion"][first], listing.torsion(trajectory.orientation[0]), atol=1e-6)
    assert np.isnan(table["x_coordinate"][500:1200]).all(), "a gap, a saccade that failed, a gap"
    assert {"-0", "nan"}.isdisjoint(set(columns["x_coordinate"]) | set(columns["y_coordinate"]))


def test_events_are_the_saccades_on_the_recordings_timeline(tmp_path: Path) -> None:
    write_bids(tmp_path / "set", three(failed=(1,)))
    about, columns = read_bids(tmp_path / "set", "events")
    assert about["OnsetSource"] == "timestamp"
    assert columns["trial_type"] == ["saccade", "saccade"]
    assert columns["saccade"] == ["1", "3"]
    _, samples = read_bids(tmp_path / "set")
    time, x, y = (numbers(samples[name]) for name in ("timestamp", "x_coordinate", "y_coordinate"))
    speed = np.hypot(np.gradient(x, time) * np.cos(np.deg2rad(y)), np.gradient(y, time))
    for onset, lasts, peak in zip(
        *(numbers(columns[key]) for key in ("onset", "duration", "peak_velocity")), strict=True
    ):
        near = (time > onset - 0.1) & (time < onset + 0.1)
        fast = time[near & (speed > 30)]
        assert fast[0] == pytest.approx(onset, abs=2e-3)
        assert fast[-1] == pytest.approx(onset + lasts, abs=2e-3)
        assert speed[near].max() == pytest.approx(peak, rel=0.02)


def test_the_same_saccades_give_the_same_files(tmp_path: Path) -> None:
    for name in "ab":
        write_bids(tmp_path / name, three())
    for path in (tmp_path / "a").rglob("*.*"):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes()


def test_the_data_set_has_what_the_standard_requires(tmp_path: Path) -> None:
    write_bids(tmp_path, three(), subject="eye3")
    about = json.loads((tmp_path / "dataset_description.json").read_text())
    assert about.keys() >= {"Name", "BIDSVersion", "DatasetType", "GeneratedBy"}
    rows = [line.split("\t") for line in (tmp_path / "participants.tsv").read_text().splitlines()]
    assert rows == [["participant_id", "species"], ["sub-eye3", "n/a"]]
    assert len((tmp_path / "README").read_text()) > 150
    names = {path.name.removeprefix("sub-eye3_task-saccade_recording-eye1_") for path in tmp_path.rglob("*/beh/*")}
    assert names == {"physio.tsv.gz", "physio.json", "physioevents.tsv.gz", "physioevents.json"}


def test_pymovements_reads_the_data_set(tmp_path: Path) -> None:
    pm = pytest.importorskip("pymovements")
    trajectory = three()
    write_bids(tmp_path / "set", trajectory)
    about = json.loads((tmp_path / "set" / f"{PHYSIO}.json").read_text())
    gaze = pm.gaze.from_csv(
        tmp_path / "set" / f"{PHYSIO}.tsv.gz",
        experiment=pm.gaze.Experiment(sampling_rate=about["SamplingFrequency"]),
        time_column="timestamp", time_unit="s", position_columns=["x_coordinate", "y_coordinate"],
        read_csv_kwargs={
            "separator": "\t", "has_header": False, "new_columns": about["Columns"], "null_values": "n/a"
        },
    )  # fmt: skip
    gaze.pos2vel("savitzky_golay", window_length=7, degree=2)
    gaze.detect("microsaccades", threshold=(5, 5), minimum_duration=10)
    gaze.compute_event_properties(["amplitude", "peak_velocity"])
    events = gaze.events.frame
    assert len(events) == 3
    _, ours = read_bids(tmp_path / "set", "events")
    np.testing.assert_allclose(events["onset"].to_numpy() / 1e3, numbers(ours["onset"]), atol=4e-3)
    np.testing.assert_allclose(events["peak_velocity"].to_numpy(), numbers(ours["peak_velocity"]), rtol=0.03)


def test_the_validator_has_no_errors(tmp_path: Path) -> None:
    """Needs no network: its schema is inside."""
    pytest.importorskip("bids_validator_deno")
    write_bids(tmp_path / "set", three(failed=(1,)))
    said = subprocess.run([VALIDATOR, "set", "--json"], cwd=tmp_path, capture_output=True, check=False)
    found = json.loads(said.stdout)["issues"]["issues"]
    assert found, "it warns of keys that we do not know"
    assert [issue for issue in found if issue["severity"] == "error"] == []


def test_a_data_set_needs_an_empty_folder_and_a_label(tmp_path: Path) -> None:
    (tmp_path / "kept.txt").write_text("kept")
    with pytest.raises(InputError, match="is not an empty folder"):
        write_bids(tmp_path, three())
    for label in ("", "a-b", "a/b", "eye 1", "ä"):
        with pytest.raises(InputError, match="letters and digits"):
            write_bids(tmp_path / "new", three(), subject=label)
    assert [path.name for path in tmp_path.iterdir()] == ["kept.txt"]


# --- Parquet --------------------------------------------------------------------------------------


def test_parquet_has_the_columns_of_the_csv_for_every_saccade(tmp_path: Path) -> None:
    trajectory = three(failed=(1,))
    table = pq.read_table(write_parquet(tmp_path / "a.parquet", trajectory))
    assert table.num_rows == 3 * TIME.size
    trajectory[2].to_csv(tmp_path / "third.csv")
    with (tmp_path / "third.csv").open() as file:
        header = next(csv.reader(file))
    assert table.column_names == ["saccade", *header]
    third = table.filter(pc.equal(table["saccade"], 3))
    rows = np.loadtxt(tmp_path / "third.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(np.stack([third[name].to_numpy() for name in header], axis=1), rows, atol=1e-6)
    assert np.isnan(table.filter(pc.equal(table["saccade"], 2))["yaw_deg"].to_numpy()).all()


# --- people's tables ------------------------------------------------------------------------------

T = np.arange(0, 1, 0.002)
X = 10 * np.tanh(80 * (T - 0.5))


def test_any_table_is_the_same_recording(tmp_path: Path) -> None:
    columns = {"when": 1e3 * T, "right": X, "up": X / 2}
    texts = {
        "a.csv": (",", "when,right,up,label", "fixation, really"),
        "b.tsv": ("\t", "label\twhen\tright\tup", "word"),
        "c.csv": (";", "when;right;up;label", ""),
    }
    for name, (separator, header, word) in texts.items():
        cells = {key: [f"{value:.9g}" for value in values] for key, values in columns.items()}
        if separator == ";":
            cells = {key: [cell.replace(".", ",") for cell in values] for key, values in cells.items()}
        cells["label"] = [f'"{word}"'] * T.size
        rows = [separator.join(row) for row in zip(*(cells[key] for key in header.split(separator)), strict=True)]
        (tmp_path / name).write_text("\n".join([header, *rows]))
    pq.write_table(pa.table(columns | {"label": ["word"] * T.size}), tmp_path / "d.parquet")
    for name in (*texts, "d.parquet"):
        record = read_gaze(tmp_path / name, GazeColumns("when", "right", "up", "ms"))
        assert record.rate_hz == pytest.approx(500, rel=1e-9)
        np.testing.assert_allclose(record.horizontal_deg, X, atol=1e-6, err_msg=name)
        np.testing.assert_allclose(record.vertical_deg, X / 2, atol=1e-6, err_msg=name)


def test_our_data_set_is_read_as_it_was_recorded(tmp_path: Path) -> None:
    trajectory = three()
    write_bids(tmp_path / "set", trajectory, rate_hz=500)
    read, wanted = read_gaze(tmp_path / "set" / f"{PHYSIO}.tsv.gz"), recorded(trajectory, 500).gaze()
    for key in ("time", "horizontal_deg", "vertical_deg"):
        np.testing.assert_allclose(getattr(read, key), getattr(wanted, key), atol=1e-6, err_msg=key)
    assert read.saccades().onset_s.size == 3


def written(path: Path, columns: dict[str, Any]) -> Path:
    rows = [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([",".join(columns), *rows]))
    return path


def test_missing_samples_and_missing_rows_are_gaps(tmp_path: Path) -> None:
    cells: list[Any] = X.tolist()
    for k, word in enumerate(("nan", "NA", "n/a", ".", "")):
        cells[100 + k] = word
    kept = np.r_[0:300, 320:500]
    record = read_gaze(written(tmp_path / "a.csv", {"t": T[kept], "x": [cells[k] for k in kept]}))
    gaps = np.flatnonzero(np.isnan(record.horizontal_deg))
    assert record.time.size == T.size
    assert set(gaps) == {*range(100, 105), *range(300, 320)}
    known = np.isfinite(record.horizontal_deg)
    np.testing.assert_allclose(record.horizontal_deg[known], X[known], atol=1e-9)
    assert np.array_equal(np.isnan(record.vertical_deg), ~known)
    assert not record.vertical_deg[known].any()


def test_times_in_whole_milliseconds_keep_their_rate(tmp_path: Path) -> None:
    time = np.arange(0, 2, 1 / 300)
    path = written(tmp_path / "a.csv", {"t": np.round(1e3 * time).astype(int), "x": 10 * np.sin(time)})
    record = read_gaze(path, GazeColumns(unit="ms"))
    assert record.rate_hz == pytest.approx(300, rel=2e-3)
    np.testing.assert_allclose(record.horizontal_deg, 10 * np.sin(record.time), atol=0.01)


ROW = {"t": T, "x": X}
REFUSED: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "no time": ({"x": X, "y": X}, {}, "no column of time: none is called t_s, .*, it has x, y; name it by --time"),
    "no gaze": ({"t": T, "gx": X}, {}, "no column of horizontal gaze: .* name it by --x"),
    "wrong name": (ROW, {"x": "gaze"}, "has no column gaze; it has t, x"),
    "twice": (ROW, {"y": "x"}, "different columns, got t, x, x"),
    "ms": ({"t": 1e3 * T, "x": X}, {}, r"rows are 2 s apart, 0.5 Hz: is time in ms\? Then say --time-unit ms \(500 Hz"),
    "s": (ROW, {"unit": "ms"}, r"is time in s\? Then say --time-unit s \(500 Hz"),
    "slow": ({"t": 10 * T, "x": X}, {}, "sampled at 50 Hz; the speed of a saccade is known from 100 to 10000 Hz"),
    "unsorted": ({"t": T[::-1], "x": X}, {}, "line 3: time must rise from row to row, .* sort the rows"),
    "repeated": ({"t": np.repeat(T[:250], 2), "x": X}, {}, "line 3: time must rise .* remove repeated ones"),
    "NaN in time": ({"t": np.where(T > 0.5, np.nan, T), "x": X}, {}, "line 253: t is not a finite number"),
    "uneven": ({"t": np.cumsum(np.tile([0.001, 0.0018, 0.0018], 100)), "x": X[:300]}, {}, "not sampled evenly"),
    "all gaps": ({"t": T, "x": np.nan * X}, {}, "no sample of gaze with all its numbers"),
    "infinite": ({"t": T, "x": np.where(T > 0.5, np.inf, X)}, {}, "gaze holds infinite numbers; leave a cell empty"),
    "pixels": ({"t": T, "x": 960 + 20 * X}, {}, r"gaze goes up to .* deg, .* are these pixels\? Convert them"),
    "words": ({"t": T, "x": ["left"] * T.size}, {}, "line 2: x is 'left', not a number"),
    "one row": ({"t": [0.0], "x": [0.0]}, {}, "one row; a recording needs many"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_a_table_that_is_no_recording_is_refused(case: str, tmp_path: Path) -> None:
    columns, options, message = REFUSED[case]
    with pytest.raises(InputError, match=message):
        read_gaze(written(tmp_path / "a.csv", columns), GazeColumns(**options))


def test_files_that_are_no_tables_are_refused(tmp_path: Path) -> None:
    pq.write_table(pa.table({"t": T, "x": ["word"] * T.size}), tmp_path / "words.parquet")
    pq.write_table(pa.table({"t": T, "x": X}), tmp_path / "whole.parquet")
    (tmp_path / "cut.parquet").write_bytes((tmp_path / "whole.parquet").read_bytes()[:200])
    (tmp_path / "alone.tsv.gz").write_bytes(gzip.compress(b"0\t0\n"))
    (tmp_path / "none.tsv.gz").write_bytes(b"no gzip")
    (tmp_path / "none.json").write_text('{"Columns": ["timestamp", "x_coordinate"]}')
    (tmp_path / "odd.tsv.gz").write_bytes(gzip.compress(b"0\t0\n"))
    (tmp_path / "odd.json").write_text('{"Columns": 3}')
    for name, message in (
        ("words.parquet", "column x holds string, not numbers"),
        ("cut.parquet", "cannot read .*cut.parquet.*give a Parquet file"),
        ("alone.tsv.gz", "cannot read .*alone.json: No such file.*has no header, its columns stand in that file"),
        ("none.tsv.gz", "cannot read .*none.tsv.gz"),
        ("odd.tsv.gz", "odd.json names no Columns"),
        ("nowhere.csv", "cannot read .*nowhere.csv: No such file"),
    ):
        with pytest.raises(InputError, match=message):
            read_gaze(tmp_path / name)


# --- the command ----------------------------------------------------------------------------------


def run(*arguments: str, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--json"])
    told = capsys.readouterr()
    assert not ended.value.code, told.err
    return dict(json.loads(told.out))


def test_convert_a_simulation_and_a_policy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "command.csv").write_text("t_s,tau2_deg\n0,0\n0,8\n0.3,8\n")
    words = f"simulate --motor {tmp_path}/command.csv --plant lpf --out {tmp_path}/run"
    run(*words.split(), capsys=capsys)
    for source in ("run", "run/trajectory.npz"):
        told = run("convert", str(tmp_path / source), "--bids", str(tmp_path / source.replace("/", "-") / "set"),
                   capsys=capsys)  # fmt: skip
        assert (told["saccades"], len(told["files"])) == (1, 8)
    told = run("convert", "lpf-1", "--target", "20", "--parquet", str(tmp_path / "a.parquet"), capsys=capsys)
    assert told["saccades"] == 1
    table = pq.read_table(tmp_path / "a.parquet")
    assert table["yaw_deg"].to_numpy()[-1] == pytest.approx(20, abs=0.5)
    assert run("convert", "lpf-1", "--rate", "500", "--bids", str(tmp_path / "d"), capsys=capsys)["saccades"] == 6
    assert read_gaze(tmp_path / "d" / f"{PHYSIO}.tsv.gz").rate_hz == pytest.approx(500)


@pytest.mark.parametrize(("policy", "eye"), [("lpf-1", "left"), ("six-gaze", "right")])
def test_the_eye_that_was_recorded(policy: str, eye: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--target", *("10 0" if policy == "six-gaze" else "10").split(), "--bids", str(tmp_path / "set"))
    run("convert", policy, *words, capsys=capsys)
    assert json.loads((tmp_path / "set" / f"{PHYSIO}.json").read_text())["RecordedEye"] == eye


@pytest.mark.parametrize("plant", ["--plant modal --surrogate six-3d", "--plant tavares --eye six"])
def test_the_eye_of_a_simulation(plant: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Told by its result; of a file that went elsewhere it is not known."""
    (tmp_path / "command.csv").write_text("t_s,MR_deg\n0,57.29577951308232\n0.3,60\n")
    run("simulate", "--motor", f"{tmp_path}/command.csv", *plant.split(), "--out", f"{tmp_path}/run", capsys=capsys)
    shutil.copy(tmp_path / "run" / "trajectory.npz", tmp_path / "alone.npz")
    for source, eye in (("run", "right"), ("alone.npz", "left")):
        folder = tmp_path / f"set-{source}"
        run("convert", f"{tmp_path}/{source}", "--bids", str(folder), capsys=capsys)
        assert json.loads((folder / f"{PHYSIO}.json").read_text())["RecordedEye"] == eye


def test_an_eye_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="left or the right eye, got 'both'"):
        write_bids(tmp_path / "set", three(), eye="both")
