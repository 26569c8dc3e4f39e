"""Periods at the start of a record in which something still drove the motion and no amplitude was lost.

A free decay loses amplitude from its first period on. Where the amplitudes of the first periods stay or grow,
on average, and those that follow fall by more than their scatter leaves to chance, the decay begins between.
The scatter is that of the later losses about a constant and a part in proportion to the amplitude, so that
no law of friction enters.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.decay.demodulation import demodulate
from friction_bayes.decay.linear_least_squares import add_sample, regression

__all__ = ["driven_half_cycles"]

_FEWEST_DRIVEN, _FEWEST_FREE = 2, 4
"""Periods that have to tell of either."""
_MOST_COMPARED = 60
_FALSE_ALARM = 1e-3
"""Probability of a cut, at most, in a free decay whose losses scatter normally, over all its places."""
_POINTS = 60
_LIMITS: Array = np.asarray(
    stats.t.isf(
        _FALSE_ALARM / np.arange(1, _POINTS + 1)[None, :],
        np.maximum(np.arange(_MOST_COMPARED + 1) - 2, 1)[:, None],
    )
)
"""Of a difference over its standard error, by the periods compared and the places looked at."""
_NO_LOSS = 2.0
"""Standard errors within which the loss of the driven part is none."""


@njit(cache=True, nogil=True)
def driven_half_cycles(y: Array, omega: float) -> int:
    """How many half cycles from the start are to be left out; zero where nothing shows.

    Parameters
    ----------
    y : ndarray, shape (n,)
        The moving samples about their rest position.
    omega : float
        Rough angular frequency [rad/sample].
    """
    _, inphase, quadrature, _ = demodulate(y, omega)
    # windows of one period lie half a period apart: every other one has samples of its own
    periods = (inphase.size - 1) // 2
    amplitude = np.zeros(periods + 1)
    for k in range(periods + 1):
        amplitude[k] = math.hypot(inphase[2 * k], quadrature[2 * k])
    places = periods - _FEWEST_DRIVEN - _FEWEST_FREE + 1
    most, cut = 0.0, 0
    for k in range(_FEWEST_DRIVEN, periods - _FEWEST_FREE + 1):
        after = min(periods - k, _MOST_COMPARED)
        matrix, right, square, basis = np.zeros((2, 2)), np.zeros(2), 0.0, np.ones(2)
        for j in range(k, k + after):
            lost = amplitude[j] - amplitude[j + 1]
            basis[1] = amplitude[j] / amplitude[0] - 1.0
            add_sample(matrix, right, basis, lost, 1.0)
            square += lost * lost
        _, rest = regression(matrix, right, square)
        if not rest < math.inf:
            continue
        sd = math.sqrt(max(rest, 0.0) / (after - 2))
        before = (amplitude[0] - amplitude[k]) / k
        later = (amplitude[k] - amplitude[k + after]) / after
        if before > _NO_LOSS * sd / math.sqrt(k):
            continue
        apart = (later - before) / max(sd * math.sqrt(1.0 / k + 1.0 / after), 1e-300)
        if apart > max(most, _LIMITS[after, min(places, _POINTS) - 1]):
            most, cut = apart, k
    # the window that ends the driven part may reach into it
    return 2 * cut + 1 if cut > 0 else 0
