r"""Squared residuals of a Coulomb decay and their derivatives, in one streaming pass over the samples.

Coefficients, in this order: offset ``c``; amplitude ``b`` in the middle of the record; friction coefficient
``u``; phase advance ``W`` over half the record; phase ``p`` in the middle. With ``s`` from -1 to 1 over the
record, ``theta = W s + p``, ``n = floor(theta/pi)`` and ``k = kappa - 2 n - 1`` the signal is

.. math:: c + (b + k u) f(\theta) + e_n u, \qquad f = \cos, -\sin, -\cos, \quad e_n = (-1)^n, 0, 0

for displacement, velocity and acceleration, until the turning point where the motion sticks; there it stays.
``kappa`` is a constant near the middle's ``2 n + 1``, so that the columns are well conditioned; the amplitude
at ``theta = 0`` is ``a = b + kappa u``.
"""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array

__all__ = ["COEFFICIENTS", "NEVER", "accumulate", "stopping_turn"]

COEFFICIENTS = 5

NEVER = 1 << 40
"""Number of a turning point that no record reaches."""


@njit(cache=True, nogil=True)
def stopping_turn(p: Array, kappa: float) -> int:
    """Number of the turning point where the motion ends: the first with ``|a - 2 n u| <= u``."""
    first = math.floor((p[4] - p[3]) / math.pi)
    a = p[1] + kappa * p[2]
    if p[2] <= 0.0 or a - p[2] > 2.0 * NEVER * p[2]:
        return NEVER
    return max(math.ceil((a - p[2]) / (2.0 * p[2])), first + 1)


@njit(cache=True, nogil=True)
def accumulate(
    y: Array, order: int, p: Array, held: Array, kappa: float, stop: int, matrix: Array, gradient: Array
) -> float:
    """Sum of squared residuals, and ``J'J`` (lower triangle) and ``J'r`` in place.

    Samples lie in the half cycles that the phase of ``held`` puts them in, which may be ``p`` itself.
    Within a half cycle every column is a combination of 1, ``f``, ``f'`` and ``s f'``: fifteen sums suffice.
    """
    n = y.size
    middle = 0.5 * (n - 1)
    rate = p[3] / middle
    for a in range(COEFFICIENTS):
        gradient[a] = 0.0
        for b in range(COEFFICIENTS):
            matrix[a, b] = 0.0
    total = 0.0
    half = math.floor((held[4] - held[3]) / math.pi)
    i = 0
    turn_cos, turn_sin = math.cos(rate), math.sin(rate)
    while i < n and half < stop:
        end = min(max(math.ceil(middle * (1.0 + ((half + 1) * math.pi - held[4]) / held[3])), i), n)
        k = kappa - 2.0 * half - 1.0
        swing = p[1] + k * p[2]
        e = 0.0
        if order == 0:
            e = 1.0 if half % 2 == 0 else -1.0
        constant = p[0] + e * p[2]
        angle = p[4] + rate * (i - middle) + 0.5 * math.pi * order
        f, g = math.cos(angle), -math.sin(angle)
        count = end - i
        sf = sg = sff = sfg = sgg = tg = tfg = tgg = ttgg = 0.0
        r1 = rf = rg = rtg = rr = 0.0
        for j in range(i, end):
            s = (j - middle) / middle
            r = y[j] - constant - swing * f
            sgj = s * g
            sf += f
            sg += g
            sff += f * f
            sfg += f * g
            sgg += g * g
            tg += sgj
            tfg += sgj * f
            tgg += sgj * g
            ttgg += sgj * sgj
            r1 += r
            rf += r * f
            rg += r * g
            rtg += r * sgj
            rr += r * r
            f, g = f * turn_cos + g * turn_sin, g * turn_cos - f * turn_sin
        matrix[0, 0] += count
        matrix[1, 0] += sf
        matrix[1, 1] += sff
        matrix[2, 0] += e * count + k * sf
        matrix[2, 1] += e * sf + k * sff
        matrix[2, 2] += e * e * count + 2.0 * e * k * sf + k * k * sff
        matrix[3, 0] += swing * tg
        matrix[3, 1] += swing * tfg
        matrix[3, 2] += swing * (e * tg + k * tfg)
        matrix[3, 3] += swing * swing * ttgg
        matrix[4, 0] += swing * sg
        matrix[4, 1] += swing * sfg
        matrix[4, 2] += swing * (e * sg + k * sfg)
        matrix[4, 3] += swing * swing * tgg
        matrix[4, 4] += swing * swing * sgg
        gradient[0] += r1
        gradient[1] += rf
        gradient[2] += e * r1 + k * rf
        gradient[3] += swing * rtg
        gradient[4] += swing * rg
        total += rr
        i = end
        half += 1
    if i < n:
        e = 0.0
        if order == 0:
            e = 1.0 if stop % 2 == 0 else -1.0
        k = e * (kappa - 2.0 * stop)
        rest = p[0] + e * p[1] + k * p[2]
        count = n - i
        r1 = 0.0
        for j in range(i, n):
            r = y[j] - rest
            r1 += r
            total += r * r
        matrix[0, 0] += count
        matrix[1, 0] += e * count
        matrix[1, 1] += e * e * count
        matrix[2, 0] += k * count
        matrix[2, 1] += e * k * count
        matrix[2, 2] += k * k * count
        gradient[0] += r1
        gradient[1] += e * r1
        gradient[2] += k * r1
    return total
