"""Compare the final posterior with a sampler's, and cross-validate the models before and after."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.loop.checks.check_friction import check_friction
from friction_bayes.loop.checks.search_target import block_log_likelihoods, target_of
from friction_bayes.loop.data.friction import friction_scale
from friction_bayes.loop.data.parameters import FRICTION
from friction_bayes.loop.search.draws import posterior_draws
from friction_bayes.loop.search.fit import LoopFit

__all__ = ["sampler_check"]

_BLOCK_DRAWS = 500
_CLOSED_FORM_DRAWS = 20_000


def sampler_check(before: LoopFit, after: LoopFit, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
    """Sample the posterior of the most probable model with emcee, on the likelihood of the fit.

    Parameters
    ----------
    before, after : LoopFit
        The Coulomb model alone, and the final one.
    seed : int

    Returns
    -------
    dict
        As from :func:`friction_bayes.loop.checks.check_friction.check_friction`, with the ``share`` of the
        model that was sampled, all of it, and ``leave_one_out`` where it was
        sampled: before, after and their difference, over blocks of a half cycle.
    xarray.DataTree or None
        What was sampled, if anything.
    """
    target = target_of(after, seed)
    closed = posterior_draws(after, np.random.default_rng(seed), _CLOSED_FORM_DRAWS)
    factor, unit = friction_scale(after.model)
    check, tree = check_friction(
        target,
        np.asarray(target.posterior(closed)[FRICTION]),
        factor=factor,
        unit=unit,
        seed=seed,
        walkers=2 * max(after.z.size + 1, 8),
    )
    check |= {"share": 1.0}
    if tree is not None:
        check["leave_one_out"] = _leave_one_out(before, after, tree, seed)
    return check, tree


def _leave_one_out(before: LoopFit, after: LoopFit, tree: xr.DataTree, seed: int) -> dict[str, Any]:
    """Cross-validate the two models: sampled draws after, those of the normal approximation before."""
    from friction_bayes.reference.cross_validation import leave_one_out

    sampled = np.asarray(tree["log_likelihood"]["signal"].values)
    draws = posterior_draws(before, np.random.default_rng(seed), _BLOCK_DRAWS)
    found = {
        "before": leave_one_out(block_log_likelihoods(before, draws)),
        "after": leave_one_out(sampled.reshape(-1, sampled.shape[-1])),
    }
    gain = found["after"].pop("pointwise") - found["before"].pop("pointwise")
    return found | {
        "gain": float(gain.sum()),
        "gain_se": math.sqrt(gain.size) * float(gain.std(ddof=1)) if gain.size > 1 else math.nan,
        "what": "expected log predictive density of each half cycle given the others, summed (PSIS)",
    }
