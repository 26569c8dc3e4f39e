"""A drift of the sensor's zero along a line or a curve: its course, where a record rather has one."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.estimators.noise.behind_high_passes import likelier_high_passes
from friction_bayes.estimators.noise.coulomb_regression import (
    DRIFT,
    LEAST_SAMPLES,
    Laid,
    PlainDecay,
    PreparedDecay,
)
from friction_bayes.estimators.noise.smooth_curve import smooth_curve

__all__ = ["zero_drift"]

_MOTIONS = 4
"""Along which a drift has to be found, each halfway to that under the law of the one before: a spring that is
bent leaves along a motion on a straight one what is no drift."""


def zero_drift(decay: PlainDecay) -> Array | None:
    """A drift at each sample, shape (n,), unit of the signal; None where there is rather none.

    It is nearly orthogonal to a decay of several half cycles: taken out where it is none it costs 2 % of
    what is known of friction; left in it passes for a random force. It is so to forces within a half cycle
    too, those that have a shape, which are not evaluated. What a high pass makes of a record may look like
    a drift, and is none.
    """
    if decay.rest_known or not decay.usable:
        return None
    prepared = PreparedDecay(decay)
    if prepared.samples < LEAST_SAMPLES:
        return None
    path = prepared.along_fit()
    for _ in range(_MOTIONS):
        laid = path.with_other_forces(shapes=()).with_drift()
        probability, law = laid.best_law_with(DRIFT)
        if probability < 0.5:
            return None
        path = laid.along_law(law, 0.5)
    if _rather_coupled(prepared.along_fit(), laid):
        return None
    change = laid.unit * law[[name == DRIFT for name in laid.regression.names]]
    return np.asarray(smooth_curve(decay.time, decay.time[-1]) @ change)


def _rather_coupled(fitted: Laid, drifting: Laid) -> bool:
    """Whether a high pass rather made of the motion what looks like a drift; that of a zero alone is one."""
    found = likelier_high_passes(fitted, drifting)
    return sum(share for share, filter_, _ in found if filter_.gain != 1.0) > 0.5
