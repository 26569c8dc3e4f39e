"""Close the loop: find the residual, trace it, add the effect, report the error before and after."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.assemble import assemble_report
from friction_bayes.loop.autoregression import fit_autoregression, is_coloured
from friction_bayes.loop.candidate import ALONG_MOTION_ALONE, LEFT_TO_REGRESSION, SearchResult
from friction_bayes.loop.evidence import posterior_probabilities
from friction_bayes.loop.family import Family
from friction_bayes.loop.fit import LoopFit, fit_growing_record
from friction_bayes.loop.model import LoopModel
from friction_bayes.loop.noise import NoiseModel
from friction_bayes.loop.random_force.force_family import force_family
from friction_bayes.loop.random_force.joint_fit import fit_together
from friction_bayes.loop.random_force.joint_report import joint_report, only_searched
from friction_bayes.loop.reference_force import validate_force
from friction_bayes.loop.result import LoopReport
from friction_bayes.loop.search import Search
from friction_bayes.loop.search_family import SearchFamily
from friction_bayes.loop.segment import Segment, cut_records
from friction_bayes.loop.starting_point import starting_point
from friction_bayes.mechanics.effects import EFFECTS, effect_named
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["close_loop"]

NOISES = ("auto", "white", "ar")
RANDOM_FORCES = ("auto", "none")
TOLERANCE = 0.2


def close_loop(
    records: Sequence[xr.DataArray],
    system: Oscillator,
    *,
    seed: int,
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
    """Find what a Coulomb model of one or more free decays lacks, and how probable each explanation is.

    Parameters
    ----------
    records : sequence of xarray.DataArray
        Records of one system and one quantity, fitted together: shared physics, own initial states, sensor
        faults, drifts of friction and noise.
    system : Oscillator
        The declared system.
    seed : int
        Seed of the draws; same seed, same report.
    effects : sequence of str, optional
        Effects that may be tried; all of the catalogue, those registered from outside too, when left out.
    exclude : sequence of str
        Effects that may not.
    noise : {"auto", "white", "ar"}
        White, autoregressive, or decided by the spectrum of the residual above the motion's harmonics.
    random_force : {"auto", "none"}
        Whether candidates with a force that fluctuates are weighed beside those without. They are with
        ``noise="auto"``; several records are then neither checked nor set beside a measured force.
    varying_friction : bool
        Take it that friction differs between the records: each one's is drawn from one normal distribution,
        whose mean is the friction reported. Left out, records that are weighed along their motions together
        decide by their evidence whether it does.
    tolerance : float
        Root mean square of a force that follows the motion, over friction, below which a law with a random
        force counts as complete although a test can tell that force from none; share of the loss of
        amplitude that dry friction takes where it matters.
    check : bool
        Sample the final posterior with emcee too.
    reference_friction : float, optional
        Friction known from elsewhere [N or N m], compared with.
    reference_force : array_like, shape (n,), optional
        Measured friction force at the samples of the first record [N or N m].
    progress : callable, optional
        Called with the name of each set of effects that is fitted.

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
    if random_force not in RANDOM_FORCES:
        choices = ", ".join(RANDOM_FORCES)
        raise InputError("random_force", f"unknown choice {random_force!r}", f"give one of {choices}")
    positive("tolerance", tolerance)
    if reference_friction is not None:
        positive("reference_friction", reference_friction)
    if varying_friction:
        _validate_varying(len(records), noise, check=check, reference_force=reference_force is not None)
    allowed = _allowed(effects, exclude)
    left_out = ALONG_MOTION_ALONE if effects is None else LEFT_TO_REGRESSION
    searched = tuple(name for name in allowed if name not in left_out)
    segments = cut_records(records, system)
    force = None if reference_force is None else validate_force(segments[0], reference_force)
    system = _calibrated(system, segments)
    found = _search(system, segments, searched, noise, progress)
    rng_search, rng_force, rng_report, rng_together = np.random.default_rng(seed).spawn(4)
    searched_sets = SearchFamily(found, allowed, rng_search)
    families: list[Family] = [searched_sets]
    sought = random_force == "auto" and noise == "auto" and RANDOM_FORCE.name in allowed
    if sought and len(segments) == 1:
        fluctuating = force_family(searched_sets, allowed, tolerance, rng_force)
        families += [fluctuating] if fluctuating is not None else []
    report = assemble_report(
        found,
        families,
        rng_report,
        seed=seed,
        started=started,
        check=check,
        reference_friction=reference_friction,
        reference_force=force,
        tolerance=tolerance,
    )
    several = sought and len(segments) > 1 and force is None and not check and not only_searched(found)
    if not (several or varying_friction):
        return report
    unwanted = () if random_force == "auto" else (RANDOM_FORCE.name,)
    weighed = [name for name in allowed if name not in unwanted]
    together = fit_together(segments, system, weighed, varying=varying_friction)
    if together is None:
        if varying_friction:
            name = segments[0].decay.name
            raise InputError(name, "too few turning points for a friction of its own", "leave the record out")
        return report
    report = joint_report(report, found, together, rng_together, tolerance=tolerance)
    return replace(report, elapsed_s=time.perf_counter() - started)


def _validate_varying(records: int, noise: str, *, check: bool, reference_force: bool) -> None:
    """Friction that varies is weighed along the measured motions, which not everything goes with."""
    place = "varying_friction"
    if records < 2:
        raise InputError(place, "one record", "give the records between which friction differs")
    if noise == "ar":
        raise InputError(place, "with noise 'ar'", "leave the noise at auto or white")
    if check or reference_force:
        raise InputError(place, "with check or a measured force", "leave one of the two out")


def _allowed(effects: Sequence[str] | None, exclude: Sequence[str]) -> tuple[str, ...]:
    """Effects that may be tried, in the catalogue's order."""
    for name in (*(effects or ()), *exclude):
        effect_named(name)
    wanted = EFFECTS if effects is None else effects
    return tuple(name for name in EFFECTS if name in wanted and name not in exclude)


def _calibrated(system: Oscillator, segments: tuple[Segment, ...]) -> Oscillator:
    """The system, a pendulum as its small swings where the signal is not calibrated.

    How far it swings is then unknown, and the sine of a voltage means nothing.
    """
    if system.pendulum and segments[0].decay.unit in UNCALIBRATED_UNITS:
        return Oscillator(**asdict(system))
    return system


def _search(
    system: Oscillator,
    segments: tuple[Segment, ...],
    allowed: tuple[str, ...],
    noise: str,
    progress: Callable[[str], None] | None,
) -> SearchResult:
    """Search with white noise, and again with autoregressive noise where that is chosen."""
    ar = tuple(np.zeros(0) for _ in segments)
    search = Search(system, segments, allowed, ar, progress)
    _run(search)
    trail = search.trail
    first = search.ranked()[0].fit
    residuals = first.residuals
    if noise == "ar" or (noise == "auto" and _any_coloured(segments, residuals)):
        ar = _shared_autoregression(segments, residuals)
        order = max(a.size for a in ar)
        # an outlier spoils as many innovations as the order, which a contaminated normal does not describe
        kept = tuple(name for name in allowed if name != OUTLIERS.name)
        white, search = search, Search(system, segments, kept, ar, progress)
        search.start_from(white)
        _run(search)
        trail = [*trail, f"noise is autoregressive of order {order}: searched again", *search.trail]
    return _result(search, tuple(trail), first)


def _run(search: Search) -> None:
    search.run()
    if not search.candidates:
        names = ", ".join(s.decay.name for s in search.segments)
        raise InputError(names, "no Coulomb decay fits", "check the record, the stiffness and the mass")


def _any_coloured(segments: tuple[Segment, ...], residuals: Sequence[Array]) -> bool:
    pairs = zip(segments, residuals, strict=True)
    return any(is_coloured(e, s.decay.step, s.decay.frequency) for s, e in pairs)


def _shared_autoregression(segments: tuple[Segment, ...], residuals: Sequence[Array]) -> tuple[Array, ...]:
    """One autoregression for all records of one sampling interval: the colour is the sensor's.

    With one of its own, a record that the model fits worst would count least.
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


def _result(search: Search, trail: tuple[str, ...], white: LoopFit) -> SearchResult:
    """Weigh the candidates, and set the Coulomb model alone, its rest position free, beside them."""
    ranked = search.ranked()
    sets = [c.effects for c in ranked]
    fits = [c.fit for c in ranked]
    log_weights = np.array([c.log_weight for c in ranked])
    probabilities = posterior_probabilities(fits, log_weights)
    if frozenset() not in sets:
        # samples held at an end of the range have no probability under a sensor that does not clip
        sets.append(frozenset())
        fits.append(_coulomb_model(search))
        log_weights = np.append(log_weights, -np.inf)
        probabilities = np.append(probabilities, 0.0)
    return SearchResult(
        sets=tuple(sets),
        fits=tuple(fits),
        log_weights=log_weights,
        probabilities=probabilities,
        allowed=search.allowed,
        before=_coulomb_model(search, SENSOR_OFFSET.name),
        ar=search.ar,
        trail=trail,
        white=white,
    )


def _coulomb_model(search: Search, *zero: str) -> LoopFit:
    """Fit Coulomb friction alone, about the sensor's zero or with an error of that."""
    names = frozenset(zero)
    if names in search.candidates:
        return search.candidates[names].fit
    model = LoopModel(search.system, search.segments, zero)
    fit = fit_growing_record(model, [NoiseModel(a) for a in search.ar], starting_point(model))
    if fit is None:
        name = search.segments[0].decay.name
        raise InputError(name, "no Coulomb decay fits", "check the record and the system")
    return fit
