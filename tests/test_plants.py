"""Laws of every entry of `PLANTS`, which a new plant is held to as well; then what each of ours promises."""

import hashlib
import json
import multiprocessing
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.signal import lsim

from orient_eye.commands.pulse_step import PulseStep
from orient_eye.commands.pulses import PULSES
from orient_eye.errors import InputError
from orient_eye.eyes.model import WORKING_RANGE_DEG
from orient_eye.motor import names, ranges, rests
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import PLANTS, Option, Plant, PlantKind, make_plant, restore_plant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.recording.poses import pose
from orient_eye.rotations import FORWARD, angle_between, from_euler, from_yaw, rotation, to_euler
from orient_eye.state import State
from orient_eye.surrogate import Surrogate

Array = NDArray[np.float64]
ELASTIC = ("mujoco", "tavares")
OURS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in ("lpf", *ELASTIC)),
    ("mujoco", {"accurate": True}),
    ("mujoco", {"eye": "eve_v3"}),
    ("mujoco", {"gravity": True}),
    ("tavares", {"accurate": True}),
    ("tavares", {"as_published": True}),
    ("mujoco", {"eye": "six"}),
    ("tavares", {"eye": "six", "pretension": 2.0}),
    ("viscous", {}),
]
ALL = [*OURS, *((name, {}) for name in PLANTS if (name, {}) not in OURS)]


def told(parameter: tuple[str, dict[str, Any]]) -> str:
    return "-".join([parameter[0], *map(str, parameter[1].values())])


@pytest.fixture(params=ALL, ids=told)
def plant(request: pytest.FixtureRequest) -> Plant:
    name, options = request.param
    return make_plant(name, **options)


@pytest.fixture(params=OURS, ids=told)
def ours(request: pytest.FixtureRequest) -> Plant:
    name, options = request.param
    return make_plant(name, **options)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its log of warnings into the working folder."""
    monkeypatch.chdir(tmp_path)


def room(plant: Plant) -> Array:
    """How far each motor works to either side of its rest, (motors,)."""
    return np.array([min(motor.rest - motor.working[0], motor.working[1] - motor.rest) for motor in plant.motors])


def reach(plant: Plant) -> Array:
    """How far each is sent, (motors,): six of them turn the eye away where they pull together."""
    return room(plant) if len(plant.motors) <= 3 else np.minimum(room(plant), 20.0)


def pulse_steps(plant: Plant, count: int = 5, seed: int = 0) -> PulseStep:
    """Of all motors, over three tenths of their reach."""
    rng, shape = np.random.default_rng(seed), (count, len(plant.motors))
    F, D = rests(plant.motors) + 0.3 * reach(plant) * rng.uniform(-1, 1, (2, *shape))
    return PulseStep(F, rng.uniform(25, 70, shape), D, rng.uniform(8, 25, shape))


def saccades(plant: Plant, count: int = 5, samples: int = 151, seed: int = 0) -> Array:
    """The same as positions, (saccades, time, motors)."""
    return pulse_steps(plant, count, seed).sample(plant.step_s, samples)


def run(plant: Plant, command: Array, start: State | None = None) -> Trajectory:
    return plant.move(command, start).trajectory()


def starting(orientation: Array, command: Array, velocity: Array | None = None) -> State:
    """Eyes in these orientations, their motors where the command begins."""
    return State(orientation, command[:, 0], velocity)


def identical(one: Trajectory, other: Trajectory, rows: list[int] | slice = slice(None)) -> None:
    """Bit for bit; `rows` of the first."""
    for name in ("orientation", "angular_velocity", "command", "motor", "tension", "failed"):
        a, b = getattr(one, name), getattr(other, name)
        if a is None:
            assert b is None
        else:
            np.testing.assert_array_equal(a[rows], b, err_msg=name)
    np.testing.assert_array_equal(one.time, other.time)


# --- laws of every plant --------------------------------------------------------------------------


def test_is_a_plant(plant: Plant) -> None:
    assert isinstance(plant, Plant)
    assert PLANTS[plant.name]
    assert len(set(names(plant.motors))) == len(plant.motors) > 0
    for motor, (low, high) in zip(plant.motors, ranges(plant.motors), strict=True):
        assert low <= motor.working[0] < motor.rest < motor.working[1] <= high
        assert np.isfinite(motor.working).all()
        assert motor.unit
    assert 0 < plant.step_s < 0.01
    assert plant.horizon_s is None or plant.horizon_s > 0
    assert plant.evaluation_pairs > 0


def test_an_identity_brings_the_plant_back(plant: Plant) -> None:
    identity = plant.identity()
    assert identity["plant"] == plant.name
    assert identity == plant.identity()
    again = restore_plant(json.loads(json.dumps(identity)))
    assert again.identity() == identity
    assert again.motors == plant.motors
    command = saccades(plant, 2, 40)
    identical(run(plant, command), run(again, command))


def test_identities_differ() -> None:
    """Plants whose numbers differ have different identities."""
    identities = [repr(make_plant(name, **options).identity()) for name, options in ALL]
    assert len(set(identities)) == len(identities)
    hashes = {make_plant("mujoco", eye=eye).identity()["model"] for eye in ("thesis", "eve_v3")}
    assert len(hashes) == 2


@pytest.mark.parametrize("name", PLANTS)
def test_the_options_of_a_plant_are_those_it_is_made_with(name: str) -> None:
    kind = PLANTS[name]
    assert kind.summary
    options = {option.name: option.default for option in kind.options}
    assert make_plant(name, **options).identity() == make_plant(name).identity()
    with pytest.raises(InputError, match=rf"plant {name!r}: .*'bogus'; its options are"):
        make_plant(name, bogus=1)


def test_trajectory_shapes_and_units(plant: Plant) -> None:
    command = saccades(plant)
    found = run(plant, command)
    assert len(found) == 5
    np.testing.assert_allclose(found.time, plant.step_s * np.arange(151), rtol=1e-15)
    assert found.orientation.shape == (5, 151, 4)
    assert found.angular_velocity.shape == (5, 151, 3)
    assert found.motors == plant.motors
    np.testing.assert_array_equal(found.command, command)
    low, high = ranges(plant.motors).T
    assert ((low <= found.motor) & (found.motor <= high)).all()
    assert not found.failed.any()
    np.testing.assert_allclose(np.linalg.norm(found.orientation, axis=-1), 1, rtol=1e-12)
    assert (found.tension is None) == (not found.tendon_names)
    if found.tension is not None:
        assert found.tension.shape == (5, 151, len(found.tendon_names))
        assert (found.tension >= 0).all()
    # The angular velocity is that of the orientation, in the head frame, deg/s.
    steps, before, after = quotients(found)
    apart, half = np.linalg.norm(steps - (before + after) / 2, axis=-1), np.linalg.norm(after - before, axis=-1) / 2
    assert (apart <= 1.001 * half + 1e-4 * np.abs(steps).max()).all()  # between its values at the ends


def quotients(found: Trajectory) -> tuple[Array, Array, Array]:
    """Angular velocity between samples by the orientation, and the trajectory's before and after, (n, time - 1, 3)."""
    count, samples = found.orientation.shape[:2]
    q = found.orientation
    turned = rotation(q[:, 1:].reshape(-1, 4)) * rotation(q[:, :-1].reshape(-1, 4)).inv()
    steps = turned.as_rotvec(degrees=True).reshape(count, samples - 1, 3) / (found.time[1] - found.time[0])
    return steps, found.angular_velocity[:, :-1], found.angular_velocity[:, 1:]


def test_its_motors_follow_and_what_they_did_is_charged(ours: Plant) -> None:
    """No motor of ours is slow, so the energy is the command's own; of samples, that of the straight lines."""
    command = pulse_steps(ours)
    movement = ours.move(command)
    np.testing.assert_array_equal(movement.trajectory().motor, movement.trajectory().command)
    np.testing.assert_array_equal(movement.energy(), command.energy())
    sampled = ours.move(command.sample(ours.step_s, 501)).energy()
    np.testing.assert_allclose(sampled, command.energy(), rtol=0.02)


def test_starts_at_rest_in_equilibrium(plant: Plant) -> None:
    """No drift over 0.3 s. The servo of MuJoCo's arms yields by up to 3e-7 rad, which is the 2e-5 deg."""
    away = 0.5 * reach(plant) * np.random.default_rng(0).uniform(-1, 1, (6, 1, len(plant.motors)))
    held = rests(plant.motors) + away
    found = run(plant, np.repeat(held, 301, axis=1))
    limit = 1e-9 if plant.name in ("lpf", "tavares") else 2e-5
    assert angle_between(found.orientation, found.orientation[:, :1]).max() < limit
    np.testing.assert_allclose(found.angular_velocity[:, 0], 0, atol=1e-9)
    assert np.abs(found.angular_velocity).max() < 10 * limit
    assert angle_between(found.orientation[:, 0], plant.rest(held[:, 0])).max() < 1e-9


def test_command_comes_to_rest_at_its_rest_orientation(plant: Plant) -> None:
    """After 2 s, the slowest torsion included: no nearer than MuJoCo's servo, or static friction, lets it."""
    command = saccades(plant, 3, samples=151) / 2
    command = np.concatenate([command, np.repeat(command[:, -1:], 1850, axis=1)], axis=1)
    found = run(plant, command)
    apart = angle_between(found.orientation, plant.rest(command[:, -1])[:, None])
    assert (apart[:, -1] < np.maximum(5e-4, 2e-3 * apart[:, 150])).all()


def test_hold_is_the_inverse_of_rest(plant: Plant) -> None:
    """With each motor alone, and with all; of more motors than angles only the orientation comes back."""
    rng, every = np.random.default_rng(3), names(plant.motors)
    for driven in (*((name,) for name in every), every):
        index = [every.index(name) for name in driven]
        motor = np.tile(rests(plant.motors), (8, 1))
        motor[:, index] += 0.5 * (reach(plant) * rng.uniform(-1, 1, motor.shape))[:, index]
        orientation = plant.rest(motor)
        for sign in (1, -1):
            held = plant.hold(sign * orientation, driven)
            assert angle_between(plant.rest(held), orientation).max() < 1e-6
            np.testing.assert_array_equal(np.delete(held - rests(plant.motors), index, axis=1), 0)
            if len(driven) <= 3:
                np.testing.assert_allclose(held, motor, atol=1e-6)


@pytest.mark.parametrize("shape", [(), (10,), (10, 1), (2, 10, 7), (2, 0, 1), (1, 2, 10, 1)])
def test_command_of_the_wrong_shape_is_refused(plant: Plant, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=r"has the shape \(saccades, time, .*motors.*got \("):
        plant.move(np.zeros(shape))
    with pytest.raises(InputError, match=rf"'{plant.name}' has the shape .*{plant.motors[0].name}"):
        plant.move(np.zeros((2, 10, len(plant.motors) + 1)))
    with pytest.raises(InputError, match=rf"'{plant.name}' has the shape .*{plant.motors[0].name}"):
        plant.move(PulseStep(*np.ones((4, 2, len(plant.motors) + 1))))


def test_start_of_the_wrong_shape_is_refused(plant: Plant) -> None:
    command, motors = saccades(plant, 2, 3), len(plant.motors)
    for start in (
        State(FORWARD[None], np.zeros((1, motors))),
        State(np.tile(FORWARD, (2, 1)), np.zeros((2, motors + 1))),
    ):
        for what in (command, pulse_steps(plant, 2)):
            with pytest.raises(InputError, match=rf"2 saccades .* {motors} motors, got motor positions \("):
                plant.move(what, start)
    with pytest.raises(InputError, match=r"angular velocities \(2, 3\).*got \(2, 4\), \(2, 2\)"):
        State(np.tile(FORWARD, (2, 1)), np.zeros((2, motors)), np.zeros((2, 2)))


@pytest.mark.parametrize("length", [2.0, 1e160, 1e-160, -1e300])
def test_a_start_of_any_length_is_the_same_start(plant: Plant, length: float) -> None:
    """Also one whose norm overflows."""
    command = saccades(plant, 3, 20)
    start, longer = plant.rest(command[:, 0]), plant.rest(command[:, 0])
    longer[1] *= length
    one, other = run(plant, command, starting(start, command)), run(plant, command, starting(longer, command))
    assert not other.failed.any()
    identical(other, run(plant, command[[0, 2]], starting(start[[0, 2]], command[[0, 2]])), [0, 2])
    assert angle_between(one.orientation[1], other.orientation[1]).max() < 1e-6


def test_same_twice(plant: Plant) -> None:
    """Nothing is left over from other runs: warm starts, controls, batches of another size."""
    command = saccades(plant)
    one = run(plant, command)
    run(plant, saccades(plant, 3, 40, seed=9))
    plant.rest(command[:2, -1])
    identical(one, run(plant, command))
    identical(one, run(restore_plant(plant.identity()), command))


def test_a_plant_may_be_used_from_several_threads_at_once(plant: Plant) -> None:
    """Bit for bit as one after the other, whatever the sizes of the batches."""
    jobs = [saccades(plant, 2 + k % 3, 101, seed=k) for k in range(12)]
    serial = [(run(plant, job), plant.rest(job[:, -1])) for job in jobs]
    with ThreadPoolExecutor(4) as threads:
        for _ in range(3):
            done = threads.map(lambda job: (run(plant, job), plant.rest(job[:, -1])), jobs)
            for (found, rest), (expected, at_rest) in zip(done, serial, strict=True):
                identical(found, expected)
                np.testing.assert_array_equal(rest, at_rest)


def test_inputs_are_left_alone(plant: Plant) -> None:
    command = saccades(plant, 2, 20)
    start = starting(2 * plant.rest(command[:, 0]), command, np.zeros((2, 3)))
    command[1, 3] = np.nan
    before, orientation, motor = command.copy(), start.orientation.copy(), start.motor.copy()
    found = run(plant, command, start)
    np.testing.assert_array_equal(command, before)
    np.testing.assert_array_equal(start.orientation, orientation)
    np.testing.assert_array_equal(start.motor, motor)
    assert not np.shares_memory(found.motor, command)


def test_batch_is_its_single_saccades(plant: Plant) -> None:
    """Bit for bit from a given start; the equilibrium before it to rounding."""
    command = saccades(plant, samples=81)
    batch = run(plant, command)
    started = run(plant, command, starting(batch.orientation[:, 0], command))
    for i in range(len(command)):
        row = slice(i, i + 1)
        start = starting(batch.orientation[row, 0], command[row])
        identical(started, run(plant, command[row], start), [i])
        assert angle_between(run(plant, command[row]).orientation, batch.orientation[i]).max() < 1e-9


def test_order_and_company_do_not_matter(plant: Plant) -> None:
    command = saccades(plant, 6)
    start = starting(plant.rest(command[:, 0]), command)
    shuffled = np.array([4, 0, 5, 2, 2, 1, 3])
    found = run(plant, command[shuffled], start[shuffled])
    identical(run(plant, command, start), found, list(shuffled))


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
@pytest.mark.parametrize("row", [0, 70])
def test_a_command_that_is_none_fails_alone(plant: Plant, bad: float, row: int) -> None:
    command = saccades(plant)
    command[2, row, -1] = bad
    found = run(plant, command)
    assert found.failed.tolist() == [False, False, True, False, False]
    for name in ("orientation", "angular_velocity", "motor", "tension"):
        if getattr(found, name) is not None:
            assert np.isnan(getattr(found, name)[2]).all(), name
    keep = [0, 1, 3, 4]
    identical(found, run(plant, command[keep]), keep)


@pytest.mark.parametrize("field", ["orientation", "motor", "angular_velocity"])
def test_a_start_that_is_none_fails_alone(plant: Plant, field: str) -> None:
    command = saccades(plant)
    good = State(plant.rest(command[:, 0]), command[:, 0].copy())
    getattr(good, field)[1] = np.nan
    found = run(plant, command, State(**{name: getattr(good, name) for name in good.__dataclass_fields__}))
    assert found.failed.tolist() == [False, True, False, False, False]
    assert np.isnan(found.orientation[1]).all()
    keep = [0, 2, 3, 4]
    identical(found, run(plant, command[keep], good[keep]), keep)


@pytest.mark.parametrize("speed", [1e6, 1e9, 1e14, 1e300])
def test_divergence_fails_alone(plant: Plant, speed: float) -> None:
    """An absurd start velocity [deg/s], after which a saccade is either whole or failed, and NaN."""
    command = saccades(plant, samples=51)
    start, velocity = plant.rest(command[:, 0]), np.zeros((5, 3))
    velocity[3] = speed * np.array([0.3, -0.5, 0.8])
    found = run(plant, command, starting(start, command, velocity))
    keep = [0, 1, 2, 4]
    assert not found.failed[keep].any()
    if plant.name in ELASTIC and speed > 1e12:
        assert found.failed[3]
    finite = np.isfinite(found.orientation[3])
    assert not finite.any() if found.failed[3] else finite.all()
    identical(found, run(plant, command[keep], starting(start[keep], command[keep])), keep)
    fresh = run(restore_plant(plant.identity()), command, starting(start, command))
    identical(fresh, run(plant, command, starting(start, command)))  # nothing of it is left over


def test_one_sample_is_the_start(plant: Plant) -> None:
    command = saccades(plant, 3, 1)
    found = run(plant, command)
    assert found.orientation.shape == (3, 1, 4)
    np.testing.assert_array_equal(found.orientation, run(plant, np.repeat(command, 4, axis=1)).orientation[:, :1])


def test_no_saccade_at_all(plant: Plant) -> None:
    found = plant.move(np.zeros((0, 5, len(plant.motors))))
    assert found.trajectory().orientation.shape == (0, 5, 4)
    assert found.measure().settling_time_s.shape == found.energy().shape == (0,)


def test_a_longer_horizon_holds_the_last_position(plant: Plant) -> None:
    command = saccades(plant, 2, 61)
    start = starting(plant.rest(command[:, 0]), command)
    longer = plant.move(command, start, horizon_s=100 * plant.step_s).trajectory()
    assert longer.time.shape == (101,)
    held = np.concatenate([command, np.repeat(command[:, -1:], 40, axis=1)], axis=1)
    identical(longer, run(plant, held, start))


def test_a_policy_is_cut_off_at_the_mechanical_range(plant: Plant) -> None:
    """Written commands are refused there; what the motors did is charged."""
    low, high = ranges(plant.motors).T
    F = np.tile(rests(plant.motors), (2, 1))
    D = F + 0.5 * np.stack([0.1 * reach(plant), room(plant)])
    command = PulseStep(F, np.full_like(F, 80.0), D, np.full_like(F, 5.0))  # peaks at six times D - F
    movement = plant.move(command, State(plant.rest(F), F), horizon_s=0.2)
    found = movement.trajectory()
    beyond = ((found.command < low) | (found.command > high)).any(axis=(1, 2))
    assert movement.saturated.tolist() == beyond.tolist()
    assert ((found.motor >= low) & (found.motor <= high)).all()
    if not beyond.any():
        assert np.isinf(ranges(plant.motors)).any()
        return
    taken = (np.diff(found.motor, axis=1) ** 2).sum(axis=(1, 2)) / plant.step_s
    np.testing.assert_allclose(movement.energy()[beyond], taken[beyond], rtol=1e-9)
    assert (movement.energy()[beyond] < command.energy()[beyond]).all()
    with pytest.raises(InputError, match="mechanical range"):
        plant.move(found.command)


def test_its_eye_can_be_drawn(plant: Plant) -> None:
    found = run(plant, saccades(plant, 2, 5))
    model = plant.drawn()
    stands = pose(model, found)
    eye = model.jnt_bodyid[model.joint("eye").id]
    assert angle_between(stands.orientation[:, :, eye], found.orientation).max() < 1e-6


def test_unknown_plant_names_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"unknown plant 'mojoco'; choose one of lpf, mujoco, tavares"):
        make_plant("mojoco")


def test_protocol_needs_every_member() -> None:
    class Half:
        name = "half"
        motors = ()

        def move(self, command: Array) -> None: ...

    assert not isinstance(Half(), Plant)


def test_a_new_plant_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    kind = PlantKind(
        "slow",
        lambda **own: make_plant("lpf", surrogate=Surrogate(1.0, 5.0), **own),
        (Option("step_s", float, 0.001, ""),),
    )
    monkeypatch.setitem(PLANTS._own, "slow", kind)
    assert make_plant("slow", step_s=0.002).step_s == 0.002
    assert "slow" in PLANTS


# --- ours -----------------------------------------------------------------------------------------


def test_the_reference_turns_by_the_new_velocity() -> None:
    """Algorithm 2: omega first, then q."""
    steps, _, after = quotients(run(TavaresPlant(), saccades(TavaresPlant())))
    np.testing.assert_allclose(steps, after, rtol=0, atol=1e-9)


def test_yaw_is_mirror_symmetric(ours: Plant) -> None:
    """Motor 2 the other way turns the eye the other way; positive turns it to the left."""
    command = PulseStep(*(np.array([[x]]) for x in (-4.0, 45.0, 14.0, 15.0)))
    if "motor2" not in names(ours.motors):
        pytest.skip("no motor turns it by yaw alone")
    horizontal = np.zeros((1, 151, len(ours.motors)))
    horizontal[..., names(ours.motors).index("motor2")] = command.sample(ours.step_s, 151)[..., 0]
    one, other = run(ours, horizontal), run(ours, -horizontal)
    assert one.yaw_deg[0, 0] < 0
    assert one.yaw_deg[0, -1] > 13
    limit = 1e-6 if ours.identity().get("eye") == "eve_v3" else 1e-9  # its inertia has a product x y
    np.testing.assert_allclose(one.yaw_deg, -other.yaw_deg, rtol=0, atol=limit)
    if limit == 1e-9:
        np.testing.assert_allclose(one.pitch_deg, other.pitch_deg, rtol=0, atol=limit)
    np.testing.assert_allclose(one.angular_velocity[..., 2], -other.angular_velocity[..., 2], rtol=0, atol=1e3 * limit)


# --- the elastic eye ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ELASTIC)
def test_static_yaw(name: str) -> None:
    """Spec: thesis author's program, motor-2 steps past where the tendons run through the eye."""
    motor = np.zeros((7, 3))
    motor[:, 1] = [25, 30, 36, 40, 50, 60, 80]
    yaw, pitch, roll = to_euler(make_plant(name).rest(motor))
    np.testing.assert_allclose(yaw, [37.3, 45.1, 55.0, 61.8, 79.3, 92.4, 105.0], atol=0.06)
    np.testing.assert_allclose([pitch, roll], 0, atol=1e-7)


def test_plants_agree_on_the_equilibrium() -> None:
    motor = np.random.default_rng(0).uniform(-30, 30, (20, 3))
    for options in ({}, {"eye": "eve_v3"}, {"gravity": True}):  # six: tests/test_six_motors.py
        apart = angle_between(MujocoPlant(**options).rest(motor), TavaresPlant(**options).rest(motor))
        assert apart.max() < 1e-9


@pytest.mark.parametrize("name", ELASTIC)
def test_commands_outside_the_mechanical_range_are_refused(name: str) -> None:
    plant = make_plant(name)
    command = saccades(plant, 3, 20)
    command[1, 12, 1] = -81.25
    with pytest.raises(
        InputError, match=r"saccade 1 sends motor2 to -81\.2 deg at 0\.012 s; its mechanical range is -80 to 80 deg"
    ):
        plant.move(command)
    command[1, 12, 1] = -80.0
    assert not run(plant, command).failed.any()
    assert {motor.working for motor in plant.motors} == {(-WORKING_RANGE_DEG, WORKING_RANGE_DEG)}
    assert WORKING_RANGE_DEG < 50  # well inside of where the response bends over


@pytest.mark.parametrize("name", ELASTIC)
def test_orientations_that_cannot_be_held_are_refused(name: str) -> None:
    plant = make_plant(name)
    with pytest.raises(InputError, match=r"no equilibrium of motors \[2\] within their range"):
        plant.hold(from_euler([0.0, 5.0], [0.0, 10.0], [0.0, 0.0]), ("motor2",))
    with pytest.raises(InputError, match="no equilibrium of motors"):
        plant.hold(from_yaw([150.0]), ("motor2",))


@pytest.mark.parametrize("name", ELASTIC)
@pytest.mark.parametrize("yaw", [-170.0, -120.0, -100.0, -87.5, -80.0, -40.0, 35.0, 60.0, 82.0, 90.0, 105.0, 140.0])
def test_held_orientations_are_held(name: str, yaw: float) -> None:
    """Far out other equilibria exist, which the eye would leave at a touch: they hold nothing."""
    plant = make_plant(name)
    try:
        motor = plant.hold(from_yaw([yaw]), ("motor2",))
    except InputError:
        assert abs(yaw) > 82
        return
    np.testing.assert_allclose(to_euler(plant.rest(motor))[0], yaw, atol=1e-6)


@pytest.mark.parametrize("name", ELASTIC)
def test_targets_need_no_more_than_the_action_range(name: str) -> None:
    """Spec: 35 deg of yaw take 23.7 deg of motor 2."""
    motor = make_plant(name).hold(from_yaw([35.0, -35.0]), ("motor2",))
    np.testing.assert_allclose(motor[:, 1], [23.6, -23.6], atol=0.15)
    np.testing.assert_array_equal(motor[:, [0, 2]], 0)


@pytest.mark.parametrize("name", ELASTIC)
def test_tension_holds_the_eye(name: str) -> None:
    """At rest the torques of the recorded tensions cancel."""
    plant, reference = make_plant(name), TavaresPlant()
    held = np.random.default_rng(1).uniform(-15, 15, (4, 1, 3))
    found = run(plant, np.repeat(held, 5, axis=1))
    turn = rotation(found.orientation[:, -1]).as_matrix()
    _, tension = reference.elastic_torque(turn, held[:, 0])
    assert found.tension is not None
    np.testing.assert_allclose(found.tension[:, -1], tension, atol=1e-6)
    np.testing.assert_allclose(found.tension[:, 0], tension, atol=1e-6)


@pytest.mark.parametrize("name", ELASTIC)
def test_gravity_pulls_the_gaze_down(name: str) -> None:
    """The centre of mass is before the centre of rotation (spec), so the eye looks lower: positive pitch."""
    still = np.zeros((1, 3))
    _, without, _ = to_euler(make_plant(name).rest(still))
    _, pitch, _ = to_euler(make_plant(name, gravity=True).rest(still))
    assert abs(without[0]) < 1e-9
    assert pitch[0] > 1


@pytest.mark.parametrize("options", [{}, {"accurate": True}, {"gravity": True}, {"eye": "six"}])
def test_mujoco_is_the_same_at_any_thread_count(options: dict[str, Any]) -> None:
    command = saccades(MujocoPlant(**options), 23)
    one = run(MujocoPlant(threads=1, **options), command)
    for threads in (2, 3, 0):
        identical(one, run(MujocoPlant(threads=threads, **options), command))


def test_mujoco_chunks_are_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Batches too large for the memory set aside run in parts."""
    plant = MujocoPlant()
    command = saccades(plant, 11)
    whole = run(plant, command)
    monkeypatch.setattr("orient_eye.plants.mujoco._RECORD_BYTES", 90_000)
    sizes = [part.stop - part.start for part in plant._chunks(11, 151)]
    assert len(sizes) > 2
    assert sum(sizes) == 11
    identical(whole, run(plant, command))


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"eye": "eve_v3", "accurate": True, "gravity": True, "threads": 2},
        {"eye": "six", "pretension": 2.0, "gravity": True},
    ],
)
def test_mujoco_pickles(options: dict[str, Any]) -> None:
    plant = MujocoPlant(**options)
    command = saccades(plant)
    before = run(plant, command)
    other = pickle.loads(pickle.dumps(plant))
    assert other.identity() == plant.identity()
    assert other.threads == plant.threads
    identical(before, run(other, command))


def test_mujoco_in_another_process_is_the_same() -> None:
    """The plant and its results do not depend on the process that makes them."""
    program = (
        "import sys, pickle, hashlib, numpy as np\n"
        "plant, command = pickle.load(sys.stdin.buffer)\n"
        "found = plant.move(command).trajectory()\n"
        "print(hashlib.sha256(found.orientation.tobytes() + found.tension.tobytes()).hexdigest())\n"
    )
    plant = MujocoPlant(threads=1)
    command = saccades(plant, 3, 40)
    found = run(plant, command)
    assert found.tension is not None
    output = subprocess.run(
        [sys.executable, "-c", program], input=pickle.dumps((plant, command)), capture_output=True, check=True
    ).stdout
    expected = hashlib.sha256(found.orientation.tobytes() + found.tension.tobytes()).hexdigest()
    assert output.decode().strip() == expected


def simulated_in_a_child(plant: MujocoPlant, command: Array, answer: Connection) -> None:
    answer.send(run(plant, command))


@pytest.mark.parametrize("options", [{}, {"threads": 1}, {"eye": "six"}], ids=str)
def test_mujoco_in_a_forked_child_is_the_same(options: dict[str, Any]) -> None:
    """After it was used here: its threads do not go with the child."""
    plant = MujocoPlant(**options)
    command = saccades(plant, 4, 60)
    before = run(plant, command)
    fork = multiprocessing.get_context("fork")
    here, there = fork.Pipe(duplex=False)
    child = fork.Process(target=simulated_in_a_child, args=(plant, command, there))
    child.start()
    try:
        assert here.poll(60), "the child hangs"
        identical(before, here.recv())
    finally:
        child.join(5)
        child.kill()
        child.join()
    assert child.exitcode == 0
    identical(before, run(plant, command))


def test_start_velocity_is_in_the_head_frame() -> None:
    """Both elastic plants start a turned eye with the same head-frame velocity, and report it."""
    motor = np.array([[5.0, 12.0, -8.0]])
    velocity = np.array([[40.0, -120.0, 300.0]])
    command = np.repeat(motor[:, None], 31, axis=1)
    found = []
    for plant in (MujocoPlant(), TavaresPlant()):
        trajectory = run(plant, command, State(plant.rest(motor), motor, velocity))
        np.testing.assert_allclose(trajectory.angular_velocity[:, 0], velocity, rtol=1e-12)
        found.append(trajectory.orientation)
    assert angle_between(*found).max() < 1e-4


# --- the low-pass plant ---------------------------------------------------------------------------

K, W0 = 1.4758, 17.5  # thesis 3.3.1


def low_pass(step_s: float = 0.001) -> Plant:
    return make_plant("lpf", surrogate=Surrogate(K, W0), step_s=step_s)


def test_low_pass_step_response() -> None:
    """theta0 + K A (1 - exp(-w0 t)), 3.13: a step at t = 0 from rest at 5 deg of motor."""
    command = np.full((1, 401, 1), 17.0)
    found = run(low_pass(), command, State(from_yaw([5 * K]), np.array([[5.0]])))
    t = found.time
    np.testing.assert_allclose(found.yaw_deg[0], K * (5 + 12 * (1 - np.exp(-W0 * t))), rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.angular_velocity[0, :, 2], K * 12 * W0 * np.exp(-W0 * t), rtol=1e-11)
    np.testing.assert_array_equal(found.angular_velocity[..., :2], 0)
    assert found.tension is None


@pytest.mark.parametrize("name", PULSES)
def test_low_pass_simulation_goes_to_the_closed_form(name: str) -> None:
    """A smooth command, taken as straight lines: the error is of second order in the step."""
    rng, onset = np.random.default_rng(1), PULSES[name].onset
    F, D = rng.uniform(-20, 20, (2, 6, 1))
    C = None if onset is None else onset.fixed
    command = PulseStep(F, rng.uniform(18, 60, (6, 1)), D, rng.uniform(8, 30, (6, 1)), name, C)
    errors = []
    for step_s, samples in ((1e-3, 401), (1e-4, 4001)):
        plant = low_pass(step_s)
        simulated = run(plant, command.sample(step_s, samples))
        closed = plant.move(command, horizon_s=(samples - 1) * step_s).trajectory()
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
    plant = make_plant("lpf", surrogate=Surrogate(K, w0), step_s=step_s)
    found = run(plant, tau[..., None]).yaw_deg
    t = step_s * np.arange(60)
    for row, yaw in zip(tau, found, strict=True):
        _, response, _ = lsim(([[-w0]], [[w0 * K]], [[1.0]], [[0.0]]), row, t, X0=[K * row[0]])
        np.testing.assert_allclose(yaw, response, rtol=0, atol=1e-9)  # slopes of 80 deg a step cancel

    def slope_forgotten(k: int) -> float:
        slope = (tau[0, k + 1] - tau[0, k]) / step_s
        return quad(lambda s: slope * np.exp(-w0 * (t[-1] - s)), t[k], t[k + 1], epsabs=1e-13)[0]

    lag = sum(slope_forgotten(k) for k in range(59))  # theta = K (tau - what of its slope is not yet followed)
    assert found[0, -1] == pytest.approx(K * (tau[0, -1] - lag), rel=0, abs=1e-9)


def test_low_pass_stays_at_rest_exactly() -> None:
    found = run(low_pass(), np.full((1, 1001, 1), 13.7))
    np.testing.assert_allclose(found.yaw_deg, K * 13.7, rtol=1e-14)


def test_low_pass_refuses_what_is_not_horizontal() -> None:
    plant = low_pass()
    tilted = from_euler([5.0, 5.0], [0.0, 3.0], [0.0, -2.0])
    with pytest.raises(InputError, match=r"turns the eye in yaw only.*got pitch 3 deg, roll -2 deg"):
        plant.hold(tilted, ("motor2",))
    with pytest.raises(InputError, match="turns the eye in yaw only"):
        run(plant, np.zeros((2, 5, 1)), State(tilted, np.zeros((2, 1))))
    np.testing.assert_allclose(plant.hold(from_yaw([-30.0]), ("motor2",)), [[-30 / K]], rtol=1e-14)


def test_low_pass_has_no_mechanical_limit() -> None:
    found = run(low_pass(), np.full((1, 3, 1), 115.0))
    assert not found.failed.any()
    np.testing.assert_allclose(found.yaw_deg, 115 * K, rtol=1e-14)


def test_low_pass_takes_its_surrogate_by_name_by_file_and_as_it_is(tmp_path: Path) -> None:
    own = Surrogate(1.2, 9.0, "motor1")
    own.save(tmp_path / "surrogate.json")
    for plant in (make_plant("lpf", surrogate=each) for each in (own, tmp_path / "surrogate.json")):
        assert plant.surrogate == own
        assert names(plant.motors) == ("motor1",)
        np.testing.assert_allclose(to_euler(plant.rest(np.array([[10.0]])))[0], 12.0)
    assert (make_plant("lpf").surrogate.K, make_plant("lpf").surrogate.w0) == (K, W0)
    assert make_plant("lpf", surrogate="thesis").identity() == {"plant": "lpf", "K": K, "w0": W0, "motor": "motor2"}
