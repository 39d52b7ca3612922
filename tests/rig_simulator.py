"""True rigs for the tests of the whole road: recorded steps in, the eye's answer to a command out.

Nothing here is shared with the plants of orient_eye: the motor, its play and the eye are equations of their own,
integrated by `scipy.integrate.solve_ivp`, and what is recorded of them is noisy, uneven and incomplete as a real log.

    rig = draw_rig("swinging", seed=3)
    path = rig.record(tmp_path)                      # CSV files of steps
    t, eye = rig.perform(time, motor, seed=0)        # what a command does
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
KINDS = ("fast", "swinging", "slow")
_GRID_S = 2.5e-4
_STEP_AT_S = 0.2
_CATCH_UP = 400.0  # 1/s, of a motor that lags
_RESERVE = 1.1  # what a motor has beyond the acceleration that its data sheet promises: without it, no lag is made up


@dataclass(frozen=True)
class TrueRig:
    """One rig.

    Attributes:
        kind: one of `KINDS`.
        K: deg of eye a deg of motor.
        order: 1, with wn its cut-off, or 2.
        wn: [rad/s].
        zeta: damping ratio of the second order.
        dead_time: [s].
        reach: of the motor to either side [deg].
        speed: of the motor at most [deg/s].
        acceleration: at most [deg/s^2]; None for no limit.
        play: between motor and eye, all of it [deg].
        noise: of the eye's sensor, standard deviation [deg].
        motor_noise: of the motor's sensor [deg].
        uneven: standard deviation of the time between rows of 10 ms, as a share.
        dropped: share of the rows that is missing.
        axis: that it turns.
        seed: of everything random.
        counts_per_deg: of its driver, which counts the other way from 512; None for one that speaks in deg.
        rate: new positions that its driver takes a second.
    """

    kind: str
    K: float
    order: int
    wn: float
    zeta: float
    dead_time: float
    reach: float
    speed: float
    acceleration: float | None
    play: float
    noise: float
    motor_noise: float
    uneven: float
    dropped: float
    axis: str
    seed: int
    counts_per_deg: float | None
    rate: float

    @property
    def column(self) -> str:
        """Of the motor in its driver's files."""
        return "servo_deg" if self.counts_per_deg is None else "servo_counts"

    def to_driver(self, motor: Array) -> Array:
        """Driver's numbers of positions [deg]."""
        return motor if self.counts_per_deg is None else 512 - self.counts_per_deg * motor

    def from_driver(self, numbers: Array) -> Array:
        """Positions [deg] of a driver's numbers."""
        return numbers if self.counts_per_deg is None else (512 - numbers) / self.counts_per_deg

    def describe(self, file: Path) -> Path:
        """What its owner writes down of it, as TOML."""
        counts = "" if self.counts_per_deg is None else f"counts_per_deg = {self.counts_per_deg}\nzero = 512\nsign = -1"
        acceleration = "" if self.acceleration is None else f"acceleration_limit = {self.acceleration}"
        file.write_text(
            f"""name = "{self.name}"
command_rate_hz = {self.rate}
[[motors]]
name = "servo"
unit = "{self.column.removeprefix("servo_")}"
{counts}
range = [{-self.reach}, {self.reach}]
speed_limit = {self.speed}
{acceleration}
[axes]
{self.axis} = {{ servo = 1.0 }}
""",
            encoding="utf-8",
        )
        return file

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.kind}-{self.seed}"

    def motor_path(self, command: Callable[[Array], Array], until: float, first: float) -> tuple[Array, Array]:
        """Times and positions of the motor under a command, from rest at `first`."""
        grid = np.arange(0, until + _GRID_S / 2, _GRID_S)
        told = command(grid)
        # The driver sees the rows of a command as a smooth path and feeds its speed and acceleration forward.
        width = 8
        smooth = np.convolve(np.pad(told, width // 2, mode="edge"), np.full(width, 1 / width), "same")
        pace = np.gradient(smooth[width // 2 : -(width // 2)], _GRID_S)
        push = np.gradient(pace, _GRID_S)

        def at(t: float, values: Array) -> float:
            return float(np.interp(t, grid, values))

        def slope(t: float, state: Array) -> list[float]:
            gap = at(t, told) - state[0]
            if self.acceleration is None:
                return [float(np.clip(at(t, pace) + _CATCH_UP * gap, -self.speed, self.speed))]
            # As fast as it can brake within the gap, and not faster than the servo's own bandwidth.
            braking = np.sqrt(1.6 * self.acceleration * abs(gap))
            wanted = np.sign(gap) * min(braking, _CATCH_UP * abs(gap)) + at(t, pace)
            wanted = float(np.clip(wanted, -self.speed, self.speed))
            forced = at(t, push) + _CATCH_UP * (wanted - state[1])
            most = _RESERVE * self.acceleration
            return [state[1], float(np.clip(forced, -most, most))]

        state = [first] if self.acceleration is None else [first, 0.0]
        solved = solve_ivp(slope, (0, grid[-1]), state, t_eval=grid, max_step=1e-3, rtol=1e-6, atol=1e-7)
        return grid, np.clip(solved.y[0], -self.reach, self.reach)

    def eye_path(self, time: Array, motor: Array, behind: float) -> Array:
        """The eye [deg] at these times, from rest; the play is left `behind` the motor at first [deg]."""
        half = self.play / 2
        pulled = np.empty_like(motor)
        pulled[0] = motor[0] - np.clip(behind, -half, half)
        for k in range(1, len(motor)):
            pulled[k] = min(max(pulled[k - 1], motor[k] - half), motor[k] + half)

        def drive(t: float) -> float:
            return self.K * float(np.interp(t - self.dead_time, time, pulled))

        def first_order(t: float, state: Array) -> list[float]:
            return [self.wn * (drive(t) - state[0])]

        def second_order(t: float, state: Array) -> list[float]:
            push = self.wn**2 * (drive(t) - state[0])
            return [state[1], push - 2 * self.zeta * self.wn * state[1]]

        slope, rest = (first_order, [drive(0)]) if self.order == 1 else (second_order, [drive(0), 0.0])
        solved = solve_ivp(slope, (0, time[-1]), rest, t_eval=time, max_step=1e-3, rtol=1e-7, atol=1e-8)
        return np.asarray(solved.y[0])

    def perform(self, time: Array, motor: Array, seed: int, until: float) -> tuple[Array, Array, Array]:
        """Times, motor and eye [deg] under a command of rows, from rest at its first, without a sensor's noise."""
        grid, taken = self.motor_path(lambda t: np.interp(t, time, motor), until, float(motor[0]))
        behind = np.random.default_rng([self.seed, seed]).uniform(-self.play, self.play) / 2
        return grid, taken, self.eye_path(grid, taken, behind)

    def record(self, folder: Path, amplitudes: tuple[float, ...] = (5.0, -8.0, 12.0, -16.0, 20.0)) -> list[Path]:
        """CSV files of steps of the motor [deg], as a log of the rig would have them."""
        random = np.random.default_rng([self.seed, 99])
        folder.mkdir(parents=True, exist_ok=True)
        paths = []
        for amplitude in amplitudes:
            until = _STEP_AT_S + max(1.0, 12 / (self.wn * min(self.zeta, 1.0)) + 40 / self.speed)
            grid, motor = self.motor_path(_step_to(amplitude), until, 0.0)
            eye = self.eye_path(grid, motor, random.uniform(-self.play, self.play) / 2)
            rows = np.cumsum(0.01 * np.maximum(1 + self.uneven * random.normal(size=int(until / 0.01) + 50), 0.2))
            rows = rows[(rows < until) & (random.random(len(rows)) >= self.dropped)]
            told = np.interp(rows, grid, motor) + self.motor_noise * random.normal(size=len(rows))
            seen = np.interp(rows, grid, eye) + self.noise * random.normal(size=len(rows))
            paths.append(folder / f"{self.name}_{amplitude:g}.csv")
            numbers = zip(rows - _STEP_AT_S, self.to_driver(told), seen, strict=True)
            lines = [f"{t:.6f},{m:.5f},{e:.5f}" for t, m, e in numbers]
            paths[-1].write_text("\n".join([f"t_s,{self.column},{self.axis}_deg", *lines]) + "\n", encoding="utf-8")
        return paths


def _step_to(amplitude: float) -> Callable[[Array], Array]:
    return lambda t: np.where(t < _STEP_AT_S, 0.0, amplitude)


def draw_rig(kind: str, seed: int) -> TrueRig:
    """A rig of a kind, its parameters drawn by the seed."""
    random = np.random.default_rng([KINDS.index(kind), seed])

    def between(low: float, high: float) -> float:
        return float(random.uniform(low, high))

    axis = ("yaw", "pitch", "roll")[seed % 3]
    if kind == "fast":
        return TrueRig(
            kind, between(1.0, 2.0), 1, between(12, 30), 1.0, 0.0, 60.0, between(350, 900), None, 0.0,
            between(0.02, 0.1), between(0.01, 0.05), 0.05, 0.0, axis, seed, None, 1000.0,
        )  # fmt: skip
    if kind == "swinging":
        return TrueRig(
            kind, between(0.9, 2.0), 2, between(12, 30), between(0.4, 0.9), between(0.004, 0.015), 60.0,
            between(300, 800), None, between(0, 0.1), between(0.02, 0.1), between(0.01, 0.05), 0.1, 0.02, axis, seed,
            None, 500.0,
        )  # fmt: skip
    return TrueRig(
        kind, between(1.0, 2.0), 1 + seed % 2, between(10, 22), between(0.8, 1.2), between(0, 0.008), 60.0,
        between(120, 250), between(3000, 12000) if seed % 2 else None, between(0.2, 0.6), between(0.05, 0.1),
        between(0.02, 0.05), 0.25, between(0.1, 0.25), axis, seed, 1024 / 90, 200.0,
    )  # fmt: skip
