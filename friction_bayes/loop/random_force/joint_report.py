"""The report of several records under one law, each with a fluctuation and perhaps a friction of its own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.summary import TAILS, Summary
from friction_bayes.loop.assemble import frequency_summary
from friction_bayes.loop.candidate import SearchResult, in_catalogue_order
from friction_bayes.loop.draws import DRAWS
from friction_bayes.loop.forecast import Forecast, forecast_errors
from friction_bayes.loop.friction import (
    Distribution,
    dry_friction,
    friction_of_loss,
    friction_scale,
    scale_draws,
)
from friction_bayes.loop.friction_range import Reading, coulomb_alone, friction_range
from friction_bayes.loop.noise import LEAST_NOISE
from friction_bayes.loop.paper_procedure import paper_procedure
from friction_bayes.loop.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.random_force.draws import LawDraws, law_draws
from friction_bayes.loop.random_force.fit import ForceFit
from friction_bayes.loop.random_force.forecast import forecast
from friction_bayes.loop.random_force.joint_draws import JointDraws, joint_draws
from friction_bayes.loop.random_force.joint_fit import JointFit
from friction_bayes.loop.random_force.left_over import LeftOver, what_is_left
from friction_bayes.loop.residual_tests import Channel, ResidualTests, residual_tests
from friction_bayes.loop.result import FluctuationTrace, LoopReport, RecordTrace
from friction_bayes.loop.verdict import verdict
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["joint_report", "only_searched"]

_LEAST_PROBABILITY = 1e-9
"""Of a candidate that is listed."""


def joint_report(
    report: LoopReport,
    found: SearchResult,
    fit: JointFit,
    rng: np.random.Generator,
    *,
    tolerance: float,
) -> LoopReport:
    """Say what the joint analysis found where a report has what the search found.

    Parameters
    ----------
    report : LoopReport
        Of the search: what it says of the Coulomb model alone is kept.
    found : SearchResult
    fit : JointFit
    rng : numpy.random.Generator
    tolerance : float
        Share of friction below which a force that depends on the motion does not matter.
    """
    draws = joint_draws(fit, rng, DRAWS)
    tests = [what_is_left(one) for one in fit.fits]
    model = found.before.model
    factor, unit = friction_scale(model)
    first = fit.fits[0]
    frequencies = first.w0 * np.sqrt(np.maximum(1.0 + draws.records[0].stiffness, 0.25))
    scale = scale_draws(model, frequencies, DRAWS, rng)
    shift, worst = max(
        ((_could_shift(one, left), left) for one, left in zip(fit.fits, tests, strict=True)),
        key=lambda pair: pair[0],
    )
    could_be = draws.friction + shift * rng.standard_normal(DRAWS)
    after = Distribution(np.abs(scale * could_be), unit)
    sets, probabilities, which = _candidates(fit, draws)
    best = np.asarray(which == 0)
    effects = in_catalogue_order(sets[0])
    predicted = [forecast(one, rng) for one in fit.fits]
    together = _of_all(tests)
    explains = not any(
        left.matters(tolerance, one.comparable_friction(draws.friction))
        for one, left in zip(fit.fits, tests, strict=True)
    )
    structured = 0.0 if worst.worst is None else worst.worst.signal
    candidates: list[dict[str, Any]] = [
        {"effects": list(in_catalogue_order(names)), "probability": float(p)}
        for names, p in zip(sets, probabilities, strict=True)
    ]
    parameters = {name: _parameters(draws, name, best) for name in effects}
    readings = [
        coulomb_alone(found.before, rng.spawn(1)[0]),
        Reading("the sets weighed along the measured motions", np.abs(could_be)),
    ]
    forced = draws.records[0].random_force > 0.0
    return replace(
        report,
        verdict=verdict(sets, probabilities, np.ones(len(sets), np.bool_), explains),
        effects=[
            {
                "name": name,
                "probability": sum(c["probability"] for c in candidates if name in c["effects"]),
                "parameters": _summaries(fit, name, parameters[name]),
            }
            for name in effects
        ],
        candidates=candidates,
        friction_after=after.to_dict(),
        friction_range=None if explains else friction_range(readings, factor, unit),
        dry_friction=dry_friction(
            after, factor * friction_of_loss(first.path.turning_x) * first.law.unit_force, tolerance
        ),
        held_out_error=report.held_out_error
        | forecast_errors([one for one in predicted if one is not None])
        | {"noise_floor": tests[0].rms},
        residual=report.residual | {"after": together.to_dict()},
        noise=report.noise | {"model": "white", "order": 0, "sd": _noise(first), "correlation_length_s": 0.0},
        paper_procedure=paper_procedure(found.fits[0], after, effects),
        frequency=frequency_summary(frequencies, model, draws.friction),
        random_force=_random_force(draws.records[0], candidates, factor, unit) if forced.any() else None,
        left=report.left
        | {
            "structured_rms": structured,
            "share_of_amplitude": structured / (float(np.max(np.abs(first.path.x))) * first.unit),
            "friction_could_shift_by": factor * shift,
            **worst.to_left(),
        },
        fitted=report.fitted
        | {
            "to_s": float(first.segment.decay.start_time + first.segment.time[first.samples - 1]),
            "samples": first.samples,
            "half_cycles": first.path.turning.size - 1,
            "set_aside": int(np.count_nonzero(first.segment.sides[: first.samples])),
        },
        next_experiment=None,
        reference_check=_reference(report.reference_check, after),
        trail=[
            *report.trail,
            f"along the measured motions: {len(first.sets.effects)} sets of effects weighed on "
            f"{len(fit.fits)} records together",
        ],
        traces=tuple(
            _trace(trace, one, own, ahead, factor, unit)
            for trace, one, own, ahead in zip(report.traces, fit.fits, draws.records, predicted, strict=True)
        ),
        posterior=_posterior(fit, draws, parameters, best, which, after, report.seed),
        friction_between_records=_between(fit, draws, scale, factor, unit, rng),
    )


def only_searched(found: SearchResult) -> bool:
    """Whether what the search found has no place among columns along the motion.

    Clipped samples and outliers have none, nor has coloured noise of the sensor that explains the records,
    nor a signal without noise.
    """
    best, white = found.fits[0], found.white
    silent = white.noises[0].sd <= LEAST_NOISE * white.model.scales.signal
    coloured = any(ar.size for ar in found.ar) and not residual_tests(best).failed
    return silent or coloured or bool(found.sets[0] & {SENSOR_CLIPPING.name, OUTLIERS.name})


def _could_shift(fit: ForceFit, left: LeftOver) -> float:
    """Friction that could move for what a record's law does not say [N or N m]."""
    return 0.0 if left.worst is None else left.worst.friction * fit.law.unit_force


def _candidates(fit: JointFit, draws: JointDraws) -> tuple[list[frozenset[str]], Array, Integers]:
    """Sets of effects, most probable first, their probabilities, and which each draw has."""
    names = fit.along[0].sets.effects
    force = fit.posterior.ratio > 0.0
    total: dict[frozenset[str], float] = {}
    for used, extra in ((force, frozenset({RANDOM_FORCE.name})), (~force, frozenset())):
        of_set = np.bincount(fit.problem.number, fit.posterior.weight[used].sum(axis=0), len(names))
        for each, p in zip(names, of_set, strict=True):
            total[each | extra] = total.get(each | extra, 0.0) + float(p)
    sets = sorted((s for s, p in total.items() if p > _LEAST_PROBABILITY or not s), key=lambda s: -total[s])
    probabilities = np.array([total[s] for s in sets])
    place = {s: i for i, s in enumerate(sets)}
    forced = draws.records[0].random_force > 0.0
    which = [
        place[names[m] | ({RANDOM_FORCE.name} if some else frozenset())]
        for m, some in zip(draws.sets, forced, strict=True)
    ]
    return sets, probabilities / probabilities.sum(), np.array(which)


def _parameters(draws: JointDraws, name: str, best: Mask) -> dict[str, Array]:
    if name == RANDOM_FORCE.name:
        first = draws.records[0]
        return {"sd": first.random_force[best], "correlation_time": first.correlation_time[best]}
    found = draws.parameters(name, best)
    if name != PERIODIC_INTERFERENCE.name:
        return found
    for key in [key for key in found if key.startswith("sine")]:
        number = key.removeprefix("sine")
        sine, cosine = found.pop(key), found.pop(f"cosine{number}")
        found[f"amplitude{number}"] = np.hypot(sine, cosine)
        found[f"phase{number}"] = np.arctan2(cosine, sine)
    return found


def _summaries(fit: JointFit, name: str, parameters: dict[str, Array]) -> dict[str, Any]:
    one = fit.fits[0]
    units = {p.name: p.unit_in(one.system, one.segment.decay.unit) for p in EFFECTS[name].parameters}
    return {
        key: {"mean": float(x.mean()), "sd": float(x.std()), "unit": units[key.split("[")[0]]}
        for key, x in parameters.items()
    }


def _of_all(tests: Sequence[LeftOver]) -> ResidualTests:
    """Each test at the record where it is worst, its p-value that of the least of as many."""
    channels = []
    for same in zip(*(left.channels for left in tests), strict=True):
        least = min(same, key=lambda channel: channel.p_value)
        p_value = -math.expm1(len(same) * math.log1p(-min(least.p_value, 1.0 - 1e-12)))
        channels.append(Channel(least.name, least.statistic, least.degrees, p_value))
    return ResidualTests(tuple(channels), tests[0].rms)


def _noise(fit: ForceFit) -> float:
    """Noise of the sensor, a sample of the first record: those of a block were averaged."""
    return fit.posterior.best.noise * fit.unit * math.sqrt(fit.segment.block)


def _random_force(
    draws: LawDraws, candidates: Sequence[dict[str, Any]], factor: float, unit: str
) -> dict[str, Any]:
    """Size of the random force in the first record, and its correlation time in all."""
    forced = draws.random_force > 0.0
    sd, friction = draws.random_force[forced], float(np.median(draws.friction))
    return {
        "sd": Summary.of_draws(factor * sd, unit).to_dict(),
        "share_of_friction": float(np.median(sd)) / friction if friction else None,
        "correlation_time_s": Summary.of_draws(draws.correlation_time[forced], "s").to_dict(),
        "probability": sum(c["probability"] for c in candidates if RANDOM_FORCE.name in c["effects"]),
    }


def _between(
    fit: JointFit, draws: JointDraws, scale: Array, factor: float, unit: str, rng: np.random.Generator
) -> dict[str, Any]:
    """Each record's friction, and their spread given that there is one."""
    differs = draws.spread > 0.0
    spread = draws.spread[differs]
    return {
        "probability": fit.probability_of_spread,
        "spread": Summary.of_draws(factor * spread, unit).to_dict() if spread.size > 1 else None,
        "share_of_friction": float(np.median(spread / draws.friction[differs])) if spread.size else 0.0,
        "reduced_chi_square": _reduced_chi_square(fit, rng),
        "records": [
            {
                "name": one.fit.segment.decay.name,
                "friction": Summary.of_draws(np.abs(scale * one.friction), unit).to_dict(),
            }
            for one in draws.records
        ],
    }


def _reduced_chi_square(fit: JointFit, rng: np.random.Generator) -> float:
    """Of the frictions that each record has by itself, about their weighted mean."""
    alone = [law_draws(one, rng, DRAWS).friction for one in fit.alone]
    mean, weight = np.array([x.mean() for x in alone]), np.array([1.0 / x.var() for x in alone])
    centre = float(weight @ mean / weight.sum())
    return float(weight @ (mean - centre) ** 2 / (len(alone) - 1))


def _reference(check: dict[str, Any] | None, after: Distribution) -> dict[str, Any] | None:
    """What was compared with a known friction, of the friction found now."""
    if check is None or "friction" not in check:
        return check
    low, high = np.quantile(after.draws, TAILS)
    return check | {
        "error_after": float(after.draws.mean()) / check["friction"] - 1.0,
        "within_interval90": bool(low <= check["friction"] <= high),
    }


def _trace(
    trace: RecordTrace, fit: ForceFit, draws: LawDraws, ahead: Forecast | None, factor: float, unit: str
) -> RecordTrace:
    """A record with its smoothed motion, its fluctuation and the forecast of its last part."""
    segment, n, turns = fit.segment, fit.samples, fit.path.turning / fit.w0
    scale = factor * fit.law.unit_force
    return replace(
        trace,
        time=trace.time[:n],
        signal=trace.signal[:n],
        before=trace.before[:n],
        after=fit.smoothed_signal * fit.unit,
        sides=trace.sides[:n],
        phase=np.interp(segment.time[:n], turns, np.arange(turns.size)),
        turning_times=segment.decay.start_time + turns,
        turning_points=fit.path.turning_x,
        fluctuation=FluctuationTrace(
            force=scale * fit.fluctuation,
            sd=scale * fit.fluctuation_sd,
            displacement=fit.path.x,
            velocity=fit.path.v * fit.w0,
            friction=factor * float(np.median(draws.friction)),
            unit=unit,
        ),
        forecast=None
        if trace.forecast is None or ahead is None
        else replace(trace.forecast, after=ahead.mean, sd=ahead.sd),
    )


def _posterior(
    fit: JointFit,
    draws: JointDraws,
    parameters: dict[str, dict[str, Array]],
    best: Mask,
    which: Integers,
    after: Distribution,
    seed: int,
) -> xr.DataTree:
    """Draws in ArviZ's layout: those of the most probable candidate, and friction over all."""
    first = fit.fits[0]
    declared = math.log(first.w0 / first.system.natural_frequency)
    variables = {
        "friction": draws.friction[best],
        LOG_FREQUENCY_RATIO: declared + 0.5 * np.log1p(draws.records[0].stiffness[best]),
        "friction_spread": draws.spread[best],
    }
    for r, one in enumerate(draws.records):
        variables[f"friction[{r}]"] = one.friction[best]
        variables[f"displacement[{r}]"] = one.coefficients[best, 0]
        variables[f"velocity[{r}]"] = one.coefficients[best, 1] * first.w0
    for name, values in parameters.items():
        variables |= {f"{name}.{key}": x for key, x in values.items()}
    mixture = {
        "friction": (("chain", "draw"), after.draws[None], {"units": after.unit}),
        "candidate": (("chain", "draw"), which[None]),
    }
    dataset = xr.Dataset({key: (("chain", "draw"), x[None]) for key, x in variables.items()})
    return xr.DataTree.from_dict(
        {
            "posterior": dataset.assign_attrs(seed=seed),
            "mixture": xr.Dataset(mixture).assign_attrs(seed=seed),
        }
    )
