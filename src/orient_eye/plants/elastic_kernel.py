"""The motion of an eye that elastics turn, compiled by Numba: thesis 3.1 to 3.12, one saccade after the other.

Importing this module compiles it, or reads what was compiled before from the user's cache folder: only a plant that
needs it does. Plain arrays go in and out, in SI units and radians, and nothing here knows MuJoCo or a command. The
functions hold no state and let go of Python's lock, so slices of a batch run in threads of the caller's, in forked
children too; a saccade's numbers do not depend on its slice.
"""

import math
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from orient_eye.resources import user_cache

Array = NDArray[np.float64]
STATIC_FRICTION = 0.006
"""N m, in the author's program, while the eye turns slower than `STATIC_SPEED`."""
STATIC_SPEED = 1e-5
"""rad/s."""
CABLE_FRICTION, CABLE_SPEED = 0.005, 0.01
"""The same in the programs of the eye that spindles turn: N m, with viscous friction; rad/s."""
_DIVERGED = 1e4  # rad/s: a thousand times the fastest saccade
_SMALL = 0.0625  # of a squared half angle, up to which these series are exact to rounding
_COS = tuple((-1.0) ** n / math.factorial(2 * n) for n in range(1, 7))
_SIN = tuple((-1.0) ** n / math.factorial(2 * n + 1) for n in range(1, 6))
_STAGES = (0.0, 0.5, 0.5, 1.0)  # of the classical Runge-Kutta method
_WEIGHTS = (1 / 6, 1 / 3, 1 / 3, 1 / 6)


_inlined = numba.njit(error_model="numpy", forceinline=True)


class Eye(NamedTuple):
    """What pulls an eye, and what it is, in head coordinates.

    The end of an elastic's arm is at base + u first + v second. Of a hinge u, v are cosine and sine of its angle; of
    an arm that slides u is 0, and v is how far. A spindle has no arm: its cables' via point stands for it, and it winds
    them up by `wound` times its angle.

    Attributes:
        insertion: of the elastics on the eye, eye coordinates [m], (elastics, 3).
        via: fixed via point [m], (elastics, 3); NaN where there is none.
        arm: base, first and second, (elastics, 3, 3).
        elastic: stiffness [N/m], rest length [m], and how much of it a spindle winds up [m/rad], (elastics, 3).
        pulls: where in `pulled` each motor's elastics begin, and the last one's end, (motors + 1,).
        pulled: elastics, one motor's after the other's, (elastics,).
        slides: whether a motor's arm goes along a line, (motors,).
        inertia: and its inverse, eye coordinates, (2, 3, 3).
        friction: [N m s/rad].
        weight: where it pulls, eye coordinates [m], and how [N], head coordinates, (2, 3).
    """

    insertion: Array
    via: Array
    arm: Array
    elastic: Array
    pulls: NDArray[np.int64]
    pulled: NDArray[np.int64]
    slides: NDArray[np.bool_]
    inertia: Array
    friction: float
    weight: Array


Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]


@_inlined
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@_inlined
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@_inlined
def _row(array: Array, i: int) -> Vector:
    return array[i, 0], array[i, 1], array[i, 2]


@_inlined
def _times(m: Matrix, v: Vector) -> Vector:
    return _dot(m[0], v), _dot(m[1], v), _dot(m[2], v)


@_inlined
def _transposed(m: Matrix) -> Matrix:
    return (m[0][0], m[1][0], m[2][0]), (m[0][1], m[1][1], m[2][1]), (m[0][2], m[1][2], m[2][2])


@_inlined
def _matrix(array: Array) -> Matrix:
    return _row(array, 0), _row(array, 1), _row(array, 2)


@_inlined
def _turn(q: Quaternion, s: float) -> Matrix:
    """Eye to head coordinates; s is 2 / |q|^2."""
    w, x, y, z = q
    return (
        (1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)),
    )


@_inlined
def _product(v: Vector, q: Quaternion, w: float) -> Quaternion:
    """(w, v) q."""
    return (
        w * q[0] - v[0] * q[1] - v[1] * q[2] - v[2] * q[3],
        w * q[1] + v[0] * q[0] + v[1] * q[3] - v[2] * q[2],
        w * q[2] - v[0] * q[3] + v[1] * q[0] + v[2] * q[1],
        w * q[3] + v[0] * q[2] - v[1] * q[1] + v[2] * q[0],
    )


@_inlined
def _square(q: Quaternion) -> float:
    return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]


@_inlined
def _scaled(q: Quaternion, s: float) -> Quaternion:
    return s * q[0], s * q[1], s * q[2], s * q[3]


@_inlined
def _turned(q: Quaternion, v: Vector) -> Quaternion:
    """Unit quaternion q turned by the rotation vector 2 v."""
    x = _dot(v, v)
    if x < _SMALL:  # no division: the compiler may not make these products of its own
        c = 1 + x * (_COS[0] + x * (_COS[1] + x * (_COS[2] + x * (_COS[3] + x * (_COS[4] + x * _COS[5])))))
        s = 1 + x * (_SIN[0] + x * (_SIN[1] + x * (_SIN[2] + x * (_SIN[3] + x * _SIN[4]))))
    else:
        half = math.sqrt(x)
        c, s = math.cos(half), math.sin(half) / half
    turned = _product((s * v[0], s * v[1], s * v[2]), q, c)
    return _scaled(turned, 1.5 - 0.5 * _square(turned))  # Newton's step towards length 1, where it nearly is


@_inlined
def _stand(eye: Eye, motor: Array, at: Array, end: Array, behind: Array) -> None:
    """Move the arms to motor (motors,).

    Of the elastics of motors that are not there already: `end`, where the elastic leaves the eye for (tendons, 3), and
    `behind`, how much of it lies behind that (tendons,). `at`, where the motors are, is brought up to date.
    """
    for m in range(len(motor)):
        if motor[m] == at[m]:
            continue
        at[m] = motor[m]
        if eye.slides[m]:
            u, v = 0.0, motor[m]
        else:
            u, v = math.cos(motor[m]), math.sin(motor[m])
        for i in range(eye.pulls[m], eye.pulls[m + 1]):
            t = eye.pulled[i]
            x = eye.arm[t, 0, 0] + u * eye.arm[t, 1, 0] + v * eye.arm[t, 2, 0]
            y = eye.arm[t, 0, 1] + u * eye.arm[t, 1, 1] + v * eye.arm[t, 2, 1]
            z = eye.arm[t, 0, 2] + u * eye.arm[t, 1, 2] + v * eye.arm[t, 2, 2]
            if math.isnan(eye.via[t, 0]):
                behind[t] = 0.0
                end[t, 0], end[t, 1], end[t, 2] = x, y, z
            else:
                d = x - eye.via[t, 0], y - eye.via[t, 1], z - eye.via[t, 2]
                behind[t] = math.sqrt(_dot(d, d)) + eye.elastic[t, 2] * motor[m]
                end[t, 0], end[t, 1], end[t, 2] = eye.via[t, 0], eye.via[t, 1], eye.via[t, 2]


@_inlined
def _pull(eye: Eye, turn: Matrix, end: Array, behind: Array, tension: Array) -> Vector:
    """Torque of elastics and weight [N m]; the tensions [N] go into `tension` (elastics,); 3.2 to 3.5, 3.8."""
    tx, ty, tz = _cross(_times(turn, _row(eye.weight, 0)), _row(eye.weight, 1))
    for t in range(len(eye.pulled)):
        p = _times(turn, _row(eye.insertion, t))
        d = end[t, 0] - p[0], end[t, 1] - p[1], end[t, 2] - p[2]
        distance = math.sqrt(_dot(d, d))
        force = eye.elastic[t, 0] * max(distance + behind[t] - eye.elastic[t, 1], 0.0)
        tension[t] = force
        force /= distance
        moment = _cross(p, d)
        tx += force * moment[0]
        ty += force * moment[1]
        tz += force * moment[2]
    return tx, ty, tz


@_inlined
def _acceleration(eye: Eye, turn: Matrix, omega: Vector, torque: Vector) -> Vector:
    """Of the full rigid body under viscous friction, head frame [rad/s^2]; worked out in the eye's frame."""
    back, c = _transposed(turn), eye.friction
    w = _times(back, omega)
    resisted = _times(back, (torque[0] - c * omega[0], torque[1] - c * omega[1], torque[2] - c * omega[2]))
    gyro = _cross(w, _times(_matrix(eye.inertia[0]), w))
    net = resisted[0] - gyro[0], resisted[1] - gyro[1], resisted[2] - gyro[2]
    return _times(turn, _times(_matrix(eye.inertia[1]), net))


@_inlined
def _published(eye: Eye, turn: Matrix, omega: Vector, torque: Vector) -> Vector:
    """The same as the author's program has it: inertia R^T I R (3.10), static friction, no gyroscopic torque."""
    if _dot(omega, omega) < STATIC_SPEED**2 and _dot(torque, torque) < STATIC_FRICTION**2:
        return 0.0, 0.0, 0.0
    c = eye.friction
    resisted = _times(turn, (torque[0] - c * omega[0], torque[1] - c * omega[1], torque[2] - c * omega[2]))
    return _times(_transposed(turn), _times(_matrix(eye.inertia[1]), resisted))


@_inlined
def _sticking(eye: Eye, turn: Matrix, omega: Vector, torque: Vector) -> Vector:
    """The rigid body as the programs of the cable eye have it: one that is slow and hardly pulled is not pulled."""
    c = eye.friction
    net = torque[0] - c * omega[0], torque[1] - c * omega[1], torque[2] - c * omega[2]
    if _dot(omega, omega) < CABLE_SPEED**2 and _dot(net, net) < CABLE_FRICTION**2:
        torque = c * omega[0], c * omega[1], c * omega[2]
    return _acceleration(eye, turn, omega, torque)


@_inlined
def _along(q: Quaternion, rate: Quaternion, h: float) -> Quaternion:
    return q[0] + h * rate[0], q[1] + h * rate[1], q[2] + h * rate[2], q[3] + h * rate[3]


@_inlined
def _on(v: Vector, rate: Vector, h: float) -> Vector:
    return v[0] + h * rate[0], v[1] + h * rate[1], v[2] + h * rate[2]


@_inlined
def _between(row: Array, following: Array, share: float, motor: Array) -> None:
    for m in range(len(motor)):
        motor[m] = (1 - share) * row[m] + share * following[m]


@_inlined
def _mean(rows: Array, motor: Array) -> None:
    """Of straight lines between rows (two or more, motors), over time, into motor (motors,)."""
    last = len(rows) - 1
    for m in range(len(motor)):
        whole = 0.5 * (rows[0, m] + rows[last, m])
        for j in range(1, last):
            whole += rows[j, m]
        motor[m] = whole / last


@_inlined
def _spin(q: Quaternion, rate: Quaternion, s: float) -> Vector:
    """Angular velocity, head frame [rad/s], of a quaternion that changes at a rate; s is 2 / |q|^2."""
    turn = _cross((rate[1], rate[2], rate[3]), (q[1], q[2], q[3]))
    return (
        s * (q[0] * rate[1] - rate[0] * q[1] - turn[0]),
        s * (q[0] * rate[2] - rate[0] * q[2] - turn[1]),
        s * (q[0] * rate[3] - rate[0] * q[3] - turn[2]),
    )


@_inlined
def _creeping(eye: Eye, q: Quaternion, motor: Array, at: Array, end: Array, behind: Array, tension: Array) -> Vector:
    """Angular velocity of an eye without inertia, head frame [rad/s]."""
    _stand(eye, motor, at, end, behind)
    torque = _pull(eye, _turn(q, 2.0), end, behind, tension)
    return torque[0] / eye.friction, torque[1] / eye.friction, torque[2] / eye.friction


def _run(
    eye: Eye,
    motor: Array,
    orientation: Array,
    velocity: Array,
    tension: Array,
    diverged: NDArray[np.bool_],
    step_s: float,
    substeps: int,
    published: int,
) -> None:
    """Move eyes; the saccades are independent of each other.

    Args:
        eye: that moves.
        motor: positions of the joints [rad or m], (saccades, time, motors).
        orientation: of the eyes (saccades, time, 4): the first sample is the start, the others are written.
        velocity: the same of the angular velocity [rad/s], head frame, (saccades, time, 3).
        tension: written, [N] (saccades, time, tendons).
        diverged: written, (saccades,): faster than 1e4 rad/s, or no number; NaN from there on.
        step_s: between samples [s].
        substeps: 0 for Algorithm 2 of the thesis, omega first, then q with the new omega. Otherwise so many steps of
            the classical Runge-Kutta method a sample, the motors on straight lines between samples.
        published: with `substeps` 0, the authors' programs to the letter: 1 that of arms, 2 that of spindles.
    """
    samples, motors, tendons = motor.shape[1], motor.shape[2], len(eye.pulled)
    at, end, behind = np.empty(motors), np.empty((tendons, 3)), np.empty(tendons)
    scratch, between = np.empty(tendons), np.empty(motors)
    for s in range(len(motor)):
        at[:] = np.nan
        q = orientation[s, 0, 0], orientation[s, 0, 1], orientation[s, 0, 2], orientation[s, 0, 3]
        q = _scaled(q, 1 / math.sqrt(_square(q)))
        omega = velocity[s, 0, 0], velocity[s, 0, 1], velocity[s, 0, 2]
        for k in range(samples):
            if not (abs(omega[0]) < _DIVERGED and abs(omega[1]) < _DIVERGED and abs(omega[2]) < _DIVERGED):  # or NaN
                diverged[s] = True
                orientation[s, k:], velocity[s, k:], tension[s, k:] = np.nan, np.nan, np.nan
                break
            turn = _turn(q, 2.0)
            _stand(eye, motor[s, k], at, end, behind)
            torque = _pull(eye, turn, end, behind, tension[s, k])
            orientation[s, k, 0], orientation[s, k, 1], orientation[s, k, 2], orientation[s, k, 3] = q
            velocity[s, k, 0], velocity[s, k, 1], velocity[s, k, 2] = omega
            if k + 1 == samples:
                break
            if substeps:
                h = step_s / substeps
                for j in range(substeps):
                    before, speed = q, omega
                    rate, change = (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
                    for i in range(4):
                        there, then = _along(before, rate, _STAGES[i] * h), _on(speed, change, _STAGES[i] * h)
                        if i + j:  # the first torque is the recorded one
                            _between(motor[s, k], motor[s, k + 1], (j + _STAGES[i]) / substeps, between)
                            _stand(eye, between, at, end, behind)
                            turn = _turn(there, 2 / _square(there))
                            torque = _pull(eye, turn, end, behind, scratch)
                        rate = _scaled(_product(then, there, 0.0), 0.5)
                        change = _acceleration(eye, turn, then, torque)
                        q, omega = _along(q, rate, _WEIGHTS[i] * h), _on(omega, change, _WEIGHTS[i] * h)
                    q = _scaled(q, 1 / math.sqrt(_square(q)))
            elif published == 1:
                omega = _on(omega, _published(eye, turn, omega, torque), step_s)
                q = _along(q, _product(omega, q, 0.0), 0.5 * step_s)
                q = _scaled(q, 1 / math.sqrt(_square(q)))
            else:
                if published == 2:
                    omega = _on(omega, _sticking(eye, turn, omega, torque), step_s)
                else:
                    omega = _on(omega, _acceleration(eye, turn, omega, torque), step_s)
                half = 0.5 * step_s
                q = _turned(q, (half * omega[0], half * omega[1], half * omega[2]))


def _creep(
    eye: Eye,
    motor: Array,
    orientation: Array,
    velocity: Array,
    diverged: NDArray[np.bool_],
    step_s: float,
    stride: int,
) -> None:
    """Move eyes without inertia, friction * omega = torque, by the midpoint method; see `_run`.

    Args:
        eye: that moves.
        motor: positions of the joints [rad or m], (saccades, time, motors); in the middle of a step their mean over it.
        orientation: of the eyes (saccades, time, 4): the first sample is the start, the others are written.
        velocity: written, [rad/s], head frame, (saccades, time, 3).
        diverged: written, (saccades,): faster than 1e4 rad/s, or no number; NaN from there on.
        step_s: between samples [s].
        stride: samples a step; those inside it lie on the cubic through its ends and their velocities.
    """
    samples, motors, tendons = motor.shape[1], motor.shape[2], len(eye.pulled)
    at, end, behind = np.empty(motors), np.empty((tendons, 3)), np.empty(tendons)
    scratch, middle = np.empty(tendons), np.empty(motors)
    for s in range(len(motor)):
        at[:] = np.nan
        q = orientation[s, 0, 0], orientation[s, 0, 1], orientation[s, 0, 2], orientation[s, 0, 3]
        q = _scaled(q, 1 / math.sqrt(_square(q)))
        omega = _creeping(eye, q, motor[s, 0], at, end, behind, scratch)
        k = 0
        while True:
            if not (abs(omega[0]) < _DIVERGED and abs(omega[1]) < _DIVERGED and abs(omega[2]) < _DIVERGED):  # or NaN
                diverged[s] = True
                orientation[s, k:], velocity[s, k:] = np.nan, np.nan
                break
            orientation[s, k, 0], orientation[s, k, 1], orientation[s, k, 2], orientation[s, k, 3] = q
            velocity[s, k, 0], velocity[s, k, 1], velocity[s, k, 2] = omega
            n = min(stride, samples - 1 - k)
            if n == 0:
                break
            h = n * step_s
            before, leaving = q, _scaled(_product(omega, q, 0.0), 0.5 * h)
            _mean(motor[s, k : k + n + 1], middle)
            there = _turned(q, (0.25 * h * omega[0], 0.25 * h * omega[1], 0.25 * h * omega[2]))
            omega = _creeping(eye, there, middle, at, end, behind, scratch)
            q = _turned(q, (0.5 * h * omega[0], 0.5 * h * omega[1], 0.5 * h * omega[2]))
            omega = _creeping(eye, q, motor[s, k + n], at, end, behind, scratch)
            arriving = _scaled(_product(omega, q, 0.0), 0.5 * h)
            bend = _along(_along(_along(_scaled(q, 3.0), before, -3.0), leaving, -2.0), arriving, -1.0)
            twist = _along(_along(_along(_scaled(q, -2.0), before, 2.0), leaving, 1.0), arriving, 1.0)
            for j in range(1, n):  # Hermite's cubic
                x = j / n
                inside = _along(before, _along(leaving, _along(bend, twist, x), x), x)
                rate = _along(leaving, _along(_scaled(bend, 2.0), twist, 3 * x), x)
                part = 1 / _square(inside)
                spin, inside = _spin(inside, rate, 2 * part / h), _scaled(inside, math.sqrt(part))
                orientation[s, k + j, 0], orientation[s, k + j, 1] = inside[0], inside[1]
                orientation[s, k + j, 2], orientation[s, k + j, 3] = inside[2], inside[3]
                velocity[s, k + j, 0], velocity[s, k + j, 1], velocity[s, k + j, 2] = spin
            k += n


def _still(eye: Eye, turn: Array, motor: Array, torque: Array, tension: Array) -> None:
    """Torque of elastics and weight on eyes at rest.

    Args:
        eye: that is turned.
        turn: rotation matrices, (n, 3, 3).
        motor: positions of the joints [rad or m], (n, motors).
        torque: written, [N m], (n, 3).
        tension: written, [N], (n, tendons).
    """
    tendons = len(eye.pulled)
    at, end, behind = np.empty(motor.shape[-1]), np.empty((tendons, 3)), np.empty(tendons)
    at[:] = np.nan
    for i in range(len(motor)):
        _stand(eye, motor[i], at, end, behind)
        torque[i, 0], torque[i, 1], torque[i, 2] = _pull(eye, _matrix(turn[i]), end, behind, tension[i])


def _cache_folder() -> Path | None:
    """Where compiled code is kept: the user's cache folder; None where that cannot be written."""
    folder = user_cache("numba")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return None
    return folder


def _compiled(function: Callable[..., None], signature: tuple[Any, ...]) -> Callable[..., None]:
    """Compiled for that signature, or read from the cache."""
    compiled: Any
    config: Any = numba.config
    own = config.CACHE_DIR  # the user's variable NUMBA_CACHE_DIR, which goes before ours
    folder = own or _cache_folder()
    if folder:
        try:
            config.CACHE_DIR = str(folder)  # what other packages compile goes where it went
            compiled = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
        finally:
            config.CACHE_DIR = own
        try:
            compiled.compile(signature)
        except Exception:  # a full disk, a damaged file: a cache saves time, and nothing hangs on it
            pass
        else:
            return compiled
    compiled = numba.njit(nogil=True, error_model="numpy")(function)
    compiled.compile(signature)
    return compiled


_NUMBER = numba.float64
_typeof: Any = numba.typeof
_EYE = _typeof(
    Eye(
        np.zeros((1, 3)),
        np.zeros((1, 3)),
        np.zeros((1, 3, 3)),
        np.zeros((1, 3)),
        np.zeros(2, np.int64),
        np.zeros(1, np.int64),
        np.zeros(1, bool),
        np.zeros((2, 3, 3)),
        0.0,
        np.zeros((2, 3)),
    )
)
_BATCH, _ROWS = _NUMBER[:, :, ::1], _NUMBER[:, ::1]
run = _compiled(_run, (_EYE, *[_BATCH] * 4, numba.boolean[::1], _NUMBER, numba.int64, numba.int64))
still = _compiled(_still, (_EYE, _BATCH, _ROWS, _ROWS, _ROWS))


@cache
def creep() -> Callable[..., None]:
    """`_creep`, compiled when it is first asked for: one plant alone needs it."""
    return _compiled(_creep, (_EYE, *[_BATCH] * 3, numba.boolean[::1], _NUMBER, numba.int64))
