"""The reference run of an estimate: emcee on the same likelihood, and whether the two agree."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.conjugate.scaled_distribution import kept_positive
from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import Summary
from friction_bayes.estimators.result import Estimate
from friction_bayes.reference.estimates import parts_of, sample_estimate
from friction_bayes.reference.tree import by_walker
from friction_bayes.validation.agreement import compare

__all__ = ["ReferenceRun", "check_estimate"]


@dataclass(frozen=True, kw_only=True)
class ReferenceRun:
    """What a sampler makes of the posterior of an estimate.

    Attributes
    ----------
    tree : xarray.DataTree
        Everything sampled.
    friction : ndarray, shape (ensembles, walkers, draws)
        Friction force, carrying the standard deviation of mass and stiffness as the estimate does.
    summary : dict
        ``reference`` of the JSON result; ``agrees`` is None where too few draws were effective.
    """

    tree: xr.DataTree
    friction: Array
    summary: dict[str, Any]


def check_estimate(
    estimate: Estimate, *, seed: int, progress: Callable[[int, int], None] | None = None
) -> ReferenceRun:
    """Sample the posterior of an estimate with emcee and compare it with the closed form.

    The comparison is made at the declared mass and stiffness, which is all that the sampler knows;
    their uncertainty multiplies both sides afterwards. Where the estimate averages over accounts of the
    noise, its parts are sampled one by one and mixed with their probability in the closed form: these
    probabilities, ratios of evidences, are what the check takes over, and what a witness that disagrees adds
    to the answer comes on top. Convergence is the worst of the parts.

    Parameters
    ----------
    estimate : Estimate
    seed : int
        Same seed, same bits.
    progress : callable, optional
        Called with steps done and steps due at present.
    """
    tree = sample_estimate(estimate, seed=seed, progress=progress)
    parts = parts_of(tree)
    draws = by_walker(tree["mixture" if len(parts) > 1 else "posterior"].dataset["friction"])
    declared = estimate.friction_of_parts
    agreement = compare(declared, draws)
    mean, sd = float(declared.mean()), float(declared.std())
    # a posterior without a variance gives no scale to measure by
    apart = (float(draws.mean()) - mean) / sd if math.isfinite(sd) else None
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1,)))
    friction = draws * _factor_draws(estimate, draws.shape, rng) / estimate.force_factor
    own = [part["posterior"].dataset["friction"].attrs for part in parts]
    summary = {
        "sampler": "emcee",
        "checked": _checked(parts),
        "friction": Summary.of_draws(friction, estimate.friction_unit, ddof=0).to_dict(),
        "rhat": max(float(attrs["nested_rhat"]) for attrs in own),
        "ess_bulk": min(float(attrs["ess_bulk"]) for attrs in own),
        "ess_tail": min(float(attrs["ess_tail"]) for attrs in own),
        "converged": all(bool(part.attrs["converged"]) for part in parts),
        "agrees": agreement.agrees,
        "because": agreement.because,
        "difference_in_sd": apart,
        "false_alarm_rate": agreement.false_alarm_rate,
        "sampler_s": sum(float(part.attrs["wall_time_s"]) for part in parts),
        "seed": seed,
    }
    return ReferenceRun(tree=tree, friction=friction, summary=summary)


def _factor_draws(estimate: Estimate, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    """Draws of the factor from the signal's friction coefficient to the friction force."""
    forces = [
        np.full(shape, factor) if sd == 0.0 else kept_positive(factor, sd).rvs(shape, random_state=rng)
        for factor, sd in estimate.force_factors
    ]
    return forces[0] if len(forces) == 1 else np.choose(rng.integers(len(forces), size=shape), forces)


def _checked(parts: tuple[xr.DataTree, ...]) -> str:
    """What was sampled, in words."""
    names = [str(part.attrs["part"]) for part in parts]
    return names[0] if len(names) == 1 else f"each of {len(names)} parts by itself"
