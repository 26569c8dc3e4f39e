"""Eqs. (4)-(8): by hand, by brute force, and where offsets would eat the digits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from friction_bayes.conjugate.credible import credible_interval
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.errors import InputError

PRIOR = NormalGamma(mu=0.1, lam=0.5, alpha=1.5, beta=0.02)
SAMPLES = np.array([0.05, 0.09, 0.02, 0.11])


def test_update_by_hand() -> None:
    # n = 4, mean = 0.0675, centred squares = 0.004875
    after = PRIOR.update(SAMPLES)
    assert after.mu == pytest.approx((0.5 * 0.1 + 0.27) / 4.5, rel=1e-14)
    assert (after.lam, after.alpha) == (4.5, 3.5)
    expected = 0.02 + 0.004875 / 2.0 + 4 * 0.5 / 4.5 * 0.0325**2 / 2.0
    assert after.beta == pytest.approx(expected, rel=1e-14)


def test_update_takes_any_shape_and_nothing() -> None:
    flat = PRIOR.update(SAMPLES)
    assert PRIOR.update(SAMPLES.reshape(2, 2)) == flat
    assert PRIOR.update([]) == PRIOR
    assert PRIOR.update(0.05).lam == 1.5


def test_statistics_equal_samples() -> None:
    centred = SAMPLES - SAMPLES.mean()
    after = PRIOR.update_statistics(4, SAMPLES.mean(), centred @ centred)
    assert after.beta == pytest.approx(PRIOR.update(SAMPLES).beta, rel=1e-14)
    with pytest.raises(InputError, match=r"n: 2\.5 is not a whole number"):
        PRIOR.update_statistics(2.5, 0.0, 0.0)  # type: ignore[arg-type]


def test_posterior_against_brute_force() -> None:
    """Prior times likelihood on a grid gives the same density, marginal moments and evidence."""
    after = PRIOR.update(SAMPLES)

    def joint(r: np.ndarray, s: np.ndarray) -> np.ndarray:
        likelihood = stats.norm.logpdf(SAMPLES[:, None, None], r, s**-0.5).sum(axis=0)
        return np.exp(PRIOR.logpdf(r, s) + likelihood)

    # trapezoidal rule in log(s) and in r scaled by the width it has at that s
    log_s, z = np.linspace(-5.0, 9.0, 400)[:, None], np.linspace(-12.0, 12.0, 200)
    s = np.exp(log_s)
    r = after.mu + z / np.sqrt(4.5 * s)

    def integral(values: np.ndarray) -> float:
        return float(np.trapezoid(np.trapezoid(values, z) * np.sqrt(s[:, 0] / 4.5), log_s[:, 0]))

    density = joint(r, s)
    evidence = integral(density)
    assert PRIOR.log_evidence(SAMPLES) == pytest.approx(math.log(evidence), abs=1e-10)
    assert after.friction.mean() == pytest.approx(integral(r * density) / evidence, rel=1e-10)
    assert after.precision.mean() == pytest.approx(integral(s * density) / evidence, rel=1e-10)
    assert after.logpdf(r, s) == pytest.approx(np.log(density / evidence), abs=1e-9)


def test_marginals_are_those_of_the_joint_density() -> None:
    at_r, at_s = 0.13, 90.0
    s = np.linspace(0.0, 1500.0, 400_001)[1:]
    r = np.linspace(-3.0, 3.0, 200_001)
    assert np.trapezoid(np.exp(PRIOR.logpdf(at_r, s)), s) == pytest.approx(PRIOR.friction.pdf(at_r), rel=1e-7)
    assert np.trapezoid(np.exp(PRIOR.logpdf(r, at_s)), r) == pytest.approx(
        PRIOR.precision.pdf(at_s), rel=1e-7
    )
    assert PRIOR.precision.mean() == pytest.approx(1.5 / 0.02)
    assert PRIOR.precision.var() == pytest.approx(1.5 / 0.02**2)


def test_density_is_zero_at_no_precision() -> None:
    assert np.all(PRIOR.logpdf(0.1, [0.0, -1.0]) == -np.inf)


def test_an_offset_of_1e8_costs_no_digits() -> None:
    """Samples at 1e8 + (0, 1, ..., 9) scatter as 0 ... 9 do; the subtractive form of Eq. (8) loses this."""
    steps = np.arange(10.0)
    low = NormalGamma(4.0, 2.0, 1.0, 3.0).update(steps)
    high = NormalGamma(1e8 + 4.0, 2.0, 1.0, 3.0).update(1e8 + steps)
    assert high.beta == pytest.approx(low.beta, rel=1e-13)
    squares = np.sum((1e8 + steps) ** 2) + 2.0 * (1e8 + 4.0) ** 2
    subtractive = 3.0 + 0.5 * (squares - 12.0 * high.mu**2)
    assert subtractive != pytest.approx(low.beta, rel=1e-2)


def test_evidence_by_the_chain_rule() -> None:
    together = PRIOR.log_evidence(SAMPLES)
    apart = PRIOR.log_evidence(SAMPLES[:1]) + PRIOR.update(SAMPLES[:1]).log_evidence(SAMPLES[1:])
    assert together == pytest.approx(apart, abs=1e-12)
    assert PRIOR.log_evidence([0.03]) == pytest.approx(PRIOR.predictive().logpdf(0.03), abs=1e-12)


def test_predictive_of_a_mean_is_narrower() -> None:
    one, four = PRIOR.predictive(), PRIOR.predictive(4)
    assert one.kwds["scale"] ** 2 == pytest.approx(0.02 / 1.5 * (1.0 + 1.0 / 0.5))
    assert four.kwds["scale"] ** 2 == pytest.approx(0.02 / 1.5 * (0.25 + 1.0 / 0.5))


def test_draws_follow_both_marginals(rng: np.random.Generator) -> None:
    # two tests at 1e-4 each
    r, s = PRIOR.rvs(20_000, rng)
    assert stats.kstest(r, PRIOR.friction.cdf).pvalue > 1e-4
    assert stats.kstest(s, PRIOR.precision.cdf).pvalue > 1e-4
    assert abs(np.corrcoef(np.abs(r - 0.1), s)[0, 1]) > 0.1


@pytest.mark.parametrize("alpha", [0.1, 0.5, 0.7, 3.0, 200.0])
@pytest.mark.parametrize("p", [0.1, 0.9, 0.99])
def test_credible_region_holds_its_mass(alpha: float, p: float) -> None:
    """Mass by an independent route: quadrature over the precision on a logarithmic grid."""
    pair = NormalGamma(2.0, 3.0, alpha, 0.7)
    level = pair.credible_level(p)
    log_s = np.linspace(stats.loggamma.ppf(1e-14, alpha), stats.loggamma.isf(1e-14, alpha), 400_001)
    s = np.exp(log_s) / 0.7
    height = pair.logpdf(2.0, s) - level
    given_s = 2.0 * stats.norm.cdf(np.sqrt(2.0 * np.maximum(height, 0.0))) - 1.0
    mass = np.trapezoid(given_s * s * pair.precision.pdf(s), log_s)
    assert mass == pytest.approx(p, abs=1e-6)


def test_credible_region_of_much_data_is_an_ellipse() -> None:
    # of a bivariate normal the level lies log(1 - p) below the top
    pair = NormalGamma(0.0, 1.0, 1e8, 1e8)
    assert pair.credible_level(0.9) - pair.credible_level(0.5) == pytest.approx(math.log(0.1 / 0.5), abs=1e-6)


@pytest.mark.parametrize("alpha", [0.4, 1.0, 1.2, 8.0])
def test_highest_density_is_the_shortest(alpha: float) -> None:
    pair = NormalGamma(0.0, 1.0, alpha, 2.0)
    low, high = pair.precision_interval(0.9, "highest-density")
    assert pair.precision.cdf(high) - pair.precision.cdf(low) == pytest.approx(0.9, abs=1e-9)
    tails = np.linspace(0.0, 0.1, 200)
    widths = pair.precision.isf(0.1 - tails) - pair.precision.ppf(tails)
    assert high - low <= widths.min() * (1.0 + 1e-9)
    assert pair.precision_interval(0.9) == pytest.approx(pair.precision.interval(0.9))


def test_friction_interval_is_equal_tailed() -> None:
    assert PRIOR.friction_interval(0.8) == pytest.approx(PRIOR.friction.interval(0.8))
    with pytest.raises(InputError, match="unknown interval 'both'"):
        credible_interval(PRIOR.friction, 0.9, "both")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="p: 1 is not a probability"):
        PRIOR.friction_interval(1.0)


def test_flat_prior_updates_but_is_no_distribution(rng: np.random.Generator) -> None:
    flat = NormalGamma(0.0, 0.0, -0.5, 0.0)
    after = flat.update(SAMPLES)
    # the classical answer: t with n - 1 degrees of freedom about the mean
    assert after.friction.kwds["df"] == 3.0
    assert after.friction.mean() == pytest.approx(SAMPLES.mean())
    assert after.friction.kwds["scale"] == pytest.approx(stats.sem(SAMPLES))
    for refused in (
        lambda: flat.friction,
        lambda: flat.precision,
        lambda: flat.logpdf(0.0, 1.0),
        lambda: flat.log_evidence(SAMPLES),
        lambda: flat.rvs(3, rng),
        lambda: flat.credible_level(0.9),
        lambda: flat.predictive(),
        lambda: flat.update([0.1, 0.1]).friction,
    ):
        with pytest.raises(InputError, match="is improper and has no"):
            refused()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"lam": -1.0}, "lam: -1 is negative"),
        ({"beta": -1e-3}, "beta: -0.001 is negative"),
        ({"mu": math.nan}, "mu: nan is not finite"),
        ({"alpha": math.inf}, "alpha: inf is not finite"),
    ],
)
def test_bad_parameters_are_named(changed: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        NormalGamma(**{"mu": 0.0, "lam": 1.0, "alpha": 1.0, "beta": 1.0, **changed})


def test_bad_samples_are_named() -> None:
    with pytest.raises(InputError, match="samples: entry 1 is nan"):
        PRIOR.update([0.1, math.nan])
    with pytest.raises(InputError, match=r"samples: .*'a'.* is not an array of real numbers"):
        PRIOR.update(["a"])  # type: ignore[list-item]
