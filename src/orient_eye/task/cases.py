"""The five learning cases of the thesis (its Chapter 5): a pulse, its C, and the weights of the reward.

The weights make a saccade from 0 to 30 deg with B = 35 optimal, settling band 1 %: on the thesis' low-pass
plant with k0 = 17.5 and K D = 30 deg (`orient-eye weights --D 20.328`; lambda_o of variant 1 is the thesis'
print), on the whole eye with the D that rests at 30 deg and the k0 below which it overshoots (`orient-eye
weights --plant mujoco`). A plant with other constants keeps those of its kind.
"""

from dataclasses import dataclass

from orient_eye.commands.pulse_step import FIXED_C
from orient_eye.errors import InputError
from orient_eye.task.reward import Weights


@dataclass(frozen=True)
class Case:
    """A kind of motor command and how its saccades are judged.

    Attributes:
        variant: of the pulse (thesis 4.3).
        C: onset rate [1/s], "varying" for the one that brings the motor to its speed limit, None in
            variant 1.
        lpf_weights: of the reward, on the low-pass plant.
        eye_weights: of the reward, on the MuJoCo eye and the NumPy reference.
    """

    variant: int
    C: float | str | None
    lpf_weights: Weights
    eye_weights: Weights

    def weights(self, plant: str) -> Weights:
        """Of the reward, on the plant of that name."""
        return self.lpf_weights if plant == "lpf" else self.eye_weights


CASES: dict[str, Case] = {  # Chapter 5: sections 5.1, 5.2.1, 5.2.2, 5.3.1, 5.3.2
    "1": Case(1, None, Weights(), Weights(4.08e7, 1.0, 5.53e5, 5.51e7)),
    "2-fixed": Case(2, FIXED_C[2], Weights(1.21e8, 1.0, 2.48e6, 3.51e8), Weights(2.30e8, 1.0, 2.79e6, 1.50e8)),
    "2-varying": Case(2, "varying", Weights(8.70e7, 1.0, 1.36e6, 1.76e8), Weights(1.37e8, 1.0, 1.39e6, 6.86e7)),
    "3-fixed": Case(3, FIXED_C[3], Weights(1.07e7, 1.0, 1.52e5, 6.91e7), Weights(1.35e7, 1.0, 1.67e5, 1.50e7)),
    "3-varying": Case(3, "varying", Weights(1.07e7, 1.0, 1.52e5, 7.10e7), Weights(1.37e7, 1.0, 1.70e5, 1.52e7)),
}


def get_case(name: str) -> Case:
    """The case of that name.

    Raises:
        InputError: unknown name.
    """
    if name not in CASES:
        raise InputError(f"unknown case {name!r}; choose one of {', '.join(CASES)}")
    return CASES[name]
