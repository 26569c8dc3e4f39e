r"""Effects and a random force too slight for a record to show, whose uncertainty friction must include.

A viscous damping of one of its standard deviations cannot be detected, and yet moves friction by several of
friction's own: over a decay that is cut before it rests, the two act nearly alike. So every candidate that
lacks one of these effects has it as a nuisance: present with the prior probability ``nuisance`` of the
settings (that of any effect where the candidate has another force of the catalogue), of a size of up to a few
of its standard deviations. Several records share one damping; their drifts, each record's own, are left out.
With the estimate :math:`\hat c` and standard deviation :math:`s` of its coefficient from the samples, the
candidate's parameters free,

.. math:: c \sim N(0, (2s)^2)

cut to its support, and no wider than the effect's own prior; friction follows it linearly. The support of
damping extends a little below zero: a gain of the sensor that rises within the record looks like damping that
drives the motion, and a nuisance of one sign would bias friction.

A random force hidden by the sensor noise moves friction by several times as much as that noise, since the
record averages the noise over its samples and the force over far fewer correlation times. So every candidate
without a random force has one as a nuisance too: present with the same prior probability, of the sizes and
correlation times under which the law is as probable as without a force to within two nats.

Nothing else of a candidate changes, nor its probability: what a record shows makes a candidate of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np
from scipy.special import expit, log_ndtr, logit, softmax

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings
from friction_bayes.loop.infer.law_draws import DrawnLaws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.normal_above import draws_above
from friction_bayes.mechanics.effects import EFFECTS, ForceEffect
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT
from friction_bayes.mechanics.effects.inclusion import inclusion
from friction_bayes.mechanics.effects.viscous_damping import VISCOUS_DAMPING

__all__ = [
    "SlightEffect",
    "SlightForce",
    "friction_with_slight_effects",
    "slight_force",
    "with_slight_effects",
]

_SLIGHT_EFFECTS = (VISCOUS_DAMPING.name, FRICTION_DRIFT.name)


@dataclass(frozen=True, eq=False)
class SlightEffect:
    """A nuisance in addition to a candidate, its coefficient in units of the effect's own prior.

    Attributes
    ----------
    probability : float
        That it acts, given the candidate.
    mean, sd : float
        Of the coefficient given that it acts, before it is cut.
    low : float
        Least value of the coefficient.
    follow : float
        Change of friction a unit of it [N or N m].
    """

    probability: float
    mean: float
    sd: float
    low: float
    follow: float

    @classmethod
    def of_likelihood(
        cls,
        estimate: float,
        information: float,
        follow: float,
        effects: Iterable[str],
        *,
        positive: bool,
    ) -> SlightEffect:
        """From mean and precision of the coefficient's likelihood, the candidate's own parameters integrated.

        Whether that of the effect is ``positive``, below which the nuisance goes, the change of friction a
        unit of it [N or N m] that would ``follow``, and the ``effects`` of the candidate.
        """
        low = -settings.SETTINGS.gain_rise if positive else -math.inf
        scale = min(settings.SETTINGS.unseen / math.sqrt(information), 1.0)
        variance = 1.0 / (information + scale**-2)
        mean, sd = variance * information * estimate, math.sqrt(variance)
        log_above = float(log_ndtr((mean - low) / sd) - log_ndtr(-low / scale))
        log_bayes_factor = math.log(sd / scale) + 0.5 * (mean / sd) ** 2 + log_above
        bent = any(isinstance(EFFECTS[name], ForceEffect) for name in effects)
        prior = inclusion() if bent else settings.SETTINGS.nuisance
        probability = float(expit(logit(prior) + log_bayes_factor))
        return cls(probability, mean, sd, low, follow)


def with_slight_effects(friction: Array, slight: Iterable[SlightEffect], rng: np.random.Generator) -> Array:
    """Draws of a candidate's friction, shape (k,), each nuisance acting on its share of them.

    Where one would make friction negative, friction is zero: damping alone explains the loss of amplitude.
    """
    for one in slight:
        low, mean, variance = (np.array([each]) for each in (one.low, one.mean, one.sd**2))
        coefficient = draws_above(low, mean, variance[:, None], rng, friction.size)[:, 0]
        acts = rng.random(friction.size) < one.probability
        moved = friction + acts * coefficient * one.follow
        friction = np.maximum(moved, 0.0)
    return friction


def friction_with_slight_effects(laws: DrawnLaws, fit: LawFit, rng: np.random.Generator) -> Array:
    """Draws of friction [N or N m], shape (k,), with the uncertainty from slight effects included."""
    friction = laws.friction.copy()
    kinds, kind = np.unique(np.column_stack([laws.first.point, laws.row]), axis=0, return_inverse=True)
    for i, (g, row) in enumerate(kinds):
        mine = kind.ravel() == i
        friction[mine] = with_slight_effects(friction[mine], slight_effects_of(fit, int(g), int(row)), rng)
    return friction


def slight_effects_of(fit: LawFit, g: int, row: int) -> Iterator[SlightEffect]:
    """The nuisances in addition to a set of the posterior at a point, except what is each record's own."""
    problem, law, point = fit.problem, fit.law, fit.posterior.points[g]
    columns, effects = problem.sets[row], fit.sets[problem.number[row]]
    prior = point.found.full_noise2 / float(point.found.noise2[row])
    rubs = columns & np.isin(np.arange(columns.size), law.frictions)
    if not rubs.any():
        return
    for name in _SLIGHT_EFFECTS:
        if effects & {name, *EFFECTS[name].excludes}:
            continue
        for j in chain(*law.alternatives(name)):
            if problem.own[j]:
                continue
            wider = columns.copy()
            wider[j] = True
            mean, covariance = problem.shared_posterior(point, row, wider)
            own, friction = (int(np.count_nonzero(wider[:c])) for c in (j, int(np.flatnonzero(rubs)[0])))
            variance = float(covariance[own, own])
            information = 1.0 / variance - prior
            if information > 0.0:
                follow = float(covariance[own, friction]) / variance * problem.scale[rubs][0] * law.unit_force
                estimate, positive = float(mean[own]) / (variance * information), bool(problem.positive[j])
                yield SlightEffect.of_likelihood(estimate, information, follow, effects, positive=positive)


@dataclass(frozen=True)
class SlightForce:
    """A random force as a nuisance in addition to a candidate without one, and the probability that it acts.

    It changes the mean of friction and adds an independent error [N or N m].
    """

    probability: float
    shift: float
    sd: float

    def added_to(self, friction: Array, rng: np.random.Generator) -> Array:
        """Draws of friction without a force, shape (k,), with this one added to some of them.

        A draw that would be negative stays where it is.
        """
        acts = rng.random(friction.size) < self.probability
        moved = friction + acts * (self.shift + self.sd * rng.standard_normal(friction.size))
        return np.where(moved >= 0.0, moved, friction)


def slight_force(fit: LawFit) -> SlightForce | None:
    """The force that records may hide, in addition to their most probable law without one.

    None where that law has no dry friction, or the records determine every force.
    """
    none = next(point for point in fit.posterior.points if point.ratio == 0.0)
    best = none.row
    rubs = [j for j in fit.law.frictions if fit.problem.sets[best, j]]
    if not rubs:
        return None
    j = rubs[0]
    unseen = 0.5 * settings.SETTINGS.unseen**2
    hidden = [
        point
        for point in fit.posterior.points
        if point.ratio > 0.0 and abs(point.found.log_weight[best] - none.found.log_weight[best]) <= unseen
    ]
    if not hidden:
        return None
    volume = softmax([point.log_volume for point in hidden])
    gain = np.exp([point.found.log_weight[best] - none.found.log_weight[best] for point in hidden])
    bayes_factor = float(volume @ gain)
    share = volume * gain / bayes_factor
    marginals = [fit.problem.marginals(point, best) for point in (none, *hidden)]
    location, scale2 = np.array(marginals)[:, :, j].T
    mean, variance = location[1:], scale2[1:]
    middle = float(share @ mean)
    added = float(share @ (variance + (mean - middle) ** 2)) - float(scale2[0])
    unit = float(fit.problem.scale[j]) * fit.law.unit_force
    return SlightForce(
        probability=float(expit(logit(settings.SETTINGS.nuisance) + math.log(bayes_factor))),
        shift=(middle - float(location[0])) * unit,
        sd=math.sqrt(max(added, 0.0)) * unit,
    )
