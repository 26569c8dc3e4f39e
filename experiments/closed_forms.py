"""Every closed form on one record, beside the truth and, where asked, beside emcee: the cell of a sweep."""

from __future__ import annotations

import json
import math
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.runner import Cell
from friction_bayes.checking import check_estimate

__all__ = ["METHODS", "SweepConfig", "gather", "measure", "seeds_of", "sweep_cells"]

METHODS = {
    "waveform": ("waveform", "highest"),
    "envelope": ("envelope", "highest"),
    "normal-gamma, highest": ("normal-gamma", "highest"),
    "normal-gamma, nominal": ("normal-gamma", "nominal"),
    "gamma-exponential": ("gamma-exponential", "highest"),
}
"""By the label of the tables: method, and how its peaks are picked."""

VARIABLES: dict[str, tuple[str, str]] = {
    "friction": ("N", "posterior mean of the friction"),
    "sd": ("N", "posterior standard deviation of the friction"),
    "low": ("N", "lower end of the equal-tailed 90 % interval"),
    "high": ("N", "upper end of the equal-tailed 90 % interval"),
    "error": ("1", "(posterior mean - true friction) / true friction"),
    "covers": ("1", "whether the 90 % interval holds the true friction"),
    "width": ("1", "width of the 90 % interval over the true friction"),
    "precision": ("", "posterior mean of the method's precision parameter, 1/(unit of its data)^2"),
    "noise_sd": ("", "standard deviation of a sample, unit of the signal; of whole-signal methods"),
    "amplitudes": ("1", "amplitudes used, or in the moving record"),
    "elapsed": ("s", "wall time of the estimate, from record to posterior"),
    "refused": ("1", "whether the record was refused"),
    "warned": ("1", "warnings of the estimate and of its check"),
    "reference_mean": ("N", "mean of the draws"),
    "reference_sd": ("N", "standard deviation of the draws"),
    "reference_low": ("N", "5 % quantile of the draws"),
    "reference_high": ("N", "95 % quantile of the draws"),
    "rhat": ("1", "nested R-hat over the ensembles"),
    "ess_bulk": ("1", "bulk effective sample size"),
    "ess_tail": ("1", "tail effective sample size"),
    "converged": ("1", "whether the diagnostics were met"),
    "agrees": ("1", "verdict on closed form against draws, at a false-alarm rate of 1 %"),
    "closed_form_s": ("s", "wall time of the closed form alone"),
    "sampler_s": ("s", "wall time of the sampler"),
    "time_ratio": ("1", "wall time of the sampler over that of the closed form"),
}
"""Unit and meaning of what is kept of a method on a record; nan where there is none."""


@dataclass(frozen=True)
class SweepConfig:
    """Records a level (with ``--full``), how many of them go through emcee, and by which methods."""

    records: int = 40
    records_full: int = 200
    checked: int = 1
    checked_full: int = 5
    methods: tuple[str, ...] = tuple(METHODS)


def sweep_cells(levels: Mapping[str, Sequence[Any]], config: SweepConfig, full: bool) -> list[dict[str, Any]]:
    """Return the cells of all combinations of levels, those with a sampler first since they take longest."""
    combinations = [dict(zip(levels, values, strict=True)) for values in product(*levels.values())]
    checked = config.checked_full if full else config.checked
    return [
        known | {"replicate": replicate, "check": replicate < checked}
        for replicate in range(config.records_full if full else config.records)
        for known in combinations
    ]


def seeds_of(cell: Cell, seed: np.random.SeedSequence) -> tuple[int, int]:
    """Return the seed of the noise, shared by paired cells, and that of the sampler, the cell's own."""
    of_noise = int(seed.generate_state(1)[0])
    own = zlib.crc32(json.dumps(dict(cell), sort_keys=True).encode())
    return of_noise, int(np.random.SeedSequence([of_noise, own]).generate_state(1)[0])


def measure(
    record: xr.DataArray,
    system: fb.Oscillator,
    friction: float,
    *,
    methods: Sequence[str],
    check: bool,
    seed: int,
) -> dict[str, Any]:
    """Estimate by every method and compare with the truth and, where asked, with emcee.

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
            estimate = fb.estimate(record, system, method=method, peaks=peaks)
        except fb.InputError:
            return {"refused": 1.0}
        elapsed = perf_counter() - began
        found = _figures(estimate, friction) | {"elapsed": elapsed, "refused": 0.0}
        if seed is not None:
            found |= _reference(check_estimate(estimate, seed=seed).summary)
    # a sampler that did not converge has its own entry
    told = [each for each in caught if not issubclass(each.category, fb.NotConvergedWarning)]
    return found | {"warned": float(len(told))}


def _figures(estimate: fb.Estimate, friction: float) -> dict[str, float]:
    posterior = estimate.friction
    mean, low, high = float(posterior.mean()), float(posterior.ppf(0.05)), float(posterior.ppf(0.95))
    return {
        "friction": mean,
        "sd": float(posterior.std()),
        "low": low,
        "high": high,
        "error": mean / friction - 1.0,
        "covers": float(low <= friction <= high),
        "width": (high - low) / friction,
        "precision": math.nan if estimate.precision is None else float(estimate.precision.mean()),
        "noise_sd": estimate.noise_sd,
        "amplitudes": float(estimate.amplitudes),
    }


def _reference(summary: Mapping[str, Any]) -> dict[str, float]:
    friction = summary["friction"]
    low, high = friction["interval90"]
    kept = {"reference_mean": friction["mean"], "reference_sd": friction["sd"]}
    kept |= {"reference_low": low, "reference_high": high}
    named = (
        "rhat",
        "ess_bulk",
        "ess_tail",
        "converged",
        "agrees",
        "closed_form_s",
        "sampler_s",
        "time_ratio",
    )
    figures = kept | {key: summary[key] for key in named}
    # no verdict is no number
    return {name: math.nan if value is None else float(value) for name, value in figures.items()}


def gather(
    cells: Sequence[Cell], results: Sequence[Mapping[str, Any]], *, levels: Mapping[str, str]
) -> xr.Dataset:
    """Lay the cells of a sweep out over levels, replicates and methods.

    Parameters
    ----------
    cells, results : sequences
        As the runner hands them over.
    levels : mapping
        Unit of each swept coordinate, by name.

    Returns
    -------
    xarray.Dataset
        Dimensions: the levels, ``replicate`` and ``method``; the names of :data:`VARIABLES`.
    """
    dims, methods = (*levels, "replicate"), results[0]["method"]
    coordinates: dict[str, list[Any]] = {}
    for name in dims:
        coordinates[name] = list(dict.fromkeys(cell[name] for cell in cells))
    shape = (*(len(values) for values in coordinates.values()), len(methods))
    columns = {name: np.full(shape, np.nan) for name in VARIABLES}
    for cell, result in zip(cells, results, strict=True):
        where = tuple(coordinates[name].index(cell[name]) for name in dims)
        for name, column in columns.items():
            # a number that was not finite is null in a cell's file
            column[where] = np.array(result[name], dtype=np.float64)
    dataset = xr.Dataset(
        {
            name: ((*dims, "method"), column, {"units": unit, "long_name": meaning})
            for (name, column), (unit, meaning) in zip(columns.items(), VARIABLES.values(), strict=True)
        },
        coords=coordinates | {"method": methods},
    )
    for name, unit in levels.items():
        dataset[name].attrs["units"] = unit
    return dataset.assign_attrs(synthetic=1)
