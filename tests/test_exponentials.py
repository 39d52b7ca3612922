"""Sums of c t^n exp(-p t): every operation against mpmath or quadrature, never against itself."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from orient_eye.commands.exponentials import ExponentialSum, Term, filter_energy

Array = NDArray[np.float64]
POWERS = (0, 1, 2)
# Of p t and (p - w) t: through the switch from series to recursion at 0.5, and far to both sides.
WIDE = np.unique(np.concatenate([np.logspace(-16, 3, 77), 0.5 * (1 + np.array([-1e-15, 0, 1e-15, 1e-3])), [0.3, 0.8]]))

properties = settings(deadline=None, max_examples=60, derandomize=True)
coefficient = st.floats(-5, 5).filter(lambda c: abs(c) > 1e-3)
decay = st.floats(0.05, 200)
term = st.tuples(coefficient, st.sampled_from(POWERS), decay)


def single(c: float, n: int, p: float | Array) -> ExponentialSum:
    p = np.atleast_1d(np.asarray(p, float))
    return ExponentialSum((Term(np.full_like(p, c), n, p),))


def build(terms: list[tuple[float, int, float]]) -> ExponentialSum:
    return ExponentialSum(tuple(Term(np.array([c]), n, np.array([p])) for c, n, p in terms))


def plain(terms: list[tuple[float, int, float]], t: float) -> float:
    return float(sum(c * t**n * np.exp(-p * t) for c, n, p in terms))


def size(terms: list[tuple[float, int, float]]) -> float:
    """Largest value of any one term: what rounding is relative to when terms cancel."""
    return max(abs(c) * (n / (np.e * p)) ** n if n else abs(c) for c, n, p in terms)


def kummer_moment(n: int, z: float) -> float:
    """Integral of u^n exp(-z u) over 0..1, either sign of z: 1F1(n + 1; n + 2; -z) / (n + 1)."""
    with mpmath.workdps(30):
        return float(mpmath.hyp1f1(n + 1, n + 2, -mpmath.mpf(z)) / (n + 1))


@pytest.mark.parametrize("n", POWERS)
def test_kummer_moment_is_the_integral(n: int) -> None:
    """The witness itself, by its definition."""
    for z in (-3.0, -0.1, 0.0, 0.4, 7.0, 60.0):
        assert kummer_moment(n, z) == pytest.approx(quad(lambda u, z=z: u**n * np.exp(-z * u), 0, 1)[0], rel=1e-12)


@pytest.mark.parametrize("n", POWERS)
def test_integral_of_one_term(n: int) -> None:
    for t in (1.0, 0.03):
        found = single(1.0, n, WIDE / t).integral(np.array([t]))[:, 0]
        np.testing.assert_allclose(found, [t ** (n + 1) * kummer_moment(n, z) for z in WIDE], rtol=5e-15)


@pytest.mark.parametrize("n", POWERS)
def test_low_pass_of_one_term_for_either_sign_of_p_minus_w(n: int) -> None:
    """w exp(-w t) t^(n+1) times the moment at (p - w) t; the far ends underflow in neither route."""
    t = 0.7
    for w in (17.5, 600.0):
        p = w + np.concatenate([WIDE[WIDE < 500], -WIDE[WIDE / t < w]]) / t
        found = single(1.0, n, p).low_pass(w, np.array([t]))[:, 0]
        with mpmath.workdps(40):
            exact = [
                float(
                    w * mpmath.exp(-w * mpmath.mpf(t)) * mpmath.mpf(t) ** (n + 1)
                    * mpmath.hyp1f1(n + 1, n + 2, -(mpmath.mpf(x) - w) * t) / (n + 1)
                )
                for x in p
            ]  # fmt: skip
        # exp(-w t) itself carries a rounding of w t in units of eps.
        np.testing.assert_allclose(found, exact, rtol=4e-16 * max(20.0, w * t))


@pytest.mark.parametrize("n", POWERS)
def test_low_pass_where_both_ends_overflow_alone(n: int) -> None:
    """exp(w t) and exp(p t) are beyond the largest float; the response is not."""
    t = np.array([1.0])
    with np.errstate(over="raise", invalid="raise"):
        slow = single(1.0, n, 2.0).low_pass(3000.0, t)[0, 0]
        fast = single(1.0, n, 3000.0).low_pass(2.0, t)[0, 0]
    # Far from p = w the slow one is left: w / (w - p) t^n e^(-p t) + ..., and w n! / (p - w)^(n+1) e^(-w t).
    follows = sum(
        (-1) ** k * float(mpmath.ff(n, k)) / 2998.0 ** (k + 1) for k in range(n + 1)
    ) * 3000.0 * np.exp(-2.0)  # fmt: skip
    assert slow == pytest.approx(follows, rel=1e-13)
    assert fast == pytest.approx(2.0 * float(mpmath.factorial(n)) / 2998.0 ** (n + 1) * np.exp(-2.0), rel=1e-13)


@properties
@given(terms=st.lists(term, min_size=1, max_size=4), w=st.floats(0.5, 100), t=st.floats(0.001, 2))
def test_sums_against_quadrature(terms: list[tuple[float, int, float]], w: float, t: float) -> None:
    total, at, scale = build(terms), np.array([[t]]), size(terms)
    assert total(at)[0, 0] == pytest.approx(plain(terms, t), abs=1e-14 * scale)
    knots = sorted({t * x for x in (0.01, 0.1, 0.5, 0.9, 0.99)})
    area = quad(lambda s: plain(terms, s), 0, t, points=knots, epsabs=0, epsrel=1e-12, limit=200)[0]
    assert total.integral(at)[0, 0] == pytest.approx(area, abs=1e-11 * scale * t)
    response = quad(
        lambda s: w * plain(terms, s) * np.exp(-w * (t - s)), 0, t, points=knots, epsabs=0, epsrel=1e-12, limit=200
    )[0]
    assert total.low_pass(w, at)[0, 0] == pytest.approx(response, abs=1e-11 * scale)


@properties
@given(terms=st.lists(term, min_size=1, max_size=4), t=st.floats(0, 3))
def test_derivative_by_complex_step(terms: list[tuple[float, int, float]], t: float) -> None:
    step = 1e-30
    rate = sum(c * (t + 1j * step) ** n * np.exp(-p * (t + 1j * step)) for c, n, p in terms)
    scale = sum(abs(c) * (p + n) * max(1.0, t**n) for c, n, p in terms)
    assert build(terms).derivative()(np.array([[t]]))[0, 0] == pytest.approx(rate.imag / step, abs=1e-14 * scale)


@properties
@given(
    poles=st.lists(st.floats(1, 100), min_size=2, max_size=3),
    apart=st.sampled_from([0.0, 1e-9, 1e-3, 1.0]),
    zero=st.floats(0.5, 60),
)
def test_filter_energy_against_the_frequency_domain(poles: list[float], apart: float, zero: float) -> None:
    """Parseval: the integral over frequency, with poles also together or nearly so."""
    poles[-1] = poles[0] + apart

    def density(log_w: float) -> float:
        w = np.exp(log_w)
        return w * abs((1j * w + zero) / np.prod([1j * w + p for p in poles])) ** 2

    area = quad(density, -20, 40, points=np.log([*poles, zero]), epsabs=0, epsrel=1e-12, limit=500)[0] / np.pi
    found = filter_energy([np.array([p]) for p in poles], np.array([zero]))
    assert found[0] == pytest.approx(area, rel=1e-8)


def test_derivative_integrates_back() -> None:
    total = build([(2.0, 2, 7.0), (-3.0, 1, 30.0), (0.5, 0, 1.5)])
    t = np.linspace(0, 2, 50)[None]
    np.testing.assert_allclose(total.derivative().integral(t), total(t) - total(np.zeros((1, 1))), atol=1e-14)


def test_sum_and_scale() -> None:
    one, other = build([(2.0, 1, 3.0)]), build([(-1.0, 0, 5.0)])
    t = np.linspace(0, 1, 7)[None]
    np.testing.assert_array_equal((one + other)(t), 2 * t * np.exp(-3 * t) - np.exp(-5 * t))
    np.testing.assert_array_equal(one.scaled(np.array([4.0]))(t), 8 * t * np.exp(-3 * t))


def test_batches_are_their_rows() -> None:
    """Shapes (saccades, motors) with times (saccades, 1, time) or (time,), each entry as if alone."""
    rng = np.random.default_rng(0)
    c, p = rng.normal(size=(2, 4, 3)), rng.uniform(1, 50, (2, 4, 3))
    total = ExponentialSum((Term(c[0], 1, p[0]), Term(c[1], 2, p[1])))
    common, own = rng.uniform(0, 1, 6), rng.uniform(0, 1, (4, 1, 6))
    w = p[0] + rng.uniform(-3, 3, (4, 3))
    for t in (common, own):
        batch = [total(t), total.integral(t), total.low_pass(w, t), total.derivative()(t)]
        assert [x.shape for x in batch] == [(4, 3, 6)] * 4
        for i in range(4):
            for j in range(3):
                alone = ExponentialSum(tuple(Term(x.c[i, j], x.n, x.p[i, j]) for x in total.terms))
                at = common if t is common else own[i, 0]
                rows = [alone(at), alone.integral(at), alone.low_pass(w[i, j], at), alone.derivative()(at)]
                for together, row in zip(batch, rows, strict=True):
                    np.testing.assert_array_equal(together[i, j], row)
