"""The closed-form fit of a decay under white noise, which its start and its end are judged by."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.friction_samples import PEAKS
from friction_bayes.estimators.base import Fit
from friction_bayes.estimators.waveform.estimator import WaveformEstimator

__all__ = ["fit_of"]


def fit_of(decay: FreeDecay) -> Callable[[FreeDecay], Fit]:
    """How a decay, or a part of it, is fitted by method ``waveform`` with its default prior."""
    estimator = WaveformEstimator()
    return partial(estimator.fit, prior=estimator.default_prior(decay), peaks=PEAKS[0])
