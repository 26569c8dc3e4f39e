"""A record with the Coulomb model and with its smoothed motion, to be drawn, and its knocks in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from friction_bayes.loop.infer.coulomb_fit import CoulombFit
from friction_bayes.loop.infer.law_draws import LawDraws
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.report.result import FluctuationTrace, RecordTrace
from friction_bayes.statespace.measured_path import MeasuredPath

__all__ = ["knock_notes", "knock_times", "motion_trace"]


def motion_trace(
    fit: ForceFit, before: CoulombFit, r: int, draws: LawDraws, *, factor: float, fluctuates: bool
) -> RecordTrace:
    """Record ``r`` of the Coulomb model ``before``, and its analysis under the most probable candidate.

    A model's friction times ``factor`` is reported.
    Whether that candidate has a random force is said by ``fluctuates``. Samples in which a filter shows what
    lies outside the record are left out.
    """
    segment, decay, known = fit.segment, fit.segment.decay, fit.record.known
    coulomb = before.predictions[r]
    # of the law that was found: the path along which it was evaluated is of the law and force before
    path = MeasuredPath.through(fit.clock.phase, *fit.motion.states[:, :2].T.copy())
    turns = path.turning / fit.w0
    scale = factor * fit.law.unit_force
    fluctuation = FluctuationTrace(
        force=scale * fit.fluctuation[known],
        sd=scale * np.sqrt(fit.motion.covariance[known, 2, 2]),
        displacement=path.x[known],
        velocity=path.v[known] * fit.w0,
        friction=factor * float(np.median(draws.friction)),
        unit=decay.friction_unit,
        knocks=tuple((decay.start_time + a, decay.start_time + b) for a, b in knock_times(fit)),
        fluctuates=fluctuates,
    )
    return RecordTrace(
        name=decay.name,
        unit=decay.unit,
        quantity=decay.quantity.name,
        time=decay.start_time + segment.time[known],
        signal=segment.values[known],
        before=coulomb.signal[known],
        after=fit.smoothed_signal[known] * fit.unit,
        sides=segment.sides[known],
        phase=np.interp(segment.time[known], turns, np.arange(turns.size)),
        turning_times_before=decay.start_time + coulomb.turning_times,
        turning_points_before=coulomb.turning_points,
        turning_times=decay.start_time + turns,
        turning_points=path.turning_x,
        fluctuation=fluctuation if fluctuates or fit.knocks else None,
    )


def knock_times(fit: ForceFit) -> list[tuple[float, float]]:
    """Start and end of each knock [s], from the first sample of the decay on."""
    time = fit.segment.time
    return [(float(time[a]), float(time[b])) for a, b in fit.knocks]


def knock_notes(fit: ForceFit, unit_force: float, unit: str) -> Iterator[str]:
    """Sentences on each knock: its time and size, the force of natural units being ``unit_force``."""
    decay = fit.segment.decay
    for (start, end), (a, b) in zip(knock_times(fit), fit.knocks, strict=True):
        # not its level: a constant force shifts the rest position, which an accelerometer does not show
        change = unit_force * float(np.ptp(fit.fluctuation[a : b + 1]))
        yield (
            f"{decay.name}: knocked at {decay.start_time + start:.4g} s: for {end - start:.2g} s a force "
            f"acts that the rest of the record does not show, and that changes by {change:.3g} {unit}; "
            "friction and the random force are estimated without it"
        )
