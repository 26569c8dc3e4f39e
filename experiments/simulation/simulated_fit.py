"""A law fitted by simulating its motion, effects and all, for what is evaluated along a motion to meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from experiments.simulation.coordinates import bounds_of, is_angle, start_of
from experiments.simulation.fit import LoopFit, fit_model, settle
from experiments.simulation.objective import NoiseModel
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.coulomb_fit import coulomb_mode
from friction_bayes.mechanics.effects import (
    EFFECTS,
    NoiseEffect,
    ProcessEffect,
    SensorEffect,
    in_catalogue_order,
)
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["simulated_fit"]


def simulated_fit(
    segment: Segment, system: Oscillator, names: Sequence[str], planted: Mapping[str, float]
) -> LoopFit:
    """Fit Coulomb friction with some effects to a record.

    The fit starts from that without them: their parameters at the null, and at the sizes that were
    ``planted``, by ``effect.parameter``, angles at each quarter turn. A line has no slope at the null, nor
    has the shape of a force; and angles are those at the first sample that is fitted.

    Raises
    ------
    RuntimeError
        If none of them ends at a motion that stays finite.
    """
    noise = [NoiseModel(outliers=OUTLIERS.name in names, censored=SENSOR_CLIPPING.name in names)]
    plain = LoopModel(system, (segment,))
    base = coulomb_mode(plain)
    if base is None:
        raise RuntimeError("no fit of the Coulomb model")
    model = LoopModel(system, (segment,), in_catalogue_order(list(filter(_changes_signal, names))))
    more = model.coordinates[base.z.size :]
    sizes = [c.coordinate(planted.get(f"{c.effect}.{c.name}", float(c.value(start_of(c))))) for c in more]
    turns = (0.0, 0.25, 0.5, 0.75) if any(map(is_angle, more)) else (0.0,)
    starts = [[start_of(c) for c in more]]
    starts += [[turn if is_angle(c) else z for c, z in zip(more, sizes, strict=True)] for turn in turns]
    begun = (np.clip(np.append(base.z, start), *bounds_of(model)) for start in starts)
    fits = [fit for z in begun if (fit := fit_model(model, noise, z)) is not None]
    if not fits:
        raise RuntimeError(f"no fit with {', '.join(names)}")
    return settle(min(fits, key=lambda fit: fit.objective))


def _changes_signal(name: str) -> bool:
    """Whether an effect changes the predicted signal: not if random, or acting after the noise."""
    effect = EFFECTS[name]
    return not (
        isinstance(effect, NoiseEffect | ProcessEffect)
        or (isinstance(effect, SensorEffect) and effect.after_noise)
    )
