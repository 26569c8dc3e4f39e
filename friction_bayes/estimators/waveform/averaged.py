"""The fit of the whole signal averaged over the accounts of what it leaves: coloured noise, a random force.

Where the residual is white noise the fit itself, exact in frequency and phase, is the answer; the others are
those of :mod:`friction_bayes.estimators.random_force.noise_accounts`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.decay.whiteness import residual_notes
from friction_bayes.estimators.base import Fit, RandomForce
from friction_bayes.estimators.random_force.noise_accounts import NoiseAccount, noise_accounts
from friction_bayes.estimators.random_force.plain_law import PlainDecay

__all__ = ["SURELY_NONE", "Averaged", "averaged", "averaged_over_accounts", "random_force_of"]

SURELY_NONE = 1e-3
"""Probability of an account below which it is left out of the answer."""


@dataclass(frozen=True, kw_only=True)
class Averaged:
    """What a fit says of a signal, under white noise or averaged over the accounts; see :class:`Fit`.

    Attributes
    ----------
    coefficient : frozen scipy.stats distribution or Mixture
        Friction coefficient of the signal; a frozen Student t under white noise.
    frequency, frequency_sd : float
        Angular frequency [rad/s].
    noise_sd : float
        Of a sample.
    """

    coefficient: Any
    frequency: float
    frequency_sd: float
    noise_sd: float


def averaged(white: Averaged, accounts: Sequence[NoiseAccount]) -> Averaged:
    """Average over the accounts; the fit under white noise is the answer where nothing else counts.

    The noise of the fit is then at least that of its account, which knows how strong it is near the motion's
    frequency.
    """
    louder = max(accounts[0].noise_sd / white.noise_sd, 1.0)
    part = white.coefficient.kwds
    exact = Mixture(
        weight=np.ones(1),
        location=np.array([part["loc"]]),
        scale=np.array([part["scale"] * louder]),
        degrees=np.array([part["df"]], dtype=np.float64),
    )
    frequency_sd = white.frequency_sd * louder
    parts = [
        replace(accounts[0], coefficient=exact, frequency=white.frequency, frequency_sd=frequency_sd),
        *accounts[1:],
    ]
    return _mean_of([each for each in parts if each.probability >= SURELY_NONE])


def _mean_of(parts: Sequence[NoiseAccount]) -> Averaged:
    share = np.array([each.probability for each in parts])
    share /= share.sum()
    mean = float(share @ [each.frequency for each in parts])
    spread = [each.frequency_sd**2 + (each.frequency - mean) ** 2 for each in parts]
    return Averaged(
        coefficient=Mixture.of([each.coefficient for each in parts], share),
        frequency=mean,
        frequency_sd=math.sqrt(float(share @ spread)),
        noise_sd=float(share @ [each.noise_sd for each in parts]),
    )


def random_force_of(accounts: Sequence[NoiseAccount]) -> RandomForce:
    """What the accounts with a random force say of it, and of friction with it and without."""
    forced = [each for each in accounts if each.forced]
    best = max(forced, key=lambda each: each.probability)
    still = [each for each in accounts if not each.forced]
    return RandomForce(
        probability=sum(each.probability for each in forced),
        sd=best.sd,
        correlation_time=best.correlation_time,
        coefficient_without=_mean_of(still).coefficient,
        coefficient_with=_mean_of(forced).coefficient,
        innovations=best.innovations,
    )


def averaged_over_accounts(decay: FreeDecay, fit: Fit) -> Fit:
    """Average a fit of the whole signal over the accounts of what it leaves.

    Parameters
    ----------
    decay : FreeDecay
        The record.
    fit : Fit
        Under white noise, method ``waveform``.

    Returns
    -------
    Fit
        The same where nothing can be told of the noise (too few samples, no noise).
    """
    assert fit.motion is not None
    accounts = noise_accounts(
        PlainDecay(
            values=decay.values,
            time=decay.time,
            order=decay.quantity.order,
            frequency=fit.frequency,
            coefficient=float(fit.coefficient.mean()),
            rest_position=fit.rest_position,
            states=fit.motion.states,
            phase_sd=fit.motion.phase_sd,
            rest_known=decay.rest_known,
            pendulum=swing_frequency(decay.system, decay.unit) > 0.0,
            noise_sd=fit.noise_sd,
        )
    )
    if not accounts:
        return fit
    white = Averaged(
        coefficient=fit.coefficient,
        frequency=fit.frequency,
        frequency_sd=fit.frequency_sd,
        noise_sd=fit.noise_sd,
    )
    doubts: tuple[str, ...] = ()
    if accounts[0].probability < 0.5 and fit.prediction is not None:
        # what residuals say against the interval under white noise is no longer said of this one
        doubts = residual_notes(decay.values - fit.prediction, fit.prediction)
    return replace(
        fit,
        **vars(averaged(white, accounts)),
        notes=tuple(note for note in fit.notes if note not in doubts),
        accounts=accounts,
        random_force=random_force_of(accounts),
    )
