"""From candidates to a report."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.text import set_words
from friction_bayes.loop.autoregression import correlation_length
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.forecast import held_out_error
from friction_bayes.loop.friction import Distribution, friction_posterior, mixture_draws
from friction_bayes.loop.next_experiment import next_experiment
from friction_bayes.loop.paper_procedure import paper_procedure
from friction_bayes.loop.reference_force import compare_forces
from friction_bayes.loop.residual_tests import residual_tests
from friction_bayes.loop.result import LoopReport, RecordTrace
from friction_bayes.loop.sampler_check import sampler_check
from friction_bayes.loop.verdict import credible_count, verdict
from friction_bayes.mechanics.effects import EFFECTS

__all__ = ["SearchResult", "assemble_report"]

_MOST_RIVALS = 3
_FREQUENCY_TOLERANCE = 0.03
"""Relative difference of the found frequency and sqrt(k/m) above which both forces are told."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchResult:
    """What a search left: candidates, most probable first, and the Coulomb model alone."""

    sets: tuple[frozenset[str], ...]
    fits: tuple[LoopFit, ...]
    probabilities: Array
    before: LoopFit
    ar: tuple[Array, ...]
    trail: tuple[str, ...]


def assemble_report(
    found: SearchResult,
    *,
    seed: int,
    started: float,
    check: bool,
    reference_friction: float | None,
    reference_force: Array | None,
) -> LoopReport:
    """Draw from the candidates, test what they leave, and put it into words and numbers."""
    rng_mixture, rng_before = np.random.default_rng(seed).spawn(2)
    best = found.fits[0]
    tests_before, tests_after = residual_tests(found.before), residual_tests(best)
    which, draws = mixture_draws(
        found.fits, found.probabilities, rng_mixture, misfit=bool(tests_after.failed)
    )
    after = friction_posterior(found.fits, draws, rng_mixture)
    _, alone = mixture_draws([found.before], np.ones(1), rng_before, misfit=bool(tests_before.failed))
    before = friction_posterior([found.before], alone, rng_before)
    word = verdict(found.sets, found.probabilities, not tests_after.failed)
    names = [set_words(_in_order(s)) for s in found.sets]
    rivals = min(credible_count(found.probabilities), _MOST_RIVALS + 1)
    further = next_experiment(found.fits[:rivals], names[:rivals]) if word == "ambiguous" else None
    effects = _in_order(found.sets[0])
    step = best.model.segments[0].decay.step
    lengths = [correlation_length(a, step) for a in found.ar]
    residual: dict[str, Any] = {"before": tests_before.to_dict(), "after": tests_after.to_dict()}
    forces: tuple[Array, ...] | None = None
    if reference_force is not None:
        residual["force"], forces = compare_forces(found.before, best, reference_force)
    return LoopReport(
        verdict=word,
        effects=_effects(found, effects, draws[0]),
        candidates=[
            {"effects": list(_in_order(s)), "probability": float(p)}
            for s, p in zip(found.sets, found.probabilities, strict=True)
        ],
        friction_before=before.to_dict(),
        friction_after=after.to_dict(),
        held_out_error=held_out_error(found.before, best),
        residual=residual,
        noise={
            "model": "ar" if max(a.size for a in found.ar) else "white",
            "order": max(a.size for a in found.ar),
            "sd": float(np.mean([np.std(e) for e in best.free_residuals])),
            "correlation_length_s": float(max(lengths)),
        },
        paper_procedure=paper_procedure(best, after, effects),
        frequency=_frequency(best, draws[0], after),
        next_experiment=further,
        reference_check=_reference(found, after, before, reference_friction, seed if check else None),
        elapsed_s=time.perf_counter() - started,
        seed=seed,
        trail=list(found.trail),
        traces=tuple(
            _trace(found.before, best, r, forces if r == 0 else None) for r in range(len(best.noises))
        ),
        posterior=_posterior(best, draws[0], after, which, seed),
    )


def _frequency(best: LoopFit, draws: Array, after: Distribution) -> dict[str, Any]:
    """The frequency found beside the declared one, and both forces where the two disagree."""
    model, decay = best.model, best.model.segments[0].decay
    declared, order = model.system.natural_frequency, decay.quantity.order
    ratios = np.exp(np.asarray(model.coordinates[1].value(draws[:, 1])))
    ratio, friction = float(ratios.mean()), float(after.draws.mean())
    told: dict[str, Any] = {
        "mean": declared * ratio,
        "sd": declared * _sd(ratios),
        "declared": declared,
        "unit": "rad/s",
        "from_stiffness": None,
        "from_mass": None,
    }
    if abs(ratio - 1.0) > _FREQUENCY_TOLERANCE and after.unit == model.system.friction_unit:
        told["from_stiffness"] = friction / ratio**order
        told["from_mass"] = friction * ratio ** (2 - order)
    return told


def _in_order(names: frozenset[str]) -> tuple[str, ...]:
    return tuple(name for name in EFFECTS if name in names)


def _effects(found: SearchResult, names: tuple[str, ...], draws: Array) -> list[dict[str, Any]]:
    best = found.fits[0]
    told = []
    for name in names:
        held = [name in s for s in found.sets]
        parameters: dict[str, Any] = {}
        decay = best.model.segments[0].decay
        units = {p.name: p.unit_in(best.model.system, decay.unit) for p in EFFECTS[name].parameters}
        several = len(best.model.segments) > 1
        for j, c in enumerate(best.model.coordinates):
            if c.effect != name:
                continue
            values = np.asarray(c.value(draws[:, j]))
            key = f"{c.name}[{c.record}]" if several and c.record >= 0 else c.name
            parameters[key] = {"mean": _mean(values), "sd": _sd(values), "unit": units[c.name]}
        if not parameters:
            parameters = _noise_parameters(best, name, units)
        told.append(
            {"name": name, "probability": float(found.probabilities[held].sum()), "parameters": parameters}
        )
    return told


def _mean(values: Array) -> float:
    return float(values.mean()) if values.size else math.nan


def _sd(values: Array) -> float:
    return float(values.std(ddof=1)) if values.size > 1 else math.nan


def _noise_parameters(fit: LoopFit, name: str, units: dict[str, str]) -> dict[str, Any]:
    """Parameters that are no coordinates: those of the outliers, and the level that samples are held at."""
    segment, noise = fit.model.segments[0], fit.noises[0]
    if name == "outliers":
        n = max(segment.values.size, 1)
        count = max(noise.fraction * n, 1.0)
        return {
            "fraction": {
                "mean": noise.fraction,
                "sd": math.sqrt(noise.fraction * (1.0 - noise.fraction) / n),
                "unit": units["fraction"],
            },
            "scale": {
                "mean": noise.scale,
                "sd": noise.scale / math.sqrt(2.0 * count),
                "unit": units["scale"],
            },
        }
    held = np.abs(segment.values[segment.sides != 0.0])
    level = float(held.max()) if held.size else math.nan
    return {"level": {"mean": level, "sd": 0.0, "unit": units["level"]}}


def _reference(
    found: SearchResult,
    after: Distribution,
    before: Distribution,
    friction: float | None,
    seed: int | None,
) -> dict[str, Any] | None:
    told: dict[str, Any] = {}
    if friction is not None:
        told["friction"] = friction
        told["error_before"] = float(before.draws.mean()) / friction - 1.0
        told["error_after"] = float(after.draws.mean()) / friction - 1.0
        low, high = np.quantile(after.draws, (0.05, 0.95))
        told["within_interval90"] = bool(low <= friction <= high)
    if seed is not None:
        told["sampler"] = sampler_check(found.before, found.fits[0], seed)
    return told or None


def _trace(before: LoopFit, after: LoopFit, r: int, forces: tuple[Array, ...] | None) -> RecordTrace:
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
    variables = {}
    several = len(best.model.segments) > 1
    for j, c in enumerate(best.model.coordinates):
        name = f"{c.effect}.{c.name}" if c.effect else c.name
        if several and c.record >= 0:
            name = f"{name}[{c.record}]"
        variables[name] = (("chain", "draw"), np.asarray(c.value(draws[:, j]))[None])
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
