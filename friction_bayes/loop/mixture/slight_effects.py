r"""Damping and drift too slight for a record to show, whose uncertainty friction must include.

A viscous damping of one of its standard deviations cannot be detected, and yet moves friction by several of
friction's own: over a decay that is cut before it rests, the two act nearly alike. So every candidate that
lacks one of these effects has it as a nuisance: present with the prior probability ``nuisance`` of the
settings (that of any effect where the candidate has another force of the catalogue), of a size of up to a few
of its standard deviations. Several records share one: damping.
With the estimate :math:`\hat c` and standard deviation :math:`s` of its coefficient from the samples, the
candidate's parameters free,

.. math:: c \sim N(0, (2s)^2)

cut to its support, and no wider than the effect's own prior; friction follows it linearly. The support of
damping extends a little below zero: a gain of the sensor that rises within the record looks like damping that
drives the motion, and a nuisance of one sign would bias friction. Nothing else of a candidate changes, nor
its probability: an effect that a record shows makes a candidate of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit

from friction_bayes.core.arrays import Array
from friction_bayes.loop import settings
from friction_bayes.loop.infer.truncated_normal import log_interval_probability, truncated_draws
from friction_bayes.mechanics.effects import EFFECTS, ForceEffect
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT
from friction_bayes.mechanics.effects.inclusion import INCLUSION
from friction_bayes.mechanics.effects.viscous_damping import VISCOUS_DAMPING

__all__ = ["SlightEffect", "slight_beside", "with_slight_effects"]

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
    low, high : float
        Support of the coefficient.
    follow : float
        Change of friction a unit of it [N or N m].
    """

    probability: float
    mean: float
    sd: float
    low: float
    high: float
    follow: float

    @classmethod
    def of_likelihood(
        cls,
        estimate: float,
        information: float,
        support: tuple[float, float],
        follow: float,
        beside: Iterable[str],
    ) -> SlightEffect:
        """From the normal likelihood of the coefficient, the candidate's own parameters integrated.

        Parameters
        ----------
        estimate, information : float
            Mean and precision of the likelihood.
        support : tuple of float
            Of the effect's coefficient; that of the nuisance goes below zero.
        follow : float
            Change of friction a unit of it [N or N m].
        beside : iterable of str
            Effects of the candidate.
        """
        low, high = min(support[0], -settings.SETTINGS.gain_rise), support[1]
        scale = min(settings.SETTINGS.unseen / math.sqrt(information), 1.0)
        variance = 1.0 / (information + scale**-2)
        mean, sd = variance * information * estimate, math.sqrt(variance)
        ends = np.array([[low - mean, high - mean], [low, high]]) / np.array([[sd], [scale]])
        inside = log_interval_probability(ends[:, 0], ends[:, 1])
        log_bayes_factor = math.log(sd / scale) + 0.5 * (mean / sd) ** 2 + float(inside[0] - inside[1])
        bent = any(isinstance(EFFECTS[name], ForceEffect) for name in beside)
        prior = INCLUSION if bent else settings.SETTINGS.nuisance
        probability = float(expit(logit(prior) + log_bayes_factor))
        return cls(probability, mean, sd, low, high, follow)


def slight_beside(effects: Iterable[str]) -> list[str]:
    """Names of the nuisances in addition to a candidate with these effects."""
    present = set(effects)
    return [name for name in _SLIGHT_EFFECTS if not present & {name, *EFFECTS[name].excludes}]


def with_slight_effects(friction: Array, slight: Iterable[SlightEffect], rng: np.random.Generator) -> Array:
    """Draws of a candidate's friction, shape (k,), each nuisance acting on its share of them.

    Where one would make friction negative, friction is zero: damping alone explains the loss of amplitude.
    """
    for one in slight:
        coefficient = truncated_draws(
            np.array([one.mean]),
            np.array([[one.sd**2]]),
            np.array([one.low]),
            np.array([one.high]),
            rng,
            friction.size,
        )[:, 0]
        acts = rng.random(friction.size) < one.probability
        moved = friction + acts * coefficient * one.follow
        friction = np.maximum(moved, 0.0)
    return friction
