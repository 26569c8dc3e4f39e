r"""Samples at the start of a record that were read while the mass was still held.

A release from rest leaves a position that is even in the time since, whatever friction and spring,

.. math:: x = a + b \cos \omega s + c \cos 2 \omega s, \quad s = t - t_0,

over the first half cycle, and a constant before. A record that begins in motion has the odd terms too, and no
hold. Both are fitted to the first half period and compared by their likelihood at the most probable noise. A
priori one record in ten has a hold, and it ends at any sample within a quarter of a period. An
acceleration is not tested: its jump at the release is visible, and alike those at turning points.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.records.quantisation import ROUNDING

__all__ = ["held_samples"]

_LOG_ODDS = math.log(0.1 / 0.9)
"""Of a hold, a priori."""
_FINENESS = 8
"""Number of release times that are tried between two samples."""
_HARMONICS = np.array([1.0, 2.0])
"""A half cycle of a far swing, or on a spring that stiffens, has the second too."""


def held_samples(decay: FreeDecay) -> int:
    """Number of samples read before the release; zero also where the record cannot show it."""
    order = decay.quantity.order
    if order == 2 or not decay.evenly_spaced or decay.disturbed:
        return 0
    angle = decay.frequency * decay.step
    values = decay.values[: int(math.pi / angle) + 1]
    time: Array = angle * np.arange(values.size, dtype=np.float64)
    longest = values.size // 2
    in_motion = np.column_stack([np.ones_like(time), _terms(time, 0), _terms(time, 1)])
    if values.size < 2 * in_motion.shape[1]:
        return 0
    least = values.size * (ROUNDING * float(np.ptp(decay.values))) ** 2
    releases = np.arange(1, longest * _FINENESS + 1) / _FINENESS
    misfits = [_misfit(_released(time - angle * at, order), values) for at in releases]
    best = int(np.argmin(misfits))
    gain = 0.5 * values.size * math.log((_misfit(in_motion, values) + least) / (misfits[best] + least))
    return math.ceil(releases[best]) if gain + _LOG_ODDS > math.log(longest) else 0


def _released(since: Array, order: int) -> Array:
    """Columns of a sensor's reading of a derivative, ``since`` in radians, for a mass held until zero."""
    moving = np.maximum(since, 0.0)
    return np.column_stack([np.ones_like(since), _terms(moving, order)])


def _terms(angle: Array, derivative: int) -> Array:
    """Terms of the motion that are even in time, or their derivative, shape (n, harmonics)."""
    turned = angle[:, None] * _HARMONICS
    return np.asarray(np.sin(turned) if derivative == 1 else np.cos(turned))


def _misfit(columns: Array, values: Array) -> float:
    """Residual sum of squares of a regression."""
    left = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(left @ left)
