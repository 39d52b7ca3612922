"""The options --start, --target and --pairs."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from orient_eye.state import State
    from orient_eye.task.targets import Targets

    Array = NDArray[np.float64]


def _angles(words: str) -> Any:
    return tyro.conf.arg(metavar="ANGLE ...", help_behavior_hint=words)


@dataclass(frozen=True)
class Saccades:
    """Which saccades, told by the angles of the task's targets."""

    start: Annotated[tuple[float, ...] | None, _angles("(default: straight ahead)")] = None
    """Direction in which the saccade begins, deg: one number for horizontal targets, the yaw, positive to the left; for
    gaze targets two, yaw and pitch, positive down."""
    target: Annotated[tuple[float, ...] | None, _angles("(required without --pairs)")] = None
    """Direction in which it should end, deg, told the same way."""
    pairs: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(optional)")] = None
    """Many saccades instead: a CSV file with the columns start_yaw_deg and target_yaw_deg, for gaze targets
    start_pitch_deg and target_pitch_deg too."""

    def angles(self, targets: "Targets", *, drawn: bool = False, moving: bool = False) -> "tuple[Array, Array]":
        """Angles [deg] (saccades, angles) of starts and targets.

        Args:
            targets: of the task.
            drawn: refuse also what the targets never draw.
            moving: refuse also saccades that end where they start.

        Raises:
            InputError: both or neither are given, other numbers of angles, or what `Targets.check` refuses; of a table
                with the line.
        """
        import numpy as np

        if self.pairs is not None and (self.start is not None or self.target is not None):
            raise InputError("give --pairs, or --start and --target, not both")
        if self.pairs is not None:
            ends, lines = _read(self.pairs, targets.angles)
        elif self.target is None:
            raise InputError(
                f"name a saccade by --start and --target ({_told(targets.angles)}), or many by --pairs FILE.csv"
            )
        else:
            begin = (0.0,) * len(targets.angles) if self.start is None else self.start
            given = {"start": begin, "target": self.target}
            start, target = (np.array([direction(targets.angles, given[what], what)]) for what in given)
            ends, lines = (start, target), ()
        for what, angles in zip(("start", "target"), ends, strict=True):
            try:
                targets.check(angles, what, drawn=drawn)
            except InputError:
                for line, one in zip(lines, angles, strict=False):  # which it was; none where there is no table
                    targets.check(one[None], f"{self.pairs}, line {line}: {what}", drawn=drawn)
                raise
        still = (ends[0] == ends[1]).all(axis=1).nonzero()[0]
        if moving and len(still):
            named = f"{self.pairs}, line {lines[still[0]]}: the saccade" if lines else "saccade 1"
            raise InputError(f"{named} starts at its target: a saccade goes from one direction to another")
        return ends


def direction(angles: tuple[str, ...], given: tuple[float, ...], what: str) -> tuple[float, ...]:
    """Where a saccade starts or ends, if it is told by as many numbers as there are angles.

    Raises:
        InputError: by another number of them.
    """
    if len(given) != len(angles):
        raise InputError(f"--{what} takes {_told(angles)}: as many numbers, not {len(given)}")
    return given


def read_pairs(path: Path, angles: tuple[str, ...]) -> "tuple[Array, Array]":
    """Angles [deg] (saccades, angles) of starts and targets, from the columns start_ANGLE and target_ANGLE of a table.

    Raises:
        InputError: unreadable, a column missing, no rows, or cells that are no finite numbers.
    """
    return _read(path, angles)[0]


def _read(path: Path, angles: tuple[str, ...]) -> "tuple[tuple[Array, Array], tuple[int, ...]]":
    """The same, and the line of each."""
    from orient_eye.tables import read_table

    names = [tuple(f"{what}_{angle}" for angle in angles) for what in ("start", "target")]
    table = read_table(path, ",".join(names[0] + names[1]))
    return (table.stack(names[0]), table.stack(names[1])), table.lines


def refuse_no_saccade(start: "State", target: "Array") -> None:
    """Refuse saccades (saccades,) that go nowhere.

    Raises:
        InputError: says which.
    """
    from orient_eye.rotations import angle_between

    for i in (angle_between(start.orientation, target) == 0).nonzero()[0]:
        raise InputError(f"saccade {i + 1} starts at its target: a saccade goes from one direction to another")


def _told(angles: tuple[str, ...]) -> str:
    return ", ".join(f"{angle.removesuffix('_deg').upper()} [deg]" for angle in angles)
