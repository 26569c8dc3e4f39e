"""What a fit of the whole signal says, whichever forward model it was made with."""

from __future__ import annotations

import math

from scipy import stats

from friction_bayes.conjugate.regression import NormalInverseGamma, mean_error_sd
from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import inverse_square
from friction_bayes.decay.calibrated import force_factor
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.whiteness import residual_notes
from friction_bayes.estimators.base import Fit
from friction_bayes.estimators.waveform.signal_target import SignalModel, signal_target

__all__ = ["signal_fit"]

_JUMPS = (
    "an acceleration jumps at its turning points: a sample that changes its half cycle changes the "
    "likelihood at once, which the closed form, linear about its optimum, does not follow; a sampler that "
    "does may put the mean a tenth of an sd elsewhere, and more in a short record"
)


def signal_fit(
    decay: FreeDecay,
    model: SignalModel,
    prior: NormalInverseGamma,
    posterior: NormalInverseGamma,
    *,
    coefficients: Array,
    rest_position: float,
    prediction: Array,
    notes: tuple[str, ...] = (),
) -> Fit:
    """Put a fit together.

    Parameters
    ----------
    decay : FreeDecay
        The record.
    model : SignalModel
        The signal; ``friction_coefficient`` and ``frequency`` are among its names.
    prior, posterior : NormalInverseGamma
        Of its coefficients and the error variance.
    coefficients : ndarray, shape (p,)
        The optimum.
    rest_position : float
        Unit of the signal.
    prediction : ndarray, shape (n,)
        The signal at the optimum.
    notes : tuple of str
        What is to be said before the residuals speak.
    """
    if decay.quantity.order == 2:
        notes = (*notes, _JUMPS)
    friction, frequency = (model.names.index(name) for name in ("friction_coefficient", "frequency"))
    alpha, beta = posterior.alpha, posterior.beta
    scale = float(model.scale[frequency])
    return Fit(
        coefficient=posterior.marginal(friction),
        precision=stats.gamma(alpha, scale=1.0 / beta),
        precision_unit=inverse_square(decay.unit),
        posterior=posterior,
        amplitudes=model.blocks.size - 1,
        frequency=float(coefficients[frequency]) * scale,
        frequency_sd=math.sqrt(posterior.coefficients.shape[frequency, frequency]) * scale,
        rest_position=rest_position,
        noise_sd=float(mean_error_sd(alpha, beta)),
        prediction=prediction,
        target=signal_target(
            model, prior, posterior, force_factor=force_factor(decay.system, decay.quantity, decay.unit)
        ),
        notes=(*notes, *residual_notes(decay.values - prediction, prediction)),
    )
