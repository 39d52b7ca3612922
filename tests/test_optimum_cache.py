"""Remembered optima and `orient-eye optimum`: searched once for each question, and never a wrong answer."""

import csv
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy
from numpy.typing import NDArray

from orient_eye.cli.optimum import Optimum as OptimumCommand
from orient_eye.cli.options import parse
from orient_eye.cli.saccades import Saccades, read_pairs
from orient_eye.errors import InputError
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.run_directory import plain
from orient_eye.search import optimum_cache
from orient_eye.search.optimum import Optimum, find_optimum
from orient_eye.search.optimum_cache import cache_folder, searched_optimum, task_key
from orient_eye.search.optimum_file import Found, read_optimum, write_optimum
from orient_eye.search.second_search import second_search
from orient_eye.state import State
from orient_eye.surrogate import Surrogate
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
WEIGHTS = {"accuracy": 2.66e7, "energy": 1.0, "duration": 5.12e5, "overshoot": 2.3e8}


@pytest.fixture(autouse=True)
def own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No test reads or writes the user's cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(optimum_cache, "cache_folder", lambda: tmp_path / "cache" / "optimum")


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[SaccadeTask]:
    """The tasks that were searched, by a search that answers at once."""
    done: list[SaccadeTask] = []

    def find(task: SaccadeTask, start: State, target: Array, random: Any, *, progress: Any = None) -> Optimum:
        done.append(task)
        if progress:
            progress(1.0)
        action = np.tile([30.0 + len(done), 20.0, 17.5], (len(target), 1))
        return Optimum(action, np.arange(len(target)) - 5.0, 7)

    monkeypatch.setattr(optimum_cache, "find_optimum", find)
    return done


def task(case: str = "1", plant: Any = None, **options: Any) -> SaccadeTask:
    return SaccadeTask.of_case(plant or LinearPlant(), case, **{"weights": WEIGHTS, **options})


START, TARGET = saccades(task().targets, [[0.0], [-5.0]], [[30.0], [5.0]])


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
        lambda: task("2-fixed"),
        lambda: task("2-varying"),
        lambda: task("2-varying", speed_limit=5000.0),
        lambda: task(weights=WEIGHTS | {"overshoot": 1e8}),
        lambda: task(weights=WEIGHTS | {"accuracy": 2.66e7 * (1 + 1e-12)}),
        lambda: task(judge="gaze", weights=WEIGHTS | {"force": 0.0}),
        lambda: task(band=0.02),
        lambda: task(plant=LinearPlant(Surrogate(1.5, 17.5, eye="thesis"))),
        lambda: task(plant=LinearPlant(Surrogate(1.4758, 17.6, eye="thesis"))),
        lambda: task(plant=MujocoPlant(threads=1)),
        lambda: task(plant=MujocoPlant(accurate=True, threads=1)),
        lambda: task(plant=MujocoPlant(threads=1), horizon_s=0.6),
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
    there = task().targets.rest(TARGET)
    moving = State(START.orientation, START.motor, np.array([[0.0, 0, 1e-9], [0.0, 0, 0]]))
    nearly = saccades(task().targets, [[0.0], [-5.0]], [[30.0 + 1e-9], [5.0]])
    for start, target in (
        (START, TARGET), (there, START.orientation), nearly, (START[:1], TARGET[:1]), (moving, TARGET)
    ):  # fmt: skip
        for _ in range(2):
            assert len(searched_optimum(task(), start, target).reward) == len(start)
    assert len(searches) == 5


def test_what_does_not_change_the_answer_does_not_search(searches: list[SaccadeTask]) -> None:
    searched_optimum(task(), START, TARGET)
    for same in (
        task(horizon_s=0.7),  # the low-pass plant has no horizon
        task(speed_limit=5000.0),  # variant 1 has no C
        task(plant=LinearPlant(Surrogate(1.4758, 17.5, "motor2", "another file with these numbers", "thesis"))),
        task(weights=tuple(WEIGHTS.values())),
    ):
        searched_optimum(same, START, TARGET)
    assert len(searches) == 1


@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty", "text", "something else", "folder"])
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
        path.write_text("no safetensors file")
    elif damage == "something else":
        safetensors.numpy.save_file({"other": np.zeros(3)}, path)
    else:
        path.unlink()
        path.mkdir()
    found = searched_optimum(task(), START, TARGET)
    assert len(searches) == 2
    assert found.action[0, 0] == 32
    if damage != "folder":  # which cannot be replaced by a file: searched every time
        assert searched_optimum(task(), START, TARGET).action[0, 0] == 32
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


# --- an optimum that travels ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def travels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with the optimum of the two saccades."""
    found = find_optimum(task(), START, TARGET, np.random.default_rng(0), effort=0.3)
    path = tmp_path_factory.mktemp("travels") / "optimum.safetensors"
    return write_optimum(path, Found(task_key(task()), START, TARGET, found))


def test_what_travels_is_not_searched(travels: Path, searches: list[SaccadeTask]) -> None:
    """All of it or a part, in any order, and where another machine puts the motors."""
    written = read_optimum(travels)
    assert written is not None
    moved = State(START.orientation, START.motor + 1e-9)
    for start, which in ((START, [0, 1]), (START, [1]), (moved, [1, 0, 1])):
        taken = searched_optimum(task(), start[which], TARGET[which], carried=travels)
        np.testing.assert_array_equal(taken.action, written.optimum.action[which])
        np.testing.assert_allclose(taken.reward, written.optimum.reward[which], rtol=1e-7)
        assert taken.evaluations == written.optimum.evaluations
    assert not searches
    assert not optimum_cache.cache_folder().exists()


def test_another_version_of_the_search_takes_it_too(
    travels: Path, searches: list[SaccadeTask], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(optimum_cache, "_SEARCH", "another")
    monkeypatch.setattr("importlib.metadata.version", lambda _: "99")
    searched_optimum(task(), START, TARGET, carried=travels)
    assert not searches


@pytest.mark.parametrize(
    "other",
    [
        lambda: task("2-fixed"),
        lambda: task(weights=WEIGHTS | {"overshoot": 1e8}),
        lambda: task(band=0.02),
        lambda: task(plant=LinearPlant(Surrogate(1.4758, 17.6, eye="thesis"))),
        lambda: task(plant=MujocoPlant(threads=1)),
    ],
)
def test_what_travels_with_another_task_is_searched(
    travels: Path, searches: list[SaccadeTask], other: Callable[[], SaccadeTask]
) -> None:
    start, target = saccades(other().targets, [[0.0], [-5.0]], [[30.0], [5.0]])
    searched_optimum(other(), start, target, carried=travels)
    assert len(searches) == 1


def test_saccades_that_do_not_travel_are_searched(travels: Path, searches: list[SaccadeTask], tmp_path: Path) -> None:
    near = saccades(task().targets, [[0.0], [-5.0]], [[30.0], [5.001]])
    moving = State(START.orientation, START.motor, np.array([[0.0, 0, 1e-3], [0.0, 0, 0]]))
    for start, target in (near, (moving, TARGET)):
        searched_optimum(task(), start, target, carried=travels)
    assert len(searches) == 2
    searched_optimum(task(), START, TARGET, carried=tmp_path / "nothing.safetensors")
    assert len(searches) == 3


def test_a_reward_that_is_not_the_actions_is_found_out(
    travels: Path, searches: list[SaccadeTask], tmp_path: Path
) -> None:
    """The file is whole, and of an eye that has changed since."""
    written = read_optimum(travels)
    assert written is not None
    for share, count in ((1 + 1e-5, 0), (1 + 1e-3, 1), (np.nan, 1)):
        changed = replace(written.optimum, reward=written.optimum.reward * [1, share])
        path = write_optimum(tmp_path / f"{share}", replace(written, optimum=changed))
        searches.clear()
        taken = searched_optimum(task(), START, TARGET, carried=path, folder=tmp_path / f"cache-{share}")
        assert len(searches) == count
        if not count:
            np.testing.assert_allclose(taken.reward, written.optimum.reward, rtol=1e-12)


def test_a_damaged_file_that_travels_is_searched(travels: Path, searches: list[SaccadeTask], tmp_path: Path) -> None:
    whole, path = travels.read_bytes(), tmp_path / "optimum.safetensors"
    written = read_optimum(travels)
    assert written is not None
    shorter = replace(written.optimum, action=written.optimum.action[:1])
    damages: list[Callable[[], object]] = [
        lambda: path.write_bytes(whole[:-50]),
        lambda: path.write_bytes(whole[:-50] + bytes([whole[-50] ^ 1]) + whole[-49:]),
        lambda: path.write_bytes((2**60).to_bytes(8, "little") + whole[8:]),
        lambda: safetensors.numpy.save_file({}, path, {"orient-eye": "[" * 100_000}),
        lambda: safetensors.numpy.save_file({}, path, {"orient-eye": "[]"}),
        lambda: write_optimum(path, replace(written, optimum=shorter)),
        lambda: write_optimum(path, replace(written, optimum=replace(shorter, action=written.optimum.action[:, :2]))),
    ]
    for count, damage in enumerate(damages, start=1):
        damage()
        searched_optimum(task(), START, TARGET, carried=path, folder=tmp_path / f"cache-{count}")
        assert len(searches) == count


def test_the_same_optimum_gives_the_same_bytes(travels: Path, tmp_path: Path) -> None:
    written = read_optimum(travels)
    assert written is not None
    assert write_optimum(tmp_path / "again", written).read_bytes() == travels.read_bytes()


# --- the second search ----------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["1", "2-varying", "3-varying"])
def test_two_searches_agree(case: str) -> None:
    """Also on a large saccade, where the reward has optima on both sides of the overshoot's onset."""
    own = SaccadeTask.of_case(LinearPlant(), case)
    start, target = saccades(own.targets, [[-35.0]], [[35.0]])
    best = searched_optimum(own, start, target)
    action, reward = second_search(own, start, target)
    assert reward == pytest.approx(best.reward[0], rel=1e-4)
    np.testing.assert_allclose(action, best.action[0], rtol=0.01)


def test_two_searches_agree_on_the_simulated_eye() -> None:
    own = task(plant=TavaresPlant())
    start, target = saccades(own.targets, [[-15.0]], [[15.0]])
    _, reward = second_search(own, start, target)
    assert reward == pytest.approx(searched_optimum(own, start, target).reward[0], rel=1e-4)


@pytest.mark.slow
@pytest.mark.usefixtures("short_second_search")
def test_two_searches_agree_in_nine_dimensions() -> None:
    """All three motors driven; only motor2 turns the eye much, so that the optimum is flat in five numbers."""
    own = SaccadeTask.of_case(TavaresPlant(), "1", driven=("motor1", "motor2", "motor3"), weights=WEIGHTS)
    start, target = own.targets.draw(1, np.random.default_rng(2021))
    assert len(own.actions.numbers) == 9
    best = searched_optimum(own, start, target)
    assert best.evaluations < 7000
    _, reward = second_search(own, start, target)
    assert reward == pytest.approx(best.reward[0], rel=1e-3)


def test_the_whole_eye_is_searched_on_its_kernel_and_judged_by_itself() -> None:
    """The twin is the same eye, with the same limits; what is told is the plant's own reward, and no worse for it."""
    for options in ({}, {"gravity": True}, {"accurate": True}, {"eye": "eve_v3"}, {"rig": "prototype"}):
        plant = MujocoPlant(**options)
        twin = plant.twin()
        assert isinstance(twin, TavaresPlant)
        identity, other = plant.identity(), twin.identity()
        assert {name: other.get(name, False) for name in plant.options} == plant.options
        assert identity["model"] == other["model"] or options.keys() & {"gravity", "accurate"}
        assert twin.motors == plant.motors
        if options.keys() & {"gravity", "eye"}:  # no motor alone holds a heavy eye straight ahead
            continue
        own = SaccadeTask.of_case(plant, "1", weights=WEIGHTS)
        start, target = saccades(own.targets, [[0.0]], [[12.0]])
        found = find_optimum(own, start, target, np.random.default_rng(0), effort=0.5)
        assert found.reward == own.perform(start, found.action, target).reward.total
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(MujocoPlant, "twin", lambda _: None)
            alone = find_optimum(own, start, target, np.random.default_rng(0), effort=0.5)
        assert found.reward == pytest.approx(alone.reward, rel=2e-3)


# --- pairs ----------------------------------------------------------------------------------------


YAW = ("yaw_deg",)


def test_pairs_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "pairs.csv"
    path.write_text("\ufeffnumber, target_yaw_deg ,start_yaw_deg\n1,30,0\n\n2,-5.5,1e1\n", encoding="utf-8")
    start, target = read_pairs(path, YAW)
    assert start.tolist() == [[0], [10]]
    assert target.tolist() == [[30], [-5.5]]


def test_pairs_of_several_angles(tmp_path: Path) -> None:
    """Of targets told by two angles; semicolons and decimal commas."""
    path = tmp_path / "pairs.csv"
    path.write_text("start_yaw_deg;start_pitch_deg;target_pitch_deg;target_yaw_deg\n0;1,5;2;3\n", encoding="utf-8")
    start, target = read_pairs(path, ("yaw_deg", "pitch_deg"))
    assert (start.tolist(), target.tolist()) == ([[0, 1.5]], [[3, 2]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; it needs a header .start_yaw_deg,target_yaw_deg"),
        ("0,30\n", "its first line must name the columns: start_yaw_deg,target_yaw_deg"),
        ("start_yaw_deg,target\n0,30\n", "has no column target_yaw_deg"),
        ("start_yaw_deg,target_yaw_deg,target_yaw_deg\n0,30,30\n", "stands twice"),
        ("start_yaw_deg,target_yaw_deg\n", "has no rows"),
        ("start_yaw_deg,target_yaw_deg\n0,30\n0,far\n", "line 3: target_yaw_deg is 'far', not a number"),
        ("start_yaw_deg,target_yaw_deg\n0\n", "line 2: 1 cells"),
        ("start_yaw_deg,target_yaw_deg\nnan,3\n", "line 2: start_yaw_deg is not a finite number"),
        ("start_yaw_deg,target_yaw_deg\n0,inf\n", "line 2: target_yaw_deg is not a finite number"),
    ],
)
def test_pairs_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "pairs.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_pairs(path, YAW)


def test_pairs_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "pairs.csv"
    path.write_bytes(b"\xff\xfe\x00")
    for name in (path, tmp_path / "missing.csv", tmp_path):
        with pytest.raises(InputError, match="cannot read"):
            read_pairs(name, YAW)


# --- the command ----------------------------------------------------------------------------------


def command(*arguments: str) -> OptimumCommand:
    return parse(OptimumCommand, arguments)


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
    assert {name: {"True": True, "False": False}.get(value, value) for name, value in written.items()} == {
        name: value if isinstance(value, bool) else "" if value is None else str(value) for name, value in row.items()
    }

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
    plant = LinearPlant(Surrogate(1.5, 16.0))
    expected = task("3-varying", plant, speed_limit=3000, weights=(1, 2, 3, 4), band=0.02)
    assert done.identity() == expected.identity()
    assert result["task"] == done.identity()


def test_a_pulse_by_itself_and_other_targets(searches: list[SaccadeTask]) -> None:
    arguments = "--pulse 2 --C 60 --targets vertical --plant tavares --target 10 --weights 1 1 1 1 --quiet"
    with pytest.raises(InputError, match=r"actions \(1, 6\)"):  # the search that answers at once knows one motor
        command(*arguments.split()).run()
    (done,) = searches
    identity = done.identity()
    assert (identity["actions"]["pulse"], identity["actions"]["C"]) == ("2", 60.0)
    assert (identity["targets"]["targets"], identity["actions"]["driven"]) == ("vertical", ["motor1", "motor3"])


def test_check_fails_when_the_second_search_is_better(searches: list[SaccadeTask]) -> None:
    """The search that answers at once is far off."""
    result = command("--start", "0", "--target", "30", "--check", "--quiet").run()
    assert result["passed"] is False
    assert result["check_largest_gain"] > 0.01
    assert result["saccades"][0]["check_gain"] == result["check_largest_gain"]


def test_command_on_the_whole_eye(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def quickly(*arguments: Any, progress: Any = None) -> Optimum:
        return find_optimum(*arguments, effort=0.1, progress=progress)

    monkeypatch.setattr(optimum_cache, "find_optimum", quickly)
    (row,) = command("--plant", "mujoco", "--start", "-5", "--target", "10").run()["saccades"]
    assert row["final_yaw_deg"] == pytest.approx(10, abs=1)
    assert "C" not in row
    assert "plant mujoco" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("", "name a saccade by --start and --target"),
        ("--start 0", "name a saccade by --start and --target"),
        ("--start 0 --pairs pairs.csv", "not both"),
        ("--start nan --target 0", "start at nan deg"),
        ("--start 0 --target inf", "target at inf deg"),
        ("--start 0 --target -118.2", r"target at -118.2 deg.* between -118.1 and 118.1 deg"),
        ("--start 62 --target 0 --plant mujoco", r"start at 62 deg.*between -61.8 and 61.8 deg"),
        ("--target 5 10", "--target takes YAW .deg.: as many numbers, not 2"),
        ("--target 5 --start", "--start takes YAW .deg.: as many numbers, not 0"),
        ("--start 0 --target 5 --plant mujoco --surrogate a.json", "--surrogate does nothing"),
        ("--start 0 --target 5 --eye eve_v3", "--eye does nothing"),
        ("--start 0 --target 5 --weights 1 1 -1 1", "not negative"),
        ("--start 0 --target 5 --weights 1 1 1", "has 4 weights"),
        ("--start 0 --target 5 --band 1.5", "settling band"),
        ("--start 5 --target 5", "saccade 1 starts at its target"),
        ("--start 0 --target 5 --out .", "is a folder"),
        ("--pairs p.csv --out ./p.csv", "--out and --pairs name the same file"),
        ("--target 5 --C 60", "name the pulse too"),
        ("--target 5 --pulse 1 --C 60", "no onset rate C"),
        ("--target 5 --pulse 2 --case 1", "exclude each other"),
    ],
)
def test_command_refuses(searches: list[SaccadeTask], arguments: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        command(*arguments.split()).run()
    assert not searches


def test_out_that_cannot_be_written(searches: list[SaccadeTask], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(InputError, match="cannot write"):
        OptimumCommand(Saccades(target=(30.0,)), out=tmp_path / "file" / "best.csv", quiet=True).run()
