"""What a reference run leaves: an ``xarray.DataTree`` in ArviZ's layout, and its file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import write_whole

__all__ = ["THINNED_DRAWS", "load_tree", "make_tree", "save_tree"]


THINNED_DRAWS = 500
"""Most draws kept where each comes with numbers for all of the data, and draws of the prior."""

_PREDICTED_VALUES = 2_000_000
"""Most numbers in ``posterior_predictive``: 16 MB, 60 replications of a signal of 33,000 samples."""


def make_tree(
    target: Target,
    coordinates: Array,
    natural: Mapping[str, Array],
    log_prob: Array,
    ensemble: Integers,
    *,
    rng: np.random.Generator,
    attrs: Mapping[str, Any],
    diagnostics: Mapping[str, Mapping[str, Any]],
) -> xr.DataTree:
    """Lay draws out as ArviZ reads them.

    Parameters
    ----------
    target : Target
        What was sampled.
    coordinates : ndarray, shape (chains, draws, d)
        The draws in the sampler's coordinates.
    natural : mapping of str to ndarray, shape (chains, draws, ...)
        The same draws as natural parameters.
    log_prob : ndarray, shape (chains, draws)
        Log-probability of each.
    ensemble : ndarray, shape (chains,)
        The ensemble each chain (walker) belongs to: chains of one ensemble are not independent.
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
        ``posterior_predictive`` (at most 500 of the posterior's draws, under their own chain and draw
        numbers) and, where the prior is proper, ``prior``.
    """
    chains, draws, size = coordinates.shape
    index = {"chain": np.arange(chains), "draw": np.arange(draws), "ensemble": ("chain", ensemble)}
    posterior = _parameters(natural, index)
    for name, values in diagnostics.items():
        posterior[name].attrs.update(values)
    groups = {
        "posterior": posterior,
        "sample_stats": xr.Dataset({"lp": (("chain", "draw"), log_prob)}, coords=index),
        "observed_data": xr.Dataset({target.observed_name: ("observation", target.observed)}),
    }
    at, thinned = _thin(index, chains, draws, THINNED_DRAWS)
    pointwise = target.pointwise(coordinates[at].reshape(-1, size))
    groups["log_likelihood"] = _per_draw(target.observed_name, "block", pointwise, thinned)
    at, thinned = _thin(
        index, chains, draws, min(THINNED_DRAWS, _PREDICTED_VALUES // max(target.observed.size, 1))
    )
    predicted = target.predictive(coordinates[at].reshape(-1, size), rng)
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


def _thin(
    index: Mapping[str, Any], chains: int, draws: int, most: int
) -> tuple[tuple[Integers, ...], dict[str, Any]]:
    """Pick at most ``most`` draws, evenly over chains and time, with their own chain and draw numbers."""
    most = max(most, 1)
    kept = np.unique(np.linspace(0, chains - 1, min(chains, most)).round().astype(int))
    at = np.unique(np.linspace(0, draws - 1, min(max(most // chains, 1), draws)).round().astype(int))
    ensemble = index["ensemble"][1][kept]
    return np.ix_(kept, at), {"chain": kept, "draw": at, "ensemble": ("chain", ensemble)}


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
