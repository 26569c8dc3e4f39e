"""First use of the kernels in two shares, for the workers of a parallel run.

All workers collect, and so begin, with the same kernels. From an empty cache each would compile all of them;
with a share each, one compiles what the other loads.
"""

from __future__ import annotations

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, short_decay
from friction_bayes.estimators.random_force.plain_law import PlainDecay, plain_posterior

__all__ = ["use_kernels"]


def use_kernels(share: int) -> None:
    """Call what compiles share 0 (the moving part, both fits) or 1 (the integrator, the random force)."""
    record = short_decay()
    if share == 0:
        fb.estimate(record, SYSTEM, random_force="none")
        fb.estimate(record, SYSTEM, method="envelope")
        return
    short_decay(effects={"viscous_damping.damping_ratio": 0.01})
    short_decay(effects=fluctuating_friction())
    plain_posterior(
        PlainDecay(
            values=record.values,
            time=record["time"].values,
            order=0,
            frequency=SYSTEM.natural_frequency,
            coefficient=0.5 / SYSTEM.stiffness,
            rest_position=0.0,
            noise_sd=1e-4,
        )
    )
    fb.estimate(record, SYSTEM, method="normal-gamma")
