"""White or coloured noise, and the autoregression that describes it.

Above the eighth harmonic of the motion a free decay has next to no power, whatever the force law. If the
residual's spectrum is flat there, the noise is white and everything else in the residual is misfit; if it is
not, the noise is coloured and described by an autoregression.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings

__all__ = ["correlation_length", "fit_autoregression", "is_coloured", "variance_gain"]

_MOST_LAGS = 40
_SPECTRUM_SIZE = 1 << 16
_HANN_SPREAD = 1.5
"""Neighbouring ordinates of a Hann-windowed periodogram are correlated: so many count as one."""


def is_coloured(residual: Array, step: float, frequency: float) -> bool:
    """Whether the spectrum above the motion's harmonics is not flat.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    step : float
        Sampling interval [s].
    frequency : float
        Of the motion [rad/s].
    """
    n = residual.size
    limit = float(settings.SETTINGS.far * 1.4826 * np.median(np.abs(residual - np.median(residual))))
    tame = np.clip(residual - residual.mean(), -limit, limit)
    power = np.abs(np.fft.rfft(tame * np.hanning(n)))[1:-1] ** 2
    lowest = frequency * step * n / (2.0 * math.pi)
    first = int(settings.SETTINGS.quiet_harmonic * lowest)
    if power.size - first < 20 * settings.SETTINGS.bins:
        # sampled too coarsely to look above all of its harmonics: above half of them instead
        first = int(0.5 * settings.SETTINGS.quiet_harmonic * lowest)
    bands = np.array_split(power[first:], settings.SETTINGS.bins)
    size = min(band.size for band in bands)
    if size < 10:
        return False
    # medians, so that a line of interference does not count as colour
    level = np.log([np.median(band) for band in bands])
    variance = _HANN_SPREAD / (size * math.log(2.0) ** 2)
    statistic = float(np.sum((level - level.mean()) ** 2)) / variance
    flat = stats.chi2.sf(statistic, settings.SETTINGS.bins - 1) > settings.SETTINGS.noise_alarm_rate
    return not flat and float(level.max() - level.min()) > math.log(settings.SETTINGS.colour_ratio)


def fit_autoregression(residual: Array) -> Array:
    """Coefficients of an autoregression of the residual, its order by the Bayesian information criterion."""
    x = residual - residual.mean()
    n = x.size
    most = min(_MOST_LAGS, n // 20)
    lagged = np.column_stack([x[most - k - 1 : n - k - 1] for k in range(most)])
    target = x[most:]
    gram, right, square = lagged.T @ lagged, lagged.T @ target, float(target @ target)
    best, best_score = np.zeros(0), math.inf
    for order in range(1, most + 1):
        ridge = 1e-10 * np.trace(gram[:order, :order]) / order * np.eye(order)
        coefficients = np.linalg.solve(gram[:order, :order] + ridge, right[:order])
        rest = square - float(right[:order] @ coefficients)
        if rest <= 0.0:
            break
        score = target.size * math.log(rest) + order * math.log(target.size)
        if score < best_score:
            best, best_score = coefficients, score
    return best


def correlation_length(ar: Array, step: float) -> float:
    """Time after which the correlation of an autoregression has fallen below 1/e [s]; 0 for white noise."""
    if ar.size == 0:
        return 0.0
    covariance = _autocovariance(ar)
    below = np.flatnonzero(covariance < covariance[0] / math.e)
    return float(step * (below[0] if below.size else covariance.size))


def variance_gain(ar: Array) -> float:
    """Variance of an autoregression over that of its innovations; 1 for white noise."""
    return float(_autocovariance(ar)[0]) if ar.size else 1.0


def _autocovariance(ar: Array) -> Array:
    """Covariance at each lag of an autoregression whose innovations have unit variance."""
    spectrum = 1.0 / np.abs(np.fft.rfft(np.concatenate([[1.0], -ar]), _SPECTRUM_SIZE)) ** 2
    return np.asarray(np.fft.irfft(spectrum)[: _SPECTRUM_SIZE // 2])
