"""What the motors are told: a batch of commands over time.

    command = PulseStep(F=F, B=B, D=D, k0=k0)        # thesis 4.3, closed form
    command = Sampled(positions, step_s=0.001)       # any positions (saccades, time, motors)
    command.sample(0.001, 501)                       # (saccades, 501, motors)

A command covers all motors of a plant; one that is not to move is told its rest position throughout.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from orient_eye.checks import real
from orient_eye.constants import LONGEST_S
from orient_eye.errors import InputError

if TYPE_CHECKING:  # the names of pulses are listed without NumPy
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class Command(Protocol):
    """Motor commands of a batch of saccades, from time 0 on.

    Attributes:
        saturates: what a plant does where the command is beyond a motor's mechanical range: a policy's pulse is
            cut off there and the movement says so (True), a command that somebody wrote down is refused (False).
        duration_s: how long it says something; None for a command without an end. The last position is held.
    """

    @property
    def saturates(self) -> bool:
        """See the class."""
        ...

    @property
    def duration_s(self) -> float | None:
        """See the class."""
        ...

    def __len__(self) -> int:
        """Number of saccades."""
        ...

    def sample(self, step_s: float, samples: int) -> Array:
        """Motor positions (saccades, samples, motors) at 0, step_s, 2 step_s, ... [s]."""
        ...

    @property
    def final(self) -> Array:
        """Where the motors come to stand, (saccades, motors)."""
        ...

    def energy(self) -> Array:
        """Integral of the squared motor speeds over all time and motors [deg^2/s], (saccades,); thesis 4.35."""
        ...

    @property
    def too_fast(self) -> NDArray[np.bool_]:
        """Whether the command was to keep a speed limit and cannot, (saccades,)."""
        ...


@dataclass(frozen=True)
class Sampled:
    """Positions at even intervals, straight lines between them, the last one held.

    Attributes:
        positions: (saccades, time, motors); NaN where they are not finite, or beyond 1e9.
        step_s: interval [s], from 1 us to an hour.
        saturates: see `Command`.

    Raises:
        InputError: another shape, what are no real numbers, or another interval.
    """

    positions: Array
    step_s: float
    saturates: bool = False

    def __post_init__(self) -> None:
        from orient_eye.state import as_numbers, sane

        positions = as_numbers("the positions (saccades, time, motors) of a command", self.positions)
        checked_step(self.step_s)
        if positions.ndim != 3 or not positions.shape[1]:
            raise InputError(f"a command has the shape (saccades, time, motors), got {positions.shape}")
        object.__setattr__(self, "positions", sane(positions))

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def duration_s(self) -> float:
        """Of the rows."""
        return (self.positions.shape[1] - 1) * self.step_s

    def sample(self, step_s: float, samples: int) -> Array:
        """See `Command.sample`; at the command's own interval the positions as they are."""
        import numpy as np

        own = self.positions.shape[1]
        if step_s == self.step_s:
            held = np.minimum(np.arange(samples), own - 1)
            return self.positions[:, held]
        at = np.minimum(np.arange(samples) * (step_s / self.step_s), own - 1)
        row = np.minimum(at.astype(int), max(own - 2, 0))
        share = (at - row)[:, None]
        following = np.minimum(row + 1, own - 1)
        return np.asarray((1 - share) * self.positions[:, row] + share * self.positions[:, following])

    @property
    def final(self) -> Array:
        """The last row."""
        return self.positions[:, -1]

    def energy(self) -> Array:
        """Of the straight lines."""
        return path_energy(self.positions, self.step_s)

    @property
    def too_fast(self) -> NDArray[np.bool_]:
        """Nothing was to be kept."""
        import numpy as np

        return np.zeros(len(self), bool)


def checked_step(step_s: float) -> float:
    """An interval between samples [s].

    Raises:
        InputError: it is none, shorter than 1 us, or longer than any movement.
    """
    return real("the interval step_s between samples", step_s, 1e-6, LONGEST_S, unit="s")


def path_energy(positions: Array, step_s: float) -> Array:
    """Integral of the squared speeds along straight lines between positions (saccades, time, motors), (saccades,)."""
    import numpy as np

    return np.asarray((np.diff(positions, axis=1) ** 2).sum(axis=(1, 2)) / step_s)


def as_command(command: Any, step_s: float) -> Command:
    """A command as it is, or an array of positions (saccades, time, motors) at a plant's step."""
    return command if hasattr(command, "sample") else Sampled(command, step_s)
