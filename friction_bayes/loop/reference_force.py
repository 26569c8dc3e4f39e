"""A measured friction force beside the resisting forces of two models."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_array
from friction_bayes.core.errors import InputError
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.segment import Segment
from friction_bayes.mechanics.effects.cubic_stiffness import CUBIC_STIFFNESS

__all__ = ["compare_forces", "resisting_force", "validate_force"]


def resisting_force(fit: LoopFit) -> Array:
    """Force that resists the motion of the first record, shape (n,) [N or N m].

    Everything that is not inertia or spring, ``-(m x'' + R(x))``, in the direction of the velocity while it
    takes energy; at rest what holds the system.
    """
    model = fit.model
    time = model.segments[0].time
    x, a = (model.predict_at(fit.z, 0, time, order=order) for order in (0, 2))
    if x is None or a is None:
        raise InputError(model.segments[0].decay.name, "the motion does not stay finite", "look at the fit")
    values = model.record_parameters(fit.z, 0)
    mass, stiffness = model.mass_and_stiffness(values.frequency_ratio)
    spring = stiffness * (np.sin(x.clean) if model.system.pendulum else x.clean)
    for cubic_stiffness in values.effects.get(CUBIC_STIFFNESS.name, ()):
        spring = spring + cubic_stiffness * x.clean**3
    return np.asarray(-(mass * a.clean + spring))


def validate_force(segment: Segment, measured: ArrayLike) -> Array:
    """Return a measured force as an array.

    Raises
    ------
    InputError
        If it does not have one finite value for every sample of the record.
    """
    force = finite_array("reference_force", measured)
    if force.shape != (segment.recorded,):
        raise InputError(
            "reference_force",
            f"has shape {force.shape}, {segment.decay.name} has {segment.recorded} samples",
            "give the force at every sample of the first record",
        )
    return force


def compare_forces(
    before: LoopFit, after: LoopFit, measured: Array
) -> tuple[dict[str, Any], tuple[Array, ...]]:
    """Compare a measured friction force with two models, over the samples used of the first record.

    Parameters
    ----------
    before, after : LoopFit
    measured : ndarray, shape (n,)
        As from :func:`validate_force`; of either sign, that by which it takes energy is used.

    Returns
    -------
    differences : dict
        Root mean square error ``before`` and ``after``, mean level of the measured force while moving, unit.
    forces : tuple of ndarray
        Measured, before and after, at the samples used.
    """
    segment = after.model.segments[0]
    used = segment.of_record(measured)
    direction = after.predictions[0].direction
    moving = direction != 0.0
    if float(used @ direction) < 0.0:
        used = -used
    forces = (used, resisting_force(before), resisting_force(after))
    differences = {
        "before": float(np.sqrt(np.mean((used - forces[1]) ** 2))),
        "after": float(np.sqrt(np.mean((used - forces[2]) ** 2))),
        "level": float(np.mean((used * direction)[moving])) if moving.any() else math.nan,
        "unit": after.model.system.friction_unit,
    }
    return differences, forces
