"""Pareto-smoothed leave-one-out cross-validation, by ArviZ, from log-likelihoods per block of data."""

from __future__ import annotations

import warnings
from typing import Any

import arviz_stats
import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array

__all__ = ["leave_one_out"]


def leave_one_out(log_likelihood: Array) -> dict[str, Any]:
    """Estimate how well each block is predicted from all others.

    Parameters
    ----------
    log_likelihood : ndarray, shape (draws, blocks)
        Of nearly independent draws of the posterior.

    Returns
    -------
    dict
        ``elpd``, the expected log predictive density, and its standard error ``se``; ``p``, the effective
        number of parameters; ``largest_pareto_k``; ``trusted``, whether that is below the limit for this
        many draws (Vehtari et al. 2024); ``blocks``; ``pointwise``, the density of each block.
    """
    values = xr.Dataset({"signal": (("chain", "draw", "block"), log_likelihood[None])})
    tree = xr.DataTree.from_dict({"log_likelihood": values})
    with warnings.catch_warnings():
        # the result reports a large k
        warnings.simplefilter("ignore", UserWarning)
        found = arviz_stats.loo(tree, reff=1.0, pointwise=True)
    largest = float(found.pareto_k.max())
    return {
        "elpd": float(found.elpd),
        "se": float(found.se),
        "p": float(found.p),
        "largest_pareto_k": largest,
        "trusted": bool(largest <= found.good_k),
        "blocks": int(found.n_data_points),
        "pointwise": np.asarray(found.elpd_i, dtype=np.float64),
    }
