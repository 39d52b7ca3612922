"""Facts of the eyes: what holds for every entry of `EYES`, and the numbers of the thesis' eye and its other preset."""

import importlib.util
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye.errors import InputError
from orient_eye.eyes import EYES
from orient_eye.eyes.elastics import Elastics
from orient_eye.eyes.model import STANDARD_GRAVITY, Tendons, ball, build_model, model_hash, motors, side
from orient_eye.motor import names, ranges
from orient_eye.plants.elastic import ElasticPlant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.resources import data_folder
from orient_eye.rotations import rotation, to_euler

Array = NDArray[np.float64]
EYE3 = ("thesis", "eve_v3")
MOTORS = ("motor1", "motor2", "motor3")
TENDONS = ("motor1_upper", "motor1_lower", "motor2_right", "motor2_left", "motor3_upper", "motor3_lower")
SCRIPT = Path(__file__).parents[1] / "scripts" / "make_meshes.py"

# Source: the thesis author's published simulator, see docs/eye.md. In the order of TENDONS: E1, E2, E3, E4, E5, E6.
INSERTION_YZ = [
    [0.05302, 0.05302],
    [0.05302, -0.05302],
    [-0.07498, 0],
    [0.07498, 0],
    [-0.05302, 0.05302],
    [-0.05302, -0.05302],
]
NO_VIA = [np.nan] * 3
VIA = [[-0.2055, 0, 0.0525], [-0.2055, 0, -0.0525], NO_VIA, NO_VIA, [-0.2055, 0, 0.0525], [-0.2055, 0, -0.0525]]
ARM_END = [[0, 0, 0.1], [0, 0, -0.1], [0, -0.14, 0], [0, 0.14, 0], [0, 0, 0.1], [0, 0, -0.1]]
ARM_CENTRE = [[-0.436, -0.0835, 0], [-0.323, 0, 0], [-0.436, 0.0835, 0]]
REST_LENGTH = [0.36, 0.36, 0.24, 0.24, 0.36, 0.36]
TENSION_PER_STRETCH = 6.0
INSERTION_X = {"thesis": 0.007, "eve_v3": -0.007}
MOTOR3_AXIS = {"thesis": [0, 1, 0], "eve_v3": [0, -1, 0]}
INERTIA = {
    "thesis": np.diag([4.759e-5, 4.316e-5, 3.956e-5]),
    "eve_v3": np.array([[4.759e-4, -1e-7, 1.11e-5], [-1e-7, 4.316e-4, 0], [1.11e-5, 0, 3.956e-4]]),
}


def pose(model: mujoco.MjModel, seed: int = 0) -> mujoco.MjData:
    """The eye turned and turning, arms and spindles turned, all by chance."""
    rng = np.random.default_rng(seed)
    data = mujoco.MjData(model)
    data.joint("eye").qpos = Rotation.random(rng=rng).as_quat(scalar_first=True)
    data.joint("eye").qvel = rng.normal(size=3)
    for joint in arms(model):
        data.joint(joint).qpos = rng.uniform(-0.5, 0.5)
    for spindle in spindles(model):
        data.actuator(spindle).ctrl = rng.uniform(0.5, 1.5)
    mujoco.mj_forward(model, data)
    return data


def turning(model: mujoco.MjModel, what: mujoco.mjtTrn) -> list[str]:
    """Motors that turn joints, or tendons."""
    return [name for name in names(motors(model)) if model.actuator(name).trntype[0] == what]


def arms(model: mujoco.MjModel) -> list[int]:
    """Joints of the motors that have one."""
    return [int(model.actuator(name).trnid[0]) for name in turning(model, mujoco.mjtTrn.mjTRN_JOINT)]


def spindles(model: mujoco.MjModel) -> list[str]:
    """Motors that wind a tendon up."""
    return turning(model, mujoco.mjtTrn.mjTRN_TENDON)


@pytest.fixture(params=EYES)
def eye(request: pytest.FixtureRequest) -> str:
    """Every eye there is."""
    return str(request.param)


@pytest.fixture(params=EYE3)
def preset(request: pytest.FixtureRequest) -> str:
    """Those of eye3.xml, whose numbers stand here."""
    return str(request.param)


def test_motors_are_read_from_the_model(eye: str) -> None:
    model = build_model(eye)
    found = motors(model)
    assert len(set(names(found))) == len(found) > 0
    assert np.isfinite(ranges(found)).all()
    assert len(arms(model)) + len(spindles(model)) == len(found)
    assert {int(model.joint(joint).type[0]) for joint in arms(model)} <= {mujoco.mjtJoint.mjJNT_HINGE}
    for motor, (low, high) in zip(found, ranges(found), strict=True):
        assert model.actuator_ctrllimited[model.actuator(motor.name).id]
        np.testing.assert_allclose(np.deg2rad([low, high]), model.actuator(motor.name).ctrlrange, rtol=1e-15)
        assert low <= motor.working[0] < motor.working[1] <= high
        assert low < motor.rest < high
        assert motor.unit == "deg"


def test_motors_are_the_three_actuators_with_limits(preset: str) -> None:
    model = build_model(preset)
    assert names(motors(model)) == MOTORS
    assert model.nu == 3
    np.testing.assert_allclose(ranges(motors(model)), [[-80, 80]] * 3)
    assert [motor.working for motor in motors(model)] == [(-40, 40)] * 3
    for name in MOTORS:
        assert model.actuator(name).trnid[0] == model.joint(name).id


def test_tendons_are_named_by_motor_and_side(preset: str) -> None:
    model = build_model(preset)
    assert tuple(model.tendon(i).name for i in range(model.ntendon)) == TENDONS


def test_sensors_show_the_state(eye: str) -> None:
    model = build_model(eye)
    data = pose(model)
    joint = data.joint("eye")
    np.testing.assert_allclose(data.sensor("orientation").data, joint.qpos, atol=1e-12)
    in_head = rotation(joint.qpos).apply(joint.qvel)  # a ball joint's velocity is in the eye's frame
    np.testing.assert_allclose(data.sensor("angular_velocity").data, in_head, atol=1e-12)
    for i in range(model.ntendon):
        name = model.tendon(i).name
        assert data.sensor(f"length_{name}").data[0] == data.tendon(name).length[0]
    assert model.nsensor == 2 + model.ntendon


def test_tension_from_the_length_sensors_makes_the_torque(eye: str) -> None:
    model = build_model(eye)
    data = pose(model)
    data.joint("eye").qvel = 0
    mujoco.mj_forward(model, data)
    pulled, own = data.qfrc_passive + data.qfrc_actuator, model.joint("eye").dofadr[0] + np.arange(3)
    tension = Tendons.of(model).tension(data.ten_length, data.ctrl)
    assert (tension >= 0).all()
    elastics = Elastics.from_model(model)
    turn = rotation(data.joint("eye").qpos)
    torque = np.zeros(3)
    for i in range(model.ntendon):
        at, end, m = turn.apply(elastics.insertion[i]), elastics.via[i], elastics.motor[i]
        if np.isnan(end).any():
            arm = Rotation.from_rotvec(data.joint(arms(model)[m]).qpos[0] * elastics.arm_axis[m])
            end = arm.apply(elastics.arm_end[i]) + elastics.arm_centre[m]
        torque += np.cross(at, tension[i] * (end - at) / np.linalg.norm(end - at))
    np.testing.assert_allclose(turn.apply(pulled[own]), torque, atol=1e-12)


def test_elastics_are_those_of_the_author(preset: str) -> None:
    elastics = Elastics.from_model(build_model(preset))
    insertion = [[INSERTION_X[preset], y, z] for y, z in INSERTION_YZ]
    np.testing.assert_allclose(elastics.insertion, insertion, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(elastics.insertion, axis=1), 0.0753, atol=2e-5)
    np.testing.assert_allclose(elastics.via, VIA, atol=1e-15)
    np.testing.assert_allclose(elastics.arm_end, ARM_END, atol=1e-15)
    np.testing.assert_allclose(elastics.arm_centre, ARM_CENTRE, atol=1e-15)
    np.testing.assert_array_equal(elastics.motor, [0, 0, 1, 1, 2, 2])
    np.testing.assert_array_equal(elastics.arm_axis, [[0, 1, 0], [0, 0, 1], MOTOR3_AXIS[preset]])
    np.testing.assert_allclose(elastics.rest_length, REST_LENGTH, atol=1e-15)
    np.testing.assert_allclose(elastics.stiffness, TENSION_PER_STRETCH / np.array(REST_LENGTH), rtol=1e-14)
    np.testing.assert_allclose(elastics.inertia, INERTIA[preset], atol=1e-18)
    np.testing.assert_allclose(elastics.centre_of_mass, [0.02, 0, 0])
    assert elastics.mass == 0.248
    assert elastics.friction == 0.02


def linearised(plant: ElasticPlant) -> tuple[Array, Array]:
    """Restoring stiffness about x, y, z and torque per motor [N m/rad], both (3, 3), at rest."""
    torque, step, still = plant.torque, 1e-6, np.zeros((3, 3))
    forward = np.tile([1.0, 0, 0, 0], (3, 1))
    turned = [Rotation.from_rotvec(sign * step * np.eye(3)).as_quat(scalar_first=True) for sign in (1, -1)]
    moved = [np.rad2deg(sign * step * np.eye(3)) for sign in (1, -1)]
    stiffness = -(torque(turned[0], still) - torque(turned[1], still)).T / (2 * step)
    drive = (torque(forward, moved[0]) - torque(forward, moved[1])).T / (2 * step)
    return stiffness, drive


@pytest.mark.parametrize("kind", [TavaresPlant, MujocoPlant])
def test_eve_v3_linearised_at_rest(kind: type[TavaresPlant] | type[MujocoPlant]) -> None:
    plant = kind("eve_v3")
    stiffness, drive = linearised(plant)
    np.testing.assert_allclose(stiffness, np.diag([0.227, 0.253, 0.501]), atol=5e-4)
    gain = np.linalg.solve(stiffness, drive)  # rad of eye per rad of motor
    np.testing.assert_allclose(gain[2], [0, 1.00, 0], atol=5e-3)
    np.testing.assert_allclose(gain[1], [0.62, 0, -0.62], atol=5e-3)

    elastics = Elastics.from_model(build_model("eve_v3"))
    inverse = np.linalg.inv(elastics.inertia)
    matrix = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse * elastics.friction]])
    poles = np.linalg.eigvals(matrix)
    poles = np.sort_complex(poles[poles.imag > 0])
    np.testing.assert_allclose(poles, [-25.3 + 25j, -23.2 + 7.1j, -21.0 + 5.9j], atol=0.06)


def test_static_yaw_of_the_thesis_eye() -> None:
    motor2 = np.array([25, 30, 36, 40, 50, 60, 80])
    motor = np.column_stack([0 * motor2, motor2, 0 * motor2])
    yaw, pitch, roll = to_euler(MujocoPlant().rest(motor))
    np.testing.assert_allclose(yaw, [37.3, 45.1, 55.0, 61.8, 79.3, 92.4, 105.0], atol=0.06)
    np.testing.assert_allclose([pitch, roll], 0, atol=1e-6)


@pytest.mark.parametrize("step_s", [5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3])
def test_arms_stand_on_the_command_one_step_later(preset: str, step_s: float) -> None:
    model = build_model(preset, step_s=step_s)
    assert model.opt.timestep == step_s
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    for _ in range(50):
        data.ctrl[:] = rng.uniform(-0.7, 0.7, model.nu)
        mujoco.mj_step(model, data)
        stand = [data.joint(joint).qpos[0] for joint in arms(model)]
        np.testing.assert_allclose(model.actuator_gear[:, 0] * stand, data.ctrl, atol=3e-6)  # 2e-4 deg


@pytest.mark.parametrize(("preset", "file"), [("thesis", "eye3.xml"), ("six", "eye6.xml")])
def test_file_alone_is_the_preset_at_1_ms(preset: str, file: str) -> None:
    """What `python -m mujoco.viewer` and any other MuJoCo program opens."""
    bare = mujoco.MjModel.from_xml_path(str(data_folder("eye_mjcf") / file))
    assert model_hash(bare) == model_hash(build_model(preset, step_s=0.001))


def test_gravity_adds_only_the_torque_of_the_centre_of_mass(eye: str) -> None:
    model, without = build_model(eye, gravity=True), build_model(eye)
    assert motors(model) == motors(without)
    assert model.nu == without.nu + 1
    weight = np.array([0, 0, -STANDARD_GRAVITY * model.body("eye").mass[0]])
    centre = model.site("centre_of_mass").pos
    for seed in range(5):
        data, reference = pose(model, seed), pose(without, seed)
        for name in names(motors(model)):
            data.actuator(name).ctrl = reference.actuator(name).ctrl = 0.3
        data.actuator("gravity").ctrl = 123.0  # no control
        mujoco.mj_forward(model, data)
        mujoco.mj_forward(without, reference)
        turn = rotation(data.joint("eye").qpos)
        torque = turn.apply(data.joint("eye").qfrc_actuator - reference.joint("eye").qfrc_actuator)
        np.testing.assert_allclose(torque, np.cross(turn.apply(centre), weight), atol=1e-14)
        np.testing.assert_array_equal(data.qfrc_passive, reference.qfrc_passive)
        for joint in arms(model):
            assert data.joint(joint).qfrc_actuator[0] == reference.joint(joint).qfrc_actuator[0]


def test_unknown_preset_names_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"'tesis'.*thesis.*eve_v3"):
        build_model("tesis")


@pytest.mark.parametrize("step_s", [0.0, -0.001, float("nan"), float("inf"), 0.05])
def test_bad_step_is_refused(step_s: float) -> None:
    with pytest.raises(InputError, match="between 0 and"):
        build_model(step_s=step_s)


def test_meshes_have_no_part_in_the_physics(eye: str) -> None:
    model, chosen = build_model(eye), EYES[eye]
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    spec = mujoco.MjSpec.from_file(str(data_folder("eye_mjcf") / chosen.file))
    if chosen.change is not None:
        chosen.change(spec)
    spec.compiler.discardvisual = True
    bare = spec.compile()
    assert bare.ngeom == 0
    assert model_hash(bare) == model_hash(model) == model_hash(build_model(eye, visual=False))
    for field in ("body_mass", "body_inertia", "body_ipos", "body_iquat", "dof_armature", "dof_damping"):
        np.testing.assert_array_equal(getattr(model, field), getattr(bare, field))


def test_the_ball_is_an_eye_that_nothing_moves() -> None:
    model = ball()
    assert (model.nu, model.ntendon, model.njnt) == (0, 0, 1)
    assert model.joint("eye").type == mujoco.mjtJoint.mjJNT_BALL
    thesis = build_model()
    np.testing.assert_array_equal(model.site("gaze").pos, thesis.site("gaze").pos)
    for name in ("sclera", "limbus", "iris", "pupil"):
        np.testing.assert_array_equal(model.geom(name).size, thesis.geom(name).size)
        np.testing.assert_array_equal(model.geom(name).pos, thesis.geom(name).pos)


# --- scripts/make_meshes.py ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def make_meshes() -> ModuleType:
    specification = importlib.util.spec_from_file_location("make_meshes", SCRIPT)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules["make_meshes"] = module  # dataclasses look their module up
    specification.loader.exec_module(module)
    return module


def triangles(path: Path) -> Array:
    """Corners (faces, 3, 3) in a binary STL file."""
    content = path.read_bytes()
    faces = np.frombuffer(content[84:], dtype=[("numbers", "<f4", 12), ("attribute", "<u2")])
    assert len(faces) == int.from_bytes(content[80:84], "little")
    return faces["numbers"].reshape(-1, 4, 3)[:, 1:].astype(float)


def test_meshes_are_what_the_script_makes(
    make_meshes: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make_meshes.main(make_meshes.Options(out=tmp_path))
    folder = data_folder("eye_mjcf")
    shipped = sorted(path.name for path in (folder / "meshes").iterdir())
    models = [(folder / name).read_text(encoding="utf-8") for name in ("eye3.xml", "eye6.xml")]
    used = re.findall(r'file="(\S+)"', "".join(models))
    assert sorted(path.name for path in tmp_path.iterdir()) == shipped == sorted(used)
    assert sum((folder / "meshes" / name).stat().st_size for name in shipped) < 720_000
    for name in shipped:
        made, there = triangles(tmp_path / name), triangles(folder / "meshes" / name)
        assert made.shape == there.shape
        np.testing.assert_allclose(made, there, atol=1e-7, err_msg=f"{name}: run scripts/make_meshes.py")
    text = capsys.readouterr().out
    assert "no rigid body has these numbers" in text


def test_eyeball_carries_the_insertions(make_meshes: ModuleType, preset: str) -> None:
    insertion = Elastics.from_model(build_model(preset)).insertion
    corners = triangles(data_folder("eye_mjcf") / "meshes" / "sclera.stl").reshape(-1, 3)
    assert corners[:, 0].min() < insertion[:, 0].min() - 0.005
    assert np.linalg.norm(corners, axis=1).max() == pytest.approx(np.linalg.norm(insertion[0]), abs=2e-5)


@pytest.fixture(scope="module")
def six() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The six-motor eye with its looks, straight ahead."""
    model = mujoco.MjModel.from_xml_path(str(data_folder("eye_mjcf") / "eye6.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def ends(six: tuple[mujoco.MjModel, mujoco.MjData]) -> Iterator[tuple[str, Array, Array]]:
    """Name, place on the head and insertion of each cable."""
    model, data = six
    for name in (model.tendon(i).name for i in range(model.ntendon)):
        yield name, data.site(f"head_{name}").xpos, data.site(f"eye_{name}").xpos


def test_globe_of_six_motors_carries_the_insertions(six: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    corners = triangles(data_folder("eye_mjcf") / "meshes" / "eye6_sclera.stl").reshape(-1, 3)
    insertion = np.array([on_eye for _, _, on_eye in ends(six)])
    assert np.linalg.norm(corners, axis=1).max() == pytest.approx(np.linalg.norm(insertion, axis=1), abs=1.5e-4)
    assert corners[:, 0].min() < insertion[:, 0].min() - 0.005


def test_spindles_stand_where_the_rest_lengths_put_them(six: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = six
    drum = np.linalg.norm(triangles(data_folder("eye_mjcf") / "meshes" / "eye6_spindle.stl")[..., :2], axis=-1)
    for name, head, on_eye in ends(six):
        gain, stiffness = -model.actuator(name).gainprm[0], -model.actuator(name).biasprm[1]
        behind = 20 / stiffness - np.linalg.norm(head - on_eye)  # 20 N per relative stretch
        away = np.linalg.norm(data.geom(f"spindle_{name}").xpos - head)
        assert np.hypot(behind, gain / stiffness) == pytest.approx(away, abs=1e-6)
        assert np.isclose(drum, gain / stiffness, atol=1e-6).any()


def test_head_hides_no_cable_of_six_motors(six: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = six
    camera, eye, hit = data.cam("three_quarter").xpos, model.body("eye").id, np.zeros(1, np.int32)
    for name, head, on_eye in ends(six):
        for part in np.linspace(0.25, 1, 30):  # clear of its eyelet
            ray = head + part * (on_eye - head) - camera
            distance = mujoco.mj_ray(model, data, camera, ray, None, 1, eye, hit, None)
            assert distance < 0 or distance > 0.999, f"{name} behind {model.geom(hit[0]).name}"


def test_meshes_are_closed() -> None:
    for path in (data_folder("eye_mjcf") / "meshes").iterdir():
        mesh = trimesh.load_mesh(path)
        assert mesh.is_watertight, path.name
        assert mesh.volume > 0, path.name


def test_weight_of_the_shell_agrees_with_its_mesh(make_meshes: ModuleType) -> None:
    radius, wall, density = 0.0753, 0.003, 1240.0
    weighed = make_meshes.weigh_shell(radius, wall, density)
    mesh = make_meshes.shell(radius, wall, rings=60, sections=128)
    mesh.density = density
    assert weighed.mass == pytest.approx(mesh.mass, rel=5e-3)
    np.testing.assert_allclose(weighed.centre_of_mass, mesh.center_mass, atol=1e-4)
    inertia = mesh.moment_inertia_frame(np.eye(4))  # about the origin
    np.testing.assert_allclose(np.diag(weighed.inertia), inertia, rtol=5e-3, atol=1e-9)


def test_the_side_of_an_eye(tmp_path: Path) -> None:
    """The medial rectus of a right eye is on its left: from the point on the head at which it begins."""
    folder = data_folder("eye_mjcf")
    model = build_model("six")
    head = [site for site in range(model.nsite) if "MR" in model.site(site).name and model.site_bodyid[site] == 0]
    assert head
    assert all(model.site_pos[site][1] > 0 for site in head)
    assert side(model) == "right"
    assert side(build_model("thesis")) == side(build_model("eve_v3")) == side(ball()) == "left"
    text = (folder / "eye6.xml").read_text(encoding="utf-8").replace('meshdir="meshes"', f'meshdir="{folder}/meshes"')
    (tmp_path / "odd.xml").write_text(text.replace('data="right"', 'data="middle"'), encoding="utf-8")
    with pytest.raises(InputError, match=r"side.* is left or right, got 'middle'"):
        side(build_model(str(tmp_path / "odd.xml")))
