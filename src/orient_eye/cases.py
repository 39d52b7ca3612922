"""The five learning cases of the thesis (its Chapter 5): a pulse, its C, and the weights of the reward.

The weights make B = 35, k0 = 17.5 and K D = 30 deg the optimal saccade from 0 to 30 deg on the thesis'
low-pass plant with a settling band of 1 %; `orient-eye weights` solves them again.
"""

from dataclasses import dataclass

from orient_eye.errors import InputError
from orient_eye.pulse_step import FIXED_C
from orient_eye.reward import Weights


@dataclass(frozen=True)
class Case:
    """A kind of motor command and how its saccades are judged.

    Attributes:
        variant: of the pulse (thesis 4.3).
        C: onset rate [1/s], "varying" for the one that brings the motor to its speed limit, None in
            variant 1.
        weights: of the reward.
        section: of the thesis that has its results.
    """

    variant: int
    C: float | str | None
    weights: Weights
    section: str


CASES: dict[str, Case] = {
    "1": Case(1, None, Weights(), "5.1"),
    "2-fixed": Case(2, FIXED_C[2], Weights(accuracy=1.21e8, duration=2.48e6, overshoot=3.51e8), "5.2.1"),
    "2-varying": Case(2, "varying", Weights(accuracy=8.70e7, duration=1.36e6, overshoot=1.76e8), "5.2.2"),
    "3-fixed": Case(3, FIXED_C[3], Weights(accuracy=1.07e7, duration=1.52e5, overshoot=6.91e7), "5.3.1"),
    "3-varying": Case(3, "varying", Weights(accuracy=1.07e7, duration=1.52e5, overshoot=7.10e7), "5.3.2"),
}


def get_case(name: str) -> Case:
    """The case of that name.

    Raises:
        InputError: unknown name.
    """
    if name not in CASES:
        raise InputError(f"unknown case {name!r}; choose one of {', '.join(CASES)}")
    return CASES[name]
