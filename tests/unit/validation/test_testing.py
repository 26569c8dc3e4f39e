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


@pytest.mark.parametrize("text", ["abc", "-3", "1.5", ""])
def test_a_seed_in_the_environment_is_a_whole_number(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv("FRICTION_BAYES_TEST_SEED", text)
    with pytest.raises(
        InputError, match=f"^FRICTION_BAYES_TEST_SEED: '{text}' is not a whole number; set it"
    ):
        testing.base_seed()


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
        (stats.norm(), [], r"draws: shape \(0,\) holds no numbers"),
        ([], np.ones(9), r"expected: shape \(0,\) holds no numbers; give a frozen scipy distribution"),
        (stats.norm(), np.ones((2, 2, 2, 2)), r"draws: shape \(2, 2, 2, 2\); give \(n,\)"),
        (stats.norm(), np.ones(9999), "ess: 10000 is more than the 9999 draws; leave it out"),
    ],
)
def test_what_cannot_be_compared_is_refused_by_name(expected, draws, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        testing.assert_agreement(expected, draws, ess=10_000)


def steps_of_four_chains(rng: np.random.Generator) -> np.ndarray:
    """Four chains of 5000 steps, moving averages over 20: about 1000 independent draws."""
    noise = rng.standard_normal((4, 5019)) / np.sqrt(20.0)
    return np.lib.stride_tricks.sliding_window_view(noise, 20, axis=1).sum(axis=-1)


def test_exchanged_axes_are_separated_from_many_short_chains(rng: np.random.Generator) -> None:
    chains = steps_of_four_chains(rng)
    options = {"minimum_ess": 100.0, "false_alarm_rate": RARE}
    assert testing.assert_agreement(stats.norm(), chains, **options).agrees
    for exchanged in (chains.T, chains.T[:, :, None]):
        with pytest.raises(
            InputError, match=r"draws: read as 5000 chains of .* put steps last, such as draws\.T"
        ):
            testing.assert_agreement(stats.norm(), exchanged, **options)
    # many chains at once, each of correlated steps, and steps without correlation
    many = chains.reshape(4, 500, 10)[:, ::5].reshape(400, 10)
    for right in (rng.permutation(many), rng.standard_normal((5000, 4))):
        assert testing.assert_agreement(stats.norm(), right, **options).agrees


RATES = [(0, "0 is not .*, such as 0.01"), (-1, "-1 is not"), (2, "2 is not .*: did you mean 0.02?")]


@pytest.mark.parametrize(("rate", "said"), RATES)
def test_a_false_alarm_rate_is_a_probability(rng: np.random.Generator, rate: float, said: str, seed) -> None:
    x = rng.standard_normal(4000)
    right = {"a": x, "b": x, "c": x}
    for assertion in (
        lambda: testing.assert_agreement(stats.norm(), x, false_alarm_rate=rate),
        lambda: testing.assert_calibrated(
            draw_prior, normal_data, normal_cdf(0.5), seed=seed, false_alarm_rate=rate
        ),
        lambda: testing.assert_coverage(x - 1.0, x + 1.0, 0.0, level=0.6827, false_alarm_rate=rate),
        # two of three alarms would do
        lambda: testing.assert_prior_recovered(
            right, dict.fromkeys("abc", stats.norm()), false_alarm_rate=rate
        ),
    ):
        with pytest.raises(InputError, match=f"^false_alarm_rate: {said}"):
            assertion()


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
    for options, said in (
        ({"replications": 1e4}, "replications: 10000.0 is not an integer"),
        ({"minimum_replications": 0}, "minimum_replications: 0 is below 1"),
        ({"seed": -1}, "seed: -1 is below 0; give a whole number, 0 or more"),
    ):
        with pytest.raises(InputError, match=f"^{said}"):
            testing.assert_calibrated(draw_prior, normal_data, normal_cdf(0.5), **{"seed": seed, **options})


@pytest.mark.parametrize(
    ("wrong", "said"),
    [(np.nan, "nan in replication 17 of parameter 1"), (1.5, "1.5 in replication 17 of parameter 1")],
)
def test_what_is_no_probability_is_reported_with_its_place(wrong: float, said: str, seed: int) -> None:
    def cdf(data: np.ndarray, mean: np.ndarray) -> np.ndarray:
        pit = np.column_stack([normal_cdf(0.5)(data, mean)] * 2)
        pit[17:, 1] = wrong
        return pit

    with pytest.raises(InputError, match=f"^posterior_cdf: {said}; let it return probabilities"):
        testing.assert_calibrated(draw_prior, normal_data, cdf, seed=seed)


TOO_FEW = {
    "one prior": ("draw_prior: .*: 1", lambda rng, n: rng.normal(), normal_data, normal_cdf(1.0)),
    "two priors": ("draw_prior: .*: 2", lambda rng, n: (0.1, rng.normal()), normal_data, normal_cdf(1.0)),
    "a named prior": ("draw_prior: .*: 1", lambda rng, n: {"r": 0.1}, normal_data, normal_cdf(1.0)),
    "one data set": ("simulate: .*: 5", draw_prior, lambda mean, rng: rng.normal(size=5), normal_cdf(1.0)),
    "one rank": ("posterior_cdf: .*: 1", draw_prior, normal_data, lambda data, mean: 0.5),
}


@pytest.mark.parametrize("case", TOO_FEW)
def test_a_function_that_returns_a_single_draw_is_reported_how_many(case: str, seed: int) -> None:
    said, *functions = TOO_FEW[case]
    with pytest.raises(InputError, match=f"{said}; let it accept .* all 200 draws at once"):
        testing.assert_calibrated(*functions, replications=200, seed=seed)


def test_data_sets_without_samples_are_data_sets(seed: int) -> None:
    testing.assert_calibrated(
        draw_prior,
        lambda mean, rng: np.empty((mean.size, 0)),
        lambda data, mean: stats.norm.cdf(mean, data.sum(axis=1), 0.5),
        seed=seed,
        false_alarm_rate=RARE,
    )


def fails(*given):
    raise RuntimeError("the solver diverged")


@pytest.mark.parametrize(
    ("name", "error", "functions"),
    [
        ("draw_prior", TypeError, (lambda rng: rng.normal(), normal_data, normal_cdf(1.0))),
        ("simulate", TypeError, (draw_prior, lambda mean, rng: rng.normal(float(mean)), normal_cdf(1.0))),
        ("simulate", RuntimeError, (draw_prior, fails, normal_cdf(1.0))),
        ("posterior_cdf", RuntimeError, (draw_prior, normal_data, fails)),
    ],
)
def test_an_error_of_the_caller_is_left_with_a_note(name: str, error: type, functions, seed: int) -> None:
    with pytest.raises(error) as reported:
        testing.assert_calibrated(*functions, replications=200, seed=seed)
    (note,) = reported.value.__notes__
    assert note.startswith(f"{name} is called once for all replications, here with ")
    assert f"seed {seed}; it must accept " in note
    assert "all 200 draws at once" in note


def test_a_posterior_equal_to_the_prior_passes_calibration(seed: int) -> None:
    # as docs/testing.md says; what shows it is in tests/statistical/test_calibration.py
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


@pytest.mark.parametrize(
    ("draws", "truth", "said"),
    [
        ([], 0.0, r"shape \(0,\) holds no numbers"),
        (np.zeros((3, 0)), np.zeros(3), r"shape \(3, 0\) holds no numbers"),
        (
            np.zeros((20, 3)),
            np.zeros(3),
            r"shape \(20, 3\) for a truth of shape \(3,\); put the draws of each",
        ),
        ([[0.0, np.nan]], [0.0], "entry 1 is nan"),
    ],
)
def test_ranks_want_draws_of_each_truth(rng: np.random.Generator, draws, truth, said: str) -> None:
    with pytest.raises(InputError, match=f"^draws: {said}"):
        testing.rank_pit(draws, truth, rng)


def test_coverage(rng: np.random.Generator) -> None:
    x = rng.standard_normal(4000)
    half = stats.norm.ppf(0.95)
    result = testing.assert_coverage(x - half, x + half, 0.0, level=0.9, false_alarm_rate=RARE)
    assert result.standard_error == pytest.approx(np.sqrt(0.09 / 4000))
    for factor in (0.9, 1.15):
        with pytest.raises(AssertionError, match=r"of 4000 intervals cover the truth, 0\.9 should"):
            testing.assert_coverage(x - factor * half, x + factor * half, 0.0, level=0.9)
    near = 0.965 * half
    testing.assert_coverage(x - near, x + near, 0.0, level=0.9, tolerance=0.02, false_alarm_rate=RARE)
    with pytest.raises(AssertionError, match="99 intervals are fewer"):
        testing.assert_coverage(x[:99], x[:99], 0.0, level=0.9)
    with pytest.raises(AssertionError, match="3990 intervals have no end, the first in replication 10"):
        testing.assert_coverage(np.where(np.arange(4000) < 10, x, np.nan), x, 0.0, level=0.9)


X = np.zeros(200)


@pytest.mark.parametrize(
    ("lower", "upper", "truth", "options", "said"),
    [
        (X, X, X, {"level": 90}, r"level: 90 is not a probability; .* did you mean 0\.9\?"),
        (X, X, X, {"level": -1}, r"level: -1 is not a probability; .* such as 0\.9"),
        (X, X, X, {"level": 0}, "level: 0 is not a probability"),
        (X, X, X, {"tolerance": 5}, r"tolerance: any coverage is within 5 of 0\.9; give a small share"),
        (X, X, X, {"tolerance": -0.1}, r"tolerance: -0\.1 is negative"),
        (X, X, X, {"minimum_replications": 0}, "minimum_replications: 0 is below 1"),
        (X, X[1:], X, {}, r"lower, upper, truth: shapes \(200,\), \(199,\), \(200,\); give each one number"),
        # every interval with every truth are no independent replications
        (X, X, X[:, None], {}, r"lower, upper, truth: shapes \(200,\), \(200,\), \(200, 1\)"),
        (0.0, 1.0, 0.5, {}, r"lower, upper, truth: shapes \(\), \(\), \(\)"),
        (
            X,
            X - (np.arange(200) == 7),
            X,
            {},
            "lower: entry 7 is 0, above upper, -1; give the lower ends first",
        ),
        (X, X, np.where(np.arange(200) == 7, np.nan, X), {}, "truth: entry 7 is nan"),
        ("low", X, X, {}, "lower: 'low' is not an array of real numbers"),
    ],
)
def test_coverage_of_what_are_no_intervals(lower, upper, truth, options, said: str) -> None:
    with pytest.raises(InputError, match=f"^{said}"):
        testing.assert_coverage(lower, upper, truth, **{"level": 0.9, **options})


def test_intervals_may_be_open_and_one_truth_is_for_all(rng: np.random.Generator) -> None:
    x = rng.standard_normal(4000)
    bound = x + stats.norm.ppf(0.9)
    testing.assert_coverage(-np.inf, bound, 0.0, level=0.9, false_alarm_rate=RARE)


def test_prior_recovery_catches_a_missing_jacobian(rng: np.random.Generator) -> None:
    prior = stats.gamma(3.0)
    draws = rng.gamma(3.0, size=10_000)
    testing.assert_prior_recovered({"s": draws}, {"s": prior}, ess=10_000, false_alarm_rate=RARE)
    # sampling log(s) with the density of s, its Jacobian forgotten, gives draws of gamma(2)
    with pytest.raises(AssertionError, match="prior of s not recovered: mean"):
        testing.assert_prior_recovered({"s": rng.gamma(2.0, size=10_000)}, {"s": prior}, ess=10_000)
    with pytest.raises(AssertionError, match=r"draws of \['s'\] for a prior of \['r'\]"):
        testing.assert_prior_recovered({"s": np.zeros(3)}, {"r": prior})


@pytest.mark.parametrize(
    ("draws", "prior", "said"),
    [
        ({}, {}, "draws: holds no parameter; give each parameter by its name"),
        (np.zeros(9), stats.norm(), "draws: ndarray has no names; give each parameter by its name"),
        ({"s": np.zeros(9)}, stats.norm(), "prior: rv_continuous_frozen has no names"),
        ({"s": np.zeros(9)}, {"s": "gamma"}, "prior of s: 'gamma' is not an array of real numbers"),
        ({"s": [0.0, np.inf]}, {"s": stats.norm()}, "draws of s: entry 1 is inf"),
    ],
)
def test_prior_recovery_compares_something_with_something(draws, prior, said: str) -> None:
    with pytest.raises(InputError, match=f"^{said}"):
        testing.assert_prior_recovered(draws, prior)


def test_draws_that_never_move_fail_in_a_sentence() -> None:
    with pytest.raises(AssertionError, match="standard errors of 0"):
        testing.assert_agreement(stats.norm(), np.full(2000, 0.3), ess=2000)


@pytest.mark.parametrize("expected", [0.3, [0.3], np.zeros(5)])
def test_few_numbers_are_no_distribution(expected: object, rng: np.random.Generator) -> None:
    """Next to so few a sampler that is a third too narrow passes."""
    with pytest.raises(InputError, match=r"expected: (5 draws|one number); give 1000 independent draws or"):
        testing.assert_agreement(expected, 0.7 * rng.standard_normal(5000), ess=5000)


def test_a_probability_may_be_rounded_beyond_one(rng: np.random.Generator) -> None:
    pit = rng.random(2000)
    pit[7] = 1.0 + 2e-16
    assert uniformity(pit, false_alarm_rate=RARE).calibrated
    pit[7] = 1.001
    with pytest.raises(InputError, match="in replication 7"):
        uniformity(pit)
