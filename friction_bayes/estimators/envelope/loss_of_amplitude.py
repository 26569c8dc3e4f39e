r"""Friction by the loss of amplitude alone: the witness of an estimate by the whole signal.

The amplitudes of the half cycles lie on a straight line, but for noise that is independent from one to the
next and, where a random force acts, for steps that stay: a random walk. Both are estimated from the scatter
of the amplitudes, so that neither the colour of the noise nor the shape within a half cycle enters,

.. math:: y_k = X_k \beta + a_k w_k + \sigma e_k, \quad w_k = w_{k-1} + \rho \sigma n_k,

with the rows ``X_k`` of :mod:`friction_bayes.estimators.envelope.half_cycle_rows`. Given ``rho`` this is a
regression under a flat prior, Student t in closed form, and the average over ``rho`` a mixture of these: none
with probability one half, log-uniform otherwise. What changes the loss itself (viscous damping, a gain that
drifts) it takes for friction as every fit of dry friction alone does; whether the amplitudes fall faster
while they are larger, as under such damping, or slower is compared by the same regression with one column
more.
"""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.phase_tracking import tracked_phase
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.estimators.envelope.half_cycle_rows import half_cycle_rows

__all__ = [
    "EXACT_TO",
    "SURELY_UNEVEN",
    "UNEVEN_PRIOR",
    "UnevenLoss",
    "loss_of_amplitude",
    "uneven_loss",
]

UNEVEN_PRIOR = MappingProxyType({1.0: 0.05, 0.5: 0.05, 0.25: 0.05, 0.125: 0.05})
"""Sds of the share of the loss that is in proportion to the amplitude, and the prior probability of each.

Dry friction alone has the rest: most machines are damped a little, few much.
"""
SURELY_UNEVEN = 0.95
"""Probability of a loss not by dry friction alone, from which on it is reported first."""

_AMPLITUDE, _FRICTION = 0, 1
"""Columns of the rows."""
_WALKS = np.geomspace(0.01, 100.0, 25)
"""Steps of the walk, over the standard error of an amplitude."""
_LEAST_FREEDOM = 2
"""Degrees of freedom below which the scatter of the amplitudes cannot be estimated."""
_ROUNDS = 4
"""Iterations in which amplitudes in motion, and what is lost in proportion to them, are those fitted."""
_EXACT = 1e-24
"""Share of the response's sum of squares that is rounding."""
EXACT_TO = 5e-4
"""Share to which an amplitude, and friction by their loss, is exact for pendulums and coarse sampling."""


def loss_of_amplitude(decay: FreeDecay) -> Mixture | None:
    """Friction coefficient of the signal by its loss of amplitude; None where too few half cycles give it.

    In the unit of the signal, as :attr:`friction_bayes.estimators.base.Fit.coefficient`.
    """
    found = _law(decay, damped=False)
    return None if found is None else found.posterior.coefficient


class UnevenLoss(NamedTuple):
    """Whether amplitudes fall faster or slower while they are larger, which dry friction alone does not do.

    Attributes
    ----------
    probability : float
        That they do.
    faster : bool
        Whether faster is more probable than slower, as under viscous damping.
    coefficient : Mixture
        Friction coefficient of the signal if they do: of small swings.
    losses : dict or None
        Probability of each other loss than by dry friction, by its name, if the whole signal says so: then
        the posterior has them. None where the amplitudes alone are evidence.
    """

    probability: float
    faster: bool
    coefficient: Mixture
    losses: dict[str, float] | None = None

    @property
    def sure(self) -> bool:
        """Whether they surely do."""
        return self.probability >= SURELY_UNEVEN


def uneven_loss(decay: FreeDecay) -> UnevenLoss | None:
    r"""Evidence of a loss with a part in proportion to the amplitude, against dry friction alone.

    None where there are too few half cycles to compute it, or no amplitude is lost.

    The amplitude loses ``c`` times its integral over the record, of length one, as well. That takes a share
    of all that is lost, as fitted, which is normal about zero with the sds of :data:`UNEVEN_PRIOR`: the
    record itself has the scale. Below zero it is no damping, but friction that grows with time or as the
    motion slows, or a sensor that shows large swings too small. Prior and noise are in proportion, as in
    :mod:`friction_bayes.statespace.subset_evidence`, so that evidences are in closed form.
    """
    law = _law(decay, damped=True)
    if law is None:
        return None
    lost = law.fitted[0] - law.fitted[-1]
    if lost <= 0.0:
        return None
    whole = lost / law.lost[-1]
    none = _regressed(law.amplitudes.without_last)
    given = [_regressed(law.amplitudes, prior_sd=share * whole) for share in UNEVEN_PRIOR]
    found = [each for each in given if each is not None]
    if none is None or len(found) < len(given):
        return None
    prior = np.array([1.0 - sum(UNEVEN_PRIOR.values()), *UNEVEN_PRIOR.values()])
    log_share = np.array([each.log_evidence for each in (none, *found)]) + np.log(prior)
    share = np.exp(log_share - log_share.max())
    share /= share.sum()
    damping = share[1:] @ [each.means[-1] for each in found]
    coefficient = Mixture.of([each.coefficient for each in found], share[1:] / share[1:].sum())
    return UnevenLoss(float(share[1:].sum()), bool(damping > 0.0), coefficient)


class _Regressed(NamedTuple):
    """Log evidence, weights of the walks, and Student t of all coefficients, shape (walks, p), given each."""

    log_evidence: float
    weight: Array
    location: Array
    scale: Array
    freedom: int

    @property
    def means(self) -> Array:
        """Of the coefficients."""
        return np.asarray(self.weight @ self.location)

    @property
    def coefficient(self) -> Mixture:
        """Distribution of the friction coefficient."""
        degrees = np.full(self.weight.size, float(self.freedom))
        return Mixture(self.weight, self.location[:, _FRICTION], self.scale[:, _FRICTION], degrees)


class _Amplitudes(NamedTuple):
    """Rows of the regression, reduced to triangular factors of columns and response, one a walk.

    With the log weight of each walk before the columns are fitted, and the least residual.
    """

    upper: Array
    log_weight: Array
    rows: int
    least: float

    @property
    def without_last(self) -> _Amplitudes:
        """The same without the last column."""
        return self._replace(upper=_triangular(np.delete(self.upper, -2, axis=2)))


class _Law(NamedTuple):
    """A regression of the amplitudes in motion, those it gives, and their integral."""

    amplitudes: _Amplitudes
    posterior: _Regressed
    fitted: Array
    lost: Array


def _law(decay: FreeDecay, *, damped: bool) -> _Law | None:
    """Amplitudes under dry friction, or with a part in proportion to them as well; None where too few.

    A half cycle whose amplitude would not be positive does not take place: the mass is at rest.
    """
    decay = decay.on_even_grid()
    polynomial, values, _ = tracked_phase(decay, damped=damped)
    swing = swing_frequency(decay.system, decay.unit)
    response, design, place = half_cycle_rows(values, polynomial, decay.quantity.order, swing)
    size, moving = place.size, np.ones(response.size, np.bool_)
    share, ratio = design[:size, _AMPLITUDE], design[:size, _FRICTION] / design[:size, _AMPLITUDE]
    step, fitted = 0.5 * np.diff(place), response[:size] / share
    law = None
    # without damping only what is in motion may change from the first round to the second
    for again in range(_ROUNDS if damped else 2):
        if again > 0:
            moving[:size] = np.logical_and.accumulate(fitted > 0.0)
        # up to the place of each amplitude, so that what is lost within its half cycle is taken as sampled
        lost = np.concatenate([[0.0], np.cumsum(step * (fitted[1:] + fitted[:-1]))])
        columns = design
        if damped:
            column = np.zeros(response.size)
            column[:size] = -share * lost
            columns = np.column_stack([design, column])
        amplitudes = _amplitudes(response[moving], columns[moving], EXACT_TO**2 if damped else _EXACT)
        found = None if amplitudes is None else _regressed(amplitudes)
        if amplitudes is None or found is None:
            return None
        last = np.count_nonzero(moving[:size])
        start, friction, share_lost = found.means[[_AMPLITUDE, _FRICTION, -1]]
        fitted = start + ratio * friction - damped * share_lost * lost
        law = _Law(amplitudes, found, fitted[:last], lost[:last])
    return law


def _amplitudes(response: Array, design: Array, exact: float) -> _Amplitudes | None:
    """Amplitudes under each walk; None where they are too few to estimate their scatter.

    The residual is taken to be at least the share ``exact`` of their sum of squares.
    """
    if response.size - design.shape[1] < _LEAST_FREEDOM or not np.all(np.isfinite(response)):
        return None
    loading = np.ascontiguousarray(design[:, _AMPLITUDE])
    steps = np.concatenate([[0.0], _WALKS / np.max(np.abs(loading))])
    log_prior = np.concatenate([[0.0], np.full(_WALKS.size, -math.log(_WALKS.size))])
    white, log_determinant = _whitened(np.column_stack([design, response]), loading, steps)
    least = exact * float(response @ response)
    return _Amplitudes(_triangular(white), log_prior - 0.5 * log_determinant, response.size, least)


@njit(**KERNEL)
def _triangular(rows: Array) -> Array:
    """Triangular factors of stacked rows, shape (walks, n, p), by modified Gram-Schmidt."""
    walks, n, p = rows.shape
    upper, column = np.zeros((walks, p, p)), np.empty((p, n))
    for i in range(walks):
        for k in range(n):
            for j in range(p):
                column[j, k] = rows[i, k, j]
        for j in range(p):
            own = column[j]
            upper[i, j, j] = math.sqrt(_product(own, own))
            for other in range(j + 1 if upper[i, j, j] > 0.0 else p, p):
                share = _product(own, column[other]) / upper[i, j, j] ** 2
                upper[i, j, other] = share * upper[i, j, j]
                for k in range(n):
                    column[other, k] -= share * own[k]
    return upper


@njit(**INNER, fastmath={"reassoc", "contract"})
def _product(one: Array, other: Array) -> float:
    total = 0.0
    for k in range(one.size):
        total += one[k] * other[k]
    return total


def _regressed(amplitudes: _Amplitudes, *, prior_sd: float | None = None) -> _Regressed | None:
    """Posterior averaged over the walk of the amplitudes; None where they do not determine it.

    With ``prior_sd`` the last coefficient is normal about zero, at the noise found without that prior.
    """
    upper, log_weight, rows, least = amplitudes
    freedom = rows - (upper.shape[2] - 1)
    if prior_sd is not None:
        precision = np.zeros((len(upper), 1, upper.shape[2]))
        noise2 = np.maximum(upper[:, -1, -1] ** 2, least) / freedom
        precision[:, 0, -2] = np.sqrt(noise2) / prior_sd
        upper = _triangular(np.concatenate([upper, precision], axis=1))
        log_weight = log_weight + np.log(precision[:, 0, -2])
        freedom += 1
    rest = np.maximum(upper[:, -1, -1] ** 2, least)
    location, scale, log_determinant = _coefficients(upper)
    if not np.all(np.isfinite(log_determinant)):
        return None
    log_weight = log_weight - 0.5 * freedom * np.log(rest) - log_determinant
    weight = np.exp(log_weight - log_weight.max())
    log_evidence = float(log_weight.max()) + math.log(weight.sum())
    scale *= np.sqrt(rest / freedom)[:, None]
    return _Regressed(log_evidence, weight / weight.sum(), location, scale, freedom)


@njit(**KERNEL)
def _coefficients(upper: Array) -> tuple[Array, Array, Array]:
    """Coefficients by triangular factors, shape (walks, p + 1, p + 1), their sds at noise of one, and the log
    determinants of the first p columns; infinite where these are not independent.
    """
    walks, p = upper.shape[0], upper.shape[1] - 1
    location, scale, log_determinant = np.zeros((walks, p)), np.zeros((walks, p)), np.zeros(walks)
    row = np.empty(p)
    for i in range(walks):
        own = upper[i]
        for k in range(p):
            length = 0.0
            for j in range(k + 1):
                length += own[j, k] ** 2
            # each by its own column: one is in the unit of the signal
            independent = own[k, k] > 1e-12 * math.sqrt(length)
            log_determinant[i] += math.log(own[k, k]) if independent else math.inf
        for k in range(p if log_determinant[i] < math.inf else 0):
            # row k of the inverse
            for j in range(k, p):
                row[j] = 1.0 if j == k else 0.0
                for m in range(k, j):
                    row[j] -= row[m] * own[m, j]
                row[j] /= own[j, j]
                location[i, k] += row[j] * own[j, p]
                scale[i, k] += row[j] ** 2
            scale[i, k] = math.sqrt(scale[i, k])
    return location, scale, log_determinant


@njit(**KERNEL)
def _whitened(columns: Array, loading: Array, steps: Array) -> tuple[Array, Array]:
    """Innovations of columns, shape (n, p), under walks of these steps over the noise; log determinants."""
    n, p = columns.shape
    white, log_determinant = np.empty((steps.size, n, p)), np.zeros(steps.size)
    for i, step in enumerate(steps):
        state, variance = np.zeros(p), 0.0
        for k in range(n):
            if k > 0:
                variance += step * step
            total = 1.0 + loading[k] * variance * loading[k]
            gain = variance * loading[k] / total
            log_determinant[i] += math.log(total)
            for j in range(p):
                innovation = columns[k, j] - loading[k] * state[j]
                white[i, k, j] = innovation / math.sqrt(total)
                state[j] += gain * innovation
            variance -= gain * loading[k] * variance
    return white, log_determinant
