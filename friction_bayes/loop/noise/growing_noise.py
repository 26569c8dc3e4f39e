r"""Whether the noise grows with the motion: with the signal, or with its rate as sample times that jitter.

A sample that is late by ``s z`` has an error of ``s z`` times the rate of the signal, one with a gain error
of ``s z`` an error of ``s z`` times the signal. With ``g_i`` that rate or signal, sample ``i`` has the
variance ``sigma**2 (1 + (g_i s / sigma)**2)``, which the filter uses. The evidence of growth is computed at
the mode of the random force, whose sd is kept, with ``log s`` integrated by Laplace's method.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from friction_bayes.mechanics.effects import GrowingNoiseEffect, Prior
from friction_bayes.mechanics.effects.inclusion import prior_log_odds
from friction_bayes.statespace.force_grid import Posterior
from friction_bayes.statespace.kalman import Clock, whiten
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.subset_evidence import evaluate_sets

__all__ = ["NoiseGrowth", "find_noise_growth"]

_SHARES = np.geomspace(0.05, 12.8, 9)
"""Noise that grows over that of one size, both over the whole record, between which the mode is sought."""
_STENCIL = 0.1


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

    @property
    def found(self) -> bool:
        """Whether it is more probable than not."""
        return self.log_odds > 0.0


def find_noise_growth(
    effect: GrowingNoiseEffect,
    regression: LawRegression,
    posterior: Posterior,
    path: MeasuredPath,
    order: int,
    w0: float,
    prior: Prior,
) -> NoiseGrowth:
    """Noise that grows, with its evidence over noise of one size.

    Parameters
    ----------
    effect : GrowingNoiseEffect
    regression : LawRegression
        The record, with noise of one size.
    posterior : Posterior
        Of its random force.
    path : MeasuredPath
    order : int
        Derivative that is measured.
    w0 : float
        Frequency of the natural units [rad/s].
    prior : Prior
        Log-normal, of the size in one value.
    """
    clock, best = regression.clock, posterior.best
    chosen = regression.sets[best.chosen]
    reference = regression.reference[chosen]
    scaled = (regression.columns * regression.scale)[:, chosen]
    block = np.column_stack([scaled, regression.target - scaled @ reference])
    # errors at a jump of the acceleration are not errors of time
    rate = (path.v, np.gradient(path.v, path.phase), -path.slope * path.v)[order]
    signal = path.reading(order, path.x, path.v)
    growth = effect.grows_with(signal, w0 * rate)
    mean_square = float(np.mean(growth**2))

    def clock_at(ratio: float) -> Clock:
        return replace(clock, variance=clock.variance * (1.0 + (ratio * growth) ** 2))

    def log_weight(clock: Clock, spread: float) -> tuple[float, float]:
        found = evaluate_sets(
            whiten(block, clock, regression.row, best.ratio * spread, best.tau),
            reference,
            regression.positive[chosen],
            np.ones((1, reference.size), dtype=np.bool_),
            np.zeros(1),
            least_noise2=regression.least_noise**2,
        )
        return float(found.log_weight[0]), math.sqrt(found.noise2[0])

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
