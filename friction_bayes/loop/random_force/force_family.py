"""Sets of effects beside a random force as a family of candidates, weighed along the measured motion."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.text import percent
from friction_bayes.loop.candidate import INCLUSION
from friction_bayes.loop.draws import DRAWS
from friction_bayes.loop.effect_summaries import parameter_summary, parameter_units
from friction_bayes.loop.expansion import LEAST_INFORMATION
from friction_bayes.loop.family import FamilyDraws
from friction_bayes.loop.forecast import Forecast
from friction_bayes.loop.friction import friction_scale
from friction_bayes.loop.friction_range import Reading
from friction_bayes.loop.next_experiment import Contender
from friction_bayes.loop.noise import LEAST_NOISE
from friction_bayes.loop.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.random_force.contender import drawn_contender
from friction_bayes.loop.random_force.draws import LawDraws, law_draws
from friction_bayes.loop.random_force.evidence import log_scale
from friction_bayes.loop.random_force.fit import ForceFit, fit_random_force
from friction_bayes.loop.random_force.forecast import forecast
from friction_bayes.loop.random_force.left_over import LeftOver, what_is_left
from friction_bayes.loop.random_force.sampler_check import check_random_force
from friction_bayes.loop.random_force.slight_beside_law import friction_with_slight_effects
from friction_bayes.loop.random_force.witnesses import two_witnesses
from friction_bayes.loop.reference_force import ResistingForce
from friction_bayes.loop.result import FluctuationTrace, RecordTrace
from friction_bayes.loop.search_family import SearchFamily
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING
from friction_bayes.mechanics.effects.timing_jitter import TIMING_JITTER

__all__ = ["LEAST_COUNTED", "ForceFamily", "force_family"]

_LEAST = 1e-12
"""Posterior probability of a set at a point of the grid that counts."""
_LARGEST_SHARE = 1.5
"""Sd of a random force, over the friction that alone would explain the loss of amplitude, above which it is
no fluctuation but stands for the unknown."""
LEAST_COUNTED = 0.05
"""Probability of an effect that the search does not try below which no candidate has it.

So little can neither keep a law from 95 % nor move friction's interval noticeably; but several effects at a
few per cent each, which a record that says little of them leaves them, would keep any law from that.
"""


def force_family(
    search: SearchFamily, allowed: tuple[str, ...], tolerance: float, rng: np.random.Generator
) -> ForceFamily | None:
    """Weigh sets of effects beside a random force.

    Returns
    -------
    ForceFamily or None
        None where that cannot be done.
    """
    found, white = search.found, search.found.white
    silent = white.noises[0].sd <= LEAST_NOISE * white.model.scales.signal
    if silent or SENSOR_CLIPPING.name in found.sets[0]:
        return None
    fit = fit_random_force(white.model.segments[0], white.model.system, allowed)
    if fit is None:
        return None
    return ForceFamily(search, fit, allowed, tolerance, rng)


class ForceFamily:
    """Candidates weighed along the measured motion (see :class:`friction_bayes.loop.family.Family`).

    All have an effect that the search does not try: a random force, or one that only the regression knows.
    What is improbable of these (see :data:`LEAST_COUNTED`) is left out, so that there may be no candidate at
    all. No random force is larger than what the loss of amplitude could be friction of: its prior ends there.

    Parameters
    ----------
    search : SearchFamily
        What the search without a random force found.
    fit : ForceFit
    allowed : tuple of str
        All effects that any family may have.
    tolerance : float
        Share of friction below which a force that depends on the motion does not matter.
    rng : numpy.random.Generator
        Of the draws.
    """

    def __init__(
        self,
        search: SearchFamily,
        fit: ForceFit,
        allowed: tuple[str, ...],
        tolerance: float,
        rng: np.random.Generator,
    ) -> None:
        self.found, self.fit = search.found, fit
        self._tolerance = tolerance
        self._rng_draws, self._rng_forecast, self._rng_reading = rng.spawn(3)
        # the regression normalises the prior over its own sets
        none = logsumexp(fit.sets.log_prior[[not names for names in fit.sets.effects]])
        others = len(set(allowed) - {RANDOM_FORCE.name}) * math.log1p(-INCLUSION)
        scale = log_scale(fit, self.found.white) + others - float(none)
        # the weights are shared out to jitter and none, while the scale is that of none
        jitters = 0.0 if fit.jitter is None else float(np.logaddexp(0.0, fit.jitter.log_odds))
        shift = fit.posterior.log_evidence + scale + jitters
        self._weights = self._weighed_here()
        sums = self._sums()
        total = np.logaddexp.reduce([*search.log_weights, *(shift + np.log([*sums.values()]))])
        own = (name for name in allowed if name not in self.found.allowed)
        probability = {
            name: sum(math.exp(math.log(w) + shift - total) for names, w in sums.items() if name in names)
            for name in own
        }
        self._leave_out({name for name, p in probability.items() if p < LEAST_COUNTED})
        ranked = sorted(
            ((math.log(weight) + shift, names) for names, weight in self._sums().items()),
            key=lambda pair: -pair[0],
        )
        self.sets = tuple(names for _, names in ranked)
        self.log_weights = np.array([value for value, _ in ranked])
        lines = ", ".join(f"{line:.4g}" for line in fit.lines)
        self.trail: tuple[str, ...] = (
            f"along the measured motion: {len(fit.sets.effects)} sets of effects weighed with and without "
            f"a random force, log evidence {fit.log_gain:+.1f} with it"
            + (f"; lines of interference that may be there: {lines} Hz" if lines else ""),
            *(
                f"{name} has a probability of {percent(p)}: left out"
                for name, p in probability.items()
                if 0.0 < p < LEAST_COUNTED
            ),
        )

    def _weighed_here(self) -> dict[bool, Array]:
        """Posterior of points and sets with jitter of the sample times, and without, shape (g, m).

        Zero where the search has the candidate. Jitter is weighed by itself: what the noise grows with tells
        the sets of effects nothing.
        """
        fit, tried, nothing = self.fit, set(self.found.allowed), _unknowable(self.fit)
        forced = (fit.posterior.ratio > 0.0)[:, None]
        own = forced | np.array([not names <= tried for names in fit.sets.effects])
        known = np.array([not names & nothing for names in fit.sets.effects])
        if fit.share_of_loss > _LARGEST_SHARE:
            known = known & ~forced
        jitter = 0.0 if fit.jitter is None else fit.jitter.probability
        weight = fit.posterior.weight
        return {False: (1.0 - jitter) * (own & known) * weight, True: jitter * known * weight}

    def _sums(self) -> dict[frozenset[str], float]:
        """Posterior probability of each set of effects, of all that the regression weighs."""
        sums: dict[frozenset[str], float] = {}
        for jitter, weight in self._weights.items():
            for g, m in np.argwhere(weight > _LEAST * self._total.sum()):
                names = self._names(g, m, jitter)
                sums[names] = sums.get(names, 0.0) + float(weight[g, m])
        return sums

    @property
    def _total(self) -> Array:
        """Posterior of points and sets, shape (g, m)."""
        return self._weights[False] + self._weights[True]

    def _leave_out(self, effects: set[str]) -> None:
        """Leave out the candidates that have any of these."""
        fit = self.fit
        kept = np.array([not names & effects for names in fit.sets.effects])
        if RANDOM_FORCE.name in effects:
            kept = kept & (fit.posterior.ratio == 0.0)[:, None]
        self._weights = {jitter: kept * weight for jitter, weight in self._weights.items()}
        if TIMING_JITTER.name in effects:
            self._weights[True] = np.zeros_like(self._weights[True])

    def _names(self, g: int, m: int, jitter: bool) -> frozenset[str]:
        """Effects of a set at a point of the grid."""
        force = {RANDOM_FORCE.name} if self.fit.posterior.ratio[g] > 0.0 else set()
        return self.fit.sets.effects[m] | force | ({TIMING_JITTER.name} if jitter else set())

    @cached_property
    def _law_draws(self) -> LawDraws:
        return law_draws(self.fit, self._rng_draws, DRAWS, self._total)

    @cached_property
    def best(self) -> ForceFit:
        """The analysis on the most probable candidate."""
        cells = sum(weight * self._is_best(jitter) for jitter, weight in self._weights.items())
        return self.fit.among(np.asarray(cells) > 0.0)

    def _is_best(self, jitter: bool) -> Mask:
        """Which points and sets are the most probable candidate, shape (g, m)."""
        points, sets = range(len(self.fit.posterior.points)), range(len(self.fit.sets.effects))
        return np.array([[self._names(g, m, jitter) == self.sets[0] for m in sets] for g in points])

    @cached_property
    def draws(self) -> FamilyDraws:
        drawn, fit, shift = self._law_draws, self.fit, self.left()["friction_could_shift_by"]
        place = {names: i for i, names in enumerate(self.sets)}
        jitters = (
            self._rng_draws.random(DRAWS)
            < (self._weights[True] / np.maximum(self._total, 1e-300))[drawn.point, drawn.chosen]
        )
        friction = _moved(friction_with_slight_effects(drawn, self._rng_draws), shift, self._rng_draws)
        return FamilyDraws(
            candidate=np.array(
                [
                    place[self._names(g, m, jitter)]
                    for g, m, jitter in zip(drawn.point, drawn.chosen, jitters, strict=True)
                ]
            ),
            friction=friction,
            frequency=fit.w0 * np.sqrt(np.maximum(1.0 + drawn.stiffness, 0.25)),
            random_force=drawn.random_force,
            correlation_time=drawn.correlation_time,
        )

    @cached_property
    def reading(self) -> Reading:
        """A force too large for a fluctuation counts here: it stands for the unknown, which is what acts."""
        drawn = law_draws(self.fit, self._rng_reading, DRAWS)
        worst = what_is_left(self.fit).worst
        shift = 0.0 if worst is None else worst.friction * self.fit.law.unit_force
        return Reading(
            "the sets weighed along the measured motion", _moved(drawn.friction, shift, self._rng_reading)
        )

    @property
    def _of_best(self) -> Mask:
        """Draws of the most probable candidate."""
        return np.asarray(self.draws.candidate == 0)

    @cached_property
    def tests(self) -> LeftOver:
        return what_is_left(self.best)

    @property
    def explains(self) -> bool:
        friction = self.fit.comparable_friction(self._law_draws.friction)
        return not self.tests.matters(self._tolerance, friction)

    def parameters(self, name: str) -> dict[str, dict[str, Any]]:
        units = parameter_units(name, self.fit.segment, self.fit.system)
        draws = self._parameter_draws(name)
        return {p.name: parameter_summary(draws[p.name], units[p.name]) for p in EFFECTS[name].parameters}

    def variables(self) -> dict[str, Array]:
        drawn, best = self._law_draws, self._of_best
        declared = self.fit.w0 / self.fit.system.natural_frequency
        return {
            "friction": drawn.friction[best],
            LOG_FREQUENCY_RATIO: np.log(declared) + 0.5 * np.log1p(drawn.stiffness[best]),
        } | {
            f"{name}.{parameter}": values
            for name in self.sets[0]
            for parameter, values in self._parameter_draws(name).items()
        }

    def _parameter_draws(self, name: str) -> dict[str, Array]:
        drawn, best = self._law_draws, self._of_best
        if name == TIMING_JITTER.name:
            return {"sd": drawn.timing_jitter[best]}
        if name == RANDOM_FORCE.name:
            return {"sd": drawn.random_force[best], "correlation_time": drawn.correlation_time[best]}
        values = drawn.parameters(name, best)
        if name == PERIODIC_INTERFERENCE.name:
            sine, cosine = values.pop("sine"), values.pop("cosine")
            values |= {"amplitude": np.hypot(sine, cosine), "phase": np.arctan2(cosine, sine)}
        return values

    def left(self) -> dict[str, Any]:
        """The largest force that follows the motion, if any does."""
        worst, fit = self.tests.worst, self.best
        rms = 0.0 if worst is None else worst.signal
        return {
            "structured_rms": rms,
            "share_of_amplitude": rms / (float(np.max(np.abs(fit.path.x))) * fit.unit),
            "friction_could_shift_by": 0.0 if worst is None else worst.friction * fit.law.unit_force,
            **self.tests.to_left(),
        }

    def check(self, seed: int) -> dict[str, Any]:
        factor, unit = friction_scale(self.found.before.model)
        return check_random_force(self.best, factor, unit, seed, forced=RANDOM_FORCE.name in self.sets[0])

    def witnesses(self) -> dict[str, Any]:
        """Friction by the loss of amplitude and by the shape within a cycle, in the best law."""
        factor, unit = friction_scale(self.found.before.model)
        witnesses = two_witnesses(self.best, factor * self.fit.law.unit_force, unit)
        return {
            "loss": witnesses.loss.to_dict(),
            "shape": witnesses.shape.to_dict(),
            "agree": witnesses.agree,
        }

    def noise(self) -> dict[str, Any]:
        """Noise of the sensor, a sample of the record: those of a block were averaged."""
        fit = self.best
        sd = fit.posterior.noise_sd * fit.unit * math.sqrt(fit.segment.block)
        step = fit.segment.resolution
        return {"model": "white", "order": 0, "sd": sd, "correlation_length_s": 0.0, "step": step}

    def forecasts(self) -> tuple[Forecast, ...]:
        predicted = forecast(self.best, self._rng_forecast)
        return () if predicted is None else (predicted,)

    def noise_floor(self) -> float:
        return self.tests.rms

    @property
    def fitted(self) -> tuple[int, int]:
        return self.fit.samples, self.fit.path.turning.size

    def traces(self) -> tuple[RecordTrace, ...]:
        """The record with the Coulomb model and with the smoothed motion."""
        fit, segment, decay, n = self.best, self.fit.segment, self.fit.segment.decay, self.fit.samples
        before = self.found.before.predictions[0]
        turns = fit.path.turning / fit.w0
        factor, unit = friction_scale(self.found.before.model)
        scale = factor * fit.law.unit_force
        trace = RecordTrace(
            name=decay.name,
            unit=decay.unit,
            quantity=decay.quantity.name,
            time=decay.start_time + segment.time[:n],
            signal=segment.values[:n],
            before=before.signal[:n],
            after=fit.smoothed_signal * fit.unit,
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
                friction=factor * float(np.median(self._law_draws.friction)),
                unit=unit,
            )
            if RANDOM_FORCE.name in self.sets[0]
            else None,
        )
        return (trace,)

    def resisting_force(self) -> ResistingForce:
        fit, law = self.best, self.best.law
        resisting = law.resisting
        return ResistingForce(
            law=-law.unit_force * (law.forces[:, resisting] @ fit.coefficients[resisting]),
            fluctuation=-law.unit_force * fit.fluctuation if RANDOM_FORCE.name in self.sets[0] else None,
            direction=np.sign(fit.path.v),
        )

    def contender(self, names: frozenset[str]) -> Contender | None:
        return drawn_contender(self._law_draws, self.draws.candidate == self.sets.index(names))


def _moved(friction: Array, shift: float, rng: np.random.Generator) -> Array:
    """Friction that could move for what the law does not say: reflected, as friction is never negative."""
    return np.abs(friction + shift * rng.standard_normal(friction.size))


def _unknowable(fit: ForceFit) -> set[str]:
    """Effects of which the samples say next to nothing beside the start and friction.

    A constant force in an acceleration record is one: its probability would stay that of its prior.
    """
    always = [*fit.law.always, fit.law.dry_friction]
    gram = fit.regression.whiten_at(0.0, 1.0).gram[:-1, :-1] / fit.posterior.points[0].found.full_noise2
    absorbed = np.linalg.solve(gram[np.ix_(always, always)] + np.eye(len(always)), gram[always])
    left = np.diag(gram) - np.sum(gram[:, always].T * absorbed, axis=0)
    told = left > LEAST_INFORMATION
    names = {column.effect for column in fit.law.columns if column.kind == "effect"}
    return {
        name for name in names if not any(told[j] for columns in fit.law.alternatives(name) for j in columns)
    }
