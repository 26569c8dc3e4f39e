"""From when on a record is free: something may have held the mass at its start, as a hand does."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.errors import InputError
from friction_bayes.estimators.waveform.estimator import white_noise_fit
from friction_bayes.estimators.waveform.free_part import free_part
from friction_bayes.loop.data.prepared_record import Segment

__all__ = ["free_from"]


def free_from(segment: Segment) -> float | None:
    """When a segment rather becomes free [s], as :func:`friction_bayes.estimate` finds it; None at its start.

    A clipped record is not judged.
    """
    if segment.clipped:
        return None
    decay = segment.decay
    ignored = np.zeros(decay.values.size, np.bool_)
    ignored[: segment.moving] = segment.ignored[: segment.moving]
    try:
        later = free_part(
            decay.without_stray(ignored), white_noise_fit(decay), suspect=max(segment.disturbed, 1)
        ).decay
    except InputError:
        return None
    return later.start_time if later.later else None
