"""A joint density and the border of the region that holds most of it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from friction_bayes.core.arrays import Array

__all__ = ["draw_region"]


def draw_region(
    axes: Axes,
    friction: Array,
    precision: Array,
    density: Array,
    level: float,
    *,
    shade: bool,
    style: str,
    colour: str,
) -> None:
    """Draw a joint density of friction and precision with the border of the region that holds 90 %.

    Parameters
    ----------
    axes : Axes
    friction, precision : ndarray, shapes (n,), (m,)
    density : ndarray, shape (m, n)
    level : float
        Density on the border.
    shade : bool
        Whether to shade the density.
    style, colour : str
        Of the border.
    """
    if shade:
        levels = np.linspace(0.03, 1.0, 12) * density.max()
        axes.contourf(friction, precision, density, levels=levels, cmap="Greys", alpha=0.8)
    axes.contour(
        friction, precision, density, levels=[level], colors=[colour], linestyles=[style], linewidths=1.6
    )
