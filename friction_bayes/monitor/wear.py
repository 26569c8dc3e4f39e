"""A wear model of friction over detection points: linear drift, diffusion, scatter from run to run.

The true friction is a Wiener process with drift, ``d theta = b dt + sqrt(v) dW``; the estimate of a record
is ``y_i = theta(t_i) + e_i`` with ``e_i`` normal of variance ``s_i**2 + tau**2``: its own standard deviation,
known from the closed form, and what conditions scatter from run to run. Given ``v`` and ``tau`` the model is
linear and normal, so the posterior of drift and of the friction at Tn is its conjugate normal in closed form,
and so is the marginal likelihood; these two are integrated over on a grid that is laid anew around the mass
it finds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = ["WearPosterior", "WearPrior", "default_wear_prior", "fit_wear"]


_NODES = 24
"""Grid nodes along each of the two standard deviations."""
_PASSES = 3
_REACH = 30.0
"""End of the first grid, in scales of the prior: 2 % of it lie beyond."""
_BLURRED = 0.3
"""Share of the smallest error of an estimate below which the grid need not resolve standard deviations."""
_WANDER, _SCATTER = 0.3, 0.03
"""Default scales of the two standard deviations, as shares of the largest friction."""
_KEPT = 1e-4
"""Nodes below this share of the heaviest are dropped, in the end and when the grid is laid anew."""


@dataclass(frozen=True, kw_only=True)
class WearPrior:
    """Prior of the wear model.

    Attributes
    ----------
    wander : float
        Scale (median) of the half-Cauchy prior of ``sqrt(v)``, the standard deviation that diffusion adds per
        square root of the unit of time; zero: there is no diffusion.
    scatter : float
        Scale (median) of the half-Cauchy prior of ``tau``, unit of friction.
    drift_mean, drift_sd : float
        Normal prior of the drift, friction per unit of time; an infinite sd is flat.
    level_mean, level_sd : float
        Normal prior of the friction at T1; an infinite sd is flat.
    """

    wander: float
    scatter: float
    drift_mean: float = 0.0
    drift_sd: float = math.inf
    level_mean: float = 0.0
    level_sd: float = math.inf


@dataclass(frozen=True, eq=False)
class WearPosterior:
    """Posterior of the wear model: a mixture of bivariate normals of friction at Tn and drift.

    Attributes
    ----------
    weight : ndarray, shape (m,)
        Posterior probability of each node of the grid.
    wander, scatter : ndarray, shape (m,)
        ``sqrt(v)`` and ``tau`` of each node.
    level, drift : ndarray, shape (m,)
        Posterior means given the node.
    level_variance, drift_variance, covariance : ndarray, shape (m,)
        Posterior covariance given the node.
    log_evidence : float
        Log marginal likelihood of the estimates, up to what is common to all fits of the same estimates over
        the same span.
    """

    weight: Array
    wander: Array
    scatter: Array
    level: Array
    drift: Array
    level_variance: Array
    drift_variance: Array
    covariance: Array
    log_evidence: float

    def moments(self, name: str) -> tuple[float, float]:
        """Return posterior mean and sd of ``level``, ``drift``, ``wander`` or ``scatter``."""
        values = getattr(self, name)
        inner = getattr(self, f"{name}_variance", np.zeros_like(values))
        mean = float(self.weight @ values)
        return mean, math.sqrt(float(self.weight @ (inner + (values - mean) ** 2)))


def default_wear_prior(times: Array, friction: Array) -> WearPrior:
    """Return the weak prior: flat in friction and drift, half-Cauchy in the two standard deviations.

    Half-Cauchy priors are the usual weak ones of standard deviations that few data determine (Gelman 2006).
    With probability one half, diffusion makes friction wander by less than 0.3 of its size over the span of
    the points, and conditions scatter it by less than 0.03.
    """
    size = float(np.abs(friction).max())
    span = math.sqrt(float(times[-1] - times[0]))
    return WearPrior(wander=_WANDER * size / span, scatter=_SCATTER * size)


@njit(**INNER)
def _filter(
    times: Array, friction: Array, sd: Array, wander: Array, scatter: Array, prior: Array
) -> tuple[Array, Array]:
    """Posterior of (level, drift) and log marginal likelihood for every node, shapes (m, 5) and (m,).

    A Kalman filter of the level runs over the estimates and over the regressor of the drift alike (de Jong
    1991): the drift is then a generalised least-squares fit to the innovations, updated point by point so
    that squares of residuals are summed, not subtracted. All nodes take a step together, which the processor
    does four at a time.
    """
    drift_mean, drift_precision, level_mean, level_variance = prior
    nodes = wander.size
    # level of the estimates and of the regressor, and their common variance
    y, x, p = np.empty(nodes), np.zeros(nodes), np.empty(nodes)
    information, drift, squares = np.empty(nodes), np.empty(nodes), np.zeros(nodes)
    product, log_product = np.ones(nodes), np.zeros(nodes)
    for k in range(nodes):
        y[k], p[k] = friction[0], sd[0] ** 2 + scatter[k] ** 2
        information[k], drift[k] = drift_precision, drift_mean
        if level_variance < np.inf:
            innovation = level_variance + p[k]
            gain = level_variance / innovation
            log_product[k] = math.log(innovation) + (friction[0] - level_mean) ** 2 / innovation
            y[k] = level_mean + gain * (friction[0] - level_mean)
            p[k] = level_variance * (1.0 - gain)
    for i in range(1, times.size):
        step, time = times[i] - times[i - 1], times[i] - times[0]
        own, estimate = sd[i] ** 2, friction[i]
        for k in range(nodes):
            before = p[k] + wander[k] ** 2 * step
            innovation = before + own + scatter[k] ** 2
            gain = before / innovation
            of_y, of_x = estimate - y[k], time - x[k]
            # variance of the residual given the points before, times the information; both zero at a reading
            # of the clock that is still zero, while nothing is known of the drift
            residual, spread = of_y - of_x * drift[k], information[k] * innovation + of_x * of_x
            squares[k] += (
                residual * residual * (information[k] / spread if spread > 0.0 else 1.0 / innovation)
            )
            drift[k] += residual * (of_x / spread if spread > 0.0 else 0.0)
            information[k] += of_x * of_x / innovation
            product[k] *= innovation
            y[k] += gain * of_y
            x[k] += gain * of_x
            p[k] = before * (1.0 - gain)
        # a product of four is far from either end of the numbers, and its logarithm costs as much as one
        if i % 4 == 0 or i == times.size - 1:
            for k in range(nodes):
                log_product[k] += math.log(product[k])
                product[k] = 1.0
    result = np.empty((nodes, 5))
    log_likelihood = np.empty(nodes)
    for k in range(nodes):
        lever = (times[-1] - times[0]) - x[k]
        result[k, 0] = y[k] + lever * drift[k]
        result[k, 1] = drift[k]
        result[k, 2] = p[k] + lever * lever / information[k]
        result[k, 3] = 1.0 / information[k]
        result[k, 4] = lever / information[k]
        log_likelihood[k] = -0.5 * (log_product[k] + math.log(information[k]) + squares[k])
    return result, log_likelihood


def fit_wear(times: Array, friction: Array, sd: Array, prior: WearPrior | None = None) -> WearPosterior:
    """Fit the wear model to the estimates of at least two detection points.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Not decreasing, the last later than the first, any unit.
    friction, sd : ndarray, shape (n,)
        Estimate of each record and its standard deviation.
    prior : WearPrior, optional
        :func:`default_wear_prior` when left out.

    Returns
    -------
    WearPosterior
    """
    prior = prior or default_wear_prior(times, friction)
    normal = np.array([prior.drift_mean, prior.drift_sd**-2.0, prior.level_mean, prior.level_sd**2])
    # below this the standard deviations change next to nothing: the grid is linear there, logarithmic above
    blurred = np.array([1.0 / math.sqrt(float(times[-1] - times[0])), 1.0]) * _BLURRED * float(sd.min())
    scale = np.array([prior.wander, prior.scatter])
    wander, scatter, found, weight, log_evidence = _on_grid(times, friction, sd, normal, scale, blurred)
    chosen = weight > _KEPT
    weight = weight[chosen] / weight[chosen].sum()
    level, drift, level_variance, drift_variance, covariance = found[chosen].T
    return WearPosterior(
        weight,
        wander[chosen],
        scatter[chosen],
        level,
        drift,
        level_variance,
        drift_variance,
        covariance,
        log_evidence,
    )


@njit(**KERNEL)
def _on_grid(
    times: Array, friction: Array, sd: Array, prior: Array, scale: Array, blurred: Array
) -> tuple[Array, Array, Array, Array, float]:
    """Nodes of the last grid, the posterior given each, its weight over the largest, and the log evidence.

    Half-Cauchy priors have these scales, less a factor of 2/pi a prior; one of zero has one node.
    """
    low, high, cell = np.zeros(2), np.log1p(_REACH * scale / blurred), np.zeros(2)
    rows, columns = (_NODES if scale[0] > 0.0 else 1), (_NODES if scale[1] > 0.0 else 1)
    nodes, axes, mass = rows * columns, np.zeros((2, _NODES)), np.zeros((2, _NODES))
    wander, scatter, log_prior = np.empty(nodes), np.empty(nodes), np.empty(nodes)
    for _ in range(_PASSES):
        for i, size in enumerate((rows, columns)):
            cell[i] = (high[i] - low[i]) / size
            for j in range(size):
                axes[i, j] = blurred[i] * math.expm1(low[i] + (j + 0.5) * cell[i])
                if scale[i] > 0.0:
                    mass[i, j] = math.log((axes[i, j] + blurred[i]) * cell[i] / scale[i])
                    mass[i, j] -= math.log1p((axes[i, j] / scale[i]) ** 2)
        for k in range(nodes):
            wander[k], scatter[k] = axes[0, k // columns], axes[1, k % columns]
            log_prior[k] = mass[0, k // columns] + mass[1, k % columns]
        found, log_likelihood = _filter(times, friction, sd, wander, scatter, prior)
        density = log_likelihood + log_prior
        weight = np.exp(density - density.max())
        kept = np.flatnonzero(weight > _KEPT)
        log_evidence = density.max() + math.log(weight.sum())
        for i, place in enumerate((kept // columns, kept % columns)):
            low[i], high[i] = low[i] + place.min() * cell[i], low[i] + (place.max() + 1) * cell[i]
    return wander, scatter, found, weight, log_evidence
