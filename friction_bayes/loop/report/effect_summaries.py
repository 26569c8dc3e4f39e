"""Parameters of an effect in the report: mean, standard deviation and unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.mechanics.effects import EFFECTS, ForceEffect, ProcessEffect
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = [
    "line_summary",
    "of_force",
    "parameter_summary",
    "parameter_units",
    "sensor_parameters",
]


_WITHOUT_SIZE = ("1", "s", "Hz")
"""Units of parameters that do not scale with the displacement."""


def parameter_units(name: str, segment: Segment, system: Oscillator) -> dict[str, str]:
    """Unit of each parameter of an effect, by name.

    For a signal that is not calibrated those of a force are as if its unit were that of the quantity, and
    marked so.
    """
    decay, effect = segment.decay, EFFECTS[name]
    units = {p.name: p.unit_in(system, decay.unit) for p in effect.parameters}
    if decay.calibrated or not isinstance(effect, ForceEffect | ProcessEffect):
        return units
    taken = f" (1 {decay.unit} as 1 {decay.quantity.unit})"
    return {p: unit if unit in _WITHOUT_SIZE else unit + taken for p, unit in units.items()}


def of_force(name: str, segment: Segment) -> frozenset[str]:
    """Parameters of an effect that go with the factor to force; none where that is one of the unit taken."""
    return frozenset(p.name for p in EFFECTS[name].parameters if p.of_force and segment.decay.calibrated)


def parameter_summary(draws: Array, unit: str) -> dict[str, Any]:
    """Mean, standard deviation and unit; not a number where there are too few draws."""
    return {
        "mean": float(draws.mean()) if draws.size else math.nan,
        # a parameter evaluated at one value has no spread, not that of rounding
        "sd": float(draws.std(ddof=1) if np.ptp(draws) > 0.0 else 0.0) if draws.size > 1 else math.nan,
        "unit": unit,
    }


def line_summary(record: int, drawn: Mapping[str, Array], unit: str) -> dict[str, Any]:
    """A line in the spectrum of one record: frequency, decay time (None where it lasts) and amplitude.

    Drawn are its ``frequency``, ``amplitude`` and, of one that dies out, ``decay_time``.
    """
    decay_time = drawn.get("decay_time")
    return {
        "record": record,
        "frequency": parameter_summary(drawn["frequency"], "Hz"),
        "decay_time": None if decay_time is None else parameter_summary(decay_time, "s"),
        "amplitude": parameter_summary(drawn["amplitude"], unit),
    }


def sensor_parameters(name: str, fit: ForceFit, units: dict[str, str]) -> dict[str, dict[str, Any]]:
    """The level at which samples are clipped, or fraction and scale of outliers; empty without any."""
    segment, noise = fit.segment, fit.sensor_noise.outliers
    if name == SENSOR_CLIPPING.name:
        if not segment.clipped:
            return {}
        level = float(np.abs(segment.values[segment.sides != 0.0]).max())
        return {"level": {"mean": level, "sd": 0.0, "unit": units["level"]}}
    if noise is None:
        return {}
    samples = max(fit.record.samples, 1)
    count = max(noise.fraction * samples, 1.0)
    sds = {
        "fraction": math.sqrt(noise.fraction * (1.0 - noise.fraction) / samples),
        "scale": noise.scale / math.sqrt(2.0 * count),
    }
    return {name: {"mean": getattr(noise, name), "sd": sd, "unit": units[name]} for name, sd in sds.items()}
