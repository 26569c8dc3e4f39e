"""Compare the final posterior with a sampler's, and cross-validate the models before and after."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.errors import InputError, NotConvergedWarning
from friction_bayes.core.summary import Summary
from friction_bayes.loop.draws import posterior_draws
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.friction import friction_scale
from friction_bayes.loop.parameters import FRICTION
from friction_bayes.loop.target import block_log_likelihoods, target_of
from friction_bayes.validation.agreement import compare

__all__ = ["sampler_check"]

ENSEMBLES = 4
_ESS = 400.0
_MOST_STEPS = 2000
_BLOCK_DRAWS = 500
_CLOSED_FORM_DRAWS = 20_000


def sampler_check(before: LoopFit, after: LoopFit, seed: int) -> dict[str, Any]:
    """Sample the posterior of the most probable model with emcee, on the likelihood of the fit.

    Parameters
    ----------
    before, after : LoopFit
        The Coulomb model alone, and the final one.
    seed : int

    Returns
    -------
    dict
        ``sampler``, ``converged`` and ``because``; the worst nested ``rhat``, ``ess_bulk`` and ``ess_tail``
        of all parameters; ``friction`` as sampled and ``closed_form`` as by the normal approximation, and
        whether one ``agrees`` with the other (null where the chain did not converge); ``sampler_s``, its
        wall time [s]; ``leave_one_out`` before, after and their difference, over blocks of a half cycle.
    """
    # only here is a sampler loaded
    from friction_bayes.reference import sample_target

    target = target_of(after, seed)
    check: dict[str, Any] = {"sampler": "emcee", "seed": seed}
    try:
        with warnings.catch_warnings():
            # reported in the result
            warnings.simplefilter("ignore", NotConvergedWarning)
            tree = sample_target(
                target,
                seed=seed,
                ensembles=ENSEMBLES,
                walkers=2 * max(after.z.size + 1, 8),
                ess=_ESS,
                max_steps=_MOST_STEPS,
            )
    except InputError as error:
        return check | {"converged": False, "agrees": None, "because": f"not sampled: {error}"}
    attrs = tree.attrs
    draws = np.asarray(tree["posterior"][FRICTION].values)
    grouped = draws.reshape(attrs["ensembles"], attrs["walkers"], -1)
    closed = posterior_draws(after, np.random.default_rng(seed), _CLOSED_FORM_DRAWS)
    expected = np.asarray(target.posterior(closed)[FRICTION])
    agreement = compare(expected, grouped, minimum_ess=0.5 * _ESS)
    converged = bool(attrs["converged"])
    because = agreement.because
    if not converged:
        because = (
            f"not converged after {attrs['steps']} steps: nested R-hat {attrs['nested_rhat']:.4f}, effective "
            f"sample size {attrs['ess_bulk']:.0f} (bulk) and {attrs['ess_tail']:.0f} (tail)"
        )
    factor, unit = friction_scale(after.model)
    return check | {
        "converged": converged,
        "rhat": float(attrs["nested_rhat"]),
        "ess_bulk": float(attrs["ess_bulk"]),
        "ess_tail": float(attrs["ess_tail"]),
        "ensembles": int(attrs["ensembles"]),
        "steps": int(attrs["steps"]),
        "friction": Summary.of_draws(factor * draws, unit, ddof=0).to_dict(),
        "closed_form": Summary.of_draws(factor * expected, unit, ddof=0).to_dict(),
        "agrees": agreement.agrees if converged else None,
        "because": because,
        "false_alarm_rate": agreement.false_alarm_rate,
        "sampler_s": float(attrs["wall_time_s"]),
        "leave_one_out": _leave_one_out(before, after, tree, seed),
    }


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
