r"""The filter that a record went through, by its effect on noise and corners.

Each filter is compared with the samples by the law behind it, fitted by least squares, and the spectrum of
its residual,

.. math:: S(\omega) = a (|H(\omega)|^2 + \rho),

``H`` the response of the filter, ``rho`` white noise added after it. The alternatives leave amplitudes
unfiltered: noise of any other colour, an autoregression; white noise and the spectrum of an oscillator under
a random force; integrated noise. Each has corners as dry friction makes them or of any shape. Spectra are of
several orthogonal tapers (Thomson, Proceedings of the IEEE 70, 1982), whose sidelobes are low enough for the
zeros of a filter; the likelihood is Whittle's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.fft import rfft
from scipy.linalg import eigh_tridiagonal
from scipy.special import expit

from friction_bayes.core.arrays import Array
from friction_bayes.estimators.noise.recording_filters import (
    FilterKind,
    RecordingFilter,
    Through,
    kinds_for,
    margin,
)
from friction_bayes.statespace.coloured_noise import burg
from friction_bayes.statespace.regression import near_least_squares

__all__ = ["likely_filters"]

_LOOKED_AT = 4096
"""Least number of samples in which filters are looked for."""
_BANDWIDTH, _TAPERS = 4.0, 4
"""Of the spectral estimate, in cycles a record, and how many tapers have it: those that leak less than 1e-4
of their energy beyond it, for the noise at the zeros of a filter is no more than that."""
_ABOVE = 2.0
"""Frequency over the motion's from which on spectra are compared: below, the fit takes from the noise."""
_LATER = np.geomspace(1e-8, 1.0, 25)
"""Equally probable variances of noise that came after a filter, over that which went through it."""
_TIMES = np.geomspace(0.05, 20.0, 10)
"""Correlation times of a random force, as phases of the motion."""
_INTEGRATED = (2, 4)
"""Powers of the spectrum of noise that was integrated once or twice, by trapezoids."""
_STRIDE, _FIRST = 1.12, 4
"""Ratio of the sizes among which the best is found: the evidence has humps that are wider. Of filters without
zeros it has one, and every fourth is tried first."""
_MOST, _MUCH_LESS = 6, 0.05
"""Largest number of filters reported, and least probability of each over that of the first."""
_DRIFT = 2
"""Degree of the polynomial by which the zero of a recording may drift, as of one that was integrated."""
_SWINGS = 4
"""The same of the amplitude of the swing, by which a force moves it: what is left there would leak above."""
_PRIOR = 0.01
"""Prior probability that noise which is not white was filtered in one of the ways known here."""


def likely_filters(
    signal: Array, known: Array, columns: Array, free_columns: Array, angle: float, order: int
) -> tuple[list[tuple[float, RecordingFilter]], float]:
    """The filter that a record most likely went through, and the probability that there was one.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Evenly spaced samples, nan where one is missing.
    known : ndarray, shape (n,)
        What of them has no coefficient.
    columns : ndarray, shape (n, p)
        Of the law, which describes the rest but for noise.
    free_columns : ndarray, shape (n, q)
        The same, and what describes corners of any shape.
    angle : float
        Of the motion [rad/sample].
    order : int
        Of the derivative measured.

    Returns
    -------
    list of (float, RecordingFilter)
        The most probable ones, the first of them most, with their probabilities among themselves; none where
        the record is too short to decide.
    float
    """
    kinds = kinds_for(angle)
    n, left_out = min(signal.size, _LOOKED_AT), margin(angle)
    if n < 8 * left_out:
        return [], 0.0
    inner = slice(left_out, n - left_out)
    spectra = _Spectra(n - 2 * left_out, angle, order)
    if spectra.empty:
        return [], 0.0
    others = [spectra.of_others((signal - known)[inner], each[inner].T) for each in (columns, free_columns)]
    log_other = math.log(0.5 * (1.0 - _PRIOR)) + _log_sum(others)
    through = Through(np.column_stack([columns, known])[:n])
    found: list[tuple[float, RecordingFilter]] = []
    for kind in kinds:
        log_prior = math.log(_PRIOR / len(kinds) / kind.sizes.size)
        found += _of_kind(kind, log_prior, lambda each: spectra.behind(signal[inner], through, inner, each))
    found.sort(key=lambda each: -each[0])
    log_filtered = _log_sum([log_evidence for log_evidence, _ in found])
    likely = [each for each in found[:_MOST] if each[0] > found[0][0] + math.log(_MUCH_LESS)]
    share = np.exp(np.array([each[0] for each in likely]) - _log_sum([each[0] for each in likely]))
    filters = [filter_ for _, filter_ in likely]
    return list(zip(share.tolist(), filters, strict=True)), float(expit(log_filtered - log_other))


def _of_kind(
    kind: FilterKind, log_prior: float, log_evidence: Callable[[RecordingFilter], float]
) -> list[tuple[float, RecordingFilter]]:
    """Filters of a kind with their log evidence: some of all sizes, and all near the best of these."""
    filters = [replace(kind.of(float(size)), log_prior=log_prior) for size in kind.sizes]
    known: dict[int, float] = {}

    def best_of(sizes: Iterable[int]) -> int:
        known.update({i: log_prior + log_evidence(filters[i]) for i in sizes if i not in known})
        return max(known, key=known.__getitem__)

    tried = _spread(kind.sizes)
    step = 1 if kind.has_zeros else _FIRST
    best = best_of([*tried[::step], tried[-1]])
    while step > 1:
        step //= 2
        place = tried.index(best)
        best = best_of(tried[each] for each in (place - step, place + step) if 0 <= each < len(tried))
    place = tried.index(best)
    best_of(range(tried[max(place - 1, 0)], tried[min(place + 1, len(tried) - 1)] + 1))
    return [(value, filters[i]) for i, value in known.items()]


def _spread(sizes: Array) -> list[int]:
    """Places of sizes whose ratio is that of neighbours or :data:`_STRIDE`, whichever is more."""
    count = math.ceil(math.log(sizes[-1] / sizes[0]) / math.log(_STRIDE)) + 1
    wanted = np.geomspace(sizes[0], sizes[-1], count)
    return sorted({int(np.argmin(np.abs(sizes - each))) for each in wanted})


class _Spectra:
    """Likelihoods of the residuals of fits of so many samples, by their spectra."""

    def __init__(self, n: int, angle: float, order: int) -> None:
        self._n = n
        place, phase = np.linspace(-1.0, 1.0, n), angle * np.arange(n)
        swings = np.polynomial.legendre.legvander(place, _SWINGS)
        self._slow = np.hstack(
            [
                np.polynomial.legendre.legvander(place, _DRIFT),
                swings * np.cos(phase)[:, None],
                swings * np.sin(phase)[:, None],
            ]
        ).T
        # estimates that share no taper's main lobe are independent
        stride = int(2 * _BANDWIDTH)
        index = np.arange(stride, n // 2 - stride // 2, stride)
        omega = 2.0 * math.pi * index / n
        # the transform at multiples of a frequency is that of as many parts of the samples added up
        parts = math.gcd(n, stride)
        index //= parts
        self._tapers = _tapers(n).reshape(_TAPERS, parts, -1)
        above = omega > _ABOVE * angle
        self._index, self._omega = index[above], omega[above]
        phase = self._omega / angle
        resonance = phase ** (2 * order) / (phase * phase - 1.0) ** 2
        integrator = math.tan(0.5 * _ABOVE * angle) / np.tan(0.5 * self._omega)
        self._others = [np.ones_like(phase)]
        self._others += [resonance / (1.0 + (phase * tau) ** 2) for tau in _TIMES]
        self._others += [integrator**power for power in _INTEGRATED]

    @property
    def empty(self) -> bool:
        """Whether the samples are too few or too far apart to show any frequency far above the motion's."""
        return self._index.size == 0

    def of_others(self, signal: Array, rows: Array) -> float:
        """Log evidence of noise that leaves amplitudes unfiltered, averaged over its kinds."""
        left = self._left(signal, rows)
        colour, _ = burg(left, len(rows))
        power = self._power(left)
        own = float(self._log_likelihood(power, colour.spectrum(self._omega)[None])[0]) - colour.penalty
        kinds = [own, *(self._averaged(power, shape) for shape in self._others)]
        return _log_sum(kinds) - math.log(len(kinds)) - self._price(len(rows))

    def behind(self, signal: Array, through: Through, inner: slice, filter_: RecordingFilter) -> float:
        """Log evidence of a filter; the last row that goes through it is known."""
        shown = through.rows(filter_)
        rows = np.vstack([shown[:-1], filter_.memory(shown.shape[1]).T])[:, inner]
        left = self._left(signal - shown[-1, inner], rows)
        response = np.abs(filter_.response(self._omega)) ** 2
        return self._averaged(self._power(left), response) - self._price(len(rows))

    def _left(self, signal: Array, rows: Array) -> Array:
        """Residual of a signal after rows, a drifting zero and a swing of varying amplitude and phase."""
        both = np.vstack([rows, self._slow, signal])
        known = np.isfinite(signal)
        if not known.all():
            both = both[:, known]
        left = both[-1] - near_least_squares(both @ both.T) @ both[:-1]
        return left if known.all() else np.interp(np.arange(signal.size), np.flatnonzero(known), left)

    def _price(self, coefficients: int) -> float:
        """Penalty for fitted coefficients, by the Bayesian information criterion."""
        return 0.5 * coefficients * math.log(self._n)

    def _power(self, left: Array) -> Array:
        parts = np.einsum("kij,ij->kj", self._tapers, left.reshape(self._tapers.shape[1:]))
        power = np.abs(rfft(parts)[:, self._index]) ** 2
        return np.asarray(power.mean(axis=0))

    def _averaged(self, power: Array, shape: Array) -> float:
        """Log likelihood of a shape, (frequencies,), averaged over white noise that came later."""
        return _log_sum(self._log_likelihood(power, shape + _LATER[:, None])) - math.log(_LATER.size)

    def _log_likelihood(self, power: Array, shapes: Array) -> Array:
        """For spectra of these shapes, (m, frequencies), the level of each fitted."""
        level = np.mean(power / shapes, axis=1, keepdims=True)
        return np.asarray(-_TAPERS * np.sum(np.log(level * shapes) + 1.0, axis=1))


@lru_cache(maxsize=1)
def _tapers(n: int) -> Array:
    """Orthogonal tapers, shape (tapers, n), that leak least beyond the bandwidth (Slepian, 1978)."""
    place = 0.5 * (n - 1) - np.arange(n)
    after = np.arange(1, n)
    diagonal = place**2 * math.cos(2.0 * math.pi * _BANDWIDTH / n)
    _, vectors = eigh_tridiagonal(
        diagonal, 0.5 * after * (n - after), select="i", select_range=(n - _TAPERS, n - 1)
    )
    return np.asarray(vectors.T)


def _log_sum(logarithms: Sequence[float] | Array) -> float:
    """Logarithm of the sum of a few numbers: SciPy's spends more time on its arguments than on the sum."""
    return float(np.logaddexp.reduce(logarithms))
