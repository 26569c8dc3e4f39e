"""Acceptance by the precision parameter: a threshold, and a set-up record at its false-alarm rate."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.errors import InputError
from friction_bayes.estimators.acceptance import FALSE_ALARM, SHARE, accept_by_set_up, accept_by_threshold

FLAT = NormalGamma(mu=0.0, lam=0.0, alpha=-0.5, beta=0.0)


def precision_of(samples: np.ndarray) -> object:
    return FLAT.update(samples).precision


def test_threshold_of_the_paper() -> None:
    # Table 2: 32.2 and 32.9 are accepted by a criterion of 30, 27.5 is not.
    verdicts = [
        accept_by_threshold(stats.gamma(20.0, scale=mean / 20.0), 30.0, unit="1/N2").accepted
        for mean in (32.2, 32.9, 27.5)
    ]
    assert verdicts == [True, True, False]


@pytest.mark.parametrize("threshold", [0.0, -1.0, np.nan, np.inf])
def test_threshold_must_be_positive(threshold: float) -> None:
    with pytest.raises(InputError, match="accept_precision"):
        accept_by_threshold(stats.gamma(20.0), threshold, unit="1/N2")


@pytest.mark.parametrize("size", [4, 20])
def test_few_amplitudes_as_good_are_refused_at_the_stated_rate(size: int, rng: np.random.Generator) -> None:
    records = 500
    refused = 0
    for _ in range(records):
        set_up, new = precision_of(rng.normal(0.07, 0.1, 51)), precision_of(rng.normal(0.07, 0.1, size))
        refused += not accept_by_set_up(new, set_up, unit="1/N2").accepted
    # two-sided exact interval at a false-alarm rate of 1e-4
    low, high = stats.binom(records, FALSE_ALARM).ppf([5e-5, 1.0 - 5e-5])
    assert low <= refused <= high


def test_many_amplitudes_must_reach_the_share() -> None:
    def verdict(ratio: float) -> bool:
        shape = 1e4
        set_up, new = stats.gamma(shape, scale=100.0 / shape), stats.gamma(shape, scale=ratio * 100.0 / shape)
        return accept_by_set_up(new, set_up, unit="1/m2").accepted

    assert verdict(1.01 * SHARE)
    assert not verdict(0.99 * SHARE)


def test_noisier_record_is_refused_with_the_reason(rng: np.random.Generator) -> None:
    set_up, new = precision_of(rng.normal(0.07, 0.1, 51)), precision_of(rng.normal(0.07, 0.5, 12))
    acceptance = accept_by_set_up(new, set_up, unit="1/N2")
    assert not acceptance.accepted
    assert acceptance.precision < acceptance.threshold
    assert "of the set-up record's" in acceptance.because
