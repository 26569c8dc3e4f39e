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
from friction_bayes.loop.data.effect_sets import searched
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import Segment, cut_records
from friction_bayes.loop.infer.moving_record import why_not_weighed
from friction_bayes.loop.mixture.families import Candidates, candidates_of
from friction_bayes.loop.report.reference_force import validate_force
from friction_bayes.loop.report.result import LoopReport
from friction_bayes.mechanics.effects import EFFECTS

__all__ = ["run"]

_ALONG_MOTION = (
    "it is weighed along the measured motion, which takes random_force among the effects, "
    "noise and random_force left at auto, and a record that has noise and four turning points, does not clip "
    "and whose motion no error of the sensor stands for"
)
"""Why an effect that the search does not try was not weighed."""


def run(
    records: Sequence[xr.DataArray],
    system: Oscillator,
    options: LoopOptions,
    reference_force: ArrayLike | None,
    progress: Callable[[str], None] | None,
) -> LoopReport:
    """Close the loop on some records; see :func:`friction_bayes.close_loop`."""
    started = time.perf_counter()
    options.validate(records)
    segments = cut_records(records, system)
    force = None if reference_force is None else validate_force(segments[0], reference_force)
    system = _calibrated(system, segments)
    scales = scales_of(segments, system)
    barred = {name: why for name in options.allowed if (why := why_not_weighed(name, segments[0], scales))}
    named = searched(options.allowed, named=options.effects is not None)
    tried = tuple(name for name in named if name not in barred)
    *rngs, rng_report, rng_joint = np.random.default_rng(options.seed).spawn(4)
    found = candidates_of(segments, system, options, tried, (*rngs, rng_joint), progress)
    report = build_report(
        found.before, found.families, rng_report, options=options, started=started, reference_force=force
    )
    if options.effects is None:
        return report
    return replace(report, notes=(*report.notes, *_not_evaluated(options.allowed, barred, found)))


def _not_evaluated(allowed: Sequence[str], barred: dict[str, str], found: Candidates) -> tuple[str, ...]:
    """Say which effects were asked for and could not be evaluated, and why."""
    left = () if found.along_motion else (name for name in allowed if EFFECTS[name].search == "never")
    reasons = dict.fromkeys(left, _ALONG_MOTION) | barred
    return tuple(
        f"{words(name)} was asked for and not weighed: {reason}" for name, reason in sorted(reasons.items())
    )


def _calibrated(system: Oscillator, segments: tuple[Segment, ...]) -> Oscillator:
    """The system, a pendulum as its small swings where the signal is not calibrated.

    How far it swings is then unknown, and the sine of a voltage means nothing.
    """
    if system.pendulum and segments[0].decay.unit in UNCALIBRATED_UNITS:
        return Oscillator(**asdict(system))
    return system
