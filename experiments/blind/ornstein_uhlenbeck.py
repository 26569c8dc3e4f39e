"""A force that fluctuates: a path of an Ornstein-Uhlenbeck process, exact at every point of its grid."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

__all__ = ["ornstein_uhlenbeck"]


def ornstein_uhlenbeck(
    rng: np.random.Generator, sd: float, correlation_time: float, step: float, n: int
) -> NDArray[np.float64]:
    """Stationary path with covariance ``sd**2 exp(-|t - u| / correlation_time)``.

    The conditional law of one point given the one before, so no error of discretisation.

    Parameters
    ----------
    rng : Generator
        Of the path.
    sd, correlation_time : float
        Of the process.
    step : float
        Between points.
    n : int
        Points.
    """
    memory = math.exp(-step / correlation_time)
    kicks = rng.standard_normal(n)
    kicks[1:] *= math.sqrt(-math.expm1(-2.0 * step / correlation_time))
    path: NDArray[np.float64] = sd * lfilter([1.0], [1.0, -memory], kicks)
    return path
