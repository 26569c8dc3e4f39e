"""Every figure of an estimate, and of several estimators of one record, by name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.errors import InputError
from friction_bayes.core.summary import TAILS
from friction_bayes.decay.half_cycles import half_cycles
from friction_bayes.estimators.result import Estimate
from friction_bayes.plotting.comparison import Interval, plot_estimators
from friction_bayes.plotting.posterior import draw_friction, plot_friction, plot_friction_panels, plot_joint
from friction_bayes.plotting.signal import plot_amplitudes, plot_fit, plot_residual, signal_label
from friction_bayes.plotting.style import DATA, MODEL, new_figure, styled

if TYPE_CHECKING:
    from friction_bayes.reference.checking import ReferenceRun

__all__ = ["comparison_figures", "estimate_figures", "joint_figure", "plot_estimate", "signal_figures"]

_GRID_POINTS = 240
_GRID_TAILS = (5e-5, 1.0 - 5e-5)


def plot_estimate(estimate: Estimate) -> Figure:
    """Draw an estimate at a glance: the record with its fit, where the method has one, and friction.

    Parameters
    ----------
    estimate : Estimate

    Returns
    -------
    matplotlib.figure.Figure
    """
    decay, prediction = estimate.decay, estimate.fit.prediction
    time = decay.start_time + decay.time
    with styled():
        figure = new_figure(10.0, 3.8)
        signal, friction = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
        signal.plot(time, decay.values, color=DATA, lw=0.8, rasterized=True, label="record")
        if prediction is not None:
            signal.plot(time, prediction, color=MODEL, lw=0.9, label="fit")
        low, high = signal.get_ylim()
        signal.set_ylim(low, high + 0.15 * (high - low))
        signal.set_xlabel("time [s]")
        signal.set_ylabel(signal_label(decay))
        signal.set_title(f"{decay.name}, {estimate.method}")
        signal.legend(loc="upper right", ncols=2)
        draw_friction(friction, estimate.friction, None, None)
        friction.set_xlabel(f"friction [{estimate.friction_unit}]")
        friction.set_title("friction, 90 % interval shaded")
    return figure


def estimate_figures(
    estimate: Estimate, record: xr.DataArray | None = None, check: ReferenceRun | None = None
) -> dict[str, Figure]:
    """Draw every figure of one estimate.

    Parameters
    ----------
    estimate : Estimate
    record : xarray.DataArray, optional
        The whole record, of which the estimate has the free decay.
    check : ReferenceRun, optional
        Its reference run.
    """
    figures, fit = signal_figures(estimate, record), estimate.fit
    if fit.prediction is not None and "fit" in figures:
        figures["residual"] = plot_residual(
            estimate.decay, fit.prediction, noise_sd=fit.noise_sd, frequency=fit.frequency
        )
    figures["friction"] = plot_friction(
        estimate.friction,
        unit=estimate.friction_unit,
        draws=None if check is None else check.friction,
        title=f"{estimate.decay.name}, {estimate.method}",
    )
    if isinstance(fit.posterior, NormalGamma):
        figures["joint"] = joint_figure(estimate)
    return figures


def signal_figures(estimate: Estimate, record: xr.DataArray | None = None) -> dict[str, Figure]:
    """Draw the signal under its fit, where the method has one, and the turning points under the envelope.

    Parameters
    ----------
    estimate : Estimate
    record : xarray.DataArray, optional
        The whole record.
    """
    fit, decay = estimate.fit, estimate.decay
    figures = {}
    if fit.prediction is not None and math.isfinite(fit.noise_sd):
        figures["fit"] = plot_fit(decay, fit.prediction, noise_sd=fit.noise_sd, record=record)
    try:
        cycles = half_cycles(decay)
    except InputError:
        # A record may be long enough for the estimator and too short for turning points of its own.
        return figures
    low, high = (float(fit.coefficient.ppf(q)) for q in TAILS)
    fitted = None
    if fit.prediction is not None and fit.uneven_loss is not None and fit.uneven_loss.probability > 0.5:
        fitted = np.interp(cycles["time"].values, decay.start_time + decay.time, fit.prediction)
    figures["amplitudes"] = plot_amplitudes(
        decay, cycles, float(fit.coefficient.mean()), (low, high), fitted=fitted
    )
    return figures


def joint_figure(estimate: Estimate, *, truth: float | None = None) -> Figure:
    """Draw the joint normal-gamma density of friction and precision with its 90 % region.

    Parameters
    ----------
    estimate : Estimate
        By ``normal-gamma``.
    truth : float, optional
        True friction of a synthetic record.
    """
    posterior = estimate.fit.posterior
    friction, precision = posterior.friction, posterior.precision
    r, s = (_grid(marginal) for marginal in (friction, precision))
    return plot_joint(
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


def _grid(marginal: Any) -> np.ndarray:
    low, high = (float(marginal.ppf(q)) for q in _GRID_TAILS)
    return np.linspace(low, high, _GRID_POINTS)


def comparison_figures(
    estimates: Sequence[Estimate], checks: Mapping[str, ReferenceRun], *, truth: float, title: str
) -> dict[str, Figure]:
    """Draw several estimators of one record side by side: intervals, and densities.

    Parameters
    ----------
    estimates : sequence of Estimate
    checks : mapping of str to ReferenceRun
        Reference runs by method.
    truth : float
        True friction.
    title : str
        What the record is.
    """
    unit = estimates[0].friction_unit
    rows = [_interval(each, checks.get(each.method)) for each in estimates]
    return {
        "estimators": plot_estimators(rows, unit=unit, truth=truth, title=title),
        "posteriors": plot_friction_panels(
            {each.method: each.friction for each in estimates},
            unit=unit,
            draws={method: check.friction for method, check in checks.items()},
            truth=truth,
            title=title,
        ),
    }


def _interval(estimate: Estimate, check: ReferenceRun | None) -> Interval:
    sampled = None if check is None else check.summary["friction"]
    low, high = (float(estimate.friction.ppf(q)) for q in TAILS)
    return Interval(
        label=estimate.method,
        mean=float(estimate.friction.mean()),
        low=low,
        high=high,
        reference=None if sampled is None else (sampled["mean"], *sampled["interval90"]),
    )
