"""Phase of a decay as a Chebyshev polynomial of time.

A polynomial is an array of Chebyshev coefficients, shape (k,), over positions from -1 (first sample) to 1
(last). It gives the phase ``chi`` of the *signal*, zero at a positive extremum: ``chi = theta + q pi/2``
with the displacement's phase ``theta`` and the derivative order ``q``.
"""

from __future__ import annotations

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = ["phase_at", "rises", "time_of_phase"]


@njit(**KERNEL)
def phase_at(polynomial: Array, position: float) -> tuple[float, float]:
    """Phase and its derivative at ``position`` in [-1, 1], from Chebyshev coefficients, shape (k,)."""
    value = polynomial[0] + polynomial[1] * position
    slope = polynomial[1]
    before, now = 1.0, position
    slope_before, slope_now = 0.0, 1.0
    for k in range(2, polynomial.size):
        following = 2.0 * position * now - before
        slope_following = 2.0 * now + 2.0 * position * slope_now - slope_before
        before, now = now, following
        slope_before, slope_now = slope_now, slope_following
        value += polynomial[k] * now
        slope += polynomial[k] * slope_now
    return value, slope


@njit(**KERNEL)
def time_of_phase(polynomial: Array, target: float, duration: float) -> float:
    """Time in ``[0, duration]``, or a little outside, at which a rising phase reaches ``target``."""
    start, _ = phase_at(polynomial, -1.0)
    end, _ = phase_at(polynomial, 1.0)
    position = -1.0 + 2.0 * (target - start) / (end - start)
    for _ in range(30):
        value, slope = phase_at(polynomial, position)
        change = (target - value) / slope
        position = min(max(position + change, -1.5), 1.5)
        if abs(change) < 1e-13:
            break
    return 0.5 * (position + 1.0) * duration


@njit(**INNER)
def rises(polynomial: Array) -> bool:
    """Whether the phase rises throughout, by a factor of at most 3 about its mean rate."""
    start, _ = phase_at(polynomial, -1.0)
    end, _ = phase_at(polynomial, 1.0)
    mean = 0.5 * (end - start)
    for i in range(65):
        _, slope = phase_at(polynomial, i / 32.0 - 1.0)
        if not (slope > mean / 3.0 and slope < 3.0 * mean):
            return False
    return mean > 0.0
