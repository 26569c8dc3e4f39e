"""What a command draws of what it has sampled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from friction_bayes.cli.console import note
from friction_bayes.core.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["figures_of_draws"]


def figures_of_draws(tree: xr.DataTree) -> dict[str, Any]:
    """Draw the figures of a sampler's draws, or say in a line what would draw them.

    Parameters
    ----------
    tree : xarray.DataTree
        As for :func:`friction_bayes.plotting.draws.draws_figures`.

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        Empty where they cannot be drawn.
    """
    from friction_bayes.plotting.draws import draws_figures

    try:
        return draws_figures(tree)
    except InputError as error:
        note(error.for_command_line)
        return {}
