"""Releases of one machine: friction drawn anew for each is recovered, and what they share agrees."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

import friction_bayes as fb
from curtailed import at_least
from decays import SYSTEM, slow_decay
from friction_bayes.loop.checks.between_records import compared_sizes
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.law_fit import fit_law
from friction_bayes.loop.settings import SETTINGS
from loop_options import loop_options

MEAN, EFFECTS = 0.07, ["viscous_damping", "random_force"]


@pytest.mark.parametrize("spread", [0.03, 0.1])
def test_mean_and_spread_of_eight_releases(spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    frictions = MEAN * (1.0 + spread * rng.standard_normal(8))
    records = [
        slow_decay(friction=friction, duration=10.0, sampling_rate=100.0, seed=seed + k)
        for k, friction in enumerate(frictions)
    ]
    report = fb.close_loop(records, SYSTEM, seed=1, effects=EFFECTS, varying_friction=True)
    between = report.friction_between_records
    assert between is not None
    # what eight releases determine of their distribution: sd of the mean and of the logarithm of the spread
    assert abs(report.friction_after["mean"] - MEAN) < 4.0 * spread * MEAN / np.sqrt(8)
    assert np.log(between["share_of_friction"] / spread) == pytest.approx(0.0, abs=4.0 / np.sqrt(14))
    z = [
        (record["friction"]["mean"] - truth) / record["friction"]["sd"]
        for record, truth in zip(between["records"], frictions, strict=True)
    ]
    assert np.sum(np.square(z)) < 26.1, "chi-square of eight beyond its 0.1 % point"


def test_sizes_of_a_shared_effect_scatter_as_they_say(seed: int) -> None:
    """Nine pairs of one damping and a random force: false-alarm rate 0.2 %, two-sided.

    Standard deviations a third of what they should be are seen in 96 % of runs.
    """
    chi_square = []
    rng = np.random.default_rng(seed)
    for pair in range(9):
        records = [
            slow_decay(
                friction=MEAN * (1.0 + 0.05 * rng.standard_normal()),
                duration=10.0,
                sampling_rate=100.0,
                seed=seed + 2 * pair + k,
                effects={
                    "viscous_damping.damping_ratio": 3e-3,
                    "random_force.sd": 0.1 * MEAN,
                    "random_force.correlation_time": 0.3,
                },
            )
            for k in range(2)
        ]
        fit = fit_law(cut_records(records, SYSTEM), SYSTEM, loop_options(EFFECTS))
        (damping,) = compared_sizes(fit)
        chi_square.append(damping.chi_square)
    low, high = chi2.ppf([0.001, 0.999], len(chi_square))
    assert low < sum(chi_square) < high


def test_a_record_that_says_little_contradicts_nothing(seed: int) -> None:
    """Nine pairs of one damping, one record loud and short: false-alarm rate 0.1 %.

    Standard deviations a third of what they should be are seen in 96 % of runs.
    """
    chi_square = []
    for pair in range(9):
        records = [
            slow_decay(
                friction=MEAN,
                duration=duration,
                sampling_rate=100.0,
                noise_sd=noise_sd,
                seed=seed + 2 * pair + k,
                effects={"viscous_damping.damping_ratio": 0.05},
            )
            for k, (duration, noise_sd) in enumerate([(10.0, 1e-5), (3.0, 3e-3)])
        ]
        fit = fit_law(cut_records(records, SYSTEM), SYSTEM, loop_options(EFFECTS[:1]))
        (damping,) = compared_sizes(fit)
        chi_square.append(damping.chi_square)
    assert sum(chi_square) < chi2.ppf(0.999, len(chi_square))


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_equal_frictions_seldom_contradict_each_other(share: float, seed: int) -> None:
    """Twelve pairs of one friction, under a random force or none: false-alarm rate 0.3 %, at most.

    Differing frictions are as probable as not beforehand, so that evidence of 19 to 1 for them comes of one
    pair in nineteen at most where they do not differ; four and more of twelve are then one in 300.
    """
    force = {"random_force.sd": share * MEAN, "random_force.correlation_time": 0.1} if share else {}

    def agree(pair: int) -> bool:
        records = [
            slow_decay(
                friction=MEAN,
                initial_displacement=0.0147 - 0.002 * k,
                duration=10.0,
                sampling_rate=60.0,
                seed=seed + 2 * pair + k,
                effects=force,
            )
            for k in range(2)
        ]
        fit = fit_law(cut_records(records, SYSTEM), SYSTEM, loop_options(EFFECTS))
        return bool(fit.posterior.weight[:, fit.spread_of > 0.0].sum() < SETTINGS.credible_mass)

    assert at_least(9, map(agree, range(12)))
