"""Each assertion passes what is right and fails a planted bug, with the figures in the message."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from friction_bayes import testing
from friction_bayes.core.errors import InputError
from friction_bayes.validation.calibration import rank_pit, uniformity

RARE = 1e-4
"""False-alarm rate of the assertions that must hold: the suite is also run over many seeds."""


def normal_data(mean: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return rng.normal(mean[:, None], 1.0, (mean.size, 5))


def normal_cdf(prior_sd: float):
    """Posterior distribution function of a normal mean after five observations of unit sd."""

    def cdf(data: np.ndarray, mean: np.ndarray) -> np.ndarray:
        precision = 1.0 / prior_sd**2 + 5.0
        return stats.norm.cdf(mean, data.sum(axis=1) / precision, precision**-0.5)

    return cdf


def draw_prior(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.normal(0.0, 0.5, n)


def test_seed_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRICTION_BAYES_TEST_SEED", "7")
    assert testing.base_seed() == 7
    monkeypatch.delenv("FRICTION_BAYES_TEST_SEED")
    assert testing.base_seed() == 20261121


@pytest.mark.parametrize(
    ("expected", "options"),
    [
        (stats.gamma(3.0), {}),
        (lambda x: x**2 * np.exp(-x), {"support": (0.0, np.inf)}),
        (stats.gamma(3.0).cdf, {"kind": "cdf"}),
        (stats.gamma(3.0).rvs(20_000, random_state=np.random.default_rng(1)), {}),
    ],
)
def test_agreement_of_every_kind_of_expectation(rng: np.random.Generator, expected, options) -> None:
    draws = rng.gamma(3.0, size=10_000)
    assert testing.assert_agreement(expected, draws, ess=10_000, false_alarm_rate=RARE, **options).agrees
    with pytest.raises(AssertionError, match="standard errors"):
        testing.assert_agreement(expected, draws * 1.1, ess=10_000, **options)


def test_agreement_looks_at_the_effective_sample_size_first(rng: np.random.Generator) -> None:
    with pytest.raises(AssertionError, match="effective sample size 500 is below 1000"):
        testing.assert_agreement(stats.norm(), rng.standard_normal(500), ess=500)


def test_agreement_is_two_sided(rng: np.random.Generator) -> None:
    draws = rng.standard_normal(10_000)
    for shift in (-0.1, 0.1):
        with pytest.raises(AssertionError, match="mean"):
            testing.assert_agreement(stats.norm(shift, 1.0), draws, ess=10_000)
    for factor in (0.9, 1.1):
        with pytest.raises(AssertionError, match="sd"):
            testing.assert_agreement(stats.norm(0.0, factor), draws, ess=10_000)


@pytest.mark.parametrize(
    ("expected", "draws", "said"),
    [
        (
            "beta",
            np.ones(9),
            "expected: 'beta' is not an array of real numbers; give a frozen scipy distribution",
        ),
        (None, np.ones(9), "expected: .* independent draws"),
        (stats.beta, np.ones(9), r"expected: beta has no parameters; freeze it: stats.beta\(a, b\)"),
        (stats.poisson(3.0), np.ones(9), "expected: poisson is discrete"),
        (stats.norm(), "draws", "draws: 'draws' is not an array of real numbers"),
        (stats.norm(), [1.0, np.nan], "draws: entry 1 is nan"),
    ],
)
def test_what_cannot_be_compared_is_refused_by_name(expected, draws, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        testing.assert_agreement(expected, draws, ess=10_000)


def test_results_show_themselves_in_a_line(rng: np.random.Generator) -> None:
    agreement = testing.assert_agreement(
        stats.norm(), rng.standard_normal(5000), ess=5000, false_alarm_rate=RARE
    )
    for result in (agreement, uniformity(rng.random(5000), false_alarm_rate=RARE)):
        assert len(repr(result)) < 200


def test_calibration_catches_a_prior_twice_too_narrow(seed: int) -> None:
    right = normal_cdf(0.5)
    assert testing.assert_calibrated(
        draw_prior, normal_data, right, seed=seed, false_alarm_rate=RARE
    ).calibrated
    with pytest.raises(AssertionError, match=f"seed {seed}.*spread"):
        testing.assert_calibrated(draw_prior, normal_data, normal_cdf(0.25), seed=seed)


def test_calibration_wants_replications(seed: int) -> None:
    with pytest.raises(AssertionError, match="50 replications are fewer than 100"):
        testing.assert_calibrated(draw_prior, normal_data, normal_cdf(0.5), replications=50, seed=seed)
    with pytest.raises(ValueError, match="not a number"):
        testing.assert_calibrated(
            draw_prior, normal_data, lambda data, mean: np.full(mean.shape, np.nan), seed=seed
        )


ONE_AT_A_TIME = {
    "draw_prior": (lambda rng: rng.normal(), normal_data, normal_cdf(1.0)),
    "simulate": (draw_prior, lambda mean, rng: rng.normal(float(mean), 1.0, 5), normal_cdf(1.0)),
    "posterior_cdf": (draw_prior, normal_data, lambda data, mean: 0.5),
}


@pytest.mark.parametrize("name", ONE_AT_A_TIME)
def test_a_function_of_one_draw_at_a_time_is_told_what_to_accept(name: str, seed: int) -> None:
    with pytest.raises(InputError, match=f"^{name}: .*all 200 draws at once") as told:
        testing.assert_calibrated(*ONE_AT_A_TIME[name], replications=200, seed=seed)
    assert "given" in str(told.value) or "returned shape ()" in str(told.value)


def test_a_posterior_equal_to_the_prior_passes_calibration(seed: int) -> None:
    # as docs/testing.md says: what is missing shows in the width alone
    assert testing.assert_calibrated(
        lambda rng, n: rng.normal(0.0, 1.0, n),
        normal_data,
        lambda data, mean: stats.norm.cdf(mean),
        seed=seed,
        false_alarm_rate=RARE,
    ).calibrated


def test_calibration_of_several_parameters_names_the_one_that_is_off(rng: np.random.Generator) -> None:
    pit = rng.random((5000, 3))
    assert uniformity(pit, false_alarm_rate=RARE).calibrated
    pit[:, 1] = pit[:, 1] ** 1.1
    assert {check.name for check in uniformity(pit).failed} == {
        "mean of parameter 1",
        "distribution of parameter 1",
    }


def test_ranks_among_draws_are_uniform(rng: np.random.Generator) -> None:
    draws, truth = rng.standard_normal((5000, 20)), rng.standard_normal(5000)
    assert uniformity(rank_pit(draws, truth, rng), false_alarm_rate=RARE).calibrated
    assert not uniformity(rank_pit(0.8 * draws, truth, rng)).calibrated


def test_coverage(rng: np.random.Generator) -> None:
    x = rng.standard_normal(4000)
    half = stats.norm.ppf(0.95)
    result = testing.assert_coverage(x - half, x + half, 0.0, level=0.9, false_alarm_rate=RARE)
    assert result.standard_error == pytest.approx(np.sqrt(0.09 / 4000))
    for factor in (0.9, 1.15):
        with pytest.raises(AssertionError, match=r"of 4000 intervals hold the truth, 0\.9 should"):
            testing.assert_coverage(x - factor * half, x + factor * half, 0.0, level=0.9)
    near = 0.965 * half
    testing.assert_coverage(x - near, x + near, 0.0, level=0.9, tolerance=0.02, false_alarm_rate=RARE)
    with pytest.raises(AssertionError, match="99 intervals are fewer"):
        testing.assert_coverage(x[:99], x[:99], 0.0, level=0.9)
    with pytest.raises(AssertionError, match="4000 intervals have no end"):
        testing.assert_coverage(x * np.nan, x, 0.0, level=0.9)


def test_prior_recovery_catches_a_missing_jacobian(rng: np.random.Generator) -> None:
    prior = stats.gamma(3.0)
    draws = rng.gamma(3.0, size=10_000)
    testing.assert_prior_recovered({"s": draws}, {"s": prior}, ess=10_000, false_alarm_rate=RARE)
    # sampling log(s) with the density of s, its Jacobian forgotten, gives draws of gamma(2)
    with pytest.raises(AssertionError, match="prior of s not recovered: mean"):
        testing.assert_prior_recovered({"s": rng.gamma(2.0, size=10_000)}, {"s": prior}, ess=10_000)
    with pytest.raises(AssertionError, match=r"draws of \['s'\] beside a prior of \['r'\]"):
        testing.assert_prior_recovered({"s": np.zeros(3)}, {"r": prior})
