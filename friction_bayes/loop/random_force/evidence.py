r"""Evidence along the measured motion on the scale of the search's, so that one posterior can hold both.

Both are densities of the same samples with the priors of the catalogue, and differ in conventions. The
search takes the noise at its best instead of integrating it: with :math:`n` samples and a sum of squares
:math:`S` that is

.. math:: \log\int\sigma^{-n} e^{-S/2\sigma^2}\,\frac{d\sigma^2}{\sigma^2}
          = \tfrac n2\log\frac2S + \log\Gamma(\tfrac n2)
          \quad\text{against}\quad -\tfrac n2\log\frac{2\pi S}{n} - \tfrac n2;

its prior of the frequency is about the declared one, and it has the samples at rest besides.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import logsumexp

from friction_bayes.loop.candidate import INCLUSION
from friction_bayes.loop.evidence import log_evidence
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.noise import log_densities
from friction_bayes.loop.parameters import FREQUENCY_SD, LOG_FREQUENCY_RATIO
from friction_bayes.loop.random_force.columns import STIFFNESS_SD
from friction_bayes.loop.random_force.fit import ForceFit

__all__ = ["log_evidence_without_force", "log_scale"]


def log_scale(fit: ForceFit, white: LoopFit) -> float:
    """Logarithm of the factor from weights along the measured motion to evidences without noise that grows.

    Where the regression has more evidence than the search for one law without a force, the approximations
    differ and not the hypotheses: that much is taken off. (The jumps of an accelerometer's signal do it: the
    search's posterior has corners there.) Where it has less, its columns are not exact enough, for which a
    force could make up: then nothing is added.

    Parameters
    ----------
    fit : ForceFit
    white : LoopFit
        The most probable of the search under white noise.
    """
    effects = frozenset(white.model.effects)
    if white.noise_models[0].outliers or effects not in fit.sets.effects:
        return _log_convention(fit, white)
    excess = log_evidence_without_force(fit, white, effects) - log_evidence(white)
    return _log_convention(fit, white) - max(excess, 0.0)


def log_evidence_without_force(fit: ForceFit, white: LoopFit, effects: frozenset[str]) -> float:
    """Log evidence of a set of effects alone, by the regression in the search's conventions.

    With dry friction, which the search always has.
    """
    rubs = np.asarray(fit.sets.columns[:, fit.law.frictions].any(axis=1))
    mine = [m for m, names in enumerate(fit.sets.effects) if names == effects and rubs[m]]
    point = fit.posterior.points[int(np.argmin(fit.posterior.ratio))]
    weight, prior = logsumexp(point.found.log_weight[mine]), logsumexp(fit.sets.log_prior[mine])
    return float(weight - prior) + _log_convention(fit, white)


def _log_convention(fit: ForceFit, white: LoopFit) -> float:
    """What the conventions make: the search's fit says what rest is worth, and its prior of the frequency."""
    n = int(np.count_nonzero(np.isfinite(fit.clock.variance)))
    value = -0.5 * n * (math.log(4.0 * math.pi / n) + 1.0) - n * math.log(fit.unit)
    # the stiffness is corrected about what the record shows, in units of half as much frequency
    score = float(white.z[white.model.index(LOG_FREQUENCY_RATIO)])
    value += math.log(0.5 * STIFFNESS_SD / FREQUENCY_SD) - 0.5 * score**2
    sides, noise_model = fit.segment.sides, white.noise_models[0]
    densities = log_densities(white.residuals[0], sides, noise_model, white.noises[0])
    value += float(densities[fit.samples :].sum())
    if fit.growth is not None and fit.growth.found:
        # the weights are then those with its size at its best
        value += fit.growth.log_volume + math.log(INCLUSION / (1.0 - INCLUSION)) - fit.growth.log_odds
    return value
