"""A recording held against a policy: a policy's own saccades are its own, and others are told apart."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.exchange.gaze import GazeRecord
from orient_eye.exchange.record import recorded
from orient_eye.learning.compared import Compared, compare
from orient_eye.learning.policy import Policy
from orient_eye.task.targets import saccades

SIZES = np.array([4.0, 7, 10, 14, 20, 28])


def recording(name: str, rate: float = 500.0, noise_deg: float = 0.02) -> GazeRecord:
    policy = Policy.load(name)
    task = policy.task()
    start, target = saccades(task.targets, *task.targets.symmetric(SIZES))
    made = task.trajectory(start, policy.act(start.orientation, target), target)
    return recorded(made, rate).gaze(noise_deg, np.random.default_rng(0))


def against(record: GazeRecord, name: str) -> Compared:
    policy = Policy.load(name)
    return compare(record, policy.task(), policy)


def test_a_policys_own_recording_is_like_it_and_anothers_is_not() -> None:
    for rate in (250.0, 1000.0):
        record = recording("lpf-human", rate)
        for name, alike in (("lpf-human", True), ("lpf-3-fixed", False)):
            rows = against(record, name).rows()
            assert [row["amplitude_deg"] for row in rows] == [10, 15, 20]
            for row in rows:
                speed = row["recording_peak_velocity_deg_s"] / row["policy_peak_velocity_deg_s"]
                lasts = row["recording_duration_ms"] / row["policy_duration_ms"]
                assert (0.93 < speed < 1.07 and 0.93 < lasts < 1.07) == alike, (rate, name, row)
                assert alike or (speed > 1.5 and lasts < 0.75)


def test_the_tables_numbers_are_the_saccades_nearby() -> None:
    found = against(recording("lpf-1"), "lpf-1")
    assert {who: len(each) for who, each in found.of.items()} == {"recording": 6, "policy": 16}
    for row in found.rows():
        near = [
            s
            for s in found.saccade_rows()
            if s["of"] == "recording" and abs(s["amplitude_deg"] / row["amplitude_deg"] - 1) <= 0.1
        ]
        assert len(near) == row["recorded"] == 1
        assert near[0]["peak_velocity_deg_s"] == row["recording_peak_velocity_deg_s"]


def test_what_cannot_be_compared_is_refused() -> None:
    time = np.arange(0, 1, 0.002)
    still = GazeRecord(time, 0 * time, 0 * time, 500.0)
    with pytest.raises(InputError, match="0 saccades were found, a main sequence needs at least 3"):
        against(still, "lpf-1")
    turns = {0.2: 74, 0.5: -74, 0.8: 114}
    large = sum(size * (1 + np.tanh((time - at) * 20)) / 2 for at, size in turns.items()) - 55
    with pytest.raises(InputError, match=r"of which the policy makes fewer than 3; it makes them up to 70\.0 deg"):
        against(GazeRecord(time, 1.0 * large, 0 * time, 500.0), "lpf-1")


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = recording("lpf-human")
    with (tmp_path / "gaze.csv").open("w") as file:
        write = csv.writer(file)
        write.writerow(["ms", "gx", "gy", "eye"])
        for row in zip(1e3 * record.time, record.horizontal_deg, record.vertical_deg, strict=True):
            write.writerow([*row, "left"])
    words = f"{tmp_path}/gaze.csv --policy lpf-human --time ms --time-unit ms --x gx --y gy --out {tmp_path}/run --json"
    with pytest.raises(SystemExit) as ended:
        main(["compare", *words.split()])
    told = capsys.readouterr()
    assert not ended.value.code, told.err
    result: dict[str, Any] = json.loads(told.out)
    assert result == json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["saccades"], round(result["rate_hz"], 6)) == (6, 500)
    assert result["fits"].keys() == {"recording", "policy", "people"}
    assert "V D / A" in told.err
    with (tmp_path / "run" / "saccades.csv").open() as file:
        assert [row["of"] for row in csv.DictReader(file)] == 6 * ["recording"] + 16 * ["policy"]
    assert imread(tmp_path / "run" / "main_sequence.png").shape[2] == 4


def test_radians_are_asked_about(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = recording("lpf-1", noise_deg=0.0)
    rows = [f"{t},{np.deg2rad(x)}" for t, x in zip(record.time, record.horizontal_deg, strict=True) if np.isfinite(x)]
    (tmp_path / "gaze.csv").write_text("\n".join(["t,x", *rows]))
    with pytest.raises(SystemExit) as ended:
        main(["compare", f"{tmp_path}/gaze.csv", "--policy", "lpf-1", "--out", f"{tmp_path}/run"])
    assert ended.value.code == 2
    assert "are these radians?" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
