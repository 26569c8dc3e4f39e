"""Close the loop: find the residual, trace it, add the effect, report the error before and after."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.assemble import SearchResult, assemble_report
from friction_bayes.loop.autoregression import fit_autoregression, is_coloured
from friction_bayes.loop.evidence import posterior_probabilities
from friction_bayes.loop.fit import LoopFit, fit_growing_record, starting_point
from friction_bayes.loop.model import LoopModel
from friction_bayes.loop.noise import NoiseModel
from friction_bayes.loop.reference_force import validate_force
from friction_bayes.loop.result import LoopReport
from friction_bayes.loop.search import Search
from friction_bayes.loop.segment import Segment, cut_records
from friction_bayes.mechanics.effects import EFFECTS, effect_named
from friction_bayes.mechanics.effects.outliers import OUTLIERS

__all__ = ["close_loop"]

NOISES = ("auto", "white", "ar")


def close_loop(
    records: Sequence[xr.DataArray],
    system: Oscillator,
    *,
    seed: int,
    effects: Sequence[str] | None = None,
    exclude: Sequence[str] = (),
    noise: str = "auto",
    check: bool = False,
    reference_friction: float | None = None,
    reference_force: ArrayLike | None = None,
    progress: Callable[[str], None] | None = None,
) -> LoopReport:
    """Find what a Coulomb model of one or more free decays lacks, and how probable each explanation is.

    Parameters
    ----------
    records : sequence of xarray.DataArray
        Records of one system and one quantity, fitted together: shared physics, own initial states, sensor
        faults and noise.
    system : Oscillator
        The declared system.
    seed : int
        Seed of the draws; same seed, same report.
    effects : sequence of str, optional
        Effects that may be tried; all of the catalogue, those registered from outside too, when left out.
    exclude : sequence of str
        Effects that may not.
    noise : {"auto", "white", "ar"}
        White, autoregressive, or decided by the residual where the motion has no part in it.
    check : bool
        Sample the final posterior with emcee too.
    reference_friction : float, optional
        Friction known from elsewhere [N or N m], compared with.
    reference_force : array_like, shape (n,), optional
        Measured friction force at the samples of the first record [N or N m].
    progress : callable, optional
        Told what is being fitted.

    Returns
    -------
    LoopReport

    Raises
    ------
    InputError
        If a record or an option is unusable, or no Coulomb decay can be fitted.
    """
    started = time.perf_counter()
    if noise not in NOISES:
        raise InputError("noise", f"unknown choice {noise!r}", f"give one of {', '.join(NOISES)}")
    if reference_friction is not None:
        positive("reference_friction", reference_friction)
    allowed = _allowed(effects, exclude)
    segments = cut_records(records, system)
    if system.pendulum and segments[0].decay.unit in UNCALIBRATED_UNITS:
        # how far it swings is not known, and the sine of volts is nothing
        system = Oscillator(**asdict(system))
    force = None if reference_force is None else validate_force(segments[0], reference_force)
    white = tuple(np.zeros(0) for _ in segments)
    search = Search(system, segments, allowed, white, progress)
    _run(search)
    trail = list(search.trail)
    coloured = noise == "ar"
    if noise == "auto":
        best = search.ranked()[0].fit
        coloured = any(
            is_coloured(e, s.decay.step, s.decay.frequency)
            for e, s in zip(best.residuals, segments, strict=True)
        )
    ar = white
    if coloured:
        ar = _shared_colour(segments, search.ranked()[0].fit.residuals)
        trail.append(f"noise is autoregressive of order {max(a.size for a in ar)}: searched again")
        # an outlier of a coloured signal is none of its innovations: it spoils as many as the order is
        kept = tuple(name for name in allowed if name != OUTLIERS.name)
        white_search, search = search, Search(system, segments, kept, ar, progress)
        search.start_from(white_search)
        _run(search)
        trail += search.trail
    ranked = search.ranked()
    fits = [c.fit for c in ranked]
    weights = np.array([c.log_weight for c in ranked])
    sets = [c.effects for c in ranked]
    probabilities = posterior_probabilities(fits, weights)
    before = _coulomb_alone(search, system, segments, ar)
    if frozenset() not in sets:
        # held values have no probability under a sensor that does not clip
        sets.append(frozenset())
        fits.append(before)
        probabilities = np.append(probabilities, 0.0)
    found = SearchResult(
        sets=tuple(sets),
        fits=tuple(fits),
        probabilities=probabilities,
        before=before,
        ar=ar,
        trail=tuple(trail),
    )
    return assemble_report(
        found,
        seed=seed,
        started=started,
        check=check,
        reference_friction=reference_friction,
        reference_force=force,
    )


def _shared_colour(segments: tuple[Segment, ...], residuals: Sequence[Array]) -> tuple[Array, ...]:
    """One autoregression for all records of one sampling interval: the colour is the sensor's.

    With a colour of its own a record that the model misses most would be told to matter least.
    """
    steps = [segment.decay.step for segment in segments]
    shared = {
        step: fit_autoregression(
            np.concatenate(
                [e - e.mean() for e, own in zip(residuals, steps, strict=True) if math.isclose(own, step)]
            )
        )
        for step in set(steps)
    }
    return tuple(shared[step] for step in steps)


def _allowed(effects: Sequence[str] | None, exclude: Sequence[str]) -> tuple[str, ...]:
    for name in (*(effects or ()), *exclude):
        effect_named(name)
    wanted = EFFECTS if effects is None else effects
    return tuple(name for name in EFFECTS if name in wanted and name not in exclude)


def _run(search: Search) -> None:
    search.run()
    if not search.candidates:
        names = ", ".join(s.decay.name for s in search.segments)
        raise InputError(names, "no Coulomb decay fits", "check the record, the stiffness and the mass")


def _coulomb_alone(
    search: Search, system: Oscillator, segments: tuple[Segment, ...], ar: tuple[Array, ...]
) -> LoopFit:
    known = search.candidates.get(frozenset())
    if known is not None:
        return known.fit
    model = LoopModel(system, segments, ())
    fit = fit_growing_record(model, [NoiseModel(a) for a in ar], starting_point(model))
    if fit is None:
        raise InputError(segments[0].decay.name, "no Coulomb decay fits", "check the record and the system")
    return fit
