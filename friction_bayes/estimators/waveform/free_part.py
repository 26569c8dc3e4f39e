"""What of a decay is fitted: until its mass rests, without faults of the sensor, from where nothing holds it.

Something may have held the mass at the start of a record, as a hand does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from friction_bayes.core.errors import InputError
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.estimators.base import Fit
from friction_bayes.estimators.noise.held_start import log_odds_of_hold
from friction_bayes.estimators.noise.noise_accounts import NoiseAccount, noise_accounts
from friction_bayes.estimators.waveform.early_rest import until_rest
from friction_bayes.estimators.waveform.sensor_faults import plain_decay, without_sensor_faults

__all__ = ["free_part"]

_MOST_LATER = 3
"""Times that the start may be moved."""


def free_part(
    decay: FreeDecay, fit_of: Callable[[FreeDecay], Fit], *, from_here: bool = False, suspect: int = 1
) -> tuple[FreeDecay, Fit]:
    """The part of a decay that is fitted, and its fit under white noise.

    Parameters
    ----------
    decay : FreeDecay
    fit_of : callable, FreeDecay -> Fit
        Under white noise, method ``waveform``.
    from_here : bool
        Whether the decay is known to be free from its start.
    suspect : int
        Half cycles at its start that are judged together first.
    """
    fit = fit_of(decay)
    shorter = until_rest(decay, fit)
    if shorter is not decay:
        decay, fit = shorter, fit_of(shorter)
    decay, fit = without_sensor_faults(decay, fit, fit_of)
    for half_cycles in [] if from_here else [suspect] + [1] * (_MOST_LATER - 1):
        later = _later(decay, fit, fit_of, half_cycles)
        if later is None:
            break
        decay, fit = later
    return decay, fit


def _later(
    decay: FreeDecay, fit: Fit, fit_of: Callable[[FreeDecay], Fit], half_cycles: int
) -> tuple[FreeDecay, Fit] | None:
    """The decay some half cycles later, and its fit, if something rather held the mass in them."""
    whole = noise_accounts(plain_decay(decay, fit), filtered=False)
    if not whole or _white(whole):
        return None
    later = decay
    for _ in range(half_cycles):
        later = later.half_a_cycle_later()
    try:
        later_fit = fit_of(later)
        rest = noise_accounts(plain_decay(later, later_fit), filtered=False)
    except InputError:
        # what is left once the start is gone is no decay: the start is what was measured
        return None
    until = later.start_time - decay.start_time
    if not rest or log_odds_of_hold(whole, rest, until, half_cycles) < 0.0:
        return None
    # a filter shapes the rest too, and the start may be what it makes of it
    if not _white(rest) and (_behind_filter(decay, fit) or _behind_filter(later, later_fit)):
        return None
    return later, later_fit


def _white(accounts: Sequence[NoiseAccount]) -> bool:
    """Whether dry friction in white noise rather explains a decay."""
    return accounts[0].probability > 0.5


def _behind_filter(decay: FreeDecay, fit: Fit) -> bool:
    """Whether a filter rather explains a decay, its start too."""
    return replace(fit, accounts=noise_accounts(plain_decay(decay, fit))).filter is not None
