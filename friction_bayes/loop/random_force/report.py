"""The report of a record whose force fluctuates: every number a summary of the same draws."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.summary import Summary
from friction_bayes.loop.assemble import (
    compare_with_reference,
    fitted_part,
    frequency_summary,
    friction_of_coulomb_model,
)
from friction_bayes.loop.candidate import SearchResult, in_catalogue_order
from friction_bayes.loop.draws import DRAWS
from friction_bayes.loop.forecast import FORECAST, forecast_error
from friction_bayes.loop.friction import Distribution, friction_scale
from friction_bayes.loop.paper_procedure import paper_procedure
from friction_bayes.loop.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.random_force.draws import LawDraws, law_draws
from friction_bayes.loop.random_force.fit import ForceFit
from friction_bayes.loop.random_force.forecast import forecast
from friction_bayes.loop.random_force.left_over import LeftOver, what_is_left
from friction_bayes.loop.random_force.sampler_check import check_random_force
from friction_bayes.loop.random_force.witnesses import Witnesses, two_witnesses
from friction_bayes.loop.residual_tests import residual_tests
from friction_bayes.loop.result import FluctuationTrace, LoopReport, RecordTrace
from friction_bayes.loop.verdict import credible_count
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.timing_jitter import TIMING_JITTER

__all__ = ["random_force_report"]

_LEAST_PROBABILITY = 1e-9
"""Of a candidate that is listed."""


def random_force_report(
    found: SearchResult,
    fit: ForceFit,
    *,
    seed: int,
    started: float,
    check: bool,
    reference_friction: float | None,
    tolerance: float,
) -> LoopReport:
    """Draw from the posterior, test what is left, and gather the report.

    Parameters
    ----------
    found : SearchResult
        What the search without a random force found: the Coulomb model alone comes from it.
    fit : ForceFit
        With one.
    seed : int
        Of the draws.
    started : float
        Reading of ``time.perf_counter`` when the loop began.
    check : bool
        Sample the most probable set of columns with emcee too.
    reference_friction : float or None
        Friction known from elsewhere [N or N m].
    tolerance : float
        Share of friction below which a force that depends on the motion does not matter.
    """
    rng, rng_before, rng_forecast = np.random.default_rng(seed).spawn(3)
    draws = law_draws(fit, rng, DRAWS)
    left = what_is_left(fit)
    factor, relative, unit = friction_scale(found.before.model)
    could_shift = 0.0 if left.worst is None else left.worst.friction * fit.law.unit_force
    scatter = 1.0 + relative * rng.standard_normal(DRAWS)
    # friction that could move for what the law does not say: reflected, as friction is never negative
    values = np.abs(draws.friction * scatter + could_shift * rng.standard_normal(DRAWS))
    after = Distribution(factor * values, unit)
    candidates = _candidates(fit)
    best = frozenset(candidates[0]["effects"])
    before = friction_of_coulomb_model(found.before, rng_before)
    segment = fit.segment
    predicted = forecast(fit, rng_forecast)
    which = _candidate_of(draws, candidates)
    effects = in_catalogue_order(best)
    amplitude = float(np.max(np.abs(fit.path.x))) * fit.unit
    reference = compare_with_reference(after, before, reference_friction) or {}
    if check:
        reference["sampler"] = check_random_force(fit, factor, unit, seed)
    structured = max((d.signal for d in left.dependences if d is left.worst), default=0.0)
    return LoopReport(
        verdict=_verdict(draws, left, candidates, tolerance),
        effects=[_effect(draws, name, which == 0, candidates) for name in effects],
        candidates=candidates,
        friction_before=before.to_dict(),
        friction_after=after.to_dict(),
        held_out_error={
            "before": forecast_error(found.before),
            "after": None if predicted is None else predicted.rms,
            "noise_floor": left.rms,
            "inside90": None if predicted is None else predicted.inside90,
            "unit": segment.decay.unit,
            "what": FORECAST,
        },
        residual={"before": residual_tests(found.before).to_dict(), "after": left.to_dict()},
        noise=_noise(fit),
        paper_procedure=paper_procedure(found.fits[0], after, effects),
        frequency=frequency_summary(
            fit.w0 * np.sqrt(np.maximum(1.0 + draws.stiffness, 0.25)), found.before.model, after
        ),
        random_force=_random_force(draws, factor, unit, candidates),
        witnesses=_witnesses(two_witnesses(fit, factor * fit.law.unit_force, unit)),
        left={
            "structured_rms": structured,
            "unit": segment.decay.unit,
            "share_of_amplitude": structured / amplitude,
            "friction_could_shift_by": factor * could_shift,
            "depends_on": None if left.worst is None else left.worst.on,
        },
        fitted=fitted_part(segment, fit.samples, fit.path.turning.size),
        next_experiment=None,
        reference_check=reference or None,
        elapsed_s=time.perf_counter() - started,
        seed=seed,
        trail=[*found.trail, _step(fit)],
        traces=(_trace(found, fit, draws, factor, unit),),
        posterior=_posterior(draws, after, effects, which, seed),
    )


def _noise(fit: ForceFit) -> dict[str, Any]:
    """Noise of the sensor, a sample of the record: those of a block were averaged."""
    sd = fit.posterior.noise_sd * fit.unit * math.sqrt(fit.segment.block)
    step = fit.segment.resolution
    return {"model": "white", "order": 0, "sd": sd, "correlation_length_s": 0.0, "step": step}


def _step(fit: ForceFit) -> str:
    return (
        f"along the measured motion: {len(fit.sets.effects)} sets of effects weighed with and without "
        f"a random force, log evidence {fit.log_gain:+.1f} with it"
    )


def _candidates(fit: ForceFit) -> list[dict[str, Any]]:
    """Probabilities of the sets of effects, with a random force and without."""
    force = fit.posterior.ratio > 0.0
    probability: dict[frozenset[str], float] = {}
    for used, extra in ((force, frozenset({RANDOM_FORCE.name})), (~force, frozenset())):
        for names, p in zip(fit.sets.effects, fit.posterior.weight[used].sum(axis=0), strict=True):
            probability[names | extra] = probability.get(names | extra, 0.0) + float(p)
    if fit.jitter is not None:
        # weighed by itself: what the noise grows with tells the sets of effects nothing
        jitters, own = fit.jitter.probability, frozenset({TIMING_JITTER.name})
        probability = {
            names | extra: share * p
            for names, p in probability.items()
            for extra, share in ((own, jitters), (frozenset(), 1.0 - jitters))
        }
    kept = {names: p for names, p in probability.items() if p > _LEAST_PROBABILITY}
    total = sum(kept.values())
    ranked = sorted(kept.items(), key=lambda item: -item[1])
    return [{"effects": list(in_catalogue_order(names)), "probability": p / total} for names, p in ranked]


def _candidate_of(draws: LawDraws, candidates: list[dict[str, Any]]) -> Integers:
    """Which candidate each draw belongs to, shape (k,); -1 where that is not listed."""
    place = {frozenset(candidate["effects"]): i for i, candidate in enumerate(candidates)}
    sets = draws.fit.sets.effects
    if draws.fit.jitter is not None and draws.fit.jitter.found:
        sets = tuple(names | {TIMING_JITTER.name} for names in sets)
    without = np.array([place.get(names, -1) for names in sets])
    beside = np.array([place.get(names | {RANDOM_FORCE.name}, -1) for names in sets])
    return np.where(draws.random_force > 0.0, beside[draws.chosen], without[draws.chosen])


def _effect(draws: LawDraws, name: str, in_best: Mask, candidates: list[dict[str, Any]]) -> dict[str, Any]:
    fit = draws.fit
    units = {p.name: p.unit_in(fit.system, fit.segment.decay.unit) for p in EFFECTS[name].parameters}
    if name == RANDOM_FORCE.name:
        parameters = {"sd": draws.random_force[in_best], "correlation_time": draws.correlation_time[in_best]}
    elif name == TIMING_JITTER.name:
        parameters = {"sd": draws.timing_jitter[in_best]}
    else:
        parameters = draws.parameters(name, in_best)
    if name == PERIODIC_INTERFERENCE.name:
        sine, cosine = parameters.pop("sine"), parameters.pop("cosine")
        parameters |= {"amplitude": np.hypot(sine, cosine), "phase": np.arctan2(cosine, sine)}
    return {
        "name": name,
        "probability": sum(c["probability"] for c in candidates if name in c["effects"]),
        "parameters": {
            p.name: _summary(parameters[p.name], units[p.name])
            for p in EFFECTS[name].parameters
            if p.name in parameters
        },
    }


def _summary(values: Array, unit: str) -> dict[str, Any]:
    return {"mean": float(values.mean()), "sd": float(values.std()), "unit": unit}


def _random_force(
    draws: LawDraws, factor: float, unit: str, candidates: list[dict[str, Any]]
) -> dict[str, Any]:
    force = draws.random_force > 0.0
    probability = sum(c["probability"] for c in candidates if RANDOM_FORCE.name in c["effects"])
    sd = factor * draws.random_force[force]
    return {
        "sd": Summary.of_draws(sd, unit).to_dict(),
        "share_of_friction": _share_of_friction(draws),
        "correlation_time_s": Summary.of_draws(draws.correlation_time[force], "s").to_dict(),
        "probability": probability,
    }


def _witnesses(witnesses: Witnesses) -> dict[str, Any]:
    return {
        "loss": witnesses.loss.to_dict(),
        "shape": witnesses.shape.to_dict(),
        "agree": witnesses.agree,
    }


def _share_of_friction(draws: LawDraws) -> float:
    return float(np.median(draws.random_force[draws.random_force > 0.0]) / np.median(draws.friction))


def _verdict(draws: LawDraws, left: LeftOver, candidates: list[dict[str, Any]], tolerance: float) -> str:
    fit = draws.fit
    dependent = left.worst is not None and left.worst.force * fit.law.unit_force > tolerance * float(
        np.median(draws.friction)
    )
    if dependent or not left.is_noise:
        return "unexplained"
    if not candidates[0]["effects"]:
        return "adequate"
    return "explained" if credible_count([c["probability"] for c in candidates]) == 1 else "ambiguous"


def _trace(found: SearchResult, fit: ForceFit, draws: LawDraws, factor: float, unit: str) -> RecordTrace:
    """The record with the Coulomb model and with the smoothed motion."""
    segment, decay, n = fit.segment, fit.segment.decay, fit.samples
    before = found.before.predictions[0]
    turns = fit.path.turning / fit.w0
    after = fit.row @ fit.motion.states.T
    faults = [j for j, c in enumerate(fit.law.columns) if not np.any(fit.law.states[:, :, j])]
    if fit.row[2]:
        # an accelerometer reads the forces of the law too
        after = (
            segment.values[:n] / fit.unit
            - fit.residual
            + fit.row @ (np.column_stack([fit.motion.states[:, :2] - _law_states(fit), fit.fluctuation]).T)
        )
    else:
        after = after + fit.law.sensor[:, faults] @ fit.coefficients[faults]
    scale = factor * fit.law.unit_force
    return RecordTrace(
        name=decay.name,
        unit=decay.unit,
        quantity=decay.quantity.name,
        time=decay.start_time + segment.time[:n],
        signal=segment.values[:n],
        before=before.signal[:n],
        after=after * fit.unit,
        sides=segment.sides[:n],
        phase=np.interp(segment.time[:n], turns, np.arange(turns.size)),
        turning_times_before=decay.start_time + before.turning_times,
        turning_points_before=before.turning_points,
        turning_times=decay.start_time + turns,
        turning_points=fit.path.turning_x,
        fluctuation=FluctuationTrace(
            force=scale * fit.fluctuation,
            sd=scale * fit.fluctuation_sd,
            displacement=fit.path.x,
            velocity=fit.path.v * fit.w0,
            friction=factor * float(np.median(draws.friction)),
            unit=unit,
        ),
    )


def _law_states(fit: ForceFit) -> Array:
    return np.asarray(fit.law.states @ fit.coefficients + fit.law.known_states)


def _posterior(
    draws: LawDraws, after: Distribution, effects: tuple[str, ...], which: Integers, seed: int
) -> xr.DataTree:
    """Draws in ArviZ's layout: those of the most probable candidate, and friction over all."""
    in_best = which == 0
    variables = {"random_force.sd": draws.random_force[in_best]}
    variables["random_force.correlation_time"] = draws.correlation_time[in_best]
    if TIMING_JITTER.name in effects:
        variables["timing_jitter.sd"] = draws.timing_jitter[in_best]
    variables["friction"] = draws.friction[in_best]
    declared = draws.fit.w0 / draws.fit.system.natural_frequency
    variables[LOG_FREQUENCY_RATIO] = np.log(declared) + 0.5 * np.log1p(draws.stiffness[in_best])
    for name in effects:
        if name != RANDOM_FORCE.name:
            for parameter, values in draws.parameters(name, in_best).items():
                variables[f"{name}.{parameter}"] = values
    best = xr.Dataset({key: (("chain", "draw"), value[None]) for key, value in variables.items()})
    mixture = xr.Dataset(
        {
            "friction": (("chain", "draw"), after.draws[None], {"units": after.unit}),
            "candidate": (("chain", "draw"), which[None]),
        }
    )
    return xr.DataTree.from_dict(
        {"posterior": best.assign_attrs(seed=seed), "mixture": mixture.assign_attrs(seed=seed)}
    )
