"""Linear eyes of first and second order with dead time: closed form, measures and sampled motors.

The witnesses are written from the definitions: quadrature of the convolution, integration of the
differential equation, partial fractions in a hundred digits, and plain fine sampling.
"""

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp
from scipy.optimize import OptimizeResult as OdeResult
from scipy.signal import lsim
from scipy.special import hyp1f1

from orient_eye.commands.exponentials import ExponentialSum, Term, impulse_response
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.errors import InputError
from orient_eye.movement.measures import Measures
from orient_eye.plants.linear import LinearPlant
from orient_eye.plants.linear_response import (
    LinearResponse,
    measure_closed_form,
    sampled_response,
    second_order_poles,
)
from orient_eye.rotations import about, to_euler
from orient_eye.state import State
from orient_eye.surrogate import Surrogate
from orient_eye.sysid import identify_plant

Array = NDArray[np.float64]
Poles = tuple[Any, ...]
K = -1.4758  # a gain may be negative

properties = settings(deadline=None, max_examples=60, derandomize=True)
variant = st.sampled_from(["1", "2", "3", "smooth"])


def log_floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(np.log(low), np.log(high)).map(lambda x: float(np.exp(x)))


decay, gain, onset = log_floats(5, 300), log_floats(0.3, 60), log_floats(0.05, 3000)
damping = st.one_of(st.floats(0.05, 3), st.sampled_from([1.0, 1 - 1e-12, 1 + 1e-12, 1 - 1e-6, 1 + 1e-6, 0.999, 1.001]))
plant = st.one_of(
    log_floats(2, 80).map(lambda w: (w,)), st.tuples(log_floats(2, 80), damping).map(lambda x: second_order_poles(*x))
)
# Relative distances of poles: none, within rounding, and to both sides of where series and fractions change over.
gap = st.sampled_from([0.0, 1e-14, -1e-9, 1e-5, -1e-3, 0.01, -0.04, 0.0499, 0.0501, -0.06, 0.09, 0.11, 0.16])


def command(B: Any, k0: Any, C: Any = 1.0, pulse: str = "1", F: Any = 0.0, D: Any = 1.0) -> PulseStep:
    F, B, D, k0, C = np.broadcast_arrays(*(np.reshape(np.asarray(x, float), (-1, 1)) for x in (F, B, D, k0, C)))
    return PulseStep(F, B, D, k0, pulse, C if pulse in ("2", "3") else None)


def of_poles(pulse: str, B: float, C: float) -> list[float]:
    return {"1": [B, B], "2": [B, B + C], "3": [B, B + C, B + C], "smooth": [B, B, B]}[pulse]


def real(poles: Poles) -> tuple[float, float]:
    """2 zeta wn and wn^2."""
    first, second = (complex(w) for w in poles)
    return (first + second).real, (first * second).real


def partial_fractions(poles: list[Any], k0: float, t: Array) -> Array:
    """x and its three derivatives, (4, time), of the product of p / (s + p) times (1 + s / k0) / s, in 100 digits.

    Poles that are the same are set 1e-18 apart, which moves the answer by as much.
    """
    with mpmath.workdps(110):
        exact = [mpmath.mpmathify(p) * (1 + i * mpmath.mpf(10) ** -18) for i, p in enumerate(poles)]
        height = mpmath.fprod(exact)
        rate = [
            height * (1 - p / mpmath.mpf(k0)) / mpmath.fprod(q - p for j, q in enumerate(exact) if j != i)
            for i, p in enumerate(exact)
        ]
        answer = []
        for time in t:
            parts = [c * mpmath.exp(-p * mpmath.mpf(float(time))) for p, c in zip(exact, rate, strict=True)]
            left = mpmath.fsum(x / p for x, p in zip(parts, exact, strict=True))
            slopes = [mpmath.fsum(x * (-p) ** n for x, p in zip(parts, exact, strict=True)) for n in range(3)]
            answer.append([float(mpmath.re(v)) for v in (1 - left, *slopes)])
    return np.array(answer).T


def times(poles: list[Any]) -> Array:
    rates = np.real(poles)
    return np.concatenate([[1e-6], np.geomspace(0.01 / max(rates), 20 / min(rates), 24)])


def hold(pulse: str, B: float, k0: float, C: float, poles: Poles) -> None:
    every = [*of_poles(pulse, B, C), *poles]
    t = times(every)
    exact = partial_fractions(every, k0, t)
    found = LinearResponse(1.0, poles, 0.0, command(B, k0, C, pulse)).motion(t[None])
    for got, right in zip(found, exact, strict=True):
        np.testing.assert_allclose(got[0], right, rtol=0, atol=1e-9 * np.abs(right).max())


# --- exponentials through linear systems ----------------------------------------------------------


def impulse(poles: Poles, u: float) -> float:
    """Of the plant, by its definition."""
    if len(poles) == 1:
        return float(poles[0] * np.exp(-poles[0] * u))
    damp, square = real(poles)
    s = np.sqrt(complex(damp**2 / 4 - square)) * u
    return float((square * u * np.exp(-damp / 2 * u) * (np.sinh(s) / s if s else 1)).real)


@properties
@given(
    n=st.integers(0, 3), p=log_floats(0.5, 200), poles=plant, close=st.none() | gap, when=log_floats(0.01, 6), c=gain
)
def test_one_term_through_a_plant_is_the_convolution(
    n: int, p: float, poles: Poles, close: float | None, when: float, c: float
) -> None:
    p = p if close is None else abs(poles[0]) * (1 + close)
    t = when / min(p, np.real(poles[0]))
    total = ExponentialSum((Term(np.array([c]), n, np.array([p])), Term(np.array([-c]), 0, np.array([2 * p]))))
    knots = sorted({t * x for x in (0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)} | {min(x / p, 0.999 * t) for x in (1, 4)})

    def integrand(s: float) -> float:
        return float(c * (s**n * np.exp(-p * s) - np.exp(-2 * p * s)) * impulse(poles, t - s))

    right = quad(integrand, 0, t, points=knots, epsabs=0, epsrel=1e-12, limit=400)[0]
    size = c * (1 + (n / (np.e * p)) ** n)
    assert total.through(poles).jet(np.array([[t]]), 0)[0][0, 0] == pytest.approx(right, rel=0, abs=1e-11 * size)


@pytest.mark.parametrize("close", [0.0, 1e-9, 1e-3, 0.04, 0.06])
def test_a_pulse_of_three_equal_poles_and_a_plant_of_two(close: float) -> None:
    """t^2 exp(-B t) where B meets both poles of the plant."""
    B, poles = 20.0, [20.0 * (1 + close), 20.0 * (1 - close)]
    t = times([B])
    found = impulse_response([np.array([x]) for x in (B, B, B, *poles)]).jet(t[None], 2)
    exact = partial_fractions([B, B, B, *poles], 1e30, t)[1:]
    for got, right in zip(found, exact, strict=True):
        np.testing.assert_allclose(got[0], right, rtol=0, atol=1e-9 * np.abs(right).max())


def test_jet_is_value_and_derivatives_and_tail_the_area_to_come() -> None:
    modes = ExponentialSum((Term(np.array([2.0]), 2, np.array([9.0])),)).through(second_order_poles(14.0, 0.4))
    h, t = 1e-5, np.linspace(0.01, 0.8, 30)
    value, slope, bend = (v[0] for v in modes.jet(t[None], 2))
    before, after = (modes.jet(t[None] + d, 1) for d in (-h, h))
    np.testing.assert_allclose((after[0] - before[0])[0] / (2 * h), slope, atol=1e-6 * np.abs(slope).max())
    np.testing.assert_allclose((after[1] - before[1])[0] / (2 * h), bend, atol=1e-6 * np.abs(bend).max())
    area = [quad(lambda s: modes.jet(np.array([[s]]), 0)[0][0, 0], x, 6, limit=200)[0] for x in t]
    np.testing.assert_allclose(modes.tail().jet(t[None], 0)[0][0], area, atol=1e-10)
    assert np.abs(value).max() > 1e-3


# --- closed form ----------------------------------------------------------------------------------


@properties
@given(pulse=variant, B=decay, k0=gain, C=onset, poles=plant)
def test_against_partial_fractions_anywhere(pulse: str, B: float, k0: float, C: float, poles: Poles) -> None:
    hold(pulse, B, k0, max(C, 0.01 * B), poles)


@settings(properties, max_examples=150)
@given(
    pulse=variant,
    w=log_floats(2, 80),
    gaps=st.tuples(gap, gap, gap),
    order=st.sampled_from([1, 2]),
    at_k0=st.booleans(),
)
def test_against_partial_fractions_where_poles_meet(
    pulse: str, w: float, gaps: tuple[float, float, float], order: int, at_k0: bool
) -> None:
    """Any of B, B + C, the plant's two poles and k0 together or nearly so."""
    B, poles = w * (1 + gaps[0]), (w, w * (1 + gaps[1]))[:order]
    hold(pulse, B, w if at_k0 else 0.3 * w, B * max(0.01, abs(gaps[2])), poles)


@settings(properties, max_examples=60)
@given(pulse=variant, w=log_floats(2, 80), tilt=st.floats(1e-6, 0.4), gaps=st.tuples(gap, gap))
def test_against_partial_fractions_where_a_pulse_meets_a_conjugate_pair(
    pulse: str, w: float, tilt: float, gaps: tuple[float, float]
) -> None:
    B = w * (1 + gaps[0])
    hold(pulse, B, 0.5 * w, B * max(0.01, abs(gaps[1])), second_order_poles(w, np.cos(tilt)))


@pytest.mark.parametrize(
    "poles", [(17.5,), second_order_poles(25.0, 0.5), second_order_poles(12.0, 1.0), (17.5, 2300.0)]
)
@pytest.mark.parametrize("pulse", ["1", "2", "3"])
def test_against_the_differential_equation(pulse: str, poles: Poles) -> None:
    """theta'' = K wn^2 tau - 2 zeta wn theta' - wn^2 theta, or theta' = w (K tau - theta); tau of the command."""
    motor, L = command(40.0, 12.0, 60.0, pulse, F=-5.0, D=15.0), 0.0083
    response = LinearResponse(K, poles, L, motor)
    t = np.linspace(0, 0.6, 40)

    def slope(time: float, y: Array) -> list[float]:
        tau = motor.position(np.array([time]))[0, 0, 0]
        if len(poles) == 1:
            return [poles[0] * (K * tau - y[0])]
        damp, square = real(poles)
        return [y[1], square * (K * tau - y[0]) - damp * y[1]]

    start = [K * -5.0, 0.0][: len(poles)]
    solved = solve_ivp(slope, (0, 0.6), start, method="Radau", rtol=1e-10, atol=1e-10, t_eval=t)
    np.testing.assert_allclose(response.angle(t[None] + L)[0], solved.y[0], atol=1e-7)
    rate = solved.y[1] if len(poles) == 2 else [slope(x, y)[0] for x, y in zip(t, solved.y.T, strict=True)]
    np.testing.assert_allclose(response.rate(t[None] + L)[0], rate, atol=1e-5)


def test_against_lsim() -> None:
    motor, poles = command(40.0, 12.0, F=-5.0, D=15.0), second_order_poles(25.0, 0.3)
    damp, square = real(poles)
    t = np.arange(0, 1, 1e-4)
    way = motor.position(t)[0, :, 0] + 5.0
    _, found, _ = lsim(([K * square], [1, damp, square]), way, t)
    np.testing.assert_allclose(LinearResponse(K, poles, 0.0, motor).angle(t[None])[0], K * -5.0 + found, atol=1e-4)


@properties
@given(pulse=variant, B=log_floats(18, 80), k0=log_floats(5, 40), C=onset, w=log_floats(5, 60), close=st.none() | gap)
def test_first_order_is_the_low_pass(pulse: str, B: float, k0: float, C: float, w: float, close: float | None) -> None:
    """x = k0 P + (1 - k0/w) y, with P the pulse's integral and y its low-pass response.

    Both ways lose digits where poles are a tenth apart: to 1e-12 elsewhere.
    """
    w = w if close is None else B * (1 + close)
    motor = command(B, k0, max(C, 0.1 * B), pulse)
    t = times([B, w])[None]
    shape = motor.shape
    p, P = (values[0, 0] for values in shape.with_integral(t))
    y = np.zeros_like(P)
    for x in shape.terms:  # w / (s + w) to c t^n exp(-b t), by Kummer's function
        kummer = hyp1f1(x.n + 1, x.n + 2, (w - x.p[0, 0]) * t[0])
        y += x.c[0, 0] * w * t[0] ** (x.n + 1) * np.exp(-w * t[0]) * kummer / (x.n + 1)
    x, x1 = (values[0] for values in LinearResponse(1.0, (w,), 0.0, motor).motion(t, 1))
    np.testing.assert_allclose(x, k0 * P + (1 - k0 / w) * y, rtol=0, atol=1e-11 * max(1, np.abs(x).max()))
    np.testing.assert_allclose(x1, w * p - (w - k0) * y, rtol=0, atol=1e-11 * np.abs(x1).max())


def test_nothing_moves_before_the_dead_time_and_then_it_is_the_same() -> None:
    motor = command([30.0, 60.0], 10.0, F=[3.0, -2.0], D=[20.0, -9.0])
    poles, L = second_order_poles(20.0, 0.6), np.array([0.012, 0.031])
    late, prompt = LinearResponse(K, poles, L, motor), LinearResponse(K, poles, 0.0, motor)
    t = np.linspace(0, 1, 333)[None]
    still = t <= L[:, None]
    for got in late.motion(t):
        assert (got[still] == 0).all()
    assert (late.angle(t)[still] == np.repeat(late.start[:, None], 333, 1)[still]).all()
    for got, right in zip(late.motion(t + L[:, None]), prompt.motion(t), strict=True):
        np.testing.assert_allclose(got, right, atol=1e-9 * np.abs(right).max())
    np.testing.assert_array_equal(late.final, K * np.array([20.0, -9.0]))


def test_a_batch_is_its_rows() -> None:
    """Plants of every kind side by side, also real and complex poles."""
    zeta = np.array([0.1, 0.7, 1.0, 1.3, 3.0, 0.9999])
    poles = second_order_poles(np.array([8.0, 12.0, 20.0, 30.0, 15.0, 25.0]), zeta)
    B, k0, gain_, L = (np.linspace(low, high, 6) for low, high in ((20.0, 25.0), (2.0, 30.0), (1.0, 2.0), (0.0, 0.02)))
    batch = LinearResponse(gain_, poles, L, command(B, k0, 0.02 * B, "3", D=np.arange(6)))
    together, t = measure_closed_form(batch), np.linspace(0, 2, 50)[None]
    motion = batch.motion(t)
    for i in range(6):
        pair = second_order_poles(float(np.abs(poles[0][i] * poles[1][i]) ** 0.5), zeta[i])
        one = LinearResponse(gain_[i], pair, L[i], command(B[i], k0[i], 0.02 * B[i], "3", D=i))
        for got, right in zip(motion, one.motion(t), strict=True):
            np.testing.assert_allclose(got[i], right[0], atol=1e-10 * np.abs(right).max())
        assert_same(measure_closed_form(one), together, i)


def assert_same(one: Measures, batch: Measures, row: int) -> None:
    for name in ("settling_time_s", "peak_velocity_deg_s", "overshoot", "skewness"):
        np.testing.assert_allclose(getattr(batch, name)[row], getattr(one, name)[0], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("poles", "L", "message"),
    [
        ((), 0.0, "one pole or two"),
        ((1.0, 2.0, 3.0), 0.0, "one pole or two"),
        ((-3.0,), 0.0, "positive"),
        ((np.nan, 1.0), 0.0, "finite"),
        ((3 + 1j,), 0.0, "conjugate"),
        ((3 + 1j, 3 + 1j), 0.0, "conjugate"),
        ((3 + 1j, 3.0), 0.0, "conjugate"),
        ((3.0, 5.0), -0.01, "dead time"),
    ],
)
def test_refuses(poles: Poles, L: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        LinearResponse(1.0, poles, L, command(30.0, 10.0))
    with pytest.raises(InputError, match=message):
        sampled_response(1.0, poles, L, np.zeros((1, 3)), 0.001)


def test_refuses_several_motors_and_other_shapes() -> None:
    two = np.ones((1, 2))
    with pytest.raises(InputError, match="one motor"):
        LinearResponse(1.0, (3.0,), 0.0, PulseStep(two, two, two, two))
    with pytest.raises(InputError, match="saccades, samples"):
        sampled_response(1.0, (3.0,), 0.0, np.zeros(3), 0.001)


# --- measures -------------------------------------------------------------------------------------


def hold_against_sampling(response: LinearResponse, band: float, slowest: float) -> None:
    """Against a hundred thousand points; crests to their square, exits to a point's distance."""
    found = measure_closed_form(response, band)
    L = float(np.asarray(response.dead_time))
    size = abs(float(response.final[0] - response.start[0]))
    t = L + np.concatenate([np.linspace(0, 1, 100_000) * 25 / slowest, np.geomspace(1e-6, 1, 2000) / slowest])
    t = np.sort(t)
    x, rate = (v[0] for v in response.motion(t[None], 1))
    last = np.flatnonzero(np.abs(x - 1) > band)[-1]
    assert t[last] - 1e-12 <= found.settling_time_s[0] <= t[last + 1] + 1e-12
    assert found.overshoot[0] == pytest.approx(max(x.max() - 1, 0), rel=1e-5, abs=1e-9)
    assert found.peak_velocity_deg_s[0] == pytest.approx(size * np.abs(rate).max(), rel=1e-5)
    yaw = np.deg2rad(to_euler(found.at_settling)[0][0] - response.angle(found.settling_time_s[:, None])[0, 0])
    assert np.sin(yaw) == pytest.approx(0, abs=1e-9)  # past 180 deg the same orientation has another yaw
    assert found.settled.all()
    assert not found.failed.any()
    peak_time = found.settling_time_s[0] * (1 - found.skewness[0])
    if found.skewness[0] > 0:
        assert abs(response.motion(np.array([[peak_time]]), 1)[1][0, 0]) == pytest.approx(np.abs(rate).max(), rel=1e-5)


@settings(properties, max_examples=80)
@given(
    pulse=variant,
    B=decay,
    k0=gain,
    C=onset,
    poles=plant,
    band=st.sampled_from([0.01, 0.02, 0.001]),
    L=st.sampled_from([0.0, 0.008]),
)
def test_measures_against_fine_sampling(
    pulse: str, B: float, k0: float, C: float, poles: Poles, band: float, L: float
) -> None:
    C = max(C, 0.01 * B)
    response = LinearResponse(1.5, poles, L, command(B, k0, C, pulse, F=-4.0, D=9.0))
    hold_against_sampling(response, band, min(B, np.real(poles[0])))


@pytest.mark.parametrize("zeta", [0.05, 0.1, 0.3, 0.6, 0.83, 0.9])
@pytest.mark.parametrize("ratio", [(0.7, 0.8), (1.5, 0.5), (5.0, 0.1), (3.0, 1.0)])
def test_measures_of_oscillations(zeta: float, ratio: tuple[float, float]) -> None:
    """The last exit is any of many, on either side: bands are swept through the crests."""
    wn = 14.0
    motor = command(ratio[0] * wn, ratio[1] * wn, F=2.0, D=12.0)
    for band in np.geomspace(0.002, 0.3, 10):
        hold_against_sampling(LinearResponse(1.5, second_order_poles(wn, zeta), 0.01, motor), float(band), zeta * wn)


def test_settling_jumps_at_a_crest() -> None:
    """A band just below and just above a crest settles a crest apart; between them no band is missed."""
    wn, zeta = 14.0, 0.3
    response = LinearResponse(1.0, second_order_poles(wn, zeta), 0.0, command(60.0, 14.0))
    t = np.linspace(0, 3, 300_001)
    left = np.abs(response.motion(t[None], 0)[0][0] - 1)
    crests = left[1:-1][(left[1:-1] > left[:-2]) & (left[1:-1] > left[2:])]
    assert len(crests) > 5
    half = np.pi / (wn * np.sqrt(1 - zeta**2))
    for crest in crests[1:6]:
        inside, outside = (
            measure_closed_form(response, crest * (1 + side * 1e-6)).settling_time_s[0] for side in (1, -1)
        )
        assert 0.4 * half < outside - inside < 1.1 * half


def test_peak_velocity_of_two_crests_that_compete() -> None:
    """There and back nearly as fast, over a sweep of k0 through the tie: the faster crest counts, not sample."""
    k0 = np.linspace(4.0, 7.0, 201)
    response = LinearResponse(1.0, second_order_poles(14.0, 0.05), 0.0, command(40.0, k0))
    rate = response.motion(np.linspace(0, 1, 20_001)[None], 1)[1]
    there, back = rate.max(axis=1), -rate.min(axis=1)
    assert (there > back).any()
    assert (there < back).any()
    assert (np.abs(there / back - 1) < 0.03).sum() > 20
    found = measure_closed_form(response).peak_velocity_deg_s
    np.testing.assert_allclose(found, np.maximum(there, back), rtol=1e-5)


def test_a_step_of_second_order_has_its_textbook_overshoot() -> None:
    """A pulse far faster than the plant, with k0 as fast as the pulse, is a step."""
    for zeta in (0.1, 0.5, 0.8):
        motor = command(3e4, 3e4, F=0.0, D=10.0)
        found = measure_closed_form(LinearResponse(1.0, second_order_poles(10.0, zeta), 0.0, motor))
        assert found.overshoot[0] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=2e-3)


def test_no_movement_and_no_number() -> None:
    motor = command(30.0, 10.0, F=[4.0, 0.0, 1.0], D=[4.0, np.inf, 5.0])
    found = measure_closed_form(LinearResponse(1.0, second_order_poles(20.0, 0.5), 0.01, motor))
    np.testing.assert_array_equal(found.failed, [False, True, False])
    assert found.settling_time_s[0] == found.peak_velocity_deg_s[0] == found.overshoot[0] == found.amplitude_deg[0] == 0
    assert np.isnan(found.settling_time_s[1])
    alone = measure_closed_form(
        LinearResponse(1.0, second_order_poles(20.0, 0.5), 0.01, command(30.0, 10.0, F=1.0, D=5.0))
    )
    assert_same(alone, found, 2)


# --- sampled motors -------------------------------------------------------------------------------


@settings(properties, max_examples=25)
@given(
    poles=st.one_of(plant, st.just((17.5, 2300.0))),
    L=st.sampled_from([0.0, 0.003, 0.0047, 0.01, 0.0123, 0.5]),
    seed=st.integers(0, 99),
)
def test_sampled_against_the_differential_equation(poles: Poles, L: float, seed: int) -> None:
    """Line by line, each solved by the matrix exponential of plant and line together, in 40 digits."""
    step, samples = 0.01, 9
    motor = np.random.default_rng(seed).normal(0, 10, (2, samples))
    angle, rate = sampled_response(K, poles, L, motor, step)
    for row in range(2):
        for k in range(samples):
            right = K * by_lines(poles, motor[row], step, k * step - L)
            assert angle[row, k] == pytest.approx(right[0], rel=0, abs=1e-11 * 30)
            assert rate[row, k] == pytest.approx(right[1], rel=0, abs=1e-11 * 30 / step)


def by_lines(poles: Poles, u: Array, step: float, until: float) -> Array:
    """Angle and rate for K = 1 at a time, from the states (theta, theta', tau, tau')."""
    with mpmath.workdps(40):
        if len(poles) == 1:
            w = mpmath.mpf(float(poles[0]))
            A = mpmath.matrix([[-w, 0, w, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
        else:
            damp, square = (mpmath.mpf(x) for x in real(poles))
            A = mpmath.matrix([[0, 1, 0, 0], [-square, -damp, square, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
        state = mpmath.matrix([u[0], 0, u[0], 0])
        time = 0.0
        for k in range(len(u)):
            span = min(step, until - k * step)
            if span <= 0:
                break
            state[2], state[3] = u[k], (u[k + 1] - u[k]) / mpmath.mpf(step) if k + 1 < len(u) else 0
            state = mpmath.expm(A * mpmath.mpf(span)) * state
            time += span
        rate = state[1] if len(poles) == 2 else poles[0] * (state[2] - state[0])
        return np.array([float(state[0]), float(rate)])


@pytest.mark.parametrize("zeta", [0.05, 0.5, 1.0, 2.0])
def test_sampled_against_lsim(zeta: float) -> None:
    poles, step, rng = second_order_poles(9.0, zeta), 0.001, np.random.default_rng(2)
    motor = np.cumsum(np.cumsum(rng.normal(0, 0.01, (3, 1500)), axis=1), axis=1)
    angle, rate = sampled_response(K, poles, 0.02, motor, step)
    damp, square = real(poles)
    for row in range(3):
        _, found, state = lsim(
            ([[0, 1], [-square, -damp]], [[0], [square]], [[1, 0]], [[0]]),
            motor[row] - motor[row, 0],
            step * np.arange(1500),
        )
        scale = np.abs(K * motor).max()
        np.testing.assert_allclose(angle[row, 20:] - K * motor[row, 0], K * found[:-20], atol=1e-10 * scale)
        np.testing.assert_allclose(rate[row, 20:], K * state[:-20, 1], atol=1e-9 * scale)
        np.testing.assert_array_equal(rate[row, :20], 0)


@pytest.mark.parametrize("poles", [(17.5,), second_order_poles(25.0, 0.4), second_order_poles(12.0, 1.0), (9.0, 40.0)])
def test_sampled_goes_to_the_closed_form(poles: Poles) -> None:
    """A tenth of the step is a hundredth of the difference."""
    motor, L = command([30.0, 50.0], 8.0, F=[3.0, -2.0], D=[20.0, -9.0]), 0.01234
    response = LinearResponse(K, poles, L, motor)
    off = []
    for step in (1e-3, 1e-4):
        t: Array = np.float64(step) * np.arange(round(0.5 / step))
        angle, rate = sampled_response(K, poles, L, motor.position(t)[..., 0], step)
        off.append([np.abs(angle - response.angle(t[None])).max(), np.abs(rate - response.rate(t[None])).max()])
    assert off[0][0] < 0.05
    assert (np.array(off[1]) < 0.03 * np.array(off[0])).all()


def test_sampled_rows_have_their_own_plants_and_rest_stays() -> None:
    poles = second_order_poles(np.array([10.0, 20.0, 30.0]), np.array([0.3, 1.0, 2.0]))
    L, gain_ = np.array([0.0, 0.0031, 0.01]), np.array([1.0, -2.0, 1.5])
    motor = np.random.default_rng(1).normal(size=(3, 40))
    angle, rate = sampled_response(gain_, poles, L, motor, 0.002)
    for i in range(3):
        one = sampled_response(gain_[i], tuple(w[i] for w in poles), L[i], motor[i : i + 1], 0.002)
        np.testing.assert_allclose([angle[i], rate[i]], [one[0][0], one[1][0]], rtol=0, atol=1e-9)
    still, speed = sampled_response(K, poles, L, np.full((3, 300), 13.7), 0.002)
    np.testing.assert_array_equal(still, K * 13.7)
    np.testing.assert_array_equal(speed, 0)


# --- motors that jump at time 0 -------------------------------------------------------------------


def delayed(poles: Poles, L: float, t: Array, tau: Array, before: float, angle: float, rate: float) -> Array:
    """Angle at times t of an eye behind a dead time, whose motor stands at `before` until it follows tau from 0 on."""

    def stretch(state: list[float], low: float, high: float, u: Callable[[float], float]) -> OdeResult:
        def slope(time: float, y: Array) -> list[float]:
            if len(poles) == 1:
                return [poles[0] * (K * u(time) - y[0])]
            damp, square = real(poles)
            return [y[1], square * (K * u(time) - y[0]) - damp * y[1]]

        return solve_ivp(slope, (low, high), state, rtol=1e-9, atol=1e-10, max_step=2e-3, dense_output=True)

    waiting = stretch([angle, rate][: len(poles)], 0.0, max(L, 1e-12), lambda _: before)
    moving = stretch(list(waiting.y[:, -1]), L, float(t[-1]), lambda time: float(np.interp(time - L, t, tau)))
    return np.where(t < L, waiting.sol(t)[0], moving.sol(t)[0])


@pytest.mark.parametrize("L", [0.0, 0.004, 0.0083, 0.3])
@pytest.mark.parametrize("poles", [(17.5,), second_order_poles(22.0, 0.7), second_order_poles(9.0, 1.6)])
def test_a_motor_that_jumps_reaches_the_eye_after_the_dead_time(poles: Poles, L: float) -> None:
    """From where motor and eye rest, and from where the eye is elsewhere and turns, which needs no dead time."""
    t = np.arange(0, 0.4, 0.001)
    tau = np.stack([np.full(t.size, 10.0), 4 + 30 * np.minimum(t, 0.1)])
    number: dict[str, Any] = {"w0": poles[0]}
    if len(poles) == 2:
        damp, square = real(poles)
        number = {"wn": square**0.5, "zeta": damp / 2 / square**0.5}
    eye = LinearPlant(Surrogate(K, dead_time=L, **number))
    before, beside, spin = np.array([0.0, -3.0]), np.array([0.0, 2.0]), np.array([0.0, 40.0])
    velocity = np.zeros((2, 3))
    velocity[:, 2] = spin
    start = State(about("yaw", K * before + beside), before[:, None], velocity)
    moved = eye.move(tau[..., None], start).trajectory().yaw_deg
    for row in range(2):
        right = delayed(poles, L, t, tau[row], before[row], K * before[row] + beside[row], spin[row])
        np.testing.assert_allclose(moved[row], right, atol=2e-5)
    assert (moved[0, t <= L] == 0).all()


def test_rows_that_jump_have_their_own_plants() -> None:
    poles, L = second_order_poles(np.array([10.0, 20.0]), np.array([0.3, 2.0])), np.array([0.0, 0.0131])
    motor, before = np.random.default_rng(1).normal(size=(2, 60)), np.array([1.0, -7.0])
    angle, rate = sampled_response(K, poles, L, motor, 0.002, before)
    for i in range(2):
        one = sampled_response(K, tuple(w[i] for w in poles), L[i], motor[i : i + 1], 0.002, before[i : i + 1])
        np.testing.assert_allclose([angle[i], rate[i]], [one[0][0], one[1][0]], rtol=0, atol=1e-9)
    same = sampled_response(K, poles, L, motor, 0.002, motor[:, 0])
    np.testing.assert_array_equal(same, sampled_response(K, poles, L, motor, 0.002))
    with pytest.raises(InputError, match="rest before"):
        sampled_response(K, poles, L, motor, 0.002, before[:1])


@pytest.mark.parametrize(
    "numbers",
    [
        {"wn": 22.0, "zeta": 0.7, "dead_time": 0.0083},
        {"wn": 80.0, "zeta": 1.4, "dead_time": 0.012},
        {"w0": 25.0, "dead_time": 0.02},
        {"wn": 12.0, "zeta": 0.9},
    ],
)
def test_steps_of_a_surrogate_tell_its_own_numbers(numbers: dict[str, Any]) -> None:
    found = identify_plant(LinearPlant(Surrogate(1.6, **numbers)), (2.0, -5.0, 10.0)).surrogate
    for name, right in {"K": 1.6, "w0": None, "wn": None, "zeta": None, "dead_time": 0.0, **numbers}.items():
        assert getattr(found, name) == (None if right is None else pytest.approx(right, rel=1e-5)), name
