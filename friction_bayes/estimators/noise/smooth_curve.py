r"""Smooth curves: about a mean, as friction or a sensor's zero changes along a decay, and of any motion.

The latter have the density of

.. math:: y_i = A \sum_{k \le d} c_k P_k(s_i) + e_i, \quad c_k \sim N(0, 1), \quad e_i \sim N(0, \sigma^2)

with Legendre polynomials, averaged over the degree; it may break at some samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array

__all__ = ["CURVE_SDS", "LOG_ODDS_NOT_FREE", "curve_degrees", "log_density_of_curve", "smooth_curve"]

CURVE_SDS = np.array([1.0, 0.5, 0.25])
"""Prior sds of its columns over that of the first: what changes smoothly has ever less of a higher degree."""
CURVE_SDS.flags.writeable = False
LOG_ODDS_NOT_FREE = math.log(0.1 / 0.9)
"""A priori, of a hold or an earlier rest in a record."""
_DEGREES = range(4, 13)
"""Of a curve over a half cycle, all as probable: below, that itself shows; above, noise is as smooth."""


def smooth_curve(place: Array, until: float) -> Array:
    """Legendre polynomials from the first degree on, halved, so that the first changes by one.

    Parameters
    ----------
    place : ndarray, shape (n,)
        Times or phases from zero on.
    until : float
        Where the decay ends.

    Returns
    -------
    ndarray, shape (n, 3)
    """
    return np.asarray(
        0.5 * np.polynomial.legendre.legvander(2.0 * place / until - 1.0, CURVE_SDS.size)[:, 1:]
    )


def curve_degrees(half_cycles: int, samples: int) -> list[int]:
    """Degrees that a curve over some half cycles may have; empty where the samples are too few."""
    return [half_cycles * each for each in _DEGREES if half_cycles * each < samples]


def log_density_of_curve(
    place: Array, signal: Array, amplitude: float, degrees: Sequence[int], breaks: int = 0
) -> float:
    """Log density of a signal as a smooth curve in white noise, all in units of the noise.

    Parameters
    ----------
    place : ndarray, shape (n,)
        Of the samples, from -1 to 1.
    signal : ndarray, shape (n,)
    amplitude : float
        Prior sd of each coefficient.
    degrees : sequence of int
        Of the curve, all as probable; zero for a constant.
    breaks : int
        Samples at which it may jump or bend, at most; all numbers of them as probable, and all samples. All
        but one of them are taken to be where they are most probable, so that the density is a lower bound.
    """
    found = [_log_density(place, signal, amplitude, degree, breaks) for degree in degrees]
    return float(logsumexp(found)) - math.log(len(found))


def _log_density(place: Array, signal: Array, amplitude: float, degree: int, breaks: int) -> float:
    """The same of one degree."""
    curve = np.polynomial.legendre.legvander(place, degree)
    log_places = math.log(2.0 * place.size)
    found = []
    for count in range(breaks + 1):
        left, singular, _ = np.linalg.svd(amplitude * curve, full_matrices=False)
        along, variance = left.T @ signal, 1.0 + singular**2
        known = 1.0 - 1.0 / variance
        squares = float(signal @ signal - known @ along**2)
        smooth = -0.5 * (signal.size * math.log(2.0 * math.pi) + float(np.log(variance).sum()) + squares)
        if count == 0:
            found.append(smooth)
        if count == breaks:
            break
        gains = _log_gains_of_breaks(place, signal - left @ (known * along), left, known, amplitude)
        found.append(smooth - count * log_places + float(logsumexp(gains)) - log_places)
        kind, sample = divmod(int(np.argmax(gains)), place.size)
        beyond = np.arange(place.size) >= sample
        curve = np.column_stack([curve, beyond * (place - place[sample] if kind else 1.0)])
    return float(logsumexp(found)) - math.log(len(found))


def _log_gains_of_breaks(place: Array, free: Array, curves: Array, known: Array, amplitude: float) -> Array:
    """What a jump at each sample, and then a bend, add to a log density, less what curves explain, (2 n,).

    Of the signal ``free`` is what curves (n, p), each so ``known``, leave.
    """

    def sums(each: Array) -> Array:
        """Of rows times each break, shape (2 n, ...)."""
        from_here, moment = (np.cumsum(rows[::-1], axis=0)[::-1] for rows in (each, (place * each.T).T))
        return np.concatenate([from_here, moment - (place * from_here.T).T])

    count, first = (np.cumsum(rows[::-1])[::-1] for rows in (np.ones_like(place), place))
    second = np.cumsum(place[::-1] ** 2)[::-1]
    squares = np.concatenate([count, second - 2.0 * place * first + place**2 * count])
    variance = np.maximum(squares - sums(curves) ** 2 @ known, 0.0)
    gain = sums(free) ** 2 / (amplitude**-2 + variance) - np.log1p(amplitude**2 * variance)
    return np.asarray(0.5 * gain)
