r"""Whether a sensor saturates below noise that comes on top: tops that are flat and yet never twice the same.

The samples well inside the range determine frequency, phase and amplitude of every half cycle, and so what
the others should show. Where these stay at one level instead, whatever they should show beyond it, the
likelihood of a saturated sensor exceeds that of half cycles of the right shape, each of any size ``g``,

.. math:: \Lambda(L) = \sum_{|s_i| > L} \frac{(y_i - d_i - g s_i)^2 - (y_i - L)^2}{2 \mathrm{var}(y_i - s_i)},

with the level ``L`` averaged over the range, on either side or on both. A filter bends the motion near its
corners too, but by the same ``d`` in every half cycle: it is seen in those whose tops stay below the level.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.estimators.waveform.coulomb_signal import signal_derivatives, signals
from friction_bayes.estimators.waveform.least_squares import fit_waveforms
from friction_bayes.estimators.waveform.normal_equations import ADVANCE, COEFFICIENTS, PHASE, Samples

__all__ = ["refuse_saturated", "saturation_level"]

_INSIDE = 0.55
"""Of the largest excursion: a sensor that saturates lower has lost more than half of the motion."""
_LEVELS = np.linspace(_INSIDE, 1.0, 46)[:-1]
_LOG_PRIOR = math.log(0.01)
"""Of a sensor that saturates, on one side or on both."""
_SURE = math.log(100.0)
_LINEAR = 0.005
"""Of the range, to which sensor and law of motion are taken to be exact."""
_BINS = 24
"""Of the phase of a half cycle, for what all of them have in common."""
_LIKE_NOISE = 3.0
"""Standard deviations by which a flat top may scatter (root mean square): what is further is no flat top."""


def saturation_level(decay: FreeDecay) -> float | None:
    """Level about the rest position at which the sensor saturates, unit of the signal; None where it is none.

    Nor is it told of a pendulum's large swings, or where too few samples lie inside.
    """
    if swing_frequency(decay.system, decay.unit) > 0.0:
        return None
    away = decay.values - decay.rest_position
    largest = float(np.max(np.abs(away)))
    inside = np.abs(away) < _INSIDE * largest
    count = int(np.count_nonzero(inside))
    if count < 4 * COEFFICIENTS:
        return None
    order, places = decay.quantity.order, decay.places
    advance = 0.5 * decay.frequency * decay.duration
    located = decay.located._replace(
        stop=np.array([count]), frequency=np.array([2.0 * advance / (count - 1)])
    )
    fits = fit_waveforms(
        away[inside][None],
        located._replace(rest_position=np.zeros(1)),
        order,
        0.0,
        places=np.ascontiguousarray(places[inside]),
    )
    if not fits.found[0]:
        return None
    p, kappa, stop = fits.coefficients[0], float(fits.kappa[0]), int(fits.stop[0])
    samples = Samples(away.size, np.ascontiguousarray(places))
    expected = signals(samples, order, p[None], kappa, stop)[0]
    noise2 = float(fits.misfit[0]) / (count - COEFFICIENTS)
    jacobian, _ = signal_derivatives(samples, order, p, kappa, stop)
    told = np.einsum("ni,ij,nj->n", jacobian, np.linalg.inv(fits.normal[0]), jacobian)
    # what sensor and law are wrong by goes on over a bin: so many samples say of it what one does
    in_bin = max(math.pi * (away.size - 1) / (2.0 * p[ADVANCE] * _BINS), 1.0)
    variance = noise2 * (1.0 + told) + in_bin * (_LINEAR * largest) ** 2
    angle = p[ADVANCE] * places + p[PHASE]
    half_cycle = np.rint((angle + 0.5 * order * math.pi) / math.pi).astype(np.int64)
    # a filter is still settling then
    variance[half_cycle <= half_cycle[0]] = np.inf
    phase = angle + 0.5 * order * math.pi - math.pi * half_cycle
    bins = np.clip(((phase / math.pi + 0.5) * _BINS).astype(np.intp), 0, _BINS - 1)
    tops = _Tops(away, expected, variance, half_cycle, bins)
    found, level = [], []
    for sides in ((1.0,), (-1.0,), (1.0, -1.0)):
        for share in _LEVELS:
            gain, flat = tops.gain(sides, share * largest)
            found.append(gain if flat else -math.inf)
            level.append(share * largest)
    evidence = float(logsumexp(found)) - math.log(len(found)) + _LOG_PRIOR
    return level[int(np.argmax(found))] if evidence > _SURE else None


def refuse_saturated(decay: FreeDecay) -> None:
    """Refuse a decay whose tops are flat below noise.

    Raises
    ------
    InputError
        Saying how far from the rest position they are flat.
    """
    level = saturation_level(decay)
    if level is not None:
        raise InputError(
            decay.name,
            f"the sensor saturates: tops are flat some {level:.4g} {decay.unit} from the rest position",
            "start after them (--start), or take a sensor with more range",
        )


class _Tops(NamedTuple):
    """The samples, what they should show, its variance, half cycle and bin of the phase, shape (n,) each."""

    away: Array
    expected: Array
    variance: Array
    half_cycle: Integers
    bins: Integers

    def gain(self, sides: tuple[float, ...], level: float) -> tuple[float, bool]:
        """Log likelihood ratio of a sensor that saturates at a level, and whether tops scatter as noise."""
        beyond = np.logical_or.reduce([side * self.expected > level for side in sides])
        y, s, weight = self.away[beyond], self.expected[beyond], 1.0 / self.variance[beyond]
        other = y - np.sign(s) * self._common(beyond)[self.bins[beyond]]
        _, own = np.unique(self.half_cycle[beyond], return_inverse=True)
        crossed, square = (np.bincount(own, weight * each * s) for each in (other, s))
        size = (crossed / np.where(square > 0.0, square, 1.0))[own]
        flat = weight * (np.abs(y) - level) ** 2
        gain = 0.5 * float(np.sum(weight * (other - size * s) ** 2 - flat))
        return gain, bool(flat.sum() <= _LIKE_NOISE**2 * np.count_nonzero(weight))

    def _common(self, beyond: Mask) -> Array:
        """What half cycles that stay below the level show beyond the law, by bin of the phase."""
        below = ~np.isin(self.half_cycle, self.half_cycle[beyond])
        bins, weight = self.bins[below], 1.0 / self.variance[below]
        wrong = np.sign(self.expected[below]) * (self.away[below] - self.expected[below])
        total = np.bincount(bins, weight, _BINS)
        return np.bincount(bins, weight * wrong, _BINS) / np.where(total > 0.0, total, 1.0)
