"""Coulomb friction alone, fitted to records by simulation: what a loop starts from."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import no_decay_fits
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import FRICTION
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.data.starting_point import starting_point
from friction_bayes.loop.infer.draws import DRAWS
from friction_bayes.loop.infer.truncated_normal import truncated_draws
from friction_bayes.loop.noise.likelihood import NoiseModel
from friction_bayes.loop.simulation.fit import LoopFit, fit_growing_record
from friction_bayes.loop.simulation.robust_covariance import robust_covariance
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["coulomb_fit", "coulomb_friction", "coulomb_model"]


def coulomb_model(system: Oscillator, segments: tuple[Segment, ...]) -> LoopFit:
    """Fit Coulomb friction alone, the rest position free, under white noise.

    Parameters
    ----------
    system : Oscillator
    segments : tuple of Segment

    Raises
    ------
    InputError
        If that cannot be fitted.
    """
    fit = coulomb_fit(LoopModel(system, segments, (SENSOR_OFFSET.name,)))
    if fit is None:
        raise no_decay_fits(", ".join(segment.decay.name for segment in segments), system)
    return fit


def coulomb_fit(model: LoopModel) -> LoopFit | None:
    """The same of a model that has these parameters; None where that cannot be fitted."""
    return fit_growing_record(model, [NoiseModel() for _ in model.segments], starting_point(model))


def coulomb_friction(fit: LoopFit, rng: np.random.Generator, *, robust: bool) -> Array:
    """Draws of its friction [N or N m], shape (DRAWS,), from the normal approximation cut to the support.

    Parameters
    ----------
    fit : LoopFit
    rng : numpy.random.Generator
    robust : bool
        Whether the draws carry the scatter of a residual that is more than noise.
    """
    spread = robust_covariance(fit) if robust else fit.covariance
    drawn = truncated_draws(fit.centre[0], spread, *fit.model.support, rng, DRAWS)
    return np.asarray(fit.model.value(drawn, FRICTION))
