r"""Smooth curves: about a mean, as friction or a sensor's zero changes along a decay, and of any motion.

The latter have the density of

.. math:: y_i = A \sum_{k \le d} c_k P_k(s_i) + e_i, \quad c_k \sim N(0, 1), \quad e_i \sim N(0, \sigma^2)

with Legendre polynomials, averaged over the degree.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array, Indices

__all__ = ["CURVE_SDS", "curve_degrees", "log_density_of_curve", "smooth_curve"]

CURVE_SDS = np.array([1.0, 0.5, 0.25])
"""Prior sds of its columns over that of the first: what changes smoothly has ever less of a higher degree."""
CURVE_SDS.flags.writeable = False
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
    place: Array, signal: Array, amplitude: float, degrees: Sequence[int], jumps: Indices | None = None
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
    jumps : ndarray of int, shape (m, k), optional
        Samples from which on it may be higher and lower in turn, by one size, in m ways, all as probable.
    """
    found = []
    for degree in degrees:
        curve = amplitude * np.polynomial.legendre.legvander(place, degree)
        left, singular, _ = np.linalg.svd(curve, full_matrices=False)
        along, variance = left.T @ signal, 1.0 + singular**2
        squares = float(signal @ signal - along @ along + np.sum(along**2 / variance))
        log_volume = signal.size * math.log(2.0 * math.pi) + float(np.log(variance).sum())
        found.append(-0.5 * (log_volume + squares))
        if jumps is not None:
            known = 1.0 - 1.0 / variance
            found[-1] += _log_gain_of_jump(signal - left @ (known * along), left, known, amplitude, jumps)
    return float(logsumexp(found)) - math.log(len(found))


def _log_gain_of_jump(free: Array, curves: Array, known: Array, amplitude: float, jumps: Indices) -> float:
    """What jumps add to the log density of a signal, less what curves (n, p), each so ``known``, explain."""
    signs = (-1.0) ** np.arange(jumps.shape[1])

    def over_jumps(each: Array) -> Array:
        """Sums of rows times what the jumps have raised them by, shape (m, ...)."""
        after = np.concatenate([np.cumsum(each[::-1], axis=0)[::-1], np.zeros((1, *each.shape[1:]))])
        return np.asarray(np.tensordot(signs, after[jumps], axes=(0, 1)))

    variance = over_jumps(np.ones(free.size)) - over_jumps(curves) ** 2 @ known
    gain = over_jumps(free) ** 2 / (amplitude**-2 + variance) - np.log1p(amplitude**2 * variance)
    return float(logsumexp(0.5 * gain)) - math.log(len(jumps))
