"""Kernels that find the moving part of a record: release, rough phase, and where the motion ends.

Everything is least squares on the samples with an oscillation whose amplitude bends smoothly; no friction
model enters, so that the cut is the same for every model fitted later. The kernels work on one record, are
compiled, and serve single records and batches alike.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import ZERO, Array
from friction_bayes.core.kernels import INLINED, INNER, KERNEL, njit
from friction_bayes.decay.amplitude_loss import amplitude_falls, rate_of_dying_away
from friction_bayes.decay.block_means import about_mean, fill_block_means, less
from friction_bayes.decay.demodulation import (
    EVIDENCE,
    amplitudes,
    demodulate,
    fill_turns,
    largest,
    phase_of,
    rate_of,
    rough_phase,
)
from friction_bayes.decay.disturbed_release import disturbed_half_cycles
from friction_bayes.decay.drive import driven_half_cycles
from friction_bayes.decay.linear_least_squares import regression
from friction_bayes.decay.located import (
    CONSTANT,
    FOUND,
    LEAST_HALF_CYCLES,
    NO_OSCILLATION,
    NOT_DECAYING,
    NOT_FINITE,
    SEVERAL_DECAYS,
    TOO_SHORT,
    Located,
)
from friction_bayes.decay.releases import peaks_after_releases, samples_averaged
from friction_bayes.decay.spans import Extremes

__all__ = ["locate_moving_parts"]

_MOST_WANDER = 0.5
"""Most mean square deviation of an oscillation's phase from a smooth one [rad2]; that of noise is larger."""
_LEAST_SHARE = 0.1
"""Share of a record's variance that the oscillation must hold."""
_MISFIT = 0.05
"""Share of the amplitude that the smooth description may miss without that being evidence of a release."""
_BY_CHANCE = 6.0
"""Fall in chi-square that two numbers more bring by chance once in twenty."""
_RESYNCHRONISED = 64
"""Samples after which a phase that has been turned from one to the next is computed anew."""
_COLUMNS_TO_ZERO = 5
"""Of an amplitude that falls to zero at a given place, on a parabola; on a line the last is left out."""
_TWO_LEVELS = 1.5
"""Steps of the sensor that two neighbouring levels span at most, printed with few digits."""


@njit(**INNER)
def _release(
    y: Array, polynomial: Array, scale: float, first_full: float, amplitude: float, rate: float
) -> tuple[int, float]:
    """First sample of the free decay, and the residual sum of squares with it.

    The signal is constant before it, and after it an oscillation whose amplitude dies away at a rate a sample
    toward any constant, or falls straight where the rate is zero. ``first_full`` is the centre of the first
    window with full amplitude. A record that begins in motion gives 0.
    """
    omega = rate_of(polynomial, scale, first_full)
    period = 2.0 * math.pi / omega
    begin = int(max(0.0, math.floor(first_full - 2.0 * period)))
    end = int(min(y.size, math.ceil(first_full + 3.5 * period)))
    n = end - begin
    if n < 12:
        return begin, math.inf
    near, passed, cosine, sine = y[begin:end], _passed(n, rate), np.empty(n), np.empty(n)
    fill_turns(phase_of(polynomial, scale, first_full) + omega * (begin - first_full), omega, cosine, sine)
    stride = max(1, int(period / 32.0))
    latest = int(min(first_full + 0.75 * period, end - 1.25 * period)) - begin
    places = max(latest, 0) // stride + 1
    matrices, rights, squares = np.zeros((places, 5, 5)), np.zeros((places, 5)), np.zeros(places)
    matrix, right, square, at = np.zeros((6, 6)), np.zeros(6), 0.0, n
    for place in range(places - 1, -1, -1):
        j = place * stride
        square += _add_swings(near, cosine, sine, passed, j, at, 1.0, matrix, right)
        at = j
        _copy_moments(matrices[place], rights[place], matrix, right)
        squares[place] = square
    floor = 0.5 * n * (_MISFIT * amplitude) ** 2
    whole = math.inf
    if latest >= 0:
        _, whole = regression(matrices[0], rights[0], squares[0])
    best, best_cost = 0, whole + floor
    total, total_square = 0.0, 0.0
    for j in range(latest + 1):
        if j % stride == 0 and j >= max(1, int(period / 16.0)):
            before = max(total_square - total * total / j, 0.0) + floor
            # what follows costs something too
            if before < best_cost:
                _, after = regression(matrices[j // stride], rights[j // stride], squares[j // stride])
                if after + before < best_cost:
                    best, best_cost = j, after + before
        total += near[j]
        total_square += near[j] ** 2
    gain = n * math.log((whole + floor) / best_cost) if whole < math.inf else math.inf
    if begin == 0 and gain < 20.0 + 2.0 * math.log(n):
        return 0, whole + floor
    return begin + best, best_cost


@njit(**INNER, fastmath={"reassoc", "contract"})
def _sums(y: Array) -> tuple[float, float]:
    """Sum of the samples, and of their squares."""
    total = square = 0.0
    for i in range(y.size):
        total += y[i]
        square += y[i] * y[i]
    return total, square


@njit(**INNER)
def _phasors(polynomial: Array, scale: float, start: int, n: int) -> tuple[Array, Array]:
    """Cosine and sine of a cubic phase from ``start`` on, turned by its differences, which a cubic ends."""
    cosine, sine = np.empty(n), np.empty(n)
    if polynomial[2] == 0.0 and polynomial[3] == 0.0:
        fill_turns(phase_of(polynomial, scale, float(start)), polynomial[1] / scale, cosine, sine)
        return cosine, sine
    third = 6.0 * polynomial[3] / scale**3
    c3, s3 = math.cos(third), math.sin(third)
    c = s = c1 = s1 = c2 = s2 = 0.0
    for j in range(n):
        if j % _RESYNCHRONISED == 0:
            here = phase_of(polynomial, scale, float(start + j))
            first = phase_of(polynomial, scale, float(start + j + 1)) - here
            second = phase_of(polynomial, scale, float(start + j + 2)) - here - 2.0 * first
            c, s = math.cos(here), math.sin(here)
            c1, s1 = math.cos(first), math.sin(first)
            c2, s2 = math.cos(second), math.sin(second)
        cosine[j], sine[j] = c, s
        c, s = c * c1 - s * s1, s * c1 + c * s1
        c1, s1 = c1 * c2 - s1 * s2, s1 * c2 + c1 * s2
        c2, s2 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
    return cosine, sine


@njit(**INNER)
def _copy_moments(to_matrix: Array, to_right: Array, matrix: Array, right: Array) -> None:
    """Copy moments of the first columns, by loops: slice assignment costs the compiler seconds."""
    for a in range(to_right.size):
        to_right[a] = right[a]
        for b in range(a + 1):
            to_matrix[a, b] = matrix[a, b]


@njit(**INNER, fastmath={"reassoc", "contract"})
def _add_swings(
    y: Array,
    cosine: Array,
    sine: Array,
    passed: Array,
    first: int,
    last: int,
    sign: float,
    matrix: Array,
    right: Array,
) -> float:
    """Add samples ``first <= j < last`` to the moments of columns ``1, c, s, hc, hs, hhc``, ``h = passed``.

    Many of these moments are the same. A negative ``sign`` takes them away.

    Returns
    -------
    float
        The sum of squares of the samples.
    """
    c0 = c1 = c2 = s0 = s1 = cc0 = cc1 = cc2 = cc3 = cc4 = cs0 = cs1 = cs2 = cs3 = ss0 = ss1 = ss2 = 0.0
    one = yc0 = yc1 = yc2 = ys0 = ys1 = square = 0.0
    for j in range(first, last):
        h, c, s, value = passed[j], cosine[j], sine[j], y[j]
        hc, hs = h * c, h * s
        hhc = h * hc
        c0, c1, c2, s0, s1 = c0 + c, c1 + hc, c2 + hhc, s0 + s, s1 + hs
        cc0, cc1, cc2, cc3, cc4 = cc0 + c * c, cc1 + hc * c, cc2 + hc * hc, cc3 + hhc * hc, cc4 + hhc * hhc
        cs0, cs1, cs2, cs3 = cs0 + c * s, cs1 + c * hs, cs2 + hc * hs, cs3 + hhc * hs
        ss0, ss1, ss2 = ss0 + s * s, ss1 + hs * s, ss2 + hs * hs
        one, square = one + value, square + value * value
        yc0, yc1, yc2 = yc0 + value * c, yc1 + value * hc, yc2 + value * hhc
        ys0, ys1 = ys0 + value * s, ys1 + value * hs
    matrix[0, 0] += sign * (last - first)
    matrix[1, 0] += sign * c0
    matrix[1, 1] += sign * cc0
    matrix[2, 0] += sign * s0
    matrix[2, 1] += sign * cs0
    matrix[2, 2] += sign * ss0
    matrix[3, 0] += sign * c1
    matrix[3, 1] += sign * cc1
    matrix[3, 2] += sign * cs1
    matrix[3, 3] += sign * cc2
    matrix[4, 0] += sign * s1
    matrix[4, 1] += sign * cs1
    matrix[4, 2] += sign * ss1
    matrix[4, 3] += sign * cs2
    matrix[4, 4] += sign * ss2
    matrix[5, 0] += sign * c2
    matrix[5, 1] += sign * cc2
    matrix[5, 2] += sign * cs2
    matrix[5, 3] += sign * cc3
    matrix[5, 4] += sign * cs3
    matrix[5, 5] += sign * cc4
    right[0] += sign * one
    right[1] += sign * yc0
    right[2] += sign * ys0
    right[3] += sign * yc1
    right[4] += sign * ys1
    right[5] += sign * yc2
    return square


@njit(**INNER)
def _passed(n: int, rate: float) -> Array:
    """A time of each of ``n`` samples in which an amplitude that dies away at a rate falls straight."""
    passed = np.empty(n)
    for j in range(n):
        passed[j] = j / n if rate == 0.0 else -math.expm1(-rate * j) / (rate * n)
    return passed


@njit(**INNER)
def _fill_to_zero(matrix: Array, right: Array, z: float, moments: Array) -> None:
    """Fill in the moments of columns ``1, (z - h) c, s, (z - h) s, (z - h)^2 c``, the samples' last.

    An amplitude on these falls to zero where the time ``h`` is ``z``. They follow from the moments of
    :func:`_add_swings`, ``matrix`` and ``right``.
    """
    cc0, cc1, cc2, cc3, cc4 = matrix[1, 1], matrix[3, 1], matrix[3, 3], matrix[5, 3], matrix[5, 5]
    cs0, cs1, cs2, cs3 = matrix[2, 1], matrix[3, 2], matrix[4, 3], matrix[5, 4]
    c0, c1, c2, s0, s1 = matrix[1, 0], matrix[3, 0], matrix[5, 0], matrix[2, 0], matrix[4, 0]
    ss0, ss1, ss2 = matrix[2, 2], matrix[4, 2], matrix[4, 4]
    zz = z * z
    moments[0, 0] = matrix[0, 0]
    moments[1, 0], moments[1, 1] = z * c0 - c1, zz * cc0 - 2.0 * z * cc1 + cc2
    moments[2, 0], moments[2, 1], moments[2, 2] = s0, z * cs0 - cs1, ss0
    moments[3, 0], moments[3, 1] = z * s0 - s1, zz * cs0 - 2.0 * z * cs1 + cs2
    moments[3, 2], moments[3, 3] = z * ss0 - ss1, zz * ss0 - 2.0 * z * ss1 + ss2
    moments[4, 0] = zz * c0 - 2.0 * z * c1 + c2
    moments[4, 1] = zz * (z * cc0 - 3.0 * cc1) + 3.0 * z * cc2 - cc3
    moments[4, 2] = zz * cs0 - 2.0 * z * cs1 + cs2
    moments[4, 3] = zz * (z * cs0 - 3.0 * cs1) + 3.0 * z * cs2 - cs3
    moments[4, 4] = zz * (zz * cc0 - 4.0 * z * cc1 + 6.0 * cc2) - 4.0 * z * cc3 + cc4
    moments[5, 0], moments[5, 1], moments[5, 2] = right[0], z * right[1] - right[3], right[2]
    moments[5, 3], moments[5, 4] = z * right[2] - right[4], zz * right[1] - 2.0 * z * right[3] + right[5]


@njit(**INNER)
def _left_over(moments: Array, square: float) -> tuple[float, float]:
    """Residual sums of squares on all columns but the last, and on all; infinite where singular.

    Takes the moments' Cholesky factor in their place: that of fewer columns is a part of it.
    """
    rest, rests = square, (math.inf, math.inf)
    for i in range(_COLUMNS_TO_ZERO):
        own = moments[i, i]
        for j in range(_COLUMNS_TO_ZERO + 1 - i):
            row = moments[i + j]
            total = row[i]
            for k in range(i):
                total -= row[k] * moments[i, k]
            if j == 0:
                if not total > 1e-13 * own:
                    return rests
                row[i] = math.sqrt(total)
            else:
                row[i] = total / moments[i, i]
        rest -= moments[_COLUMNS_TO_ZERO, i] ** 2
        if i == _COLUMNS_TO_ZERO - 2:
            rests = (max(rest, 0.0), math.inf)
    return rests[0], max(rest, 0.0)


@njit(**INNER)
def _first_coefficient(factor: Array, size: int) -> float:
    """First coefficient on so many columns, from the factor of :func:`_left_over`."""
    x = np.empty(size)
    for i in range(size - 1, -1, -1):
        x[i] = factor[_COLUMNS_TO_ZERO, i]
        for k in range(i + 1, size):
            x[i] -= factor[k, i] * x[k]
        x[i] /= factor[i, i]
    return x[0]


class _End(NamedTuple):
    """Where the amplitude meets zero [samples], the constant of the oscillation, residual sum of squares."""

    place: float
    centre: float
    cost: float


@njit(**INNER)
def _ends(
    y: Array, c: Array, s: Array, passed: Array, half: float, beyond_doubt: float
) -> tuple[_End, _End, _End]:
    """Where the amplitude meets zero on a line and on a parabola, and that it goes on, on any parabola.

    The samples ``y`` have mean zero; lines and parabolas are those over the time ``passed``. Each place is
    the first that is worse than the best by no more than ``beyond_doubt`` in chi-square.
    """
    n = y.size
    _, variance = _sums(y)
    matrix, right = np.zeros((6, 6)), np.zeros(6)
    _add_swings(y, c, s, passed, ZERO, n, 1.0, matrix, right)
    x, cost = regression(matrix, right, variance)
    on = _End(math.inf, x[0], cost)
    factor = np.zeros((_COLUMNS_TO_ZERO + 1, _COLUMNS_TO_ZERO))
    straight = bent = _End(math.inf, 0.0, math.inf)
    # from the end on; a motion does not end within its first three half cycles
    j, at, places = n - 1, n, math.floor(4.0 * ((n - 2) / half - 3.0))
    square, tail_sum, tail_square = variance, 0.0, 0.0
    while True:
        taken = _add_swings(y, c, s, passed, j, at, -1.0, matrix, right)
        total, _ = _sums(y[j:at])
        square, tail_sum, tail_square, at = square - taken, tail_sum + total, tail_square + taken, j
        tail = max(tail_square - tail_sum * tail_sum / (n - j), 0.0)
        if tail > straight.cost and tail > bent.cost:
            # what is constant after costs no less for an earlier place, and now more than all
            break
        _fill_to_zero(matrix, right, passed[j], factor)
        on_line, on_parabola = _left_over(factor, square)
        if on_line < math.inf and on_line + tail <= straight.cost * (1.0 + beyond_doubt / n):
            centre = _first_coefficient(factor, _COLUMNS_TO_ZERO - 1)
            straight = _End(float(j), centre, min(on_line + tail, straight.cost))
        if on_parabola < math.inf and on_parabola + tail <= bent.cost * (1.0 + beyond_doubt / n):
            centre = _first_coefficient(factor, _COLUMNS_TO_ZERO)
            bent = _End(float(j), centre, min(on_parabola + tail, bent.cost))
        if places < 0:
            break
        j = math.ceil((3.0 + 0.25 * places) * half)
        places -= 1
    return straight, bent, on


@njit(**INNER)
def _hinge(y: Array, start: int, polynomial: Array, scale: float, rate: float) -> tuple[float, float, float]:
    """Where the amplitude meets zero, constant samples after.

    The amplitude falls to zero on a line, or where the data ask for it on a parabola, or as under damping in
    addition to dry friction: an exponential less a constant.

    Returns
    -------
    hinge : float
        In samples; ``inf`` when the oscillation goes on to the end of the record.
    centre : float
        Constant of the oscillation.
    explained : float
        Variance that the oscillation explains over what noise alone would give (an F ratio); zero where it
        is hardly a share of the whole, as in a record that only drifts.
    """
    n = y.size - start
    half = math.pi / rate_of(polynomial, scale, float(start))
    moving, mean = about_mean(y[start:])
    _, variance = _sums(moving)
    c, s = _phasors(polynomial, scale, start, n)
    end, bent, on = _ends(moving, c, s, _passed(n, 0.0), half, 0.0)
    damped = more_bent = _End(math.inf, 0.0, math.inf)
    if rate > 0.0:
        # it meets zero at no place where it is lost in noise before
        damped, more_bent, goes_on = _ends(moving, c, s, _passed(n, rate), half, _BY_CHANCE)
        if damped.cost < bent.cost:
            bent = damped
        if goes_on.cost < on.cost:
            on = goes_on
    for other in (bent, more_bent):
        if end.cost > other.cost * (1.0 + EVIDENCE / n):
            end = other
    if on.cost <= min(end.cost, damped.cost, more_bent.cost) * (1.0 - _BY_CHANCE / n):
        end = on
    explained = (variance - end.cost) / 5.0 / max(end.cost / max(n - 6, 1), 1e-300)
    if variance - end.cost < _LEAST_SHARE * variance:
        explained = 0.0
    return start + end.place, end.centre + mean, explained


@njit(**INNER)
def _still_from(y: Array, resolution: float) -> int:
    """First of the last samples that lie on one level of the sensor or two neighbouring ones.

    ``y.size`` where the sensor has no ``resolution``, which is then zero.
    """
    first, low, high = y.size, math.inf, -math.inf
    for i in range(y.size - 1, -1, -1):
        low, high = min(low, y[i]), max(high, y[i])
        if not high - low < _TWO_LEVELS * resolution:
            break
        first = i
    return first


@njit(**INNER)
def _median(values: Array) -> float:
    """Upper median by selection; a library sort costs the compiler seconds."""
    kept = values.copy()
    low, high, sought = 0, kept.size - 1, kept.size // 2
    while low < high:
        pivot = kept[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while kept[i] < pivot:
                i += 1
            while kept[j] > pivot:
                j -= 1
            if i <= j:
                kept[i], kept[j] = kept[j], kept[i]
                i += 1
                j -= 1
        if sought <= j:
            high = j
        elif sought >= i:
            low = i
        else:
            break
    return kept[sought]


@njit(**INNER)
def _nearest_turn(hinge: float, polynomial: Array, scale: float, order: int) -> float:
    """Turning point nearest to ``hinge``, in samples: dry friction stops a motion nowhere else."""
    theta = phase_of(polynomial, scale, hinge) - 0.5 * math.pi * order
    turn = math.pi * round(theta / math.pi)
    return hinge + (turn - theta) / rate_of(polynomial, scale, hinge)


@njit(**KERNEL)
def locate_moving_parts(
    values: Array,
    seen: Extremes,
    frequencies: Array,
    resolutions: Array,
    order: int,
    given_start: int,
    alone: bool,
    judged: bool,
    located: Located,
) -> None:
    """Find the moving part of every record.

    Parameters
    ----------
    values : ndarray, shape (records, n)
        Samples, one record a row.
    seen : Extremes
        Of each.
    frequencies : ndarray, shape (records,)
        Rough angular frequencies [rad/sample].
    resolutions : ndarray, shape (records,)
        Steps of the sensor, unit of the signal; zero where none shows.
    order : int
        Derivative order of the signal.
    given_start : int
        First sample of the free decay if known, else -1.
    alone : bool
        Whether each record is taken to hold one decay; otherwise :data:`SEVERAL_DECAYS` is the status of
        those with several releases.
    judged : bool
        Whether a start on which a hand or a drive acts is left out, as amplitudes show it.
    located : Located
        Receives what is found.
    """
    for r in range(values.shape[0]):
        y, omega, resolution = values[r], frequencies[r], resolutions[r]
        low, high = seen.low[r], seen.high[r]
        undriven = 0
        for again in range(2):
            # phase and rest of a part freed from a drive are its own, and it is taken to hold one decay
            given, single = (undriven, True) if again > 0 else (given_start, alone)
            found = _moving_part(y, low, high, omega, resolution, order, given, single, judged, again > 0)
            if again == 0:
                undriven = found[8]
            if undriven == 0:
                break
        (
            located.status[r],
            located.start[r],
            located.stop[r],
            located.frequency[r],
            located.phase[r],
            located.rest_position[r],
            located.stops[r],
            located.disturbed[r],
            _,
        ) = found
        located.driven[r] = undriven > 0


@njit(**INLINED)
def _moving_part(
    y: Array,
    low: float,
    high: float,
    omega: float,
    resolution: float,
    order: int,
    given_start: int,
    alone: bool,
    judged: bool,
    after_drive: bool,
) -> tuple[int, int, int, float, float, float, bool, int, int]:
    """The row of :class:`Located` that belongs to one record; its last entry: where a drive has ended."""
    if y.size > 0 and not math.isfinite(high - low):
        return _nothing(NOT_FINITE)
    if not high > low:
        return _nothing(CONSTANT)
    offset = 0.5 * (low + high)
    begin = max(given_start, 0)
    # positions below are counted in blocks, whose centres lie ``shift`` samples after their first
    width = samples_averaged(omega)
    shift = 0.5 * (width - 1)
    moving = np.empty((y.size - begin) // width)
    fill_block_means(y[begin:], width, offset, moving)
    centre, inphase, quadrature, noise = demodulate(moving, omega * width)
    if centre.size < 2:
        return _nothing(TOO_SHORT)
    amplitude = amplitudes(inphase, quadrature)
    most_swing = largest(amplitude)
    floor = _median(noise)
    if not alone and peaks_after_releases(amplitude, floor).size > 1:
        return _nothing(SEVERAL_DECAYS)
    threshold = 0.8 * most_swing - 2.0 * floor
    first = 0
    while first < amplitude.size - 1 and amplitude[first] < threshold:
        first += 1
    polynomial, scale, wander = rough_phase(centre, inphase, quadrature, floor, first, omega * width)
    if not wander < _MOST_WANDER or not rate_of(polynomial, scale, centre[first]) > 0.3 * omega * width:
        return _nothing(NO_OSCILLATION)
    start, dying = 0, rate_of_dying_away(centre, amplitude, floor, first)
    if given_start < 0:
        start, cost = _release(moving, polynomial, scale, centre[first], most_swing, 0.0)
        if dying > 0.0:
            damped, damped_cost = _release(moving, polynomial, scale, centre[first], most_swing, dying)
            if damped_cost < cost:
                start = damped
        if start > 0:
            # by windows none of which the release lies in
            after, c, s, _ = demodulate(moving[start:], omega * width)
            dying = rate_of_dying_away(after, amplitudes(c, s), floor, ZERO)
    hinge, rest, explained = _hinge(moving, start, polynomial, scale, dying)
    if explained < 12.0 + 2.0 * math.log(moving.size):
        return _nothing(NO_OSCILLATION)
    first_sample, stop = begin + start * width, y.size
    if hinge < math.inf:
        turn = _nearest_turn(hinge, polynomial, scale, order)
        stop = min(math.floor(begin + turn * width + shift) + 1, y.size)
    # a motion of more than a step crosses two levels within half a period: it has ended, whatever the
    # straight amplitude says, which only the large swings decide
    still = (_still_from(y, resolution) - begin - shift) / width
    if (moving.size - still) * rate_of(polynomial, scale, still) > math.pi:
        turn = _nearest_turn(still, polynomial, scale, order)
        stop = min(math.floor(begin + turn * width + shift) + 1, stop)
    disturbed, undriven = 0, 0
    # a phase that is bent to fit a rest may run backwards at the start
    rate = rate_of(polynomial, scale, float(start))
    if not rate > 0.0:
        return _nothing(NO_OSCILLATION)
    if given_start < 0 and judged:
        half = math.pi / rate
        # where the record begins with a hold, the release is known to about half a half cycle
        free = start + int(0.5 * half) if start > 0 else 0
        swing = less(moving[free : (stop - begin) // width], rest)
        windows = demodulate(swing, math.pi / half)
        disturbed, goes_on = disturbed_half_cycles(windows)
        after, driven = free, 0
        if goes_on:
            # a drive that acts for longer shows as a whole
            driven = driven_half_cycles(swing, math.pi / half, windows)
        if driven == 0:
            if disturbed > 0:
                let_go = _nearest_turn(free + disturbed * half, polynomial, scale, order)
                first_sample = math.ceil(begin + let_go * width + shift)
                after = max(math.ceil(let_go), free)
                swing = less(moving[after : (stop - begin) // width], rest)
                windows = demodulate(swing, math.pi / half)
            driven = driven_half_cycles(swing, math.pi / half, windows)
        if driven > 0:
            # the turning point after
            released = _nearest_turn(after + (driven + 0.5) * half, polynomial, scale, order)
            undriven = math.ceil(begin + released * width + shift)
    last = (stop - begin - shift) / width
    begun = (first_sample - begin - shift) / width
    rate = (phase_of(polynomial, scale, last) - phase_of(polynomial, scale, begun)) / max(
        stop - first_sample, 1
    )
    if not 0.3 * omega < rate < 1.8 * omega:
        return _nothing(NO_OSCILLATION)
    if (stop - first_sample) * rate < LEAST_HALF_CYCLES * math.pi:
        return _nothing(TOO_SHORT)
    free_samples = moving[max((first_sample - begin) // width, 0) : (stop - begin) // width]
    if not amplitude_falls(free_samples, rate * width, after_drive):
        return NOT_DECAYING, 0, 0, 0.0, 0.0, 0.0, False, 0, undriven
    phase = (phase_of(polynomial, scale, begun) - 0.5 * math.pi * order) % (2.0 * math.pi)
    return FOUND, first_sample, stop, rate, phase, rest + offset, stop < y.size, disturbed, undriven


@njit(**INNER)
def _nothing(status: int) -> tuple[int, int, int, float, float, float, bool, int, int]:
    return status, 0, 0, 0.0, 0.0, 0.0, False, 0, 0
