"""Motors with limits: what they may never do, on every plant, and in the language of a rig's driver."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from orient_eye.cli.another_plant import AnotherPlant
from orient_eye.cli.evaluate import Evaluate
from orient_eye.cli.optimum import Optimum
from orient_eye.cli.options import parse
from orient_eye.cli.predict import Predict
from orient_eye.cli.problem import Problem
from orient_eye.cli.saccades import Saccades
from orient_eye.cli.simulate import Simulate
from orient_eye.commands.motor_file import read_command
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.learning.config import TrainConfig
from orient_eye.motor import Motor, rests
from orient_eye.plants import make_plant, restore_plant
from orient_eye.plants.limited_motor import follow, peaks
from orient_eye.plants.limits import wiring
from orient_eye.plants.linear import LinearPlant
from orient_eye.rig import Rig, RigMotor
from orient_eye.surrogate import Surrogate
from orient_eye.tables import read_table
from orient_eye.task.actions import restore_actions
from orient_eye.task.saccade import SaccadeTask
from test_policy_commands import sensible_policy

Array = NDArray[np.float64]
SIX = ("IR", "MR", "SR", "LR", "IO", "SO")
STEP = 0.001
SLACK = 1 + 1e-6
settings.register_profile("limits", deadline=None, max_examples=60, derandomize=True)
settings.load_profile("limits")


def motor(speed: float | None = None, acceleration: float | None = None) -> Motor:
    return Motor("m", "deg", (-90, 90), (-90, 90), speed, acceleration)


speeds = st.floats(20, 2000)
accelerations = st.floats(500, 1e6)
limits = st.tuples(st.none() | speeds, st.none() | accelerations)
seeds = st.integers(0, 2**32 - 1)


def told(seed: int, saccades: int = 3, samples: int = 400, motors: int = 1) -> Array:
    """Steps, ramps, swings and noise, then the last position held; from 0."""
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(samples)
    path = np.zeros((saccades, samples, motors))
    for which in np.ndindex(saccades, motors):
        line = rng.choice([0.0, 3.0]) * np.sin(rng.uniform(5, 60) * t)
        for _ in range(rng.integers(1, 4)):
            size, at, rate = rng.uniform(-30, 30), rng.uniform(0, 0.15), rng.uniform(5, 200)
            line = line + size * (1 - np.exp(-rate * np.maximum(t - at, 0))) + rng.choice([0, size]) * (t > at)
        path[which[0], :, which[1]] = line
    path[:, 200:] = path[:, 200:201]
    path[:, 0] = 0
    return path


# --- follow ---------------------------------------------------------------------------------------


@given(seeds, limits)
def test_no_limit_is_ever_broken(seed: int, limit: tuple[float | None, float | None]) -> None:
    path, _ = follow(told(seed), [motor(*limit)], STEP)
    fastest, hardest = peaks(path, STEP)
    assert (fastest <= (limit[0] or np.inf) * SLACK).all()
    assert (hardest <= (limit[1] or np.inf) * SLACK + 1e-4).all()


@given(seeds, limits)
def test_a_command_within_the_limits_is_followed_to_the_bit(
    seed: int, limit: tuple[float | None, float | None]
) -> None:
    within, _ = follow(told(seed), [motor(*limit)], STEP)
    fastest, hardest = peaks(within, STEP)
    wider = [motor(fastest.max() * SLACK + 1e-3, hardest.max() * SLACK + 1e-3)]
    path, changed = follow(within, wider, STEP)
    assert not changed.any()
    np.testing.assert_array_equal(path, within)


@given(seeds, limits)
def test_a_held_command_is_reached(seed: int, limit: tuple[float | None, float | None]) -> None:
    command = told(seed)
    speed, acceleration = limit[0] or 1e9, limit[1] or 1e9
    way = 4 * np.abs(command).max()
    lasts = 0.2 + way / speed + 4 * np.sqrt(way / acceleration) + 2 * speed / acceleration * (limit[0] is not None)
    longer = np.concatenate([command, np.repeat(command[:, -1:], int(lasts / STEP), axis=1)], axis=1)
    path, _ = follow(longer, [motor(*limit)], STEP)
    np.testing.assert_array_equal(path[:, -1], command[:, -1])


@given(st.floats(1, 60), speeds, st.floats(1, 10), st.none() | accelerations)
def test_a_larger_limit_is_nowhere_behind(size: float, speed: float, more: float, acceleration: float | None) -> None:
    command = np.full((1, 3000, 1), size)
    command[:, 0] = 0
    slow, _ = follow(command, [motor(speed, acceleration)], STEP)
    fast, _ = follow(command, [motor(speed * more, acceleration)], STEP)
    step = (acceleration or 0) * STEP**2  # braking comes in steps of it
    assert (fast >= slow - 0.13 * step - 1e-9).all()
    assert slow.max() <= size + 0.13 * step + 1e-9  # and never beyond


@given(seeds, limits)
def test_saccades_do_not_touch_each_other(seed: int, limit: tuple[float | None, float | None]) -> None:
    command = told(seed, saccades=4, motors=2)
    command[1] *= 1e-3
    motors = [motor(*limit), motor(300.0)]
    path, changed = follow(command, motors, STEP)
    for k in range(len(command)):
        alone, own = follow(command[k : k + 1], motors, STEP)
        np.testing.assert_array_equal(path[k : k + 1], alone)
        assert changed[k] == own[0]


def test_the_step_of_a_motor_with_both_limits_is_the_trapezoid() -> None:
    """Accelerate, cruise, brake: 30 deg at 300 deg/s and 10000 deg/s^2 take 30 / 300 + 300 / 10000 s."""
    command = np.full((1, 300, 1), 30.0)
    command[:, 0] = 0
    path, changed = follow(command, [motor(300.0, 1e4)], STEP)
    t = STEP * np.arange(300)
    exact = np.interp(t, [0, 0.13], [0, 30])
    up, down = t < 0.03, (t > 0.1) & (t < 0.13)
    exact[t >= 0.03] = 4.5 + 300 * (t[t >= 0.03] - 0.03)
    exact[up] = 5e3 * t[up] ** 2
    exact[down] = 30 - 5e3 * (0.13 - t[down]) ** 2
    exact[t >= 0.13] = 30
    assert changed.all()
    np.testing.assert_allclose(path[0, :, 0], exact, atol=0.3)  # a sample's way


# --- plants ---------------------------------------------------------------------------------------


def independent_motor(command: PulseStep, k: int, speed: float) -> tuple[Array, Array]:
    """A motor that goes after a command at most so fast, in steps of 10 us: times and positions."""
    h = 1e-5
    t = h * np.arange(100_001)
    wanted = command.position(t)[k, :, 0]
    at = np.empty_like(wanted)
    x = at[0] = wanted[0]
    for i in range(1, len(t)):
        x += min(max(wanted[i] - x, -speed * h), speed * h)
        at[i] = x
    return t, at


@pytest.mark.parametrize("numbers", [{"w0": 17.5}, {"wn": 12.0, "zeta": 0.9, "dead_time": 0.008}])
def test_a_limited_surrogate_against_an_integrator(numbers: dict[str, float]) -> None:
    plant = LinearPlant(Surrogate(1.6, motor="m", speed_limit=350.0, range=(-60, 60), **numbers))
    command = PulseStep(
        *(np.array(x)[:, None] for x in ([0.0, -5.0], [70.0, 40.0], [15.0, 12.0], [3.0, 8.0])),
    )
    movement = plant.move(command)
    assert movement.limited.all()
    trajectory = movement.trajectory()
    for k in range(2):
        t, path = independent_motor(command, k, 350.0)
        late = numbers.get("dead_time", 0.0)

        def moving(now: float, state: Array, t: Array = t, path: Array = path, late: float = late) -> list[float]:
            told = np.interp(now - late, t, path)
            if "w0" in numbers:
                return [numbers["w0"] * (1.6 * told - state[0]), 0.0]
            wn, zeta = numbers["wn"], numbers["zeta"]
            return [state[1], wn**2 * (1.6 * told - state[0]) - 2 * zeta * wn * state[1]]

        found = solve_ivp(
            moving, (0, 0.5), [1.6 * path[0], 0.0], t_eval=trajectory.time[:501], max_step=1e-3, rtol=1e-8
        )
        np.testing.assert_allclose(
            trajectory.yaw_deg[k, :501], found.y[0], atol=0.05
        )  # a sample's way where it catches up
        energy = np.sum(np.diff(path) ** 2) / 1e-5
        assert movement.energy()[k] == pytest.approx(energy, rel=0.02)
        assert movement.energy()[k] < 0.9 * command.energy()[k]


@pytest.mark.parametrize("name", ["mujoco", "tavares"])
def test_a_limited_eye_is_the_eye_under_the_limited_path(name: str) -> None:
    limited, free = make_plant(name, rig="prototype"), make_plant(name)
    rng = np.random.default_rng(0)
    command = PulseStep(*(rng.uniform(low, high, (3, 3)) for low, high in ((-5, 5), (30, 70), (-12, 12), (6, 20))))
    movement = limited.move(command, horizon_s=0.4)
    assert movement.limited.any()
    trajectory = movement.trajectory()
    again = free.move(trajectory.motor).trajectory()
    np.testing.assert_array_equal(trajectory.orientation, again.orientation)
    np.testing.assert_array_equal(trajectory.tension, again.tension)
    np.testing.assert_allclose(movement.energy(), (np.diff(trajectory.motor, axis=1) ** 2).sum(axis=(1, 2)) / STEP)
    assert (peaks(trajectory.motor, STEP)[0] <= 349 * SLACK).all()


@pytest.mark.parametrize(
    "plant",
    [
        LinearPlant(rig="prototype"),
        LinearPlant(Surrogate(1.9, wn=12.0, zeta=1.3, dead_time=0.0083, speed_limit=350.0, acceleration_limit=2e4)),
        make_plant("mujoco", rig="prototype"),
    ],
    ids=["first order", "second order", "mujoco"],
)
def test_a_batch_gives_each_saccade_what_it_has_alone(plant: Any) -> None:
    """Some limited and some not: to the bit."""
    motors = len(plant.motors)
    rng = np.random.default_rng(1)
    size = np.array([0.5, 20, 1, 30, 0.1, 12.0])[:, None] * np.ones(motors)
    command = PulseStep(0 * size, rng.uniform(30, 60, size.shape), size, rng.uniform(10, 20, size.shape))
    whole = plant.move(command)
    assert whole.limited.any()
    assert not whole.limited.all()
    measured, energy, trajectory = whole.measure(), whole.energy(), whole.trajectory()
    for k in range(len(size)):
        alone = plant.move(command[np.array([k])])
        for field in ("settling_time_s", "peak_velocity_deg_s", "overshoot", "final", "at_settling"):
            one, other = getattr(measured, field)[k], getattr(alone.measure(), field)[0]
            if motors == 1:
                np.testing.assert_array_equal(one, other, err_msg=field)
            else:  # where it rests is found by Newton's method, whose last digit is the batch's
                np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12, err_msg=field)
        assert energy[k] == alone.energy()[0]
        assert whole.limited[k] == alone.limited[0]
        for field in ("orientation", "motor", "command"):
            np.testing.assert_array_equal(getattr(trajectory, field)[k], getattr(alone.trajectory(), field)[0])


def test_a_rig_limits_the_motors_of_its_names(tmp_path: Path) -> None:
    rig = Rig(
        "r", (RigMotor("motor2", range=(-90, 30), speed_limit=200.0, acceleration_limit=5e3),), {"yaw": {"motor2": 1}}
    )
    for name in ("mujoco", "tavares"):
        plant, free = make_plant(name, rig=rig.save(tmp_path / "r.toml")), make_plant(name)
        assert plant.motors[0] == free.motors[0]
        assert plant.motors[1] == Motor("motor2", "deg", (-80, 30), (-40, 30), 200.0, 5e3)
        assert str(tmp_path) not in json.dumps(plant.identity())
        again = restore_plant(json.loads(json.dumps(plant.identity())))
        assert (again.motors, again.identity()) == (plant.motors, plant.identity())
        assert again.pulse_rates == plant.pulse_rates
        assert plant.horizon_s == 1.1  # 0.5 s, and 70 deg at 200 deg/s with 2 sqrt(70 / 5000) s
        assert (free.horizon_s, free.pulse_rates, plant.slow_pole) == (0.5, None, None)
        assert "rig" not in free.identity()
    with pytest.raises(InputError, match="servo are none of plant 'mujoco', whose motors are motor1, motor2, motor3"):
        make_plant("mujoco", rig=Rig("r", (RigMotor("servo"),), {"yaw": {"servo": 1.0}}))
    with pytest.raises(InputError, match="rig 'r' turns yaw, not pitch"):
        LinearPlant(Surrogate(1.0, 10.0, axis="pitch"), rig=rig)


def test_a_rig_of_an_eye_under_pretension_has_its_motors_rest_inside_their_range() -> None:
    def rig(low: float, high: float) -> Rig:
        each = tuple(RigMotor(name, range=(low, high), speed_limit=2000.0) for name in SIX)
        return Rig("r", each, {"yaw": {"MR": 0.7, "LR": -0.7}, "pitch": {"IR": 1.0, "SR": -1.0, "IO": -1.0, "SO": 1.0}})

    free, plant = make_plant("tavares", eye="six"), make_plant("tavares", eye="six", rig=rig(0, 200))
    assert rests(plant.motors) == pytest.approx(rests(free.motors))
    assert {motor.working for motor in plant.motors} == {(0.0, 200.0)}
    begin = rests(plant.motors)
    told = np.tile(begin, (1, 300, 1))
    told[:, 1:, 1] += 15.0
    movement = plant.move(told)
    assert movement.limited.all()
    moved = movement.trajectory()
    np.testing.assert_allclose(moved.motor[0, :9, 1], begin[1] + np.minimum(2.0 * np.arange(9), 15.0), atol=1e-9)
    np.testing.assert_array_equal(free.move(moved.motor).trajectory().orientation, moved.orientation)
    assert wiring(plant, rig(0, 200)).motors == plant.motors
    with pytest.raises(InputError, match=r"'IR' go from -30 to 30 deg, but it stands at 57.84 .* a range around that"):
        make_plant("mujoco", eye="six", rig=rig(-30, 30))


def test_the_wiring_of_one_motor_that_rests_elsewhere() -> None:
    """Its axis is told by a degree from there: at 0 the cable of this one hangs slack and turns nothing."""

    class Slack(LinearPlant):
        def rest(self, motor: Array) -> Array:
            return super().rest(np.maximum(motor, 20.0))

    plant = Slack(Surrogate(1.5, 10.0, motor="MR", axis="pitch", rest=60.0))
    rig = Rig("r", (RigMotor("a"), RigMotor("b")), {"yaw": {"b": 1.0}, "pitch": {"a": 1.0}})
    assert wiring(plant, rig).axis == "pitch"


def test_the_pulse_rates_of_an_eye_lie_around_its_poles() -> None:
    """Stiffness over friction on the thesis' eye, heavily damped; the poles of eve_v3 as they are published."""
    thesis = make_plant("tavares", rig="prototype")
    assert thesis.rates() == pytest.approx([5.10, 12.78, 18.35], abs=0.05)  # type: ignore[attr-defined]
    eve = make_plant("mujoco", eye="eve_v3", rig="prototype")
    poles = np.abs([-21.0 + 5.9j, -23.2 + 7.1j, -25.3 + 25j])
    assert eve.rates() == pytest.approx(poles, abs=0.1)  # type: ignore[attr-defined]


def test_the_rig_inside_a_surrogate_counts_unless_another_is_given() -> None:
    inside = Rig(
        "in", (RigMotor("a", speed_limit=100.0), RigMotor("b", range=(-20, 20))), {"pitch": {"a": 1.0, "b": -1.0}}
    )
    surrogate = Surrogate(0.7, 15.0, motor="a - b", axis="pitch", rig=inside.to_plain())
    plant = LinearPlant(surrogate)
    assert plant.motors[0].range == (-40, 40)
    assert plant.motors[0].speed_limit == 200.0
    assert restore_plant(plant.identity()).motors == plant.motors
    other = Rig("other", (RigMotor("a", speed_limit=50.0), RigMotor("b", range=(-20, 20))), inside.axes)
    assert LinearPlant(surrogate, rig=other).motors[0].speed_limit == 100.0
    with pytest.raises(InputError, match="give the rig it was identified with"):
        LinearPlant(surrogate, rig=Rig("x", inside.motors, {"pitch": {"a": 1.0, "b": 1.0}}))


def test_without_a_rig_nothing_changes() -> None:
    assert make_plant("lpf").identity() == {"plant": "lpf", "K": 1.4758, "w0": 17.5, "motor": "motor2"}
    assert set(make_plant("mujoco").identity()) == {"plant", "eye", "accurate", "gravity", "model"}
    restored = restore_plant(make_plant("lpf", rig="prototype").identity())
    assert restored.surrogate.eye == "thesis"  # type: ignore[attr-defined]


# --- in the driver's language ---------------------------------------------------------------------

UNITS: dict[str, dict[str, Any]] = {
    "counts": {"unit": "counts", "counts_per_deg": 11.4, "zero": 512.0, "sign": -1},
    "deg": {"zero": 3.0},
    "rad": {"unit": "rad", "sign": -1},
}


def rig_of(unit: str, rate: float, *, axis: str = "yaw", acceleration: float | None = 2e4) -> Rig:
    """Two motors on an axis, unlike each other, and one on another."""
    both = {"range": (-50, 50), "acceleration_limit": acceleration, **UNITS[unit]}
    left, right = (RigMotor(name, speed_limit=limit, **both) for name, limit in (("left", 300.0), ("right", 400.0)))
    other = "roll" if axis == "pitch" else "pitch"
    return Rig("two", (left, right, RigMotor("lid")), {axis: {"left": 1.0, "right": -0.5}, other: {"lid": 1.0}}, rate)


@pytest.fixture
def policy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)

    def make(rig: Rig, **numbers: float) -> tuple[str, str, dict[str, Any]]:
        """Folder of a policy, the rig's file, and the options of its plant."""
        file = str(rig.save(tmp_path / "rig.toml"))
        numbers = numbers or {"wn": 14.0, "zeta": 0.8, "dead_time": 0.007}
        surrogate = Surrogate(1.5, motor=rig.drive_name("yaw"), rig=rig.to_plain(), **numbers)
        options = {"surrogate": str(surrogate.save(tmp_path / "surrogate.json")), "rig": file}
        task = SaccadeTask.of_case(make_plant("lpf", **options), "1", weights=(1.0, 1.0, 1.0, 1.0))
        return str(sensible_policy(task).save(tmp_path / "policy").parent), file, options

    return make


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("rate", [60.0, 100.0, 333.0, 1000.0, 4000.0])
def test_a_written_command_keeps_the_limits_and_comes_back(policy: Any, tmp_path: Path, unit: str, rate: float) -> None:
    rig = rig_of(unit, rate)
    folder, file, options = policy(rig)
    result = Predict(
        folder,
        Saccades((-8.0,), (17.0,)),
        command=tmp_path / "there.csv",
        back=tmp_path / "back.csv",
        another_plant=AnotherPlant(None, {"rig": file}),
    ).run()
    (row,), resolution = result["saccades"], 1.5 / 11.4 if unit == "counts" else 1e-6
    assert row["limited"]
    assert row["motor_speed_deg_s"] <= row["motor_speed_limit_deg_s"] * SLACK

    table = read_table(tmp_path / "there.csv", "")
    assert list(table.columns) == ["t_s", *(motor.column for motor in rig.motors)]
    np.testing.assert_allclose(np.diff(table["t_s"]), 1 / rate, rtol=1e-5)
    drive = 0.0
    for motor, coefficient in ((rig.motors[0], 1.0), (rig.motors[1], -0.5)):
        numbers = table[motor.column]
        degrees = (numbers - motor.zero) / motor.units_per_deg
        drive = drive + coefficient * degrees
        assert np.abs(degrees).max() <= 50 + 1e-9
        assert motor.speed_limit is not None
        assert motor.acceleration_limit is not None
        speed = np.diff(degrees) * rate
        counts = 2 / 11.4 * rate**2 if unit == "counts" else 0.0  # what rounding can add
        assert np.abs(speed).max() <= max(motor.speed_limit, counts / rate) * SLACK
        assert np.abs(np.diff(speed, prepend=0.0)).max() * rate <= motor.acceleration_limit * SLACK + counts + 1.0
        if unit == "counts":
            assert (numbers == np.round(numbers)).all()
        assert len(set(numbers[-2:])) <= 2
        np.testing.assert_allclose(degrees[-1], degrees[-2], atol=resolution + 1e-3)  # it stands
    np.testing.assert_allclose(table["lid_deg"], 0)
    assert drive[0] == pytest.approx(row["F_deg"], abs=resolution)
    assert drive[-1] == pytest.approx(row["D_deg"], abs=resolution)

    simulated = Simulate(tmp_path / "there.csv", "lpf", options, horizon=4.0, out=tmp_path / "there").run()
    assert simulated["final_yaw_pitch_roll_deg"][0] == pytest.approx(
        row["final_yaw_deg"], abs=max(0.05, 1.5 * resolution)
    )
    assert not simulated["saturated"]
    back = Simulate(tmp_path / "back.csv", "lpf", options, horizon=5.0, out=tmp_path / "back").run()
    assert back["final_yaw_pitch_roll_deg"][0] == pytest.approx(0, abs=max(0.05, 1.5 * resolution))
    told = result["written"][1]["motors"]["left"]
    assert told["peak_speed_deg_s"] <= 0.5 * 300 + 2 * resolution * rate
    assert not any(each["beyond_limits"] for each in result["written"]) or unit == "counts"


def test_a_way_back_is_the_smoothest_within_half_the_limits(policy: Any, tmp_path: Path) -> None:
    rig = rig_of("deg", 200.0, acceleration=100.0)
    folder, file, _ = policy(rig)
    result = Predict(
        folder, Saccades((0.0,), (17.0,)), back=tmp_path / "back.csv", another_plant=AnotherPlant(None, {"rig": file})
    ).run()
    table = read_table(tmp_path / "back.csv", "")
    left = table["left_deg"] - 3.0
    assert left[-1] == pytest.approx(0, abs=1e-9)
    assert left[0] == pytest.approx(result["saccades"][0]["D_deg"] / 1.25, abs=1e-6)
    s = table["t_s"] / table["t_s"][-1]
    np.testing.assert_allclose(left / left[0], 1 - (10 * s**3 - 15 * s**4 + 6 * s**5), atol=1e-9)
    hardest = np.abs(np.diff(left, 2)).max() * 200**2
    assert hardest == pytest.approx(50, rel=0.01)  # the smoothest that uses half of 100 deg/s^2


def test_a_batch_of_commands(policy: Any, tmp_path: Path) -> None:
    folder, file, _ = policy(rig_of("counts", 100.0))
    pairs = tmp_path / "pairs.csv"
    pairs.write_text("start_yaw_deg,target_yaw_deg\n0,10\n5,-5\n-3,12\n")
    rigged = AnotherPlant(None, {"rig": file})
    result = Predict(folder, Saccades(pairs=pairs), commands=tmp_path / "all", another_plant=rigged).run()
    with (tmp_path / "all" / "index.csv").open() as text:
        index = list(csv.DictReader(text))
    assert [row["file"] for row in index] == ["saccade-1.csv", "saccade-2.csv", "saccade-3.csv"]
    assert [float(row["target_yaw_deg"]) for row in index] == [10, -5, 12]
    assert len(result["written"]) == 3
    Predict(folder, Saccades((5.0,), (-5.0,)), command=tmp_path / "one.csv", another_plant=rigged).run()
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "all" / "saccade-2.csv").read_bytes()
    with pytest.raises(InputError, match="not an empty folder"):
        Predict(folder, Saccades(pairs=pairs), commands=tmp_path / "all", another_plant=rigged).run()
    with pytest.raises(InputError, match="--back writes the way back of one saccade"):
        Predict(folder, Saccades(pairs=pairs), back=tmp_path / "back.csv", another_plant=rigged).run()


def test_another_rig_has_to_be_forced(policy: Any, tmp_path: Path) -> None:
    folder, file, _ = policy(rig_of("deg", 100.0))
    arguments = [folder, "--target", "10", "--rig", file]
    assert parse(Predict, arguments).run()["differs_from_training"] == []
    rig_of("deg", 100.0, acceleration=None).save(file)  # the same but for a limit
    with pytest.raises(InputError, match="force"):
        parse(Predict, arguments).run()
    assert parse(Predict, [*arguments, "--force"]).run()["differs_from_training"]


def test_the_files_of_a_driver_are_checked(policy: Any, tmp_path: Path) -> None:
    rig = rig_of("counts", 100.0)
    _, _, options = policy(rig)
    plant = make_plant("lpf", **options)
    wired = wiring(plant, rig)

    def read(text: str) -> Array:
        (tmp_path / "c.csv").write_text(text)
        return read_command(tmp_path / "c.csv", plant.motors, wired).positions[:, 0]

    head = "t_s,left_counts,right_counts"
    # One deg of left and two of right the other way: u = 1 + 0.5 * 2.
    np.testing.assert_allclose(read(f"{head}\n0,512,512\n0.1,{512 - 11.4},{512 + 22.8}\n"), [0, 2], atol=1e-9)
    np.testing.assert_allclose(read(f"{head},lid_deg\n0,512,512,0\n0.1,512,512,0\n"), 0, atol=1e-9)
    for text, words in (
        ("t_s,left_counts\n0,512\n0.1,512\n", "has no right_counts"),
        (f"{head},lid_deg\n0,512,512,0\n0.1,512,512,5\n", "moves lid"),
        (f"{head},tau1_deg\n0,512,512,0\n0.1,512,512,0\n", "tau1_deg, which is no motor's"),
        (f"{head}\n0,512,512\n0.1,nan,512\n", "not a finite number"),
    ):
        with pytest.raises(InputError, match=words):
            read(text)


def test_a_command_beyond_the_speed_is_followed_and_said(
    policy: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = tmp_path / "c.csv"
    command.write_text("t_s,tau2_deg\n0,0\n0.01,10\n1,10\n")
    result = Simulate(command, "mujoco", {"rig": "prototype"}, out=tmp_path / "a").run()
    shown = capsys.readouterr().err
    assert (result["limited"], result["saturated"]) == (True, False)
    assert "told 1000, makes 349 of 349 deg/s" in shown
    assert "limited: the command is more than a motor can do" in shown
    free = Simulate(command, "mujoco", out=tmp_path / "b").run()
    assert not free["limited"]
    assert result["final_yaw_pitch_roll_deg"] == pytest.approx(free["final_yaw_pitch_roll_deg"], abs=1e-3)
    command.write_text("t_s,tau2_deg\n0,0\n0.01,46\n1,46\n")
    with pytest.raises(InputError, match="its mechanical range is -45 to 45 deg"):
        Simulate(command, "lpf", {"rig": "prototype"}, out=tmp_path / "c").run()


def test_every_table_says_how_fast_the_motors_are(
    policy: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "best.csv"
    weights = (1e7, 1.0, 1e4, 1e5)
    Optimum(
        Saccades((0.0,), (20.0,)), Problem(plant_options={"rig": "prototype"}), weights=weights, out=out, quiet=True
    ).run()
    with out.open() as text:
        (row,) = csv.DictReader(text)
    assert float(row["motor_speed_deg_s"]) <= 349 * SLACK
    assert float(row["motor_speed_limit_deg_s"]) == 349
    assert row["motor_acceleration_limit_deg_s2"] == ""
    assert "of 349" in capsys.readouterr().err
    folder, _, _ = policy(rig_of("deg", 100.0))
    Evaluate(folder, pairs=2, out=tmp_path / "run", quiet=True).run()
    with (tmp_path / "run" / "pairs.csv").open() as text:
        rows = list(csv.DictReader(text))
    assert all(float(row["motor_acceleration_deg_s2"]) <= 2e4 * 1.25 * SLACK for row in rows)
    assert all(float(row["motor_acceleration_limit_deg_s2"]) == 2e4 * 1.25 for row in rows)


@pytest.mark.parametrize("case", ["2-varying", "3-varying"])
def test_a_C_that_cannot_hold_the_limit_is_never_silent(case: str, capsys: pytest.CaptureFixture[str]) -> None:
    """By 4.18 none does below V = |D - F| B^2 / k0: 160 deg/s at the bounds of B and k0."""
    problem, ends = Problem(speed_limit=100.0), Saccades((0.0,), (30.0,))
    (row,) = Optimum(ends, problem, case=case, weights=(1e7, 1.0, 1e4, 1e5), quiet=True).run()["saccades"]
    shown = capsys.readouterr().err
    assert row["too_fast"]
    assert row["motor_speed_deg_s"] > 100
    assert "too fast " in shown.split("no C")[0]
    assert "no C holds 1 of 1 commands to the speed limit of 100 deg/s" in shown


def test_a_varying_C_takes_the_rig_s_own_speed_limit_where_nobody_says_another() -> None:
    """Of the driven motors the least; the thesis' 7200 deg/s where none is limited, and whatever is said."""
    fast, slow = (RigMotor(f"motor{i}", speed_limit=v) for i, v in ((1, 9000.0), (2, 300.0)))
    rig = Rig("two", (fast, slow), {"yaw": {"motor2": 1.0}, "roll": {"motor1": 1.0}})

    def V(plant: str, rig: Rig | str | None, **options: Any) -> Any:
        made = make_plant(plant) if rig is None else make_plant(plant, rig=rig)
        task = SaccadeTask.of_case(made, "2-varying", weights=(1, 1, 1, 1), **options)
        assert restore_actions(task.actions.identity(), task.plant).identity() == task.actions.identity()
        return task.actions.identity()["speed_limit"]

    assert V("mujoco", None) == V("lpf", None) == 7200
    assert V("lpf", "prototype") == 349
    assert V("lpf", "prototype", speed_limit=1000.0) == 1000
    assert V("mujoco", rig) == V("mujoco", rig, driven=("motor1", "motor2")) == 300
    assert V("mujoco", rig, driven=("motor1", "motor3")) == 9000
    config = TrainConfig("lpf", {"rig": "prototype"}, case="2-varying", weights=(1, 1, 1, 1))
    problem = Problem("lpf", {"rig": "prototype"})
    for task in (config.make_task(), problem.task(*problem.made(), "2-varying", (1, 1, 1, 1))):
        assert task.actions.identity()["speed_limit"] == 349
