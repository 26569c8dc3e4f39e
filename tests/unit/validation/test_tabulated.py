"""Tabulated densities and distribution functions against scipy's own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from friction_bayes.core.errors import InputError
from friction_bayes.validation.tabulated import Tabulated


@pytest.mark.parametrize(
    ("distribution", "around", "support"),
    [
        (stats.norm(3.0, 2.0), (2.0, 4.0), (-np.inf, np.inf)),
        (stats.norm(1e6, 0.5), (1e6 - 1.0, 1e6 + 1.0), (-np.inf, np.inf)),
        (stats.gamma(3.0), (1.0, 5.0), (0.0, np.inf)),
        (stats.beta(2.0, 5.0), (0.2, 0.4), (0.0, 1.0)),
        (stats.t(8.0), (-2.0, 2.0), (-np.inf, np.inf)),
    ],
)
@pytest.mark.parametrize("kind", ["density", "cdf"])
def test_agrees_with_scipy(distribution, around, support, kind) -> None:
    function = (lambda x: 7.0 * distribution.pdf(x)) if kind == "density" else distribution.cdf
    table = Tabulated.of(function, around=around, support=support, kind=kind)
    sd = distribution.std()
    assert table.mean() == pytest.approx(distribution.mean(), abs=2e-5 * sd)
    assert table.std() == pytest.approx(sd, rel=2e-4)
    p = np.array([0.01, 0.05, 0.5, 0.95, 0.99])
    np.testing.assert_allclose(table.cdf(distribution.ppf(p)), p, atol=1e-6)
    np.testing.assert_allclose(table.ppf(p), distribution.ppf(p), atol=1e-4 * sd)
    assert table.cdf(around[0] - 1e9) == 0.0
    assert table.cdf(around[1] + 1e9) == 1.0


def test_finds_a_mode_far_from_the_draws() -> None:
    mixture = Tabulated.of(lambda x: stats.norm.pdf(x) + stats.norm.pdf(x, 8.0), around=(-3.0, 3.0))
    assert mixture.mean() == pytest.approx(4.0, abs=1e-3)


@pytest.mark.parametrize(
    ("function", "kind", "message"),
    [
        (lambda x: np.ones_like(x), "density", "proper"),
        (lambda x: -stats.norm.pdf(x), "density", "negative"),
        (stats.norm.logpdf, "density", r"negative, -[\d.]+ at [-\d.]+; give the density, not its logarithm"),
        (stats.gamma(3.0).logpdf, "density", "negative, -inf at -1; give the density, not its logarithm"),
        (lambda x: np.full_like(x, np.nan), "density", "not finite, nan at -1; state its support"),
        (lambda x: 1.0, "density", "take an array and return as many values"),
        (lambda x: 2.0 * stats.norm.cdf(x), "cdf", "above 1"),
        (lambda x: stats.norm.sf(x), "cdf", "settle|decreases"),
    ],
)
def test_refuses_what_is_no_distribution(function, kind, message) -> None:
    with pytest.raises(InputError, match=f"^expected: .*({message})"):
        Tabulated.of(function, around=(-1.0, 1.0), kind=kind)


def test_a_kind_is_spelt_as_it_is() -> None:
    with pytest.raises(InputError, match="kind: unknown kind 'CDF'; give one of density, cdf"):
        Tabulated.of(stats.norm.cdf, around=(-1.0, 1.0), kind="CDF")


def test_an_error_of_the_function_is_left_with_a_note() -> None:
    with pytest.raises(TypeError) as reported:
        Tabulated.of(lambda x: math.exp(-(x**2)), around=(-1.0, 1.0))
    (note,) = reported.value.__notes__
    assert note.startswith("the density was given an array of shape (8193,); let the density take an array")


def test_refuses_a_range_outside_the_support() -> None:
    with pytest.raises(InputError, match=r"^support: .*no finite range"):
        Tabulated.of(stats.gamma(3.0).pdf, around=(-2.0, -1.0), support=(0.0, np.inf))
