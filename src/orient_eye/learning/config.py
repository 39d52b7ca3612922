"""What a training run is: `TrainConfig` is what a user may say, `TrainSettings` what a run is made of.

    settings = TrainConfig(plant="mujoco", updates=5000).resolved()

In a `TrainConfig` None stands for what depends on the plant or the preset; in `TrainSettings` nothing is open.
Their docstrings are the help of `orient-eye train`.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.checks import real, shown, whole
from orient_eye.constants import BAND, DOUBT
from orient_eye.errors import InputError

if TYPE_CHECKING:
    from orient_eye.task.saccade import SaccadeTask


def _default(words: str) -> Any:
    """What the command line says of a default that depends on something."""
    return tyro.conf.arg(help_behavior_hint=f"(default: {words})")


PRESETS: dict[str, dict[str, Any]] = {
    "ours": {
        "saccades_per_update": 16,
        "updates_per_rollout": 8,
        "batch_size": 512,
        "replay_size": 60_000,
        "warmup": 4096,
        "learning_rate": 3e-3,
        "last_learning_rate": 0.03,
        "second_moment": 0.98,
        "temperature": (0.1, 1e-3),
        "reward_scale": "log",
    },
    "thesis": {  # 4.6; it says nothing of the temperature
        "updates": 300_000,
        "updates_per_rollout": 1,
        "saccades_per_update": 1,
        "batch_size": 8196,
        "replay_size": 30_000,
        "warmup": 8196,
        "learning_rate": 1e-5,
        "last_learning_rate": 1.0,
        "second_moment": 0.999,
        "temperature": "auto",
        "reward_scale": "raw",
    },
}
FINE_TUNING: dict[str, Any] = {"updates": 4000, "warmup": 512, "temperature": (1e-3, 3e-4), "learning_rate": 1e-3}
"""What differs where a run begins with a policy."""
_WHOLE = {
    "updates": (1, 10**8),
    "updates_per_rollout": (1, 10**4),
    "saccades_per_update": (1, 10**5),
    "batch_size": (1, 10**5),  # 0.7 GB
    "replay_size": (1, 10**7),  # 0.5 GB
    "warmup": (1, 10**7),
    "evaluation_pairs": (1, 10**4),
    "seed": (0, 2**63 - 1),
}
_REAL = {
    "learning_rate": (1e-12, 1.0),
    "last_learning_rate": (0.0, 1.0),
    "second_moment": (0.0, 1 - 1e-9),
    "doubt": (1e-12, 0.5),
}
_ROLLOUT = 10**5  # saccades performed at once: 0.6 GB on a simulated eye
_TEMPERATURE = 1e-12, 1e6


@dataclass(frozen=True)
class TrainConfig:
    """Options of a training run. Where a default depends on something, None stands for it."""

    plant: str = "lpf"
    """Plant on which the policy learns."""
    plant_options: dict[str, Any] = field(default_factory=dict)
    """Options of that plant, by name."""
    case: str = "1"
    """Learning case: the pulse of the motor command and its onset rate C (thesis 4.3, 5.1 to 5.3)."""
    targets: Annotated[str | None, _default("horizontal, or what the plant turns")] = None
    """Set of targets between which saccades are made."""
    driven: Annotated[tuple[str, ...] | None, _default("those that the targets need")] = None
    """Motors that the policy commands; the others stay where they are."""
    speed_limit: Annotated[float | None, _default("that of the slowest driven motor, else 7200")] = None
    """Motor speed to which a varying C brings the command, in deg/s."""
    weights: Annotated[
        tuple[float, ...] | dict[str, float] | None,
        tyro.conf.arg(metavar="WEIGHT ...", help_behavior_hint="(default: those of the case on the plant)"),
    ] = None
    """Weights of the reward's terms: accuracy, energy, duration, overshoot (thesis 4.32; see orient-eye weights), and
    between gaze targets force (docs/gaze.md)."""
    end_point_error_deg: Annotated[
        float | None, tyro.conf.arg(name="end-point-error", help_behavior_hint="(default: 0.25 on a rig)")
    ] = None
    """End-point error one can live with, deg at 5 deg: sets the weights by rule, on any plant (docs/weights.md)."""
    torsion: Annotated[Literal["least force", "listing", "fick"] | None, _default("that of the least force")] = None
    """Torsion with which the usual command of gaze targets holds its target: the policy's actions are told from that
    command, and it begins with it."""
    origin: Annotated[str | None, tyro.conf.arg(name="from", metavar="POLICY", help_behavior_hint="(optional)")] = None
    """A policy to begin with, of the same targets and kind of actions: fine-tuning on another plant. Its first tenth
    trains the Q network alone."""
    robust: bool = False
    """Perform each saccade on another eye of the 95 % intervals that sysid found, and say what that costs."""
    band: float = BAND
    """Settling band as a share of the amplitude: the saccade lasts until the eye stays within it."""
    horizon_s: Annotated[float | None, _default("the plant's own")] = None
    """How long a simulated saccade lasts, in s."""
    preset: Literal["ours", "thesis"] = "ours"
    """Defaults of the options below: ours (minutes), or the thesis' own (4.6; many hours on a CPU)."""
    updates: Annotated[
        int | None,
        _default("10000, 7000 on a simulated eye; gaze 26000, 72000 of six motors; with --from 4000; thesis 300000"),
    ] = None
    """How many times the networks are updated; a multiple of 8 is quickest with ours."""
    saccades_per_update: Annotated[int | None, _default("16; gaze of six motors 4; thesis 1")] = None
    """Fresh saccades performed for each update."""
    updates_per_rollout: Annotated[
        int | None, _default("8, 32 of six motors, or what divides the updates; thesis 1")
    ] = None
    """Updates between two rollouts: a rollout performs the saccades of that many updates in one batch."""
    batch_size: Annotated[int | None, _default("512; gaze of three motors 1024; thesis 8196")] = None
    """Saccades that one update learns from."""
    replay_size: Annotated[int | None, _default("60000; gaze 150000; thesis 30000")] = None
    """Saccades that the replay buffer holds."""
    warmup: Annotated[int | None, _default("4096; with --from 512; thesis 8196")] = None
    """Saccades with random actions before the first update."""
    learning_rate: Annotated[
        float | None, _default("0.003, gaze of six motors 0.002; with --from 0.001; thesis 0.00001")
    ] = None
    """Learning rate of the optimiser (Adam)."""
    last_learning_rate: Annotated[float | None, _default("0.03; thesis 1")] = None
    """Share of the learning rate that is left at the end; it falls linearly over the last 60 % of the run."""
    second_moment: Annotated[float | None, _default("0.98; thesis 0.999")] = None
    """Adam's decay of its mean of squared gradients: how long a large gradient is remembered."""
    temperature: Annotated[
        tuple[float, float] | Literal["auto"] | None,
        _default("0.1 0.001; gaze 0.02 0.0003, with --from 0.001 0.0003; thesis auto"),
    ] = None
    """Entropy temperature at the beginning and at the end; it falls geometrically over the first 80 % of the run.
    With auto it follows the automatic rule of Stable-Baselines3."""
    reward_scale: Annotated[Literal["log", "raw"] | None, _default("log; thesis raw")] = None
    """Whether to learn on the logarithm of the reward, which has the same optimal policy, or on the raw reward."""
    doubt: Annotated[float | None, _default("0.000001; gaze 0.001")] = None
    """Share of the amplitude by which a measure may be wrong while the policy learns, because a simulated saccade was
    not stepped on until nothing is left of it; it is always judged at 0.000001."""
    device: str = "cpu"
    """Device on which the networks live: cpu, cuda, or cuda:NUMBER."""
    evaluation_pairs: Annotated[
        int | None, _default("300 in closed form, 30 on a rig, 60 simulated, 24 between gaze targets")
    ] = None
    """Random saccades on which the policy is held against the searched optimum."""
    seed: int = 0
    """Seed of everything random in the run."""

    def make_task(self) -> "SaccadeTask":
        """Plant, actions, targets and reward that the options describe.

        Raises:
            InputError: an unknown name, or options that do not go together.
        """
        from orient_eye.plants import make_plant  # the physics, which --help does not wait for
        from orient_eye.task.judge import JUDGES
        from orient_eye.task.known_weights import solve
        from orient_eye.task.saccade import SaccadeTask
        from orient_eye.task.targets import make_targets

        if self.weights is not None and self.end_point_error_deg is not None:
            raise InputError("weights and end_point_error_deg both set the reward's weights; give one of them")
        plant = make_plant(self.plant, **self.plant_options)
        targets = make_targets(self.targets, plant, driven=self.driven)
        weights = self.weights
        if self.end_point_error_deg is not None:
            weights = JUDGES[targets.of].any_weights  # until they are set
        task = SaccadeTask.of_case(
            plant,
            self.case,
            targets=targets,
            driven=self.driven,
            weights=weights,
            band=self.band,
            speed_limit=self.speed_limit,
            horizon_s=self.horizon_s,
            action_options=None if self.torsion is None else {"rule": self.torsion},
        )
        if self.end_point_error_deg is None:
            return task
        solved, where = solve(task, self.end_point_error_deg)
        return replace(task, weights=solved, weights_from=where)

    def resolved(self, task: "SaccadeTask | None" = None) -> "TrainSettings":
        """The settings of a run, with nothing left open.

        Args:
            task: from `make_task`, where it is made already.

        Raises:
            InputError: an unknown name, options that do not go together, or a number out of its range.
        """
        if self.preset not in PRESETS:
            raise InputError(f"unknown preset {self.preset!r}; choose one of {', '.join(PRESETS)}")
        task = task or self.make_task()
        shared = {f.name for f in fields(TrainSettings)} & {f.name for f in fields(TrainConfig)}
        values: dict[str, Any] = {
            "updates": task.plant.updates,
            "evaluation_pairs": task.plant.evaluation_pairs,
            **PRESETS[self.preset],
            **(task.targets.learning if self.preset == "ours" else {}),
            **(FINE_TUNING if self.origin is not None and self.preset == "ours" else {}),
            **{name: getattr(self, name) for name in shared if getattr(self, name) is not None},
        }
        if self.updates_per_rollout is None and isinstance(values["updates"], int):
            values["updates_per_rollout"] = math.gcd(values["updates"], values["updates_per_rollout"])
        path = None if self.origin is None else Path(self.origin)  # else the name of a shipped policy
        values["origin"] = str(path.resolve()) if path is not None and path.exists() else self.origin or ""
        values["robust"] = _intervals(task) if self.robust else {}
        return TrainSettings(task=task.identity(), weights_from=task.weights_from, **values)


@dataclass(frozen=True)
class TrainSettings:
    """A training run with nothing left open: what run.json holds, and all that a run is made of.

    Attributes:
        task: identity of plant, actions, targets and reward (`SaccadeTask.identity`).
        weights_from: where the reward's weights are from, in words.
        case: name of the learning case.
        doubt: that of the plant on which it learns.
        origin: the policy with which it begins, with its whole path; none for a new one.
        robust: low and high of the plant's numbers, drawn anew for each saccade; none for the plant as it is.

    The others are those of `TrainConfig`.

    Raises:
        InputError: a number out of its range, or a device that is not there.
    """

    task: dict[str, Any]
    weights_from: str
    case: str
    updates: int
    updates_per_rollout: int
    saccades_per_update: int
    batch_size: int
    replay_size: int
    warmup: int
    learning_rate: float
    last_learning_rate: float
    second_moment: float
    temperature: tuple[float, float] | Literal["auto"]
    reward_scale: Literal["log", "raw"]
    device: str
    evaluation_pairs: int
    seed: int
    doubt: float = DOUBT
    origin: str = ""
    robust: dict[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, (least, most) in _WHOLE.items():
            whole(name.replace("_", " "), getattr(self, name), least, most)
        for name, (low, high) in _REAL.items():
            real(name.replace("_", " "), getattr(self, name), low, high)
        for name in ("case", "origin", "weights_from"):
            _require(isinstance(getattr(self, name), str), name.replace("_", " "), "words", getattr(self, name))
        whole("updates per rollout x saccades per update", self.saccades_per_rollout, 1, _ROLLOUT)
        words = f"a number that divides the {self.updates} updates"
        _require(self.updates % self.updates_per_rollout == 0, "updates per rollout", words, self.updates_per_rollout)
        pair = isinstance(self.temperature, list | tuple) and len(self.temperature) == 2
        words = "'auto', or a first and a last one"
        _require(pair or self.temperature == "auto", "temperature", words, self.temperature)
        if pair:  # a list, as JSON has it
            ends = tuple(real("temperature", value, *_TEMPERATURE) for value in self.temperature)
            object.__setattr__(self, "temperature", ends)
        robust = {str(name): (float(ends[0]), float(ends[1])) for name, ends in self.robust.items()}
        object.__setattr__(self, "robust", robust)
        _require(self.reward_scale in ("log", "raw"), "reward scale", "log or raw", self.reward_scale)
        _check_device(self.device)

    @property
    def saccades_per_rollout(self) -> int:
        """Saccades performed in one batch."""
        return self.saccades_per_update * self.updates_per_rollout

    @property
    def warmup_rollouts(self) -> int:
        """Batches before the first update."""
        return -(-self.warmup // self.saccades_per_rollout)

    @property
    def rollouts(self) -> int:
        """All batches of the run."""
        return self.warmup_rollouts + self.updates // self.updates_per_rollout

    def make_task(self) -> "SaccadeTask":
        """The task again, as it was."""
        from orient_eye.task.saccade import SaccadeTask

        return replace(SaccadeTask.restore(self.task), weights_from=self.weights_from)

    @classmethod
    def from_plain(cls, content: Mapping[str, Any]) -> "TrainSettings":
        """The settings that run.json holds.

        Raises:
            InputError: they are not of this version.
        """
        try:
            return cls(**content)
        except (AttributeError, LookupError, TypeError) as error:
            raise InputError(f"these settings are not of this version of orient-eye: {error}") from error


def _intervals(task: "SaccadeTask") -> dict[str, tuple[float, float]]:
    """Those of the task's plant."""
    from orient_eye.plants.uncertain import uncertain

    return uncertain(task.plant).intervals


def _require(fits: bool, name: str, allowed: str, value: Any) -> None:
    if not fits:
        raise InputError(f"{name} must be {allowed}, got {shown(value)}")


def _check_device(name: str) -> None:
    if not re.fullmatch(r"(cpu|cuda)(:\d{1,3})?", str(name)):
        raise InputError(f"device must be cpu, cuda or cuda:NUMBER, got {shown(name)}")
    kind, _, number = name.partition(":")
    if kind == "cuda":
        import torch

        if int(number or 0) >= torch.cuda.device_count():
            raise InputError(
                f"device {name}: torch sees {torch.cuda.device_count()} CUDA devices on this machine; use cpu"
            )
