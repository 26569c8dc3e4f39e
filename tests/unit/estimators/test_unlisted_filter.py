"""A filter that is not listed: its evidence and gain, from the noise that a listed one does not explain."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy import signal, stats

import friction_bayes as fb
from filtered_decays import SYSTEM, settled
from friction_bayes.core.arrays import Array
from friction_bayes.estimators.noise.noise_accounts import UNLISTED
from friction_bayes.estimators.noise.recording_filters import RecordingFilter, kinds_for
from friction_bayes.estimators.noise.unlisted_filter import _fitted, gains_of, likeness

ANGLE = 0.05
OMEGA = np.geomspace(0.1, 3.0, 60)
HALF_POWER = 4.0 * ANGLE


def second_order() -> RecordingFilter:
    kind = next(each for each in kinds_for(ANGLE, 0) if each.name == "low pass of order 2")
    return kind.of(HALF_POWER)


def spectrum(rng: np.random.Generator, poles: float, tapers: int) -> Array:
    """Estimates over what a listed filter lets through, of noise through one with that many poles more."""
    less = (1.0 + (OMEGA / HALF_POWER) ** 2) ** -poles
    power = less * rng.gamma(tapers, 1.0 / tapers, OMEGA.size)
    return np.asarray(power / power.mean())


def test_evidence_of_many_tapers_is_that_of_normal_logarithms(rng: np.random.Generator) -> None:
    tapers = 4000.0
    apart = np.subtract.outer(np.log(OMEGA), np.log(OMEGA))
    prior = 1.0 + 0.2 * np.exp(-0.5 * apart**2)
    seen = rng.multivariate_normal(np.zeros(OMEGA.size), prior + np.eye(OMEGA.size) / tapers)
    estimates = np.full(OMEGA.size, tapers)
    found = _fitted(prior, np.exp(seen), estimates)
    # the likelihood of a spectrum lacks the normal's constant, and has its value where the fit is perfect
    exact = stats.multivariate_normal(cov=prior + np.eye(OMEGA.size) / tapers).logpdf(seen)
    constant = 0.5 * OMEGA.size * math.log(tapers / (2.0 * math.pi)) + float(estimates @ (seen + 1.0))
    assert found.log_evidence == pytest.approx(exact - constant, abs=0.2)


def test_noise_of_the_listed_filter_is_evidence_against_another(rng: np.random.Generator) -> None:
    filter_ = second_order()
    found = [likeness(spectrum(rng, 0.0, 4), np.ones(60), OMEGA, HALF_POWER, filter_, 4) for _ in range(20)]
    for number in range(len(found[0])):
        assert np.mean([each[number].log_evidence for each in found]) < 0.0
    widest = np.array([each[-1].log_gain - math.log(filter_.gain) for each in found])
    assert np.all(np.abs(widest) < 4.0 * found[0][-1].log_gain_sd)


@pytest.mark.parametrize("poles", [-1.0, 1.0, 2.0])
def test_the_gain_of_another_filter_follows_from_its_noise(rng: np.random.Generator, poles: float) -> None:
    filter_ = second_order()
    found = likeness(spectrum(rng, poles, 4), np.ones(60), OMEGA, HALF_POWER, filter_, 4)
    assert max(each.log_evidence for each in found) > 10.0
    best = max(found, key=lambda each: each.log_evidence)
    change = -0.5 * poles * math.log1p((ANGLE / HALF_POWER) ** 2)
    assert best.log_gain - math.log(filter_.gain) == pytest.approx(change, abs=2.5 * best.log_gain_sd)
    assert best.log_gain_sd < 0.1
    shares, gains = zip(*gains_of(found), strict=True)
    assert sum(shares) == pytest.approx(1.0)
    assert list(gains) == sorted(gains)
    assert gains[-1] <= 1.0


def test_white_noise_that_came_later_says_nothing_of_the_filter(rng: np.random.Generator) -> None:
    """Where next to nothing went through it, its gain is what it may be beforehand."""
    share = np.full(60, 1e-6)
    found = likeness(spectrum(rng, 0.0, 4), share, OMEGA, HALF_POWER, second_order(), 4)
    slope = math.log1p((ANGLE / HALF_POWER) ** 2)
    assert found[-1].log_gain_sd == pytest.approx(0.5 * 2.0 * slope, rel=1e-3)
    assert abs(found[-1].log_evidence) < 1e-3


@pytest.mark.parametrize(
    ("sections", "gain"),
    [
        (signal.bessel(8, 17.0 / (2.0 * math.pi), fs=240.0, output="sos", norm="mag"), 0.889),
        (signal.butter(5, 45.0 / (2.0 * math.pi), fs=240.0, output="sos"), 1.0),
    ],
    ids=["Bessel of order 8", "order 5"],
)
def test_friction_is_not_known_better_than_the_gain_of_a_filter_of_another_kind(
    sections: Array, gain: float
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        found = fb.estimate(settled(sections, noise_sd=2.4e-5, seed=3), SYSTEM)
    filter_ = found.to_dict()["noise"]["filter"]
    assert filter_["name"] == UNLISTED
    assert filter_["gain"] == pytest.approx(gain, abs=0.1)
    assert any(each.unlisted is not None for each in found.fit.accounts)
    low, high = found.friction.interval(0.9)
    assert low < 1.0 < high < low + 0.5
