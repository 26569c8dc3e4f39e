"""The method ``envelope``: conjugate regression on the amplitude of every half cycle.

The amplitudes themselves are the data, not their differences: with few unknowns - initial amplitude, friction
coefficient, rest position - they lie on a straight line, their errors are independent and equal, and the
posterior is a normal-inverse-gamma in closed form. See :mod:`friction_bayes.conjugate.half_cycle_data`. The
noise level is judged by how half cycles scatter about that line, not by the samples within them, so that
noise which is correlated from sample to sample narrows the interval little.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.special import gammaln

from friction_bayes.conjugate.estimator import Fit, register
from friction_bayes.conjugate.half_cycle_data import half_cycle_rows
from friction_bayes.conjugate.priors import complete_prior, default_prior, prior_keys
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.conjugate.targets import regression_target
from friction_bayes.errors import InputError
from friction_bayes.free_decay import FreeDecay
from friction_bayes.halfcycles import force_factor, swing_frequency, tracked_phase
from friction_bayes.mechanics.swing import frequency_ratio, linear_amplitude, third_harmonic
from friction_bayes.quantities import inverse_square

__all__ = ["COEFFICIENTS", "ENVELOPE", "EnvelopeEstimator"]

COEFFICIENTS = ("initial_amplitude", "friction_coefficient", "rest_position")
"""Columns of the regression: ``a``, ``u`` and ``c``, all in the unit of the signal."""

_MIN_ROWS = 4
_GRID = 513

Array = NDArray[np.float64]


class EnvelopeEstimator:
    """Conjugate regression on half cycles; ``peaks`` plays no part, since none is picked."""

    name = "envelope"
    prior_keys = prior_keys("envelope")

    def default_prior(self, decay: FreeDecay) -> dict[str, float]:
        """Weak prior derived from the declared system, see :mod:`friction_bayes.conjugate.priors`."""
        return default_prior(self.name, decay.system, decay.quantity, decay.unit)

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior of one free decay; what ``prior`` leaves out is the default.

        Raises
        ------
        InputError
            If the record holds too few samples in too few half cycles.
        """
        polynomial, values, reference = tracked_phase(decay)
        prior = complete_prior(self.default_prior(decay), prior)
        order, swing = decay.quantity.order, swing_frequency(decay)
        response, design, half_cycles = half_cycle_rows(values, polynomial, order, swing)
        if not np.all(np.isfinite(response)):
            raise InputError(
                decay.name,
                f"{decay.quantity.name} does not tell the amplitude of swings this large",
                "start later in the record, or check inertia, stiffness and unit",
            )
        if response.size < _MIN_ROWS:
            raise InputError(
                decay.name,
                f"{half_cycles} half cycles could be fitted, with {response.size} data for three unknowns",
                "give a longer record or one sampled faster",
            )
        response = response + reference * design[:, 2]
        before = NormalInverseGamma.from_prior(
            mean=np.zeros(3),
            precision=prior["coefficient_precision"],
            alpha=prior["alpha"],
            beta=prior["beta"],
        )
        after = before.update(design, response)
        return Fit(
            coefficient=after.marginal(1),
            precision=stats.gamma(after.alpha, scale=1.0 / after.beta),
            precision_unit=inverse_square(decay.unit),
            posterior=after,
            amplitudes=half_cycles,
            frequency=_frequency(polynomial, decay, after.mean, swing),
            frequency_sd=math.nan,
            rest_position=float(after.mean[2]),
            noise_sd=math.sqrt(after.beta) * math.exp(gammaln(after.alpha - 0.5) - gammaln(after.alpha)),
            prediction=_prediction(polynomial, decay, after.mean, swing),
            target=regression_target(
                before,
                design,
                response,
                names=COEFFICIENTS,
                friction="friction_coefficient",
                force_factor=force_factor(decay),
                observed_name="half_cycle_projection",
            ),
            notes=_notes(decay, swing),
        )


def _notes(decay: FreeDecay, swing: float) -> tuple[str, ...]:
    notes = [
        "the noise level is that of white noise which would scatter the half cycles as they do about a "
        "straight loss of amplitude"
    ]
    if decay.system.pendulum and swing == 0.0:
        notes.append("the sensor is not calibrated: swings of the pendulum are taken as small")
    return tuple(notes)


def _linear_swing(polynomial: Array, order: int, mean: Array, positions: Array) -> tuple[Array, Array, Array]:
    """Signal phase, half cycle number and amplitude (linear in friction) at positions in [-1, 1]."""
    chi = np.asarray(np.polynomial.chebyshev.chebval(positions, polynomial), dtype=np.float64)
    half = np.floor((chi - 0.5 * order * math.pi) / math.pi)
    return chi, half, mean[0] - (2.0 * half + 1.0) * mean[1]


def _fundamental(amplitude: Array, order: int, swing: float) -> Array:
    """Fourier amplitude of the signal of a pendulum, from the amplitude that is linear in friction."""
    unit = swing**order
    grid = np.linspace(0.0, 3.0, _GRID) * unit
    table = np.array([linear_amplitude(b, order, swing)[0] for b in grid])
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(table)) > 0.0])
    return np.sign(amplitude) * np.interp(np.abs(amplitude), table[rising], grid[rising])


def _prediction(polynomial: Array, decay: FreeDecay, mean: Array, swing: float) -> Array:
    """Fitted signal over ``decay.time``, shape (n,)."""
    order = decay.quantity.order
    chi, half, amplitude = _linear_swing(polynomial, order, mean, np.linspace(-1.0, 1.0, decay.values.size))
    shift = np.where(half % 2.0 == 0.0, mean[1], -mean[1]) if order == 0 else 0.0
    if swing == 0.0:
        return mean[2] + shift + amplitude * np.cos(chi)
    fundamental = _fundamental(amplitude, order, swing)
    ratio = np.array([third_harmonic(b, order) for b in np.unique(fundamental) / swing**order])
    third = ratio[np.unique(fundamental, return_inverse=True)[1]] * np.cos(3.0 * chi)
    return mean[2] + shift + fundamental * (np.cos(chi) + third)


def _frequency(polynomial: Array, decay: FreeDecay, mean: Array, swing: float) -> float:
    """Angular frequency [rad/s] of small motion: slope of the phase, weighted by the squared amplitude.

    A pendulum's phase is first brought to that of small swings.
    """
    order = decay.quantity.order
    positions = np.linspace(-1.0, 1.0, _GRID)
    chi, _, amplitude = _linear_swing(polynomial, order, mean, positions)
    if swing > 0.0:
        fundamental = _fundamental(amplitude, order, swing) / swing**order
        ratio = np.array([frequency_ratio(b, order) for b in fundamental])
        steps = np.diff(chi) * 2.0 / (ratio[1:] + ratio[:-1])
        chi = np.concatenate([[0.0], np.cumsum(steps)])
    time = 0.5 * (positions + 1.0) * (decay.values.size - 1) * decay.step
    weights = np.abs(amplitude)
    return float(np.polynomial.Polynomial.fit(time, chi, 1, w=weights).convert().coef[1])


ENVELOPE = register(EnvelopeEstimator())
