"""The pulse-step command and its low-pass response: laws of every entry of `PULSES`, then ours one by one.

The laws are held against a chain of first-order filters, one for each pole of the pulse, and quadrature. The witness of
the thesis' pulses is written from the definitions: f(t) of each variant, A from D (thesis 4.9, 4.15 and the corrected
4.24), tau = F + p + k0 integral p (4.1), theta' = w0 (K tau - theta) (3.11).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.linalg import expm, solve_continuous_lyapunov
from scipy.optimize import brentq, minimize_scalar
from scipy.special import gammainc, gammaincinv

from orient_eye.commands.pulse_step import PulseStep
from orient_eye.commands.pulses import PULSES, keeps_speed_limit, varying_C
from orient_eye.constants import SPEED_LIMIT
from orient_eye.errors import InputError
from orient_eye.plants import make_plant
from orient_eye.surrogate import Surrogate
from orient_eye.task.cases import Case
from orient_eye.task.saccade import SaccadeTask
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
K, W0 = 1.4758, 17.5  # thesis 3.3.1
PLANT = make_plant("lpf", surrogate=Surrogate(K, W0))
THESIS = ("1", "2", "3")
OURS = (*THESIS, "smooth")
VARYING = [name for name in PULSES if PULSES[name].onset is not None]

properties = settings(deadline=None, max_examples=40, derandomize=True)
angle = st.floats(-80, 80)
decay = st.floats(5, 80)
gain = st.floats(5, 40)
onset = st.floats(0.18, 500)


@dataclass(frozen=True)
class Plain:
    """One motor, one saccade, from the definitions."""

    variant: str
    F: float
    B: float
    D: float
    k0: float
    C: float = 1.0

    @property
    def A(self) -> float:
        """Thesis 4.9, 4.15, and 4.24 with B (B + C)^2; that of t^2 by the integral 2 / B^3 of t^2 e^(-Bt)."""
        B, C = self.B, self.C
        areas = {"1": 1 / B**2, "2": C / (B * (B + C)), "3": C**2 / (B * (B + C) ** 2), "smooth": 2 / B**3}
        return (self.D - self.F) / (self.k0 * areas[self.variant])

    def onset(self, t: float) -> float:
        """f(t): t (4.3), 1 - e^(-Ct) (4.10), 1 - e^(-Ct) - Ct e^(-Ct) (4.19), without cancellation; t^2."""
        C = self.C
        forms = {
            "1": lambda: t,
            "2": lambda: -np.expm1(-C * t),
            "3": lambda: gammainc(2, C * t),
            "smooth": lambda: t**2,
        }
        return float(forms[self.variant]())

    def onset_rate(self, t: float) -> float:
        C = self.C
        forms = {
            "1": lambda: 1.0,
            "2": lambda: C * np.exp(-C * t),
            "3": lambda: C**2 * t * np.exp(-C * t),
            "smooth": lambda: 2 * t,
        }
        return float(forms[self.variant]())

    def pulse(self, t: float) -> float:
        return self.A * np.exp(-self.B * t) * self.onset(t)

    def pulse_area(self, t: float) -> float:
        return integral(self.pulse, t, self.knots)

    def tau(self, t: float) -> float:
        return self.F + self.pulse(t) + self.k0 * self.pulse_area(t)

    def rate(self, t: float) -> float:
        slope = self.A * np.exp(-self.B * t) * (self.onset_rate(t) - self.B * self.onset(t))
        return float(slope + self.k0 * self.pulse(t))

    def energy(self) -> float:
        return integral(lambda t: self.rate(t) ** 2, 45 / (2 * self.B), self.knots)

    def theta(self, t: float, K: float = K, w0: float = W0) -> float:
        """K F e^(-w0 t) + K w0 integral of tau(s) e^(-w0 (t - s)), with tau by parts, so one integral does.

        The response to k0 times the integral P of p is k0 (P - y / w0) with y the response to p.
        """
        y = integral(lambda s: w0 * self.pulse(s) * np.exp(-w0 * (t - s)), t, [*self.knots, t - 1 / w0])
        return K * (self.F + y + self.k0 * (self.pulse_area(t) - y / w0))

    @property
    def knots(self) -> list[float]:
        """Where the pulse bends, for the quadrature."""
        return [x / r for x in (0.3, 1, 3, 10) for r in (self.B, self.B + self.C)]

    def command(self) -> PulseStep:
        return single(self.variant, self.F, self.B, self.D, self.k0, self.C)


def single(name: str, F: float, B: float, D: float, k0: float, C: float) -> PulseStep:
    """One motor, one saccade; a pulse without an onset is told no C."""
    numbers = (np.array([[x]]) for x in (F, B, D, k0))
    return PulseStep(*numbers, name, None if PULSES[name].onset is None else C)


def yaw_of(command: PulseStep, t: Array) -> Array:
    """Of the low-pass eye, (time,)."""
    response = PLANT.move(command).response
    return response.start[0] + (response.final - response.start)[0] * response.motion(t[None])[0][0]


def integral(f: Callable[[float], float], end: float, knots: list[float]) -> float:
    points = sorted({k for k in knots if 0 < k < end})
    return float(quad(f, 0, end, points=points or None, epsabs=0, epsrel=1e-12, limit=400)[0])


def times(plain: Plain) -> Array:
    return np.concatenate([[0, 1e-6], np.array([0.05, 0.3, 1, 2, 5, 12]) / plain.B])


def assert_over_time(found: Array, exact: Callable[[float], float], at: Array, peak: float) -> None:
    """To 1e-9 of the peak magnitude."""
    np.testing.assert_allclose(found, [exact(float(t)) for t in at], rtol=0, atol=1e-9 * peak)


def hold_against_quadrature(plain: Plain) -> None:
    command, at = plain.command(), times(plain)
    fine = np.geomspace(1e-7, 12 / plain.B, 2000)
    step = abs(plain.D - plain.F)
    pulse, tau, rate = command.pulse_at(at), command.position(at), command.rate(at)
    assert pulse.shape == tau.shape == rate.shape == (1, len(at), 1)
    assert_over_time(pulse[0, :, 0], plain.pulse, at, np.abs(command.pulse_at(fine)).max())
    assert_over_time(tau[0, :, 0] - plain.F, lambda t: plain.tau(t) - plain.F, at, step)
    assert_over_time(rate[0, :, 0], plain.rate, at, np.abs(command.rate(fine)).max())
    assert command.energy().shape == (1,)
    assert command.energy()[0] == pytest.approx(plain.energy(), rel=1e-9, abs=0)
    yaw = yaw_of(command, at)
    assert_over_time(yaw - K * plain.F, lambda t: plain.theta(t) - K * plain.F, at, K * step)


# --- laws of every pulse --------------------------------------------------------------------------


@dataclass(frozen=True)
class Chain:
    """A pulse as first-order filters in a row, x_i' = p_i (x_i-1 - x_i), struck at t = 0: p(s) of `Pulse.poles`.

    Behind them its integral, and the eye: theta' = w0 (K tau - theta), from K F.
    """

    poles: tuple[float, ...]
    step: float
    k0: float

    @classmethod
    def of(cls, command: PulseStep) -> "Chain":
        poles = command.kind.poles(command.B, np.asarray(command.C))
        return cls(tuple(float(pole[0, 0]) for pole in poles), float(command.step[0, 0]), float(command.k0[0, 0]))

    @property
    def matrix(self) -> Array:
        n = len(self.poles)
        A = np.zeros((n + 2, n + 2))
        for i, pole in enumerate(self.poles):
            A[i, i], A[i, i - 1 if i else i] = -pole, pole if i else -pole
        A[n, n - 1] = 1.0
        A[n + 1] = W0 * K * self.moved
        A[n + 1, n + 1] = -W0
        return A

    @property
    def moved(self) -> Array:
        """tau - F from the state."""
        n = len(self.poles)
        return np.array([*np.zeros(n - 1), 1.0, self.k0, 0.0])

    @property
    def struck(self) -> Array:
        start = np.zeros(len(self.poles) + 2)
        start[0] = self.step / self.k0 * self.poles[0]
        return start

    def states(self, t: Array) -> Array:
        """(time, filters, then integral and eye)."""
        return np.array([expm(self.matrix * s) @ self.struck for s in t])

    def energy(self) -> float:
        """Integral of (moved . x')^2, by Lyapunov's equation; moved . x' needs the filters only."""
        n = len(self.poles)
        A, b = self.matrix[:n, :n], self.struck[:n]
        speed = (self.moved @ self.matrix)[:n]
        return float(b @ solve_continuous_lyapunov(A.T, -np.outer(speed, speed)) @ b)


@pytest.mark.parametrize("name", PULSES)
@properties
@given(F=angle, B=decay, D=angle, k0=gain, C=onset)
def test_every_pulse_is_its_poles(name: str, F: float, B: float, D: float, k0: float, C: float) -> None:
    """Pulse, position, speed and eye over time, against the matrix exponential of the filters."""
    if abs(D - F) < 1e-3 or C < 0.01 * B:
        return
    command = single(name, F, B, D, k0, C)
    chain = Chain.of(command)
    t = np.concatenate([[0, 1e-6], np.array([0.05, 0.3, 1, 2, 5, 12]) / B])
    x = chain.states(t)
    rate = x @ chain.matrix.T @ chain.moved
    fine = np.geomspace(1e-7, 12 / B, 2000)
    for found, exact, peak in (
        (command.pulse_at(t), x[:, -3], np.abs(command.pulse_at(fine)).max()),
        (command.position(t) - F, x @ chain.moved, abs(D - F)),
        (command.rate(t), rate, np.abs(command.rate(fine)).max()),
        (yaw_of(command, t)[None, :, None] - K * F, x[:, -1], K * abs(D - F)),
    ):
        np.testing.assert_allclose(found[0, :, 0], exact, rtol=0, atol=2e-9 * peak)


@pytest.mark.parametrize("name", PULSES)
@properties
@given(F=angle, B=decay, D=angle, k0=gain, C=onset)
def test_energy_of_every_pulse(name: str, F: float, B: float, D: float, k0: float, C: float) -> None:
    if C >= 0.01 * B:
        command = single(name, F, B, D, k0, C)
        assert command.energy()[0] == pytest.approx(Chain.of(command).energy(), rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("name", PULSES)
@pytest.mark.parametrize("C", [0.9, 3.6, 85.0, 5000.0])
def test_every_pulse_by_quadrature(name: str, C: float) -> None:
    """Position, speed, pulse and energy are computed apart: each is the integral of the one before."""
    command = single(name, -5.0, 40.0, 15.0, 12.0, C)
    knots = [x / r for x in (0.3, 1, 3, 10) for r in (40, 40 + C)]
    for end in (0.004, 0.03, 0.2):
        area = integral(lambda t: command.pulse_at([t])[0, 0, 0], end, knots)
        way = integral(lambda t: command.rate([t])[0, 0, 0], end, knots)
        position, pulse = command.position([end])[0, 0, 0], command.pulse_at([end])[0, 0, 0]
        assert position == pytest.approx(-5.0 + way, rel=0, abs=1e-9 * 20)
        assert position == pytest.approx(-5.0 + pulse + 12.0 * area, rel=0, abs=1e-9 * 20)
    energy = integral(lambda t: command.rate([t])[0, 0, 0] ** 2, 45 / 80, knots)
    assert command.energy()[0] == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("name", PULSES)
@pytest.mark.parametrize("C", [0.9, 85.0])
def test_every_pulse_starts_at_F_and_ends_at_D(name: str, C: float) -> None:
    for F, D in ((-12.0, 9.5), (20.0, -23.0), (7.0, 7.0)):
        command = single(name, F, 20.0, D, 12.0, C)
        start, end = command.position([0.0, 40.0])[0, :, 0]
        assert start == pytest.approx(F + command.pulse_at([0.0])[0, 0, 0], rel=0, abs=1e-12 * 45)
        assert end == pytest.approx(D, rel=0, abs=1e-11 * 45)
        assert command.final[0, 0] == D
        response = PLANT.move(command).response
        np.testing.assert_allclose([response.start[0], response.final[0]], [K * F, K * D], rtol=1e-15)
        np.testing.assert_allclose(yaw_of(command, np.array([0.0, 40.0])), [K * F, K * D], rtol=0, atol=1e-11 * 45)


@properties
@given(name=st.sampled_from(list(PULSES)), F=angle, B=decay, D=angle, k0=gain, C=onset)
def test_energy_goes_with_the_square_of_the_step(name: str, F: float, B: float, D: float, k0: float, C: float) -> None:
    unit = single(name, 0.0, B, 1.0, k0, C).energy()[0]
    assert single(name, F, B, D, k0, C).energy()[0] == pytest.approx((D - F) ** 2 * unit, rel=1e-14)
    assert single(name, -F, B, -D, k0, C).energy()[0] == pytest.approx((D - F) ** 2 * unit, rel=1e-14)


@pytest.mark.parametrize("name", PULSES)
def test_batch_shapes_and_motors(name: str) -> None:
    """(saccades, time, motors); each motor as if alone, the energies of the motors summed."""
    rng = np.random.default_rng(0)
    F, D = rng.uniform(-20, 20, (2, 4, 3))
    B, k0, C = rng.uniform(20, 80, (4, 3)), rng.uniform(5, 40, (4, 3)), rng.uniform(1, 90, (4, 3))
    t = np.linspace(0, 0.3, 7)
    command = PulseStep(F, B, D, k0, name, C)
    alone = [[single(name, *(x[i, j] for x in (F, B, D, k0, C))) for j in range(3)] for i in range(4)]
    for method in ("pulse_at", "position", "rate"):
        batch = getattr(command, method)(t)
        assert batch.shape == (4, 7, 3)
        for i in range(4):
            for j in range(3):
                np.testing.assert_array_equal(batch[i, :, j], getattr(alone[i][j], method)(t)[0, :, 0])
    energy = [sum(each.energy()[0] for each in row) for row in alone]
    np.testing.assert_allclose(command.energy(), energy, rtol=1e-14)
    np.testing.assert_array_equal(command.sample(0.05, 7), command.position(0.05 * np.arange(7)))
    assert not command.too_fast.any()


def test_a_command_of_plain_numbers() -> None:
    """Lists and numbers, whole ones too, become arrays (saccades, motors)."""
    command = PulseStep([[0, 5]], [[35, 40]], [[20], [-3]], 17, "2", 85)
    expected = {"F": [0, 5], "B": [35, 40], "D": [[20], [-3]], "k0": 17, "C": 85}
    for name, value in expected.items():
        array = getattr(command, name)
        np.testing.assert_array_equal(array, np.broadcast_to(np.array(value, float), (2, 2)), strict=True, err_msg=name)
    np.testing.assert_array_equal(command.step, [[20, 15], [-3, -8]])


def test_some_saccades_of_a_command() -> None:
    rng = np.random.default_rng(0)
    parts = {name: rng.uniform(20, 80, (4, 3)) for name in ("F", "B", "D", "k0", "C")}
    too_fast, which = np.array([True, False, True, False]), np.array([2, 1])
    some = PulseStep(pulse="3", too_fast=too_fast, **parts)[which]
    assert (len(some), some.pulse, some.too_fast.tolist()) == (2, "3", [True, False])
    for name, array in parts.items():
        np.testing.assert_array_equal(getattr(some, name), array[which], err_msg=name)


@pytest.mark.parametrize("name", VARYING)
@properties
@given(step=st.floats(0.02, 160), B=st.floats(18, 80), k0=gain, V=st.sampled_from([720.0, 7200.0]))
def test_a_varying_C_keeps_the_speed_limit(name: str, step: float, B: float, k0: float, V: float) -> None:
    """Where one does; in a corner of variant 2 (k0 > 2 B + C) the speed rises by 2 % after its start."""
    C = find_C(name, step, B, k0, V)
    assert C > 0
    assert find_C(name, -step, B, k0, V) == C
    kept = bool(keeps_speed_limit(PULSES[name], *map(np.array, (step, B, k0)), V))
    t = np.concatenate([[0], np.geomspace(1e-7, 20 / B, 3000)])
    fastest = np.abs(single(name, 0.0, B, step, k0, C).rate(t)).max()
    assert not kept or fastest <= 1.02 * V


@pytest.mark.parametrize("name", [name for name in PULSES if name not in VARYING])
def test_a_pulse_without_an_onset_keeps_no_limit(name: str) -> None:
    assert not keeps_speed_limit(PULSES[name], *np.ones((3, 2, 1))).any()


# --- our pulses, against quadrature ---------------------------------------------------------------

ONSETS: dict[str, tuple[float, ...]] = {
    "1": (1.0,),
    "2": (0.3, 3.6, 85.0, 142.0, 5000.0),
    "3": (0.9, 3.6, 85.0, 5000.0),
    "smooth": (1.0,),
}
CASES = [(variant, C) for variant, onsets in ONSETS.items() for C in onsets]


@pytest.mark.parametrize(("variant", "C"), CASES)
@pytest.mark.parametrize("B", [5.0, 17.4, 35.0, 80.0])
def test_against_quadrature(variant: str, C: float, B: float) -> None:
    """B below and above w0 = 17.5, k0 below, at and above it."""
    for F, D, k0 in ((0.0, 20.33, 17.5), (-12.0, 9.5, 5.0), (20.0, -23.0, 40.0)):
        hold_against_quadrature(Plain(variant, F, B, D, k0, C))


@pytest.mark.parametrize("variant", OURS)
@pytest.mark.parametrize("gap", [0.0, *(sign * 10.0**-k for k in range(3, 13) for sign in (1, -1))])
def test_against_quadrature_where_a_pole_meets_w0(variant: str, gap: float) -> None:
    """B = w0, also with k0, and B + C = w0, exactly and nearly: there the partial fractions divide zero by zero."""
    k0 = W0 if gap == 0 else 12.0
    hold_against_quadrature(Plain(variant, 3.0, W0 + gap, 21.0, k0, 3.6))
    if variant in THESIS[1:]:
        hold_against_quadrature(Plain(variant, 3.0, W0 + gap - 3.6, 21.0, k0, 3.6))


@properties
@given(variant=st.sampled_from(OURS), F=angle, B=decay, D=angle, k0=gain, C=onset)
def test_against_quadrature_anywhere(variant: str, F: float, B: float, D: float, k0: float, C: float) -> None:
    if abs(D - F) > 1e-3 and C >= 0.01 * B:
        hold_against_quadrature(Plain(variant, F, B, D, k0, C))


@pytest.mark.parametrize("variant", THESIS[1:])
@pytest.mark.parametrize("B", [18.0, 35.0, 80.0])
@pytest.mark.parametrize("step", [1e-6, 0.1, 1.0, 5.0, 20.33, 60.0, 160.0])
def test_varying_C_keeps_the_accuracy(variant: str, B: float, step: float) -> None:
    """Also for the smallest saccades, whose C is smallest in variant 3 and largest in variant 2."""
    for k0 in (5.0, 17.5, 40.0):
        hold_against_quadrature(Plain(variant, 0.0, B, step, k0, find_C(variant, step, B, k0)))


@properties
@given(variant=st.sampled_from(OURS), F=angle, B=decay, D=angle, k0=gain, C=onset)
def test_energy_by_parseval(variant: str, F: float, B: float, D: float, k0: float, C: float) -> None:
    """Integral of |s tau(s)|^2 along the imaginary axis, by the classical table for 2nd and 3rd order."""
    step, q = D - F, B + (C if variant in THESIS[1:] else 0)
    if variant in ("3", "smooth"):  # s tau = A C^2 (s + k0) / ((s + B) (s + q)^2), 4.21, or its limit q = B
        exact = step**2 * B * q * (B * q**2 + k0**2 * (B + 2 * q)) / (4 * k0**2 * (B + q) ** 2)
    else:  # A C (s + k0) / ((s + B) (s + q)), 4.12; variant 1 is its limit q = B, 4.4
        exact = step**2 * B * q * (B * q + k0**2) / (2 * k0**2 * (B + q))
    if C >= 0.01 * B:
        assert Plain(variant, F, B, D, k0, C).command().energy()[0] == pytest.approx(exact, rel=1e-9, abs=0)


@pytest.mark.parametrize(("variant", "C"), CASES)
def test_pulses_start_at_nothing(variant: str, C: float) -> None:
    for F, D in ((-12.0, 9.5), (20.0, -23.0), (7.0, 7.0)):
        plain = Plain(variant, F, 20.0, D, 12.0, C)
        assert plain.command().position([0.0])[0, 0, 0] == F
        assert plain.command().pulse_at([0.0])[0, 0, 0] == pytest.approx(0, abs=1e-12 * abs(plain.A))


def test_the_smooth_pulse_is_the_limit_of_variant_3() -> None:
    """C -> 0, there by its definition: our sum of its terms loses digits with C / B."""
    at = np.linspace(0.005, 0.4, 80)
    smooth, near = single("smooth", -5.0, 35.0, 15.0, 17.5, 1.0), Plain("3", -5.0, 35.0, 15.0, 17.5, C=1e-4)
    for found, limit in (
        (smooth.pulse_at(at), near.pulse),
        (smooth.rate(at), near.rate),
        (smooth.position(at), near.tau),
    ):
        exact = [limit(float(t)) for t in at]
        np.testing.assert_allclose(found[0, :, 0], exact, rtol=0, atol=1e-5 * np.abs(found).max())
    assert smooth.energy()[0] == pytest.approx(near.energy(), rel=1e-5)


def test_the_smooth_pulse_is_gentle_to_the_motor() -> None:
    """From rest, and at 44 % of variant 1's largest speed where the eye settles as soon.

    At k0 = w0 the eye's way is that of the pulses' poles alone, a gamma distribution.
    """
    band, B = 0.01, 35.0
    longer = float(gammaincinv(3, 1 - band) / gammaincinv(2, 1 - band))
    one = Plain("1", 0.0, B, 20.33, 17.5)
    as_soon, alike = replace(one, variant="smooth", B=longer * B), replace(one, variant="smooth")
    settling = [PLANT.move(x.command()).measure(band).settling_time_s[0] for x in (one, as_soon, alike)]
    assert settling[1:] == pytest.approx([settling[0], longer * settling[0]], rel=1e-9)
    assert longer == pytest.approx(1.27, abs=0.005)
    speed = [top_speed(x) for x in (one, as_soon, alike)]
    assert [speed[1] / speed[0], speed[2] / speed[0]] == pytest.approx([0.44, 0.29], abs=0.005)
    assert as_soon.energy() / one.energy() == pytest.approx(0.60, abs=0.005)
    np.testing.assert_array_equal(as_soon.command().rate([0.0]), 0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pulse": "none"}, r"unknown pulse 'none'; choose one of 1, 2, 3"),
        ({"pulse": "2"}, r"pulse '2' needs C; the thesis uses 85"),
        ({"pulse": "3"}, r"pulse '3' needs C; the thesis uses 3\.6"),
        ({"B": [[35.0, 0.0]]}, "B must be positive, got 0"),
        ({"k0": [[-1.0, 17.5]]}, "k0 must be positive, got -1"),
        ({"pulse": "2", "C": -3.0}, "C must be positive, got -3"),
        ({"F": 0.0, "D": 20.0, "B": 35.0, "k0": 17.5}, r"\(saccades, motors\), got \(\)"),
        ({"D": [[1.0, 2.0, 3.0]]}, r"\(saccades, motors\), got \(1, 2\), \(1, 2\), \(1, 3\), \(1, 2\), \(\)"),
        ({"D": [["left", "right"]]}, "^D .*number"),
    ],
)
def test_bad_commands_are_refused(change: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {"F": [[0.0, 0.0]], "B": [[35.0, 35.0]], "D": [[20.0, -5.0]], "k0": [[17.5, 17.5]]}
    PulseStep(**good)
    with pytest.raises(InputError, match=message):
        PulseStep(**(good | change))


# --- varying C ------------------------------------------------------------------------------------

size = st.floats(0.02, 160)


def top_speed(plain: Plain) -> float:
    """Largest motor speed, by a dense scan and a local search."""
    t = np.concatenate([[0], np.geomspace(1e-7, 20 / plain.B, 3000)])
    speed = np.abs([plain.rate(float(s)) for s in t])
    k = int(speed.argmax())
    if k in (0, len(t) - 1):
        return float(speed[k])
    best = minimize_scalar(lambda s: -abs(plain.rate(s)), bounds=(t[k - 1], t[k + 1]), method="bounded")
    return float(max(speed[k], -best.fun))


def find_C(name: str, step: float, B: float, k0: float, V: float = SPEED_LIMIT) -> float:
    return float(varying_C(PULSES[name], np.array(step), np.array(B), np.array(k0), V))


def bound_of_variant3(C: float, step: float, B: float, k0: float) -> float:
    """A C / e + A k0 C^2 / (B + C)^2, thesis 4.31."""
    A = abs(step) * B * (B + C) ** 2 / (C**2 * k0)
    return A * C / np.e + A * k0 * C**2 / (B + C) ** 2


@properties
@given(step=size, B=st.floats(18, 80), k0=gain, V=st.sampled_from([720.0, 7200.0]))
@example(step=0.0234375, B=18.0, k0=6.0, V=7200.0)
def test_variant2_starts_at_the_limit(step: float, B: float, k0: float, V: float) -> None:
    """A C = V (thesis 4.18) where feasible; where not, the slowest onset comes nearest."""
    C = find_C("2", step, B, k0, V)
    initial = Plain("2", 0.0, B, step, k0, C).rate(0.0)
    lowest = step * B**2 / k0  # A C for C -> 0
    if C == 1e5:  # the largest: of a saccade so small that the limit asks for more
        assert 0 < abs(initial) < V
    elif lowest < V / 1.011:
        assert pytest.approx(V / C, rel=1e-9) == Plain("2", 0.0, B, step, k0, C).A
        assert initial == pytest.approx(V, rel=1e-9)
        if k0 < 2 * B + C:  # else the speed still rises at t = 0
            assert top_speed(Plain("2", 0.0, B, step, k0, C)) == pytest.approx(V, rel=1e-9)
    else:
        assert pytest.approx(0.01 * B, rel=1e-12) == C
        assert lowest < initial <= 1.0101 * max(lowest, V)


@properties
@given(step=size, B=st.floats(18, 80), k0=gain, V=st.sampled_from([720.0, 7200.0]))
def test_variant3_is_the_smaller_root_of_the_bound(step: float, B: float, k0: float, V: float) -> None:
    """Thesis 4.31 by bracketing: the bound falls with C up to C = B, so that the smaller root is below B."""
    C = find_C("3", step, B, k0, V)
    kept = keeps_speed_limit(PULSES["3"], np.array(step), np.array(B), np.array(k0), V)
    assert bool(kept) == (bound_of_variant3(B, step, B, k0) < V)
    if not kept:  # C = B has the least value
        assert pytest.approx(B, rel=1e-12) == C
        return
    root = brentq(lambda c: bound_of_variant3(c, step, B, k0) - V, 1e-9, B, xtol=1e-14, rtol=1e-14)
    if root > 0.011 * B:
        assert pytest.approx(root, rel=1e-9) == C
    assert root * (1 - 1e-9) <= C <= B
    assert bound_of_variant3(C, step, B, k0) <= V * (1 + 1e-9)
    assert top_speed(Plain("3", 0.0, B, step, k0, C)) <= V


def test_the_limit_of_the_thesis_gives_C_142_not_85() -> None:
    """4.18 with V = 7200 for the saccade of 4.4.5, B = 35, D - F = 20.33, k0 = 17.5."""
    assert find_C("2", 20.33, 35.0, 17.5) == pytest.approx(142.07, abs=0.01)


@pytest.mark.parametrize("variant", THESIS[1:])
def test_infeasible_commands_get_the_nearest_C(variant: str) -> None:
    """B = 80, k0 = 5, 160 deg: no C keeps 7200 deg/s."""
    step, B, k0 = 160.0, 80.0, 5.0
    C = find_C(variant, step, B, k0)
    assert pytest.approx({"2": 0.01 * B, "3": B}[variant], rel=1e-12) == C
    found = bound_of_variant3(C, step, B, k0) if variant == "3" else Plain("2", 0, B, step, k0, C).A * C
    others = np.geomspace(0.01 * B, 100 * B, 500)
    bounds = [
        bound_of_variant3(c, step, B, k0) if variant == "3" else Plain("2", 0, B, step, k0, c).A * c for c in others
    ]
    assert found > SPEED_LIMIT
    assert found <= min(bounds) * (1 + 1e-12)
    assert keeps_speed_limit(PULSES[variant], *np.array([[160.0], [80.0], [5.0]])).tolist() == [False]
    assert keeps_speed_limit(PULSES[variant], *np.array([[20.0], [35.0], [17.5]])).tolist() == [True]


@pytest.mark.parametrize("name", VARYING)
def test_outcome_tells_commands_that_no_C_holds_to_the_limit(name: str) -> None:
    """B = 80, k0 = 5, 80 deg: whatever the pulse keeps of that."""
    plant, step, B, k0 = make_plant("lpf"), np.array([20.33, 80.0]), np.array([35.0, 80.0]), np.array([17.5, 5.0])
    kept = keeps_speed_limit(PULSES[name], step, B, k0)
    for C, expected in (("varying", (~kept).tolist()), (None, [False, False])):
        task = SaccadeTask.of_case(plant, Case(name, C), weights=[1.0] * 4)
        start, target = saccades(task.targets, [[0.0], [0.0]], [[30.0], [30.0]])
        outcome = task.perform(start, np.stack([B, step, k0], axis=1), target)
        assert outcome.too_fast.tolist() == expected
    if name in THESIS:
        assert kept.tolist() == [True, False]


@pytest.mark.parametrize("name", VARYING)
def test_varying_C_is_continuous(name: str) -> None:
    """In the step, through zero, both limits and the edge of what is feasible, and in B and k0."""
    for B, k0 in ((80.0, 5.0), (35.0, 17.5), (18.0, 40.0)):
        up = np.geomspace(1e-3, 400, 200_000)
        step = np.concatenate([-up[::-1], up])
        C = varying_C(PULSES[name], step, np.full_like(step, B), np.full_like(step, k0))
        assert (C > 0).all()
        np.testing.assert_array_equal(C, C[::-1])  # the direction does not matter
        # The square root of variant 3 is steep at its edge: halving the steps must shrink the largest change.
        coarse, fine = (np.abs(np.diff(np.log(C[:200_000][::n]))).max() for n in (64, 1))
        assert fine < 0.2 * coarse
        for symbol in ("B", "k0"):
            near = {"B": B, "k0": k0}
            near[symbol] *= 1 + 1e-10
            moved = varying_C(PULSES[name], step, np.full_like(step, near["B"]), np.full_like(step, near["k0"]))
            np.testing.assert_allclose(moved, C, rtol=1e-3)


@pytest.mark.parametrize("variant", THESIS[1:])
def test_varying_C_without_a_step(variant: str) -> None:
    """D = F: C at its bound, and a motor that does not move."""
    C = find_C(variant, 0.0, 35.0, 17.5)
    assert pytest.approx({"2": 1e5, "3": 0.35}[variant]) == C
    command = Plain(variant, 7.0, 35.0, 7.0, 17.5, C).command()
    np.testing.assert_array_equal(command.position(np.linspace(0, 1, 20)), 7.0)
    np.testing.assert_array_equal(command.rate(np.linspace(0, 1, 20)), 0.0)
    assert command.energy()[0] == 0.0


# --- the thesis' printed formulas -----------------------------------------------------------------

SACCADES = [(0.0, 35.0, 20.33, 17.0), (-8.0, 60.0, 11.0, 9.0), (15.0, 22.0, -20.0, 31.0)]  # F, B, D, k0
T = np.linspace(0, 0.4, 41)


def agree(found: Array, formula: Array) -> bool:
    """To 1e-9 of the formula's largest value; a misprint is off by far more."""
    return bool(np.abs(found - formula).max() <= 1e-9 * np.abs(formula).max())


def named(variant: str, saccade: tuple[float, float, float, float], C: float) -> tuple[Plain, Array, Array]:
    """The plain form; our tau - F and theta - theta0 over T."""
    plain = Plain(variant, *saccade, C)
    command = plain.command()
    theta = yaw_of(command, T)
    return plain, command.position(T)[0, :, 0] - plain.F, theta - K * plain.F


@pytest.mark.parametrize("saccade", SACCADES)
def test_formulas_of_variant_1(saccade: tuple[float, float, float, float]) -> None:
    plain, tau, theta = named("1", saccade, 1.0)
    A, B, k0, w0, t = plain.A, plain.B, plain.k0, W0, T
    assert agree(  # 4.6
        theta,
        A * K * w0 * (
            k0 / (B**2 * w0)
            + (2 * B * k0 - B**2 - k0 * w0) / (B**2 * (B - w0) ** 2) * np.exp(-B * t)
            + (k0 - B) / (-B * (w0 - B)) * t * np.exp(-B * t)
            + (k0 - w0) / (-w0 * (B - w0) ** 2) * np.exp(-w0 * t)
        ),
    )  # fmt: skip
    assert agree(  # 4.7, without its F
        tau, A * (k0 / B**2 - k0 / B**2 * np.exp(-B * t) + (B - k0) / B * t * np.exp(-B * t))
    )
    # 4.36 at its lower limit; at infinity it vanishes.
    at_0 = 1 / (-2 * B) + -2 * (B - k0) / (-4 * B**2) + 2 * (B - k0) ** 2 / (-8 * B**3)
    assert plain.command().energy()[0] == pytest.approx(-(A**2) * at_0, rel=1e-12)


@pytest.mark.parametrize("saccade", SACCADES)
@pytest.mark.parametrize("C", [3.6, 85.0])
def test_formulas_of_variant_2(saccade: tuple[float, float, float, float], C: float) -> None:
    plain, tau, theta = named("2", saccade, C)
    A, B, k0, w0, t = plain.A, plain.B, plain.k0, W0, T
    assert agree(  # 4.14
        theta,
        A * C * K * w0 * (
            k0 / (B * (B + C) * w0)
            + (k0 - B) / (B * C * (B - w0)) * np.exp(-B * t)
            + (k0 - (B + C)) / ((B + C) * C * (w0 - (B + C))) * np.exp(-(B + C) * t)
            + (w0 - k0) / (w0 * (B - w0) * (B + C - w0)) * np.exp(-w0 * t)
        ),
    )  # fmt: skip
    assert agree(  # 4.16
        tau,
        A * C * (
            k0 / (B * (B + C))
            + (B - k0) / (B * C) * np.exp(-B * t)
            + (k0 - (B + C)) / ((B + C) * C) * np.exp(-(B + C) * t)
        ),
    )  # fmt: skip
    assert agree(  # 4.17
        plain.command().rate(T)[0, :, 0],
        A * C * (-(B - k0) / C * np.exp(-B * t) - (k0 - (B + C)) / C * np.exp(-(B + C) * t)),
    )
    at_0 = (  # 4.37
        (k0 - B) ** 2 / (-2 * B) + 2 * (k0 - B) * (B + C - k0) / -(2 * B + C) + (B + C - k0) ** 2 / (-2 * (B + C))
    )
    assert plain.command().energy()[0] == pytest.approx(A**2 * -at_0, rel=1e-9)


@pytest.mark.parametrize("saccade", SACCADES)
@pytest.mark.parametrize("C", [3.6, 85.0])
def test_misprints_of_variant_3(saccade: tuple[float, float, float, float], C: float) -> None:
    """4.23, 4.24, 4.27 and 4.38: as printed they do not agree, corrected they do."""
    plain, tau, theta = named("3", saccade, C)
    A, B, k0, w0, t = plain.A, plain.B, plain.k0, W0, T
    q = B + C

    # 4.23. The coefficient of the double pole's e^(-qt) is the derivative of the rest of theta(s) at -q.
    at_q = (k0 - q) / (q * C * (w0 - q))
    coefficient = at_q * (1 / (k0 - q) + 1 / q + 1 / C - 1 / (w0 - q))
    printed = (-(q**2) + k0 * (B + 2 * C)) / (C**2 * q**2)

    def theta_with(of_double_pole: float) -> Array:
        return A * C**2 * K * w0 * (
            k0 / (B * q**2 * w0)
            + (k0 - B) / (-B * C**2 * (w0 - B)) * np.exp(-B * t)
            + of_double_pole * np.exp(-q * t)
            + at_q * t * np.exp(-q * t)
            + (k0 - w0) / (-w0 * (B - w0) * (q - w0) ** 2) * np.exp(-w0 * t)
        )  # fmt: skip

    assert agree(theta, theta_with(coefficient))
    assert not agree(theta, theta_with(printed))

    # 4.24
    step = plain.D - plain.F
    reached = plain.command().position([50.0])[0, 0, 0] - plain.F
    assert reached == pytest.approx(A * C**2 * k0 / (B * (B + C) ** 2), rel=1e-9)
    assert reached == pytest.approx(step, rel=1e-9)
    assert A * C**2 * k0 / (B * (B + C**2)) != pytest.approx(step, rel=0.01)

    # 4.27: the step part of tau
    stepped = tau - plain.command().pulse_at(T)[0, :, 0]

    def step_with(onset: Array) -> Array:
        return A * k0 * (C**2 / (B * q**2) - np.exp(-B * t) / B + onset * np.exp(-q * t))

    assert agree(stepped, step_with((1 + C * t + C / q) / q))
    assert not agree(stepped, step_with((1 + C * t + C * q) / q**2))

    # 4.38 at its lower limit
    a0, a1, a2 = (k0 - B) / C**2, (B - k0) / C**2, (B + C - k0) / C

    def energy_with(sign: int) -> float:
        crossed = 2 * a0 * a1 / -(2 * B + C) - 2 * a0 * a2 / (2 * B + C) ** 2
        double = a1**2 / (-2 * q) - 2 * a2 * a1 / (4 * q**2) - 2 * a2**2 / (8 * q**3)
        return -(A**2) * C**4 * (a0**2 / (-2 * B) + sign * crossed + double)

    found = plain.command().energy()[0]
    assert found == pytest.approx(energy_with(+1), rel=1e-8)  # the formula itself loses digits at C = 3.6
    assert found != pytest.approx(energy_with(-1), rel=0.01)
