"""Recordings in three dimensions: the gaze on its net, torsion, Listing's plane, and saccades one after the other."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from orient_eye import rotations
from orient_eye.cli.view import View
from orient_eye.errors import InputError
from orient_eye.motor import Motor
from orient_eye.movement.trajectory import Trajectory, concatenate
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.recording import record, record_sequence
from orient_eye.recording.directions import net
from orient_eye.recording.rotation_vectors import RotationVectors
from orient_eye.state import State
from test_recording import column, entities, horizontal, scalars, verify

Array = NDArray[np.float64]
PLANE = (0.01, 0.05, -0.08)  # r_x = a + b r_y + c r_z
ENDS = np.array([[0.15, -0.1], [-0.2, -0.05], [0.05, 0.25]])  # r_y, r_z
MOTORS = tuple(Motor(name, "deg") for name in ("one", "two", "three"))
SAMPLES = 50


def on_plane(yz: Array) -> Array:
    """Rotation vectors (..., 3) on PLANE."""
    y, z = np.moveaxis(yz, -1, 0)
    return np.stack([PLANE[0] + PLANE[1] * y + PLANE[2] * z, y, z], axis=-1)


def quaternions(r: Array) -> Array:
    q = np.concatenate([np.ones((*r.shape[:-1], 1)), r], axis=-1)
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


def gaze(r: Array) -> Array:
    """First column of Cayley's rotation matrix of rotation vectors (..., 3)."""
    x, y, z = np.moveaxis(r, -1, 0)
    first = np.stack([1 + x * x - y * y - z * z, 2 * (x * y + z), 2 * (x * z - y)], axis=-1)
    return np.asarray(first / (1 + (r * r).sum(axis=-1))[..., None])


def straight(starts: Array, ends: Array) -> tuple[Trajectory, Array]:
    """Saccades on straight lines of r_y, r_z (saccades, 2) on PLANE, and their rotation vectors."""
    share = np.sin(np.linspace(0, np.pi / 2, SAMPLES))[:, None] ** 2
    r = on_plane(starts[:, None] * (1 - share) + ends[:, None] * share)
    motor = np.rad2deg(r)
    velocity = np.gradient(motor, 1e-3, axis=1)
    time, failed = 1e-3 * np.arange(SAMPLES, dtype=float), np.zeros(len(r), bool)
    return Trajectory(time, quaternions(r), velocity, motor, motor, None, failed, MOTORS), r


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Trajectory, Array]:
    trajectory, r = straight(np.zeros((3, 2)), ENDS)
    path = tmp_path_factory.mktemp("three") / "three.rrd"
    return record(path, trajectory, target=quaternions(r[:, -1]), titles=["a", "b", "c"]), trajectory, r


@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Trajectory, Array]:
    trajectory, r = straight(np.concatenate([np.zeros((1, 2)), ENDS[:-1]]), ENDS)
    path = tmp_path_factory.mktemp("sequence") / "sequence.rrd"
    return record_sequence(path, trajectory, target=quaternions(r[:, -1]), pause_s=0.02), trajectory, r


def strips(path: Path, entity: str) -> tuple[NDArray[np.float64], list[Any]]:
    """All rows of a line that grows: times [s], strips."""
    times, rows = [], []
    for chunk in RrdReader(path).stream().filter(content=entity):
        batch = chunk.to_record_batch()
        if "LineStrips3D:strips" in batch.schema.names:
            times += (batch.column("sim_time").cast("int64").to_numpy() / 1e9).tolist()
            rows += [row[0] for row in batch.column("LineStrips3D:strips").to_pylist()]
    return np.array(times), rows


def test_the_trace_is_the_way_of_the_gaze(three: tuple[Path, Trajectory, Array]) -> None:
    path, _, r = three
    verify(path)
    for k, title in enumerate("abc"):
        root = f"/saccades/{k}_{title}/scene"
        ((target,),) = column(path, f"{root}/target", "Points3D:positions")[1]
        reach = np.linalg.norm(target)
        ((trace,),) = column(path, f"{root}/trace", "LineStrips3D:strips")[1]
        np.testing.assert_allclose(trace, reach * gaze(r[k]), atol=1e-6 * reach)
        np.testing.assert_allclose(trace[-1], target, atol=1e-6 * reach)
        ((ring,),) = column(path, f"{root}/start", "LineStrips3D:strips")[1]
        away = np.rad2deg(np.arccos(ring @ gaze(r[k, 0]) / reach))
        np.testing.assert_allclose(away, 1.5, atol=1e-3)
        np.testing.assert_allclose(ring[0], ring[-1], atol=1e-6)


def test_torsion_has_its_own_curve(three: tuple[Path, Trajectory, Array]) -> None:
    path, trajectory, r = three
    for k, title in enumerate("abc"):
        root = f"/saccades/{k}_{title}"
        np.testing.assert_allclose(
            scalars(path, f"{root}/angle/torsion")[1], np.rad2deg(2 * np.arctan(r[k, :, 0])), atol=1e-9
        )
        wanted = scalars(path, f"{root}/angle/target_torsion")[1]
        np.testing.assert_allclose(wanted, np.rad2deg(2 * np.arctan(r[k, -1, 0])), atol=1e-9)
        np.testing.assert_array_equal(scalars(path, f"{root}/velocity/x")[1], trajectory.angular_velocity[k, :, 0])
    assert not any("roll" in entity for entity in entities(path))


def test_the_net_is_of_circles_of_eccentricity_and_meridians(three: tuple[Path, Trajectory, Array]) -> None:
    path = three[0]
    ((*lines,),) = column(path, "/head/directions", "LineStrips3D:strips")[1]
    lines = [np.array(line) / np.linalg.norm(line[0]) for line in lines]
    away = [np.rad2deg(np.arccos(np.clip(line[:, 0], -1, 1))) for line in lines]
    assert [round(a.mean()) for a in away[:4]] == [10, 20, 30, 40]
    assert max(np.ptp(a) for a in away[:4]) < 1e-3
    for line in lines[4:]:  # great circles through straight ahead: each in a plane with x
        assert np.linalg.svd(np.concatenate([line, [[1, 0, 0]]]), compute_uv=False)[-1] < 1e-5
    (labels,) = column(path, "/head/directions/degrees", "Points3D:labels")[1]
    ((*marks,),) = column(path, "/head/directions/degrees", "Points3D:positions")[1]
    where = dict(zip(labels, np.array(marks), strict=True))
    assert where["left"][1] > 0 > where["right"][1]
    assert where["up"][2] > 0 > where["down"][2]
    assert where["20°"][0] / np.linalg.norm(where["20°"]) == pytest.approx(np.cos(np.deg2rad(20)))
    assert net(57.0).labels[:6] == ["10°", "20°", "30°", "40°", "50°", "60°"]


def test_listings_plane_stands_where_the_rotation_vectors_lie(three: tuple[Path, Trajectory, Array]) -> None:
    path, trajectory, r = three
    factor = RotationVectors(trajectory.orientation.reshape(-1, 4)).factor
    assert factor > 1  # torsion is small here
    for k, title in enumerate("abc"):
        root = f"/saccades/{k}_{title}/listing"
        drawn = np.rad2deg(2 * np.arctan(r[k])) * [factor, 1, 1]
        ((line,),) = column(path, f"{root}/path", "LineStrips3D:strips")[1]
        np.testing.assert_allclose(line, drawn, atol=1e-5)
        ((end,),) = column(path, f"{root}/end", "Points3D:positions")[1]
        np.testing.assert_allclose(end, drawn[-1], atol=1e-5)
        time, moments = column(path, f"{root}/moment", "Points3D:positions")
        np.testing.assert_allclose(time, trajectory.time, atol=1e-9)
        np.testing.assert_allclose(np.array(moments)[:, 0], drawn, atol=1e-5)
    (corners,) = column(path, "/listing/plane", "Mesh3D:vertex_positions")[1]
    vectors = np.tan(np.deg2rad(np.array(corners) / [factor, 1, 1]) / 2)
    np.testing.assert_allclose(vectors, on_plane(vectors[:, 1:]), atol=1e-6)
    text = column(path, "/info", "TextDocument:text")[1][0][0]
    assert "thickness 0.00°" in text
    assert f"by {np.rad2deg(np.arctan(-PLANE[1])):+.2f}° of yaw" in text


@given(st.floats(0.01, 60), st.floats(1, 60))
def test_torsion_is_drawn_larger_but_not_too_large(torsion_deg: float, gaze_deg: float) -> None:
    r = np.tan(np.deg2rad([[torsion_deg, gaze_deg, 0], [0, 0, gaze_deg], [0, 0, 0], [0, gaze_deg, 0]]) / 2)
    vectors = RotationVectors(quaternions(r))
    places = np.abs(vectors.at(quaternions(r)))
    assert vectors.factor in {1, 2, 5, 10, 20}
    assert vectors.factor == 1 or places[:, 0].max() <= 0.75 * (places[:, 1:].max() + 10)
    assert (f"{vectors.factor} times" in vectors.name) == (vectors.factor > 1)


def test_saccades_along_one_line_have_no_plane(tmp_path: Path) -> None:
    trajectory, _ = straight(np.zeros((1, 2)), ENDS[:1])
    path = record(tmp_path / "line.rrd", trajectory)
    verify(path)
    drawn = entities(path)
    assert {"/saccades/0_saccade_0/listing/path", "/listing/axes"} <= drawn
    assert "/listing/plane" not in drawn
    assert "no one plane" in column(path, "/info", "TextDocument:text")[1][0][0]


def test_the_reference_leaves_a_trace_too(three: tuple[Path, Trajectory, Array], tmp_path: Path) -> None:
    trajectory = three[1]
    other, beside = straight(np.zeros((3, 2)), 0.9 * ENDS)
    path = record(tmp_path / "two.rrd", trajectory, reference=other)
    verify(path)
    ((trace,),) = column(path, "/saccades/1_saccade_1/scene/reference_trace", "LineStrips3D:strips")[1]
    ((own,),) = column(path, "/saccades/1_saccade_1/scene/trace", "LineStrips3D:strips")[1]
    reach = np.linalg.norm(own[0])
    np.testing.assert_allclose(trace, reach * gaze(beside[1]), atol=1e-6 * reach)
    torsion = scalars(path, "/saccades/1_saccade_1/reference/angle/torsion")[1]
    np.testing.assert_allclose(torsion, np.rad2deg(2 * np.arctan(beside[1, :, 0])), atol=1e-9)


def test_horizontal_saccades_are_drawn_as_ever(tmp_path: Path) -> None:
    trajectory = horizontal(("motor2",), saccades=2)
    drawn = entities(record(tmp_path / "flat.rrd", trajectory, target=rotations.from_yaw([12.0, 24.0])))
    assert "/head/protractor" in drawn
    assert not any(new in each for each in drawn for new in ("directions", "trace", "torsion", "listing", "pitch"))


def test_vertical_saccades_leave_a_trace_and_no_torsion(tmp_path: Path) -> None:
    flat = horizontal(("motor1",))
    trajectory = replace(flat, orientation=rotations.about("pitch", flat.yaw_deg))
    drawn = entities(record(tmp_path / "down.rrd", trajectory))
    root = "/saccades/0_saccade_0"
    assert {f"{root}/scene/trace", f"{root}/angle/pitch", "/head/directions"} <= drawn
    assert not any(new in each for each in drawn for new in ("torsion", "listing"))


def test_all_six_tendons_have_their_tension(tmp_path: Path) -> None:
    plant = MujocoPlant()
    command = np.zeros((1, 60, 3))
    command[:, 5:] = [4.0, 8.0, 6.0]
    trajectory = plant.move(command).trajectory()
    path = record(tmp_path / "six.rrd", trajectory, model=plant.drawn())
    _, tension = scalars(path, "/saccades/0_saccade_0/tension")
    assert tension.shape == (60, 6)
    np.testing.assert_array_equal(tension, trajectory.tension[0])  # type: ignore[index]  # an elastic plant has one
    (names,) = column(path, "/saccades/0_saccade_0/tension", "SeriesLines:names")[1][:1]
    assert names == list(trajectory.tendon_names)


def test_a_sequence_is_one_series_with_pauses(sequence: tuple[Path, Trajectory, Array]) -> None:
    path, trajectory, r = sequence
    verify(path)
    every = SAMPLES + 19  # 20 ms from the last sample to the next's first, both of which are there already
    time, torsion = scalars(path, "/sequence/angle/torsion")
    np.testing.assert_allclose(time, 1e-3 * np.arange(3 * every), atol=1e-9)
    (_, motor), (_, speed) = (scalars(path, f"/sequence/{name}") for name in ("motor/two", "velocity/z"))
    _, wanted = scalars(path, "/sequence/angle/target_torsion")
    for k in range(3):
        moving, resting = slice(k * every, k * every + SAMPLES), slice(k * every + SAMPLES, (k + 1) * every)
        np.testing.assert_allclose(torsion[moving], np.rad2deg(2 * np.arctan(r[k, :, 0])), atol=1e-9)
        np.testing.assert_array_equal(torsion[resting], torsion[moving][-1])
        np.testing.assert_array_equal(motor[moving], trajectory.motor[k, :, 1])
        np.testing.assert_array_equal(motor[resting], trajectory.motor[k, -1, 1])
        np.testing.assert_array_equal(speed[moving], trajectory.angular_velocity[k, :, 2])
        assert not speed[resting].any()
        np.testing.assert_allclose(wanted[k * every : (k + 1) * every], np.rad2deg(2 * np.arctan(r[k, -1, 0])))


def test_a_sequences_trace_grows_and_its_targets_appear(sequence: tuple[Path, Trajectory, Array]) -> None:
    path, trajectory, r = sequence
    starts = 0.069 * np.arange(3)
    when, pieces = strips(path, "/sequence/scene/trace")
    targets = [column(path, f"/sequence/scene/target/{k + 1}", "Points3D:positions") for k in range(3)]
    reach = np.linalg.norm(targets[0][1][0][0])
    seen = np.concatenate([gaze(r[k]) for k in range(3)]) * reach
    order = np.argsort(when)
    drawn = np.array([pieces[i] for i in order])
    np.testing.assert_allclose(drawn[1:, 0], drawn[:-1, 1], atol=1e-6 * reach)  # without a gap
    moved = np.r_[True, np.linalg.norm(np.diff(seen, axis=0), axis=1) > 1e-9]
    np.testing.assert_allclose(np.concatenate([drawn[:1, 0], drawn[:, 1]]), seen[moved], atol=1e-6 * reach)
    assert (np.diff(when[order]) > 0).all()
    assert when.max() == pytest.approx(starts[2] + trajectory.time[-1])
    for k, (times, places) in enumerate(targets):
        np.testing.assert_allclose(times, starts[k : k + 2], atol=1e-9)
        np.testing.assert_allclose(places[0][0], reach * gaze(r[k, -1]), atol=1e-6 * reach)
    radii = column(path, "/sequence/scene/target/1", "Points3D:radii")[1]
    assert radii[0][0] > radii[1][0]
    times, ends = column(path, "/sequence/listing/ends", "Points3D:positions")
    np.testing.assert_allclose(times, starts + trajectory.time[-1], atol=1e-9)
    np.testing.assert_allclose(np.array(ends)[:, 0, 1:], np.rad2deg(2 * np.arctan(ENDS)), atol=1e-5)
    rows = column(path, "/info", "TextDocument:text")[1][0][0].splitlines()
    assert [row.split("|")[2].strip() for row in rows[-3:]] == [f"{start:.3f}" for start in starts]


def test_a_sequence_of_a_plant_with_tendons(tmp_path: Path) -> None:
    plant = MujocoPlant()
    start, parts = State(rotations.from_yaw([0.0]), np.zeros((1, 3))), []
    for yaw in (4.0, -3.0):
        command = np.repeat(start.motor[:, None], 200, axis=1)
        command[:, 10:, 1] = yaw
        parts.append(plant.move(command, start).trajectory())
        start = State(parts[-1].orientation[:, -1], parts[-1].motor[:, -1])
    both = concatenate(parts)
    path = record_sequence(tmp_path / "flat.rrd", both, model=plant.drawn(), titles=["left", "right"])
    verify(path)
    time, tension = scalars(path, "/sequence/tension")
    assert both.tension is not None
    second = round((both.time[-1] + 0.2) / 1e-3)
    np.testing.assert_allclose(time[second], both.time[-1] + 0.2)
    np.testing.assert_array_equal(tension[second : second + 200], both.tension[1])
    drawn = entities(path)
    assert {"/head/protractor", "/sequence/scene/trace", "/sequence/scene/tendons"} <= drawn
    assert not any("listing" in each or "torsion" in each for each in drawn)
    assert "| 2: right |" in column(path, "/info", "TextDocument:text")[1][0][0]


def test_a_sequence_that_is_none_is_refused(sequence: tuple[Path, Trajectory, Array], tmp_path: Path) -> None:
    _, trajectory, _ = sequence
    with pytest.raises(InputError, match=r"saccade 2 of the sequence starts .* deg from where"):
        record_sequence(tmp_path / "torn.rrd", trajectory[np.array([1, 0, 2])])
    with pytest.raises(InputError, match=r"saccade 3 of the sequence failed"):
        record_sequence(tmp_path / "failed.rrd", replace(trajectory, failed=np.array([False, False, True])))
    with pytest.raises(InputError, match=r"0 s or longer, got -0\.1"):
        record_sequence(tmp_path / "early.rrd", trajectory, pause_s=-0.1)
    with pytest.raises(InputError, match="titles: one for each of the 3"):
        record_sequence(tmp_path / "named.rrd", trajectory, titles=["one"])
    with pytest.raises(InputError, match=r"NAME\.rrd"):
        record_sequence(tmp_path / "eye.mp4", trajectory)
    parts: Any = {
        name: getattr(trajectory, name)[:, :1] for name in ("orientation", "angular_velocity", "command", "motor")
    }
    with pytest.raises(InputError, match="one sample each"):
        record_sequence(tmp_path / "short.rrd", replace(trajectory, time=trajectory.time[:1], **parts))
    with pytest.raises(InputError, match=r"shape \(3, 4\)"):
        record_sequence(tmp_path / "eye.rrd", trajectory, target=np.zeros(3))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("which", ["three", "sequence"])
def test_the_viewer_shows_all_of_it(which: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    path = request.getfixturevalue(which)[0]
    try:
        result = View(path, screenshot=tmp_path / "eye.png", at=0.1, size=(800, 500)).run()
    except InputError as error:
        pytest.skip(str(error))
    assert result["not_shown"] == []
