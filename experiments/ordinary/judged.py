"""Estimates of an ordinary record, compared with the truth."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from time import process_time
from typing import Any

import xarray as xr

import friction_bayes as fb
from experiments.ordinary.rig import OrdinaryRecord
from friction_bayes.records.record import make_record

__all__ = ["ESTIMATORS", "VERDICT", "judged"]

_OPTIONS: dict[str, dict[str, Any]] = {
    "default": {},
    "no random force": {"random_force": "none"},
    "envelope": {"method": "envelope"},
}
_WITNESS = "witness"
ESTIMATORS = (*_OPTIONS, _WITNESS)
"""Labels of the tables; the last is the default's witness: friction by the loss of amplitude."""

VERDICT: dict[str, tuple[str, str]] = {
    "refused": ("1", "whether the record was refused"),
    "ratio": ("1", "mean of the friction over the true one"),
    "width": ("1", "width of the 90 % interval over the true friction"),
    "covered": ("1", "whether the interval covers the true friction"),
    "covered_in_signal": ("1", "whether it covers what the recorded signal shows: the gain times the truth"),
    "off": ("1", "whether the mean is more than the whole width of the interval off the truth"),
    "warned": ("1", "whether the estimate warned"),
    "force": ("1", "probability of a random force; of the default"),
    "agrees": ("1", "whether the witness agrees with the estimate; of the witness"),
    "elapsed": ("s", "processor time"),
}
"""Unit and meaning of what is kept of an estimator on a record; nan where there is none."""


def judged(ordinary: OrdinaryRecord) -> dict[str, list[float]]:
    """Return the names of :data:`VERDICT`, each a list along :data:`ESTIMATORS`.

    Parameters
    ----------
    ordinary : OrdinaryRecord
        Record and declared system are all that an estimator is given.
    """
    record = make_record(
        ordinary.times, ordinary.values, ordinary.quantity, name="ordinary record", synthetic=True
    )
    system = fb.Oscillator(mass=ordinary.mass, stiffness=ordinary.stiffness)
    verdicts: dict[str, dict[str, float]] = {}
    for label, options in _OPTIONS.items():
        verdict, fields, part = _estimated(record, system, options)
        if fields is not None and ordinary.truth is not None:
            truth = ordinary.truth(*part)
            verdict |= _against_truth(fields["friction"], truth, ordinary.gain)
        verdicts[label] = verdict
        if label == "default":
            verdicts[_WITNESS] = {"refused": 1.0}
            witness = None if fields is None else fields.get("witness")
            if witness is not None:
                verdicts[_WITNESS] = {"refused": 0.0, "agrees": float(witness["agrees"])}
                if ordinary.truth is not None:
                    verdicts[_WITNESS] |= _against_truth(witness["friction"], truth, ordinary.gain)
    return {name: [verdicts[label].get(name, math.nan) for label in ESTIMATORS] for name in VERDICT}


def _estimated(
    record: xr.DataArray, system: fb.Oscillator, options: Mapping[str, Any]
) -> tuple[dict[str, float], dict[str, Any] | None, tuple[float, float]]:
    """Verdict so far, the estimate as plain numbers, and from when to when it took the decay for free."""
    began = process_time()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", fb.RecordWarning)
        try:
            estimate = fb.estimate(record, system, **options)
            fields = estimate.to_dict()
        except fb.InputError:
            return {"refused": 1.0, "elapsed": process_time() - began}, None, (0.0, 0.0)
    elapsed = process_time() - began
    force = fields["random_force"]
    verdict = {
        "refused": 0.0,
        "elapsed": elapsed,
        "warned": float(any(issubclass(each.category, fb.RecordWarning) for each in caught)),
        "force": 0.0 if force is None else force["probability"],
    }
    decay = estimate.decay
    first = float(decay.start_time)
    return verdict, fields, (first, first + float(decay.time[-1]))


def _against_truth(friction: Mapping[str, Any], truth: float, gain: float) -> dict[str, float]:
    low, high = friction["interval90"]
    mean = friction["mean"]
    return {
        "ratio": mean / truth,
        "width": (high - low) / truth,
        "covered": float(low <= truth <= high),
        "covered_in_signal": float(low <= gain * truth <= high),
        "off": float(abs(mean - truth) > high - low),
    }
