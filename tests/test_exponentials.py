"""Sums of c t^n exp(-p t): every operation against mpmath or quadrature, never against itself."""

from math import factorial

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
WIDE = np.logspace(-16, 3, 77)  # of p t

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
        value, found = (x[:, 0] for x in single(1.0, n, WIDE / t).with_integral(np.array([t])))
        np.testing.assert_allclose(value, t**n * np.exp(-WIDE), rtol=1e-12)
        limit = factorial(n) * (t / WIDE) ** (n + 1)  # what it goes to
        exact = np.array([t ** (n + 1) * kummer_moment(n, z) for z in WIDE])
        np.testing.assert_array_less(np.abs(found - exact), 1e-15 * limit)


@properties
@given(terms=st.lists(term, min_size=1, max_size=4), t=st.floats(0.001, 2))
def test_sums_against_quadrature(terms: list[tuple[float, int, float]], t: float) -> None:
    total, at, scale = build(terms), np.array([[t]]), size(terms)
    assert total(at)[0, 0] == pytest.approx(plain(terms, t), abs=1e-14 * scale)
    knots = sorted({t * x for x in (0.01, 0.1, 0.5, 0.9, 0.99)})
    area = quad(lambda s: plain(terms, s), 0, t, points=knots, epsabs=0, epsrel=1e-12, limit=200)[0]
    limit = max(abs(c) * factorial(n) / p ** (n + 1) for c, n, p in terms)
    assert total.with_integral(at)[1][0, 0] == pytest.approx(area, abs=1e-11 * scale * t + 1e-15 * limit)


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
    np.testing.assert_allclose(total.derivative().with_integral(t)[1], total(t) - total(np.zeros((1, 1))), atol=1e-14)


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
    for t in (common, own):
        batch = [total(t), *total.with_integral(t), total.derivative()(t)]
        assert [x.shape for x in batch] == [(4, 3, 6)] * 4
        for i in range(4):
            for j in range(3):
                alone = ExponentialSum(tuple(Term(x.c[i, j], x.n, x.p[i, j]) for x in total.terms))
                at = common if t is common else own[i, 0]
                rows = [alone(at), *alone.with_integral(at), alone.derivative()(at)]
                for together, row in zip(batch, rows, strict=True):
                    np.testing.assert_array_equal(together[i, j], row)
