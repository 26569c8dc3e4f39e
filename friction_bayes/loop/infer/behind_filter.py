"""The filter that a record went through, which changes corners, noise and amplitude.

It is found as :func:`friction_bayes.estimate` finds it
(:mod:`friction_bayes.estimators.noise.filter_evidence`), along the motion of a law without a random force.
"""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Mask
from friction_bayes.estimators.noise.filter_evidence import likely_filters
from friction_bayes.estimators.noise.free_corners import corner_columns
from friction_bayes.estimators.noise.recording_filters import RecordingFilter, blended
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion

__all__ = ["filter_of"]


def filter_of(found: LawAlongMotion, missing: Mask) -> RecordingFilter | None:
    """The mean of a record's probable filters, with their differences; None where none is as probable.

    Forces other than friction are represented by a swing of varying amplitude and phase: above the motion's
    frequency they are small next to the corners.

    Parameters
    ----------
    found : LawAlongMotion
        As if there were no filter.
    missing : ndarray of bool, shape (n,)
        Samples that are not used.
    """
    law, clock, path = found.law, found.clock, found.path
    if not clock.even:
        return None
    plain = np.column_stack([law.sensor[:, [*law.always, law.dry_friction]], np.ones(path.phase.size)])
    corners = np.hstack([plain, corner_columns(path)])
    signal = np.where(missing, np.nan, found.regression.target + law.known)
    angle = float(path.phase[-1] - path.phase[0]) / (path.phase.size - 1)
    filters = likely_filters(signal, law.known, plain, corners, angle, found.segment.order)
    return blended(filters.likely, law.read.values) if filters.probability > 0.5 else None
