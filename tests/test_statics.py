"""Statics of gaze: against what a motor's limit, mirror symmetry and other searches say, and by the command."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from orient_eye import rotations
from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.figures import gaze as pictures
from orient_eye.listing import directions, fit_plane, torsion, with_torsion
from orient_eye.motor import names
from orient_eye.movement.oblique import seen_from
from orient_eye.plants import Plant, make_plant
from orient_eye.statics import Held, Workspace, cone, degrees_per_motor, extent, toward

SIDE = st.floats(-40, 40)


@pytest.fixture(scope="module")
def plant() -> Plant:
    return make_plant("tavares")


@pytest.fixture(scope="module")
def eve() -> Plant:
    return make_plant("tavares", eye="eve_v3")


@pytest.fixture(scope="module")
def space(eve: Plant) -> Workspace:
    return Workspace.of(eve)


def answer(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, dict[str, Any]]:
    with pytest.raises(SystemExit) as end:
        main(["listing", *map(str, arguments), "--json"])
    return int(end.value.code or 0), json.loads(capsys.readouterr().out)


@given(SIDE, SIDE, SIDE, SIDE)
@settings(max_examples=50, deadline=None)
def test_toward_is_the_inverse_of_seen_from(left: float, up: float, aside: float, above: float) -> None:
    origin = toward([aside, above])
    np.testing.assert_allclose(seen_from(toward([left, up], origin), origin), [left, up], atol=1e-7)
    away = rotations.angle_between_directions(toward([left, up]), [1.0, 0, 0])
    assert away == pytest.approx(np.hypot(left, up), abs=1e-6)


def test_a_motor_turns_the_resting_eye_as_another_program_says(plant: Plant, eve: Plant) -> None:
    thesis = [[-0.158, 1.568, 0], [0, 0, 1.463], [0.158, 1.568, 0]]
    np.testing.assert_allclose(degrees_per_motor(plant), thesis, atol=5e-4)
    np.testing.assert_allclose(
        degrees_per_motor(eve), [[-0.184, 0.622, 0], [0, 0, 1.001], [-0.184, -0.622, 0]], atol=5e-4
    )


def test_least_force_is_the_least_of_many(plant: Plant) -> None:
    random = np.random.default_rng(1)
    held = Held.of(plant, toward(random.uniform(-30, 30, (40, 2))))
    tried = random.uniform(*held.range.T[:, :, None], (40, 60))
    orientation = with_torsion(np.repeat(held.direction, 60, axis=0), tried.ravel())
    motor = plant.hold(orientation, names(plant.motors))
    force = plant.force(orientation, motor)
    assert force is not None
    assert (force.reshape(40, 60) >= held.force[:, None] - 1e-9).all()
    np.testing.assert_allclose(plant.rest(held.motor), held.orientation, atol=1e-9)


@pytest.mark.parametrize("eye", ["plant", "eve"])
def test_the_range_of_torsion_ends_where_a_motor_does(eye: str, request: pytest.FixtureRequest) -> None:
    plant: Plant = request.getfixturevalue(eye)
    held = Held.of(plant, toward([[0, 0], [0, 30], [20, 20], [-25, 10], [-5, -28]]))
    for end in held.range.T:
        motor = plant.hold(with_torsion(held.direction, end), names(plant.motors))
        np.testing.assert_allclose(np.abs(motor).max(axis=1), 40, atol=0.2)
        assert (np.abs(motor) <= 40).all()
    assert (held.range[:, 0] < held.torsion).all()
    assert (held.torsion < held.range[:, 1]).all()


def test_left_and_right_are_mirror_images(plant: Plant) -> None:
    shift = np.random.default_rng(2).uniform(-30, 30, (20, 2))
    one, other = (Held.of(plant, toward(shift * side)) for side in ([1, 1], [-1, 1]))
    np.testing.assert_allclose(one.torsion, -other.torsion, atol=1e-3)
    np.testing.assert_allclose(one.range, -other.range[:, ::-1], atol=0.02)
    np.testing.assert_allclose(one.force, other.force, rtol=1e-5)


def test_the_plane_of_least_force_is_that_of_another_program(plant: Plant, eve: Plant) -> None:
    """sd 0.43 and 0.36 deg, twist -0.196 and -0.166; of directions up to 34 deg, evenly spread."""
    for eye, sd, twist in ((plant, 0.43, -0.196), (eve, 0.36, -0.166)):
        plane = fit_plane(Held.of(eye, cone(34.0)).orientation)
        assert plane.sd_deg == pytest.approx(sd, abs=0.008)
        assert plane.twist == pytest.approx(twist, abs=0.001)
        assert np.abs(plane.tilt_deg).max() < 1e-6


def test_hardly_a_torsion_is_held_beyond_the_reach(eve: Plant, space: Workspace) -> None:
    for farther, most in ((0.5, 3), (3.0, 0)):
        edge = space.shift[-1] * (1 + farther / space.reach_deg)[:, None]
        orientation = with_torsion(np.repeat(toward(edge), 31, axis=0), np.tile(np.arange(-15.0, 16), len(edge)))
        held = np.isfinite(eve.held(orientation, names(eve.motors))).all(axis=1).reshape(-1, 31)
        assert held.sum(axis=1).max() <= most
    assert np.isfinite(space.held.motor).all()
    assert space.reach_deg.max() <= extent(eve)
    inside = rotations.angle_between_directions(space.held.direction, [1.0, 0, 0])
    assert inside.max() == pytest.approx(space.reach_deg.max(), abs=1e-6)


def test_the_maps_show_left_on_the_left_and_the_largest_cone(space: Workspace) -> None:
    for figure in (pictures.workspace(space, 20.0), pictures.torsion_maps(space, 20.0)):
        assert isinstance(figure, Figure)
        maps = [axes for axes in figure.axes if axes.get_xlabel()]
        for axes in maps:
            assert axes.get_xlim()[0] > axes.get_xlim()[1]
            assert 20.0 in [circle.radius for circle in axes.patches]
    assert f"{space.reach_deg.min():.1f} deg" in pictures.workspace(space, 20.0).get_suptitle()


def test_what_holds_a_direction_makes_the_eye_look_there(capsys: pytest.CaptureFixture[str]) -> None:
    _, held = answer(capsys, "--gaze", 20, -10, "--torsion", 1.5)
    code, rest = answer(capsys, "--motors", *held["motors"].values())
    assert code == 0
    assert rest["gaze_deg"] == pytest.approx([20, -10], abs=1e-7)
    assert rest["torsion_deg"] == pytest.approx(1.5, abs=1e-7)
    assert rest["force_n2"] == pytest.approx(held["force_n2"], rel=1e-6)
    assert held["force_n2"] > held["least_force_n2"]


def test_motors_of_large_directions_are_those_of_another_program(capsys: pytest.CaptureFixture[str]) -> None:
    for eye, up, left in (("thesis", 10.9, 23.5), ("eve_v3", 32.0, 35.9)):
        eyes = ("--plant", "viscous" if eye == "thesis" else "tavares", "--eye", eye)
        told = answer(capsys, *eyes, "--gaze", 0, -35)[1]["motors"]
        assert np.abs([told["motor1"], told["motor3"]]) == pytest.approx(up, abs=0.06)
        assert answer(capsys, *eyes, "--gaze", 35, 0)[1]["motors"]["motor2"] == pytest.approx(left, abs=0.06)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--gaze", 85, 0), "nearer to straight ahead"),
        (("--gaze", 200, 0), "from -90 to 90 deg, got 200"),
        (("--gaze", 35, -35, "--torsion", 20), "hold torsions from"),
        (("--torsion", 1), "name the direction too"),
        (("--motors", 1, 2), "got 2 positions"),
        (("--motors", 1, 2, 90), "motor3 must be a number from -80 to 80 deg, got 90"),
        (("--motors", 1, 2, "nan"), "got nan"),
        (("--gaze", 1, 1, "--motors", 0, 0, 0), "different questions"),
        (("--gaze", "nan", 1), "from -90 to 90 deg, got nan"),
        (("--plant", "lpf"), "no elastics are known"),
        (("--plant", "modal", "--gaze", 1, 1), "no elastics are known"),
        (("thesis", "--gaze", 1, 1), "leave the policy out"),
        (("no/such/policy",), "is no policy"),
        (("any", "--seed", -1), "--seed must be a whole number of at least 0"),
        (("any", "--saccades", 3), "through 8 saccades or more"),
    ],
)
def test_bad_input_is_told_with_exit_code_2(
    capsys: pytest.CaptureFixture[str], arguments: tuple[object, ...], words: str
) -> None:
    code, told = answer(capsys, *arguments)
    assert code == 2
    assert words in told["error"]


def test_a_run_of_statics_explains_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    code, result = answer(capsys, "--plant", "tavares", "--eye", "eve_v3", "--limit", 20, "--out", run)
    assert code == 0
    assert {file.name for file in run.iterdir()} == {
        "run.json", "result.json", "statics.csv", "workspace.png", "torsion.png", "plane.png"
    }  # fmt: skip
    assert json.loads((run / "result.json").read_text()) == result
    with (run / "statics.csv").open() as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    row = rows[len(rows) // 2]
    motor = np.array([[row[f"tau{i}_deg"] for i in (1, 2, 3)]])
    rest = make_plant("tavares", eye="eve_v3").rest(motor)
    gaze = directions(row["yaw_deg"], row["pitch_deg"])
    np.testing.assert_allclose(rotations.gaze(rest)[0], gaze, atol=1e-6)
    assert float(torsion(rest)[0]) == pytest.approx(row["torsion_deg"], abs=1e-6)
    assert [rows[0][f"{name}_deg"] for name in ("left", "up", "yaw", "pitch")] == [0, 0, 0, 0]
    assert rows[1]["left_deg"] > 0
    assert result["largest_cone_deg"] == pytest.approx(38.9, abs=0.1)


def test_a_limit_beyond_the_cone_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, told = answer(capsys, "--plant", "tavares", "--eye", "eve_v3", "--limit", 45, "--out", tmp_path / "run")
    assert code == 2
    assert "up to 38.9 deg" in told["error"]
    assert not (tmp_path / "run").exists()


def test_one_motor_has_no_torsion_to_choose() -> None:
    with pytest.raises(InputError, match="no elastics are known"):
        Held.of(make_plant("lpf"), directions([0.0], [0.0]))
