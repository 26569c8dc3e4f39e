"""Half cycles after the release that a force acted on which is gone later: a hand that had not let go yet.

From one period to the next, half a period apart, a free decay loses amplitude by a constant and a part in
proportion to the amplitude, whatever mixture of dry friction and drag damps it over few half cycles; and
it advances in phase by a constant and, on a spring that stiffens or as a pendulum, a part in proportion to
the amplitude squared. Both are fitted to the half cycles after the first few and extrapolated to those. No
law of friction enters, and the scatter of the later half cycles, from whatever it comes, is the yardstick.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INLINED, INNER, njit
from friction_bayes.decay.demodulation import Windows
from friction_bayes.decay.linear_least_squares import add_sample, regression, solve_spd

__all__ = ["disturbed_half_cycles"]

_SOUGHT = 4
"""Steps of half a period from the start that may be disturbed, at most; of few a third."""
_PART = 3
_FEWEST_COMPARED, _MOST_COMPARED = 4, 20
"""Steps after those that they are compared with; the limit of few is far out."""
_FALSE_ALARM = 0.01
"""Probability of a cut, at most, in a record whose steps scatter normally about both fits."""
_LIMITS: Array = np.asarray(
    stats.t.isf(_FALSE_ALARM / (2 * 2 * _SOUGHT), np.maximum(np.arange(_MOST_COMPARED + 1) - 2, 1))
)
"""Of a step over its standard error, by the number that it is compared with."""
_MATTERS = 0.5
"""Share of the amplitude lost in a half cycle below which a step is left: friction moves by some 2 %."""
_FADING = 1
"""Half cycles left out beyond the last step that shows: a force that fades shows too little at its end."""


@njit(**INLINED)
def disturbed_half_cycles(windows: Windows) -> tuple[int, bool]:
    """How many half cycles from the start are to be left out.

    Parameters
    ----------
    windows : Windows
        Those of the moving samples.

    Returns
    -------
    count : int
        Zero where nothing shows, or where too few half cycles follow to compare with.
    goes_on : bool
        Whether the last step that is sought is disturbed too, so that more may be.
    """
    _, inphase, quadrature, _ = windows
    steps = inphase.size - 1
    # the last step may be one into the rest
    sought = min(_SOUGHT, steps // _PART)
    compared = min(_MOST_COMPARED, steps - 1 - sought)
    if compared < _FEWEST_COMPARED:
        return 0, False
    steps = sought + compared
    amplitude, cubed, lost, advanced = np.zeros(steps), np.zeros(steps), np.zeros(steps), np.zeros(steps)
    for k in range(steps):
        along = inphase[k + 1] * inphase[k] + quadrature[k + 1] * quadrature[k]
        across = quadrature[k + 1] * inphase[k] - inphase[k + 1] * quadrature[k]
        before, after = math.hypot(inphase[k], quadrature[k]), math.hypot(inphase[k + 1], quadrature[k + 1])
        amplitude[k] = 0.5 * (before + after)
        cubed[k] = amplitude[k] * amplitude[k] * amplitude[k]
        lost[k] = before - after
        advanced[k] = amplitude[k] * math.atan2(across, along)
    matters = 0.0
    for k in range(sought, sought + compared):
        matters += _MATTERS * lost[k] / compared
    last = max(
        _last_apart(lost, np.ones(steps), amplitude, sought, compared, abs(matters)),
        _last_apart(advanced, amplitude, cubed, sought, compared, abs(matters)),
    )
    return (last + 1 + _FADING, last == sought - 1) if last >= 0 else (0, False)


@njit(**INNER)
def _last_apart(step: Array, one: Array, other: Array, sought: int, compared: int, matters: float) -> int:
    """Last of the first steps that two columns, fitted to those after, miss; -1 for none."""
    matrix, right, square, basis = np.zeros((2, 2)), np.zeros(2), 0.0, np.zeros(2)
    for k in range(sought, sought + compared):
        basis[0], basis[1] = one[k], other[k]
        add_sample(matrix, right, basis, step[k], 1.0)
        square += step[k] ** 2
    law, rest = regression(matrix, right, square)
    if not rest < math.inf:
        return -1
    sd, last = math.sqrt(rest / (compared - 2)), -1
    for k in range(sought):
        basis[0], basis[1] = one[k], other[k]
        spread, _ = solve_spd(matrix, basis)
        limit = _LIMITS[compared] * sd * math.sqrt(1.0 + (basis[0] * spread[0] + basis[1] * spread[1]))
        if abs(step[k] - (law[0] * basis[0] + law[1] * basis[1])) > max(matters, limit):
            last = k
    return last
