"""Whether a record is better described by a force that fluctuates than by noise in the sensor alone."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.loop.candidate import SearchResult
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.noise import LEAST_NOISE
from friction_bayes.loop.random_force.fit import ForceFit, fit_random_force
from friction_bayes.loop.residual_tests import residual_tests
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["fluctuating_force"]

_LARGEST_SHARE = 1.0
"""Sd of a random force over friction above which it is no fluctuation of it, but stands for the unknown."""

_CLEAR = 3.0
"""Log odds of a random force from which on it is kept although white noise passes every test."""


def fluctuating_force(found: SearchResult, allowed: tuple[str, ...]) -> ForceFit | None:
    """Look for a random force beside what the search found.

    It is kept where the evidence is for it, against none in the same law: where noise in the sensor, white or
    coloured, explains the record, that has to be clear and the search's candidates worse by Schwarz's
    criterion on the same samples; so too where they have outliers, which are no column.

    Returns
    -------
    ForceFit or None
        None where a random force is not the better description.
    """
    best, white = found.fits[0], found.white
    silent = white.noises[0].sd <= LEAST_NOISE * white.model.scales.signal
    if silent or SENSOR_CLIPPING.name in found.sets[0]:
        return None
    passes = not residual_tests(best).failed
    line = None
    if PERIODIC_INTERFERENCE.name in white.model.effects:
        line = float(white.model.value(white.z, "frequency", effect=PERIODIC_INTERFERENCE.name, record=0))
    fit = fit_random_force(white.model.segments[0], white.model.system, allowed, line=line)
    least = _CLEAR if passes and white is best else 0.0
    if fit is None or fit.log_gain <= least or fit.share_of_friction > _LARGEST_SHARE:
        return None
    if not passes and OUTLIERS.name not in found.sets[0]:
        return fit
    rivals = [white, best] if passes else [white]
    return fit if _score(fit) > max(_score_of_search(rival, fit.samples) for rival in rivals) else None


def _score(fit: ForceFit) -> float:
    """Log likelihood of the best law and force, less Schwarz's price of its parameters."""
    best, n = fit.posterior.best, int(np.count_nonzero(np.isfinite(fit.clock.variance)))
    log_determinant = fit.posterior.problem.whiten_at(best.ratio, best.tau).log_determinant
    variance = 2.0 * math.pi * (best.noise * fit.unit) ** 2
    parameters = int(fit.sets.columns[fit.chosen].sum()) + 2
    square = float(np.sum(fit.innovations**2))
    return -0.5 * (n * math.log(variance) + square + log_determinant + parameters * math.log(n))


def _score_of_search(fit: LoopFit, samples: int) -> float:
    """The same of a candidate of the search, on as many samples."""
    counted = int(np.count_nonzero(fit.noises[0].weight > 0.0))
    parameters = fit.z.size + fit.noise_models[0].ar.size + 2 * fit.noise_models[0].outliers
    return -0.5 * (fit.deviance * samples / counted + parameters * math.log(samples))
