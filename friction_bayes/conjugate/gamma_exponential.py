"""The gamma-exponential pair, Eqs. (9)-(11) of the paper: exponential samples of unknown rate.

The paper compares it with the normal-gamma pair and drops it, and it is kept here as that comparison. What
it estimates is the *rate* of an exponential distribution, so with friction samples ``r_i`` its posterior
mean ``(alpha_0 + n) / (kappa_0 + sum r_i)`` tends to ``1 / mean(r)``, about 14 for a friction of 0.07, and
not to the friction; that is why it "converges to an incorrect value".

An exponential density is zero below zero, while noisy friction samples often are negative. The likelihood is
therefore the formal one, ``n log r - r sum(r_i)``, on the side of the closed form and of the sampler alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.special import gammaln, xlogy

from friction_bayes.conjugate.credible import IntervalKind, credible_interval
from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_array, non_negative
from friction_bayes.core.errors import InputError

__all__ = ["GammaExponential", "negative_share"]


def negative_share(samples: ArrayLike) -> float:
    """Share of the samples that an exponential cannot have produced; 0 for none."""
    x = finite_array("samples", samples)
    return float(np.mean(x < 0.0)) if x.size else 0.0


@dataclass(frozen=True)
class GammaExponential:
    """Gamma distribution of the exponential rate that the paper takes for the friction force, Eq. (9).

    Parameters
    ----------
    alpha : float
        Shape, in samples, >= 0.
    kappa : float
        Rate, the sum of that many samples [unit of the samples], >= 0.

    Raises
    ------
    InputError
        If a parameter is negative or not finite.

    Notes
    -----
    Zero in ``alpha`` or ``kappa`` makes an improper prior: it can be updated, but it has no density.

    Examples
    --------
    >>> posterior = GammaExponential(alpha=1.0, kappa=0.02).update([0.06, 0.08])
    >>> posterior.alpha, round(posterior.kappa, 10)
    (3.0, 0.16)
    """

    alpha: float
    kappa: float

    def __post_init__(self) -> None:
        for name in ("alpha", "kappa"):
            object.__setattr__(self, name, non_negative(name, getattr(self, name)))

    @property
    def proper(self) -> bool:
        """Whether the density integrates to one."""
        return self.alpha > 0.0 and self.kappa > 0.0

    def update(self, samples: ArrayLike) -> GammaExponential:
        """Return the posterior after friction samples of any shape, Eqs. (10) and (11).

        Raises
        ------
        InputError
            If the samples are so negative that ``kappa`` would not be positive: there is no posterior.
        """
        x = finite_array("samples", samples)
        if x.size == 0:
            return self
        alpha, kappa = self.parameters_after(x.size, float(x.sum()))
        if kappa <= 0.0:
            negative = 100.0 * negative_share(x)
            raise InputError(
                "samples",
                f"kappa + sum = {kappa:g} is not positive, {negative:.0f} % of the samples being negative",
                "use normal-gamma, which takes samples of either sign",
            )
        return GammaExponential(alpha, kappa)

    def parameters_after(self, n: Any, total: Any) -> tuple[Any, Any]:
        """Return ``alpha`` and ``kappa`` after ``n`` samples, Eqs. (10) and (11); arrays broadcast."""
        return self.alpha + n, self.kappa + total

    @property
    def friction(self) -> Any:
        """Frozen gamma distribution of ``r``, mean ``alpha/kappa``: see the module on what that tends to."""
        self._require_proper("marginal")
        return stats.gamma(self.alpha, scale=1.0 / self.kappa)

    def log_kernel(self, r: ArrayLike) -> Array:
        """Eq. (9) without its constant, which an improper prior does not have."""
        r = np.asarray(r, dtype=np.float64)
        inside = r > 0.0
        r = np.where(inside, r, 1.0)
        return np.where(inside, xlogy(self.alpha - 1.0, r) - self.kappa * r, -np.inf)

    def logpdf(self, r: ArrayLike) -> Array:
        """Log-density of ``r``, Eq. (9)."""
        self._require_proper("density")
        return self.log_kernel(r) + (self.alpha * math.log(self.kappa) - float(gammaln(self.alpha)))

    def friction_interval(self, p: float = 0.9, kind: IntervalKind = "equal-tailed") -> tuple[float, float]:
        """Credible interval of ``r``, equal-tailed or highest-density (the shortest)."""
        return credible_interval(self.friction, p, kind)

    def log_evidence(self, samples: ArrayLike) -> float:
        """Log of the formal likelihood integrated over this prior; proper priors only."""
        self._require_proper("evidence")
        after = self.update(samples)
        return float(
            gammaln(after.alpha)
            - gammaln(self.alpha)
            + self.alpha * math.log(self.kappa)
            - after.alpha * math.log(after.kappa)
        )

    def rvs(self, size: int | tuple[int, ...], rng: np.random.Generator) -> Array:
        """Draw ``r``, shape ``size``."""
        self._require_proper("draws")
        return rng.gamma(self.alpha, 1.0 / self.kappa, size)

    def _require_proper(self, what: str) -> None:
        if not self.proper:
            raise InputError(
                "GammaExponential",
                f"alpha={self.alpha:g}, kappa={self.kappa:g} is improper and has no {what}",
                "update it with samples, or give alpha and kappa above zero",
            )
