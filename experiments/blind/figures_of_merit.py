"""The table of the sealed test: rates, medians and a reliability diagram, each with its Monte Carlo error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

__all__ = [
    "Figure",
    "common_traits",
    "figures_of_merit",
    "median_error",
    "rate_error",
    "reliability",
    "reliability_limit",
]

Mask = NDArray[np.bool_]

RELIABILITY_EDGES = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98, 1.0)
_FAMILY_LEVEL = 0.05  # of the largest deviation over all bins of the reliability diagram
_TRAIT_LEVEL = 0.01


@dataclass(frozen=True)
class Figure:
    """One line of the table.

    Attributes
    ----------
    name, target : str
        What, and what to reach.
    value, error : float
        The figure and its Monte Carlo standard error; NaN where no record is eligible.
    n : int
        Records it rests on.
    reached : bool
        Whether the value itself meets the target.
    failed : ndarray of bool, shape (record,)
        Records that count against it.
    eligible : ndarray of bool, shape (record,)
        Records that were counted.
    """

    name: str
    target: str
    value: float
    error: float
    n: int
    reached: bool
    failed: Mask
    eligible: Mask


def rate_error(rate: float, n: int) -> float:
    """Standard error of a rate from ``n`` records; at 0 and 1 that of half a record (never zero)."""
    inside = min(max(rate, 0.5 / n), 1.0 - 0.5 / n)
    return math.sqrt(inside * (1.0 - inside) / n)


def median_error(values: NDArray[np.float64]) -> float:
    """Standard error of a median: half the distance of the order statistics ``sqrt(n)/2`` ranks away."""
    ordered = np.sort(values)
    half = math.sqrt(ordered.size) / 2.0
    low = max(math.floor((ordered.size - 1) / 2.0 - half), 0)
    high = min(math.ceil((ordered.size - 1) / 2.0 + half), ordered.size - 1)
    return float(ordered[high] - ordered[low]) / 2.0


def _rate(name: str, target: str, good: Mask, eligible: Mask, meets: Callable[[float], bool]) -> Figure:
    n = int(eligible.sum())
    value = float(good[eligible].mean()) if n else math.nan
    error = rate_error(value, n) if n else math.nan
    return Figure(name, target, value, error, n, bool(n and meets(value)), eligible & ~good, eligible)


def _median(name: str, target: str, values: NDArray[np.float64], eligible: Mask, limit: float) -> Figure:
    n = int(eligible.sum())
    value = float(np.median(values[eligible])) if n else math.nan
    error = median_error(values[eligible]) if n else math.nan
    return Figure(
        name, target, value, error, n, bool(n and value <= limit), eligible & (values > limit), eligible
    )


def reliability(dataset: xr.Dataset, eligible: Mask) -> xr.Dataset:
    """Stated probabilities against frequencies, over all evaluated candidates of the eligible records.

    Returns
    -------
    xarray.Dataset
        Dimension ``bin``: ``n`` candidates, their mean ``stated`` probability, the ``frequency`` with
        which they were the truth, and ``z``, the deviation over ``sqrt(sum p (1 - p))``.
    """
    stated = dataset["probabilities"].values[eligible]
    ranks = dataset["truth_rank"].values[eligible]
    is_truth = np.arange(stated.shape[1]) == ranks[:, None]
    evaluated = np.isfinite(stated)
    p, hit = stated[evaluated], is_truth[evaluated]
    which = np.clip(np.digitize(p, RELIABILITY_EDGES) - 1, 0, len(RELIABILITY_EDGES) - 2)
    rows = []
    for b in range(len(RELIABILITY_EDGES) - 1):
        chosen = which == b
        n = int(chosen.sum())
        spread = math.sqrt(float(np.sum(p[chosen] * (1.0 - p[chosen]))))
        deviation = float(hit[chosen].sum() - p[chosen].sum())
        z = 0.0 if abs(deviation) < 1e-9 else deviation / max(spread, 1e-9)
        rows.append((n, p[chosen].mean() if n else math.nan, hit[chosen].mean() if n else math.nan, z))
    n, mean, frequency, z = np.array(rows, dtype=float).T
    return xr.Dataset(
        {
            "n": ("bin", n.astype(int)),
            "stated": ("bin", mean),
            "frequency": ("bin", frequency),
            "z": ("bin", z),
        },
        coords={"low": ("bin", list(RELIABILITY_EDGES[:-1])), "high": ("bin", list(RELIABILITY_EDGES[1:]))},
    )


def reliability_limit(diagram: xr.Dataset) -> float:
    """Largest ``|z|`` of a bin that chance explains, at 5 % over all filled bins."""
    filled = int((diagram["n"] > 0).sum())
    return float(stats.norm.isf(_FAMILY_LEVEL / 2.0 / max(filled, 1)))


def _reliability_figure(dataset: xr.Dataset, eligible: Mask) -> Figure:
    diagram = reliability(dataset, eligible)
    limit = reliability_limit(diagram)
    worst = float(np.abs(diagram["z"]).max())
    sure_and_wrong = eligible & ~dataset["right"].values & (dataset["said_probability"].values > 0.9)
    return Figure(
        "stated probabilities against frequencies, largest |z| of a bin",
        f"<= {limit:.2f}",
        worst,
        1.0,
        int(eligible.sum()),
        worst <= limit,
        sure_and_wrong,
        eligible,
    )


def figures_of_merit(dataset: xr.Dataset) -> list[Figure]:
    """Every figure of the table, in its order.

    Parameters
    ----------
    dataset : xarray.Dataset
        One entry a record: the fields of :func:`experiments.blind.scoring.score`, ``kind``, ``outside``,
        ``identifiable`` (never a record without a visible effect or outside the catalogue) and ``elapsed``.
    """
    outside = dataset["outside"].values.astype(bool)
    plain = dataset["kind"].values == "plain_coulomb"
    catalogue = ~outside & ~plain
    identifiable = dataset["identifiable"].values.astype(bool)
    before, after = dataset["error_before"].values, dataset["error_after"].values
    adequate = dataset["verdict"].values == "adequate"
    right = dataset["right"].values.astype(bool)
    ratio = np.full(before.size, np.inf)
    np.divide(after, before, out=ratio, where=np.isfinite(before) & np.isfinite(after) & (before > 0.0))
    alarm = _rate("false alarm on plain Coulomb records", "<= 5 %", ~adequate, plain, lambda r: r <= 0.05)
    return [
        # counted the other way round: an alarm is the failure
        Figure(
            alarm.name,
            alarm.target,
            alarm.value,
            alarm.error,
            alarm.n,
            alarm.reached,
            plain & ~adequate,
            plain,
        ),
        _rate(
            "true effect set most probable, identifiable records",
            ">= 90 %",
            right,
            identifiable,
            lambda r: r >= 0.9,
        ),
        _rate(
            "true set among those that add up to 95 %, all of the catalogue",
            ">= 95 %",
            dataset["held"].values.astype(bool),
            catalogue,
            lambda r: r >= 0.95,
        ),
        _rate(
            "friction_after 90 % interval covers the truth",
            "85 .. 95 %",
            dataset["covered"].values.astype(bool),
            ~outside,
            lambda r: 0.85 <= r <= 0.95,
        ),
        _median("median friction error after", "<= 0.5 %", after, catalogue, 0.005),
        _median(
            "median of friction error after over before, where before > 3 %",
            "<= 0.1",
            ratio,
            catalogue & (before > 0.03),
            0.1,
        ),
        _rate(
            "friction within 10 %, identifiable records",
            ">= 95 %",
            after <= 0.1,
            identifiable,
            lambda r: r >= 0.95,
        ),
        _rate(
            "effects outside the catalogue called unexplained",
            ">= 90 %",
            dataset["verdict"].values == "unexplained",
            outside,
            lambda r: r >= 0.9,
        ),
        _reliability_figure(dataset, ~outside),
        _median(
            "median processor time per record [s]",
            "<= 2.5 s",
            dataset["elapsed"].values,
            np.ones(before.size, bool),
            2.5,
        ),
    ]


def _traits(dataset: xr.Dataset) -> Iterator[tuple[str, Mask]]:
    for name in ("kind", "quantity", "visible"):
        for value in np.unique(dataset[name].values):
            yield f"{name} {value}", dataset[name].values == value
    for name, unit, edges in (
        ("snr_db", "dB", (22, 26, 30, 34)),
        ("half_cycles", "half cycles", (36, 54, 72, 91)),
    ):
        values = dataset[name].values
        for low, high in pairwise(edges):
            yield f"{low}-{high} {unit}", (values >= low) & (values < high)
    for name, yes, no in (
        ("mid_motion", "begins in mid-motion", "begins at a release"),
        ("reaches_rest", "goes on into rest", "cut before rest"),
    ):
        values = dataset[name].values.astype(bool)
        yield yes, values
        yield no, ~values


def common_traits(dataset: xr.Dataset, figure: Figure) -> list[tuple[str, int, int]]:
    """What the failures of one figure have in common.

    Returns
    -------
    list of (trait, failed, eligible)
        Traits under which failures are more frequent than over all eligible records, by a one-sided
        binomial test at 1 %, most significant first.
    """
    overall = float(figure.failed.sum()) / max(figure.n, 1)
    found = []
    for trait, mask in _traits(dataset):
        total, failed = int((mask & figure.eligible).sum()), int((mask & figure.failed).sum())
        if failed and total < figure.n:
            level = float(stats.binom.sf(failed - 1, total, overall))
            if level < _TRAIT_LEVEL:
                found.append((level, trait, failed, total))
    return [(trait, failed, total) for _, trait, failed, total in sorted(found)]
