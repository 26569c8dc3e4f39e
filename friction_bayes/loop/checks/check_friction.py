"""Comparison of the friction of a closed form with a sampler's, on one target."""

from __future__ import annotations

import warnings
from typing import Any

import xarray as xr

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError, NotConvergedWarning
from friction_bayes.core.summary import Summary
from friction_bayes.loop.data.parameters import FRICTION
from friction_bayes.validation.agreement import compare

__all__ = ["check_friction"]

_ENSEMBLES = 4
_ESS = 400.0
_MOST_STEPS = 4000


def check_friction(
    target: Target, expected: Array, *, factor: float, unit: str, seed: int, walkers: int | None = None
) -> tuple[dict[str, Any], xr.DataTree | None]:
    """Friction of a target sampled with emcee, compared with draws of the closed form.

    Parameters
    ----------
    target : Target
        Whose natural parameters include friction.
    expected : ndarray, shape (n,)
        Friction as drawn from the closed form.
    factor : float
        From friction of the declared system to what is reported.
    unit : str
        Of the latter.
    seed : int
    walkers : int, optional
        Of each ensemble; the sampler's own choice by default.

    Returns
    -------
    dict
        ``sampler``, ``converged`` and ``because``; the worst nested ``rhat``, ``ess_bulk`` and ``ess_tail``
        of all parameters; ``friction`` as sampled and ``closed_form``, and whether one ``agrees`` with the
        other (null where the chain did not converge); ``sampler_s``, its wall time [s].
    xarray.DataTree or None
        What was sampled; None where the sampler refuses the target.
    """
    # only here is a sampler loaded
    from friction_bayes.reference import sample_target
    from friction_bayes.reference.tree import by_walker

    check: dict[str, Any] = {"sampler": "emcee", "seed": seed}
    try:
        with warnings.catch_warnings():
            # reported in the result
            warnings.simplefilter("ignore", NotConvergedWarning)
            tree = sample_target(
                target, seed=seed, ensembles=_ENSEMBLES, walkers=walkers, ess=_ESS, max_steps=_MOST_STEPS
            )
    except InputError as error:
        return check | {"converged": False, "agrees": None, "because": f"not sampled: {error}"}, None
    attrs = tree.attrs
    draws = by_walker(tree["posterior"].dataset[FRICTION])
    agreement = compare(expected, draws, minimum_ess=0.5 * _ESS)
    converged = bool(attrs["converged"])
    because = agreement.because
    if not converged:
        because = (
            f"not converged after {attrs['steps']} steps: nested R-hat {attrs['nested_rhat']:.4f}, effective "
            f"sample size {attrs['ess_bulk']:.0f} (bulk) and {attrs['ess_tail']:.0f} (tail)"
        )
    found = {
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
    }
    return check | found, tree
