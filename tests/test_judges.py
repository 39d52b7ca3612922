"""Other people's programs find our saccades, sampled at 500 Hz with noise, and agree how large and fast they are."""

from functools import cache

import numpy as np
import pytest

from orient_eye.exchange.record import EyeRecord, recorded
from orient_eye.movement.trajectory import Trajectory
from outside_judges import JUDGES, Events, Judgement, judged, of_policy

SIZES = np.array([3.0, 5, 10, 20, 30])
POLICIES = ("lpf-1", "lpf-human", "tavares-gaze", "six-gaze")


@cache
def made(policy: str) -> tuple[Trajectory, EyeRecord]:
    trajectory = of_policy(policy, SIZES)
    return trajectory, recorded(trajectory, 500.0)


def judge(name: str, policy: str) -> Judgement:
    for package in ("pymovements", "remodnav"):
        if package in name.lower():
            pytest.importorskip(package)
    trajectory, record = made(policy)
    return judged(JUDGES[name](record.gaze(0.02, np.random.default_rng(0))), record, trajectory)


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("name", JUDGES)
def test_every_saccade_is_found_with_our_amplitude_and_peak_velocity(name: str, policy: str) -> None:
    found = judge(name, policy)
    assert found.found == 1
    assert found.others <= 2
    assert ((found.amplitude > 0.7) & (found.amplitude < 1.03)).all(), "above a threshold the eye goes less than all"
    assert (found.amplitude[2:] > 0.9).all()
    assert ((found.peak_velocity > 0.8) & (found.peak_velocity < 1.08)).all()
    if "30 deg/s" in name or "samples" in name:
        assert ((found.duration > 0.85) & (found.duration < 1.35)).all(), "by the same threshold"
    else:
        assert (found.duration > 1.1).all(), "by lower thresholds saccades last longer"


def test_a_judgement_counts_what_is_missed_and_what_is_no_saccade() -> None:
    trajectory, record = made("lpf-1")
    first = record.starts_s[0] + 0.01
    events = Events(*np.array([[first, first + 0.02, 3.0, 100.0], [0.01, 0.05, 1.0, 40.0]]).T)
    found = judged(events, record, trajectory)
    assert (found.found, found.others) == (0.2, 1)
    assert found.amplitude[0] == pytest.approx(3 / np.ptp(trajectory.yaw_deg[0, [0, -1]]))
    assert found.duration[0] < 1
    assert np.isnan(found.amplitude[1:]).all()
    none = judged(Events(*np.empty((4, 0))), record, trajectory)
    assert (none.found, none.others) == (0, 0)
