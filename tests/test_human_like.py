"""The inverse problem, the judge that it found, and the policy that was trained by it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from orient_eye.errors import InputError
from orient_eye.human import people
from orient_eye.learning.figures.saccades import Saccades
from orient_eye.learning.policy import Policy
from orient_eye.movement.velocity_threshold import above
from orient_eye.plants.linear import LinearPlant
from orient_eye.report.likeness import Likeness
from orient_eye.search import human_like
from orient_eye.search.human_like import nearest
from orient_eye.search.optimum import find_optimum
from orient_eye.task.cases import Case
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

WIDE = Case("1", B=(18.0, 300.0))


def test_the_impatient_judge_discounts_time_at_ten_a_second() -> None:
    task = SaccadeTask.of_case(LinearPlant(), "human")
    start, target = saccades(task.targets, [[0.0]], [[10.0]])
    outcome = task.perform(start, np.array([[100.0, 10 / 1.4758, 17.5]]), target)
    t = outcome.measures.settling_time_s
    assert outcome.reward.terms["duration"] == pytest.approx(-10 * t / (1 + 10 * t))
    usual = SaccadeTask.of_case(LinearPlant(), "1").perform(start, np.array([[60.0, 6.8, 17.5]]), target)
    t = usual.measures.settling_time_s
    assert usual.reward.terms["duration"] == pytest.approx(-0.6 * t / (1 + 0.6 * t))


def test_weights_are_found_again_from_the_main_sequence_of_their_best_saccades(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(human_like, "_SEARCHES", 9)
    monkeypatch.setattr(human_like, "_FACTORS", (2.0, 40.0))
    plain = SaccadeTask.of_case(LinearPlant(), WIDE)
    heavy = {name: value * (1 if name == "energy" else 8) for name, value in plain.weights.items()}
    made = SaccadeTask.of_case(LinearPlant(), WIDE, weights=heavy)
    start, target = saccades(made.targets, *made.targets.symmetric(np.array([10.0])))
    best = find_optimum(made, start, target, np.random.default_rng(3)).action
    bout = above(made.perform(start, best, target).movement.trajectory())
    wanted: Any = SimpleNamespace(
        peak_velocity=lambda a: bout.peak_velocity_deg_s, duration_ms=lambda a: 1e3 * bout.duration_s
    )
    found = nearest(plain, wanted, np.random.default_rng(0), (10.0,))
    assert found.factor == pytest.approx(8, rel=0.1)
    assert found.peak_velocity == pytest.approx(1, abs=0.02)
    assert found.off < 0.2
    assert found.prevents.startswith("nothing")


def test_what_keeps_saccades_from_being_nearer_is_said() -> None:
    task = SaccadeTask.of_case(LinearPlant(), WIDE)
    at = np.array([5.0, 10.0, 20.0])

    def told(velocity: list[float], duration: list[float], B: float) -> str:
        action = np.array([[B, 5.0, 17.5]] * 3)
        found = human_like.Nearest(task, 1.0, at, np.array(velocity), np.array(duration), at, action, 4000.0)
        return found.prevents

    assert "does not level off" in told([0.8, 1.0, 1.25], [1.0, 1.0, 1.0], 100.0)
    assert told([0.8, 1.0, 1.0], [1.0, 1.0, 1.0], 300.0) == "B at its bound"
    assert "tail" in told([1.0, 1.0, 1.0], [1.0, 1.0, 1.6], 100.0)


def test_main_sequences_are_compared_about_one_axis_and_inside_the_range() -> None:
    task = SaccadeTask.of_case(LinearPlant(), WIDE)
    with pytest.raises(InputError, match="no saccade of 90 deg around straight ahead; compare smaller ones"):
        nearest(task, people(), np.random.default_rng(0), (90.0,))


def test_the_human_policy_is_as_fast_and_as_long_as_people() -> None:
    """Within 10 % of the peak velocity and 20 % of the duration above 30 deg/s, from 5 to 20 deg."""
    policy, human = Policy.load("lpf-human"), people()
    made = Saccades.symmetric(policy.task(), policy, np.arange(5.0, 20.5, 1.0))
    bout = above(made.trajectory)
    velocity = bout.peak_velocity_deg_s / human.peak_velocity(made.size_deg)
    duration = 1e3 * bout.duration_s / human.duration_ms(made.size_deg)
    assert np.abs(velocity - 1).max() < 0.1
    assert np.abs(duration - 1).max() < 0.2


def test_a_policy_is_told_within_other_bounds() -> None:
    policy, task = Policy.load("lpf-1"), Policy.load("mujoco-1").task()
    told = policy.within(task, np.random.default_rng(0))
    assert told.within(task, np.random.default_rng(1)) is told
    start, target = task.targets.draw(200, np.random.default_rng(5))
    here, there = (each.act(start.orientation, target) for each in (told, policy))
    assert (here >= task.actions.low).all()
    assert (here <= task.actions.high).all()
    np.testing.assert_allclose(here[:, [0, 2]], there[:, [0, 2]], rtol=1e-6)
    inside = np.clip(there[:, 1], task.actions.low[1], task.actions.high[1])
    assert np.sqrt(np.mean((here[:, 1] - inside) ** 2)) < 0.5


def test_the_verdict_says_where_saccades_are_like_those_of_people() -> None:
    def verdict(velocity: list[float], duration: list[float]) -> str:
        fit: Any = None
        told = np.array(velocity), np.array(duration), np.array([0.3, 0.25, 0.2]), np.zeros(3)
        return Likeness("x", fit, *told).verdict

    assert verdict([1, 1, 1], [1, 1, 1.05]).startswith("as fast as people; as long as people; accelerates for 0.25")
    assert verdict([1, 0.8, 1], [1, 1, 1]).startswith("nearly as fast as people; as long")
    assert verdict([0.4, 0.5, 1], [1, 1, 2.0]).startswith("0.4 times as fast as people at 5 deg; 2 times as long")
    assert verdict([0.4, 0.5, np.nan], [1, 1, np.nan]).startswith("0.4 times as fast as people at 5 deg; as long")
