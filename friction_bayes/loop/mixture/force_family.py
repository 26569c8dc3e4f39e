"""Sets of effects beside a random force as a family of candidates, weighed along the measured motion."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.text import percent
from friction_bayes.loop.checks.sampler_check import check_random_force
from friction_bayes.loop.checks.witnesses import Witnesses, two_witnesses
from friction_bayes.loop.data.friction import friction_scale
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.infer.cells import Cells
from friction_bayes.loop.infer.drawn_laws import DrawnLaws
from friction_bayes.loop.infer.law_draws import LEAST_PROBABILITY, law_draws
from friction_bayes.loop.infer.pushing import pushing
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.infer.search_scale import log_scale
from friction_bayes.loop.mixture.motion_family import MotionFamily
from friction_bayes.loop.mixture.search_family import SearchFamily
from friction_bayes.loop.mixture.slight_beside_law import beside_set
from friction_bayes.loop.mixture.slight_effects import SlightEffect
from friction_bayes.loop.mixture.slight_force import slight_force
from friction_bayes.loop.mixture.unknowable import unknowable
from friction_bayes.loop.noise.correlated_error import NO_ERROR
from friction_bayes.loop.report.friction_range import Reading
from friction_bayes.loop.search.draws import DRAWS
from friction_bayes.mechanics.effects.inclusion import INCLUSION
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["ForceFamily", "log_share_of_search"]


class ForceFamily(MotionFamily):
    """Candidates of one record that the search does not have.

    All have an effect that it does not try: a random force, or one that only the regression knows. There may
    be none (see :class:`friction_bayes.loop.mixture.motion_family.MotionFamily`).

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
        super().__init__(search.found.before, tolerance, rng)
        self.found, self.fit = search.found, fit
        self.slight_force = slight_force(fit)
        shift = self._log_scale(allowed)
        self.cells = self._weighed_here()
        ranked = sorted(self.cells.probabilities.items(), key=lambda pair: -pair[1])
        self.sets = tuple(names for names, _ in ranked)
        self.log_weights = np.array([math.log(p) + shift for _, p in ranked])
        lines = ", ".join(map(str, fit.lines))
        self.trail = (
            f"along the measured motion: {len(fit.sets.effects)} sets of effects weighed with and without "
            f"a random force, log evidence {fit.log_gain:+.1f} with it"
            + (f"; lines that may be there: {lines}" if lines else ""),
            *self._left_out_as_pushing(),
        )

    def _log_scale(self, allowed: tuple[str, ...]) -> float:
        """From the regression's posterior to the scale that all families share."""
        fit = self.fit
        # the regression normalises the prior over its own sets
        none = logsumexp(fit.sets.log_prior[[not names for names in fit.sets.effects]])
        uncertain = set(allowed) - _certain(fit) - {RANDOM_FORCE.name}
        scale = log_scale(fit, self.found.white, self.found.fits[0]) - float(none)
        scale += len(uncertain) * math.log1p(-INCLUSION)
        # the weights are shared out to the kinds of noise, while the scale is that of white noise alone
        return fit.posterior.log_evidence + scale + fit.sensor_noise.log_total

    @cached_property
    def _pushing(self) -> Mask:
        return pushing(self.fit)

    def _left_out_as_pushing(self) -> tuple[str, ...]:
        share = float(self.fit.posterior.weight[:, self._pushing].sum())
        if share < LEAST_PROBABILITY:
            return ()
        return (f"sets whose dry friction would drive the motion, {percent(share)} likely, are left out",)

    @property
    def lead(self) -> float:
        """Log of how many times as probable its candidates are as what noise of the sensor alone explains.

        That is the candidates of the search, and the same sets along the measured motion. None where most of
        what the regression believes is left out here: what the search finds stands for that then.
        """
        mine = float(self.cells.total.sum())
        if mine < 0.5:
            return -math.inf
        along = math.log(mine) - log_share_of_search(self.fit, self.found.allowed)
        return min(along, float(logsumexp(self.log_weights) - logsumexp(self.found.log_weights)))

    def _weighed_here(self) -> Cells:
        """All but what the search has, of which the samples say something, under each kind of noise."""
        fit, nothing = self.fit, unknowable(self.fit)
        known = np.array([not names & nothing for names in fit.sets.effects]) & ~self._pushing
        # under errors that neighbours share a set is another hypothesis than under the search's white noise
        other_noise = fit.error != NO_ERROR and not any(ar.size for ar in self.found.ar)
        weights = []
        for noise, probability in fit.sensor_noise.probabilities.items():
            own = ~_known_to_search(fit, self.found.allowed, noise) | other_noise
            weights.append(probability * (own & known) * fit.posterior.weight)
        kinds = [noise | _certain(fit) for noise in fit.sensor_noise.probabilities]
        return Cells(np.array(weights), fit.posterior.ratio > 0.0, fit.sets.effects, kinds)

    @cached_property
    def laws(self) -> DrawnLaws:
        return DrawnLaws.of_one(law_draws(self.fit, self._rng_draws, DRAWS, self.cells.total))

    @cached_property
    def candidate(self) -> Integers:
        drawn = self.laws.first
        upto = np.cumsum(self.cells.weight[:, drawn.point, drawn.chosen], axis=0)
        kind = (self._rng_draws.random(DRAWS) * upto[-1] >= upto[:-1]).sum(axis=0)
        return self.cells.places(self.sets)[kind, drawn.point, drawn.chosen]

    def _slight_beside(self, g: int, row: int) -> Iterator[SlightEffect]:
        return beside_set(self.fit, g, row)

    @cached_property
    def best(self) -> tuple[ForceFit, ...]:
        # a candidate has sets of columns that are left out too, where another shape of it pushes
        own = (self.cells.places(self.sets[:1]) == 0) & (self.cells.weight > 0.0)
        return (self.fit.among(own.any(axis=0)),)

    @cached_property
    def reading(self) -> Reading:
        laws = DrawnLaws.of_one(law_draws(self.fit, self._rng_reading, DRAWS))
        return self._reading("the sets weighed along the measured motion", (self.fit,), laws)

    def simulated(self) -> tuple[LoopModel, Array]:
        """The search's: a law beside a random force does not follow the record."""
        return self.found.fits[0].model, self.found.fits[0].z

    def check(self, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
        factor, unit = friction_scale(self.before.model)
        return check_random_force(self.best[0], factor, unit, seed, forced=self._fluctuates)

    @cached_property
    def _witnesses(self) -> Witnesses:
        """In the best law, friction in the unit of the report."""
        factor, unit = friction_scale(self.before.model)
        return two_witnesses(self.best[0], factor * self.fit.law.unit_force, unit)

    def witnesses(self) -> dict[str, Any]:
        """Friction by the loss of amplitude and by the shape within a cycle, in the best law."""
        return {
            "loss": self._witnesses.loss.to_dict(),
            "shape": self._witnesses.shape.to_dict(),
            "agree": self._witnesses.agree,
        }

    def left(self) -> dict[str, Any]:
        """What the best law leaves; where the witnesses disagree friction may be that of the loss.

        The shape within a cycle is at the mercy of errors of the sensor that follow the direction, and of a
        law that is not quite the contact's.
        """
        found = super().left()
        if not self._witnesses.agree:
            factor, _ = friction_scale(self.before.model)
            gap = abs(self._witnesses.loss.mean / factor - float(self._friction[self._of_best].mean()))
            found["friction_could_shift_by"] = max(found["friction_could_shift_by"], gap)
        return found

    def between_records(self) -> None:
        """It has one."""


def log_share_of_search(fit: ForceFit, tried: Collection[str]) -> float:
    """Log probability, along the measured motion, of the sets that a search of some effects has too."""
    share = sum(
        float(probability * fit.posterior.weight[_known_to_search(fit, tried, noise)].sum())
        for noise, probability in fit.sensor_noise.probabilities.items()
    )
    return math.log(share) if share > 0.0 else -math.inf


def _known_to_search(fit: ForceFit, tried: Collection[str], noise: frozenset[str]) -> Mask:
    """Points and sets that it has, under one kind of noise, shape (g, m): dry friction, and no knocks.

    Its interference has one line.
    """
    if fit.knocks:
        return np.zeros((fit.posterior.ratio.size, len(fit.sets.effects)), np.bool_)
    several = {PERIODIC_INTERFERENCE.name} if sum(line.steady for line in fit.lines) > 1 else set()
    has = np.array([(names | noise) <= set(tried) - several for names in fit.sets.effects]) & fit.rubs
    return np.asarray((fit.posterior.ratio == 0.0)[:, None] & has)


def _certain(fit: ForceFit) -> frozenset[str]:
    """Effects that the samples prove before any model."""
    return frozenset({SENSOR_CLIPPING.name} if fit.segment.clipped else ())
