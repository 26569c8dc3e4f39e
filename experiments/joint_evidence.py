"""How often are the errors of several records as small as the paper's, all of them together?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array

__all__ = ["Joint", "together"]


@dataclass(frozen=True)
class Joint:
    """Several errors together, each on a record of its own in the paper.

    Attributes
    ----------
    shares : tuple of float
        Of the records as close as the paper's, one an error: ``(hits + 1)/(records + 1)``, so that none is
        never taken as impossible.
    product : float
        Share in which all are, if the records are independent.
    fisher : float
        Chance of a product as small, by Fisher's combined test: the smallest of many products is small
        by itself.
    relative_error : float
        Monte Carlo error of the product, relative; shares that are counted on the same records err together.
    """

    shares: tuple[float, ...]
    product: float
    fisher: float
    relative_error: float

    @property
    def fisher_error(self) -> float:
        """Monte Carlo error of Fisher's chance, for its slope over the logarithm of the product."""
        k = len(self.shares) - 1
        slope = self.product * (-math.log(self.product)) ** k / math.factorial(k)
        return slope * self.relative_error


def together(errors: Array, stated: Sequence[float]) -> Joint:
    """Return how often sizes of errors are as small as those stated.

    Parameters
    ----------
    errors : ndarray, shape (levels, records)
        Sizes; nan where a record gives none. A column may be one draw of noise at every level.
    stated : sequence of float
        The paper's, in the same unit.
    """
    known = np.isfinite(errors)
    close = known & (errors <= np.asarray(stated)[:, None])
    counts = known.sum(axis=1)
    shares = (close.sum(axis=1) + 1) / (counts + 1)
    covariance = np.cov(close) / np.outer(shares, shares)
    # the share itself is never zero, so that neither is its error
    np.fill_diagonal(covariance, (1.0 - shares) / shares)
    return Joint(
        shares=tuple(shares.tolist()),
        product=float(np.prod(shares)),
        fisher=float(stats.combine_pvalues(shares, method="fisher").pvalue),
        relative_error=math.sqrt((covariance / np.sqrt(np.outer(counts, counts))).sum()),
    )
