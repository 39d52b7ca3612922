"""What a training run is: every choice in one frozen dataclass, resolved before anything starts."""

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import tyro

from orient_eye.errors import InputError


def _default(words: str) -> Any:
    """What the command line says of a default that depends on the plant."""
    return tyro.conf.arg(help_behavior_hint=f"(default: {words})")


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
    weights: Annotated[tuple[float, float, float, float] | None, _default("those of the case")] = None
    """Weights of the reward: accuracy, energy, duration, overshoot (thesis 4.32; orient-eye weights)."""
    band: float = 0.01
    """Settling band, share of the amplitude."""
    updates: int = 14_000
    """Updates of the networks."""
    saccades_per_update: Annotated[int | None, _default("128 on lpf, 32 on other plants")] = None
    """Fresh saccades before each update."""
    batch_size: int = 512
    """Saccades an update learns from."""
    replay_size: int = 300_000
    """Saccades the replay buffer holds."""
    warmup: int = 2048
    """Saccades with random actions before the first update."""
    learning_rate: float = 1e-3
    """Of Adam; it falls linearly to 3 % of this over the last fifth of the run."""
    temperature: tuple[float, float] = (1.0, 1e-3)
    """Entropy temperature: first and last; it falls geometrically over the first 80 % of the run."""
    reward_scale: Literal["log", "raw"] = "log"
    """Learn on the logarithm of the reward, which has the same optimal policy, or on the reward itself."""
    evaluation_pairs: Annotated[int | None, _default("300 on lpf, 60 on other plants")] = None
    """Random saccades held against the searched optimum."""
    seed: int = 0
    """Of everything random."""

    def resolved(self) -> "TrainConfig":
        """The configuration with no None left.

        Raises:
            InputError: a number out of its range.
        """
        from orient_eye.cases import get_case  # the physics, which --help does not wait for

        closed_form = self.plant == "lpf"
        weights = get_case(self.case).weights
        defaults = {
            "weights": (weights.accuracy, weights.energy, weights.duration, weights.overshoot),
            "saccades_per_update": 128 if closed_form else 32,
            "evaluation_pairs": 300 if closed_form else 60,
        }
        config = replace(self, **{k: v for k, v in defaults.items() if getattr(self, k) is None})  # type: ignore[arg-type]
        for name in ("updates", "saccades_per_update", "batch_size", "replay_size", "warmup", "evaluation_pairs"):
            if getattr(config, name) < 1:
                raise InputError(f"--{name.replace('_', '-')} must be at least 1, got {getattr(config, name)}")
        if not config.learning_rate > 0 or not min(config.temperature) > 0:
            raise InputError("--learning-rate and --temperature must be positive")
        if config.seed < 0:
            raise InputError(f"--seed must not be negative, got {config.seed}")
        return config
