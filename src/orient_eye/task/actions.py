"""What an action means: described numbers, and the command they make.

    actions = PulseStepActions(plant, driven=("motor2",), pulse="1")
    actions.names                                    # ("B", "D", "k0")
    actions.command(start, target, action)           # action (saccades, numbers), in units
    actions.from_unit(scaled)                        # from a network's -1 .. 1

Search, policy, environment and command line know of an action what stands in its `Number`s. Another kind of
action is a class with these members and a line in `ACTIONS`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye.cached import cached_property
from orient_eye.checks import real
from orient_eye.commands import Command
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.commands.pulses import PULSES, keeps_speed_limit, varying_C
from orient_eye.constants import SPEED_LIMIT
from orient_eye.errors import InputError
from orient_eye.motor import check_driven
from orient_eye.plants import Plant, PulseRates
from orient_eye.registry import Registry
from orient_eye.state import State

Array = NDArray[np.float64]
B_RANGE = (18.0, 80.0)
"""Bounds of B in the action [1/s]."""
K0_RANGE = (5.0, 40.0)
"""Bounds of k0 in the action [1/s]."""
C_BOUNDS, SPEED_BOUNDS = (1.0, 1e5), (1.0, 1e5)
"""Of an onset rate [1/s] and of a motor's speed limit [deg/s] that somebody names."""


@dataclass(frozen=True)
class Number:
    """One number of an action.

    Attributes:
        symbol: of the thesis, where it has one.
        unit: "1/s".
        motor: that it commands; "" for several.
        low: least value.
        high: largest value.
        log: spread evenly on a logarithmic scale.
        fine: share of the range around a good value in which a search looks closer.
        cliff: whether the reward may have a cliff along it, so that a search stays on all sides.

    Raises:
        InputError: bounds that are none.
    """

    symbol: str
    unit: str
    motor: str
    low: float
    high: float
    log: bool = False
    fine: float = 0.03
    cliff: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite([self.low, self.high]).all() and (0 if self.log else -np.inf) < self.low < self.high):
            positive = ", above 0 on a logarithmic scale" if self.log else ""
            raise InputError(
                f"{self.symbol} of an action goes from a number up to a larger one{positive}, got {self.low} to "
                f"{self.high}"
            )


class ActionSpace(ABC):
    """What an action means. A subclass has `numbers` and writes `command`, `likely` and `identity`."""

    numbers: tuple[Number, ...]

    @abstractmethod
    def command(self, start: State, target: Array, action: Array) -> Command:
        """The motor command of an action.

        Args:
            start: of the eyes.
            target: desired orientations, (saccades, 4).
            action: in units, (saccades, numbers).
        """

    @abstractmethod
    def likely(self, target: Array) -> Array:
        """Values near which the best action probably is, (saccades, numbers); NaN where nothing is known."""

    @abstractmethod
    def identity(self) -> dict[str, Any]:
        """What makes these actions these ones, in plain values: `actions`, their kind, and its options."""

    @property
    def plain(self) -> "ActionSpace":
        """The same commands, told without regard to the saccade: there the best action is searched and told."""
        return self

    def as_plain(self, start: State, target: Array, action: Array) -> Array:
        """The actions (saccades, numbers) of `plain` that make the same commands; arguments as `command`'s."""
        return action

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the numbers: symbols, of several motors B_motor1, B_motor2, ..."""
        several = len({number.motor for number in self.numbers}) > 1
        return tuple(f"{n.symbol}_{n.motor}" if several and n.motor else n.symbol for n in self.numbers)

    @cached_property
    def low(self) -> Array:
        """Lower bounds, (numbers,)."""
        return np.array([number.low for number in self.numbers])

    @cached_property
    def high(self) -> Array:
        """Upper bounds, (numbers,)."""
        return np.array([number.high for number in self.numbers])

    @cached_property
    def log(self) -> NDArray[np.bool_]:
        """Which are on a logarithmic scale, (numbers,)."""
        return np.array([number.log for number in self.numbers])

    def from_unit(self, scaled: ArrayLike) -> Array:
        """Actions in units from -1 .. 1, (saccades, numbers); what is beyond is cut off."""
        return scale(scaled, self.low, self.high, self.log)

    def to_unit(self, action: Array) -> Array:
        """The inverse of `from_unit`."""
        with np.errstate(invalid="ignore", divide="ignore"):
            linear = (action - self.low) / (self.high - self.low)
            if not self.log.any():
                return np.asarray(2 * linear - 1)
            low, high = np.where(self.log, self.low, 1), np.where(self.log, self.high, np.e)
            logarithmic = np.log(np.where(self.log, action, 1) / low) / np.log(high / low)
        return np.asarray(2 * np.where(self.log, logarithmic, linear) - 1)


def scale(scaled: ArrayLike, low: Array, high: Array, log: NDArray[np.bool_]) -> Array:
    """Values between bounds (numbers,) from -1 .. 1 (..., numbers), on a linear or a logarithmic scale."""
    shares = (np.clip(np.asarray(scaled, float), -1, 1) + 1) / 2
    linear = low + shares * (high - low)
    if not log.any():
        return np.asarray(linear)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(log, low * (high / low) ** shares, linear))


class PulseStepActions(ActionSpace):
    """B, D and k0 of a pulse-step for each driven motor (thesis 4.2, 4.3).

    Args:
        plant: whose motors are commanded.
        driven: motors that the action commands; the others stay where they are.
        pulse: a name of `orient_eye.commands.pulses.PULSES`.
        C: onset rate [1/s] of a pulse that has one; None for the thesis' fixed value, "varying" for the one that
            brings the motor to the speed limit.
        speed_limit: V [deg/s], for a varying C; None for that of the slowest driven motor, or the thesis' 7200 where
            none is limited.
        rates: bounds of B and k0, or a mapping of them; None for the plant's own.

    Raises:
        InputError: motors the plant has not, an unknown pulse, a C that is none, or a speed limit that is none.
    """

    kind = "pulse-step"

    def __init__(
        self,
        plant: Plant,
        driven: Sequence[str],
        pulse: str = "1",
        C: float | str | None = None,
        speed_limit: float | None = None,
        rates: PulseRates | Mapping[str, Sequence[float]] | None = None,
    ) -> None:
        self.plant, self.driven, self.pulse = plant, tuple(driven), pulse
        self.index = check_driven(plant.motors, self.driven, plant.name)
        known = (plant.motors[i].speed_limit for i in self.index)
        self.speed_limit = min((limit for limit in known if limit), default=SPEED_LIMIT)
        if speed_limit is not None:
            self.speed_limit = real("the speed limit", speed_limit, *SPEED_BOUNDS, unit="deg/s")
        onset = PULSES[pulse].onset
        if onset is None and C is not None:
            raise InputError(f"pulse {pulse!r} has no onset rate C; leave C = {C} out")
        if C is not None and C != "varying":
            C = real("the onset rate C", C, *C_BOUNDS, unit="1/s", advice="or 'varying'")
        self.C = onset.fixed if onset and C is None else C
        self.rates = PulseRates(**{k: (v[0], v[1]) for k, v in rates.items()}) if isinstance(rates, Mapping) else rates
        log = self.rates is not None or plant.pulse_rates is not None
        rates = self.rates or plant.pulse_rates or PulseRates(B_RANGE, K0_RANGE)
        self.numbers = tuple(
            number
            for motor in (plant.motors[i] for i in self.index)
            for number in (
                Number("B", "1/s", motor.name, *rates.B, log=log, fine=0.05),
                Number(
                    "D", motor.unit, motor.name, *_finite(motor.working), fine=0.002 if len(self.index) == 1 else 0.006
                ),
                Number("k0", "1/s", motor.name, *rates.k0, log=log, fine=0.03, cliff=True),
            )
        )

    def identity(self) -> dict[str, Any]:
        """Kind, motors, pulse, C, speed limit where C varies, and bounds; their scale follows from the plant."""
        return {
            "actions": self.kind,
            "driven": list(self.driven),
            "pulse": self.pulse,
            "C": self.C,
            "speed_limit": self.speed_limit if self.C == "varying" else None,
            **({} if self.rates is None else {"rates": {"B": list(self.rates.B), "k0": list(self.rates.k0)}}),
            "low": self.low.tolist(),
            "high": self.high.tolist(),
        }

    def command(self, start: State, target: Array, action: Array) -> PulseStep:
        """A pulse-step of all motors; those that are not driven are told to stay."""
        each = np.asarray(action, float).reshape(len(start), len(self.index), 3)
        F, shape = start.motor, start.motor.shape
        B, D, k0 = np.ones(shape), F.copy(), np.ones(shape)
        for values, column in ((B, 0), (D, 1), (k0, 2)):
            values[:, self.index] = each[..., column]
        if self.C != "varying":
            return PulseStep(F, B, D, k0, self.pulse, self.C)
        pulse = PULSES[self.pulse]
        C = varying_C(pulse, D - F, B, k0, self.speed_limit)
        keeps = keeps_speed_limit(pulse, D - F, B, k0, self.speed_limit)[:, self.index]
        return PulseStep(F, B, D, k0, self.pulse, C, too_fast=np.asarray(~keeps.all(axis=1)))

    def likely(self, target: Array) -> Array:
        """D is near where the eye rests on the target."""
        found = np.full((len(target), len(self.numbers)), np.nan)
        found[:, 1::3] = self.plant.hold(target, self.driven)[:, self.index]
        return found


def _finite(working: tuple[float, float]) -> tuple[float, float]:
    if not np.isfinite(working).all():
        raise InputError(f"a motor that a policy drives needs a finite working range, got {working}")
    return working


ACTIONS: Registry[Callable[..., ActionSpace]] = Registry(
    "action",
    {
        PulseStepActions.kind: PulseStepActions,
        "residual": "orient_eye.task.residual_actions:ResidualActions",
        "generators": "orient_eye.task.generator_actions:GeneratorActions",
        "generator-ratios": "orient_eye.task.generator_actions:GeneratorRatios",
    },
)
"""Kind to class; each takes the plant, the driven motors, and options of its own."""


def restore_actions(identity: dict[str, Any], plant: Plant) -> ActionSpace:
    """The action space of an identity on a plant; its bounds are those of the plant."""
    options = {k: v for k, v in identity.items() if k not in ("actions", "low", "high") and v is not None}
    return ACTIONS[str(identity["actions"])](plant, **options)
