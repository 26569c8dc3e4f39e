"""What a reference run leaves: an ``xarray.DataTree`` in ArviZ's layout, and its file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import write_whole

__all__ = ["THINNED_DRAWS", "by_walker", "load_tree", "make_tree", "numbered", "save_tree"]


THINNED_DRAWS = 500
"""Most draws kept where each comes with numbers for all of the data, and draws of the prior."""

_PREDICTED_VALUES = 2_000_000
"""Most numbers in ``posterior_predictive``: 16 MB, 60 replications of a signal of 33,000 samples."""


def make_tree(
    target: Target,
    coordinates: Array,
    natural: Mapping[str, Array],
    log_prob: Array,
    ensembles: int,
    *,
    rng: np.random.Generator,
    attrs: Mapping[str, Any],
    diagnostics: Mapping[str, Mapping[str, Any]],
) -> xr.DataTree:
    """Lay draws out as ArviZ reads them: an ensemble is a chain, its walkers one after the other.

    Walkers of one ensemble depend on each other. Taken for chains they make the R-hat of a run that has
    converged 1.01, as each is short and holds a few independent draws. Ensembles are what is independent.
    Walker after walker, the autocorrelation along a chain is that of the sampler, and what ArviZ finds of it
    is what :mod:`friction_bayes.reference.convergence` finds.

    Parameters
    ----------
    target : Target
        What was sampled.
    coordinates : ndarray, shape (w, steps, d)
        The draws in the sampler's coordinates, of all walkers, ensemble after ensemble.
    natural : mapping of str to ndarray, shape (w, steps, ...)
        The same draws as natural parameters.
    log_prob : ndarray, shape (w, steps)
        Log-probability of each.
    ensembles : int
        How many ensembles the walkers are of.
    rng : numpy.random.Generator
        For predictions and prior draws.
    attrs : mapping
        Attributes of the whole.
    diagnostics : mapping of str to mapping
        Attributes of the variables of ``posterior``.

    Returns
    -------
    xarray.DataTree
        Groups ``posterior``, ``sample_stats`` (``lp``), ``observed_data``, ``log_likelihood`` and
        ``posterior_predictive`` (at most 500 of the posterior's draws, and one of each ensemble, under their
        own draw numbers) and, where the prior is proper, ``prior``. Coordinates ``chain``, the ensemble;
        ``draw``; and along it ``walker``.
    """
    walkers, steps, size = coordinates.shape
    coordinates = _chains(coordinates, ensembles)
    index = numbered(ensembles, walkers // ensembles, steps)
    posterior = _parameters({name: _chains(values, ensembles) for name, values in natural.items()}, index)
    for name, values in diagnostics.items():
        posterior[name].attrs.update(values)
    groups = {
        "posterior": posterior,
        "sample_stats": xr.Dataset({"lp": (("chain", "draw"), _chains(log_prob, ensembles))}, coords=index),
        "observed_data": xr.Dataset({target.observed_name: ("observation", target.observed)}),
    }
    thinned = _thin(index, THINNED_DRAWS)
    pointwise = target.pointwise(coordinates[:, thinned["draw"]].reshape(-1, size))
    groups["log_likelihood"] = _per_draw(target.observed_name, "block", pointwise, thinned)
    thinned = _thin(index, min(THINNED_DRAWS, _PREDICTED_VALUES // max(target.observed.size, 1)))
    predicted = target.predictive(coordinates[:, thinned["draw"]].reshape(-1, size), rng)
    groups["posterior_predictive"] = _per_draw(target.observed_name, "observation", predicted, thinned)
    try:
        prior = target.posterior(target.prior_draws(rng, THINNED_DRAWS))
    except InputError:
        # a flat prior can be updated but not drawn from
        attrs = {**attrs, "prior": "improper"}
    else:
        one = {"chain": np.arange(1), "draw": np.arange(THINNED_DRAWS)}
        groups["prior"] = _parameters({name: v[None] for name, v in prior.items()}, one)
    tree = xr.DataTree.from_dict(groups)
    tree.attrs.update(attrs)
    return tree


def _parameters(natural: Mapping[str, Array], index: Mapping[str, Any]) -> xr.Dataset:
    variables = {
        name: (("chain", "draw", *(f"{name}_dim_{i}" for i in range(values.ndim - 2))), values)
        for name, values in natural.items()
    }
    return xr.Dataset(variables, coords=index)


def numbered(ensembles: int, walkers: int, steps: int) -> dict[str, Any]:
    """Coordinates of draws laid out by :func:`make_tree`; ArviZ draws no trace without them.

    Parameters
    ----------
    ensembles, walkers, steps : int
        Walkers are those of one ensemble, steps those of one walker.
    """
    return {
        "chain": np.arange(ensembles),
        "draw": np.arange(walkers * steps),
        "walker": ("draw", np.repeat(np.arange(walkers), steps)),
    }


def _chains(values: Array, ensembles: int) -> Array:
    """Put the walkers of each ensemble one after the other: (w, steps, ...) to (ensembles, draws, ...)."""
    return values.reshape(ensembles, -1, *values.shape[2:])


def by_walker(draws: xr.DataArray) -> Array:
    """Return the draws of a scalar parameter by walker.

    Parameters
    ----------
    draws : xarray.DataArray, shape (chain, draw)
        With the coordinate ``walker``, as :func:`make_tree` lays them out.

    Returns
    -------
    ndarray, shape (ensembles, walkers, steps)
    """
    walkers = int(draws["walker"][-1]) + 1
    return np.asarray(draws.values).reshape(draws.sizes["chain"], walkers, -1)


def _thin(index: Mapping[str, Any], most: int) -> dict[str, Any]:
    """Pick at most ``most`` draws, evenly over walkers and time, and one of each ensemble at least."""
    draws = index["draw"].size
    kept = min(max(most // index["chain"].size, 1), draws)
    at = np.unique(np.linspace(0, draws - 1, kept).round().astype(int))
    return {**index, "draw": at, "walker": ("draw", index["walker"][1][at])}


def _per_draw(name: str, dim: str, values: Array, index: Mapping[str, Any]) -> xr.Dataset:
    shape = (index["chain"].size, index["draw"].size, values.shape[-1])
    return xr.Dataset({name: (("chain", "draw", dim), values.reshape(shape))}, coords=index)


def save_tree(tree: xr.DataTree, path: str | os.PathLike[str]) -> None:
    """Write a tree to NetCDF, whole or not at all: the file appears under its name when it is complete."""
    write_whole(Path(path), lambda aside: tree.to_netcdf(aside, engine="h5netcdf"))


def load_tree(path: str | os.PathLike[str]) -> xr.DataTree:
    """Read what :func:`save_tree` wrote, into memory.

    Raises
    ------
    InputError
        If there is no such file.
    """
    if not Path(path).is_file():
        raise InputError(os.fspath(path), "no such file", "give the NetCDF file of a reference run")
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        return tree.load()
