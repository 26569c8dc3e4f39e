r"""Whether something held the mass at the start or the end of a record, as a hand does: by some half cycles.

Two hypotheses explain these. The decay was free: they have the probability of the whole record under all
accounts of its residual, over that of the rest under the same. Or it was not: whatever held the mass made
them a smooth curve (:mod:`friction_bayes.estimators.noise.smooth_curve`) in the noise of the rest, which has
to be white: a colour, or a floor, is taken from the samples, and is another one where there are fewer. The
curve may break where something takes hold or lets go, and as often as the mass turns. Or what touched a mass
that went on moving was a random force of that part alone: then they have the probability of the whole record
with one over that of the rest with one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import gammaln

from friction_bayes.estimators.noise.noise_accounts import NoiseAccount, most_probable, total_probability
from friction_bayes.estimators.noise.smooth_curve import (
    LOG_ODDS_NOT_FREE,
    curve_degrees,
    log_density_of_curve,
)

__all__ = ["log_odds_of_hold"]

_LEAST = 1e-300


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
        Between two samples, of what was held and of the rest, from the first one of the whole [s].
    half_cycles : int
        That were held.
    at_end : bool
        Whether these are after the border.
    """
    white = [each for each in rest if each.of_white_noise]
    if total_probability(white) < 0.5:
        return -math.inf
    best = most_probable(whole)
    prepared, used = best.laid.prepared, best.laid.regression.clock.used
    # the first mean of a block is that much later than the first sample
    to_first = 0.5 * (prepared.decay.block - 1) * prepared.decay.step
    time, signal = to_first + prepared.time[used], prepared.signal[used]
    held = (time < border) != at_end
    degrees = curve_degrees(half_cycles, int(np.count_nonzero(held)))
    if not degrees:
        return -math.inf
    # in units of the noise, one sample more or less in the rest is worth little
    after = most_probable(white)
    noise = after.laid.unit * after.posterior.noise_sd
    free = _log_density(whole, noise) - _log_density(rest, noise)
    amplitude = float(np.max(np.abs(signal)))
    time, signal = time[held], signal[held]
    place = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    by_curve = log_density_of_curve(place, signal / noise, amplitude / noise, degrees, breaks=half_cycles + 1)
    by_force = free + _log_share_with_force(whole) - _log_share_with_force(rest)
    return LOG_ODDS_NOT_FREE + float(np.logaddexp(by_curve, by_force)) - math.log(2.0) - free


def _log_share_with_force(accounts: Sequence[NoiseAccount]) -> float:
    """Log probability of a random force among accounts of a record."""
    return math.log(max(total_probability(each for each in accounts if each.forced), _LEAST))


def _log_density(accounts: Sequence[NoiseAccount], unit: float) -> float:
    """Log density of the samples that count, in a unit, averaged over all accounts of a record."""
    best = most_probable(accounts)
    samples = int(np.count_nonzero(best.laid.regression.clock.used))
    # accounts compare without what all have of the integral over the noise
    shared = float(gammaln(0.5 * samples)) - 0.5 * samples * math.log(2.0 * math.pi)
    return best.log_evidence - math.log(best.probability) + shared + samples * math.log(unit)
