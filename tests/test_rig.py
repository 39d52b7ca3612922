"""The description of a rig: TOML and back, degrees and the driver's numbers and back, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orient_eye.errors import InputError
from orient_eye.plants.limited_motor import peaks
from orient_eye.rig import AXES, Rig, RigMotor, to_toml
from orient_eye.sysid.plan import REST_S, SHARES, plan_steps, write_plan
from orient_eye.tables import read_table

NAMES = st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), min_size=1, max_size=12)
SIZES = st.floats(0.01, 1e4)


@st.composite
def motors(draw: st.DrawFn, name: str) -> RigMotor:
    unit = draw(st.sampled_from(["deg", "rad", "counts"]))
    reach = draw(st.one_of(st.none(), st.tuples(st.floats(-400, -1), st.floats(1, 400))))
    return RigMotor(
        name,
        unit,
        counts_per_deg=draw(SIZES) if unit == "counts" else None,
        zero=draw(st.floats(-1e4, 1e4)),
        sign=draw(st.sampled_from([1, -1])),
        range=(-np.inf, np.inf) if reach is None else reach,
        speed_limit=draw(st.one_of(st.none(), SIZES)),
        acceleration_limit=draw(st.one_of(st.none(), SIZES)),
    )


@st.composite
def rigs(draw: st.DrawFn) -> Rig:
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    weights = st.floats(-5, 5).filter(lambda c: abs(c) > 0.01)
    drives = st.dictionaries(st.sampled_from(names), weights, min_size=1)
    axes = draw(st.dictionaries(st.sampled_from(AXES), drives, min_size=1))
    rate = draw(st.floats(1, 1e5))
    return Rig(draw(NAMES), tuple(draw(motors(n)) for n in names), axes, rate, draw(NAMES))


@settings(max_examples=60, deadline=None)
@given(rig=rigs())
def test_a_rig_is_the_same_after_its_file(rig: Rig, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = rig.save(tmp_path_factory.mktemp("rig") / "rig.toml")
    assert Rig.load(path) == rig
    assert Rig.from_plain(rig.to_plain(), "here") == rig


@settings(max_examples=60, deadline=None)
@given(rig=rigs(), drive=st.lists(st.floats(-100, 100), min_size=1, max_size=5))
def test_a_drive_is_the_same_after_the_drivers_numbers(rig: Rig, drive: list[float]) -> None:
    for axis in rig.axes:
        columns = rig.to_driver(axis, np.array(drive))
        assert set(columns) == {motor.column for motor in rig.motors}
        np.testing.assert_allclose(rig.from_driver(axis, columns), drive, rtol=1e-6, atol=1e-6)


def test_a_drive_is_spread_by_the_least_movement() -> None:
    """Of all motor positions that make the drive, the shortest: the pseudo-inverse."""
    weights = {"a": 1.0, "b": -2.0, "c": 0.5}
    rig = Rig("three", tuple(RigMotor(name) for name in weights), {"roll": weights})
    shares = rig.shares("roll")
    matrix = np.array([list(weights.values())])
    np.testing.assert_allclose(list(shares.values()), np.linalg.pinv(matrix)[:, 0])
    assert rig.drive_name("roll") == "a - 2 b + 0.5 c"


def test_limits_of_a_drive_are_those_of_the_motor_that_is_first_at_its_own() -> None:
    left = RigMotor("left", range=(-10, 40), speed_limit=100)
    right = RigMotor("right", range=(-30, 20), speed_limit=350, acceleration_limit=9000)
    drive = Rig("two", (left, right), {"pitch": {"left": 1.0, "right": -1.0}}).drive("pitch")
    assert drive.range == (-20, 60)  # left = u / 2, right = -u / 2
    assert (drive.speed_limit, drive.acceleration_limit) == (200, 18000)


def test_the_shipped_prototype() -> None:
    rig = Rig.load("prototype")
    drive = rig.drive("pitch")
    assert drive.speed_limit == 2 * 349.0
    down = rig.to_driver("pitch", np.array([0.0, 20.0]))
    np.testing.assert_allclose(down["motor1_counts"], [512, 512 - 10 * 1024 / 90])
    np.testing.assert_allclose(down["motor3_counts"], [512, 512 + 10 * 1024 / 90])
    np.testing.assert_allclose(down["motor2_counts"], 512)


GOOD = """
[[motors]]
name = "servo"
unit = "counts"
counts_per_deg = 10.0
range = [-60.0, 60.0]
[axes]
yaw = { servo = 1.0 }
"""
BAD: dict[str, tuple[str, str]] = {
    "a unit": (GOOD.replace('"counts"', '"turns"'), "deg, rad or counts, got 'turns'"),
    "counts without size": (GOOD.replace("counts_per_deg = 10.0", ""), "counts_per_deg belongs to"),
    "size without counts": (GOOD.replace('unit = "counts"', ""), "counts_per_deg belongs to"),
    "counts that go back": (GOOD.replace("10.0", "-10.0"), "sign says the direction"),
    "a sign": (GOOD.replace("[axes]", "sign = 2\n[axes]"), "sign is 1 or -1, got 2"),
    "a range that is none": (GOOD.replace("-60.0, 60.0", "60.0, -60.0"), "from low to high"),
    "a range of one": (GOOD.replace("[-60.0, 60.0]", "60.0"), r"is \[low, high\] in deg"),
    "a limit of nothing": (GOOD.replace("[axes]", "speed_limit = 0\n[axes]"), "speed_limit is positive, or left out"),
    "a word for a limit": (GOOD.replace("[axes]", 'speed_limit = "fast"\n[axes]'), "describes no rig"),
    "an unknown key": (GOOD.replace("[axes]", "speed = 3\n[axes]"), "got .*'speed'"),
    "an unknown key above": ("colour = 1\n" + GOOD, r"unknown keys \['colour'\]"),
    "a motor without name": (GOOD.replace('name = "servo"', ""), "a motor has a name"),
    "an unknown motor": (GOOD.replace("servo = 1.0", "other = 1.0"), "names motors among servo"),
    "an unknown axis": (GOOD.replace("yaw =", "tilt ="), "yaw, pitch or roll"),
    "a weight of 0": (GOOD.replace("servo = 1.0", "servo = 0.0"), "finite and not 0"),
    "no axis": (GOOD.split("[axes]", maxsplit=1)[0], "turns no axis"),
    "no motor": ("[axes]\nyaw = { servo = 1.0 }\n", "needs motors"),
    "a motor twice": (GOOD + GOOD.split("[axes]", maxsplit=1)[0], "each with a name of its own"),
    "a rate": ("command_rate_hz = 0\n" + GOOD, "between 1 and 100000"),
    "no TOML": ("motors: servo", "give a TOML file"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_what_describes_no_rig_is_refused_with_the_reason(what: str, tmp_path: Path) -> None:
    text, words = BAD[what]
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        Rig.load(path)


def test_what_is_asked_of_a_rig_that_it_has_not() -> None:
    rig = Rig("one", (RigMotor("servo"),), {"yaw": {"servo": 1.0}})
    with pytest.raises(InputError, match="turns yaw, not pitch"):
        rig.drive("pitch")
    with pytest.raises(InputError, match="needs the columns servo_deg"):
        rig.from_driver("yaw", {"other_deg": np.zeros(3)})
    with pytest.raises(InputError, match="shipped rig: prototype"):
        Rig.load("none.toml")


def test_what_is_not_known_is_a_comment() -> None:
    text = to_toml(Rig("one", (RigMotor("servo"),), {"yaw": {"servo": 1.0}}))
    for key in ("range", "speed_limit", "acceleration_limit"):
        assert any(line.startswith(f"# {key} = ") for line in text.splitlines())


# --- the plan -------------------------------------------------------------------------------------------


def planned(**limits: Any) -> Rig:
    left = RigMotor("left", "counts", 11.4, zero=512, range=(-40, 40), **limits)
    right = RigMotor("right", "rad", sign=-1, range=(-50, 50), **limits)
    return Rig("two", (left, right), {"pitch": {"left": 1.0, "right": -1.0}}, command_rate_hz=200)


@pytest.mark.parametrize("limits", [{}, {"speed_limit": 300.0}, {"speed_limit": 300.0, "acceleration_limit": 9000.0}])
def test_planned_steps_keep_the_limits_in_the_drivers_units(limits: dict[str, float], tmp_path: Path) -> None:
    rig = planned(**limits)
    steps = plan_steps(rig, "pitch")
    assert [s.amplitude_deg for s in steps] == [s * round(share * 80, 1) for share in SHARES for s in (1, -1)]
    assert len({s.until_s for s in steps}) == 1  # one --until cuts all of their recordings
    files = write_plan(steps, rig, "pitch", tmp_path)
    for step, file in zip(steps, files, strict=False):
        table = read_table(tmp_path / file, "")
        for motor in rig.motors:
            degrees = motor.from_driver(table[motor.column])
            assert degrees[table["t_s"] < REST_S - 1e-9] == pytest.approx(0, abs=1e-9)
            assert degrees[-1] == pytest.approx(0, abs=1e-9)
            end = rig.shares("pitch")[motor.name] * step.amplitude_deg
            assert np.interp(step.until_s, table["t_s"], degrees) == pytest.approx(end, abs=0.05)
            assert motor.range[0] <= degrees.min() < degrees.max() <= motor.range[1]
        drive = rig.from_driver("pitch", {m.column: table[m.column] for m in rig.motors})
        np.testing.assert_allclose(drive, step.drive, atol=0.5 / 11.4 + 1e-6)  # counts are whole
        speed, acceleration = (peak[0, 0] for peak in peaks(step.drive[None, :, None], 1 / 200))
        if limits:
            assert speed < 600
            assert speed > 0.8 * 600 or acceleration > 0.8 * 18000
        if "acceleration_limit" in limits:
            assert acceleration < 18000


def test_a_plan_rests_in_the_middle_of_a_range_that_begins_at_0() -> None:
    rig = Rig("one", (RigMotor("servo", range=(0, 80)),), {"yaw": {"servo": 1.0}})
    steps = plan_steps(rig, "yaw")
    assert steps[0].drive[0] == 40
    assert (min(s.drive.min() for s in steps), max(s.drive.max() for s in steps)) == (20, 60)


def test_no_plan_without_a_range() -> None:
    with pytest.raises(InputError, match="says no range of the motors of yaw"):
        plan_steps(Rig("one", (RigMotor("servo"),), {"yaw": {"servo": 1.0}}), "yaw")
