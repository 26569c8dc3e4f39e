"""The fit of the whole signal averaged over accounts of its residual: coloured noise, a random force.

Where the residual is white noise the fit itself, exact in frequency and phase, is reported; the other
accounts are those of :mod:`friction_bayes.estimators.noise.noise_accounts`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from friction_bayes.conjugate.mixture import OMITTED, Mixture
from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.whiteness import residual_notes
from friction_bayes.estimators.base import Fit, RandomForce
from friction_bayes.estimators.envelope.loss_of_amplitude import (
    UnevenLoss,
    loss_of_amplitude,
    uneven_loss,
)
from friction_bayes.estimators.noise.noise_accounts import (
    SLIGHT,
    NoiseAccount,
    most_probable,
    total_probability,
)
from friction_bayes.estimators.posterior_part import PosteriorPart
from friction_bayes.estimators.witness import Witness

__all__ = ["averaged_over_accounts"]

_AS_LOUD = 1.01
"""Noise of the account over that of the fit up to which the sampler takes the fit as it is."""
_BY_CHANCE = 4.0
"""Standard deviations by which that of a fit exceeds that of its account by chance."""


def _averages(decay: FreeDecay, fit: Fit, accounts: Sequence[NoiseAccount]) -> dict[str, Any]:
    """Averages over the accounts, that of white noise by its fit, whose noise is at least the account's.

    A fit with more noise than that has samples that are not accounted for, where the mass rests, and does not
    hold there.
    """
    if _rests_elsewhere(decay, fit, accounts[0]):
        return _mean_of(accounts, _probabilities(accounts))
    loud = accounts[0].noise_sd
    louder = max(loud / fit.noise_sd, 1.0)
    widened = Mixture.of_student(fit.coefficient).widened(louder)
    exact = replace(fit, coefficient=widened, frequency_sd=fit.frequency_sd * louder, noise_sd=loud)
    return _mean_of([exact, *accounts[1:]], _probabilities(accounts))


def _rests_elsewhere(decay: FreeDecay, fit: Fit, account: NoiseAccount) -> bool:
    """Whether a fit has more noise than the account of its motion, beyond chance."""
    return fit.noise_sd > account.noise_sd * (1.0 + _BY_CHANCE / math.sqrt(2.0 * decay.values.size))


def _probabilities(accounts: Sequence[NoiseAccount]) -> Array:
    return np.array([each.probability for each in accounts])


def _mean_of(parts: Sequence[Fit | NoiseAccount], share: Array) -> dict[str, Any]:
    """Fields of :class:`Fit` averaged over parts; those without probability are not computed."""
    # none of a kind may have any probability to rounding
    share = share / share.sum() if share.sum() > 0.0 else np.eye(len(parts))[0]
    parts = [part for part, own in zip(parts, share, strict=True) if own > OMITTED]
    share = share[share > OMITTED] / share[share > OMITTED].sum()
    mean = float(share @ [each.frequency for each in parts])
    spread = [each.frequency_sd**2 + (each.frequency - mean) ** 2 for each in parts]
    return {
        "coefficient": Mixture.of([each.coefficient for each in parts], share),
        "frequency": mean,
        "frequency_sd": math.sqrt(float(share @ spread)),
        "noise_sd": float(share @ [each.noise_sd for each in parts]),
    }


def _random_force_of(accounts: Sequence[NoiseAccount]) -> RandomForce:
    """Posterior of the random force from the accounts that have one, and of friction with and without it."""
    forced = [each for each in accounts if each.forced]
    still = [each for each in accounts if not each.forced]
    best = most_probable(forced)
    return RandomForce(
        probability=total_probability(forced),
        sd=best.sd,
        correlation_time=best.correlation_time,
        coefficient_without=_mean_of(still, _probabilities(still))["coefficient"],
        coefficient_with=_mean_of(forced, _probabilities(forced))["coefficient"],
        innovations=best.innovations,
    )


def _witness_of(
    decay: FreeDecay, coefficient: Any, uneven: UnevenLoss | None, accounts: Sequence[NoiseAccount]
) -> Witness | None:
    """Witness by the loss of amplitude of a friction posterior; None where it cannot be computed.

    Where the loss is surely uneven, friction is what that leaves to it, and disagrees with a fit of dry
    friction alone. What lies between the two is what other laws leave to it: drag in proportion to the square
    of the velocity, and friction that changes with time. Where the whole signal says which of them, or that
    the spring is bent, in white noise, the amplitudes alone say nothing more; behind a filter what it leaves
    may pass for a loss, and dry friction alone by the amplitudes remains a witness.

    It bounds the width of the answer where only white noise could be evaluated, and where an accelerometer's
    noise is neither white nor that of a filter: such a sensor shows a force itself, which then passes for
    noise without effect on the motion.
    """
    if total_probability(each for each in accounts if each.others and each.plain) > 0.5:
        return None
    if uneven is not None and uneven.sure and not uneven.losses:
        return Witness(uneven.coefficient, agrees=False, bounds=False)
    lost = loss_of_amplitude(decay)
    if lost is None:
        return None
    lost = _before_filter(lost, accounts)
    separated = bool(accounts) and (decay.quantity.order < 2 or _noise_is_known(accounts))
    return Witness.compared(coefficient, lost, bounds=not separated)


def _noise_is_known(accounts: Sequence[NoiseAccount]) -> bool:
    """Whether the noise is rather white, or that of a filter."""
    return total_probability(each for each in accounts if each.of_known_noise) > 0.5


def _by_accounts(accounts: Sequence[NoiseAccount]) -> UnevenLoss | None:
    """Other losses than by dry friction as the accounts of known noise have them; None without any."""
    known = [each for each in accounts if each.of_known_noise]
    found = [each.other_loss for each in known if each.probability > 0.0]
    having = [loss for loss in found if loss is not None]
    if not having:
        return None
    share = np.array([each.probability for each in having])
    probability = float(share.sum() / _probabilities(known).sum())
    share /= share.sum()
    named = [each.losses or {} for each in having]
    losses = {name: float(share @ [each[name] for each in named]) for name in named[0]}
    best = max(having, key=lambda each: each.probability)
    # as if it might be negative: so much of it need not be there
    coefficient = Mixture.of([replace(each.coefficient, positive=False) for each in having], share)
    return UnevenLoss(probability, best.faster, coefficient, losses)


def _before_filter(lost: Mixture, accounts: Sequence[NoiseAccount]) -> Mixture:
    """Friction by the loss of amplitude of the motion, from that of the signal."""
    if all(each.gain == 1.0 for each in accounts):
        return lost
    shares = [each.probability for each in accounts]
    return Mixture.of([lost.scaled(1.0 / each.gain) for each in accounts], shares)


def averaged_over_accounts(decay: FreeDecay, fit: Fit, accounts: tuple[NoiseAccount, ...]) -> Fit:
    """A fit of the whole signal, under white noise, averaged over the accounts of its residual.

    With the witness.
    """
    uneven = uneven_loss(decay)
    if uneven is not None:
        uneven = uneven._replace(coefficient=_before_filter(uneven.coefficient, accounts))
    if _noise_is_known(accounts):
        uneven = _by_accounts(accounts) or uneven
    fit = replace(fit, uneven_loss=uneven)
    if not accounts:
        return replace(fit, witness=_witness_of(decay, fit.coefficient, uneven, ()))
    averages = _averages(decay, fit, accounts)
    # under a random force a law alone wanders off
    others = [each for each in accounts if each.others and not each.forced]
    if total_probability(others) > 0.5 and fit.prediction is not None:
        predicted = most_probable(others).prediction(fit.prediction, decay.time - decay.time[0])
        averages["prediction"] = predicted
    doubts: tuple[str, ...] = ()
    if accounts[0].probability < 0.5 and fit.prediction is not None:
        # remarks about residuals concern the interval under white noise, not this one
        doubts = residual_notes(decay.values - fit.prediction, fit.prediction)
    return replace(
        fit,
        **averages,
        notes=tuple(note for note in fit.notes if note not in doubts),
        accounts=accounts,
        account_parts=_parts(decay, fit, accounts),
        random_force=_random_force_of(accounts),
        witness=_witness_of(decay, averages["coefficient"], uneven, accounts),
    )


def _parts(decay: FreeDecay, fit: Fit, accounts: Sequence[NoiseAccount]) -> tuple[PosteriorPart, ...]:
    """Parts for a sampler: the fit itself under white noise, unless its account has more noise."""
    parts: list[PosteriorPart] = []
    for i, account in enumerate(accounts):
        if account.probability >= SLIGHT:
            own = i == 0 and account.noise_sd <= _AS_LOUD * fit.noise_sd
            own &= not _rests_elsewhere(decay, fit, account)
            white = PosteriorPart(account.name, account.probability, False, fit.coefficient, fit.build_target)
            parts += [white] if own else account.parts(decay.force_factor)
    return tuple(parts)
