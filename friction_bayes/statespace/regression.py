"""A record as a regression on the columns of its law along the measured motion, given the random force.

The first round evaluates forces along a motion smoothed without a law, only to smooth again: the part that
the law explains is not noise of the motion. The next round uses the motion smoothed with that law, in natural
units of the frequency found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import softmax

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.kalman import Clock, Whitened, shown, smooth, whiten
from friction_bayes.statespace.smoother import SmoothedMotion
from friction_bayes.statespace.subset_evidence import solved

__all__ = ["RIDGE", "LawRegression", "frequency_change", "likely_columns", "near_least_squares"]

_LIKELY = 0.25
"""Prior probability of a column above which it is part of the reference law."""
RIDGE = 1e-10
"""Of least squares, over each column's own sum of squares: columns may be the same to rounding."""
_LEAST_KEPT = 1e-6
"""Least share of a sample's noise that remains after smoothing: below is rounding."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LawRegression:
    """Columns along a motion, and the record less the known terms.

    Attributes
    ----------
    clock : Clock
    row : ndarray, shape (3,) or (n, 3)
        Of the sensor.
    names : tuple of str, length p
        Of the columns.
    columns : ndarray, shape (n, p)
        What the sensor shows of each, natural units.
    states : ndarray, shape (n, 2, p)
        Displacement and velocity of each.
    known_states : ndarray, shape (n, 2)
        Of the terms without a coefficient.
    target : ndarray, shape (n,)
        The signal less what the sensor shows of these terms.
    scale : ndarray, shape (p,)
        Prior sd of the coefficients.
    positive : ndarray of bool, shape (p,)
        Which coefficients have to be positive.
    sets : ndarray of bool, shape (m, p)
        Sets of columns to evaluate.
    log_prior : ndarray, shape (m,)
        Log prior probabilities of the sets.
    stiffness : int
        The column whose coefficient is the relative correction of the stiffness.
    motion : SmoothedMotion
        What the columns go along; its force and noise are first guesses.
    least_noise : float
        Least sd of the noise, that of the sensor's rounding, natural units.
    alike : int
        Columns that are others with another prior sd: they explain nothing more.
    near : ndarray, shape (p,), optional
        A law near the record, in units of ``scale``; by least squares where none is given.
    """

    clock: Clock
    row: Array
    names: tuple[str, ...]
    columns: Array
    states: Array
    known_states: Array
    target: Array
    scale: Array
    positive: Mask
    sets: Mask
    log_prior: Array
    stiffness: int
    motion: SmoothedMotion
    least_noise: float = 0.0
    alike: int = 0
    near: Array | None = None

    @cached_property
    def reference(self) -> Array:
        """A law in units of ``scale``, shape (p,), near the record, so that residuals to whiten are small.

        With the columns alone that most sets have: least squares with all columns gives near collinear ones
        huge coefficients, and those that a set lacks have to be put back with their rounding.
        """
        if self.near is not None:
            return self.near
        return near_least_squares(self.guessed_gram, likely_columns(self.sets, self.log_prior))

    def _about(self, reference: Array) -> Array:
        """Scaled columns, and the record less a law in units of ``scale``, shape (n, p + 1)."""
        scaled = self.columns * self.scale
        return np.column_stack([scaled, self.target - scaled @ reference])

    @property
    def guessed_gram(self) -> Array:
        """Whitened sums of the scaled columns and the record under the first guess of a force."""
        ratio, tau = self.motion.force_sd / self.motion.noise, self.motion.tau
        return whiten(self._about(np.zeros(self.scale.size)), self.clock, self.row, ratio, tau).gram

    @cached_property
    def _about_reference(self) -> Array:
        return self._about(self.reference)

    @cached_property
    def _known(self) -> dict[tuple[float, float], Whitened]:
        return {}

    def whiten_at(self, ratio: float, tau: float) -> Whitened:
        """Whitened sums about the reference law, remembered: draws come from the points evaluated."""
        if (ratio, tau) not in self._known:
            self._known[ratio, tau] = whiten(self._about_reference, self.clock, self.row, ratio, tau)
        return self._known[ratio, tau]

    def of_columns(self, chosen: Mask) -> LawRegression:
        """The same record on some of the columns, ``chosen`` of shape (p,), as the one set that there is."""
        mine = np.flatnonzero(chosen)
        return replace(
            self,
            names=tuple(self.names[j] for j in mine),
            columns=self.columns[:, mine],
            states=self.states[:, :, mine],
            scale=self.scale[mine],
            positive=self.positive[mine],
            sets=np.ones((1, mine.size), np.bool_),
            log_prior=np.zeros(1),
            alike=0,
            near=None,
            stiffness=int(np.searchsorted(mine, self.stiffness)),
        )

    def products(self, columns: Array, force: GridPoint) -> Array:
        """Whitened products of other columns, shape (n, k), under a random force, shape (k, k)."""
        return whiten(columns, self.clock, self.row, force.ratio, force.tau).gram

    def residual(self, law: Array) -> Array:
        """The record less a law, shape (n,)."""
        return np.asarray(self.target - self.columns @ law)

    def innovations(self, law: Array, ratio: float, tau: float) -> Array:
        """Its whitened residual, in units of the sensor noise, shape (n,)."""
        white = whiten(self.residual(law)[:, None], self.clock, self.row, ratio, tau, keep=True).columns
        assert white is not None
        return np.asarray(white[:, 0])

    def log_densities(self, law: Array, noise2: float, ratio: float, tau: float) -> Array:
        """Log density of each sample given those before it, shape (n,); zero of samples that are not used."""
        rest = self.residual(law)[:, None]
        white = whiten(rest, self.clock, self.row, ratio, tau, keep=True)
        assert white.columns is not None
        assert white.variances is not None
        used = np.isfinite(white.variances)
        variance = noise2 * np.where(used, white.variances, 1.0)
        squares = white.columns[:, 0] ** 2 / noise2
        return np.where(used, -0.5 * (np.log(2.0 * math.pi * variance) + squares), 0.0)

    def left_out(self, law: Array, ratio: float, tau: float) -> tuple[Array, Array]:
        """Each sample less its prediction from all others, shape (n,), and the variance of that error.

        The variance is in units of that of the sensor noise; a sample that is not used has noise of unit
        variance too.
        """
        residual = self.residual(law)
        states, covariance = smooth(residual[:, None], self.clock, self.row, ratio, tau)
        # the sensor reads its own error with the state
        row = np.column_stack([np.broadcast_to(self.row, (residual.size, 3)), np.ones(residual.size)])
        error = residual - shown(states[:, :, 0], row)
        known = np.einsum("ni,nij,nj->n", row, covariance, row)
        used = self.clock.used
        own = np.where(used, self.clock.variance, 1.0)
        # the part of a sample's own noise that remains after smoothing
        kept = np.where(used, np.maximum(1.0 - known / own, _LEAST_KEPT), 1.0)
        return error / kept, np.where(used, own / kept, own + known)

    def smoothed(self, law: Array, force: GridPoint) -> SmoothedMotion:
        """The motion under a law and a random force."""
        residual = self.residual(law)[:, None]
        fluctuation, covariance = smooth(residual, self.clock, self.row, force.ratio, force.tau)
        states = fluctuation[:, :3, 0].copy()
        states[:, :2] += self.states @ law + self.known_states
        return SmoothedMotion(
            states=states,
            covariance=covariance[:, :3, :3] * force.noise**2,
            noise=force.noise,
            force_sd=force.ratio * force.noise,
            tau=force.tau,
        )


def likely_columns(sets: Mask, log_prior: Array) -> Mask:
    """Columns, shape (p,), that are likely before the record is seen, given that one of some sets is there.

    Of shape (m, p), with the logarithms of prior probabilities up to a constant.
    """
    return np.asarray(softmax(log_prior) @ sets > _LIKELY)


def near_least_squares(gram: Array, columns: Mask | None = None) -> Array:
    """Coefficients near those of least squares, shape (p,), from sums of columns and, last, the record.

    Of some of the ``columns`` alone, shape (p,), where these are given: the others have none.
    """
    law = np.zeros(len(gram) - 1)
    mine = np.arange(law.size) if columns is None else np.flatnonzero(columns)
    own = gram[mine][:, mine]
    law[mine] = solved(own + np.diag(RIDGE * np.diag(own) + 1e-300), gram[mine, -1])
    return law


def frequency_change(kappa: float) -> float:
    """Frequency over the reference frequency for a correction of the stiffness.

    A law that would stop the oscillation does not count.
    """
    return math.sqrt(max(1.0 + kappa, 0.25))
