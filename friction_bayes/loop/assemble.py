"""From what a search found to the report: draws, tests of what is left, comparisons."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.summary import TAILS
from friction_bayes.core.text import set_words
from friction_bayes.estimators.result import FREQUENCY_TOLERANCE
from friction_bayes.loop.autoregression import correlation_length
from friction_bayes.loop.candidate import SearchResult, in_catalogue_order
from friction_bayes.loop.draws import mixture_draws
from friction_bayes.loop.effect_summaries import effect_summaries
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.forecast import held_out_error
from friction_bayes.loop.friction import Distribution, friction_posterior
from friction_bayes.loop.model import LoopModel
from friction_bayes.loop.next_experiment import next_experiment
from friction_bayes.loop.paper_procedure import paper_procedure
from friction_bayes.loop.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.reference_force import compare_forces
from friction_bayes.loop.residual_tests import residual_tests
from friction_bayes.loop.result import LoopReport, RecordTrace
from friction_bayes.loop.sampler_check import sampler_check
from friction_bayes.loop.segment import Segment
from friction_bayes.loop.verdict import credible_count, verdict

__all__ = [
    "assemble_report",
    "compare_with_reference",
    "fitted_part",
    "frequency_summary",
    "friction_of_coulomb_model",
]

_MOST_RIVALS = 3


def assemble_report(
    found: SearchResult,
    *,
    seed: int,
    started: float,
    check: bool,
    reference_friction: float | None,
    reference_force: Array | None,
) -> LoopReport:
    """Draw from the candidates, test what they leave, and gather the report.

    Parameters
    ----------
    found : SearchResult
    seed : int
        Of the draws.
    started : float
        Reading of ``time.perf_counter`` when the loop began.
    check : bool
        Sample the final posterior with emcee too.
    reference_friction : float or None
        Friction known from elsewhere [N or N m].
    reference_force : ndarray or None
        As from :func:`friction_bayes.loop.reference_force.validate_force`.
    """
    rng_mixture, rng_before = np.random.default_rng(seed).spawn(2)
    best = found.fits[0]
    tests_before, tests_after = residual_tests(found.before), residual_tests(best)
    which, draws = mixture_draws(
        found.fits, found.probabilities, rng_mixture, robust=bool(tests_after.failed)
    )
    after = friction_posterior(found.fits, draws, rng_mixture)
    before = friction_of_coulomb_model(found.before, rng_before)
    word = verdict(found.sets, found.probabilities, not tests_after.failed)
    effects = in_catalogue_order(found.sets[0])
    residual: dict[str, Any] = {"before": tests_before.to_dict(), "after": tests_after.to_dict()}
    forces: tuple[Array, ...] | None = None
    if reference_force is not None:
        residual["force"], forces = compare_forces(found.before, best, reference_force)
    return LoopReport(
        verdict=word,
        effects=effect_summaries(found, draws[0]),
        candidates=[
            {"effects": list(in_catalogue_order(s)), "probability": float(p)}
            for s, p in zip(found.sets, found.probabilities, strict=True)
        ],
        friction_before=before.to_dict(),
        friction_after=after.to_dict(),
        held_out_error=held_out_error(found.before, best),
        residual=residual,
        noise=_noise(found),
        paper_procedure=paper_procedure(best, after, effects),
        frequency=_frequency(best, draws[0], after),
        random_force=None,
        witnesses=None,
        left=_left(best, bool(tests_after.failed), after),
        fitted=_fitted(best),
        next_experiment=_next_experiment(found) if word == "ambiguous" else None,
        reference_check=_reference(found, after, before, reference_friction, seed if check else None),
        elapsed_s=time.perf_counter() - started,
        seed=seed,
        trail=list(found.trail),
        traces=tuple(
            _trace(found.before, best, r, forces if r == 0 else None) for r in range(len(best.noises))
        ),
        posterior=_posterior(best, draws[0], after, which, seed),
    )


def friction_of_coulomb_model(fit: LoopFit, rng: np.random.Generator) -> Distribution:
    """Friction by the Coulomb model alone."""
    _, draws = mixture_draws([fit], np.ones(1), rng, robust=bool(residual_tests(fit).failed))
    return friction_posterior([fit], draws, rng)


def _next_experiment(found: SearchResult) -> str | None:
    """The record that would decide between the most probable candidates."""
    n = min(credible_count(found.probabilities), _MOST_RIVALS + 1)
    return next_experiment(found.fits[:n], [set_words(in_catalogue_order(s)) for s in found.sets[:n]])


def _noise(found: SearchResult) -> dict[str, Any]:
    best = found.fits[0]
    segment = best.model.segments[0]
    order = max(a.size for a in found.ar)
    return {
        "model": "ar" if order else "white",
        "order": order,
        "sd": float(np.mean([np.std(e) for e in best.free_residuals])),
        "correlation_length_s": float(max(correlation_length(a, segment.decay.step) for a in found.ar)),
        "step": segment.resolution,
    }


def _frequency(best: LoopFit, draws: Array, after: Distribution) -> dict[str, Any]:
    """The frequency found beside the declared one, and both forces where the two disagree."""
    ratios = np.exp(best.model.value(draws, LOG_FREQUENCY_RATIO))
    return frequency_summary(best.model.system.natural_frequency * ratios, best.model, after)


def frequency_summary(frequencies: Array, model: LoopModel, after: Distribution) -> dict[str, Any]:
    """Draws of the natural frequency [rad/s] beside the declared one, and both forces where they differ."""
    declared, order = model.system.natural_frequency, model.segments[0].order
    ratio, friction = float(frequencies.mean()) / declared, float(after.draws.mean())
    disagree = abs(ratio - 1.0) > FREQUENCY_TOLERANCE and after.unit == model.system.friction_unit
    return {
        "mean": declared * ratio,
        "sd": float(frequencies.std(ddof=1)),
        "declared": declared,
        "unit": "rad/s",
        "from_stiffness": friction / ratio**order if disagree else None,
        "from_mass": friction * ratio ** (2 - order) if disagree else None,
    }


def _left(best: LoopFit, failed: bool, after: Distribution) -> dict[str, Any]:
    """What is left of a residual that fails its tests, all of it taken as structure."""
    segment = best.model.segments[0]
    rms = float(np.sqrt(np.mean(best.free_residuals[0] ** 2))) if failed else 0.0
    return {
        "structured_rms": rms,
        "unit": segment.decay.unit,
        "share_of_amplitude": rms / best.model.scales.signal,
        # where the tests fail, the draws carry the scatter that the residual shows
        "friction_could_shift_by": float(after.draws.std(ddof=1)) if failed else 0.0,
        "depends_on": None,
    }


def _fitted(best: LoopFit) -> dict[str, Any]:
    segment = best.model.segments[0]
    return fitted_part(segment, segment.values.size, best.predictions[0].turning_times.size)


def fitted_part(segment: Segment, samples: int, turning_points: int) -> dict[str, Any]:
    """Which part of a record was fitted."""
    start = segment.decay.start_time
    return {
        "from_s": start,
        "to_s": float(start + segment.time[samples - 1]),
        "samples": samples,
        "half_cycles": max(turning_points - 1, 0),
        "set_aside": int(np.count_nonzero(segment.sides[:samples])),
    }


def _reference(
    found: SearchResult,
    after: Distribution,
    before: Distribution,
    friction: float | None,
    seed: int | None,
) -> dict[str, Any] | None:
    """Compare with a reference friction and, where a seed is given, with a sampler."""
    check = compare_with_reference(after, before, friction) or {}
    if seed is not None:
        check["sampler"] = sampler_check(found.before, found.fits[0], seed)
    return check or None


def compare_with_reference(
    after: Distribution, before: Distribution, friction: float | None
) -> dict[str, Any] | None:
    """Compare with a friction known from elsewhere, where there is one."""
    if friction is None:
        return None
    low, high = np.quantile(after.draws, TAILS)
    return {
        "friction": friction,
        "error_before": float(before.draws.mean()) / friction - 1.0,
        "error_after": float(after.draws.mean()) / friction - 1.0,
        "within_interval90": bool(low <= friction <= high),
    }


def _trace(before: LoopFit, after: LoopFit, r: int, forces: tuple[Array, ...] | None) -> RecordTrace:
    """One record with both models."""
    segment, last = after.model.segments[r], after.predictions[r]
    turns = last.turning_times
    phase = (
        np.interp(segment.time, turns, np.arange(turns.size))
        if turns.size > 1
        else np.zeros_like(segment.time)
    )
    decay = segment.decay
    return RecordTrace(
        name=decay.name,
        unit=decay.unit,
        quantity=decay.quantity.name,
        time=decay.start_time + segment.time,
        signal=segment.values,
        before=before.predictions[r].signal,
        after=last.signal,
        sides=segment.sides,
        phase=phase,
        turning_times_before=decay.start_time + before.predictions[r].turning_times,
        turning_points_before=before.predictions[r].turning_points,
        turning_times=decay.start_time + turns,
        turning_points=last.turning_points,
        forces=forces,
    )


def _posterior(best: LoopFit, draws: Array, after: Distribution, which: Integers, seed: int) -> xr.DataTree:
    """Draws in ArviZ's layout."""
    model = best.model
    variables = {
        model.numbered(c.label, c): (("chain", "draw"), np.asarray(c.value(draws[:, j]))[None])
        for j, c in enumerate(model.coordinates)
    }
    mixture = xr.Dataset(
        {
            "friction": (("chain", "draw"), after.draws[None], {"units": after.unit}),
            "candidate": (("chain", "draw"), which[None]),
        }
    )
    return xr.DataTree.from_dict(
        {
            "posterior": xr.Dataset(variables, attrs={"seed": seed}),
            "mixture": mixture.assign_attrs(seed=seed),
        }
    )
