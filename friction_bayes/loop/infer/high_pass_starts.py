"""Laws behind the high passes that a record may have gone through, from which rounds start.

Found along motions of dry friction as :func:`friction_bayes.estimate` finds them
(:mod:`friction_bayes.estimators.noise.behind_high_passes`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from friction_bayes.estimators.noise.behind_high_passes import likelier_high_passes
from friction_bayes.estimators.noise.coulomb_regression import Laid, PlainDecay, PreparedDecay
from friction_bayes.estimators.noise.recording_filters import RecordingFilter, blended
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.infer.coulomb_fit import CoulombStart
from friction_bayes.loop.infer.rounds import Round
from friction_bayes.loop.noise.correlated_noise import NO_ERROR

__all__ = ["high_pass_starts"]


def high_pass_starts(whole: MovingRecord, coulomb: CoulombStart) -> list[Round]:
    """The first rounds behind the means of likely high passes, one for each order; none behind none.

    High passes of one order differ in their corners, those of several orders in what they remember.
    """
    decay = _plain_decay(whole, coulomb)
    if not decay.usable:
        return []
    laid = PreparedDecay(decay).along_fit()
    orders: dict[int, list[tuple[float, RecordingFilter, Laid]]] = {}
    for share, filter_, behind in likelier_high_passes(laid, laid):
        orders.setdefault(filter_.remembered, []).append((share, filter_, behind))
    found = []
    for alike in orders.values():
        mean = blended([(share, filter_) for share, filter_, _ in alike], laid.read)
        likeliest = alike[0][2]
        record = replace(whole.behind(mean), error=NO_ERROR)
        if likeliest.signal.size == whole.samples:
            found.append(Round.starting(record, likeliest.frequency, likeliest.regression.motion))
        else:
            # where the mass may stick the motion behind it is not known
            found.append(Round.starting(record, *coulomb))
    return [each for each in found if each is not None]


def _plain_decay(whole: MovingRecord, coulomb: CoulombStart) -> PlainDecay:
    segment, n = whole.segment, whole.samples
    unit = coulomb.w0**segment.order
    missing = segment.ignored[:n] & ~segment.near_jumps[:n]
    return PlainDecay(
        values=np.where(missing, np.nan, segment.values[:n]),
        time=segment.time[:n] - segment.time[0],
        order=segment.order,
        frequency=coulomb.w0,
        coefficient=coulomb.law.friction * unit,
        rest_position=segment.decay.rest_position,
        states=unit * coulomb.motion.states[:, :2],
        phase_sd=0.0,
        pendulum=whole.system.pendulum,
        noise_sd=coulomb.motion.noise * unit,
    )
