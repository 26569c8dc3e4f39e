"""Figures of a posterior: closed form against sampler; joint density of friction and precision."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import TAILS
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, TRUTH, margin_note, new_figure, styled

__all__ = ["draw_friction", "plot_friction", "plot_friction_panels", "plot_joint"]


def draw_friction(axes: Axes, friction: Any, draws: Array | None, truth: float | None) -> None:
    """Density of a frozen distribution over a histogram of draws, the true value as a line."""
    low, high = (float(q) for q in friction.ppf([0.0005, 0.9995]))
    if draws is not None:
        low, high = min(low, float(np.quantile(draws, 0.0005))), max(high, float(np.quantile(draws, 0.9995)))
        axes.hist(draws, bins=60, range=(low, high), density=True, color=FAINT, label="emcee")
    grid = np.linspace(low, high, 400)
    density = friction.pdf(grid)
    axes.plot(grid, density, color=MODEL, label="closed form")
    left, right = (float(q) for q in friction.ppf(TAILS))
    inside = (grid >= left) & (grid <= right)
    axes.fill_between(grid[inside], density[inside], color=MODEL, alpha=0.15, lw=0.0, label="90 % interval")
    if truth is not None:
        reach = 0.5 * (high - low)
        if low - reach <= truth <= high + reach:
            axes.axvline(truth, color=TRUTH, lw=1.2, ls=":", label="true value")
        else:
            side = "right" if truth > high else "left"
            arrow = "→" if side == "right" else "←"
            margin_note(axes, f"true value {truth:.4g} {arrow}", place=f"upper {side}")
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.set_ylim(bottom=0.0)
    axes.locator_params(axis="x", nbins=5)


def plot_friction(
    friction: Any,
    *,
    unit: str,
    draws: Array | None = None,
    truth: float | None = None,
    title: str = "friction",
) -> Figure:
    """Draw the closed-form friction density against a histogram of sampler draws.

    Parameters
    ----------
    friction : frozen scipy.stats distribution
        Closed-form posterior.
    unit : str
        Its unit.
    draws : ndarray, any shape, optional
        Friction draws of the sampler, same unit.
    truth : float, optional
        True value of a synthetic record.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with styled():
        figure = new_figure(6.0, 3.6)
        axes = figure.add_subplot()
        draw_friction(axes, friction, None if draws is None else np.ravel(draws), truth)
        axes.set_xlabel(f"friction [{unit}]")
        axes.set_title(title)
        # clear of the curve, which may have two humps
        axes.legend(loc="best")
    return figure


def plot_friction_panels(
    frictions: Mapping[str, Any],
    *,
    unit: str,
    draws: Mapping[str, Array],
    truth: float | None = None,
    title: str | None = None,
) -> Figure:
    """Draw one panel an estimator, closed form against sampler; each on its own scale.

    Parameters
    ----------
    frictions : mapping of str to frozen distribution
        Closed-form posterior by method.
    unit : str
        Their unit.
    draws : mapping of str to ndarray
        Sampler draws by method; a method without draws is drawn without a histogram.
    truth : float, optional
        True value of a synthetic record.
    title : str, optional
        Title over all panels.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with styled():
        figure = new_figure(9.0, 5.6)
        rows = (len(frictions) + 1) // 2
        panels = figure.subplots(rows, 2, squeeze=False).ravel()
        for axes, (method, friction) in zip(panels, frictions.items(), strict=False):
            sample = draws.get(method)
            draw_friction(axes, friction, None if sample is None else np.ravel(sample), truth)
            axes.set_title(method)
            axes.set_xlabel(f"friction [{unit}]")
        for axes in panels[len(frictions) :]:
            axes.set_axis_off()
        handles, labels = panels[0].get_legend_handles_labels()
        if truth is not None and "true value" not in labels:
            handles.append(Line2D([], [], color=TRUTH, lw=1.2, ls=":"))
            labels.append("true value")
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        if title:
            figure.suptitle(title, fontweight="bold", x=0.01, ha="left")
    return figure


def plot_joint(
    friction_grid: Array,
    precision_grid: Array,
    density: Array,
    level90: float,
    *,
    friction_unit: str,
    precision_unit: str,
    friction: Any,
    precision: Any,
    truth: float | None = None,
    title: str = "joint posterior",
) -> Figure:
    """Draw the joint density of friction and precision, its 90 % region and both marginals.

    Parameters
    ----------
    friction_grid, precision_grid : ndarray, shapes (n,), (m,)
        Axes of the density.
    density : ndarray, shape (m, n)
        Joint density, rows along precision.
    level90 : float
        Density on the border of the smallest region that holds 90 %.
    friction_unit, precision_unit : str
        Units of the axes.
    friction, precision : frozen scipy.stats distributions
        The marginals.
    truth : float, optional
        True friction of a synthetic record.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with styled():
        figure = new_figure(6.4, 5.4)
        grid = figure.add_gridspec(2, 2, width_ratios=(4.0, 1.0), height_ratios=(1.0, 4.0))
        joint = figure.add_subplot(grid[1, 0])
        top = figure.add_subplot(grid[0, 0], sharex=joint)
        side = figure.add_subplot(grid[1, 1], sharey=joint)

        joint.contourf(
            friction_grid,
            precision_grid,
            density,
            levels=np.linspace(0.02, 1.0, 13) * density.max(),
            cmap="Blues",
        )
        joint.contour(
            friction_grid, precision_grid, density, levels=[level90], colors=[ACCENT], linewidths=1.6
        )
        joint.plot([], [], color=ACCENT, lw=1.6, label="90 % region")
        if truth is not None:
            joint.axvline(truth, color=TRUTH, lw=1.2, ls=":", label="true friction")
            top.axvline(truth, color=TRUTH, lw=1.2, ls=":")
        joint.set_xlabel(f"friction r [{friction_unit}]")
        joint.set_ylabel(f"precision s [{precision_unit}]")
        joint.legend(loc="upper right")

        top.fill_between(friction_grid, friction.pdf(friction_grid), color=DATA, alpha=0.4, lw=0.0)
        top.plot(friction_grid, friction.pdf(friction_grid), color=MODEL)
        side.fill_betweenx(precision_grid, precision.pdf(precision_grid), color=DATA, alpha=0.4, lw=0.0)
        side.plot(precision.pdf(precision_grid), precision_grid, color=MODEL)
        top.set_title(title)
        for axes in (top, side):
            axes.tick_params(labelbottom=False, labelleft=False, left=False, bottom=False)
            for spine in axes.spines.values():
                spine.set_visible(False)
    return figure
