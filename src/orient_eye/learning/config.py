"""What a training run is: every choice in one frozen dataclass, resolved before anything starts."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import tyro

from orient_eye.errors import InputError


def _default(words: str) -> Any:
    """What the command line says of a default that depends on the plant."""
    return tyro.conf.arg(help_behavior_hint=f"(default: {words})")


_PRESETS: dict[str, dict[str, Any]] = {
    "ours": {
        "updates": 14_000,
        "batch_size": 1024,
        "replay_size": 300_000,
        "warmup": 2048,
        "learning_rate": 1e-3,
        "last_learning_rate": 0.03,
        "temperature": (1.0, 1e-3),
        "reward_scale": "log",
    },
    "thesis": {  # 4.6; it says nothing of the temperature
        "updates": 300_000,
        "saccades_per_update": 1,
        "batch_size": 8196,
        "replay_size": 30_000,
        "warmup": 8196,
        "learning_rate": 1e-5,
        "last_learning_rate": 1.0,
        "temperature": "auto",
        "reward_scale": "raw",
    },
}


@dataclass(frozen=True)
class TrainConfig:
    """Options of a training run. Where a default depends on the plant, None stands for it."""

    plant: Literal["lpf", "mujoco", "tavares"] = "lpf"
    """What the policy learns on: the low-pass surrogate, the MuJoCo eye, or the NumPy reference."""
    surrogate: str = "thesis"
    """For lpf: a surrogate.json written by sysid, or the name of a shipped one."""
    eye: str = "thesis"
    """For mujoco and tavares: preset of the eye."""
    case: Literal["1", "2-fixed", "2-varying", "3-fixed", "3-varying"] = "1"
    """Pulse of the motor command and its onset rate C: one of the thesis' five cases (4.3, 5.1 to 5.3)."""
    speed_limit: float = 7200.0
    """Motor speed to which a varying C brings the command, deg/s."""
    weights: Annotated[tuple[float, float, float, float] | None, _default("those of the case on the plant")] = None
    """Weights of the reward: accuracy, energy, duration, overshoot (thesis 4.32; orient-eye weights)."""
    band: float = 0.01
    """Settling band, share of the amplitude."""
    preset: Literal["ours", "thesis"] = "ours"
    """Defaults of the options below: ours (minutes), or the thesis' own (4.6; many hours on a CPU)."""
    updates: Annotated[int | None, _default("14000; thesis 300000")] = None
    """Updates of the networks."""
    saccades_per_update: Annotated[int | None, _default("128 on lpf, 32 on other plants; thesis 1")] = None
    """Fresh saccades before each update."""
    batch_size: Annotated[int | None, _default("1024; thesis 8196")] = None
    """Saccades an update learns from."""
    replay_size: Annotated[int | None, _default("300000; thesis 30000")] = None
    """Saccades the replay buffer holds."""
    warmup: Annotated[int | None, _default("2048; thesis 8196")] = None
    """Saccades with random actions before the first update."""
    learning_rate: Annotated[float | None, _default("0.001; thesis 0.00001")] = None
    """Of Adam."""
    last_learning_rate: Annotated[float | None, _default("0.03; thesis 1")] = None
    """Share of the learning rate to which it falls, linearly, over the last fifth of the run."""
    temperature: Annotated[tuple[float, float] | Literal["auto"] | None, _default("1 0.001; thesis auto")] = None
    """Entropy temperature: first and last (it falls geometrically over the first 80 % of the run), or auto for
    SB3's automatic rule."""
    reward_scale: Annotated[Literal["log", "raw"] | None, _default("log; thesis raw")] = None
    """Learn on the logarithm of the reward, which has the same optimal policy, or on the reward itself."""
    device: str = "cpu"
    """Where the networks live: cpu, cuda, or cuda:NUMBER."""
    evaluation_pairs: Annotated[int | None, _default("300 on lpf, 60 on other plants")] = None
    """Random saccades held against the searched optimum."""
    seed: int = 0
    """Of everything random."""

    def resolved(self) -> "TrainConfig":
        """The configuration with no None left.

        Raises:
            InputError: a number out of its range.
        """
        from orient_eye.task.cases import get_case  # the physics, which --help does not wait for

        closed_form = self.plant == "lpf"
        weights = get_case(self.case).weights(self.plant)
        defaults = {
            "saccades_per_update": 128 if closed_form else 32,
            **_PRESETS[self.preset],
            "weights": (weights.accuracy, weights.energy, weights.duration, weights.overshoot),
            "evaluation_pairs": 300 if closed_form else 60,
        }
        config = replace(self, **{k: v for k, v in defaults.items() if getattr(self, k) is None})
        for name in ("updates", "saccades_per_update", "batch_size", "replay_size", "warmup", "evaluation_pairs"):
            if getattr(config, name) < 1:
                raise InputError(f"--{name.replace('_', '-')} must be at least 1, got {getattr(config, name)}")
        for name in ("learning_rate", "last_learning_rate", "temperature"):
            value = getattr(config, name)
            numbers = value if isinstance(value, tuple) else (value,)
            if value != "auto" and not all(0 < number < math.inf for number in numbers):
                raise InputError(f"--{name.replace('_', '-')} must be positive and finite, got {value}")
        assert config.last_learning_rate
        if config.last_learning_rate > 1:
            raise InputError(f"--last-learning-rate is a share, at most 1, got {config.last_learning_rate}")
        if config.seed < 0:
            raise InputError(f"--seed must not be negative, got {config.seed}")
        _check_device(config.device)
        return config


def _check_device(name: str) -> None:
    kind, _, number = name.partition(":")
    if kind not in ("cpu", "cuda") or (number and not number.isdecimal()):
        raise InputError(f"--device is cpu, cuda or cuda:NUMBER, got {name!r}")
    if kind == "cuda":
        import torch

        if int(number or 0) >= torch.cuda.device_count():
            raise InputError(
                f"--device {name}: torch sees {torch.cuda.device_count()} CUDA devices on this machine; use cpu"
            )
