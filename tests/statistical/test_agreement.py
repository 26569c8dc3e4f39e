"""How often the agreement check fails what is right, and how surely it finds what is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal, stats

from friction_bayes.validation.agreement import compare
from friction_bayes.validation.mixing import bulk_ess

TAU = 4.0
STEPS = 320  # 4 ensembles of 32 walkers: effective sample size 10,000


def walkers(rng: np.random.Generator) -> np.ndarray:
    """Standard normal draws as correlated as those of a reference run, (ensembles, walkers, steps)."""
    r = (TAU - 1.0) / (TAU + 1.0)
    noise = rng.standard_normal((4, 32, STEPS))
    noise[..., 1:] *= np.sqrt(1.0 - r**2)
    return signal.lfilter([1.0], [1.0, -r], noise, axis=-1)


def test_effective_sample_size_is_ten_thousand(rng: np.random.Generator) -> None:
    found = [bulk_ess(walkers(rng)).ess for _ in range(20)]
    assert np.mean(found) == pytest.approx(10_000, rel=0.1)


def test_false_alarm_rate_is_what_it_says(rng: np.random.Generator) -> None:
    """At a stated 10 %, 150 correct closed forms; Bonferroni over dependent checks may only lower it."""
    alarms = sum(not compare(stats.norm(), walkers(rng), false_alarm_rate=0.1).agrees for _ in range(150))
    # more than 28 of 150 has a probability of 5e-4 at a rate of 10 %; none would mean a blind check
    assert 1 <= alarms <= 28


@pytest.mark.parametrize("wrong", [stats.norm(0.05, 1.0), stats.norm(-0.05, 1.0)])
def test_finds_a_mean_off_by_five_per_cent_of_the_sd(rng: np.random.Generator, wrong) -> None:
    found = sum(compare(wrong, walkers(rng)).agrees is False for _ in range(30))
    # 5 standard errors against a threshold of 3.0: power 0.97; 23 or fewer of 30 has probability 2e-5
    assert found >= 24


@pytest.mark.parametrize("wrong", [stats.norm(0.0, 1.05), stats.norm(0.0, 0.95)])
def test_finds_an_sd_off_by_five_per_cent(rng: np.random.Generator, wrong) -> None:
    found = sum(compare(wrong, walkers(rng)).agrees is False for _ in range(30))
    # about 7 standard errors
    assert found >= 29
