"""Coulomb friction alone, fitted to records by simulation: the start of a loop."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import no_decay_fits
from friction_bayes.loop.data.effect_sets import SENSOR_ZERO
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import DISPLACEMENT, FRICTION, LOG_FREQUENCY_RATIO, SHARED, VELOCITY
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.likelihood import NoiseModel
from friction_bayes.loop.simulation.fit import LoopFit, fit_growing_record
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["coulomb_fit", "coulomb_model", "starting_point"]


def coulomb_model(system: Oscillator, segments: tuple[Segment, ...]) -> LoopFit:
    """A fit of Coulomb friction alone, the rest position free, under white noise.

    Parameters
    ----------
    system : Oscillator
    segments : tuple of Segment

    Raises
    ------
    InputError
        If that cannot be fitted.
    """
    fit = coulomb_fit(system, segments)
    if fit is None:
        raise no_decay_fits(", ".join(segment.decay.name for segment in segments), system)
    return fit


def coulomb_fit(
    system: Oscillator, segments: tuple[Segment, ...], samples: Sequence[int] | None = None
) -> LoopFit | None:
    """The same, of the first samples of each record where their numbers are given; None if none can be."""
    model = LoopModel(system, segments, (SENSOR_OFFSET.name,))
    if samples is not None:
        model = model.of_first_samples(samples)
    return fit_growing_record(model, [NoiseModel() for _ in model.segments], starting_point(model))


def starting_point(model: LoopModel) -> Array:
    """Rough coordinates of the Coulomb model, each effect but an error of the sensor's zero at its null."""
    decay = model.segments[0].decay
    drops = []
    z = np.array([c.start for c in model.coordinates])

    def put(value: float, name: str, record: int = SHARED) -> None:
        j = model.index(name, record=record)
        z[j] = model.coordinates[j].coordinate(value)

    for r, segment in enumerate(model.segments):
        drop, displacement, velocity = _drop_and_state(segment)
        drops.append(drop)
        put(displacement, DISPLACEMENT, r)
        put(velocity, VELOCITY, r)
        for name in SENSOR_ZERO.intersection(model.effects):
            j = model.index("offset", effect=name, record=r)
            z[j] = model.coordinates[j].coordinate(segment.decay.rest_position)
    put(float(np.median(drops)) * model.system.stiffness, FRICTION)
    put(math.log(decay.frequency / model.system.natural_frequency), LOG_FREQUENCY_RATIO)
    return model.within_bounds(z)


def _drop_and_state(segment: Segment) -> tuple[float, float, float]:
    """Half the loss of amplitude a half cycle (which is r/k), displacement and velocity at the start."""
    decay = segment.decay
    half = max(int(math.pi / (decay.frequency * decay.step)), 2)
    y = (decay.values - decay.rest_position) / decay.frequency**segment.order
    first, last = (float(np.quantile(np.abs(part), 0.97)) for part in (y[: 2 * half], y[-2 * half :]))
    halves = max(decay.values.size / half - 2.0, 1.0)
    drop = max(first - last, 0.02 * first) / (2.0 * halves)
    amplitude = float(np.sqrt(2.0 * np.mean(y[: 2 * half] ** 2)))
    phase = decay.phase
    return drop, amplitude * math.cos(phase), -amplitude * decay.frequency * math.sin(phase)
