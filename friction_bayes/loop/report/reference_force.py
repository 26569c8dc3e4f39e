"""A measured friction force compared with the resisting forces of two models."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_array
from friction_bayes.core.errors import InputError
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.coulomb_fit import CoulombFit

__all__ = ["ResistingForce", "compare_forces", "resisting_force", "validate_force"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ResistingForce:
    """Force that resists the motion of a record under a model, at the samples that it was fitted to.

    Attributes
    ----------
    law : ndarray, shape (n,)
        By the law alone [N or N m].
    fluctuation : ndarray, shape (n,), or None
        Contribution of the random force; None without one.
    direction : ndarray, shape (n,)
        Sign of the velocity, zero at rest.
    """

    law: Array
    fluctuation: Array | None = None
    direction: Array

    @property
    def total(self) -> Array:
        """Law and random force, shape (n,)."""
        return self.law if self.fluctuation is None else self.law + self.fluctuation


def resisting_force(fit: CoulombFit) -> Array:
    """Force that resists the motion of the first record, shape (n,) [N or N m].

    Everything that is not inertia or spring, ``-(m x'' + R(x))``, in the direction of the velocity while it
    takes energy; at rest what holds the system.
    """
    model = fit.model
    time = model.segments[0].time
    x, a = (model.predict_at(fit.z, 0, time, order=order) for order in (0, 2))
    if x is None or a is None:
        raise InputError(model.segments[0].decay.name, "the motion does not stay finite", "look at the fit")
    mass, stiffness = model.mass_and_stiffness(model.record_parameters(fit.z, 0).frequency_ratio)
    spring = stiffness * (np.sin(x.clean) if model.system.pendulum else x.clean)
    return np.asarray(-(mass * a.clean + spring))


def validate_force(segment: Segment, measured: ArrayLike) -> Array:
    """Return a measured force as an array.

    Raises
    ------
    InputError
        If it does not have one finite value for every sample of the record.
    """
    force = finite_array("reference_force", measured)
    if force.shape != segment.kept.shape:
        raise InputError(
            "reference_force",
            f"has shape {force.shape}, {segment.decay.name} has {segment.kept.size} samples",
            "give the force at every sample of the first record",
        )
    return force


def compare_forces(
    before: CoulombFit, after: ResistingForce, measured: Array
) -> tuple[dict[str, Any], tuple[Array, ...]]:
    """Comparison of a measured friction force with two models, over the samples used of the first record.

    Parameters
    ----------
    before : CoulombFit
        The Coulomb model alone.
    after : ResistingForce
        Of the final model; the samples that it has are compared.
    measured : ndarray, shape (n,)
        As from :func:`validate_force`; of either sign, that by which it takes energy is used.

    Returns
    -------
    differences : dict
        Root mean square error ``before`` and ``after``, mean ``level`` of the measured force while moving,
        ``unit``, and the share of the measured force's variance that is ``explained_by_law`` alone and
        ``explained_with_fluctuation`` (None where the final model has none).
    forces : tuple of ndarray
        Measured, before and after, at these samples.
    """
    segment, n, direction = before.model.segments[0], after.law.size, after.direction
    used = segment.of_record(measured)[:n]
    moving = direction != 0.0
    if float(used @ direction) < 0.0:
        used = -used
    forces = (used, resisting_force(before)[:n], after.total)
    differences = {
        "before": float(np.sqrt(np.mean((used - forces[1]) ** 2))),
        "after": float(np.sqrt(np.mean((used - forces[2]) ** 2))),
        "level": float(np.mean((used * direction)[moving])) if moving.any() else math.nan,
        "unit": before.model.system.friction_unit,
        "explained_by_law": _explained(used, after.law),
        "explained_with_fluctuation": None if after.fluctuation is None else _explained(used, after.total),
    }
    return differences, forces


def _explained(measured: Array, model: Array) -> float:
    """Share of the variance of a measured force that a model explains."""
    variance = float(np.var(measured))
    return 1.0 - float(np.mean((measured - model) ** 2)) / variance if variance > 0.0 else math.nan
