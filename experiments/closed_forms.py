"""Every closed form on one record, compared with the truth and, on some, with emcee: the cell of a sweep."""

from __future__ import annotations

import math
import warnings
import zlib
from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import SAMPLED, sampled
from friction_bayes.conjugate.gamma_exponential import negative_share
from friction_bayes.decay.friction_samples import peak_amplitudes
from friction_bayes.mechanics.simulate import signal_to_noise_db

__all__ = [
    "AGAINST_TRUTH",
    "METHODS",
    "VARIABLES",
    "against_truth",
    "closed_form_seconds",
    "measure",
    "posterior_against_truth",
]

METHODS = {
    "waveform": ("waveform", "highest"),
    "envelope": ("envelope", "highest"),
    "normal-gamma, highest": ("normal-gamma", "highest"),
    "normal-gamma, nominal": ("normal-gamma", "nominal"),
    "gamma-exponential": ("gamma-exponential", "highest"),
}
"""By the label of the tables: method, and how its peaks are picked."""

AGAINST_TRUTH: dict[str, tuple[str, str]] = {
    "friction": ("N", "posterior mean of the friction"),
    "sd": ("N", "posterior standard deviation of the friction"),
    "low": ("N", "lower end of the equal-tailed 90 % interval"),
    "high": ("N", "upper end of the equal-tailed 90 % interval"),
    "error": ("1", "(posterior mean - true friction) / true friction"),
    "covers": ("1", "whether the 90 % interval covers the true friction"),
    "width": ("1", "width of the 90 % interval over the true friction"),
}
"""Unit and meaning of what :func:`posterior_against_truth` returns."""

VARIABLES: dict[str, tuple[str, str]] = AGAINST_TRUTH | {
    "precision": ("", "posterior mean of the method's precision parameter, 1/(unit of its data)^2"),
    "noise_sd": ("", "standard deviation of a sample, unit of the signal; of whole-signal methods"),
    "amplitudes": ("1", "amplitudes used, or in the moving record"),
    "samples": ("1", "friction samples, n of Eqs. (5) to (8); of the paper's methods"),
    "frequency": ("Hz", "frequency found in the data"),
    "duration": ("s", "length of the moving part found"),
    "signal_to_noise_db": (
        "dB",
        "mean square of the fitted signal over the noise variance; of whole-signal methods",
    ),
    "envelope_rmse": (
        "",
        "RMS of picked amplitudes about a straight line, unit of the signal; of normal-gamma",
    ),
    "line_error": (
        "1",
        "error of the friction, Eq. (2), of a straight line through picked amplitudes; of normal-gamma",
    ),
    "rmse_in_interval": ("1", "whether the 90 % interval of the precision covers what that RMS means"),
    "negative_share": ("1", "share of friction samples below zero; of the paper's methods"),
    "elapsed": ("s", "wall time of the estimate, from record to posterior"),
    "refused": ("1", "whether the record was refused"),
    "warned": ("1", "warnings of the estimate and of its check"),
    "reference_error": ("1", "(mean of the draws - true friction) / true friction"),
    "closed_form_s": ("s", "wall time of the estimate once more, nothing left to compile"),
    "time_ratio": ("1", "wall time of the sampler over that of the closed form"),
    **SAMPLED,
}
"""Unit and meaning of what is kept of a method on a record; nan where there is none."""


def measure(
    record: xr.DataArray,
    system: fb.Oscillator,
    friction: float,
    *,
    methods: Sequence[str],
    check: bool,
    seed: int,
) -> dict[str, Any]:
    """Estimate by every method and compare with the truth and, where ``check`` is set, with emcee.

    Parameters
    ----------
    record : xarray.DataArray
    system : Oscillator
    friction : float
        The truth [N].
    methods : sequence of str
        Keys of :data:`METHODS`.
    check : bool
        Whether to run the sampler.
    seed : int
        Of the sampler.

    Returns
    -------
    dict
        ``method``, and by the names of :data:`VARIABLES` one number a method, nan where there is none.
    """
    columns: dict[str, list[float]] = {name: [] for name in VARIABLES}
    for label in methods:
        own = np.random.SeedSequence([seed, zlib.crc32(label.encode())])
        found = _one(record, system, friction, label, int(own.generate_state(1)[0]) if check else None)
        for name, column in columns.items():
            column.append(found.get(name, math.nan))
    return {"method": list(methods), **columns}


def _one(
    record: xr.DataArray, system: fb.Oscillator, friction: float, label: str, seed: int | None
) -> dict[str, float]:
    method, peaks = METHODS[label]
    with warnings.catch_warnings(record=True) as caught:
        # counted, not shown: there would be one for each of thousands of records
        warnings.simplefilter("always")
        began = perf_counter()
        try:
            estimate = fb.estimate(record, system, method=method, peaks=peaks, random_force="none")
        except fb.InputError:
            return {"refused": 1.0}
        elapsed = perf_counter() - began
        found = _figures(estimate, friction) | {"elapsed": elapsed, "refused": 0.0}
        if method in ("normal-gamma", "gamma-exponential"):
            found |= _of_samples(estimate, friction)
        if seed is not None:
            found |= sampled(estimate, seed=seed)
            found["reference_error"] = found["reference_mean"] / friction - 1.0
    if seed is not None:
        # what the sampler samples has no random force either
        seconds = closed_form_seconds(record, system, method=method, peaks=peaks, random_force="none")
        found |= {"closed_form_s": seconds, "time_ratio": found["sampler_s"] / seconds}
    return found | {"warned": float(len(caught))}


def closed_form_seconds(record: xr.DataArray, system: fb.Oscillator, **options: Any) -> float:
    """Wall time [s] of an estimate made before: the first may have waited for the compiler."""
    with warnings.catch_warnings():
        # the first estimate has reported them
        warnings.simplefilter("ignore")
        began = perf_counter()
        fb.estimate(record, system, **options)
        return perf_counter() - began


def against_truth(mean: float, sd: float, low: float, high: float, truth: float) -> dict[str, float]:
    """Return friction with its 90 % interval, and error, coverage and width relative to the truth."""
    return {
        "friction": mean,
        "sd": sd,
        "low": low,
        "high": high,
        "error": mean / truth - 1.0,
        "covers": float(low <= truth <= high),
        "width": (high - low) / truth,
    }


def posterior_against_truth(posterior: Any, truth: float) -> dict[str, float]:
    """Return :func:`against_truth` of a frozen distribution of the friction."""
    low, high = (float(posterior.ppf(q)) for q in (0.05, 0.95))
    return against_truth(float(posterior.mean()), float(posterior.std()), low, high, truth)


def _figures(estimate: fb.Estimate, friction: float) -> dict[str, float]:
    return posterior_against_truth(estimate.friction, friction) | {
        "precision": math.nan if estimate.precision is None else float(estimate.precision.mean()),
        "noise_sd": estimate.noise_sd,
        "amplitudes": float(estimate.amplitudes),
        "frequency": estimate.frequency / (2.0 * math.pi),
        "duration": estimate.decay.values.size * estimate.decay.step,
        "signal_to_noise_db": _signal_to_noise(estimate),
    }


def _signal_to_noise(estimate: fb.Estimate) -> float:
    prediction = estimate.fit.prediction
    if prediction is None or not estimate.noise_sd > 0.0:
        return math.nan
    return signal_to_noise_db(prediction - estimate.rest_position, estimate.noise_sd)


def _of_samples(estimate: fb.Estimate, friction: float) -> dict[str, float]:
    """Amplitudes about a straight line: its friction, their scatter, and whether the precision agrees."""
    samples = estimate.fit.target.observed
    found = {"samples": float(samples.size), "negative_share": negative_share(samples)}
    time, amplitude = peak_amplitudes(estimate.decay, estimate.peaks)
    if estimate.precision is None or amplitude.size < 3:
        return found
    line = np.polyfit(time, amplitude, 1)
    residual = amplitude - np.polyval(line, time)
    rmse = float(np.sqrt(np.mean(residual**2)))
    # a friction sample is factor (A_i - A_i+1) / 4, so amplitudes of variance v give it factor^2 v / 8
    implied = 8.0 / (estimate.force_factor * rmse) ** 2
    low, high = estimate.precision.ppf(0.05), estimate.precision.ppf(0.95)
    # an amplitude falls by 4 u a period
    slope_friction = -0.5 * math.pi / estimate.frequency * estimate.force_factor * float(line[0])
    return found | {
        "envelope_rmse": rmse,
        "line_error": slope_friction / friction - 1.0,
        "rmse_in_interval": float(low <= implied <= high),
    }
