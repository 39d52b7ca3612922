"""Residual actions: zero is the usual command as it is stated, bounds are never left, an identity restores them."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orient_eye import listing, rotations
from orient_eye.errors import InputError
from orient_eye.plants import Plant, make_plant
from orient_eye.plants.fixation import fixate
from orient_eye.state import State
from orient_eye.task.actions import restore_actions
from orient_eye.task.residual_actions import ResidualActions
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

ALL = ("motor1", "motor2", "motor3")
SMALL = {"accuracy": 1e7, "energy": 1.0, "duration": 1e5, "overshoot": 1e6, "force": 0.0}


@cache
def made(name: str) -> Plant:
    return make_plant(name)


@cache
def task_of(name: str, rule: str | None = None) -> SaccadeTask:
    return SaccadeTask.of_case(
        made(name), targets="gaze", weights=SMALL, action_options=None if rule is None else {"rule": rule}
    )


def nothing(actions: ResidualActions, count: int) -> np.ndarray:
    return actions.from_unit(np.zeros((count, len(actions.numbers))))


def actions_of(name: str, rule: str | None = None) -> ResidualActions:
    found = task_of(name, rule).actions
    assert isinstance(found, ResidualActions)
    return found


START = [[0.0, 0.0], [-10.0, 5.0], [20.0, 10.0], [0.3, 0.0]]
TARGET = [[20.0, 0.0], [10.0, -15.0], [-20.0, -10.0], [0.0, 0.0]]


@pytest.mark.parametrize("name", ["tavares", "modal"])
def test_zero_is_the_usual_command(name: str) -> None:
    """B = 200 A^-0.6, each motor to where the eye holds the target with the least force, k0 the pole it moves most."""
    task, plant = task_of(name), made(name)
    start, target = saccades(task.targets, START, TARGET)
    actions = actions_of(name)
    np.testing.assert_allclose(nothing(actions, 4)[0], [1, 0, 1] * 3, atol=1e-12)
    plain = actions.as_plain(start, target, nothing(actions, 4)).reshape(4, 3, 3)
    amplitude = np.array(
        [
            rotations.angle_between_directions(*rotations.gaze(np.stack(p)))
            for p in zip(start.orientation, target, strict=True)
        ]
    )
    B = np.clip(200 * amplitude**-0.6, 12, 120)
    np.testing.assert_allclose(plain[:, :, 0], np.repeat(B[:, None], 3, axis=1), rtol=1e-9)
    np.testing.assert_allclose(plain[:, :, 1], fixate(plant, rotations.gaze(target))[1], atol=5e-3)
    np.testing.assert_allclose(plain[:, :, 2], np.tile(plant.motor_rates(), (4, 1)), rtol=1e-9)
    command = actions.command(start, target, nothing(actions, 4))
    np.testing.assert_allclose(plant.rest(command.final), target, atol=2e-4)


def test_the_usual_command_of_another_rule_ends_with_its_torsion() -> None:
    for rule, torsion in (("fick", listing.ficks_torsion), ("listing", lambda gaze: np.zeros(len(gaze)))):
        task, actions = task_of("tavares", rule), actions_of("tavares", rule)
        start, target = saccades(task.targets, START, TARGET)
        ends = made("tavares").rest(actions.command(start, target, nothing(actions, 4)).final)
        gaze = rotations.gaze(target)
        np.testing.assert_allclose(rotations.gaze(ends), gaze, atol=1e-4)
        np.testing.assert_allclose(listing.torsion(ends), torsion(gaze), atol=0.01)


@settings(max_examples=50, deadline=None)
@given(st.data())
def test_bounds_are_never_left(data: st.DataObject) -> None:
    """Whatever a network says, and wherever the saccade goes: commands stay inside B 12..120, k0 2..60, D +-40."""
    actions = actions_of("modal")
    scaled = np.array([data.draw(st.lists(st.floats(-3, 3), min_size=9, max_size=9))])
    angles = [data.draw(st.tuples(st.floats(0, 49), st.floats(0, 2 * np.pi))) for _ in range(2)]
    start, target = (
        listing.with_torsion(listing.directions([away * np.cos(around)], [away * np.sin(around)]), [torsion])
        for (away, around), torsion in zip(angles, (data.draw(st.floats(-2, 2)), 0.0), strict=True)
    )
    action = actions.from_unit(scaled)
    np.testing.assert_allclose(action, np.clip(action, actions.low, actions.high), rtol=1e-12)
    begin = State(start, made("modal").hold(start, ALL))
    plain = actions.as_plain(begin, target, action)
    assert (actions.plain.low <= plain).all()
    assert (plain <= actions.plain.high).all()
    np.testing.assert_allclose(actions.plain.low.reshape(3, 3), [[12, -40, 2]] * 3)
    np.testing.assert_allclose(actions.plain.high.reshape(3, 3), [[120, 40, 60]] * 3)


def test_the_ends_of_the_box() -> None:
    actions = actions_of("tavares")
    assert actions.names[:4] == ("B_ratio_motor1", "D_shift_motor1", "k0_ratio_motor1", "B_ratio_motor2")
    ends = actions.from_unit([[-1.0] * 9, [1.0] * 9]).reshape(2, 3, 3)
    np.testing.assert_allclose(ends[:, :, 0], np.exp([[-0.6] * 3, [0.6] * 3]))
    np.testing.assert_allclose(ends[:, :, 2], np.exp([[-0.4] * 3, [0.4] * 3]))
    # The horizontal motor turns the eye by 4.5 deg, the other two together by twice that, less what is not linear.
    motor = np.zeros((2, 3))
    motor[0, 1], motor[1, [0, 2]] = ends[1, 1, 1], ends[1, [0, 2], 1]
    turned = rotations.angle_between(made("tavares").rest(motor), rotations.FORWARD)
    assert turned == pytest.approx([4.5, 2 * 9.0], rel=0.02)


def test_shares_multiply_and_shifts_add() -> None:
    task, actions = task_of("tavares"), actions_of("tavares")
    start, target = saccades(task.targets, [[0.0, 0.0]], [[15.0, -10.0]])
    usual = actions.as_plain(start, target, nothing(actions, 1))
    other = actions.as_plain(start, target, np.array([[1.2, 1.0, 0.9, 0.8, -2.0, 1.1, 1.0, 0.5, 1.3]]))
    np.testing.assert_allclose((other / usual).reshape(3, 3)[:, [0, 2]], [[1.2, 0.9], [0.8, 1.1], [1.0, 1.3]])
    np.testing.assert_allclose((other - usual).reshape(3, 3)[:, 1], [1.0, -2.0, 0.5])


def test_the_same_command_told_plainly_is_worth_the_same() -> None:
    task = task_of("tavares")
    start, target = task.targets.draw(6, np.random.default_rng(0))
    action = task.actions.from_unit(np.random.default_rng(1).uniform(-1, 1, (6, 9)))
    one = task.perform(start, action, target)
    other = task.plain.perform(start, task.actions.as_plain(start, target, action), target)
    np.testing.assert_array_equal(one.reward.total, other.reward.total)
    assert task.plain.actions is task.actions.plain
    plain = task.plain
    assert plain.plain is plain


def test_only_what_ends_on_the_target_is_likely() -> None:
    likely = actions_of("modal").likely(np.tile(rotations.FORWARD, (2, 1))).reshape(2, 3, 3)
    assert (likely[:, :, 1] == 0).all()
    assert np.isnan(likely[:, :, [0, 2]]).all()


@pytest.mark.parametrize("rule", [None, "fick"])
def test_an_identity_restores_the_actions(rule: str | None) -> None:
    actions = actions_of("tavares", rule)
    again = restore_actions(task_of("tavares", rule).identity()["actions"], made("tavares"))
    assert again.identity() == actions.identity()
    start, target = saccades(task_of("tavares").targets, START, TARGET)
    np.testing.assert_array_equal(
        again.as_plain(start, target, nothing(actions, 4)), actions.as_plain(start, target, nothing(actions, 4))
    )


def test_what_is_refused() -> None:
    with pytest.raises(InputError, match="choose targets about one axis"):
        ResidualActions(make_plant("lpf"), ("motor2",))
    with pytest.raises(InputError, match="got 'donders'"):
        ResidualActions(made("modal"), ALL, rule="donders")  # type: ignore[arg-type]  # as a stranger's file may have it
    with pytest.raises(InputError, match="unknown pulse"):
        ResidualActions(made("modal"), ALL, pulse="17")
