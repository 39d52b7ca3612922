"""examples/stream_command.py with a clock that stands still unless somebody sleeps."""

import sys
from collections.abc import Mapping
from importlib import util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from orient_eye.errors import InputError
from orient_eye.rig import Rig

FILE = Path(__file__).parents[1] / "examples" / "stream_command.py"
HEAD = "t_s,motor1_counts,motor2_counts,motor3_counts\n"


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = util.spec_from_file_location("stream_command", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = util.module_from_spec(spec)
    sys.modules["stream_command"] = module  # where its dataclasses look for their annotations
    spec.loader.exec_module(module)
    return module


class Clock:
    """Seconds that pass by sleeping; each sleep takes `more` longer than it should."""

    def __init__(self) -> None:
        self.now, self.more, self.slept = 100.0, 0.0, []

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds + self.more


def command(path: Path, rows: str) -> Path:
    path.write_text(HEAD + rows)
    return path


TEN = "".join(f"{0.01 * k:.2f},512,{512 + 10 * k},512\n" for k in range(10))


def test_rows_are_sent_at_their_times(example: ModuleType, tmp_path: Path) -> None:
    clock = Clock()
    driver = example.FakeDriver(clock)
    rows = example.read_rows(command(tmp_path / "c.csv", TEN), Rig.load("prototype"))
    done = example.stream(rows, driver, clock=clock, sleep=clock.sleep)
    assert (done.rows, done.late, done.interrupted) == (10, {}, False)
    assert [t for t, _ in driver.sent] == pytest.approx(100 + 0.01 * np.arange(10))
    assert [p["motor2"] for _, p in driver.sent] == [512 + 10 * k for k in range(10)]
    assert {(p["motor1"], p["motor3"]) for _, p in driver.sent} == {(512, 512)}


def test_a_slow_driver_does_not_shift_the_rest(example: ModuleType, tmp_path: Path) -> None:
    """One row takes 24 ms: the rows that were due meanwhile go out at once, are late, and the rest is on time."""
    clock = Clock()

    class Slow(example.FakeDriver):  # type: ignore[misc, name-defined]
        def send(self, positions: Mapping[str, float]) -> None:
            super().send(positions)
            if positions["motor2"] == 542:
                clock.now += 0.024

    driver = Slow(clock)
    rows = example.read_rows(command(tmp_path / "c.csv", TEN), Rig.load("prototype"))
    done = example.stream(rows, driver, clock=clock, sleep=clock.sleep)
    assert done.late == {4: pytest.approx(0.014)}  # the fifth is 4 ms late: within half an interval
    assert [t - 100 for t, _ in driver.sent] == pytest.approx(
        [0, 0.01, 0.02, 0.03, 0.054, 0.054, 0.06, 0.07, 0.08, 0.09]
    )


def test_late_rows_are_reported(example: ModuleType, tmp_path: Path) -> None:
    clock = Clock()
    clock.more = 0.0075
    rows = example.read_rows(command(tmp_path / "c.csv", TEN), Rig.load("prototype"))
    done = example.stream(rows, example.FakeDriver(clock), clock=clock, sleep=clock.sleep)
    assert done.late == {k: pytest.approx(0.0075) for k in range(1, 10)}


def test_an_interruption_holds_the_last_position(example: ModuleType, tmp_path: Path) -> None:
    clock = Clock()

    def sleep(seconds: float) -> None:
        if len(clock.slept) == 4:
            raise KeyboardInterrupt
        clock.sleep(seconds)

    driver = example.FakeDriver(clock)
    rows = example.read_rows(command(tmp_path / "c.csv", TEN), Rig.load("prototype"))
    done = example.stream(rows, driver, clock=clock, sleep=sleep)
    assert (done.rows, done.interrupted) == (5, True)
    assert [p["motor2"] for _, p in driver.sent] == [512, 522, 532, 542, 552, 552]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0,512,512,512\n0.01,512,1025,512\n", "line 3: motor2_counts = 1025 is outside the range of motor2, 0 to"),
        ("0,512,512,512\n0.01,-1,512,512\n", "motor1_counts = -1"),
        ("0,512,512,512\n0,512,512,512\n", "time must rise"),
        ("0,512,512,512\n0.01,512,,512\n", "not a finite number"),
    ],
)
def test_nothing_is_sent_of_a_command_that_is_wrong(example: ModuleType, tmp_path: Path, rows: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        example.read_rows(command(tmp_path / "c.csv", rows), Rig.load("prototype"))


def test_columns_are_those_of_the_rig(example: ModuleType, tmp_path: Path) -> None:
    file = tmp_path / "c.csv"
    file.write_text("t_s,tau2_deg\n0,0\n0.01,1\n")
    with pytest.raises(InputError, match="tau2_deg is no column of rig 'prototype'"):
        example.read_rows(file, Rig.load("prototype"))
    file.write_text("t_s,motor2_counts\n0,512\n0.01,512\n")
    with pytest.raises(InputError, match="no column motor1_counts"):
        example.read_rows(file, Rig.load("prototype"))


def test_it_runs(example: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done = example.main([str(command(tmp_path / "c.csv", TEN)), "--rig", "prototype"])
    assert done.rows == 10
    assert "motor2 602" in capsys.readouterr().out
