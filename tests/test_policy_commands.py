"""predict, evaluate, models and export: their numbers by another route, their files, and what they refuse."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from orient_eye.cli.another_plant import AnotherPlant
from orient_eye.cli.evaluate import Evaluate
from orient_eye.cli.export import Export
from orient_eye.cli.models import Models
from orient_eye.cli.options import parse
from orient_eye.cli.predict import Predict
from orient_eye.cli.saccades import Saccades
from orient_eye.commands.motor_file import read_command
from orient_eye.errors import InputError
from orient_eye.learning import figures, judged
from orient_eye.learning.evaluation import Yardstick, carry_optimum, evaluation_saccades
from orient_eye.learning.policy import NAME, Policy, shipped_policies
from orient_eye.motor import names
from orient_eye.movement.measures import measure
from orient_eye.plants import make_plant
from orient_eye.resources import data_folder
from orient_eye.rotations import from_yaw, to_euler
from orient_eye.search.optimum import Optimum
from orient_eye.state import State
from orient_eye.surrogate import Surrogate
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades
from test_policy import make_policy

FIVE = Saccades(target=(5.0,))
PNG = b"\x89PNG"


def sensible_policy(task: SaccadeTask) -> Policy:
    """Random networks whose D lies near the target: the network's weights are small, those to D made by hand."""
    policy = make_policy(task, sizes=(6, 8))
    weights, biases = [w.copy() for w in policy.weights], [b.copy() for b in policy.biases]
    weights[0][:] = biases[0][:] = 0
    weights[0][[2, 5, 2, 5], [0, 0, 1, 1]] = 1, 1, -1, -1  # relu of target yaw / 35 and of its negative
    D = float(task.actions.likely(from_yaw([35.0]))[0, 1]) / task.actions.high[1]
    weights[1][:] *= 0.2
    weights[1][:2] = [[-0.9, D, 0.0], [-0.9, -D, 0.0]]
    biases[1][:] = 0.6, 0, -0.25
    return replace(policy, weights=tuple(weights), biases=tuple(biases))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy of case 2-varying on the thesis' surrogate."""
    task = SaccadeTask.of_case(make_plant("lpf"), "2-varying")
    return sensible_policy(task).save(tmp_path_factory.mktemp("policy")).parent


@pytest.fixture(scope="module")
def mujoco_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    task = SaccadeTask.of_case(make_plant("mujoco"), "1")
    return sensible_policy(task).save(tmp_path_factory.mktemp("mujoco")).parent


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Evaluations that draw and record nothing: what they leave is looked at elsewhere."""
    monkeypatch.setattr(judged, "draw_policy_figures", lambda *_: [])
    monkeypatch.setattr(judged, "record_policy", lambda *_: None)


# --- predict --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("plant", ["lpf", "mujoco"])
@pytest.mark.parametrize(("start", "target"), [(0.0, 20.0), (-35.0, 35.0), (12.5, -4.0)])
def test_the_written_command_does_what_was_predicted(
    plant: str, start: float, target: float, folder: Path, mujoco_folder: Path, tmp_path: Path
) -> None:
    policy = folder if plant == "lpf" else mujoco_folder
    file = tmp_path / "command.csv"
    result = Predict(str(policy), Saccades((start,), (target,)), command=file).run()
    (row,) = result["saccades"]
    assert result["plant"] == make_plant(plant).identity()
    # The file read back and simulated, the response measured from its samples.
    eye = make_plant(plant)
    written = read_command(file, eye.motors)
    resting = eye.rest(written.rest)
    assert to_euler(resting)[0][0] == pytest.approx(start, abs=1e-4)
    trajectory = eye.move(written, State(resting, written.rest)).trajectory()
    final = np.zeros((1, len(eye.motors)))
    final[0, names(eye.motors).index("motor2")] = row["D_deg"]
    measured = measure(trajectory, eye.rest(final))
    assert row["final_yaw_deg"] == pytest.approx(trajectory.yaw_deg[0, -1], abs=0.01)
    assert row["final_yaw_error_deg"] == pytest.approx(row["final_yaw_deg"] - target, abs=2e-9)
    assert row["duration_ms"] == pytest.approx(1e3 * measured.settling_time_s[0], abs=1)
    assert row["peak_velocity_deg_s"] == pytest.approx(measured.peak_velocity_deg_s[0], rel=0.01)
    assert row["overshoot"] == pytest.approx(measured.overshoot[0], abs=1e-3)
    assert row["settled"] is True
    assert row["failed"] is False


def test_the_command_file_has_the_columns_of_simulate(folder: Path, mujoco_folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "new" / "command.csv"
    (row,) = Predict(str(folder), Saccades((-10.0,), (20.0,)), command=file).run()["saccades"]
    with file.open() as text:
        rows = list(csv.DictReader(text))
    assert list(rows[0]) == ["t_s", "tau2_deg"]  # the motors of its plant
    assert float(rows[0]["tau2_deg"]) == pytest.approx(row["F_deg"], rel=1e-8)
    assert row["F_deg"] == pytest.approx(-10 / 1.4758)
    assert float(rows[-1]["tau2_deg"]) == pytest.approx(row["D_deg"], abs=0.05)
    times = np.array([float(r["t_s"]) for r in rows])
    assert times == pytest.approx(0.001 * np.arange(501), abs=1e-12)
    Predict(str(mujoco_folder), saccades=Saccades(target=(20.0,)), command=file).run()
    with file.open() as text:
        rows = list(csv.DictReader(text))
    assert list(rows[0]) == ["t_s", "tau1_deg", "tau2_deg", "tau3_deg"]
    assert {r["tau1_deg"] for r in rows} == {r["tau3_deg"] for r in rows} == {"0"}


def test_C_is_that_of_the_pulse(folder: Path, mujoco_folder: Path) -> None:
    (row,) = Predict(str(folder), saccades=Saccades(target=(30.0,))).run()["saccades"]
    B, k0, size = row["B"], row["k0"], abs(row["D_deg"] - row["F_deg"])
    assert row["C"] == pytest.approx(7200 * k0 / (size * B) - B)  # 4.18
    (row,) = Predict(str(mujoco_folder), saccades=Saccades(target=(30.0,))).run()["saccades"]
    assert "C" not in row


def test_lists_of_saccades(folder: Path, tmp_path: Path) -> None:
    pairs, out = tmp_path / "pairs.csv", tmp_path / "out.csv"
    pairs.write_text("number,target_yaw_deg,start_yaw_deg\n1,20,0\n2,-35,35\n3,5,5\n")
    result = Predict(str(folder), saccades=Saccades(pairs=pairs), out=out).run()
    assert [(r["start_yaw_deg"], r["target_yaw_deg"]) for r in result["saccades"]] == [(0, 20), (35, -35), (5, 5)]
    one = Predict(str(folder), Saccades((35.0,), (-35.0,))).run()["saccades"][0]
    assert result["saccades"][1] == pytest.approx(one)
    with out.open() as text:
        written = list(csv.DictReader(text))
    assert [float(r["B"]) for r in written] == [r["B"] for r in result["saccades"]]
    json.dumps(result, allow_nan=False)


def test_predict_reads_its_command_line(folder: Path) -> None:
    arguments = "--start -5 --target -20.5 --plant mujoco --accurate --force"
    expected = AnotherPlant("mujoco", {"accurate": True}, force=True)
    assert parse(Predict, [str(folder), *arguments.split()]) == Predict(
        str(folder), Saccades((-5.0,), (-20.5,)), another_plant=expected
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("", "--target"),
        ("--start 3", "--target"),
        ("--target 35.001", "between -35.0 and 35.0"),
        ("--target -36", "target at -36"),
        ("--target 0 --start 40", "start at 40"),
        ("--target nan", "nan"),
        ("--target 1 --pairs pairs.csv", "not both"),
        ("--target 1 2", "--target takes YAW"),
        ("--pairs nothing.csv", "cannot read"),
    ],
)
def test_saccades_beyond_the_training_are_refused(folder: Path, arguments: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse(Predict, [str(folder), *arguments.split()]).run()


def test_predict_writes_over_nothing_of_its_own(folder: Path, tmp_path: Path) -> None:
    pairs, same = tmp_path / "pairs.csv", tmp_path / "new.csv"
    pairs.write_text("start_yaw_deg,target_yaw_deg\n0,20\n")
    before = (folder / NAME).read_bytes()
    for options, words in (
        ({"saccades": Saccades(pairs=pairs), "out": pairs}, "--out and --pairs"),
        ({"saccades": Saccades(pairs=pairs), "command": tmp_path / "." / "pairs.csv"}, "--command and --pairs"),
        ({"saccades": FIVE, "out": same, "command": same}, "--out and --command"),
        ({"saccades": FIVE, "out": folder / NAME}, "--out and the policy"),
        ({"saccades": FIVE, "command": folder / NAME}, "--command and the policy"),
        ({"saccades": FIVE, "out": folder}, "is a folder"),
    ):
        with pytest.raises(InputError, match=words):
            Predict(str(folder), **options).run()
    assert not same.exists()
    assert (folder / NAME).read_bytes() == before


def test_one_command_file_is_of_one_saccade(folder: Path, tmp_path: Path) -> None:
    pairs = tmp_path / "pairs.csv"
    pairs.write_text("start_yaw_deg,target_yaw_deg\n0,20\n0,10\n")
    with pytest.raises(InputError, match="one saccade"):
        Predict(str(folder), saccades=Saccades(pairs=pairs), command=tmp_path / "command.csv").run()
    assert not (tmp_path / "command.csv").exists()


def test_another_plant_has_to_be_forced(folder: Path, tmp_path: Path) -> None:
    surrogate = str(Surrogate(1.5, 16.0).save(tmp_path / "s.json"))
    for another in (AnotherPlant("mujoco"), AnotherPlant("lpf", {"surrogate": surrogate})):
        with pytest.raises(InputError, match="force"):
            Predict(str(folder), saccades=Saccades(target=(20.0,)), another_plant=another).run()
        forced = Predict(
            str(folder), saccades=Saccades(target=(20.0,)), another_plant=replace(another, force=True)
        ).run()
        assert forced["differs_from_training"][0].startswith(("plant lpf", "K 1.4758, not 1.5"))
        assert forced["plant"]["plant"] == another.plant
    own = Predict(str(folder), saccades=Saccades(target=(20.0,))).run()
    same = Predict(str(folder), saccades=Saccades(target=(20.0,)), another_plant=AnotherPlant("lpf")).run()
    assert same["differs_from_training"] == []
    assert same["saccades"] == own["saccades"]
    with pytest.raises(InputError, match="--eye says more about a plant; name the plant too, by --plant"):
        parse(Predict, [str(folder), "--target", "20", "--eye", "eve_v3"])


def test_several_driven_motors_have_columns_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weights = (1.0, 1.0, 1.0, 1.0)
    task = SaccadeTask.of_case(make_plant("tavares"), "2-fixed", driven=("motor1", "motor2"), weights=weights)
    make_policy(task).save(tmp_path)
    (row,) = Predict(str(tmp_path), saccades=Saccades(target=(10.0,)), command=tmp_path / "command.csv").run()[
        "saccades"
    ]
    assert {"B_motor1", "B_motor2", "D_motor2_deg", "k0_motor1", "C_motor1"} <= set(row)
    assert row["F_motor1_deg"] == pytest.approx(0, abs=1e-6)
    shown = capsys.readouterr().err
    assert f"{row['B_motor2']:.5g}" in shown


# --- evaluate -------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("cache")
def test_evaluate_holds_a_policy_against_the_optimum(folder: Path, tmp_path: Path) -> None:
    result = Evaluate(str(folder), pairs=3, out=tmp_path / "run", quiet=True).run()
    files = {file.name for file in (tmp_path / "run").iterdir()}
    names = ("policy_output", "saccades", "pure_step", "main_sequence", "reward_against_k0", "energy")
    pictures = {f"{name}.png" for name in names}
    assert files == {"run.json", "result.json", "pairs.csv", "recording.rrd", *pictures}
    for name in pictures:
        assert (tmp_path / "run" / name).read_bytes()[:4] == PNG
    assert json.loads((tmp_path / "run" / "result.json").read_text()) == json.loads(json.dumps(result))
    assert json.loads((tmp_path / "run" / "run.json").read_text())["config"]["pairs"] == 3
    with (tmp_path / "run" / "pairs.csv").open() as text:
        table = list(csv.DictReader(text))
    rows = [{key: float(value) for key, value in row.items() if value not in ("True", "False", "")} for row in table]
    gaps = [(row["reward_best"] - row["reward"]) / abs(row["reward_best"]) for row in rows]
    assert [row["gap"] for row in rows] == pytest.approx(gaps)
    assert result["gap_mean"] == pytest.approx(np.mean(gaps))
    assert min(gaps) > 0  # the search is better than this policy
    assert result["yaw_error_max_deg"] == pytest.approx(max(abs(row["final_yaw_error_deg"]) for row in rows))
    assert [row["amplitude_deg"] for row in result["table"]] == [5, 10, 20, 30, 45, 60]
    with pytest.raises(InputError, match="not an empty folder"):
        Evaluate(str(folder), pairs=3, out=tmp_path / "run", quiet=True).run()


@pytest.mark.usefixtures("cache", "no_pictures")
def test_the_optimum_travels_with_a_policy(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Copied or not, with all of its saccades or some of them; on another plant it is searched."""
    own = shutil.copytree(folder, tmp_path / "policy")
    pairs, table = evaluation_saccades(Policy.load(own).task(), 4)
    carry_optimum(pairs, table, own)
    searched: list[str] = []

    def find(task: SaccadeTask, start: State, target: np.ndarray, *_: object, **__: object) -> Optimum:
        searched.append(task.plant.name)
        action = np.tile([30.0, 10.0, 17.5], (len(target), 1))
        return Optimum(action, np.full(len(target), -1e5), 0)

    monkeypatch.setattr("orient_eye.search.optimum_cache.find_optimum", find)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "another"))
    result = Evaluate(str(own), pairs=4, out=tmp_path / "a", quiet=True).run()
    fewer = Evaluate(str(own / NAME), pairs=2, out=tmp_path / "b", quiet=True).run()
    assert not searched
    assert not (tmp_path / "another").exists()
    assert [row["reward_best"] for row in result["table"]] == pytest.approx(list(table.optimum.reward), rel=1e-12)
    assert (result["pairs"], fewer["pairs"]) == (4, 2)
    with (tmp_path / "a" / "pairs.csv").open() as one, (tmp_path / "b" / "pairs.csv").open() as other:
        assert list(csv.DictReader(one))[:2] == list(csv.DictReader(other))
    Evaluate(str(own), pairs=5, out=tmp_path / "c", quiet=True).run()
    surrogate = str(Surrogate(1.5, 16.0).save(tmp_path / "s.json"))
    another = AnotherPlant("lpf", {"surrogate": surrogate}, force=True)
    Evaluate(str(own), pairs=4, out=tmp_path / "d", another_plant=another, quiet=True).run()
    assert len(searched) == 2


@pytest.mark.usefixtures("cache", "no_pictures")
def test_evaluate_takes_as_many_saccades_as_the_training(folder: Path, tmp_path: Path) -> None:
    policy = Policy.load(folder)
    replace(policy, manifest={**policy.manifest, "result": {"pairs": 3}}).save(tmp_path / "policy")
    assert Evaluate(str(tmp_path / "policy"), out=tmp_path / "run", quiet=True).run()["pairs"] == 3


@pytest.mark.usefixtures("cache")
@pytest.mark.parametrize("name", shipped_policies())
def test_every_shipped_policy_has_its_optimum(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that evaluate searches nothing; `python scripts/results.py FOLDER --optimum` searches what is missing."""
    monkeypatch.setattr("orient_eye.search.optimum_cache.find_optimum", lambda *_, **__: pytest.fail("not there"))
    policy = Policy.load(name)
    carried = shipped_policies()[name] / "optimum.safetensors"
    for yardstick in evaluation_saccades(policy.task(), policy.manifest["result"]["pairs"], carried=carried):
        _, _, gap = yardstick.perform(policy.act)
        assert gap.min() > -1e-3  # nothing that was learned is better than what was found


def test_evaluate_refuses_before_it_works(folder: Path, tmp_path: Path) -> None:
    for command in (
        Evaluate(str(folder), pairs=0, out=tmp_path / "run"),
        Evaluate(str(folder), out=tmp_path / "run", another_plant=AnotherPlant("mujoco")),
        Evaluate(str(tmp_path / "nothing"), out=tmp_path / "run"),
    ):
        with pytest.raises(InputError):
            command.run()
    assert not (tmp_path / "run").exists()
    command = parse(Evaluate, [str(folder), "--pairs", "7", "--plant", "lpf", "--quiet"])
    assert command == Evaluate(str(folder), pairs=7, another_plant=AnotherPlant("lpf"), quiet=True)


def known(task: SaccadeTask, policy: Policy, yaw: np.ndarray) -> Yardstick:
    """Saccades around straight ahead whose "optimum" is the policy itself, so that nothing is searched."""
    start, target = saccades(task.targets, -yaw[:, None] / 2, yaw[:, None] / 2)
    action = policy.act(start.orientation, target)
    reward = task.perform(start, action, target).reward.total
    return Yardstick(task, start, target, Optimum(action, reward, 0))


@pytest.mark.parametrize(
    ("plant", "case", "panels"), [("lpf", "2-varying", 4), ("lpf", "3-fixed", 3), ("mujoco", "1", 3)]
)
def test_figure_5_1_draws_what_the_policy_puts_out(plant: str, case: str, panels: int) -> None:
    task = SaccadeTask.of_case(make_plant(plant), case)
    policy = sensible_policy(task)
    yardstick = known(task, policy, np.array([5.0, 30.0, 60.0]))
    figure = figures.figure_5_1(policy, yardstick, yardstick)
    assert len(figure.axes) == panels
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    mean = lines["policy, mean"]
    start = np.linspace(-35, 35 - 30, 8)
    start, target = np.concatenate([start, start + 30]), np.concatenate([start + 30, start])
    expected = policy.act(from_yaw(start), from_yaw(target))[:, 0].mean()
    assert mean.get_ydata()[list(mean.get_xdata()).index(30)] == pytest.approx(expected)
    assert ("policy, symmetric" in lines) == (plant == "mujoco")


def test_the_cost_against_k0_is_the_sum_of_its_terms(folder: Path) -> None:
    policy = Policy.load(folder)
    task = policy.task()
    table = known(task, policy, np.array([30.0]))
    figure = figures.figure_5_24(policy, table)
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    k0, cost = (np.array(data) for data in (lines["total"].get_xdata(), lines["total"].get_ydata()))
    at = table.optimum.action[0, 2]
    assert np.interp(at, k0, cost) == pytest.approx(-table.optimum.reward[0], rel=0.01)
    terms = [lines[name].get_ydata() for name in ("accuracy", "energy", "duration", "overshoot")]
    assert np.nansum(terms, axis=0) == pytest.approx(cost, rel=1e-6)


def test_human_data_has_sources_and_is_drawn(folder: Path) -> None:
    with (data_folder("models") / "human" / "main_sequence.csv").open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    assert all(row["source"] and row["population"] and row["unit"] for row in rows)
    policy = Policy.load(folder)
    figure = figures.figure_5_4(policy, policy.task())
    labels = [text.get_text() for axes in figure.axes for text in axes.get_legend().get_texts()]
    assert sum(label.startswith("people:") for label in labels) >= 6


def test_the_pictures_of_training_runs_are_drawn(folder: Path, tmp_path: Path) -> None:
    policy = Policy.load(folder)
    task = policy.task()
    path = figures.draw_policy(policy, known(task, policy, np.array([5.0, 30.0])), tmp_path / "policy.png")
    assert path.read_bytes()[:4] == PNG
    metrics = tmp_path / "metrics.csv"
    metrics.write_text("update,reward_mean,gap_mean,gap_p95\n0,nan,2,3\n100,-1e5,0.1,0.2\n")
    assert figures.draw_learning(metrics, tmp_path / "learning.png").read_bytes()[:4] == PNG


# --- models and export ----------------------------------------------------------------------------------


def test_models_lists_what_is_shipped() -> None:
    result = Models().run()
    surrogates = {row["name"]: row for row in result["surrogates"]}
    assert surrogates["thesis"]["K"] == 1.4758
    assert {row["name"] for row in result["policies"]} == {
        file.parent.name for file in data_folder("models").glob(f"policies/*/{NAME}")
    }
    assert not any("error" in row for row in (*result["policies"], *result["surrogates"]))
    json.dumps(result, allow_nan=False)


def test_models_reports_a_damaged_one(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(data_folder("models") / "surrogates", tmp_path / "surrogates")
    for name in ("good", "bad"):
        shutil.copytree(folder, tmp_path / "policies" / name)
    (tmp_path / "policies" / "bad" / NAME).write_bytes(b"")
    for module in ("orient_eye.learning.policy", "orient_eye.resources"):
        monkeypatch.setattr(f"{module}.data_folder", lambda name: tmp_path)
    bad, good = Models().run()["policies"]
    assert "damaged" in bad["error"]
    assert (good["name"], good["gap_mean"]) == ("good", 0.01)


def test_export_writes_what_is_asked_for(folder: Path, tmp_path: Path) -> None:
    result = Export(str(folder), onnx=tmp_path / "a.onnx", sb3=tmp_path / "a.zip").run()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.onnx", "a.zip"]
    assert result["onnx"] == str(tmp_path / "a.onnx")
    assert parse(Export, [str(folder), "--onnx", "x.onnx"]) == Export(str(folder), onnx=Path("x.onnx"))
    with pytest.raises(InputError, match="--sb3 and --onnx name the same file"):
        Export(str(folder), onnx=tmp_path / "b", sb3=tmp_path / "b").run()
    with pytest.raises(InputError, match="--onnx and the policy name the same file"):
        Export(str(folder), onnx=folder / NAME).run()
    with pytest.raises(InputError, match="say what to write"):
        Export(str(folder)).run()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot write"):
        Export(str(folder), onnx=tmp_path / "file" / "a.onnx").run()
    assert "runs the code" in (Export.__doc__ or "")
