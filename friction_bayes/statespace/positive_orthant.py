r"""Normal distributions confined to positive coefficients: their mass and marginals.

For ``b ~ N(m, C)`` the probability that several components are positive has no closed form. Expectation
propagation (Cunningham, Hennig and Lacoste-Julien 2011) replaces each constraint by a normal factor,

.. math:: N(b; m, C) \prod_j [b_j > 0] \approx Z\, N(b; m, C) \prod_j \exp(\nu_j b_j - \tau_j b_j^2 / 2)

with equal moments of every marginal; it is exact for one constraint and accurate to well under a per cent for
a few. A constrained marginal is returned as the normal that, cut at zero, gives it.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.statespace.cholesky import factor, forward

__all__ = ["VECTORS", "confine", "confine_all", "cut_moments", "log_normal_mass"]

_SQRT2 = math.sqrt(2.0)
_LOG_SQRT_2PI = 0.5 * math.log(2.0 * math.pi)
_FAR = -30.0
"""Standard deviations below which asymptotic series are closer than differences of rounded numbers."""
_SWEEPS = 30
_CONVERGED = 1e-7
_ROUNDING = 1e-16
"""Share of a variance below which the part remaining after a constraint is lost in rounding."""
VECTORS = 6
"""In the room that :func:`confine_all` works in."""


@njit(**KERNEL)
def log_normal_mass(z: float) -> float:
    """``log Phi(z)``."""
    if z > _FAR:
        return math.log(0.5 * math.erfc(-z / _SQRT2))
    inverse = 1.0 / (z * z)
    series = -inverse * (1.0 - 3.0 * inverse * (1.0 - 5.0 * inverse))
    return -0.5 * z * z - math.log(-z) - _LOG_SQRT_2PI + math.log1p(series)


@njit(**KERNEL)
def cut_moments(mean: float, variance: float) -> tuple[float, float, float]:
    """Log mass above zero of ``N(mean, variance)``, and mean and variance of what lies there."""
    sd = math.sqrt(variance)
    z = mean / sd
    log_mass = log_normal_mass(z)
    if z < _FAR:
        inverse = 1.0 / (z * z)
        centre = -(1.0 - inverse * (2.0 - inverse * (10.0 - 74.0 * inverse))) / z
        shrink = inverse * (1.0 - inverse * (6.0 - inverse * (50.0 - 518.0 * inverse)))
        return log_mass, sd * centre, variance * shrink
    hazard = math.exp(-0.5 * z * z - _LOG_SQRT_2PI - log_mass)
    return log_mass, mean + sd * hazard, variance * (1.0 - hazard * (z + hazard))


@njit(**KERNEL)
def confine(mean: Array, cov: Array, positive: Mask, location: Array, scale2: Array) -> float:
    """Log probability that the components named by ``positive`` are positive, and all marginals.

    Parameters
    ----------
    mean, cov : ndarray, shapes (p,) and (p, p)
        Of the normal distribution.
    positive : ndarray of bool, shape (p,)
        Which components have to be positive.
    location, scale2 : ndarray, shape (p,)
        Filled with mean and variance of the marginals, those of ``positive`` before they are cut at zero.
    """
    p = mean.size
    chosen = _places(positive)
    return confine_all(p, mean, cov, chosen, location, scale2, np.empty((2 * p + VECTORS, p)))


@njit(**INNER)
def confine_all(
    p: int, mean: Array, cov: Array, chosen: Integers, location: Array, scale2: Array, room: Array
) -> float:
    """:func:`confine` of the first ``p`` components, ``chosen`` those that have to be positive.

    It works in ``room``, shape (2 q + VECTORS, q) with q not below p: new arrays for every set would take a
    fifth of the time.
    """
    q = room.shape[1]
    sigma, inner, vectors = room[:q], room[q : 2 * q], room[2 * q :]
    mu, tilt, shift, column = vectors[0], vectors[1], vectors[2], vectors[3]
    for a in range(p):
        mu[a], tilt[a], shift[a] = mean[a], 0.0, 0.0
        for b in range(p):
            sigma[a, b] = cov[a, b]
    # one constraint is exact at once
    for _ in range(min(chosen.size, 1) if chosen.size < 2 else _SWEEPS):
        change = 0.0
        for i in chosen:
            cavity_precision = 1.0 / sigma[i, i] - tilt[i]
            if not cavity_precision > 0.0:
                continue
            cavity = 1.0 / cavity_precision
            centre = cavity * (mu[i] / sigma[i, i] - shift[i])
            _, m, v = cut_moments(centre, cavity)
            new_tilt = max(1.0 / v - cavity_precision, 0.0)
            new_shift = m / v - centre * cavity_precision
            more_tilt, more_shift = new_tilt - tilt[i], new_shift - shift[i]
            denominator = 1.0 + more_tilt * sigma[i, i]
            if not (denominator > 0.0 and math.isfinite(more_shift)):
                continue
            change = max(change, abs(more_tilt) * sigma[i, i])
            tilt[i], shift[i] = new_tilt, new_shift
            gain = (more_shift - more_tilt * mu[i]) / denominator
            loss = more_tilt / denominator
            for a in range(p):
                column[a] = sigma[a, i]
            for a in range(p):
                mu[a] += column[a] * gain
                share = loss * column[a]
                for b in range(p):
                    sigma[a, b] -= share * column[b]
                sigma[a, a] = max(sigma[a, a], _ROUNDING * cov[a, a])
        if change < _CONVERGED:
            break
    log_mass, most = 0.0, 0.0
    for a in range(p):
        location[a], scale2[a] = mu[a], sigma[a, a]
    for i in chosen:
        cavity_precision = max(1.0 / sigma[i, i] - tilt[i], 1e-12 / sigma[i, i])
        cavity = 1.0 / cavity_precision
        centre = cavity * (mu[i] / sigma[i, i] - shift[i])
        location[i], scale2[i] = centre, cavity
        most = min(most, log_normal_mass(mean[i] / math.sqrt(cov[i, i])))
        log_mass += log_normal_mass(centre / math.sqrt(cavity)) + 0.5 * math.log1p(tilt[i] * cavity)
        total = centre * cavity_precision + shift[i]
        log_mass -= 0.5 * (total**2 / (cavity_precision + tilt[i]) - centre**2 * cavity_precision)
    log_mass += _log_integral(mean, cov, chosen, tilt, shift, inner, vectors[4], vectors[5])
    # all are positive at most as often as each; not finite by rounding counts as never
    return min(log_mass, most) if math.isfinite(log_mass) else -math.inf


@njit(**INNER)
def _places(chosen: Mask) -> Integers:
    """Indices of the chosen, as by ``np.flatnonzero``, which takes the compiler a second."""
    places = np.empty(chosen.size, np.int64)
    count = 0
    for i in range(chosen.size):
        if chosen[i]:
            places[count] = i
            count += 1
    return places[:count]


@njit(**INNER)
def _log_integral(
    mean: Array,
    cov: Array,
    chosen: Integers,
    tilt: Array,
    shift: Array,
    inner: Array,
    right: Array,
    half: Array,
) -> float:
    """``log int N(b; m, C) prod exp(shift b - tilt b**2 / 2) db`` over the constrained components.

    With ``T`` the tilts and ``n`` the shifts, ``w = m + C n`` and ``B = I + sqrt(T) C sqrt(T)``, no
    eigenvalue of which is below one, it is ``(n' (m + w) - log|B| - w' sqrt(T) inv(B) sqrt(T) w) / 2``.
    """
    some = chosen.size
    log_value = 0.0
    for a in range(some):
        i = chosen[a]
        shifted = mean[i]
        for b in range(some):
            k = chosen[b]
            shifted += cov[i, k] * shift[k]
            inner[a, b] = math.sqrt(tilt[i] * tilt[k]) * cov[i, k]
        inner[a, a] += 1.0
        right[a] = math.sqrt(tilt[i]) * shifted
        log_value += 0.5 * shift[i] * (mean[i] + shifted)
    factor(inner, some)
    log_determinant = 0.0
    for a in range(some):
        log_determinant += 2.0 * math.log(inner[a, a])
    log_value -= 0.5 * log_determinant
    return log_value - 0.5 * forward(inner, right, some, half)
