"""Comparison of the posterior of a law along measured motions with a sampler's."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import InputError, NotConvergedWarning
from friction_bayes.core.summary import Summary
from friction_bayes.loop.data.parameters import FRICTION
from friction_bayes.loop.infer.law_draws import draw_laws, unit_force
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.statespace.sampling.law_target import law_target
from friction_bayes.validation.agreement import compare

__all__ = ["check_law", "target_of_set"]

_ENSEMBLES = 4
_ESS = 400.0
_MOST_STEPS = 4000
_CLOSED_FORM_DRAWS = 20_000
_LEAST_STIFFNESS = -0.75
"""Correction below which a law would hardly oscillate."""


def check_law(
    fit: LawFit, cells: Mask, factor: float, unit: str, seed: int, *, forced: bool
) -> tuple[dict[str, Any], xr.DataTree | None]:
    """Friction of the most probable columns, and spread, of a candidate by emcee and in closed form.

    The candidate is the points and sets ``cells``, shape (g, n), ``forced`` where it has a random force;
    ``factor`` times friction is reported in ``unit``.

    Returns
    -------
    dict
        ``sampler``, ``converged`` and ``because``; the worst nested ``rhat``, ``ess_bulk`` and ``ess_tail``
        of all parameters; ``friction`` as sampled and ``closed_form``, and whether one ``agrees`` with the
        other (null where the chain did not converge); ``sampler_s``, its wall time [s]; the ``share`` of the
        candidate that was sampled.
    xarray.DataTree or None
        What was sampled; None where the sampler refuses the target.
    """
    # only here is a sampler loaded
    from friction_bayes.reference import sample_target
    from friction_bayes.reference.tree import by_walker

    posterior = fit.posterior
    mine = cells & ((posterior.ratio > 0.0) == forced)[:, None]
    weight = np.where(mine, posterior.weight, 0.0)
    row = int(np.argmax(weight.sum(axis=0)))
    share = float(weight[:, row].sum() / weight.sum())
    weight[:, np.arange(weight.shape[1]) != row] = 0.0
    expected = draw_laws(fit, np.random.default_rng(seed), _CLOSED_FORM_DRAWS, weight).friction
    target = target_of_set(fit, row, forced=forced)
    check: dict[str, Any] = {"sampler": "emcee", "seed": seed, "share": share}
    try:
        with warnings.catch_warnings():
            # reported in the result
            warnings.simplefilter("ignore", NotConvergedWarning)
            tree = sample_target(target, seed=seed, ensembles=_ENSEMBLES, ess=_ESS, max_steps=_MOST_STEPS)
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


def target_of_set(fit: LawFit, row: int, *, forced: bool) -> Target:
    """Posterior of a set's shared coefficients, confined to their support, of noise and of any random force.

    Columns are those of set ``row`` of the posterior along the measured motions, and noise that grows is as
    found: neither is sampled. The zero within a step and free corners are integrated out.
    """
    first, columns = fit.fits[0], np.flatnonzero(fit.problem.sets[row])
    # next to an offset the zero within a step is one too many
    of_recording = np.array([column.of_recording for column in fit.law.columns])
    columns = columns[~of_recording[columns]]
    frictions = np.isin(columns, fit.law.frictions)
    stiffness = int(np.searchsorted(columns, first.regression.stiffness))

    def natural(law: Array, noise: Array, q: Array, tau: Array) -> dict[str, Array]:
        # as for the draws of the closed form: the factor to force stays that of the declared system
        force = unit_force(first, np.maximum(law[:, stiffness], _LEAST_STIFFNESS))
        found = {"friction": law[:, frictions].sum(axis=1) * force, "noise_sd": noise * first.unit}
        if forced:
            found |= {"random_force_sd": q * force, "correlation_time": tau / first.w0}
        return found

    return law_target(
        fit.problem.only(row, of_recording),
        first.prior if forced else None,
        natural=natural,
        signals=[each.segment.values[: each.record.samples] for each in fit.fits],
        unit=first.unit,
    )
