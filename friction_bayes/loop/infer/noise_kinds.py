r"""Kinds of sensor noise in addition to white: outliers, growth with the motion, both or neither.

They are evaluated at the law and the random force of the record without outliers or with them: the
distribution of the noise hardly changes the probabilities of the sets of effects.

Noise grows with the signal, or with its rate as sample times that jitter. A sample that is late by ``s z``
has an error of ``s z`` times the rate of the signal, one with a gain error of ``s z`` an error of ``s z``
times the signal. With ``g_i`` that rate or signal, sample ``i`` has the variance
``sigma**2 (1 + (g_i s / sigma)**2)``, which the filter uses. The evidence of growth is computed at the mode
of the random force, whose sd is kept, with ``log s`` integrated by Laplace's method.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion
from friction_bayes.loop.noise.correlated_noise import BestSet, Colour
from friction_bayes.loop.noise.likelihood import NoiseFit
from friction_bayes.mechanics.effects import EFFECTS, GrowingNoiseEffect
from friction_bayes.mechanics.effects.inclusion import inclusion, prior_log_odds
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.statespace.force_grid import Posterior, integrate_force
from friction_bayes.statespace.kalman import Clock

__all__ = ["NoiseGrowth", "NoiseKinds", "evaluate_sensor_noise", "log_convention"]

_SHARES = np.geomspace(0.05, 12.8, 9)
"""Noise that grows over that of one size, both over the whole record, between which the mode is sought."""
_STENCIL = 0.1


@dataclass(frozen=True, eq=False)
class NoiseKinds:
    """The kinds of noise that were evaluated, by their effects, and the one that the posterior takes.

    Log odds, priors included, are against white noise alone, which comes first. Growth and outliers are those
    of the one taken, None where it has none; outliers are about what all other samples predict.
    """

    log_odds: Mapping[frozenset[str], float]
    effects: frozenset[str]
    growth: NoiseGrowth | None
    outliers: NoiseFit | None

    @property
    def log_total(self) -> float:
        """Logarithm of the sum of all odds."""
        return float(logsumexp([*self.log_odds.values()]))

    def probabilities(self, records: int = 1) -> dict[frozenset[str], float]:
        """Probability of each kind of noise by its effects, in one of some records.

        That any of these has an effect is as probable as any effect.
        """
        prior = math.log(math.expm1(-math.log1p(-inclusion()) / records))
        more = prior - prior_log_odds()
        log_odds = {effects: each + len(effects) * more for effects, each in self.log_odds.items()}
        total = logsumexp([*log_odds.values()])
        return {effects: math.exp(each - total) for effects, each in log_odds.items()}

    def sd_of_samples(self, sd: Array) -> Array:
        """Standard deviation of the noise, outliers included, where that of the others is ``sd``."""
        if self.outliers is None:
            return sd
        fraction = self.outliers.fraction
        return np.asarray(np.sqrt((1.0 - fraction) * sd**2 + fraction * self.outliers.scale**2))


def log_convention(used: int, unit: float) -> float:
    """Logarithm of the factor from evidence of ``used`` samples, noise integrated, to that at its best.

    With ``unit`` that of the signal in natural units.
    """
    return -0.5 * used * (math.log(4.0 * math.pi / used) + 1.0) - used * math.log(unit)


def evaluate_sensor_noise(
    along: LawAlongMotion, cleaned: LawAlongMotion
) -> tuple[LawAlongMotion, Posterior, NoiseKinds]:
    """The law under the most probable kind of noise, its posterior over the random force, and all kinds.

    ``cleaned`` is the law without the samples that are outliers if there are any; ``along`` itself where none
    are.
    """
    evaluated = _given_samples(along, contaminated=False)
    if cleaned is not along:
        evaluated += _given_samples(cleaned, contaminated=True)
    best, white = max(evaluated, key=lambda each: each.log_weight), evaluated[0].log_weight
    posterior = best.posterior
    if best.growth is not None:
        posterior = integrate_force(best.along.problem, along.prior)
    noise = NoiseKinds(
        log_odds={each.effects: each.log_weight - white for each in evaluated},
        effects=best.effects,
        growth=best.growth,
        outliers=best.noise if OUTLIERS.name in best.effects else None,
    )
    return best.along, posterior, noise


class _Evaluated(NamedTuple):
    """One kind of noise, its evidence, and the law and force at which it was evaluated."""

    effects: frozenset[str]
    log_weight: float
    along: LawAlongMotion
    posterior: Posterior
    growth: NoiseGrowth | None
    noise: NoiseFit


def _given_samples(along: LawAlongMotion, *, contaminated: bool) -> list[_Evaluated]:
    """Noise of one size and noise that grows on the samples that a record uses."""
    posterior = integrate_force(along.problem, along.prior)
    left = along.left_out(posterior.best_law(), posterior.best)
    used = along.clock.used
    log_factor = left.log_factor(used, outliers=contaminated) + (prior_log_odds() if contaminated else 0.0)
    convention = log_convention(int(used.sum()), along.unit)
    growth = _noise_growth(along, posterior)
    one_size = _Evaluated(
        effects=frozenset({OUTLIERS.name} if contaminated else ()),
        log_weight=posterior.log_evidence + convention + log_factor,
        along=along,
        posterior=posterior,
        growth=None,
        noise=left.noise(outliers=contaminated),
    )
    if growth is None:
        return [one_size]
    grown = one_size._replace(
        effects=one_size.effects | {growth.effect.name},
        log_weight=one_size.log_weight + growth.log_odds,
        along=replace(along, regression=replace(along.regression, clock=growth.clock)),
        growth=growth,
    )
    return [one_size, grown]


def _noise_growth(along: LawAlongMotion, posterior: Posterior) -> NoiseGrowth | None:
    """The most probable growth of the noise; None where none may act."""
    if isinstance(along.record.error, Colour):
        return None
    effects = (EFFECTS[name] for name in along.record.allowed)
    growing = (effect for effect in effects if isinstance(effect, GrowingNoiseEffect))
    growths = (find_noise_growth(effect, along, posterior) for effect in growing)
    return max(growths, key=lambda growth: growth.log_odds, default=None)


@dataclass(frozen=True, eq=False)
class NoiseGrowth:
    """Noise of a record that grows with its motion, given that it does, and the probability of that.

    Attributes
    ----------
    effect : GrowingNoiseEffect
    log_odds : float
        Of growth against none, prior odds included.
    ratio : float
        The size, a parameter of the effect, over the sd of the noise of one size in natural units.
    log_sd : float
        Standard deviation of its logarithm.
    clock : Clock
        Time stamps with the noise that it makes of them.
    """

    effect: GrowingNoiseEffect
    log_odds: float
    ratio: float
    log_sd: float
    clock: Clock


def find_noise_growth(effect: GrowingNoiseEffect, along: LawAlongMotion, posterior: Posterior) -> NoiseGrowth:
    """Noise that grows, with its evidence over that of one size, which the law ``along`` a motion has.

    At the ``posterior`` of the random force.
    """
    record, path, order = along.record, along.path, along.segment.order
    clock, force, best = along.clock, posterior.best, BestSet(along.regression, posterior)
    # the prior is one of the noise of a sample: in a mean of a block it counts less
    prior = effect.priors(record.scales)[0]
    prior = replace(prior, location=prior.location / math.sqrt(record.segment.block))
    # errors at a jump of the acceleration are not errors of time
    rate = (path.v, np.gradient(path.v, path.phase), -path.slope * path.v)[order]
    signal = path.reading(order, path.x, path.v)
    growth = effect.grows_with(signal, along.w0 * rate)
    mean_square = float(np.mean(growth**2))

    def clock_at(ratio: float) -> Clock:
        return replace(clock, variance=clock.variance * (1.0 + (ratio * growth) ** 2))

    def log_weight(clock: Clock, spread: float) -> tuple[float, float]:
        value, noise2 = best.under(clock, force.ratio * spread, force.tau)
        return value, math.sqrt(noise2)

    def density(log_ratio: float) -> float:
        """Log posterior density of the logarithm of the size; the other noise is reduced accordingly."""
        ratio = math.exp(log_ratio)
        value, noise = log_weight(clock_at(ratio), math.sqrt(1.0 + ratio**2 * mean_square))
        size = ratio * noise
        return value + float(prior.log_density(size)) + math.log(size)

    grid = np.log(_SHARES / math.sqrt(mean_square))
    values = [density(x) for x in grid]
    k = min(max(int(np.argmax(values)), 1), grid.size - 2)
    climbed = minimize_scalar(
        lambda x: -density(x),
        bounds=(grid[k - 1], grid[k + 1]),
        method="bounded",
        options={"xatol": 0.03, "maxiter": 12},
    )
    mode, top = float(climbed.x), -float(climbed.fun)
    bend = (density(mode + _STENCIL) - 2.0 * top + density(mode - _STENCIL)) / _STENCIL**2
    log_sd = 1.0 / math.sqrt(max(-bend, 1.0 / prior.scale**2))
    log_evidence = top + 0.5 * math.log(2.0 * math.pi) + math.log(log_sd)
    log_odds = prior_log_odds() + log_evidence - log_weight(clock, 1.0)[0]
    ratio = math.exp(mode)
    return NoiseGrowth(effect, log_odds, ratio, log_sd, clock_at(ratio))
