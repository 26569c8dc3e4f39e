"""Sets of effects evaluated on one record, with and without a random force."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import percent
from friction_bayes.loop.checks.sampler_check import check_random_force
from friction_bayes.loop.checks.witnesses import Witnesses, two_witnesses
from friction_bayes.loop.data.friction import friction_scale
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.cells import Cells
from friction_bayes.loop.infer.drawn_laws import DrawnLaws
from friction_bayes.loop.infer.draws import DRAWS
from friction_bayes.loop.infer.law_draws import LEAST_PROBABILITY, law_draws
from friction_bayes.loop.infer.record_fit import ForceFit, fit_random_force, too_few_turning_points
from friction_bayes.loop.mixture.candidates import Candidates
from friction_bayes.loop.mixture.slight_beside_law import beside_set
from friction_bayes.loop.mixture.slight_effects import SlightEffect
from friction_bayes.loop.mixture.slight_force import slight_force
from friction_bayes.loop.mixture.unknowable import unknowable
from friction_bayes.loop.report.friction_range import Reading
from friction_bayes.loop.simulation.coulomb import coulomb_model
from friction_bayes.loop.simulation.fit import LoopFit
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["RecordCandidates", "candidates_of_record"]


class RecordCandidates(Candidates):
    """All candidates of one record (see :class:`friction_bayes.loop.mixture.candidates.Candidates`).

    Parameters
    ----------
    before : LoopFit
        The Coulomb model alone.
    fit : ForceFit
    tolerance : float
        Share of friction below which a force that depends on the motion does not matter.
    rng : numpy.random.Generator
        Of the draws.
    """

    def __init__(self, before: LoopFit, fit: ForceFit, tolerance: float, rng: np.random.Generator) -> None:
        super().__init__(before, tolerance, rng)
        self.fit = fit
        self.slight_force = slight_force(fit)
        self._rank(_cells(fit))
        lines = ", ".join(map(str, fit.lines))
        share = float(fit.posterior.weight[:, fit.impossible].sum())
        left_out = (
            f"sets in which friction pushes or sensor effects hide the motion, {percent(share)} likely, "
            "are left out"
        )
        self.trail = (
            f"along the measured motion: {len(fit.sets.effects)} sets of effects evaluated"
            + (
                f" with and without a random force, log evidence {fit.log_gain:+.1f} with it"
                if fit.forced
                else " without a random force"
            )
            + (f"; lines that may be there: {lines}" if lines else ""),
            *((left_out,) if share >= LEAST_PROBABILITY else ()),
        )

    @cached_property
    def laws(self) -> DrawnLaws:
        return DrawnLaws.of_one(law_draws(self.fit, self._rng_draws, DRAWS, self.cells.total))

    def _slight_beside(self, g: int, row: int) -> Iterator[SlightEffect]:
        return beside_set(self.fit, g, row)

    @cached_property
    def best(self) -> tuple[ForceFit, ...]:
        # a candidate may lack some of its sets of columns, where one of its shapes is impossible
        own = (self.cells.places(self.sets[:1]) == 0) & (self.cells.weight > 0.0)
        return (self.fit.among(own.any(axis=0)),)

    @cached_property
    def reading(self) -> Reading:
        laws = DrawnLaws.of_one(law_draws(self.fit, self._rng_reading, DRAWS))
        return self._reading("the sets evaluated along the measured motion", (self.fit,), laws)

    def check(self, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
        factor, unit = friction_scale(self.before.model)
        return check_random_force(self.best[0], factor, unit, seed, forced=self._fluctuates)

    @cached_property
    def _witnesses(self) -> Witnesses | None:
        """In the best law, friction in the unit of the report; None where it has no random force."""
        if not self._fluctuates:
            return None
        factor, unit = friction_scale(self.before.model)
        return two_witnesses(self.best[0], factor * self.fit.law.unit_force, unit)

    def witnesses(self) -> dict[str, Any] | None:
        """Friction by the loss of amplitude and by the shape within a cycle, in the best law."""
        found = self._witnesses
        if found is None:
            return None
        return {"loss": found.loss.to_dict(), "shape": found.shape.to_dict(), "agree": found.agree}

    def left(self) -> dict[str, Any]:
        """Tests of the best law's residual; where the witnesses disagree friction may be that of the loss.

        The shape within a cycle is biased by errors of the sensor that follow the direction, and by a law
        that is not quite the contact's.
        """
        found, witnesses = super().left(), self._witnesses
        if witnesses is not None and not witnesses.agree:
            factor, _ = friction_scale(self.before.model)
            gap = abs(witnesses.loss.mean / factor - float(self._friction[self._of_best].mean()))
            found["friction_could_shift_by"] = max(found["friction_could_shift_by"], gap)
        return found

    def between_records(self) -> None:
        """There is one."""


def candidates_of_record(
    segment: Segment,
    system: Oscillator,
    options: LoopOptions,
    rng: np.random.Generator,
) -> RecordCandidates:
    """Candidates of one record.

    Parameters
    ----------
    segment : Segment
    system : Oscillator
        The declared system.
    options : LoopOptions
    rng : numpy.random.Generator
        Of the draws.

    Raises
    ------
    InputError
        If the record holds too few turning points, or no Coulomb decay can be fitted.
    """
    fit = fit_random_force(segment, system, options.allowed, noise=options.noise)
    if fit is None:
        raise too_few_turning_points(segment)
    return RecordCandidates(coulomb_model(system, (segment,)), fit, options.tolerance, rng)


def _cells(fit: ForceFit) -> Cells:
    """All sets that the samples can determine and whose friction resists, under each kind of noise."""
    nothing = unknowable(fit)
    known = np.array([not names & nothing for names in fit.sets.effects]) & ~fit.impossible
    noises = fit.sensor_noise.probabilities
    certain = frozenset({SENSOR_CLIPPING.name} if fit.segment.clipped else ())
    weights = [probability * known * fit.posterior.weight for probability in noises.values()]
    return Cells(
        np.array(weights),
        fit.posterior.ratio > 0.0,
        fit.sets.effects,
        [noise | certain for noise in noises],
    )
