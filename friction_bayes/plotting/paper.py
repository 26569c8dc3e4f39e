"""The figures of the paper on one's own data: each takes axes, or makes some, and returns them.

Fig. 1: :func:`detection_points`; 2, 3, 8, 10, 12 and 14: :func:`prior_and_posterior`; 4:
:func:`samples_used`; 6: :func:`force`; 7 and 9: :func:`response`; 11: :func:`part`; 13: :func:`rates`. Fig. 5
has no data.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.errors import InputError
from friction_bayes.core.text import words
from friction_bayes.estimators.result import Estimate
from friction_bayes.monitor.report import MonitorReport
from friction_bayes.plotting.credible_region import draw_region
from friction_bayes.plotting.monitor import draw_detection_points
from friction_bayes.plotting.samples_used import samples_used
from friction_bayes.plotting.style import ACCENT, DATA, MODEL, TRUTH, Panels, panels_of, styled

__all__ = [
    "detection_points",
    "force",
    "part",
    "prior_and_posterior",
    "rates",
    "response",
    "samples_used",
]

_LINES = (("-", ACCENT), ("--", MODEL), (":", TRUTH), ("-.", DATA))
_GRID = 121
_PRIOR_SHARE, _POSTERIOR_SHARE, _PRECISION_SHARE = 0.95, 0.99, 0.997
"""Of a distribution that its axis shows."""
_PERIODS = 2.0
"""Periods that a response is enlarged for, so that the jumps at the turning points show."""
_THICK = "#b5b5b5"


def detection_points(report: MonitorReport, *, axes: Axes | None = None) -> Axes:
    """Draw the friction at each detection point, the threshold and the remaining life: Fig. 1.

    Parameters
    ----------
    report : MonitorReport
    axes : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    with styled():
        (axes,) = panels_of(axes, 1, height=4.8)
        draw_detection_points(axes, report)
        axes.legend(loc="upper left")
    return axes


def prior_and_posterior(
    *estimates: Estimate, truth: float | None = None, axes: Sequence[Axes] | None = None
) -> Panels:
    """Draw the prior above, and below it the posterior of each estimate: Figs. 2, 3, 8, 10, 12 and 14.

    Of ``normal-gamma`` it is the joint density of friction and precision with its 90 % region, of
    ``gamma-exponential`` the density of what that pair calls friction.

    Parameters
    ----------
    *estimates : Estimate
        By one of the paper's two methods, from one prior; the prior of the first is drawn.
    truth : float, optional
        True friction of a synthetic record, or one known from another source [N or N m].
    axes : sequence of two matplotlib.axes.Axes, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)

    Raises
    ------
    InputError
        If there is no estimate, one is by another method, or the prior is improper and cannot be drawn.
    """
    kinds = {type(each.fit.posterior) for each in estimates}
    if len(kinds) != 1 or not kinds <= _DRAWN.keys():
        methods = ", ".join(each.method for each in estimates) or "none"
        raise InputError(
            "estimates", f"by {methods}", "give all by normal-gamma, or all by gamma-exponential"
        )
    (kind,) = kinds
    draw = _DRAWN[kind]
    with styled():
        above, below = panels = panels_of(axes, 2, height=6.0)
        draw(above, estimates[0], kind(**estimates[0].prior), _PRIOR_SHARE, "prior", _LINES[0], shade=True)
        for k, estimate in enumerate(estimates):
            label = f"{estimate.decay.name}, {estimate.peaks} peaks"
            line = _LINES[k % len(_LINES)]
            draw(below, estimate, estimate.fit.posterior, _POSTERIOR_SHARE, label, line, shade=k == 0)
        above.set_title("prior")
        below.set_title("posterior")
        for each in panels:
            if truth is not None:
                each.axvline(truth, color=TRUTH, lw=1.2, ls=":", label=f"reference {truth:g}")
            each.legend(loc="upper right")
    return panels


def _draw_joint(
    axes: Axes,
    estimate: Estimate,
    pair: NormalGamma,
    share: float,
    label: str,
    line: tuple[str, str],
    *,
    shade: bool,
) -> None:
    low, high = pair.friction.interval(share)
    friction = np.linspace(low, high, _GRID)
    precision = np.linspace(0.0, float(pair.precision.ppf(_PRECISION_SHARE)), _GRID + 1)[1:]
    density = np.exp(pair.logpdf(friction[None, :], precision[:, None]))
    level, (style, colour) = math.exp(pair.credible_level(0.9)), line
    draw_region(axes, friction, precision, density, level, shade=shade, style=style, colour=colour)
    axes.plot([], [], color=colour, ls=style, lw=1.6, label=f"{label}: 90 % region")
    axes.set_xlabel(f"friction r [{estimate.friction_unit}]")
    axes.set_ylabel(f"precision s [{estimate.precision_unit}]")


def _draw_rate(
    axes: Axes,
    estimate: Estimate,
    pair: GammaExponential,
    share: float,
    label: str,
    line: tuple[str, str],
    *,
    shade: bool,
) -> None:
    low, high = pair.friction.interval(share)
    rate = np.linspace(0.0, 1.2 * high, 4 * _GRID)
    density = pair.friction.pdf(rate)
    style, colour = line
    axes.plot(rate, density, color=colour, ls=style, label=label)
    if shade:
        axes.fill_between(rate, density, where=(rate >= low) & (rate <= high), color=DATA, alpha=0.3, lw=0.0)
    axes.set_xlabel(f"what the pair calls friction: a rate [1/{estimate.friction_unit}]")
    axes.set_ylabel("density")
    axes.set_ylim(bottom=0.0)


_DRAWN: dict[type, Callable[..., None]] = {NormalGamma: _draw_joint, GammaExponential: _draw_rate}
"""By the kind of the posterior."""


def force(
    time: ArrayLike, measured: ArrayLike, friction: float, *, unit: str = "N", axes: Axes | None = None
) -> Axes:
    """Draw a measured friction force and Coulomb's, of one size against the same motion: Fig. 6.

    Parameters
    ----------
    time : array_like, shape (n,)
        [s].
    measured : array_like, shape (n,)
        Its sign is that of the motion.
    friction : float
        Coulomb's force.
    unit : str
        Of both forces.
    axes : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    with styled():
        (axes,) = panels_of(axes, 1, height=3.4)
        axes.plot(time, measured, color=DATA, lw=1.4, label="measured")
        coulomb = friction * np.sign(np.asarray(measured, dtype=float))
        axes.plot(time, coulomb, color=ACCENT, lw=1.0, ls="--", label=f"Coulomb, ±{friction:.4g} {unit}")
        axes.set_xlabel("time [s]")
        axes.set_ylabel(f"friction force [{unit}]")
        axes.legend(loc="upper right")
    return axes


def response(
    record: xr.DataArray,
    estimated: xr.DataArray,
    *,
    frequency: float,
    axes: Sequence[Axes] | None = None,
) -> Panels:
    """Draw the acquired signal and the response of the estimated friction, whole and enlarged: Figs. 7 and 9.

    Parameters
    ----------
    record : xarray.DataArray
    estimated : xarray.DataArray
        Of the same quantity, as :func:`friction_bayes.simulate` makes it of the friction that was estimated.
    frequency : float
        Of the motion [rad/s], as ``estimate.frequency``.
    axes : sequence of two matplotlib.axes.Axes, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)
    """
    time = record["time"].values
    middle = 0.5 * (time[0] + time[-1])
    reach = _PERIODS * 2.0 * math.pi / frequency
    with styled():
        panels = panels_of(axes, 2, height=5.0)
        for each in panels:
            _draw_record(each, record, color=_THICK, lw=2.4, label="acquired")
            each.plot(estimated["time"], estimated.values, color=MODEL, lw=0.9, label="estimated")
        panels[0].legend(loc="upper right", ncols=2)
        seen = record.values[(time > middle) & (time < middle + reach)]
        panels[1].set_xlim(middle, middle + reach)
        panels[1].set_ylim(1.15 * seen.min(), 1.15 * seen.max())
        panels[1].set_title(f"{_PERIODS:.0f} periods of it")
    return panels


def part(record: xr.DataArray, reduced: xr.DataArray, *, axes: Sequence[Axes] | None = None) -> Panels:
    """Draw a record with a part of it marked, and that part enlarged: Fig. 11.

    Parameters
    ----------
    record, reduced : xarray.DataArray
    axes : sequence of two matplotlib.axes.Axes, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)
    """
    with styled():
        panels = panels_of(axes, 2, height=5.0)
        _draw_record(panels[0], record, color=DATA, lw=1.0, label="whole record")
        for each in panels:
            _draw_record(each, reduced, color=MODEL, lw=0.9, label="part")
        panels[0].legend(loc="upper right", ncols=2)
        panels[1].set_title("the part")
    return panels


def rates(*records: xr.DataArray, axes: Sequence[Axes] | None = None) -> Panels:
    """Draw one record at several sampling rates, a panel each: Fig. 13.

    Parameters
    ----------
    *records : xarray.DataArray
    axes : sequence of matplotlib.axes.Axes, optional
        As many as records.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (records,)
    """
    with styled():
        panels = panels_of(axes, len(records), height=2.0 * max(len(records), 1))
        for each, record in zip(panels, records, strict=True):
            time = record["time"].values
            _draw_record(each, record, color=MODEL, lw=0.8, marker=".", ms=2.5)
            each.set_title(f"{(time.size - 1) / (time[-1] - time[0]):.4g} Hz")
    return panels


def _draw_record(axes: Axes, record: xr.DataArray, **style: Any) -> None:
    axes.plot(record["time"], record.values, rasterized=True, **style)
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"{words(record.attrs['quantity'])} [{record.attrs['units']}]")
