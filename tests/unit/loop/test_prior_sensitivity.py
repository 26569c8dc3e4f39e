"""Importance weights of draws against the posterior that another prior gives."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM, slow_decay
from friction_bayes.loop.mixture.mixture import CandidateMixture, prior_sensitivity
from friction_bayes.mechanics.effects import EFFECTS

ONE = (frozenset({"viscous_damping"}),)
TWO = (frozenset[str](), frozenset({"viscous_damping"}))
ALL = len(EFFECTS)


def draws(likelihood_mean: float, likelihood_sd: float, size: int = 200_000) -> CandidateMixture:
    """Friction equal to one coefficient with a standard normal prior and a normal likelihood."""
    rng = np.random.default_rng(7)
    variance = 1.0 / (1.0 + likelihood_sd**-2)
    value = rng.normal(variance * likelihood_mean / likelihood_sd**2, np.sqrt(variance), size)
    return CandidateMixture(
        sets=ONE,
        probabilities=np.ones(1),
        candidate=np.zeros(size, dtype=int),
        friction=value,
        random_force=np.zeros(size),
        scores=value[:, None],
    )


def half_with_an_effect(size: int = 40_000) -> CandidateMixture:
    """Every other draw has an effect, next to its null, and friction that is larger by one."""
    with_one = np.arange(size) % 2
    return CandidateMixture(
        sets=TWO,
        probabilities=np.full(2, 0.5),
        candidate=with_one,
        friction=with_one.astype(float),
        random_force=np.zeros(size),
        scores=1e-9 * with_one[:, None],
    )


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_shift_is_that_of_the_other_posterior(factor: float) -> None:
    mean, sd = 0.15, 0.1
    variance = 1.0 / (1.0 + sd**-2)
    other = mean / sd**2 / (factor**-2 + sd**-2)
    expected = (other - variance * mean / sd**2) / np.sqrt(variance)
    assert prior_sensitivity(draws(mean, sd), ALL)[f"{factor:g}"] == pytest.approx(expected, abs=0.02)


def test_a_posterior_that_lies_elsewhere_is_not_reported() -> None:
    # two standard deviations of the prior, known to a tenth: a tenth of the prior pulls it half way to zero
    assert prior_sensitivity(draws(2.0, 0.1, 4000), ALL)["0.1"] is None


def test_occam_factors_count() -> None:
    """Half of the draws have an effect at its null: a prior ten times as wide leaves a tenth of these."""
    moved = prior_sensitivity(half_with_an_effect(), ALL)
    assert moved["10"] == pytest.approx((1.0 / 11.0 - 0.5) / 0.5, abs=1e-3)
    assert moved["0.1"] == pytest.approx((10.0 / 11.0 - 0.5) / 0.5, abs=1e-3)
    # one given effect of n against none: odds 1 / (2 n - 1), with half of them expected 1 / (3 n - 1)
    n = len(EFFECTS)
    odds = {
        name: 1.0 / (others * n - 1)
        for name, others in (("inclusion_halved", 3.0), ("inclusion_doubled", 1.5))
    }
    for name, factor in ((name, other * (2 * n - 1)) for name, other in odds.items()):
        assert moved[name] == pytest.approx((factor / (1.0 + factor) - 0.5) / 0.5, abs=1e-3)


@pytest.mark.parametrize("evaluated", [1, 3, ALL])
def test_the_number_expected_counts_among_the_effects_evaluated(evaluated: int) -> None:
    """With twice as many expected of N, one of n has odds 1 / (N / 2 + n - 1), before 1 / (N + n - 1)."""
    factor = (ALL + evaluated - 1) / (0.5 * ALL + evaluated - 1)
    expected = (factor / (1.0 + factor) - 0.5) / 0.5
    moved = prior_sensitivity(half_with_an_effect(), evaluated)
    assert moved["inclusion_doubled"] == pytest.approx(expected, abs=1e-3)


def test_a_report_says_it() -> None:
    damping = {"viscous_damping.damping_ratio": 0.002}
    record = slow_decay(duration=20.0, sampling_rate=100.0, effects=damping, seed=1)
    report = fb.close_loop([record], SYSTEM, seed=1)
    shifts = report.prior_sensitivity
    assert set(shifts) == {"0.1", "10", "inclusion_halved", "inclusion_doubled"}
    assert any(shift is not None and shift != 0.0 for shift in shifts.values())


def test_what_a_few_far_draws_decide_is_not_reported() -> None:
    """One draw in two thousand lies a hundred deviations off, and counts ten times as much."""
    rng = np.random.default_rng(3)
    friction, far = rng.standard_normal(4000), np.arange(4000) < 2
    some = CandidateMixture(
        sets=TWO,
        probabilities=np.full(2, 0.5),
        candidate=far.astype(int),
        friction=np.where(far, 100.0, friction),
        random_force=np.zeros(4000),
        scores=1e-9 * far[:, None],
    )
    assert prior_sensitivity(some, ALL)["0.1"] is None
    assert prior_sensitivity(some, ALL)["10"] is not None
