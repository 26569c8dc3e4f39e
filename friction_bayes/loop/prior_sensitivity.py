r"""By how much friction would move if the priors of the effects had another scale.

Coefficients of effects are normal with a standard deviation that the set-up suggests. Were all of them
:math:`f` times as wide, a draw with :math:`n` coefficients whose squares add up to :math:`S` variances of the
prior would count

.. math:: f^{-n} \exp\left(-\tfrac12 S (f^{-2} - 1)\right)

times as much: importance weights of the draws that there are (Kallioinen et al., Stat. Comput. 34, 2024).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import softmax

from friction_bayes.loop.family import FamilyDraws

__all__ = ["prior_sensitivity"]

_FACTORS = (0.1, 10.0)
_LEAST_DRAWS = 50.0
"""Effective number of draws below which nothing is said."""
_LARGEST_ERROR = 0.1
"""Monte Carlo error of a shift, in standard deviations of friction, above which nothing is said."""


def prior_sensitivity(draws: FamilyDraws) -> dict[str, float | None]:
    """Shift of friction's mean in its own standard deviations, by the factor on the scale of the priors.

    None where too few of the draws would count, or a few far ones too much: the posterior with those priors
    lies elsewhere. Nuisances too slight to show (:mod:`friction_bayes.loop.slight_effects`) keep their size.
    """
    sd = float(draws.friction.std(ddof=1))
    found: dict[str, float | None] = {}
    for factor in _FACTORS:
        log_ratio = -draws.coefficients * math.log(factor) - 0.5 * draws.squares * (factor**-2 - 1.0)
        weight = softmax(log_ratio)
        mean = float(weight @ draws.friction)
        error = float(np.linalg.norm(weight * (draws.friction - mean)))
        told = 1.0 / float(weight @ weight) > _LEAST_DRAWS and error < _LARGEST_ERROR * sd
        found[f"{factor:g}"] = (mean - float(draws.friction.mean())) / sd if told else None
    return found
