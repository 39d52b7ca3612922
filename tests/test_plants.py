"""Every plant keeps the protocol; a new one in `PLANTS` is tested here for free. Then what each alone promises."""

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.signal import lsim

from orient_eye.commands.pulse_step import FIXED_C, PULSES, PulseStep
from orient_eye.errors import InputError
from orient_eye.movement.trajectory import EyeState, Trajectory
from orient_eye.plants import ELASTIC_ACTION_RANGE_DEG, PLANTS, Plant, make_plant
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.rotations import FORWARD, angle_between, from_euler, from_yaw, rotation, to_euler
from orient_eye.surrogate import Surrogate

Array = NDArray[np.float64]
ELASTIC = [name for name in PLANTS if name != "lpf"]
PLANT_OPTIONS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in PLANTS),
    ("mujoco", {"accurate": True}),
    ("mujoco", {"eye": "eve_v3"}),
    ("mujoco", {"gravity": True}),
    ("tavares", {"as_published": True}),
]


@pytest.fixture(params=PLANT_OPTIONS, ids=lambda p: "-".join([p[0], *map(str, p[1].values())]))
def plant(request: pytest.FixtureRequest) -> Plant:
    name, options = request.param
    return make_plant(name, **options)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its log of warnings into the working folder."""
    monkeypatch.chdir(tmp_path)


def saccades(plant: Plant, count: int = 5, samples: int = 151, seed: int = 0) -> Array:
    """Pulse-steps of all motors, (saccades, time, motors) [deg]."""
    rng, shape = np.random.default_rng(seed), (count, len(plant.motors))
    F, D = rng.uniform(-12, 12, (2, *shape))
    command = PulseStep(F, rng.uniform(25, 70, shape), D, rng.uniform(8, 25, shape))
    return command.sample(plant.step_s, samples)


def identical(one: Trajectory, other: Trajectory, rows: list[int] | slice = slice(None)) -> None:
    """Bit for bit; `rows` of the first."""
    for name in ("orientation", "angular_velocity", "motor", "tension", "failed"):
        a, b = getattr(one, name), getattr(other, name)
        if a is None:
            assert b is None
        else:
            np.testing.assert_array_equal(a[rows], b, err_msg=name)
    np.testing.assert_array_equal(one.time, other.time)


# --- the protocol, every plant --------------------------------------------------------------------


def test_is_a_plant(plant: Plant) -> None:
    assert isinstance(plant, Plant)
    assert PLANTS[plant.name]
    motors = len(plant.motors)
    assert motors == len(set(plant.motors)) > 0
    assert plant.motor_range_deg.shape == plant.action_range_deg.shape == (motors, 2)
    assert (plant.action_range_deg[:, 0] >= plant.motor_range_deg[:, 0]).all()
    assert (plant.action_range_deg[:, 1] <= plant.motor_range_deg[:, 1]).all()
    assert np.isfinite(plant.action_range_deg).all()
    assert 0 < plant.step_s < 0.01
    identity = plant.identity()
    assert identity["plant"] == plant.name
    assert identity == plant.identity()


def test_identities_differ() -> None:
    """Plants whose numbers differ have different identities, and these survive JSON."""
    identities = [repr(make_plant(name, **options).identity()) for name, options in PLANT_OPTIONS]
    assert len(set(identities)) == len(identities)
    hashes = {make_plant("mujoco", eye=eye).identity()["model"] for eye in ("thesis", "eve_v3")}
    assert len(hashes) == 2


def test_trajectory_shapes_and_units(plant: Plant) -> None:
    command = saccades(plant)
    found = plant.simulate(command)
    assert len(found) == 5
    np.testing.assert_allclose(found.time, plant.step_s * np.arange(151), rtol=1e-15)
    assert found.orientation.shape == (5, 151, 4)
    assert found.angular_velocity.shape == (5, 151, 3)
    assert found.motor_names == plant.motors
    np.testing.assert_array_equal(found.motor, command)
    assert not found.failed.any()
    np.testing.assert_allclose(np.linalg.norm(found.orientation, axis=-1), 1, rtol=1e-12)
    if found.tension is not None:
        assert found.tension.shape == (5, 151, len(found.tendon_names))
        assert (found.tension >= 0).all()
    # The angular velocity is that of the orientation, in the head frame, deg/s.
    q = rotation(found.orientation.reshape(-1, 4))
    later = (q[1:] * q[:-1].inv()).as_rotvec().reshape(-1, 3)
    turned = np.rad2deg(later).reshape(-1, 3)
    steps = np.delete(turned, np.arange(150, 5 * 151 - 1, 151), axis=0).reshape(5, 150, 3) / plant.step_s
    before, after = found.angular_velocity[:, :-1], found.angular_velocity[:, 1:]
    apart, half = np.linalg.norm(steps - (before + after) / 2, axis=-1), np.linalg.norm(after - before, axis=-1) / 2
    assert (apart <= 1.001 * half + 1e-4 * np.abs(steps).max()).all()  # between its values at the ends
    if plant.name == "tavares" and not plant.identity()["as_published"]:
        np.testing.assert_allclose(steps, after, rtol=0, atol=1e-9)  # omega first, then q


def test_starts_at_rest_in_equilibrium(plant: Plant) -> None:
    """No drift over 0.3 s. The servo of MuJoCo's arms yields by up to 3e-7 rad, which is the 2e-5 deg."""
    held = np.random.default_rng(0).uniform(-20, 20, (6, 1, len(plant.motors)))
    found = plant.simulate(np.repeat(held, 301, axis=1))
    limit = 2e-5 if plant.name == "mujoco" else 1e-9
    assert angle_between(found.orientation, found.orientation[:, :1]).max() < limit
    np.testing.assert_array_equal(found.angular_velocity[:, 0], 0)
    assert np.abs(found.angular_velocity).max() < 10 * limit
    assert angle_between(found.orientation[:, 0], plant.rest_orientation(held[:, 0])).max() < 1e-9


def test_command_comes_to_rest_at_its_rest_orientation(plant: Plant) -> None:
    """After 2 s, the slowest torsion included: no nearer than MuJoCo's servo, or static friction, lets it."""
    command = saccades(plant, 3, samples=151) / 2
    command = np.concatenate([command, np.repeat(command[:, -1:], 1850, axis=1)], axis=1)
    found = plant.simulate(command)
    apart = angle_between(found.orientation, plant.rest_orientation(command[:, -1])[:, None])
    assert (apart[:, -1] < np.maximum(5e-4, 2e-3 * apart[:, 150])).all()


def test_rest_motor_is_the_inverse_of_rest_orientation(plant: Plant) -> None:
    rng = np.random.default_rng(3)
    driven = plant.motors if len(plant.motors) == 1 else ("motor2",)
    cases = [(plant.motors, list(range(len(plant.motors))))]
    if not plant.identity().get("gravity"):  # the weight is not motor 2's to hold
        cases.append((driven, [plant.motors.index(driven[0])]))
    for names, index in cases:
        motor = np.zeros((8, len(plant.motors)))
        motor[:, index] = rng.uniform(-20, 20, (8, len(index)))
        orientation = plant.rest_orientation(motor)
        np.testing.assert_allclose(plant.rest_motor(orientation, names), motor, atol=1e-7)
        np.testing.assert_allclose(plant.rest_motor(-orientation, names), motor, atol=1e-7)


def test_yaw_is_mirror_symmetric(plant: Plant) -> None:
    """Motor 2 the other way turns the eye the other way; positive turns it to the left."""
    command = PulseStep(*(np.array([[x]]) for x in (-4.0, 45.0, 14.0, 15.0)))
    horizontal = np.zeros((1, 151, len(plant.motors)))
    horizontal[..., plant.motors.index("motor2")] = command.position(plant.step_s * np.arange(151))[..., 0]
    one, other = plant.simulate(horizontal), plant.simulate(-horizontal)
    assert one.yaw_deg[0, 0] < 0
    assert one.yaw_deg[0, -1] > 13
    limit = 1e-6 if plant.identity().get("eye") == "eve_v3" else 1e-9  # its inertia has a product x y
    np.testing.assert_allclose(one.yaw_deg, -other.yaw_deg, rtol=0, atol=limit)
    if limit == 1e-9:
        np.testing.assert_allclose(one.pitch_deg, other.pitch_deg, rtol=0, atol=limit)
    np.testing.assert_allclose(one.angular_velocity[..., 2], -other.angular_velocity[..., 2], rtol=0, atol=1e3 * limit)


@pytest.mark.parametrize("shape", [(), (10,), (10, 1), (2, 10, 7), (2, 0, 1), (1, 2, 10, 1)])
def test_command_of_the_wrong_shape_is_refused(plant: Plant, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=rf"'{plant.name}' has the shape \(saccades, time, \d motor.*motor2.*got \("):
        plant.simulate(np.zeros(shape))


def test_start_of_the_wrong_shape_is_refused(plant: Plant) -> None:
    command = saccades(plant, 2, 3)
    with pytest.raises(InputError, match=r"2 saccades need start orientations of shape \(2, 4\).*got \(1, 4\)"):
        plant.simulate(command, EyeState(FORWARD[None]))
    with pytest.raises(InputError, match=r"got \(2, 4\) and \(2, 2\)"):
        plant.simulate(command, EyeState(np.tile(FORWARD, (2, 1)), np.zeros((2, 2))))
    with pytest.raises(InputError, match=r"zero quaternion.*\(1, 0, 0, 0\)"):
        plant.simulate(command, EyeState(np.zeros((2, 4))))


def test_a_start_of_any_length_is_the_same_start(plant: Plant) -> None:
    command, start = saccades(plant, 2, 20), from_yaw([3.0, -4.0])
    identical(plant.simulate(command, EyeState(start)), plant.simulate(command, EyeState(2 * start)))


def test_same_twice(plant: Plant) -> None:
    """Nothing is left over from other runs: warm starts, controls, batches of another size."""
    command = saccades(plant)
    one = plant.simulate(command)
    plant.simulate(saccades(plant, 3, 40, seed=9))
    plant.rest_orientation(command[:2, -1])
    identical(one, plant.simulate(command))
    identical(one, make_plant(plant.name, **getattr(plant, "options", {})).simulate(command))


def test_inputs_are_left_alone(plant: Plant) -> None:
    command, start = saccades(plant, 2, 20), EyeState(2 * from_yaw([3.0, -4.0]), np.zeros((2, 3)))
    command[1, 3] = np.nan
    before = command.copy()
    found = plant.simulate(command, start)
    np.testing.assert_array_equal(command, before)
    np.testing.assert_array_equal(start.orientation, 2 * from_yaw([3.0, -4.0]))
    assert not np.shares_memory(found.motor, command)


def test_batch_is_its_single_saccades(plant: Plant) -> None:
    """Bit for bit from a given start; the equilibrium before it to rounding."""
    command = saccades(plant, samples=81)
    batch = plant.simulate(command)
    started = plant.simulate(command, EyeState(batch.orientation[:, 0]))
    for i in range(len(command)):
        start = EyeState(batch.orientation[i : i + 1, 0])
        identical(started, plant.simulate(command[i : i + 1], start), [i])
        alone = plant.simulate(command[i : i + 1])
        assert angle_between(alone.orientation, batch.orientation[i]).max() < 1e-9


def test_order_and_company_do_not_matter(plant: Plant) -> None:
    command = saccades(plant, 6)
    start = EyeState(plant.rest_orientation(command[:, 0]))
    shuffled = np.array([4, 0, 5, 2, 2, 1, 3])
    found = plant.simulate(command[shuffled], EyeState(start.orientation[shuffled]))
    identical(plant.simulate(command, start), found, list(shuffled))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("row", [0, 70])
def test_a_command_that_is_none_fails_alone(plant: Plant, bad: float, row: int) -> None:
    command = saccades(plant)
    command[2, row, -1] = bad
    if bad == np.inf and np.isfinite(plant.motor_range_deg).all():
        with pytest.raises(InputError, match=r"saccade 2 sends motor3 to inf deg .* range is -80 to 80 deg"):
            plant.simulate(command)
        return
    with np.errstate(invalid="ignore"):
        found = plant.simulate(command)
    assert found.failed.tolist() == [False, False, True, False, False]
    for name in ("orientation", "angular_velocity", "motor", "tension"):
        if getattr(found, name) is not None:
            assert np.isnan(getattr(found, name)[2]).all(), name
    keep = [0, 1, 3, 4]
    identical(found, plant.simulate(command[keep]), keep)


def test_a_start_that_is_none_fails_alone(plant: Plant) -> None:
    command = saccades(plant)
    start = plant.rest_orientation(command[:, 0])
    start[1] = np.nan
    found = plant.simulate(command, EyeState(start))
    assert found.failed.tolist() == [False, True, False, False, False]
    assert np.isnan(found.orientation[1]).all()
    keep = [0, 2, 3, 4]
    identical(found, plant.simulate(command[keep], EyeState(start[keep])), keep)


@pytest.mark.parametrize("speed", [1e6, 1e9, 1e14])
def test_divergence_fails_alone(plant: Plant, speed: float) -> None:
    """An absurd start velocity [deg/s], after which a saccade is either whole or failed, and NaN."""
    command = saccades(plant, samples=51)
    start, velocity = plant.rest_orientation(command[:, 0]), np.zeros((5, 3))
    velocity[3] = speed * np.array([0.3, -0.5, 0.8])
    found = plant.simulate(command, EyeState(start, velocity))
    keep = [0, 1, 2, 4]
    assert not found.failed[keep].any()
    if plant.name != "lpf" and speed > 1e12:
        assert found.failed[3]
    finite = np.isfinite(found.orientation[3])
    assert not finite.any() if found.failed[3] else finite.all()
    identical(found, plant.simulate(command[keep], EyeState(start[keep])), keep)
    fresh = make_plant(plant.name, **getattr(plant, "options", {})).simulate(command, EyeState(start))
    identical(fresh, plant.simulate(command, EyeState(start)))  # nothing of it is left over


def test_one_sample_is_the_start(plant: Plant) -> None:
    command = saccades(plant, 3, 1)
    found = plant.simulate(command)
    assert found.orientation.shape == (3, 1, 4)
    np.testing.assert_array_equal(found.orientation, plant.simulate(np.repeat(command, 4, axis=1)).orientation[:, :1])


def test_unknown_plant_names_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"unknown plant 'mojoco'; choose one of mujoco, lpf, tavares"):
        make_plant("mojoco")


def test_protocol_needs_every_member() -> None:
    class Half:
        name = "half"
        motors = ("motor2",)

        def simulate(self, command: Array) -> None: ...

    assert not isinstance(Half(), Plant)


def test_a_new_plant_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PLANTS, "slow", lambda **options: LowPassPlant(Surrogate(1.0, 5.0), **options))
    assert make_plant("slow", step_s=0.002).step_s == 0.002


# --- the elastic eye ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ELASTIC)
def test_static_yaw(name: str) -> None:
    """Spec: thesis author's program, motor-2 steps past where the tendons run through the eye."""
    motor = np.zeros((7, 3))
    motor[:, 1] = [25, 30, 36, 40, 50, 60, 80]
    yaw, pitch, roll = to_euler(make_plant(name).rest_orientation(motor))
    np.testing.assert_allclose(yaw, [37.3, 45.1, 55.0, 61.8, 79.3, 92.4, 105.0], atol=0.06)
    np.testing.assert_allclose([pitch, roll], 0, atol=1e-7)


def test_plants_agree_on_the_equilibrium() -> None:
    motor = np.random.default_rng(0).uniform(-30, 30, (20, 3))
    for options in ({}, {"eye": "eve_v3"}, {"gravity": True}):
        apart = angle_between(
            MujocoPlant(**options).rest_orientation(motor), TavaresPlant(**options).rest_orientation(motor)
        )
        assert apart.max() < 1e-9


@pytest.mark.parametrize("name", ELASTIC)
def test_commands_outside_the_mechanical_range_are_refused(name: str) -> None:
    plant = make_plant(name)
    command = saccades(plant, 3, 20)
    command[1, 12, 1] = -81.25
    with pytest.raises(
        InputError, match=r"saccade 1 sends motor2 to -81\.2 deg at 0\.012 s; its mechanical range is -80 to 80 deg"
    ):
        plant.simulate(command)
    command[1, 12, 1] = -80.0
    assert not plant.simulate(command).failed.any()
    assert (np.abs(plant.action_range_deg) == ELASTIC_ACTION_RANGE_DEG).all()
    assert np.abs(plant.action_range_deg).max() < 50  # well inside of where the response bends over


@pytest.mark.parametrize("name", ELASTIC)
def test_orientations_that_cannot_be_held_are_refused(name: str) -> None:
    plant = make_plant(name)
    with pytest.raises(InputError, match=r"no equilibrium of motors \[2\] within their range"):
        plant.rest_motor(from_euler([0.0, 5.0], [0.0, 10.0], [0.0, 0.0]), ("motor2",))
    with pytest.raises(InputError, match="no equilibrium of motors"):
        plant.rest_motor(from_yaw([150.0]), ("motor2",))


@pytest.mark.parametrize("name", ELASTIC)
@pytest.mark.parametrize("yaw", [-170.0, -120.0, -100.0, -87.5, -80.0, -40.0, 35.0, 60.0, 82.0, 90.0, 105.0, 140.0])
def test_held_orientations_are_held(name: str, yaw: float) -> None:
    """Far out other equilibria exist, which the eye would leave at a touch: they hold nothing."""
    plant = make_plant(name)
    try:
        motor = plant.rest_motor(from_yaw([yaw]), ("motor2",))
    except InputError:
        assert abs(yaw) > 82
        return
    np.testing.assert_allclose(to_euler(plant.rest_orientation(motor))[0], yaw, atol=1e-6)


@pytest.mark.parametrize("name", ELASTIC)
def test_targets_need_no_more_than_the_action_range(name: str) -> None:
    """Spec: 35 deg of yaw take 23.7 deg of motor 2."""
    motor = make_plant(name).rest_motor(from_yaw([35.0, -35.0]), ("motor2",))
    np.testing.assert_allclose(motor[:, 1], [23.6, -23.6], atol=0.15)
    np.testing.assert_array_equal(motor[:, [0, 2]], 0)


@pytest.mark.parametrize("name", ELASTIC)
def test_tension_holds_the_eye(name: str) -> None:
    """At rest the torques of the recorded tensions cancel."""
    plant, reference = make_plant(name), TavaresPlant()
    held = np.random.default_rng(1).uniform(-15, 15, (4, 1, 3))
    found = plant.simulate(np.repeat(held, 5, axis=1))
    turn = rotation(found.orientation[:, -1]).as_matrix()
    _, tension = reference.elastic_torque(turn, held[:, 0])
    assert found.tension is not None
    np.testing.assert_allclose(found.tension[:, -1], tension, atol=1e-6)
    np.testing.assert_allclose(found.tension[:, 0], tension, atol=1e-6)


@pytest.mark.parametrize("name", ELASTIC)
def test_gravity_pulls_the_gaze_down(name: str) -> None:
    """The centre of mass is before the centre of rotation (spec), so the eye looks lower: positive pitch."""
    still = np.zeros((1, 3))
    _, without, _ = to_euler(make_plant(name).rest_orientation(still))
    _, pitch, _ = to_euler(make_plant(name, gravity=True).rest_orientation(still))
    assert abs(without[0]) < 1e-9
    assert pitch[0] > 1


@pytest.mark.parametrize("options", [{}, {"accurate": True}, {"gravity": True}])
def test_mujoco_is_the_same_at_any_thread_count(options: dict[str, bool]) -> None:
    command = saccades(MujocoPlant(), 23)
    one = MujocoPlant(threads=1, **options).simulate(command)
    for threads in (2, 3, 0):
        identical(one, MujocoPlant(threads=threads, **options).simulate(command))


def test_mujoco_chunks_are_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Batches too large for the memory set aside run in parts."""
    plant = MujocoPlant()
    command = saccades(plant, 11)
    whole = plant.simulate(command)
    monkeypatch.setattr("orient_eye.plants.mujoco._RECORD_BYTES", 90_000)
    sizes = [part.stop - part.start for part in plant._chunks(11, 151)]
    assert len(sizes) > 2
    assert sum(sizes) == 11
    identical(whole, plant.simulate(command))


@pytest.mark.parametrize("options", [{}, {"eye": "eve_v3", "accurate": True, "gravity": True, "threads": 2}])
def test_mujoco_pickles(options: dict[str, Any]) -> None:
    plant = MujocoPlant(**options)
    command = saccades(plant)
    before = plant.simulate(command)
    other = pickle.loads(pickle.dumps(plant))
    assert other.identity() == plant.identity()
    assert other.threads == plant.threads
    identical(before, other.simulate(command))


def test_mujoco_in_another_process_is_the_same() -> None:
    """The plant and its results do not depend on the process that makes them."""
    program = (
        "import sys, pickle, hashlib, numpy as np\n"
        "plant, command = pickle.load(sys.stdin.buffer)\n"
        "found = plant.simulate(command)\n"
        "print(hashlib.sha256(found.orientation.tobytes() + found.tension.tobytes()).hexdigest())\n"
    )
    import hashlib

    plant = MujocoPlant(threads=1)
    command = saccades(plant, 3, 40)
    found = plant.simulate(command)
    assert found.tension is not None
    output = subprocess.run(
        [sys.executable, "-c", program], input=pickle.dumps((plant, command)), capture_output=True, check=True
    ).stdout
    expected = hashlib.sha256(found.orientation.tobytes() + found.tension.tobytes()).hexdigest()
    assert output.decode().strip() == expected


def test_start_velocity_is_in_the_head_frame() -> None:
    """Both elastic plants start a turned eye with the same head-frame velocity, and report it."""
    motor = np.array([[5.0, 12.0, -8.0]])
    velocity = np.array([[40.0, -120.0, 300.0]])
    command = np.repeat(motor[:, None], 31, axis=1)
    found = []
    for plant in (MujocoPlant(), TavaresPlant()):
        trajectory = plant.simulate(command, EyeState(plant.rest_orientation(motor), velocity))
        np.testing.assert_allclose(trajectory.angular_velocity[:, 0], velocity, rtol=1e-12)
        found.append(trajectory.orientation)
    assert angle_between(*found).max() < 1e-4


# --- the low-pass plant ---------------------------------------------------------------------------

K, W0 = 1.4758, 17.5  # thesis 3.3.1


def low_pass(step_s: float = 0.001) -> LowPassPlant:
    return LowPassPlant(Surrogate(K, W0), step_s=step_s)


def test_low_pass_step_response() -> None:
    """theta0 + K A (1 - exp(-w0 t)), 3.13: a step at t = 0 from rest at 5 deg of motor."""
    command = np.full((1, 401, 1), 17.0)
    found = low_pass().simulate(command, EyeState(from_yaw([5 * K])))
    t = found.time
    np.testing.assert_allclose(found.yaw_deg[0], K * (5 + 12 * (1 - np.exp(-W0 * t))), rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.angular_velocity[0, :, 2], K * 12 * W0 * np.exp(-W0 * t), rtol=1e-11)
    np.testing.assert_array_equal(found.angular_velocity[..., :2], 0)
    assert found.tension is None


@pytest.mark.parametrize("variant", PULSES)
def test_low_pass_simulation_goes_to_the_closed_form(variant: int) -> None:
    """A smooth command, taken as straight lines: the error is of second order in the step."""
    rng = np.random.default_rng(variant)
    F, D = rng.uniform(-20, 20, (2, 6, 1))
    command = PulseStep(F, rng.uniform(18, 60, (6, 1)), D, rng.uniform(8, 30, (6, 1)), variant, FIXED_C.get(variant))
    errors = []
    for step_s, samples in ((1e-3, 401), (1e-4, 4001)):
        plant = low_pass(step_s)
        simulated, closed = plant.simulate(command.sample(step_s, samples)), plant.trajectory(command, samples)
        np.testing.assert_array_equal(simulated.motor, closed.motor)
        errors.append(np.abs(simulated.yaw_deg - closed.yaw_deg).max())
        velocity = np.abs(simulated.angular_velocity - closed.angular_velocity).max()
        assert velocity < 3 * W0 * errors[-1]
    assert errors[0] < 0.05
    assert errors[1] < 0.0102 * errors[0]


@settings(deadline=None, max_examples=40, derandomize=True)
@given(seed=st.integers(0, 2**30), w0=st.floats(0.5, 300), step_s=st.sampled_from([0.0005, 0.001, 0.01]))
def test_low_pass_is_exact_for_straight_lines(seed: int, w0: float, step_s: float) -> None:
    """Against scipy's first-order-hold solution, and quadrature of the convolution for one of them."""
    rng = np.random.default_rng(seed)
    tau = rng.uniform(-40, 40, (3, 60))
    plant = LowPassPlant(Surrogate(K, w0), step_s=step_s)
    found = plant.simulate(tau[..., None]).yaw_deg
    t = step_s * np.arange(60)
    for row, yaw in zip(tau, found, strict=True):
        _, response, _ = lsim(([[-w0]], [[w0 * K]], [[1.0]], [[0.0]]), row, t, X0=[K * row[0]])
        np.testing.assert_allclose(yaw, response, rtol=0, atol=1e-10)

    def slope_forgotten(k: int) -> float:
        slope = (tau[0, k + 1] - tau[0, k]) / step_s
        return quad(lambda s: slope * np.exp(-w0 * (t[-1] - s)), t[k], t[k + 1], epsabs=1e-13)[0]

    lag = sum(slope_forgotten(k) for k in range(59))  # theta = K (tau - what of its slope is not yet followed)
    assert found[0, -1] == pytest.approx(K * (tau[0, -1] - lag), rel=0, abs=1e-9)


def test_low_pass_stays_at_rest_exactly() -> None:
    found = low_pass().simulate(np.full((1, 1001, 1), 13.7))
    np.testing.assert_allclose(found.yaw_deg, K * 13.7, rtol=1e-14)


def test_low_pass_refuses_what_is_not_horizontal() -> None:
    plant = low_pass()
    tilted = from_euler([5.0, 5.0], [0.0, 3.0], [0.0, -2.0])
    with pytest.raises(InputError, match=r"pitch and roll 0, got pitch 3 and roll -2 deg"):
        plant.rest_motor(tilted, ("motor2",))
    with pytest.raises(InputError, match="moves horizontally only"):
        plant.simulate(np.zeros((2, 5, 1)), EyeState(tilted))
    np.testing.assert_allclose(plant.rest_motor(from_yaw([-30.0]), ("motor2",)), [[-30 / K]], rtol=1e-14)


def test_low_pass_has_no_mechanical_limit() -> None:
    found = low_pass().simulate(np.full((1, 3, 1), 115.0))
    assert not found.failed.any()
    np.testing.assert_allclose(found.yaw_deg, 115 * K, rtol=1e-14)


def test_low_pass_takes_its_surrogate_by_name_by_file_and_as_it_is(tmp_path: Path) -> None:
    own = Surrogate(1.2, 9.0, "motor1")
    own.save(tmp_path / "surrogate.json")
    for plant in (LowPassPlant(own), LowPassPlant(tmp_path / "surrogate.json")):
        assert plant.surrogate == own
        assert plant.motors == ("motor1",)
        np.testing.assert_allclose(to_euler(plant.rest_orientation(np.array([[10.0]])))[0], 12.0)
    assert (LowPassPlant().surrogate.K, LowPassPlant().surrogate.w0) == (K, W0)
    assert LowPassPlant("thesis").identity() == {"plant": "lpf", "K": K, "w0": W0, "motor": "motor2"}
