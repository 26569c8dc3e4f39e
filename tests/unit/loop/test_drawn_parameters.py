"""Draws of the parameters of effects, each with the friction that was drawn with it."""

from __future__ import annotations

import numpy as np

from friction_bayes.loop.infer.law_draws import draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from unsteady_decays import bent_record, fitted, ringing_record


def test_a_parameter_is_drawn_with_the_law_that_it_shapes(rng: np.random.Generator) -> None:
    """The parameter of a draw lies in the part of the prior that its own set of columns represents."""
    fit = fitted(bent_record(rng, 0.0), ("viscous_damping", "presliding", "stribeck_friction"))
    # weights of the prior, so that every shape is drawn at several sizes of the force
    weight = np.ones_like(fit.posterior.weight) * np.exp(fit.regression.log_prior)
    draws = draw_laws(LawFit.of(fit), rng, 4000, weight).first
    for effect in ("presliding", "stribeck_friction"):
        having = np.array([effect in fit.sets[row] for row in draws.set_index])
        shapes = []
        for row in draws.set_index[having]:
            held = [fit.law.columns[j] for j in np.flatnonzero(fit.regression.sets[row])]
            shapes.append(next(c.shape[0] for c in held if c.effect == effect))
        assert len(set(shapes)) > 2
        drawn = draws.parameters(effect, np.ones(having.size, np.bool_))[shapes[0].name]
        assert drawn.size == len(shapes)
        low, high = np.array([(shape.low, shape.high) for shape in shapes]).T
        assert np.all((low <= drawn) & (drawn <= high))


def test_how_a_second_mode_began_is_known_as_its_frequency_and_decay_time_are(
    rng: np.random.Generator,
) -> None:
    """Its size with its decay time, its phase with its frequency; these two not with each other."""
    fit = fitted(ringing_record(rng, 0.01, 1.5), ("second_mode",))
    draws = draw_laws(LawFit.of(fit), rng, 4000).first
    drawn = draws.parameters("second_mode", np.ones(4000, np.bool_))
    (line,) = fit.lines
    began = np.log(drawn["sine"] + 1j * drawn["cosine"])
    rate = np.log(drawn["decay_time"]), 2.0 * np.pi * line.decay_time * drawn["frequency"]
    assert abs(np.corrcoef(rate)[0, 1]) < 0.05
    for part, of_rate in zip((began.real, np.unwrap(began.imag)), rate, strict=True):
        # of the variance half is that of the rate, and half would be left were that known
        assert abs(np.corrcoef(part, of_rate)[0, 1] + np.sqrt(0.5)) < 0.05
        assert abs(np.std(part) / np.std(of_rate) - np.sqrt(0.5)) < 0.05
