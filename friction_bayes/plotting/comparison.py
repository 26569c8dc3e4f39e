"""Estimators side by side: interval, mean and reference of each against the true value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from friction_bayes.plotting.style import ACCENT, FAINT, MODEL, TRUTH, new_figure, styled

__all__ = ["Interval", "plot_estimators"]


@dataclass(frozen=True, kw_only=True)
class Interval:
    """One row of the figure: an estimate and, where one was made, its reference.

    Attributes
    ----------
    label : str
        Name of the estimator.
    mean, low, high : float
        Closed form: posterior mean and 90 % interval.
    reference : tuple of float, optional
        The sampler's mean and 90 % interval: (mean, low, high).
    """

    label: str
    mean: float
    low: float
    high: float
    reference: tuple[float, float, float] | None = None


def _draw(axes: Axes, rows: Sequence[Interval], centre: float | None) -> None:
    for place, row in enumerate(rows):
        if place % 2 == 0:
            axes.axhspan(place - 0.5, place + 0.5, color=FAINT, alpha=0.35, lw=0.0)
        axes.plot([row.low, row.high], [place - 0.14] * 2, color=MODEL, lw=2.6)
        axes.plot([row.mean], [place - 0.14], "o", ms=6.0, color=MODEL)
        if row.reference is not None:
            mean, low, high = row.reference
            axes.plot([low, high], [place + 0.14] * 2, color=ACCENT, lw=1.2)
            axes.plot([mean], [place + 0.14], "D", ms=4.5, color="white", mec=ACCENT, mew=1.3)
    if centre is not None:
        axes.axvline(centre, color=TRUTH, lw=1.2, ls=":")
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(range(len(rows)), [row.label for row in rows])
    axes.tick_params(left=False)
    axes.spines["left"].set_visible(False)


def plot_estimators(
    rows: Sequence[Interval],
    *,
    unit: str,
    truth: float | None = None,
    reach: float = 0.6,
    title: str = "friction",
) -> Figure:
    """Draw the estimators' intervals one below the other, around the true value where it is known.

    Parameters
    ----------
    rows : sequence of Interval
        From top to bottom.
    unit : str
        Unit of friction.
    truth : float, optional
        True value of a synthetic record; a second panel then shows the errors of the best estimate closely.
    reach : float
        Half width of the first panel as a share of the true value; an arrow points to what lies outside.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with styled():
        figure = new_figure(9.0 if truth else 7.0, 1.5 + 0.52 * len(rows))
        if truth is None:
            axes = figure.add_subplot()
            _draw(axes, rows, None)
            axes.set_xlabel(f"friction [{unit}]")
            left = axes
        else:
            left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.6, 1.0))
            _draw(left, rows, truth)
            left.set_xlim(truth * (1.0 - reach), truth * (1.0 + reach))
            left.set_xlabel(f"friction [{unit}]")
            errors = [_relative(row, truth) for row in rows]
            _draw(right, errors, 0.0)
            zoom = 1.6 * min(max(abs(row.low), abs(row.high)) for row in errors)
            right.set_xlim(-zoom, zoom)
            right.locator_params(axis="x", nbins=5)
            decimals = 0 if zoom > 0.02 else 1 if zoom > 2e-3 else 2
            right.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=decimals, symbol=" %"))
            right.set_xlabel("error, close to the true value")
            right.tick_params(labelleft=False)
            for axes, drawn, edge in ((left, rows, truth * (1.0 + reach)), (right, errors, zoom)):
                _tell_outside(axes, drawn, edge, with_value=axes is left)
        left.set_title(title)
        handles = [
            left.plot([], [], "-o", lw=2.6, ms=6.0, color=MODEL)[0],
            left.plot([], [], "-D", lw=1.2, ms=4.5, color=ACCENT, mfc="white", mec=ACCENT)[0],
        ]
        labels = ["closed form, 90 % interval", "emcee, 90 % interval"]
        if truth is not None:
            handles.append(left.plot([], [], ls=":", lw=1.2, color=TRUTH)[0])
            labels.append(f"true value {truth:.4g} {unit}")
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _tell_outside(axes: Axes, rows: Sequence[Interval], edge: float, *, with_value: bool) -> None:
    """Point to intervals that lie to the right of the panel."""
    for place, row in enumerate(rows):
        if row.low > edge:
            axes.annotate(
                f"{row.mean:.3g} →" if with_value else "→",
                (0.985, place),
                xycoords=("axes fraction", "data"),
                ha="right",
                va="center",
                color=MODEL,
            )


def _relative(row: Interval, truth: float) -> Interval:
    """Return a row as relative error."""
    reference = row.reference and tuple(value / truth - 1.0 for value in row.reference)
    return Interval(
        label=row.label,
        mean=row.mean / truth - 1.0,
        low=row.low / truth - 1.0,
        high=row.high / truth - 1.0,
        reference=reference,  # type: ignore[arg-type]
    )
