r"""Noise of the sensor that neighbouring samples share: correlated errors next to white noise, or a colour.

**Correlated errors.** A sensor that smooths, or one with noise of low frequency, has correlated errors, which
would pass for a short and strong random force. They are an Ornstein-Uhlenbeck process in the sensor
(:mod:`friction_bayes.statespace.kalman`), of sd ``rho sigma`` and correlation time ``tau_u``, with the prior
``log rho ~ N(0, 2**2)`` and ``tau_u`` log-uniform from a third of a step to a tenth of a period: slower ones
are at the motion's own frequency, where they cannot be separated from a force.

The process is found at the mode, together with the random force, since each can explain what the other does,
and fixed there. The density has several modes: it is evaluated on a coarse grid of ratios, times and forces,
and maximised from the best. Correlated noise is as probable a priori as uncorrelated, penalised only for its
two numbers.

**Colour**, in place of white noise and of a random force, where the spectrum shows it. Filters of the
acquisition, differences of positions and interpolation colour the noise. Above the eighth harmonic of the
motion a free decay has almost no power, whatever the force law: where the spectrum of a residual is flat
there, the noise is white and everything else in it is misfit. Where it is not, an autoregression of it
(:mod:`friction_bayes.statespace.coloured_noise`) is an alternative to white noise with or without a random
force, penalised for its coefficients.

Where it is more probable, the law is found under noise of the sensor's level near the motion's frequency,
and of that colour where it is stronger (:mod:`friction_bayes.estimators.noise.noise_level`): a filter removes
the corners of the motion with the noise, so that a quiet band above is no evidence about friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import chain, product

import numpy as np
from scipy import stats
from scipy.optimize import minimize

from friction_bayes.core.arrays import Array
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.loop import settings
from friction_bayes.statespace.coloured_noise import Autoregression, burg
from friction_bayes.statespace.force_grid import Posterior
from friction_bayes.statespace.force_prior import ForcePrior, at_resonance
from friction_bayes.statespace.kalman import Clock, CorrelatedError, whiten
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.subset_evidence import evaluate_sets

__all__ = [
    "NO_ERROR",
    "BestSet",
    "Colour",
    "SensorError",
    "colour_of",
    "find_sensor_error",
    "is_coloured",
]

Place = tuple[float, float]

_LEAST_STEPS = 1.0 / 3.0
_RATIOS = (0.3, 1.0, 3.0, 9.0)
_PLACES = (0.1, 0.37, 0.63, 0.9)
"""Between the bounds of the logarithm of the correlation time."""
_FORCE_PERIODS = (0.02, 0.08, 0.3)
"""Correlation times at which a force as strong as the best is looked at too [periods of the motion].

With an error that explains its fast part a force is slower than without: a mode of its own.
"""
_FIRST_STEP = 0.4
"""In the logarithms of ratios and times."""
_TOLERANCE = 0.05
"""Of the search, in the same."""
_STENCIL = 0.2
_FAR = 1e9
_GRID = 1025
"""Frequencies of a spectrum whose transform is the correlation of the noise."""
_HANN_SPREAD = 1.5
"""Neighbouring ordinates of a Hann-windowed periodogram are correlated: so many count as one."""


@dataclass(frozen=True)
class SensorError:
    """Errors of the sensor that neighbouring samples share.

    Attributes
    ----------
    ratio : float
        Their sd over that of the white noise.
    correlation_time : float
        [s].
    log_volume : float
        Logarithm of the prior probability of the ratios and times that these represent.
    """

    ratio: float = 0.0
    correlation_time: float = 1.0
    log_volume: float = 0.0
    least_noise = 0.0
    """It sets no lower limit to the white noise."""

    @property
    def share(self) -> float:
        """Sd of the whole noise over that of the part that a posterior knows, which is white."""
        return math.hypot(1.0, self.ratio)

    def of(self, clock: Clock, w0: float) -> Clock:
        """A clock in natural units of a frequency [rad/s] with these errors."""
        return replace(clock, error=CorrelatedError(self.ratio, w0 * self.correlation_time))

    def alike(self, other: object) -> bool:
        """Whether another is the same, as far as the search for it goes."""
        if not isinstance(other, SensorError):
            return False
        if min(self.ratio, other.ratio) == 0.0:
            return self.ratio == other.ratio
        sizes = math.log(self.ratio / other.ratio), math.log(self.correlation_time / other.correlation_time)
        return max(map(abs, sizes)) < 2.0 * _TOLERANCE

    def described(self, step: float) -> dict[str, float | int | str]:
        """Fields of the report."""
        if self.ratio == 0.0:
            return {"model": "white", "order": 0, "correlation_length_s": 0.0}
        return {"model": "ar", "order": 1, "correlation_length_s": self.correlation_time}


NO_ERROR = SensorError()


def find_sensor_error(
    regression: LawRegression, posterior: Posterior, prior: ForcePrior, w0: float
) -> SensorError | None:
    """The correlated error of the sensor, where the innovations of a record are not white.

    An error that the clock of the ``regression`` has already is climbed from. None where none is required:
    the innovations are white, and any random force is too slow to represent one; one of size zero where it is
    less probable than none.
    """
    best, law = posterior.best, posterior.best_law()
    left = regression.innovations(law, best.ratio, best.tau)[regression.clock.used]
    looks_like_one = best.ratio > 0.0 and best.tau < settings.SETTINGS.longest_error
    if whiteness(left).white and not looks_like_one:
        return None
    step = float(np.median(regression.clock.steps[regression.clock.index]))
    bounds = math.log(_LEAST_STEPS * step), math.log(settings.SETTINGS.longest_error)
    if bounds[0] >= bounds[1]:
        return None
    density = _Density(regression, posterior, prior, bounds)
    forces = _forces(posterior)
    without = max(density(force, None) for force in chain(*forces))
    errors = _errors(regression.clock.error, bounds)
    starts = [max(product(alike, errors), key=lambda place: density(*place)) for alike in forces]
    force, error = max((density.climb(*start) for start in starts), key=lambda place: density(*place))
    volume = math.log(2.0 * math.pi) + float(np.sum(density.log_sds(force, error)))
    log_odds = density(force, error) + volume - without
    if log_odds <= 0.0:
        return NO_ERROR
    return SensorError(math.exp(error[0]), math.exp(error[1]) / w0, density.log_prior(error) + volume)


def _errors(known: CorrelatedError, bounds: Place) -> list[Place]:
    """The error that is known already; or else a grid of sizes and times."""
    if known.ratio > 0.0:
        return [(math.log(known.ratio), min(max(math.log(known.tau), bounds[0]), bounds[1]))]
    width = bounds[1] - bounds[0]
    return [(math.log(ratio), bounds[0] + place * width) for ratio, place in product(_RATIOS, _PLACES)]


def _forces(posterior: Posterior) -> list[list[Place | None]]:
    """No force; and the best one evaluated so far, with some as strong at resonance."""
    points = [point for point in posterior.points if point.ratio > 0.0]
    if not points:
        return [[None]]
    best = max(points, key=lambda p: float(np.max(p.found.log_weight)) + p.log_volume)
    strength = best.ratio * at_resonance(best.tau)
    others = [2.0 * math.pi * periods for periods in _FORCE_PERIODS]
    alike: list[Place | None] = [
        (math.log(strength / at_resonance(tau)), math.log(tau)) for tau in (best.tau, *others)
    ]
    return [[None], alike]


class BestSet:
    """The best set of columns of a regression, to be evaluated under other noise and forces."""

    def __init__(self, regression: LawRegression, posterior: Posterior) -> None:
        self.regression = regression
        chosen = posterior.problem.sets[posterior.best.row]
        self.reference, self.positive = regression.reference[chosen], regression.positive[chosen]
        scaled = (regression.columns * regression.scale)[:, chosen]
        self.block = np.column_stack([scaled, regression.target - scaled @ self.reference])

    def under(self, clock: Clock, ratio: float, tau: float) -> tuple[float, float]:
        """Its log evidence, and the variance of the noise."""
        found = evaluate_sets(
            whiten(self.block, clock, self.regression.row, ratio, tau),
            self.reference,
            self.positive,
            np.ones((1, self.reference.size), dtype=np.bool_),
            np.zeros(1),
            least_noise2=self.regression.least_noise**2,
        )
        return float(found.log_weight[0]), float(found.noise2[0])


class _Density:
    """Log posterior density of a correlated error and a random force, of each or of neither.

    Both are ``(log ratio, log correlation time)`` or None; the set of columns is the best so far.
    """

    def __init__(
        self, regression: LawRegression, posterior: Posterior, prior: ForcePrior, bounds: Place
    ) -> None:
        self.best, self.prior, self.bounds = BestSet(regression, posterior), prior, bounds

    def __call__(self, force: Place | None, error: Place | None) -> float:
        if error is not None and not self.bounds[0] <= error[1] <= self.bounds[1]:
            return -_FAR
        ratio, tau = (0.0, 1.0) if force is None else (math.exp(each) for each in force)
        of_sensor = (
            CorrelatedError() if error is None else CorrelatedError(*(math.exp(each) for each in error))
        )
        clock = replace(self.best.regression.clock, error=of_sensor)
        value, noise2 = self.best.under(clock, ratio, tau)
        if error is not None:
            value += self.log_prior(error)
        if force is None:
            return value + math.log(self.prior.none)
        return max(value + float(self.prior.log_density(ratio * math.sqrt(noise2), tau)), -_FAR)

    def log_prior(self, error: Place) -> float:
        """Log prior density of an error."""
        sd, range_of_time = settings.SETTINGS.error_ratio_sd, self.bounds[1] - self.bounds[0]
        return -0.5 * ((error[0] / sd) ** 2 + math.log(2.0 * math.pi)) - math.log(sd * range_of_time)

    def climb(self, force: Place | None, error: Place) -> tuple[Place | None, Place]:
        """The mode near a place."""
        start = np.array([*error, *(force or ())])

        def place(at: Array) -> tuple[Place | None, Place]:
            return (float(at[2]), float(at[3])) if force else None, (float(at[0]), float(at[1]))

        def misfit(at: Array) -> float:
            return -self(*place(at))

        found = minimize(
            misfit,
            start,
            method="Nelder-Mead",
            options={
                "maxfev": 60 * start.size,
                "xatol": _TOLERANCE,
                "fatol": 0.05,
                "initial_simplex": start + _FIRST_STEP * np.eye(start.size + 1, start.size, -1),
            },
        )
        return place(found.x)

    def log_sds(self, force: Place | None, error: Place) -> Array:
        """Logarithms of the sds of both numbers of an error, each given all others, shape (2,)."""
        top = self(force, error)
        sds = []
        sd_of_time = (self.bounds[1] - self.bounds[0]) / math.sqrt(12.0)
        for j, widest in enumerate((settings.SETTINGS.error_ratio_sd, sd_of_time)):
            steps = [tuple(np.array(error) + sign * _STENCIL * np.eye(2)[j]) for sign in (-1.0, 1.0)]
            lost = max(2.0 * top - sum(max(self(force, (a, b)), top - 4.0) for a, b in steps), 0.0)
            sds.append(min(_STENCIL / math.sqrt(max(lost, 1e-12)), widest))
        return np.log(sds)


@dataclass(frozen=True, eq=False)
class Colour:
    """Noise of the sensor that is coloured.

    Attributes
    ----------
    autoregression : Autoregression or None
        None where the noise is taken as white, being weaker far above the motion's frequency.
    least_noise : float
        Least sd of the noise, natural units.
    """

    autoregression: Autoregression | None
    least_noise: float = 0.0
    share = 1.0
    """Sd of the whole noise over that of the part that a posterior knows: all of it."""

    @property
    def log_volume(self) -> float:
        """Penalty of its coefficients in log evidence, negative."""
        return 0.0 if self.autoregression is None else -self.autoregression.penalty

    def of(self, clock: Clock, w0: float) -> Clock:
        """A clock with this noise, which goes from sample to sample whatever the frequency ``w0`` [rad/s]."""
        return replace(clock, autoregression=self.autoregression)

    def alike(self, other: object) -> bool:
        """Whether another is as good: it follows the residual of the law, and converges with that."""
        return isinstance(other, Colour)

    def described(self, step: float) -> dict[str, float | int | str]:
        """Fields of the report, of samples every ``step`` [s]."""
        if self.autoregression is None:
            return {"model": "ar", "order": 0, "correlation_length_s": step}
        # the correlation extends beyond as many samples as there are coefficients
        correlation = np.fft.irfft(self.autoregression.spectrum(np.linspace(0.0, math.pi, _GRID)))[:_GRID]
        below = np.flatnonzero(correlation < correlation[0] / math.e)
        length = int(below[0]) if below.size else correlation.size
        order = self.autoregression.order
        return {"model": "ar", "order": order, "correlation_length_s": float(step * length)}


def colour_of(residual: Array, fitted: int) -> Colour | None:
    """Colour of the residual of a law with so many coefficients, shape (n,); None where that is white."""
    own, _ = burg(residual, fitted)
    # behind a filter that removes everything an autoregression is singular to rounding
    return Colour(own.levelled(0.0, 0.0)) if own.order else None


def is_coloured(residual: Array, step: float, frequency: float) -> bool:
    """Whether the spectrum above the harmonics of a motion [rad/s] is not flat, with a ``step`` [s]."""
    n = residual.size
    limit = float(settings.SETTINGS.far * 1.4826 * np.median(np.abs(residual - np.median(residual))))
    tame = np.clip(residual - residual.mean(), -limit, limit)
    power = np.abs(np.fft.rfft(tame * np.hanning(n)))[1:-1] ** 2
    lowest = frequency * step * n / (2.0 * math.pi)
    first = int(settings.SETTINGS.quiet_harmonic * lowest)
    if power.size - first < 20 * settings.SETTINGS.bins:
        # sampled too coarsely to look above all of its harmonics: above half of them instead
        first = int(0.5 * settings.SETTINGS.quiet_harmonic * lowest)
    bands = np.array_split(power[first:], settings.SETTINGS.bins)
    size = min(band.size for band in bands)
    if size < 10:
        return False
    # medians, so that a line of interference does not count as colour
    level = np.log([np.median(band) for band in bands])
    variance = _HANN_SPREAD / (size * math.log(2.0) ** 2)
    statistic = float(np.sum((level - level.mean()) ** 2)) / variance
    p_value = float(stats.chi2.sf(statistic, settings.SETTINGS.bins - 1))
    return p_value < settings.SETTINGS.noise_alarm_rate
