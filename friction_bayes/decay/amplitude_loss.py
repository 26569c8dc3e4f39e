"""Whether the amplitude of a motion falls at all, as that of a free decay does.

Amplitudes are those of windows of one period, half a period apart. The scatter about a fit, from whatever it
comes, is the yardstick.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER
from friction_bayes.decay.demodulation import amplitudes, demodulate, largest
from friction_bayes.decay.linear_least_squares import add_sample, regression, solve_spd

__all__ = ["amplitude_falls"]

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
