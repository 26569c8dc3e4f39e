"""Evidence along a motion in the conventions of a fit by simulation, to compare both."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import logsumexp

from experiments.simulation.fit import LoopFit
from friction_bayes.loop import settings
from friction_bayes.loop.data.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.noise_kinds import log_convention
from friction_bayes.loop.infer.record_fit import ForceFit

__all__ = ["log_evidence_without_force"]


def log_evidence_without_force(fit: ForceFit, white: LoopFit, effects: frozenset[str]) -> float:
    """Log evidence of a set of effects alone, by the regression in the conventions of a fit.

    With dry friction, which a fit always has, with outliers where these are most probable, and with noise
    that does not grow. The fit takes the noise at its best instead of integrating it, has its prior of the
    frequency about the declared one, and has the samples at rest too, which carry no information on the
    law: they change both alike.
    """
    rubs = fit.regression.sets[:, fit.law.frictions].any(axis=1)
    mine = rubs & np.array([names == effects for names in fit.sets])
    (alone,) = LawFit.of(fit).among((fit.posterior.ratio == 0.0)[:, None] & mine).fits
    if not np.all(np.isfinite(alone.coefficients)):
        # next to other sets without a force it cannot matter, so that its law was not looked at
        return -math.inf
    (point,) = alone.posterior.points
    # shapes taken about the best represent a part of their prior, which an evidence has whole
    shaped = (c for c in fit.law.columns if c.effect in effects and c.score != 0.0)
    part = sum({c.shape: c.weight for c in shaped}.values()) or 1.0
    weight = logsumexp(point.found.log_weight)
    prior = logsumexp(fit.regression.log_prior[mine]) - math.log(part)
    noise, n = fit.sensor_noise, int(np.count_nonzero(fit.clock.used))
    # the stiffness is corrected about what the record shows, in units of half as much frequency
    unit = 0.5 * settings.SETTINGS.stiffness_sd / settings.SETTINGS.frequency_sd
    score = float(white.z[white.model.index(LOG_FREQUENCY_RATIO)])
    value = log_convention(n, fit.unit) + math.log(unit) - 0.5 * score**2
    densities = white.noise_models[0].log_densities(white.residuals[0], fit.segment, white.noises[0])
    value += float(densities[fit.record.samples :].sum())
    used = fit.clock.used
    left = fit.left_out(alone.coefficients, point)
    value += left.log_factor(used, outliers=noise.outliers is not None)
    return float(weight - prior) + value
