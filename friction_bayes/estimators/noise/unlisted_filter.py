r"""A filter that is not listed: the power of one that is, times a smooth factor.

.. math:: \log |H(\omega)|^2 = \log |H_k(\omega)|^2 + s(\omega) f(\omega), \qquad
          s = \log(1 + \omega^2 / \omega_k^2)

``H_k`` is a listed low pass that lets half the power through at ``omega_k``, ``f`` a Gaussian process of the
logarithm of the frequency. All low passes leave slow motions as they are, and differ most where they let
least through, whence ``s``, what one of first order takes; at the motion's own
frequency the factor follows from the noise above it, as far as it is smooth.

Estimates of spectra have Gamma distributions; the evidence is by Laplace's approximation (Rasmussen and
Williams, Gaussian Processes for Machine Learning, 2006, algorithm 3.1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import digamma, softmax

from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.arrays import Array
from friction_bayes.estimators.noise.recording_filters import RecordingFilter

__all__ = ["Likeness", "gains_of", "likeness"]

_SD = (0.25, 0.5, 1.0, 2.0)
"""Equally probable standard deviations of the process: one is a first-order low pass more, or less."""
_OCTAVES = 1.0
"""Over which it is smooth."""
_BIN = 0.125
"""Octaves within which estimates are averaged."""
_LEVEL_SD = 1.0
"""Of the logarithm of the noise's level, beforehand."""
_GAINS = 7
"""How many of a distribution are evaluated."""
_DONE = 1e-3
"""Change of the log density with which the iteration ends, and its least step."""


class Likeness(NamedTuple):
    """How an unlisted filter is like one that is listed.

    Attributes
    ----------
    log_evidence : float
        Of an unlisted filter over the listed one.
    log_gain : float
        Mean of the logarithm of its gain at the motion's frequency.
    log_gain_sd : float
    """

    log_evidence: float
    log_gain: float
    log_gain_sd: float


def gains_of(unlisted: Sequence[Likeness]) -> list[tuple[float, float]]:
    """Gains of filters with their probabilities; a low pass has none above one."""
    shares = softmax([each.log_evidence for each in unlisted])
    gains = Mixture.of_normals(
        shares,
        np.array([each.log_gain for each in unlisted]),
        np.array([each.log_gain_sd for each in unlisted]),
    )
    places = (np.arange(_GAINS) + 0.5) / _GAINS
    found, count = np.unique(np.minimum(np.exp(gains.ppf(places)), 1.0), return_counts=True)
    return [(int(many) / _GAINS, float(gain)) for gain, many in zip(found, count, strict=True)]


def likeness(
    power: Array, share: Array, omega: Array, half_power: float, filter_: RecordingFilter, tapers: int
) -> list[Likeness]:
    """Filters of unlisted kinds that resemble a listed one, for each sd of the process.

    Parameters
    ----------
    power : ndarray, shape (m,)
        Spectral estimates over what is expected behind the listed filter.
    share : ndarray, shape (m,)
        Of what is expected the share that went through the filter; the rest came later.
    omega : ndarray, shape (m,)
        Frequencies of the estimates [rad/sample].
    half_power : float
        Frequency at which the listed filter lets half the power through [rad/sample].
    filter_ : RecordingFilter
        That one.
    tapers : int
        Estimates averaged in each.

    Returns
    -------
    list of Likeness
        From the least sd to the largest.
    """
    bins = np.unique(np.round(np.log(omega) / (_BIN * math.log(2.0))), return_inverse=True)[1]
    count = np.bincount(bins).astype(np.float64)
    power, share, omega = (np.bincount(bins, each) / count for each in (power, share, omega))
    places = np.append(omega, filter_.angle)
    slope = np.log1p((places / half_power) ** 2) * np.append(share, 1.0)
    apart = np.subtract.outer(np.log(places), np.log(places)) / (_OCTAVES * math.log(2.0))
    process = np.outer(slope, slope) * np.exp(-0.5 * apart**2)
    level = np.full((omega.size, omega.size), _LEVEL_SD**2)
    listed = _fitted(level, power, tapers * count)
    found = []
    for sd in _SD:
        prior = sd * sd * process
        fitted = _fitted(prior[:-1, :-1] + level, power, tapers * count)
        across = prior[-1, :-1]
        variance = float(prior[-1, -1] - across @ fitted.inverse @ across)
        found.append(
            Likeness(
                fitted.log_evidence - listed.log_evidence,
                math.log(filter_.gain) + 0.5 * float(across @ fitted.pull),
                0.5 * math.sqrt(max(variance, 0.0)),
            )
        )
    return found


class _Fitted(NamedTuple):
    """Log evidence, the mode times the inverse prior covariance, and the inverse covariance of the data."""

    log_evidence: float
    pull: Array
    inverse: Array


def _fitted(prior: Array, power: Array, estimates: Array) -> _Fitted:
    """Gaussian process of the logarithm of the expected power, (m, m), by Laplace's approximation."""

    def towards(weight: Array, wanted: Array) -> tuple[Array, Array, float]:
        """Pull of ``wanted``, known with that precision; inverse and log determinant of its covariance."""
        root = np.sqrt(weight)
        inside = np.eye(power.size) + root[:, None] * prior * root
        inverse = root[:, None] * np.linalg.solve(inside, np.diag(root))
        return inverse @ wanted, inverse, float(np.linalg.slogdet(inside)[1])

    def value_at(pull: Array) -> float:
        log_power = prior @ pull
        left = estimates * (log_power + power * np.exp(-log_power))
        return -0.5 * float(pull @ log_power) - float(left.sum())

    # the mean of the logarithm of an estimate
    pull, _, _ = towards(estimates, np.log(power) + np.log(estimates) - digamma(estimates))
    value, last = value_at(pull), -math.inf
    while value - last > _DONE:
        ratio = power * np.exp(-prior @ pull)
        aim, inverse, log_determinant = towards(estimates * ratio, prior @ pull + 1.0 - 1.0 / ratio)
        step, last = 1.0, value
        while step > _DONE and (value := value_at(pull + step * (aim - pull))) < last:
            step *= 0.5
        pull = pull + step * (aim - pull)
    return _Fitted(value - 0.5 * log_determinant, pull, inverse)
