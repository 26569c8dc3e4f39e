"""Gauss-Newton on the whole signal of a Coulomb decay.

Coefficients and ``kappa`` are those of :mod:`friction_bayes.estimators.waveform.normal_equations`.
"""

from __future__ import annotations

import math
from typing import NamedTuple, cast

import numpy as np

from friction_bayes.core.arrays import ZERO, Array
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.linear_least_squares import solve_spd
from friction_bayes.estimators.waveform.coulomb_signal import near_turns, signal_derivatives, signals
from friction_bayes.estimators.waveform.normal_equations import (
    ADVANCE,
    AMPLITUDE,
    COEFFICIENTS,
    FRICTION,
    NEVER,
    PHASE,
    NormalEquations,
    Signal,
    accumulate,
    stopping_turn,
)

__all__ = ["Penalty", "fit_waveform", "leave_out_turns", "start_waveform"]

_REPEATEDLY = cast(bool, np.bool_(False))
"""Of what is not done ``once``: for a literal numba would compile the kernel once more."""
_LINEAR = ZERO + 3
"""The first coefficients, in which the signal is linear once frequency and phase are given."""
_ALL = ZERO + COEFFICIENTS
_MAX_STEPS = 60
_CONVERGED = 1e-10
"""Gauss-Newton stops when a step, in squared standard deviations, is below this."""
_LINEAR_STEP, _LEFT_OVER = 0.05, 1e-7
"""... or, where samples are to be read once, below the first of these with less than the second to follow:
the regression on the signal linearised there takes the step."""
_ROUNDING = 1e-28
"""... or below this share of the signal's sum of squares, for records without noise."""

_MAX_DAMPING = 1e10
_STEPS_WITHOUT = 3
"""Iterations from the optimum of all samples, a few standard deviations off: quadratic convergence."""
_MAX_ROUNDS = 8
_SHIFTS = (-3.0, -1.0, -0.4, 0.4, 1.0, 3.0)
"""Samples by which the turning points of an acceleration are tried elsewhere."""


class Penalty(NamedTuple):
    """Prior of the coefficients, shape (5,) each: ``weight (p - mean)**2``; infinite weight holds one."""

    weight: Array
    mean: Array


@njit(**INNER)
def _blank() -> NormalEquations:
    p, gradient = np.zeros(COEFFICIENTS), np.zeros(COEFFICIENTS)
    return NormalEquations(p, np.zeros((COEFFICIENTS, COEFFICIENTS)), gradient)


@njit(**INNER)
def _keep(at: NormalEquations, trial: NormalEquations) -> None:
    """Take a trial over, by loops: slice assignment costs the compiler seconds."""
    for a in range(COEFFICIENTS):
        at.p[a], at.gradient[a] = trial.p[a], trial.gradient[a]
        for b in range(COEFFICIENTS):
            at.matrix[a, b] = trial.matrix[a, b]


@njit(**KERNEL)
def _step(at: NormalEquations, prior: Penalty, damping: float, size: int) -> tuple[Array, bool]:
    """Levenberg-Marquardt step of the first ``size`` coefficients; infinite weight holds a coefficient."""
    normal = np.zeros((size, size))
    right = np.zeros(size)
    for a in range(size):
        held = prior.weight[a] == math.inf
        for b in range(a):
            if not held and prior.weight[b] != math.inf:
                normal[a, b] = at.matrix[a, b]
        normal[a, a] = 1.0 if held else (at.matrix[a, a] + prior.weight[a]) * (1.0 + damping)
        right[a] = 0.0 if held else at.gradient[a] + prior.weight[a] * (prior.mean[a] - at.p[a])
    return solve_spd(normal, right)


@njit(**INNER)
def _penalty(p: Array, prior: Penalty) -> float:
    total = 0.0
    for a in range(p.size):
        if prior.weight[a] != math.inf and prior.weight[a] > 0.0:
            total += prior.weight[a] * (p[a] - prior.mean[a]) ** 2
    return total


@njit(**INNER)
def _promised_fall(at: NormalEquations, step: Array, prior: Penalty) -> float:
    """Fall of the linearised cost with a step."""
    fall = 0.0
    for a in range(COEFFICIENTS):
        if prior.weight[a] != math.inf:
            fall += step[a] * (at.gradient[a] + prior.weight[a] * (prior.mean[a] - at.p[a]))
    return fall


@njit(**INNER)
def _bend(at: NormalEquations, step: Array, unit: float) -> float:
    """Share of a step, in squared standard deviations, that remains after it.

    The signal bends over the step itself, and noise, of variance ``unit``, turns the phase in which it bends.
    """
    known = math.sqrt(unit / min(at.matrix[ADVANCE, ADVANCE], at.matrix[PHASE, PHASE]))
    return (abs(step[ADVANCE]) + abs(step[PHASE]) + known) ** 2


@njit(**INNER)
def _minimise(
    signal: Signal, squares: float, at: NormalEquations, held: Array, stop: int, prior: Penalty, once: bool
) -> tuple[float, bool]:
    """Gauss-Newton from ``at``, damped where a step does not descend; see :func:`fit_waveform`.

    ``squares`` is the signal's sum of squares. An acceleration jumps where a sample changes its half cycle:
    there the half cycles of ``held`` are kept.
    """
    trial = _blank()
    jumps = signal.order == 2
    misfit = accumulate(signal, at, held if jumps else at.p, stop)
    cost = misfit + _penalty(at.p, prior)
    damping = 0.0
    for _ in range(_MAX_STEPS):
        step, ok = _step(at, prior, damping, _ALL)
        if not ok:
            if damping > _MAX_DAMPING:
                return misfit, False
            damping = max(10.0 * damping, 1e-6)
            continue
        fall = _promised_fall(at, step, prior)
        unit = misfit / signal.y.size
        if fall <= _CONVERGED * unit or fall <= _ROUNDING * squares:
            return misfit, True
        if once and fall <= _LINEAR_STEP * unit and fall * _bend(at, step, unit) <= _LEFT_OVER * unit:
            return misfit, True
        # a quarter turn at most, so that no step leaves the basin of its phase
        scale = min(1.0, 0.8 / max(abs(step[ADVANCE]) + abs(step[PHASE]), 1e-300))
        for a in range(COEFFICIENTS):
            trial.p[a] = at.p[a] + scale * step[a]
        trial_misfit, trial_cost = math.inf, math.inf
        if trial.p[ADVANCE] > 0.0:
            trial_misfit = accumulate(signal, trial, held if jumps else trial.p, stop)
            trial_cost = trial_misfit + _penalty(trial.p, prior)
        if trial_cost <= cost:
            _keep(at, trial)
            misfit, cost = trial_misfit, trial_cost
            damping = 0.0 if damping < 1e-3 else 0.1 * damping
        elif damping < _MAX_DAMPING:
            damping = max(10.0 * damping, 1e-3)
        else:
            return misfit, True
    return misfit, False


@njit(**INNER)
def _settle_jumps(
    signal: Signal, squares: float, at: NormalEquations, stop: int, misfit: float, prior: Penalty
) -> float:
    """Move an acceleration's turning points by a few samples, all alike or at the ends, while that helps.

    Where a jump exceeds the noise, every sample in the wrong half cycle makes a minimum of its own.
    """
    held, trial = np.zeros(COEFFICIENTS), _blank()
    for _ in range(_MAX_ROUNDS):
        before = misfit
        sample = at.p[ADVANCE] / (0.5 * (signal.y.size - 1))
        for which in (PHASE, ADVANCE):
            for shift in _SHIFTS:
                for a in range(COEFFICIENTS):
                    held[a] = trial.p[a] = at.p[a]
                held[which] += shift * sample
                _minimise(signal, squares, trial, held, stop, prior, _REPEATEDLY)
                trial_misfit = accumulate(signal, trial, trial.p, stop)
                if trial_misfit < misfit:
                    _keep(at, trial)
                    misfit = trial_misfit
        if misfit >= before:
            break
    return misfit


@njit(**INNER)
def start_waveform(signal: Signal, at: NormalEquations, prior: Penalty) -> tuple[float, bool]:
    """Offset, amplitude and friction that go with the phase and frequency in ``at.p``, put in there.

    Returns
    -------
    float, bool
        The signal's sum of squares, and whether there are any.
    """
    at.p[AMPLITUDE], at.p[FRICTION] = 0.0, 0.0
    squares = accumulate(signal, at, at.p, NEVER)
    step, ok = _step(at, prior, 0.0, _LINEAR)
    if ok:
        for a in range(_LINEAR):
            at.p[a] += step[a]
    return squares, ok


@njit(**INNER)
def fit_waveform(
    signal: Signal, squares: float, at: NormalEquations, prior: Penalty, rough: bool, once: bool
) -> tuple[float, int, bool]:
    """Minimise squared residuals plus ``weight (p - mean)**2``, from ``at.p``.

    The turning point where the motion ends is held within a minimisation, where the signal is then smooth,
    and is put right between them; so are the half cycles of an acceleration.

    Parameters
    ----------
    signal : Signal
        What is fitted.
    squares : float
        Its sum of squares.
    at : NormalEquations
        Its ``p`` holds what is known, the offset itself if its weight is infinite. Receives the optimum.
    prior : Penalty
        Prior precisions relative to that of a sample (infinite: held) and prior means.
    rough : bool
        Whether that is too rough to determine where the motion ends.
    once : bool
        Whether to stop where the regression on the signal linearised there takes the last step. Not for an
        acceleration, which jumps.

    Returns
    -------
    float, int, bool
        Sum of squared residuals, number of the turning point where the motion ends (:data:`NEVER` for none in
        sight), and whether a minimum was reached.
    """
    trial = _blank()
    stop, misfit, found = NEVER, math.inf, False
    for turn in range(0 if rough else 1, _MAX_ROUNDS):
        proposed = NEVER if turn == 0 else stopping_turn(at.p, signal.kappa)
        if min(proposed, stop) > (at.p[PHASE] + at.p[ADVANCE]) / math.pi:
            proposed = stop
        if found and proposed == stop and signal.order < 2:
            break
        for a in range(COEFFICIENTS):
            trial.p[a] = at.p[a]
        trial_misfit, trial_found = _minimise(signal, squares, trial, at.p, proposed, prior, once)
        if signal.order == 2:
            # in the half cycles that its own phase puts the samples in
            trial_misfit = accumulate(signal, trial, trial.p, proposed)
        if turn > 1 and trial_misfit >= misfit:
            break
        _keep(at, trial)
        misfit, found, stop = trial_misfit, trial_found, proposed
        if not found:
            break
    if signal.order == 2 and found and (2.0 * at.p[FRICTION]) ** 2 > misfit / signal.y.size:
        misfit = _settle_jumps(signal, squares, at, stop, misfit, prior)
    return misfit, stop, found


def leave_out_turns(
    signal: Signal, at: NormalEquations, stop: int, prior: Penalty
) -> tuple[float, int, bool]:
    """Minimise without the samples of an acceleration that may be of either half cycle at a turning point.

    The signal of the other samples is smooth. Where a jump exceeds the noise, each of the ambiguous samples
    would decide for one side and bias frequency and friction. Not compiled: compilation takes two seconds.

    Returns
    -------
    float, int, bool
        Sum of squared residuals, how many samples are left out, and whether a minimum was reached.
    """
    for step_number in range(_STEPS_WITHOUT + 1):
        used = ~near_turns(signal.samples, at.p, stop)
        left_out = signal.y.size - int(np.count_nonzero(used))
        expected = signals(signal.samples, signal.order, at.p[None], signal.kappa, stop)[0]
        residual = (signal.y - expected)[used]
        jacobian = signal_derivatives(signal.samples, signal.order, at.p, signal.kappa, stop)[0][used]
        misfit = float(residual @ residual)
        at.gradient[:] = residual @ jacobian
        at.matrix[:] = np.tril(jacobian.T @ jacobian)
        if step_number == _STEPS_WITHOUT:
            break
        step, ok = _step(at, prior, 0.0, _ALL)
        if not ok:
            return misfit, left_out, False
        at.p[:] += step
    return misfit, left_out, True
