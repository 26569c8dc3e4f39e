"""Laws of wear with their evidence, and the remaining life averaged over them.

Steady, accelerating, decelerating, saturating and kinked wear, and wear in jumps, are equally probable
beforehand; so are the values of the shape parameters that a law has, over their range. Each value is a clock
(:mod:`friction_bayes.monitor.clocks`), on which the wear model is fitted in closed form; the probability of a
clock follows from the marginal likelihood of the estimates. The remaining life is the mixture over clocks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol, TypeVar

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array
from friction_bayes.monitor.clocks import LAWS, ExponentialClock, JumpClock, KinkClock, PowerClock, WearClock
from friction_bayes.monitor.remaining_life import RemainingLife, remaining_life
from friction_bayes.monitor.wear import WearPosterior, default_wear_prior, fit_wear

__all__ = ["WearLaws", "WearOnClock", "fit_laws"]

_NODES = 7
"""Values of a shape parameter at first."""
_HALVINGS = 6
_NUMBERS_OF_JUMPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Those that are evaluated, up to half of the steps between detection points."""
_STEP = 1.0
"""Difference of log-evidence above which there is a further value between two."""
_NEGLIGIBLE = 7.0
"""Values whose log-evidence is so far below the best of their law get no neighbours."""
_KEPT = 1e-3
"""Clocks below this share of the most probable one are dropped."""
_LONGEST = 1e7
"""End of the time axis, in units of the time observed; what is not reached by then never is."""
_AXIS = 1500
"""Nodes of the time axis, at most."""


@dataclass(frozen=True)
class _Family:
    """Clocks of a law along one shape parameter."""

    law: str
    clock: Callable[[float], WearClock]
    low: float
    high: float


_FAMILIES = (
    _Family("accelerating", ExponentialClock, 0.1, 8.0),
    _Family("accelerating", PowerClock, 1.05, 5.0),
    _Family("decelerating", PowerClock, 0.1, 0.95),
    _Family("decelerating", lambda power: PowerClock(power, 0.5), 0.1, 0.95),
    _Family("saturating", ExponentialClock, -8.0, -0.1),
)
"""Wear grows at most by e^8 within the time observed, or began at T1 or half that time before."""
_STEEPEST_KINK = 10.0
"""Largest ratio of the rates after and before a kink. It is at least 1, and its logarithm uniform."""
_KINK_STEP = 2.0
"""As ``_STEP``, for the two shape parameters of kinks. At the finer step there would be two to four times
the fits, and the ends of the 90 % interval would move by 1 % of its width, 6 % at most (of six machines)."""


class _Evaluated(Protocol):
    """What has an evidence, so that values of a shape parameter can be laid where it is."""

    @property
    def log_evidence(self) -> float:
        """Log marginal likelihood."""


_Fit = TypeVar("_Fit", bound=_Evaluated)


@dataclass(frozen=True, eq=False)
class _Kinks:
    """Kinks of one ratio at all times.

    Attributes
    ----------
    clocks : list of KinkClock
    shares : ndarray
        Of each, given the ratio.
    fits : list of WearPosterior
    """

    clocks: list[KinkClock]
    shares: Array
    fits: list[WearPosterior]

    @property
    def log_evidence(self) -> float:
        """Of the ratio, averaged over the time of the kink."""
        return float(logsumexp([each.log_evidence for each in self.fits], b=self.shares))


@dataclass(frozen=True, eq=False)
class WearOnClock:
    """The wear model on one clock.

    Attributes
    ----------
    law : str
        One of :data:`friction_bayes.monitor.clocks.LAWS`.
    clock : WearClock
    probability : float
        Posterior probability of the clock.
    posterior : WearPosterior
        Its unit of time is the time observed.
    """

    law: str
    clock: WearClock
    probability: float
    posterior: WearPosterior


@dataclass(frozen=True, eq=False)
class WearLaws:
    """Posterior over laws of wear.

    Attributes
    ----------
    clocks : tuple of WearOnClock
        Those that matter; their probabilities add to one.
    span : float
        Time observed, T1 to Tn.
    """

    clocks: tuple[WearOnClock, ...]
    span: float

    @property
    def probabilities(self) -> dict[str, float]:
        """Posterior probability of each law."""
        return {law: sum(each.probability for each in self.clocks if each.law == law) for law in LAWS}

    def moments(self, name: str) -> tuple[float, float]:
        """Return posterior mean and sd of ``level``, ``drift``, ``wander`` or ``scatter``.

        Drift and wander are per unit of time at Tn, the latter per square root of it.
        """
        power = {"drift": 1.0, "wander": 0.5}.get(name, 0.0)
        found = np.array([each.posterior.moments(name) for each in self.clocks])
        found *= np.array([(each.clock.pace / self.span) ** power for each in self.clocks])[:, None]
        weight = np.array([each.probability for each in self.clocks])
        mean = float(weight @ found[:, 0])
        return mean, math.sqrt(float(weight @ (found[:, 1] ** 2 + (found[:, 0] - mean) ** 2)))

    def course(self, law: str, later: Array) -> Array:
        """Return the mean friction under a law at times after Tn; under jumps, while there is none."""
        chosen = [each for each in self.clocks if each.law == law]
        weight = np.array([each.probability for each in chosen])
        time = 1.0 + later / self.span
        paths = [
            each.posterior.moments("level")[0]
            + each.posterior.moments("drift")[0] * (each.clock.reading(time) - 1.0)
            for each in chosen
        ]
        return np.asarray((weight / weight.sum()) @ np.array(paths))

    def remaining_life(self, threshold: float, *, relative_sd: float = 0.0) -> RemainingLife:
        """Return the distribution of the time from Tn till the friction first reaches the threshold.

        Parameters
        ----------
        threshold, relative_sd : float
            As in :func:`friction_bayes.monitor.remaining_life.remaining_life`.
        """
        lives = [
            remaining_life(each.posterior, threshold, 1.0, relative_sd=relative_sd) for each in self.clocks
        ]
        time = np.concatenate(
            [each.clock.when(1.0 + life.time) - 1.0 for each, life in zip(self.clocks, lives, strict=True)]
        )
        time = np.unique(time[(time > 1.0 / _LONGEST) & (time < _LONGEST)])
        time = np.append(time[:: max(time.size // _AXIS, 1)], _LONGEST)
        cumulative = sum(
            each.probability * each.clock.reached(life, 1.0 + time)
            for each, life in zip(self.clocks, lives, strict=True)
        )
        # interpolation may leave a hair too much
        cumulative = np.clip(np.maximum.accumulate(cumulative), 0.0, 1.0)
        already = sum(each.probability * life.already for each, life in zip(self.clocks, lives, strict=True))
        density = np.gradient(cumulative, time) / self.span
        return RemainingLife(
            time * self.span, density, cumulative, min(already, 1.0), 1.0 - float(cumulative[-1])
        )


def fit_laws(times: Array, friction: Array, sd: Array) -> WearLaws:
    """Evaluate the laws of wear by the estimates of at least two detection points.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Increasing, any unit.
    friction, sd : ndarray, shape (n,)
        Estimate of each record and its standard deviation.

    Returns
    -------
    WearLaws
    """
    span = float(times[-1] - times[0])
    time = (times - times[0]) / span
    prior = default_wear_prior(time, friction)

    def fit(clock: WearClock) -> WearPosterior:
        return fit_wear(clock.reading(time), friction, sd, prior)

    # law, clock, its share of the law beforehand, its fit
    found: list[tuple[str, WearClock, float, WearPosterior]] = [
        ("linear", PowerClock(), 1.0, fit(PowerClock()))
    ]
    for jumps, share in _jumps(time, friction, sd):
        # one jump says nothing of how jumps differ: the next is like it
        alike = replace(prior, wander=0.0) if len(jumps.after) == 1 else prior
        found.append(("jumps", jumps, share, fit_wear(jumps.reading(time), friction, sd, alike)))
    for family in _FAMILIES:
        families = sum(other.law == family.law for other in _FAMILIES)
        shapes, fits = _along(family.low, family.high, partial(_fit_shape, family, fit))
        found += [
            (family.law, family.clock(shape), float(part) / families, each)
            for shape, part, each in zip(shapes.tolist(), _shares(shapes), fits, strict=True)
        ]
    steepness, kinks = _along(
        0.0, math.log(_STEEPEST_KINK), lambda power: _kinks(math.exp(power), fit), _KINK_STEP
    )
    for share, of_ratio in zip(_shares(steepness), kinks, strict=True):
        found += [
            ("kinked", clock, float(share * part), each)
            for clock, part, each in zip(of_ratio.clocks, of_ratio.shares, of_ratio.fits, strict=True)
        ]
    score = np.array([math.log(share) + each.log_evidence for _, _, share, each in found])
    kept = np.flatnonzero(score > score.max() + math.log(_KEPT))
    probability = np.exp(score[kept] - logsumexp(score[kept]))
    return WearLaws(
        tuple(
            WearOnClock(found[k][0], found[k][1], float(p), found[k][3])
            for k, p in zip(kept, probability, strict=True)
        ),
        span,
    )


def _jumps(time: Array, friction: Array, sd: Array) -> list[tuple[JumpClock, float]]:
    """Return clocks of few and of many jumps with their shares of the law beforehand.

    Numbers of jumps are equally probable, and so are the places of as many. Of the places only the likeliest
    are taken, where friction rose most for its error: the evidence of jumps is a lower bound.
    """
    places = time.size - 1
    rise = np.diff(friction) / np.hypot(sd[1:], sd[:-1])
    order = np.argsort(-np.abs(rise), kind="stable")
    numbers = [number for number in _NUMBERS_OF_JUMPS if number <= max(places // 2, 1)]
    return [
        (
            JumpClock(tuple(np.sort(time[:-1][order[:number]]).tolist())),
            1.0 / (len(numbers) * math.comb(places, number)),
        )
        for number in numbers
    ]


def _fit_shape(family: _Family, fit: Callable[[WearClock], WearPosterior], shape: float) -> WearPosterior:
    """Fit the clock of one value of a family's shape parameter."""
    return fit(family.clock(shape))


def _kinks(ratio: float, fit: Callable[[WearClock], WearPosterior]) -> _Kinks:
    """Fit kinks of one ratio, at times that are laid where the evidence is."""
    times, fits = _along(0.0, 1.0, lambda time: fit(KinkClock(time, ratio)), _KINK_STEP)
    return _Kinks([KinkClock(time, ratio) for time in times.tolist()], _shares(times), fits)


def _shares(shapes: Array) -> Array:
    """Return the share of a uniform prior that belongs to each of some values, by the trapezoidal rule."""
    steps = np.diff(shapes)
    return np.asarray((np.append(steps, 0.0) + np.append(0.0, steps)) / (2.0 * (shapes[-1] - shapes[0])))


def _along(
    low: float, high: float, fit: Callable[[float], _Fit], step: float = _STEP
) -> tuple[Array, list[_Fit]]:
    """Return values of a shape parameter, dense where the evidence is, and the fit of each."""
    shapes = np.linspace(low, high, _NODES)
    fits = [fit(shape) for shape in shapes.tolist()]
    for _ in range(_HALVINGS):
        evidence = np.array([each.log_evidence for each in fits])
        near = np.maximum(evidence[1:], evidence[:-1]) > evidence.max() - _NEGLIGIBLE
        width = np.diff(shapes)
        neighbour = np.minimum(np.append(width[1:], np.inf), np.append(np.inf, width[:-1]))
        # a peak between two values of equal evidence shows in how fine the steps next to it are
        coarse = (np.abs(np.diff(evidence)) > step) | (width > 1.5 * neighbour)
        wide = np.flatnonzero(near & coarse)
        if wide.size == 0:
            break
        between = 0.5 * (shapes[wide] + shapes[wide + 1])
        shapes = np.insert(shapes, wide + 1, between)
        for place, shape in reversed(list(zip(wide + 1, between.tolist(), strict=True))):
            fits.insert(int(place), fit(shape))
    return shapes, fits
