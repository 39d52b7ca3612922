"""Pulse-step generators that several motors share, as those of the brainstem do: each has a share of the motors' ways.

    command = Generators(F, way, B, k0, "smooth")    # way (saccades, generators, motors)
    command.position(t)                              # (saccades, time, motors) [deg]

A generator goes from 0 to 1 by a pulse beside an integrator (thesis 4.1, `orient_eye.commands.pulse_step`), and takes
each motor along its part of the way. With one generator for each motor this is the thesis' pulse-step.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye.cached import cached_property
from orient_eye.commands.exponentials import overlap
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.state import as_numbers, sane

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Generators:
    """A batch of commands by shared generators; numbers that are not finite fail their saccade, as a `PulseStep`'s do.

    Attributes:
        F: initial motor positions [deg], (saccades, motors).
        way: by how much each generator takes each motor [deg], (saccades, generators, motors).
        B: decay of the pulses [1/s], > 0, (saccades, generators).
        k0: gain of the integrators [1/s], > 0, (saccades, generators).
        pulse: a name of `orient_eye.commands.pulses.PULSES`.
        C: rate of the onset [1/s], (saccades, generators) or a number; for pulses that have one.

    Raises:
        InputError: as `PulseStep`, or shapes that do not fit.
    """

    F: Array
    way: Array
    B: Array
    k0: Array
    pulse: str = "1"
    C: ArrayLike | None = None
    saturates = True  # at the motors' mechanical range, as a motor would
    duration_s = None

    def __post_init__(self) -> None:
        F, way, B = (as_numbers(name, getattr(self, name)) for name in ("F", "way", "B"))
        if way.ndim != 3 or F.shape != way[:, 0].shape or B.shape != way.shape[:2]:
            raise InputError(
                "F, way, B have the shapes (saccades, motors), (saccades, generators, motors), (saccades, generators), "
                f"got {F.shape}, {way.shape}, {B.shape}"
            )
        object.__setattr__(self, "way", sane(way))
        known = np.isfinite(self.shared.D).all(axis=1, keepdims=True)
        known = known & np.isfinite(self.way).reshape(len(F), 1, -1).all(axis=2)
        object.__setattr__(self, "F", np.where(known, sane(F), np.nan))

    @cached_property
    def shared(self) -> PulseStep:
        """The generators themselves, from 0 to 1, in the place of motors."""
        one = np.ones(np.shape(self.B))
        done = PulseStep(0 * one, self.B, one, self.k0, self.pulse, self.C)
        return PulseStep(0 * one, done.B, np.where(np.isfinite(done.F), one, np.nan), done.k0, self.pulse, done.C)

    def __len__(self) -> int:
        return len(self.F)

    def __getitem__(self, which: NDArray[Any]) -> "Generators":
        """Some of the saccades."""
        C = np.broadcast_to(np.asarray(0.0 if self.C is None else self.C), np.shape(self.B))[which]
        F, way, B, k0 = (getattr(self, name)[which] for name in ("F", "way", "B", "k0"))
        return Generators(F, way, B, k0, self.pulse, None if self.C is None else C)

    @property
    def final(self) -> Array:
        """Where the motors come to stand [deg], (saccades, motors)."""
        return self.F + self.way.sum(axis=1)

    @property
    def step(self) -> Array:
        """The whole way [deg], (saccades, motors)."""
        return self.way.sum(axis=1)

    def position(self, t: ArrayLike) -> Array:
        """Motor positions [deg], (saccades, time, motors), at times t [s] (time,)."""
        return np.asarray(self.F[:, None] + self.shared.position(t) @ self.way)

    def rate(self, t: ArrayLike) -> Array:
        """Motor speeds [deg/s], (saccades, time, motors)."""
        return np.asarray(self.shared.rate(t) @ self.way)

    def sample(self, step_s: float, samples: int) -> Array:
        """Motor positions [deg] (saccades, samples, motors) at 0, step_s, 2 step_s, ... [s]."""
        return self.position(step_s * np.arange(samples))

    def energy(self) -> Array:
        """Integral of the squared motor speeds over all time and motors [deg^2/s], (saccades,); 4.35.

        The speeds of generators are sums of exponentials, and so is the integral of the product of two.
        """
        count = self.way.shape[1]
        speeds = [self.shared.rate_shape.part(g) for g in range(count)]
        together = np.einsum("sgm,shm->sgh", self.way, self.way)
        parts = (together[:, g, h] * overlap(speeds[g], speeds[h]) for g in range(count) for h in range(count))
        return np.asarray(sum(parts, np.zeros(len(self))))

    @property
    def too_fast(self) -> NDArray[np.bool_]:
        """No speed limit is kept by a C, (saccades,)."""
        return np.zeros(len(self), bool)
