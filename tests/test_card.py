"""Cards of policies: what is shipped is what the code writes, and what a card says is true and can be done."""

import re
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orient_eye.cli import main
from orient_eye.cli.options import parse
from orient_eye.cli.train import Train
from orient_eye.learning.card import card, command_line, write_card
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.policy import Policy, shipped_policies
from orient_eye.plants import make_plant
from orient_eye.task.saccade import SaccadeTask

SHIPPED = shipped_policies()
RESULT = {"pairs": 3, "gap_mean": 0.1, "gap_p95": 0.2, "gap_max": 0.3, "saccades": 9, "train_s": 1.0, "table": []}


def policy_of(task: SaccadeTask, **manifest: Any) -> Policy:
    """Of random numbers."""
    sizes = (6, 8, len(task.actions.numbers))
    random = np.random.default_rng(0)
    weights = tuple(random.normal(size=each) for each in pairwise(sizes))
    return Policy.of_task(task, weights, tuple(np.zeros(size) for size in sizes[1:]), **manifest)


def trained(config: TrainConfig) -> Policy:
    """What a training with these options leaves, but for the learning."""
    task = config.make_task()
    told = asdict(config.resolved(task))
    apart = {name: told.pop(name) for name in ("task", "weights_from", "case")}
    return policy_of(task, case=apart["case"], config=told, versions={}, result=RESULT)


def settings_of(line: str) -> dict[str, Any]:
    """What `orient-eye train` makes of a command line."""
    program, command, *words = line.split()
    assert (program, command) == ("orient-eye", "train")
    settings = asdict(parse(Train, words).config.resolved())
    settings.pop("weights_from")  # "given" where they stand as numbers
    return settings


def section(text: str, title: str) -> str:
    return text.split(f"\n## {title}\n")[1].split("\n## ", 1)[0]


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_card_is_what_the_code_writes(name: str) -> None:
    written = (SHIPPED[name] / "README.md").read_text(encoding="utf-8")
    assert written == card(Policy.load(name), name, shipped=True), "python scripts/results.py --cards"


@pytest.mark.parametrize("name", SHIPPED)
def test_the_front_matter_is_that_of_a_model_hub(name: str) -> None:
    yaml = pytest.importorskip("yaml")
    before, front, _ = (SHIPPED[name] / "README.md").read_text(encoding="utf-8").split("---\n", 2)
    told, result = yaml.safe_load(front), Policy.load(name).manifest["result"]
    assert before == ""
    assert (told["license"], told["library_name"]) == ("mit", "orient-eye")
    assert all(isinstance(tag, str) for tag in told["tags"])
    (model,) = told["model-index"]
    (found,) = model["results"]
    assert model["name"] == name
    assert found["task"]["type"] == "reinforcement-learning"
    assert f"{result['pairs']} random saccades" in found["dataset"]["name"]
    metrics = {metric["type"]: metric["value"] for metric in found["metrics"]}
    assert metrics == pytest.approx({f"reward_gap_{k}": result[f"gap_{k}"] for k in ("mean", "p95", "max")}, rel=1e-5)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_command_line_of_a_shipped_card_means_its_training(name: str) -> None:
    policy = Policy.load(name)
    told = section(card(policy, name), "Training")
    assert f"orient-eye {policy.manifest['versions']['orient-eye']}," in told
    assert "With another version the same command may come to other numbers." in told
    (line,) = re.findall(r"^    (orient-eye train.*)$", told, re.MULTILINE)
    settings = settings_of(line)
    policy.require(SaccadeTask.restore(settings["task"]))
    config = {key: value for key, value in policy.manifest["config"].items() if value is not None}
    assert {key: settings[key] for key in config} == {
        key: tuple(value) if isinstance(value, list) else value for key, value in config.items()
    }


@pytest.mark.parametrize(
    "config",
    [
        TrainConfig(weights=(1e7, 1, 2.5e5, 1e8), seed=7, updates=800, temperature=(0.2, 0.01)),
        TrainConfig(case="2-varying", speed_limit=900.0, band=0.02, doubt=1e-4, reward_scale="raw"),
        TrainConfig(plant_options={"surrogate": "mujoco"}, evaluation_pairs=9, batch_size=64),
        TrainConfig(plant_options={"rig": "prototype"}, weights=(1e7, 1, 2.5e5, 1e8)),
        TrainConfig(preset="thesis", updates=5000),
        TrainConfig(origin="lpf-1", learning_rate=2e-4, temperature="auto"),
        TrainConfig(plant="mujoco", plant_options={"accurate": True, "eye": "eve_v3"}, horizon_s=0.6, weights=(1,) * 4),
        TrainConfig(plant="viscous", targets="vertical", weights=(1e7, 1, 2.5e5, 1e8)),
        TrainConfig(plant="tavares", targets="gaze", torsion="fick", saccades_per_update=8),
    ],
    ids=str,
)  # fmt: skip
def test_a_command_line_means_the_training_it_is_made_from(config: TrainConfig) -> None:
    line = command_line(trained(config))
    asked = asdict(config.resolved())
    asked.pop("weights_from")
    rig = "prototype" if "rig" in config.plant_options else "rig.toml"
    assert settings_of(line.replace("rig.toml", rig)) == asked
    assert line.count("--") <= 8, "only what is not usual"


def numbers_in(value: Any) -> list[float]:
    if isinstance(value, dict | list):
        return [n for each in (value.values() if isinstance(value, dict) else value) for n in numbers_in(each)]
    return [float(value)] if isinstance(value, int | float) else []


@pytest.mark.parametrize("name", ["lpf-1", "six-gaze"])
def test_every_number_of_the_results_stands_in_the_manifest(name: str) -> None:
    policy = Policy.load(name)
    known = np.array([*numbers_in(policy.manifest["result"]), policy.manifest["task"]["targets"]["limit_deg"]])
    told = section(card(policy, name), "Results")
    found = re.findall(r"(?<![\w.])\d+\.?\d*(?!\w)", told.split("finds.", 1)[1])
    assert len(found) > 30
    for number in found:
        half = 0.5 * 10.0 ** -len(number.partition(".")[2]) + 1e-9
        assert (np.abs(np.concatenate([known, 100 * known]) - float(number)) <= half).any(), number


def test_what_a_card_says_about_its_use_can_be_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "my-run"
    policy = trained(TrainConfig(evaluation_pairs=3))
    policy.save(folder)
    text = write_card(policy, folder).read_text(encoding="utf-8")
    assert text.splitlines()[1] != "license: mit", "nobody has said so"
    assert "\n# my-run\n" in text
    use = section(text, "Use")
    monkeypatch.chdir(folder)
    predict = re.findall(r"^    orient-eye (predict.*)$", use, re.MULTILINE)
    with pytest.raises(SystemExit) as end:
        main(predict[0].split())
    assert not end.value.code
    assert (folder / "saccade.csv").exists()
    names: dict[str, Any] = {}
    exec(use.split("```python\n")[1].split("```")[0], names)
    expected = policy.act(names["start"].orientation, names["target"])
    np.testing.assert_allclose(names["action"], expected, rtol=1e-6)  # its file holds float32


def test_a_card_of_strange_words_stays_a_card() -> None:
    """Names are other people's, and a policy may say nothing of its training."""
    policy = policy_of(SaccadeTask.of_case(make_plant("lpf"), "1"), case=None, weights_from="a | b\n# c")
    text = card(policy, "odd | name\n---")
    assert "## Training" not in text
    assert "## Results" not in text
    assert "\n# c" not in text
    assert text.count("\n---\n") == 1
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        assert len({row.replace("\\|", "").count("|") for row in table.splitlines()}) == 1
    unknown = replace(policy, manifest={**policy.manifest, "result": {**RESULT, "gap_p95": None}})
    assert "95th" not in card(unknown, "unknown")
