"""A path of the random force that the catalogue knows, for the integrator to follow."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError

__all__ = ["RTOL", "random_force_path"]

RTOL = 1e-8
"""Local error of a motion under such a force: its kinks would make a finer one creep."""
_SPACING = 0.05
"""Of the values, in correlation times: a line between them loses 2 % of the variance."""
_PERIOD = 0.02
"""The same in periods."""
_MOST_VALUES = 10**7


def random_force_path(
    sd: float, correlation_time: float, duration: float, period: float, rng: np.random.Generator
) -> tuple[float, Array]:
    """Draw an Ornstein-Uhlenbeck process.

    Parameters
    ----------
    sd : float
        Its standard deviation.
    correlation_time : float
        Of its exponential correlation [s].
    duration : float
        To cover [s].
    period : float
        Of the motion that it will drive [s].
    rng : numpy.random.Generator

    Returns
    -------
    spacing : float
        Of the values [s].
    values : ndarray, shape (n,)

    Raises
    ------
    InputError
        If the correlation time is too short to be followed.
    """
    spacing = min(_SPACING * correlation_time, _PERIOD * period, duration)
    n = math.ceil(duration / spacing) + 2
    if n > _MOST_VALUES:
        raise InputError(
            "random_force.correlation_time",
            f"{correlation_time:g} s is too short to be followed over {duration:g} s",
            "lengthen it; so short a force is noise in the acceleration",
        )
    kept = math.exp(-spacing / correlation_time)
    drawn = rng.standard_normal(n) * np.append(1.0, np.full(n - 1, math.sqrt(1.0 - kept * kept)))
    return spacing, np.asarray(sd * lfilter([1.0], [1.0, -kept], drawn))
