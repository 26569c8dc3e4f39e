"""The law behind high passes of likely corners, each along the motion that the record shows through it.

A high pass takes the motion to be earlier than it was, the corners and jumps of dry friction less so. Along
one and the same path every corner but its own is improbable: corners are compared along their own motions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
from scipy.special import logsumexp, softmax

from friction_bayes.decay.whiteness import whiteness
from friction_bayes.estimators.noise.coulomb_regression import Laid
from friction_bayes.estimators.noise.high_passes import filters_of, of_known
from friction_bayes.estimators.noise.recording_filters import (
    FilterKind,
    RecordingFilter,
    kinds_for,
    log_prior_of_no_high_pass,
)

__all__ = ["behind_high_passes", "likelier_high_passes"]

_FIRST, _MOST_MOTIONS = 2, 8
"""Motions behind a filter, each along that before: to compare corners far apart, and at most."""
_WITHIN = 0.3
"""Distance, of logarithms, of corners from one that are near it: that between those tried first."""
_SAME = 1e-6, 0.1
"""Phase by which turning points of two of them differ where they agree: at least, and over its sd."""


def behind_high_passes(laid: Laid) -> Iterator[tuple[str, list[tuple[RecordingFilter, Laid]]]]:
    """Kinds of high passes, filters of each of likely corners, and the regressions behind these."""
    for kind, own, filters in _likely(laid, laid):
        yield kind.name, [(each, own.behind(each)) for each in filters]


def likelier_high_passes(laid: Laid, other: Laid) -> list[tuple[float, RecordingFilter, Laid]]:
    """High passes that a record rather went through than that another law of it holds behind none.

    With their shares, the most probable first, and the regressions behind them. None where what is left
    behind the most probable is not white.
    """
    found = [(each, own) for _, own, filters in _likely(laid, other) for each in filters]
    values = np.array([each.log_prior + own.log_evidence(each) for each, own in found])
    none = log_prior_of_no_high_pass(laid.order) + _log_evidence(other)
    if not found or logsumexp(values) < none:
        return []
    order, shares = np.argsort(-values).tolist(), softmax(values).tolist()
    behind = [(shares[k], found[k][0], found[k][1].behind(found[k][0])) for k in order]
    return behind if _leaves_white_noise(behind[0][2]) else []


def _leaves_white_noise(laid: Laid) -> bool:
    regression = laid.regression
    left = regression.residual(laid.without_force().best_law())
    return whiteness(left[regression.clock.used]).white


def _likely(laid: Laid, other: Laid) -> Iterator[tuple[FilterKind, _OwnMotions, list[RecordingFilter]]]:
    """Kinds of high passes with likelier corners than another law, the motions behind them, and filters."""
    if not laid.regression.clock.even or not laid.motion_behind().determined:
        return
    least = _log_evidence(other)
    for kind in kinds_for(laid.path.angle, laid.order):
        if kind.high_pass and kind.sizes.size:
            own = _OwnMotions(laid)
            closer = partial(own.compare_near, kind)
            filters = filters_of(kind, own.log_evidence, least=least, closer=closer)
            if filters:
                yield kind, own, filters


def _log_evidence(laid: Laid) -> float:
    """Without a random force, of as many samples along any motion: none is less probable than the others."""
    used = laid.regression.clock.used
    return float(laid.without_force().log_evidence) * used.size / int(np.count_nonzero(used))


class _OwnMotions:
    """The regressions behind high passes of one kind, each along its own motion.

    Along one near that, which a few steps lead to, until corners near each other are compared.
    """

    def __init__(self, laid: Laid) -> None:
        self._laid = laid
        self._by_delay = {0.0: laid}
        self._variance = np.zeros(laid.signal.size)
        self._motions = _FIRST

    def behind(self, filter_: RecordingFilter) -> Laid:
        """The regression behind one."""
        return self._path(filter_).behind(filter_)

    def _path(self, filter_: RecordingFilter) -> Laid:
        delay = filter_.delay
        path = self._by_delay[min(self._by_delay, key=lambda each: abs(each - delay))]
        for _ in range(self._motions):
            before, path = path, path.seen_through(filter_)
            if self._agree(before, path):
                break
        self._by_delay[delay] = path
        return path

    @staticmethod
    def _agree(one: Laid, other: Laid) -> bool:
        """Whether two motions turn at the same times."""
        mine, its, path = one.path.turning / one.frequency, other.path.turning / other.frequency, other.path
        phase_sd = float(np.max(path.v_sd / np.hypot(path.x, path.v)))
        same = max(_SAME[0], _SAME[1] * phase_sd) / other.frequency
        return mine.size == its.size and bool(np.all(np.abs(mine - its) < same))

    def compare_near(self, kind: FilterKind, corner: float) -> None:
        """Compare filters near a corner on samples that are far from a turning point behind any of them."""
        self._motions = _MOST_MOTIONS
        low, middle, high = (
            self._path(of_known(kind, corner * math.exp(away))) for away in (-_WITHIN, 0.0, _WITHIN)
        )
        between = (low.path.v > 0.0) != (high.path.v > 0.0)
        jumps = between & (self._laid.order == 2)
        near = [each.regression.clock.variance for each in (low, middle, high)]
        self._variance = np.maximum.reduce([*near, np.where(jumps, np.inf, 0.0)])

    def log_evidence(self, filter_: RecordingFilter) -> float:
        """Of the law behind one."""
        behind = self.behind(filter_)
        variance = np.maximum(behind.regression.clock.variance, self._variance)
        return _log_evidence(behind.with_variance(variance))
