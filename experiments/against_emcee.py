"""Closed forms against emcee, by their own likelihood and prior, on some records of every level.

:func:`sampled` and :func:`sampled_pair` sample one posterior; :func:`three_columns` and :func:`word` sum up
the checked records of a level: R-hat, effective sample sizes, agreement;
:func:`what_was_checked` sums up those of a whole result.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.tables import Row
from friction_bayes.conjugate.targets import normal_gamma_target
from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import TAILS
from friction_bayes.reference import sample_target
from friction_bayes.reference.checking import check_estimate
from friction_bayes.reference.tree import by_walker
from friction_bayes.validation.agreement import compare

__all__ = [
    "CHECKED",
    "SAMPLED",
    "checked_records",
    "sampled",
    "sampled_pair",
    "three_columns",
    "verdict_rows",
    "what_was_checked",
    "word",
]

CHECKED = 10
"""Records a level that go through emcee."""

SAMPLED: dict[str, tuple[str, str]] = {
    "reference_mean": ("", "mean of the draws of the friction"),
    "reference_sd": ("", "standard deviation of the draws"),
    "reference_low": ("", "5 % quantile of the draws"),
    "reference_high": ("", "95 % quantile of the draws"),
    "reference_precision": ("", "mean of the precision's draws; of the normal-gamma pair"),
    "shift": ("1", "mean of the draws less that of the closed form, in its standard deviation, as declared"),
    "width_ratio": ("1", "width of the 90 % interval of the draws over that of the closed form, as declared"),
    "rhat": ("1", "nested R-hat over the ensembles, the worst of the parts"),
    "ess_bulk": ("1", "bulk effective sample size, the least of the parts"),
    "ess_tail": ("1", "tail effective sample size, likewise"),
    "converged": ("1", "whether the diagnostics were met"),
    "agrees": ("1", "verdict on the closed form of the friction, at a false-alarm rate of 1 %"),
    "precision_agrees": ("1", "the same of the precision, of the normal-gamma pair"),
    "sampler_s": ("s", "wall time of the sampler"),
}
"""Unit and meaning of what is kept of a posterior that was sampled; nan where there is none."""


def sampled(estimate: fb.Estimate, *, seed: int) -> dict[str, float]:
    """Sample the posterior of an estimate, by the likelihood and prior that it used.

    Parameters
    ----------
    estimate : Estimate
        Where it averages over accounts of the noise, a random force among them, each is sampled.
    seed : int
        Of the sampler.

    Returns
    -------
    dict
        By name of :data:`SAMPLED`, those that exist for this estimate.
    """
    run = _quietly(check_estimate, estimate, seed=seed)
    summary, posterior = run.summary, run.tree["posterior"].dataset
    found = _compared(run.friction, estimate.friction)
    # at the declared mass and stiffness, which are all that a sampler knows, and without a witness's share
    drawn = run.tree["mixture" if "mixture" in run.tree.children else "posterior"].dataset["friction"]
    alike = _compared(by_walker(drawn), estimate.friction_of_parts)
    found |= {name: alike[name] for name in ("shift", "width_ratio")}
    named = ("rhat", "ess_bulk", "ess_tail", "converged", "agrees", "sampler_s")
    found |= {name: summary[name] for name in named}
    if estimate.precision is not None and estimate.random_force is None and "precision" in posterior:
        found |= _of_precision(posterior, estimate.precision)
    return _numbers(found)


def sampled_pair(prior: fb.NormalGamma, samples: Array, *, seed: int) -> dict[str, float]:
    """Sample the normal-gamma posterior of friction samples, as :func:`sampled` does of an estimate.

    Parameters
    ----------
    prior : NormalGamma
    samples : ndarray, shape (n,)
        Friction samples [N].
    seed : int
        Of the sampler.
    """
    closed = prior.update(samples)
    tree = _quietly(sample_target, normal_gamma_target(prior, samples), seed=seed)
    posterior = tree["posterior"].dataset
    draws, attrs = by_walker(posterior["friction"]), posterior["friction"].attrs
    found = _compared(draws, closed.friction) | {
        "rhat": attrs["nested_rhat"],
        "ess_bulk": attrs["ess_bulk"],
        "ess_tail": attrs["ess_tail"],
        "converged": tree.attrs["converged"],
        "agrees": compare(closed.friction, draws).agrees,
        "sampler_s": tree.attrs["wall_time_s"],
    }
    return _numbers(found | _of_precision(posterior, closed.precision))


def _quietly(sample: Any, *what: Any, seed: int) -> Any:
    """Sample without a warning: ``converged`` says whether the steps sufficed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.NotConvergedWarning)
        return sample(*what, seed=seed)


def _compared(draws: Array, closed: Any) -> dict[str, float]:
    """Mean, sd and 90 % interval of draws, and shift and width relative to the closed form's."""
    low, high = np.quantile(draws, TAILS)
    expected_low, expected_high = closed.ppf(TAILS)
    mean, sd = float(draws.mean()), float(closed.std())
    return {
        "reference_mean": mean,
        "reference_sd": float(draws.std()),
        "reference_low": float(low),
        "reference_high": float(high),
        # a posterior without a variance gives no scale to measure by
        "shift": (mean - float(closed.mean())) / sd if math.isfinite(sd) else math.nan,
        "width_ratio": float((high - low) / (expected_high - expected_low)),
    }


def _of_precision(posterior: xr.Dataset, closed: Any) -> dict[str, Any]:
    draws = by_walker(posterior["precision"])
    return {"reference_precision": float(draws.mean()), "precision_agrees": compare(closed, draws).agrees}


def _numbers(found: Mapping[str, Any]) -> dict[str, float]:
    """No verdict is no number."""
    return {name: math.nan if value is None else float(value) for name, value in found.items()}


_COLUMNS = (
    "rhat",
    "ess_bulk",
    "ess_tail",
    "converged",
    "agrees",
    "precision_agrees",
    "shift",
    "width_ratio",
)
"""What :func:`three_columns` looks at: of all that a level has, a few."""


def checked_records(dataset: xr.Dataset) -> xr.Dataset:
    """Return what went through emcee, laid out along ``posterior``.

    Parameters
    ----------
    dataset : xarray.Dataset
        With the names of :data:`SAMPLED`, over any dimensions.
    """
    dims = dataset["rhat"].dims
    flat = dataset.stack(posterior=dims, create_index=False) if dims else dataset.expand_dims("posterior")
    return flat.isel(posterior=np.flatnonzero(np.isfinite(flat["rhat"].values)))


def three_columns(dataset: xr.Dataset) -> dict[str, str]:
    """Return emcee's results for the checked records of one level: R-hat, effective sample sizes, agreement.

    The first two are the worst of the records. Means are compared in standard deviations of the closed form,
    averaged over the records, with the standard error of that average; widths of 90 % intervals by their
    ratio, since few amplitudes leave Student's t with little more than two degrees of freedom, whose standard
    deviation cannot be estimated from draws.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of one level, with the names of :data:`SAMPLED`.
    """
    kept = np.isfinite(dataset["rhat"].values)
    if not kept.any():
        return dict.fromkeys(("R-hat", "ESS bulk/tail", "emcee against ours"), "")
    # tables have hundreds of such cells: arrays, where datasets took a hundredth of a second for each
    mine = {name: dataset[name].values[kept] for name in _COLUMNS}
    return {
        "R-hat": f"{mine['rhat'].max():.4f}",
        "ESS bulk/tail": f"{mine['ess_bulk'].min():.0f}/{mine['ess_tail'].min():.0f}",
        "emcee against ours": _agreement(mine),
    }


def word(dataset: xr.Dataset) -> str:
    """Return :func:`three_columns` in one cell of a table."""
    rhat, ess, agreement = three_columns(dataset).values()
    return rhat and f"{agreement}; R-hat {rhat}, ESS {ess}"


def _agreement(checked: Mapping[str, Array]) -> str:
    n, converged = checked["converged"].size, int(checked["converged"].sum())
    parts = [f"{_verdict(checked['agrees'])}{_mean_apart(checked['shift'])}"]
    parts.append(f"90 % width × {np.nanmean(checked['width_ratio']):.3f}")
    if np.isfinite(checked["precision_agrees"]).any():
        parts.append(f"precision {_verdict(checked['precision_agrees'])}")
    return ", ".join(parts if converged == n else [*parts, f"converged in {converged} of {n}"])


def _verdict(agrees: Array) -> str:
    judged, n = int(np.isfinite(agrees).sum()), agrees.size
    if not judged:
        return "not judged"
    agreed = f"agrees in {int(np.nansum(agrees))} of {judged}"
    return agreed if judged == n else f"{agreed} judged of {n}"


def _mean_apart(shift: Array) -> str:
    values = shift[np.isfinite(shift)]
    if values.size == 0:
        return ""
    error = f" ± {values.std(ddof=1) / math.sqrt(values.size):.3f}" if values.size > 1 else ""
    return f", mean {values.mean():+.3f}{error} sd"


def what_was_checked(dataset: xr.Dataset) -> str:
    """Return in one sentence how many posteriors of a result went through emcee, and what came of it.

    Parameters
    ----------
    dataset : xarray.Dataset
        With the names of :data:`SAMPLED`, bare or with more before or behind them, or with none of them.
    """
    found: dict[str, list[Array]] = {}
    for each in (str(name) for name in dataset.data_vars):
        before, mark, behind = each.partition("rhat")
        if not mark:
            continue
        kept = np.isfinite(dataset[each].values)
        for name in ("rhat", "ess_bulk", "ess_tail", "converged", "agrees"):
            found.setdefault(name, []).append(dataset[f"{before}{name}{behind}"].values[kept])
    values = {name: np.concatenate(parts) for name, parts in found.items()}
    if not values or values["rhat"].size == 0:
        return "No posterior here was checked by a sampler."
    agrees = values["agrees"][np.isfinite(values["agrees"])]
    least = "/".join(f"{values[name].min():.0f}" for name in ("ess_bulk", "ess_tail"))
    return (
        f"Checked by emcee: {values['rhat'].size} posteriors, {values['converged'].sum():.0f} of them "
        f"converged (over all, R-hat at most {values['rhat'].max():.4f}, ESS bulk/tail at least {least}); "
        f"the closed form agrees in {agrees.sum():.0f} of {agrees.size} judged, false alarms 1 % each."
    )


def verdict_rows(dataset: xr.Dataset, dim: str = "method") -> list[Row]:
    """Return how many of the closed forms that were checked agree with emcee, over all levels.

    Parameters
    ----------
    dataset : xarray.Dataset
        With the names of :data:`SAMPLED`.
    dim : str
        A row for each of its values.
    """
    rows = []
    for name in dataset[dim].values.tolist():
        at = dataset.sel({dim: name})
        mine = checked_records(at)
        n = mine.sizes["posterior"]
        if n == 0:
            continue
        remarks = [f"{int(mine['converged'].sum())} converged; false alarms 1 % each"]
        if mine["precision_agrees"].notnull().any():
            remarks.append(f"precision {_verdict(mine['precision_agrees'].values)}")
        if "time_ratio" in mine:
            remarks.append(f"emcee takes {float(mine['time_ratio'].median()):.0f} times as long")
        judged = int(mine["agrees"].notnull().sum())
        rows.append(
            Row(
                f"agrees with emcee: {name}",
                f"{int(mine['agrees'].sum())} of {judged}",
                remark="; ".join(remarks if judged == n else [*remarks, f"{n - judged} not judged"]),
                sampler=word(at),
            )
        )
    return rows
