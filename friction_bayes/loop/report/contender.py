"""A law found along the measured motion as a model that predicts a further record."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import (
    DISPLACEMENT,
    FRICTION,
    LOG_FREQUENCY_RATIO,
    VELOCITY,
    Coordinate,
)
from friction_bayes.loop.infer.law_draws import DrawnLaws
from friction_bayes.loop.report.next_experiment import Contender
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.statespace.regression import frequency_change

__all__ = ["drawn_contender"]


def drawn_contender(laws: DrawnLaws, chosen: Mask) -> Contender | None:
    """The candidate of some draws, ``chosen`` of shape (k,); None where they are too few.

    Its law is their mean, in the most frequent shape of each effect; state and sensor are those of the first
    record. Where friction differs between the records it would in a further one too.
    """
    draws, fit = laws.first, laws.first.fit
    if np.count_nonzero(chosen) < 2:
        return None
    shape = int(np.argmax(np.bincount(draws.chosen[chosen])))
    mine = chosen & (draws.chosen == shape)
    if np.count_nonzero(mine) < 2:
        return None
    names = fit.sets.effects[shape]
    model = LoopModel(fit.record.system, (fit.segment,)).with_effects(names)
    declared = fit.w0 / fit.record.system.natural_frequency
    change = np.array([frequency_change(kappa) for kappa in draws.stiffness[mine]])
    values = {
        ("", FRICTION): laws.friction[mine],
        ("", LOG_FREQUENCY_RATIO): np.log(declared * change),
        ("", DISPLACEMENT): draws.coefficients[mine, 0],
        ("", VELOCITY): draws.coefficients[mine, 1] * fit.w0,
    } | {
        (name, parameter): drawn
        for name in names
        for parameter, drawn in _of_model(name, draws.parameters(name, mine)).items()
    }
    count = int(np.count_nonzero(mine))
    z = np.column_stack([_coordinates(c, values.get((c.effect, c.name)), count) for c in model.coordinates])
    covariance, rubs = np.cov(z, rowvar=False), model.index(FRICTION)
    covariance[rubs, rubs] += np.mean((laws.spread[mine] / model.coordinates[rubs].prior.scale) ** 2)
    return Contender(
        model=model,
        z=z.mean(axis=0),
        covariance=covariance,
        noise_sd=fit.noise_sd,
        random_force=float(np.median(draws.random_force[mine])),
        correlation_time=float(np.median(draws.correlation_time[mine])),
    )


def _of_model(name: str, drawn: dict[str, Array]) -> dict[str, Array]:
    """Parameters as in the simulated model: a line of interference by amplitude and phase."""
    if name != PERIODIC_INTERFERENCE.name:
        return drawn
    sine, cosine = float(drawn["sine"].mean()), float(drawn["cosine"].mean())
    return {
        "frequency": np.full_like(drawn["sine"], drawn["frequency"].mean()),
        "amplitude": np.full_like(drawn["sine"], math.hypot(sine, cosine)),
        "phase": np.full_like(drawn["sine"], math.atan2(cosine, sine)),
    }


def _coordinates(c: Coordinate, values: Array | None, count: int) -> Array:
    """A parameter's draws in its coordinate, shape (count,)."""
    if values is None:
        return np.full(count, c.start)
    return np.array([c.coordinate(float(value)) for value in values])
