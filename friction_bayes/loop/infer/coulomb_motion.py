"""The motion of a record under the Coulomb law that fits it best, about which another law is linearised."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.loop.columns.law_before import LawBefore
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import FRICTION, LOG_FREQUENCY_RATIO
from friction_bayes.loop.infer.coulomb_fit import coulomb_fit
from friction_bayes.loop.infer.moving_record import MovingRecord
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET
from friction_bayes.statespace.smoother import Motion

__all__ = ["CoulombMotion", "coulomb_motion"]


class CoulombMotion(NamedTuple):
    """The frequency of the natural units [rad/s], a motion in these, and the Coulomb law that it follows."""

    w0: float
    motion: Motion
    law: LawBefore


def coulomb_motion(record: MovingRecord) -> CoulombMotion | None:
    """The simulated motion of the Coulomb law that fits the samples of a record best.

    Returns
    -------
    CoulombMotion or None
        None where no such law can be fitted, or its mass stops or does not turn within the samples.
    """
    n = record.samples
    model = LoopModel(record.system, (record.segment,), (SENSOR_OFFSET.name,))
    fit = coulomb_fit(model.of_first_samples([n]))
    if fit is None or math.isfinite(fit.predictions[0].stop_time):
        return None
    w0 = record.system.natural_frequency * math.exp(float(fit.model.value(fit.z, LOG_FREQUENCY_RATIO)))
    moved = fit.predictions[0]
    motion = Motion(
        states=np.column_stack([moved.displacement, moved.velocity / w0, np.zeros(n)]),
        covariance=np.zeros((n, 3, 3)),
        noise=float(np.std(fit.free_residuals[0])) / w0**record.segment.order,
        force_sd=0.0,
        tau=1.0,
    )
    found = record.along(motion, w0, ())
    if found is None:
        return None
    sizes = np.zeros(found.law.scale.size)
    sizes[found.law.dry_friction] = fit.model.value(fit.z, FRICTION) / found.law.unit_force
    return CoulombMotion(w0, motion, found.law.before(sizes, np.zeros(n)))
