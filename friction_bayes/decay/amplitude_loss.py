"""Whether the amplitude of a motion falls at all, as that of a free decay does.

Amplitudes are those of windows of one period, half a period apart. The scatter about a fit, from whatever it
comes, is the yardstick.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, njit
from friction_bayes.decay.demodulation import EVIDENCE, amplitudes, demodulate, largest
from friction_bayes.decay.linear_least_squares import add_sample, regression, solve_spd

__all__ = ["amplitude_falls", "rate_of_dying_away"]

_FEWEST = 6
"""Amplitudes below which nothing is said of their course."""
_MANY = 40
"""Amplitudes, of twenty periods, from which on a free decay shows that it loses some."""
_OVERLAP = 2.0
"""Amplitudes to one that is independent: each window shares its samples with those next to it."""
_LEAST_LOSS = 0.01
"""Least share of the largest amplitude that a free decay loses on record: less may be nothing."""
_CERTAIN = 4.0
"""Standard errors by which a course must be ruled out."""
_NOT_EXCLUDED = 2.0
"""Standard errors within which a loss may be none."""
_SEEN = 4.0
"""Standard deviations of an amplitude above which it is one of the motion, not of noise alone."""
_RATE_KNOWN = 0.02
"""Logarithm of a rate to which it is searched."""


@njit(**INNER)
def _regress(amplitude: Array, design: Array) -> tuple[Array, Array]:
    """Coefficients of a regression of the amplitudes and their standard errors; infinite where singular."""
    count, size = design.shape
    matrix, right, square = np.zeros((size, size)), np.zeros(size), 0.0
    basis = np.zeros(size)
    for k in range(count):
        for j in range(size):
            basis[j] = design[k, j]
        add_sample(matrix, right, basis, amplitude[k], 1.0)
        square += amplitude[k] ** 2
    coefficients, rest = regression(matrix, right, square)
    freedom = max(count / _OVERLAP - size, 1.0)
    errors = np.full(size, math.inf)
    if rest < math.inf:
        for j in range(size):
            for i in range(size):
                basis[i] = 1.0 if i == j else 0.0
            column, _ = solve_spd(matrix, basis)
            errors[j] = math.sqrt(max(column[j], 0.0) * rest / freedom)
    return coefficients, errors


@njit(**INNER)
def amplitude_falls(y: Array, omega: float, after_drive: bool) -> bool:
    """Whether the amplitude may fall, from the first to the last, by a share that shows; true of few periods.

    A steady motion and one that grows are no free decay: something drives them. Of many periods the loss has
    to show itself: without, what moves steadily under noise would be given a friction of next to nothing.
    So it has after a part that was driven, which may have gone on steadily.

    Parameters
    ----------
    y : ndarray, shape (n,)
        The moving samples.
    omega : float
        Rough angular frequency [rad/sample].
    after_drive : bool
        Whether a drive acted before.
    """
    _, inphase, quadrature, _ = demodulate(y, omega)
    amplitude = amplitudes(inphase, quadrature)
    count = amplitude.size
    if count < (2 if after_drive else _FEWEST):
        return True
    design = np.ones((count, 2))
    for k in range(count):
        design[k, 1] = -k / (count - 1)
    line, error = _regress(amplitude, design)
    if count >= _MANY or after_drive:
        return line[1] > _NOT_EXCLUDED * error[1]
    return line[1] + _CERTAIN * error[1] > _LEAST_LOSS * largest(amplitude)


@njit(**INNER)
def rate_of_dying_away(centre: Array, amplitude: Array, noise: float, first: int) -> float:
    """Rate a sample of the exponential, less a constant, on which amplitudes fall; zero where a line will do.

    So they fall under viscous damping in addition to dry friction.

    Parameters
    ----------
    centre, amplitude : ndarray, shape (windows,)
        Of windows half a period apart [samples, unit of the signal].
    noise : float
        Standard deviation of an amplitude.
    first : int
        The first amplitude of the motion; the last is the one before noise.
    """
    last = first
    while last < amplitude.size and amplitude[last] > _SEEN * noise:
        last += 1
    if last - first < 3:
        return 0.0
    time, seen = centre[first:last] - centre[first], amplitude[first:last]
    straight = _misfit(time, seen, 0.0)
    if straight < EVIDENCE * noise * noise:
        return 0.0
    low, high = -math.log(time[-1]), -math.log(time[1])
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    inner, outer = high - golden * (high - low), low + golden * (high - low)
    slow, fast = _misfit(time, seen, math.exp(inner)), _misfit(time, seen, math.exp(outer))
    while high - low > _RATE_KNOWN:
        # of the two places inside, one is a place inside the part that is kept
        if slow < fast:
            high, outer, fast = outer, inner, slow
            inner = high - golden * (high - low)
            slow = _misfit(time, seen, math.exp(inner))
        else:
            low, inner, slow = inner, outer, fast
            outer = low + golden * (high - low)
            fast = _misfit(time, seen, math.exp(outer))
    rate = math.exp(0.5 * (low + high))
    return rate if straight - _misfit(time, seen, rate) > EVIDENCE * noise * noise else 0.0


@njit(**INNER)
def _misfit(time: Array, amplitude: Array, rate: float) -> float:
    """Residual sum of squares of amplitudes that die away toward any constant, or at rate zero on a line."""
    course = course_square = seen = along = square = 0.0
    value, step, kept = 1.0, 0.0, 1.0
    for k in range(time.size):
        if rate > 0.0:
            # windows are whole samples apart, most of them as many as those before
            apart = time[k] - time[max(k - 1, 0)]
            if apart != step:
                step, kept = apart, math.exp(-rate * apart)
            value *= kept
        else:
            value = -time[k]
        course, course_square = course + value, course_square + value * value
        seen, along, square = seen + amplitude[k], along + value * amplitude[k], square + amplitude[k] ** 2
    matrix, right = np.empty((2, 2)), np.empty(2)
    matrix[0, 0], matrix[1, 0], matrix[1, 1] = float(time.size), course, course_square
    right[0], right[1] = seen, along
    return regression(matrix, right, square)[1]
