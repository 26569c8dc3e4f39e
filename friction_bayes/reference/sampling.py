"""Run ensembles until their diagnostics are met, or warn that they are not."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import asdict
from importlib.metadata import version

import numpy as np
import xarray as xr

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.core.errors import InputError, NotConvergedWarning
from friction_bayes.reference.convergence import MINIMUM_LENGTH, Convergence, diagnose
from friction_bayes.reference.ensembles import Ensembles
from friction_bayes.reference.tree import make_tree
from friction_bayes.validation.mixing import mixing

__all__ = ["sample_target"]


BURN_IN = 10
"""Steps thrown away, in integrated autocorrelation times, and never fewer than the first 50."""

_LEAST_DRAWS = 5 * MINIMUM_LENGTH
"""Draws of a walker that thinning leaves, as a run of that length has where it is thinned to a fifth of its
autocorrelation time: one that did not mix is to be judged, not empty."""

_FIRST_STEPS = 150
_MARGIN = 1.15
"""Steps run over those needed, since the need is itself an estimate."""


@single_threaded_blas()
def sample_target(
    target: Target,
    *,
    seed: int,
    ensembles: int = 4,
    walkers: int | None = None,
    ess: float = 1000.0,
    max_steps: int = 20_000,
    progress: Callable[[int, int], None] | None = None,
) -> xr.DataTree:
    """Sample a target with independent emcee ensembles until its diagnostics are met.

    Parameters
    ----------
    target : Target
        Log-probability, start and natural parameters.
    seed : int
        Same seed, same bits.
    ensembles : int
        Independent ensembles, at least 4, started 2.5 times as wide as the closed form.
    walkers : int, optional
        Walkers of an ensemble, even and at least twice the number of parameters; 32 or four times
        their number when left out.
    ess : float
        Least bulk and tail effective sample size of every parameter.
    max_steps : int
        Steps of each ensemble after which it gives up.
    progress : callable, optional
        Called with the steps that all ensembles have made and those due at present.

    Returns
    -------
    xarray.DataTree
        Groups as :func:`friction_bayes.reference.tree.make_tree` lays them out, a chain an ensemble, after
        burn-in and thinned to a fifth of the autocorrelation time. Attributes: ``converged`` (1 or 0); the
        worst ``nested_rhat``, ``ess_bulk``, ``ess_tail`` and ``tau`` [steps] of all parameters; ``steps``,
        ``burn_in``, ``thinning``, ``acceptance_fraction``, ``wall_time_s``, ``seed``, ``ensembles``,
        ``walkers`` and versions. Each scalar variable of ``posterior`` has its own figures, and
        ``mcse_mean``, for attributes.

    Raises
    ------
    InputError
        If a number is out of range, or the target is not finite where it should start.

    Warns
    -----
    NotConvergedWarning
        If nested R-hat < 1.01, the effective sample sizes and 50 autocorrelation times were not all
        reached; the message carries the numbers.
    """
    if max_steps < _FIRST_STEPS:
        raise InputError("max_steps", f"{max_steps} steps are too few to judge", f"give {_FIRST_STEPS}")
    began = time.perf_counter()
    run = Ensembles(target, seed=seed, ensembles=ensembles, walkers=walkers)
    due = _FIRST_STEPS
    while True:
        _advance(run, due, ensembles, progress)
        burn_in, tau = _burn_in(run)
        needed = burn_in + max(MINIMUM_LENGTH, ess / run.chains) * tau
        if run.steps >= min(needed, max_steps):
            thinning = max(1, min(int(tau / 5.0), (run.steps - burn_in) // _LEAST_DRAWS))
            coordinates = run.coordinates(burn_in, thinning)
            natural = _natural(target, coordinates)
            found = {
                name: diagnose(draws, ensembles, thinning)
                for name, draws in _scalars(target, coordinates, natural).items()
            }
            worst = Convergence.worst(found)
            kept = run.steps - burn_in
            if worst.met(ess=ess, steps=kept):
                break
            if run.steps >= max_steps:
                message = f"emcee used up its {max_steps} steps: {worst.describe(ess=ess, steps=kept)}"
                # over the decorator's frame, to the caller's line
                warnings.warn(message, NotConvergedWarning, stacklevel=3)
                break
            needed = max(needed, 1.2 * run.steps)
        due = min(math.ceil(_MARGIN * needed), 2 * run.steps, max_steps)
    attrs = {
        "sampler": "emcee",
        "seed": seed,
        "converged": int(worst.met(ess=ess, steps=kept)),
        **{name: value for name, value in asdict(worst).items() if name != "mcse_mean"},
        "steps": run.steps,
        "burn_in": burn_in,
        "thinning": thinning,
        "ensembles": ensembles,
        "walkers": run.walkers,
        "acceptance_fraction": run.acceptance_fraction,
        **{f"{name.replace('-', '_')}_version": version(name) for name in _VERSIONS},
    }
    tree = make_tree(
        target,
        coordinates,
        natural,
        run.log_prob(burn_in, thinning),
        ensembles,
        rng=run.rng,
        attrs=attrs,
        diagnostics={name: asdict(found[name]) for name in natural if name in found},
    )
    tree.attrs["wall_time_s"] = time.perf_counter() - began
    return tree


_VERSIONS = ("friction-bayes", "emcee", "arviz-stats", "numpy")


def _advance(run: Ensembles, due: int, ensembles: int, progress: Callable[[int, int], None] | None) -> None:
    before = run.steps
    more = due - before

    def report(done: int, of: int) -> None:
        if progress is not None:
            progress(before * of + done * more, due * of)

    run.advance(more, report)


def _burn_in(run: Ensembles) -> tuple[int, float]:
    """Return the steps to throw away and the autocorrelation time, of the slowest coordinate.

    The time is measured over the later two thirds, where the start is forgotten or shows as slow mixing;
    at most a third is thrown away, so that a chain that is too short is seen to be so.
    """
    third = run.steps // 3
    tau = max(mixing(scores).tau for scores in run.scores(third))
    wanted = max(BURN_IN * tau, _FIRST_STEPS / 3)
    return (third if wanted > third else math.ceil(wanted)), max(tau, 1.0)


def _natural(target: Target, coordinates: Array) -> dict[str, Array]:
    chains, draws, size = coordinates.shape
    natural = target.posterior(coordinates.reshape(-1, size))
    return {name: np.asarray(v).reshape(chains, draws, *np.shape(v)[1:]) for name, v in natural.items()}


def _scalars(target: Target, coordinates: Array, natural: Mapping[str, Array]) -> dict[str, Array]:
    """Return all scalar parameters to judge, (chains, draws) each: natural ones and the sampler's own."""
    own = {name: coordinates[..., i] for i, name in enumerate(target.names)}
    return own | {name: values for name, values in natural.items() if values.ndim == 2}
