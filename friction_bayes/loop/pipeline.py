"""Close the loop: records, effects that may act, candidates, report."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.core.text import words
from friction_bayes.loop.build_report import build_report
from friction_bayes.loop.columns.moving_record import why_not_evaluated
from friction_bayes.loop.data.options import TOLERANCE, LoopOptions
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import Segment, cut_records, rather_free
from friction_bayes.loop.mixture.candidates import candidates_of
from friction_bayes.loop.report.comparisons import validate_force
from friction_bayes.loop.report.result import LoopReport
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["close_loop"]


@single_threaded_blas()
def close_loop(
    records: xr.DataArray | Sequence[xr.DataArray],
    system: Oscillator,
    *,
    seed: int = 1,
    effects: Sequence[str] | None = None,
    exclude: Sequence[str] = (),
    noise: str = "auto",
    random_force: str = "auto",
    varying_friction: bool = False,
    tolerance: float = TOLERANCE,
    check: bool = False,
    reference_friction: float | None = None,
    reference_force: ArrayLike | None = None,
    progress: Callable[[str], None] | None = None,
) -> LoopReport:
    """Return which effects a Coulomb model of one or more free decays lacks, and their probabilities.

    Parameters
    ----------
    records : xarray.DataArray or sequence of xarray.DataArray
        One record, or several of one system and one quantity, fitted together: shared physics, own initial
        states, sensor effects, drifts of friction and noise.
    system : Oscillator
        The declared system.
    seed : int
        Seed of the draws; same seed, same report, which names it.
    effects : sequence of str, optional
        Effects that may be tried; all of the catalogue, those registered from outside too, when left out.
    exclude : sequence of str
        Effects that may not.
    noise : {"auto", "white", "ar"}
        Whether the sensor noise is white, coloured where the residual of the law is, or as the record shows.
    random_force : {"auto", "none"}
        Whether candidates with a random force are evaluated too.
    varying_friction : bool
        Assume that friction differs between the records: each one's is drawn from one normal distribution,
        whose mean is the friction reported. Otherwise the evidence decides whether it does, where several
        records are evaluated along their motions.
    tolerance : float
        Root mean square of a force that follows the motion, over friction, below which a law with a random
        force counts as complete although a test detects that force; share of the loss of amplitude from
        which on dry friction matters.
    check : bool
        Sample the most probable candidate with emcee too; no other number depends on it.
    reference_friction : float, optional
        Friction known from elsewhere [N or N m], compared with.
    reference_force : array_like, shape (n,), optional
        Measured friction force at the samples of the first record [N or N m].
    progress : callable, optional
        Called with the name of each record or set of effects that is fitted.

    Returns
    -------
    LoopReport

    Raises
    ------
    InputError
        If a record or an option is unusable, or no Coulomb decay can be fitted.
    """
    started = time.perf_counter()
    options = LoopOptions(
        seed=seed,
        effects=None if effects is None else tuple(effects),
        exclude=tuple(exclude),
        noise=noise,
        random_force=random_force,
        varying_friction=varying_friction,
        tolerance=tolerance,
        check=check,
        reference_friction=reference_friction,
    )
    given = (records,) if isinstance(records, xr.DataArray) else records
    system = check_system(system)
    options.validate(given)
    segments = cut_records(given, system)
    if SENSOR_CLIPPING.name not in options.allowed:
        # without that effect samples at an end of the range count as measured
        segments = tuple(replace(segment, sides=np.zeros_like(segment.sides)) for segment in segments)
    force = None if reference_force is None else validate_force(segments[0], reference_force)
    system = _calibrated(system, segments)
    scales = scales_of(segments, system)
    rng, rng_report = np.random.default_rng(options.seed).spawn(2)
    candidates = candidates_of(segments, system, options, rng, progress)
    if candidates.needs_more:
        # what is left of it may be too short
        with suppress(InputError):
            if (free := _while_free(given, segments, system)) != segments:
                candidates = candidates_of(free, system, options, rng, progress)
    report = build_report(candidates, rng_report, options=options, started=started, reference_force=force)
    if options.effects is None:
        return report
    barred = {name: why for name in options.allowed if (why := why_not_evaluated(name, segments[0], scales))}
    notes = (f"{words(name)} was requested and not evaluated: {why}" for name, why in sorted(barred.items()))
    return replace(report, notes=(*report.notes, *notes))


def _while_free(
    records: Sequence[xr.DataArray], segments: tuple[Segment, ...], system: Oscillator
) -> tuple[Segment, ...]:
    """The segments without the half cycles in which something rather held the mass, or stopped it."""
    return tuple(
        segment if (free := rather_free(segment)) is None else segment.only(free, record, system)
        for record, segment in zip(records, segments, strict=True)
    )


def _calibrated(system: Oscillator, segments: tuple[Segment, ...]) -> Oscillator:
    """The system, a pendulum as its small swings where the signal is not calibrated.

    How far it swings is then unknown, and the sine of a voltage means nothing.
    """
    if system.pendulum and not segments[0].decay.calibrated:
        return Oscillator(**asdict(system))
    return system
