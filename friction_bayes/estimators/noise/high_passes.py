"""The corner of a high pass that a record went through, by what that makes of the motion.

White noise is almost white behind it too, so that no spectrum shows it. But the motion behind it, with what
it remembers of the time before the record, fits the samples, and the motion itself does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import logsumexp, softmax

from friction_bayes.core.arrays import Array
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.estimators.noise.filter_evidence import LOOKED_AT, drift_and_swing, least_squares_residual
from friction_bayes.estimators.noise.recording_filters import (
    FILTERED,
    FilterKind,
    RecordingFilter,
    Through,
    kinds_for,
    margin,
)

__all__ = ["Likelihood", "MotionBehind", "filters_near", "likeliest_corner", "likely_high_passes"]

Likelihood = Callable[[RecordingFilter | None], float]
"""Logarithm of the likelihood of a record behind a filter, or none."""

_MOST_MEMORY = 2
"""Coefficients of what a high pass remembers of the time before."""
_TRIED = 16
"""Corners among which the most likely is found: as densely as a hump of the likelihood is wide."""
_STEP = 0.01
"""Relative distance of corners over which a likelihood is a parabola."""
_FAR = 5.0
"""Standard deviations within which the law and a swing that varies have their most likely corners."""
_NODES = np.arange(-2.0, 2.5)
"""Corners that stand for all, in standard deviations from the most likely."""


class MotionBehind:
    """The likelihood of a record of a motion in white noise, behind a high pass or none.

    A drift, and a swing that varies along the record in place of other forces than dry friction, are fitted
    beside the columns, or what else is ``always`` there. Of a long record the first samples count.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Evenly spaced samples, nan where one does not count.
    known : ndarray, shape (n,)
        What of them has no coefficient.
    columns : ndarray, shape (n, p)
        Of the motion; without its rest position, which a high pass removes.
    angle : float
        Of the motion [rad/sample].
    always : ndarray, shape (q, n), optional
        Rows that go through no filter.
    """

    def __init__(
        self, signal: Array, known: Array, columns: Array, angle: float, always: Array | None = None
    ) -> None:
        self.angle, left_out = angle, margin(angle)
        signal, known, columns = (each[:LOOKED_AT] for each in (signal, known, columns))
        self._inner = np.isfinite(signal)
        self._inner[:left_out] = self._inner[signal.size - left_out :] = False
        self._signal, self._motion = signal, np.column_stack([columns, known])
        self._through = Through(self._motion)
        self._always = drift_and_swing(signal.size, angle) if always is None else always[:, :LOOKED_AT]

    def left(self, filter_: RecordingFilter | None) -> Array:
        """Residual behind a filter, or none, at the samples that count."""
        shown, inner = self._motion.T if filter_ is None else self._through.rows(filter_), self._inner
        rows = np.vstack([self._always, shown[:-1], *self._memory(filter_)])[:, inner]
        return least_squares_residual((self._signal - shown[-1])[inner], rows)[0]

    def _memory(self, filter_: RecordingFilter | None) -> list[Array]:
        return [] if filter_ is None else [filter_.memory(self._signal.size).T]

    def __call__(self, filter_: RecordingFilter | None) -> float:
        """Logarithm of the likelihood behind a filter, or none."""
        left, memory = self.left(filter_), sum(map(len, self._memory(filter_)))
        freedom = left.size - self._rows - memory
        return -0.5 * freedom * math.log(float(left @ left)) - 0.5 * memory * math.log(left.size)

    @property
    def _rows(self) -> int:
        return len(self._always) + self._motion.shape[1] - 1

    @property
    def determined(self) -> bool:
        """Whether the samples that count are enough to show what a filter does: twice the coefficients."""
        return int(np.count_nonzero(self._inner)) >= 2 * (self._rows + _MOST_MEMORY)


def likely_high_passes(log_likelihood: MotionBehind, order: int) -> list[tuple[float, RecordingFilter]]:
    """High passes that a record rather went through than none, with their shares, the most probable first.

    Given the order of the derivative that is measured. None where what is left is not white.
    """
    if not log_likelihood.determined:
        return []
    found = []
    for kind in kinds_for(log_likelihood.angle, order):
        if kind.high_pass and kind.sizes.size:
            corner, sd = likeliest_corner(kind, log_likelihood)
            found += filters_near(kind, corner, sd, log_likelihood)
    values = np.array([each.log_prior + log_likelihood(each) for each in found])
    if not found or logsumexp(values) < math.log1p(-FILTERED) + log_likelihood(None):
        return []
    shares = softmax(values)
    if not whiteness(log_likelihood.left(found[int(np.argmax(values))])).white:
        return []
    return [(float(shares[k]), found[k]) for k in np.argsort(-shares) if shares[k] > 0.0]


def likeliest_corner(
    kind: FilterKind, log_likelihood: Likelihood, near: float | None = None
) -> tuple[float, float]:
    """The corner [rad/sample] of a kind behind which a record is most likely, and its relative sd.

    It is ``near`` one where that is given, as along much the same motion.
    """
    low, high = (math.log(each) for each in kind.sizes[[0, -1]])
    tried = np.linspace(low, high, _TRIED)
    if near is None:
        values = [log_likelihood(_of_known(kind, math.exp(each))) for each in tried]
        near = math.exp(tried[np.argmax(values)])
    return _peak(kind, log_likelihood, math.log(near), tried[1] - tried[0])


def filters_near(
    kind: FilterKind, corner: float, sd: float, log_likelihood: Likelihood
) -> list[RecordingFilter]:
    """Filters about the most likely one near a corner, that known to an sd, equally far apart.

    Each with the prior probability of all those that it represents.
    """
    best, sd = _peak(kind, log_likelihood, math.log(corner), _FAR * sd)
    corners = best * np.exp(sd * _NODES)
    low, high = kind.sizes[[0, -1]]
    log_prior = math.log(kind.prior * sd / math.log(high / low))
    found = [_of_known(kind, each) for each in corners[(corners >= low) & (corners <= high)].tolist()]
    return [replace(each, log_prior=log_prior) for each in found]


def _of_known(kind: FilterKind, corner: float) -> RecordingFilter:
    """The filter of a kind whose corner is known: without its first doubt, which is of the corner."""
    filter_ = kind.of(corner)
    return replace(filter_, doubts=filter_.doubts[1:])


def _peak(kind: FilterKind, log_likelihood: Likelihood, near: float, within: float) -> tuple[float, float]:
    """The most likely corner near one, a logarithm, and its relative sd, that of a normal density there."""
    low, high = (math.log(each) for each in kind.sizes[[0, -1]])

    def loss(log_corner: float) -> float:
        return -log_likelihood(_of_known(kind, math.exp(log_corner)))

    between = max(near - within, low), min(near + within, high)
    best = minimize_scalar(loss, bounds=between, method="bounded", options={"xatol": _STEP})
    below, above = loss(best.x - _STEP), loss(best.x + _STEP)
    bend = below + above - 2.0 * best.fun
    if bend <= 0.0:
        return math.exp(best.x), 0.5 * within
    top = min(max(best.x + 0.5 * _STEP * (below - above) / bend, between[0]), between[1])
    return math.exp(top), min(_STEP / math.sqrt(bend), 0.5 * within)
