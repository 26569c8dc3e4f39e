"""A sweep of priors: its update, its errors, the area of a region, and the prior of two precisions."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from experiments.claims import After, Claim, in_band, median, pooled, share
from experiments.credible_area import credible_area
from experiments.prior_sweep import shape_and_rate_for

PRIORS = [(0.5, 0.05, 1.0, 0.02), (0.1, 3.0, 0.3, 2.0), (0.1, 50.0, 26.0, 0.7)]


def after_of(values: np.ndarray, prior: fb.NormalGamma) -> After:
    """Records of three samples each, shape (records, readings of a peak, 3)."""
    dims = ("replicate", "peaks", "condition")
    mean = values.mean(axis=-1)
    columns = {
        "count": np.full(mean.shape, 3.0),
        "mean": mean,
        "squares": ((values - mean[..., None]) ** 2).sum(axis=-1),
        "truth": np.full(mean.shape, 0.2),
    }
    data = {name: (dims, column[..., None]) for name, column in columns.items()}
    return After(prior, xr.Dataset(data, coords={"condition": ["one"]}))


def test_sweep_updates_as_the_pair_does(rng: np.random.Generator) -> None:
    prior, values = fb.NormalGamma(0.3, 0.5, 2.0, 0.1), rng.normal(0.2, 0.1, (4, 1, 3))
    after = after_of(values, prior)
    for i, samples in enumerate(values[:, 0]):
        one = prior.update(samples)
        low, high = one.friction_interval(0.9)
        assert float(after.precision[i, 0, 0]) == pytest.approx(one.alpha / one.beta)
        assert float(after.error[i, 0, 0]) == pytest.approx(one.mu / 0.2 - 1.0)
        assert float(after.relative_width[i, 0, 0]) == pytest.approx((high - low) / abs(one.mu))


def test_errors_of_numbers_are_those_of_repeated_experiments(rng: np.random.Generator) -> None:
    prior = fb.NormalGamma(0.3, 0.5, 2.0, 0.1)

    def error(after: After) -> xr.DataArray:
        return after.error.sel(condition="one")

    numbers = {
        "share": share(lambda after: (error(after) > 0.1).astype(float)),
        "median": median(error),
        "pooled": pooled(lambda after: error(after).mean("replicate").values),
        "in band": in_band(error, 0.1),
    }
    # each reading of a peak is a repetition: 100 of them give a standard deviation to 7 %
    runs = after_of(rng.normal(0.2, 0.1, (80, 100, 3)), prior)
    for name, of in numbers.items():
        found, its_error = of(runs)
        assert found.std(ddof=1) == pytest.approx(its_error.mean(), rel=0.3), name


def test_few_records_have_no_error() -> None:
    after = after_of(np.full((3, 1, 3), 0.1), fb.NormalGamma(0.3, 0.5, 2.0, 0.1))
    _, error = pooled(lambda after: after.error.mean("replicate").values.ravel())(after)
    assert np.isnan(error).all()


def test_verdict_waits_for_more_than_its_error() -> None:
    value, error = np.array([0.7, 0.52, 0.3, math.nan]), np.array([0.05, 0.05, 0.05, 0.05])
    more = Claim("", "", "", lambda after: (value, error), more_than=0.5)
    less = Claim("", "", "", lambda after: (value, error), less_than=0.5)
    np.testing.assert_array_equal(more.verdict(value, error), [1.0, 0.0, -1.0, math.nan])
    np.testing.assert_array_equal(less.verdict(value, error), [-1.0, 0.0, 1.0, math.nan])


@pytest.mark.parametrize("parameters", PRIORS)
def test_area_of_the_region_is_that_of_its_draws(
    parameters: tuple[float, ...], rng: np.random.Generator
) -> None:
    pair = fb.NormalGamma(*parameters)
    n = 200_000
    density = pair.logpdf(*pair.rvs(n, rng))
    # the area is the mean over draws of one over their density, inside
    inside = np.where(density >= pair.credible_level(0.9), np.exp(-density), 0.0)
    assert credible_area(pair) == pytest.approx(inside.mean(), abs=4.0 * inside.std() / math.sqrt(n))


def test_prior_gives_both_precisions() -> None:
    mass, noise, counts, means = 19.5, 0.0608, (33.0, 5.0), (11.6, 32.2)
    alpha, beta = shape_and_rate_for(mass, noise, counts, means)
    prior = fb.NormalGamma(0.0, 1e-9, alpha, beta)
    for n, expected in zip(counts, means, strict=True):
        posterior = prior.update_statistics(int(n), 0.0, n * (mass * noise) ** 2 / 8.0)
        assert posterior.alpha / posterior.beta == pytest.approx(expected)
