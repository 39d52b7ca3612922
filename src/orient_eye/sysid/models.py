"""Linear models of the eye behind its motor, with their exact response to a measured motor movement.

    first_order              K w0 / (s + w0)                                 (thesis 3.11)
    first_order_dead_time    the same, e^(-L s) later
    second_order             K wn^2 / (s^2 + 2 zeta wn s + wn^2)
    second_order_dead_time   the same, e^(-L s) later

The motor moves along straight lines between its samples. On such a line, u = u0 + m t, the states
of these models are known in closed form: a particular solution (u - m/w0, or u - 2 zeta m/wn) plus
a decaying free motion. So the response is exact at any time, whatever the sampling, and the dead
time only shifts it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye.sysid.step_response import StepResponse

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """A number to be identified.

    Attributes:
        name: symbol of the thesis where it has one.
        unit: for tables.
        low: lower bound.
        high: upper bound.
        starts: values the search starts from; empty for K, which follows from the others.
    """

    name: str
    unit: str
    low: float
    high: float
    starts: tuple[float, ...] = ()


_K = Parameter("K", "deg/deg", -100.0, 100.0)
_W0 = Parameter("w0", "rad/s", 0.1, 500.0, (1, 2, 5, 8, 12, 16, 20, 25, 32, 45, 70, 120, 250))
_WN = Parameter("wn", "rad/s", 0.2, 1000.0, (2, 5, 10, 15, 20, 30, 45, 70, 120, 250))
_ZETA = Parameter("zeta", "", 0.02, 5.0, (0.2, 0.5, 0.8, 1.2, 2.5))
_DEAD_TIME = Parameter("dead_time", "s", 0.0, 0.2, (0.0, 0.005, 0.015, 0.03, 0.06, 0.12))

Motion = Callable[[Array, Array], tuple[Array, Array]]
"""From the parameters between K and the dead time and intervals (n,) [s] to the free motion over each
interval, (n, states, states), and the particular solution's offset per unit slope, (states,)."""


def _first_order(shape: Array, interval: Array) -> tuple[Array, Array]:
    (w0,) = shape
    return np.exp(-w0 * interval)[:, None, None], np.array([-1 / w0])


def _second_order(shape: Array, interval: Array) -> tuple[Array, Array]:
    wn, zeta = shape
    # exp(A t) with A = [[0, 1], [-wn^2, -2 zeta wn]] = e^(-a t) (cosh(s t) I + sinh(s t)/s (A + a I)),
    # a = zeta wn, s^2 = a^2 - wn^2. Written with e^(-(a -+ s) t), which neither overflows nor, at s = 0, divides by it.
    a = zeta * wn
    s = np.sqrt(complex(a * a - wn * wn))
    slow, fast = np.exp(-(a - s) * interval), np.exp(-(a + s) * interval)
    small = np.abs(s) * interval < 1e-4
    series = np.exp(-a * interval) * interval * (1 + (s * interval) ** 2 / 6)
    sine = np.where(small, series, (slow - fast) / np.where(small, 1, 2 * s)).real
    cosine = ((slow + fast) / 2).real
    motion = np.stack([np.stack([cosine + a * sine, sine], -1), np.stack([-wn * wn * sine, cosine - a * sine], -1)], -2)
    return motion, np.array([-2 * zeta / wn, 1.0])


@dataclass(frozen=True)
class Model:
    """A transfer function with named parameters: K first, the dead time, where it has one, last."""

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    motion: Motion

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(p.name for p in self.parameters)

    def response(self, values: Array, step: StepResponse) -> Array:
        """Where the model's eye is at the samples of a step response [deg], (samples,).

        Args:
            values: of the parameters, in their order.
            step: its motor movement drives the model, from rest.
        """
        return float(values[0]) * self.shape_response(values[1:], step)

    def shape_response(self, values: Array, step: StepResponse) -> Array:
        """Response for K = 1; values are the parameters after K."""
        dead_time = float(values[-1]) if self.names[-1] == "dead_time" else 0.0
        shape = np.asarray(values[: len(values) - (self.names[-1] == "dead_time")], dtype=float)
        node_time, node_u, slope = _lines(step)
        state = self._states_at_nodes(shape, node_time, node_u, slope)
        elapsed = step.time - dead_time
        node = np.searchsorted(node_time, elapsed, side="right") - 1
        answer = np.zeros(len(elapsed))
        moving = node >= 0
        node, since = node[moving], elapsed[moving] - node_time[node[moving]]
        motion, offset = self.motion(shape, since)
        particular = node_u[node, None] * _position(len(offset)) + slope[node, None] * offset
        free = np.einsum("nj,nj->n", motion[:, 0], state[node] - particular)
        answer[moving] = free + particular[:, 0] + slope[node] * since
        return answer

    def _states_at_nodes(self, shape: Array, time: Array, u: Array, slope: Array) -> Array:
        """State (nodes, states) at the start of every line; at rest at the first."""
        interval = np.diff(time)
        motion, offset = self.motion(shape, interval)
        first = _position(len(offset))
        start = u[:-1, None] * first + slope[:-1, None] * offset
        end = start + (slope[:-1] * interval)[:, None] * first
        push = end - np.einsum("nij,nj->ni", motion, start)
        states = np.zeros((len(time), len(offset)))
        if len(offset) == 1:
            y = 0.0
            for k, (e, p) in enumerate(zip(motion[:, 0, 0].tolist(), push[:, 0].tolist(), strict=True)):
                y = e * y + p
                states[k + 1, 0] = y
        else:
            y = v = 0.0
            rows = zip(motion.reshape(-1, 4).tolist(), push.tolist(), strict=True)
            for k, ((yy, yv, vy, vv), (p, q)) in enumerate(rows):
                y, v = yy * y + yv * v + p, vy * y + vv * v + q
                states[k + 1] = y, v
        return states


def _position(states: int) -> Array:
    unit: Array = np.eye(states)[0]
    return unit


def _lines(step: StepResponse) -> tuple[Array, Array, Array]:
    """Start times, start values and slopes of the straight lines the motor moves along."""
    slope = np.append(np.diff(step.motor_deg) / np.diff(step.time), 0.0)
    bend = np.append(True, slope[1:] != slope[:-1])
    return step.time[bend], step.motor_deg[bend], slope[bend]


MODELS: dict[str, Model] = {
    model.name: model
    for model in (
        Model("first_order", "first order", (_K, _W0), _first_order),
        Model("first_order_dead_time", "first order, dead time", (_K, _W0, _DEAD_TIME), _first_order),
        Model("second_order", "second order", (_K, _WN, _ZETA), _second_order),
        Model("second_order_dead_time", "second order, dead time", (_K, _WN, _ZETA, _DEAD_TIME), _second_order),
    )
}
"""Name to model, simplest first."""
