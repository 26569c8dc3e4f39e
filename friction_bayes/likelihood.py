"""The only log-likelihoods, shared by the closed forms and the sampler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Target"]

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Target:
    """A posterior as the sampler sees it, in unconstrained coordinates, beside its closed form.

    Attributes
    ----------
    names : tuple of str
        Names of the sampled coordinates, length ``d``; transformed ones say so (``log_precision``).
    log_prob : callable, (walkers, d) -> (walkers,)
        Log-likelihood plus log-prior plus log-Jacobian of the transform, vectorised over walkers.
    closed_form : callable, (walkers, d) -> (walkers,)
        Log-density of the closed-form posterior in the same coordinates; ``log_prob`` minus this is one
        constant over parameter space where the closed form is exact.
    centre : ndarray, shape (d,)
        Closed-form location, where the ensembles start.
    covariance : ndarray, shape (d, d)
        Closed-form covariance in the same coordinates; ensembles start over-dispersed by a stated factor.
    posterior : callable, (draws, d) -> dict of str to (draws, ...) arrays
        Natural parameters: always ``friction`` [force unit]; ``precision``, ... where the model has them.
    log_prior : callable, (walkers, d) -> (walkers,)
        Log-prior plus log-Jacobian alone: ``log_prob`` with an empty data set.
    pointwise : callable, (draws, d) -> (draws, blocks)
        Log-likelihood per honest unit of data: a friction sample, an amplitude, a half cycle of signal.
    predictive : callable, (draws, d), Generator -> (draws, n)
        Replicated data, same shape as ``observed``.
    prior_draws : callable, Generator, int -> (draws, d)
        Draws from the prior, in the sampler's coordinates; proper priors only.
    observed : ndarray, shape (n,)
        The data of the likelihood.
    observed_name : str
        Its name in ``observed_data``.
    """

    names: tuple[str, ...]
    log_prob: Callable[[Array], Array]
    closed_form: Callable[[Array], Array]
    centre: Array
    covariance: Array
    posterior: Callable[[Array], dict[str, Array]]
    log_prior: Callable[[Array], Array]
    pointwise: Callable[[Array], Array]
    predictive: Callable[[Array, np.random.Generator], Array]
    prior_draws: Callable[[np.random.Generator, int], Array]
    observed: Array
    observed_name: str
