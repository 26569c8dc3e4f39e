"""Which effects: a search led by the residual, from the empty set to three effects at once.

About the best fit so far the evidence of every set of effects, those of the fit dropped, swapped or kept, is
approximated to second order (see :mod:`friction_bayes.loop.search.expansion`); what promises to matter is
fitted from where that points, and the search goes on from the best. Each single effect is fitted whatever is
promised, and single forces also from the first periods on, so that no wrong start decides.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from friction_bayes.core.system import Oscillator
from friction_bayes.loop import settings
from friction_bayes.loop.data.effect_sets import SENSOR_ZERO, EffectSets, set_name
from friction_bayes.loop.data.model import LoopModel, changes_signal
from friction_bayes.loop.data.parameters import FRICTION
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.data.starting_point import starting_point
from friction_bayes.loop.noise.likelihood import NoiseModel, has_heavy_tails
from friction_bayes.loop.search.candidate import Candidate
from friction_bayes.loop.search.expansion import Approximation, Expansion, is_identifiable
from friction_bayes.loop.search.fit import LoopFit, fit_growing_record, fit_model, settle
from friction_bayes.loop.search.laplace_evidence import log_evidence
from friction_bayes.loop.search.residual_tests import residual_tests
from friction_bayes.loop.search.spectral_lines import has_line_of_motion
from friction_bayes.mechanics.effects import EFFECTS, ForceEffect
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["Search"]

_CARRIED = 3
"""Best sets of another search to start from."""
_BETTER = 1.0
"""Objective below that of a fit, to second order, that makes it be climbed again."""
_NEAR = 4.0
"""Log-weight below the best within which a fit is expanded about too."""
_MOST_FITS = 12
_MOST_CENTRES = 7
_MOST_STOPS = 4
_BEFORE_REST = 0.7
"""Share of the moving samples fitted first where the motion comes to rest."""

Names = frozenset[str]


@dataclass
class Search:
    """The candidates of some records.

    Parameters
    ----------
    system : Oscillator
    segments : tuple of Segment
    allowed : tuple of str
        Effects that may be tried.
    ar : tuple of ndarray
        Autoregression of each record's noise.
    progress : callable, optional
        Called with the name of each set that is fitted.

    Attributes
    ----------
    candidates : dict
        What was fitted, by its effects.
    trail : list of str
        The steps taken.
    """

    system: Oscillator
    segments: tuple[Segment, ...]
    allowed: tuple[str, ...]
    ar: tuple[np.ndarray, ...]
    progress: Callable[[str], None] | None = None
    candidates: dict[Names, Candidate] = field(default_factory=dict)
    trail: list[str] = field(default_factory=list)

    @cached_property
    def sets(self) -> EffectSets:
        """The sets that may be formed; samples held at an end of the sensor's range prove that it clips."""
        clips = SENSOR_CLIPPING.name in self.allowed and any(s.clipped for s in self.segments)
        return EffectSets(self.allowed, frozenset({SENSOR_CLIPPING.name}) if clips else frozenset())

    def ranked(self) -> list[Candidate]:
        """Candidates, most probable first."""
        return sorted(self.candidates.values(), key=lambda c: -c.log_weight)

    def run(self) -> None:
        """Search."""
        root = self.sets.certain
        self._fit_from_first_periods(root)
        if root not in self.candidates or residual_tests(self.candidates[root].fit).failed:
            # where the sensor's zero is far off, a fit without it points nowhere
            for name in sorted(SENSOR_ZERO.intersection(self.allowed)):
                self._fit_from_first_periods(root | {name})
            if not self.candidates:
                return
            alone = self.candidates.get(root, self.ranked()[0])
            forces = [name for name in self.allowed if isinstance(EFFECTS[name], ForceEffect)]
            for name in sorted(Expansion(alone.fit, forces).informed, key=forces.index):
                self._fit_from_first_periods(alone.effects | {name})
        expanded: dict[Names, float] = {}
        while len(expanded) < _MOST_CENTRES:
            centre = self._next_centre(expanded)
            if centre is None:
                break
            self._expand(centre)
            expanded[centre.effects] = self.candidates[centre.effects].fit.objective
        self._settle()

    def _settle(self) -> None:
        """Weigh what counts at its mode."""
        if not self.candidates:
            return
        least = self.ranked()[0].log_weight - math.log(settings.SETTINGS.promising)
        for names, candidate in self.candidates.items():
            if candidate.log_weight > least:
                self.candidates[names] = self._weighed(names, settle(candidate.fit))

    def _weighed(self, names: Names, fit: LoopFit) -> Candidate:
        return Candidate(names, fit, log_evidence(fit) + self.sets.log_prior(names))

    def start_from(self, other: Search) -> None:
        """Climb from what a search of the same records under other noise reached: the singles and the best.

        Coloured noise takes a model that has lost the cycles for one that is nearly right, so that growing
        from the first periods may end far off.
        """
        best = {candidate.effects for candidate in other.ranked()[:_CARRIED]}
        for names, candidate in other.candidates.items():
            if names <= set(self.allowed) and (self.sets.is_single(names) or names in best):
                fit = candidate.fit
                self._keep(names, fit_model(fit.model, self._noise_models(names), fit.z))

    def _next_centre(self, expanded: Mapping[Names, float]) -> Candidate | None:
        """The most probable candidate not expanded about yet: a near one, or any while there is misfit."""
        ranked = self.ranked()
        waiting = [c for c in ranked if c.fit.objective < expanded.get(c.effects, math.inf) - _BETTER]
        if not waiting:
            return None
        near = waiting[0].log_weight > ranked[0].log_weight - _NEAR
        return waiting[0] if near or residual_tests(ranked[0].fit).failed else None

    def _expand(self, centre: Candidate) -> None:
        """Fit what promises to matter about a candidate."""
        before = self.ranked()[0]
        centre = self._with_other_stops(centre)
        self._toggle_outliers(centre)
        promised = sorted(self._promised(centre), key=lambda promise: -promise[0])
        fitted, margin = 0, math.log(settings.SETTINGS.promising)
        for log_weight, names, approximation in promised:
            known = self.candidates.get(names)
            single = self.sets.is_single(names) and known is None
            promising = log_weight > self.ranked()[0].log_weight - margin and fitted < _MOST_FITS
            if single or (promising and (known is None or self._is_better(approximation, known, centre))):
                self._fit_from_approximation(names, approximation, centre)
                fitted += 1
        best = self.ranked()[0]
        # without the sign that rounding leaves of a zero
        gained = round(best.log_weight - before.log_weight, 1) + 0.0
        self.trail.append(
            f"about {set_name(centre.effects)}: {len(promised)} sets approximated, {fitted} fitted; "
            f"{set_name(best.effects)} is most probable, log evidence {gained:+.1f}"
        )

    def _promised(self, centre: Candidate) -> Iterator[tuple[float, Names, Approximation]]:
        """Log-weight of every set, to second order about a candidate, under its noise."""
        in_signal = [name for name in self.allowed if changes_signal(name)]
        noise = centre.effects - frozenset(in_signal)
        one_more = max(self.sets.counted(centre.effects) + 1, 2)
        most = min(settings.SETTINGS.most_at_once - len(noise - self.sets.certain), one_more)
        log_prior = self.sets.log_prior
        for approximation in Expansion(centre.fit, in_signal).approximations(most, SENSOR_ZERO):
            names = approximation.effects | noise
            log_weight = centre.log_weight + approximation.log_gain
            yield log_weight + log_prior(names) - log_prior(centre.effects), names, approximation

    def _with_other_stops(self, centre: Candidate) -> Candidate:
        """Climb from a half cycle more and a half cycle less before the rest: each is a hill of its own."""
        names = centre.effects
        for sign in (1.0, -1.0):
            for _ in range(_MOST_STOPS):
                fit = self.candidates[names].fit
                turns = [p.turning_times.size for p in fit.predictions if math.isfinite(p.stop_time)]
                if not turns:
                    break
                z = fit.z.copy()
                z[fit.model.index(FRICTION)] *= 1.0 + sign / max(turns)
                self._keep(names, fit_model(fit.model, fit.noise_models, z))
                if self.candidates[names].fit.objective > fit.objective - _BETTER:
                    break
        return self.candidates[names]

    @staticmethod
    def _is_better(approximation: Approximation, known: Candidate, centre: Candidate) -> bool:
        return centre.fit.objective + approximation.objective < known.fit.objective - _BETTER

    def _toggle_outliers(self, centre: Candidate) -> None:
        """Fit the same set with outliers where residuals lie far out, and without them where it has them."""
        if OUTLIERS.name in centre.effects:
            other = centre.effects - {OUTLIERS.name}
        elif OUTLIERS.name in self.allowed and any(
            has_heavy_tails(noise.residual[noise.weight > 0.0]) for noise in centre.fit.noises
        ):
            other = centre.effects | {OUTLIERS.name}
        else:
            return
        if self.sets.counted(other) <= settings.SETTINGS.most_at_once and other not in self.candidates:
            self._keep(other, fit_model(centre.fit.model, self._noise_models(other), centre.fit.z))

    def _model(self, names: Names) -> LoopModel:
        if self.progress is not None:
            self.progress(set_name(names))
        effects = tuple(name for name in EFFECTS if name in names and changes_signal(name))
        return LoopModel(self.system, self.segments, effects)

    def _noise_models(self, names: Names) -> list[NoiseModel]:
        outliers, censored = OUTLIERS.name in names, SENSOR_CLIPPING.name in names
        return [NoiseModel(ar, outliers=outliers, censored=censored) for ar in self.ar]

    def _fit_from_first_periods(self, names: Names) -> None:
        model = self._model(names)
        self._keep(names, fit_growing_record(model, self._noise_models(names), starting_point(model)))

    def _fit_from_approximation(self, names: Names, approximation: Approximation, centre: Candidate) -> None:
        model = self._model(names)
        noise_models = self._noise_models(names)
        start = approximation.coordinates(model)
        self._keep(names, fit_model(model, noise_models, start))
        reached = self.candidates.get(names)
        short = reached is None or self._is_better(approximation, reached, centre)
        if short and any(s.decay.stops for s in self.segments):
            # at the end of the motion a half cycle more or less bends the likelihood: come from before it
            self._keep(names, fit_growing_record(model, noise_models, start, share=_BEFORE_REST))

    def _keep(self, names: Names, fit: LoopFit | None) -> None:
        """Keep a fit that is better than what is known of its set."""
        if fit is None or has_line_of_motion(fit):
            return
        if not is_identifiable(fit):
            # short of the mode the samples may seem to say too little of an effect
            fit = settle(fit)
            if not is_identifiable(fit) or has_line_of_motion(fit):
                return
        known = self.candidates.get(names)
        if known is not None and known.fit.objective <= fit.objective:
            return
        self.candidates[names] = self._weighed(names, fit)
