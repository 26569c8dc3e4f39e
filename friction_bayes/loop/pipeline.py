"""The path of a closed loop: records, effects that may act, candidates, report."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import words
from friction_bayes.loop.build_report import build_report
from friction_bayes.loop.columns.moving_record import why_not_evaluated
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import Segment, cut_records
from friction_bayes.loop.mixture.candidates import candidates_of
from friction_bayes.loop.report.reference_force import validate_force
from friction_bayes.loop.report.result import LoopReport
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["run_loop"]


def run_loop(
    records: Sequence[xr.DataArray],
    system: Oscillator,
    options: LoopOptions,
    reference_force: ArrayLike | None,
    progress: Callable[[str], None] | None,
) -> LoopReport:
    """The report on some records; see :func:`friction_bayes.close_loop`."""
    started = time.perf_counter()
    options.validate(records)
    segments = cut_records(records, system)
    if SENSOR_CLIPPING.name not in options.allowed:
        # without that effect samples at an end of the range count as measured
        segments = tuple(replace(segment, sides=np.zeros_like(segment.sides)) for segment in segments)
    force = None if reference_force is None else validate_force(segments[0], reference_force)
    system = _calibrated(system, segments)
    scales = scales_of(segments, system)
    rng, rng_report = np.random.default_rng(options.seed).spawn(2)
    candidates = candidates_of(segments, system, options, rng, progress)
    report = build_report(candidates, rng_report, options=options, started=started, reference_force=force)
    if options.effects is None:
        return report
    barred = {name: why for name in options.allowed if (why := why_not_evaluated(name, segments[0], scales))}
    notes = (f"{words(name)} was requested and not evaluated: {why}" for name, why in sorted(barred.items()))
    return replace(report, notes=(*report.notes, *notes))


def _calibrated(system: Oscillator, segments: tuple[Segment, ...]) -> Oscillator:
    """The system, a pendulum as its small swings where the signal is not calibrated.

    How far it swings is then unknown, and the sine of a voltage means nothing.
    """
    if system.pendulum and segments[0].decay.unit in UNCALIBRATED_UNITS:
        return Oscillator(**asdict(system))
    return system
