"""Sums of c t^n exp(-p t): every operation against mpmath or quadrature, never against itself."""

from math import factorial
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from orient_eye.commands.exponentials import ExponentialSum, Mode, Modes, Term, filter_energy, impulse_response

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


# --- modes ----------------------------------------------------------------------------------------

# Relative distances of poles: none, and to both sides of where series and partial fractions change over.
GAPS = (0.0, 1e-14, -1e-9, 1e-5, -1e-3, 0.01, -0.04, 0.0499, 0.0501, -0.06, 0.2, 1.5)
TIMES = np.array([0, 1e-6, 0.003, 0.02, 0.06, 0.15, 0.5])


def partial_fractions(inputs: list[tuple[float, list[Any]]], t: Array) -> Array:
    """Area to come, value, two derivatives (4, time) of the sum of c / ((s + p) (s + q) ...), each as (c, [p, q, ...]).

    In many digits: poles that are the same are set 1e-18 apart, which moves the answer by as much.
    """
    total = [[mpmath.mpf(0)] * len(t) for _ in range(4)]
    with mpmath.workdps(200):
        for c, poles in inputs:
            apart = [mpmath.mpmathify(p) * (1 + i * mpmath.mpf(10) ** -18) for i, p in enumerate(poles)]
            for i, p in enumerate(apart):
                residue = mpmath.mpf(c) / mpmath.fprod(q - p for j, q in enumerate(apart) if j != i)
                for k, time in enumerate(t):
                    part = residue * mpmath.exp(-p * mpmath.mpf(float(time)))
                    for n in range(4):
                        total[n][k] += part * (-p) ** (n - 1) * (-1 if n == 0 else 1)
    return np.array([[float(mpmath.re(x)) for x in row] for row in total])


def near(rows: int, rng: np.random.Generator) -> Array:
    return np.asarray(20 * (1 + rng.choice(GAPS, rows)))


def two_modes(rows: int, rng: np.random.Generator) -> Modes:
    """Of the orders 0 to 2, and 0."""
    p, q = near(rows, rng), near(rows, rng)
    return Modes((Mode(p, rng.normal(size=(3, rows)) * [[1], [20], [400]]), Mode(q, rng.normal(size=(1, rows)))))


def pole_pairs(rows: int, rng: np.random.Generator) -> list[Array]:
    """Conjugate, in some rows two real ones."""
    first, second, turned = near(rows, rng), near(rows, rng), rng.choice([0, 1e-9, 1e-3, 0.5, 1, 4, 30], rows)
    return [first + 1j * turned, np.where(turned == 0, second, first - 1j * turned)]


def seen(modes: Modes, t: Array = TIMES[None]) -> Array:
    """(..., 4, time): area to come, value and two derivatives."""
    return np.stack([*modes.tail().jet(t, 0), *modes.jet(t, 2)], axis=-2)


def hold(found: Array, exact: Array, within: float = 2e-8) -> None:
    """To a share of the largest value over time."""
    np.testing.assert_array_less(np.abs(found - exact), within * np.abs(exact).max(axis=-1, keepdims=True) + 0 * exact)


@pytest.mark.parametrize("pair", [False, True])
def test_modes_through_poles_wherever_they_are(pair: bool) -> None:
    """Near to the modes and to each other, three real ones or a pair, each row as if alone."""
    rows, rng = 24, np.random.default_rng(5)
    modes = two_modes(rows, rng)
    poles = pole_pairs(rows, rng) if pair else [near(rows, rng) for _ in range(3)]
    found = seen(modes.through(poles))
    for i in range(rows):
        own = [w[i] for w in poles]
        hold(
            found[i],
            partial_fractions(
                [
                    (np.prod(own).real * c, [m.p[i]] * (n + 1) + own)
                    for m in modes.modes
                    for n, c in enumerate(m.a[:, i])
                ],
                TIMES,
            ),
        )


@pytest.mark.parametrize("gaps", [(0.049, 0.051, 0.052), (-0.0499, -0.0501, -0.0502), (0.04, 0.08, 0.08, 0.081)])
def test_poles_near_to_a_pole_that_a_mode_took_in_before(gaps: tuple[float, ...]) -> None:
    """But not to the mode's own rate: as many digits as elsewhere."""
    p, poles, a = 20.0, [20 * (1 + gap) for gap in gaps], [1.0, 20.0, 400.0]
    fractions: list[tuple[float, list[Any]]] = [(np.prod(poles) * c, [p] * (n + 1) + poles) for n, c in enumerate(a)]
    mode = Mode(np.array([p]), np.array(a)[:, None])
    hold(seen(Modes((mode,)).through(poles))[0], partial_fractions(fractions, TIMES), 1e-12)


def test_a_sum_through_poles() -> None:
    """Terms of one rate, two of them of one order, and of another rate; one of the poles meets the first."""
    p, q = np.array([20.0]), np.array([50.0])
    terms = [(3.0, 2, p), (-0.04, 0, p), (2.0, 2, p), (0.7, 1, q)]
    total = ExponentialSum(tuple(Term(np.array([c]), n, rate) for c, n, rate in terms))
    fractions: list[tuple[float, list[Any]]] = [
        (c * factorial(n) * 20 * 7, [rate[0]] * (n + 1) + [20.0, 7.0]) for c, n, rate in terms
    ]
    hold(seen(total.through([20.0, np.array([7.0])]))[0], partial_fractions(fractions, TIMES), 1e-12)


@pytest.mark.parametrize("poles", [(20.0,), (20.0, 20.0 * (1 + 1e-9), 35.0), (20.0, 15 + 8j, 15 - 8j)])
def test_impulse_response(poles: tuple[complex, ...]) -> None:
    found = seen(impulse_response([np.array([p]) for p in poles]))[0]
    hold(found, partial_fractions([(np.prod(poles).real, list(poles))], TIMES), 1e-11)


def test_modes_scaled_and_added() -> None:
    """5 exp(-3 t), and with t exp(-3 t) beside it."""
    p, t = np.array([3.0]), np.linspace(0, 1, 7)[None]
    one, other = Modes((Mode(p, np.array([[5.0], [0.0]])),)), Modes((Mode(p, np.array([[0.0], [1.0]])),))
    np.testing.assert_allclose(one.scaled(np.array([4.0])).jet(t, 0)[0], 20 * np.exp(-3 * t), rtol=1e-15)
    np.testing.assert_allclose(one.plus(other).jet(t, 0)[0], (5 + t) * np.exp(-3 * t), rtol=1e-15)
    with pytest.raises(ValueError, match="shorter"):
        one.plus(Modes(()))


@pytest.mark.parametrize(("rows", "samples", "close"), [(70, 60, 0.5), (70, 60, 0.0), (26, 120, 1.0), (2, 40_000, 0.5)])
def test_a_large_batch_of_modes_is_its_rows(rows: int, samples: int, close: float) -> None:
    """More than is computed at a time, of poles that are near in none, some or all rows; (saccades, motors)."""
    rng = np.random.default_rng(rows)
    p, far = rng.uniform(40, 60, rows), rng.uniform(5, 8, rows)
    pole = np.where(np.arange(rows) < close * rows, 1.03 * p, 200.0)
    sums, t = rng.normal(size=(3, rows)) * [[1], [50], [2500]], rng.uniform(0, 0.2, (rows, samples))
    alone = Modes((Mode(p, sums), Mode(far, sums[:1]))).through([100.0, pole])
    two = (rows // 2, 2)
    modes = Modes(tuple(Mode(m.p.reshape(two), m.a.reshape(-1, *two)) for m in alone.modes))
    found = seen(modes, t.reshape(*two, samples)).reshape(rows, 4, samples)
    for i in {0, rows // 2, rows - 1, *rng.integers(0, rows, 4).tolist()}:
        few = [0, samples // 2, samples - 1]
        hold(found[[i]][..., few], seen(alone[i : i + 1], t[[i]][:, few]), 1e-13)


def test_modes_of_several_motors_and_their_times() -> None:
    """(saccades, motors), and times of all, of each saccade, and of each motor."""
    rng = np.random.default_rng(2)
    p, a, w = rng.uniform(10, 50, (4, 3)), rng.normal(size=(2, 4, 3)), rng.uniform(10, 50, (4, 3))
    modes = Modes((Mode(p, a),)).through([w])
    for t in (rng.uniform(0, 0.2, 5), rng.uniform(0, 0.2, (4, 1, 5)), rng.uniform(0, 0.2, (4, 3, 5))):
        found, own = modes.jet(t, 1), np.broadcast_to(t, (4, 3, 5))
        assert [x.shape for x in found] == [(4, 3, 5)] * 2
        for i in range(4):
            for j in range(3):
                alone = Modes((Mode(p[i, j : j + 1], a[:, i, j : j + 1]),)).through([w[i, j : j + 1]])
                for x, y in zip(found, alone.jet(own[i, j][None], 1), strict=True):
                    np.testing.assert_allclose(x[i, j], y[0], rtol=0, atol=1e-13 * np.abs(y).max())
    one, own = Modes((Mode(p[0, :1], a[:, 0, :1]),)), rng.uniform(0, 0.2, (4, 5))
    np.testing.assert_array_equal(one.jet(own, 0)[0].ravel(), one.jet(own.reshape(1, -1), 0)[0].ravel())
