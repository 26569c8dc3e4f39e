r"""The remaining life f(dt|Tn): when the wear model first reaches the threshold, in closed form.

Given the diffusion ``v`` the distance to the threshold ``D`` and the drift ``b`` are bivariate normal. The
first passage of a Wiener process at time ``t`` has density ``D/t N(D - b t; 0, v t)`` (inverse Gaussian);
averaged over ``(D, b)`` with ``D > 0`` it is

    f(t) = N(W = 0) E[max(D, 0) | W = 0] / t,    W = D - b t + sqrt(v t) z,

with ``D`` and ``W`` jointly normal, and ``E[max(X, 0)] = m Phi(m/s) + s phi(m/s)``. No draw is made. A
friction that is above the threshold already has a remaining life of zero; one that drifts away may never
reach it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.monitor.wear import WearPosterior

__all__ = ["RemainingLife", "remaining_life"]


_SHORTEST, _LONGEST = 1e-7, 1e7
"""Ends of the time axis, in spans of the detection points."""
_COARSE = 100
_TOLERANCE = 4e-6
"""Probability within a step of the time axis that may be wrong before the step is halved."""
_ROUNDS = 20
_FAR = 8.0
"""Standard deviations beyond which a normal density or tail (below 1e-14) counts as nothing."""
_DROPPED = 1e-6
"""Nodes of the posterior with less weight than this share of the largest are left out here."""
_DIGITS = 6
"""Of the logarithm of time: nodes nearer to each other would be one to rounding."""
_SHARPEST = 10.0 ** (1 - _DIGITS)
"""Least standard deviation of the distance, as a share of it: a crossing sharper than that lies between nodes
of the time axis, where no quadrature meets it."""


@dataclass(frozen=True, eq=False)
class RemainingLife:
    """Distribution of the time from Tn till the friction first reaches the threshold.

    Attributes
    ----------
    time : ndarray, shape (m,)
        Nodes of the time axis, unit of the detection times.
    density : ndarray, shape (m,)
        Its density there, per unit of time; integrates to ``1 - already - never``.
    cumulative : ndarray, shape (m,)
        Probability to have reached the threshold by then; from ``already`` to ``1 - never``.
    already : float
        Probability that the friction is at or above the threshold at Tn.
    never : float
        Probability that it never reaches it, or after more than ten million spans of the detection points.
    """

    time: Array
    density: Array
    cumulative: Array
    already: float
    never: float

    def cdf(self, time: ArrayLike) -> Array:
        """Probability to have reached the threshold by ``time``, any shape; ``already`` at zero."""
        t = np.asarray(time, dtype=np.float64)
        inside = np.interp(np.log(np.maximum(t, self.time[0])), np.log(self.time), self.cumulative)
        return np.where(t < 0.0, 0.0, np.where(t <= self.time[0], self.already, inside))

    def ppf(self, probability: float) -> float:
        """Time by which the threshold is reached with a probability; infinite where it never is so likely."""
        if probability <= self.already:
            return 0.0
        if probability > self.cumulative[-1]:
            return math.inf
        return float(np.exp(np.interp(probability, self.cumulative, np.log(self.time))))


@njit(**KERNEL)
def _density(time: Array, nodes: Array) -> Array:
    """Density of the first passage at each time, averaged over the nodes, shape (nodes, 7)."""
    result = np.zeros(time.size)
    for i in range(time.size):
        t = time[i]
        total = 0.0
        for k in range(nodes.shape[0]):
            weight, distance, drift, distance_variance, drift_variance, covariance, v = nodes[k]
            # W = D - b t + sqrt(v t) z; cov(D, b) = -covariance of level and drift
            centre = distance - drift * t
            shared = distance_variance + covariance * t
            variance = shared + covariance * t + drift_variance * t * t + v * t
            if variance <= 0.0:
                continue
            ratio = centre / math.sqrt(variance)
            if abs(ratio) > _FAR:
                continue
            mean = distance - shared / variance * centre
            spread = math.sqrt(max(distance_variance - shared * shared / variance, 0.0))
            positive = max(mean, 0.0)
            if abs(mean) < _FAR * spread:
                z = mean / spread
                positive = mean * 0.5 * math.erfc(-z / math.sqrt(2.0))
                positive += spread * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
            height = math.exp(-0.5 * ratio * ratio) / math.sqrt(2.0 * math.pi * variance)
            total += weight * height * max(positive, 0.0)
        result[i] = total / t
    return result


def remaining_life(
    wear: WearPosterior, threshold: float, span: float, *, relative_sd: float = 0.0
) -> RemainingLife:
    """Return the distribution of the time from Tn till the friction first reaches the threshold.

    Parameters
    ----------
    wear : WearPosterior
        From :func:`friction_bayes.monitor.wear.fit_wear`.
    threshold : float
        Unit of friction.
    span : float
        Time between the first and the last detection point: scale of the time axis.
    relative_sd : float
        Relative standard deviation of the factor common to all estimates (mass, stiffness). It scales
        friction against the threshold, so that the distance has a further variance ``(threshold
        relative_sd)**2``, to first order.

    Returns
    -------
    RemainingLife
        Probabilities correct to about 5e-3.
    """
    kept = wear.weight > _DROPPED * wear.weight.max()
    weight = wear.weight[kept] / wear.weight[kept].sum()
    distance = threshold - wear.level[kept]
    variance = wear.level_variance[kept] + (threshold * relative_sd) ** 2 + (_SHARPEST * distance) ** 2
    nodes = np.column_stack(
        [
            *(weight, distance, wear.drift[kept], variance),
            *(wear.drift_variance[kept], wear.covariance[kept], wear.wander[kept] ** 2),
        ]
    )
    already = min(float(weight @ ndtr(-distance / np.sqrt(variance))), 1.0)
    coarse = span * np.logspace(math.log10(_SHORTEST), math.log10(_LONGEST), _COARSE)
    # where the mean path of each node crosses: no peak is then too narrow to be met
    heading = (distance > 0.0) & (nodes[:, 2] > 0.0)
    crossing = np.unique(distance[heading] / nodes[heading, 2])
    crossing = crossing[:: max(crossing.size // 50, 1)]
    within = (crossing > coarse[0]) & (crossing < coarse[-1])
    start = np.log(np.concatenate([coarse, crossing[within]]))
    time, density = _refined(np.exp(np.unique(np.round(start, _DIGITS))), nodes)
    steps = 0.5 * np.diff(np.log(time)) * ((time * density)[1:] + (time * density)[:-1])
    cumulative = already + np.concatenate([[0.0], np.cumsum(steps)])
    # rounding and quadrature may leave a hair above one
    cumulative = np.minimum(cumulative, 1.0)
    return RemainingLife(time, density, cumulative, already, 1.0 - float(cumulative[-1]))


def _refined(time: Array, nodes: Array) -> tuple[Array, Array]:
    """Halve the steps of the logarithmic time axis until the probability within each is settled."""
    density = _density(time, nodes)
    open_steps = np.ones(time.size - 1, dtype=np.bool_)
    for _ in range(_ROUNDS):
        left = np.flatnonzero(open_steps)
        if left.size == 0:
            break
        middle = np.sqrt(time[left] * time[left + 1])
        between = _density(middle, nodes)
        width = np.log(time[left + 1] / time[left])
        height = time[left] * density[left] + time[left + 1] * density[left + 1]
        error = np.abs(0.5 * height - middle * between) * width / 6.0
        halves = np.repeat((error > _TOLERANCE) & (width > 4.0 * 10.0**-_DIGITS), 2)
        where = left + 1
        time, density = np.insert(time, where, middle), np.insert(density, where, between)
        open_steps = np.zeros(time.size - 1, dtype=np.bool_)
        # each step that was left is now two, shifted by the insertions before it
        first = left + np.arange(left.size)
        open_steps[np.column_stack([first, first + 1]).ravel()] = halves
    return time, density
