"""Friction under a force that fluctuates, read by a sensor whose noise is correlated, is covered.

Records of a simulator of their own, under a force of a fifth of friction. Of 48 on other seeds the 90 %
interval covered 44, and the mean was off by 1.1 standard deviations rms. Of eight, an interval that means
what it says covers fewer than five once in two hundred runs; one that covers half is seen in 64 %. (A
force of a twentieth, which such a sensor hides in half of the records, is another matter: of 36 it covered
21.)
"""

from __future__ import annotations

import numpy as np

from curtailed import at_least
from friction_bayes.loop.infer.law_draws import draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from unsteady_decays import ERROR, FRICTION, SYSTEM, correlated_record, fitted


def covers(rng: np.random.Generator) -> bool:
    fit = fitted(correlated_record(rng, ERROR), ("random_force", "viscous_damping", "sensor_offset"))
    low, high = np.quantile(draw_laws(LawFit.of(fit), rng, 4000).first.friction, [0.05, 0.95])
    return bool(low <= SYSTEM.stiffness * FRICTION <= high)


def test_friction_is_covered(rng: np.random.Generator) -> None:
    assert at_least(5, (covers(rng) for _ in range(8)))
