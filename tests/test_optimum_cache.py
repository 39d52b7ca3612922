"""Remembered optima and `orient-eye optimum`: searched once for each question, and never a wrong answer."""

import csv
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
import tyro
from numpy.typing import NDArray

from orient_eye.cli.optimum import OptimumCommand, read_pairs, second_search
from orient_eye.errors import InputError
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.run_directory import plain
from orient_eye.search import optimum_cache
from orient_eye.search.optimum import Optimum, find_optimum
from orient_eye.search.optimum_cache import cache_folder, searched_optimum
from orient_eye.surrogate import Surrogate
from orient_eye.task.cases import CASES
from orient_eye.task.reward import Weights
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
START, TARGET = np.array([0.0, -5.0]), np.array([30.0, 5.0])


@pytest.fixture(autouse=True)
def own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No test reads or writes the user's cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(optimum_cache, "cache_folder", lambda: tmp_path / "cache" / "optimum")


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[SaccadeTask]:
    """The tasks that were searched, by a search that answers at once."""
    done: list[SaccadeTask] = []

    def find(task: SaccadeTask, start: Any, target: Array, random: Any, *, progress: Any = None) -> Optimum:
        done.append(task)
        if progress:
            progress(1.0)
        action = np.tile([30.0 + len(done), 20.0, 17.5], (len(target), 1, 1))
        return Optimum(action, np.arange(len(target)) - 5.0, 7)

    monkeypatch.setattr(optimum_cache, "find_optimum", find)
    return done


def task(case: str = "1", **options: Any) -> SaccadeTask:
    return SaccadeTask.of_case(LowPassPlant(), case, **options)


def kept() -> list[Path]:
    return sorted(optimum_cache.cache_folder().iterdir())


# --- the cache ------------------------------------------------------------------------------------


def test_second_call_does_not_search(monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[float] = []
    found = searched_optimum(task(), START, TARGET, progress=shares.append)
    assert shares[-1] == 1.0
    assert shares == sorted(shares)
    monkeypatch.setattr(optimum_cache, "find_optimum", lambda *_, **__: pytest.fail("searched again"))
    again = searched_optimum(task(), START, TARGET, progress=lambda _: pytest.fail("progress without work"))
    np.testing.assert_array_equal(again.action, found.action)
    np.testing.assert_array_equal(again.reward, found.reward)
    assert again.evaluations == found.evaluations


def test_search_is_reproducible(tmp_path: Path) -> None:
    one, other = (searched_optimum(task(), START, TARGET, folder=tmp_path / name) for name in "ab")
    np.testing.assert_array_equal(one.action, other.action)


@pytest.mark.parametrize(
    "other",
    [
        lambda: task("2-fixed", weights=Weights()),
        lambda: task("2-varying", weights=Weights()),
        lambda: task("2-varying", weights=Weights(), speed_limit=5000.0),
        lambda: task(weights=Weights(overshoot=1e8)),
        lambda: task(weights=Weights(accuracy=2.66e7 * (1 + 1e-12))),
        lambda: task(band=0.02),
        lambda: SaccadeTask(LowPassPlant(Surrogate(1.5, 17.5))),
        lambda: SaccadeTask(LowPassPlant(Surrogate(1.4758, 17.6))),
        lambda: SaccadeTask(MujocoPlant(threads=1)),
        lambda: SaccadeTask(MujocoPlant(accurate=True, threads=1)),
        lambda: SaccadeTask(MujocoPlant(threads=1), horizon_s=0.6),
    ],
)
def test_another_task_is_another_question(searches: list[SaccadeTask], other: Callable[[], SaccadeTask]) -> None:
    searched_optimum(task(), START, TARGET)
    searched_optimum(task(), START, TARGET)
    assert len(searches) == 1
    first = searched_optimum(other(), START, TARGET)
    assert len(searches) == 2
    assert searched_optimum(other(), START, TARGET).action.tolist() == first.action.tolist()
    assert len(searches) == 2
    assert len(kept()) == 2


def test_other_saccades_are_another_question(searches: list[SaccadeTask]) -> None:
    for start, target in ((START, TARGET), (TARGET, START), (START, TARGET + 1e-9), (START[:1], TARGET[:1])):
        for _ in range(2):
            assert len(searched_optimum(task(), start, target).reward) == len(start)
    assert len(searches) == 4


def test_what_does_not_change_the_answer_does_not_search(searches: list[SaccadeTask]) -> None:
    searched_optimum(task(), START, TARGET)
    for same in (
        task(horizon_s=0.7),  # the low-pass plant has no horizon
        task(speed_limit=5000.0),  # variant 1 has no C
        SaccadeTask(LowPassPlant(Surrogate(1.4758, 17.5, source="another file with these numbers"))),
    ):
        searched_optimum(same, START, TARGET)
    assert len(searches) == 1


@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty", "text", "zip of something else", "folder"])
def test_damaged_file_is_searched_again(searches: list[SaccadeTask], damage: str) -> None:
    searched_optimum(task(), START, TARGET)
    (path,) = kept()
    whole = path.read_bytes()
    if damage == "truncated":
        path.write_bytes(whole[: len(whole) // 2])
    elif damage == "flipped":
        at = whole.index(np.float64(31.0).tobytes())
        path.write_bytes(whole[:at] + b"\x00\x00\x00\x00\x00\x00\x08\x40" + whole[at + 8 :])
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "text":
        path.write_text("not an archive")
    elif damage == "zip of something else":
        np.savez(path, other=np.zeros(3))
    else:
        path.unlink()
        path.mkdir()
    found = searched_optimum(task(), START, TARGET)
    assert len(searches) == 2
    assert found.action[0, 0, 0] == 32
    if damage != "folder":  # which cannot be replaced by a file: searched every time
        assert searched_optimum(task(), START, TARGET).action[0, 0, 0] == 32
        assert len(searches) == 2
        assert len(kept()) == 1  # no temporary file is left


def test_folder_that_cannot_be_written(searches: list[SaccadeTask], tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    for count in (1, 2):
        assert searched_optimum(task(), START, TARGET, folder=blocked / "optimum").evaluations == 7
        assert len(searches) == count


def test_nothing_is_kept_of_a_search_that_was_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        searched_optimum(task(), START, TARGET, progress=stop)
    assert not optimum_cache.cache_folder().exists()


@pytest.mark.skipif(sys.platform != "linux", reason="XDG_CACHE_HOME is Linux' variable")
def test_folder_of_the_user(tmp_path: Path) -> None:
    """The real function, which `own_cache` replaces in its module."""
    assert cache_folder() == tmp_path / "cache" / "orient-eye" / "optimum"


# --- the second search ----------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["1", "2-varying", "3-varying"])
def test_two_searches_agree(case: str) -> None:
    """Also on a large saccade, where the reward has optima on both sides of the overshoot's onset."""
    start, target = np.array([-35.0]), np.array([35.0])
    best = searched_optimum(task(case), start, target)
    action, reward = second_search(task(case), -35.0, 35.0)
    assert reward == pytest.approx(best.reward[0], rel=1e-4)
    np.testing.assert_allclose(action, best.action[0, 0], rtol=0.01)


# --- pairs ----------------------------------------------------------------------------------------


def test_pairs_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "pairs.csv"
    path.write_text("\ufeffname, target_yaw_deg ,start_yaw_deg\nfirst,30,0\n\nsecond,-5.5,1e1\n", encoding="utf-8")
    start, target = read_pairs(path)
    assert start.tolist() == [0, 10]
    assert target.tolist() == [30, -5.5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "needs the columns start_yaw_deg and target_yaw_deg once each, got nothing"),
        ("0,30\n", "needs the columns .* got 0, 30"),
        ("start_yaw_deg,target\n0,30\n", "needs the columns"),
        ("start_yaw_deg,target_yaw_deg,target_yaw_deg\n0,30,30\n", "needs the columns"),
        ("start_yaw_deg,target_yaw_deg\n", "has no saccades"),
        ("start_yaw_deg,target_yaw_deg\n0,30\n0,far\n", "line 3: start and target are numbers"),
        ("start_yaw_deg,target_yaw_deg\n0\n", "line 2: start and target are numbers"),
        ("start_yaw_deg,target_yaw_deg\nnan,3\n", "line 2: start and target must be finite"),
        ("start_yaw_deg,target_yaw_deg\n0,inf\n", "line 2: start and target must be finite"),
    ],
)
def test_pairs_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "pairs.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_pairs(path)


def test_pairs_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "pairs.csv"
    path.write_bytes(b"\xff\xfe\x00")
    for name in (path, tmp_path / "missing.csv", tmp_path):
        with pytest.raises(InputError, match="cannot read"):
            read_pairs(name)


# --- the command ----------------------------------------------------------------------------------


def command(*arguments: str) -> OptimumCommand:
    return tyro.cli(OptimumCommand, args=arguments, config=(tyro.conf.OmitArgPrefixes, tyro.conf.DisallowNone))


def test_command_finds_and_remembers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "best.csv"
    arguments = ("--start", "0", "--target", "30", "--case", "2-varying", "--check", "--out", str(out))
    result = command(*arguments).run()
    printed = capsys.readouterr()
    assert not printed.out
    assert "searched with" in printed.err
    assert result["passed"]
    assert not result["remembered"]
    assert json.loads(json.dumps(result, default=plain)) == result

    (row,) = result["saccades"]
    terms = sum(row[f"reward_{name}"] for name in ("accuracy", "energy", "duration", "overshoot"))
    assert terms == pytest.approx(row["reward"], rel=1e-12)
    assert row["final_yaw_deg"] == pytest.approx(1.4758 * row["D_deg"], rel=1e-9)
    assert row["F_deg"] == 0
    assert row["B"] == pytest.approx(35, abs=1.5)
    assert row["k0"] == pytest.approx(17.5, abs=0.3)
    assert abs(row["check_gain"]) < 1e-4
    with out.open(newline="", encoding="utf-8") as file:
        (written,) = csv.DictReader(file)
    assert {name: float(value) for name, value in written.items()} == row

    again = command(*arguments[:-3]).run()
    assert "remembered from an earlier search" in capsys.readouterr().err
    assert again["remembered"]
    assert "passed" not in again
    assert again["saccades"][0] == {name: value for name, value in row.items() if not name.startswith("check_")}


def test_command_takes_pairs_and_every_option(searches: list[SaccadeTask], tmp_path: Path) -> None:
    pairs, surrogate = tmp_path / "pairs.csv", tmp_path / "surrogate.json"
    pairs.write_text("start_yaw_deg,target_yaw_deg\n0,30\n10,12\n", encoding="utf-8")
    Surrogate(1.5, 16.0).save(surrogate)
    options = f"--pairs {pairs} --case 3-varying --surrogate {surrogate} --speed-limit 3000 --band 0.02"
    result = command(*options.split(), "--weights", "1", "2", "3", "4", "--quiet").run()
    assert [(r["start_yaw_deg"], r["target_yaw_deg"]) for r in result["saccades"]] == [(0, 30), (10, 12)]
    (done,) = searches
    expected = SaccadeTask(
        LowPassPlant(Surrogate(1.5, 16.0)), variant=3, C="varying", speed_limit=3000, weights=Weights(1, 2, 3, 4)
    )
    assert done.identity() == replace(expected, band=0.02).identity()
    assert result["task"] == done.identity()


def test_check_fails_when_the_second_search_is_better(searches: list[SaccadeTask]) -> None:
    """The search that answers at once is far off."""
    result = command("--start", "0", "--target", "30", "--check", "--quiet").run()
    assert result["passed"] is False
    assert result["check_largest_gain"] > 0.01
    assert result["saccades"][0]["check_gain"] == result["check_largest_gain"]


def test_command_on_the_whole_eye(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def quickly(*arguments: Any, progress: Any = None) -> Optimum:
        return find_optimum(*arguments, population=12, generations=6, progress=progress)

    monkeypatch.setattr(optimum_cache, "find_optimum", quickly)
    (row,) = command("--plant", "mujoco", "--start", "-5", "--target", "10").run()["saccades"]
    assert row["final_yaw_deg"] == pytest.approx(10, abs=1)
    assert row["C"] is None
    assert "plant mujoco" in capsys.readouterr().err


def test_command_knows_the_cases() -> None:
    assert set(get_args(get_type_hints(OptimumCommand)["case"])) == set(CASES)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "name a saccade by --start YAW and --target YAW"),
        ({"start": 0.0}, "name a saccade by --start YAW and --target YAW"),
        ({"start": 0.0, "pairs": Path("pairs.csv")}, "not both"),
        ({"start": float("nan"), "target": 0.0}, "start at nan deg"),
        ({"start": 0.0, "target": float("inf")}, "target at inf deg"),
        ({"start": 0.0, "target": -118.2}, r"target at -118.2 deg.* between -118.1 and 118.1 deg"),
        ({"start": 62.0, "target": 0.0, "plant": "mujoco"}, r"start at 62 deg.*between -61.8 and 61.8 deg"),
        ({"start": 0.0, "target": 5.0, "plant": "mujoco", "surrogate": "a.json"}, "--surrogate does nothing"),
        ({"start": 0.0, "target": 5.0, "eye": "eve_v3"}, "--eye does nothing"),
        ({"start": 0.0, "target": 5.0, "weights": (1.0, 1.0, -1.0, 1.0)}, "not negative"),
        ({"start": 0.0, "target": 5.0, "band": 1.5}, "settling band"),
        ({"start": 5.0, "target": 5.0}, "both 5 deg"),
        ({"start": 0.0, "target": 5.0, "out": Path()}, "is a folder"),
    ],
)
def test_command_refuses(searches: list[SaccadeTask], options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        OptimumCommand(**options).run()
    assert not searches


def test_out_that_cannot_be_written(searches: list[SaccadeTask], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(InputError, match="cannot write"):
        OptimumCommand(0.0, 30.0, out=tmp_path / "file" / "best.csv", quiet=True).run()
