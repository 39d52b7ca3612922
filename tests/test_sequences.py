"""Sequences of saccades, by policies whose torsion is known beforehand."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from orient_eye import listing, rotations
from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.learning.policy import Policy
from orient_eye.learning.sequences import (
    Sequence,
    drawn,
    ficks_starts,
    imposed,
    listing_numbers,
    on_the_way,
    sequence,
    stretching,
    torsion_columns,
)
from orient_eye.movement.oblique import component_durations
from orient_eye.plants import make_plant
from orient_eye.plants.fixation import fixate
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
WEIGHTS = {"accuracy": 4e7, "energy": 1.0, "duration": 5e5, "overshoot": 5e6, "force": 3e5}


def make_task(rule: str | None = None, **options: Any) -> SaccadeTask:
    return SaccadeTask.of_case(
        make_plant("tavares"), "1", targets="gaze", weights=WEIGHTS, action_options={"rule": rule}, **options
    )


@pytest.fixture(scope="module")
def task() -> SaccadeTask:
    return make_task()


def usual(task: SaccadeTask) -> Any:
    """Acts as the usual command does."""
    return lambda start, target: task.actions.from_unit(np.zeros((len(start), len(task.actions.numbers))))


def make_sequence(task: SaccadeTask, sequences: int = 3, saccades: int = 8, seed: int = 0) -> Sequence:
    start, target = drawn(task, sequences, saccades, np.random.default_rng(seed))
    return sequence(task, usual(task), target, start)


@pytest.fixture(scope="module")
def made(task: SaccadeTask) -> Sequence:
    return make_sequence(task)


def test_each_start_is_the_previous_end(task: SaccadeTask, made: Sequence) -> None:
    def by_sequence(values: Array) -> Array:
        return values.reshape(3, 8, -1)

    ends, starts = by_sequence(made.measures.final), by_sequence(made.start.orientation)
    np.testing.assert_allclose(starts[:, 1:], ends[:, :-1], atol=1e-12)
    stands = by_sequence(made.trajectory.motor[:, -1])
    np.testing.assert_allclose(by_sequence(made.start.motor)[:, 1:], stands[:, :-1], atol=0.1)  # the slow pole's tail
    np.testing.assert_allclose(task.plant.rest(made.start.motor), made.start.orientation, atol=1e-9)
    np.testing.assert_allclose(made.trajectory.orientation[:, 0], made.start.orientation, atol=1e-12)
    np.testing.assert_array_equal(torsion_columns(made)["saccade"], np.tile(np.arange(1, 9), 3))
    np.testing.assert_array_equal(torsion_columns(made)["sequence"], np.repeat([1, 2, 3], 8))


def test_sequences_side_by_side_are_those_one_after_the_other(task: SaccadeTask, made: Sequence) -> None:
    start, target = drawn(task, 3, 8, np.random.default_rng(0))
    alone = sequence(task, usual(task), target[1:2], start[[1]])
    rows = slice(8, 16)
    np.testing.assert_allclose(alone.measures.final, made.measures.final[rows], atol=1e-10)
    np.testing.assert_allclose(alone.trajectory.orientation, made.trajectory.orientation[rows], atol=1e-10)
    np.testing.assert_array_equal(alone.target, made.target[rows])
    for name, values in alone.columns.items():
        np.testing.assert_allclose(values, made.columns[name][rows], rtol=1e-6, atol=1e-6, err_msg=name)


def test_the_torsion_of_the_usual_command_is_that_of_its_rule(task: SaccadeTask, made: Sequence) -> None:
    gaze = rotations.gaze(made.measures.final)
    np.testing.assert_allclose(listing.torsion(made.measures.final), fixate(task.plant, gaze)[0], atol=2e-3)
    numbers = listing_numbers(made)
    assert numbers["ends"]["sd_deg"] == pytest.approx(numbers["usual"]["sd_deg"], abs=1e-3)
    assert numbers["beside_least_force_deg"]["sd"] < 1e-3
    assert numbers["gaze_error_deg"]["largest"] < 1e-3

    other = listing_numbers(make_sequence(make_task("listing")))
    assert other["ends"]["sd_deg"] < 1e-3
    assert other["ends"]["twist"] == pytest.approx(0, abs=1e-3)
    assert other["beside_least_force_deg"]["sd"] > 0.1

    third = listing_numbers(make_sequence(make_task("fick")))
    assert third["ends"]["twist"] == pytest.approx(-1, abs=1e-3)
    assert third["ends"]["sd_deg"] == pytest.approx(third["fick"]["sd_deg"], abs=1e-3)


def test_from_ficks_torsion_one_usual_command_leads_to_the_least_force(task: SaccadeTask) -> None:
    random = np.random.default_rng(1)
    start = ficks_starts(task, 4, random)
    gaze = rotations.gaze(start.orientation)
    yaw, pitch = rotations.to_euler(start.orientation)[:2]
    np.testing.assert_allclose(rotations.from_euler(yaw, pitch, 0.0), start.orientation, atol=1e-9)
    assert np.abs(listing.torsion(start.orientation) - fixate(task.plant, gaze)[0]).min() > 2
    made = sequence(task, usual(task), drawn(task, 4, 5, random)[1], start)
    first = listing_numbers(made)["first"]
    assert [row["saccades"] for row in first] == [2, 5]
    assert first[0]["last_beside_least_force_deg"] < 1e-3
    beside = torsion_columns(made)["beside_least_force_deg"]
    assert np.abs(beside).max() < 1e-3


def test_numbers_of_gaze_and_paths_are_those_of_the_rows(made: Sequence) -> None:
    numbers, columns = listing_numbers(made), torsion_columns(made)
    ends = rotations.gaze(made.measures.final)
    apart = np.rad2deg(np.arccos(np.clip((ends * rotations.gaze(made.target)).sum(axis=1), -1, 1)))
    np.testing.assert_allclose(columns["gaze_error_deg"], apart, atol=1e-5)
    assert numbers["path_deviation"]["median"] == pytest.approx(np.median(columns["path_deviation"]))
    assert numbers["component_correlation"]["least"] == pytest.approx(np.nanmin(columns["component_correlation"]))
    assert numbers["torsion_blip_deg"]["largest"] == pytest.approx(np.max(columns["torsion_blip_deg"]))
    on = on_the_way(made)
    assert len(on) == int((made.trajectory.time <= made.measures.settling_time_s[:, None]).sum())
    assert numbers["on_the_way"]["sd_deg"] == pytest.approx(listing.fit_plane(on).sd_deg)


def test_a_component_is_held_against_the_saccade_it_would_be_alone(task: SaccadeTask) -> None:
    """From straight ahead the horizontal part of (12 left, 8 up) is the saccade to yaw 12, if it ends where it aims."""
    ahead = task.targets.rest(task.targets.orientation([[0.0, 0.0]]))
    aim = task.targets.orientation([[12.0, -8.0]])
    one = sequence(task, usual(task), aim[None], ahead)
    took = component_durations(one.trajectory, one.measures)[0]
    away = np.rad2deg(np.arccos(rotations.gaze(aim)[0, 0]))
    beside = rotations.gaze(aim)[0, 1:] * away / np.sin(np.deg2rad(away))
    alone = [
        task.perform(ahead, usual(task)(ahead.orientation, there), there).measures.settling_time_s[0]
        for there in (task.targets.orientation([[beside[0], 0.0]]), task.targets.orientation([[0.0, -beside[1]]]))
    ]
    found = stretching(one, usual(task))
    assert found["larger"] == pytest.approx({"median": took[0] / alone[0], "compared": 1}, rel=1e-4)
    assert found["smaller"] == pytest.approx({"median": took[1] / alone[1], "compared": 1}, rel=1e-4)


def test_what_is_imposed_is_told_in_words(task: SaccadeTask) -> None:
    assert "torsion of the least force, and may shift its D by up to motor1" in imposed(task)
    assert "the reward favours that of the least force (weight 300000)" in imposed(task)
    assert "holds the target at the torsion of Fick's gimbal" in imposed(make_task("fick"))
    free = replace(make_task("listing"), weights={**WEIGHTS, "force": 0.0})
    assert "at the torsion zero" in imposed(free)
    assert "the reward knows no torsion" in imposed(free)
    modal = SaccadeTask.of_case(make_plant("modal"), "1", targets="gaze", weights={**WEIGHTS, "force": 0.0})
    assert "at the torsion zero" in imposed(modal)
    assert "by the actions nothing, they tell D outright" in imposed(task.plain)


def test_where_motors_go_by_the_statics_listings_law_is_imposed_entirely() -> None:
    six = SaccadeTask.of_case(make_plant("tavares", eye="six"), "smooth", targets="gaze", weights=WEIGHTS)
    for task in (six, six.plain):
        assert imposed(task).startswith("Imposed on torsion: at rest all of it. The actions tell B and k0;")
        assert "of the least change of the motors from their pretension" in imposed(task)
    made = make_sequence(six, sequences=2, saccades=4)
    numbers = listing_numbers(made)
    assert numbers["usual"] == pytest.approx(numbers["ends"], abs=0.01)  # fits of the statics: to 4e-4 deg
    assert numbers["gaze_error_deg"]["largest"] < 0.01


def test_torsion_of_the_shifts_is_what_the_motors_make_of_them(task: SaccadeTask) -> None:
    """Motors 1 and 3 of the thesis' eye by 5.74 deg each, against one another: 0.158 deg a degree each (spec)."""
    assert "straight ahead 1.8 deg of torsion" in imposed(task)


def test_what_is_no_sequence_is_refused(task: SaccadeTask) -> None:
    start, target = drawn(task, 2, 3, np.random.default_rng(0))
    with pytest.raises(InputError, match="2 sequences have targets"):
        sequence(task, usual(task), target[0], start)
    with pytest.raises(InputError, match="one saccade or more"):
        sequence(task, usual(task), target[:, :0], start)
    with pytest.raises(InputError, match="one saccade or more, got 0 sequences"):
        drawn(task, 0, 5, np.random.default_rng(0))
    with pytest.raises(InputError, match="saccade 1 of sequence 2 failed"):
        sequence(task, lambda s, t: usual(task)(s, t) * np.array([[1.0], [np.nan]]), target, start)
    with pytest.raises(InputError, match="8 saccades or more, got 3"):
        listing_numbers(sequence(task, usual(task), target[:1], start[[0]]))
    flat = SaccadeTask.of_case(make_plant("lpf"), "1")
    with pytest.raises(InputError, match="saccades in all directions"):
        drawn(flat, 1, 5, np.random.default_rng(0))


def command(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, dict[str, Any]]:
    with pytest.raises(SystemExit) as end:
        main(["listing", *map(str, arguments), "--json"])
    return int(end.value.code or 0), json.loads(capsys.readouterr().out)


def test_a_policy_leaves_a_run_directory(task: SaccadeTask, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A network of zeros acts as the usual command."""
    size = len(task.actions.numbers)
    Policy.of_task(task, (np.zeros((6, size)),), (np.zeros(size),)).save(tmp_path / "policy")
    run = tmp_path / "run"
    code, result = command(
        capsys, tmp_path / "policy", "--saccades", 6, "--sequences", 2, "--start", "fick", "--quiet", "--out", run
    )
    assert code == 0
    assert {file.name for file in run.iterdir()} >= {
        "run.json",
        "result.json",
        "sequence.csv",
        "plane.png",
        "sequence.rrd",
    }
    assert result["saccades"] == 12
    assert result["ends"]["twist"] == pytest.approx(result["usual"]["twist"], abs=1e-3)
    with (run / "sequence.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(float(row["sequence"]), float(row["saccade"])) for row in rows[5:7]] == [(1, 6), (2, 1)]
    assert abs(float(rows[0]["start_torsion_deg"])) > 2
    assert float(rows[1]["start_yaw_deg"]) == pytest.approx(float(rows[0]["final_yaw_deg"]), abs=1e-6)
    code, told = command(
        capsys, tmp_path / "policy", "--saccades", 8, "--plant", "viscous", "--out", tmp_path / "other"
    )
    assert code == 2
    assert "plant tavares" in told["error"]
