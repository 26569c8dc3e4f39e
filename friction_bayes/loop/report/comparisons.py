"""The result compared: with a friction or a force known from elsewhere, and with the paper's own procedure.

The paper's procedure is run on the record and on predictions of the final model: sampled finely and without
noise, then sampled as the record is. Each reading differs from the one before by one error source.
"""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_array
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.core.summary import TAILS, Summary
from friction_bayes.estimators.estimate import estimate
from friction_bayes.loop import settings
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.coulomb_fit import CoulombFit
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.report.result import FluctuationTrace
from friction_bayes.records.record import make_record

__all__ = [
    "compare_forces",
    "compare_frictions",
    "paper_procedure",
    "validate_force",
]

_METHOD = "normal-gamma"
_FINE = 400.0
"""Samples a period of the finely sampled prediction: the highest falls short by 1e-5 of the amplitude."""
_NO_WIDTH = 1e-6
"""Width over friction below which samples have no scatter: a single one, or equal steps."""


def _resisting_force(fit: CoulombFit) -> Array:
    """Force that resists the motion of the first record, shape (n,) [N or N m].

    Everything that is not inertia or spring, ``-(m x'' + R(x))``, in the direction of the velocity while it
    takes energy; at rest what holds the system.
    """
    model = fit.model
    moved = model.predict_at(fit.z, 0, model.segments[0].time, order=2)
    assert moved is not None
    mass, stiffness = model.mass_and_stiffness(math.exp(float(model.value(fit.z, LOG_FREQUENCY_RATIO))))
    x = np.sin(moved.displacement) if model.system.pendulum else moved.displacement
    return np.asarray(-(mass * moved.clean + stiffness * x))


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


def compare_frictions(after: Array, before: Array, friction: float) -> dict[str, Any]:
    """Comparison of draws with a friction known from elsewhere."""
    low, high = np.quantile(after, TAILS)
    return {
        "friction": friction,
        "error_before": float(before.mean()) / friction - 1.0,
        "error_after": float(after.mean()) / friction - 1.0,
        "within_interval90": bool(low <= friction <= high),
    }


def compare_forces(
    before: CoulombFit, fit: ForceFit, fluctuates: FluctuationTrace | None, measured: Array, factor: float
) -> tuple[dict[str, Any], tuple[Array, ...]]:
    """Comparison of a measured friction force with two models, over the samples used of the first record.

    Of either sign of the force, shape (recorded,), that by which it takes energy is used. Forces of the model
    ``before`` and of the final ``fit`` times ``factor`` are reported, that which ``fluctuates`` as it is.

    Returns
    -------
    differences : dict
        Root mean square error ``before`` and ``after``, mean ``level`` of the measured force while moving,
        ``unit``, and the share of the measured force's variance that is ``explained_by_law`` alone and
        ``explained_with_fluctuation`` (None where the final model has none).
    forces : tuple of ndarray
        Measured, before and after, at these samples.
    """
    known, resists = fit.record.known, -factor * fit.law.unit_force
    own = fit.law.resisting
    law = resists * (fit.law.forces[known, own] @ fit.coefficients[own])
    total = law if fluctuates is None else law - fluctuates.force
    used, direction = before.model.segments[0].of_record(measured)[known], np.sign(fit.path.v[known])
    moving = direction != 0.0
    if float(used @ direction) < 0.0:
        used = -used
    forces = (used, factor * _resisting_force(before)[known], total)
    differences = {
        "before": float(np.sqrt(np.mean((used - forces[1]) ** 2))),
        "after": float(np.sqrt(np.mean((used - forces[2]) ** 2))),
        "level": float(np.mean((used * direction)[moving])) if moving.any() else math.nan,
        "unit": before.model.segments[0].decay.friction_unit,
        "explained_by_law": _explained(used, law),
        "explained_with_fluctuation": None if fluctuates is None else _explained(used, total),
    }
    return differences, forces


def _explained(measured: Array, model: Array) -> float:
    """Share of the variance of a measured force that a model explains."""
    variance = float(np.var(measured))
    return 1.0 - float(np.mean((measured - model) ** 2)) / variance if variance > 0.0 else math.nan


def paper_procedure(model: LoopModel, z: Array, after: Array, effects: tuple[str, ...]) -> dict[str, Any]:
    """Comparison of the paper's procedure with draws of the final friction, on the first record.

    The model, at coordinates ``z``, shape (p,), is the final one with its ``effects``, or the nearest to it
    that can be simulated.
    """
    segment = model.segments[0]
    friction, sd = float(after.mean()), float(after.std())
    try:
        said = _read_off(model, segment.time, segment.values)
    except InputError as error:
        unusable = ["sensor_clipping"] if segment.clipped else []
        # the remedy that estimate names is this loop
        return {"friction": None, "disagrees": True, "because": unusable, "why": error.problem}
    moving = segment.time[: segment.moving]
    period = 2.0 * np.pi / segment.decay.frequency
    fine = np.linspace(0.0, moving[-1], int(_FINE * moving[-1] / period))
    shares: dict[str, float] = {}
    last = friction
    for source, clock in (("effects", fine), ("coarse_sampling", moving)):
        predicted = model.predict_at(z, 0, clock)
        if predicted is None:
            continue
        try:
            read = _read_off(model, clock, predicted.signal).mean
        except InputError:
            continue
        shares[source] = read - last
        last = read
    shares["noise_lifts_maxima"] = said.mean - last
    low, high = said.interval90
    least = max(settings.SETTINGS.same_friction * friction, settings.SETTINGS.unseen * sd)
    measures = high - low > _NO_WIDTH * abs(said.mean)
    outside = measures and not low <= friction <= high
    disagrees = bool(abs(said.mean - friction) > least or outside)
    sources = [source for source, share in shares.items() if abs(share) > least]
    if disagrees and not sources:
        # none exceeds the uncertainty of friction: the largest is named
        sources = [max(shares, key=lambda source: abs(shares[source]))]
    because: list[str] = []
    for source in sources:
        because += effects if source == "effects" else [source]
    if high - low > float(np.diff(np.quantile(after, TAILS))[0]):
        because.append("telescoping_drops")
    if not measures:
        because.append("no_scatter")
    return {
        "friction": said.to_dict(),
        "disagrees": disagrees,
        "because": because,
        "shares": shares,
    }


def _read_off(model: LoopModel, time: Array, values: Array) -> Summary:
    decay = model.segments[0].decay
    record = make_record(time, values, decay.quantity.name, unit=decay.unit, name=decay.name)
    with warnings.catch_warnings():
        # warnings of an estimate, mostly of a wrong frequency, are handled by the loop
        warnings.simplefilter("ignore", RecordWarning)
        estimated = estimate(record, model.system, method=_METHOD)
    return Summary.of_distribution(estimated.friction, estimated.friction_unit)
