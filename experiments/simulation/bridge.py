"""Evidence by bridge sampling: from a sampler's draws and those of a normal, with no approximation to a mode.

Meng & Wong, Statistica Sinica 6 (1996): with unnormalised target ``q``, normalised proposal ``g`` and their
draws, the ratio of constants is the fixed point of a ratio of two sample means.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from experiments.simulation.fit import LoopFit
from experiments.simulation.laplace_evidence import log_normalisation
from experiments.simulation.simulated_target import target_of
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.reference.ensembles import Ensembles

__all__ = ["BridgedEvidence", "bridged_log_evidence"]


_ENSEMBLES = 4
_WIDER = 1.3
"""Covariance of the proposal over that of the draws: its tails must not be thinner."""
_THINNING = 5


@dataclass(frozen=True)
class BridgedEvidence:
    """A log-evidence and its Monte Carlo standard error, from the scatter over independent ensembles."""

    value: float
    error: float


def _bridge(target: Target, draws: Array, rng: np.random.Generator) -> float:
    """Log of the constant of a target from its draws, shape (n, d); the first half shapes the proposal."""
    half = len(draws) // 2
    covariance = _WIDER * np.cov(draws[:half], rowvar=False)
    proposal = stats.multivariate_normal(draws[:half].mean(axis=0), covariance, allow_singular=True)
    sampled = draws[half:]
    proposed = np.atleast_2d(proposal.rvs(len(sampled), random_state=rng))
    log_l1 = target.log_prob(sampled) - proposal.logpdf(sampled)
    log_l2 = target.log_prob(proposed) - proposal.logpdf(proposed)
    shift = float(np.median(log_l1))
    l1, l2 = np.exp(log_l1 - shift), np.exp(log_l2 - shift)
    ratio = 1.0
    for _ in range(200):
        new = float(np.mean(l2 / (l2 + ratio)) / np.mean(1.0 / (l1 + ratio)))
        if abs(math.log(new / ratio)) < 1e-8:
            break
        ratio = new
    return shift + math.log(ratio)


def bridged_log_evidence(fit: LoopFit, seed: int, *, steps: int = 400) -> BridgedEvidence:
    """Log-evidence of the model of a fit, for
    :func:`experiments.simulation.laplace_evidence.log_evidence` to meet.

    Parameters
    ----------
    fit : LoopFit
        Of white noise: fraction and scale of outliers are not sampled here.
    seed : int
    steps : int
        Of each of four ensembles; the first third is thrown away.
    """
    target = target_of(fit, seed)
    run = Ensembles(target, seed=seed, ensembles=_ENSEMBLES, walkers=2 * max(fit.z.size + 1, 8))
    run.advance(steps)
    chains = run.coordinates(steps // 3, _THINNING)
    constant = log_normalisation(fit)
    constant += math.fsum(noise.log_volume for noise in fit.noises)
    # walkers of one ensemble are not independent, ensembles are
    logs = [_bridge(target, part.reshape(-1, fit.z.size), run.rng) for part in np.split(chains, _ENSEMBLES)]
    return BridgedEvidence(
        constant + float(np.mean(logs)), float(np.std(logs, ddof=1)) / math.sqrt(_ENSEMBLES)
    )
