"""Comparison of the posterior of several records under one law with a sampler's."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop.checks.check_friction import check_friction
from friction_bayes.loop.checks.joint_target import JointTarget
from friction_bayes.loop.infer.joint_draws import joint_draws
from friction_bayes.loop.infer.joint_fit import JointFit
from friction_bayes.loop.infer.law_draws import unit_force

__all__ = ["check_together", "target_together"]

_CLOSED_FORM_DRAWS = 20_000


def target_together(fit: JointFit, row: int, *, forced: bool) -> JointTarget:
    """The sampler's target of one of the posterior's sets, with or without a random force."""
    return JointTarget(problem=fit.problem, posterior=fit.posterior, row=row, prior=fit.prior, forced=forced)


def check_together(
    fit: JointFit, cells: Mask, factor: float, unit: str, seed: int, *, forced: bool
) -> tuple[dict[str, Any], xr.DataTree | None]:
    """Comparison with emcee of the most probable columns and spread of the most probable candidate.

    Parameters
    ----------
    fit : JointFit
    cells : ndarray of bool, shape (g, n)
        Points and sets of the posterior that are the candidate.
    factor : float
        From friction of the declared system to what is reported.
    unit : str
        Of the latter.
    seed : int
    forced : bool
        Whether the candidate has a random force.

    Returns
    -------
    dict
        As from :func:`friction_bayes.loop.checks.check_friction.check_friction`, with the ``share`` of the
        candidate that was sampled.
    xarray.DataTree or None
        What was sampled, if anything.
    """
    posterior, law = fit.posterior, fit.along[0].law
    mine = cells & ((posterior.ratio > 0.0) == forced)[:, None]
    weight = np.where(mine, posterior.weight, 0.0)
    row = int(np.argmax(weight.sum(axis=0)))
    share = float(weight[:, row].sum() / weight.sum())
    weight[:, np.arange(weight.shape[1]) != row] = 0.0
    drawn = joint_draws(fit, np.random.default_rng(seed), _CLOSED_FORM_DRAWS, weight)
    stiffness = fit.along[0].regression.stiffness

    def natural(laws: Array) -> dict[str, Array]:
        # as for the draws of the closed form: the factor to force stays that of the declared system
        change = np.maximum(laws[:, stiffness], -0.75)
        return {"friction": laws[:, law.frictions].sum(axis=1) * unit_force(fit.fits[0], change)}

    target = target_together(fit, row, forced=forced).target(
        natural=natural,
        signals=[one.segment.values[: one.samples] for one in fit.fits],
        unit=fit.fits[0].unit,
    )
    check, tree = check_friction(target, drawn.friction, factor=factor, unit=unit, seed=seed)
    return check | {"share": share}, tree
