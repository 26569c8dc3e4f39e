"""Friction beside a force where samples are clipped or are outliers.

Records of a simulator of their own, a fifth to two fifths of their samples at a ceiling or a fiftieth of
them outliers. The standardised error of friction is normal: its mean over n records lies within
3.3 / sqrt(n), its variance within the 0.1 and 99.9 % points of a chi-square, each but once or twice in a
thousand. With flat samples alone set aside the mean was -1.4 over the 30 records that were tried at the noise
used here. Forces are large enough to show: one that cannot be seen leaves friction's interval too narrow,
clipped or not.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import friction_bayes as fb
from fluctuating_force import fluctuating_decay
from friction_bayes.loop.random_force.draws import law_draws
from friction_bayes.loop.random_force.fit import ForceFit, fit_random_force
from friction_bayes.loop.segment import cut_records

SYSTEM = fb.Oscillator(mass=1.0, stiffness=100.0)
STEP, RELEASE, FRICTION = 0.01, 0.02, 0.0002
CEILING = 0.55 * RELEASE
RECORDS = 30


def fits(
    rng: np.random.Generator, *, force: float, noise: float, hit: float, clipped: bool
) -> list[ForceFit]:
    found = []
    for k in range(RECORDS):
        order = 2 * (k % 2)
        unit = 10.0**order
        motion = fluctuating_decay(
            rng,
            frequency=10.0,
            friction=FRICTION,
            release=RELEASE,
            step=STEP,
            samples=1500,
            force_sd=force * FRICTION,
            correlation_time=0.1,
        )[order]
        far = rng.random(motion.size) < hit
        values = motion + unit * noise * np.where(far, 10.0, 1.0) * rng.standard_normal(motion.size)
        if clipped:
            values = np.clip(values, -CEILING * unit, CEILING * unit)
        record = fb.make_record(
            STEP * np.arange(motion.size), values, ("displacement", "velocity", "acceleration")[order]
        )
        (segment,) = cut_records([record], SYSTEM)
        fit = fit_random_force(segment, SYSTEM, ("random_force", "outliers"))
        assert fit is not None
        found.append(fit)
    return found


@pytest.mark.parametrize(("force", "noise"), [(0.0, 5e-4), (0.4, 1e-4)])
@pytest.mark.parametrize("fault", ["outliers", "clipped"])
def test_friction_is_unbiased(fault: str, force: float, noise: float, rng: np.random.Generator) -> None:
    hit, clipped = (0.02, False) if fault == "outliers" else (0.0, True)
    records = fits(rng, force=force, noise=noise, hit=hit, clipped=clipped)
    # outliers pass for something else where chance has them at some speeds or times: one record in a thousand
    assert sum(np.isinf(fit.clock.variance).any() for fit in records) >= RECORDS - 2
    z = np.array(
        [
            (drawn.mean() - 100.0 * FRICTION) / drawn.std()
            for drawn in (law_draws(fit, rng, 2000).friction for fit in records)
        ]
    )
    assert abs(z.mean()) < 3.3 / np.sqrt(z.size)
    low, high = stats.chi2.ppf([1e-3, 0.999], z.size - 1) / (z.size - 1)
    assert low < z.var(ddof=1) < high


def test_no_outliers_are_invented(rng: np.random.Generator) -> None:
    # none of 80 such records had a probability above a thousandth
    records = fits(rng, force=0.2, noise=2e-4, hit=0.0, clipped=False)
    odds = [fit.sensor_noise.probabilities.get(frozenset({"outliers"}), 0.0) for fit in records]
    assert np.sum(np.array(odds) > 0.5) <= 1
