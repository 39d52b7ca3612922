"""Options that optimum and weights share: the plant, how it is commanded, and what is asked of it."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.constants import BAND
from orient_eye.errors import InputError
from orient_eye.task.cases import Case

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from orient_eye.plants import Plant
    from orient_eye.task.saccade import SaccadeTask
    from orient_eye.task.targets import Targets


def _hint(words: str) -> Any:
    return tyro.conf.arg(help_behavior_hint=words)


@dataclass(frozen=True)
class Problem:
    """All of a task but its case and its weights."""

    plant: str = "lpf"
    """The plant that makes the saccades."""
    plant_options: dict[str, Any] = field(default_factory=dict)
    targets: Annotated[str | None, _hint("(default: horizontal, or what the plant turns)")] = None
    """Set of targets: which directions there are, and which motors are driven."""
    pulse: Annotated[str | None, _hint("(optional)")] = None
    """A pulse by itself, instead of a case."""
    C: Annotated[float | Literal["varying"] | None, _hint("(default: the pulse's own)")] = None
    """Onset rate of --pulse, 1/s, or varying: the one that brings the motor to its speed limit."""
    speed_limit: Annotated[float | None, _hint("(default: that of the slowest driven motor, else 7200)")] = None
    """Motor speed to which a varying C brings the command, deg/s."""
    band: float = BAND
    """Settling band, share of the amplitude."""

    def case(self, named: str | None) -> str | Case:
        """The case that --case names, or --pulse and --C describe; case 1 where nothing does.

        Raises:
            InputError: both are given, or --C alone.
        """
        if self.pulse is None:
            if self.C is not None:
                raise InputError("--C is the onset rate of a pulse; name the pulse too, by --pulse")
            return named or "1"
        if named is not None:
            raise InputError("--case and --pulse exclude each other: a case is a pulse with its C; give one")
        return Case(self.pulse, self.C)

    def made(self) -> "tuple[Plant, Targets]":
        """The plant, and its targets."""
        from orient_eye.plants import make_plant
        from orient_eye.task.targets import make_targets

        plant = make_plant(self.plant, **self.plant_options)
        return plant, make_targets(self.targets, plant)

    def task(
        self,
        plant: "Plant",
        targets: "Targets",
        case: str | Case,
        weights: "Mapping[str, float] | Sequence[float] | None",
    ) -> "SaccadeTask":
        """The task of a case; weights None for those of the case on the plant."""
        from orient_eye.task.saccade import SaccadeTask

        return SaccadeTask.of_case(
            plant, case, targets=targets, weights=weights, band=self.band, speed_limit=self.speed_limit
        )
