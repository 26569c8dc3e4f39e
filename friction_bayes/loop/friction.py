"""Friction as a distribution: the mixture over the candidates, or one model's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.summary import Summary
from friction_bayes.loop.evidence import posterior_draws
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.model import LoopModel
from friction_bayes.loop.robust_covariance import robust_covariance

__all__ = ["DRAWS", "Distribution", "friction_posterior", "friction_scale", "mixture_draws"]

DRAWS = 4000
_LEAST_SHARE = 1e-4


@dataclass(frozen=True, eq=False)
class Distribution:
    """Draws of a number with a unit.

    Attributes
    ----------
    draws : ndarray, shape (m,)
    unit : str
    """

    draws: Array
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """Mean, standard deviation, central 90 % interval and unit."""
        return Summary.of_draws(self.draws, self.unit).to_dict()


def mixture_draws(
    fits: Sequence[LoopFit], probabilities: Array, rng: np.random.Generator, *, misfit: bool
) -> tuple[Integers, list[Array]]:
    """Draw coordinates from each candidate in proportion to its probability.

    Parameters
    ----------
    fits : sequence of LoopFit
    probabilities : ndarray, shape (k,)
    rng : numpy.random.Generator
    misfit : bool
        Whether the draws carry the scatter that a residual beyond noise shows.

    Returns
    -------
    which : ndarray of int, shape (DRAWS,)
        Candidate of each draw.
    draws : list of ndarray, shape (k, p)
        Draws of each candidate, empty where its share is too small.
    """
    kept = np.where(probabilities > _LEAST_SHARE, probabilities, 0.0)
    counts = rng.multinomial(DRAWS, kept / kept.sum())
    draws = [
        posterior_draws(fit, rng, int(k), robust_covariance(fit) if misfit else None)
        if k
        else np.empty((0, fit.z.size))
        for fit, k in zip(fits, counts, strict=True)
    ]
    return np.repeat(np.arange(len(fits)), counts), draws


def friction_scale(model: LoopModel) -> tuple[float, float, str]:
    """Factor from a model's friction to the one that is told, its relative standard deviation, and the unit.

    A signal that is not calibrated tells friction in its own unit alone.
    """
    decay = model.segments[0].decay
    if decay.unit in UNCALIBRATED_UNITS:
        return 1.0 / model.system.force_factor(decay.quantity), 0.0, decay.unit
    return 1.0, model.system.force_factor_relative_sd(decay.quantity), model.system.friction_unit


def friction_posterior(
    fits: Sequence[LoopFit], draws: Sequence[Array], rng: np.random.Generator
) -> Distribution:
    """Friction force of draws, with the uncertainty of mass and stiffness where it was given."""
    model = fits[0].model
    values = np.concatenate(
        [np.asarray(f.model.coordinates[0].value(d[:, 0])) for f, d in zip(fits, draws, strict=True)]
    )
    factor, relative, unit = friction_scale(model)
    if relative > 0.0:
        values = values * (1.0 + relative * rng.standard_normal(values.size))
    return Distribution(factor * values, unit)
