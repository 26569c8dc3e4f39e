"""Linear filters between a motion and its recording, and their effect on a signal.

Each reduces the amplitude at the motion's frequency, and friction with it, by a share that the oscillation
alone does not show. Delays are irrelevant, as the time of the motion is that of the recording: the response
is taken less the delay at the motion's own frequency. Differences of positions are a filter of their velocity
(``sin(w)/w`` for ``np.gradient``), behind which the noise of the positions has another colour (``sin(w)``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from friction_bayes.core.arrays import Array, Complexes, Indices

__all__ = [
    "FILTERED",
    "FilterKind",
    "RecordingFilter",
    "Through",
    "behind",
    "blended",
    "determined",
    "jump_columns",
    "kinds_for",
    "log_prior_of_no_high_pass",
    "margin",
    "own_columns",
]

_LONGEST_MEAN, _LONGEST_POLYNOMIAL = 0.25, 0.5
"""Windows over the period: a moving mean of that length takes a tenth of the amplitude."""
_LOWEST_CORNER, _OF_STEEP = 1.5, 3.0
"""Of low passes, over the motion's frequency: one of first order takes a sixth there. Those that take next to
nothing of the motion, the steep ones, are tried from where they still leave something of its corners."""
_NEXT_TO_NOTHING = 1e-3
"""Share of the amplitude."""
_COUPLING = (0.01, 0.5)
"""Corners of an AC coupling over the motion's frequency: 5e-5 and a tenth are what these take."""
_HIGH_PASS = (0.02, 1.5)
"""The same of a high pass of second order."""
_OF_MOUNTS, _DAMPINGS_APART = (0.02, 0.04, 0.08, 0.16), 1.3
"""Damping ratios of what carries a sensor, and by which factor each may be another."""
_OF_PICKUPS, _PICKUPS_APART = (0.57, 0.63, 0.7), 0.03
"""The same of pickups that are an oscillator themselves, made to have some .56 to .71, and by how much each
may be another."""
_APART = 1.03
"""Ratio of neighbouring corners: to a few hundredths of one the rounding of a turning point is the same."""
_BESSEL_HALF = 2.1139176749042
"""Frequency at which Bessel's filter of order 4 and of unit delay lets half the power through."""
_HIGHEST_CORNER = 0.98
"""Over Nyquist's frequency."""
_RIPPLE = 0.05
"""Of the Chebyshev filter by which records are decimated [dB]."""
_DECIMATIONS = np.array([2.0, 3.0, 5.0, 10.0])
"""Factors: the larger they are, the less responses differ."""
_STILL_SLOW = 0.1
"""Frequency over the motion's below which an integral is no longer known to be one."""
_BELOW_NYQUIST = math.pi - 1e-6
"""Frequency at which a bilinear transform is still finite."""
_MARGIN = 0.25
"""Share of a period at either end, where a filter has too few samples."""
_LET_THROUGH = 0.3
"""Share of the amplitude below which a frequency is not let through."""
_MOST_DOUBTS, _SAME = 3, 1e-9
"""How many components of the differences between filters are kept, and variance of those that are none."""
FILTERED, _DERIVED = 0.013, 0.1
"""Prior probabilities that a record was filtered in one of the ways listed, and that a velocity or
acceleration was computed from positions or velocities: few sensors show one."""
_COUPLED = 0.5
"""Prior probability that an acceleration is AC coupled: accelerometers of charge or of constant current are,
those that show gravity are not, and laboratories have both."""
_AC_COUPLING = "AC coupling"
_FORGOTTEN = 1e-4
"""Share of what came when it is not known that a filter may still show where it is taken to be forgotten."""


Response = Callable[[Array], Array]
"""Complex response, shape (m,), at frequencies [rad/sample], shape (m,)."""


@dataclass(frozen=True)
class RecordingFilter:
    """A filter and what it does to a motion of one frequency.

    Attributes
    ----------
    name : str
        In words; filters of one name are the same.
    response : callable
        See :data:`Response`.
    angle : float
        Frequency of the motion [rad/sample].
    settling : ndarray of complex, shape (p,)
        Rates at which it forgets what was before the recording [1/sample], one of each conjugate pair; none
        where that is within the :func:`margin`.
    both_ways : bool
        Whether it ran backward too: then it does not know either what is after the recording.
    doubts : tuple of callable
        Differences to what may be the right response, without delay, one standard deviation each: of the next
        filter of its kind, where a size in between may be the right one.
    log_prior : float
        Logarithm of the prior probability that a record went through it.
    of_noise : callable or None
        Response to the noise of the sensor, where that is not ``response``, as large at the motion's
        frequency.
    computed : bool
        Whether nothing comes after it but rounding.
    in_time : bool
        Whether the time of the motion is its own, and not that of the recording.
    """

    name: str
    response: Response = field(compare=False)
    angle: float = field(compare=False)
    settling: Complexes = field(default_factory=lambda: np.empty(0, np.complex128), compare=False)
    both_ways: bool = field(default=False, compare=False)
    doubts: tuple[Response, ...] = field(default=(), compare=False)
    log_prior: float = field(default=0.0, compare=False)
    of_noise: Response | None = field(default=None, compare=False)
    computed: bool = field(default=False, compare=False)
    in_time: bool = field(default=False, compare=False)

    @cached_property
    def _at_motion(self) -> complex:
        return complex(self.response(np.array([self.angle]))[0])

    @property
    def gain(self) -> float:
        """Factor on the motion."""
        return abs(self._at_motion)

    def to_dict(self) -> dict[str, str | float]:
        """Fields of a report."""
        return {"name": self.name, "gain": self.gain}

    @property
    def delay(self) -> float:
        """By which the motion is recorded late [samples]; negative behind a high pass."""
        return -float(np.angle(self._at_motion)) / self.angle

    def without_delay(self, omega: Array) -> Array:
        """Response at frequencies, shape (m,), less the delay that the motion has, unless ``in_time``."""
        response, delay = self.response(omega), self.delay
        return response if self.in_time or delay == 0.0 else response * np.exp(1j * omega * delay)

    def power_of_noise(self, omega: Array) -> Array:
        """Spectral density of white noise of the sensor behind it at frequencies, shape (m,)."""
        response = self.response if self.of_noise is None else self.of_noise
        return np.asarray(np.abs(response(omega)) ** 2)

    def undone(self, noise: Array) -> Array:
        """Noise, shape (n,), as strong as it was before the filter, at frequencies that were let through."""
        size = next_fast_len(noise.size, real=True)
        share = np.sqrt(self.power_of_noise(2.0 * math.pi * np.arange(size // 2 + 1) / size))
        before = irfft(rfft(noise, size) / np.maximum(share, _LET_THROUGH), size)
        return np.asarray(before[: noise.size])

    @property
    def remembered(self) -> int:
        """How many coefficients what it remembers of the time before the recording has."""
        return self.memory(1).shape[1]

    def memory(self, samples: int, another: Complexes | float = 1.0) -> Array:
        """Responses to the time before the recording, shape (samples, p): any multiples of these.

        The difference between two recordings of one motion, whatever had gone through the filter before.
        Behind another response too, which has these values at :attr:`settling`.
        """
        left = another * np.exp(np.multiply.outer(np.arange(samples), self.settling))
        # a rate that alternates from sample to sample is real
        pairs = (self.settling.imag != 0.0) & (np.abs(self.settling.imag) != math.pi)
        return np.hstack([left.real, left.imag[:, pairs]])

    def unseen(self, samples: int) -> Array:
        """The same and, last, those to the time after the recording, shape (samples, p or 2 p)."""
        before = self.memory(samples)
        return np.hstack([before, before[::-1]]) if self.both_ways else before


class Through:
    """Columns, shape (n, p), that go through one filter or another.

    They are continued beyond either end by their mirror image about its value, fading out: a step there would
    ring in every sample behind a filter with a fractional delay. Their transform is at the frequencies
    ``omega`` [rad/sample], shape (m,).

    What a filter in time adds to columns that jump at ``places``, as of indices of samples, shape (k,), shows
    where between two samples they do.
    """

    def __init__(self, columns: Array, places: Array | None = None) -> None:
        self._n = n = len(columns)
        self._added = added = n // 2
        self._columns = columns
        fade = np.cos(0.5 * math.pi * np.arange(1, added + 1) / (added + 1)) ** 2
        rows = (columns if places is None else _mean_at_jumps(columns, places)).T
        before = (2.0 * rows[:, :1] - rows[:, 1 : added + 1]) * fade
        after = (2.0 * rows[:, -1:] - rows[:, -added - 1 : -1][:, ::-1]) * fade
        self._size = next_fast_len(n + 2 * added, real=True)
        self._spectrum = rfft(np.hstack([before[:, ::-1], rows, after]), self._size)
        self.omega = 2.0 * math.pi * np.arange(self._spectrum.shape[1]) / self._size

    def __call__(self, filter_: RecordingFilter) -> Array:
        """Columns behind the filter, shape (n, p); not valid within the :func:`margin` of either end."""
        return np.ascontiguousarray(self.rows(filter_).T)

    def rows(self, filter_: RecordingFilter, another: Complexes | float = 1.0) -> Array:
        """The same, a row each, shape (p, n), as the transform provides them; behind another response too."""
        response = filter_.without_delay(self.omega) * another
        return self._columns.T + self._behind(response - 1.0) if filter_.in_time else self._behind(response)

    def doubts(self, filter_: RecordingFilter) -> Array:
        """Columns behind each of the filter's doubts, those of the first doubt first, shape (n, doubts p)."""
        shown = [self._behind(doubt(self.omega)) for doubt in filter_.doubts]
        return np.ascontiguousarray(np.concatenate(shown or [np.empty((0, self._n))]).T)

    def _behind(self, response: NDArray[Any]) -> Array:
        shown = irfft(self._spectrum * response, self._size)
        return np.asarray(shown[:, self._added : self._added + self._n])


def behind(columns: Array, filter_: RecordingFilter, places: Array) -> Array:
    """Columns that jump at places behind a filter, shape (n, p); one in time alone shows where exactly."""
    return Through(columns, places if filter_.in_time else None)(filter_)


def _mean_at_jumps(columns: Array, places: Array) -> Array:
    """Columns, shape (n, p), that jump at places, each sample next to one the mean over the step about it."""
    means = columns.copy()
    for place in places.tolist():
        k = round(place)
        if 2 <= k < len(columns) - 2:
            (first, before, after, last), at = columns[[k - 2, k - 1, k + 1, k + 2]], k - place
            jump = after - before - (before - first) - (last - after)
            means[k] = 0.5 * (before + after) + at * jump
    return means


def blended(filters: Sequence[tuple[float, RecordingFilter]], read: Array) -> RecordingFilter:
    """The mean of filters that a record may have gone through, in doubt as they differ.

    Parameters
    ----------
    filters : sequence of (float, RecordingFilter)
        With their probabilities, or some of these. The first, the most probable, lends its name and memory.
    read : ndarray, shape (n,)
        The motion as the sensor reads it: doubts are the principal components of its differences.

    Returns
    -------
    RecordingFilter
        As probable beforehand as all filters that are about as probable as the first.
    """
    total = sum(share for share, _ in filters)
    filters = [(share / total, each) for share, each in filters]
    first, shares = filters[0][1], np.array([share for share, _ in filters])
    own = [(share, doubt) for share, each in filters for doubt in each.doubts]
    if len(filters) == 1 and not own:
        return first
    responses = [*(each.without_delay for _, each in filters), *(doubt for _, doubt in own)]
    # every response is evaluated once, however many differences it is part of
    apart = np.diag(np.sqrt(np.append(shares, [share for share, _ in own])))
    apart[: shares.size, : shares.size] -= np.outer(np.sqrt(shares), shares)
    shown = Through(read[:, None]).doubts(replace(first, doubts=tuple(responses))) @ apart.T
    variance, directions = np.linalg.eigh(shown.T @ shown)
    kept = directions[:, variance > _SAME * variance[-1]].T[::-1][:_MOST_DOUBTS]
    return replace(
        first,
        response=_combined(shares, responses[: shares.size]),
        doubts=tuple(_combined(each @ apart, responses) for each in kept),
        log_prior=first.log_prior - math.log(shares[0]),
    )


def _combined(weights: Iterable[float], responses: Sequence[Response]) -> Response:
    """Sum of responses with weights."""

    def response(omega: Array) -> Array:
        return np.asarray(sum(weight * each(omega) for weight, each in zip(weights, responses, strict=True)))

    return response


def own_columns(filter_: RecordingFilter, read: Array) -> Array:
    """Columns of a recording that are due to the filter alone, all of unit prior sd, shape (n, p + q).

    What it has seen outside the recording, as large as the motion that is ``read``, shape (n,) (see
    :meth:`RecordingFilter.unseen`), then its doubts.
    """
    unseen = float(np.max(np.abs(read))) * filter_.unseen(read.size)
    return np.hstack([unseen, Through(read[:, None]).doubts(filter_)])


def jump_columns(filter_: RecordingFilter, places: Indices, samples: int) -> Array:
    """Responses to unit impulses at ``places``, of those that show inside the margin, shape (samples, k).

    A sensor that jumps shows no more than between which samples it does: a jump that is early by a share of
    the step is that share of an impulse, which a filter makes as wide as the jump itself.
    """
    size = next_fast_len(2 * samples, real=True)
    omega = 2.0 * math.pi * np.arange(size // 2 + 1) / size
    impulse = irfft(filter_.without_delay(omega), size)
    columns = np.asarray(impulse[np.subtract.outer(np.arange(samples), places) % size])
    shown = np.max(np.abs(columns[determined(filter_, samples)]), axis=0)
    return columns[:, shown > _FORGOTTEN * np.max(np.abs(impulse))]


def margin(angle: float) -> int:
    """Number of samples at either end where the output of a filter of a motion of ``angle`` is unknown."""
    return math.ceil(_MARGIN * 2.0 * math.pi / angle)


def determined(filter_: RecordingFilter | None, samples: int) -> slice:
    """Which samples the motion within the record determines: behind a filter not those at either end."""
    left_out = 0 if filter_ is None else margin(filter_.angle)
    return slice(left_out, samples - left_out)


@dataclass(frozen=True, eq=False)
class FilterKind:
    """Filters that differ in their size alone.

    Attributes
    ----------
    name : str
        In words.
    sizes : ndarray, shape (m,)
        Ascending, as probable one as another.
    of : callable, float -> RecordingFilter
        The filter of a size.
    has_zeros : bool
        Whether it suppresses some frequencies altogether.
    prior : float
        Probability that noise which is not white went through one of them.
    high_pass : bool
        Whether they let everything above the motion's frequency through.
    """

    name: str
    sizes: Array
    of: Callable[[float], RecordingFilter]
    has_zeros: bool
    prior: float = 1.0
    high_pass: bool = False


def kinds_for(angle: float, order: int) -> list[FilterKind]:
    """Filters that attenuate a motion of ``angle`` [rad/sample], with their probabilities.

    Of a derivative of this order: it may have been computed from one of a lower order.
    """
    kinds = [_means(angle, 1), _means(angle, 2), _hann(angle), _polynomials(angle, 2), _polynomials(angle, 4)]
    kinds += [_couplings(angle), _smoothing(angle), _gaussian(angle)]
    kinds += [_butterworth(angle, order, ways) for ways in (1, 2) for order in (1, 2, 3, 4, 6, 8)]
    kinds += [_bessel(angle), *(_resonance(angle, damping) for damping in _OF_MOUNTS)]
    kinds += [_decimation(angle, ways) for ways in (1, 2)]
    # that of an accelerometer settles as what it is coupled through
    kinds += [_settling_zero(angle)] if order < 2 else []
    # they show how fast it moves
    kinds += [_pickup(angle, damping) for damping in _OF_PICKUPS if order == 1]
    kinds += [_integrals(angle, times) for times in range(1, 3 - order)]
    derived = [of(angle, times) for of in (_differences, _slopes) for times in range(1, order + 1)]
    # a kind that is not listed is as probable as one that is
    kinds = _with_prior(kinds, FILTERED, besides=1) + _with_prior(derived, _DERIVED)
    if order == 2:
        kinds = [replace(kind, prior=_COUPLED) if kind.name == _AC_COUPLING else kind for kind in kinds]
    return kinds


def log_prior_of_no_high_pass(order: int) -> float:
    """Logarithm of the prior probability that a record of a derivative of this order went through none."""
    return math.log1p(-(_COUPLED if order == 2 else FILTERED))


def _with_prior(kinds: Sequence[FilterKind], probability: float, besides: int = 0) -> list[FilterKind]:
    """Those that have sizes, and as many besides, all equally probable."""
    kinds = [kind for kind in kinds if kind.sizes.size]
    return [replace(kind, prior=probability / (len(kinds) + besides)) for kind in kinds]


def _windows(angle: float, shortest: int, longest: float, step: float = 2.0) -> Array:
    return np.arange(shortest, longest * 2.0 * math.pi / angle, step)


def _means(angle: float, times: int) -> FilterKind:
    def of(window: float) -> RecordingFilter:
        def response(omega: Array) -> Array:
            half = 0.5 * np.maximum(omega, 1e-12)
            return np.asarray((np.sin(window * half) / (window * np.sin(half))) ** times)

        name = f"a moving mean of {window:.0f} samples{', twice' if times == 2 else ''}"
        return RecordingFilter(name, response, angle)

    # one of an even number of samples is centred between two: that is a delay
    sizes = _windows(angle, 2, _LONGEST_MEAN, step=1.0)
    return FilterKind(f"moving mean{', twice' if times == 2 else ''}", sizes, of, has_zeros=True)


def _hann(angle: float) -> FilterKind:
    """Weights of Hann's window; outside the window they are zero."""

    def of(window: float) -> RecordingFilter:
        half = int(window) // 2
        weights = 1.0 + np.cos(math.pi * np.arange(half + 1) / (half + 1.0))
        weights *= np.append(1.0, np.full(half, 2.0))
        weights /= weights.sum()

        def response(omega: Array) -> Array:
            return np.asarray(np.polynomial.chebyshev.chebval(np.cos(omega), weights))

        return RecordingFilter(f"a Hann window of {window:.0f} samples", response, angle)

    return FilterKind("Hann window", _windows(angle, 3, _LONGEST_POLYNOMIAL), of, has_zeros=True)


def _polynomials(angle: float, degree: int) -> FilterKind:
    """Savitzky and Golay's, Analytical Chemistry 36, 1964: an odd degree is the same as the one below."""

    def of(window: float) -> RecordingFilter:
        half = int(window) // 2
        powers = np.polynomial.legendre.legvander(np.arange(-half, half + 1) / half, degree)
        # what each sample adds to the polynomial at the middle
        weights = np.linalg.lstsq(powers.T @ powers, powers[half])[0] @ powers.T
        cosines = np.append(weights[half], 2.0 * weights[half + 1 :])

        def response(omega: Array) -> Array:
            return np.asarray(np.polynomial.chebyshev.chebval(np.cos(omega), cosines))

        name = f"a polynomial of degree {degree} or {degree + 1} over {window:.0f} samples (Savitzky-Golay)"
        return RecordingFilter(name, response, angle)

    sizes = _windows(angle, degree + 3, _LONGEST_POLYNOMIAL)
    return FilterKind(f"polynomial of degree {degree}", sizes, of, has_zeros=True)


def _derivative(name: str, angle: float, times: int, slope: Callable[[Array], Array]) -> RecordingFilter:
    """A derivative by weights of samples, of response ``1j slope(w)``, or one of one."""

    def response(omega: Array) -> Array:
        omega = np.maximum(omega, 1e-9)
        return np.asarray((slope(omega) / omega) ** times)

    def of_noise(omega: Array) -> Array:
        return np.asarray((slope(omega) / angle) ** times)

    name = f"a derivative by {name}{', twice' if times == 2 else ''}"
    return RecordingFilter(name, response, angle, of_noise=of_noise)


def _differences(angle: float, times: int) -> FilterKind:
    """Of neighbouring samples, for the time in between."""

    def of(_: float) -> RecordingFilter:
        name = "differences of neighbouring samples"
        return _derivative(name, angle, times, lambda omega: 2.0 * np.sin(0.5 * omega))

    return FilterKind(f"differences{', twice' if times == 2 else ''}", np.ones(1), of, has_zeros=True)


def _slopes(angle: float, times: int) -> FilterKind:
    """Of parabolas through as many samples (Savitzky-Golay); of three it is the mean of both differences."""

    def of(window: float) -> RecordingFilter:
        place = np.arange(1.0, int(window) // 2 + 1)

        def slope(omega: Array) -> Array:
            return np.asarray(np.sin(np.multiply.outer(omega, place)) @ place / (place @ place))

        return _derivative(f"slopes over {window:.0f} samples", angle, times, slope)

    sizes = _windows(angle, 3, _LONGEST_POLYNOMIAL)
    return FilterKind(f"slopes{', twice' if times == 2 else ''}", sizes, of, has_zeros=True)


def _integrals(angle: float, times: int) -> FilterKind:
    """Of lines through neighbouring samples: trapezoids. What is far below the motion was taken out again."""

    def of(_: float) -> RecordingFilter:
        def response(omega: Array) -> Array:
            half = 0.5 * np.clip(omega, _STILL_SLOW * angle, _BELOW_NYQUIST)
            return np.asarray((half / np.tan(half)) ** times)

        def of_noise(omega: Array) -> Array:
            half = 0.5 * np.clip(omega, _STILL_SLOW * angle, _BELOW_NYQUIST)
            return np.asarray((math.tan(0.5 * angle) / np.tan(half)) ** times)

        name = f"an integral by trapezoids{', twice' if times == 2 else ''}"
        return RecordingFilter(name, response, angle, of_noise=of_noise)

    return FilterKind(f"integral{', twice' if times == 2 else ''}", np.ones(1), of, has_zeros=True)


def _corners(lowest: float, highest: float) -> Array:
    if lowest >= highest:
        return np.empty(0)
    return np.geomspace(lowest, highest, math.ceil(math.log(highest / lowest) / math.log(_APART)) + 1)


def _of_corner(
    name: str,
    angle: float,
    words: Callable[[float], str],
    response: Callable[..., Array],
    rates: Callable[[float], Complexes] = lambda corner: np.empty(0, np.complex128),
    between: tuple[float, float] | None = None,
    *,
    others: Sequence[Callable[..., Array]] = (),
    both_ways: bool = False,
) -> FilterKind:
    """Filters of ``response(omega, corner=...)``, which forget at the rates [1/sample] of a corner.

    The response may also be one of ``others``, each one standard deviation apart. Words and the corners that
    are tried, ``between`` of high passes, have corners over the motion's frequency.
    """
    high_pass = between is not None

    def of(corner: float) -> RecordingFilter:
        own = RecordingFilter(
            words(corner / angle),
            partial(response, corner=corner),
            angle,
            settling=_remembered(rates(corner), angle),
            both_ways=both_ways,
            in_time=high_pass,
        )
        neighbours = [partial(response, corner=corner / _APART)]
        neighbours += [partial(other, corner=corner) for other in others]
        return replace(own, doubts=tuple(_apart(own, neighbour) for neighbour in neighbours))

    if between is None:
        left = abs(complex(response(np.array([angle]), corner=_OF_STEEP * angle)[0]))
        between = (_OF_STEEP if left > 1.0 - _NEXT_TO_NOTHING else _LOWEST_CORNER, math.inf)
    highest = min(between[1] * angle, _HIGHEST_CORNER * math.pi)
    corners = _corners(between[0] * angle, highest)
    return FilterKind(name, corners, of, has_zeros=False, high_pass=high_pass)


def _remembered(rates: Complexes, angle: float) -> Complexes:
    """Those rates [1/sample] at which it is not forgotten within the margin what was before."""
    return rates[np.exp(rates.real * margin(angle)) > _FORGOTTEN]


def _apart(filter_: RecordingFilter, response: Response) -> Response:
    """How another response differs from that of a filter, both without delay."""
    return _combined([1.0, -1.0], [replace(filter_, response=response).without_delay, filter_.without_delay])


def _of_poles(angle: float, poles: Complexes, name: str, ways: int) -> FilterKind:
    """Low passes of the poles that they have at a corner of one, by the bilinear transform."""

    def response(omega: Array, *, corner: float) -> Array:
        one_way = _through_poles(omega, corner, poles)
        return np.asarray(np.abs(one_way) ** 2 if ways == 2 else one_way)

    name += ", forward and backward" if ways == 2 else ""
    return _of_corner(
        name,
        angle,
        lambda corner: f"a {name}, corner at {corner:.3g} times the motion's frequency",
        response,
        partial(_rates_of, poles=poles),
        both_ways=ways == 2,
    )


def _through_poles(omega: Array, corner: float, poles: Complexes) -> Complexes:
    s = 1j * np.tan(0.5 * np.minimum(omega, _BELOW_NYQUIST)) / math.tan(0.5 * corner)
    product = s - poles[0]
    for pole in poles[1:]:
        product *= s - pole
    return np.asarray(np.prod(-poles) / product)


def _rates_of(corner: float, poles: Complexes) -> Complexes:
    """At which a low pass of these poles forgets [1/sample]."""
    own = math.tan(0.5 * corner) * poles[poles.imag >= 0.0]
    return np.asarray(np.log((1.0 + own) / (1.0 - own)))


def _butterworth(angle: float, order: int, ways: int) -> FilterKind:
    poles = np.exp(0.5j * math.pi * (1.0 + (2.0 * np.arange(order) + 1.0) / order))
    poles.imag[np.abs(poles.imag) < 1e-12] = 0.0
    return _of_poles(angle, poles, f"low pass of order {order}", ways)


def _bessel(angle: float) -> FilterKind:
    poles = np.roots([1.0, 10.0, 45.0, 105.0, 105.0]).astype(np.complex128) / _BESSEL_HALF
    return _of_poles(angle, poles, "Bessel filter of order 4", 1)


def _decimation(angle: float, ways: int) -> FilterKind:
    """One of every so many samples, as SciPy, MATLAB and Octave decimate.

    Behind Chebyshev's filter of order 8, its corner at .8 of the new Nyquist frequency, which lets a ripple's
    share through at low frequencies, of zero too.
    """
    order, low = 8, 10.0 ** (-_RIPPLE / 20.0)
    sinh = math.sinh(math.asinh(1.0 / math.sqrt(10.0 ** (_RIPPLE / 10.0) - 1.0)) / order)
    round_circle = 0.5 * math.pi * (2.0 * np.arange(order) + 1.0) / order
    poles = -sinh * np.sin(round_circle) + 1j * math.hypot(1.0, sinh) * np.cos(round_circle)
    how = "decimation, forward and backward" if ways == 2 else "decimation"

    def corner(factor: float) -> float:
        return 0.8 * math.pi / factor

    def response(omega: Array, *, factor: float) -> Array:
        one_way = low * _through_poles(omega / factor, corner(factor), poles)
        return np.asarray(np.abs(one_way) ** 2 if ways == 2 else one_way)

    def of_noise(omega: Array, *, factor: float) -> Array:
        # what lies above the new Nyquist frequency is folded below it
        folded = (response(each, factor=factor) for each in (omega, 2.0 * math.pi - omega))
        return np.hypot(*map(np.abs, folded))

    def of(factor: float) -> RecordingFilter:
        rates = factor * _rates_of(corner(factor), poles)
        return RecordingFilter(
            f"{how}, by {factor:.0f}",
            partial(response, factor=factor),
            angle,
            settling=_remembered(rates, angle),
            both_ways=ways == 2,
            of_noise=partial(of_noise, factor=factor),
            computed=True,
        )

    return FilterKind(how, _DECIMATIONS, of, has_zeros=True)


def _resonance(angle: float, damping: float) -> FilterKind:
    """What rings at each corner, from three times the motion's frequency on.

    The mount of a sensor magnifies the motion too. A second mode of what moves, which the force drives, rings
    alike and does not: nothing in a record tells the two apart, so that the gain is either, equally probable.
    """

    def response(omega: Array, *, corner: float, damping: float = damping, share: float = 0.5) -> Array:
        poles = _oscillator(damping)
        magnified = abs(_through_poles(np.array([angle]), corner, poles)[0])
        return np.asarray((share + (1.0 - share) / magnified) * _through_poles(omega, corner, poles))

    name = f"resonance of the mount or a second mode, damping ratio {damping:g}"
    return _of_corner(
        name,
        angle,
        lambda corner: f"a {name}, corner at {corner:.3g} times the motion's frequency",
        response,
        partial(_rates_of, poles=_oscillator(damping)),
        others=[partial(response, damping=damping * _DAMPINGS_APART), partial(response, share=1.0)],
    )


def _pickup(angle: float, damping: float) -> FilterKind:
    """A sensor that shows a motion relative to a mass on a spring, as a geophone does."""

    def response(omega: Array, *, corner: float, damping: float = damping) -> Array:
        s = 1j * omega / corner
        return np.asarray(s * s / (s * s + 2.0 * damping * s + 1.0))

    name = f"high pass of order 2, damping ratio {damping:g}"
    return _of_corner(
        name,
        angle,
        lambda corner: f"a {name}, corner at {corner:.3g} times the motion's frequency",
        response,
        lambda corner: corner * _oscillator(damping)[:1],
        _HIGH_PASS,
        others=[partial(response, damping=damping + _PICKUPS_APART)],
    )


def _oscillator(damping: float) -> Complexes:
    """Poles of an oscillator of unit frequency."""
    pole = complex(-damping, math.sqrt(1.0 - damping**2))
    return np.array([pole, pole.conjugate()])


def _smoothing(angle: float) -> FilterKind:
    """Exponential smoothing: each value goes a share of the way to the sample."""

    def response(omega: Array, *, corner: float) -> Array:
        kept = math.exp(-corner)
        return np.asarray((1.0 - kept) / (1.0 - kept * np.exp(-1j * omega)))

    return _of_corner(
        "exponential smoothing",
        angle,
        lambda corner: f"exponential smoothing by {-math.expm1(-corner * angle):.3g} a sample",
        response,
        lambda corner: np.array([-corner + 0.0j]),
    )


def _gaussian(angle: float) -> FilterKind:
    """Weights of a normal density at the samples; half the power is left at the corner."""
    half = math.sqrt(math.log(2.0))
    # what is sampled has its spectrum again at every multiple of the sampling rate
    again = 2.0 * math.pi * np.arange(-2, 3)

    def response(omega: Array, *, corner: float) -> Array:
        shown, whole = (
            np.exp(-0.5 * (half * np.add.outer(each, again) / corner) ** 2).sum(axis=-1)
            for each in (omega, np.zeros(1))
        )
        return np.asarray(shown / whole)

    return _of_corner(
        "Gaussian weights",
        angle,
        lambda corner: f"Gaussian weights of sd {half / (corner * angle):.3g} samples",
        response,
    )


def _settling_zero(angle: float) -> FilterKind:
    """What an AC coupling remembers of the time before, and nothing else of it: the motion as it is."""

    def response(omega: Array, *, corner: float) -> Array:
        return np.ones(np.shape(omega), np.complex128)

    return _of_first_order("settling zero", "a zero that settles at", angle, response)


def _couplings(angle: float) -> FilterKind:
    def response(omega: Array, *, corner: float) -> Array:
        return np.asarray(1j * omega / (1j * omega + corner))

    return _of_first_order(_AC_COUPLING, "an AC coupling, corner at", angle, response)


def _of_first_order(name: str, words: str, angle: float, response: Callable[..., Array]) -> FilterKind:
    """High passes that forget at their corner."""
    return _of_corner(
        name,
        angle,
        lambda corner: f"{words} {corner:.3g} times the motion's frequency",
        response,
        lambda corner: np.array([-corner + 0.0j]),
        _COUPLING,
    )
