"""Where no candidate explains a record: how far friction is known, and what to measure next.

A posterior over candidates none of which is true gives how well the record separates them, not how far each
is from the truth.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import Summary

__all__ = ["experiment_on_unexplained", "friction_range"]

_BY_VARIABLE = {
    "velocity": "Release it from half and from twice the amplitude, and close the loop on all records "
    "together: a force that belongs to the velocity comes again at the same velocity, and its curve in the "
    "figure of the force left over is the effect to register.",
    "position": "Move the sensor against the machine, release again and compare the force left over: what "
    "stays at its place in the machine is a force (a guide, a cable), what moves along is an error of the "
    "sensor.",
    "amplitude": "Release it from half the amplitude, and close the loop on both records together: a force "
    "that belongs to the amplitude comes again at the same amplitude, one that belongs to the time does not.",
    "time": "Release it again at once without touching it: what follows the time since the release comes "
    "again, what went on in the meantime is warming or wear.",
}
_OF_THE_SENSOR = {"whiteness", "spectrum", "tails"}
"""Tests of the scatter of samples, independent of the motion."""


_OF_RECORDS = (
    "Close the loop on each record by itself, and look for what was not the same between them: mounting, "
    "temperature, wear, the side of the release. Where friction is known to differ, fit it as varying "
    "(--varying-friction, varying_friction=True): its mean and its spread are then found."
)


def experiment_on_unexplained(
    depends_on: str | None, failed: Collection[str], because: Collection[str], records: int
) -> str:
    """A sentence on the measurement that shows where the residual comes from.

    Parameters
    ----------
    depends_on : str or None
        What the force that is left depends on.
    failed : collection of str
        Tests that the residual fails.
    because : collection of str
        What forbids to use the number.
    records : int
        Of how many records.
    """
    if "records" in because:
        return _OF_RECORDS
    if depends_on is not None:
        return _BY_VARIABLE[depends_on]
    if failed and _OF_THE_SENSOR.issuperset(failed):
        return (
            "Record the machine at rest with the same sensor: what scatters the same way there is the "
            "sensor's, what does not comes with the motion."
        )
    if records > 1:
        return (
            "Nothing yet: close the loop on each record by itself first. A knock or a sensor that slipped in "
            "one of them is reported there, and so is friction, which all were taken to share."
        )
    return (
        "Repeat the release twice from the same amplitude, and close the loop on all records together: what "
        "comes again is an effect to look for in the figures of the residual, what does not is a disturbance."
    )


def friction_range(readings: Mapping[str, Array], factor: float, unit: str) -> dict[str, Any]:
    """Return the report's ``friction_range``: lowest and highest mean of a reading, and each reading.

    Parameters
    ----------
    readings : mapping of str to ndarray, shape (k,)
        Draws of friction [N or N m] by each reading of the record, in words.
    factor : float
        From a model's friction to the reported one.
    unit : str
        Of the latter.
    """
    each = [
        {"what": what} | Summary.of_draws(factor * friction, unit).to_dict()
        for what, friction in readings.items()
    ]
    means = [reading["mean"] for reading in each]
    return {"low": min(means), "high": max(means), "unit": unit, "readings": each}
