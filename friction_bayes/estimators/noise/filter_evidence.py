r"""The filter that a record went through, by its effect on noise and corners.

Each filter is compared with the samples by the law behind it, fitted by least squares, and the spectrum of
its residual,

.. math:: S(\omega) = a (|H(\omega)|^2 + \rho),

``H`` the response of the filter, ``rho`` white noise added after it. The alternatives leave amplitudes
unfiltered: noise of any other colour, an autoregression; white noise and the spectrum of an oscillator under
a random force. Each has corners as dry friction makes them or of any shape.

Record and columns are first whitened by one autoregression, so that the fit by least squares has the weights
of the noise, and no frequency leaks into another. Spectra are of several orthogonal tapers (Thomson,
Proceedings of the IEEE 70, 1982). The likelihood is Whittle's, with the expectation of each estimate in place
of the spectral density behind a filter (Sykulski et al., Biometrika 106, 2019); what leaves amplitudes
unfiltered has no zeros, and is level enough once whitened.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy.fft import irfft, next_fast_len, prev_fast_len, rfft
from scipy.linalg import eigh_tridiagonal
from scipy.linalg.lapack import dpotrf, dpotrs
from scipy.special import expit, gammainc, softmax

from friction_bayes.core.arrays import Array, Complexes
from friction_bayes.estimators.noise.free_corners import corner_columns
from friction_bayes.estimators.noise.recording_filters import (
    FILTERED,
    FilterKind,
    RecordingFilter,
    Through,
    kinds_for,
    margin,
)
from friction_bayes.estimators.noise.unlisted_filter import Likeness, likeness
from friction_bayes.statespace.coloured_noise import burg, burg_recursion, most_lags, with_missing_drawn
from friction_bayes.statespace.force_grid import humps
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.regression import RIDGE, near_least_squares

__all__ = [
    "IMPROBABLE",
    "LOOKED_AT",
    "FoundFilters",
    "FoundKind",
    "drift_and_swing",
    "filters_along",
    "least_squares_residual",
    "likely_filters",
]

LOOKED_AT = 4096
"""Largest number of samples in which filters are looked for."""
_SMALLEST = 1e-300
"""Least probability that has a logarithm."""
_BANDWIDTH, _TAPERS = 4.0, 4
"""Of the spectral estimate, in cycles a record, and how many tapers have it: those that leak less than 1e-4
of their energy beyond it."""
_LEAKED = 1e-6
"""Of the strongest power, which tapers show far beyond their bandwidth, the same everywhere."""
_AS_DESIGNED = 1e-8
"""The same of the recorded power, down to which filters are as designed: weights are truncated (of a normal
density at four standard deviations) and coefficients rounded."""
_LOBE = int(2 * _BANDWIDTH)
"""Width of a taper's main lobe, in frequencies of the record: estimates that share none are independent."""
_ABOVE = 2.0
"""Frequency over the motion's from which on spectra are compared: below, the fit takes from the noise."""
_LATER = np.append(0.0, np.geomspace(1e-12, 1.0, 25))
"""Equally probable variances of noise that came after a filter, over that which went through it."""
_ROUNDED = _LATER[_LATER <= 0.01]
"""The same of rounding: what is computed is stored with more digits than are noise."""
_TIMES = np.geomspace(0.05, 20.0, 10)
"""Correlation times of a random force, as phases of the motion."""
_STRIDE, _FIRST = 1.12, 4
"""Ratio of the sizes among which the best is found: the evidence has humps that are wider. Of filters without
zeros every fourth is tried first."""
_MOST_GAINED = 50.0
"""What sizes between those of that ratio add at most to a log evidence (23 in 256 kinds of 16 records), and
sizes between some farther apart as the square of that: where it is too little, no finer ones are tried."""
IMPROBABLE = 1e-3
"""Odds of a kind against noise that was not filtered below which no finer ones are tried either: a tenth of
those that an account has."""
_BY_NOISE = 4
"""How many sizes of a filter with zeros are tried: those that the zeros of the noise make most probable."""
_MOST, _MUCH_LESS = 30, 0.05
"""Largest number of filters reported, and least probability of each over that of the first."""
_DRIFT = 2
"""Degree of the polynomial by which the zero of a recording may drift, as of one that was integrated."""
_SWINGS = 4
"""The same of the amplitude of the swing, by which a force moves it: what is left there would leak above."""


class FoundKind(NamedTuple):
    """Filters of a kind that a record may have gone through.

    Attributes
    ----------
    name : str
        Of the kind.
    filters : sequence of (float, RecordingFilter)
        All that were tried, the most probable first, with their log evidence.
    unlisted : sequence of Likeness
        Filters of other kinds that resemble the first.
    """

    name: str
    filters: Sequence[tuple[float, RecordingFilter]]
    unlisted: Sequence[Likeness] = ()

    @property
    def log_evidence(self) -> float:
        """Of the kind."""
        return _log_sum([value for value, _ in self.filters])

    @property
    def log_unlisted(self) -> float:
        """Log evidence of filters of other kinds that resemble it."""
        return _log_sum([-math.inf, *(each.log_evidence for each in self.unlisted)])


@dataclass(frozen=True, eq=False)
class FoundFilters:
    """Filters that a record may have gone through.

    Attributes
    ----------
    kinds : sequence of FoundKind
        The most probable one first.
    log_other : float
        Log evidence of noise that was not filtered.
    """

    kinds: Sequence[FoundKind] = ()
    log_other: float = 0.0

    @property
    def probability(self) -> float:
        """That there was a filter."""
        found = [each for kind in self.kinds for each in (kind.log_evidence, kind.log_unlisted)]
        return float(expit(_log_sum(found) - self.log_other))

    def and_also(self, kinds: Sequence[FoundKind]) -> FoundFilters:
        """The same and more kinds, whose log evidence is over that of noise that was not filtered."""
        more = [
            kind._replace(filters=[(self.log_other + value, filter_) for value, filter_ in kind.filters])
            for kind in kinds
        ]
        return replace(self, kinds=sorted([*self.kinds, *more], key=lambda kind: -kind.log_evidence))

    @property
    def likely(self) -> list[tuple[float, RecordingFilter]]:
        """The most probable filters, the first of them most, with their probabilities among themselves."""
        found = sorted((each for kind in self.kinds for each in kind.filters), key=lambda each: -each[0])
        found = [each for each in found[:_MOST] if each[0] > found[0][0] + math.log(_MUCH_LESS)]
        share = softmax([value for value, _ in found]).tolist() if found else []
        return list(zip(share, (each for _, each in found), strict=True))


def likely_filters(
    signal: Array,
    known: Array,
    columns: Array,
    free_columns: Array,
    angle: float,
    order: int,
    *,
    averaged: Array | None = None,
    only: str | None = None,
) -> FoundFilters:
    """The filters that a record most likely went through; none where it is too short to decide.

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
    averaged : ndarray, shape (n, p), optional
        The columns of the law as means over a step about each sample, where these differ: differences of
        positions have seen on which side of a turning point the motion was between two samples.
    only : str, optional
        Name of the one kind that is compared.
    """
    # what a high pass does is below the frequencies that are compared
    kinds = [kind for kind in kinds_for(angle, order) if not kind.high_pass]
    n, left_out = min(signal.size, LOOKED_AT), margin(angle)
    if n < max(6 * left_out, 2 * left_out + 4 * _LOBE):
        return FoundFilters()
    inner = slice(left_out, n - left_out)
    target = _filled((signal - known)[inner], free_columns[inner].T)
    spectra = _Spectra(target, free_columns[inner].T, angle, order)
    if spectra.empty:
        return FoundFilters()
    others = [spectra.of_others(target, each[inner].T) for each in (columns, free_columns)]
    log_other = math.log(0.5 * (1.0 - FILTERED)) + _log_sum(others)
    through = Through(np.column_stack([columns, known])[:n])
    averages = through if averaged is None else Through(np.column_stack([averaged, known])[:n])
    whitener, filled = spectra.whitener_at(through.omega), spectra.whitened(target + known[inner])

    def behind(filter_: RecordingFilter) -> tuple[Array, float]:
        memory = filter_.memory(inner.stop, spectra.whitener_at(-1j * filter_.settling)).T
        read = (through if filter_.of_noise is None else averages).rows(filter_, whitener)
        shown, unseen = (rows[:, inner][:, -filled.size :] for rows in (read, memory))
        return spectra.behind(filled, shown, unseen)

    def log_evidence(filter_: RecordingFilter) -> float:
        power, price = behind(filter_)
        return spectra.of_response(power, filter_) - price

    def with_unlisted(kind: FoundKind) -> FoundKind:
        nearest = kind.filters[0][1]
        log_like = kind.log_evidence - math.log(len(kinds))
        alike = spectra.likeness(behind(nearest)[0], nearest)
        return kind._replace(
            unlisted=[each._replace(log_evidence=log_like + each.log_evidence) for each in alike]
        )

    found: list[FoundKind] = []
    for kind in kinds:
        if only in {None, kind.name}:
            log_prior = math.log(kind.prior / kind.sizes.size)
            found.append(_of_kind(kind, log_prior, spectra.of_noise, log_evidence, log_other))
    # where samples are drawn no filter fits the noise to its faintest frequencies
    if only is None and np.isfinite(signal).all():
        found = [with_unlisted(each) if each.log_evidence > log_other else each for each in found]
    return FoundFilters(sorted(found, key=lambda kind: -kind.log_evidence), log_other)


def filters_along(
    path: MeasuredPath,
    order: int,
    signal: Array,
    known: Array,
    columns: Array,
    friction: int,
    only: str | None = None,
) -> FoundFilters:
    """The filters that a record of a motion along a path, even in time, most likely went through.

    Which of the columns is that of dry friction, whose force jumps, says ``friction``; all else, of shapes
    and meaning, is as for :func:`likely_filters`.
    """
    corners = np.hstack([columns, corner_columns(path)])
    averaged = columns.copy()
    averaged[:, friction] -= path.missed_jumps(order)
    return likely_filters(signal, known, columns, corners, path.angle, order, averaged=averaged, only=only)


def _filled(signal: Array, rows: Array) -> Array:
    """A signal with what is missing as rows have it, and a residual like that of the others."""
    known = np.isfinite(signal)
    if known.all():
        return signal
    both = np.vstack([rows, signal])[:, known]
    fitted = near_least_squares(both @ both.T) @ rows
    return np.where(known, signal, fitted + with_missing_drawn(np.where(known, signal - fitted, 0.0), known))


def _of_kind(
    kind: FilterKind,
    log_prior: float,
    of_noise: Callable[[RecordingFilter], float],
    log_evidence: Callable[[RecordingFilter], float],
    log_other: float,
) -> FoundKind:
    """Filters of a kind: some of all sizes, and all near the best of these where that may be probable."""
    tried: dict[int, tuple[float, RecordingFilter]] = {}

    @cache
    def of_size(i: int) -> RecordingFilter:
        return replace(kind.of(float(kind.sizes[i])), log_prior=log_prior)

    def value(i: int) -> float:
        if i not in tried:
            tried[i] = (log_prior + log_evidence(of_size(i)), of_size(i))
        return tried[i][0]

    if kind.has_zeros:
        by_noise = np.argsort([-of_noise(of_size(i)) for i in range(kind.sizes.size)])[:_BY_NOISE]
        best = max(by_noise.tolist(), key=value)
        near = range(max(best - 1, 0), min(best + 2, kind.sizes.size))
    else:
        near = _around_the_best(_spread(kind.sizes), value, log_other)
    for i in near:
        value(i)
    return FoundKind(kind.name, sorted(tried.values(), key=lambda each: -each[0]))


def _around_the_best(places: Sequence[int], value: Callable[[int], float], log_other: float) -> range:
    """Places between the neighbours of the best of some; none where that is too improbable."""

    def height(k: int) -> float:
        return value(places[k])

    def worth_more(k: int, step: int) -> bool:
        return height(k) + _MOST_GAINED * step**2 > log_other

    last = len(places) - 1
    first = [*range(0, last, _FIRST), last]
    tops = []
    # noise and corners may each have a hump
    for hump in humps(np.array([height(k) for k in first])):
        top, step = first[hump], _FIRST
        while step > 1 and worth_more(top, step):
            step //= 2
            top = max((k for k in (top - step, top, top + step) if 0 <= k <= last), key=height)
        tops.append(top)
    best = max(tops, key=height)
    if not worth_more(best, 1):
        return range(0)
    near = range(places[max(best - 1, 0)], places[min(best + 1, last)] + 1)
    # between three places a parabola rises above them by an eighth of its bend at most
    middle = min(max(best, 1), last - 1)
    bend = abs(2.0 * height(middle) - height(middle - 1) - height(middle + 1)) if last > 1 else math.inf
    most = height(best) + bend + math.log(len(near))
    return near if most > log_other + math.log(IMPROBABLE) else range(0)


def _spread(sizes: Array) -> list[int]:
    """Places of sizes whose ratio is that of neighbours or :data:`_STRIDE`, whichever is more."""
    count = math.ceil(math.log(sizes[-1] / sizes[0]) / math.log(_STRIDE)) + 1
    wanted = np.geomspace(sizes[0], sizes[-1], count)
    return sorted({int(np.argmin(np.abs(sizes - each))) for each in wanted})


class _Spectra:
    """Likelihoods of the residuals of fits to a signal, by their spectra.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    rows : ndarray, shape (q, n)
        What describes it but for noise, by whose residual all are whitened.
    angle, order
        See :func:`likely_filters`.
    """

    def __init__(self, signal: Array, rows: Array, angle: float, order: int) -> None:
        self._amplitude = float(np.max(np.abs(signal)))
        self._slow = drift_and_swing(signal.size, angle)
        left, _ = least_squares_residual(signal, np.vstack([self._slow, rows]))
        coefficients, _ = burg_recursion(
            left / math.sqrt(float(left @ left) / left.size), most_lags(signal.size)
        )
        self._whitener = np.append(1.0, -coefficients[-1])
        # what is left is of a length whose transforms are fast
        self._n = n = _LOBE * prev_fast_len((signal.size - self._whitener.size + 1) // _LOBE)
        self._slow = self.whitened(self._slow)
        # a column of which whitening leaves nothing but rounding explains nothing
        self._noise_over_size = float(np.std(self.whitened(left))) / self._amplitude
        # twice as fine as the Fourier frequencies: no lag of a taper is missed
        grid = math.pi * np.arange(n + 1) / n
        self._grid, self._gain = grid, np.abs(self.whitener_at(grid)) ** 2
        self._window = irfft(np.mean(np.abs(rfft(_tapers(n), 2 * n)) ** 2, axis=0))
        # none is as near to its image beyond the Nyquist frequency as two are to each other
        self._places = np.arange(_LOBE, n // 2 - _LOBE // 2 + 1, _LOBE)
        self._places = self._places[2.0 * math.pi * self._places / n > _ABOVE * angle]
        # the transform at multiples of a frequency is that of as many parts of the samples added up
        self._parts = _tapers(n).reshape(_TAPERS, _LOBE, -1)
        self._noise = self._power_left(self.whitened(signal), self.whitened(rows))
        self._white = self._expected(np.ones_like(grid))
        gain = self._gain[2 * self._places]
        strongest, loudest = (float(np.max(each, initial=0.0)) for each in (self._noise, self._noise / gain))
        self._least = np.maximum(_LEAKED * strongest, _AS_DESIGNED * loudest * gain)
        self._angle, self._order = angle, order

    @property
    def empty(self) -> bool:
        """Whether the samples are too few or too far apart to compare frequencies far above the motion's."""
        return self._places.size < 2

    @property
    def _omega(self) -> Array:
        return self._grid[2 * self._places]

    def of_others(self, signal: Array, rows: Array) -> float:
        """Log evidence of noise that was not filtered, averaged over its kinds and their sizes."""
        colour, _ = burg(least_squares_residual(signal, rows)[0], len(rows))
        power = self._power_left(self.whitened(signal), self.whitened(rows))
        white = self._gain[2 * self._places]
        own = float(self._log_likelihood(power, white * colour.spectrum(self._omega)[None])[0])
        phase = self._omega / self._angle
        resonance = phase ** (2 * self._order) / (phase * phase - 1.0) ** 2
        flat, forced = (
            _log_mean([self._averaged(power, white * each, white) for each in shapes])
            for shapes in (
                [np.ones_like(phase)],
                [resonance / (1.0 + (phase * tau) ** 2) for tau in _TIMES],
            )
        )
        return _log_mean([own - colour.penalty, flat, forced]) - self._price(len(rows))

    def of_noise(self, filter_: RecordingFilter) -> float:
        """Log evidence of a filter if corners have any shape, by the noise alone."""
        return self.of_response(self._noise, filter_)

    def behind(self, signal: Array, shown: Array, memory: Array) -> tuple[Array, float]:
        """Spectrum of what is left behind a filter, and the price of the coefficients fitted.

        Parameters
        ----------
        signal : ndarray, shape (n,)
            Whitened.
        shown : ndarray, shape (p + 1, n)
            Columns of the law behind the filter, the last one known, whitened.
        memory : ndarray, shape (q, n)
            Of the filter, whitened; what came after the record hardly shows under tapers.
        """
        rows = np.vstack([shown[:-1], memory])
        left, factor = self._left(signal - shown[-1], rows)
        # coefficients of the memory are of the order of the amplitude
        own = np.diag(factor)[len(factor) - len(memory) :] / self._noise_over_size
        return self._power(left), self._price(len(shown) - 1) + float(np.log(own).sum())

    def likeness(self, power: Array, filter_: RecordingFilter) -> list[Likeness]:
        """Filters of other kinds that resemble one, relative to it; none of one that is no plain low pass."""
        if filter_.gain > 1.0 or filter_.of_noise is not None:
            return []
        passed = filter_.power_of_noise(self._grid)
        less, shows = self._grid[passed < 0.5], power > self._least
        if less.size == 0 or less[0] < self._angle or not shows.any():
            return []
        shape = self._expected(passed)
        shapes = shape + _LATER[:, None] * self._white
        best = shapes[np.argmax(self._log_likelihood(power, shapes))][shows]
        over, share = power[shows] / best, shape[shows] / best
        return likeness(over / over.mean(), share, self._omega[shows], float(less[0]), filter_, _TAPERS)

    def whitener_at(self, omega: Array | Complexes) -> Complexes:
        """Response of the whitening filter at frequencies, shape (m,)."""
        return np.asarray(polyval(np.exp(-1j * omega), self._whitener))

    def whitened(self, rows: Array) -> Array:
        """Last samples of rows behind the whitening filter, as many as it knows enough before."""
        samples = rows.shape[-1]
        size = next_fast_len(samples, real=True)
        white = irfft(rfft(rows, size) * rfft(self._whitener, size), size)
        return np.asarray(white[..., samples - self._n : samples])

    def _left(self, signal: Array, rows: Array) -> tuple[Array, Array]:
        """Residual of a signal after a drifting zero, a swing of varying amplitude and phase, and rows."""
        return least_squares_residual(signal, np.vstack([self._slow, rows]), self._noise_over_size)

    def _power_left(self, signal: Array, rows: Array) -> Array:
        return self._power(self._left(signal, rows)[0])

    def _price(self, coefficients: int) -> float:
        """Penalty for fitted coefficients, by the Bayesian information criterion."""
        return 0.5 * coefficients * math.log(self._n)

    def _power(self, left: Array) -> Array:
        parts = np.einsum("kij,ij->kj", self._parts, left.reshape(self._parts.shape[1:]))
        power = np.abs(rfft(parts)[:, self._places // _LOBE]) ** 2
        return np.asarray(power.mean(axis=0))

    def _expected(self, shape: Array) -> Array:
        """Expectation of the estimates, once whitened, of a spectral density on the grid."""
        return np.asarray(rfft(irfft(shape * self._gain) * self._window).real[2 * self._places])

    def of_response(self, power: Array, filter_: RecordingFilter) -> float:
        """Log likelihood of a spectrum behind a filter."""
        shape = self._expected(filter_.power_of_noise(self._grid))
        return self._averaged(power, shape, self._white, _ROUNDED if filter_.computed else _LATER)

    def _averaged(self, power: Array, shape: Array, white: Array, later: Array = _LATER) -> float:
        """Log likelihood of expected estimates, (frequencies,), averaged over white noise that came later."""
        shapes = shape + later[:, None] * white
        return _log_mean(self._log_likelihood(power, shapes))

    def _log_likelihood(self, power: Array, shapes: Array) -> Array:
        """For spectra of these shapes, (m, frequencies), the level of each fitted where power shows.

        Where it does not show, it is known to be less than the least that does, with any phases.
        """
        shows = power > self._least
        if not shows.any():
            shows[:] = True
        level = np.mean(power[shows] / shapes[:, shows], axis=1, keepdims=True)
        least = self._least[~shows]
        below = gammainc(_TAPERS, _TAPERS * least / (level * shapes[:, ~shows]))
        hidden = np.log(np.maximum(below, _SMALLEST))
        hidden += math.lgamma(_TAPERS + 1) - _TAPERS * np.log(_TAPERS * least)
        seen = -_TAPERS * (np.log(level * shapes[:, shows]) + 1.0)
        return np.asarray(seen.sum(axis=1) + hidden.sum(axis=1))


def drift_and_swing(samples: int, angle: float) -> Array:
    """Rows of a zero that drifts, and of a swing of varying amplitude and phase, shape (p, samples)."""
    place, phase = np.linspace(-1.0, 1.0, samples), angle * np.arange(samples)
    drift, swings = (np.polynomial.legendre.legvander(place, degree).T for degree in (_DRIFT, _SWINGS))
    return np.vstack([drift, swings * np.cos(phase), swings * np.sin(phase)])


def least_squares_residual(signal: Array, rows: Array, noise_over_size: float = 0.0) -> tuple[Array, Array]:
    """What least squares of rows leave of a signal, if coefficients have that size, over the noise.

    And Cholesky's factor of the products of rows. The second fit takes what rounding left.
    """
    products = rows @ rows.T
    np.einsum("ii->i", products)[:] += RIDGE * np.diag(products) + noise_over_size**2
    factor, _ = dpotrf(products, lower=True)
    for _ in range(2):
        coefficients, _ = dpotrs(factor, rows @ signal, lower=True)
        signal = signal - coefficients @ rows
    return signal, np.asarray(factor)


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


def _log_mean(logarithms: Sequence[float] | Array) -> float:
    """The same of the mean."""
    return _log_sum(logarithms) - math.log(len(logarithms))
