"""Mixtures have what frozen distributions have, and all of it is of one distribution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.integrate import quad

from friction_bayes.conjugate.frozen import crossed
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.conjugate.scaled_distribution import ScaledDistribution, scaled
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.core.summary import Summary

LEVELS = np.array([0.001, 0.05, 0.3, 0.5, 0.9, 0.999])


@st.composite
def mixtures(draw: st.DrawFn) -> Mixture:
    size = draw(st.integers(1, 4))
    number = st.floats(-5.0, 5.0)
    parts = [draw(st.tuples(number, st.floats(-3.0, 1.0), st.floats(0.01, 1.0))) for _ in range(size)]
    location, log_scale, weight = np.array(parts).T
    positive = draw(st.booleans())
    atom = draw(st.sampled_from([0.0, 0.03, 0.4]))
    weight = weight * (1.0 - atom) / weight.sum()
    mixture = Mixture.of_normals(weight, location, np.exp(log_scale), positive=positive, atom=atom)
    if not positive and draw(st.booleans()):
        mixture = Mixture.of([mixture, Mixture.of_student(stats.t(df=30.0, loc=1.0, scale=0.2))], (0.7, 0.3))
    return mixture


@settings(max_examples=40)
@given(mixtures())
def test_every_summary_is_of_one_distribution(mixture: Mixture) -> None:
    x = mixture.ppf(LEVELS)
    assert np.all(np.diff(x) >= 0.0)
    away = np.abs(x) > 1e-9
    np.testing.assert_allclose(mixture.cdf(x[away]), LEVELS[away], atol=1e-9)
    np.testing.assert_allclose(mixture.cdf(x) + mixture.sf(x), 1.0, atol=1e-12)
    # between two modes far apart a quantile is known to the error of its level over the density
    off = np.abs(mixture.isf(1.0 - LEVELS) - x)
    assert np.all(off <= 1e-7 + 1e-12 / np.maximum(mixture.pdf(x), 1e-300))
    assert mixture.median() == mixture.ppf(0.5)
    low, high = mixture.interval(0.9)
    assert (low, high) == pytest.approx((mixture.ppf(0.05), mixture.ppf(0.95)), abs=1e-9)
    summary = Summary.of_distribution(mixture, "N")
    assert summary.interval90[0] <= summary.mean <= summary.interval90[1]
    assert summary.mean == mixture.mean()


@settings(max_examples=40)
@given(mixtures())
def test_moments_are_integrals_of_quantiles(mixture: Mixture) -> None:
    level = (np.arange(1_000) + 0.5) / 1_000
    x = mixture.ppf(level)
    scale = max(np.abs(x).max(), 1e-3)
    assert mixture.mean() == pytest.approx(x.mean(), abs=2e-3 * scale)
    assert mixture.std() == pytest.approx(x.std(), abs=5e-3 * scale)


@pytest.mark.parametrize("positive", [False, True])
def test_density_integrates_to_the_distribution(positive: bool) -> None:
    mixture = Mixture.of_normals(
        np.array([0.2, 0.5]), np.array([-0.5, 2.0]), np.array([0.4, 1.0]), positive=positive, atom=0.3
    )
    mass = quad(mixture.pdf, 0.5, 3.0)[0]
    assert mass == pytest.approx(mixture.cdf(3.0) - mixture.cdf(0.5), abs=1e-9)
    assert mixture.cdf(0.0) - mixture.cdf(-1e-12) == pytest.approx(0.3)
    assert mixture.support() == ((0.0 if positive else -np.inf), np.inf)


def test_draws_have_its_distribution(rng) -> None:
    for positive in (False, True):
        mixture = Mixture.of_normals(
            np.array([0.4, 0.6]), np.array([-1.0, 2.0]), np.array([0.5, 1.0]), positive=positive
        )
        assert stats.kstest(mixture.rvs(4000, random_state=rng), mixture.cdf).pvalue > 1e-4
    with pytest.raises(TypeError, match="random_state"):
        mixture.rvs(3)
    atom = Mixture.of_normals(np.array([0.5]), np.array([3.0]), np.array([0.1]), atom=0.5)
    assert np.mean(atom.rvs(2000, random_state=rng) == 0.0) == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("degrees", [5.0, np.inf])
def test_one_part_is_that_part(degrees: float) -> None:
    one = Mixture(np.ones(1), np.array([2.0]), np.array([0.3]), np.array([degrees]))
    t = stats.t(degrees, 2.0, 0.3)
    for method in ("mean", "std", "median", "var"):
        assert getattr(one, method)() == pytest.approx(getattr(t, method)(), rel=1e-10)
    np.testing.assert_allclose(one.ppf(LEVELS), t.ppf(LEVELS), rtol=1e-10)
    assert one.logpdf(2.3) == pytest.approx(t.logpdf(2.3))


@pytest.mark.parametrize("degrees", [1.0, 1.5, 2.0])
def test_few_degrees_of_freedom_leave_no_variance(degrees: float) -> None:
    mixture = Mixture(np.full(2, 0.5), np.zeros(2), np.ones(2), np.array([30.0, degrees]))
    np.testing.assert_equal(mixture.var(), stats.t(degrees).var())


def test_a_quantile_takes_few_probabilities(rng: np.random.Generator) -> None:
    """Of a mixture as an estimate's: interpolation finds in a dozen what halving does in fifty."""
    spread = rng.uniform(1.0, 5.0, 60)
    mixture = Mixture(np.full(60, 1.0 / 60.0), 3.0 + 0.1 * spread, 0.1 * spread, np.full(60, 97.0))
    asked = []

    def beyond(x: Array) -> Array:
        asked.append(x)
        return np.asarray(mixture.cdf(x) - [0.05, 0.95])

    x = crossed(np.array([0.0, 3.0]), np.array([3.5, 6.0]), beyond)
    np.testing.assert_allclose(mixture.cdf(x), [0.05, 0.95], rtol=1e-14)
    assert len(asked) < 20


def test_factors_known_and_not() -> None:
    mixture = Mixture.of_normals(np.array([0.7, 0.3]), np.array([1.0, 1.1]), np.array([0.01, 0.1]))
    exact = scaled(mixture, 3.0)
    assert exact.mean() == pytest.approx(3.0 * mixture.mean())
    assert exact.ppf(0.05) == pytest.approx(3.0 * mixture.ppf(0.05))
    uncertain = scaled(mixture, 3.0, relative_sd=0.02)
    assert isinstance(uncertain, ScaledDistribution)
    assert uncertain.cdf(uncertain.ppf(0.3)) == pytest.approx(0.3, abs=1e-6)
    assert uncertain.std() > exact.std()


def test_what_does_not_fit_is_refused() -> None:
    one = np.ones(1)
    with pytest.raises(InputError, match="weights of sum 2"):
        Mixture.of_normals(2.0 * one, one, one)
    with pytest.raises(InputError, match="Student t"):
        Mixture(one, one, one, 3.0 * one, positive=True)


def cut_normal(location: float, scale: float) -> Mixture:
    return Mixture.of_normals(np.ones(1), np.array([location]), np.array([scale]), positive=True)


@pytest.mark.parametrize(
    ("below", "mean", "variance"),
    [
        (3.0, 0.2830986549304365, 0.07055918678526811),
        (10.0, 0.09809323396251196, 0.009445377825656262),
        (20.0, 0.049753068527850546, 0.0024632616150521637),
        (30.0, 0.03325966743367704, 0.001103771511890091),
        (300.0, 0.0033332592633741475, 1.1110370438949582e-05),
        (1e4, 9.99999980000001e-05, 9.99999940000005e-09),
    ],
)
def test_moments_of_a_normal_cut_far_out_in_its_tail(below: float, mean: float, variance: float) -> None:
    """By a continued fraction for the ratio of the tail to the density, in eighty digits."""
    cut = cut_normal(-2.0 * below, 2.0)
    assert cut.mean() == pytest.approx(2.0 * mean, rel=2e-8)
    assert cut.var() == pytest.approx(4.0 * variance, rel=4e-8)


def test_moments_of_a_cut_normal_go_over_into_those_of_the_whole() -> None:
    near = cut_normal(0.5, 1.0)
    expected = stats.truncnorm(-0.5, np.inf, 0.5, 1.0)
    assert near.mean() == pytest.approx(expected.mean(), rel=1e-12)
    assert near.var() == pytest.approx(expected.var(), rel=1e-12)
    whole = cut_normal(30.0, 2.0)
    assert (whole.mean(), whole.var()) == pytest.approx((30.0, 4.0), rel=1e-12)
