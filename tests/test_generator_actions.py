"""Generators that motors share, and actions of an eye with more motors than axes: meaning, and where they end."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from orient_eye import listing, rotations
from orient_eye.commands.generators import Generators
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.plants import make_plant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.task.actions import PulseStepActions, restore_actions
from orient_eye.task.gaze_targets import GazeTargets
from orient_eye.task.generator_actions import GeneratorActions, GeneratorRatios
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import make_targets, saccades

Array = NDArray[np.float64]
SIX = ("IR", "MR", "SR", "LR", "IO", "SO")
LAW = settings(deadline=None, max_examples=25, derandomize=True)
USUAL = np.array([[1.0, 1.0, 1.0, 1.0, 0.0]])
angle = st.floats(-17.0, 17.0)
rate = st.floats(5.0, 150.0)


@pytest.fixture(scope="module")
def plant() -> TavaresPlant:
    return TavaresPlant("six")


@pytest.fixture(scope="module")
def task(plant: TavaresPlant) -> SaccadeTask:
    return SaccadeTask.of_case(plant, "smooth")


def drawn(pulse: str, B: tuple[float, float], k0: tuple[float, float]) -> Generators:
    way = np.array([[[3.0, -2.0, 0.0], [1.0, 4.0, -5.0]]])
    C = 20.0 if pulse in ("2", "3") else None
    return Generators(np.array([[10.0, 20.0, 30.0]]), way, np.array([B]), np.array([k0]), pulse, C)


# --- the command ----------------------------------------------------------------------------------


@LAW
@given(pulse=st.sampled_from(["1", "2", "3", "smooth"]), B=st.tuples(rate, rate), k0=st.tuples(rate, rate))
def test_energy_is_that_of_the_speeds(pulse: str, B: tuple[float, float], k0: tuple[float, float]) -> None:
    command = drawn(pulse, B, k0)
    last = 30 / min(B)

    def power(t: float) -> float:
        return float((command.rate([t])[0, 0] ** 2).sum())

    expected = quad(power, 0, last, limit=400, epsabs=0, epsrel=1e-9)[0]
    assert command.energy()[0] == pytest.approx(expected, rel=1e-6)


@LAW
@given(pulse=st.sampled_from(["1", "2", "3", "smooth"]), B=st.tuples(rate, rate), k0=st.tuples(rate, rate))
def test_a_generator_for_each_motor_is_the_pulse_step_of_the_thesis(
    pulse: str, B: tuple[float, float], k0: tuple[float, float]
) -> None:
    C = 20.0 if pulse in ("2", "3") else None
    F, D = np.array([[1.0, -2.0]]), np.array([[8.0, 3.0]])
    shared = Generators(F, np.diagflat(D - F)[None], np.array([B]), np.array([k0]), pulse, C)
    alone = PulseStep(F, np.array([B]), D, np.array([k0]), pulse, C)
    np.testing.assert_allclose(shared.sample(0.002, 200), alone.sample(0.002, 200), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(shared.energy(), alone.energy(), rtol=1e-7)
    np.testing.assert_allclose(shared.final, alone.final)


def test_some_of_the_saccades_are_the_same() -> None:
    one = drawn("smooth", (30.0, 60.0), (5.0, 20.0))
    two = Generators(*(np.concatenate([a, 2 * a]) for a in (one.F, one.way, one.B, one.k0)), "smooth")
    np.testing.assert_array_equal(two[np.array([0])].sample(0.001, 50), one.sample(0.001, 50))
    np.testing.assert_array_equal(two[np.array([False, True])].final, 2 * one.final)


def test_numbers_that_are_none_fail_their_saccade_only() -> None:
    one = drawn("smooth", (30.0, 60.0), (5.0, 20.0))
    B, way = np.repeat(one.B, 3, axis=0), np.repeat(one.way, 3, axis=0)
    B[1, 0], way[2, 1, 2] = np.nan, np.inf
    command = Generators(np.repeat(one.F, 3, axis=0), way, B, np.repeat(one.k0, 3, axis=0), "smooth")
    told = command.sample(0.001, 20)
    assert np.isfinite(told).all(axis=(1, 2)).tolist() == [True, False, False]
    np.testing.assert_array_equal(told[0], one.sample(0.001, 20)[0])
    with pytest.raises(InputError, match=r"have the shapes .* got \(1, 3\), \(1, 2, 3\), \(1, 3\)"):
        Generators(one.F, one.way, np.ones((1, 3)), one.k0)
    with pytest.raises(InputError, match="k0 must be positive"):
        Generators(one.F, one.way, one.B, -one.k0).sample(0.001, 2)


# --- the actions ----------------------------------------------------------------------------------


def test_an_eye_with_six_motors_looks_in_all_directions(task: SaccadeTask) -> None:
    assert isinstance(task.targets, GazeTargets)
    assert (task.targets.limit_deg, task.targets.torsion_deg) == (25.0, 0.6)
    assert isinstance(task.actions, GeneratorRatios)
    assert task.actions.names == ("B_ratio_sideways", "k0_ratio_sideways", "B_ratio_updown", "k0_ratio_updown", "trim")
    assert task.plain.actions.names == ("B_sideways", "k0_sideways", "B_updown", "k0_updown", "trim")


@pytest.mark.parametrize("name", ["horizontal", "vertical", "torsional"])
def test_it_does_not_turn_about_one_axis_by_some_motors(plant: TavaresPlant, name: str) -> None:
    with pytest.raises(InputError, match=r"6 motors of plant 'tavares' turn the eye about all axes .* targets gaze"):
        make_targets(name, plant)


@LAW
@given(start=st.tuples(angle, angle), target=st.tuples(angle, angle), seed=st.integers(0, 2**20))
def test_whatever_the_numbers_are_the_eye_ends_on_the_target(
    task: SaccadeTask, plant: TavaresPlant, start: tuple[float, float], target: tuple[float, float], seed: int
) -> None:
    begin, wanted = saccades(task.targets, [start], [target])
    action = task.actions.from_unit(np.random.default_rng(seed).uniform(-1, 1, (1, 5)))
    command = task.actions.command(begin, wanted, action)
    rest = plant.rest(command.final)
    assert rotations.angle_between_directions(rotations.gaze(rest), rotations.gaze(wanted)).max() < 0.001
    assert plant.cables.state(rest, command.final).good.all()
    assert listing.torsion(rest) == pytest.approx(listing.torsion(wanted), abs=0.001)


def test_each_generator_carries_the_gaze_one_way(task: SaccadeTask, plant: TavaresPlant) -> None:
    """The sideways part alone turns the eye by the saccade's yaw, the other by its pitch."""
    begin, wanted = saccades(task.targets, [[-8.0, 6.0], [10.0, -4.0]], [[9.0, -7.0], [10.0, 12.0]])
    assert isinstance(task.plain.actions, GeneratorActions)
    ways = task.plain.actions.ways(begin, wanted)
    np.testing.assert_allclose(
        begin.motor + ways.sum(axis=1), task.plain.actions.fixations.motor(rotations.gaze(wanted))
    )
    for which, (yaw, pitch) in enumerate([((17.0, 0.0), (0.0, 0.0)), ((0.0, 0.0), (-13.0, 16.0))]):
        ends = rotations.to_euler(plant.rest(begin.motor + ways[:, which]))
        begins = rotations.to_euler(begin.orientation)
        np.testing.assert_allclose(ends[0] - begins[0], yaw if which == 0 else 0.0, atol=0.6)
        np.testing.assert_allclose(ends[1] - begins[1], pitch if which == 0 else (-13.0, 16.0), atol=0.6)


def test_a_saccade_straight_up_does_not_drift_to_the_side(task: SaccadeTask) -> None:
    """What turns the eye up kicks it aside, and that dies away slowly; the trim kicks it back."""
    begin, wanted = saccades(task.targets, [[0.0, 15.0]], [[0.0, -15.0]])
    trims = np.linspace(-0.1, 0.1, 41)
    tried = np.column_stack([np.tile([70.0, 5.1, 70.0, 19.8], (41, 1)), trims])
    which = np.zeros(41, int)
    found = task.plain.perform(begin[which], tried, wanted[which]).measures
    took = np.where(found.settled, found.settling_time_s, np.inf)
    assert took[20] > 0.3
    assert took.min() < 0.14
    assert np.abs(np.diff(found.final, axis=0)).max() < 1e-9  # it changes the way, not the end


def test_the_trim_takes_nothing_with_it_that_the_other_generator_does_not_bring_back(task: SaccadeTask) -> None:
    begin, wanted = saccades(task.targets, [[-8.0, 6.0]], [[9.0, -7.0]])
    told = np.array([[60.0, 5.0, 70.0, 20.0, 0.03]])
    with_trim = task.plain.actions.command(begin, wanted, told)
    without = task.plain.actions.command(begin, wanted, told * [1, 1, 1, 1, 0])
    np.testing.assert_allclose(with_trim.final, without.final)
    moved = np.abs(with_trim.sample(0.001, 200) - without.sample(0.001, 200)).max(axis=(0, 1))
    assert (moved[[1, 3]] > 0.5).all()  # the horizontal recti alone
    assert moved[[0, 2, 4, 5]].max() == 0


def test_ratios_are_of_usual_numbers_and_stay_in_bounds(task: SaccadeTask) -> None:
    random = np.random.default_rng(0)
    begin, wanted = task.targets.draw(200, random)
    plain = task.plain.actions
    told = task.actions.as_plain(begin, wanted, task.actions.from_unit(random.uniform(-1, 1, (200, 5))))
    assert (told >= plain.low).all()
    assert (told <= plain.high).all()
    usual = task.actions.as_plain(begin, wanted, USUAL[[0] * 200])
    more = task.actions.as_plain(begin, wanted, np.tile([1.1, 1.1, 1.1, 1.1, 0.0], (200, 1)))
    inside = (usual > plain.low) & (more < plain.high)
    assert inside.mean() > 0.8
    inside[:, -1] = False
    np.testing.assert_allclose(more[inside], 1.1 * usual[inside])


def test_usual_numbers_follow_the_amplitude_and_the_eye(task: SaccadeTask) -> None:
    """B falls with the amplitude, k0 with how fast the eye is: slow at its nose, on the left of a right eye."""
    small, large = ([[0.0, 0.0]], [[5.0, 0.0]]), ([[-15.0, 0.0]], [[15.0, 0.0]])
    left, right = ([[15.0, 0.0]], [[20.0, 0.0]]), ([[-15.0, 0.0]], [[-20.0, 0.0]])
    usual = [task.actions.as_plain(*saccades(task.targets, *ends), USUAL)[0] for ends in (small, large, left, right)]
    assert usual[0][0] / usual[1][0] == pytest.approx(6**0.53)
    assert usual[2][1] < 0.8 * usual[3][1]


def test_generators_for_groups_of_motors(plant: TavaresPlant) -> None:
    pairs = GeneratorActions(plant, SIX, "smooth", generators="pairs")
    assert pairs.names[::2] == ("B_IR_SR", "B_MR_LR", "B_IO_SO")
    axes = GeneratorActions(plant, SIX, "smooth", generators="axes")
    assert axes.names == ("B_MR_LR", "k0_MR_LR", "B_IR_SR_IO_SO", "k0_IR_SR_IO_SO")
    assert restore_actions(axes.identity(), plant).identity() == axes.identity()
    with pytest.raises(InputError, match="generators are for directions, axes, pairs, got 'muscles'"):
        GeneratorActions(plant, SIX, generators="muscles")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no onset rate C brings it to its speed limit"):
        GeneratorActions(plant, SIX, "2", "varying")
    three = make_plant("tavares")
    with pytest.raises(InputError, match="not pairs of antagonists; take generators for axes"):
        GeneratorActions(three, ("motor1", "motor2", "motor3"), generators="pairs")


def test_a_generator_for_each_pair_tells_its_motors_the_same(plant: TavaresPlant, task: SaccadeTask) -> None:
    begin, wanted = saccades(task.targets, [[0.0, 0.0]], [[12.0, -9.0]])
    pairs = GeneratorActions(plant, SIX, "smooth", rates=task.targets.pulse_rates, generators="pairs")
    each = PulseStepActions(plant, SIX, "smooth", rates=task.targets.pulse_rates)
    D = pairs.fixations.motor(rotations.gaze(wanted))[0]
    B, k0 = np.array([30.0, 60, 30, 60, 90, 90]), np.array([10.0, 5, 10, 5, 20, 20])
    np.testing.assert_allclose(
        pairs.command(begin, wanted, np.array([[30.0, 10, 60, 5, 90, 20]])).sample(0.001, 400),
        each.command(begin, wanted, np.stack([B, D, k0], axis=1).reshape(1, -1)).sample(0.001, 400),
        atol=1e-9,
    )


def test_restored_tasks_are_the_same(task: SaccadeTask) -> None:
    again = SaccadeTask.restore(task.identity())
    assert again.identity() == task.identity()
    assert SaccadeTask.restore(task.identity(), make_plant("mujoco", eye="six")).actions.names == task.actions.names


def test_copies_are_the_same_task(task: SaccadeTask) -> None:
    for again in (copy.deepcopy(task), pickle.loads(pickle.dumps(task))):
        assert again.identity() == task.identity()


def test_the_environment_has_five_numbers() -> None:
    env = gymnasium.make(
        "OrientEye/Saccade-v0", plant="tavares", plant_options={"eye": "six"}, targets="gaze", case="smooth"
    )
    env.reset(seed=0)
    assert env.action_space.shape == (5,)
    _, reward, terminated, _, _ = env.step(np.zeros(5, np.float32))
    assert terminated
    assert float(reward) < 0
    env.close()
