"""The summary of an uncertain number: mean, standard deviation and central 90 % interval, with its unit.

A mean that a few far values carry out of the central 90 % would lie outside the interval printed with it: the
interval then reaches to the mean.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.core.strict_json import plain

__all__ = ["HALF_WIDTH90", "TAILS", "Summary", "summary_arrays", "summary_table"]

TAILS = (0.05, 0.95)
"""Probabilities at the ends of a central (equal-tailed) 90 % interval."""
HALF_WIDTH90 = 1.6448536269514722
"""Half the width of that of a normal distribution, in standard deviations."""


@dataclass(frozen=True, kw_only=True)
class Summary:
    """Mean, standard deviation and central 90 % interval of an uncertain number.

    Attributes
    ----------
    mean, sd : float
        Not finite where the moment does not exist: a Student t of two degrees of freedom has no variance.
    interval90 : tuple of float
        Quantiles at 5 % and 95 %, or the mean where that lies beyond.
    unit : str
        Of all four numbers.
    """

    mean: float
    sd: float
    interval90: tuple[float, float]
    unit: str

    @classmethod
    def of_distribution(cls, distribution: Any, unit: str) -> Summary:
        """Summarise a frozen distribution: anything with ``mean()``, ``std()`` and ``ppf(p)`` of an array."""
        low, high = np.asarray(distribution.ppf(np.array(TAILS))).tolist()
        mean = float(distribution.mean())
        return cls(mean=mean, sd=float(distribution.std()), interval90=_around(mean, low, high), unit=unit)

    @classmethod
    def of_draws(cls, draws: ArrayLike, unit: str, *, ddof: int = 1) -> Summary:
        """Summarise draws of any shape; ``ddof`` as in :func:`numpy.std`."""
        values = np.asarray(draws, dtype=np.float64)
        low, high = np.quantile(values, TAILS).tolist()
        mean = float(values.mean())
        sd = float(values.std(ddof=ddof))
        return cls(mean=mean, sd=sd, interval90=_around(mean, low, high), unit=unit)

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name, for JSON; None where a number does not exist."""
        return plain(vars(self))


def _around(mean: float, low: float, high: float) -> tuple[float, float]:
    """Interval with the mean in it, where there is one."""
    return (min(low, mean), max(high, mean)) if math.isfinite(mean) else (low, high)


def summary_table(summaries: Mapping[str, Mapping[str, Any]]) -> Any:
    """Lay summaries out as ArviZ does: a row a quantity, with its unit in the last column.

    Parameters
    ----------
    summaries : mapping of str to mapping
        By name of the quantity; ``sd`` and ``interval90`` may be missing or None.

    Returns
    -------
    pandas.DataFrame
        Columns ``mean``, ``sd``, ``eti90_lb``, ``eti90_ub`` (the equal-tailed 90 % interval) and ``unit``;
        not a number where there is none.
    """
    rows = list(summaries.values())
    ends = [row.get("interval90") or (None, None) for row in rows]
    numbers = {
        "mean": [row["mean"] for row in rows],
        "sd": [row.get("sd") for row in rows],
        "eti90_lb": [low for low, _ in ends],
        "eti90_ub": [high for _, high in ends],
    }
    columns = {name: ("quantity", np.array(values, dtype=np.float64)) for name, values in numbers.items()}
    units = ("quantity", np.array([row["unit"] for row in rows], dtype=object))
    return xr.Dataset({**columns, "unit": units}, coords={"quantity": list(summaries)}).to_dataframe()


def summary_arrays(summaries: Mapping[str, Mapping[str, Any]]) -> xr.Dataset:
    """Lay summaries out as arrays, one a quantity.

    Parameters
    ----------
    summaries : mapping of str to mapping
        As for :func:`summary_table`.

    Returns
    -------
    xarray.Dataset
        Over ``statistic``: ``mean``, ``sd``, ``low`` and ``high``, the ends of the 90 % interval; nan where
        there is none. Attribute ``units`` each.
    """
    found = {}
    for name, row in summaries.items():
        numbers = [row["mean"], row.get("sd"), *(row.get("interval90") or (None, None))]
        found[name] = ("statistic", np.array(numbers, dtype=np.float64), {"units": row["unit"]})
    return xr.Dataset(found, coords={"statistic": ["mean", "sd", "low", "high"]})
