r"""Stray samples: single readings far outside the noise of those around them, as false echoes and glitches.

A sample is either one of normal noise about its neighbours, or stray and anywhere within the range of the
signal,

.. math:: p(d) = (1 - \epsilon)\, N(d; 0, \sigma^2) + \epsilon / R,

with ``d`` the residual of a fit less its median over the samples around, so that what a law lacks, which
changes as the motion does, is not stray. Its sd is that of the residual, or of the samples around, where this
is larger: behind a filter neighbours are alike but where the motion turns or begins.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtri

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.decay.running_ranks import ranks_of_seven

__all__ = ["SURELY_NONE", "stray_samples"]

_SHARE = 1e-5
"""Prior share of stray samples: twice as large, it moves the limit, some five sd, by an eighth of one."""
_MIDDLE_FOUR = 1.28
"""Mean range of the middle four of six normal values, in sd; of the second to fifth of seven 1.11."""
_QUANTILE = 0.9
"""Of distances and residuals, by which their sds are known whatever stray samples there are."""
_ROUNDING = 1e-9
"""Share of the range of the signal by which a fit without noise may be off."""
SURELY_NONE = 5.0
"""Largest residual over its sd with which none is rather stray."""


def stray_samples(residual: Array, span: float, rounded: Array | float = 0.0) -> Mask:
    """Which samples are rather stray, shape (n,).

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Of a fit, unit of the signal.
    span : float
        Range of the signal.
    rounded : ndarray, shape (n,), or float
        Distance from its neighbours at which a sample may lie without noise, as where a filter rounds a jump.
    """
    # one or two next to each other may be stray
    low, middle, high = ranks_of_seven(residual)
    distance = np.abs(residual - middle)
    distance = np.maximum(distance - rounded, 0.0)
    usual = max(float(np.quantile(each, _QUANTILE)) for each in (distance, np.abs(residual)))
    if not _ROUNDING * span < usual < span:
        return np.zeros(residual.size, np.bool_)
    sd = np.maximum(usual / float(ndtri(0.5 + 0.5 * _QUANTILE)), (high - low) / _MIDDLE_FOUR)
    log_odds = np.log(_SHARE * math.sqrt(2.0 * math.pi) * sd / span) + 0.5 * (distance / sd) ** 2
    return np.asarray(log_odds > 0.0)
