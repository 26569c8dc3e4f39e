r"""Evidence along the measured motion on the scale of the search's, so that one posterior can hold both.

Both are densities of the same samples with the priors of the catalogue, and differ in conventions. The
search takes the noise at its best instead of integrating it: with :math:`n` samples and a sum of squares
:math:`S` that is

.. math:: \log\int\sigma^{-n} e^{-S/2\sigma^2}\,\frac{d\sigma^2}{\sigma^2}
          = \tfrac n2\log\frac2S + \log\Gamma(\tfrac n2)
          \quad\text{against}\quad -\tfrac n2\log\frac{2\pi S}{n} - \tfrac n2;

its prior of the frequency is about the declared one, and it has the samples at rest besides. Those say
nothing about the law: they are worth the same to both, what the search's best candidate says of them. White
noise that stands for a wrong law is far too large for them.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import logsumexp

from friction_bayes.loop import settings
from friction_bayes.loop.data.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.infer.sensor_noise import log_convention
from friction_bayes.loop.noise.correlated_error import NO_ERROR
from friction_bayes.loop.noise.likelihood import log_densities
from friction_bayes.loop.noise.robust_samples import LeftOut
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.loop.search.laplace_evidence import log_evidence

__all__ = ["log_evidence_without_force", "log_scale"]


def log_scale(fit: ForceFit, white: LoopFit, best: LoopFit) -> float:
    """Logarithm of the factor from weights along the measured motion to evidences under white noise alone.

    Where the regression has more evidence than the search for one law without a force, the approximations
    differ and not the hypotheses: that much is taken off. (The jumps of an accelerometer's signal do it: the
    search's posterior has corners there.) Where it has less, its columns are not exact enough, for which a
    force could make up: then nothing is added. With a knock, which the search knows nothing of, the
    hypotheses do differ.

    Parameters
    ----------
    fit : ForceFit
    white : LoopFit
        The most probable of the search under white noise.
    best : LoopFit
        The most probable of the search, under whichever noise it has.
    """
    scale = _log_convention(fit, white, best) + fit.sensor_noise.log_scale
    effects = frozenset(white.model.effects)
    same_noise = white.noise_models[0].outliers == fit.sensor_noise.contaminated and fit.error == NO_ERROR
    if fit.knocks or not same_noise or effects not in fit.sets.effects:
        return scale
    excess = log_evidence_without_force(fit, white, effects) - log_evidence(white)
    return scale - max(excess, 0.0)


def log_evidence_without_force(fit: ForceFit, white: LoopFit, effects: frozenset[str]) -> float:
    """Log evidence of a set of effects alone, by the regression in the search's conventions.

    With dry friction, which the search always has, and with outliers where these are most probable.
    """
    mine = fit.rubs & np.array([names == effects for names in fit.sets.effects])
    alone = fit.among((fit.posterior.ratio == 0.0)[:, None] & mine)
    if not np.all(np.isfinite(alone.coefficients)):
        # beside other sets without a force it cannot matter, so that its law was not looked at
        return -math.inf
    (point,) = alone.posterior.points
    weight, prior = logsumexp(point.found.log_weight), logsumexp(fit.sets.log_prior[mine])
    noise, value = fit.sensor_noise, _log_convention(fit, white, white)
    used = np.isfinite(fit.clock.variance)
    left = LeftOut.under(fit.segment, fit.scales, fit.regression, fit.w0, alone.coefficients, point)
    value += left.log_factor(used, outliers=noise.contaminated)
    if noise.growth is not None and noise.growth.found:
        value += noise.growth.log_scale
    return float(weight - prior) + value


def _log_convention(fit: ForceFit, white: LoopFit, at_rest: LoopFit) -> float:
    """What the conventions make: a fit says what rest is worth, the white one its prior of the frequency."""
    n = int(np.count_nonzero(np.isfinite(fit.clock.variance)))
    # the stiffness is corrected about what the record shows, in units of half as much frequency
    unit = 0.5 * settings.SETTINGS.stiffness_sd / settings.SETTINGS.frequency_sd
    score = float(white.z[white.model.index(LOG_FREQUENCY_RATIO)])
    value = log_convention(n, fit.unit) + math.log(unit) - 0.5 * score**2
    model, noise = at_rest.noise_models[0], at_rest.noises[0]
    densities = log_densities(at_rest.residuals[0], fit.segment.sides, model, noise)
    return value + float(densities[fit.samples :].sum())
