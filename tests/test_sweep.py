"""Sweeps: which runs a grid is, that each is what train leaves, that what was killed or stopped is taken up again."""

import csv
import itertools
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from rich.console import Console

from conftest import without_pictures
from orient_eye.cli import main
from orient_eye.cli.options import parse
from orient_eye.cli.sweep import Sweep as Command
from orient_eye.cli.sweep import live_table, read_runs
from orient_eye.errors import Ended, InputError
from orient_eye.learning import workers
from orient_eye.learning.config import TrainConfig, TrainSettings
from orient_eye.learning.grid import config_of, named, product_of
from orient_eye.learning.loop import StopRequest
from orient_eye.learning.policy import Policy
from orient_eye.learning.spread import spread
from orient_eye.learning.sweep import Sweep, _plain
from orient_eye.learning.sweep_results import RunState
from orient_eye.learning.training import Interrupted, train
from orient_eye.resources import cores
from test_checkpoint import _middle, assert_same

TINY = {"updates": 48, "saccades_per_update": 8, "warmup": 64, "batch_size": 32, "evaluation_pairs": 2}
WORDS = [word for name, value in TINY.items() for word in (f"--{name.replace('_', '-')}", str(value))]
PERFORM = workers.perform


def quick() -> Callable[..., None]:
    """A worker's work without search, pictures or TensorBoard; workers know nothing of patches in this process."""

    def perform(*given: Any) -> None:
        from orient_eye.learning import figures, loop, stages, workers
        from orient_eye.search import optimum_cache
        from orient_eye.search.optimum import Optimum

        def middle(task: Any, start: Any, target: Any, *_: Any, **__: Any) -> Any:
            action = task.actions.from_unit(np.zeros((len(target), len(task.actions.numbers))))
            return Optimum(action, task.perform(start, action, target).reward.total, 0)

        optimum_cache.find_optimum = middle
        for module, name in ((figures, "draw_learning"), (figures, "draw_policy"), (stages, "record_stages")):
            setattr(module, name, lambda *_: None)
        loop.TrainingLoop._tensorboard = lambda _: None
        workers.perform(*given)

    return perform


@pytest.fixture(autouse=True, scope="module")
def quickly(private_cache: None) -> Iterator[None]:
    """The same in this process too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("orient_eye.search.optimum_cache.find_optimum", _middle)
        without_pictures(patch)
        patch.setattr("orient_eye.learning.loop.TrainingLoop._tensorboard", lambda _: None)
        patch.setattr("orient_eye.learning.sweep.perform", quick())
        yield


def runs_of(**values: Any) -> dict[str, Any]:
    return named(product_of({**{name: (value,) for name, value in TINY.items()}, **values}))


def table(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / "sweep.csv").open(encoding="utf-8") as file:
        return {row["run"]: row for row in csv.DictReader(file)}


# --- which runs -----------------------------------------------------------------------------------


def test_a_grid_is_every_combination_once() -> None:
    cases, seeds, bands = ("1", "2-fixed", "3-varying"), (0, 1, 2, 3), (0.01, 0.02)
    runs = runs_of(seed=seeds, case=cases, band=bands)
    assert len(runs) == 24
    told = {(run["case"], run["seed"], run["band"]) for run in runs.values()}
    assert told == set(itertools.product(cases, seeds, bands))
    assert "2-fixed-band0.02-seed3" in runs
    assert config_of(runs["2-fixed-band0.02-seed3"]) == TrainConfig(case="2-fixed", band=0.02, seed=3, **TINY)


def test_names_say_what_differs_and_are_each_a_folder_of_their_own() -> None:
    assert list(runs_of()) == ["usual"]
    assert list(runs_of(seed=(4, 5))) == ["seed4", "seed5"]
    odd = named([{"origin": "a/b"}, {"origin": "a b"}, {"origin": "../.."}, {"origin": "x" * 500}, {}])
    assert len(odd) == 5
    for name in odd:
        assert Path(name).name == name
        assert len(name) < 120
    mixed = named([{"plant": "lpf"}, {"plant": "mujoco", "eye": "thesis"}, {"plant": "mujoco", "eye": "eve_v3"}])
    assert list(mixed) == ["lpf", "mujoco-eyethesis", "mujoco-eyeeve-v3"]
    assert config_of(mixed["mujoco-eyeeve-v3"]).plant_options == {"eye": "eve_v3"}


def test_many_runs_that_look_alike_are_named_apart_in_no_time() -> None:
    began = time.process_time()
    assert len(named(product_of({"seed": tuple(range(10**4))}))) == 10**4
    names = named(product_of({"origin": ["a" + "/" * k for k in range(1, 5001)]}))
    assert time.process_time() - began < 5  # by the square of the number it takes longer than ten
    assert len({name.casefold() for name in names}) == 5000
    assert max(map(len, names)) < 120
    for runs in ([{"origin": "a/b"}, {"origin": "a b"}, {"origin": "a b"}], [{"a": 1, "b": 2}, {"b": 2, "a": 1}]):
        with pytest.raises(InputError, match="two runs of the sweep are the same"):
            named(runs)


def test_the_command_line_and_a_file_say_the_same(tmp_path: Path) -> None:
    told = "--plant lpf --case 1 2-fixed --seed 0 1 2 --weights 1 2 3 4 --temperature auto --robust --end-point-error 1"
    command = parse(Command, [*told.split(), *WORDS])
    assert command.grid["seed"] == (0, 1, 2)
    assert command.grid["weights"] == ((1.0, 2.0, 3.0, 4.0),)
    file = tmp_path / "sweep.toml"
    file.write_text(
        '[options]\nplant = "lpf"\ncase = [1, "2-fixed"]\nseed = [0, 1, 2]\nweights = [1, 2, 3, 4]\n'
        'temperature = "auto"\nrobust = true\nend-point-error = 1\n'
        + "".join(f"{name} = {value}\n" for name, value in TINY.items())
    )
    assert read_runs(file) == product_of(command.grid)


def test_tables_of_runs_are_grids_beside_one_another(tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_text(
        "[options]\nseed = [0, 1]\n[[runs]]\ncase = ['1', 'human']\n"
        "[[runs]]\nplant = 'mujoco'\neye = ['thesis', 'eve_v3']\nseed = 7\n"
        "[[runs]]\nweights = [[1, 2, 3, 4], [4, 3, 2, 1]]\ntemperature = [[0.1, 0.01]]\nrobust = [false, true]\n"
    )
    runs = read_runs(file)
    assert len(runs) == 4 + 2 + 8
    assert {"plant": "mujoco", "eye": "eve_v3", "seed": 7} in runs
    last = {"seed": 1, "weights": (4.0, 3.0, 2.0, 1.0), "temperature": (0.1, 0.01), "robust": True}
    assert last in runs
    assert len(named(runs)) == 14


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("options = 3", "options is one table"),
        ("[option]\nseed = 3", "unknown option; a sweep has the tables"),
        ("seed = [", "cannot read .*sweep.toml"),
        ("[options]\nnosuch = 3", "nosuch = 3 is no option of orient-eye train: .*--nosuch"),
        ("[options]\nupdates = 1.5", r"updates = 1\.5 is no option .*--updates"),
        ("[options]\ncase = '9'", "case = '9' .* invalid choice"),
        ("[options]\nout = 'x'", "out = 'x' is no option"),
        ("[options]\nhelp = true", "help = True is no option"),
        ("[options]\nupdates = 1.5", r"updates = 1\.5 .* \.\.\.$"),
        ("[options]\nseed = [[0, 1], [2]]", "a list in a list is one value of several numbers, which seed has not"),
        ("[options]\nseed = [[0], [2]]", "write its values side by side"),
        ("[options]\nrobust = [[true], false]", "which robust has not"),
        ("[options]\nweights = [[[1, 2, 3, 4], [4, 3, 2, 1]]]", "write its values side by side"),
        ("[options]\nseed = []", "seed names no value"),
        ("[options]\nseed = [1, 1]", "seed names 1 twice"),
        ("[options]\nseed = 1\n[[runs]]\n[[runs]]", "two runs of the sweep are the same"),
        ("runs = []", "at least one run"),
        (f"[options]\nseed = {list(range(400))}\nband = {[0.001 * k for k in range(1, 400)]}", "at most 100000 runs"),
    ],
)
def test_a_file_that_is_none(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=message):
        named(read_runs(file))


# --- what they leave ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole sweep, in this process."""
    folder = tmp_path_factory.mktemp("sweep") / "made"
    Sweep.begin(runs_of(case=("1", "2-fixed"), seed=(0, 1)), folder).carry_out(jobs=1)
    return folder


def test_every_run_is_what_train_leaves(made: Path, tmp_path: Path) -> None:
    """Bit for bit, but for its clock, its place and the command line."""
    train(TrainConfig(case="2-fixed", seed=1, **TINY), tmp_path / "train", quiet=True)
    one, other = made / "2-fixed-seed1", tmp_path / "train"
    assert_same(one, other)
    assert {file.name for file in one.iterdir()} == {file.name for file in other.iterdir()}
    told = [json.loads((folder / "run.json").read_text()) for folder in (one, other)]
    assert told[0]["config"] == told[1]["config"]
    results = [json.loads((folder / "result.json").read_text()) for folder in (one, other)]
    for result in results:
        del result["out"], result["train_s"]
    assert results[0] == results[1]
    assert Policy.load(one).manifest["case"] == "2-fixed"


def test_a_sweep_explains_itself(made: Path) -> None:
    told = json.loads((made / "sweep.json").read_text())
    assert set(told["runs"]) == {"1-seed0", "1-seed1", "2-fixed-seed0", "2-fixed-seed1"}
    assert told["runs"]["1-seed1"] == {**TINY, "case": "1", "seed": 1}
    rows = table(made)
    for name, row in rows.items():
        result = json.loads((made / name / "result.json").read_text())
        assert (row["state"], float(row["gap_mean"]), row["why"]) == ("done", result["gap_mean"], "")
    assert rows["2-fixed-seed0"]["case"] == "2-fixed"
    result = json.loads((made / "result.json").read_text())
    assert [each["setting"] for each in result["settings"]] == ["1", "2-fixed"]
    gaps = [float(rows[f"1-seed{seed}"]["gap_mean"]) for seed in (0, 1)]
    assert result["settings"][0]["gap_mean"] == pytest.approx(sum(gaps) / 2)
    assert [result["settings"][0][end] for end in ("low", "high")] == pytest.approx(sorted(gaps))
    assert imread(made / "sweep.png").shape[2] == 4
    assert not list(made.glob(".*"))


def test_the_same_command_again_trains_nothing(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = {file: file.stat().st_mtime_ns for file in made.glob("*/*")}
    monkeypatch.setattr("orient_eye.learning.sweep.perform", lambda *_: pytest.fail("a run began"))
    for arguments in (
        ["--case", "1", "2-fixed", "--seed", "0", "1", "--out", str(made), *WORDS],
        ["--resume", str(made)],
    ):
        assert parse(Command, arguments).run()["done"] == 4
    assert {file: file.stat().st_mtime_ns for file in made.glob("*/*")} == before


def test_what_is_not_its_own_is_left_alone(made: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is of another sweep, of 4 runs: 1-seed0.* --resume"):
        Sweep.begin(runs_of(seed=(0, 1)), made)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="not an empty folder"):
        Sweep.begin(runs_of(), tmp_path)
    with pytest.raises(InputError, match="no folder of a sweep"):
        Sweep.open(tmp_path)
    for content in (
        "[]",
        '{"runs": {}}',
        '{"runs": {"../x": {}}}',
        '{"runs": {"x": 3}}',
        '{"runs": {"x": {"updates": "y"}}}',
    ):
        (tmp_path / "sweep.json").write_text(content)
        with pytest.raises(InputError):
            Sweep.open(tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"file", "sweep.json"}


def test_bad_values_are_found_before_the_first_run(tmp_path: Path) -> None:
    for values, message in (
        ({"updates": (8, 0)}, "run updates0: updates must be a whole number"),
        ({"seed": (0, -1)}, "seed must be a whole number"),
        ({"eye": ("thesis", "eve_v3")}, "eye"),
        ({"origin": ("nosuch", "lpf-1")}, "nosuch"),
    ):
        with pytest.raises(InputError, match=message):
            Sweep.begin(runs_of(**values), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_train_refuses_is_refused_in_its_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "sweep.toml"
    for text, words in (
        ("weights = [1, 2, nan, 3]", "--weights 1 2 nan 3"),
        ("eye = 'nosuch'", "--eye nosuch"),
        ("plant = 'mujoco'\neye = 'nosuch'", "--plant mujoco --eye nosuch"),
    ):
        file.write_text(f"[options]\n{text}\n")
        said = []
        for command in (["train", *words.split()], ["sweep", *words.split()], ["sweep", str(file)]):
            with pytest.raises(SystemExit) as ended:
                main([*command, "--out", str(tmp_path / "out"), "--json"])
            assert ended.value.code == 2
            said.append(json.loads(capsys.readouterr().out)["error"])
        assert said[0] == said[1] == said[2]
    with pytest.raises(InputError, match="finite"):
        _plain({"of another package": float("inf")})
    assert not (tmp_path / "out").exists()


def test_a_run_that_fails_stops_no_other_and_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    make_task = TrainSettings.make_task
    broken = [1]

    def failing(config: TrainConfig, *given: Any, **more: Any) -> Any:
        if config.seed in broken:
            raise RuntimeError("a plant of another package fell over")
        return train(config, *given, **more)

    monkeypatch.setattr("orient_eye.learning.training.train", failing)
    command = ["sweep", "--seed", "0", "1", "2", "--jobs", "1", "--out", str(tmp_path / "out"), *WORDS]
    with pytest.raises(SystemExit) as ended:
        main([*command, "--json"])
    assert ended.value.code == 1
    said = capsys.readouterr()
    assert json.loads(said.out)["failed"] == {"seed1": "RuntimeError: a plant of another package fell over"}
    assert "error: seed1: RuntimeError" in said.err
    assert [row["state"] for row in table(tmp_path / "out").values()] == ["done", "failed", "done"]
    assert make_task is TrainSettings.make_task
    broken.clear()
    assert parse(Command, ["--resume", str(tmp_path / "out"), "--jobs", "1"]).run()["passed"]


def test_runs_that_are_over_are_not_looked_at_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of ten thousand runs that is what there is to do, twice a second."""
    sweep = Sweep.begin(runs_of(seed=tuple(range(6))), tmp_path / "out")
    board = workers.Board(tmp_path, os.getpid())
    over: dict[str, RunState] = {}
    for seed, state in enumerate(("done", "failed", "running", "stopped")):
        board.tell(f"seed{seed}", state, why="it fell over" if state == "failed" else "")
    (tmp_path / "out" / "seed0").mkdir()
    (tmp_path / "out" / "seed0" / "result.json").touch()
    states = sweep._states(board, over)
    assert [each.state for each in states] == ["done", "failed", "running", "stopped", "waiting", "waiting"]
    assert states[1].why == "it fell over"
    asked: list[str] = []
    told = workers.Board.told
    monkeypatch.setattr(workers.Board, "told", lambda board, run: asked.append(run) or told(board, run))
    board.tell("seed4", "running")
    again = sweep._states(board, over)
    assert asked == ["seed2", "seed3", "seed4"]
    assert [each.state for each in again] == ["done", "failed", "running", "stopped", "running", "waiting"]
    assert sweep.states(board) == again


# --- workers --------------------------------------------------------------------------------------


def children() -> dict[int, str]:
    """Processes of this one, that train."""
    found = {}
    for place in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((place / "stat").read_text().rpartition(")")[2].split()[1])
            command = (place / "cmdline").read_bytes().decode()
        except OSError:
            continue
        if parent == os.getpid() and "popen_loky" in command:
            found[int(place.name)] = command
    return found


def when(happens: Callable[[], bool], then: Callable[[], object]) -> threading.Thread:
    """Do something in the background, once something else has happened."""

    def wait() -> None:
        patient = time.monotonic() + 60
        while not happens() and time.monotonic() < patient:
            time.sleep(0.005)
        then()

    thread = threading.Thread(target=wait)
    thread.start()
    return thread


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Mapping[int, Path]:
    """What train leaves, by seed."""
    folder = tmp_path_factory.mktemp("alone")
    for seed in (0, 1):
        train(TrainConfig(**{**TINY, "updates": 240}, seed=seed), folder / str(seed), quiet=True)
    return {seed: folder / str(seed) for seed in (0, 1)}


def test_killed_and_stopped_a_sweep_comes_to_the_same_numbers(alone: Mapping[int, Path], tmp_path: Path) -> None:
    """One of two workers is killed, and another takes its run up; then Ctrl-C; then the same again to the end."""
    folder = tmp_path / "out"
    sweep = Sweep.begin(runs_of(updates=(240,), seed=(0, 1)), folder)
    states: list[list[RunState]] = []
    begun = [folder / f"seed{seed}" / "checkpoint.safetensors" for seed in (0, 1)]

    def both_go_on() -> bool:
        return all(file.exists() for file in begun)

    killed: set[int] = set()

    def kill() -> None:
        killed.add(sorted(children())[0])
        os.kill(min(killed), signal.SIGKILL)
        when(lambda: len(set(children()) - before) == 2 and resumed() == 2, lambda: os.kill(os.getpid(), signal.SIGINT))

    def resumed() -> int:
        return sum("resumed" in json.loads(file.with_name("run.json").read_text()) for file in begun)

    before: set[int] = set()

    def first() -> None:
        before.update(children())
        kill()

    waiting = when(both_go_on, first)
    with pytest.raises(Interrupted, match="sweep --resume") as stopped:
        sweep.carry_out(jobs=2, checkpoint_s=0.2, show=states.append)
    waiting.join()
    assert stopped.value.code == 130
    assert not children()
    assert not any((folder / name).exists() for name in ("result.json", ".board"))
    running = [state for told in states for state in told if state.update is not None]
    assert running
    assert "running" in {state.state for state in running}

    result = sweep.carry_out(jobs=1)
    assert (result["done"], result["passed"]) == (2, True)
    assert not children()
    for seed, one in alone.items():
        assert_same(folder / f"seed{seed}", one)


def test_ctrl_c_in_this_process_leaves_a_checkpoint(alone: Mapping[int, Path], tmp_path: Path) -> None:
    folder = tmp_path / "out"
    sweep = Sweep.begin(runs_of(updates=(240,), seed=(0, 1)), folder)
    metrics = folder / "seed0" / "metrics.csv"
    waiting = when(metrics.exists, lambda: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(Interrupted, match="sweep --resume"):
        sweep.carry_out(jobs=1, checkpoint_s=1000)
    waiting.join()
    assert (folder / "seed0" / "checkpoint.safetensors").exists()
    assert not (folder / "seed1").exists()
    sweep.carry_out(jobs=1)
    assert_same(folder / "seed0", alone[0])


def test_one_sweep_at_a_time_has_a_folder(tmp_path: Path) -> None:
    sweep = Sweep.begin(runs_of(), tmp_path / "out")
    with workers_alone(tmp_path / "out"), pytest.raises(InputError, match="another process"):
        sweep.carry_out(jobs=1)


def workers_alone(folder: Path) -> Any:
    from orient_eye.learning.training import alone as only

    return only(folder)


def test_a_worker_has_its_share_of_the_cores(tmp_path: Path) -> None:
    board = workers.Board(tmp_path, os.getppid())
    before, handler = cores(), signal.getsignal(signal.SIGTERM)
    with workers._working(board, 3):
        assert cores() == 3
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    assert signal.getsignal(signal.SIGTERM) is handler
    from orient_eye import resources

    resources._SHARE.clear()
    assert cores() == before


def test_a_worker_that_is_told_with_its_sweep_still_writes_its_checkpoint(tmp_path: Path) -> None:
    """A signal to the whole group reaches it too, and the board repeats it: that counts once."""
    board = workers.Board(tmp_path, os.getppid())
    with workers._working(board, 1), StopRequest() as request:
        signal.raise_signal(signal.SIGTERM)
        board.stop()
        time.sleep(5 * workers._LOOKS_S)  # a second signal would end the block
        assert request.signal == signal.SIGTERM
    with pytest.raises(Ended), workers._working(board, 1):  # told by the board alone
        time.sleep(60)
    from orient_eye import resources

    resources._SHARE.clear()


def test_an_idle_worker_ends_with_its_sweep(tmp_path: Path) -> None:
    """Killed, it cannot end its workers, and they would wait for work for minutes."""
    program = (
        "import os, time; from pathlib import Path; from orient_eye.learning import workers\n"
        "parent = os.getpid()\n"
        "if os.fork():\n    time.sleep(1)\n    os._exit(0)\n"
        f"with workers._working(workers.Board(Path({str(tmp_path)!r}), parent), 1): pass\n"
        f"Path({str(tmp_path / 'idle')!r}).touch()\ntime.sleep(100)\n"
    )
    began = time.monotonic()
    subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.PIPE)  # until nobody can write to it
    assert (tmp_path / "idle").exists()
    assert time.monotonic() - began < 90


def test_a_run_killed_before_it_could_explain_itself_begins_anew(made: Path, tmp_path: Path) -> None:
    sweep = Sweep.begin(runs_of(seed=(0, 1)), tmp_path / "out")
    for seed, content in ((0, ""), (1, '{"comm')):
        (tmp_path / "out" / f"seed{seed}").mkdir()
        (tmp_path / "out" / f"seed{seed}" / "run.json").write_text(content)
    assert sweep.carry_out(jobs=1)["passed"]
    assert_same(tmp_path / "out" / "seed1", made / "1-seed1")


# --- numbers and pictures -------------------------------------------------------------------------


def test_interquartile_means_leave_out_a_quarter_at_either_end() -> None:
    """Eight runs: the middle four, whatever the others are."""
    runs = np.array([5.0, 1.0, 1e9, 3.0, -1e9, 4.0, 2.0, 1e9])
    assert spread([runs]).mean == pytest.approx((2 + 3 + 4 + 5) / 4)
    assert spread([runs[:4], runs[4:]]).mean == spread([runs]).mean
    one = spread([np.array([2.0])])
    assert (one.mean, np.isnan(one.low)) == (2.0, True)


def test_intervals_hold_the_mean_as_often_as_they_say() -> None:
    """Twenty runs each of two settings that lie far apart: resampled apart, the distance between them is no spread."""
    random = np.random.default_rng(0)
    held = []
    for _ in range(200):
        found = spread([random.normal(0, 1, 20), random.normal(100, 1, 20)])
        held.append(found.low <= 50 <= found.high)
        assert found.high - found.low < 10
    assert 0.85 <= np.mean(held) <= 1.0
    curve = spread([random.normal(0, 1, (20, 7))])
    assert curve.mean.shape == curve.low.shape == curve.high.shape == (7,)
    assert np.all(curve.low < curve.mean)
    assert np.all(curve.mean < curve.high)


def test_the_live_table_says_what_runs_and_what_failed() -> None:
    states = [
        RunState("a", "done"),
        RunState("b", "running", 120, 0.034),
        RunState("c", "failed", why="it diverged"),
        RunState("d", "waiting"),
    ]
    console = Console(width=100, record=True, file=open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115  of the test
    console.print(live_table(states))
    said = console.export_text()
    assert "1 of 4 done, 1 running, 1 failed" in said
    assert all(words in said for words in ("b", "120", "3.40%", "c", "it diverged"))
