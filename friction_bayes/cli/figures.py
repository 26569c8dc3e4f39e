"""Figures of estimates: what is drawn of which, and under which file name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.errors import InputError
from friction_bayes.decay.half_cycles import half_cycles
from friction_bayes.estimators.result import Estimate
from friction_bayes.plotting import (
    Interval,
    plot_amplitudes,
    plot_estimators,
    plot_fit,
    plot_friction,
    plot_friction_panels,
    plot_joint,
    save_figure,
)
from friction_bayes.reference.checking import ReferenceRun

__all__ = ["draw_comparison", "draw_estimate", "draw_joint", "draw_signal"]

_GRID_POINTS = 240
_GRID_TAILS = (5e-5, 1.0 - 5e-5)


def draw_estimate(
    estimate: Estimate,
    record: xr.DataArray,
    check: ReferenceRun | None,
    folder: Path,
    *,
    truth: float | None = None,
) -> None:
    """Leave every figure of one estimate in ``folder``.

    Parameters
    ----------
    estimate : Estimate
    record : xarray.DataArray
        The whole record.
    check : ReferenceRun or None
        Its reference run.
    folder : path
    truth : float, optional
        True friction of a synthetic record.
    """
    draw_signal(estimate, record, folder)
    draws = None if check is None else check.friction
    figure = plot_friction(
        estimate.friction,
        unit=estimate.friction_unit,
        draws=draws,
        truth=truth,
        title=f"{estimate.decay.name}, {estimate.method}",
    )
    save_figure(figure, folder, "friction")
    if isinstance(estimate.fit.posterior, NormalGamma):
        draw_joint(estimate, folder, "joint", truth=truth)


def draw_signal(estimate: Estimate, record: xr.DataArray, folder: Path, *, prefix: str = "") -> None:
    """Draw the signal under its fit, where the method has one, and the turning points under the envelope."""
    fit, decay = estimate.fit, estimate.decay
    if fit.prediction is not None and math.isfinite(fit.noise_sd):
        figure = plot_fit(decay, fit.prediction, noise_sd=fit.noise_sd, record=record)
        save_figure(figure, folder, f"{prefix}fit")
    try:
        cycles = half_cycles(decay)
    except InputError:
        # A record may be long enough for the estimator and too short for turning points of its own.
        return
    low, high = (float(fit.coefficient.ppf(q)) for q in (0.05, 0.95))
    figure = plot_amplitudes(decay, cycles, float(fit.coefficient.mean()), (low, high))
    save_figure(figure, folder, f"{prefix}amplitudes")


def draw_joint(estimate: Estimate, folder: Path, name: str, *, truth: float | None = None) -> None:
    """Draw the joint normal-gamma density of friction and precision with its 90 % region."""
    posterior = estimate.fit.posterior
    friction, precision = posterior.friction, posterior.precision
    r, s = (_grid(marginal) for marginal in (friction, precision))
    figure = plot_joint(
        r,
        s,
        np.exp(posterior.logpdf(r[None, :], s[:, None])),
        math.exp(posterior.credible_level(0.9)),
        friction_unit=estimate.friction_unit,
        precision_unit=estimate.precision_unit,
        friction=friction,
        precision=precision,
        truth=truth,
        title=f"{estimate.decay.name}: joint posterior",
    )
    save_figure(figure, folder, name)


def _grid(marginal: Any) -> np.ndarray:
    low, high = (float(marginal.ppf(q)) for q in _GRID_TAILS)
    return np.linspace(low, high, _GRID_POINTS)


def draw_comparison(
    estimates: Sequence[Estimate],
    checks: Mapping[str, ReferenceRun],
    folder: Path,
    *,
    truth: float,
    title: str,
    prefix: str = "",
) -> None:
    """Draw several estimators of one record side by side: intervals, and densities.

    Parameters
    ----------
    estimates : sequence of Estimate
    checks : mapping of str to ReferenceRun
        Reference runs by method.
    folder : path
    truth : float
        True friction.
    title : str
        What the record is.
    prefix : str
        Of the file names.
    """
    unit = estimates[0].friction_unit
    rows = [_interval(each, checks.get(each.method)) for each in estimates]
    save_figure(plot_estimators(rows, unit=unit, truth=truth, title=title), folder, f"{prefix}estimators")
    figure = plot_friction_panels(
        {each.method: each.friction for each in estimates},
        unit=unit,
        draws={method: check.friction for method, check in checks.items()},
        truth=truth,
        title=title,
    )
    save_figure(figure, folder, f"{prefix}posteriors")


def _interval(estimate: Estimate, check: ReferenceRun | None) -> Interval:
    return Interval(
        label=estimate.method,
        mean=float(estimate.friction.mean()),
        low=float(estimate.friction.ppf(0.05)),
        high=float(estimate.friction.ppf(0.95)),
        reference=None if check is None else _reference(check.friction),
    )


def _reference(draws: np.ndarray) -> tuple[Any, ...]:
    low, high = np.quantile(draws, [0.05, 0.95])
    return float(draws.mean()), float(low), float(high)
