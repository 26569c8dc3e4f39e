"""The result of a fit of the whole signal, with any forward model."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from scipy import stats

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.regression import NormalInverseGamma, mean_error_sd
from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import inverse_square
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.whiteness import residual_notes
from friction_bayes.estimators.base import Fit, FittedMotion
from friction_bayes.estimators.waveform.signal_target import SignalModel, signal_target

__all__ = ["FittedSignal", "signal_fit"]

_JUMPS = (
    "an acceleration jumps at its turning points: a sample that changes its half cycle changes the "
    "likelihood at once, which the closed form, linear about its optimum, does not follow; a sampler that "
    "does may put the mean a tenth of an sd elsewhere, and more in a short record"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedSignal:
    """The signal that fits a record best.

    Attributes
    ----------
    coefficients : mapping of str to float
        In order; ``friction_coefficient`` and ``frequency`` are among the names.
    frequency_scale : float
        From the coefficient named ``frequency`` to rad/s.
    half_cycles : int
        How many lie in the record.
    rest_position : float
        Unit of the signal.
    prediction : ndarray, shape (n,)
        The signal.
    motion : FittedMotion
        The motion that it shows.
    jumps : bool
        Whether a sample that counts may be of either half cycle, of which an acceleration makes a jump.
    """

    coefficients: Mapping[str, float]
    frequency_scale: float
    half_cycles: int
    rest_position: float
    prediction: Array
    motion: FittedMotion
    jumps: bool


def signal_fit(
    decay: FreeDecay,
    build_model: Callable[[], SignalModel],
    prior: NormalInverseGamma,
    posterior: NormalInverseGamma,
    fitted: FittedSignal,
    notes: tuple[str, ...] = (),
) -> Fit:
    """Return a fit, put together from its parts.

    Parameters
    ----------
    decay : FreeDecay
        The record.
    build_model : callable, () -> SignalModel
        Makes the signal as the sampler sees it.
    prior, posterior : NormalInverseGamma
        Of its coefficients and the error variance.
    fitted : FittedSignal
        The optimum.
    notes : tuple of str
        Remarks that precede those on the residuals.
    """
    if fitted.jumps:
        notes = (*notes, _JUMPS)
    names, scale = list(fitted.coefficients), fitted.frequency_scale
    friction, frequency = (names.index(name) for name in ("friction_coefficient", "frequency"))
    alpha, beta = posterior.alpha, posterior.beta
    return Fit(
        coefficient=posterior.marginal(friction),
        precision=stats.gamma(alpha, scale=1.0 / beta),
        precision_unit=inverse_square(decay.unit),
        posterior=posterior,
        amplitudes=fitted.half_cycles,
        frequency=float(fitted.coefficients["frequency"]) * scale,
        frequency_sd=math.sqrt(posterior.coefficients.shape[frequency, frequency]) * scale,
        rest_position=fitted.rest_position,
        noise_sd=float(mean_error_sd(alpha, beta)),
        prediction=fitted.prediction,
        motion=fitted.motion,
        build_target=partial(_target, decay, build_model, prior, posterior),
        notes=(*notes, *residual_notes(decay.values - fitted.prediction, fitted.prediction)),
    )


def _target(
    decay: FreeDecay,
    build_model: Callable[[], SignalModel],
    prior: NormalInverseGamma,
    posterior: NormalInverseGamma,
) -> Target:
    return signal_target(build_model(), prior, posterior, force_factor=decay.force_factor)
