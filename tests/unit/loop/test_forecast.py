"""The rest of a record forecast from its first part."""

from __future__ import annotations

import numpy as np
import pytest

from decays import SYSTEM, slow_decay
from friction_bayes.loop.checks.forecast import forecast
from unsteady_decays import fitted


@pytest.mark.parametrize(
    "effects",
    [
        {"stiffness_drift.relative_change": 0.005},
        {"friction_drift.relative_change": -0.3, "asymmetric_friction.asymmetry": 0.1},
    ],
)
def test_what_drifts_goes_on_while_all_else_stays(effects: dict[str, float], seed: int) -> None:
    """Of a noise at which a friction, or a friction over the stiffness, of 1 % more would be seen."""
    record = slow_decay(friction=0.07, noise_sd=5e-7, seed=seed, effects=effects)
    names = tuple(name.split(".")[0] for name in effects)
    predicted = forecast(fitted(record, names, SYSTEM), names, np.random.default_rng(seed))
    assert predicted is not None
    z = (predicted.signal - predicted.mean) / predicted.sd
    assert np.sqrt(np.mean(z**2)) < 2.0
