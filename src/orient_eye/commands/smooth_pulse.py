"""A pulse whose motor starts from rest, with no onset rate to choose; symbols as in `orient_eye.commands.pulses`.

It is variant 3 of the thesis (4.3.3) in the limit C -> 0, as variant 1 is that of variant 2. Its saccade of 30 deg
that settles as soon as variant 1's with B = 35 (4.4.5) needs 1.27 times that B, 44 % of the largest motor speed and
60 % of the energy; with the same B it needs 29 % of the speed, and 1.27 times as long.
"""

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands.exponentials import ExponentialSum, Term
from orient_eye.commands.pulses import Pulse

Array = NDArray[np.float64]


def _smooth(B: Array, k0: Array, C: Array) -> ExponentialSum:
    """A t^2 exp(-B t); A = (D - F) B^3 / (2 k0), as its integral is (D - F) / k0."""
    return ExponentialSum((Term(B**3 / (2 * k0), 2, B),))


SMOOTH = Pulse("A t^2 exp(-B t): begins gently, with the motor at rest", _smooth, lambda B, C: (B, B, B))
