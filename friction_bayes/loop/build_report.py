"""From the candidates to the report: the verdict on them, one posterior, tests of residuals, comparisons."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.declared_force import by_stiffness_and_mass, frequencies_disagree
from friction_bayes.core.errors import InputError
from friction_bayes.core.summary import Summary
from friction_bayes.core.text import percent, set_words
from friction_bayes.decay.located import LEAST_HALF_CYCLES
from friction_bayes.loop import settings
from friction_bayes.loop.checks.forecast import forecast_records, held_out_error, with_forecasts
from friction_bayes.loop.checks.noise_tests import tests_before
from friction_bayes.loop.data.friction import dry_friction, friction_of_loss
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.infer.law_draws import DRAWS, LEAST_PROBABILITY
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.mixture.candidates import Candidates
from friction_bayes.loop.mixture.mixture import CandidateMixture, prior_sensitivity
from friction_bayes.loop.mixture.slight_effects import slight_force
from friction_bayes.loop.report.comparisons import compare_forces, compare_frictions, paper_procedure
from friction_bayes.loop.report.next_experiment import (
    WHETHER_IT_RUBS,
    experiment_on_unexplained,
    next_experiment,
)
from friction_bayes.loop.report.result import LoopReport, RecordTrace
from friction_bayes.loop.report.verdict import (
    AMBIGUOUS,
    FORECAST,
    UNEXPLAINED,
    credible_count,
    verdict,
)
from friction_bayes.mechanics.effects import in_catalogue_order
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = ["build_report"]

_ROUNDING = 0.05
"""Share of a half cycle by which three may fall short, their frequency being known so well."""


def _loss(candidates: Candidates) -> float:
    """Friction that alone would explain the loss of amplitude, as friction is reported."""
    model, turning_points = candidates.before.model, candidates.traces[0].turning_points
    if turning_points.size < LEAST_HALF_CYCLES:
        return 0.0
    system, order = model.system, model.segments[0].order
    ratio = float(candidates.laws.frequency.mean()) / system.natural_frequency
    return candidates.factor * system.stiffness * ratio**order * friction_of_loss(turning_points)


def build_report(
    candidates: Candidates,
    rng: np.random.Generator,
    *,
    options: LoopOptions,
    started: float,
    reference_force: Array | None,
) -> LoopReport:
    """The report: the mixture of candidates, tests of the residuals of the most probable, comparisons.

    Timed from ``started``, a reading of ``time.perf_counter``; a measured force is as from
    :func:`friction_bayes.loop.report.comparisons.validate_force`.
    """
    rng_mixture, rng_before, rng_after, rng_dry = rng.spawn(4)
    mixture = candidates.mixture.with_slight_force(slight_force(candidates.fit), rng_mixture)
    before, unit, loss = candidates.before, candidates.unit, _loss(candidates)
    model, effects = before.model, in_catalogue_order(mixture.sets[0])
    dry = dry_friction(candidates.scale(rng_dry) * mixture.friction, loss, candidates.tolerance, unit)
    forecasts = candidates.where_fitted(forecast_records(before)), candidates.forecasts
    held_out = held_out_error(*forecasts, candidates.noise_floor(), model.segments[0].decay.unit)
    friction = candidates.scale(rng_after) * mixture.friction
    after = Summary.of_draws(friction, unit).to_dict()
    against = reasons_against(candidates, loss, held_out, after["interval90"])
    rubs, failed = dry["probability"], len(candidates.tests.failed)
    word = verdict(mixture.sets, mixture.probabilities, mixture.agrees, against, rubs, failed)
    agreed = mixture.same_friction(credible_count(mixture.probabilities))
    alone = before.friction(rng_before, DRAWS)
    friction_before = candidates.scale(rng_before) * alone
    residual, traces = _residuals(candidates, reference_force)
    reference, sampled = _reference_check(candidates, options, friction, friction_before)
    return LoopReport(
        verdict=word,
        because=against,
        effects=[_effect(name, mixture, candidates) for name in effects],
        candidates=_listed(mixture),
        friction_before=Summary.of_draws(friction_before, unit).to_dict(),
        friction_after=after,
        friction_range=_friction_range(candidates, alone) if word == UNEXPLAINED else None,
        # all agree on a friction that may be zero
        friction_agreed=agreed and rubs >= settings.SETTINGS.credible_mass and not against,
        prior_sensitivity=prior_sensitivity(mixture, len(candidates.evaluated)),
        dry_friction=dry,
        held_out_error=held_out,
        residual=residual,
        noise=candidates.noise(),
        paper_procedure=paper_procedure(*candidates.simulated(), friction, effects),
        frequency=_frequency(candidates, float(mixture.friction.mean())),
        random_force=_random_force(mixture, candidates),
        witnesses=candidates.witnesses,
        left=candidates.left(),
        fitted=_fitted(candidates),
        next_experiment=_next_experiment(candidates, mixture, word, against, rubs),
        reference_check=reference or None,
        elapsed_s=time.perf_counter() - started,
        seed=options.seed,
        trail=list(_trail(candidates.fit)),
        traces=with_forecasts(traces, *forecasts),
        posterior=_posterior(candidates, friction, options.seed, sampled, rng),
        friction_between_records=candidates.between_records(),
        notes=(*(note for each in model.segments for note in each.notes), *candidates.notes),
    )


def reasons_against(
    candidates: Candidates, loss: float, held_out: Mapping[str, Any], friction: tuple[float, float]
) -> tuple[str, ...]:
    """Names of the reasons against the number, whatever the effects found; what is not known is none.

    The ``loss`` of amplitude alone would explain another friction; ``friction`` is the 90 % interval over all
    candidates; ``held_out`` is a field of the report.
    """
    as_bad = 1.0 + settings.SETTINGS.worse_forecast
    before = max(held_out["before"], candidates.least_noise)
    witnesses = candidates.witnesses
    reasons = {
        "left_over": not candidates.explains,
        "shift": candidates.factor * candidates.shift > settings.SETTINGS.most_shift * loss > 0.0,
        "band": held_out["inside90"] < settings.SETTINGS.least_inside,
        FORECAST: held_out["after"] > as_bad * before > 0.0,
        "witnesses": witnesses is not None and not _spans(friction, witnesses),
        "records": candidates.contradicted,
    }
    return tuple(name for name, found in reasons.items() if found)


def _spans(friction: tuple[float, float], witnesses: Mapping[str, Any]) -> bool:
    """Whether two witnesses agree, or the interval of friction reaches into those of both."""
    both = (witnesses[name]["interval90"] for name in ("loss", "shape"))
    return witnesses["agree"] or all(low <= friction[1] and friction[0] <= high for low, high in both)


def _residuals(
    candidates: Candidates, reference_force: Array | None
) -> tuple[dict[str, Any], tuple[RecordTrace, ...]]:
    """Tests of the residuals, before and after, and the records; with a force that was measured, if any."""
    before, traces = candidates.before, candidates.traces
    residual: dict[str, Any] = {
        "before": tests_before(before).to_dict(),
        "after": candidates.tests.to_dict(),
    }
    if reference_force is not None:
        final = candidates.best[0], traces[0].fluctuation
        residual["force"], forces = compare_forces(before, *final, reference_force, candidates.factor)
        traces = (replace(traces[0], forces=forces), *traces[1:])
    return residual, traces


def _listed(mixture: CandidateMixture) -> list[dict[str, Any]]:
    """Effects and probability of each candidate."""
    return [
        {"effects": list(in_catalogue_order(names)), "probability": float(p)}
        for names, p in zip(mixture.sets, mixture.probabilities, strict=True)
    ]


def _effect(name: str, mixture: CandidateMixture, candidates: Candidates) -> dict[str, Any]:
    """An effect of the most probable candidate."""
    return {
        "name": name,
        "probability": mixture.probability(name),
        "parameters": candidates.parameters(name),
        "lines": candidates.lines(name),
    }


def _friction_range(candidates: Candidates, alone: Array) -> dict[str, Any]:
    """Between which readings of an unexplained record friction lies, ``alone`` by Coulomb friction."""
    by_all = candidates.by_all_sets
    readings = {"Coulomb friction alone": alone, "the sets evaluated along the measured motion": by_all}
    each = [
        {"what": what} | Summary.of_draws(candidates.factor * friction, candidates.unit).to_dict()
        for what, friction in readings.items()
    ]
    means = [reading["mean"] for reading in each]
    return {"low": min(means), "high": max(means), "unit": candidates.unit, "readings": each}


def _next_experiment(
    candidates: Candidates, mixture: CandidateMixture, word: str, against: tuple[str, ...], rubs: float
) -> str | None:
    """The next experiment, where the verdict leaves a question open."""
    if word == AMBIGUOUS and (deciding := _deciding_experiment(mixture, candidates)):
        return deciding
    least = settings.SETTINGS.credible_mass
    if word == AMBIGUOUS and not against and 1.0 - least < rubs < least:
        return WHETHER_IT_RUBS
    failed = candidates.tests.failed
    if against or (word == AMBIGUOUS and len(failed) > 1):
        depends_on = candidates.left()["depends_on"]
        return experiment_on_unexplained(depends_on, failed, against, len(candidates.best))
    return None


def _reference_check(
    candidates: Candidates, options: LoopOptions, friction: Array, before: Array
) -> tuple[dict[str, Any], xr.DataTree | None]:
    """Friction known from elsewhere and a sampler's, each with ours, if requested; and what was sampled."""
    known, sampled = options.reference_friction, None
    reference = {} if known is None else compare_frictions(friction, before, known)
    if options.check:
        found, sampled = candidates.check(options.seed)
        effects = list(in_catalogue_order(candidates.sets[0]))
        share = float(candidates.probabilities[0]) * found.pop("share")
        reference["sampler"] = found | {"sampled": {"effects": effects, "probability": share}}
    return reference, sampled


def _deciding_experiment(mixture: CandidateMixture, candidates: Candidates) -> str | None:
    """The record that would decide between the most probable candidates.

    Between those with another friction, if there are any, and that do not contain the first as the case of a
    vanishing size: no record separates these.
    """
    count, first = credible_count(mixture.probabilities), mixture.sets[0]
    others = [mixture.sets[c] for c in np.flatnonzero(mixture.say_otherwise(count))]
    rivals = [names for names in others if not names > first] or list(mixture.sets[1:count])
    credible = [first, *rivals][: settings.SETTINGS.most_at_once + 1]
    contenders = [(names, candidates.contender(names)) for names in credible]
    known = {names: contender for names, contender in contenders if contender is not None}
    if len(known) < 2:
        return None
    return next_experiment([*known.values()], [set_words(in_catalogue_order(names)) for names in known])


def _random_force(mixture: CandidateMixture, candidates: Candidates) -> dict[str, Any] | None:
    """Size and correlation time of the random force, given that there is one; None where not evaluated."""
    forced = mixture.random_force > 0.0
    if np.count_nonzero(forced) < 2:
        return None
    sd, friction = mixture.random_force[forced], float(np.median(mixture.friction[forced]))
    correlation_time = candidates.laws.first.correlation_time[forced]
    return {
        "sd": Summary.of_draws(candidates.factor * sd, candidates.unit).to_dict(),
        "share_of_friction": float(np.median(sd)) / friction if friction else None,
        "correlation_time_s": Summary.of_draws(correlation_time, "s").to_dict(),
        "probability": mixture.probability(RANDOM_FORCE.name),
    }


def _frequency(candidates: Candidates, friction: float) -> dict[str, Any]:
    """The natural frequency [rad/s], the declared one, and both forces of a friction where they disagree."""
    model, drawn = candidates.before.model, candidates.laws.frequency
    system, decay = model.system, model.segments[0].decay
    found, sd = float(drawn.mean()), float(drawn.std(ddof=1))
    disagree = bool(frequencies_disagree(system, found, sd)) and decay.calibrated
    coefficient = friction / system.force_factor(decay.quantity)
    by_stiffness, by_mass = by_stiffness_and_mass(system, decay.quantity, found, coefficient)
    return {
        "mean": found,
        "sd": sd,
        "declared": system.natural_frequency,
        "unit": "rad/s",
        "from_stiffness": by_stiffness if disagree else None,
        "from_mass": by_mass if disagree else None,
        "trusted": system.trust,
    }


def _fitted(candidates: Candidates) -> dict[str, Any]:
    """The part of the first record that was fitted.

    Raises
    ------
    InputError
        If the most probable law moves for less than three half cycles of it.
    """
    fit, trace = candidates.best[0], candidates.traces[0]
    segment, frequency = fit.segment, float(candidates.laws.frequency.mean())
    start = segment.decay.start_time
    end = start + float(segment.time[fit.record.samples - 1])
    # a law that moves on turns again within a half cycle
    moves_until = min(end, float(trace.turning_times.max(initial=start)) + math.pi / frequency)
    half_cycles = int((moves_until - start) * frequency / math.pi + _ROUNDING)
    half_cycles = min(half_cycles, fit.path.turning.size + 1)
    recorded = ~segment.in_gaps[: fit.record.samples]
    if half_cycles < LEAST_HALF_CYCLES:
        raise InputError(
            trace.name,
            f"the most probable law moves for {half_cycles} whole half cycles, from {start:.4g} to "
            f"{moves_until:.4g} s, before the mass may stick: no verdict on fewer than {LEAST_HALF_CYCLES:g}",
            "release it from farther away, and give the free decay alone; estimate asks for less",
        )
    return {
        "from_s": start,
        "to_s": end,
        "samples": int(np.count_nonzero(recorded)) * segment.block,
        "half_cycles": half_cycles,
        "set_aside": int(np.count_nonzero(recorded & ~fit.clock.used)) * segment.block,
    }


def _trail(fit: LawFit) -> Iterator[str]:
    """How the candidates were found."""
    sets = f"{len(fit.sets)} sets of effects evaluated"
    if not fit.one:
        yield f"along the measured motions: {sets} on {len(fit.alone)} records together"
        return
    one = fit.alone[0]
    lines = ", ".join(map(str, one.lines))
    yield (
        f"along the measured motion: {sets}"
        + (
            f" with and without a random force, log evidence {one.log_gain:+.1f} with it"
            if one.forced
            else " without a random force"
        )
        + (f"; lines that may be there: {lines}" if lines else "")
    )
    share = float(one.posterior.weight[:, one.impossible].sum())
    if share >= LEAST_PROBABILITY:
        yield (
            f"sets in which friction pushes or sensor effects hide the motion, {percent(share)} likely, "
            "are left out"
        )


def _posterior(
    candidates: Candidates,
    friction: Array,
    seed: int,
    sampled: xr.DataTree | None,
    rng: np.random.Generator,
) -> xr.DataTree:
    """Draws in ArviZ's layout: those of the most probable candidate, friction over all, and a sampler's."""

    def variable(values: Array | Integers, *dims: str) -> xr.Variable:
        # as it is: xarray otherwise loads dask.array to see whether the array is Dask's
        return xr.Variable(dims, values, fastpath=True)

    def one_chain(draws: Mapping[str, Array | Integers]) -> xr.Dataset:
        # independent, and drawn candidate after candidate, which ArviZ takes for a chain that hardly moves
        order = rng.permutation(next(iter(draws.values())).size)
        return xr.Dataset(
            {name: variable(values[None, order], "chain", "draw") for name, values in draws.items()},
            coords={
                "chain": variable(np.arange(1), "chain"),
                "draw": variable(np.arange(order.size), "draw"),
            },
        )

    best = one_chain(candidates.variables())
    mixture = one_chain({"friction": friction, "candidate": candidates.mixture.candidate})
    mixture["friction"].attrs["units"] = candidates.unit
    tree = xr.DataTree.from_dict(
        {"posterior": best.assign_attrs(seed=seed), "mixture": mixture.assign_attrs(seed=seed)}
    )
    if sampled is not None:
        tree["reference"] = sampled
    return tree
