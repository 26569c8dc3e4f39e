r"""Coloured noise of the sensor: an autoregression of the samples, in place of white noise.

.. math:: u_i = \sum_{k=1}^p a_k u_{i-k} + \epsilon_i

Filters of the acquisition, differences of positions and interpolation make noise of this kind. The
coefficients are those of the residual by Burg's recursion, which keeps the process stationary on short
records; the order is the one with the least Bayesian information criterion (Schwarz, Annals of Statistics 6,
1978), whose penalty then enters the evidence of the candidate. The likelihood is exact: the filter of
:func:`coloured_gains` has the last ``p`` values of the noise as states, from their stationary covariance
on, so that samples may be left out and a random force may act in addition.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_banded, solve_toeplitz, toeplitz

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.statespace.transition import ForcedSteps

__all__ = [
    "MOST_LAGS",
    "Autoregression",
    "LaggedNoise",
    "burg",
    "burg_recursion",
    "coloured_gains",
    "coloured_innovations",
    "most_lags",
    "order_cost",
    "with_missing_drawn",
]

MOST_LAGS = 30
_SAMPLES_PER_LAG = 8
"""A lag more is looked for in so many samples more."""
_FAINTEST = 1e-10
"""Spectral density over its mean below which it is rounding: an autoregression is singular without any."""
_GRID = 4097
"""Frequencies from zero to Nyquist's at which spectra are compared."""
_REGULAR = 1.0 - 1e-10
"""Factor on reflection coefficients: the recursion stays regular where a residual is smooth to rounding."""
_STEADY = 1e-12
_MOST_DRAWS, _SAME_COLOUR = 20, 1e-3
"""Times that what is missing is drawn, each from the colour of the time before, and by how much of their size
the innovations of the same colour may differ."""


class LaggedNoise(NamedTuple):
    """An autoregression as the filter takes it.

    Attributes
    ----------
    coefficients : ndarray, shape (p,)
    covariance : ndarray, shape (p, p)
        Of ``p`` successive values.
    added : float
        Variance that each sample adds.
    """

    coefficients: Array
    covariance: Array
    added: float


@dataclass(frozen=True, eq=False)
class Autoregression:
    """Noise of unit variance.

    Attributes
    ----------
    coefficients : ndarray, shape (p,)
        ``a_1 .. a_p``.
    innovation_variance : float
        Of ``epsilon``, over that of the noise.
    penalty : float
        What its coefficients cost in log evidence: half the Bayesian information criterion's, and the order.
    """

    coefficients: Array
    innovation_variance: float
    penalty: float = 0.0

    @property
    def order(self) -> int:
        """Number of lags."""
        return int(self.coefficients.size)

    @cached_property
    def covariance(self) -> Array:
        """Of ``p`` successive values, shape (p, p), from the Yule-Walker equations."""
        p = self.order
        matrix = np.eye(p + 1)
        for i in range(p + 1):
            for k in range(1, p + 1):
                matrix[i, abs(i - k)] -= self.coefficients[k - 1]
        right = np.zeros(p + 1)
        right[0] = self.innovation_variance
        return np.asarray(toeplitz(np.linalg.solve(matrix, right)[:p]))

    @property
    def lagged(self) -> LaggedNoise:
        """The same for the filter."""
        return LaggedNoise(self.coefficients, self.covariance, self.innovation_variance)

    def drawn(self, samples: int, rng: np.random.Generator) -> Array:
        """Draw so many successive values, shape (samples,)."""
        first = np.linalg.cholesky(self.covariance) @ rng.standard_normal(self.order)
        kicks = math.sqrt(self.innovation_variance) * rng.standard_normal(samples)
        return _run(self.coefficients, np.concatenate([first, kicks]))[self.order :]

    def spectrum(self, omega: Array) -> Array:
        """Spectral density at ``omega`` [rad/sample], shape (m,); that of white noise is its variance."""
        through = polyval(np.exp(-1j * omega), np.append(1.0, -self.coefficients))
        return np.asarray(self.innovation_variance / np.abs(through) ** 2)

    def level(self, omega: Array) -> float:
        """Geometric mean of the spectral density over ``omega`` [rad/sample], shape (m,)."""
        return float(np.exp(np.log(self.spectrum(np.minimum(omega, math.pi))).mean()))

    def gain(self, samples: int) -> float:
        """Log likelihood of so many samples over that of white noise of the same variance."""
        return -0.5 * samples * math.log(self.innovation_variance)

    def levelled(self, level: float, angle: float, least: float = _FAINTEST) -> Autoregression:
        """The same with a spectral density ``level`` below twice ``angle``, and at least ``least`` above."""
        omega = np.linspace(0.0, math.pi, _GRID)
        spectrum = np.where(omega < 2.0 * angle, level, np.maximum(self.spectrum(omega), least))
        covariance = np.fft.irfft(spectrum)[: self.order + 1]
        coefficients = solve_toeplitz(covariance[:-1], covariance[1:])
        known = float(coefficients @ covariance[1:]) / float(covariance[0])
        return Autoregression(coefficients, 1.0 - known, self.penalty)


def burg(residual: Array, fitted: float) -> tuple[Autoregression, float]:
    """Autoregression of a residual, shape (n,), and its variance, ``fitted`` numbers being fitted to it.

    Of order zero where the residual is white.
    """
    x = residual - residual.mean()
    power = float(x @ x) / max(x.size - fitted, 1.0)
    most = most_lags(x.size)
    if most < 1 or power == 0.0:
        return Autoregression(np.empty(0), 1.0), power
    coefficients, variances = burg_recursion(x / math.sqrt(float(x @ x) / x.size), most)
    order = int(np.argmin([order_cost(x.size, m, most, variances[m]) for m in range(most + 1)]))
    penalty = order_cost(x.size, order, most, 1.0)
    return Autoregression(coefficients[order, :order].copy(), float(variances[order]), penalty), power


def with_missing_drawn(residual: Array, known: Mask) -> Array:
    """Replace missing samples by one draw, given those known, from the autoregression of both.

    Fit and draw alternate until the innovations stay. Interpolated samples would be smoother than the others,
    as behind a filter. The draw is the same for the same samples, and mirrored where these are.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    known : ndarray of bool, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
    """
    measured = residual[known]
    if measured.size == residual.size:
        return residual
    mean, sd = (float(measured.mean()), float(measured.std())) if measured.size else (0.0, 0.0)
    if sd == 0.0 or most_lags(residual.size) < 1:
        return np.where(known, residual, mean)
    normal = np.random.default_rng(0).standard_normal(residual.size - measured.size)
    normal *= math.copysign(1.0, measured[0])
    x = np.where(known, (residual - mean) / sd, 0.0)
    x[~known] = normal
    innovation = math.inf
    for _ in range(_MOST_DRAWS):
        colour, power = burg(x, 0.0)
        before, innovation = innovation, power * colour.innovation_variance
        if abs(innovation - before) < _SAME_COLOUR * innovation:
            break
        x = np.where(known, x, 0.0)
        x[~known] = _between(x, ~known, colour, math.sqrt(power) * normal)
    return np.where(known, residual, mean + sd * x)


def _between(x: Array, missing: Mask, colour: Autoregression, normal: Array) -> Array:
    """A draw of what is missing, zero in ``x``, given all else, by as many independent ``normal`` numbers."""
    if colour.order == 0:
        return normal
    # of faint frequencies no more than rounding leaves
    colour = colour.levelled(0.0, 0.0)
    n, order, place = x.size, colour.order, np.flatnonzero(missing)
    whitener = np.append(1.0, -colour.coefficients) / math.sqrt(colour.innovation_variance)
    first = np.linalg.inv(np.linalg.cholesky(colour.covariance))
    innovations = np.convolve(x, whitener)[:n]
    innovations[:order] = 0.0
    back = np.convolve(innovations[::-1], whitener)[:n][::-1]
    back[:order] += first.T @ (first @ x[:order])
    factor = cholesky_banded(_precision(place, n, whitener, first.T @ first), lower=True)
    upper = np.zeros_like(factor)
    for k in range(factor.shape[0]):
        upper[-1 - k, k:] = factor[k, : place.size - k]
    spread = solve_banded((0, factor.shape[0] - 1), upper, normal)
    return np.asarray(spread - cho_solve_banded((factor, True), back[place]))


def _precision(place: Indices, samples: int, whitener: Array, first: Array) -> Array:
    """Precision of samples at some places given all others, as bands below its diagonal.

    The ``whitener``, shape (p + 1,), makes innovations of unit variance of a sample and those before it, from
    sample p on; ``first`` is the precision of those before that.
    """
    order = whitener.size - 1
    # of two samples some lags apart by as many innovations as have both
    products = np.zeros((order + 1, order + 2))
    for lag in range(order + 1):
        products[lag, lag + 1 :] = np.cumsum(whitener[lag:] * whitener[: order + 1 - lag])
    until = np.minimum(order, samples - 1 - place) + 1
    since = np.maximum(order - place, 0)
    band = np.zeros((min(order, place.size - 1) + 1, place.size))
    for k in range(band.shape[0]):
        one, other = place[: place.size - k], place[k:]
        lag = np.minimum(other - one, order)
        both = products[lag, until[: one.size]] - products[lag, since[: one.size]]
        both += np.where(other < order, first[np.minimum(one, order - 1), np.minimum(other, order - 1)], 0.0)
        band[k, : one.size] = np.where(other - one <= order, both, 0.0)
    return band


@njit(**KERNEL)
def most_lags(samples: int) -> int:
    """Highest order that is looked for."""
    return min(MOST_LAGS, samples // _SAMPLES_PER_LAG)


@njit(**KERNEL)
def order_cost(samples: int, order: int, most: int, variance: float) -> float:
    """Minus the log evidence of an order of innovations of that variance, and a penalty: zero for none."""
    cost = 0.5 * samples * math.log(variance) + 0.5 * order * math.log(samples)
    # white or not, and if not, any order as probable as another
    return cost + math.log(most) if order > 0 else cost


@njit(**KERNEL)
def _run(coefficients: Array, kicks: Array) -> Array:
    """An autoregression driven by kicks, the first ones its own values."""
    values, p = kicks.copy(), coefficients.size
    for i in range(p, values.size):
        for k in range(p):
            values[i] += coefficients[k] * values[i - 1 - k]
    return values


@njit(**KERNEL, fastmath={"reassoc", "contract"})
def burg_recursion(x: Array, most: int) -> tuple[Array, Array]:
    """Coefficients, row ``m`` those of order ``m``, and variances of the innovations, for unit variance."""
    n = x.size
    coefficients = np.zeros((most + 1, most))
    variances = np.ones(most + 1)
    forward, backward = x.copy(), x.copy()
    for m in range(1, most + 1):
        numerator, denominator = 0.0, 0.0
        # what an order leaves stays in its place, so that compilers take several at a time
        ahead, behind = forward[m:], backward[: n - m]
        for i in range(n - m):
            numerator += ahead[i] * behind[i]
            denominator += ahead[i] ** 2 + behind[i] ** 2
        reflection = _REGULAR * 2.0 * numerator / max(denominator, 1e-300)
        for k in range(m - 1):
            coefficients[m, k] = coefficients[m - 1, k] - reflection * coefficients[m - 1, m - 2 - k]
        coefficients[m, m - 1] = reflection
        variances[m] = variances[m - 1] * (1.0 - reflection * reflection)
        for i in range(n - m):
            before, after = ahead[i], behind[i]
            ahead[i] = before - reflection * after
            behind[i] = after - reflection * before
    return coefficients, variances


@njit(**KERNEL)
def coloured_gains(force: ForcedSteps, noise: LaggedNoise, rows: Array, variance: Array) -> Array:
    """Gains, shape (n, m + 1), of the ``m = 3 + p`` states, and last one over the innovation's sd.

    The states are displacement, velocity, random force and the last ``p`` values of the noise, the newest
    first. All are zero of samples that are not used, whose ``variance`` is infinite.
    """
    index, transitions, forced, square = force
    coefficients, covariance, added = noise
    p, n = coefficients.size, variance.size
    m = 3 + p
    gains = np.zeros((n, m + 1))
    # a value of the noise stays in its place, the newest takes that of the oldest
    cov, newest = np.zeros((m, m)), m - 1
    cov[2, 2] = square
    for a in range(p):
        for b in range(p):
            cov[3 + a, 3 + b] = covariance[a, b]
    # from any place on, what each value adds to the next one: twice, so that no place has to be counted round
    shares = np.empty(2 * p)
    for k in range(p):
        shares[p - 1 - k] = shares[2 * p - 1 - k] = coefficients[k]
    gain, new = np.empty(m), np.empty(m)
    changes, same_for = len(rows) > 1, 0
    for i in range(n):
        same = i > 1 and variance[i] == variance[i - 1] < math.inf and index[i - 1] == index[i - 2]
        # another row has another covariance
        same = same and not (changes and rows[i, 0] != rows[i - 1, 0])
        # as many equal gains as there are states say that the covariance is the same
        if same_for >= m and same:
            for a in range(m + 1):
                gains[i, a] = gains[i - 1, a]
            continue
        if i > 0:
            oldest = newest + 1 if newest < m - 1 else 3
            k = index[i - 1]
            _advance(cov, transitions[k], forced[k], shares, m - 1 - newest, added, oldest, new)
            newest = oldest
        if variance[i] == math.inf:
            same_for = 0
            continue
        row = rows[i if changes else 0]
        scale = _learn(cov, row, variance[i], newest, gain)
        for a in range(3):
            gains[i, a] = gain[a]
        for k in range(p):
            gains[i, 3 + k] = gain[_place(newest, k, m)]
        gains[i, m] = scale
        same_for = same_for + 1 if same and _close(gains[i], gains[i - 1]) else 0
    return gains


@njit(**INNER)
def _place(newest: int, age: int, m: int) -> int:
    """Place of the noise's value that is so many samples older than the newest."""
    place = newest - age
    return place if place > 2 else place + m - 3


@njit(**INNER, fastmath={"contract"})
def _learn(cov: Array, row: Array, variance: float, newest: int, gain: Array) -> float:
    """Fill the gains of a sample that is used; its covariance then is known. Returns one over its sd."""
    m = cov.shape[0]
    for a in range(m):
        gain[a] = cov[0, a] * row[0] + cov[1, a] * row[1] + cov[2, a] * row[2] + cov[newest, a]
    total = variance - 1.0 + gain[newest]
    for a in range(3):
        total += row[a] * gain[a]
    scale = 1.0 / math.sqrt(total)
    for a in range(m):
        gain[a] *= scale
    for a in range(m):
        for b in range(m):
            cov[a, b] -= gain[a] * gain[b]
    return scale


@njit(**INNER, fastmath={"contract"})
def _advance(
    cov: Array, f: Array, forced: Array, shares: Array, first: int, added: float, oldest: int, new: Array
) -> None:
    """The covariance one sample later; the new value of the noise takes the place of the oldest."""
    m = cov.shape[0]
    for b in range(m):
        new[b] = 0.0
    for k in range(m - 3):
        for b in range(m):
            new[b] += shares[first + k] * cov[3 + k, b]
    own_variance = added
    for k in range(m - 3):
        own_variance += shares[first + k] * new[3 + k]
    new[oldest] = own_variance
    for b in range(m):
        cov[oldest, b] = cov[b, oldest] = new[b]
    for b in range(m):
        x, v, d = cov[0, b], cov[1, b], cov[2, b]
        for a in range(3):
            cov[a, b] = f[a, 0] * x + f[a, 1] * v + f[a, 2] * d
    for a in range(3):
        x, v, d = cov[a, 0], cov[a, 1], cov[a, 2]
        for b in range(3):
            cov[a, b] = f[b, 0] * x + f[b, 1] * v + f[b, 2] * d + forced[a, b]
        for b in range(3, m):
            cov[b, a] = cov[a, b]


@njit(**INNER)
def _close(gains: Array, before: Array) -> bool:
    """Whether gains are what they were to rounding."""
    most = 0.0
    for a in range(gains.size):
        most = max(most, abs(gains[a] - before[a]) / (1.0 + abs(gains[a])))
    return most <= _STEADY


@njit(**KERNEL, fastmath={"contract"})
def coloured_innovations(
    columns: Array, index: Indices, transitions: Array, rows: Array, coefficients: Array, gains: Array
) -> Array:
    """Whitened innovations of every column, shape (n, q), zero in samples that are not used."""
    n, q = columns.shape
    p = coefficients.size
    white = np.zeros((n, q))
    x, v, d = np.zeros(q), np.zeros(q), np.zeros(q)
    # row i + p is that of sample i as far as it is known: the last p rows are states, and none has to move
    noise = np.zeros((n + p, q))
    changes = len(rows) > 1
    row0, row1, row2 = rows[0, 0], rows[0, 1], rows[0, 2]
    for i in range(n):
        # the states are zero before the first sample, whatever the step
        f = transitions[index[max(i - 1, 0)]]
        f00, f01, f02, f10, f11, f12, f22 = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2]
        if changes:
            row0, row1, row2 = rows[i, 0], rows[i, 1], rows[i, 2]
        now = noise[i + p]
        for k in range(p):
            share, before = coefficients[k], noise[i + p - 1 - k]
            for j in range(q):
                now[j] += share * before[j]
        k0, k1, k2, scale = gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 3 + p]
        sample, innovation = columns[i], white[i]
        used = scale > 0.0
        for j in range(q):
            xj = f00 * x[j] + f01 * v[j] + f02 * d[j]
            vj = f10 * x[j] + f11 * v[j] + f12 * d[j]
            dj = f22 * d[j]
            e = (sample[j] - row0 * xj - row1 * vj - row2 * dj - now[j]) * scale if used else 0.0
            innovation[j] = e
            x[j] = xj + k0 * e
            v[j] = vj + k1 * e
            d[j] = dj + k2 * e
        for k in range(p):
            gain, before = gains[i, 3 + k], noise[i + p - k]
            for j in range(q):
                before[j] += gain * innovation[j]
    return white
