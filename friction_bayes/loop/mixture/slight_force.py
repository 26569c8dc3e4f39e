r"""A random force too slight for a record to show, whose uncertainty friction must include.

A random force hidden by the sensor noise moves friction by several times as much as that noise, since the
record averages the noise over its samples and the force over far fewer correlation times. So every candidate
without a random force has one as a nuisance, as it has slight damping and drift
(:mod:`friction_bayes.loop.mixture.slight_effects`): present with the same prior probability, of the sizes and
correlation times under which the law is as probable as without a force to within two nats. Nothing else of a
candidate changes, nor its probability: a force that a record shows makes a candidate of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit, softmax

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings
from friction_bayes.loop.infer.law_fit import LawFit

__all__ = ["SlightForce", "slight_force"]


@dataclass(frozen=True)
class SlightForce:
    """A random force as a nuisance in addition to a candidate without one.

    Attributes
    ----------
    probability : float
        That it acts.
    shift, sd : float
        Change of the mean of friction where it acts, and an independent error [N or N m].
    """

    probability: float
    shift: float
    sd: float

    def beside(self, friction: Array, rng: np.random.Generator) -> Array:
        """Draws of friction without a force, shape (k,), with this one added to some of them.

        A draw that would be negative stays where it is.
        """
        acts = rng.random(friction.size) < self.probability
        moved = friction + acts * (self.shift + self.sd * rng.standard_normal(friction.size))
        return np.where(moved >= 0.0, moved, friction)


def slight_force(fit: LawFit) -> SlightForce | None:
    """The force that records may hide, in addition to their most probable law without one.

    Returns
    -------
    SlightForce or None
        None where that law has no dry friction, or the records determine every force.
    """
    none = next(point for point in fit.posterior.points if point.ratio == 0.0)
    best = none.chosen
    rubs = np.flatnonzero(fit.problem.sets[best] & np.isin(np.arange(fit.law.scale.size), fit.law.frictions))
    if rubs.size == 0:
        return None
    j = int(rubs[0])
    said_at_most = 0.5 * settings.SETTINGS.unseen**2
    hidden = [
        point
        for point in fit.posterior.points
        if point.ratio > 0.0
        and abs(point.found.log_weight[best] - none.found.log_weight[best]) <= said_at_most
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
    unit = float(fit.law.scale[j]) * fit.law.unit_force
    return SlightForce(
        probability=float(expit(logit(settings.SETTINGS.nuisance) + math.log(bayes_factor))),
        shift=(middle - float(location[0])) * unit,
        sd=math.sqrt(max(added, 0.0)) * unit,
    )
