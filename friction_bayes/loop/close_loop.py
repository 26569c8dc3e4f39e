"""Close the loop: find the residual, trace it, add the effect, report the error before and after."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.core.checks import positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import words
from friction_bayes.loop.build_report import assemble_report
from friction_bayes.loop.data.effect_sets import searched
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import Segment, cut_records
from friction_bayes.loop.infer.moving_record import why_not_weighed
from friction_bayes.loop.mixture.families_of_one import families_of_one, knows_the_range
from friction_bayes.loop.mixture.joint_family import joint_family
from friction_bayes.loop.mixture.mixture import Family
from friction_bayes.loop.mixture.search_family import SearchFamily
from friction_bayes.loop.report.reference_force import validate_force
from friction_bayes.loop.report.result import LoopReport
from friction_bayes.loop.search.run_search import search_records
from friction_bayes.mechanics.effects import EFFECTS, effect_named
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = ["close_loop"]

NOISES = ("auto", "white", "ar")
RANDOM_FORCES = ("auto", "none")
TOLERANCE = 0.2
_ALONG_MOTION = (
    "it is weighed along the measured motion, which takes random_force among the effects, "
    "noise and random_force left at auto, and a record that has noise and four turning points, does not clip "
    "and whose motion no error of the sensor stands for"
)
"""Why an effect that the search does not try was not weighed."""


@single_threaded_blas()
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
        ``noise="auto"``.
    varying_friction : bool
        Take it that friction differs between the records: each one's is drawn from one normal distribution,
        whose mean is the friction reported. Left out, records that are weighed along their motions together
        decide by their evidence whether it does.
    tolerance : float
        Root mean square of a force that follows the motion, over friction, below which a law with a random
        force counts as complete although a test can tell that force from none; share of the loss of
        amplitude that dry friction takes where it matters.
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
    if isinstance(records, xr.DataArray | np.ndarray):
        raise InputError(
            "records",
            f"one {type(records).__name__} instead of a list of records",
            "write [record]; make_record(time, values, quantity) makes one of an array",
        )
    if noise not in NOISES:
        raise InputError("noise", f"unknown choice {noise!r}", f"give one of {', '.join(NOISES)}")
    if random_force not in RANDOM_FORCES:
        choices = ", ".join(RANDOM_FORCES)
        raise InputError("random_force", f"unknown choice {random_force!r}", f"give one of {choices}")
    positive("tolerance", tolerance)
    if reference_friction is not None:
        positive("reference_friction", reference_friction)
    if varying_friction:
        _validate_varying(len(records), noise)
    allowed = _allowed(effects, exclude)
    segments = cut_records(records, system)
    force = None if reference_force is None else validate_force(segments[0], reference_force)
    system = _calibrated(system, segments)
    scales = scales_of(segments, system)
    barred = {name: reason for name in allowed if (reason := why_not_weighed(name, segments[0], scales))}
    tried = tuple(name for name in searched(allowed, named=effects is not None) if name not in barred)
    rng_search, rng_force, rng_report, rng_joint = np.random.default_rng(seed).spawn(4)
    sought = random_force == "auto" and noise == "auto" and RANDOM_FORCE.name in allowed
    several = len(segments) > 1 and knows_the_range(segments, allowed)
    joint = None
    if varying_friction or (sought and several):
        unwanted = () if random_force == "auto" else (RANDOM_FORCE.name,)
        weighed = tuple(name for name in allowed if name not in unwanted)
        joint = joint_family(
            segments,
            system,
            weighed,
            tolerance,
            rng_joint,
            varying=varying_friction,
            progress=progress,
        )
    families: list[Family]
    if joint is not None and (varying_friction or joint.knows_the_noise):
        before, families = joint.before, [joint]
    elif sought and len(segments) == 1:
        rngs = rng_search, rng_force
        of_search, beside_force = families_of_one(
            system, segments[0], allowed, tried, tolerance, rngs, progress
        )
        before, families = of_search.found.before, [f for f in (of_search, beside_force) if f is not None]
    else:
        found = search_records(system, segments, tried, noise, progress)
        searched_sets = SearchFamily(found, allowed, rng_search)
        before, families = found.before, [searched_sets]
        if joint is not None and not searched_sets.holds_more:
            before, families = joint.before, [joint]
    report = assemble_report(
        before,
        families,
        rng_report,
        seed=seed,
        started=started,
        check=check,
        reference_friction=reference_friction,
        reference_force=force,
        tolerance=tolerance,
    )
    if effects is None:
        return report
    along = any(not isinstance(family, SearchFamily) for family in families)
    left = () if along else (name for name in allowed if EFFECTS[name].search == "never")
    unweighed = dict.fromkeys(left, _ALONG_MOTION)
    reasons = (unweighed | barred).items()
    notes = (f"{words(name)} was asked for and not weighed: {reason}" for name, reason in sorted(reasons))
    return replace(report, notes=(*report.notes, *notes))


def _validate_varying(records: int, noise: str) -> None:
    """Friction that varies is weighed along the measured motions, which not everything goes with."""
    place = "varying_friction"
    if records < 2:
        raise InputError(place, "one record", "give the records between which friction differs")
    if noise == "ar":
        raise InputError(place, "with noise 'ar'", "leave the noise at auto or white")


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
