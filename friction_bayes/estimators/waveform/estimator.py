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
from collections.abc import Mapping

import numpy as np
from scipy.linalg import solve_triangular

from friction_bayes.conjugate.likelihood import RegressionStatistics
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.estimators.base import Fit, register
from friction_bayes.estimators.priors import coefficient_bounds, default_prior, prior_keys
from friction_bayes.estimators.waveform.coulomb_signal import (
    CURVED_PAIRS,
    crossing_misfit,
    exact_misfit,
    signal_derivatives,
    signals,
    turning_samples,
)
from friction_bayes.estimators.waveform.least_squares import WaveformFits, fit_waveforms, prior_of
from friction_bayes.estimators.waveform.normal_equations import COEFFICIENTS
from friction_bayes.estimators.waveform.pendulum_fit import fit_pendulum
from friction_bayes.estimators.waveform.signal_expansion import SignalExpansion, agrees_near
from friction_bayes.estimators.waveform.signal_fit import signal_fit
from friction_bayes.estimators.waveform.signal_target import SignalModel

__all__ = ["NAMES", "WAVEFORM", "WaveformEstimator"]

NAMES = ("offset", "amplitude", "friction_coefficient", "frequency", "phase")
"""Coefficients; amplitude and phase are those in the middle of the record."""

_BAND = 3.0


class WaveformEstimator:
    """Conjugate regression on the whole signal; ``peaks`` plays no part, since none is picked."""

    name = "waveform"
    prior_keys = prior_keys("waveform")

    def default_prior(self, decay: FreeDecay) -> dict[str, float]:
        """Weak prior derived from the declared system, see :mod:`friction_bayes.estimators.priors`."""
        return default_prior(self.name, decay.system, decay.quantity, decay.unit)

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior of one free decay.

        Raises
        ------
        InputError
            If no Coulomb decay fits the record.
        """
        if decay.system.pendulum and decay.unit not in UNCALIBRATED_UNITS:
            return fit_pendulum(decay, prior)
        n = decay.values.size
        fits = fit_waveforms(
            decay.values[None],
            decay.located,
            decay.quantity.order,
            prior["coefficient_precision"],
            rest_known=decay.rest_known,
        )
        if not fits.found[0]:
            raise InputError(
                decay.name,
                "no Coulomb decay fits the record",
                "give start or a longer record, or use envelope",
            )
        p, kappa, stop = fits.coefficients[0], float(fits.kappa[0]), int(fits.stop[0])
        free = slice(1 if decay.rest_known else 0, COEFFICIENTS)
        data = _linearised(fits, n, free)
        before = prior_of(prior, p[free].size)
        after = before.update_statistics(data)
        return signal_fit(
            decay,
            _model(decay, p, kappa, stop, after, prior["coefficient_precision"]),
            before,
            after,
            coefficients=p[free],
            rest_position=float(p[0]),
            prediction=signals(n, decay.quantity.order, p[None], kappa, stop)[0],
        )


def _linearised(fits: WaveformFits, n: int, free: slice) -> RegressionStatistics:
    """Reduce the signal linearised at the optimum of the first record, in the coefficients that are free."""
    factor = np.asarray(np.linalg.cholesky(fits.normal[0, free, free]).T, dtype=np.float64)
    step = solve_triangular(factor, fits.gradient[0, free], trans="T")
    projected = factor @ fits.coefficients[0, free] + step
    return RegressionStatistics(n, factor, projected, max(float(fits.misfit[0] - step @ step), 0.0))


def _model(
    decay: FreeDecay, p: Array, kappa: float, stop: int, after: NormalInverseGamma, precision: float
) -> SignalModel:
    """The whole signal, all coefficients free, for the sampler."""
    values, order, n = decay.values, decay.quantity.order, decay.values.size
    skip = COEFFICIENTS - after.size
    half_duration = 0.5 * (n - 1) * decay.step
    jacobian, curvature = signal_derivatives(n, order, p, kappa, stop)
    pairs = np.array(CURVED_PAIRS) - skip
    residual = values - signals(n, order, p[None], kappa, stop)[0]
    expansion = SignalExpansion.of(p[skip:], residual, jacobian[:, skip:], curvature, pairs)

    def whole(q: Array) -> Array:
        return np.ascontiguousarray(np.column_stack([np.full((len(q), skip), p[0]), q]))

    def exact(q: Array) -> Array:
        return np.asarray(exact_misfit(values, order, whole(q), kappa, stop))

    def expanded(q: Array) -> Array:
        return expansion.misfit(q) + crossing_misfit(values, order, p, whole(q), kappa, stop)

    covariance = after.coefficients.shape
    fast = agrees_near(expanded, exact, p[skip:], covariance, after.beta / after.alpha)
    advance = decay.system.natural_frequency * half_duration
    free = coefficient_bounds(precision, decay.system, decay.quantity, decay.unit)
    bounds = np.array([free] * 3 + [(advance / _BAND, advance * _BAND), (p[4] - math.pi, p[4] + math.pi)])
    bounds[3] = min(bounds[3, 0], 0.5 * p[3]), max(bounds[3, 1], 2.0 * p[3])
    return SignalModel(
        names=NAMES[skip:],
        scale=np.array([1.0, 1.0, 1.0, 1.0 / half_duration, 1.0])[skip:],
        bounds=bounds[skip:],
        signal=lambda q: signals(n, order, whole(q), kappa, stop),
        misfit=expanded if fast else exact,
        blocks=turning_samples(n, p, stop),
        observed=values,
    )


WAVEFORM = register(WaveformEstimator())
