"""A record with the Coulomb model and with its smoothed motion, to be drawn."""

from __future__ import annotations

import numpy as np

from friction_bayes.loop.data.friction import friction_scale
from friction_bayes.loop.infer.coulomb_fit import CoulombFit
from friction_bayes.loop.infer.law_draws import LawDraws
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.report.knock_notes import knock_times
from friction_bayes.loop.report.result import FluctuationTrace, RecordTrace
from friction_bayes.statespace.measured_path import MeasuredPath

__all__ = ["motion_trace"]


def motion_trace(
    fit: ForceFit, before: CoulombFit, r: int, draws: LawDraws, *, fluctuates: bool
) -> RecordTrace:
    """Record ``r`` of the Coulomb model ``before``, and its analysis.

    Parameters
    ----------
    fit : ForceFit
        The record under the most probable candidate.
    before : CoulombFit
    r : int
    draws : LawDraws
        Of the record.
    fluctuates : bool
        Whether that candidate has a random force.
    """
    segment, decay, n = fit.segment, fit.segment.decay, fit.record.samples
    coulomb = before.predictions[r]
    # of the law that was found: the path along which it was evaluated is of the law and force before
    path = MeasuredPath.through(fit.clock.phase, *fit.motion.states[:, :2].T.copy())
    turns = path.turning / fit.w0
    factor, unit = friction_scale(before.model)
    scale = factor * fit.law.unit_force
    fluctuation = FluctuationTrace(
        force=scale * fit.fluctuation,
        sd=scale * fit.fluctuation_sd,
        displacement=path.x,
        velocity=path.v * fit.w0,
        friction=factor * float(np.median(draws.friction)),
        unit=unit,
        knocks=tuple((decay.start_time + a, decay.start_time + b) for a, b in knock_times(fit)),
        fluctuates=fluctuates,
    )
    return RecordTrace(
        name=decay.name,
        unit=decay.unit,
        quantity=decay.quantity.name,
        time=decay.start_time + segment.time[:n],
        signal=segment.values[:n],
        before=coulomb.signal[:n],
        after=fit.smoothed_signal * fit.unit,
        sides=segment.sides[:n],
        phase=np.interp(segment.time[:n], turns, np.arange(turns.size)),
        turning_times_before=decay.start_time + coulomb.turning_times,
        turning_points_before=coulomb.turning_points,
        turning_times=decay.start_time + turns,
        turning_points=path.turning_x,
        fluctuation=fluctuation if fluctuates or fit.knocks else None,
    )
