"""Which effects: a search led by the residual, from the empty set to three effects at once.

At each set the derivatives of the signal with respect to everything that is not in it are projected out of
what the set already explains; the residual then says, to first order, what each addition would gain. Only
what promises to matter is fitted, from where the linear step points. The best sets are extended in turn,
and every part of the winner is fitted too, so that no effect is carried by another.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from friction_bayes.loop.addition import Addition, additions
from friction_bayes.loop.evidence import log_evidence
from friction_bayes.loop.fit import LoopFit, fit_grown, fit_model, starting_point
from friction_bayes.loop.model import LoopModel, distorting
from friction_bayes.loop.noise import NoiseForm
from friction_bayes.loop.segment import Segment
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.oscillator import Oscillator

__all__ = ["INCLUSION", "Candidate", "Search"]

INCLUSION = 0.1
"""Prior probability that an effect acts, independently for each."""
MOST_EFFECTS = 3
_BEAM = 3
_PROMISING = math.log(200.0)
"""What the linear step must come within of the best evidence to be fitted."""
_MOST_FITS = 6
_GROSS = 0.2
"""Residual over signal, RMS, beyond which a linear step says nothing and the record is grown anew."""
_BEFORE_REST = 0.7
"""Share of the moving samples fitted first where the motion comes to rest."""

Names = frozenset[str]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A set of effects that was fitted.

    Attributes
    ----------
    effects : frozenset of str
    fit : LoopFit
    log_weight : float
        Log-evidence with the log-prior of the set.
    """

    effects: Names
    fit: LoopFit
    log_weight: float


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
        Told the name of each set that is fitted.
    """

    system: Oscillator
    segments: tuple[Segment, ...]
    allowed: tuple[str, ...]
    ar: tuple[np.ndarray, ...]
    progress: Callable[[str], None] | None = None
    candidates: dict[Names, Candidate] = field(default_factory=dict)
    trail: list[str] = field(default_factory=list)

    @property
    def certain(self) -> Names:
        """Effects that the samples prove before any model: held values are clipped."""
        if "sensor_clipping" in self.allowed and any(s.clipped for s in self.segments):
            return frozenset({"sensor_clipping"})
        return frozenset()

    def ranked(self) -> list[Candidate]:
        """Candidates, most probable first."""
        return sorted(self.candidates.values(), key=lambda c: -c.log_weight)

    def run(self) -> None:
        """Search."""
        root = self.certain
        self._fit(root, None)
        if root not in self.candidates:
            return
        frontier = [root]
        for size in range(1, MOST_EFFECTS + 1):
            before = self.ranked()[0].log_weight
            grown: list[Names] = []
            for names in frontier:
                grown += self._extend(names)
            if not grown:
                break
            for names in grown:
                self._second_start(names)
            best = self.ranked()[0]
            self.trail.append(
                f"with {size}: {'+'.join(sorted(best.effects)) or 'Coulomb alone'} is most probable, "
                f"log evidence {best.log_weight - before:+.1f} on the last step"
            )
            if best.log_weight <= before:
                break
            fresh = sorted(set(grown), key=lambda names: -self.candidates[names].log_weight)
            frontier = fresh[:_BEAM]
        self._fit_parts()

    def _extend(self, names: Names) -> list[Names]:
        """Fit the promising extensions of a set; those fitted."""
        parent = self.candidates[names]
        wanted = [
            name
            for name in self.allowed
            if name not in names
            and name != "sensor_clipping"
            and not any(other in names for other in EFFECTS[name].excludes)
        ]
        found = additions(parent.fit, [name for name in wanted if distorting(name)])
        threshold = self.ranked()[0].log_weight - _PROMISING
        step = math.log(INCLUSION / (1.0 - INCLUSION))
        chosen = [a for a in found if parent.log_weight + a.log_gain + step > threshold]
        chosen.sort(key=lambda a: -a.log_gain)
        grown = []
        for addition in chosen[:_MOST_FITS] if names != self.certain else chosen:
            child = names | {addition.effect}
            if child not in self.candidates:
                self._fit(child, addition)
            if child in self.candidates:
                grown.append(child)
        if "outliers" in wanted and self._heavy(parent.fit):
            child = names | {"outliers"}
            if child not in self.candidates:
                self._fit(child, None, parent.fit)
            if child in self.candidates:
                grown.append(child)
        return grown

    @staticmethod
    def _heavy(fit: LoopFit) -> bool:
        """Whether more residuals lie beyond four standard deviations than the normal has by chance."""
        for noise in fit.noises:
            x = noise.residual[noise.weight > 0.0]
            core = 1.4826 * float(np.median(np.abs(x)))
            expected = 6.4e-5 * x.size
            if np.count_nonzero(np.abs(x) > 4.0 * core) > expected + 3.0 * math.sqrt(expected) + 1.0:
                return True
        return False

    def _second_start(self, names: Names) -> None:
        """A set must not be worse than its parts: climb again from the part that is better."""
        candidate = self.candidates[names]
        for part in (names - {name} for name in names):
            other = self.candidates.get(part)
            if other is None or other.fit.objective > candidate.fit.objective - 1.0:
                continue
            again = fit_model(
                candidate.fit.model, candidate.fit.forms, _embedded(other.fit, candidate.fit.model)
            )
            self._keep(names, again)

    def _fit_parts(self) -> None:
        """Fit every subset of the winner that was passed over, from the winner's parameters."""
        best = self.ranked()[0]
        free = best.effects - self.certain
        for size in range(len(free) - 1, 0, -1):
            for part in combinations(sorted(free), size):
                names = frozenset(part) | self.certain
                if names not in self.candidates:
                    self._fit(names, None, best.fit)

    def _fit(self, names: Names, addition: Addition | None, nearby: LoopFit | None = None) -> None:
        effects = tuple(name for name in EFFECTS if name in names and distorting(name))
        model = LoopModel(self.system, self.segments, effects)
        forms = [
            NoiseForm(ar, outliers="outliers" in names, censored="sensor_clipping" in names) for ar in self.ar
        ]
        if self.progress is not None:
            self.progress("+".join(sorted(names)) or "Coulomb friction alone")
        origin = addition.parent if addition is not None else nearby
        if origin is None:
            self._keep(names, fit_grown(model, forms, starting_point(model)))
            return
        start = addition.start(model) if addition is not None else _embedded(origin, model)
        # where the motion ends, a half cycle more or less is a step in the likelihood: come from before it
        rests = any(math.isfinite(p.stop_time) for p in origin.predictions) or any(
            s.decay.stops for s in self.segments
        )
        climb = (
            fit_grown(model, forms, start, share=_BEFORE_REST) if rests else fit_model(model, forms, start)
        )
        self._keep(names, climb)
        if _misfit(origin) > _GROSS:
            self._keep(names, fit_grown(model, forms, starting_point(model)))

    def _keep(self, names: Names, fit: LoopFit | None) -> None:
        if fit is None:
            return
        known = self.candidates.get(names)
        if known is not None and known.fit.objective <= fit.objective:
            return
        k = len(names - self.certain)
        others = len(self.allowed) - len(names)
        prior = k * math.log(INCLUSION) + others * math.log1p(-INCLUSION)
        self.candidates[names] = Candidate(names, fit, log_evidence(fit) + prior)


def _misfit(fit: LoopFit) -> float:
    """Residual over signal, root mean square."""
    residual = np.concatenate(fit.residuals)
    signal = np.concatenate([p.signal for p in fit.predictions])
    return float(np.sqrt(np.mean(residual**2) / np.mean(signal**2)))


def _embedded(fit: LoopFit, model: LoopModel) -> np.ndarray:
    """Coordinates of another model that agree with a fit where they have the same name, null elsewhere."""
    known = {(c.effect, c.name, c.record): x for c, x in zip(fit.model.coordinates, fit.z, strict=True)}
    return np.array([known.get((c.effect, c.name, c.record), 0.0) for c in model.coordinates])


def describe(candidates: Sequence[Candidate]) -> list[str]:
    """Names of candidates."""
    return ["+".join(sorted(c.effects)) or "none" for c in candidates]
