"""A record as the columns of a law need it, for tests that write down the motion themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import friction_bayes as fb
from friction_bayes.loop.columns.effect_columns import LawColumn
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.parameters import effect_coordinates
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.mechanics.effects import Scales


def moving_record(scales: Scales, *effects: str, block: int = 1) -> MovingRecord:
    """A record with these scales, of means of so many samples; its values do not count."""
    system, rate = scales.system, scales.sampling_rate
    samples = round(scales.duration * rate)
    time = np.arange(samples) / rate
    values = scales.amplitude * (1.0 - 0.5 * time / scales.duration) * np.cos(system.natural_frequency * time)
    record = fb.make_record(time, values, scales.quantity.name)
    (segment,) = cut_records([record], system)
    return MovingRecord.of(replace(segment, values=values, block=block), system, effects, scales)


def shape_of(column: LawColumn, scales: Scales) -> dict[str, float]:
    """Values of the parameters that shape a column."""
    shaping = {shape.name for shape in column.shape}
    coordinates = effect_coordinates(column.effect, scales, 1)
    return {c.name: c.at_score(column.score) for c in coordinates if c.name in shaping}
