r"""Whether something still held the mass at the start of a record, as a hand does: by its first half cycles.

Two hypotheses explain these. The decay was free: they have the probability of the whole record under all
accounts of its residual, over that of the rest under the same. Or it was not, and whatever held the mass made
them a smooth curve,

.. math:: y_i = A \sum_{k \le d} c_k P_k(s_i) + e_i, \quad c_k \sim N(0, 1), \quad e_i \sim N(0, \sigma^2)

with Legendre polynomials up to any degree of some, :math:`A` the amplitude and :math:`\sigma` the noise of
the rest, which has to be white: a colour, or a floor, is taken from the samples, and is another one where
there are fewer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array
from friction_bayes.estimators.noise.noise_accounts import NoiseAccount, record_evidence

__all__ = ["log_odds_of_hold"]

_LOG_PRIOR_ODDS = math.log(0.1 / 0.9)
"""Of a hold a priori."""
_DEGREES = range(4, 13)
"""Of the curve over a half cycle, all as probable: below, that itself shows; above, noise is as smooth."""


def log_odds_of_hold(
    whole: Sequence[NoiseAccount], rest: Sequence[NoiseAccount], until: float, half_cycles: int
) -> float:
    """Log odds that the mass was held before a time, against free from the start.

    Parameters
    ----------
    whole, rest : sequence of NoiseAccount
        Of the record, and of what is left of it from ``until`` on; behind no filter.
    until : float
        From the first sample of the whole [s].
    half_cycles : int
        Before it.
    """
    best = max(rest, key=lambda account: account.probability)
    if best.coloured or best.weaker_above:
        return -math.inf
    all_of_it, after = record_evidence(whole), record_evidence(rest)
    first = all_of_it.time < until
    degrees = [half_cycles * each for each in _DEGREES if half_cycles * each < np.count_nonzero(first)]
    if not degrees:
        return -math.inf
    # in units of the noise, one sample more or less in the rest is worth little
    noise = after.noise
    free = all_of_it.log_density_over(noise) - after.log_density_over(noise)
    amplitude = float(np.max(np.abs(all_of_it.signal)))
    place = 2.0 * all_of_it.time[first] / until - 1.0
    held = _smooth(place, all_of_it.signal[first] / noise, amplitude / noise, degrees)
    return _LOG_PRIOR_ODDS + held - free


def _smooth(place: Array, signal: Array, amplitude: float, degrees: Sequence[int]) -> float:
    """Log density of a signal, shape (n,), as a smooth curve in white noise, all in units of the noise."""
    found = []
    for degree in degrees:
        curve = amplitude * np.polynomial.legendre.legvander(place, degree)
        left, singular, _ = np.linalg.svd(curve, full_matrices=False)
        along, variance = left.T @ signal, 1.0 + singular**2
        squares = float(signal @ signal - along @ along + np.sum(along**2 / variance))
        log_volume = signal.size * math.log(2.0 * math.pi) + float(np.log(variance).sum())
        found.append(-0.5 * (log_volume + squares))
    return float(logsumexp(found)) - math.log(len(found))
