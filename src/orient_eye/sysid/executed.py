"""An executed saccade held against its prediction: what came out, how far off, and what to do about it.

held = hold_against(predicted, executed, model_answer=answer)
held.rows                                        # end point, overshoot, duration, ... predicted and executed
held.advice                                      # what to do, or that all is as predicted
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from orient_eye.errors import InputError
from orient_eye.sysid.recording_checks import noise_of

Array = NDArray[np.float64]
BAND = 0.02
"""Settling band where nobody says another: a share of the movement, as is usual of step responses."""
_MIN_ROWS = 8
_BEGUN = 0.005  # of the amplitude: then the eye has begun to move
_SHIFTS_S = (-0.1, 0.3)  # looked for
_WINDOW_S = 0.03  # over which the motor's speed is taken
_END_DEG, _END_SHARE = 0.5, 0.03  # off by less is as predicted
_NOISY = 4.0  # times the sensor's noise: no band is narrower
_LATE_S = 0.005
_SLOWER = 0.92  # of the predicted speed
_MORE_OVERSHOOT = 0.03


@dataclass(frozen=True)
class Saccade:
    """One saccade, predicted or executed, on the clock of its command.

    Attributes:
        time: [s], rising; 0 where the first row of the command is sent, (samples,).
        eye_deg: about the axis, (samples,).
        motor_deg: position of the drive, (samples,); None where it was not recorded.
    """

    time: Array
    eye_deg: Array
    motor_deg: Array | None = None


@dataclass(frozen=True)
class Row:
    """One quantity, predicted and executed; None where it is not known."""

    name: str
    unit: str
    predicted: float | None
    executed: float | None


@dataclass(frozen=True)
class Held:
    """An executed saccade beside its prediction.

    Attributes:
        rows: quantities of both.
        band_deg: around its end, into which a movement comes to stay when it is over.
        band_is_noise: whether that is four times the sensor's noise, as the band asked for is less.
        residual_rms_deg: executed - predicted, from rest each.
        shift_s: by which the executed eye comes later than predicted.
        gain: how far it goes of what was predicted, at that shift.
        left_rms_deg: residual that shift and gain leave.
        model_rms_deg: residual of the model driven by the motor as it was measured; None where it was not.
        motor_shift_s: by which the motor comes later than it was told; None where it was not measured.
        noise_deg: of the measured eye.
        advice: what to do.
    """

    rows: tuple[Row, ...]
    band_deg: float
    band_is_noise: bool
    residual_rms_deg: float
    shift_s: float
    gain: float
    left_rms_deg: float
    model_rms_deg: float | None
    motor_shift_s: float | None
    noise_deg: float
    advice: tuple[str, ...]


def hold_against(predicted: Saccade, executed: Saccade, model_answer: Array | None = None, band: float = BAND) -> Held:
    """Compare an executed saccade with its prediction.

    Args:
        predicted: with its motor, from the first row of the command on, at least as long as the recording.
        executed: as recorded.
        model_answer: movement [deg] that the model answers to the motor as it was measured, from rest, (samples,) of
            the executed saccade.
        band: in which the eye has settled, a share of the predicted movement; the sensor's noise may ask for more.

    Raises:
        InputError: a band that is no share, too few rows, no overlap in time, or a prediction that does not move.
    """
    if not 0 < band < 1:
        raise InputError(f"the settling band is a share of the movement between 0 and 1, got {band:g}")
    if len(executed.time) < _MIN_ROWS or executed.time[-1] <= 0 or executed.time[0] >= predicted.time[-1]:
        raise InputError(
            f"the recording has {len(executed.time)} rows from {executed.time[0]:g} to {executed.time[-1]:g} s, the "
            f"command lasts from 0 to {predicted.time[-1]:g} s: record at least {_MIN_ROWS} rows of the movement, on "
            "the command's clock"
        )
    told = _at(predicted, executed.time)
    amplitude = float(told.eye_deg[-1] - predicted.eye_deg[0])
    if abs(amplitude) < 1e-6:
        raise InputError("the predicted eye does not move, so there is nothing to hold against it; is the axis right?")
    noise = noise_of(executed.time, executed.eye_deg)
    moving = np.abs(told.eye_deg - predicted.eye_deg[0]) > _BEGUN * abs(amplitude)
    resting = np.arange(len(moving)) < max(int(moving.argmax()), 1)
    asked, drowned = band * abs(amplitude), _NOISY * noise
    band_deg = max(asked, drowned)
    ours = _measured(told, resting, band_deg)
    theirs = _measured(executed, resting, band_deg)
    expected, seen = told.eye_deg - ours["start"], executed.eye_deg - theirs["start"]
    shift, gain, left = _shift_and_gain(executed.time, seen, predicted.time, predicted.eye_deg - ours["start"])
    units = {"start": "deg", "end": "deg", "movement": "deg", "overshoot": "%", "duration": "ms"}
    rows = [Row(name, unit, ours[name], theirs[name]) for name, unit in units.items()]
    motor_shift = None
    if told.motor_deg is not None:
        measured_motor = None if executed.motor_deg is None else executed
        both = [None if s is None else _motor(s) for s in (told, measured_motor)]
        rows += [
            Row(f"motor {name}", unit, *(None if one is None else one[name] for one in both))
            for name, unit in (("end", "deg"), ("top speed", "deg/s"))
        ]
        if executed.motor_deg is not None and predicted.motor_deg is not None:
            reached = executed.motor_deg - executed.motor_deg[resting].mean()
            wanted = predicted.motor_deg - told.motor_deg[resting].mean()
            motor_shift, _, _ = _shift_and_gain(executed.time, reached, predicted.time, wanted)
    held = Held(
        rows=tuple(rows),
        band_deg=band_deg,
        band_is_noise=drowned > asked,
        residual_rms_deg=_rms(seen - expected),
        shift_s=shift,
        gain=gain,
        left_rms_deg=left,
        model_rms_deg=None if model_answer is None else _rms(seen - (model_answer - model_answer[resting].mean())),
        motor_shift_s=motor_shift,
        noise_deg=noise,
        advice=(),
    )
    apart = float(np.median(np.diff(executed.time)))
    return replace(held, advice=tuple(_advice(held, ours, theirs, rows, apart)))


def _at(saccade: Saccade, time: Array) -> Saccade:
    """A saccade at other times; it rests before, and stands after."""
    motor = None if saccade.motor_deg is None else np.interp(time, saccade.time, saccade.motor_deg)
    return Saccade(time, np.interp(time, saccade.time, saccade.eye_deg), motor)


def _measured(saccade: Saccade, resting: NDArray[np.bool_], band: float) -> dict[str, float]:
    time, eye = saccade.time, saccade.eye_deg
    start, end = float(eye[resting].mean()), float(eye[_late(time)].mean())
    smooth = ndimage.median_filter(eye, 3, mode="nearest")
    movement = end - start
    beyond = float(((smooth - end) * np.sign(movement)).max())
    outside = np.flatnonzero(np.abs(smooth - end) > band)
    return {
        "start": start,
        "end": end,
        "movement": movement,
        "overshoot": 100 * max(beyond, 0.0) / max(abs(movement), 1e-9),
        "duration": 1e3 * float(time[min(outside[-1] + 1, len(time) - 1)]) if outside.size else 0.0,
    }


def _motor(saccade: Saccade) -> dict[str, float]:
    assert saccade.motor_deg is not None
    window = max(_WINDOW_S, 2 * float(np.median(np.diff(saccade.time))))
    later = np.interp(saccade.time + window, saccade.time, saccade.motor_deg)
    speed = float(np.abs(later - saccade.motor_deg).max()) / window
    return {"end": float(saccade.motor_deg[_late(saccade.time)].mean()), "top speed": speed}


def _late(time: Array) -> NDArray[np.bool_]:
    return np.asarray(time >= time[-1] - 0.1 * (time[-1] - time[0]))


def _shift_and_gain(time: Array, seen: Array, told_time: Array, told: Array) -> tuple[float, float, float]:
    """Shift [s] and gain with which a told movement is nearest to the seen one, and the rms that is left."""

    def fitted(shift: float) -> tuple[float, float]:
        model = np.interp(time - shift, told_time, told)
        gain = float(model @ seen / max(float(model @ model), 1e-300))
        return gain, _rms(seen - gain * model)

    grid = np.arange(_SHIFTS_S[0], _SHIFTS_S[1], 0.005)
    near = float(grid[int(np.argmin([fitted(s)[1] for s in grid]))])
    found = optimize.minimize_scalar(
        lambda s: fitted(s)[1], bounds=(near - 0.005, near + 0.005), method="bounded", options={"xatol": 1e-5}
    )
    return float(found.x), *fitted(float(found.x))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _advice(
    held: Held, ours: dict[str, float], theirs: dict[str, float], rows: Sequence[Row], apart: float
) -> list[str]:
    """What the comparison says to do.

    Args:
        held: all but the advice.
        ours: measures of the prediction.
        theirs: of the execution.
        rows: of both.
        apart: rows of the recording [s].
    """
    size = abs(ours["movement"])
    small = max(_END_DEG, _END_SHARE * size, 2 * held.noise_deg)
    off = theirs["movement"] - ours["movement"]
    both = {r.name: (r.predicted, r.executed) for r in rows if r.predicted is not None and r.executed is not None}
    found = []
    if theirs["movement"] * ours["movement"] < 0 and abs(theirs["movement"]) > small:
        return ["the eye turned the other way: check sign of the motors in the rig, and the sense of the eye's angle"]
    beside = theirs["start"] - ours["start"]
    if abs(beside) > max(_END_DEG, 4 * held.noise_deg):
        found.append(
            f"already at rest the eye stands {beside:+.2f} deg beside the prediction: look at the zero of the motors "
            "or of the eye's sensor"
        )
    gain = theirs["movement"] / ours["movement"]
    end_told, end_reached = both.get("motor end", (0.0, 0.0))
    missed = end_reached - end_told
    if abs(off) > small and abs(missed) > 0.5 * abs(off * end_told) / size:
        found.append(
            f"the motor ends {missed:+.2f} deg beside its command: it stands before its end, or its zero or its counts "
            "a degree are others than the rig says"
        )
    elif abs(off) > small:
        found.append(
            f"the eye goes {100 * abs(gain - 1):.1f} % too {'far' if gain > 1 else 'short'}: recalibrate the gain (K "
            f"times {gain:.3f} at this size): record steps of this size and identify again"
        )
    top_told, top_reached = both.get("motor top speed", (0.0, 0.0))
    went = min(abs(end_reached / end_told), 1.0) if end_told else 1.0  # who goes less far needs less speed
    slow = top_reached < _SLOWER * went * top_told
    if slow:
        found.append(
            f"the motor reaches {top_reached:.0f} deg/s where {top_told:.0f} were predicted: it is slower than the rig "
            f"says; set its speed_limit so that the drive has {top_reached:.0f} deg/s, identify and train again"
        )
    more = theirs["overshoot"] - ours["overshoot"]
    wrong = held.left_rms_deg > max(_END_SHARE * size, 3 * held.noise_deg)
    wrong |= more > 100 * max(_MORE_OVERSHOOT, 4 * held.noise_deg / size)
    if abs(held.shift_s) > max(_LATE_S, apart / 2) and not (wrong or slow):  # which look like a delay
        motor_late = held.motor_shift_s is not None and abs(held.motor_shift_s) > 0.5 * abs(held.shift_s)
        way = "later" if held.shift_s > 0 else "earlier"
        what = (
            "see whether the recording begins when the command was sent (--sent-at), and the limits of the rig"
            if held.shift_s < 0
            else "the motor as much: the driver delays the command, or the clocks of command and recording differ"
            if motor_late
            else "identify the dead time again, or see whether the clocks of command and recording differ"
        )
        found.append(f"the eye moves {1e3 * abs(held.shift_s):.0f} ms {way} than predicted; {what}")
    if wrong and held.model_rms_deg is not None and held.model_rms_deg < 0.5 * held.left_rms_deg:
        found.append(
            f"the model follows the motor as it really moved (rms {held.model_rms_deg:.2f} deg), but the motor did not "
            "move as commanded: look at its speed and acceleration limits in the rig"
        )
    elif wrong:
        found.append(
            f"the shape differs (rms {held.left_rms_deg:.2f} deg beyond delay and gain, overshoot {more:+.1f} %): "
            "identify again, with steps of this size and a higher order (sysid --model best)"
        )
    if not found:
        found.append(
            f"as predicted: off by {off:+.2f} deg at the end, {1e3 * held.shift_s:+.0f} ms, rms "
            f"{held.residual_rms_deg:.2f} deg"
        )
    return found
