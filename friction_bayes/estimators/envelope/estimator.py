"""The method ``envelope``: conjugate regression on the amplitude of every half cycle.

The amplitudes themselves are the data, not their differences: with few unknowns - initial amplitude, friction
coefficient, rest position - they lie on a straight line, their errors are independent and equal, and the
posterior is a normal-inverse-gamma in closed form. See
:mod:`friction_bayes.estimators.envelope.half_cycle_rows`. The noise level is estimated from the scatter of
half cycles about that line, not from the samples within them, so that noise which is correlated from sample
to sample narrows the interval little.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial

import numpy as np
from scipy import stats

from friction_bayes.conjugate.regression import CoefficientMarginals, NormalInverseGamma, mean_error_sd
from friction_bayes.conjugate.sufficient_statistics import RegressionStatistics
from friction_bayes.conjugate.targets import regression_target
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import inverse_square
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.phase_tracking import tracked_phase
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.estimators.base import Fit, Fits, FreeDecays
from friction_bayes.estimators.envelope.half_cycle_rows import envelope_statistics, half_cycle_rows
from friction_bayes.estimators.envelope.signal import envelope_signal, small_motion_frequency
from friction_bayes.estimators.priors import TabulatedPrior

__all__ = ["ENVELOPE_COEFFICIENTS", "EnvelopeEstimator"]

ENVELOPE_COEFFICIENTS = ("initial_amplitude", "friction_coefficient", "rest_position")
"""Columns of the regression: ``a``, ``u`` and ``c``, all in the unit of the signal."""

INITIAL_AMPLITUDE, FRICTION, REST_POSITION = range(3)
"""Their places."""

_MIN_ROWS = 4
"""Fewest data for the three coefficients and a scatter."""


class EnvelopeEstimator(TabulatedPrior):
    """Conjugate regression on half cycles; ``peaks`` is not used, since none is picked."""

    name = "envelope"

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior of one free decay.

        Raises
        ------
        InputError
            If the record holds too few samples in too few half cycles.
        """
        polynomial, values, reference = tracked_phase(decay)
        order, swing = decay.quantity.order, swing_frequency(decay.system, decay.unit)
        response, design, place = half_cycle_rows(values, polynomial, order, swing)
        if not np.all(np.isfinite(response)):
            raise InputError(
                decay.name,
                f"{decay.quantity.name} does not give the amplitude of swings this large",
                "start later in the record, or check inertia, stiffness and unit",
            )
        if response.size < _MIN_ROWS:
            raise InputError(
                decay.name,
                f"{place.size} half cycles could be fitted, with {response.size} data for three unknowns",
                "give a longer record or one sampled faster",
            )
        response = response + reference * design[:, REST_POSITION]
        before = _prior_of(prior)
        after = before.update(design, response)
        duration = np.array([(values.size - 1) * decay.step])
        return Fit(
            coefficient=after.marginal(FRICTION),
            precision=stats.gamma(after.alpha, scale=1.0 / after.beta),
            precision_unit=inverse_square(decay.unit),
            posterior=after,
            amplitudes=place.size,
            frequency=float(
                small_motion_frequency(polynomial[None], duration, order, after.mean[None], swing)[0]
            ),
            frequency_sd=math.nan,
            rest_position=float(after.mean[REST_POSITION]),
            noise_sd=float(mean_error_sd(after.alpha, after.beta)),
            prediction=envelope_signal(polynomial, values.size, order, after.mean, swing),
            build_target=partial(
                regression_target,
                before,
                design,
                response,
                names=ENVELOPE_COEFFICIENTS,
                friction=ENVELOPE_COEFFICIENTS[FRICTION],
                force_factor=decay.force_factor,
                observed_name="half_cycle_projection",
            ),
            notes=_notes(decay, swing),
        )

    def fit_many(self, decays: FreeDecays, prior: Mapping[str, float], *, peaks: str) -> Fits:
        """Closed-form posteriors of many free decays."""
        before = _prior_of(prior)
        many = envelope_statistics(*decays.kernel_arguments)
        found = np.isfinite(many.residual) & (many.rows >= _MIN_ROWS)
        data = RegressionStatistics.of_normal_equations(
            many.rows,
            np.where(found[:, None, None], many.gram, np.eye(len(ENVELOPE_COEFFICIENTS))),
            np.zeros_like(many.coefficients),
            np.where(found[:, None], many.coefficients, 0.0),
            np.where(found, many.residual, 0.0),
        )
        posterior = CoefficientMarginals.of(before, data, found)
        fitted = np.isfinite(posterior.degrees)
        frequency = np.full(len(found), np.nan)
        frequency[fitted] = small_motion_frequency(
            many.polynomial[fitted],
            np.asarray((decays.counts[fitted] - 1) * decays.step, dtype=np.float64),
            decays.quantity.order,
            posterior.mean[fitted],
            swing_frequency(decays.system, decays.unit),
        )
        return Fits(
            family=stats.t,
            parameters=(posterior.degrees, posterior.mean[:, FRICTION], posterior.scale[:, FRICTION]),
            frequency=frequency,
            frequency_sd=np.full(len(found), np.nan),
            rest_position=posterior.mean[:, REST_POSITION],
            noise_sd=posterior.noise_sd,
        )


def _prior_of(prior: Mapping[str, float]) -> NormalInverseGamma:
    """Prior of the three coefficients and the error variance."""
    return NormalInverseGamma.from_prior(
        mean=np.zeros(3), precision=prior["coefficient_precision"], alpha=prior["alpha"], beta=prior["beta"]
    )


def _notes(decay: FreeDecay, swing: float) -> tuple[str, ...]:
    notes = [
        "the noise level is that of white noise which would scatter the half cycles as they do about a "
        "straight loss of amplitude"
    ]
    if decay.system.pendulum and swing == 0.0:
        notes.append("the sensor is not calibrated: swings of the pendulum are taken as small")
    return tuple(notes)
