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
from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = ["SURELY_NONE", "stray_samples"]

_SHARE = 1e-5
"""Prior share of stray samples: twice as large, it moves the limit, some five sd, by an eighth of one."""
_AROUND = 3
"""Samples on either side that show where a sample should be: one or two next to each other may be stray."""
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
    low, middle, high = _of_seven(np.pad(residual, _AROUND, mode="reflect"))
    distance = np.abs(residual - middle)
    distance = np.maximum(distance - rounded, 0.0)
    usual = max(float(np.quantile(each, _QUANTILE)) for each in (distance, np.abs(residual)))
    if not _ROUNDING * span < usual < span:
        return np.zeros(residual.size, np.bool_)
    sd = np.maximum(usual / float(ndtri(0.5 + 0.5 * _QUANTILE)), (high - low) / _MIDDLE_FOUR)
    log_odds = np.log(_SHARE * math.sqrt(2.0 * math.pi) * sd / span) + 0.5 * (distance / sd) ** 2
    return np.asarray(log_odds > 0.0)


@njit(**KERNEL)
def _of_seven(x: Array) -> tuple[Array, Array, Array]:
    """Second, fourth and fifth, in ascending order, of each sample with its three on either side."""
    n = x.size - 2 * _AROUND
    second, fourth, fifth = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        # a sorting network, so that compilers take several samples at a time
        a, g = _ordered(x[i], x[i + 6])
        c, d = _ordered(x[i + 2], x[i + 3])
        e, f = _ordered(x[i + 4], x[i + 5])
        a, c = _ordered(a, c)
        b, e = _ordered(x[i + 1], e)
        d, g = _ordered(d, g)
        a, b = _ordered(a, b)
        c, f = _ordered(c, f)
        d, e = _ordered(d, e)
        b, c = _ordered(b, c)
        e, g = _ordered(e, g)
        c, d = _ordered(c, d)
        e, f = _ordered(e, f)
        second[i], _ = _ordered(b, c)
        fourth[i], fifth[i] = _ordered(d, e)
    return second, fourth, fifth


@njit(**INNER)
def _ordered(one: float, other: float) -> tuple[float, float]:
    return (one, other) if one < other else (other, one)
