"""Whether residuals are white noise, as every interval that counts samples as independent assumes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import chdtrc

from friction_bayes.core.arrays import Array

__all__ = ["Whiteness", "residual_notes", "whiteness"]

_LAGS = 20
_LEVEL = 1e-3


@dataclass(frozen=True)
class Whiteness:
    """Ljung and Box's test of residuals.

    Attributes
    ----------
    lag1 : float
        Correlation of successive residuals.
    statistic : float
        Ljung-Box statistic over ``lags`` lags.
    lags : int
        Number of lags.
    p_value : float
        Probability of so large a statistic from white noise.
    """

    lag1: float
    statistic: float
    lags: int
    p_value: float

    @property
    def white(self) -> bool:
        """Whether white noise gives so large a statistic more often than once in a thousand."""
        return self.p_value >= _LEVEL

    @property
    def limit(self) -> float:
        """What the statistic of white noise exceeds once in a thousand."""
        return float(stats.chi2.isf(_LEVEL, max(self.lags, 1)))


def whiteness(residual: Array) -> Whiteness:
    """Test residuals, shape (n,), for correlation (Ljung & Box, Biometrika 65, 1978)."""
    n = residual.size
    lags = min(_LAGS, n // 5)
    # of no samples there is no mean
    centred = residual - residual.sum() / max(n, 1)
    power = float(centred @ centred)
    if lags < 1 or power == 0.0:
        return Whiteness(0.0, 0.0, lags, 1.0)
    rho = np.array([centred[k:] @ centred[:-k] for k in range(1, lags + 1)]) / power
    statistic = float(n * (n + 2.0) * np.sum(rho**2 / (n - np.arange(1, lags + 1))))
    return Whiteness(float(rho[0]), statistic, lags, float(chdtrc(lags, statistic)))


def residual_notes(residual: Array, prediction: Array) -> tuple[str, ...]:
    """Return notes on what the residuals say against the interval.

    Parameters
    ----------
    residual, prediction : ndarray, shape (n,)
        In the unit of the signal; the residual is compared with the swing of the prediction.
    """
    swing = float(np.std(prediction))
    if float(np.std(residual)) < 1e-9 * swing:
        return ("the record has no noise: the interval reflects the prior and rounding alone",)
    test = whiteness(residual)
    if test.white:
        return ()
    return (
        f"residuals are not white noise: successive ones correlate at {test.lag1:.3f}, Ljung-Box over "
        f"{test.lags} lags is {test.statistic:.3g} where white noise stays below "
        f"{test.limit:.3g} in 999 of 1000: the interval is too narrow, and the "
        "model lacks an effect; closing the loop looks for it",
    )
