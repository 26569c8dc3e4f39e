r"""Normal equations of a Coulomb decay: squared residuals, ``J'J`` and ``J'r``, in one pass over the samples.

Coefficients, in this order: offset ``c``; amplitude ``b`` in the middle of the record; friction coefficient
``u``; phase advance ``W`` over half the record; phase ``p`` in the middle. With ``s`` from -1 to 1 over the
record, ``theta = W s + p``, ``n = floor(theta/pi)`` and ``k = kappa - 2 n - 1`` the signal is

.. math:: c + (b + k u) f(\theta) + e_n u, \qquad f = \cos, -\sin, -\cos, \quad e_n = (-1)^n, 0, 0

for displacement, velocity and acceleration, until the turning point where the motion sticks; there it stays.
``kappa`` is a constant near the middle's ``2 n + 1``, so that the columns are well conditioned; the amplitude
at ``theta = 0`` is ``a = b + kappa u``.

Within a half cycle ``k``, ``e`` and the swing ``w = b + k u`` are constants. With ``g = df/dtheta`` and
``h = s g`` the derivatives by the five coefficients are

.. math:: J = (1,\; f,\; e + k f,\; w h,\; w g),

so that every entry of ``J'J`` and ``J'r`` is a combination, by these constants, of sums over the half cycle
of products of (1, ``f``, ``g``, ``h``) with one another and with the residual: fourteen sums and the count.
Where samples are evenly spaced they need no sine or cosine each: one table of a half cycle, turned by the
phase of its first sample, serves all of them, and only the sums with the residual read the samples.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import ZERO, Array
from friction_bayes.core.kernels import INLINED, INNER, KERNEL, njit
from friction_bayes.decay.demodulation import fill_turns

__all__ = [
    "ADVANCE",
    "AMPLITUDE",
    "COEFFICIENTS",
    "EVENLY",
    "FRICTION",
    "NEVER",
    "OFFSET",
    "PHASE",
    "NormalEquations",
    "Samples",
    "Signal",
    "Turns",
    "accumulate",
    "even_sums",
    "first_at",
    "half_cycle_table",
    "place",
    "stopping_turn",
]

OFFSET, AMPLITUDE, FRICTION, ADVANCE, PHASE = range(5)
"""Places of the coefficients."""
COEFFICIENTS = 5

NEVER = ZERO + (1 << 40)
"""Number of a turning point that no record reaches."""


EVENLY: Array = np.empty(0)
"""The places of samples that are evenly spaced, which need none."""


class Samples(NamedTuple):
    """Where the samples of a record lie between its ends, at ``s = -1`` and 1.

    Attributes
    ----------
    size : int
        How many there are.
    places : ndarray, shape (size,) or (0,)
        Place ``s`` of each; none where they are evenly spaced.
    """

    size: int
    places: Array


@njit(**INNER)
def place(samples: Samples, i: int) -> float:
    """Place of sample ``i``."""
    if samples.places.size > 0:
        return samples.places[i]
    middle = 0.5 * (samples.size - 1)
    return (i - middle) / middle


@njit(**INNER)
def first_at(samples: Samples, s: float) -> int:
    """First sample that lies at ``s`` or behind it, from 0 to ``samples.size``."""
    if samples.places.size > 0:
        low, high = 0, samples.places.size
        while low < high:
            middle = (low + high) // 2
            if samples.places[middle] >= s:
                high = middle
            else:
                low = middle + 1
        return low
    return min(max(math.ceil(0.5 * (samples.size - 1) * (1.0 + s)), 0), samples.size)


class Signal(NamedTuple):
    """What is fitted: moving samples, derivative order, and ``kappa``."""

    y: Array
    samples: Samples
    order: int
    kappa: float


class NormalEquations(NamedTuple):
    """Coefficients ``p``, shape (5,), with ``J'J`` (lower triangle) and ``J'r`` there; all overwritten."""

    p: Array
    matrix: Array
    gradient: Array


class _Sums(NamedTuple):
    """Sums over the samples of one half cycle; ``fg`` is that of ``f g``, ``r`` the residual."""

    ones: int
    f: float
    g: float
    h: float
    ff: float
    fg: float
    gg: float
    fh: float
    gh: float
    hh: float
    r: float
    rf: float
    rg: float
    rh: float
    rr: float


@njit(**INNER)
def stopping_turn(p: Array, kappa: float) -> int:
    """Number of the turning point where the motion ends: the first with ``|a - 2 n u| <= u``."""
    first = math.floor((p[PHASE] - p[ADVANCE]) / math.pi)
    a = p[AMPLITUDE] + kappa * p[FRICTION]
    if p[FRICTION] <= 0.0 or a - p[FRICTION] > 2.0 * NEVER * p[FRICTION]:
        return NEVER
    return max(math.ceil((a - p[FRICTION]) / (2.0 * p[FRICTION])), first + 1)


@njit(**KERNEL)
def accumulate(signal: Signal, at: NormalEquations, held: Array, stop: int) -> float:
    """Sum of squared residuals at ``at.p``, and the normal equations there in place.

    Samples lie in the half cycles that the phase of ``held`` puts them in, which may be ``at.p`` itself.
    """
    y, samples, order, kappa = signal
    p, matrix, gradient = at
    for a in range(COEFFICIENTS):
        gradient[a] = 0.0
        for b in range(COEFFICIENTS):
            matrix[a, b] = 0.0
    total = 0.0
    half = math.floor((held[PHASE] - held[ADVANCE]) / math.pi)
    i, n = ZERO, y.size
    turns = half_cycle_table(samples, p[ADVANCE], held[ADVANCE])
    while i < n and half < stop:
        end = max(first_at(samples, ((half + 1) * math.pi - held[PHASE]) / held[ADVANCE]), i)
        k = kappa - 2.0 * half - 1.0
        swing = p[AMPLITUDE] + k * p[FRICTION]
        e = 0.0
        if order == 0:
            e = 1.0 if half % 2 == 0 else -1.0
        constant = p[OFFSET] + e * p[FRICTION]
        if samples.places.size == 0:
            sums = even_sums(y[i:end], turns, i, 0.5 * (n - 1), order, p, constant, swing)
        else:
            sums = _uneven_sums(y, samples, i, end, order, p, constant, swing)
        _add_half_cycle(matrix, gradient, sums, k, e, swing)
        total += sums.rr
        i = end
        half += 1
    if i < n:
        total = _add_rest(signal, at, stop, i, total)
    return total


class Turns(NamedTuple):
    """Cosines and sines of the first multiples of an angle, and their sums, which all half cycles share.

    Attributes
    ----------
    cosine, sine : ndarray, shape (m,)
    sums : ndarray, shape (m + 1, 13)
        Of the first ``j`` of ``c, s, jc, js, cc, cs, ss, jcc, jcs, jss, jjcc, jjcs, jjss``.
    """

    cosine: Array
    sine: Array
    sums: Array


@njit(**INNER)
def half_cycle_table(samples: Samples, advance: float, held: float) -> Turns:
    """Table of one half cycle of evenly spaced samples, empty where they are not.

    Parameters
    ----------
    samples : Samples
    advance : float
        Phase over half the record.
    held : float
        The same of the half cycles that samples are put in.
    """
    if samples.places.size > 0:
        return Turns(np.zeros(0), np.zeros(0), np.zeros((0, 13)))
    n, middle = samples.size, 0.5 * (samples.size - 1)
    angle = advance / middle
    # one more than a half cycle has, for rounding
    count = min(int(min(math.pi * middle / held, float(n))) + 2, n)
    cosine, sine, sums = np.empty(count), np.empty(count), np.zeros((count + 1, 13))
    fill_turns(0.0, angle, cosine, sine)
    for j in range(count):
        c, s, before, after = cosine[j], sine[j], sums[j], sums[j + 1]
        cc, cs, ss = c * c, c * s, s * s
        after[0], after[1] = before[0] + c, before[1] + s
        after[2], after[3] = before[2] + j * c, before[3] + j * s
        after[4], after[5], after[6] = before[4] + cc, before[5] + cs, before[6] + ss
        after[7], after[8], after[9] = before[7] + j * cc, before[8] + j * cs, before[9] + j * ss
        after[10], after[11] = before[10] + j * j * cc, before[11] + j * j * cs
        after[12] = before[12] + j * j * ss
    return Turns(cosine, sine, sums)


@njit(**INLINED)
def even_sums(
    y: Array, turns: Turns, start: int, middle: float, order: int, p: Array, constant: float, swing: float
) -> _Sums:
    """Sums over the samples ``y`` of one half cycle, the first of them sample ``start`` of the record.

    ``f`` and ``g`` are those of the first sample turned by the table; so are their sums.
    """
    n = y.size
    first, step = (start - middle) / middle, 1.0 / middle
    angle = p[PHASE] + p[ADVANCE] * first + 0.5 * math.pi * order
    c, s = math.cos(angle), math.sin(angle)
    t = turns.sums[n]
    sum_f, sum_g = c * t[0] - s * t[1], -s * t[0] - c * t[1]
    cross, square = c * s, c * c - s * s
    fg = cross * (t[6] - t[4]) - square * t[5]
    fg1 = cross * (t[9] - t[7]) - square * t[8]
    gg = s * s * t[4] + 2.0 * cross * t[5] + c * c * t[6]
    gg1 = s * s * t[7] + 2.0 * cross * t[8] + c * c * t[9]
    gg2 = s * s * t[10] + 2.0 * cross * t[11] + c * c * t[12]
    r, rc, rs, rc1, rs1, rr = _residual_sums(y, turns.cosine, turns.sine, constant, swing * c, swing * s)
    rg = -s * rc - c * rs
    return _Sums(
        n,
        sum_f,
        sum_g,
        first * sum_g - step * (s * t[2] + c * t[3]),
        c * c * t[4] - 2.0 * cross * t[5] + s * s * t[6],
        fg,
        gg,
        first * fg + step * fg1,
        first * gg + step * gg1,
        first * (first * gg + 2.0 * step * gg1) + step * step * gg2,
        r,
        c * rc - s * rs,
        rg,
        first * rg - step * (s * rc1 + c * rs1),
        rr,
    )


@njit(**INNER, fastmath={"reassoc", "contract"})
def _residual_sums(  # type: ignore[no-untyped-def]
    y: Array, cosine: Array, sine: Array, constant: float, along: float, across: float
):
    """Sums of ``r, rc, rs, jrc, jrs, rr`` for ``r = y - constant - along c + across s``.

    Sums in any order (``reassoc``) are taken several at a time; this loop is what a fit takes its time for.
    """
    sum_r = sum_rc = sum_rs = sum_rc1 = sum_rs1 = sum_rr = 0.0
    for j in range(y.size):
        r = y[j] - constant - along * cosine[j] + across * sine[j]
        rc, rs = r * cosine[j], r * sine[j]
        sum_r += r
        sum_rc += rc
        sum_rs += rs
        sum_rc1 += j * rc
        sum_rs1 += j * rs
        sum_rr += r * r
    return sum_r, sum_rc, sum_rs, sum_rc1, sum_rs1, sum_rr


@njit(**INNER)
def _uneven_sums(
    y: Array, samples: Samples, start: int, end: int, order: int, p: Array, constant: float, swing: float
) -> _Sums:
    """Sums over samples ``start <= j < end`` of the signal ``constant + swing f``."""
    sum_f = sum_g = sum_h = sum_ff = sum_fg = sum_gg = sum_fh = sum_gh = sum_hh = 0.0
    sum_r = sum_rf = sum_rg = sum_rh = sum_rr = 0.0
    for j in range(start, end):
        s = samples.places[j]
        angle = p[PHASE] + p[ADVANCE] * s + 0.5 * math.pi * order
        f, g = math.cos(angle), -math.sin(angle)
        h = s * g
        r = y[j] - constant - swing * f
        sum_f += f
        sum_g += g
        sum_h += h
        sum_ff += f * f
        sum_fg += f * g
        sum_gg += g * g
        sum_fh += h * f
        sum_gh += h * g
        sum_hh += h * h
        sum_r += r
        sum_rf += r * f
        sum_rg += r * g
        sum_rh += r * h
        sum_rr += r * r
    return _Sums(
        end - start, sum_f, sum_g, sum_h, sum_ff, sum_fg, sum_gg, sum_fh, sum_gh, sum_hh,
        sum_r, sum_rf, sum_rg, sum_rh, sum_rr,
    )  # fmt: skip


@njit(**INLINED)
def _add_half_cycle(matrix: Array, gradient: Array, sums: _Sums, k: float, e: float, swing: float) -> None:
    """Add the products of the columns ``(1, f, e + k f, w h, w g)`` of one half cycle."""
    matrix[OFFSET, OFFSET] += sums.ones
    matrix[AMPLITUDE, OFFSET] += sums.f
    matrix[AMPLITUDE, AMPLITUDE] += sums.ff
    matrix[FRICTION, OFFSET] += e * sums.ones + k * sums.f
    matrix[FRICTION, AMPLITUDE] += e * sums.f + k * sums.ff
    matrix[FRICTION, FRICTION] += e * e * sums.ones + 2.0 * e * k * sums.f + k * k * sums.ff
    matrix[ADVANCE, OFFSET] += swing * sums.h
    matrix[ADVANCE, AMPLITUDE] += swing * sums.fh
    matrix[ADVANCE, FRICTION] += swing * (e * sums.h + k * sums.fh)
    matrix[ADVANCE, ADVANCE] += swing * swing * sums.hh
    matrix[PHASE, OFFSET] += swing * sums.g
    matrix[PHASE, AMPLITUDE] += swing * sums.fg
    matrix[PHASE, FRICTION] += swing * (e * sums.g + k * sums.fg)
    matrix[PHASE, ADVANCE] += swing * swing * sums.gh
    matrix[PHASE, PHASE] += swing * swing * sums.gg
    gradient[OFFSET] += sums.r
    gradient[AMPLITUDE] += sums.rf
    gradient[FRICTION] += e * sums.r + k * sums.rf
    gradient[ADVANCE] += swing * sums.rh
    gradient[PHASE] += swing * sums.rg


@njit(**INNER)
def _add_rest(signal: Signal, at: NormalEquations, stop: int, start: int, total: float) -> float:
    """Add the samples at rest, from ``start`` on; return ``total`` with their squared residuals."""
    y, p, matrix, gradient = signal.y, at.p, at.matrix, at.gradient
    e = 0.0
    if signal.order == 0:
        e = 1.0 if stop % 2 == 0 else -1.0
    k = e * (signal.kappa - 2.0 * stop)
    rest = p[OFFSET] + e * p[AMPLITUDE] + k * p[FRICTION]
    count = y.size - start
    sum_r = 0.0
    for j in range(start, y.size):
        r = y[j] - rest
        sum_r += r
        total += r * r
    matrix[OFFSET, OFFSET] += count
    matrix[AMPLITUDE, OFFSET] += e * count
    matrix[AMPLITUDE, AMPLITUDE] += e * e * count
    matrix[FRICTION, OFFSET] += k * count
    matrix[FRICTION, AMPLITUDE] += e * k * count
    matrix[FRICTION, FRICTION] += k * k * count
    gradient[OFFSET] += sum_r
    gradient[AMPLITUDE] += e * sum_r
    gradient[FRICTION] += k * sum_r
    return total
