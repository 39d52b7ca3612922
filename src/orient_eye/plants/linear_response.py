"""The response of a linear eye, of first or second order and with a dead time, in closed form.

    theta(s) = K product of w / (s + w) e^(-L s) tau(s)

with one real pole w, or two that are real or a conjugate pair. `LinearResponse` is the response to
pulse-steps as a function of time, with no sampling at all, and `measure_closed_form` measures it;
`sampled_response` is exact for any path of straight lines.

For a step of 1, a pulse of poles p is 1 / k0 times the product of p / (s + p), and the command is that pulse
through 1 + k0 / s. So with g the impulse response of all poles, of pulse and plant, the eye's speed is
g + g' / k0, and its distance from the end the integral of g from now on, less g / k0: one sum of `Modes`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.cached import cached_property
from orient_eye.commands.exponentials import Modes, Numbers, impulse_response
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.constants import BAND
from orient_eye.errors import InputError
from orient_eye.movement.measures import Measures, finished

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


def second_order_poles(wn: float | Array, zeta: float | Array) -> tuple[Numbers, Numbers]:
    """The poles w of wn^2 / (s^2 + 2 zeta wn s + wn^2) = w1 w2 / ((s + w1) (s + w2)), real where all are.

    Args:
        wn: natural frequency [rad/s], a number or (...).
        zeta: damping ratio, likewise.
    """
    wn, zeta = np.asarray(wn, float), np.asarray(zeta, float)
    square = (zeta - 1) * (zeta + 1)
    real = zeta + np.sqrt(np.maximum(square, 0))
    if (square >= 0).all():
        return wn / real, wn * real
    apart = np.where(square < 0, np.sqrt(np.maximum(-square, 0)) * 1j, 0)
    return wn * np.where(square < 0, zeta + apart, 1 / real), wn * np.where(square < 0, zeta - apart, real)


@dataclass(frozen=True)
class LinearResponse:
    """Angle over time of a linear eye under pulse-steps of its one motor, from rest at their F.

    Attributes:
        gain: K, deg of the eye per deg of motor; a number or (saccades,).
        poles: w [rad/s], each a number or (saccades,): one real, or two, real or conjugate.
        dead_time: L [s]; a number or (saccades,).
        command: the pulse-steps, of one motor.

    Raises:
        InputError: poles that make no stable real system of order one or two, a negative dead time, or several
            motors.
    """

    gain: float | Array
    poles: tuple[complex | Numbers, ...]
    dead_time: float | Array
    command: PulseStep

    def __post_init__(self) -> None:
        _check(self.poles, self.dead_time)
        if self.command.F.shape[1] != 1:
            raise InputError(f"a linear eye has one motor, got a command of {self.command.F.shape[1]}")

    @property
    def start(self) -> Array:
        """Initial angle K F [deg], (saccades,)."""
        return np.asarray(self.gain * self.command.F[:, 0])

    @property
    def final(self) -> Array:
        """Final angle K D [deg], (saccades,)."""
        return np.asarray(self.gain * self.command.D[:, 0])

    @cached_property
    def remaining(self) -> Modes:
        """Share of the way still to go, 1 - x, at the time since the dead time; batch shape (saccades, 1)."""
        command = self.command
        pulse = command.kind.poles(command.B, np.asarray(command.C))
        of_poles = impulse_response([*pulse, *map(_column, self.poles)])
        return of_poles.tail().plus(of_poles.scaled(-1 / command.k0))

    def angle(self, t: Array) -> Array:
        """Angle [deg] at times t [s], (saccades or 1, time)."""
        return self.start[:, None] + (self.final - self.start)[:, None] * self.motion(t, 0)[0]

    def rate(self, t: Array) -> Array:
        """Angular velocity [deg/s] at times t [s], (saccades or 1, time)."""
        return (self.final - self.start)[:, None] * self.motion(t, 1)[1]

    def motion(self, t: Array, derivatives: int = 3) -> tuple[Array, ...]:
        """Share x of the way from start to final, and its first derivatives by time.

        Defined also for a saccade of size 0. Nothing moves up to the dead time.

        Args:
            t: times [s], (saccades or 1, time).
            derivatives: how many.

        Returns:
            x, and its derivatives in 1/s, 1/s^2 and so on, each (saccades, time).
        """
        since = t - _column(self.dead_time)
        moving = since > 0
        x, *slopes = (-values[:, 0] for values in self.remaining.jet(np.maximum(since, 0)[:, None], derivatives))
        return np.where(moving, 1 + x, 0.0), *(np.where(moving, slope, 0.0) for slope in slopes)


def _column(x: complex | Numbers) -> Numbers:
    """A number, or (saccades,) as (saccades, 1)."""
    x = np.asarray(x)
    return np.asarray(x[:, None] if x.ndim else x)


def _check(poles: Sequence[complex | Numbers], dead_time: float | Array) -> None:
    w = [np.asarray(pole) for pole in poles]
    if len(w) not in (1, 2) or not all((np.isfinite(x) & (x.real > 0)).all() for x in w):
        raise InputError(f"a linear eye has one pole or two, finite and with positive real parts, got {poles}")
    # Each is real where it is its own conjugate, and so are both of a pair where they are each other's.
    apart = [np.where(x.imag == 0, 0, np.abs(x.conj() - y)) for x, y in zip(w, w[::-1], strict=True)]
    if any((x > 1e-12 * np.abs(w[0])).any() for x in apart):
        raise InputError(f"poles are real or a conjugate pair, got {poles}")
    if not (np.asarray(dead_time) >= 0).all():
        raise InputError(f"a dead time is 0 s or more, got {dead_time}")


# --- measures -------------------------------------------------------------------------------------

_GRID = 128  # points in time on which roots are bracketed
_PER_PERIOD = 12  # further ones, of an oscillation
_HORIZON = 25.0  # decay lengths of the slowest pole: past exp(-25) nothing matters
_COMPETES = 0.9  # of the largest sample: a lower one's true crest is not the largest
_ROUNDS = 60  # of safeguarded Newton at most; about six are made


def measure_closed_form(response: LinearResponse, band: float = BAND, axis: str = "yaw") -> Measures:
    """Measure the response of a linear eye to pulse-steps, in closed form.

    Settling time, peak velocity and overshoot are roots of the closed form and its derivatives, bracketed on a
    grid and solved by Newton's method. Crests between two points of the grid are looked at where they may be the
    largest, or the last to leave the band. Times count from the command: the dead time is part of them.

    Args:
        response: of the eye.
        band: settling band, share of the amplitude.
        axis: about which the eye turns: yaw, pitch or roll.
    """
    modes = response.remaining
    t = _grid(modes, len(response.command.F))
    left, x1 = (-values[:, 0] for values in modes.jet(t[:, None], 1))  # x - 1 and its slope
    speed, outside = np.abs(x1), np.asarray(np.abs(left) > band)
    last = outside.shape[1] - 1 - outside[:, ::-1].argmax(axis=1)
    ever = np.asarray(outside.any(axis=1))

    # Brackets of crests: of the speed, of the overshoot, and of what may leave the band after the last point outside.
    fast, point_fast = np.nonzero(_may_be_largest(speed))
    high, point_high = np.nonzero(_may_be_largest(left) & (left[:, 1:-1] > 0))
    rise = 0.5 * np.diff(t, axis=1) * np.maximum(speed[:, :-1], speed[:, 1:])
    reaches = np.maximum(np.abs(left[:, :-1]), np.abs(left[:, 1:])) + rise > band
    late, cell = np.nonzero(
        (x1[:, :-1] * x1[:, 1:] < 0) & reaches & (np.arange(t.shape[1] - 1) >= last[:, None]) & ever[:, None]
    )
    rows = np.concatenate([fast, high, late])
    low = np.concatenate([t[fast, point_fast], t[high, point_high], t[late, cell]])
    up = np.concatenate([t[fast, point_fast + 2], t[high, point_high + 2], t[late, cell + 1]])
    side = np.concatenate([np.sign(x1[fast, point_fast + 1]), np.ones(len(high)), np.sign(x1[late, cell])])
    of_speed = np.arange(len(rows)) < len(fast)
    of_height = ~of_speed & (np.arange(len(rows)) < len(fast) + len(high))

    def crest(which: Rows, s: Array) -> tuple[Array, Array]:
        _, slope, x2, x3 = _at(modes, rows[which], s, 3)
        kind = of_speed[which]
        return side[which] * np.where(kind, x2, slope), side[which] * np.where(kind, x3, x2)

    first = np.concatenate(
        [
            _vertex(*(values[fast[:, None], point_fast[:, None] + [0, 1, 2]] for values in (t, speed))),
            _crossing(*(values[high[:, None], point_high[:, None] + [0, 2]] for values in (t, x1))),
            _crossing(*(values[late[:, None], cell[:, None] + [0, 1]] for values in (t, x1))),
        ]
    )
    at = _falling_root(low, up, crest, first)
    height, slope = _at(modes, rows, at, 1)
    peak, peak_time = _largest(speed[:, 0], rows[of_speed], np.abs(slope[of_speed]), at[of_speed])
    overshoot, _ = _largest(np.zeros(len(t)), rows[of_height], height[of_height], at[of_height])

    # The last exit: behind the last point outside, or behind a later crest that is outside.
    every = np.arange(len(t))
    low, up, exit_side = t[every, last], t[every, np.minimum(last + 1, t.shape[1] - 1)], np.sign(left[every, last])
    leaves = ~of_speed & ~of_height & (side * height > band)
    crested = rows[leaves]  # a row's crests stand in the order of time, and the last one assigned stays
    low[crested], exit_side[crested] = at[leaves], side[leaves]
    up[crested] = t[late, cell + 1][leaves[len(fast) + len(high) :]]

    def beyond(which: Rows, s: Array) -> tuple[Array, Array]:
        x, slope = _at(modes, which, s, 1)
        return exit_side[which] * x - band, exit_side[which] * slope

    # Where no crest moved the bracket, the values at its ends are known.
    known = np.stack([np.abs(left[every, last]), exit_side * left[every, np.minimum(last + 1, t.shape[1] - 1)]], axis=1)
    first = _crossing(np.stack([low, up], axis=1), known - band)
    first[crested] = 0.5 * (low + up)[crested]
    exit_ = np.where(ever, _falling_root(low, up, beyond, first), 0.0)
    size = response.final - response.start
    moved = size != 0
    way = np.where(moved, 1 + _at(modes, every, exit_, 0)[0], 0.0)
    angle = response.start + size * way
    dead_time = np.broadcast_to(np.asarray(response.dead_time, float), size.shape)
    settling = np.where(moved, dead_time + exit_, 0.0)
    return finished(
        final=rotations.about(axis, response.final),
        at_settling=rotations.about(axis, angle),
        amplitude_deg=np.abs(size),
        settling_time_s=settling,
        peak_velocity_deg_s=np.abs(size) * peak,
        overshoot=np.where(moved, overshoot, 0.0),
        peak_time=dead_time + peak_time,
        settled=np.ones(len(t), bool),
        failed=~(np.isfinite(angle) & np.isfinite(response.final) & np.isfinite(settling)),
    )


def _grid(modes: Modes, saccades: int) -> Array:
    """Times (saccades, points) since the dead time, dense at the start, until all is settled."""
    rates = [np.broadcast_to(m.p[..., 0], saccades) for m in modes.modes]
    end = _HORIZON / np.nan_to_num(np.min([p.real for p in rates], axis=0), nan=1.0)[:, None]  # of no command, any
    t = end * np.linspace(0, 1, _GRID) ** 3
    periods = end[:, 0] * np.nan_to_num(np.max([np.abs(p.imag) for p in rates], axis=0)) / (2 * np.pi)
    more = int(np.ceil(_PER_PERIOD * periods.max(initial=0)))
    return np.sort(np.concatenate([t, end * (np.arange(1, more) / max(more, 1))], axis=1), axis=1)


def _may_be_largest(values: Array) -> NDArray[np.bool_]:
    """Where the inner points of values (saccades, points) are crests that compete for the largest."""
    before, middle, after = values[:, :-2], values[:, 1:-1], values[:, 2:]
    competes = middle >= _COMPETES * values.max(axis=1, keepdims=True)
    return np.asarray((middle >= before) & (middle > after) & competes)


def _largest(first: Array, rows: Rows, values: Array, at: Array) -> tuple[Array, Array]:
    """Of a first value (saccades,) at time 0 and the values of rows the largest of each row, and its time."""
    largest, time = first.copy(), np.zeros(len(first))
    order = np.argsort(values, kind="stable")  # where a row is assigned several times, the last one stays
    order = order[values[order] > first[rows[order]]]
    largest[rows[order]], time[rows[order]] = values[order], at[order]
    return largest, time


def _at(modes: Modes, rows: Rows, t: Array, derivatives: int) -> tuple[Array, ...]:
    """x - 1 and its derivatives, each (n,), of these rows at one time t (n,) each."""
    return tuple(-values[:, 0, 0] for values in modes[rows].jet(t[:, None, None], derivatives))


def _crossing(t: Array, values: Array) -> Array:
    """Where the line through two values (n, 2) at times (n, 2) is zero, (n,)."""
    fall = values[:, 0] - values[:, 1]
    share = np.clip(values[:, 0] / np.where(fall == 0, 1, fall), 0, 1)
    return np.asarray(t[:, 0] + share * (t[:, 1] - t[:, 0]))


def _vertex(t: Array, values: Array) -> Array:
    """Where the parabola through three values (n, 3) at times (n, 3) is largest, (n,)."""
    before, after = t[:, 1] - t[:, 0], t[:, 2] - t[:, 1]
    up, down = (values[:, 1] - values[:, 0]) / before, (values[:, 2] - values[:, 1]) / after
    bend = np.where(up == down, 1, up - down)
    return np.asarray(t[:, 0] + 0.5 * before + 0.5 * (before + after) * np.clip(up / bend, 0, 1))


def _falling_root(low: Array, high: Array, f: Callable[[Rows, Array], tuple[Array, Array]], first: Array) -> Array:
    """Roots of functions that fall from positive at low to negative at high, each (n,).

    Newton's method; a step that would leave the bracket halves it instead.

    Args:
        low: start of the bracket.
        high: its end.
        f: of which of the n functions, and where; to their values and slopes.
        first: where to begin.
    """
    x = np.clip(first, low, high)
    which = np.arange(len(x))
    low, high = low.copy(), high.copy()
    for _ in range(_ROUNDS):
        if not len(which):
            break
        here = x[which]
        value, slope = f(which, here)
        low[which] = np.where(value > 0, here, low[which])
        high[which] = np.where(value > 0, high[which], here)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            following = here - value / slope
        inside = (following >= low[which]) & (following <= high[which])
        x[which] = np.where(inside, following, 0.5 * (low[which] + high[which]))
        # The error after a step of Newton's is the square of the step's: one more would change nothing.
        which = which[~(inside & (np.abs(following - here) < 1e-9 * np.abs(here)))]
    return x


# --- sampled motors -------------------------------------------------------------------------------


def sampled_response(
    gain: float | Array,
    poles: Sequence[complex | Numbers],
    dead_time: float | Array,
    motor: Array,
    step_s: float,
    before: Array | None = None,
) -> tuple[Array, Array]:
    """Response to a motor that moves along straight lines between samples, exact at the samples' times.

    Along a line of slope m the eye follows at a constant lag, m (1/w1 + 1/w2), once free motion has died away;
    where the slope changes, free motion starts. The dead time, any, only shifts where on the lines the eye is.

    Args:
        gain: K; a number or (saccades,).
        poles: w [rad/s], each a number or (saccades,): one real, or two, real or conjugate.
        dead_time: L [s]; a number or (saccades,).
        motor: positions (saccades, samples) [deg].
        step_s: interval between samples [s].
        before: where motor and eye rest before the first sample, at which the motor jumps, (saccades,) [deg of
            motor]; None for its first position.

    Returns:
        Angle [deg] and angular velocity [deg/s], (saccades, samples).

    Raises:
        InputError: as `LinearResponse`; another shape of motor.
    """
    _check(poles, dead_time)
    motor = np.asarray(motor, float)
    if motor.ndim != 2 or not motor.shape[1]:
        raise InputError(f"a motor's path has the shape (saccades, samples), got {motor.shape}")
    w = [np.asarray(pole) for pole in poles]
    lag = np.asarray(sum(1 / x for x in w)).real
    if before is not None and np.shape(before) != motor.shape[:1]:
        raise InputError(f"motors rest before at (saccades,) = {motor.shape[:1]} positions, got {np.shape(before)}")
    path = np.ascontiguousarray(motor.T)
    slope = np.diff(path, axis=0, append=path[-1:]) / step_s
    bend = np.diff(slope, axis=0, prepend=0.0)
    # Free motion behind a knot, as (angle, rate): each bend of the line adds (lag, -1).
    free = _free_states(_free_motion(w, np.asarray(step_s)), lag, bend)

    samples = np.arange(motor.shape[1])[:, None]
    delay = np.asarray(dead_time, float) / step_s
    back = np.ceil(delay - 1e-12).astype(int)  # samples; what is left of the step in which the eye is
    since = np.maximum(back - delay, 0.0) * step_s
    knot = np.broadcast_to(samples - back, slope.shape)
    moving, at = knot >= 0, np.maximum(knot, 0)
    own = np.arange(len(motor))[None]
    free_angle, free_rate = _moved(_free_motion(w, since), free[:, at, own])
    rest = path[0] if before is None else np.asarray(before, float)
    jump = np.stack([rest - path[0], np.zeros_like(rest)])
    if jump.any():  # which is behind by all of it when it reaches the eye
        reached = np.maximum(samples - delay, 0.0) * step_s
        behind = _moved(_free_motion(w, reached), jump)
        free_angle, free_rate = free_angle + behind[0], free_rate + behind[1]
    ahead = slope[at, own]
    angle = np.where(moving, path[at, own] + (ahead * (since - lag) + free_angle), rest)
    rate = np.where(moving, ahead + free_rate, 0.0)
    return (gain * angle).T, (gain * rate).T


def free_response(poles: Sequence[complex | Numbers], angle: Array, rate: Array, t: Array) -> tuple[Array, Array]:
    """Angle and rate (saccades, time) of a linear eye left to itself, its motor at 0.

    Args:
        poles: w [rad/s], as in `LinearResponse`.
        angle: at time 0 [deg], (saccades,).
        rate: at time 0 [deg/s], (saccades,); of the first order it follows from the angle.
        t: times [s], (time,).
    """
    motion = _free_motion([np.asarray(_column(pole)) for pole in poles], t[None])
    moved = _moved(motion, np.array([angle[:, None], rate[:, None]]))
    return moved[0], moved[1]


def _free_states(over_step: Array, lag: Array, bend: Array) -> Array:
    """Free motion, angle and rate, behind each knot (2, samples, saccades), where each bend of the line adds (lag, -1).

    Args:
        over_step: motion over the time between knots, (2, 2, ...).
        lag: (...).
        bend: (samples, saccades).
    """
    if over_step.ndim == 2:  # one eye: by Cayley and Hamilton each state is a filter of order two
        from scipy.signal import lfilter  # half a second, which closed forms do not wait for

        trace, product = over_step[0, 0] + over_step[1, 1], np.linalg.det(over_step)
        push = np.array([lag, -1.0])
        behind = over_step @ push - trace * push
        return np.array(
            [lfilter([a, b], [1.0, -trace, product], bend, axis=0) for a, b in zip(push, behind, strict=True)]
        )
    free = np.zeros((2, *bend.shape))
    state = np.zeros((2, bend.shape[1]))
    for k, change in enumerate(bend):
        state = _moved(over_step, state)
        state[0] += lag * change
        state[1] -= change
        free[:, k] = state
    return free


def _moved(motion: Array, state: Array) -> Array:
    """motion (2, 2, ...) times state (2, ...)."""
    return np.array([row[0] * state[0] + row[1] * state[1] for row in motion])


def _free_motion(poles: Sequence[Numbers], t: Array) -> Array:
    """From angle and rate to angle and rate a time t later, (2, 2, ...), with the motor at 0.

    Two poles: exp(-a t) (cosh(s t) + (A + a) sinh(s t) / s), a their mean and s half their distance, which may
    be imaginary; its sinh(s t) / s has no singularity where they meet.
    """
    if len(poles) == 1:
        decay = np.exp(-poles[0].real * t)
        return np.array([[decay, 0 * decay], [-poles[0].real * decay, 0 * decay]])
    first, second = poles
    a, product = ((first + second) / 2).real, (first * second).real
    s = (first - second) / 2
    near = np.abs(s) * t < 1e-3
    safe = np.where(near, 1, s)
    slow, fast = np.exp(-(a - s) * t), np.exp(-(a + s) * t)
    series = np.exp(-a * t) * t * (1 + (s * t) ** 2 / 6 * (1 + (s * t) ** 2 / 20))
    sine, cosine = np.where(near, series, (slow - fast) / (2 * safe)).real, ((slow + fast) / 2).real
    return np.array([[cosine + a * sine, sine], [-product * sine, cosine - a * sine]])
