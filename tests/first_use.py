"""First use of the kernels in two shares, for the workers of a parallel run.

All workers collect, and so begin, with the same kernels. From an empty cache each would compile all of them;
with a share each, one compiles what the other loads.
"""

from __future__ import annotations

import numpy as np

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, short_decay
from friction_bayes.statespace.kalman import Clock, sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.response import force_response
from friction_bayes.statespace.smoother import first_motion

__all__ = ["use_kernels"]


def use_kernels(share: int) -> None:
    """Call what compiles share 0 (the moving part, both fits) or 1 (the integrator, the random force)."""
    record = short_decay()
    if share == 0:
        fb.estimate(record, SYSTEM, random_force="none")
        fb.estimate(record, SYSTEM, method="envelope")
        return
    short_decay(effects={"viscous_damping.damping_ratio": 0.01})
    # meanwhile the other worker compiles the moving part and the fit, which come next
    _smooth_an_oscillation()
    fb.estimate(short_decay(effects=fluctuating_friction()), SYSTEM)
    fb.estimate(record, SYSTEM, method="normal-gamma")


def _smooth_an_oscillation() -> None:
    """Call the filter, the path and its response."""
    phase = np.arange(0.0, 20.0, 0.1)
    motion = first_motion(np.cos(phase) * (1.0 - 0.02 * phase), Clock.of(phase), sensor_row(0))
    x, v = motion.states[:, :2].T.copy()
    path = MeasuredPath.through(phase, x, v, motion.velocity_sd)
    force_response(path, -path.direction[:, None])
