"""The verdict on the candidates, and friction under it, before a report is written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.decay.located import LEAST_HALF_CYCLES
from friction_bayes.loop import settings
from friction_bayes.loop.checks.forecast import (
    Forecast,
    forecast_records,
    held_out_error,
)
from friction_bayes.loop.data.friction import (
    Distribution,
    dry_friction,
    friction_of_loss,
    reported_friction,
)
from friction_bayes.loop.infer.law_draws import DRAWS
from friction_bayes.loop.mixture.candidates import Candidates
from friction_bayes.loop.mixture.mixture import CandidateMixture
from friction_bayes.loop.report.verdict import (
    UNEXPLAINED,
    credible_count,
    friction_range,
    reasons_against,
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
        What forbids to use the number: see :func:`friction_bayes.loop.report.verdict.reasons_against`.
    mixture : CandidateMixture
        All candidates.
    friction, friction_before : Distribution
        As they are reported, of all candidates and of Coulomb friction alone.
    friction_range, dry, held_out, friction_agreed
        Fields of the report.
    forecasts : tuple
        Of Coulomb friction alone and of all laws, one a record.
    """

    word: str
    against: tuple[str, ...]
    mixture: CandidateMixture
    friction: Distribution
    friction_before: Distribution
    friction_range: dict[str, Any] | None
    dry: dict[str, Any]
    held_out: dict[str, Any]
    friction_agreed: bool
    forecasts: tuple[tuple[Forecast, ...], tuple[Forecast, ...]]


def judge(candidates: Candidates, rng: np.random.Generator) -> Judgement:
    """The mixture of candidates, and the verdict on the most probable by its consequences."""
    rng_mixture, rng_before, rng_after, rng_dry = rng.spawn(4)
    mixture = candidates.mixture.with_slight_force(candidates.slight_force, rng_mixture)
    before, frequency = candidates.before, mixture.frequency
    model = before.model
    loss, factor = _loss(candidates, frequency), candidates.factor
    friction = reported_friction(mixture.friction, frequency, model, rng_dry)
    dry = dry_friction(friction, loss, candidates.tolerance)
    forecasts = forecast_records(before), candidates.forecasts()
    held_out = held_out_error(*forecasts, candidates.noise_floor(), model.segments[0].decay.unit)
    after = reported_friction(mixture.friction, frequency, model, rng_after)
    against = reasons_against(
        is_noise=candidates.explains,
        shift=factor * candidates.shift,
        loss=loss,
        held_out=held_out,
        least_noise=candidates.least_noise,
        friction=after.to_dict()["interval90"],
        witnesses=candidates.witnesses(),
        contradicted=candidates.contradicted,
    )
    word = verdict(mixture.sets, mixture.probabilities, mixture.agrees, against, dry["probability"])
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
        friction_range=friction_range(readings, factor, candidates.unit) if readings else None,
        dry=dry,
        held_out=held_out,
        friction_agreed=agreed and not against,
        forecasts=forecasts,
    )


def _loss(candidates: Candidates, frequency: Array) -> float:
    """Friction that alone would explain the loss of amplitude, as friction is reported."""
    model, turning_points = candidates.before.model, candidates.traces[0].turning_points
    if turning_points.size < LEAST_HALF_CYCLES:
        return 0.0
    system, order = model.system, model.segments[0].order
    ratio = float(frequency.mean()) / system.natural_frequency
    return candidates.factor * system.stiffness * ratio**order * friction_of_loss(turning_points)
