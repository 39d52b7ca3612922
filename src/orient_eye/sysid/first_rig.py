"""The first description of a rig, from nothing but recordings of its one motor: what they do not tell is a comment."""

from collections.abc import Sequence

import numpy as np

from orient_eye.rig import quoted
from orient_eye.sysid.step_response import StepResponse

_WINDOW_S = 0.03  # over which the motor's speed is taken: differences of neighbouring rows are noise


def first_rig(steps: Sequence[StepResponse], axis: str) -> str:
    """A rig file (TOML) for recordings of one motor in deg.

    Args:
        steps: the recordings.
        axis: about which the eye turns.
    """
    name = steps[0].drive
    positions = [s.motor_deg + s.rest[0] for s in steps]
    low, high = min(p.min() for p in positions), max(p.max() for p in positions)
    seen = ", ".join(s.name for s in steps)
    said = "" if all(s.axis for s in steps) else "  # nobody said which axis: yaw, pitch or roll?"
    motor = quoted(name)
    return f"""\
# A rig for orient-eye, begun from the recordings {seen}.
# Angles in deg. A line that begins with # is something the recordings do not tell: fill it in (docs/rigs.md).

name = "my-rig"
# command_rate_hz = 100  # new positions a second that the driver takes

[[motors]]
name = {motor}
unit = "deg"  # of the driver, as in the column {name}_deg; rad, or counts with counts_per_deg
# counts_per_deg = 11.4
zero = 0.0  # the driver's number at 0 deg
sign = 1  # -1: the driver counts the other way
# range = [LOW, HIGH]  # deg; the recordings go from {low:.4g} to {high:.4g}, which is no limit
# speed_limit = FASTEST  # deg/s; in the recordings the motor reached {max(map(_fastest, steps)):.0f}
# acceleration_limit = HARDEST  # deg/s^2

[axes]  # what turns the eye: for each axis, its drive as a weighted sum of motors
{axis} = {{ {motor} = 1.0 }}{said}
"""


def _fastest(step: StepResponse) -> float:
    """Largest mean speed of the motor over a window [deg/s]."""
    window = max(_WINDOW_S, 2 * float(np.median(np.diff(step.time))))
    later = np.interp(step.time + window, step.time, step.motor_deg)
    return float(np.abs(later - step.motor_deg).max()) / window
