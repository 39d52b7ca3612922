"""What a step response cannot tell, and input that is probably wrong: said before it is fitted."""

import numpy as np
from numpy.typing import NDArray

from orient_eye.sysid.step_response import StepResponse

Array = NDArray[np.float64]
_SETTLED = 0.02  # of the final value
_ARRIVED = 5  # times the eye's lag behind the motor: a first-order eye is within 0.7 % then
_SURE = 5.0  # standard errors: a thousand rows of noise do not reach it
_MEDIAN = 1.4826  # standard deviations a median of normal noise's size
_NOISY = 0.03  # of the step
_SLOW_S, _LONG_S = 0.5, 1000.0  # between rows, of a recording: an eye's step is over long before
_SMALL_DEG = 1.0  # a step or a movement of less shows little but noise
_RADIAN = 1.6  # angles of an eye and its motors in radians stay below a quarter turn
_GAINS = (0.1, 10.0)  # of usual eyes
_COUNTS, _TURN = 200.0, 180.0  # no motor of an eye stands at so many degrees, no eye turns so far
_ANOTHER_AXIS = 2.0  # times the movement about the one asked for


def doubts_of(step: StepResponse) -> list[str]:
    """Why these numbers are probably not what they are taken for, each beginning with the recording's name."""
    found = []
    time, motor, eye = step.time, step.largest_deg, float(np.abs(step.eye_deg).max())
    apart, whole = float(np.median(np.diff(time))), float(time[-1] - time[0])
    if apart > _SLOW_S or whole > _LONG_S:
        found.append(
            f"rows are {apart:g} s apart and the recording lasts {whole:g} s: are these ms? t_s is in s, divide by 1000"
        )
    gain = eye / motor if motor else float("inf")
    columns = str(step.source.get("motor", "motor_deg"))
    if motor < _RADIAN and (gain > _GAINS[1] or (0 < eye < _RADIAN and motor < _SMALL_DEG)):
        found.append(
            f"the motor moves by {motor:.3g} only ({columns}): are these radians? motor_deg is in deg, multiply by "
            '57.29578, or describe the motor in a rig (unit = "rad")'
        )
    if 0 < eye < _RADIAN and (gain < _GAINS[0] or (motor < _RADIAN and eye < _SMALL_DEG)):
        found.append(
            f"the eye turns by {eye:.3g} only ({step.source.get('eye', 'eye_deg')}): are these radians? Its angle is "
            "read in deg, multiply by 57.29578"
        )
    position = step.motor_deg + step.rest[0]
    counted = np.abs(position).max() >= _COUNTS and bool((np.abs(position - np.round(position)) < 1e-6).all())
    if counted or motor > _TURN:
        low, high = position.min(), position.max()
        found.append(
            f"the motor stands at {low:.4g} to {high:.4g} ({columns}): are these counts? motor_deg is in deg; describe "
            'the motor in a rig (unit = "counts", counts_per_deg, zero) and give it by --rig'
        )
    if eye > _TURN:
        found.append(f"the eye turns by {eye:.4g}: are these counts? Its angle is read in deg")
    asked = step.axis or "yaw"
    others = {axis: way for axis, way in step.turned.items() if axis != asked}
    most = max(others, key=others.__getitem__, default=asked)
    if asked in step.turned and most != asked and others[most] > max(_ANOTHER_AXIS * step.turned[asked], _SMALL_DEG):
        found.append(
            f"the eye turns {others[most]:.3g} deg in {most} and {step.turned[asked]:.3g} deg in {asked}: "
            f"is {most} meant? Name it by --axis {most}"
        )
    return [f"{step.name}: {text}" for text in found]


def warnings_of(step: StepResponse) -> list[str]:
    """Warnings about a recorded step response, each beginning with its name."""
    found = list(step.warnings)
    time, motor, eye = step.time, step.motor_deg, step.eye_deg
    end, reached = step.amplitude_deg, float(np.abs(eye).max())
    noise = noise_of(time, motor)
    if noise > _NOISY * step.largest_deg:
        found.append(
            f"the motor's position has {noise:.2g} deg of noise on a step of {step.largest_deg:.3g} deg: make "
            "larger steps"
        )
    if abs(end) < 0.1 * step.largest_deg:
        found.append("the motor comes back to its rest position: this is no step, the gain follows from the way there")
        return [f"{step.name}: {text}" for text in found]
    unsettled = np.abs(motor - end) > max(_SETTLED * abs(end), _SURE * noise)
    still = float(time[unsettled.nonzero()[0][-1]]) if unsettled.any() else float(time[0])
    late = time >= time[-1] - 0.1 * (time[-1] - time[0])
    drift, error = _drift(time[late], motor[late])
    if time[-1] - still < 0.1 * (time[-1] - time[0]) or abs(drift) > max(_SETTLED * abs(end), _SURE * error):
        found.append("the motor moves until the end of the recording: the gain K rests on the model; record longer")
    lag = max(_reaches(step, eye, float(eye[-1])) - _reaches(step, motor, end), 0.0) + float(np.median(np.diff(time)))
    quiet = _ARRIVED * lag
    after = time >= still + quiet
    if after.sum() >= 4:
        creep, error = _drift(time[after], eye[after])
        if abs(creep) > max(_SETTLED * reached, _SURE * error):
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


def noise_of(time: Array, values: Array) -> float:
    """Standard deviation of the noise of values (rows,) in the last third of the time.

    From how far each row lies beside the straight line between its neighbours; the median, so that a bend or two do
    not count.
    """
    late = time >= time[-1] - (time[-1] - time[0]) / 3
    t, v = time[late], values[late]
    if len(t) < 5:
        return 0.0
    share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
    beside = v[1:-1] - (1 - share) * v[:-2] - share * v[2:]
    alone = np.abs(beside) / np.sqrt(1 + share**2 + (1 - share) ** 2)
    noise = float(np.median(alone)) * _MEDIAN
    return noise if noise > 1e-9 * float(np.abs(values).max(initial=0)) else 0.0


def _drift(time: Array, values: Array) -> tuple[float, float]:
    """By how much a straight line through values (rows,) changes from first to last, and its standard error."""
    if len(time) < 4:
        return 0.0, 0.0
    centred = time - time.mean()
    slope = float(centred @ values / (centred @ centred))
    residual = values - values.mean() - slope * centred
    error = float(np.sqrt(residual @ residual / (len(time) - 2) / (centred @ centred)))
    span = float(time[-1] - time[0])
    return slope * span, error * span


def _reaches(step: StepResponse, values: NDArray[np.float64], end: float) -> float:
    """When these values first come to 63 % of their end [s]."""
    there = values * np.sign(end) >= 0.63 * abs(end)
    return float(step.time[int(there.argmax())])
