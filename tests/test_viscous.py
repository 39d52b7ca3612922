"""Plant `viscous`: its equation by scipy and the NumPy witness, the whole eye it stands for, and eyes it refuses."""

import multiprocessing
import pickle
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from numpy_reference import NumpyReference, rate
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.eyes import EYES, Eye
from orient_eye.plants import make_plant
from orient_eye.plants.simulated import Run
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.plants.viscous import ViscousPlant
from orient_eye.rotations import FORWARD, angle_between
from orient_eye.state import State

Array = NDArray[np.float64]
PLANT = ViscousPlant(threads=2)


def pulse_steps(count: int, seed: int = 0) -> PulseStep:
    """Saccades of all three motors, of about 30 deg, at rates near the best."""
    rng, shape = np.random.default_rng(seed), (count, 3)
    F, D = rng.uniform(-15, 15, (2, *shape))
    return PulseStep(F, rng.uniform(25, 70, shape), D, rng.uniform([4, 14, 4], [8, 22, 8], shape))


def starting(motor: Array, velocity: Array | None = None) -> State:
    return State(PLANT.rest(motor[:, 0]), motor[:, 0], velocity)


def truth(reference: NumpyReference, motor: Array, start: Array) -> tuple[Array, Array]:
    """Orientation (time, 4) and angular velocity [deg/s] (time, 3) of friction * omega = torque, by DOP853.

    The motors (time, motors) go on straight lines between samples of 1 ms.
    """
    grid = 0.001 * np.arange(len(motor))

    def velocity(t: float, q: Array) -> Array:
        at = np.stack([np.interp(t, grid, each) for each in motor.T])
        return reference.torque(q[None] / np.linalg.norm(q), at[None]) / reference.elastics.friction

    solution = solve_ivp(
        lambda t, q: rate(q[None], velocity(t, q))[0], (0, grid[-1]), start, "DOP853", grid, rtol=1e-7, atol=1e-9
    )
    q = solution.y.T
    return q, np.rad2deg([velocity(t, each)[0] for t, each in zip(grid, q, strict=True)])


def rms(one: Array, other: Array) -> float:
    return float(np.sqrt(np.mean(angle_between(one, other) ** 2)))


def identical(one: Run, other: Run) -> None:
    """Bit for bit."""
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


# --- right ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("gravity", [False, True])
def test_it_is_friction_times_velocity(gravity: bool) -> None:
    """At every sample, those inside the steps too; the last step is a short one."""
    plant = ViscousPlant(gravity=gravity)
    motor = pulse_steps(2, seed=1).sample(0.001, 305)
    start = State(plant.rest(motor[:, 0]), motor[:, 0])
    q, omega, tension, diverged = plant.run(motor, start)
    assert plant.stride == 10
    assert tension is None
    assert not diverged.any()
    for i in range(2):
        expected, velocity = truth(NumpyReference(plant.elastics, gravity), motor[i], start.orientation[i])
        assert rms(q[i], expected) < 0.15
        assert np.sqrt(np.mean((omega[i] - velocity) ** 2)) < 0.01 * np.abs(velocity).max()
        ends = [*range(0, 305, 10), 304]
        torque = NumpyReference(plant.elastics, gravity).torque(q[i, ends], motor[i, ends])
        np.testing.assert_allclose(omega[i, ends], np.rad2deg(torque / plant.elastics.friction), rtol=0, atol=1e-9)


def test_it_is_of_second_order() -> None:
    """A third of the step, a ninth of the error."""
    plant, motor = ViscousPlant(), pulse_steps(1, seed=2).sample(0.001, 91)
    start = starting(motor)
    expected, _ = truth(NumpyReference(plant.elastics), motor[0], start.orientation[0])
    errors = []
    for plant.stride in (9, 3, 1):
        errors.append(angle_between(plant.run(motor, start)[0][0], expected).max())
    assert errors[0] / errors[1] > 7
    assert errors[1] / errors[2] > 7


@settings(deadline=None, max_examples=10, derandomize=True)
@given(seed=st.integers(0, 2**30))
def test_it_is_near_the_whole_eye(seed: int) -> None:
    """Spec: 0.13 deg rms over pulse-steps of three motors."""
    command = pulse_steps(20, seed)
    motor = command.sample(0.001, 501)
    assert rms(PLANT.run(motor, starting(motor))[0], TavaresPlant(threads=1).run(motor, starting(motor))[0]) < 0.3


def test_it_rests_where_the_whole_eye_does_and_pulls_alike() -> None:
    motor = np.random.default_rng(0).uniform(-30, 30, (20, 3))
    for options in ({}, {"gravity": True}):
        plant, whole = ViscousPlant(**options), TavaresPlant(**options)
        assert angle_between(plant.rest(motor), whole.rest(motor)).max() < 1e-9
        reference = NumpyReference(plant.elastics)
        turned = PLANT.rest(-motor)
        for each in (plant, whole):
            _, expected = reference.elastic_torque(rotation_matrices(turned), motor)
            np.testing.assert_allclose(each.tension(turned, motor), expected, rtol=0, atol=1e-12)


def rotation_matrices(q: Array) -> Array:
    flat = np.zeros((len(q), 9))
    for row, each in zip(flat, q, strict=True):
        mujoco.mju_quat2Mat(row, each)
    return flat.reshape(-1, 3, 3)


def test_the_velocity_of_a_start_is_ignored() -> None:
    motor = pulse_steps(3).sample(0.001, 101)
    still, moving = starting(motor), starting(motor, np.full((3, 3), 250.0))
    identical(PLANT.run(motor, still), PLANT.run(motor, moving))
    np.testing.assert_allclose(PLANT.run(motor, moving)[1][:, 0], 0, atol=1e-7)


def test_it_goes_on_from_a_state() -> None:
    """Where a step ends to rounding, inside one as near as the steps are exact."""
    assert PLANT.resumes
    motor = pulse_steps(4).sample(0.001, 301)
    whole, _, _, _ = PLANT.run(motor, starting(motor))
    for sample, limit in ((60, 1e-12), (67, 0.05)):
        later, _, _, _ = PLANT.run(motor[:, sample:], State(whole[:, sample], motor[:, sample]))
        assert angle_between(later, whole[:, sample:]).max() <= limit


def test_measures_do_not_depend_on_the_horizon() -> None:
    """The samples end while these eyes still move, and go on from there."""
    command = pulse_steps(6, seed=4)
    start = State(PLANT.rest(command.F), command.F)
    one, other = (PLANT.move(command, start, horizon_s).measure() for horizon_s in (0.15, 2.0))
    np.testing.assert_allclose(one.settling_time_s, other.settling_time_s, rtol=0, atol=1e-5)
    np.testing.assert_allclose(one.overshoot, other.overshoot, rtol=0, atol=1e-5)
    assert angle_between(one.at_settling, other.at_settling).max() < 1e-4


# --- eyes -----------------------------------------------------------------------------------------


def another_eye(name: str, stiffness: float, inertia: float, patch: pytest.MonkeyPatch) -> str:
    """The thesis' with stiffer elastics and another inertia, by factors."""

    def change(spec: mujoco.MjSpec) -> None:
        for tendon in spec.tendons:
            tendon.stiffness[0] *= stiffness
        spec.body("eye").inertia = inertia * np.array(spec.body("eye").inertia)

    patch.setitem(EYES._own, name, Eye("another", Path("eye3.xml"), change))
    return name


def test_an_eye_whose_inertia_matters_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for eye in ("eve_v3", another_eye("heavy", 1.0, 3.0, monkeypatch)):
        with pytest.raises(InputError, match=rf"eye '{eye}' has poles of [\d., ]+ 1/s: take plant 'tavares' or"):
            make_plant("viscous", eye=eye)


def test_steps_are_short_where_the_eye_is_quick(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = ViscousPlant(another_eye("tight", 2.5, 0.5, monkeypatch))
    assert plant.stride == 5
    motor = pulse_steps(2).sample(0.001, 201)
    whole = TavaresPlant("tight").run(motor, starting(motor))[0]
    assert rms(plant.run(motor, starting(motor))[0], whole) < 0.3


def test_a_saccade_that_diverges_fails_alone() -> None:
    """Nearly without friction; at rest straight ahead nothing pulls."""
    plant = ViscousPlant()
    plant._weighed = plant._weighed._replace(friction=1e-9)
    motor = np.zeros((3, 20, 3))
    motor[1, 5:] = 10.0
    q, omega, _, diverged = plant.run(motor, State(np.tile(FORWARD, (3, 1)), motor[:, 0]))
    assert diverged.tolist() == [False, True, False]
    for each in (q, omega):
        np.testing.assert_array_equal(np.isnan(each[:, -1]).any(axis=1), diverged)


# --- the same in any thread and process ----------------------------------------------------------------


def test_bit_for_bit_at_any_number_of_threads() -> None:
    motor = pulse_steps(67).sample(0.001, 401)
    one = PLANT.run(motor, starting(motor))
    for threads in (1, 3, 0):
        identical(one, ViscousPlant(threads=threads).run(motor, starting(motor)))
    part = slice(3, 9)
    for a, b in zip(one, PLANT.run(motor[part], starting(motor)[part]), strict=True):
        np.testing.assert_array_equal(None if a is None else a[part], b)


@pytest.mark.parametrize("options", [{}, {"gravity": True, "threads": 3}, {"rig": "prototype"}], ids=str)
def test_pickles(options: dict[str, Any]) -> None:
    plant, motor = ViscousPlant(**options), pulse_steps(3).sample(0.001, 40)
    other = pickle.loads(pickle.dumps(plant))
    assert other.identity() == plant.identity()
    assert (other.threads, other.motors) == (plant.threads, plant.motors)
    identical(plant.run(motor, starting(motor)), other.run(motor, starting(motor)))


def moved(motor: Array) -> Run:
    return PLANT.run(motor, starting(motor))


def test_in_a_forked_child() -> None:
    """With the plant as it was used here."""
    motor = pulse_steps(60).sample(0.001, 401)
    before = moved(motor)
    with multiprocessing.get_context("fork").Pool(1) as child:
        identical(before, child.apply_async(moved, (motor,)).get(60))


def test_without_numba_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(InputError, match=r"'viscous' is compiled by Numba, .*pip install numba"):
        make_plant("viscous")
