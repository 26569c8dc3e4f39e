"""Figures of a record: the signal under its fit, and its turning points under a linear envelope."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from friction_bayes.core.arrays import Array
from friction_bayes.core.text import words
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, caption, new_figure, styled

__all__ = ["plot_amplitudes", "plot_fit", "plot_residual", "signal_label"]

_HEADROOM = 1.1
"""Height of the axes over the largest swing, whatever the width of an interval."""


def signal_label(decay: FreeDecay) -> str:
    """Name quantity and unit of a signal for an axis."""
    return f"{words(decay.quantity.name)} [{decay.unit}]"


def plot_fit(
    decay: FreeDecay,
    prediction: Array,
    *,
    noise_sd: float,
    record: xr.DataArray | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the signal with its fit, its last cycles next to it, and the residual below.

    Parameters
    ----------
    decay : FreeDecay
        The moving part that was fitted.
    prediction : ndarray, shape (n,)
        Fitted signal over ``decay.time``, unit of the signal.
    noise_sd : float
        Estimated standard deviation of a sample, drawn as a band of two in the residual.
    record : xarray.DataArray, optional
        The whole record; what was cut away from it is drawn faintly.
    title : str, optional
        Name of the record when left out.

    Returns
    -------
    matplotlib.figure.Figure
    """
    time = decay.start_time + decay.time
    residual = decay.values - prediction
    with styled():
        figure = new_figure(9.0, 4.6)
        grid = figure.add_gridspec(2, 2, height_ratios=(2.6, 1.0), width_ratios=(2.2, 1.0))
        whole = figure.add_subplot(grid[0, 0])
        below = figure.add_subplot(grid[1, 0], sharex=whole)
        close = figure.add_subplot(grid[0, 1])
        shape = figure.add_subplot(grid[1, 1])

        if record is not None and record.size > time.size:
            whole.plot(record["time"], record.values, color=FAINT, lw=0.8, rasterized=True, label="not used")
        whole.plot(time, decay.values, color=DATA, lw=0.8, rasterized=True, label="record")
        whole.plot(time, prediction, color=MODEL, lw=0.9, label="fit")
        whole.set_ylabel(signal_label(decay))
        whole.set_title(title or decay.name)
        whole.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)
        whole.tick_params(labelbottom=False)

        _draw_residual(below, time, residual, noise_sd, decay.unit)

        period = 2.0 * math.pi / decay.frequency
        last = time >= time[-1] - 4.0 * period
        close.plot(time[last], decay.values[last], ".", color=DATA, ms=2.5, mew=0.0, rasterized=True)
        close.plot(time[last], prediction[last], color=MODEL)
        close.locator_params(axis="x", nbins=5)
        caption(close, "the last four cycles")

        _draw_histogram(shape, residual, noise_sd, decay.unit)
    return figure


def plot_residual(
    decay: FreeDecay, prediction: Array, *, noise_sd: float, frequency: float, title: str | None = None
) -> Figure:
    """Draw the residual of a fit against time, against phase, and its distribution.

    Parameters
    ----------
    decay, prediction, noise_sd, title
        As for :func:`plot_fit`.
    frequency : float
        Angular frequency of the fit [rad/s], by which the phase advances.

    Returns
    -------
    matplotlib.figure.Figure
    """
    residual = decay.values - prediction
    with styled():
        figure = new_figure(9.0, 4.6)
        panels = figure.subplot_mosaic([["time", "time"], ["phase", "shape"]], width_ratios=(2.2, 1.0))
        _draw_residual(panels["time"], decay.start_time + decay.time, residual, noise_sd, decay.unit)
        panels["time"].set_title(f"{title or decay.name}: residual")
        phase = np.degrees(frequency * decay.time + decay.phase) % 360.0
        _draw_residual(panels["phase"], phase, residual, noise_sd, decay.unit, ".")
        panels["phase"].set_xlabel("phase [deg], 0 at the positive turning points")
        panels["phase"].set_xticks([0, 90, 180, 270, 360])
        _draw_histogram(panels["shape"], residual, noise_sd, decay.unit)
    return figure


def _draw_residual(
    axes: Axes, x: Array, residual: Array, noise_sd: float, unit: str, marks: str = "-"
) -> None:
    """Residuals over a band of two standard deviations of the noise."""
    axes.axhspan(-2.0 * noise_sd, 2.0 * noise_sd, color=FAINT, lw=0.0)
    axes.plot(x, residual, marks, color=ACCENT, lw=0.6, ms=1.6, mew=0.0, rasterized=True)
    axes.set_ylabel(f"residual [{unit}]")
    axes.set_xlabel("time [s]")
    caption(axes, "shaded: ± 2 sd of the noise")
    low, high = np.quantile(residual, [0.0005, 0.9995])
    reach = 1.25 * max(abs(low), abs(high), 2.0 * noise_sd)
    axes.set_ylim(-reach, reach)


def _draw_histogram(axes: Axes, residual: Array, noise_sd: float, unit: str) -> None:
    """Distribution of the residuals under the normal one of the noise."""
    bound = 5.0 * max(noise_sd, float(np.std(residual)))
    axes.hist(residual, bins=41, range=(-bound, bound), density=True, color=FAINT)
    level = np.linspace(-bound, bound, 201)
    bell = np.exp(-0.5 * (level / noise_sd) ** 2) / (noise_sd * math.sqrt(2.0 * math.pi))
    axes.plot(level, bell, color=MODEL, lw=1.2)
    axes.set_xlabel(f"residual [{unit}]")
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.locator_params(axis="x", nbins=4)
    caption(axes, f"noise sd {noise_sd:.3g} {unit}")


def plot_amplitudes(
    decay: FreeDecay,
    cycles: xr.Dataset,
    coefficient: float,
    interval: tuple[float, float],
    *,
    fitted: Array | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the turning points and what dry friction of a coefficient takes of the amplitude, or a fit.

    Coulomb friction takes ``2 u`` from the amplitude in every half cycle: Eq. (2), per half cycle.

    Parameters
    ----------
    decay : FreeDecay
        The moving part of the record.
    cycles : xarray.Dataset
        Its turning points, from :func:`friction_bayes.decay.half_cycles.half_cycles`.
    coefficient : float
        Posterior mean of the signal's friction coefficient ``u``, unit of the signal.
    interval : tuple of float
        Its 90 % interval.
    fitted : ndarray, shape (cycles,), optional
        A fit at the turning points, drawn instead where more than dry friction takes of the amplitude.
    title : str, optional
        Name of the record when left out.

    Returns
    -------
    matplotlib.figure.Figure
    """
    moment = np.asarray(cycles["time"], dtype=float)
    rest = float(cycles.attrs["rest_position"])
    signed = np.asarray(cycles["value"], dtype=float) - rest
    size = np.asarray(cycles["amplitude"], dtype=float)
    # The line through the centre of the amplitudes: where every slope leaves their mean in place.
    middle, level = float(moment.mean()), float(size.mean())
    along = np.linspace(moment[0], moment[-1], 200)

    def envelope(u: float) -> Array:
        return level - 2.0 * u * decay.frequency / math.pi * (along - middle)

    with styled():
        figure = new_figure(7.0, 4.2)
        axes = figure.add_subplot()
        axes.plot(
            decay.start_time + decay.time,
            decay.values - rest,
            color=FAINT,
            lw=0.8,
            rasterized=True,
            label="record, rest at zero",
        )
        if fitted is None:
            edges = np.array([envelope(interval[0]), envelope(interval[1])])
            for sign in (1.0, -1.0):
                axes.fill_between(along, *(sign * edges), color=ACCENT, alpha=0.25, lw=0.0)
            line, label = (along, envelope(coefficient)), "what dry friction takes, 90 % interval shaded"
        else:
            line, label = (moment, np.abs(fitted - rest)), "what dry friction and all else in the fit take"
        for sign in (1.0, -1.0):
            axes.plot(line[0], sign * line[1], color=ACCENT, lw=1.4, ls="--")
        axes.plot([], [], color=ACCENT, ls="--", label=label)
        axes.plot(moment, signed, "o", ms=3.5, color=MODEL, label=f"{moment.size} turning points")
        axes.set_xlabel("time [s]")
        axes.set_ylabel(signal_label(decay))
        axes.set_title(title or decay.name)
        reach = _HEADROOM * max(float(size.max()), float(np.abs(decay.values - rest).max()))
        axes.set_ylim(-reach, reach)
        # below the axes: a wide interval fills them
        figure.legend(loc="outside lower center", ncols=3)
    return figure
