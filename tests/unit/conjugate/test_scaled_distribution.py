"""A distribution times an uncertain factor, against direct quadrature and draws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from friction_bayes.conjugate.scaled_distribution import ScaledDistribution, scaled
from friction_bayes.core.errors import InputError

COEFFICIENTS = {
    "wide": stats.t(df=20, loc=1e-6, scale=7e-6),
    "middling": stats.t(df=20, loc=7e-5, scale=7e-7),
    "narrow": stats.t(df=50, loc=7e-5, scale=1e-8),
    "negative": stats.t(df=30, loc=-7e-5, scale=1e-6),
    "gamma": stats.gamma(5.0, scale=1e-5),
}
PROBABILITIES = np.array([1e-4, 0.05, 0.3, 0.5, 0.95, 0.999])


def reference_cdf(distribution: Any, factor: float, relative_sd: float, x: float) -> float:
    """Gauss-Legendre over many panels of the factor, crowded where the coefficient makes a step."""
    low = max(-9.5, -1.0 / relative_sd)
    with np.errstate(divide="ignore"):
        step = (x / (factor * distribution.ppf([0.01, 0.5, 0.99])) - 1.0) / relative_sd
    crowd = step[1] + np.linspace(-30.0, 30.0, 2001) * np.ptp(step) / 4.0
    edges = np.unique(np.clip(np.concatenate([np.linspace(low, 9.5, 601), crowd]), low, 9.5))
    node, weight = np.polynomial.legendre.leggauss(6)
    half = 0.5 * np.diff(edges)
    z = edges[:-1, None] + half[:, None] * (1.0 + node)
    values = stats.norm.pdf(z) * distribution.cdf(x / (factor * (1.0 + relative_sd * z)))
    return float((values @ weight) @ half) / float(stats.norm.cdf(1.0 / relative_sd))


@pytest.mark.parametrize("relative_sd", [1e-4, 0.01, 0.1, 0.3])
@pytest.mark.parametrize("name", COEFFICIENTS)
def test_probabilities_are_exact(name: str, relative_sd: float) -> None:
    distribution = COEFFICIENTS[name]
    product = scaled(distribution, 1000.0, relative_sd=relative_sd)
    x = product.ppf(PROBABILITIES)
    assert product.cdf(x) == pytest.approx(PROBABILITIES, abs=1e-10)
    assert product.sf(x) == pytest.approx(1.0 - PROBABILITIES, abs=1e-10)
    assert product.isf(1.0 - PROBABILITIES) == pytest.approx(x, rel=1e-9)
    if name in ("middling", "narrow", "negative"):
        assert [reference_cdf(distribution, 1000.0, relative_sd, v) for v in x] == pytest.approx(
            PROBABILITIES.tolist(), abs=1e-9
        )


@pytest.mark.parametrize("name", COEFFICIENTS)
def test_density_is_the_derivative(name: str) -> None:
    product = scaled(COEFFICIENTS[name], 1000.0, relative_sd=0.02)
    x = product.ppf(PROBABILITIES[1:-1])
    h = 1e-3 * (product.ppf(0.6) - product.ppf(0.4))
    slope = (product.cdf(x + h) - product.cdf(x - h)) / (2.0 * h)
    assert product.pdf(x) == pytest.approx(slope, rel=1e-5)
    assert product.logpdf(x) == pytest.approx(np.log(product.pdf(x)), abs=1e-12)


@pytest.mark.parametrize("relative_sd", [0.005, 0.05, 0.2])
@pytest.mark.parametrize("name", ["middling", "gamma", "narrow"])
def test_moments_match_the_distribution(name: str, relative_sd: float) -> None:
    product = scaled(COEFFICIENTS[name], 1000.0, relative_sd=relative_sd)
    x = np.linspace(product.ppf(1e-9), product.isf(1e-9), 801)
    density = product.pdf(x)
    mean = np.trapezoid(x * density, x)
    assert product.mean() == pytest.approx(mean, rel=1e-5)
    assert product.std() == pytest.approx(np.sqrt(np.trapezoid((x - mean) ** 2 * density, x)), rel=1e-4)
    assert product.var() == pytest.approx(product.std() ** 2)
    assert product.median() == pytest.approx(product.ppf(0.5))
    assert product.interval(0.9) == pytest.approx((product.ppf(0.05), product.ppf(0.95)))


def test_draws(rng: np.random.Generator) -> None:
    product = scaled(COEFFICIENTS["middling"], 1000.0, relative_sd=0.02)
    assert stats.kstest(product.rvs(2500, random_state=rng), product.cdf).pvalue > 1e-4
    with pytest.raises(TypeError, match="random_state"):
        product.rvs(3)


@pytest.mark.parametrize(
    "frozen",
    [stats.t(3.0, 0.1, 0.2), stats.t(df=3.0, loc=0.1, scale=0.2), stats.gamma(2.0, scale=0.1), stats.norm()],
)
def test_an_exact_factor_only_scales(frozen: Any) -> None:
    product = scaled(frozen, 40.0)
    assert not isinstance(product, ScaledDistribution)
    assert product.ppf(PROBABILITIES) == pytest.approx(40.0 * frozen.ppf(PROBABILITIES))
    almost = scaled(frozen, 40.0, relative_sd=1e-8)
    assert almost.ppf(PROBABILITIES) == pytest.approx(product.ppf(PROBABILITIES), rel=1e-6, abs=1e-9)


def test_ends_and_shapes() -> None:
    product = scaled(COEFFICIENTS["gamma"], 2.0, relative_sd=0.1)
    assert product.support() == (0.0, np.inf)
    ends = product.ppf([[0.0, 1.0], [np.nan, 0.5]])
    assert ends.shape == (2, 2)
    assert (ends[0, 0], ends[0, 1]) == (0.0, np.inf)
    assert np.isnan(ends[1, 0])
    assert np.ndim(product.cdf(1e-4)) == 0
    assert product.cdf(np.full((2, 3), 1e-4)).shape == (2, 3)


def test_bad_factors_are_named() -> None:
    with pytest.raises(InputError, match="factor: 0 is not positive"):
        scaled(stats.norm(), 0.0)
    with pytest.raises(InputError, match=r"relative_sd: -0\.1 is negative"):
        scaled(stats.norm(), 1.0, relative_sd=-0.1)
