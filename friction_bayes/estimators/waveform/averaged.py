"""The fit of the whole signal averaged with the regression under a random force.

The fit without a random force, exact in frequency and phase, is one part of the posterior; the regression of
:mod:`friction_bayes.estimators.random_force.plain_law` is the other. Their probabilities follow from the
evidence of that regression with and without the force, on the same samples and columns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.sensor_calibration import force_factor, swing_frequency
from friction_bayes.decay.whiteness import residual_notes
from friction_bayes.estimators.base import Fit, RandomForce
from friction_bayes.estimators.random_force.plain_law import PlainDecay, PlainPosterior, plain_posterior

__all__ = ["SURELY_NONE", "Averaged", "averaged", "averaged_over_random_force", "force_probability"]

SURELY_NONE = 1e-3
"""Probability of a random force below which the fit without one is the answer."""


@dataclass(frozen=True, kw_only=True)
class Averaged:
    """What a fit says of a signal, with or without a random force or averaged over it; see :class:`Fit`.

    Attributes
    ----------
    coefficient : frozen scipy.stats distribution or Mixture
        Friction coefficient of the signal; a frozen Student t without a random force.
    frequency, frequency_sd : float
        Angular frequency [rad/s].
    noise_sd : float
        Of a sample.
    """

    coefficient: Any
    frequency: float
    frequency_sd: float
    noise_sd: float


def force_probability(found: PlainPosterior) -> float:
    """Probability of a random force: its shares may add up to more than one by their rounding."""
    return min(found.probability, 1.0)


def averaged(without: Averaged, found: PlainPosterior) -> Averaged:
    """Average both parts; the fit without a random force is the answer where there surely is none."""
    p = force_probability(found)
    if p < SURELY_NONE:
        return without
    frequency = (1.0 - p) * without.frequency + p * found.frequency
    variance = (1.0 - p) * (without.frequency_sd**2 + (without.frequency - frequency) ** 2)
    variance += p * (found.frequency_sd**2 + (found.frequency - frequency) ** 2)
    part = without.coefficient.kwds
    return Averaged(
        coefficient=found.coefficient.with_part(1.0 - p, part["loc"], part["scale"], part["df"]),
        frequency=frequency,
        frequency_sd=math.sqrt(variance),
        noise_sd=(1.0 - p) * without.noise_sd + p * found.noise_sd,
    )


def averaged_over_random_force(decay: FreeDecay, fit: Fit) -> Fit:
    """Average a fit of the whole signal over a random force.

    Parameters
    ----------
    decay : FreeDecay
        The record.
    fit : Fit
        Without a random force, method ``waveform``.

    Returns
    -------
    Fit
        The same where the record says nothing of a random force (too short, no noise); the same but for
        ``random_force`` where there surely is none.
    """
    found = plain_posterior(
        PlainDecay(
            values=decay.values,
            time=decay.time,
            order=decay.quantity.order,
            frequency=fit.frequency,
            coefficient=float(fit.coefficient.mean()),
            rest_position=fit.rest_position,
            rest_known=decay.rest_known,
            pendulum=swing_frequency(decay.system, decay.unit) > 0.0,
            noise_sd=fit.noise_sd,
        )
    )
    if found is None:
        return fit
    without = Averaged(
        coefficient=fit.coefficient,
        frequency=fit.frequency,
        frequency_sd=fit.frequency_sd,
        noise_sd=fit.noise_sd,
    )
    doubts: tuple[str, ...] = ()
    if found.probability > 0.5 and fit.prediction is not None:
        # what residuals say against the interval without a force is no longer said of this one
        doubts = residual_notes(decay.values - fit.prediction, fit.prediction)
    return replace(
        fit,
        **vars(averaged(without, found)),
        notes=tuple(note for note in fit.notes if note not in doubts),
        random_force=RandomForce(
            probability=force_probability(found),
            sd=found.sd,
            correlation_time=found.correlation_time,
            coefficient_without=fit.coefficient,
            coefficient_with=found.coefficient,
            innovations=found.innovations,
            build_target=lambda: found.target(force_factor(decay.system, decay.quantity, decay.unit)),
        ),
    )
