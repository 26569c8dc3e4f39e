"""The registry of estimators for ``estimate``, ``estimate_batch`` and ``sample_reference``."""

from __future__ import annotations

from friction_bayes.core.errors import unknown_name
from friction_bayes.estimators.base import Estimator
from friction_bayes.estimators.envelope.estimator import EnvelopeEstimator
from friction_bayes.estimators.paper_methods import GammaExponentialEstimator, NormalGammaEstimator
from friction_bayes.estimators.waveform.estimator import WaveformEstimator

__all__ = ["ESTIMATORS", "estimator_named", "register"]

ESTIMATORS: dict[str, Estimator] = {}
"""By name."""


def register(estimator: Estimator) -> None:
    """Add an estimator under its name."""
    ESTIMATORS[estimator.name] = estimator


for _built_in in (WaveformEstimator, EnvelopeEstimator, NormalGammaEstimator, GammaExponentialEstimator):
    register(_built_in())


def estimator_named(method: str) -> Estimator:
    """Return the estimator of a name.

    Raises
    ------
    InputError
        If there is no estimator of that name.
    """
    if method not in ESTIMATORS:
        raise unknown_name("method", "method", method, ESTIMATORS)
    return ESTIMATORS[method]
