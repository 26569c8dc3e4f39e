"""Damping and drift too slight to show, in addition to the laws drawn along measured motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import chain

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop.columns.law_columns import LawColumns
from friction_bayes.loop.infer.drawn_laws import DrawnLaws
from friction_bayes.loop.infer.joint_fit import JointFit
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.mixture.slight_effects import SlightEffect, slight_beside, with_slight_effects
from friction_bayes.statespace.subset_evidence import set_posterior

__all__ = ["beside_joint_set", "beside_set", "friction_with_slight_effects"]


def friction_with_slight_effects(
    laws: DrawnLaws, beside: Callable[[int, int], Iterable[SlightEffect]], rng: np.random.Generator
) -> Array:
    """Draws of friction [N or N m], shape (k,), with the uncertainty from slight effects included.

    See :mod:`friction_bayes.loop.mixture.slight_effects`.

    Parameters
    ----------
    laws : DrawnLaws
    beside : callable, (point of the grid, set of the posterior) -> iterable of SlightEffect
        The nuisances in addition to that set.
    rng : numpy.random.Generator
    """
    friction = laws.friction.copy()
    kinds, kind = np.unique(np.column_stack([laws.first.point, laws.row]), axis=0, return_inverse=True)
    for i, (g, row) in enumerate(kinds):
        mine = kind.ravel() == i
        friction[mine] = with_slight_effects(friction[mine], beside(int(g), int(row)), rng)
    return friction


def beside_set(fit: ForceFit, g: int, m: int) -> Iterator[SlightEffect]:
    """The nuisances in addition to a set of one record at a point of the grid."""
    point = fit.posterior.points[g]
    gram = fit.regression.whiten_at(point.ratio, point.tau).gram
    columns, lam, noise2 = fit.sets.columns[m], point.found.full_noise2, float(point.found.noise2[m])

    def posterior(beside: Mask) -> tuple[Array, Array]:
        return set_posterior(gram, fit.regression.reference, beside, lam, noise2)

    return _beside(fit.law, fit.sets.effects[m], columns, np.ones_like(columns), lam / noise2, posterior)


def beside_joint_set(fit: JointFit, g: int, row: int) -> Iterator[SlightEffect]:
    """The nuisances in addition to a set of several records, except those that are each record's own."""
    problem, point, law = fit.problem, fit.posterior.points[g], fit.along[0].law
    effects = fit.along[0].sets.effects[problem.number[row]]
    prior = point.found.full_noise2 / float(point.found.noise2[row])

    def posterior(beside: Mask) -> tuple[Array, Array]:
        return problem.shared_posterior(point, row, beside)

    return _beside(law, effects, problem.sets[row], ~problem.own, prior, posterior)


def _beside(
    law: LawColumns,
    effects: frozenset[str],
    columns: Mask,
    offered: Mask,
    prior: float,
    posterior: Callable[[Mask], tuple[Array, Array]],
) -> Iterator[SlightEffect]:
    """The nuisances in addition to a set.

    Parameters
    ----------
    law : LawColumns
    effects : frozenset of str
        Of the set.
    columns, offered : ndarray of bool, shape (p,)
        Columns of the set, and those that a nuisance may have.
    prior : float
        Precision of a coefficient's prior.
    posterior : callable
        Mean and covariance of the coefficients in some columns, before they are cut at zero.
    """
    rubs = columns & np.isin(np.arange(columns.size), law.frictions)
    if not rubs.any():
        return
    for name in slight_beside(effects):
        for j in chain(*law.alternatives(name)):
            if not offered[j]:
                continue
            beside = columns.copy()
            beside[j] = True
            mean, covariance = posterior(beside)
            own, friction = (int(np.count_nonzero(beside[:c])) for c in (j, int(np.flatnonzero(rubs)[0])))
            variance = float(covariance[own, own])
            information = 1.0 / variance - prior
            if information > 0.0:
                follow = float(covariance[own, friction]) / variance * law.scale[rubs][0] * law.unit_force
                support = (0.0 if law.positive[j] else -math.inf, math.inf)
                estimate = float(mean[own]) / (variance * information)
                yield SlightEffect.of_likelihood(estimate, information, support, follow, effects)
