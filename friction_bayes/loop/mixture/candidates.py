"""Candidates evaluated along measured motions, of one record or of several: what both report."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.loop.checks.force_tests import LeftOver, what_is_left, worst_of
from friction_bayes.loop.checks.forecast import forecast
from friction_bayes.loop.checks.held_out import Forecast
from friction_bayes.loop.data.friction import friction_scale
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import LOG_FREQUENCY_RATIO
from friction_bayes.loop.infer.cells import Cells
from friction_bayes.loop.infer.drawn_laws import DrawnLaws
from friction_bayes.loop.infer.draws import DRAWS
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.mixture.candidate_draws import CandidateDraws
from friction_bayes.loop.mixture.slight_beside_law import friction_with_slight_effects
from friction_bayes.loop.mixture.slight_effects import SlightEffect
from friction_bayes.loop.mixture.slight_force import SlightForce
from friction_bayes.loop.noise.likelihood import NoiseModel
from friction_bayes.loop.report.contender import drawn_contender
from friction_bayes.loop.report.effect_summaries import (
    clipping_parameters,
    line_summary,
    outlier_parameters,
    parameter_summary,
    parameter_units,
)
from friction_bayes.loop.report.friction_range import Reading
from friction_bayes.loop.report.knock_notes import knock_notes
from friction_bayes.loop.report.motion_trace import motion_trace
from friction_bayes.loop.report.next_experiment import Contender
from friction_bayes.loop.report.reference_force import ResistingForce
from friction_bayes.loop.report.result import RecordTrace
from friction_bayes.loop.simulation.fit import LoopFit, fit_model
from friction_bayes.loop.simulation.residual_tests import ResidualTests
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["Candidates"]


class Candidates(ABC):
    """Candidates evaluated along measured motions, of one record or of several.

    Parameters
    ----------
    before : LoopFit
        The Coulomb model alone.
    tolerance : float
        Share of friction below which a force that depends on the motion does not matter.
    rng : numpy.random.Generator
        Of the draws.

    Attributes
    ----------
    sets : tuple of frozenset of str, length c
        Effects of each candidate, the most probable first; the empty set is among them.
    probabilities : ndarray, shape (c,)
    slight_force : SlightForce or None
        A random force too slight to show, for draws without one.
    trail : tuple of str
        The steps that led to them.
    """

    slight_force: SlightForce | None = None
    cells: Cells
    sets: tuple[frozenset[str], ...]
    probabilities: Array
    trail: tuple[str, ...]

    def __init__(self, before: LoopFit, tolerance: float, rng: np.random.Generator) -> None:
        self.before = before
        self._tolerance = tolerance
        self._rng_draws, self._rng_forecast, self._rng_reading = rng.spawn(3)

    @property
    @abstractmethod
    def best(self) -> tuple[ForceFit, ...]:
        """Each record under the most probable candidate."""

    @property
    @abstractmethod
    def laws(self) -> DrawnLaws:
        """Draws over all candidates."""

    @property
    @abstractmethod
    def reading(self) -> Reading:
        """Friction by all candidates."""

    @abstractmethod
    def check(self, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
        """The posterior of the most probable candidate compared with a sampler's.

        ``share`` is the sampled share of the candidate's probability; the tree has the samples, if any.
        """

    @abstractmethod
    def witnesses(self) -> dict[str, Any] | None:
        """Friction by the loss of amplitude and by the shape within a cycle; None where not compared."""

    @abstractmethod
    def between_records(self) -> dict[str, Any] | None:
        """Friction of each record and its spread between them; None where it is one friction."""

    def _rank(self, cells: Cells) -> None:
        """Make these cells the candidates, the most probable first; all mixtures have the empty set."""
        self.cells = cells
        by_set = {frozenset[str](): 0.0} | cells.probabilities
        ranked = sorted(by_set.items(), key=lambda pair: -pair[1])
        self.sets = tuple(names for names, _ in ranked)
        self.probabilities = np.array([p for _, p in ranked])
        self.probabilities /= self.probabilities.sum()

    @cached_property
    def candidate(self) -> Integers:
        """Index of the set of each draw, shape (k,)."""
        drawn = self.laws.first
        upto = np.cumsum(self.cells.weight[:, drawn.point, drawn.chosen], axis=0)
        kind = (self._rng_draws.random(DRAWS) * upto[-1] >= upto[:-1]).sum(axis=0)
        return self.cells.places(self.sets)[kind, drawn.point, drawn.chosen]

    @cached_property
    def _of_best(self) -> Mask:
        """Draws of the most probable candidate."""
        return np.asarray(self.candidate == 0)

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
    def contradicted(self) -> bool:
        """One record contradicts nothing."""
        return False

    @property
    def explains(self) -> bool:
        return not any(
            left.matters(self._tolerance, fit.comparable_friction(self.laws.friction))
            for fit, left in zip(self.best, self._left, strict=True)
        )

    @cached_property
    def draws(self) -> CandidateDraws:
        laws, candidate = self.laws, self.candidate
        return CandidateDraws(
            candidate=candidate,
            friction=_moved(self._friction, self.left()["friction_could_shift_by"], self._rng_draws),
            frequency=laws.frequency,
            random_force=laws.first.random_force,
            correlation_time=laws.first.correlation_time,
            coefficients=np.count_nonzero(laws.scores, axis=1),
            squares=np.sum(laws.scores**2, axis=1),
        )

    @abstractmethod
    def _slight_beside(self, g: int, row: int) -> Iterable[SlightEffect]:
        """Nuisances in addition to a set of the posterior at a point of its grid."""

    @cached_property
    def _friction(self) -> Array:
        """Draws of friction [N or N m]: those of the laws, widened by slight effects."""
        return friction_with_slight_effects(self.laws, self._slight_beside, self._rng_draws)

    def _reading(self, what: str, fits: tuple[ForceFit, ...], laws: DrawnLaws) -> Reading:
        """Friction by some laws, with its shift by the residual of the most probable one."""
        shift = max(_friction_shift(fit, what_is_left(fit)) for fit in fits)
        return Reading(what, _moved(laws.friction, shift, self._rng_reading))

    def parameters(self, name: str) -> dict[str, dict[str, Any]]:
        fit = self.best[0]
        units = parameter_units(name, fit.segment, fit.system)
        if name in (SENSOR_CLIPPING.name, OUTLIERS.name):
            numbered = len(self.best) > 1
            return {
                f"{key}[{r}]" if numbered else key: value
                for r, one in enumerate(self.best)
                for key, value in _parameters_of_sensor(name, one, units).items()
            }
        return {
            key: parameter_summary(values, units[key.partition("[")[0]])
            for key, values in self.laws.parameters(name, self._of_best).items()
        }

    def lines(self, name: str) -> list[dict[str, Any]]:
        unit = self.best[0].segment.decay.unit
        return [
            line_summary(r, line, unit)
            for r, draws in enumerate(self.laws.records)
            for line in draws.lines(name, self._of_best)
        ]

    def variables(self) -> dict[str, Array]:
        fit, best = self.best[0], self._of_best
        declared = math.log(fit.w0 / fit.system.natural_frequency)
        return {
            "friction": self.laws.friction[best],
            LOG_FREQUENCY_RATIO: declared + 0.5 * np.log1p(self.laws.first.stiffness[best]),
        } | {
            f"{name}.{parameter}": values
            for name in self.sets[0] - {OUTLIERS.name, SENSOR_CLIPPING.name}
            for parameter, values in self.laws.parameters(name, best).items()
        }

    def left(self) -> dict[str, Any]:
        """The largest force that follows the motion, if any, of the record whose friction it shifts most."""
        fit, left = self.best[self._worst], self._left[self._worst]
        rms = 0.0 if left.worst is None else left.worst.signal
        return {
            "record": fit.segment.decay.name,
            "structured_rms": rms,
            "share_of_amplitude": rms / (float(np.max(np.abs(fit.path.x))) * fit.unit),
            "friction_could_shift_by": _friction_shift(fit, left),
            **left.to_left(),
        }

    def noise(self) -> dict[str, Any]:
        """Noise of the first record's sensor, a sample of it: those of a block were averaged.

        The noise that neighbouring samples share remains in their mean.
        """
        fit = self.best[0]
        white = fit.posterior.noise_sd * fit.unit
        of_a_sample = math.sqrt(fit.segment.block - 1.0 + fit.error.share**2)
        behind = None if fit.law.filter is None else fit.law.filter.to_dict()
        found = {"sd": white * of_a_sample, "step": fit.segment.resolution, "filter": behind}
        return fit.error.described(fit.segment.decay.step) | found

    def forecasts(self) -> tuple[Forecast, ...]:
        found = []
        for fit in self.best:
            predicted = forecast(fit, self._rng_forecast)
            if predicted is None:
                return ()
            found.append(predicted)
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
        factor, unit = friction_scale(self.before.model)
        told: list[str] = []
        for fit, left in zip(self.best, self._left, strict=True):
            told += knock_notes(fit, factor * fit.law.unit_force, unit)
            if left.jumps is not None and self._fluctuates:
                told.append(
                    f"{fit.segment.decay.name}: the random force jumps as no normal one does (kurtosis "
                    f"{left.jumps:.2g}, where 3 is normal): something slips or knocks now and then"
                )
        return tuple(told)

    @property
    def fitted(self) -> tuple[int, int, int]:
        fit = self.best[0]
        aside = np.count_nonzero(np.isinf(fit.clock.variance))
        return fit.samples, fit.path.turning.size, int(aside)

    def traces(self) -> tuple[RecordTrace, ...]:
        return tuple(
            motion_trace(fit, self.before, r, draws, fluctuates=self._fluctuates)
            for r, (fit, draws) in enumerate(zip(self.best, self.laws.records, strict=True))
        )

    def simulated(self) -> tuple[LoopModel, Array]:
        """The most probable law, fitted to the first record as far as it follows that."""
        law = drawn_contender(DrawnLaws.of_one(self.laws.first), self._of_best)
        if law is None:
            return self.before.model, self.before.z
        fit = fit_model(law.model, [NoiseModel()], law.z)
        return law.model, law.z if fit is None else fit.z

    def resisting_force(self) -> ResistingForce:
        fit, law = self.best[0], self.best[0].law
        resisting = law.resisting
        return ResistingForce(
            law=-law.unit_force * (law.forces[:, resisting] @ fit.coefficients[resisting]),
            fluctuation=-law.unit_force * fit.fluctuation if self._fluctuates or fit.knocks else None,
            direction=np.sign(fit.path.v),
        )

    def contender(self, names: frozenset[str]) -> Contender | None:
        return drawn_contender(self.laws, self.candidate == self.sets.index(names))


def _parameters_of_sensor(name: str, fit: ForceFit, units: dict[str, str]) -> dict[str, dict[str, Any]]:
    """Parameters of clipped samples or outliers in one record; empty without any."""
    if name == SENSOR_CLIPPING.name:
        return clipping_parameters(fit.segment, units) if fit.segment.clipped else {}
    if fit.sensor_noise.outliers is None or not fit.sensor_noise.contaminated:
        return {}
    return outlier_parameters(fit.samples, fit.sensor_noise.outliers, units)


def _friction_shift(fit: ForceFit, left: LeftOver) -> float:
    """How far friction could shift for a force that a record's law lacks [N or N m]."""
    return 0.0 if left.worst is None else left.worst.friction * fit.law.unit_force


def _moved(friction: Array, shift: float, rng: np.random.Generator) -> Array:
    """Draws with such a shift, reflected at zero, as friction is never negative."""
    return np.abs(friction + shift * rng.standard_normal(DRAWS))
