r"""The shift of friction if the priors of the effects had another scale, or other odds.

Coefficients of effects are normal, scaled by the set-up. Were all priors :math:`f` times as wide, a draw with
:math:`n` coefficients whose squares add up to :math:`S` variances of the prior would have the weight

.. math:: f^{-n} \exp\left(-\tfrac12 S (f^{-2} - 1)\right)

(importance weights, Kallioinen et al., Stat. Comput. 34, 2024). With another number of effects
expected, the weight of a draw is the ratio of the prior probabilities of its set among the effects evaluated.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import special

from friction_bayes.loop.mixture.mixture import CandidateMixture
from friction_bayes.mechanics.effects.inclusion import EXPECTED, log_probability

__all__ = ["prior_sensitivity"]

_FACTORS = (0.1, 10.0)
_EXPECTED = {"inclusion_halved": 0.5 * EXPECTED, "inclusion_doubled": 2.0 * EXPECTED}
_LEAST_DRAWS = 50.0
"""Effective number of draws below which no value is reported."""
_LARGEST_ERROR = 0.1
"""Monte Carlo error of a shift, in standard deviations of friction, above which no value is reported."""


def prior_sensitivity(mixture: CandidateMixture, evaluated: int) -> dict[str, float | None]:
    """Shift of friction's mean in its own standard deviations.

    By the factor on the scale of the priors, and with half and twice the number of effects expected.

    None where too few of the draws would count, or a few far ones too much: the posterior with those priors
    lies elsewhere. Nuisances too slight to show (:mod:`friction_bayes.loop.mixture.slight_effects`) keep
    their size.

    Parameters
    ----------
    mixture : CandidateMixture
    evaluated : int
        Number of effects that its sets are of.
    """
    # effects that are certain are in all sets, and make one factor; a draw without a set counts as of none
    effects = np.append([len(names) for names in mixture.sets], 0)[mixture.candidate]
    ratios = {
        f"{factor:g}": -mixture.coefficients * math.log(factor) - 0.5 * mixture.squares * (factor**-2 - 1.0)
        for factor in _FACTORS
    } | {
        name: log_probability(effects, evaluated, expected) - log_probability(effects, evaluated)
        for name, expected in _EXPECTED.items()
    }
    sd = float(mixture.friction.std(ddof=1))
    found: dict[str, float | None] = {}
    for name, log_ratio in ratios.items():
        weight = special.softmax(log_ratio)
        mean = float(weight @ mixture.friction)
        error = float(np.linalg.norm(weight * (mixture.friction - mean)))
        enough = 1.0 / float(weight @ weight) > _LEAST_DRAWS and error < _LARGEST_ERROR * sd
        found[name] = (mean - float(mixture.friction.mean())) / sd if enough else None
    return found
