"""Compare the posterior of a law under a random force with a sampler's."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError, NotConvergedWarning
from friction_bayes.core.summary import Summary
from friction_bayes.estimators.random_force.sampler_target import force_target, half_cycle_blocks
from friction_bayes.loop.random_force.draws import law_draws
from friction_bayes.loop.random_force.fit import ForceFit
from friction_bayes.validation.agreement import compare

__all__ = ["best_set", "check_random_force", "target_of_set"]

_ENSEMBLES = 4
_ESS = 400.0
_MOST_STEPS = 2000
_CLOSED_FORM_DRAWS = 40_000


def best_set(fit: ForceFit) -> int:
    """The most probable set of columns, given that there is a random force."""
    posterior = fit.posterior
    return int(np.argmax(posterior.weight[posterior.ratio > 0.0].sum(axis=0)))


def target_of_set(fit: ForceFit, chosen: int) -> Target:
    """Posterior of a set's coefficients, confined to their support, of noise and of the random force.

    Columns are those along the measured motion and timing jitter is as found: neither is sampled.
    """
    columns = fit.sets.columns[chosen]
    regression = fit.regression.of_columns(columns)
    frictions = np.isin(np.flatnonzero(columns), fit.law.frictions)
    order = fit.segment.order

    def natural(law: Array, noise: Array, q: Array, tau: Array) -> dict[str, Array]:
        # as for the draws of the closed form: the factor to force stays that of the declared system
        factor = fit.law.unit_force * np.maximum(1.0 + law[:, regression.stiffness], 0.25) ** (
            0.5 * (order - 2)
        )
        return {
            "friction": law[:, frictions].sum(axis=1) * factor,
            "random_force_sd": q * factor,
            "correlation_time": tau / fit.w0,
            "noise_sd": noise * fit.unit,
        }

    return force_target(
        regression,
        fit.prior,
        natural=natural,
        blocks=half_cycle_blocks(regression.clock.phase),
        signal=fit.segment.values[: fit.samples],
        unit=fit.unit,
    )


def check_random_force(fit: ForceFit, factor: float, unit: str, seed: int) -> dict[str, Any]:
    """Sample the most probable set of columns under a random force with emcee, and compare friction.

    Parameters
    ----------
    fit : ForceFit
    factor : float
        From friction of the declared system to what is reported.
    unit : str
        Of the latter.
    seed : int

    Returns
    -------
    dict
        As from :func:`friction_bayes.loop.sampler_check.sampler_check`; ``leave_one_out`` is null: under a
        random force half cycles are not independent given the parameters.
    """
    # only here is a sampler loaded
    from friction_bayes.reference import sample_target

    chosen = best_set(fit)
    check: dict[str, Any] = {"sampler": "emcee", "seed": seed}
    try:
        with warnings.catch_warnings():
            # reported in the result
            warnings.simplefilter("ignore", NotConvergedWarning)
            tree = sample_target(
                target_of_set(fit, chosen), seed=seed, ensembles=_ENSEMBLES, ess=_ESS, max_steps=_MOST_STEPS
            )
    except InputError as error:
        return check | {"converged": False, "agrees": None, "because": f"not sampled: {error}"}
    attrs = tree.attrs
    sampled = np.asarray(tree["posterior"].dataset["friction"].values)
    draws = law_draws(fit, np.random.default_rng(seed), _CLOSED_FORM_DRAWS)
    expected = draws.friction[(draws.chosen == chosen) & (draws.random_force > 0.0)]
    grouped = sampled.reshape(attrs["ensembles"], attrs["walkers"], -1)
    agreement = compare(expected, grouped, minimum_ess=0.5 * _ESS)
    converged = bool(attrs["converged"])
    because = agreement.because
    if not converged:
        because = (
            f"not converged after {attrs['steps']} steps: nested R-hat {attrs['nested_rhat']:.4f}, effective "
            f"sample size {attrs['ess_bulk']:.0f} (bulk) and {attrs['ess_tail']:.0f} (tail)"
        )
    return check | {
        "converged": converged,
        "rhat": float(attrs["nested_rhat"]),
        "ess_bulk": float(attrs["ess_bulk"]),
        "ess_tail": float(attrs["ess_tail"]),
        "ensembles": int(attrs["ensembles"]),
        "steps": int(attrs["steps"]),
        "friction": Summary.of_draws(factor * sampled, unit, ddof=0).to_dict(),
        "closed_form": Summary.of_draws(factor * expected, unit, ddof=0).to_dict(),
        "agrees": agreement.agrees if converged else None,
        "because": because,
        "false_alarm_rate": agreement.false_alarm_rate,
        "sampler_s": float(attrs["wall_time_s"]),
        "leave_one_out": None,
    }
