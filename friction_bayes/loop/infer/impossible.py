"""Sets of effects beyond what their priors allow.

Sizes outside their support, friction that pushes, a sensor that hides the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.columns.effect_columns import LawColumn
from friction_bayes.loop.columns.law_columns import LawColumns
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.statespace.force_grid import Posterior, integrate_force
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint

__all__ = ["better_but_impossible", "impossible", "integrate_possible"]

_NEGLIGIBLE = 1e-3
"""Probability of sets that need not be looked at."""
_AT_ONCE = 64
"""Sets that are looked at together at most."""
_HIDDEN = 0.5
"""Share of the signal that sensor effects cancel where they hide the motion: at one nothing is left of it."""


def integrate_possible(found: LawAlongMotion, prior: ForcePrior, near: GridPoint | None = None) -> Posterior:
    """Posterior of a law at its mode, given that the best set is possible: no impossible one would be better.

    A force ``near`` the most probable one may be known.
    """
    problem = found.problem
    while True:
        posterior = integrate_force(problem, prior, near=near, only_mode=True)
        better = better_but_impossible(found, posterior)
        if not better.any():
            return posterior
        problem = problem.without(better)


def better_but_impossible(found: LawAlongMotion, posterior: Posterior) -> Mask:
    """Impossible sets that are more probable than the best possible one, shape (m,).

    And those that are so without these at the most probable force: to integrate again is costly.
    """
    place, beyond = posterior.best, np.zeros(len(found.regression.sets), np.bool_)
    while (ahead := _ahead(found, posterior)).any():
        beyond |= ahead
        problem = posterior.problem.without(ahead)
        again = replace(place, found=problem.evaluate(place.ratio, place.tau))
        posterior = Posterior(problem, [again])
    return beyond


def _ahead(found: LawAlongMotion, posterior: Posterior) -> Mask:
    """Impossible sets that come before the first possible one, shape (m,)."""
    ahead = np.zeros(len(found.regression.sets), np.bool_)
    for k, possible in _judged(found, posterior):
        if possible:
            break
        ahead[k] = True
    return ahead


def impossible(found: LawAlongMotion, posterior: Posterior) -> Mask:
    """Sets, shape (m,), of sizes outside their support, or in which friction pushes or a sensor hides motion.

    In the regression a dependence of friction is a force of its own, with a prior in units of the friction
    that explains the loss of amplitude; where dry friction is small, it may exceed this and change the sign.
    A sensor effect that follows the motion is a column along the smoothed signal, which a large negative
    coefficient cancels, beyond the range where the columns are linear in it. The sets are tested from the
    most probable on, until the rest is negligible.
    """
    beyond = np.zeros(len(found.regression.sets), np.bool_)
    total = posterior.weight.sum(axis=0)
    left = kept = float(total.sum())
    for k, possible in _judged(found, posterior):
        beyond[k] = not possible
        left -= float(total[k])
        kept -= 0.0 if possible else float(total[k])
        if left < _NEGLIGIBLE * kept:
            break
    return beyond


def _judged(found: LawAlongMotion, posterior: Posterior) -> Iterator[tuple[int, bool]]:
    """Sets that have been evaluated and whether they are possible, the most probable first."""
    weight = posterior.weight
    total, at = weight.sum(axis=0), weight.argmax(axis=0)
    order = np.argsort(-total)[: np.count_nonzero(total)]
    # each judges laws (k, p), shape (k,)
    outside, pushes, hides = _outside(found.law), _pushes(found), _hides(found.law)
    start, some = 0, 1
    while start < order.size:
        # the first are often all that is looked at
        sets = order[start : start + some]
        laws = np.array([posterior.mean_law(posterior.points[at[k]], k) for k in sets.tolist()])
        yield from zip(sets.tolist(), ~(outside(laws) | pushes(laws) | hides(laws)), strict=True)
        start, some = start + some, min(2 * some, _AT_ONCE)


def _outside(law: LawColumns) -> Callable[[Array], Mask]:
    """Whether a parameter of laws lies outside what it may be; the regression knows its sign alone."""
    support = [_support(column) for column in law.columns]
    bounded = np.array([k for k, ends in enumerate(support) if np.isfinite(ends).any()], np.intp)
    low, high = np.array(support)[bounded].T
    of_friction = np.array([law.columns[k].of_friction for k in bounded], np.bool_)

    def judged(laws: Array) -> Mask:
        values, friction = laws[:, bounded], laws[:, law.frictions].sum(axis=1) * law.unit_force
        # in units of the friction that the columns assume; without dry friction there is none to compare with
        scale = np.divide(law.friction, friction, out=np.zeros_like(friction), where=friction > 0.0)
        values = np.where(of_friction, values * scale[:, None], values)
        return np.asarray(((values < low) | (values > high)).any(axis=1))

    return judged


def _support(column: LawColumn) -> tuple[float, float]:
    """Least and largest value of the parameter that a column has as its coefficient."""
    if column.kind != "effect" or column.line is not None:
        return -np.inf, np.inf
    (parameter,) = (each for each in EFFECTS[column.effect].parameters if each.name == column.parameter)
    return parameter.low, parameter.high


def _pushes(found: LawAlongMotion) -> Callable[[Array], Mask]:
    """Whether the dry friction of laws pushes for a part of the way."""
    law, path = found.law, found.path
    rubs = np.array([column.kind == "friction" or column.of_friction for column in law.columns])
    power = (-path.expected_direction * np.abs(path.v))[:, None] * law.forces[:, rubs]

    def judged(laws: Array) -> Mask:
        work = power @ laws[:, rubs].T
        size = np.abs(work).sum(axis=0)
        pushed = 0.5 * (size - work.sum(axis=0))
        return np.asarray(pushed > settings.SETTINGS.minor_share * size)

    return judged


def _hides(law: LawColumns) -> Callable[[Array], Mask]:
    """Whether the effects of a sensor take away, or add, half of the signal."""
    of_sensor = law.of_sensor_effects
    signal = law.read.values - law.read.values.mean()
    shares = signal @ law.sensor[:, of_sensor] / float(signal @ signal)

    def judged(laws: Array) -> Mask:
        return np.asarray(np.abs(laws[:, of_sensor] @ shares) > _HIDDEN)

    return judged
