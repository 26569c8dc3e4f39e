"""What of a decay is fitted: until its mass rests, without faults of the sensor, as long as nothing holds it.

Something may have held the mass at the start of a record, as a hand does, or have stopped it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from friction_bayes.core.errors import InputError
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.estimators.base import BehindFilter, Fit
from friction_bayes.estimators.noise.held_part import log_odds_of_hold
from friction_bayes.estimators.noise.noise_accounts import NoiseAccounts, total_probability
from friction_bayes.estimators.waveform.early_rest import until_rest
from friction_bayes.estimators.waveform.sensor_faults import plain_decay, without_sensor_faults

__all__ = ["FreePart", "free_part"]

_MOST_LATER = 3
"""Times that the start may be moved."""
_MOST_EARLIER = 4
"""Half cycles within which a mass is stopped, at most."""


class FreePart(NamedTuple):
    """What of a decay is fitted, its fit under white noise, and the accounts of its residual."""

    decay: FreeDecay
    fit: Fit
    accounts: NoiseAccounts

    @classmethod
    def of(cls, decay: FreeDecay, fit: Fit) -> FreePart:
        return cls(decay, fit, NoiseAccounts(plain_decay(decay, fit)))

    @property
    def white(self) -> bool:
        """Whether dry friction in white noise rather explains it."""
        return self.accounts.behind_none[0].probability > 0.5

    @property
    def explained(self) -> bool:
        """Whether forces that follow the motion rather explain it in white noise."""
        accounts = self.accounts.behind_none
        return total_probability(each for each in accounts if each.of_white_noise and not each.forced) > 0.5

    @property
    def behind_filter(self) -> bool:
        """Whether a filter rather explains it, its start too."""
        return BehindFilter.of(self.accounts.all) is not None


def free_part(
    decay: FreeDecay, fit_of: Callable[[FreeDecay], Fit], *, from_here: bool = False, suspect: int = 1
) -> FreePart:
    """The part of a decay that is fitted.

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
    found = FreePart.of(*without_sensor_faults(decay, fit, fit_of))
    # what stopped the mass makes its start improbable too
    ended = _earlier(found, fit_of)
    if ended is not None:
        return ended
    for half_cycles in [] if from_here else [suspect] + [1] * (_MOST_LATER - 1):
        later = _later(found, fit_of, half_cycles)
        if later is None:
            break
        found = later
    return (_earlier(found, fit_of) if found.decay.later else None) or found


def _later(whole: FreePart, fit_of: Callable[[FreeDecay], Fit], half_cycles: int) -> FreePart | None:
    """What is left some half cycles later, if something rather held the mass in them.

    Behind a filter only what white noise explains: it shapes the rest too, and the start may be what it makes
    of it. Then, and where several are suspected, more may have been held than are removed first.
    """
    if not whole.accounts.behind_none or whole.white:
        return None
    decay = whole.decay
    for removed in range(1, max(half_cycles, _MOST_LATER) + 1):
        decay = decay.half_a_cycle_later()
        if removed < half_cycles:
            continue
        try:
            rest = FreePart.of(decay, fit_of(decay))
        except InputError:
            # what is left once the start is gone is no decay: the start is what was measured
            return None
        after = rest.accounts.behind_none
        until = decay.start_time - 0.5 * decay.step - whole.decay.start_time
        if not after:
            return None
        held = log_odds_of_hold(whole.accounts.behind_none, after, until, removed) > 0.0
        if held and (rest.white or not (whole.behind_filter or rest.behind_filter)):
            return rest
        if not held and half_cycles == 1:
            return None
    return None


def _earlier(whole: FreePart, fit_of: Callable[[FreeDecay], Fit]) -> FreePart | None:
    """What is left without the last half cycles, if something rather stopped the mass in these.

    As few of them as leave what forces that follow the motion explain: that is known to be free. Where these
    do not explain what the most of them leave, they do not explain more of it either.
    """
    if not whole.decay.stops or not whole.accounts.behind_none or whole.explained:
        return None
    cuts = (_without_end(whole, fit_of, half_cycles) for half_cycles in range(_MOST_EARLIER, 0, -1))
    shortest = next((rest for rest in cuts if rest is not None), None)
    if shortest is None or not shortest.explained:
        return None
    most = shortest.decay.earlier
    for half_cycles in range(1, most + 1):
        rest = shortest if half_cycles == most else _without_end(whole, fit_of, half_cycles)
        if rest is None or not rest.explained:
            continue
        border = rest.decay.start_time + rest.decay.duration + 0.5 * rest.decay.step - whole.decay.start_time
        before = rest.accounts.behind_none
        if log_odds_of_hold(whole.accounts.behind_none, before, border, half_cycles, at_end=True) > 0.0:
            return rest
    return None


def _without_end(whole: FreePart, fit_of: Callable[[FreeDecay], Fit], half_cycles: int) -> FreePart | None:
    """What is left without so many half cycles at the end; None where that is too short."""
    decay = whole.decay.half_cycles_earlier(half_cycles)
    try:
        rest = FreePart.of(decay, fit_of(decay))
    except InputError:
        return None
    return rest if rest.accounts.behind_none else None
