"""The paper's own procedure on the same record, and which error source makes it differ.

The procedure is run on the record and on predictions of the final model: sampled finely and without noise,
then sampled as the record is. Each reading differs from the one before by one error source.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.core.summary import TAILS, Summary
from friction_bayes.estimators.estimate import estimate
from friction_bayes.loop import settings
from friction_bayes.loop.data.friction import Distribution
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.records.record import make_record

__all__ = ["paper_procedure"]

_METHOD = "normal-gamma"
_FINE = 400.0
"""Samples a period of the finely sampled prediction: the highest falls short by 1e-5 of the amplitude."""
_NO_WIDTH = 1e-6
"""Width over friction below which samples have no scatter: a single one, or equal steps."""


def paper_procedure(
    model: LoopModel, z: Array, after: Distribution, effects: tuple[str, ...]
) -> dict[str, Any]:
    """Comparison of the paper's procedure with the final friction, on the first record.

    Parameters
    ----------
    model : LoopModel
        The final model, or the nearest to it that can be simulated.
    z : ndarray, shape (p,)
        Its coordinates.
    after : Distribution
        Its friction.
    effects : tuple of str
        Its effects.
    """
    segment = model.segments[0]
    friction = float(after.draws.mean())
    sd = float(after.draws.std())
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
        try:
            read = _read_off(model, clock, _predicted(model, z, clock)).mean
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
    if high - low > float(np.diff(np.quantile(after.draws, TAILS))[0]):
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


def _predicted(model: LoopModel, z: Array, time: Array) -> Array:
    prediction = model.predict_at(z, 0, time)
    if prediction is None:
        raise InputError("prediction", "does not stay finite", "look at the fit")
    return prediction.signal
