r"""The end of a decay whose mass rests earlier than the fit says, as it breaks away at more than it slides.

By Coulomb friction it rests where the spring pulls with less than friction. Friction at rest may be larger,
and hold it from an earlier turning point on. The samples after one have then a constant level,

.. math:: y_i = a + e_i, \quad a \sim N(0, A^2), \quad e_i \sim N(0, \sigma^2)

against the fit, with :math:`A` the amplitude there and :math:`\sigma` the noise of the samples before.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.estimators.base import Fit

__all__ = ["until_rest"]

_LOG_PRIOR_ODDS = math.log(0.1 / 0.9)
"""Of an earlier rest a priori."""
_MOST_EARLIER = 3
"""Half cycles by which it may come earlier, each as probable: friction at rest is then seven times that of
sliding. The last turning point of the fit, where the mass rests by that, may be named too.
"""
_FEWEST = 3
"""Half cycles of a decay, and samples at rest."""


def until_rest(decay: FreeDecay, fit_of: Callable[[FreeDecay], Fit]) -> FreeDecay:
    """The decay up to where its mass rather rests, itself where the fit says so.

    Parameters
    ----------
    decay : FreeDecay
    fit_of : callable, FreeDecay -> Fit
        Under white noise, method ``waveform``.
    """
    if not decay.stops or decay.quantity.order == 2:
        # at rest an accelerometer shows what it shows at any speed
        return decay
    try:
        fit = fit_of(decay)
    except InputError:
        # what is no decay is refused where it is fitted
        return decay
    if fit.prediction is None or fit.motion is None:
        return decay
    left = decay.values - fit.prediction
    turns = np.flatnonzero(np.diff(np.sign(fit.motion.states[:, 1])) != 0) + 1
    log_odds = {}
    for turn in turns[_FEWEST:][-_MOST_EARLIER - 1 :].tolist():
        if left.size - turn >= _FEWEST:
            log_odds[turn] = _log_odds(decay.values[turn:] - fit.rest_position, left[:turn], left[turn:])
    best = max(log_odds, key=lambda turn: log_odds[turn], default=None)
    if best is None or log_odds[best] + _LOG_PRIOR_ODDS - math.log(_MOST_EARLIER) < 0.0:
        return decay
    return decay.until(best)


def _log_odds(level: Array, before: Array, after: Array) -> float:
    """Log odds of a constant level against residuals ``after``, given those ``before``."""
    noise2 = float(before @ before) / before.size
    amplitude2, n = float(np.max(np.abs(level))) ** 2 + noise2, level.size
    mean = float(level.mean())
    squares = float(np.sum((level - mean) ** 2))
    spread = amplitude2 + noise2 / n
    log_occam = 0.5 * math.log(noise2 / (n * spread))
    return 0.5 * (float(after @ after) - squares) / noise2 + log_occam - 0.5 * mean**2 / spread
