"""Coulomb friction alone, fitted to records by simulation: the start of a loop."""

from __future__ import annotations

from collections.abc import Sequence

from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import no_decay_fits
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.data.starting_point import starting_point
from friction_bayes.loop.noise.likelihood import NoiseModel
from friction_bayes.loop.simulation.fit import LoopFit, fit_growing_record
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["coulomb_fit", "coulomb_model"]


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
