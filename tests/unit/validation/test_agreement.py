"""The verdict of an agreement, and when there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from friction_bayes.validation.agreement import compare


def names(verdict) -> list[str]:
    return [check.name for check in verdict.checks]


def test_judges_nothing_on_too_few_effective_draws(rng: np.random.Generator) -> None:
    slow = np.cumsum(rng.standard_normal((4, 2000)), axis=1)
    verdict = compare(stats.norm(), slow)
    assert verdict.agrees is None
    assert verdict.checks == ()
    assert "below 1000: not judged" in verdict.because


def test_says_what_is_off_and_by_how_much(rng: np.random.Generator) -> None:
    verdict = compare(stats.norm(0.2, 1.0), rng.standard_normal(10_000), ess=10_000)
    assert verdict.agrees is False
    assert verdict.failed[0].name == "mean"
    assert verdict.failed[0].z == pytest.approx(-20.0, abs=5.0)
    assert "mean: " in verdict.because


def test_levels_share_the_false_alarm_rate(rng: np.random.Generator) -> None:
    verdict = compare(stats.norm(), rng.standard_normal(5000), ess=5000, false_alarm_rate=2e-4)
    assert sum(check.level for check in verdict.checks) == pytest.approx(2e-4)
    assert verdict.agrees
    assert "false-alarm rate 0.0002" in verdict.because


@pytest.mark.parametrize(
    ("df", "expected"), [(10.0, ["mean", "sd"]), (4.5, ["mean"]), (2.5, ["mean"]), (1.5, [])]
)
def test_moments_that_do_not_exist_are_not_compared(
    rng: np.random.Generator, df: float, expected: list[str]
) -> None:
    heavy = stats.t(df)
    verdict = compare(heavy, heavy.rvs(4000, random_state=rng), ess=4000)
    assert names(verdict)[: len(expected)] == expected
    assert names(verdict)[len(expected)].startswith("P(below 5 %")


def test_two_sets_of_draws(rng: np.random.Generator) -> None:
    same = compare(rng.gamma(3.0, size=5000), rng.gamma(3.0, size=5000), ess=5000, false_alarm_rate=1e-4)
    assert same.agrees
    # the errors of both sides add
    assert same.checks[0].mcse == pytest.approx(np.sqrt(2.0 * 3.0 / 5000), rel=0.1)
    assert not compare(rng.gamma(3.0, size=5000), rng.gamma(3.5, size=5000), ess=5000).agrees


def test_a_difference_that_moments_and_quantiles_miss(rng: np.random.Generator) -> None:
    """Draws on a comb have every moment right; only the whole distribution shows it."""
    teeth = stats.norm.ppf((np.arange(40) + 0.5) / 40)
    verdict = compare(stats.norm(0.0, teeth.std()), rng.choice(teeth, 20_000), ess=20_000)
    assert "distribution" in [check.name for check in verdict.failed]


def test_refuses_draws_that_are_not_finite() -> None:
    with pytest.raises(ValueError, match="draws: entry 2000 is nan"):
        compare(stats.norm(), np.append(np.zeros(2000), np.nan), ess=2001)
