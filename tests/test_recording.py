"""Recordings: numbers read back from the file, other eyes, failures, and the viewer without a screen."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from orient_eye import rotations
from orient_eye.cli.view import View
from orient_eye.errors import InputError
from orient_eye.eyes.model import Tendons, build_model
from orient_eye.eyes.muscles import Muscles
from orient_eye.motor import Motor
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.recording import curves, record, record_sequence, viewer
from orient_eye.recording.poses import pose, tendon_names
from orient_eye.recording.scene import SLACK_COLOUR, TENSION_COLOURS, tension_colours

TARGETS_DEG = np.array([10.0, -15.0, 20.0])

# Two motors, a globe that is not called "eye", tendons over a pulley and around a sphere, every primitive.
OTHER_EYE = """
<mujoco>
  <option gravity="0 0 0"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="0.3 0.3 0.1" pos="0 0 -0.2"/>
    <geom name="box" type="box" size="0.01 0.02 0.03" pos="-0.2 0 -0.1"/>
    <geom name="axle" type="cylinder" size="0.005 0.05" pos="-0.1 0.09 0"/>
    <site name="anchor" pos="-0.3 0.02 0"/>
    <site name="side" pos="-0.1 0.12 0.01"/>
    <body name="globe" pos="0.01 0 0.02">
      <joint name="eye" type="ball"/>
      <geom name="ball" type="sphere" size="0.03" mass="0.2" rgba="1 1 1 1"/>
      <geom name="lens" type="ellipsoid" size="0.005 0.015 0.015" pos="0.03 0 0"/>
      <geom name="collision" type="sphere" size="0.05" group="3"/>
      <site name="left" pos="0 0.03 0"/>
      <site name="top" pos="0 0 0.03"/>
    </body>
    <body name="pan_arm" pos="-0.2 0 0">
      <joint name="pan_hinge" axis="0 0 1"/>
      <geom name="rod" type="capsule" size="0.004 0.05" euler="90 0 0" mass="0.1"/>
      <site name="pan_end" pos="0 0.05 0"/>
    </body>
    <body name="tilt_arm" pos="-0.2 0 0.1">
      <joint name="tilt_hinge" axis="0 1 0"/>
      <geom type="box" size="0.002 0.002 0.05" mass="0.1"/>
      <site name="tilt_end" pos="0 0 0.05"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="horizontal" springlength="0 0.1" stiffness="10">
      <site site="pan_end"/> <geom geom="axle" sidesite="side"/> <site site="left"/>
    </spatial>
    <spatial name="vertical" springlength="0 0.5" stiffness="10">
      <site site="tilt_end"/> <site site="anchor"/> <pulley divisor="2"/> <site site="anchor"/> <site site="top"/>
    </spatial>
  </tendon>
  <actuator>
    <position name="tilt" joint="tilt_hinge"/>
    <position name="pan" joint="pan_hinge"/>
  </actuator>
</mujoco>
"""


@pytest.fixture(scope="module")
def saccades() -> Trajectory:
    command = np.zeros((3, 150, 3))
    command[:, 10:, 1] = TARGETS_DEG[:, None] / 1.476
    return MujocoPlant().move(command).trajectory()


@pytest.fixture(scope="module")
def recorded(saccades: Trajectory, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "three.rrd"
    target = rotations.from_yaw(TARGETS_DEG)
    return record(path, saccades, model=build_model(), target=target, notes="# Three saccades")


def horizontal(motors: tuple[str, ...], saccades: int = 1, samples: int = 40, unit: str = "deg") -> Trajectory:
    """Saccades that turn left with their motors, of a plant without tendons."""
    yaw = np.linspace(0, 12, samples) * np.arange(1, saccades + 1)[:, None]
    velocity = np.zeros((saccades, samples, 3))
    velocity[..., 2] = np.gradient(yaw, 1e-3, axis=1)
    motor = yaw[..., None] / 1.5 + np.arange(len(motors))
    time, failed = 1e-3 * np.arange(samples, dtype=float), np.zeros(saccades, bool)
    described = tuple(Motor(name, unit) for name in motors)
    return Trajectory(time, rotations.from_yaw(yaw), velocity, motor, motor, None, failed, described)


def entities(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in RrdReader(path).stream()}


def column(path: Path, entity: str, component: str) -> tuple[NDArray[np.float64], list[Any]]:
    """Times [s] and values of a component of an entity; no times where it is static."""
    for chunk in RrdReader(path).stream().filter(content=entity):
        batch = chunk.to_record_batch()
        if component in batch.schema.names:
            time = batch.column("sim_time").cast("int64").to_numpy() / 1e9 if not chunk.is_static else np.zeros(0)
            return time, batch.column(component).to_pylist()
    raise AssertionError(f"{entity} has no {component}")


def scalars(path: Path, entity: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    time, values = column(path, entity, "Scalars:scalars")
    return time, np.array(values).squeeze()


def verify(path: Path) -> None:
    done = subprocess.run(
        [viewer._executable(), "rrd", "verify", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_curves_are_the_trajectory_exactly(saccades: Trajectory, recorded: Path) -> None:
    for k, root in enumerate(("/saccades/0_10deg", "/saccades/1_-15deg", "/saccades/2_20deg")):
        for entity, expected in (
            ("angle/yaw", saccades.yaw_deg[k]),
            ("velocity/z", saccades.angular_velocity[k, :, 2]),
            ("motor/motor2", saccades.motor[k, :, 1]),
            ("tension", saccades.tension[k]),
        ):
            time, values = scalars(recorded, f"{root}/{entity}")
            np.testing.assert_allclose(time, saccades.time, atol=1e-9)
            np.testing.assert_array_equal(values, expected)
        time, values = scalars(recorded, f"{root}/angle/target_yaw")
        np.testing.assert_allclose(values, TARGETS_DEG[k])
        np.testing.assert_allclose(time, saccades.time[[0, -1]], atol=1e-9)
        assert (scalars(recorded, f"{root}/motor/motor3")[1] == 0).all()


def test_the_eye_turns_as_the_trajectory_says(saccades: Trajectory, recorded: Path) -> None:
    _, xyzw = column(recorded, "/saccades/2_20deg/scene/eye", "Transform3D:quaternion")
    turned = np.roll(np.array(xyzw).squeeze(), 1, axis=-1)
    assert rotations.angle_between(turned, saccades.orientation[2]).max() < 1e-4
    _, xyzw = column(recorded, "/saccades/2_20deg/scene/arm2", "Transform3D:quaternion")
    arm = rotations.to_euler(np.roll(np.array(xyzw).squeeze(), 1, axis=-1))[0]
    np.testing.assert_allclose(arm, saccades.motor[2, :, 1], atol=1e-4)
    # The line of sight starts at the pupil and ends, like the target, on a sphere about the eye.
    ((start, end),) = column(recorded, "/saccades/2_20deg/scene/eye/gaze", "LineStrips3D:strips")[1][0]
    ((*target,),) = column(recorded, "/saccades/2_20deg/scene/target", "Points3D:positions")[1][0]
    np.testing.assert_allclose(start, build_model().site("gaze").pos, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(end), np.linalg.norm(target), rtol=1e-6)
    np.testing.assert_allclose(np.rad2deg(np.arctan2(target[1], target[0])), 20, atol=1e-4)


def test_tendons_run_from_arm_to_eye_in_the_colour_of_their_tension(saccades: Trajectory, recorded: Path) -> None:
    _, rows = column(recorded, "/saccades/2_20deg/scene/tendons", "LineStrips3D:strips")
    _, colours = column(recorded, "/saccades/2_20deg/scene/tendons", "LineStrips3D:colors")
    model = build_model()
    data = mujoco.MjData(model)
    data.joint("eye").qpos[:] = saccades.orientation[2, 60]
    data.joint("motor2").qpos[:] = np.deg2rad(saccades.motor[2, 60, 1])
    mujoco.mj_forward(model, data)
    right = tendon_names(model).index("motor2_right")
    ends = [data.site("arm_motor2_right").xpos, data.site("eye_motor2_right").xpos]
    np.testing.assert_allclose(rows[60][right], ends, atol=1e-6)
    assert saccades.tension is not None
    top = np.ceil(saccades.tension.max())
    for i, packed in enumerate(colours[60]):
        rgb = [packed >> shift & 255 for shift in (24, 16, 8)]
        np.testing.assert_array_equal(rgb, tension_colours(saccades.tension[2, 60, i], top))


def test_colour_scale_sets_slack_apart() -> None:
    colours = tension_colours([0.0, 1e-9, 2.0, 5.0], 2.0)
    np.testing.assert_array_equal(colours[[0, 2, 3]], [SLACK_COLOUR, TENSION_COLOURS[-1], TENSION_COLOURS[-1]])
    np.testing.assert_allclose(colours[1], TENSION_COLOURS[0], atol=1)


def test_file_is_whole_has_a_layout_and_draws_once_what_stands_still(recorded: Path) -> None:
    verify(recorded)
    reader = RrdReader(recorded)
    assert len(reader.recordings()) == len(reader.blueprints()) == 1
    drawn = entities(recorded)
    assert {"/head/world/base", "/head/arm1/arm1", "/head/protractor"} <= drawn
    assert not any("arm1" in each for each in drawn if each.startswith("/saccades"))
    text = column(recorded, "/info", "TextDocument:text")[1][0][0]
    assert text.startswith("# Three saccades")
    assert "| +20° |" in text


def test_a_plant_with_one_motor_and_no_tendons(tmp_path: Path) -> None:
    trajectory = horizontal(("motor2",))
    path = record(tmp_path / "one.rrd", trajectory, model=build_model())
    verify(path)
    np.testing.assert_array_equal(scalars(path, "/saccades/0_saccade_0/angle/yaw")[1], trajectory.yaw_deg[0])
    np.testing.assert_array_equal(scalars(path, "/saccades/0_saccade_0/motor/motor2")[1], trajectory.motor[0, :, 0])
    assert "/saccades/0_saccade_0/motor/motor1" not in entities(path)
    tension = scalars(path, "/saccades/0_saccade_0/tension")[1]
    model = build_model()
    data = mujoco.MjData(model)
    data.joint("eye").qpos[:] = trajectory.orientation[0, -1]
    data.joint("motor2").qpos[:] = np.deg2rad(trajectory.motor[0, -1])
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(tension[-1], Tendons.of(model).tension(data.ten_length, data.ctrl), atol=1e-9)


@pytest.mark.parametrize("motors", [("motor2",), ("pan", "tilt"), ()])
def test_an_eye_without_a_model_is_a_ball(motors: tuple[str, ...], tmp_path: Path) -> None:
    """Whatever moves it, and where nothing is known to: no arm, no tendon, and never the thesis' eye."""
    trajectory = horizontal(motors, saccades=2, unit="mm")
    path = record(tmp_path / "ball.rrd", trajectory, reference=trajectory)
    verify(path)
    drawn, root = entities(path), "/saccades/1_saccade_1"
    assert {f"{root}/scene/eye/sclera", f"{root}/scene/eye/gaze", "/head/protractor"} <= drawn
    assert {each for each in drawn if each.startswith(f"{root}/motor")} == {f"{root}/motor/{name}" for name in motors}
    assert not any("arm" in each or "tension" in each or "tendon" in each for each in drawn)
    _, xyzw = column(path, f"{root}/scene/eye", "Transform3D:quaternion")
    turned = np.roll(np.array(xyzw).squeeze(), 1, axis=-1)
    assert rotations.angle_between(turned, trajectory.orientation[1]).max() < 1e-4
    assert "Tendons" not in column(path, "/info", "TextDocument:text")[1][0][0]


def test_a_command_is_drawn_where_its_motor_did_not_follow(tmp_path: Path) -> None:
    trajectory = horizontal(("pan", "tilt"), saccades=2, unit="mm")
    command = trajectory.motor.copy()
    command[1, 20:, 1] += 3.0
    apart = replace(trajectory, command=command)
    path = record(tmp_path / "told.rrd", apart)
    verify(path)
    for k in (0, 1):
        root = f"/saccades/{k}_saccade_{k}"
        np.testing.assert_array_equal(scalars(path, f"{root}/command/tilt")[1], command[k, :, 1])
        np.testing.assert_array_equal(scalars(path, f"{root}/motor/tilt")[1], trajectory.motor[k, :, 1])
    assert not any("command/pan" in each for each in entities(path))
    shown = {plot.name: plot for plot in curves.Curves(apart, [0, 1], np.zeros((2, 40, 0)), ()).plots()}
    plot = shown["pan, tilt [mm], command grey"]
    assert plot.series == ("motor/pan", "motor/tilt", "command/tilt")
    assert plot.span == (0.0, command.max())
    assert not curves.Curves(apart, [0], np.zeros((2, 40, 0)), ()).told  # drawn only where it is seen
    motors = (Motor("pan", "mm"), Motor("tilt", "deg"))
    mixed = curves.Curves(replace(apart, motors=motors), [0, 1], np.zeros((2, 40, 0)), ()).plots()
    assert [each.name for each in mixed][1:3] == ["pan [mm]", "tilt [deg], command grey"]


SIX = ("IR", "MR", "SR", "LR", "IO", "SO")
ANTAGONISTS = [("IR", "SR"), ("MR", "LR"), ("IO", "SO")]  # anatomy


@pytest.fixture(scope="module")
def six() -> tuple[MujocoPlant, Trajectory]:
    """MR winds up, LR lets go."""
    plant = MujocoPlant(eye="six")
    command = np.tile([motor.rest for motor in plant.motors], (2, 60, 1))
    command[0, 5:] += [0, 10, 0, -10, 0, 0]
    return plant, plant.move(command).trajectory()


def test_antagonists_are_those_of_anatomy_and_other_eyes_have_none() -> None:
    muscles = Muscles.of(build_model("six"))
    assert muscles is not None
    assert muscles.names == SIX
    assert [tuple(SIX[i] for i in pair) for pair in muscles.pairs.tolist()] == ANTAGONISTS
    for model in (build_model(), mujoco.MjModel.from_xml_string(OTHER_EYE)):
        assert Muscles.of(model) is None


def test_each_muscle_has_its_tension_and_its_name(six: tuple[MujocoPlant, Trajectory], tmp_path: Path) -> None:
    plant, trajectory = six
    path = record(tmp_path / "six.rrd", trajectory, model=plant.drawn())
    verify(path)
    root = "/saccades/0_saccade_0"
    assert trajectory.tension is not None
    for i, name in enumerate(SIX):
        np.testing.assert_array_equal(scalars(path, f"{root}/tension/{name}")[1], trajectory.tension[0, :, i])
    assert f"{root}/tension" not in entities(path)
    (labels,) = column(path, f"{root}/scene/muscles", "Points3D:labels")[1]
    assert tuple(labels) == SIX
    _, places = column(path, f"{root}/scene/muscles", "Points3D:positions")
    model = build_model("six")
    data = mujoco.MjData(model)
    data.joint("eye").qpos[:] = trajectory.orientation[0, 40]
    mujoco.mj_forward(model, data)
    middle = [(data.site(f"head_{name}").xpos + data.site(f"eye_{name}").xpos) / 2 for name in SIX]
    np.testing.assert_allclose(places[40], middle, atol=1e-6)
    sequence = record_sequence(tmp_path / "sequence.rrd", trajectory[[1, 0]], model=plant.drawn())
    assert {"/sequence/scene/muscles", "/sequence/tension/SO"} <= entities(sequence)


def test_antagonists_share_a_plot_on_the_scale_of_all(six: tuple[MujocoPlant, Trajectory]) -> None:
    _, trajectory = six
    assert trajectory.tension is not None
    muscles = Muscles.of(build_model("six"))
    every = curves.Curves(trajectory, [0, 1], trajectory.tension, SIX, muscles=muscles)
    _, motors, tensions = ([plot for plot in every.plots() if plot.row == row] for row in (1, 2, 3))
    assert [plot.name for plot in motors] == ["IR, SR [deg]", "MR, LR [deg]", "IO, SO [deg]"]
    assert [plot.labels for plot in tensions] == ANTAGONISTS
    assert {plot.span for plot in tensions} == {(0.0, trajectory.tension.max())}
    compared = [plot.name for plot in every.compared()]
    assert compared[-6:] == [f"{name} [deg]" for pair in zip(*ANTAGONISTS, strict=True) for name in pair]
    at_rest = tension_colours(trajectory.tension[1, 0], np.ceil(trajectory.tension.max()))
    assert np.ptp(at_rest.astype(int), axis=0).max() < 60  # pretension looks alike in all of them
    assert not (at_rest == SLACK_COLOUR).all(axis=-1).any()


def test_another_preset_draws_itself(tmp_path: Path) -> None:
    trajectory = horizontal(("motor1", "motor2", "motor3"), saccades=2)
    path = record(tmp_path / "v3.rrd", trajectory, model=build_model("eve_v3"))
    verify(path)
    _, xyzw = column(path, "/saccades/1_saccade_1/scene/arm3", "Transform3D:quaternion")
    pitch = rotations.to_euler(np.roll(np.array(xyzw).squeeze(), 1, axis=-1))[1]
    np.testing.assert_allclose(pitch, -trajectory.motor[1, :, 2], atol=1e-4)  # it counts the other way


def test_an_eye_nobody_thought_of_draws_itself(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(OTHER_EYE)
    trajectory = horizontal(("pan", "tilt"), saccades=2)
    path = record(tmp_path / "other.rrd", trajectory, model=model)
    verify(path)
    drawn = entities(path)
    assert {"/head/world/floor", "/saccades/0_saccade_0/scene/globe/gaze"} <= drawn
    assert "/saccades/0_saccade_0/scene/globe/lens" in drawn
    assert not any("collision" in each for each in drawn)
    poses = pose(model, trajectory)
    data = mujoco.MjData(model)
    for row in (0, 39):
        data.joint("eye").qpos[:] = trajectory.orientation[1, row]
        for i, hinge in enumerate(("pan_hinge", "tilt_hinge")):
            data.joint(hinge).qpos[:] = np.deg2rad(trajectory.motor[1, row, i])
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(poses.position[1, row], data.xpos)
        np.testing.assert_allclose(poses.orientation[1, row], data.xquat)
        np.testing.assert_allclose(poses.tension[1, row], Tendons.of(model).tension(data.ten_length, data.ctrl))
        strips, tendon, counts = poses.strips(1, slice(row, row + 1))
        assert tendon.tolist() == [0, 1, 1]  # the pulley splits the second
        assert counts.tolist() == [3]
        np.testing.assert_allclose(strips[0][[0, -1]], [data.site("pan_end").xpos, data.site("left").xpos])
        np.testing.assert_allclose(strips[1], [data.site("tilt_end").xpos, data.site("anchor").xpos])
        np.testing.assert_allclose(strips[2], [data.site("anchor").xpos, data.site("top").xpos])


def test_failed_saccades_are_left_out_with_a_note(tmp_path: Path) -> None:
    command = np.zeros((3, 30, 3))
    command[1, 5:] = np.nan
    trajectory = MujocoPlant().move(command).trajectory()
    assert trajectory.failed.tolist() == [False, True, False]
    path = record(tmp_path / "failed.rrd", trajectory, titles=["a", "b", "c"], reference=trajectory)
    verify(path)
    drawn = entities(path)
    assert any(each.startswith("/saccades/2_c") for each in drawn)
    assert not any(each.startswith("/saccades/1_b") for each in drawn)
    assert "| b |  | **failed" in column(path, "/info", "TextDocument:text")[1][0][0]
    alone = record(tmp_path / "alone.rrd", trajectory[1])
    verify(alone)
    assert "failed" in column(alone, "/info", "TextDocument:text")[1][0][0]


def test_groups_and_a_reference(tmp_path: Path) -> None:
    trajectory = horizontal(("motor2",), saccades=4)
    reference = horizontal(("motor2",), saccades=4, samples=60)
    titles, groups = ["near", "far"] * 2, ["0 %", "0 %", "100 %", "100 %"]
    path = record(tmp_path / "groups.rrd", trajectory, titles=titles, groups=groups, reference=reference)
    verify(path)
    beside = scalars(path, "/saccades/100_percent/2_near/reference/angle/yaw")
    np.testing.assert_array_equal(beside[1], reference.yaw_deg[2])
    colours = [
        column(path, f"/saccades/{root}/angle/yaw", "SeriesLines:colors")[1][0]
        for root in ("0_percent/0_near", "0_percent/1_far", "100_percent/2_near")
    ]
    assert colours[0] == colours[2] != colours[1]


def test_a_failing_write_leaves_the_old_file(
    saccades: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path / "kept.rrd", saccades[0])
    before = path.read_bytes()

    def fail(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(curves, "_send", fail)
    with pytest.raises(InputError, match=r"cannot write .*kept\.rrd: disk full"):
        record(path, saccades)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    assert not rr.strict_mode()


def test_a_recording_is_whole(recorded: Path) -> None:
    """Its footer ends the file, and the layout in it is that of its application."""
    content = recorded.read_bytes()
    assert content.startswith(b"RRF2")
    assert content[-12:-4] == b"RRF2FOOT"
    reader = RrdReader(recorded)
    (layout,), (data,) = reader.blueprints(), reader.recordings()
    assert layout.application_id == data.application_id
    assert layout.application_id.startswith("orient-eye-")


def test_titles_say_where_a_saccade_comes_from_and_goes(tmp_path: Path) -> None:
    trajectory = horizontal(("motor2",))
    turned = replace(trajectory, orientation=trajectory.orientation[:, ::-1])
    path = record(tmp_path / "back.rrd", turned, target=rotations.from_euler([-3.25], [10], [0]))
    assert "/saccades/0_12deg_0deg_-3.2deg_10deg/scene/target" in entities(path)
    assert "| +12°, +0° → -3.2°, +10° |" in column(path, "/info", "TextDocument:text")[1][0][0]


def test_importing_it_is_light() -> None:
    code = "import sys, orient_eye.recording, orient_eye.cli.view; print(sys.modules.keys() & {'rerun', 'trimesh'})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_bad_input_is_refused(saccades: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"NAME\.rrd"):
        record(tmp_path / "eye.mp4", saccades)
    with pytest.raises(InputError, match=r"shape \(3, 4\)"):
        record(tmp_path / "eye.rrd", saccades, target=TARGETS_DEG)
    with pytest.raises(InputError, match="titles: one for each of the 3"):
        record(tmp_path / "eye.rrd", saccades, titles=["one"])
    with pytest.raises(InputError, match=r"moves tilt, .* motor1, motor2, motor3.*plant\.drawn"):
        record(tmp_path / "eye.rrd", horizontal(("tilt",)), model=build_model())
    with pytest.raises(InputError, match="at least one"):
        record(tmp_path / "eye.rrd", saccades[:0])
    assert not list(tmp_path.iterdir())


def test_view_refuses_what_it_cannot_show(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = tmp_path / "text.rrd"
    text.write_text("not a recording")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    for view, message in (
        (View(tmp_path / "missing.rrd"), r"cannot read .*missing\.rrd: No such file .*; orient-eye simulate writes"),
        (View(tmp_path), "is a folder; name the recording in it"),
        (View(text), "not a recording"),
        (View(recorded), "--screenshot"),
        (View(recorded, screenshot=tmp_path / "eye.jpg"), r"NAME\.png"),
        (View(recorded, screenshot=tmp_path / "eye.png", web=True), "exclude"),
    ):
        with pytest.raises(InputError, match=message):
            view.run()


def test_viewer_shows_every_view_without_a_screen(recorded: Path, tmp_path: Path) -> None:
    picture = tmp_path / "eye.png"
    try:
        result = View(recorded, screenshot=picture, at=0.05, tab=("+20°",), size=(800, 500)).run()
    except InputError as error:
        pytest.skip(str(error))
    assert result["not_shown"] == []
    assert picture.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match=r"no tab 'left'.*\+20°"):
        viewer.screenshot(recorded, picture, tab=("left",))
