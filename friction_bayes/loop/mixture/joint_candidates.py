"""Sets of effects evaluated on several records, each with its own random force and perhaps friction."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.system import Oscillator
from friction_bayes.loop import settings
from friction_bayes.loop.checks.contradictions import contradictions
from friction_bayes.loop.checks.joint_check import check_together
from friction_bayes.loop.data.friction import friction_scale, scale_draws
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.cells import Cells
from friction_bayes.loop.infer.drawn_laws import DrawnLaws
from friction_bayes.loop.infer.draws import DRAWS
from friction_bayes.loop.infer.joint_draws import joint_draws
from friction_bayes.loop.infer.joint_fit import JointFit, fit_together
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.mixture.candidates import Candidates
from friction_bayes.loop.mixture.slight_beside_law import beside_joint_set
from friction_bayes.loop.mixture.slight_effects import SlightEffect
from friction_bayes.loop.mixture.unknowable import unknowable
from friction_bayes.loop.report.between_records import friction_between_records
from friction_bayes.loop.report.friction_range import Reading
from friction_bayes.loop.simulation.coulomb import coulomb_model
from friction_bayes.loop.simulation.fit import LoopFit
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["JointCandidates", "candidates_together"]


def candidates_together(
    segments: tuple[Segment, ...],
    system: Oscillator,
    options: LoopOptions,
    rng: np.random.Generator,
    progress: Callable[[str], None] | None,
) -> JointCandidates:
    """Candidates of several records evaluated together.

    Parameters
    ----------
    segments : tuple of Segment, length r
    system : Oscillator
        The declared system.
    options : LoopOptions
    rng : numpy.random.Generator
        Of the draws.
    progress : callable or None
        Called with the name of each record.

    Raises
    ------
    InputError
        If a record holds too few turning points, or no Coulomb decay can be fitted.
    """
    varying, noise = options.varying_friction, options.noise
    fit = fit_together(segments, system, options.allowed, varying=varying, noise=noise, progress=progress)
    return JointCandidates(coulomb_model(system, segments), fit, options.allowed, options.tolerance, rng)


class JointCandidates(Candidates):
    """All candidates of several records: with a random force or none, one friction or one of each record.

    They are evaluated along the motions (see :class:`friction_bayes.loop.mixture.candidates.Candidates`).

    Parameters
    ----------
    before : LoopFit
        The Coulomb model alone.
    fit : JointFit
    allowed : sequence of str
        Effects that may act.
    tolerance : float
        Share of friction below which a force that depends on the motion does not matter.
    rng : numpy.random.Generator
        Of the draws.
    """

    def __init__(
        self,
        before: LoopFit,
        fit: JointFit,
        allowed: Sequence[str],
        tolerance: float,
        rng: np.random.Generator,
    ) -> None:
        super().__init__(before, tolerance, rng)
        self.fit = fit
        effects = fit.along[0].sets.effects
        nothing = set.intersection(*(unknowable(one) for one in fit.alone))
        known = np.array([not names & nothing for names in effects])
        clipped = any(one.segment.clipped for one in fit.alone)
        certain = frozenset({SENSOR_CLIPPING.name} if clipped and SENSOR_CLIPPING.name in allowed else ())
        spoilt = _outliers_somewhere(fit.alone)
        noises = {certain: 1.0 - spoilt, certain | {OUTLIERS.name}: spoilt}
        weights = [share * known * self.fit.weight for share in noises.values() if share > 0.0]
        kinds = [noise for noise, share in noises.items() if share > 0.0]
        self._rank(Cells(np.array(weights), fit.posterior.ratio > 0.0, effects, kinds))
        self.trail = (
            f"along the measured motions: {len(effects)} sets of effects evaluated on {len(fit.alone)} "
            "records together",
        )

    @property
    def _weight(self) -> Array:
        """Posterior of the points and of the sets with a spread, zero for those of no candidate."""
        kept = self.cells.total > 0.0
        return self.fit.posterior.weight * kept[:, self.fit.problem.number]

    @cached_property
    def laws(self) -> DrawnLaws:
        return joint_draws(self.fit, self._rng_draws, DRAWS, self._weight)

    def _slight_beside(self, g: int, row: int) -> Iterator[SlightEffect]:
        return beside_joint_set(self.fit, g, row)

    @property
    def _of_candidate(self) -> Mask:
        """Points and sets of the records that are the most probable candidate, shape (g, m)."""
        return np.asarray((self.cells.places(self.sets[:1]) == 0).any(axis=0))

    @cached_property
    def best(self) -> tuple[ForceFit, ...]:
        return self.fit.among(self._of_candidate).fits

    @cached_property
    def reading(self) -> Reading:
        laws = joint_draws(self.fit, self._rng_reading, DRAWS)
        return self._reading("the sets evaluated along the measured motions", self.fit.fits, laws)

    @property
    def notes(self) -> tuple[str, ...]:
        return (*super().notes, *self._contradictions)

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

    def variables(self) -> dict[str, Array]:
        best = self._of_best
        own = {"friction_spread": self.laws.spread[best]}
        for r, one in enumerate(self.laws.records):
            own[f"friction[{r}]"] = one.friction[best]
            own[f"displacement[{r}]"] = one.coefficients[best, 0]
            own[f"velocity[{r}]"] = one.coefficients[best, 1] * one.fit.w0
        return super().variables() | own

    def check(self, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
        factor, unit = friction_scale(self.before.model)
        mine = self._of_candidate[:, self.fit.problem.number] & (self._weight > 0.0)
        return check_together(self.fit, mine, factor, unit, seed, forced=self._fluctuates)

    def witnesses(self) -> None:
        """Not with several records, each of which would have its own."""

    def between_records(self) -> dict[str, Any]:
        model = self.before.model
        _, unit = friction_scale(model)
        rng_scale, rng_alone = self._rng_reading.spawn(2)
        return friction_between_records(
            self.laws,
            self.fit.alone,
            shift=self._friction - self.laws.friction,
            probability=self._differs,
            scale=scale_draws(model, self.laws.frequency, DRAWS, rng_scale),
            unit=unit,
            rng=rng_alone,
        )


def _outliers_somewhere(alone: Sequence[ForceFit]) -> float:
    """Probability that at least one record has outliers."""
    none = 1.0
    for fit in alone:
        noises = fit.sensor_noise.probabilities
        none *= sum(p for names, p in noises.items() if OUTLIERS.name not in names)
    return 1.0 - min(none, 1.0)
