"""Comparison of the posterior of a law along the measured motion with a sampler's."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.loop.checks.check_friction import check_friction
from friction_bayes.loop.checks.sensor_noise_target import sensor_noise_target
from friction_bayes.loop.infer.law_draws import law_draws
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.statespace.force_target import force_target, half_cycle_blocks

__all__ = ["best_set", "check_random_force", "target_of_set"]

_CLOSED_FORM_DRAWS = 40_000


def best_set(fit: ForceFit, *, forced: bool) -> int:
    """The most probable set of columns, given that there is a random force or none."""
    posterior = fit.posterior
    return int(np.argmax(posterior.weight[(posterior.ratio > 0.0) == forced].sum(axis=0)))


def target_of_set(fit: ForceFit, chosen: int, *, forced: bool) -> Target:
    """Posterior of a set's coefficients, confined to their support, of noise and of any random force.

    Columns are those along the measured motion and noise that grows is as found: neither is sampled.
    """
    columns = fit.sets.columns[chosen]
    regression = fit.regression.of_columns(columns)
    frictions = np.isin(np.flatnonzero(columns), fit.law.frictions)
    order = fit.segment.order

    blocks, signal = half_cycle_blocks(regression.clock.phase), fit.segment.values[: fit.samples]

    def unit_force(law: Array) -> Array:
        # as for the draws of the closed form: the factor to force stays that of the declared system
        change = np.maximum(1.0 + law[:, regression.stiffness], 0.25)
        return np.asarray(fit.law.unit_force * change ** (0.5 * (order - 2)))

    def without_force(law: Array, noise: Array) -> dict[str, Array]:
        friction = law[:, frictions].sum(axis=1) * unit_force(law)
        return {"friction": friction, "noise_sd": noise * fit.unit}

    def with_force(law: Array, noise: Array, q: Array, tau: Array) -> dict[str, Array]:
        force = {"random_force_sd": q * unit_force(law), "correlation_time": tau / fit.w0}
        return without_force(law, noise) | force

    if not forced:
        return sensor_noise_target(
            regression, natural=without_force, blocks=blocks, signal=signal, unit=fit.unit
        )
    return force_target(
        regression, fit.prior, natural=with_force, blocks=blocks, signal=signal, unit=fit.unit
    )


def check_random_force(
    fit: ForceFit, factor: float, unit: str, seed: int, *, forced: bool
) -> tuple[dict[str, Any], xr.DataTree | None]:
    """Friction of the most probable set of columns, compared with emcee's.

    Parameters
    ----------
    fit : ForceFit
    factor : float
        From friction of the declared system to what is reported.
    unit : str
        Of the latter.
    seed : int
    forced : bool
        Whether the set of columns under a random force is meant, or that without one.

    Returns
    -------
    dict
        As from :func:`friction_bayes.loop.checks.check_friction.check_friction`, with the ``share`` of the
        fit that was sampled.
    xarray.DataTree or None
        What was sampled, if anything.
    """
    chosen = best_set(fit, forced=forced)
    weight = fit.posterior.weight[(fit.posterior.ratio > 0.0) == forced]
    draws = law_draws(fit, np.random.default_rng(seed), _CLOSED_FORM_DRAWS)
    check, tree = check_friction(
        target_of_set(fit, chosen, forced=forced),
        draws.friction[(draws.chosen == chosen) & ((draws.random_force > 0.0) == forced)],
        factor=factor,
        unit=unit,
        seed=seed,
    )
    return check | {"share": float(weight[:, chosen].sum() / weight.sum())}, tree
