"""First use of the kernels in two shares, for the workers of a parallel run.

All workers collect, and so begin, with the same kernels. From an empty cache each would compile all of them;
with a share each, one compiles what the other loads.
"""

from __future__ import annotations

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, short_decay

__all__ = ["use_kernels"]


def use_kernels(share: int) -> None:
    """Call what compiles share 0 (the moving part, both fits) or 1 (the integrator, the random force)."""
    record = short_decay()
    if share == 0:
        fb.estimate(record, SYSTEM, random_force="none")
        fb.estimate(record, SYSTEM, method="envelope")
        return
    short_decay(effects={"viscous_damping.damping_ratio": 0.01})
    fb.estimate(short_decay(effects=fluctuating_friction()), SYSTEM)
    fb.estimate(record, SYSTEM, method="normal-gamma")
