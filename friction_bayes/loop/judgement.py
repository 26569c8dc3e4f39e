"""The verdict on the candidates, and friction under it, before a report is written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_bayes.decay.located import LEAST_HALF_CYCLES
from friction_bayes.loop import settings
from friction_bayes.loop.checks.held_out import (
    CoulombForecast,
    Forecast,
    forecast_records,
    held_out_error,
)
from friction_bayes.loop.data.friction import (
    Distribution,
    dry_friction,
    friction_of_loss,
    friction_scale,
    reported_friction,
)
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.infer.law_draws import DRAWS
from friction_bayes.loop.mixture.candidates import Candidates
from friction_bayes.loop.mixture.mixture import CandidateMixture, mixture_of
from friction_bayes.loop.mixture.prior_sensitivity import prior_sensitivity
from friction_bayes.loop.report.friction_range import friction_range
from friction_bayes.loop.report.result import RecordTrace
from friction_bayes.loop.report.verdict import (
    UNEXPLAINED,
    Consequences,
    credible_count,
    verdict,
)

__all__ = ["Judgement", "judge"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """The verdict and its reasons.

    Attributes
    ----------
    word : str
        The verdict.
    against : tuple of str
        What forbids to use the number: see :class:`friction_bayes.loop.report.verdict.Consequences`.
    mixture : CandidateMixture
        All candidates.
    friction, friction_before : Distribution
        As they are reported, of all candidates and of Coulomb friction alone.
    friction_range, dry, witnesses : dict or None
        Fields of the report.
    held_out, left : dict
        The same.
    sensitivity : dict
        The report's ``prior_sensitivity``.
    friction_agreed : bool
        The report's.
    shift : float
        How far friction could shift for what is left, as it is reported.
    forecasts : tuple
        Of Coulomb friction alone and of all laws, one a record.
    traces : tuple of RecordTrace
    """

    word: str
    against: tuple[str, ...]
    mixture: CandidateMixture
    friction: Distribution
    friction_before: Distribution
    friction_range: dict[str, Any] | None
    dry: dict[str, Any]
    witnesses: dict[str, Any] | None
    held_out: dict[str, Any]
    left: dict[str, Any]
    sensitivity: dict[str, Any]
    friction_agreed: bool
    shift: float
    forecasts: tuple[tuple[CoulombForecast, ...], tuple[Forecast, ...]]
    traces: tuple[RecordTrace, ...]


def judge(candidates: Candidates, rng: np.random.Generator, tolerance: float) -> Judgement:
    """The mixture of candidates, and the verdict on the most probable by its consequences.

    Parameters
    ----------
    candidates : Candidates
    rng : numpy.random.Generator
    tolerance : float
        Share of the loss of amplitude from which on dry friction matters.
    """
    rng_mixture, rng_before, rng_after, rng_dry = rng.spawn(4)
    mixture = mixture_of(candidates, rng_mixture)
    before, frequency = candidates.before, mixture.draws.frequency
    model = before.model
    left, traces = candidates.left(), candidates.traces()
    loss = _loss(traces[0], mixture, model)
    dry = dry_friction(reported_friction(mixture.draws.friction, frequency, model, rng_dry), loss, tolerance)
    factor, unit = friction_scale(model)
    shift = factor * left["friction_could_shift_by"]
    forecasts = forecast_records(before), candidates.forecasts()
    held_out = held_out_error(*forecasts, candidates.noise_floor(), model.segments[0].decay.unit)
    witnesses = candidates.witnesses()
    after = reported_friction(mixture.draws.friction, frequency, model, rng_after)
    against = Consequences(
        is_noise=candidates.explains,
        shift=shift,
        loss=loss,
        held_out=held_out,
        least_noise=candidates.least_noise,
        friction=after.to_dict()["interval90"],
        witnesses=witnesses,
        contradicted=candidates.contradicted,
    ).against()
    word = verdict(mixture.sets, mixture.probabilities, mixture.agrees, against, dry["probability"])
    sensitivity = prior_sensitivity(mixture.draws, mixture.sets, len(candidates.evaluated))
    count = credible_count(mixture.probabilities)
    # all agree on a friction that may be zero
    agreed = dry["probability"] >= settings.SETTINGS.credible_mass and mixture.same_friction(count)
    alone, readings = before.friction(rng_before, DRAWS), None
    if word == UNEXPLAINED:
        by_all = candidates.by_all_sets
        readings = {"Coulomb friction alone": alone, "the sets evaluated along the measured motion": by_all}
    return Judgement(
        word=word,
        against=against,
        mixture=mixture,
        friction=after,
        friction_before=reported_friction(alone, frequency, model, rng_before),
        friction_range=friction_range(readings, factor, unit) if readings else None,
        dry=dry,
        witnesses=witnesses,
        held_out=held_out,
        left=left,
        sensitivity=sensitivity,
        friction_agreed=agreed and not against,
        shift=shift,
        forecasts=forecasts,
        traces=traces,
    )


def _loss(trace: RecordTrace, mixture: CandidateMixture, model: LoopModel) -> float:
    """Friction that alone would explain the loss of amplitude, as friction is reported."""
    if trace.turning_points.size < LEAST_HALF_CYCLES:
        return 0.0
    system, order = model.system, model.segments[0].order
    ratio = float(mixture.draws.frequency.mean()) / system.natural_frequency
    factor, _ = friction_scale(model)
    return factor * system.stiffness * ratio**order * friction_of_loss(trace.turning_points)
