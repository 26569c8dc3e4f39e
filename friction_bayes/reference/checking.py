"""The reference run beside an estimate: emcee on the same likelihood, and whether the two agree."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.conjugate.scaled_distribution import ScaledDistribution
from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import Summary
from friction_bayes.estimators.result import Estimate
from friction_bayes.reference.sampling import sample_target
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
    their uncertainty multiplies both sides afterwards. Where the estimate averages over a random force, what
    is sampled and compared is its part without one.

    Parameters
    ----------
    estimate : Estimate
    seed : int
        Same seed, same bits.
    progress : callable, optional
        Called with steps done and steps due at present.
    """
    tree = sample_target(estimate.fit.target, seed=seed, progress=progress)
    attrs = tree.attrs
    posterior = tree["posterior"].dataset["friction"]
    draws = np.asarray(posterior.values).reshape(attrs["ensembles"], attrs["walkers"], -1)
    force = estimate.random_force
    declared = estimate.friction_as_declared if force is None else force.coefficient_without
    agreement = compare(declared, draws)
    mean, sd = float(declared.mean()), float(declared.std())
    # a posterior without a variance gives no scale to measure by
    apart = (float(draws.mean()) - mean) / sd if math.isfinite(sd) else None
    friction = draws
    if isinstance(estimate.friction, ScaledDistribution):
        factor = estimate.friction.factor
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1,)))
        friction = draws * factor.rvs(draws.shape, random_state=rng) / estimate.force_factor
    summary = {
        "sampler": "emcee",
        "checked": "the whole posterior" if force is None else "the part without a random force",
        "friction": Summary.of_draws(friction, estimate.friction_unit, ddof=0).to_dict(),
        "rhat": float(posterior.attrs["nested_rhat"]),
        "ess_bulk": float(posterior.attrs["ess_bulk"]),
        "ess_tail": float(posterior.attrs["ess_tail"]),
        "converged": bool(attrs["converged"]),
        "agrees": agreement.agrees,
        "because": agreement.because,
        "difference_in_sd": apart,
        "false_alarm_rate": agreement.false_alarm_rate,
        "sampler_s": float(attrs["wall_time_s"]),
        "seed": seed,
    }
    return ReferenceRun(tree=tree, friction=friction, summary=summary)
