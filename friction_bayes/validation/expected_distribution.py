"""What draws are compared with: a continuous distribution, or independent draws of one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_sample
from friction_bayes.core.errors import InputError
from friction_bayes.validation.mixing import Mixing

__all__ = ["Expected"]


@dataclass(frozen=True)
class Expected:
    """What draws are compared with.

    Attributes
    ----------
    distribution : object
        With ``cdf`` and ``ppf``.
    mean, sd, excess_kurtosis : float
    size : float
        Number of independent draws it is made of; infinite for a distribution.
    """

    distribution: Any
    mean: float
    sd: float
    excess_kurtosis: float
    size: float

    @classmethod
    def of(cls, expected: Any) -> Expected:
        """Take a continuous distribution or independent draws.

        Raises
        ------
        InputError
            If it is neither, or the distribution lacks its parameters.
        """
        if not hasattr(expected, "cdf"):
            remedy = "give a frozen scipy distribution, such as stats.norm(0, 1), or independent draws"
            sample = np.sort(finite_sample("expected", expected, remedy).ravel())
            kurtosis = float(stats.kurtosis(sample))
            return cls(_Empirical(sample), float(sample.mean()), float(sample.std()), kurtosis, sample.size)
        _refuse_unusable(expected)
        kurtosis = float(expected.stats(moments="k")) if hasattr(expected, "stats") else 0.0
        return cls(expected, float(expected.mean()), float(expected.std()), kurtosis, math.inf)

    def joint(self, found: Mixing) -> float:
        """Effective sample size of the difference: the errors of both sides add."""
        return 1.0 / (1.0 / found.ess + 1.0 / self.size) if found.ess > 0.0 else 0.0


@dataclass(frozen=True)
class _Empirical:
    """Distribution function of sorted independent draws."""

    sample: Array

    def cdf(self, x: ArrayLike) -> Array:
        return np.asarray(np.searchsorted(self.sample, x, side="right") / self.sample.size)

    def ppf(self, p: float) -> float:
        return float(np.quantile(self.sample, p))


def _refuse_unusable(distribution: Any) -> None:
    """Refuse what has a distribution function and still cannot be compared."""
    name = getattr(getattr(distribution, "dist", distribution), "name", type(distribution).__name__)
    if hasattr(distribution, "pmf") and not hasattr(distribution, "pdf"):
        # ties between draws and steps of the distribution function would pass for disagreement
        raise InputError("expected", f"{name} is discrete", "give a continuous distribution")
    if isinstance(distribution, stats.rv_continuous) and getattr(distribution, "numargs", False):
        raise InputError(
            "expected", f"{name} has no parameters", f"freeze it: stats.{name}({distribution.shapes})"
        )
    missing = [each for each in ("mean", "std", "cdf", "ppf") if not hasattr(distribution, each)]
    if missing:
        raise InputError(
            "expected", f"{name} has no {', '.join(missing)}", "give a frozen scipy distribution"
        )
