"""Periods at the start of a record in which something still drove the motion and no amplitude was lost.

From one period to the next a free decay loses amplitude by a constant and a part in proportion to the
amplitude. That law from the first period on is compared, by evidence, with the same law from a later period
on and, before it, a smooth course of the amplitude that owes nothing to it: a motion that a drive builds
up, keeps up or beats with. Each course has a scatter of its own, from whatever it comes, of which the noise
of the samples is the prior idea, so that few periods are enough; the period in which the drive ends follows
neither. A course counts as driven only where its first half goes without a loss.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INLINED, INNER, njit
from friction_bayes.decay.demodulation import Windows, fill_moments, fill_turns, largest
from friction_bayes.decay.linear_least_squares import add_sample, regression

__all__ = ["driven_half_cycles"]

_FEWEST_DRIVEN = 2
"""Periods: one in which the drive ends and one before."""
_DRIVEN = 0.001
"""Share of records that begin under a drive, before any is seen; all places at which it may end are alike."""
_SURELY_FREE = 0.95
"""Probability that the drive has ended by the place of the cut."""
_NO_LOSS = 2.0
"""Standard errors within which a loss counts as zero."""
_NOISE_FREEDOM = 2.0
"""Degrees of freedom that the noise of the samples counts for in a scatter."""
_STEEPEST = 2.0
"""Prior standard deviation of the part in proportion to the amplitude, over the mean loss; by drag 1 or 2."""
_ROUNDING = 1e-13
"""Share of a sum of squares that rounding leaves of samples which a regression fits to the last digit."""
_STOPPED = 2
"""Last amplitudes without which a drive shows too: a hand stops a mass within so many periods."""
_COURSE = 3
"""Coefficients of the change of amplitude under a drive, in powers of time, at most."""


@njit(**INNER)
def driven_half_cycles(y: Array, omega: float, windows: Windows) -> int:
    """How many half cycles from the start are to be left out; zero where nothing shows.

    Parameters
    ----------
    y : ndarray, shape (n,)
        The moving samples about their rest position.
    omega : float
        Rough angular frequency [rad/sample].
    windows : Windows
        The samples demodulated at it.
    """
    amplitude, noise = _amplitudes(y, omega, windows)
    driven = _driven(amplitude, noise)
    # what stops the mass at the end makes all before lose next to nothing
    if (
        driven == 0
        or _driven(amplitude[:-_STOPPED], noise) > 0
        or not _loses(amplitude[: driven // 2], noise)
    ):
        return driven
    return 0


@njit(**INLINED)
def _loses(amplitude: Array, noise: float) -> bool:
    """Whether amplitudes fall, for what their steps scatter by."""
    steps = amplitude.size - 1
    if steps < 1:
        return False
    lost = (amplitude[0] - amplitude[steps]) / steps
    square = 2.0 * noise * noise * _NOISE_FREEDOM
    for k in range(steps):
        square += (amplitude[k] - amplitude[k + 1] - lost) ** 2
    return lost > _NO_LOSS * math.sqrt(square / (steps - 1 + _NOISE_FREEDOM) / steps)


@njit(**INNER)
def _driven(amplitude: Array, noise: float) -> int:
    """The same from amplitudes a period apart, and their noise."""
    steps = amplitude.size - 1
    places = steps - _FEWEST_DRIVEN
    if places < 1:
        return 0
    lost, most, least = np.zeros(steps), -math.inf, math.inf
    for k in range(steps):
        lost[k] = amplitude[k] - amplitude[k + 1]
        most, least = max(most, lost[k]), min(least, lost[k])
    most_swing = largest(amplitude)
    variance = max(2.0 * noise * noise, 1e-24 * most_swing**2)
    if not _may_begin_without_loss(amplitude, lost, variance):
        return 0
    # a step of the period in which the drive ends lies anywhere between the others
    anywhere = -math.log(max(most - least, 1e-12 * most_swing))
    before = _courses(lost, variance)
    log_odds = np.full(steps, -math.inf)
    matrix, right, square, basis = np.zeros((2, 2)), np.zeros(2), 0.0, np.ones(2)
    free = -math.inf
    for k in range(steps - 1, -1, -1):
        basis[1] = 0.5 * (amplitude[k] + amplitude[k + 1]) / amplitude[0] - 1.0
        add_sample(matrix, right, basis, lost[k], 1.0)
        square += lost[k] * lost[k]
        count = steps - k
        later = (amplitude[k] - amplitude[steps]) / count
        ridge = variance / max(_STEEPEST * later, 1e-12 * amplitude[0]) ** 2
        known = matrix.copy()
        known[1, 1] += ridge
        _, rest = regression(known, right, square)
        if not rest < math.inf:
            continue
        about_mean = matrix[1, 1] - matrix[1, 0] ** 2 / matrix[0, 0]
        free = _evidence(count, 1, rest, variance) - 0.5 * math.log(1.0 + about_mean / ridge)
        sd = math.sqrt((rest + _NOISE_FREEDOM * variance) / (count - 2 + _NOISE_FREEDOM))
        if k >= _FEWEST_DRIVEN and _begins_without_loss(amplitude, k, sd, later):
            log_odds[k] = free + before[k - 2] + 2.0 * anywhere
    # ``free`` is now that of the law from the first period on
    prior = math.log(_DRIVEN / (1.0 - _DRIVEN) / places)
    for k in range(steps):
        log_odds[k] = log_odds[k] + prior - free
    return 2 * _cut(log_odds)


@njit(**INLINED)
def _amplitudes(y: Array, omega: float, windows: Windows) -> tuple[Array, float]:
    """Amplitudes in windows of one period that share no samples, each at its own frequency, and their noise.

    That of a motion under a drive is the drive's, and a window of one period at another frequency gives an
    amplitude that depends on the phase.
    """
    centre, inphase, quadrature, _ = windows
    length, last = 2.0 * math.pi / omega, centre.size - 1
    amplitude = np.zeros(last // 2 + 1)
    log_noise, scattered = 0.0, 0
    matrix, right = np.zeros((3, 3)), np.zeros(3)
    cosine, sine = np.empty(int(length) + 2), np.empty(int(length) + 2)
    for k in range(amplitude.size):
        a, b = max(2 * k - 1, 0), min(2 * k + 1, last)
        along = inphase[b] * inphase[a] + quadrature[b] * quadrature[a]
        across = quadrature[b] * inphase[a] - inphase[b] * quadrature[a]
        rate = omega + (math.atan2(across, along) / (centre[b] - centre[a]) if b > a else 0.0)
        begin = max(math.ceil(centre[2 * k] - 0.5 * length), 0)
        end = min(math.floor(centre[2 * k] + 0.5 * length) + 1, y.size)
        c, s = cosine[: end - begin], sine[: end - begin]
        fill_turns(rate * (begin - centre[2 * k]), rate, c, s)
        square = fill_moments(y[begin:end], c, s, matrix, right)
        x, rest = regression(matrix, right, square)
        if rest < math.inf:
            amplitude[k] = math.hypot(x[1], x[2])
            variance = 2.0 * rest / max(end - begin - 3, 1) / (end - begin)
            # the mean of logarithms, as one window may hold more than noise; without those whose samples are
            # all alike, of which rounding leaves zero or not by chance
            if rest > _ROUNDING * square:
                log_noise += 0.5 * math.log(variance)
                scattered += 1
    return amplitude, math.exp(log_noise / scattered) if scattered > 0 else 0.0


@njit(**INNER)
def _evidence(count: int, coefficients: int, rest: float, variance: float) -> float:
    """Logarithm of the density of responses about a regression, its scatter integrated out.

    ``coefficients`` have a prior as wide as one response determines; ``rest`` contains the penalty of others.
    """
    freedom = count + _NOISE_FREEDOM
    prior = _NOISE_FREEDOM * variance
    return (
        math.lgamma(0.5 * freedom)
        - math.lgamma(0.5 * _NOISE_FREEDOM)
        + 0.5 * _NOISE_FREEDOM * math.log(prior)
        - 0.5 * freedom * math.log(prior + rest)
        - 0.5 * count * math.log(math.pi)
        - 0.5 * coefficients * math.log(count + 1.0)
    )


@njit(**INLINED)
def _courses(lost: Array, variance: float) -> Array:
    """Evidence of the first steps, by their number, as a polynomial in time: the mean over its degrees."""
    out = np.zeros(lost.size)
    matrix, right, square = np.zeros((_COURSE, _COURSE)), np.zeros(_COURSE), 0.0
    basis = np.ones(_COURSE)
    for k in range(lost.size - 1):
        for power in range(1, _COURSE):
            basis[power] = basis[power - 1] * k / lost.size
        add_sample(matrix, right, basis, lost[k], 1.0)
        square += lost[k] * lost[k]
        total = -math.inf
        for size in range(1, min(_COURSE, k + 1) + 1):
            _, rest = regression(matrix[:size, :size].copy(), right[:size].copy(), square)
            if rest < math.inf:
                total = np.logaddexp(total, _evidence(k + 1, size, rest, variance))
        out[k + 1] = total - math.log(_COURSE)
    return out


@njit(**INLINED)
def _may_begin_without_loss(amplitude: Array, lost: Array, variance: float) -> bool:
    """Whether :func:`_begins_without_loss` may hold anywhere: a law scatters no more than about the mean."""
    steps, total, square = lost.size, 0.0, 0.0
    for k in range(steps - 1, _FEWEST_DRIVEN - 1, -1):
        total += lost[k]
        square += lost[k] * lost[k]
        count = steps - k
        about_mean = max(square - total * total / count, 0.0) + 1e-9 * square
        sd = math.sqrt((about_mean + _NOISE_FREEDOM * variance) / (count - 2 + _NOISE_FREEDOM))
        if _begins_without_loss(amplitude, k, sd, (amplitude[k] - amplitude[steps]) / count):
            return True
    return False


@njit(**INNER)
def _begins_without_loss(amplitude: Array, end: int, sd: float, later: float) -> bool:
    """Whether no amplitude is lost over the first steps, nor over half of all up to ``end``.

    Under a drive it may fall later, where the motion beats with it.
    """
    for j in (_FEWEST_DRIVEN, max(end // 2, _FEWEST_DRIVEN)):
        before = (amplitude[0] - amplitude[j]) / j
        if before >= later or before > _NO_LOSS * sd / math.sqrt(j):
            return False
    return True


@njit(**INLINED)
def _cut(log_odds: Array) -> int:
    """First place by which a drive has surely ended; 0 where that there was one is less probable than not."""
    best = largest(log_odds)
    if not best > -math.inf:
        return 0
    total = 0.0
    for k in range(log_odds.size):
        total += math.exp(log_odds[k] - best)
    if not best + math.log(total) > 0.0:
        return 0
    reached, k = 0.0, -1
    while reached < _SURELY_FREE * total:
        k += 1
        reached += math.exp(log_odds[k] - best)
    return k
