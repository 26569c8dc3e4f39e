"""The density f(r|Ti) over detection points: each posterior, discounted or not, is the next prior.

A record's closed form gives its friction as a mean and a standard deviation, from thousands of samples: a
normal likelihood of known variance, whose conjugate prior is normal. With the whole posterior as the next
prior nothing is forgotten: right for a friction that stays, and late for one that wears. The power prior
(Ibrahim & Chen 2000) raises the posterior to a discount between 0 and 1 before it becomes the next prior;
a normal stays normal, its precision multiplied by the discount (West & Harrison's discounting of a level).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array

__all__ = ["DISCOUNTS", "Track", "choose_discount", "track"]


DISCOUNTS = np.logspace(-8.0, 0.0, 161)
"""Discounts to choose from. At the smallest the past counts next to nothing: its standard deviation has
grown ten thousandfold."""
_LOG_TWO_PI = math.log(2.0 * math.pi)


@dataclass(frozen=True, eq=False)
class Track:
    """Friction after each detection point.

    Attributes
    ----------
    discount : float
        Power of the posterior that becomes the next prior; 1 forgets nothing.
    mean, sd : ndarray, shape (n,)
        Of the normal density f(r|Ti).
    forecast, forecast_sd : ndarray, shape (n,)
        Of the normal one-step forecast of the next estimate, made before it; nan at T1.
    log_predictive : float
        Log-density that the forecasts gave to the estimates T2..Tn, together.
    """

    discount: float
    mean: Array
    sd: Array
    forecast: Array
    forecast_sd: Array
    log_predictive: float


def track(friction: Array, sd: Array, discount: float = 1.0) -> Track:
    """Update a flat prior by one detection point after the other.

    Parameters
    ----------
    friction, sd : ndarray, shape (n,)
        Estimate of each record and its standard deviation.
    discount : float
        0 < discount <= 1.

    Returns
    -------
    Track
    """
    mean, spread, forecast, forecast_sd, log_predictive = _tracked(friction, sd, np.array([discount]))
    return Track(
        discount, mean[:, 0], spread[:, 0], forecast[:, 0], forecast_sd[:, 0], float(log_predictive[0])
    )


def _tracked(friction: Array, sd: Array, discount: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Mean, sd and those of the forecasts of many discounts, shape (n, m), and log densities, shape (m,)."""
    shape = (friction.size, discount.size)
    mean, spread = np.empty(shape), np.empty(shape)
    forecast, forecast_sd = np.full(shape, math.nan), np.full(shape, math.nan)
    mean[0], spread[0] = friction[0], sd[0]
    for i in range(1, friction.size):
        prior_variance = spread[i - 1] ** 2 / discount
        forecast[i], forecast_sd[i] = mean[i - 1], np.sqrt(prior_variance + sd[i] ** 2)
        gain = prior_variance / (prior_variance + sd[i] ** 2)
        mean[i] = mean[i - 1] + gain * (friction[i] - mean[i - 1])
        spread[i] = sd[i] * np.sqrt(gain)
    missed = (friction[1:, None] - forecast[1:]) / forecast_sd[1:]
    log_predictive = -np.sum(0.5 * (missed**2 + _LOG_TWO_PI) + np.log(forecast_sd[1:]), axis=0)
    return mean, spread, forecast, forecast_sd, log_predictive


def choose_discount(friction: Array, sd: Array) -> float:
    """Return the discount of :data:`DISCOUNTS` whose one-step forecasts make the estimates likeliest.

    Where several are equally good, as for a friction that never moved, the largest: it forgets least.
    """
    *_, scores = _tracked(friction, sd, DISCOUNTS)
    return float(DISCOUNTS[np.flatnonzero(scores >= scores.max() - 1e-9)[-1]])
