"""Mixtures of normal and Student t distributions, free or cut at zero, with an atom at zero."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.special import log_ndtr, logsumexp, ndtr, ndtri, ndtri_exp, stdtr, stdtrit

from friction_bayes.conjugate.frozen import FrozenDistribution, crossed
from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import InputError

__all__ = ["OMITTED", "Mixture"]

OMITTED = 1e-9
"""Probability of a part below which a mixture omits it."""
_FAR_BELOW = 25.0
"""Sds of a mean below zero from which on expansions give moments above it, to 2e-8."""


@dataclass(frozen=True, eq=False)
class Mixture(FrozenDistribution):
    """Mixture of distributions.

    Attributes
    ----------
    weight, location, scale : ndarray, shape (k,)
        Of the parts; the weights and ``atom`` add up to one.
    degrees : ndarray, shape (k,)
        Degrees of freedom of the parts, Student t; infinite for a normal.
    positive : bool
        Whether the parts, which then are normal, are cut at zero, each with its full weight above it.
    atom : float
        Probability of exactly zero.

    Raises
    ------
    InputError
        If shapes or weights do not fit together, or a Student t is to be cut.
    """

    weight: Array
    location: Array
    scale: Array
    degrees: Array
    positive: bool = False
    atom: float = 0.0

    def __post_init__(self) -> None:
        shapes = {np.shape(each) for each in (self.weight, self.location, self.scale, self.degrees)}
        total = float(np.sum(self.weight)) + self.atom
        if len(shapes) != 1 or abs(total - 1.0) > 1e-6:
            raise InputError(
                "mixture", f"shapes {shapes}, weights of sum {total:g}", "give one weight a part"
            )
        if self.positive and np.any(np.isfinite(self.degrees)):
            raise InputError("mixture", "a Student t cut at zero", "give normal parts")

    @classmethod
    def of_normals(
        cls, weight: Array, location: Array, scale: Array, *, positive: bool = False, atom: float = 0.0
    ) -> Mixture:
        """Mixture of normals, cut at zero if ``positive``."""
        return cls(weight, location, scale, np.full(np.shape(weight), np.inf), positive, atom)

    @classmethod
    def of_student(cls, distribution: Any) -> Mixture:
        """A frozen Student t as a mixture of one part; a mixture as it is."""
        if isinstance(distribution, Mixture):
            return distribution
        part = distribution.kwds
        location, scale, degrees = (np.array([float(part[name])]) for name in ("loc", "scale", "df"))
        return cls(np.ones(1), location, scale, degrees)

    def widened(self, factor: float) -> Mixture:
        """The same with parts ``factor`` times as wide."""
        return replace(self, scale=self.scale * factor)

    def scaled(self, factor: float) -> Mixture:
        """Return the distribution of ``factor`` times the variable, ``factor`` > 0."""
        return replace(self, location=self.location * factor, scale=self.scale * factor)

    @classmethod
    def of(cls, distributions: Sequence[Any], share: ArrayLike) -> Mixture:
        """Mixture of mixtures and frozen Student t, in shares that add up to one, shape (m,).

        Parts of no probability are omitted. If one is cut at zero, all are: the variable is not negative.
        """
        parts = [cls.of_student(each) for each in distributions]
        if any(each.positive for each in parts):
            parts = [each.kept_positive() for each in parts]
        shares = np.asarray(share, dtype=np.float64)
        weight = np.concatenate([each.weight * p for each, p in zip(parts, shares, strict=True)])
        kept = weight > OMITTED
        return cls(
            weight[kept] * (weight.sum() / max(weight[kept].sum(), OMITTED)),
            np.concatenate([each.location for each in parts])[kept],
            np.concatenate([each.scale for each in parts])[kept],
            np.concatenate([each.degrees for each in parts])[kept],
            parts[0].positive,
            float(shares @ [each.atom for each in parts]),
        )

    def kept_positive(self) -> Mixture:
        """The same given that the variable is positive, which it must be able to be.

        Parts are normal then: a Student t is taken as the normal whose central 90 % it has.
        """
        if self.positive:
            return self
        student = stdtrit(np.where(self._normal, 1.0, self.degrees), 0.95) / ndtri(0.95)
        scale = self.scale * np.where(self._normal, 1.0, student)
        with np.errstate(divide="ignore"):  # of a part that has no weight
            log_weight = np.log(self.weight) + log_ndtr(self.location / scale)
        total = logsumexp(np.append(log_weight, math.log(self.atom) if self.atom > 0.0 else -np.inf))
        return Mixture.of_normals(
            np.exp(log_weight - total),
            self.location,
            scale,
            positive=True,
            atom=self.atom * math.exp(-total),
        )

    @cached_property
    def _normal(self) -> Mask:
        return np.isinf(self.degrees)

    @cached_property
    def _log_above(self) -> Array:
        """Log probability of the parts above zero before they are cut there."""
        return np.asarray(log_ndtr(self.location / self.scale))

    @cached_property
    def _moments_above(self) -> tuple[Array, Array]:
        """Mean and variance of the normal parts cut at zero, in their standard deviations."""
        above = self.location / self.scale
        density = np.exp(-0.5 * above**2 - 0.5 * math.log(2.0 * math.pi) - self._log_above)
        mean, variance = above + density, 1.0 - density * (density + above)
        far = above < -_FAR_BELOW
        # there both are differences of nearly equal numbers: by their expansions in one over the distance
        square = above[far] ** -2.0
        mean[far] = -(1.0 - square * (2.0 - square * (10.0 - square * (74.0 - 706.0 * square)))) / above[far]
        variance[far] = square * (1.0 - square * (6.0 - square * (50.0 - square * (518.0 - 6354.0 * square))))
        return mean, variance

    @cached_property
    def _means(self) -> Array:
        """Of the parts."""
        return self.scale * self._moments_above[0] if self.positive else self.location

    @cached_property
    def _variances(self) -> Array:
        """Of the parts."""
        if self.positive:
            return np.asarray(self.scale**2 * self._moments_above[1])
        # infinite up to two degrees of freedom, and up to one there is none
        finite = np.where(self.degrees > 2.0, self.degrees, np.inf)
        others = np.where(self.degrees > 1.0, np.inf, np.nan)
        return np.where(self.degrees > 2.0, self.scale**2 * (1.0 + 2.0 / (finite - 2.0)), others)

    def cdf(self, x: ArrayLike) -> Any:
        """Cumulative probability."""
        return self._probability(x, upper=False)

    def sf(self, x: ArrayLike) -> Any:
        """Probability above ``x``."""
        return self._probability(x, upper=True)

    def pdf(self, x: ArrayLike) -> Any:
        """Density; that of the parts alone where there is an atom."""
        return np.exp(self.logpdf(x))[()]

    def logpdf(self, x: ArrayLike) -> Any:
        """Log-density; that of the parts alone where there is an atom."""
        z = np.asarray(x, dtype=np.float64)[..., None]
        with np.errstate(divide="ignore"):
            value = stats.t.logpdf(z, self.degrees, self.location, self.scale) + np.log(self.weight)
        if self.positive:
            value = np.where(z >= 0.0, value - self._log_above, -np.inf)
        return logsumexp(value, axis=-1)[()]

    def ppf(self, q: ArrayLike) -> Any:
        """Quantile: the least ``x`` with ``cdf(x) >= q``."""
        return self._solve(q, upper=False)

    def isf(self, q: ArrayLike) -> Any:
        """Upper quantile: the least ``x`` with ``sf(x) <= q``."""
        return self._solve(q, upper=True)

    def mean(self) -> float:
        """Mean."""
        return float(self.weight @ self._means)

    def var(self) -> float:
        """Variance; not finite where that of a part is."""
        # about the mean, so that a narrow distribution far from zero loses nothing
        centre = self.mean()
        return float(self.weight @ (self._variances + (self._means - centre) ** 2) + self.atom * centre**2)

    def support(self) -> tuple[float, float]:
        """Ends of the support."""
        if self.weight.size == 0:
            return 0.0, 0.0
        return (0.0 if self.positive else -np.inf), np.inf

    def rvs(self, size: int | tuple[int, ...] = 1, random_state: np.random.Generator | None = None) -> Array:
        """Draws, from a generator that must be given."""
        if random_state is None:
            raise TypeError("rvs needs random_state: give a numpy Generator")
        weight = np.append(self.weight, self.atom)
        part = random_state.choice(weight.size, size=size, p=weight / weight.sum())
        # the atom last, as the limit of a narrow part
        location, scale, degrees = (
            np.append(each, last)[part]
            for each, last in ((self.location, 0.0), (self.scale, 0.0), (self.degrees, np.inf))
        )
        if self.positive:
            log_above = np.append(self._log_above, 0.0)[part]
            return location - scale * ndtri_exp(np.log(random_state.random(size)) + log_above)
        normal = np.isinf(degrees)
        finite = np.where(normal, 1.0, degrees)
        spread = np.where(normal, 1.0, np.sqrt(finite / random_state.chisquare(finite)))
        return location + scale * spread * random_state.standard_normal(size)

    def _probability(self, x: ArrayLike, *, upper: bool) -> Any:
        z = np.asarray(x, dtype=np.float64)[..., None]
        if self.positive:
            # relative to the mass above zero, in logarithms: it may be far out in the tail
            log_sf = log_ndtr((self.location - np.maximum(z, 0.0)) / self.scale)
            above = np.exp(log_sf - self._log_above)
            each = above if upper else 1.0 - above
        else:
            z_score = (self.location - z if upper else z - self.location) / self.scale
            each = ndtr(z_score)
            if not np.all(self._normal):
                # ten times as dear as the normal's, and most mixtures have none
                student = ~self._normal
                each[..., student] = stdtr(self.degrees[student], z_score[..., student])
        beyond_atom = (z[..., 0] < 0.0) if upper else (z[..., 0] >= 0.0)
        return (each @ self.weight + self.atom * beyond_atom)[()]

    def _solve(self, q: ArrayLike, *, upper: bool) -> Any:
        """Invert a monotone probability: a mixture may be flat between its parts."""
        target = np.atleast_1d(np.asarray(q, dtype=np.float64))
        inside = (target > 0.0) & (target < 1.0)
        p = np.where(inside, target, 0.5)
        beyond = (lambda x: p - self.sf(x)) if upper else (lambda x: self.cdf(x) - p)
        high = crossed(*self._bracket(p, upper), beyond)
        if self.atom > 0.0:
            # an atom is met exactly, not to the last halving
            at = (self.sf(0.0) <= p) if upper else (self.cdf(0.0) >= p)
            before = (self.sf(0.0) + self.atom > p) if upper else (self.cdf(0.0) - self.atom < p)
            high = np.where(at & before, 0.0, high)
        ends = self.support()[::-1] if upper else self.support()
        x = np.select([inside, target == 0.0, target == 1.0], [high, ends[0], ends[1]], np.nan)
        return x.reshape(np.shape(q))[()]

    def _bracket(self, p: Array, upper: bool) -> tuple[Array, Array]:
        """Bracket of quantiles: the least and the greatest of those of the parts, and the atom."""
        if self.weight.size == 0:
            return np.zeros(p.shape), np.zeros(p.shape)
        level = p[..., None]
        if self.positive:
            log_sf = np.log(level if upper else 1.0 - level) + self._log_above
            each = self.location - self.scale * ndtri_exp(log_sf)
        else:
            student = stdtrit(np.where(self._normal, 1.0, self.degrees), level)
            quantile = self.scale * np.where(self._normal, ndtri(level), student)
            each = self.location + (-quantile if upper else quantile)
        low, high = each.min(axis=-1), each.max(axis=-1)
        if self.atom > 0.0:
            low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        # the ends themselves round either way
        slack = 1e-9 * (high - low) + 1e-12 * np.maximum(np.abs(low), np.abs(high))
        return low - slack, high + slack
