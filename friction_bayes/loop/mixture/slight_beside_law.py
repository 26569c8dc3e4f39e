"""Damping and drift too slight to show, in addition to the laws drawn along measured motions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.infer.drawn_laws import DrawnLaws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.mixture.slight_effects import SlightEffect, slight_beside, with_slight_effects

__all__ = ["friction_with_slight_effects", "slight_effects_of"]


def friction_with_slight_effects(laws: DrawnLaws, fit: LawFit, rng: np.random.Generator) -> Array:
    """Draws of friction [N or N m], shape (k,), with the uncertainty from slight effects included.

    See :mod:`friction_bayes.loop.mixture.slight_effects`.

    Parameters
    ----------
    laws : DrawnLaws
    fit : LawFit
        From which they were drawn.
    rng : numpy.random.Generator
    """
    friction = laws.friction.copy()
    kinds, kind = np.unique(np.column_stack([laws.first.point, laws.row]), axis=0, return_inverse=True)
    for i, (g, row) in enumerate(kinds):
        mine = kind.ravel() == i
        friction[mine] = with_slight_effects(friction[mine], slight_effects_of(fit, int(g), int(row)), rng)
    return friction


def slight_effects_of(fit: LawFit, g: int, row: int) -> Iterator[SlightEffect]:
    """The nuisances in addition to a set of the posterior at a point, except what is each record's own."""
    problem, law, point = fit.problem, fit.law, fit.posterior.points[g]
    columns, effects = problem.sets[row], fit.sets.effects[problem.number[row]]
    prior = point.found.full_noise2 / float(point.found.noise2[row])
    rubs = columns & np.isin(np.arange(columns.size), law.frictions)
    if not rubs.any():
        return
    for name in slight_beside(effects):
        for j in chain(*law.alternatives(name)):
            if problem.own[j]:
                continue
            beside = columns.copy()
            beside[j] = True
            mean, covariance = problem.shared_posterior(point, row, beside)
            own, friction = (int(np.count_nonzero(beside[:c])) for c in (j, int(np.flatnonzero(rubs)[0])))
            variance = float(covariance[own, own])
            information = 1.0 / variance - prior
            if information > 0.0:
                follow = float(covariance[own, friction]) / variance * law.scale[rubs][0] * law.unit_force
                support = (0.0 if law.positive[j] else -math.inf, math.inf)
                estimate = float(mean[own]) / (variance * information)
                yield SlightEffect.of_likelihood(estimate, information, support, follow, effects)
