"""Posteriors of many records under one prior, and figures of them, each with its Monte Carlo error."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import xarray as xr
from scipy import stats

from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.arrays import Array

__all__ = ["After", "Claim", "Numbers", "in_band", "median", "pooled", "quantiles", "share"]

BATCHES = 10
"""Replicates are dealt into as many groups to see how much a number over all of them scatters."""
LEAST = 4
"""Replicates that a group has at least; with fewer than two such groups a number has no error."""
CLEAR = 1.64
"""Standard errors between a number and what it has to exceed, short of which a claim stays undecided."""


@dataclass(frozen=True)
class After:
    """The posterior of every record under one prior.

    Attributes
    ----------
    prior : NormalGamma
    data : xarray.Dataset
        Statistics over ``replicate``, ``peaks``, ``condition``.
    """

    prior: NormalGamma
    data: xr.Dataset

    @cached_property
    def parameters(self) -> tuple[xr.DataArray, ...]:
        """``mu``, ``lam``, ``alpha``, ``beta`` after the samples."""
        return self.prior.parameters_after(self.data["count"], self.data["mean"], self.data["squares"])

    @cached_property
    def precision(self) -> xr.DataArray:
        """Posterior mean of the precision [1/N^2]."""
        _, _, alpha, beta = self.parameters
        return alpha / beta

    @cached_property
    def error(self) -> xr.DataArray:
        """Posterior mean of the friction over the truth, less one."""
        return self.parameters[0] / self.data["truth"] - 1.0

    @cached_property
    def relative_width(self) -> xr.DataArray:
        """Width of the 90 % interval of the friction over its posterior mean."""
        mu, lam, alpha, beta = self.parameters
        reach = xr.apply_ufunc(partial(stats.t.ppf, 0.95), 2.0 * alpha)
        return 2.0 * reach * np.sqrt(beta / alpha / lam) / abs(mu)

    def of(self, variable: xr.DataArray, condition: str) -> xr.DataArray:
        """A variable of one condition, over replicates and peaks."""
        return variable.sel(condition=condition)

    def part(self, group: int, groups: int) -> After:
        """One of ``groups`` groups of replicates."""
        return After(self.prior, self.data.isel(replicate=slice(group, None, groups)))


def quantiles(values: xr.DataArray, levels: Sequence[float]) -> xr.DataArray:
    """Quantiles over the records that give a number, ``quantile`` first; nan where none does."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN slice", RuntimeWarning)
        return values.quantile(list(levels), "replicate")


Numbers = Callable[[After], tuple[Array, Array]]
"""Value and Monte Carlo error, a number a reading of a peak."""


@dataclass(frozen=True)
class Claim:
    """One claim of the paper.

    Attributes
    ----------
    name : str
    says : str
        What the number is.
    paper : str
        What the paper says.
    numbers : callable, After -> (value, error)
    more_than, less_than : float or None
        What the number has to exceed, or stay under, for the claim to hold.
    """

    name: str
    says: str
    paper: str
    numbers: Numbers
    more_than: float | None = None
    less_than: float | None = None

    def verdict(self, value: Array, error: Array) -> Array:
        """1 where the claim holds, -1 where it does not, 0 where the error leaves it open, else nan."""
        if self.more_than is not None:
            clear = (value - self.more_than) / error
        elif self.less_than is not None:
            clear = (self.less_than - value) / error
        else:
            return np.full(value.shape, math.nan)
        return np.where(np.isnan(clear), math.nan, np.where(abs(clear) < CLEAR, 0.0, np.sign(clear)))


def share(hits: Callable[[After], xr.DataArray]) -> Numbers:
    """Share of the records in which something is so; those that do not give it are left out."""

    def numbers(after: After) -> tuple[Array, Array]:
        found = hits(after)
        there = found.notnull().sum("replicate")
        n, share = there.where(there > 0).values, found.mean("replicate").values
        inner = np.clip(share, 0.5 / n, 1.0 - 0.5 / n)
        return share, np.sqrt(inner * (1.0 - inner) / n)

    return numbers


def median(values: Callable[[After], xr.DataArray]) -> Numbers:
    """Median over the records; its error is half of what one standard error of a rank spans."""

    def numbers(after: After) -> tuple[Array, Array]:
        found = values(after)
        reach = 0.5 / math.sqrt(found.sizes["replicate"])
        low, middle, high = quantiles(found, (0.5 - reach, 0.5, 0.5 + reach)).values
        return middle, np.maximum(0.5 * (high - low), 1e-12)

    return numbers


def pooled(value: Callable[[After], Array]) -> Numbers:
    """A number over all records; its error from groups of them."""

    def numbers(after: After) -> tuple[Array, Array]:
        whole, groups = value(after), min(BATCHES, after.data.sizes["replicate"] // LEAST)
        if groups < 2:
            return whole, np.full(whole.shape, math.nan)
        parts = np.array([value(after.part(group, groups)) for group in range(groups)])
        return whole, np.std(parts, axis=0, ddof=1) / math.sqrt(groups)

    return numbers


def in_band(values: Callable[[After], xr.DataArray], paper: float) -> Numbers:
    """Share of the records on the rarer side of the paper's number: above 5 % it lies in our 90 % band."""

    def numbers(after: After) -> tuple[Array, Array]:
        found = values(after)
        found_share, error = share(lambda _: (found < paper).where(found.notnull()))(after)
        return np.minimum(found_share, 1.0 - found_share), error

    return numbers
