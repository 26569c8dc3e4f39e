r"""Whether something held the mass at the start or the end of a record, as a hand does: by some half cycles.

Two hypotheses explain these. The decay was free: they have the probability of the whole record under all
accounts of its residual, over that of the rest under the same. Or it was not, and whatever held the mass made
them a smooth curve (:mod:`friction_bayes.estimators.noise.smooth_curve`) in the noise of the rest, which has
to be white: a colour, or a floor, is taken from the samples, and is another one where there are fewer. The
curve may break where something takes hold or lets go, and as often as the mass turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from friction_bayes.estimators.noise.noise_accounts import NoiseAccount, record_evidence
from friction_bayes.estimators.noise.smooth_curve import curve_degrees, log_density_of_curve

__all__ = ["log_odds_of_hold"]

_LOG_PRIOR_ODDS = math.log(0.1 / 0.9)
"""Of a hold a priori."""


def log_odds_of_hold(
    whole: Sequence[NoiseAccount],
    rest: Sequence[NoiseAccount],
    border: float,
    half_cycles: int,
    *,
    at_end: bool = False,
) -> float:
    """Log odds that the mass was held before a time, or from it on, against free throughout.

    Parameters
    ----------
    whole, rest : sequence of NoiseAccount
        Of the record, and of what is left of it; behind no filter.
    border : float
        Between what was held and the rest, from the first sample of the whole [s].
    half_cycles : int
        That were held.
    at_end : bool
        Whether these are after the border.
    """
    best = max(rest, key=lambda account: account.probability)
    if best.coloured or best.weaker_above:
        return -math.inf
    all_of_it, after = record_evidence(whole), record_evidence(rest)
    held = (all_of_it.time < border) != at_end
    degrees = curve_degrees(half_cycles, int(np.count_nonzero(held)))
    if not degrees:
        return -math.inf
    # in units of the noise, one sample more or less in the rest is worth little
    noise = after.noise
    free = all_of_it.log_density_over(noise) - after.log_density_over(noise)
    amplitude = float(np.max(np.abs(all_of_it.signal)))
    time, signal = all_of_it.time[held], all_of_it.signal[held]
    place = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    by_curve = log_density_of_curve(place, signal / noise, amplitude / noise, degrees, breaks=half_cycles + 1)
    return _LOG_PRIOR_ODDS + by_curve - free
