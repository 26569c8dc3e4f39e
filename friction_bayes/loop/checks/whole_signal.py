"""Friction by the estimate of the whole signal, where that knows what no candidate of the loop has."""

from __future__ import annotations

from functools import partial

import numpy as np

from friction_bayes.core.errors import InputError
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.friction_samples import PEAKS
from friction_bayes.decay.sensor_calibration import force_factor
from friction_bayes.estimators.envelope.loss_of_amplitude import faster_loss
from friction_bayes.estimators.priors import complete_prior
from friction_bayes.estimators.waveform.averaged import answered
from friction_bayes.estimators.waveform.estimator import WaveformEstimator
from friction_bayes.loop.infer.draws import DRAWS
from friction_bayes.loop.report.friction_range import Reading

__all__ = ["filtered_signal"]


def filtered_signal(decay: FreeDecay, rng: np.random.Generator) -> Reading | None:
    """Friction of a record that has gone through a filter, by dry friction alone.

    No candidate of the loop has turning points of the shape that a filter gives them: forces that are not
    there stand for it, and friction goes with these.

    Parameters
    ----------
    decay : FreeDecay
        The moving part of the record.
    rng : numpy.random.Generator

    Returns
    -------
    Reading or None
        None where the estimate finds no such thing, where the amplitudes fall as under damping, or where
        nothing can be estimated.
    """
    faster = faster_loss(decay)
    if faster is not None and faster.probability > 0.5:
        return None
    estimator = WaveformEstimator()
    prior = complete_prior(estimator.name, estimator.default_prior(decay), None)
    try:
        decay, fit = answered(decay, partial(estimator.fit, prior=prior, peaks=PEAKS[0]))
    except InputError:
        return None
    if not fit.seems_filtered or fit.surely_negative:
        return None
    factor = force_factor(decay.system, decay.quantity, decay.unit)
    friction = factor * np.asarray(fit.answer.ppf(rng.random(DRAWS)))
    return Reading("dry friction alone, behind a filter", friction)
