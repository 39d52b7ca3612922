"""The card of a policy: what its own metadata says, in Markdown for people, with YAML in front for a model hub.

    write_card(policy, Path("runs/my-run"))          # README.md

The file's form is that of the Hugging Face hub's model cards.
"""

import shlex
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2

from orient_eye.commands.pulses import PULSES
from orient_eye.errors import InputError
from orient_eye.files import write_text
from orient_eye.learning.config import PRESETS, TrainConfig, TrainSettings
from orient_eye.learning.policy import Policy
from orient_eye.modal_surrogate import shipped_modal_surrogates
from orient_eye.plants import PLANTS, make_plant
from orient_eye.registry import Registry
from orient_eye.surrogate import shipped_surrogates
from orient_eye.task.cases import CASES
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import make_targets
from orient_eye.words import in_words, plant_in_words

NAME = "README.md"
_GAPS = {"gap_mean": "in the mean", "gap_p95": "at the 95th percentile", "gap_max": "at most"}
_COMPUTING = ("orient-eye", "python", "mujoco", "numpy", "scipy", "torch", "stable-baselines3")
_SURROGATE, _RIG = "surrogate", "rig"  # options of plants whose file an identity does not name


def write_card(policy: Policy, folder: Path, *, shipped: bool = False) -> Path:
    """Write README.md beside a policy, under the name of the folder; returns its path.

    Args:
        policy: in the folder.
        folder: a run directory, or a shipped policy's.
        shipped: it comes with orient-eye, under its licence, and is given to commands by its name.

    Raises:
        InputError: it cannot be written.
    """
    return write_text(folder / NAME, card(policy, folder.resolve().name, shipped=shipped))


def card(policy: Policy, name: str, *, shipped: bool = False) -> str:
    """The card's text, the same for the same policy.

    Args:
        policy: with the manifest that a training leaves; what that does not say is left out.
        name: of the policy.
        shipped: see `write_card`.

    Raises:
        InputError: the manifest does not describe a task of this version.
    """
    told = policy.manifest
    task = policy.task()
    identity, config, targets = told["task"], told.get("config") or {}, task.targets
    numbers = [
        {**number, "low": low, "high": high, "log": log}
        for number, low, high, log in zip(told["numbers"], policy.low, policy.high, policy.log, strict=True)
    ]
    actions = identity["actions"]
    template = _environment().from_string(
        (resources.files("orient_eye.learning") / "card.md").read_text(encoding="utf-8")
    )
    return template.render(
        name=name,
        given=name if shipped else ".",
        shipped=shipped,
        task=identity,
        actions=actions,
        targets=identity["targets"],
        result=told.get("result") or {},
        config=config,
        numbers=numbers,
        gaps=_GAPS,
        weights_from=told.get("weights_from", "unknown"),
        versions=[f"{each} {told['versions'][each]}" for each in _COMPUTING if each in told.get("versions", {})],
        plant=plant_in_words(identity["plant"]),
        case=_described(told.get("case"), CASES),
        pulse=_pulse(actions),
        range=f"{targets.name}, up to {targets.limit_deg:g} deg from straight ahead",
        robust=in_words(config.get("robust") or {}),
        command=command_line(policy, task) if config else "",
        angles=list(targets.angles),
        start=[0.0] * len(targets.angles),
        goal=[targets.limit_deg / 2, *[0.0] * (len(targets.angles) - 1)],
    )


def command_line(policy: Policy, task: SaccadeTask | None = None) -> str:
    """The shortest `orient-eye train` that means the settings of a policy's training.

    A surrogate or a rig that is not shipped is given as surrogate.json, rig.toml; of a policy to begin with stands the
    name alone. Weights that are not shipped are given as numbers, also where they were solved.

    Args:
        policy: with `config` in its manifest.
        task: it was trained on; None for that of its manifest.

    Raises:
        InputError: the manifest does not describe a training of this version.
    """
    task, told = task or policy.task(), policy.manifest
    config = {key: value for key, value in told["config"].items() if value is not None}  # as 0.3 said "no origin"
    apart = {key: told[key] for key in ("task", "weights_from", "case")}
    settings = TrainSettings.from_plain({**config, **apart})
    usual, words = TrainConfig(), dict[str, Any]()
    if task.plant.name != usual.plant:
        words["plant"] = task.plant.name
    words |= _plant_options(told["task"]["plant"])
    if settings.case != usual.case:
        words["case"] = settings.case
    words |= _task_options(task, settings)
    if settings.origin:
        words["from"] = Path(settings.origin).name  # until 0.6 with its path
    if settings.robust:
        words["robust"] = True
    fewest: dict[str, Any] = min((_differing(preset, settings, task) for preset in PRESETS), key=len)
    words |= fewest
    return shlex.join(["orient-eye", "train", *_options(words)])


def _plant_options(identity: dict[str, Any]) -> dict[str, Any]:
    """Of a plant's identity those options that are not the usual ones."""
    name, found = identity["plant"], {}
    options = {option.name: option for option in PLANTS[name].options}
    for key, option in options.items():
        if key in identity and identity[key] not in (option.default, None):
            found[key] = "rig.toml" if key == _RIG else identity[key]
    if _SURROGATE in options:
        limits = ("range", "speed_limit", "acceleration_limit")
        numbers = {key: value for key, value in identity.items() if key not in limits}
        shipped = [*shipped_surrogates(), *shipped_modal_surrogates()]
        of = next((each for each in shipped if _identity(name, each) in (identity, numbers)), "surrogate.json")
        if of != options[_SURROGATE].default:
            found[_SURROGATE] = of
        if numbers != identity and of != "surrogate.json":
            found[_RIG] = "rig.toml"
    return found


def _identity(plant: str, surrogate: str) -> dict[str, Any] | None:
    """Of a plant with a shipped surrogate; None where that is for another plant."""
    try:
        return make_plant(plant, surrogate=surrogate).identity()
    except InputError:
        return None


def _task_options(task: SaccadeTask, settings: TrainSettings) -> dict[str, Any]:
    """What makes a task another than the usual one of its case on its plant."""
    found: dict[str, Any] = {}
    name = task.targets.name
    if name != make_targets(None, task.plant).name:
        found["targets"] = name
    usual = SaccadeTask.of_case(task.plant, settings.case, targets=name, weights=task.weights)
    driven = tuple(settings.task["actions"]["driven"])
    if driven != tuple(usual.actions.identity()["driven"]):
        found["driven"] = driven
        usual = SaccadeTask.of_case(task.plant, settings.case, targets=name, weights=task.weights, driven=driven)
    for key, option in (("speed_limit", "speed_limit"), ("rule", "torsion")):
        value = settings.task["actions"].get(key)
        if value != usual.actions.identity().get(key):
            found[option] = value
    if not settings.weights_from.startswith("shipped"):
        found["weights"] = tuple(task.weights.values())
    if task.band != usual.band:
        found["band"] = task.band
    if settings.task["horizon_s"] not in (None, usual.horizon_s):
        found["horizon_s"] = task.horizon_s
    return found


def _differing(preset: Any, settings: TrainSettings, task: SaccadeTask) -> dict[str, Any]:
    """A preset, and the settings of the learning that are not its own."""
    usual = TrainConfig(case=settings.case, preset=preset, origin=settings.origin or None).resolved(task)
    apart = ("task", "weights_from", "case", "origin", "robust")
    named = {} if preset == TrainConfig().preset else {"preset": preset}
    differ = {key: value for key, value in vars(settings).items() if value != getattr(usual, key)}
    return named | {key: value for key, value in differ.items() if key not in apart}


def _options(words: dict[str, Any]) -> list[str]:
    """Words of a command line."""
    found = []
    for key, value in words.items():
        found.append(f"--{key.replace('_', '-')}")
        if isinstance(value, tuple):
            found += [_word(each) for each in value]
        elif value is not True:
            found.append(_word(value))
    return found


def _word(value: Any) -> str:
    """Of a number its shortest exact words."""
    short = f"{value:g}" if isinstance(value, float) else str(value)
    return short if not isinstance(value, float) or float(short) == value else repr(value)


def _described(name: str | None, registry: Registry[Any]) -> str:
    """A name and what its registry says of it."""
    if name is None or name not in registry:
        return str(name)
    summary = registry[name].summary
    return f"{name}: {summary}" if summary else name


def _pulse(actions: dict[str, Any]) -> str:
    """Of an action: its pulse and how C is chosen."""
    C, limit = actions.get("C"), actions.get("speed_limit")
    told = _described(actions.get("pulse"), PULSES)
    if C == "varying":
        return f"{told}, with the C that brings the motor to {limit:g} deg/s"
    return told if C is None else f"{told}, C = {C:g} 1/s"


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    environment.filters |= {"cell": _cell, "told": _told, "told_all": _told_all}
    return environment


def _cell(value: Any) -> str:
    """Words that a table of Markdown holds on one line."""
    text = str(value).replace("\\", "\\\\").replace("|", "\\|")
    return text if text.isprintable() else repr(text)


def _told(value: float | None, form: str, scale: float = 1.0) -> str:
    """A number, "-" where none is known."""
    return "-" if value is None else form % (scale * value)


def _told_all(values: list[float]) -> str:
    """Numbers of an option."""
    return " ".join(f"{value:g}" for value in values)
