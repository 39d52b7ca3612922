"""An executed saccade held against its prediction: a rig of scipy's, spoilt in one way, and what is advised."""

import csv
import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from orient_eye.cli import main
from orient_eye.cli.another_plant import AnotherPlant
from orient_eye.cli.check import Check
from orient_eye.cli.predict import Predict
from orient_eye.cli.saccades import Saccades
from orient_eye.cli.simulate import Simulate
from orient_eye.errors import InputError
from orient_eye.plants import make_plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.rig import Rig, RigMotor
from orient_eye.surrogate import Surrogate
from orient_eye.sysid.executed import Saccade, hold_against
from orient_eye.task.saccade import SaccadeTask
from test_policy_commands import sensible_policy

Array = np.ndarray
TIME = np.arange(0, 1.2, 0.005)
SHARE = np.clip((TIME - 0.05) / 0.12, 0, 1)
TOLD = 20 * (10 * SHARE**3 - 15 * SHARE**4 + 6 * SHARE**5)
RIG = Rig(
    "bench",
    (RigMotor("left", "counts", 11.4, zero=512), RigMotor("right", "rad", sign=-1, zero=0.1)),
    {"pitch": {"left": 1.0, "right": -1.0}},
    command_rate_hz=200,
)
MODEL = Surrogate(1.6, wn=22.0, zeta=0.7, dead_time=0.006, motor="left - right", axis="pitch", rig=RIG.to_plain())


def eye_of(motor: Array, K: float = 1.6, wn: float = 22.0, zeta: float = 0.7, late: float = 0.006) -> Array:
    def slope(t: float, state: Array) -> list[float]:
        return [state[1], wn * wn * (K * np.interp(t - late, TIME, motor) - state[0]) - 2 * zeta * wn * state[1]]

    return np.asarray(solve_ivp(slope, (0, TIME[-1]), [K * motor[0], 0.0], t_eval=TIME, max_step=3e-3).y[0])


def limited(speed: float) -> Array:
    motor = TOLD.copy()
    for k in range(1, len(motor)):
        motor[k] = motor[k - 1] + np.clip(TOLD[k] - motor[k - 1], -0.005 * speed, 0.005 * speed)
    return motor


def written(path: Path, motor: Array, eye: Array | None = None, rig: Rig = RIG) -> Path:
    (axis,) = rig.axes
    columns = {"t_s": TIME, **rig.to_driver(axis, motor)}
    if eye is not None:
        columns[f"{axis}_deg"] = eye + 0.05 * np.random.default_rng(3).normal(size=len(eye))
    with path.open("w", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(columns)
        rows.writerows(np.column_stack(list(columns.values())).tolist())
    return path


DELAYED = np.interp(TIME - 0.03, TIME, TOLD)
CASES: dict[str, tuple[Array, dict[str, float], float, str]] = {
    "nothing": (TOLD, {}, 0.0, "^as predicted: off by"),
    "gain": (TOLD, {"K": 1.45}, 0.0, "9.* % too short: recalibrate the gain .K times 0.90"),
    "zero": (TOLD, {}, 2.0, r"already at rest the eye stands \+(2.0|1.9)\d deg beside .*zero"),
    "driver's delay": (DELAYED, {}, 0.0, "30 ms later than predicted; the motor as much"),
    "dead time": (TOLD, {"late": 0.03}, 0.0, "24 ms later than predicted; identify the dead time"),
    "slow motor": (limited(120), {}, 0.0, "the motor reaches 12\\d deg/s where 30\\d were predicted.*speed_limit"),
    "damping": (TOLD, {"zeta": 0.35}, 0.0, "the shape differs .*identify again"),
    "motor's end": (0.9 * TOLD, {}, 0.0, r"the motor ends -2.0\d deg beside its command"),
}


@pytest.mark.parametrize("what", CASES)
def test_what_is_wrong_with_a_rig_is_found(what: str, tmp_path: Path) -> None:
    motor, rig, beside, words = CASES[what]
    command = written(tmp_path / "command.csv", TOLD)
    executed = written(tmp_path / "executed.csv", motor, eye_of(motor, **rig) + beside)
    model = MODEL.save(tmp_path / "surrogate.json")
    result = Check(str(model), command, executed).run()
    assert len(result["advice"]) == 1
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(result["advice"][0])
    json.dumps(result)


def test_numbers_are_those_of_the_movement(tmp_path: Path) -> None:
    command = written(tmp_path / "command.csv", TOLD)
    eye = eye_of(TOLD, zeta=0.6)
    executed = written(tmp_path / "executed.csv", TOLD, eye)
    MODEL.save(tmp_path / "surrogate.json")
    result = Check(str(tmp_path), command, executed, out=tmp_path / "table.csv").run()
    rows = {row["name"]: row for row in result["quantities"]}
    assert rows["end"]["predicted"] == pytest.approx(32, abs=0.05)
    assert rows["end"]["executed"] == pytest.approx(eye[-20:].mean(), abs=0.05)
    assert rows["overshoot"]["executed"] == pytest.approx(100 * (eye.max() / eye[-1] - 1), abs=0.5)
    late = TIME[np.flatnonzero(np.abs(eye - eye[-1]) > 0.64)[-1]]  # 2 % of 32 deg
    assert rows["duration"]["executed"] == pytest.approx(1e3 * late, abs=12)
    assert (result["band"], result["band_deg"]) == (0.02, pytest.approx(0.64, abs=0.001))
    assert rows["motor end"]["executed"] == pytest.approx(20, abs=0.1)
    assert result["noise_deg"] == pytest.approx(0.05, rel=0.3)
    table: list[dict[str, Any]] = list(csv.DictReader((tmp_path / "table.csv").open()))
    assert [row["name"] for row in table] == list(rows)


def test_a_recording_without_motors_on_a_clock_of_its_own(tmp_path: Path) -> None:
    command = written(tmp_path / "command.csv", TOLD)
    executed = tmp_path / "executed.csv"
    columns = np.column_stack([TIME + 1700.0, eye_of(TOLD, K=1.7)])
    np.savetxt(executed, columns, delimiter=";", header="t_s;eye_deg", comments="")
    model = str(MODEL.save(tmp_path / "surrogate.json"))
    result = Check(model, command, executed).run()
    assert result["gain"] == pytest.approx(1.7 / 1.6, abs=0.002)
    assert result["motor_shift_s"] is None
    assert result["advice"][0].startswith("the eye goes 6.3 % too far")
    shifted = Check(model, command, executed, sent_at=1700.0 - 0.02).run()
    assert shifted["shift_s"] == pytest.approx(0.02, abs=0.001)
    with pytest.raises(InputError, match="before the command is sent at 1800 s"):
        Check(model, command, executed, sent_at=1800.0).run()


@pytest.mark.parametrize("band", [0.02, 0.05, 0.3])
def test_duration_is_till_the_band_that_is_asked_for(
    band: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The response's own last exit, by search in its differential equation; no band is narrower than the noise."""
    command = written(tmp_path / "command.csv", TOLD)
    eye = eye_of(TOLD, zeta=0.5)
    executed = written(tmp_path / "executed.csv", TOLD, eye)
    model = str(MODEL.save(tmp_path / "surrogate.json"))
    result = Check(model, command, executed, band=band).run()
    rows = {row["name"]: row for row in result["quantities"]}
    for name, path in (("predicted", eye_of(TOLD)), ("executed", eye)):
        after = TIME[np.flatnonzero(np.abs(path - path[-1]) > 32 * band)[-1] + 1]
        assert rows["duration"][name] == pytest.approx(1e3 * after, abs=12 if name == "executed" else 1)
    assert f"{32 * band:.3g} deg of its end, {100 * band:g} % of the movement" in capsys.readouterr().err
    narrow = Check(model, command, executed, band=1e-4).run()
    assert narrow["band_deg"] == pytest.approx(4 * narrow["noise_deg"])
    assert "four times its sensor's noise, in which 0.01 % of the movement" in capsys.readouterr().err
    with pytest.raises(InputError, match="between 0 and 1, got 2"):
        Check(model, command, executed, band=2.0).run()


@pytest.mark.parametrize("band", [0.01, 0.04])
def test_a_policy_is_held_to_its_own_prediction(
    band: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What `predict` told of the saccade is what `check` holds the eye to: end, overshoot and duration, in its band."""
    rig = replace(RIG, axes={"yaw": RIG.axes["pitch"]})
    file = str(rig.save(tmp_path / "rig.toml"))
    plant = LinearPlant(replace(MODEL, axis="yaw", rig=rig.to_plain()))
    task = SaccadeTask.of_case(plant, "1", weights=(1e7, 1.0, 1e4, 1e5), band=band)
    policy = str(sensible_policy(task).save(tmp_path / "policy").parent)
    command = tmp_path / "command.csv"
    there = AnotherPlant(None, {"rig": file})
    (told,) = Predict(policy, Saccades((0.0,), (20.0,)), command=command, another_plant=there).run()["saccades"]
    assert "with the surrogate that the policy has learned on" in capsys.readouterr().err
    surrogate = str(replace(MODEL, axis="yaw", rig=rig.to_plain()).save(tmp_path / "my surrogate.json"))
    (tmp_path / "policy" / "run.json").write_text(
        json.dumps({"command_line": shlex.join(["orient-eye", "train", "--surrogate", surrogate])})
    )
    Predict(policy, Saccades((0.0,), (20.0,)), command=command, another_plant=there).run()
    typed = capsys.readouterr().err.replace("\n", " ").split("to try it: orient-eye ")[1].strip()
    with pytest.raises(SystemExit, match="0"):
        main([*shlex.split(typed), "--out", str(tmp_path / "tried")])
    with command.open() as rows:
        table = list(csv.DictReader(rows))
    sent = rig.from_driver("yaw", {name: np.array([float(row[name]) for row in table]) for name in table[0]})
    motor = np.interp(TIME, [float(row["t_s"]) for row in table], sent)
    executed = written(tmp_path / "executed.csv", motor, eye_of(motor), rig)
    result = Check(policy, command, executed, rig=file).run()
    rows_of = {row["name"]: row for row in result["quantities"]}
    assert result["band"] == band
    assert result["band_deg"] == pytest.approx(
        max(band * abs(told["final_yaw_deg"]), 4 * result["noise_deg"]), abs=0.05
    )
    assert rows_of["end"]["predicted"] == pytest.approx(told["final_yaw_deg"], abs=0.1)
    assert result["advice"][0].startswith("as predicted")
    for who in ("predicted", "executed"):
        assert rows_of["duration"][who] == pytest.approx(told["duration_ms"], abs=15)
    with pytest.raises(InputError, match=r"cannot be commanded by .*name its file by --rig"):
        Check(policy, command, executed).run()
    json.dumps(result)


def test_a_policy_of_an_eye_with_several_motors(tmp_path: Path) -> None:
    """Executed by the thesis' own program, in the plant's columns."""
    plant = make_plant("mujoco")
    task = SaccadeTask.of_case(plant, "1", weights=(1e7, 1.0, 1e4, 1e5))
    policy = str(sensible_policy(task).save(tmp_path / "policy").parent)
    command = tmp_path / "command.csv"
    Predict(policy, Saccades((0.0,), (15.0,)), command=command).run()
    moved = Simulate(command, "tavares", horizon=0.6, out=tmp_path / "run").run()
    result = Check(policy, command, tmp_path / "run" / "trajectory.csv").run()
    assert result["axis"] == "yaw"
    assert result["band"] == 0.01
    assert {row["name"]: row for row in result["quantities"]}["end"]["executed"] == pytest.approx(
        moved["final_yaw_pitch_roll_deg"][0], abs=0.05
    )
    assert result["gain"] == pytest.approx(1, abs=0.01)
    assert result["shift_s"] == pytest.approx(0, abs=0.001)
    assert result["advice"][0].startswith("as predicted")


def test_the_same_movement_is_the_same() -> None:
    """Also where a recording has no rows of rest."""
    late = TIME > 0.06
    own = Saccade(TIME, 1.6 * TOLD, TOLD)
    held = hold_against(own, Saccade(TIME[late], own.eye_deg[late], TOLD[late]))
    assert held.gain == pytest.approx(1, abs=1e-6)
    assert held.shift_s == pytest.approx(0, abs=2e-5)
    assert held.motor_shift_s == pytest.approx(0, abs=2e-5)


@pytest.mark.parametrize("lost_s", [0.0, 0.1])
def test_the_model_is_driven_by_the_measured_motor_also_where_its_first_rows_are_lost(
    lost_s: float, tmp_path: Path
) -> None:
    command = written(tmp_path / "command.csv", TOLD + 3)
    executed = written(tmp_path / "executed.csv", limited(200) + 3, eye_of(limited(200) + 3))
    lines = executed.read_text().splitlines()
    executed.write_text("\n".join([lines[0], *lines[1 + round(lost_s / 0.005) :]]) + "\n")
    result = Check(str(MODEL.save(tmp_path / "surrogate.json")), command, executed).run()
    assert result["model_rms_deg"] < 0.15
    assert result["residual_rms_deg"] > 0.5


IN_OTHER_UNITS = {
    "the eye in radians": (TOLD, eye_of(TOLD) / 57.29578, "the eye's angle comes to 0.5.* multiply by 57.29578"),
    "another command's": (np.sin(20 * TIME), eye_of(np.sin(20 * TIME)) * 20, "the recording of another command"),
    "an eye that stands": (TOLD, 0 * TOLD, "explains 0 % .* an eye that does not follow its motor"),
}


@pytest.mark.parametrize("what", IN_OTHER_UNITS)
def test_a_recording_of_something_else_is_no_rig_with_a_bad_gain(what: str, tmp_path: Path) -> None:
    motor, eye, words = IN_OTHER_UNITS[what]
    command, executed = written(tmp_path / "c.csv", TOLD), written(tmp_path / "e.csv", motor, eye)
    result = Check(str(MODEL.save(tmp_path / "surrogate.json")), command, executed).run()
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(result["advice"][0])
    assert "gain" not in " ".join(result["advice"])


def test_a_recording_in_milliseconds_is_refused(tmp_path: Path) -> None:
    command, executed = written(tmp_path / "c.csv", TOLD), tmp_path / "e.csv"
    columns = np.column_stack([1000 * TIME, eye_of(TOLD)])
    np.savetxt(executed, columns, delimiter=",", header="t_s,eye_deg", comments="")
    with pytest.raises(InputError, match=r"240 rows are 5 s apart and last 1195 s: are these ms"):
        Check(str(MODEL.save(tmp_path / "surrogate.json")), command, executed).run()


def test_nothing_to_compare_is_refused() -> None:
    still = Saccade(TIME, 0 * TIME)
    with pytest.raises(InputError, match="predicted eye does not move"):
        hold_against(still, still)
    few = Saccade(TIME[:5], TIME[:5])
    with pytest.raises(InputError, match=r"5 rows .* record at least 8"):
        hold_against(Saccade(TIME, TOLD), few)


def test_an_eye_that_turns_the_other_way_is_seen() -> None:
    held = hold_against(Saccade(TIME, 1.6 * TOLD), Saccade(TIME, -1.6 * TOLD))
    assert "the other way" in held.advice[0]
