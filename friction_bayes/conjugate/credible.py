"""Credible intervals of one parameter and the joint credible region of the normal-gamma pair."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq
from scipy.special import erf, gammainc, gammaincinv, gammaln, wrightomega, xlogy

from friction_bayes.core.checks import probability
from friction_bayes.core.errors import InputError

__all__ = ["IntervalKind", "credible_interval", "normal_gamma_level"]

IntervalKind = Literal["equal-tailed", "highest-density"]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(200)
_SINE = np.sin(0.5 * np.pi * _NODES)
_SINE_WEIGHTS = 0.5 * np.pi * np.cos(0.5 * np.pi * _NODES) * _WEIGHTS
_TOLERANCE = 1e-12


def credible_interval(
    distribution: Any, p: float, kind: IntervalKind = "equal-tailed"
) -> tuple[float, float]:
    """Interval that holds probability ``p`` of a frozen distribution with one mode.

    Parameters
    ----------
    distribution : frozen scipy.stats distribution
        Continuous, with a single mode or a density that only falls.
    p : float
        Probability, 0 < p < 1.
    kind : {"equal-tailed", "highest-density"}
        Same probability left out on both sides, or the shortest interval.

    Returns
    -------
    (low, high) : tuple of float

    Raises
    ------
    InputError
        If ``p`` is not a probability or the kind is unknown.
    """
    p = probability("p", p)
    if kind == "equal-tailed":
        low, high = distribution.ppf(0.5 * (1.0 - p)), distribution.isf(0.5 * (1.0 - p))
        return float(low), float(high)
    if kind != "highest-density":
        raise InputError("kind", f"unknown interval {kind!r}", "give equal-tailed or highest-density")

    def density_step(lower_tail: float) -> float:
        # a difference of log-densities would be infinite where the support begins
        low, high = distribution.ppf(lower_tail), distribution.isf(1.0 - p - lower_tail)
        return float(distribution.pdf(low) - distribution.pdf(high))

    tail = 1.0 - p
    smallest = tail * 1e-9
    if density_step(smallest) >= 0.0:
        return float(distribution.ppf(0.0)), float(distribution.isf(tail))
    lower_tail = brentq(density_step, smallest, tail * (1.0 - 1e-9), xtol=tail * 1e-12)
    return float(distribution.ppf(lower_tail)), float(distribution.isf(tail - lower_tail))


def normal_gamma_level(alpha: float, p: float) -> float:
    """Log-density level of the joint credible region of a normal-gamma with ``lam = beta = 1``.

    With ``g(s)`` the joint log-density on the ridge ``r = mu``, the region ``{log f >= level}`` holds at a
    given ``s`` the ``r`` with ``lam s (r - mu)**2 / 2 <= g(s) - level``; and ``r`` given ``s`` is normal with
    precision ``lam s``, so the region's mass is ``E[erf(sqrt(max(g(s) - level, 0)))]`` over the gamma
    marginal of ``s``. That one-dimensional integral is done by Gauss-Legendre quadrature over the probability
    of ``s``, with a sine substitution for the square-root ends, and solved for the level.

    Parameters
    ----------
    alpha : float
        Shape, > 0. The level for other ``lam`` and ``beta`` is ``0.5 log(lam) + 0.5 log(beta)`` higher.
    p : float
        Probability inside, 0 < p < 1.

    Returns
    -------
    float
        The level; the mass above it is ``p`` to 1e-8 for 0.001 <= p <= 0.999 and alpha >= 0.05.
    """
    p = probability("p", p)
    slope = alpha - 0.5
    constant = -float(gammaln(alpha)) - 0.5 * np.log(2.0 * np.pi)

    def excess_mass(level: float) -> float:
        lower, upper = _ridge_above(level - constant, slope)
        u_low, u_high = float(gammainc(alpha, lower)), float(gammainc(alpha, upper))
        half = 0.5 * (u_high - u_low)
        s = np.asarray(gammaincinv(alpha, u_low + half * (1.0 + _SINE)), dtype=np.float64)
        height = xlogy(slope, s) - s - (level - constant)
        return half * float(_SINE_WEIGHTS @ erf(np.sqrt(np.maximum(height, 0.0)))) - p

    top = constant + (float(xlogy(slope, slope)) - slope if slope >= 0.0 else 0.0)
    step = 1.0
    low = high = top
    while excess_mass(low) <= 0.0:
        low, step = low - step, 2.0 * step
    if slope < 0.0:
        # the density has no maximum: it grows without bound towards s = 0
        step = 1.0
        while excess_mass(high) > 0.0:
            high, step = high + step, 2.0 * step
    return float(brentq(excess_mass, low, high, xtol=_TOLERANCE, rtol=_TOLERANCE))


def _ridge_above(height: float, slope: float) -> tuple[float, float]:
    """Return the interval of ``s`` on which ``slope log(s) - s >= height``."""
    if slope == 0.0:
        return 0.0, max(-height, 0.0)
    if slope < 0.0:
        # with y = s / |slope|: y + log(y) = -height / |slope| - log|slope|
        return 0.0, -slope * float(np.real(wrightomega(height / slope - np.log(-slope))))
    depth = (float(xlogy(slope, slope)) - slope - height) / slope
    if depth <= 0.0:
        return slope, slope

    def fall(x: float) -> float:
        return float(np.expm1(x)) - x - depth

    # bounds of the two branches of Lambert's W
    left = brentq(fall, -1.0 - depth, 0.0, xtol=1e-15)
    right = brentq(fall, 0.0, float(np.log1p(np.sqrt(2.0 * depth) + depth)) + 1e-12, xtol=1e-15)
    return slope * float(np.exp(left)), slope * float(np.exp(right))
