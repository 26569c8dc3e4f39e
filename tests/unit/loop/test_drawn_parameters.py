"""Draws of the parameters of effects, each beside the friction that was drawn with it."""

from __future__ import annotations

import numpy as np

from friction_bayes.loop.random_force.draws import law_draws
from unsteady_decays import bent_record, fitted


def test_a_parameter_is_drawn_with_the_law_that_it_shapes(rng: np.random.Generator) -> None:
    """The parameter of a draw lies in the part of the prior that its own set of columns stands for."""
    fit = fitted(bent_record(rng, 0.0), ("viscous_damping", "presliding", "stribeck_friction"))
    # weights of the prior, so that every shape is drawn at several sizes of the force
    weight = np.ones_like(fit.posterior.weight) * np.exp(fit.sets.log_prior)
    draws = law_draws(fit, rng, 4000, weight)
    for effect in ("presliding", "stribeck_friction"):
        having = np.array([effect in fit.sets.effects[row] for row in draws.chosen])
        shapes = []
        for row in draws.chosen[having]:
            held = [fit.law.columns[j] for j in np.flatnonzero(fit.sets.columns[row])]
            shapes.append(next(c.shape[0] for c in held if c.effect == effect))
        assert len(set(shapes)) > 3
        drawn = draws.parameters(effect, np.ones(having.size, np.bool_))[shapes[0].name]
        assert drawn.size == len(shapes)
        low, high = np.array([(shape.low, shape.high) for shape in shapes]).T
        assert np.all((low <= drawn) & (drawn <= high))
