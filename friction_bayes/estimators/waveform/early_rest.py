"""The end of a decay whose mass rests earlier than the fit says, as it breaks away at more than it slides.

By Coulomb friction it rests where the spring pulls with less than friction. Friction at rest may be larger,
and hold it from an earlier turning point on. The samples after one are then at a constant level; or they are
what the fit says, about any level; or they move on in another way, along any smooth curve
(:mod:`friction_bayes.estimators.noise.smooth_curve`), as under a law that the fit lacks.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.estimators.base import Fit
from friction_bayes.estimators.noise.smooth_curve import (
    LOG_ODDS_NOT_FREE,
    curve_degrees,
    log_density_of_curve,
)

__all__ = ["may_rest_early", "until_rest"]

_MOST_EARLIER = 3
"""Half cycles by which it may come earlier, each as probable: friction at rest is then seven times that of
sliding.
"""
_FEWEST = 3
"""Half cycles of a decay, and samples at rest."""


def until_rest(decay: FreeDecay, fit: Fit) -> FreeDecay:
    """The decay up to where its mass rather rests, itself where its fit by ``waveform`` says so."""
    if not may_rest_early(decay) or fit.prediction is None or fit.motion is None:
        return decay
    left, about_rest = decay.values - fit.prediction, decay.values - fit.rest_position
    noise = _noise(decay.values, left)
    turns = np.flatnonzero(np.diff(np.sign(fit.motion.states[:, 1])) != 0) + 1
    log_odds = {
        turn: _log_odds(about_rest / noise, left / noise, turn, int(np.sum(turns >= turn)))
        for turn in turns[_FEWEST:][-_MOST_EARLIER - 1 :].tolist()
        if left.size - turn >= _FEWEST and noise > 0.0
    }
    best = max(log_odds, key=lambda turn: log_odds[turn], default=None)
    if best is None or log_odds[best] + LOG_ODDS_NOT_FREE - math.log(_MOST_EARLIER) < 0.0:
        return decay
    return decay.until(best)


def may_rest_early(decay: FreeDecay) -> bool:
    """Whether a decay shows a rest: an accelerometer shows at rest what it shows at any speed."""
    return decay.stops and decay.quantity.order < 2


def _noise(values: Array, left: Array) -> float:
    """Sd of the sensor's noise, at most: what the fit leaves, or the second differences of the samples."""
    second = np.diff(values, 2)
    return math.sqrt(min(float(left @ left) / left.size, float(second @ second) / (6.0 * second.size)))


def _log_odds(about_rest: Array, left: Array, turn: int, half_cycles: int) -> float:
    """Log odds of a constant level from a turn on, against the fit or a motion, in units of the noise.

    The fit may be about another level there, as it misses other losses: what is judged is whether the mass
    moves. And it may be as wrong as before: under a random force it leaves more than noise everywhere.
    """
    level, after = about_rest[turn:], left[turn:]
    amplitude, place = float(np.max(np.abs([level, after]))) + 1.0, np.linspace(-1.0, 1.0, level.size)
    fit = max(
        log_density_of_curve(place, after / sd, amplitude / sd, [0]) - level.size * math.log(sd)
        for sd in (1.0, max(1.0, math.sqrt(float(left[:turn] @ left[:turn]) / turn)))
    )
    degrees = curve_degrees(half_cycles, level.size)
    moves = log_density_of_curve(place, level, amplitude, degrees) if degrees else -math.inf
    return log_density_of_curve(place, level, amplitude, [0]) - max(fit, moves)
