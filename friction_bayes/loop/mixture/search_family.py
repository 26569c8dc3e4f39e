"""The candidates of the search as a family: noise in the sensor alone, white or autoregressive."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop.checks.search_forecast import Forecast, forecast_records
from friction_bayes.loop.checks.search_sampler_check import sampler_check
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import FRICTION, LOG_FREQUENCY_RATIO
from friction_bayes.loop.mixture.mixture import FamilyDraws
from friction_bayes.loop.mixture.slight_effects import slight_effects, with_slight_effects
from friction_bayes.loop.noise.autoregression import correlation_length
from friction_bayes.loop.noise.likelihood import LEAST_NOISE
from friction_bayes.loop.report.effect_summaries import (
    clipping_parameters,
    line_summary,
    outlier_parameters,
    parameter_summary,
    parameter_units,
)
from friction_bayes.loop.report.friction_range import Reading
from friction_bayes.loop.report.next_experiment import Contender
from friction_bayes.loop.report.reference_force import ResistingForce, resisting_force
from friction_bayes.loop.report.result import RecordTrace
from friction_bayes.loop.search.candidate import SearchResult
from friction_bayes.loop.search.draws import candidate_draws
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.loop.search.residual_tests import ResidualTests, residual_tests
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["SearchFamily"]


class SearchFamily:
    """What a search found, as a family of candidates (see
    :class:`friction_bayes.loop.mixture.mixture.Family`).

    Parameters
    ----------
    found : SearchResult
    rng : numpy.random.Generator
        Of the draws.
    """

    holds_what_is_left = False
    notes = ()
    contradicted = False
    slight_force = None

    def __init__(self, found: SearchResult, rng: np.random.Generator) -> None:
        self.found, self._rng = found, rng
        self.sets, self.log_weights, self.trail = found.sets, found.log_weights, found.trail

    @property
    def best(self) -> LoopFit:
        """The most probable."""
        return self.found.fits[0]

    @property
    def is_silent(self) -> bool:
        """Whether the record has no noise."""
        white = self.found.white
        return white.noises[0].sd <= LEAST_NOISE * white.model.scales.signal

    @property
    def holds_more(self) -> bool:
        """Whether the most probable has what has no place among columns along the motion.

        Clipped samples and outliers have none, nor has coloured noise of the sensor that explains the
        records, nor a signal without noise.
        """
        coloured = any(ar.size for ar in self.found.ar) and self.explains
        return self.is_silent or coloured or bool(self.sets[0] & {SENSOR_CLIPPING.name, OUTLIERS.name})

    @cached_property
    def tests(self) -> ResidualTests:
        return residual_tests(self.best)

    @property
    def explains(self) -> bool:
        return not self.tests.failed

    @cached_property
    def _coordinates(self) -> list[Array]:
        """Coordinates drawn from each candidate, shape (k, p)."""
        found = self.found
        return candidate_draws(found.fits, found.probabilities, self._rng, robust=not self.explains)

    @cached_property
    def draws(self) -> FamilyDraws:
        pairs = list(zip(self.found.fits, self._coordinates, strict=True))
        friction = np.concatenate([self._friction(fit, z) for fit, z in pairs])
        ratio = np.exp(np.concatenate([fit.model.value(z, LOG_FREQUENCY_RATIO) for fit, z in pairs]))
        scores = [z[:, _normal_coefficients(fit)] for fit, z in pairs]
        return FamilyDraws(
            candidate=np.repeat(np.arange(len(pairs)), [len(z) for _, z in pairs]),
            friction=friction,
            frequency=self.best.model.system.natural_frequency * ratio,
            random_force=np.zeros_like(friction),
            correlation_time=np.zeros_like(friction),
            coefficients=np.repeat([z.shape[1] for z in scores], [len(z) for z in scores]),
            squares=np.concatenate([np.sum(z**2, axis=1) for z in scores]),
        )

    def _friction(self, fit: LoopFit, drawn: Array) -> Array:
        """Draws of friction under one candidate, those of its coordinates given, shape (k, p)."""
        friction = np.asarray(fit.model.value(drawn, FRICTION))
        if not len(drawn):
            return friction
        return with_slight_effects(friction, slight_effects(fit, self.found.allowed), self._rng)

    @property
    def reading(self) -> Reading:
        return Reading("the closest candidates under noise of the sensor alone", self.draws.friction)

    def parameters(self, name: str) -> dict[str, dict[str, Any]]:
        model = self.best.model
        units = parameter_units(name, model.segments[0], model.system)
        found = {
            model.numbered(c.name, c): parameter_summary(
                np.asarray(c.value(self._coordinates[0][:, j])), units[c.name]
            )
            for j, c in enumerate(model.coordinates)
            if c.effect == name
        }
        segment = model.segments[0]
        if name == OUTLIERS.name:
            return outlier_parameters(segment.values.size, self.best.noises[0], units)
        return found or clipping_parameters(segment, units)

    def lines(self, name: str) -> list[dict[str, Any]]:
        """Of interference one in each record."""
        if name != PERIODIC_INTERFERENCE.name:
            return []
        model, found = self.best.model, []
        for r, segment in enumerate(model.segments):
            drawn = {
                c.name: np.asarray(c.value(self._coordinates[0][:, j]))
                for j, c in enumerate(model.coordinates)
                if c.effect == name and c.record == r
            }
            drawn["sine"] = drawn["amplitude"] * np.cos(drawn["phase"])
            drawn["cosine"] = drawn["amplitude"] * np.sin(drawn["phase"])
            found.append(line_summary(r, drawn, segment.decay.unit))
        return found

    def variables(self) -> dict[str, Array]:
        model, draws = self.best.model, self._coordinates[0]
        return {
            model.numbered(c.label, c): np.asarray(c.value(draws[:, j]))
            for j, c in enumerate(model.coordinates)
        }

    def left(self) -> dict[str, Any]:
        """What is left of a residual that fails its tests, all of it taken as structure."""
        rms = 0.0 if self.explains else float(np.sqrt(np.mean(self.best.free_residuals[0] ** 2)))
        return {
            "record": self.best.model.segments[0].decay.name,
            "structured_rms": rms,
            "share_of_amplitude": rms / self.best.model.scales.signal,
            # where the tests fail, the draws carry the scatter that the residual shows
            "friction_could_shift_by": 0.0 if self.explains else float(self.draws.friction.std(ddof=1)),
            "depends_on": None,
            "shape": None,
            "share": None,
        }

    def check(self, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
        return sampler_check(self.found.before, self.best, seed)

    def witnesses(self) -> None:
        """Not compared: that takes the columns of a regression."""

    def between_records(self) -> None:
        """It has one friction."""

    def noise(self) -> dict[str, Any]:
        """Noise of the sensors, a sample of it: those of a block were averaged."""
        ar, segment = self.found.ar, self.best.model.segments[0]
        pairs = zip(self.best.model.segments, self.best.predictions, strict=True)
        order = max(a.size for a in ar)
        return {
            "model": "ar" if order else "white",
            "order": order,
            "sd": float(np.mean([each.noise_of_a_sample(found.signal) for each, found in pairs])),
            "correlation_length_s": float(max(correlation_length(a, segment.decay.step) for a in ar)),
            "step": segment.resolution,
        }

    def forecasts(self) -> tuple[Forecast, ...]:
        return forecast_records(self.best)

    def noise_floor(self) -> float:
        return math.sqrt(float(np.mean([np.var(e) for e in self.best.free_residuals])))

    @property
    def fitted(self) -> tuple[int, int, int]:
        segment = self.best.model.segments[0]
        turning_points = self.best.predictions[0].turning_times.size
        return segment.values.size, turning_points, int(np.count_nonzero(~segment.free))

    def traces(self) -> tuple[RecordTrace, ...]:
        records = range(len(self.best.noises))
        return tuple(_trace(self.found.before, self.best, r) for r in records)

    def simulated(self) -> tuple[LoopModel, Array]:
        return self.best.model, self.best.z

    def resisting_force(self) -> ResistingForce:
        return ResistingForce(law=resisting_force(self.best), direction=self.best.predictions[0].direction)

    def contender(self, names: frozenset[str]) -> Contender:
        return Contender.of_fit(self.found.fits[self.sets.index(names)])


def _normal_coefficients(fit: LoopFit) -> Mask:
    """Coordinates that are coefficients of effects with a normal prior, shape (p,)."""
    return np.array([bool(c.effect) and c.prior.family == "normal" for c in fit.model.coordinates])


def _trace(before: LoopFit, after: LoopFit, r: int) -> RecordTrace:
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
    )
