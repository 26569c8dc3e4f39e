"""Candidates evaluated along measured motions, of one or several records, and what is reported of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.declared_force import ForceFactor, common_factor
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.sensor_calibration import force_factors
from friction_bayes.estimators.noise.free_corners import near_corners
from friction_bayes.loop import settings
from friction_bayes.loop.checks.between_records import contradictions, friction_between_records
from friction_bayes.loop.checks.force_tests import LeftOver, what_is_left
from friction_bayes.loop.checks.forecast import forecast, forecast_errors
from friction_bayes.loop.checks.noise_tests import ResidualTests, worst_of
from friction_bayes.loop.checks.sampler_check import check_law
from friction_bayes.loop.checks.witnesses import two_witnesses
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.data.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.coulomb_fit import CoulombFit, fit_coulomb
from friction_bayes.loop.infer.law_draws import DRAWS, DrawnLaws, by_record, draw_laws
from friction_bayes.loop.infer.law_fit import LawFit, fit_law
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.mixture.mixture import CandidateMixture, cells_of, ranked
from friction_bayes.loop.mixture.slight_effects import friction_with_slight_effects
from friction_bayes.loop.report.effect_summaries import (
    line_summary,
    of_force,
    parameter_summary,
    parameter_units,
    sensor_parameters,
)
from friction_bayes.loop.report.motion_trace import knock_notes, motion_trace
from friction_bayes.loop.report.next_experiment import Contender, drawn_contender
from friction_bayes.loop.report.result import Forecast, RecordTrace
from friction_bayes.loop.report.verdict import ADDED, credible_count
from friction_bayes.mechanics.effects import in_catalogue_order
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["Candidates", "candidates_of"]


class Candidates:
    """Sets of effects, with a random force or none, one friction or one of each record, evaluated on records.

    Parameters
    ----------
    before : CoulombFit
        The Coulomb model alone.
    fit : LawFit
    tolerance : float
        Share of friction below which a force that depends on the motion does not matter, and of the loss of
        amplitude from which on dry friction does.
    rng : numpy.random.Generator
        Of the draws.

    Attributes
    ----------
    sets : tuple of frozenset of str, length c
        Effects of each candidate, the most probable first; the empty set is among them.
    probabilities : ndarray, shape (c,)
    unit : str
        Of the reported friction.
    """

    def __init__(self, before: CoulombFit, fit: LawFit, tolerance: float, rng: np.random.Generator) -> None:
        self.before, self.fit = before, fit
        self.unit = before.model.segments[0].decay.friction_unit
        self.tolerance = tolerance
        self._rng_draws, self._rng_forecast, self._rng_reading = rng.spawn(3)
        self.cells = cells_of(fit)
        self.sets, self.probabilities = ranked({frozenset[str](): 0.0} | self.cells.probabilities)

    @property
    def needs_more(self) -> bool:
        """Whether dry friction, and what a sensor adds to any motion, fail to explain or forecast it."""
        if not self.sets[0] <= ADDED or any(fit.knocks for fit in self.best) or self.tests.failed:
            return True
        return forecast_errors(self.forecasts)["inside90"] < settings.SETTINGS.least_inside

    @property
    def evaluated(self) -> frozenset[str]:
        """Effects that the sets are of: of the law, of the kinds of noise, and a random force."""
        forced = {RANDOM_FORCE.name} if self.cells.forced.any() else set[str]()
        return frozenset(forced).union(*self.fit.sets, *self.cells.noises)

    @property
    def _weight(self) -> Array:
        """Posterior of the points and of the sets with a spread, zero for those of no candidate."""
        kept = self.cells.total > 0.0
        return self.fit.posterior.weight * kept[:, self.fit.problem.number]

    @property
    def _cells_of_best(self) -> Mask:
        """Points and sets of the records that are the most probable candidate, shape (g, m)."""
        # it may lack some of its sets of columns, where one of its shapes is impossible
        own = (self.cells.places(self.sets[:1]) == 0) & (self.cells.weight > 0.0)
        return np.asarray(own.any(axis=0))

    @cached_property
    def laws(self) -> DrawnLaws:
        """Draws over all candidates."""
        return draw_laws(self.fit, self._rng_draws, DRAWS, self._weight)

    @cached_property
    def _factors(self) -> tuple[float, tuple[ForceFactor, ...]]:
        """On the signal's friction coefficient: to a model's friction, and to the reported one.

        The latter, by the frequency found, are equally probable; of a signal that is not calibrated friction
        is in the unit of the signal.
        """
        model, found = self.before.model, self.laws.frequency
        system, decay, sd = model.system, model.segments[0].decay, float(found.std(ddof=1))
        factors = force_factors(system, decay.quantity, decay.unit, float(found.mean()), sd)
        return system.force_factor(decay.quantity), factors

    @cached_property
    def factor(self) -> float:
        """Mean factor from a model's friction to the reported one, for what is compared with friction."""
        of_model, factors = self._factors
        return float(common_factor(factors).factor) / of_model

    def scale(self, rng: np.random.Generator) -> Array:
        """Draws of that factor, with the uncertainty of mass and stiffness."""
        normal, (of_model, factors) = rng.standard_normal(DRAWS), self._factors
        scales = [f * (1.0 + relative * normal) for f, relative in factors]
        drawn = scales[0] if len(scales) == 1 else np.choose(rng.integers(len(scales), size=DRAWS), scales)
        return np.asarray(drawn / of_model)

    @cached_property
    def best(self) -> tuple[ForceFit, ...]:
        """Each record under the most probable candidate."""
        return self.fit.among(self._cells_of_best).fits

    @cached_property
    def by_all_sets(self) -> Array:
        """Draws of friction by all sets, whether candidates or not [N or N m]."""
        laws = draw_laws(self.fit, self._rng_reading, DRAWS)
        shift = max(_friction_shift(fit, what_is_left(fit)) for fit in self.fit.fits)
        return _moved(laws.friction, shift, self._rng_reading)

    def check(self, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
        """The posterior of the most probable candidate compared with a sampler's.

        ``share`` is the sampled share of the candidate's probability; the tree has the samples, if any.
        """
        mine = self._cells_of_best[:, self.fit.problem.number] & (self._weight > 0.0)
        return check_law(self.fit, mine, self.factor, self.unit, seed, forced=self._fluctuates)

    @cached_property
    def witnesses(self) -> dict[str, Any] | None:
        """Friction by the loss of amplitude and by the shape within a cycle; None where not compared.

        Of several records they are not, nor without a random force.
        """
        if not (self.fit.one and self._fluctuates):
            return None
        return two_witnesses(self.best[0], self.factor * self.fit.law.unit_force, self.unit)

    def between_records(self) -> dict[str, Any] | None:
        """Friction of each of several records and its spread between them."""
        if self.fit.one:
            return None
        rng_scale, rng_alone = self._rng_reading.spawn(2)
        return friction_between_records(
            self.laws,
            self.fit.alone,
            shift=self._friction - self.laws.friction,
            probability=self._differs,
            scale=self.scale(rng_scale),
            unit=self.unit,
            rng=rng_alone,
        )

    @cached_property
    def _contradictions(self) -> tuple[str, ...]:
        """Effects for which the records contradict a common size."""
        return tuple(contradictions(self.fit))

    @cached_property
    def _differs(self) -> float:
        """Probability that friction differs between the records."""
        weight = self._weight
        return float(weight[:, self.fit.spread_of > 0.0].sum() / weight.sum())

    @property
    def contradicted(self) -> bool:
        """Whether the records contradict one friction for all, if it is not known to differ, or one law."""
        known = bool((self.fit.spreads > 0.0).all())
        return bool(self._contradictions) or (not known and self._differs >= settings.SETTINGS.credible_mass)

    @cached_property
    def _candidate(self) -> Integers:
        """Index of the set of each draw, shape (k,); -1 without one."""
        drawn = self.laws.first
        upto = np.cumsum(self.cells.weight[:, drawn.point, drawn.set_index], axis=0)
        kind = (self._rng_draws.random(DRAWS) * upto[-1] >= upto[:-1]).sum(axis=0)
        return self.cells.places(self.sets)[kind, drawn.point, drawn.set_index]

    @cached_property
    def _of_best(self) -> Mask:
        """Draws of the most probable candidate."""
        return np.asarray(self._candidate == 0)

    @cached_property
    def _left(self) -> tuple[LeftOver, ...]:
        """Tests of the residual of each record."""
        return tuple(what_is_left(fit) for fit in self.best)

    @property
    def _worst(self) -> int:
        """The record that could shift friction most."""
        return int(np.argmax([_friction_shift(*pair) for pair in zip(self.best, self._left, strict=True)]))

    @property
    def _fluctuates(self) -> bool:
        """Whether the most probable candidate has a random force."""
        return RANDOM_FORCE.name in self.sets[0]

    @cached_property
    def tests(self) -> ResidualTests:
        return worst_of(self._left)

    @property
    def explains(self) -> bool:
        return not any(
            left.matters(self.tolerance, fit.comparable_friction(self.laws.friction))
            for fit, left in zip(self.best, self._left, strict=True)
        )

    @cached_property
    def mixture(self) -> CandidateMixture:
        """The posterior over all of them."""
        return CandidateMixture(
            sets=self.sets,
            probabilities=self.probabilities,
            candidate=self._candidate,
            friction=_moved(self._friction, self.shift, self._rng_draws),
            random_force=self.laws.first.random_force,
            scores=self.laws.scores,
        )

    @cached_property
    def _friction(self) -> Array:
        """Draws of friction [N or N m]: those of the laws, widened by slight effects."""
        return friction_with_slight_effects(self.laws, self.fit, self._rng_draws)

    def parameters(self, name: str) -> dict[str, dict[str, Any]]:
        fit = self.best[0]
        units = parameter_units(name, fit.segment, fit.record.system)
        if name in (SENSOR_CLIPPING.name, OUTLIERS.name):
            return by_record(sensor_parameters(name, one, units) for one in self.best)
        forces, found = of_force(name, fit.segment), {}
        for key, values in self.laws.parameters(name, self._of_best).items():
            parameter = key.partition("[")[0]
            factor = self.factor if parameter in forces else 1.0
            found[key] = parameter_summary(factor * values, units[parameter])
        return found

    def lines(self, name: str) -> list[dict[str, Any]]:
        unit = self.best[0].segment.decay.unit
        return [
            line_summary(r, line, unit)
            for r, draws in enumerate(self.laws.records)
            for line in draws.lines(name, self._of_best)
        ]

    def variables(self) -> dict[str, Array]:
        fit, best = self.best[0], self._of_best
        declared = math.log(fit.w0 / fit.record.system.natural_frequency)
        found = {
            "friction": self.laws.friction[best],
            LOG_FREQUENCY_RATIO: declared + 0.5 * np.log1p(self.laws.first.stiffness[best]),
        } | {
            f"{name}.{parameter}": values
            for name in in_catalogue_order(self.sets[0] - {OUTLIERS.name, SENSOR_CLIPPING.name})
            for parameter, values in self.laws.parameters(name, best).items()
        }
        if not self.fit.one:
            found["friction_spread"] = self.laws.spread[best]
            found |= by_record(
                {
                    "friction": one.friction[best],
                    "displacement": one.coefficients[best, 0],
                    "velocity": one.coefficients[best, 1] * one.fit.w0,
                }
                for one in self.laws.records
            )
        return found

    @cached_property
    def shift(self) -> float:
        """How far friction could shift for what is left [N or N m].

        Where the two witnesses of one record disagree, friction may be that of the loss: the shape within a
        cycle is biased by errors of the sensor that follow the direction, and by a law that is not quite the
        contact's.
        """
        shift, found = _friction_shift(self.best[self._worst], self._left[self._worst]), self.witnesses
        if found is None or found["agree"]:
            return shift
        by_law = float(self._friction[self._of_best].mean())
        return max(shift, abs(found["loss"]["mean"] / self.factor - by_law))

    def left(self) -> dict[str, Any]:
        """The largest force that follows the motion, if any, of the record whose friction it shifts most."""
        fit, left = self.best[self._worst], self._left[self._worst]
        rms = 0.0 if left.worst is None else left.worst.signal
        return {
            "record": fit.segment.decay.name,
            "structured_rms": rms,
            "share_of_amplitude": rms / (float(np.max(np.abs(fit.path.x))) * fit.unit),
            "friction_could_shift_by": self.factor * self.shift,
            "depends_on": None if left.worst is None else left.worst.on,
            "shape": None if left.shape is None else left.shape.name,
            "share": None if left.shape is None else left.shape.share,
            "unit": fit.segment.decay.unit,
        }

    def noise(self) -> dict[str, Any]:
        """Noise of the first record's sensor, a sample of it: those of a block were averaged.

        The noise that neighbouring samples share remains in their mean.
        """
        fit = self.best[0]
        white = fit.posterior.noise_sd * fit.unit
        of_a_sample = math.sqrt(fit.segment.block - 1.0 + fit.record.error.share**2)
        behind = None if fit.law.filter is None else fit.law.filter.to_dict()
        found = {"sd": white * of_a_sample, "step": fit.segment.resolution, "filter": behind}
        return fit.record.error.described(fit.segment.decay.step) | found

    @cached_property
    def forecasts(self) -> tuple[Forecast, ...]:
        """Those of each record by the effects of the candidates that hold 95 %; none where one fails."""
        credible = self.sets[: credible_count(self.probabilities)]
        effects = in_catalogue_order(frozenset().union(*credible))
        found = []
        for fit in self.fit.fits:
            predicted = forecast(fit, effects, self._rng_forecast)
            if predicted is None:
                return ()
            found.append(predicted)
        return self.where_fitted(found)

    def where_fitted(self, forecasts: Sequence[Forecast]) -> tuple[Forecast, ...]:
        """Forecasts compared where free corners describe a jump: of an acceleration not next to it."""
        found = []
        for each, fit in zip(forecasts, self.best, strict=False):
            near = np.zeros(fit.segment.moving, np.bool_)
            if fit.record.free_corners and fit.segment.order == 2:
                at = near_corners(fit.path)[: near.size]
                near[: at.size] = at
            found.append(replace(each, free=each.free & ~near[near.size - each.free.size :]))
        return tuple(found)

    def noise_floor(self) -> float:
        pairs = zip(self.best, self._left, strict=True)
        each = [float(fit.sensor_noise.sd_of_samples(np.asarray(left.rms))) for fit, left in pairs]
        return math.sqrt(float(np.mean(np.square(each))))

    @property
    def least_noise(self) -> float:
        """Noise that every record is taken to have, in the unit of the signal."""
        return max(fit.regression.least_noise * fit.unit for fit in self.best)

    @property
    def notes(self) -> tuple[str, ...]:
        found: list[str] = []
        for fit, left in zip(self.best, self._left, strict=True):
            found += knock_notes(fit, self.factor * fit.law.unit_force, self.unit)
            if fit.record.free_corners:
                found.append(
                    f"{fit.segment.decay.name}: where the motion turns, the record has not the corners of "
                    "dry friction, as behind a filter or on a soft mount: they may have any shape, and the "
                    "loss of amplitude determines friction, the gain at the motion's frequency being one"
                )
            if left.jumps is not None and self._fluctuates:
                found.append(
                    f"{fit.segment.decay.name}: the random force jumps as no normal one does (kurtosis "
                    f"{left.jumps:.2g}, where 3 is normal): something slips or knocks now and then"
                )
        return (*found, *self._contradictions)

    @cached_property
    def traces(self) -> tuple[RecordTrace, ...]:
        return tuple(
            motion_trace(fit, self.before, r, draws, factor=self.factor, fluctuates=self._fluctuates)
            for r, (fit, draws) in enumerate(zip(self.best, self.laws.records, strict=True))
        )

    def simulated(self) -> tuple[LoopModel, Array]:
        """The most probable law, with the state at the start of the first record."""
        law = drawn_contender(self.laws.of_first, self._of_best)
        if law is None:
            return self.before.model, self.before.z
        return law.model, law.z

    def contender(self, names: frozenset[str]) -> Contender | None:
        return drawn_contender(self.laws, self._candidate == self.sets.index(names))


def candidates_of(
    segments: tuple[Segment, ...],
    system: Oscillator,
    options: LoopOptions,
    rng: np.random.Generator,
    progress: Callable[[str], None] | None = None,
) -> Candidates:
    """Candidates of one or several records; ``progress`` is called with the name of each.

    Raises
    ------
    InputError
        If a record has too few turning points, or no Coulomb decay can be fitted.
    """
    fit = fit_law(segments, system, options, progress)
    return Candidates(fit_coulomb(system, segments), fit, options.tolerance, rng)


def _friction_shift(fit: ForceFit, left: LeftOver) -> float:
    """How far friction could shift for a force that a record's law lacks [N or N m]."""
    return 0.0 if left.worst is None else left.worst.friction * fit.law.unit_force


def _moved(friction: Array, shift: float, rng: np.random.Generator) -> Array:
    """Draws with such a shift, reflected at zero, as friction is never negative."""
    return np.abs(friction + shift * rng.standard_normal(DRAWS))
