"""What a step response cannot tell: said before it is fitted."""

import numpy as np
from numpy.typing import NDArray

from orient_eye.sysid.step_response import StepResponse

_SETTLED = 0.02  # of the final value
_ARRIVED = 5  # times the eye's lag behind the motor: a first-order eye is within 0.7 % then


def warnings_of(step: StepResponse) -> list[str]:
    """Warnings about a recorded step response, each beginning with its name."""
    found = list(step.warnings)
    time, motor, eye = step.time, step.motor_deg, step.eye_deg
    end, reached = step.amplitude_deg, float(np.abs(eye).max())
    if abs(end) < 0.1 * np.abs(motor).max():
        found.append("the motor comes back to its rest position: this is no step, the gain follows from the way there")
        return [f"{step.name}: {text}" for text in found]
    unsettled = np.abs(motor - end) > _SETTLED * abs(end)
    still = float(time[unsettled.nonzero()[0][-1]]) if unsettled.any() else float(time[0])
    if time[-1] - still < 0.1 * (time[-1] - time[0]):
        found.append("the motor moves until the end of the recording: the gain K rests on the model; record longer")
    lag = max(_reaches(step, eye, float(eye[-1])) - _reaches(step, motor, end), 0.0) + float(np.median(np.diff(time)))
    quiet = _ARRIVED * lag
    after = time >= still + quiet
    if after.sum() >= 4:
        creep = float(eye[-1] - eye[after][0])
        if abs(creep) > _SETTLED * reached:
            found.append(
                f"the eye creeps by {creep:+.2f} deg ({100 * creep / reached:+.1f} %) from {quiet:.2f} s after the "
                "motor stands to the end: K is a mean over that"
            )
    elif time[-1] - still < quiet:
        found.append(f"it ends {time[-1] - still:.2f} s after the motor stands; the eye may not have settled")
    way = (np.abs(eye) > 0.1 * reached) & (np.abs(eye) < 0.9 * reached)
    risen = int(way[: int(np.abs(eye).argmax())].sum())
    if risen < 4:
        found.append(f"only {risen} rows fall between 10 and 90 % of the eye's movement: its dynamics show poorly")
    return [f"{step.name}: {text}" for text in found]


def _reaches(step: StepResponse, values: NDArray[np.float64], end: float) -> float:
    """When these values first come to 63 % of their end [s]."""
    there = values * np.sign(end) >= 0.63 * abs(end)
    return float(step.time[int(there.argmax())])
