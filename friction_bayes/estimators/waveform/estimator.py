"""The method ``waveform``: conjugate regression on the whole signal.

Given frequency and phase the signal of a Coulomb decay is linear in offset, amplitude and friction
coefficient. Gauss-Newton finds frequency and phase together with them; regression on the signal linearised
there, in all five, gives a normal-inverse-gamma posterior that carries the uncertainty of frequency and
phase. What is approximate in it is the linearisation in those two alone.

Priors: for offset, amplitude in the middle of the record and friction coefficient uniform and very wide, or
normal about zero, relative to the error variance; inverse gamma for that variance; uniform for frequency,
within a factor 3 of the declared one, and for phase. The number of half cycles until the
motion ends is taken as found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from scipy import stats

from friction_bayes.conjugate.regression import CoefficientMarginals, NormalInverseGamma
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.decay.free_decay import FreeDecay, no_decay_fits
from friction_bayes.decay.friction_samples import PEAKS
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.estimators.base import Fit, Fits, FittedMotion, FreeDecays
from friction_bayes.estimators.priors import TabulatedPrior, coefficient_bounds
from friction_bayes.estimators.waveform.coulomb_signal import (
    CURVED_PAIRS,
    crossing_misfit,
    exact_misfit,
    near_turns,
    signal_derivatives,
    signals,
    states,
    turning_samples,
)
from friction_bayes.estimators.waveform.glance import glance
from friction_bayes.estimators.waveform.least_squares import fit_waveforms, prior_of
from friction_bayes.estimators.waveform.normal_equations import (
    ADVANCE,
    COEFFICIENTS,
    EVENLY,
    FRICTION,
    OFFSET,
    PHASE,
    Samples,
)
from friction_bayes.estimators.waveform.pendulum_fit import fit_pendulum
from friction_bayes.estimators.waveform.signal_expansion import SignalExpansion, agrees_near
from friction_bayes.estimators.waveform.signal_fit import FittedSignal, signal_fit
from friction_bayes.estimators.waveform.signal_target import SignalModel
from friction_bayes.statespace.measured_path import NEAR_TURN

__all__ = ["WaveformEstimator", "white_noise_fit"]

_NAMES = ("offset", "amplitude", "friction_coefficient", "frequency", "phase")
"""Coefficients; amplitude and phase are those in the middle of the record."""

_BAND = 3.0
_SURELY = 4.0
"""Standard deviations of its phase within which a turning point lies."""


class WaveformEstimator(TabulatedPrior):
    """Conjugate regression on the whole signal; ``peaks`` is not used, since none is picked."""

    name = "waveform"

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior of one free decay.

        Raises
        ------
        InputError
            If no Coulomb decay fits the record.
        """
        if swing_frequency(decay.system, decay.unit) > 0.0:
            return fit_pendulum(decay, prior)
        samples = _samples(decay)
        fits = fit_waveforms(
            decay.values[None],
            decay.located,
            decay.quantity.order,
            prior["coefficient_precision"],
            rest_known=decay.rest_known,
            places=samples.places,
        )
        if not fits.found[0]:
            raise no_decay_fits(decay.name, decay.system)
        p, kappa, stop = fits.coefficients[0], float(fits.kappa[0]), int(fits.stop[0])
        free = slice(OFFSET + 1 if decay.rest_known else OFFSET, COEFFICIENTS)
        before = prior_of(prior, p[free].size)
        after = before.update_statistics(fits.linearised([samples.size], free).record(0))
        phase_variance = np.diag(after.coefficients.shape)[[ADVANCE - COEFFICIENTS, PHASE - COEFFICIENTS]]
        phase_sd = math.sqrt(float(phase_variance.sum()))
        fitted = FittedSignal(
            coefficients=dict(zip(_NAMES[free], after.mean, strict=True)),
            frequency_scale=2.0 / decay.duration,
            half_cycles=turning_samples(samples, p, stop).size - 1,
            rest_position=float(p[OFFSET] if decay.rest_known else after.mean[OFFSET]),
            prediction=signals(samples, decay.quantity.order, p[None], kappa, stop)[0],
            motion=FittedMotion(states(samples, p, kappa, stop), phase_sd),
            jumps=decay.quantity.order == 2 and _SURELY * phase_sd > NEAR_TURN,
        )
        precision = prior["coefficient_precision"]
        return signal_fit(
            decay, partial(_model, decay, p, kappa, stop, after, precision), before, after, fitted
        )

    def fit_many(self, decays: FreeDecays, prior: Mapping[str, float], *, peaks: str) -> Fits:
        """Closed-form posteriors of many free decays of a linear system.

        Raises
        ------
        InputError
            If the system is a pendulum.
        """
        if swing_frequency(decays.system, decays.unit) > 0.0:
            raise InputError(
                "system",
                "waveform integrates a pendulum's large swings one record at a time",
                "give method envelope, use estimate, or declare a rotational Oscillator for small swings",
            )
        counts = decays.counts
        fits = fit_waveforms(
            decays.values, decays.located, decays.quantity.order, prior["coefficient_precision"]
        )
        half_duration = np.where(counts > 1, 0.5 * (counts - 1) * decays.step, np.nan)
        # what takes the place of dropouts was not measured
        for row in [row for row in decays.dropouts if decays.usable[row]]:
            decay = decays.without_dropouts(row)
            own = fit_waveforms(
                decay.values[None],
                decay.located,
                decays.quantity.order,
                prior["coefficient_precision"],
                places=_samples(decay).places,
            )
            for many, one in zip(fits, own, strict=True):
                many[row] = one[0]
            counts[row], half_duration[row] = decay.values.size, 0.5 * decay.duration
        data = fits.linearised(counts, slice(OFFSET, COEFFICIENTS))
        posterior = CoefficientMarginals.of(prior_of(prior, COEFFICIENTS), data, fits.found)

        def residual(row: int) -> Array:
            decay, coefficients = decays.without_dropouts(row), fits.coefficients[row]
            kappa, stop = float(fits.kappa[row]), int(fits.stop[row])
            signal = signals(_samples(decay), decays.quantity.order, coefficients[None], kappa, stop)[0]
            return np.asarray(decay.values - signal)

        return Fits(
            family=stats.t,
            parameters=(posterior.degrees, posterior.mean[:, FRICTION], posterior.scale[:, FRICTION]),
            frequency=posterior.mean[:, ADVANCE] / half_duration,
            frequency_sd=posterior.scale[:, ADVANCE] / half_duration,
            rest_position=posterior.mean[:, OFFSET],
            noise_sd=posterior.noise_sd,
            residual=residual,
            glance=partial(glance, decays.values, decays.located, decays.quantity.order, fits),
        )


def white_noise_fit(decay: FreeDecay) -> Callable[[FreeDecay], Fit]:
    """How a decay, or a part of it, is fitted with its default prior."""
    estimator = WaveformEstimator()
    return partial(estimator.fit, prior=estimator.default_prior(decay), peaks=PEAKS[0])


def _samples(decay: FreeDecay) -> Samples:
    """Where the samples of a decay lie between its ends."""
    return Samples(decay.values.size, EVENLY if decay.evenly_spaced else decay.places)


def _model(
    decay: FreeDecay, p: Array, kappa: float, stop: int, after: NormalInverseGamma, precision: float
) -> SignalModel:
    """The whole signal, all coefficients free, for the sampler."""
    values, order, samples = decay.values, decay.quantity.order, _samples(decay)
    skip = COEFFICIENTS - after.size
    half_duration = 0.5 * decay.duration
    jacobian, curvature = signal_derivatives(samples, order, p, kappa, stop)
    pairs = np.array(CURVED_PAIRS) - skip
    residual = values - signals(samples, order, p[None], kappa, stop)[0]
    near = near_turns(samples, p, stop) if order == 2 else np.zeros(values.size, dtype=np.bool_)
    left_out, at = values[near], Samples(int(near.sum()), decay.places[near])
    used = ~near
    expansion = SignalExpansion.of(p[skip:], residual[used], jacobian[used, skip:], curvature[used], pairs)

    def whole(q: Array) -> Array:
        return np.ascontiguousarray(np.column_stack([np.full((len(q), skip), p[OFFSET]), q]))

    def exact(q: Array) -> Array:
        without = np.sum((left_out - signals(at, order, whole(q), kappa, stop)) ** 2, axis=1)
        return np.asarray(exact_misfit(values, samples, order, whole(q), kappa, stop) - without)

    def expanded(q: Array) -> Array:
        crossing = crossing_misfit(values, samples, order, p, whole(q), kappa, stop)
        if left_out.size:
            crossing -= crossing_misfit(left_out, at, order, p, whole(q), kappa, stop)
        return expansion.misfit(q) + crossing

    covariance = after.coefficients.shape
    fast = agrees_near(expanded, exact, p[skip:], covariance, after.beta / after.alpha)
    advance = decay.system.natural_frequency * half_duration
    free = coefficient_bounds(precision, decay.system, decay.quantity, decay.unit)
    slowest, fastest = min(advance / _BAND, 0.5 * p[ADVANCE]), max(advance * _BAND, 2.0 * p[ADVANCE])
    bounds = np.array([free, free, free, (slowest, fastest), (p[PHASE] - math.pi, p[PHASE] + math.pi)])
    return SignalModel(
        names=_NAMES[skip:],
        scale=np.array([1.0, 1.0, 1.0, 1.0 / half_duration, 1.0])[skip:],
        bounds=bounds[skip:],
        signal=lambda q: signals(samples, order, whole(q), kappa, stop),
        misfit=expanded if fast else exact,
        blocks=turning_samples(samples, p, stop),
        observed=values,
        used=used,
    )
