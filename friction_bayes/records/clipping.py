"""Flat tops: has the sensor run into the end of its range?"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.records.quantisation import ROUNDING

__all__ = ["clipped_fraction"]

SHORTEST_RUN = 3
"""Equal neighbours at an extreme that raise the question; two can be chance in a quantised signal."""

STEPS_BELOW = 6.0
"""Depth below the extreme, in resolution steps, whose samples a clipped level must outnumber.

At a smooth turning point the depth grows as the square of time: a top level of ``f <= 1`` steps holds
``sqrt(f)`` of the samples, the next ``c`` steps ``sqrt(f + c) - sqrt(f)``, which is more for ``c > 3``.
A flat top cut at ``h`` below the true turning point outnumbers them once ``h`` exceeds two steps.
"""


def clipped_fraction(values: ArrayLike) -> tuple[float, float | None]:
    """Return the share of samples that sit flat at an end of the sensor's range, and that level.

    A signal that moves smoothly passes an extreme without staying; a quantised one stays there only as long
    as a parabola stays within one step. A level that holds runs of equal samples, and more of them than the
    band beneath it, is the end of the range. A record held still before its release does not count.

    Parameters
    ----------
    values : array_like, shape (n,)
        The signal, finite, before any smoothing.

    Returns
    -------
    fraction : float
        Clipped samples over all samples; zero when none.
    level : float or None
        The clipped value, the one with more samples when both ends clip; None when none.
    """
    signal = np.asarray(values, dtype=float)
    levels = [
        (count, level)
        for count, level in (_clipped_at_top(signal), _clipped_at_top(-signal, sign=-1.0))
        if count
    ]
    if not levels:
        return 0.0, None
    return sum(count for count, _ in levels) / signal.size, max(levels)[1]


def _clipped_at_top(signal: Array, *, sign: float = 1.0) -> tuple[int, float]:
    """Return how many samples are clipped at the largest value, and that value (times ``sign``)."""
    top, bottom = signal.max(), signal.min()
    rounding = ROUNDING * (top - bottom)
    starts, lengths = _runs(signal)
    levels = signal[starts]
    at_top = levels >= top - rounding
    inside = ~at_top & (levels > bottom + rounding)
    under = top - rounding - STEPS_BELOW * _resolution(signal, starts, lengths, inside)
    # what is near the top from the very start on is a hold that ends with a release, which proves nothing
    held = int(np.argmax(signal < under))
    evidence = at_top & (starts >= held) & (starts > 0)
    if top == bottom or not (evidence & (lengths >= SHORTEST_RUN)).any():
        return 0, 0.0
    # noise of a few steps holds a value by chance: one flat run counts if those below are far shorter
    upper = ~at_top & (levels > 0.5 * (top + np.median(signal)))
    if np.count_nonzero(evidence) == 1 and lengths[evidence].sum() <= lengths[upper].max(initial=0) + 1:
        return 0, 0.0
    beneath = np.count_nonzero((signal[held:] < top - rounding) & (signal[held:] >= under))
    if lengths[evidence].sum() <= beneath:
        return 0, 0.0
    return int(lengths[at_top].sum()), float(sign * top)


def _runs(signal: Array) -> tuple[Indices, Indices]:
    """Return start and length of each run of samples that are equal but for rounding."""
    changes = np.abs(np.diff(signal)) > ROUNDING * np.ptp(signal)
    starts = np.concatenate(([0], np.flatnonzero(changes) + 1))
    return starts, np.diff(np.append(starts, signal.size))


def _resolution(
    signal: Array,
    starts: Indices,
    lengths: Indices,
    inside: Mask,
) -> float:
    """Return the step of a quantised signal, zero for a continuous one.

    The smallest difference between values that occur, where they fill a lattice; or, where a filter has
    blurred the steps, the typical step out of the flat turning points elsewhere in the record (``inside``
    marks runs away from both extremes).
    """
    gaps = np.diff(np.unique(signal))
    span = float(np.ptp(signal))
    lattice = float(gaps[gaps > ROUNDING * span].min(initial=span))
    # the closest of n values strewn at random lie about span / n**2 apart, on a lattice span / n or more
    if span <= 4.0 * signal.size * lattice:
        return lattice
    flat = np.flatnonzero(inside & (lengths >= SHORTEST_RUN))
    flat = flat[(flat > 0) & (flat < starts.size - 1)]
    if not flat.size:
        return lattice
    level = signal[starts[flat]]
    before, after = signal[starts[flat] - 1], signal[starts[flat + 1]]
    return float(max(lattice, np.median(np.maximum(np.abs(before - level), np.abs(after - level)))))
