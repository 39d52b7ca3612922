"""How six motors share the work: against the eye's table written out here, scipy's SLSQP, another program's numbers."""

import csv
import json
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import fsolve, minimize
from scipy.spatial.transform import Rotation

from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.eyes.model import load_spec
from orient_eye.figures import muscles
from orient_eye.listing import directions, fit_plane, torsion, with_torsion
from orient_eye.motor import names, rests
from orient_eye.movement.oblique import toward
from orient_eye.plants import Plant, make_plant
from orient_eye.plants.cables import CRITERIA, Cables
from orient_eye.plants.fixation import Fixations
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.resources import data_folder
from orient_eye.rotations import from_euler, gaze
from orient_eye.statics import Ends, Postures, Softening, cables_of, cone

Array = NDArray[np.float64]
SIX = ("--plant", "tavares", "--eye", "six")
NAMES = ["IR", "MR", "SR", "LR", "IO", "SO"]
PAIRS = [(0, 2), (1, 3), (4, 5)]
# The eye's table [m], as the group's programs have it: insertions, head points, from head point to spindle.
Q = 1e-4 * np.array([(-20, -14, -400), (77, 393, 0), (-20, 8, 400), (77, -393, 0), (-112, -14, -383), (-118, -12, 381)])
H = 1e-4 * np.array(
    [(-1001, 407, -78), (-1001, 516, 35), (-1001, 407, 149), (-1001, 296, 35), (450, 375, -620), (450, 375, 620)]
)
BACK = np.array([0.04, 0.04, 0.04, 0.04, 0.065, 0.065])
RADIUS, STIFF = 0.024, 20.0
REST = np.linalg.norm(H - Q, axis=1) + BACK
SQUARE = np.stack([g.ravel() for g in np.meshgrid(*[np.linspace(-30, 30, 9)] * 2)], axis=1)
"""Left and up [deg]: the directions of the other program."""


@cache
def plant(pretension: float = 1) -> Plant:
    return make_plant("tavares", eye="six", pretension=pretension)


@cache
def cables(pretension: float = 1) -> Cables:
    found = cables_of(plant(pretension))
    assert found is not None
    return found


def by_hand(orientation: Array, theta: Array) -> tuple[Array, Array]:
    """Tension [N] (6,) and torque [N m] (3,) at an orientation, the spindles at theta [rad]."""
    at = Rotation.from_quat(orientation, scalar_first=True).apply(Q)
    way = H - at
    length = np.linalg.norm(way, axis=1)
    tension = STIFF / REST * np.maximum(0, length + BACK + RADIUS * theta - REST)
    return tension, np.cross(at, way / length[:, None] * tension[:, None]).sum(axis=0)


def stiffness_by_hand(orientation: Array, theta: Array) -> Array:
    """Eigenvalues [N m/rad] (3,) of how the torque falls with a turn."""
    here, step = Rotation.from_quat(orientation, scalar_first=True), 1e-5
    torques = [
        [
            by_hand((Rotation.from_rotvec(side * step * axis) * here).as_quat(scalar_first=True), theta)[1]
            for side in (1, -1)
        ]
        for axis in np.eye(3)
    ]
    K = np.array([(back - ahead) / (2 * step) for ahead, back in torques])
    return np.linalg.eigvalsh((K + K.T) / 2)


def cost_by_hand(criterion: str, orientation: Array, theta: Array) -> float:
    if criterion == "least-change":
        return float(((theta - np.deg2rad(rests(plant().motors))) ** 2).sum())
    tension = by_hand(orientation, theta)[0]
    if criterion == "least-difference":
        return float(sum((tension[i] - tension[j]) ** 2 for i, j in PAIRS))
    return float((tension**2).sum())


def random_orientations(count: int, seed: int = 0) -> Array:
    random = np.random.default_rng(seed)
    return with_torsion(toward(random.uniform(-25, 25, (count, 2))), random.uniform(-8, 8, count))


# --- the eye, the solver ----------------------------------------------------------------------------------


def test_the_plant_is_the_table() -> None:
    random = np.random.default_rng(1)
    for orientation in random_orientations(5):
        theta = random.uniform(0.8, 2.0, 6)
        tension, torque = by_hand(orientation, theta)
        at = orientation[None], np.rad2deg(theta)[None]
        np.testing.assert_allclose(cables().tension(*at)[0], tension, atol=1e-9)
        np.testing.assert_allclose(cables().torque(*at)[0], torque, atol=1e-10)
    assert cables().pairs.tolist() == [list(pair) for pair in PAIRS]


@pytest.mark.parametrize("criterion", CRITERIA)
def test_slsqp_finds_no_better_posture(criterion: str) -> None:
    level = 1.3
    orientations = random_orientations(6)
    motor, cost = cables().posture(orientations, criterion, None if criterion == "least-change" else level)
    for orientation, found, told in zip(orientations, np.deg2rad(motor), cost, strict=True):
        assert np.abs(by_hand(orientation, found)[1]).max() < 1e-9
        assert told == pytest.approx(cost_by_hand(criterion, orientation, found), rel=1e-5, abs=1e-5)
        if criterion == "co-contraction":  # as many equations as motors: nothing is left to choose
            zero = fsolve(
                lambda x, q=orientation: [*by_hand(q, x)[1], *(x[list(p)].mean() - level for p in PAIRS)], found + 0.1
            )
            np.testing.assert_allclose(found, zero, atol=1e-8)
            continue
        held: list[dict[str, Any]] = [{"type": "eq", "fun": lambda x, q=orientation: 100 * by_hand(q, x)[1]}]
        for pair in [] if criterion == "least-change" else PAIRS:
            held.append({"type": "ineq", "fun": lambda x, p=pair: x[list(p)].mean() - level})
        searched = minimize(
            lambda x, q=orientation: cost_by_hand(criterion, q, x), np.full(6, 1.5), method="SLSQP", constraints=held,
            options={"ftol": 1e-12, "maxiter": 200},
        )  # fmt: skip
        assert np.abs(by_hand(orientation, searched.x)[1]).max() < 1e-6
        assert told <= searched.fun + 1e-5
        if criterion != "least-difference":  # that one is flat: winding pairs up costs nothing
            assert told == pytest.approx(searched.fun, abs=1e-5)
            np.testing.assert_allclose(found, searched.x, atol=3e-3)


def test_the_state_of_a_posture_is_that_of_the_table() -> None:
    looking = toward([[0, 0], [25, 0], [-25, 10], [41, 0], [44, 0]])
    found = Postures.of(cables(), looking)
    for orientation, motor, K, least in zip(
        found.orientation, np.deg2rad(found.motor), found.stiffness, found.state.stiffness, strict=True
    ):
        by_table = stiffness_by_hand(orientation, motor)
        np.testing.assert_allclose(np.linalg.eigvalsh((K + K.T) / 2), by_table, atol=1e-5)
        assert least == pytest.approx(by_table[0], abs=1e-5)
    assert found.state.good.tolist() == [True, True, True, True, False]
    assert "not stable" in found.state.fault(4)


def test_a_torsion_costs_least() -> None:
    looking = toward([[10, 20], [-20, -15]])
    for criterion in ("least-change", "least-force"):
        best = Postures.of(cables(), looking, criterion)
        for aside in (-0.3, 0.3):
            assert (Postures.of(cables(), looking, criterion, torsion=best.torsion + aside).cost > best.cost).all()


def test_a_driven_motor_alone_moves() -> None:
    orientation = random_orientations(3)
    motor, _ = cables().posture(orientation, driven=[0, 1, 3, 5])
    np.testing.assert_array_equal(motor[:, [2, 4]], np.tile(rests(cables().motors)[[2, 4]], (3, 1)))
    assert np.abs([by_hand(q, m)[1] for q, m in zip(orientation, np.deg2rad(motor), strict=True)]).max() < 1e-9


# --- numbers of another program ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pretension", "criterion", "level", "sd", "tilt"),
    [
        (1, "least-force", 1.0, 0.95, 15),
        (1, "least-force", 2.0, 1.63, 15),
        (1, "least-change", None, 1.90, 10.5),
        (2, "least-change", None, 0.37, 12.5),
        (1, "least-difference", 2.0, 3.4, 11),
    ],
)
def test_listings_plane_of_each_criterion(
    pretension: float, criterion: str, level: float | None, sd: float, tilt: float
) -> None:
    """Its directions are a square of 30 deg to each side; evenly over a cone of 30 deg all are half as thick."""
    found = Postures.of(cables(pretension), toward(SQUARE), criterion, level)
    plane = fit_plane(found.orientation)
    assert plane.sd_deg == pytest.approx(sd, rel=0.04)
    assert plane.tilt_deg[0] == pytest.approx(tilt, abs=0.7)
    angles = found.correlation(cables(pretension).pairs)[:, 0]
    assert (angles > 0.8).all() if criterion == "least-difference" else (angles < -0.875).all()


def test_targets_within_25_degrees_need_no_slack() -> None:
    found = Postures.of(cables(), cone(25.0))
    assert found.state.good.all()
    assert [found.tension.min(), found.tension.max()] == pytest.approx([2.3, 4.0], abs=0.05)
    plane = fit_plane(found.orientation)
    assert plane.tilt_deg[0] == pytest.approx(10.8, abs=0.2)
    assert plane.sd_deg == pytest.approx(0.58, abs=0.06)


def test_the_slowest_rate_left_ahead_and_right() -> None:
    found = Postures.of(cables(), toward([[25, 0], [0, 0], [-25, 0]]))
    assert found.state.stiffness / 0.04 == pytest.approx([2.8, 5.1, 5.7], abs=0.05)  # friction 0.04 N m s/rad
    assert np.diag(found.stiffness[1]) == pytest.approx([0.415, 0.667, 0.201], abs=0.004)


@pytest.mark.parametrize(("pretension", "end"), [(1, 42), (2, 28)])
def test_beyond_some_angle_to_the_left_no_torsion_is_stable(pretension: float, end: float) -> None:
    roll = np.arange(-25, 25.1, 0.5)
    for yaw, stable in ((end - 1, True), (end + 1, False)):
        looking = directions(np.full(len(roll), yaw), np.zeros(len(roll)))
        found = Postures.of(cables(pretension), looking, torsion=roll).state
        assert (found.stiffness > 0).any() == stable


def test_co_contraction_softens() -> None:
    found = Softening.of(cables(), np.linspace(0.5, 4, 36))
    assert found.unstable_from == pytest.approx(2.7, abs=0.02)
    assert (np.diff(found.about[:, 2]) < 0).all()
    straight = with_torsion(np.array([1.0, 0, 0]), 0.0)
    theta = np.deg2rad(cables().posture(straight[None], "co-contraction", 2.8)[0][0])
    assert stiffness_by_hand(straight, theta)[0] < 0
    assert Softening.of(cables(), np.array([0.5, 1.0])).unstable_from == np.inf
    assert Softening.of(cables(), np.array([3.0, 4.0])).unstable_from == -np.inf


def test_what_ends_the_reach() -> None:
    ends = Ends.of(cables())
    assert ends.unstable_deg[0] == pytest.approx(42.2, abs=0.2)
    assert ends.cause[0] == "unstable"
    slack = ends.slack_deg[np.isfinite(ends.slack_deg)]
    assert 55 < slack.min() < 60
    outside = toward((ends.reach_deg + 0.3)[:, None] * ends.toward)
    inside = toward((ends.reach_deg - 0.3)[:, None] * ends.toward)
    assert not Postures.of(cables(), outside).state.good.any()
    assert Postures.of(cables(), inside).state.good.all()


# --- fixations --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("pretension", "limit", "most"), [(1, 40.0, 3e-6), (2, 25.0, 1e-9)])
def test_fitted_motors_leave_no_torque(pretension: float, limit: float, most: float) -> None:
    """[N m]: a degree is worth 3e-3, so that 3e-6 is a thousandth of a degree."""
    found = Fixations.of(plant(pretension))
    assert found.limit_deg == limit
    random = np.random.default_rng(2)
    away, around = limit * np.sqrt(random.uniform(size=100)), random.uniform(0, 2 * np.pi, 100)
    looking = toward(np.stack([away * np.cos(around), away * np.sin(around)], axis=1))
    orientation, motor = found.orientation(looking), found.motor(looking)
    left = [by_hand(q, m)[1] for q, m in zip(orientation, np.deg2rad(motor), strict=True)]
    assert np.abs(left).max() < most
    best = Postures.of(cables(pretension), looking)
    np.testing.assert_allclose(motor, best.motor, atol=2e-3)
    np.testing.assert_allclose(found.torsion(looking), best.torsion, atol=2e-3)
    np.testing.assert_allclose(found.force(looking), best.cost, atol=1e-4)


# --- the command ------------------------------------------------------------------------------------------


def answer(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, dict[str, Any]]:
    with pytest.raises(SystemExit) as end:
        main(["listing", *map(str, arguments), "--json"])
    return int(end.value.code or 0), json.loads(capsys.readouterr().out)


def test_what_holds_a_direction_makes_the_eye_look_there(capsys: pytest.CaptureFixture[str]) -> None:
    shared = ("--criterion", "least-force", "--co-contraction", 1.5)
    _, held = answer(capsys, *SIX, "--gaze", 20, -10, "--torsion", 1.5, *shared)
    code, rest = answer(capsys, *SIX, "--motors", *held["motors"].values())
    assert code == 0
    assert rest["gaze_deg"] == pytest.approx([20, -10], abs=1e-6)
    assert rest["torsion_deg"] == pytest.approx(1.5, abs=1e-6)
    assert list(rest["tensions_n"]) == NAMES
    for key in ("tensions_n", "stiffness_nm_rad"):
        assert rest[key] == pytest.approx(held[key], rel=1e-6)
    theta = np.deg2rad(list(held["motors"].values()))
    assert [theta[list(pair)].mean() for pair in PAIRS] == pytest.approx([1.5] * 3)
    tension, _ = by_hand(np.array(rest["orientation"]), theta)
    assert held["cost"] == pytest.approx((tension**2).sum(), rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--gaze", 45, 0), "not stable there: its stiffness is -0.0"),
        (("--gaze", 60, 0), "a cable hangs slack there"),
        (("--gaze", 0, 0, "--criterion", "co-contraction", "--co-contraction", 2.8), "not stable there"),
        (("--gaze", 0, 0, "--co-contraction", 1), "least-change has no co-contraction"),
        (("--gaze", 0, 0, "--criterion", "most-force"), "unknown criterion 'most-force'"),
        (("--criterion", "least-force", "--co-contraction", "nan"), "from 0 to 10 rad, got nan"),
        (("--criterion", "co-contraction", "--co-contraction", 3), "does not look straight ahead"),
        (("--motors", 57, 57, 57, -57, 57, 57), "with cable LR slack"),
        (("--motors", 0, 0, 0, 0, 0, 0), "cables IR, MR, SR, LR, IO, SO slack"),
        (("--motors", 57, 57, 57, 57, 57, 500), "SO must be a number from -57.29578 to 343.774677 deg, got 500"),
        (("--motors", 57, 120, 57, 57, 57, 57), "turns over"),
        (("--motors", 57, 57), "got 2 positions"),
        (("--motors", *[57] * 6, "--criterion", "least-force"), "leave --criterion out"),
        (("--limit", 60), "from 1 to 45 deg, got 60"),
    ],
)
def test_bad_input_is_told_with_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[object, ...], words: str
) -> None:
    code, told = answer(capsys, *SIX, *arguments, "--out", tmp_path / "run")
    assert code == 2
    assert words in told["error"]
    assert not (tmp_path / "run").exists()


def test_three_motors_share_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    code, told = answer(capsys, "--criterion", "least-force")
    assert code == 2
    assert "choose an eye that has more (six)" in told["error"]
    with pytest.raises(InputError, match="driven out"):
        cables().posture(random_orientations(1), "least-force", driven=[0, 1, 2, 3])


def test_a_run_of_statics_explains_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    code, result = answer(capsys, *SIX, "--limit", 20, "--out", run)
    assert code == 0
    pictures = {f"{name}.png" for name in ("reach", "planes", "motors", "antagonists", "stiffness")}
    assert {file.name for file in run.iterdir()} == {"run.json", "result.json", "statics.csv", *pictures}
    assert json.loads((run / "result.json").read_text()) == result
    assert list(result["criteria"]) == list(CRITERIA)
    assert result["ends"][0]["ended_by"] == "unstable"
    assert result["largest_cone_deg"] == pytest.approx(42.2, abs=0.1)
    with (run / "statics.csv").open() as file:
        rows = list(csv.DictReader(file))
    row = rows[len(rows) // 2]
    motor = np.array([[float(row[f"{name}_deg"]) for name in NAMES]])
    rest = plant().rest(motor)
    np.testing.assert_allclose(gaze(rest)[0], directions(float(row["yaw_deg"]), float(row["pitch_deg"])), atol=1e-6)
    assert float(torsion(rest)[0]) == pytest.approx(float(row["torsion_deg"]), abs=1e-6)
    tension, _ = by_hand(rest[0], np.deg2rad(motor[0]))
    assert [float(row[f"tension_{name}_n"]) for name in NAMES] == pytest.approx(tension.tolist(), abs=1e-6)


# --- the pictures -----------------------------------------------------------------------------------------


def test_planes_tell_what_is_not_held() -> None:
    found = {"least-change": Postures.of(cables(2), toward(SQUARE)), "least-force": Postures.of(cables(2), cone(20.0))}
    figure = muscles.planes(found)
    hollow = [
        len(np.asarray(line.get_xdata())) for axes in figure.axes[:2] for line in axes.lines if line.get_marker() == "o"
    ]
    assert hollow == [int((~each.state.good).sum()) for each in found.values()]
    assert hollow[0] > 0
    for axes, each in zip(figure.axes[:2], found.values(), strict=True):
        assert f"sd {fit_plane(each.orientation).sd_deg:.2f} deg" in axes.get_title()


def test_the_pictures_show_left_on_the_left() -> None:
    ends = Ends.of(cables())
    figure = muscles.reach(ends, np.ones((3, len(ends.toward))), 20.0)
    assert "42.2 deg" in figure.get_suptitle()
    line = np.array([-20.0, 0.0, 20.0])
    along = [(line, Postures.of(cables(), toward(line[:, None] * np.array(way)))) for way in ((1, 0), (0, 1))]
    meridians = muscles.meridians(along[0], along[1], cables().motors, cables().pairs)
    softer = muscles.stiffness(Softening.of(cables(), np.linspace(1, 3, 11)), line, {1.0: along[0][1].state.stiffness})
    for axes in (*figure.axes, *meridians.axes, *softer.axes):
        if "left" in axes.get_xlabel():
            assert axes.get_xlim()[0] > axes.get_xlim()[1]
    assert any("2.71" in text.get_text() for text in softer.axes[0].texts)
    drawn = {line.get_label(): line for line in meridians.axes[1].lines}
    np.testing.assert_array_equal(drawn["MR"].get_ydata(), along[0][1].motor[:, 1])


def test_four_arms_hold_the_eye_near_their_rest(tmp_path: Path) -> None:
    """More arms than axes, which pull on curved lines: no cables, but the eye is held, with little change."""
    spec = load_spec("thesis")
    spec.meshdir = str(data_folder("eye_mjcf") / "meshes")
    body = spec.worldbody.add_body(name="arm4", pos=[-0.323, 0, 0.03])
    body.add_joint(name="motor4", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1], armature=1)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], mass=0.05)
    for side, y in (("right", -1.0), ("left", 1.0)):
        body.add_site(name=f"arm_motor4_{side}", pos=[0, 0.14 * y, 0])
        spec.body("eye").add_site(name=f"eye_motor4_{side}", pos=[0.007, 0.07 * y, 0.027])
        tendon = spec.add_tendon(name=f"motor4_{side}", stiffness=25, springlength=[0, 0.24])
        tendon.wrap_site(f"arm_motor4_{side}")
        tendon.wrap_site(f"eye_motor4_{side}")
        spec.add_sensor(
            name=f"length_motor4_{side}", type=mujoco.mjtSensor.mjSENS_TENDONPOS, objtype=mujoco.mjtObj.mjOBJ_TENDON,
            objname=f"motor4_{side}",
        )  # fmt: skip
    servo = spec.add_actuator(name="motor4", trntype=mujoco.mjtTrn.mjTRN_JOINT, target="motor4", ctrlrange=[-1.4, 1.4])
    servo.set_to_position(kp=1e6, kv=1e3)
    file = tmp_path / "four.xml"
    file.write_text(spec.to_xml())
    plant = TavaresPlant(str(file))
    wanted = from_euler([12.0, -8.0], [5.0, 10.0], [1.0, 0.0])
    motor = plant.hold(wanted, names(plant.motors))
    assert np.abs(plant.torque(wanted, motor)).max() < 1e-9
    assert np.abs(motor).max() < 40
    alone = plant.hold(wanted, names(plant.motors)[:3])
    assert (np.linalg.norm(motor, axis=1) < np.linalg.norm(alone, axis=1)).all()
