r"""Corners of a motion as a recording may have made them: of any shape, the same at every turning point.

A linear filter, a mean over an interval or a sensor with a delay turns a decaying cosine into a decaying
cosine and preserves the loss of amplitude. It changes the corners that dry friction makes: next to the
cosine, the part of the motion locked to the direction is periodic and does not decay, so that after any
filter it is a sum of odd harmonics of constant size. With these as columns of their own, the corners say
nothing about friction any more, and the loss of amplitude alone determines it.

Unfiltered, harmonic ``n`` of a displacement is ``4 r/k`` over ``pi n (n**2 - 1)``, of a velocity ``n`` times
and of an acceleration ``n**2`` times as large: as much a filter may take away, which is the prior.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.statespace.measured_path import MeasuredPath

__all__ = ["corner_columns", "corner_scale", "corners_after", "near_corners"]

_HIGHEST = 31
"""Harmonic up to which corners are described; of the next ones a displacement has 1e-4 of friction."""
_BELOW_NYQUIST = 0.9
_FEWEST = 2
"""Turning points from which on there is a phase to count harmonics by."""


def _harmonics(path: MeasuredPath) -> Array:
    step = float(np.median(np.diff(path.phase)))
    highest = min(_HIGHEST, int(_BELOW_NYQUIST * math.pi / step))
    return np.arange(3.0, highest + 1.0, 2.0) if path.turning.size >= _FEWEST else np.empty(0)


def corner_columns(path: MeasuredPath) -> Array:
    """Cosines and sines of the odd harmonics from the third on, shape (n, 2 harmonics)."""
    count = path.turning.size
    turns = np.concatenate([path.turning[:1] - math.pi, path.turning, path.turning[-1:] + math.pi])
    # beyond the first and the last turning point the motion goes on as the oscillator does
    theta = np.interp(path.phase, turns, math.pi * np.arange(count + 2)) if count else path.phase
    return _waves(theta, path)


def corners_after(path: MeasuredPath, phase: Array) -> Array:
    """The same columns at phases after the last turning point, shape (m,), of a motion that goes on."""
    return _waves(math.pi * path.turning.size + phase - path.turning[-1], path)


def _waves(theta: Array, path: MeasuredPath) -> Array:
    angles = theta[:, None] * _harmonics(path)
    return np.hstack([np.cos(angles), np.sin(angles)])


def corner_scale(path: MeasuredPath, order: int, friction: float) -> Array:
    """Prior sd of their coefficients, shape (2 harmonics,), for a displacement ``r/k``."""
    n = _harmonics(path)
    return np.tile(4.0 * friction * n ** (order - 1) / (math.pi * (n * n - 1.0)), 2)


def near_corners(path: MeasuredPath) -> Array:
    """Which samples, shape (n,), lie where an acceleration's jump has more than these harmonics."""
    highest = max(int(np.max(_harmonics(path), initial=1)), 1)
    turns = np.concatenate([[-np.inf], path.turning, [np.inf]])
    after = np.searchsorted(turns, path.phase)
    nearest = np.minimum(path.phase - turns[after - 1], turns[after] - path.phase)
    return np.asarray(nearest < math.pi / (highest + 2))
