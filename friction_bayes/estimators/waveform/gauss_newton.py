"""Gauss-Newton on the whole signal of a Coulomb decay.

Coefficients and ``kappa`` are those of :mod:`friction_bayes.estimators.waveform.normal_equations`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.decay.linear_least_squares import solve_spd
from friction_bayes.estimators.waveform.normal_equations import COEFFICIENTS, NEVER, accumulate, stopping_turn

__all__ = ["fit_waveform"]

_MAX_STEPS = 60
_CONVERGED = 1e-10
"""Gauss-Newton stops when a step, in squared standard deviations, is below this."""
_ROUNDING = 1e-28
"""... or below this share of the signal's sum of squares, for records without noise."""

_MAX_DAMPING = 1e10
_MAX_ROUNDS = 8


@njit(cache=True, nogil=True)
def _solve_step(
    matrix: Array, gradient: Array, weight: Array, misfit: Array, damping: float, size: int
) -> tuple[Array, bool]:
    """Levenberg-Marquardt step of the first ``size`` coefficients; infinite weight holds a coefficient."""
    normal = np.zeros((size, size))
    right = np.zeros(size)
    for a in range(size):
        held_a = weight[a] == math.inf
        for b in range(a):
            if not held_a and weight[b] != math.inf:
                normal[a, b] = matrix[a, b]
        normal[a, a] = 1.0 if held_a else (matrix[a, a] + weight[a]) * (1.0 + damping)
        right[a] = 0.0 if held_a else gradient[a] + weight[a] * misfit[a]
    return solve_spd(normal, right)


@njit(cache=True, nogil=True)
def _penalty(p: Array, weight: Array, mean: Array) -> float:
    total = 0.0
    for a in range(p.size):
        if weight[a] != math.inf and weight[a] > 0.0:
            total += weight[a] * (p[a] - mean[a]) ** 2
    return total


@njit(cache=True, nogil=True)
def _keep(
    p: Array, matrix: Array, gradient: Array, trial: Array, trial_matrix: Array, trial_gradient: Array
) -> None:
    """Take a trial over, by loops: slice assignment costs the compiler seconds."""
    for a in range(COEFFICIENTS):
        p[a], gradient[a] = trial[a], trial_gradient[a]
        for b in range(COEFFICIENTS):
            matrix[a, b] = trial_matrix[a, b]


@njit(cache=True, nogil=True)
def _minimise(
    y: Array,
    order: int,
    p: Array,
    held: Array,
    kappa: float,
    stop: int,
    weight: Array,
    mean: Array,
    matrix: Array,
    gradient: Array,
) -> tuple[float, bool]:
    """Gauss-Newton, damped where a step does not descend; see :func:`fit_waveform`.

    An acceleration jumps where a sample changes its half cycle: there the half cycles of ``held`` are kept.
    """
    trial, trial_gradient = np.zeros(COEFFICIENTS), np.zeros(COEFFICIENTS)
    trial_matrix = np.zeros((COEFFICIENTS, COEFFICIENTS))
    missing = np.zeros(COEFFICIENTS)
    signal = 0.0
    for i in range(y.size):
        signal += y[i] * y[i]
    jumps = order == 2
    misfit = accumulate(y, order, p, held if jumps else p, kappa, stop, matrix, gradient)
    cost = misfit + _penalty(p, weight, mean)
    damping = 0.0
    for _ in range(_MAX_STEPS):
        for a in range(COEFFICIENTS):
            missing[a] = mean[a] - p[a]
        step, ok = _solve_step(matrix, gradient, weight, missing, damping, COEFFICIENTS)
        if not ok:
            if damping > _MAX_DAMPING:
                return misfit, False
            damping = max(10.0 * damping, 1e-6)
            continue
        fall = 0.0
        for a in range(COEFFICIENTS):
            if weight[a] != math.inf:
                fall += step[a] * (gradient[a] + weight[a] * (mean[a] - p[a]))
        if fall <= _CONVERGED * misfit / y.size or fall <= _ROUNDING * signal:
            return misfit, True
        # a quarter turn at most, so that no step leaves the basin of its phase
        scale = min(1.0, 0.8 / max(abs(step[3]) + abs(step[4]), 1e-300))
        for a in range(COEFFICIENTS):
            trial[a] = p[a] + scale * step[a]
        trial_cost = math.inf
        if trial[3] > 0.0:
            trial_misfit = accumulate(
                y, order, trial, held if jumps else trial, kappa, stop, trial_matrix, trial_gradient
            )
            trial_cost = trial_misfit + _penalty(trial, weight, mean)
        if trial_cost <= cost:
            _keep(p, matrix, gradient, trial, trial_matrix, trial_gradient)
            misfit, cost = trial_misfit, trial_cost
            damping = 0.0 if damping < 1e-3 else 0.1 * damping
        elif damping < _MAX_DAMPING:
            damping = max(10.0 * damping, 1e-3)
        else:
            return misfit, True
    return misfit, False


@njit(cache=True, nogil=True)
def _settle_jumps(
    y: Array,
    p: Array,
    kappa: float,
    stop: int,
    misfit: float,
    weight: Array,
    mean: Array,
    matrix: Array,
    gradient: Array,
) -> float:
    """Move an acceleration's turning points by a few samples, all alike or at the ends, while that helps.

    Where a jump stands out of the noise, every sample in the wrong half cycle makes a minimum of its own.
    """
    held, trial, trial_gradient = np.zeros(COEFFICIENTS), np.zeros(COEFFICIENTS), np.zeros(COEFFICIENTS)
    trial_matrix = np.zeros((COEFFICIENTS, COEFFICIENTS))
    for _ in range(_MAX_ROUNDS):
        before = misfit
        sample = p[3] / (0.5 * (y.size - 1))
        for which in (4, 3):
            for shift in (-3.0, -1.0, -0.4, 0.4, 1.0, 3.0):
                for a in range(COEFFICIENTS):
                    held[a] = trial[a] = p[a]
                held[which] += shift * sample
                _minimise(y, 2, trial, held, kappa, stop, weight, mean, trial_matrix, trial_gradient)
                trial_misfit = accumulate(y, 2, trial, trial, kappa, stop, trial_matrix, trial_gradient)
                if trial_misfit < misfit:
                    _keep(p, matrix, gradient, trial, trial_matrix, trial_gradient)
                    misfit = trial_misfit
        if misfit >= before:
            break
    return misfit


@njit(cache=True, nogil=True)
def fit_waveform(
    y: Array, order: int, p: Array, kappa: float, weight: Array, mean: Array, matrix: Array, gradient: Array
) -> tuple[float, int, bool]:
    """Minimise squared residuals plus ``weight (p - mean)**2``, from phase and frequency in ``p``.

    The turning point where the motion ends is held within a minimisation, where the signal is then smooth,
    and is put right between them; so are the half cycles of an acceleration.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Moving samples, less a constant near their rest position.
    order : int
        Derivative order of the signal.
    p : ndarray, shape (5,)
        ``p[3]``, ``p[4]`` hold the rough phase; ``p[0]`` the offset if its weight is infinite. Overwritten.
    kappa : float
        See the module.
    weight, mean : ndarray, shape (5,)
        Prior precisions relative to that of a sample (infinite: held) and prior means.
    matrix, gradient : ndarray, shapes (5, 5) and (5,)
        Receive ``J'J`` (lower triangle) and ``J'r`` at the optimum.

    Returns
    -------
    float, int, bool
        Sum of squared residuals, number of the turning point where the motion ends (:data:`NEVER` for none in
        sight), and whether a minimum was reached.
    """
    trial, trial_gradient = np.zeros(COEFFICIENTS), np.zeros(COEFFICIENTS)
    trial_matrix = np.zeros((COEFFICIENTS, COEFFICIENTS))
    missing = np.zeros(COEFFICIENTS)
    p[1], p[2] = 0.0, 0.0
    for a in range(3):
        missing[a] = mean[a] - p[a]
    accumulate(y, order, p, p, kappa, NEVER, matrix, gradient)
    step, ok = _solve_step(matrix, gradient, weight, missing, 0.0, 3)
    if not ok:
        return math.inf, NEVER, False
    for a in range(3):
        p[a] += step[a]
    stop, misfit, found = NEVER, math.inf, False
    for turn in range(_MAX_ROUNDS):
        proposed = NEVER if turn == 0 else stopping_turn(p, kappa)
        if min(proposed, stop) > (p[4] + p[3]) / math.pi:
            proposed = stop
        if turn > 0 and proposed == stop and order < 2:
            break
        for a in range(COEFFICIENTS):
            trial[a] = p[a]
        _, trial_found = _minimise(
            y, order, trial, p, kappa, proposed, weight, mean, trial_matrix, trial_gradient
        )
        trial_misfit = accumulate(y, order, trial, trial, kappa, proposed, trial_matrix, trial_gradient)
        if turn > 1 and trial_misfit >= misfit:
            break
        _keep(p, matrix, gradient, trial, trial_matrix, trial_gradient)
        misfit, found, stop = trial_misfit, trial_found, proposed
        if not found:
            break
    if order == 2 and found and (2.0 * p[2]) ** 2 > misfit / y.size:
        misfit = _settle_jumps(y, p, kappa, stop, misfit, weight, mean, matrix, gradient)
    return misfit, stop, found
