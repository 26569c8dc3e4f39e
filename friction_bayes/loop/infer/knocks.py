"""A force that comes once: a knock, a touch, a rope that slips.

It requires jumps of the force larger than the random force makes anywhere else
(:func:`friction_bayes.statespace.kalman.jump_scores`). In those few intervals the force may then jump freely,
so that the rest of the record determines the random force. Jumps that come more often are the machine's and
not excluded: they are tested with the residuals of a law.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.kalman import jump_scores
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.smoother import SmoothedMotion

__all__ = ["jump_tails", "log_odds_of_knocks", "next_knock", "spans_of"]

_BESIDE = 1
"""Samples on either side of it that contain the jump of friction too."""
_FEWEST = 20.0
"""Least number of independent scores for a test of the tails of their distribution."""


def next_knock(regression: LawRegression, law: Array, best: GridPoint, friction: float) -> Array | None:
    """How far the force may jump in each interval, over the noise, with one more knock; shape (n - 1,).

    Nowhere if that is one too many; None where there is no other. The clock of the ``regression`` says where
    the force may jump already, and ``friction``, natural units, alone explains the loss of amplitude.
    """
    clock = regression.clock
    known = clock.jumps
    motion = regression.smoothed(law, best)
    if _lasts(motion.states[:, 2], clock.phase, spans_of(known)):
        return np.zeros_like(known)
    scores = _scores(regression, law, best)
    place = int(np.argmax(np.where(_near_turns(regression, motion), 0.0, np.abs(scores))))
    if scores.size * 2.0 * float(stats.norm.sf(abs(scores[place]))) > settings.SETTINGS.false_alarm_rate:
        return None
    same = scores / scores[place] > settings.SETTINGS.knock_part
    first = place - int(np.argmin(same[place::-1])) + 1
    # one more: the force goes back
    last = min(place + int(np.argmin(np.append(same[place:], False))), scores.size - 1)
    jumps = known.copy()
    jumps[max(first - 1, 0) : last] = settings.SETTINGS.knock_frictions * friction / best.noise
    jumps = _joined(jumps, clock.phase)
    spans = spans_of(jumps)
    longest = max(clock.phase[b] - clock.phase[a] for a, b in spans)
    if len(spans) > settings.SETTINGS.most_at_once or longest > settings.SETTINGS.longest_knock:
        return np.zeros_like(known)
    return jumps


def _joined(jumps: Array, phase: Array) -> Array:
    """The jumps, with spans joined that together last no longer than one knock.

    An accelerometer shows the force itself: there only its onset and its end require a jump.
    """
    spans, jumps = spans_of(jumps), jumps.copy()
    for (a, b), (c, d) in pairwise(spans):
        if phase[d] - phase[a] <= settings.SETTINGS.longest_knock:
            jumps[b:c] = jumps[a]
    return jumps


def _lasts(force: Array, phase: Array, spans: list[tuple[int, int]]) -> bool:
    """Whether a force comes at one span and goes at the next: one that lasts too long for a knock."""
    for (a, b), (c, d) in pairwise(spans):
        held = float(np.mean(force[b : c + 1]))
        rise, fall = held - force[a], held - force[d]
        largest = float(np.max(np.abs(force[a : d + 1] - force[a])))
        comes_and_goes = rise * fall > 0.0 and min(abs(rise), abs(fall)) > 0.5 * largest
        if comes_and_goes and phase[d] - phase[a] > settings.SETTINGS.longest_knock:
            return True
    return False


def spans_of(jumps: Array) -> list[tuple[int, int]]:
    """First and last sample of each run of intervals, shape (n - 1,), in which the force may jump."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], jumps > 0.0, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def log_odds_of_knocks(jumps: Array) -> float:
    """Logarithm of the prior odds of knocks, each at one of all intervals and as probable as none."""
    return -len(spans_of(jumps)) * math.log(jumps.size)


def jump_tails(regression: LawRegression, law: Array, best: GridPoint) -> tuple[float, float, float]:
    """Whether the jumps of a random force are larger than those of a normal one.

    Their kurtosis, for how many independent scores, and the probability of as much (Anscombe and Glynn,
    1983); 3, 0 and 1 where there is no random force. Neighbouring scores are correlated; the equivalent
    number of independent ones has the same variance (of a sum of fourth powers: ``n / sum rho**4``).
    """
    if best.ratio == 0.0:
        return 3.0, 0.0, 1.0
    near_turns = _near_turns(regression, regression.smoothed(law, best))
    scores = _scores(regression, law, best)
    scores = scores[(scores != 0.0) & ~near_turns]
    power = np.abs(np.fft.rfft(scores - scores.mean(), 2 * scores.size)) ** 2
    alike = np.fft.irfft(power)[: scores.size]
    n = scores.size / (1.0 + 2.0 * float(np.sum((alike[1:] / alike[0]) ** 4)))
    kurtosis = float(np.mean(scores**4) / np.mean(scores**2) ** 2)
    if n < _FEWEST:
        return kurtosis, n, 1.0
    return kurtosis, n, _p_value_of_kurtosis(kurtosis, n)


def _scores(regression: LawRegression, law: Array, best: GridPoint) -> Array:
    """Standardised scores of a jump before each sample, zero where it may jump already, shape (n,)."""
    clock = regression.clock
    scores = jump_scores(regression.residual(law), clock, regression.row, best.ratio, best.tau) / best.noise
    scores[:1] = 0.0
    scores[1:][clock.jumps > 0.0] = 0.0
    return scores


def _near_turns(regression: LawRegression, motion: SmoothedMotion) -> Mask:
    """Samples at which friction may have either direction and the sensor shows the force, shape (n,).

    There an accelerometer shows a jump that is not of the random force.
    """
    velocity = motion.states[:, 1]
    if not np.any(regression.row[..., 2]):
        return np.zeros(velocity.size, np.bool_)
    doubtful = np.abs(velocity) < settings.SETTINGS.far * motion.velocity_sd
    return np.convolve(doubtful, np.ones(2 * _BESIDE + 1), "same") > 0.0


def _p_value_of_kurtosis(kurtosis: float, n: float) -> float:
    """Probability of as large a kurtosis of ``n`` normal numbers (Anscombe and Glynn, Biometrika 70, 227)."""
    mean = 3.0 * (n - 1.0) / (n + 1.0)
    variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0) ** 2 * (n + 3.0) * (n + 5.0))
    skew = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0))
    skew *= math.sqrt(6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0)))
    a = 6.0 + 8.0 / skew * (2.0 / skew + math.sqrt(1.0 + 4.0 / skew**2))
    x = (kurtosis - mean) / math.sqrt(variance)
    below = 1.0 + x * math.sqrt(2.0 / (a - 4.0))
    root = math.copysign(abs((1.0 - 2.0 / a) / below) ** (1.0 / 3.0), below)
    z = (1.0 - 2.0 / (9.0 * a) - root) / math.sqrt(2.0 / (9.0 * a))
    return float(stats.norm.sf(z))
