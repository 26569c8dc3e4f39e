"""The corner of a high pass that a record went through, by what that makes of the motion.

White noise is almost white behind it too, so that no spectrum shows it. But the motion behind it, with what
it remembers of the time before the record, fits the samples, and the motion itself does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp, softmax

from friction_bayes.core.arrays import Array
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.estimators.noise.filter_evidence import LOOKED_AT, drift_and_swing, least_squares_residual
from friction_bayes.estimators.noise.recording_filters import (
    FilterKind,
    RecordingFilter,
    Through,
    kinds_for,
    log_prior_of_no_high_pass,
    margin,
)

__all__ = [
    "Likelihood",
    "MotionBehind",
    "filters_of",
    "likely_high_passes",
    "of_known",
]

Likelihood = Callable[[RecordingFilter], float]
"""Logarithm of the likelihood of a record behind a filter."""

_MOST_MEMORY = 2
"""Coefficients of what a high pass remembers of the time before."""
_TRIED, _NEAR, _ZOOMS = 16, 7, 4
"""Corners all over the range of a kind, as densely as a hump of the likelihood is wide, those tried about the
likeliest of them, and how often, each time three times as densely: to a third of a per cent."""
_COUNTS, _MANY = -4.0, 4
"""Log likelihood, less that of the likeliest, from which a corner counts, and how many stand for all."""


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
    in_time : bool
        Whether the motion was found behind such a filter, and is in its own time.
    """

    def __init__(
        self,
        signal: Array,
        known: Array,
        columns: Array,
        angle: float,
        always: Array | None = None,
        *,
        in_time: bool = False,
    ) -> None:
        self.angle, self._in_time, left_out = angle, in_time, margin(angle)
        signal, known, columns = (each[:LOOKED_AT] for each in (signal, known, columns))
        self._inner = np.isfinite(signal)
        self._inner[:left_out] = self._inner[signal.size - left_out :] = False
        self._signal, self._motion = signal, np.column_stack([columns, known])
        self._always = drift_and_swing(signal.size, angle) if always is None else always[:, :LOOKED_AT]

    @cached_property
    def _through(self) -> Through:
        return Through(self._motion)

    def left(self, filter_: RecordingFilter | None) -> Array:
        """Residual behind a filter, or none, at the samples that count."""
        shown, inner = self._motion.T, self._inner
        if filter_ is not None:
            shown = self._through.rows(replace(filter_, in_time=self._in_time))
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
            found += filters_of(kind, log_likelihood)
    values = np.array([each.log_prior + log_likelihood(each) for each in found])
    if not found or logsumexp(values) < log_prior_of_no_high_pass(order) + log_likelihood(None):
        return []
    shares = softmax(values)
    if not whiteness(log_likelihood.left(found[int(np.argmax(values))])).white:
        return []
    return [(float(shares[k]), found[k]) for k in np.argsort(-shares) if shares[k] > 0.0]


def filters_of(
    kind: FilterKind,
    log_likelihood: Likelihood,
    *,
    least: float = -math.inf,
    closer: Callable[[float], None] = lambda _: None,
) -> list[RecordingFilter]:
    """Filters that stand for all of a kind, each with the prior probability of those that it represents.

    Of corners all over its range, or ever closer about the likeliest until several of them count. The
    likeliest comes first.

    Parameters
    ----------
    kind : FilterKind
    log_likelihood : callable
    least : float
        Log likelihood below which there is none, of all over the range.
    closer : callable, corner [rad/sample] -> None
        What is done before corners near one are compared.
    """
    low, high = kind.sizes[[0, -1]].tolist()
    corners = np.geomspace(low, high, _TRIED)
    for zoom in range(_ZOOMS + 1):
        values = np.array([log_likelihood(of_known(kind, corner)) for corner in corners.tolist()])
        if zoom == 0 and values.max() < least:
            return []
        apart, counts = math.log(corners[1] / corners[0]), values > values.max() + _COUNTS
        if np.count_nonzero(counts) >= _MANY or zoom == _ZOOMS:
            break
        best = float(corners[np.argmax(values)])
        if zoom == 0:
            closer(best)
        corners = best * np.exp(apart * np.linspace(-1.0, 1.0, _NEAR))
        corners = corners[(corners > low * math.exp(-0.5 * apart)) & (corners < high * math.exp(0.5 * apart))]
    log_prior = math.log(kind.prior * apart / math.log(high / low))
    likely = [k for k in np.argsort(-values).tolist() if counts[k]]
    return [replace(of_known(kind, float(corners[k])), log_prior=log_prior) for k in likely]


def of_known(kind: FilterKind, corner: float) -> RecordingFilter:
    """The filter of a kind whose corner is known: without its first doubt, which is of the corner."""
    filter_ = kind.of(corner)
    return replace(filter_, doubts=filter_.doubts[1:])
