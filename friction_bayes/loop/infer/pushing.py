"""Laws whose dry friction would push: none of them is a law of friction."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.infer.moving_record import LawAlongMotion
from friction_bayes.statespace.force_grid import Posterior

__all__ = ["pushing"]

_NEGLIGIBLE = 1e-3
"""Probability of sets that need not be looked at."""


def pushing(found: LawAlongMotion, posterior: Posterior) -> Mask:
    """Sets, shape (m,), in whose law dry friction pushes for a part of the way.

    A regression knows friction that depends on something as a force of its own. Its prior is in units of the
    friction that explains the loss of amplitude, so that where dry friction is small it may outgrow this and
    change sign: no friction does. Of the sets that are the most probable, until what is left is negligible.
    """
    law, sets, weight = found.law, found.sets.columns, posterior.weight
    rubs = np.array([column.kind == "friction" or column.of_friction for column in law.columns])
    # one column of friction alone resists
    may_push = (sets & rubs).sum(axis=1) > 1
    work = (-found.path.expected_direction * np.abs(found.path.v))[:, None] * law.forces[:, rubs]
    pushes = np.zeros(len(sets), np.bool_)
    total, left = weight.sum(axis=0), float(weight.sum())
    for k in np.argsort(-total):
        if may_push[k]:
            point = posterior.points[int(np.argmax(weight[:, k]))]
            share = _share_pushed(work @ posterior.mean_law(point, k)[rubs])
            pushes[k] = share > settings.SETTINGS.minor_share
        left -= float(total[k])
        if left < _NEGLIGIBLE * float(total[~pushes].sum()):
            break
    return pushes


def _share_pushed(work: Array) -> float:
    """Share of the work, shape (n,), that is negative."""
    size = float(np.abs(work).sum())
    return float(np.maximum(-work, 0.0).sum()) / size if size > 0.0 else 0.0
