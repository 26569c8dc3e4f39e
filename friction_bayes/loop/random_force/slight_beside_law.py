"""Damping and drift too slight to show, beside the laws drawn along a measured motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.estimators.random_force.subsets import set_posterior
from friction_bayes.loop.random_force.draws import LawDraws
from friction_bayes.loop.slight_effects import SlightEffect, slight_beside, with_slight_effects

__all__ = ["friction_with_slight_effects"]


def friction_with_slight_effects(draws: LawDraws, rng: np.random.Generator) -> Array:
    """Draws of friction [N or N m], shape (k,), that answer for slight effects too.

    See :mod:`friction_bayes.loop.slight_effects`.
    """
    friction = draws.friction.copy()
    kinds, kind = np.unique(np.column_stack([draws.point, draws.chosen]), axis=0, return_inverse=True)
    for i, (g, m) in enumerate(kinds):
        mine = kind.ravel() == i
        friction[mine] = with_slight_effects(friction[mine], _beside(draws, int(g), int(m)), rng)
    return friction


def _beside(draws: LawDraws, g: int, m: int) -> Iterator[SlightEffect]:
    """The nuisances beside a set at a point of the grid."""
    fit = draws.fit
    law, point, columns = fit.law, fit.posterior.points[g], fit.sets.columns[m]
    rubs = columns & np.isin(np.arange(columns.size), law.frictions)
    if not rubs.any():
        return
    gram = fit.regression.whiten_at(point.ratio, point.tau).gram
    for name in slight_beside(fit.sets.effects[m]):
        for j in chain(*law.alternatives(name)):
            beside = columns.copy()
            beside[j] = True
            mean, covariance = set_posterior(
                gram,
                fit.regression.reference,
                beside,
                point.found.full_noise2,
                float(point.found.noise2[m]),
            )
            own, friction = (int(np.count_nonzero(beside[:c])) for c in (j, int(np.flatnonzero(rubs)[0])))
            variance = float(covariance[own, own])
            # without the prior of the coefficient, a standard normal
            information = 1.0 / variance - 1.0
            if information > 0.0:
                follow = float(covariance[own, friction]) / variance * law.scale[rubs][0] * law.unit_force
                support = (0.0 if law.positive[j] else -math.inf, math.inf)
                estimate = float(mean[own]) / (variance * information)
                yield SlightEffect.of_likelihood(estimate, information, support, follow, fit.sets.effects[m])
