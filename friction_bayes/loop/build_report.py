"""From the candidates to the report: one posterior, tests of what is left, comparisons."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.declared_force import by_mass, by_stiffness, frequencies_disagree
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.summary import TAILS, Summary
from friction_bayes.core.text import set_words
from friction_bayes.decay.located import LEAST_HALF_CYCLES
from friction_bayes.loop.checks.search_forecast import forecast_records, held_out_error, with_forecasts
from friction_bayes.loop.data.effect_sets import in_catalogue_order
from friction_bayes.loop.data.friction import (
    Distribution,
    dry_friction,
    friction_of_loss,
    friction_scale,
    reported_friction,
)
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.mixture.mixture import Family, FamilyDraws, Mixture, mixture_of
from friction_bayes.loop.mixture.prior_sensitivity import prior_sensitivity
from friction_bayes.loop.report.friction_range import Reading, coulomb_alone, friction_range, pooled
from friction_bayes.loop.report.next_experiment import next_experiment
from friction_bayes.loop.report.paper_procedure import paper_procedure
from friction_bayes.loop.report.reference_force import compare_forces
from friction_bayes.loop.report.result import LoopReport, RecordTrace
from friction_bayes.loop.report.unexplained import experiment_on_unexplained
from friction_bayes.loop.report.verdict import (
    AMBIGUOUS,
    UNEXPLAINED,
    Consequences,
    credible_count,
    verdict,
)
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.loop.search.residual_tests import residual_tests
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = ["assemble_report"]

_MOST_RIVALS = 3
_ROUNDING = 0.05
"""Share of a half cycle by which three may fall short, their frequency being known so well."""
_LEAST_TURNS = 3
"""Turning points that show a loss of amplitude about a middle."""


def assemble_report(
    before: LoopFit,
    families: Sequence[Family],
    rng: np.random.Generator,
    *,
    seed: int,
    started: float,
    check: bool,
    reference_friction: float | None,
    reference_force: Array | None,
    tolerance: float,
) -> LoopReport:
    """Mix the candidates, test what the most probable leaves, and gather the report.

    Parameters
    ----------
    before : LoopFit
        The Coulomb model alone.
    families : sequence of Family
        All candidates. One that is left without any has nothing but its trail.
    rng : numpy.random.Generator
    seed : int
        That the generators come from.
    started : float
        Reading of ``time.perf_counter`` when the loop began.
    check : bool
        Sample the final posterior with emcee too.
    reference_friction : float or None
        Friction known from elsewhere [N or N m].
    reference_force : ndarray or None
        Measured force, as from :func:`friction_bayes.loop.report.reference_force.validate_force`.
    tolerance : float
        Share of the loss of amplitude from which on dry friction matters.
    """
    rng_mixture, rng_before, rng_after, rng_pool, rng_dry = rng.spawn(5)
    trail = [step for family in families for step in family.trail]
    everyone, families = families, [family for family in families if family.sets]
    # a family whose own sets do not count knows it all the same
    slight_force = next((f.slight_force for f in everyone if f.slight_force is not None), None)
    mixture = mixture_of(families, rng_mixture, slight_force)
    best, model = mixture.best, before.model
    segment = model.segments[0]
    effects = in_catalogue_order(mixture.sets[0])
    left, traces = best.left(), best.traces()
    loss = _loss(traces[0], mixture, model)

    def whether_it_rubs(friction: Array) -> dict[str, Any]:
        return dry_friction(
            reported_friction(friction, mixture.draws.frequency, model, rng_dry), loss, tolerance
        )

    dry = whether_it_rubs(mixture.draws.friction)
    factor, unit = friction_scale(model)
    shift = factor * left["friction_could_shift_by"]
    forecasts = forecast_records(before), best.forecasts()
    held_out = held_out_error(*forecasts, best.noise_floor(), segment.decay.unit)
    witnesses = best.witnesses()
    after = reported_friction(mixture.draws.friction, mixture.draws.frequency, model, rng_after)
    against = Consequences(
        is_noise=best.explains,
        shift=shift,
        loss=loss,
        held_out=held_out,
        friction=after.to_dict()["interval90"],
        witnesses=witnesses,
        contradicted=best.contradicted,
    ).against()
    word = verdict(mixture.sets, mixture.probabilities, mixture.agrees, against, dry["probability"])
    sensitivity = prior_sensitivity(mixture.draws, mixture.sets)
    alone, readings = coulomb_alone(before, rng_before), None
    if word == UNEXPLAINED:
        read = [family.reading for family in everyone]
        readings = [alone, *read]
        # Coulomb friction alone and the search weigh no law without dry friction: they cannot deny it
        for family, reading in zip(everyone, read, strict=True):
            if family.holds_what_is_left:
                dry = whether_it_rubs(reading.friction)
        in_question = readings
        if best.holds_what_is_left:
            # Coulomb friction alone is out of the question then; what the other family says is not
            others = [r for family, r in zip(everyone, read, strict=True) if family is not best]
            in_question = [Reading("the candidates", mixture.draws.friction), *others]
        mixture = mixture.with_friction(pooled(in_question, rng_pool))
        after = reported_friction(mixture.draws.friction, mixture.draws.frequency, model, rng_after)
    frictions_before = reported_friction(alone.friction, mixture.draws.frequency, model, rng_before)
    residual: dict[str, Any] = {
        "before": residual_tests(before).to_dict(),
        "after": best.tests.to_dict(),
    }
    fitted = _fitted(best, traces[0], model, float(mixture.draws.frequency.mean()))
    if reference_force is not None:
        residual["force"], forces = compare_forces(before, best.resisting_force(), reference_force)
        traces = (replace(traces[0], forces=forces), *traces[1:])
    further = None
    if word == AMBIGUOUS:
        further = _next_experiment(families, mixture)
    elif word == UNEXPLAINED:
        further = experiment_on_unexplained(
            left["depends_on"], residual["after"]["failed"], against, len(model.segments)
        )
    reference = _compare_with_reference(after, frictions_before, reference_friction) or {}
    if check:
        found = best.check(seed)
        share = mixture.share_of_best * found.pop("share")
        sampled = {"effects": list(effects), "probability": share}
        reference["sampler"] = found | {"sampled": sampled}
    return LoopReport(
        verdict=word,
        because=against,
        effects=[
            {
                "name": name,
                "probability": mixture.probability(name),
                "parameters": best.parameters(name),
                "lines": best.lines(name),
            }
            for name in effects
        ],
        candidates=[
            {"effects": list(in_catalogue_order(names)), "probability": float(p)}
            for names, p in zip(mixture.sets, mixture.probabilities, strict=True)
        ],
        friction_before=frictions_before.to_dict(),
        friction_after=after.to_dict(),
        friction_range=friction_range(readings, factor, unit) if readings else None,
        prior_sensitivity=sensitivity,
        dry_friction=dry,
        held_out_error=held_out,
        residual=residual,
        noise=best.noise(),
        paper_procedure=paper_procedure(*best.simulated(), after, effects),
        frequency=_frequency(mixture.draws.frequency, model, mixture.draws.friction),
        random_force=_random_force(mixture, families, factor, unit),
        witnesses=witnesses,
        left=left | {"unit": segment.decay.unit, "friction_could_shift_by": shift},
        fitted=fitted,
        next_experiment=further,
        reference_check=reference or None,
        elapsed_s=time.perf_counter() - started,
        seed=seed,
        trail=trail,
        traces=with_forecasts(traces, *forecasts),
        posterior=_posterior(mixture, after, seed),
        friction_between_records=best.between_records(),
        notes=(*(note for each in model.segments for note in each.notes), *best.notes),
    )


def _next_experiment(families: Sequence[Family], mixture: Mixture) -> str | None:
    """The record that would decide between the most probable candidates."""
    credible = mixture.sets[: credible_count(mixture.probabilities)][: _MOST_RIVALS + 1]
    # of several that have a set the one where it is most probable
    weighed = [pair for f in families for pair in zip(f.log_weights, f.sets, [f] * len(f.sets), strict=True)]
    owners = {names: family for _, names, family in sorted(weighed, key=lambda one: float(one[0]))}
    contenders = [(names, owners[names].contender(names)) for names in credible]
    known = {names: contender for names, contender in contenders if contender is not None}
    if len(known) < 2:
        return None
    return next_experiment([*known.values()], [set_words(in_catalogue_order(names)) for names in known])


def _loss(trace: RecordTrace, mixture: Mixture, model: LoopModel) -> float:
    """Friction that alone would explain the loss of amplitude, as friction is reported."""
    if trace.turning_points.size < _LEAST_TURNS:
        return 0.0
    system, order = model.system, model.segments[0].order
    ratio = float(mixture.draws.frequency.mean()) / system.natural_frequency
    factor, _ = friction_scale(model)
    return factor * system.stiffness * ratio**order * friction_of_loss(trace.turning_points)


def _random_force(
    mixture: Mixture, families: Sequence[Family], factor: float, unit: str
) -> dict[str, Any] | None:
    """Size and correlation time of the random force, given that there is one; None where none was weighed."""
    draws = [family.draws.at(family.draws.random_force > 0.0) for family in families]
    forced = FamilyDraws(**{name: np.concatenate([vars(d)[name] for d in draws]) for name in vars(draws[0])})
    if forced.random_force.size < 2:
        return None
    friction = float(np.median(forced.friction))
    return {
        "sd": Summary.of_draws(factor * forced.random_force, unit).to_dict(),
        "share_of_friction": float(np.median(forced.random_force)) / friction if friction else None,
        "correlation_time_s": Summary.of_draws(forced.correlation_time, "s").to_dict(),
        "probability": mixture.probability(RANDOM_FORCE.name),
    }


def _frequency(frequencies: Array, model: LoopModel, friction: Array) -> dict[str, Any]:
    """Draws of the natural frequency [rad/s] beside the declared one, and both forces where they disagree.

    Those of ``friction``, shape (m,), are of the model's [N or N m].
    """
    system, decay = model.system, model.segments[0].decay
    found, sd = float(frequencies.mean()), float(frequencies.std(ddof=1))
    disagree = bool(frequencies_disagree(system, found, sd)) and decay.unit not in UNCALIBRATED_UNITS
    coefficient = float(friction.mean()) / system.force_factor(decay.quantity)
    forces = [
        coefficient * float(factor(system, decay.quantity, found).factor)
        for factor in (by_stiffness, by_mass)
    ]
    return {
        "mean": found,
        "sd": sd,
        "declared": system.natural_frequency,
        "unit": "rad/s",
        "from_stiffness": forces[0] if disagree else None,
        "from_mass": forces[1] if disagree else None,
        "trusted": system.trust,
    }


def _fitted(best: Family, trace: RecordTrace, model: LoopModel, frequency: float) -> dict[str, Any]:
    """Which part of the first record was fitted.

    Raises
    ------
    InputError
        If the most probable law moves for less than three half cycles of it.
    """
    segment = model.segments[0]
    samples, turning_points, set_aside = best.fitted
    start, end = segment.decay.start_time, segment.decay.start_time + float(segment.time[samples - 1])
    # a law that moves on turns again within a half cycle
    moves_until = min(end, float(trace.turning_times.max(initial=start)) + math.pi / frequency)
    half_cycles = min(int((moves_until - start) * frequency / math.pi + _ROUNDING), turning_points + 1)
    if half_cycles < LEAST_HALF_CYCLES:
        raise InputError(
            trace.name,
            f"the most probable law moves for {half_cycles} half cycles, from {start:.4g} to "
            f"{moves_until:.4g} s: no verdict on fewer than {LEAST_HALF_CYCLES:g}",
            "give the free decay alone, or a longer one, and check what the record shows there",
        )
    return {
        "from_s": start,
        "to_s": end,
        "samples": samples * segment.block,
        "half_cycles": half_cycles,
        "set_aside": set_aside * segment.block,
    }


def _compare_with_reference(
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


def _posterior(mixture: Mixture, after: Distribution, seed: int) -> xr.DataTree:
    """Draws in ArviZ's layout: those of the most probable candidate, and friction over all."""

    def one_chain(values: Array | Integers, **attrs: str) -> xr.Variable:
        # as it is: xarray otherwise loads dask.array to see whether the array is Dask's
        return xr.Variable(("chain", "draw"), values[None], attrs, fastpath=True)

    best = xr.Dataset({name: one_chain(values) for name, values in mixture.best.variables().items()})
    friction = xr.Dataset(
        {
            "friction": one_chain(after.draws, units=after.unit),
            "candidate": one_chain(mixture.draws.candidate),
        }
    )
    return xr.DataTree.from_dict(
        {"posterior": best.assign_attrs(seed=seed), "mixture": friction.assign_attrs(seed=seed)}
    )
