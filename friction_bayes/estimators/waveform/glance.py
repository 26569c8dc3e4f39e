"""Quick tests of the residuals of many fits: surely white noise, surely a loss by dry friction alone.

Each is a conservative version, from sums over the residual, of a longer test
(:func:`~friction_bayes.estimators.noise.noise_level.looks_white`,
:func:`~friction_bayes.estimators.envelope.loss_of_amplitude.uneven_loss`): it passes by a margin only, so
that no record passes which the longer one would reject. The other records are left to the longer test.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.arrays import ZERO, Array
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.block_means import fill_block_means
from friction_bayes.decay.linear_least_squares import add_sample, regression, solve_spd
from friction_bayes.decay.located import Located
from friction_bayes.estimators.base import Glance
from friction_bayes.estimators.envelope.loss_of_amplitude import UNEVEN_PRIOR
from friction_bayes.estimators.noise.coulomb_regression import LEAST_SAMPLES
from friction_bayes.estimators.noise.force_screen import (
    ComparedForces,
    ForceTable,
    force_table,
    probability_of_none,
)
from friction_bayes.estimators.noise.noise_level import (
    RATHER_NONE,
    compared_forces,
    samples_in_mean,
    samples_of_colour,
)
from friction_bayes.estimators.noise.stray_samples import SURELY_NONE
from friction_bayes.estimators.waveform.least_squares import WaveformFits
from friction_bayes.estimators.waveform.normal_equations import (
    ADVANCE,
    AMPLITUDE,
    COEFFICIENTS,
    FRICTION,
    OFFSET,
    PHASE,
    Samples,
    Turns,
    first_at,
    half_cycle_table,
)
from friction_bayes.statespace.coloured_noise import MOST_LAGS, most_lags, order_cost
from friction_bayes.statespace.kalman import sensor_row

__all__ = ["RATHER_EVEN", "glance"]

RATHER_EVEN = 0.05
"""Probability of a loss not by dry friction alone below which a record passes, which then has that alone."""
_TAILS = 2.0
"""Sds of the mean fourth power above which the long form looks for stray samples; it costs but time."""
_MARGIN = 1.0
"""Log odds by which a test passes that is not made exactly as its long form is."""
_NONE = RATHER_NONE + 0.05
"""Probability of no force that passes, where the clock is that of the table as nearly as below."""
_SAME_CLOCK = 0.02
"""Rad by which the phase of a record may run away from the table's."""
_FEWEST = 12
"""Half cycles below which amplitudes scatter too little or too much by chance for a short form."""
_LAGS_AT_A_TIME, _NEAR = 10, 2000
"""Lags that one reading gives products of, and values that are read while they are near."""
_BESIDE = MOST_LAGS + _LAGS_AT_A_TIME
"""Zeros on either side of values whose products are added up, so that no sum ends early."""
_SHARES, _PRIOR = tuple(UNEVEN_PRIOR), tuple(UNEVEN_PRIOR.values())
_EVEN = math.log(RATHER_EVEN / (1.0 - RATHER_EVEN))
"""Log odds of another loss than by dry friction alone below which there is rather none."""


def glance(values: Array, located: Located, order: int, fits: WaveformFits) -> Glance:
    """Results of the quick tests of the residuals of fits of evenly spaced records.

    Parameters
    ----------
    values : ndarray, shape (records, n)
    located : Located
        Where the moving part of each lies.
    order : int
        Derivative order of the signal.
    fits : WaveformFits
    """
    found = Glance(np.zeros(len(values), np.bool_), np.zeros(len(values), np.bool_))
    _glance_all(values, located, order, fits, sensor_row(order), compared_forces(), found)
    return found


@njit(**KERNEL)
def _glance_all(
    values: Array,
    located: Located,
    order: int,
    fits: WaveformFits,
    row: Array,
    forces: ComparedForces,
    found: Glance,
) -> None:
    # nothing before the first value and after the last
    work = np.zeros(values.shape[1] + 2 * _BESIDE, np.float32)
    few = np.zeros(values.shape[1] // 2 + 2 * _BESIDE, np.float32)
    table = force_table(0.5, ZERO + 2, row, order, forces)
    for r in range(values.shape[0]):
        n = located.stop[r] - located.start[r]
        if not fits.found[r] or n < LEAST_SAMPLES:
            continue
        p, residual = fits.coefficients[r], work[_BESIDE : _BESIDE + n]
        work[_BESIDE + n :] = 0.0
        # about a fitted offset the residual has no mean
        scale = math.sqrt(n / max(fits.misfit[r], 1e-300))
        moving = values[r, located.start[r] : located.stop[r]]
        found.straight[r] = _straight(moving, order, p, fits.kappa[r], fits.stop[r], scale, residual)
        angle = 2.0 * p[ADVANCE] / (n - 1)
        if (
            _surely_none_stray(residual)
            and _surely_uncorrelated(work, n)
            and _surely_without_colour(residual, samples_of_colour(angle), few)
        ):
            block = samples_in_mean(angle)
            means = np.empty(n // block)
            fill_block_means(residual, block, 0.0, means)
            if means.size > COEFFICIENTS:
                table = _table_for(angle * block, means.size, row, order, forces, table)
                found.white[r] = probability_of_none(means, row, forces, table) >= _NONE


@njit(**INNER, fastmath={"reassoc"})
def _surely_none_stray(x: NDArray[np.float32]) -> bool:
    """Whether values of unit mean square have none far outside, nor as many or as few that hide them in it.

    These show in the mean fourth power, which of normal values is three, give or take sqrt(24/n).
    """
    none, limit = np.float32(0.0), np.float32(SURELY_NONE**2)
    fourth = beyond = none
    for i in range(x.size):
        square = x[i] * x[i]
        fourth += square * square
        # a sum, as compilers keep no running largest of several numbers
        beyond += square if square >= limit else none
    return beyond == none and float(fourth) < 3.0 * x.size + _TAILS * math.sqrt(24.0 * x.size)


@njit(**INNER, fastmath={"reassoc", "contract"})
def _add_lagged_products(x: NDArray[np.float32], count: int, lag: int, products: Array) -> None:
    """Add sums of products of values with those from ``lag`` to nine more on.

    Two values five apart go with the same five others: lags beyond the fifth are those of the earlier one.
    """
    later, earlier = x[5:], x
    a, b, c = x[5 + lag :], x[6 + lag :], x[7 + lag :]
    d, e = x[8 + lag :], x[9 + lag :]
    sum_a = sum_b = sum_c = sum_d = sum_e = np.float32(0.0)
    far_a = far_b = far_c = far_d = far_e = np.float32(0.0)
    for i in range(count):
        near, far = later[i], earlier[i]
        sum_a += near * a[i]
        sum_b += near * b[i]
        sum_c += near * c[i]
        sum_d += near * d[i]
        sum_e += near * e[i]
        far_a += far * a[i]
        far_b += far * b[i]
        far_c += far * c[i]
        far_d += far * d[i]
        far_e += far * e[i]
    for k, total in enumerate((sum_a, sum_b, sum_c, sum_d, sum_e, far_a, far_b, far_c, far_d, far_e)):
        products[lag + k] += total


@njit(**INNER, fastmath={"reassoc", "contract"})
def _surely_without_colour(residual: NDArray[np.float32], block: int, work: NDArray[np.float32]) -> bool:
    """Whether means of ``block`` values are :func:`_surely_uncorrelated`; ``work`` is zero at its ends."""
    if block == 1:
        return True
    means = np.empty(residual.size // block)
    fill_block_means(residual, block, 0.0, means)
    total = square = 0.0
    for i in range(means.size):
        total += means[i]
    mean = total / max(means.size, 1)
    for i in range(means.size):
        square += (means[i] - mean) ** 2
    scale = math.sqrt(means.size / max(square, 1e-300))
    for i in range(means.size):
        work[_BESIDE + i] = (means[i] - mean) * scale
    work[_BESIDE + means.size :] = 0.0
    return _surely_uncorrelated(work, means.size)


@njit(**INNER)
def _surely_uncorrelated(x: NDArray[np.float32], n: int) -> bool:
    """Whether order zero of an autoregression is the most probable, by the Yule-Walker equations.

    Of ``n`` values of unit mean square behind :data:`_BESIDE` zeros and before as many.
    """
    most = most_lags(n)
    covariance = np.zeros(MOST_LAGS + 1)
    first, count = _BESIDE - _LAGS_AT_A_TIME // 2, n + _LAGS_AT_A_TIME // 2
    for lag in range(1, MOST_LAGS + 1, _LAGS_AT_A_TIME):
        for begin in range(0, count, _NEAR):
            _add_lagged_products(x[first + begin :], min(_NEAR, count - begin), lag, covariance)
    coefficients, before = np.zeros(most), np.zeros(most)
    variance = 1.0
    for m in range(1, most + 1):
        reflection = covariance[m] / n
        for k in range(m - 1):
            reflection -= before[k] * covariance[m - 1 - k] / n
        reflection /= variance
        for k in range(m - 1):
            coefficients[k] = before[k] - reflection * before[m - 2 - k]
        coefficients[m - 1] = reflection
        variance *= 1.0 - reflection * reflection
        if not variance > 0.0 or order_cost(n, m, most, variance) < _MARGIN:
            return False
        for k in range(m):
            before[k] = coefficients[k]
    return True


@njit(**INNER)
def _table_for(
    step: float, n: int, row: Array, order: int, forces: ComparedForces, table: ForceTable
) -> ForceTable:
    """The table, or another one where the clock is not that one or the record is longer."""
    if len(table.columns) >= n and abs(step - table.step) * n <= _SAME_CLOCK:
        return table
    return force_table(step, n, row, order, forces)


@njit(**INNER, fastmath={"reassoc", "contract"})
def _leave(  # type: ignore[no-untyped-def]
    y: Array,
    turns: Turns,
    constant: float,
    along: float,
    across: float,
    scale: float,
    out: NDArray[np.float32],
):
    """Fill in the residual of a half cycle, times a scale; its sums of ``rc`` and ``rs`` unscaled."""
    cosine, sine = turns.cosine, turns.sine
    sum_rc = sum_rs = 0.0
    for j in range(y.size):
        r = y[j] - constant - along * cosine[j] + across * sine[j]
        sum_rc += r * cosine[j]
        sum_rs += r * sine[j]
        out[j] = r * scale
    return sum_rc, sum_rs


@njit(**INNER)
def _straight(
    y: Array,
    order: int,
    p: Array,
    kappa: float,
    stop: int,
    scale: float,
    residual: NDArray[np.float32],
) -> bool:
    """Whether the residual of a fit has rather no loss that depends on the amplitude.

    The amplitudes of the half cycles by what is left of each, as in the long form. The residual times a scale
    is filled in.
    """
    # an array of the module is read-only here, for which the tables would be compiled once more
    samples = Samples(y.size, np.empty(0))
    turns = half_cycle_table(samples, p[ADVANCE], p[ADVANCE])
    n, middle = y.size, 0.5 * (y.size - 1)
    half = math.floor((p[PHASE] - p[ADVANCE]) / math.pi)
    total = 2.0 * p[ADVANCE] / math.pi
    matrix, right, square, basis = np.zeros((3, 3)), np.zeros(3), 0.0, np.ones(3)
    lost, count, i = 0.0, 0, 0
    first_k, first_lost = 0.0, 0.0
    while i < n and half < stop:
        end = max(first_at(samples, ((half + 1) * math.pi - p[PHASE]) / p[ADVANCE]), i)
        k = kappa - 2.0 * half - 1.0
        swing = p[AMPLITUDE] + k * p[FRICTION]
        angle = p[PHASE] + p[ADVANCE] * (i - middle) / middle + 0.5 * math.pi * order
        c, s = math.cos(angle), math.sin(angle)
        constant = p[OFFSET]
        if order == 0:
            constant += p[FRICTION] if half % 2 == 0 else -p[FRICTION]
        rc, rs = _leave(y[i:end], turns, constant, swing * c, swing * s, scale, residual[i:end])
        table = turns.sums[end - i]
        rf, ff = c * rc - s * rs, c * c * table[4] - 2.0 * c * s * table[5] + s * s * table[6]
        lost += 0.5 * swing / total
        if ff > 0.0:
            if count == 0:
                first_k, first_lost = k, lost
            basis[1], basis[2] = k, -lost
            add_sample(matrix, right, basis, rf / ff, ff)
            square += rf * rf / ff
            count += 1
        lost += 0.5 * swing / total
        i = end
        half += 1
    if i < n:
        rest = p[OFFSET]
        if order == 0:
            rest += (1.0 if stop % 2 == 0 else -1.0) * (p[AMPLITUDE] + (kappa - 2.0 * stop) * p[FRICTION])
        for j in range(i, n):
            residual[j] = (y[j] - rest) * scale
    if count < _FEWEST:
        return False
    fitted, rest = regression(matrix, right, square)
    if not rest < math.inf:
        return False
    by_friction = (first_k - basis[1]) * (p[FRICTION] + fitted[1])
    sd = max(fitted[2] - by_friction / (basis[2] + first_lost), 0.0)
    basis[0], basis[1], basis[2] = 0.0, 0.0, 1.0
    column, _ = solve_spd(matrix, basis)
    variance = column[2] * rest / (count - 3)
    return _log_odds(fitted[2], variance, sd) < _EVEN - _MARGIN


@njit(**INNER)
def _log_odds(exponent: float, variance: float, whole: float) -> float:
    """Of an exponent found with a variance, to none, where ``whole`` takes all that is lost."""
    odds, none = 0.0, 1.0
    for j in range(len(_SHARES)):
        own = (_SHARES[j] * whole) ** 2
        gain = 0.5 * exponent**2 * own / (variance * (own + variance))
        odds += _PRIOR[j] * math.sqrt(variance / (own + variance)) * math.exp(min(gain, 500.0))
        none -= _PRIOR[j]
    return math.log(odds / none)
