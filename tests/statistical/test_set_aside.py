"""Friction under a random force where samples are clipped or are outliers.

Records of a simulator of their own, a fifth to two fifths of their samples at a ceiling or a fiftieth of
them outliers. The standardised error of friction is normal: its mean over n records lies within 3.3 /
sqrt(n), its variance within the 0.1 and 99.9 % points of a chi-square, each but once or twice in a
thousand. With flat samples alone set aside the mean was -0.9 over 24 records without a force, with a
standard deviation of 0.6: it is seen in 97 % of runs. Forces are large enough to show: one that cannot be
seen leaves friction's interval too narrow, clipped or not.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from friction_bayes.loop.infer.law_draws import draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.record_fit import ForceFit
from unsteady_decays import FRICTION, RELEASE, SYSTEM, faulty_record, fitted

OUTLIERS = {"hit": 0.02, "far": 10.0}
CLIPPED = {"ceiling": 0.55 * RELEASE}


def fits(
    rng: np.random.Generator, count: int, *, force: float, noise: float, **faults: float
) -> list[ForceFit]:
    """Of displacements and accelerations in turn."""
    records = (
        faulty_record(rng, force=force, noise=noise, order=2 * (k % 2), **faults)[0] for k in range(count)
    )
    return [fitted(record, ("random_force", "outliers")) for record in records]


@pytest.mark.parametrize(("count", "force", "noise"), [(24, 0.0, 5e-4), (14, 0.4, 1e-4)])
@pytest.mark.parametrize("faults", [OUTLIERS, CLIPPED], ids=["outliers", "clipped"])
def test_friction_is_unbiased(
    faults: dict[str, float], count: int, force: float, noise: float, rng: np.random.Generator
) -> None:
    records = fits(rng, count, force=force, noise=noise, **faults)
    # outliers pass for something else where chance has them at some speeds or times: one record in a thousand
    assert sum(np.isinf(fit.clock.variance).any() for fit in records) >= count - 2
    z = np.array(
        [
            (drawn.mean() - SYSTEM.stiffness * FRICTION) / drawn.std()
            for drawn in (draw_laws(LawFit.of(fit), rng, 2000).first.friction for fit in records)
        ]
    )
    assert abs(z.mean()) < 3.3 / np.sqrt(z.size)
    low, high = stats.chi2.ppf([1e-3, 0.999], z.size - 1) / (z.size - 1)
    assert low < z.var(ddof=1) < high


def test_no_outliers_are_invented(rng: np.random.Generator) -> None:
    # none of 80 such records had a probability above a thousandth; invented in one of five, they show in
    # 89 % of runs
    records = fits(rng, 10, force=0.2, noise=1.4e-4)
    odds = [fit.sensor_noise.probabilities().get(frozenset({"outliers"}), 0.0) for fit in records]
    assert np.all(np.array(odds) < 0.5)
