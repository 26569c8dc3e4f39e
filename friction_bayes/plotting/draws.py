"""Figures of a sampler's draws, by ArviZ: whether the ensembles agree, and how far to trust them."""

from __future__ import annotations

import warnings
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from friction_bayes.plotting.style import styled
from friction_bayes.reference.inference_data import load_arviz, to_inference_data

__all__ = ["draws_figures"]

_RANKED_DRAWS = 500
"""Most draws of an ensemble that are ranked: the time that ArviZ takes grows with their square."""


def draws_figures(tree: xr.DataTree) -> dict[str, Figure]:
    """Draw ``ranks``, those of each ensemble among all, and ``ess``, the effective sample size by quantile.

    Parameters
    ----------
    tree : xarray.DataTree
        From :func:`friction_bayes.reference.sample_target`; all scalar parameters are drawn.

    Returns
    -------
    dict of str to matplotlib.figure.Figure

    Raises
    ------
    InputError
        If ArviZ is not installed.
    """
    arviz = load_arviz("drawing ranks and effective sample sizes")
    posterior = tree["posterior"].to_dataset()
    scalars = posterior[[name for name, each in posterior.data_vars.items() if each.ndim == 2]]
    every = -(-scalars.sizes["draw"] // _RANKED_DRAWS)
    drawn = {
        "ranks": (arviz.plot_rank, scalars.isel(draw=slice(None, None, every))),
        "ess": (arviz.plot_ess, scalars),
    }
    with styled(), warnings.catch_warnings():
        # ArviZ 0.2x is older than what matplotlib 3.11 deprecates
        warnings.simplefilter("ignore", mpl.MatplotlibDeprecationWarning)
        return {
            name: _figure(plot(to_inference_data(xr.DataTree.from_dict({"posterior": draws}))))
            for name, (plot, draws) in drawn.items()
        }


def _figure(plotted: Any) -> Figure:
    """The figure of a plot collection of ArviZ 1.x, or of the axes that 0.2x returns."""
    figure = plotted.viz["figure"].item() if hasattr(plotted, "viz") else np.ravel(plotted)[0].figure
    # ArviZ draws by pyplot, which would keep it
    plt.close(figure)
    # with six parameters and more its labels lie on each other
    figure.set_layout_engine("constrained")
    return figure
