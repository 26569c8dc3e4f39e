"""The closed forms of every method for many records at once, by the kernels that serve one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.conjugate.normal_gamma import NormalGamma, posterior_parameters
from friction_bayes.conjugate.regression_batch import update_regressions
from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.quantities import Quantity
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.calibrated import force_factor, swing_frequency
from friction_bayes.decay.friction_samples import friction_sample_statistics
from friction_bayes.decay.release_and_rest import FOUND, Located
from friction_bayes.estimators.envelope.estimator import MIN_ROWS, envelope_prior
from friction_bayes.estimators.envelope.half_cycle_rows import envelope_statistics
from friction_bayes.estimators.envelope.signal import small_motion_frequency
from friction_bayes.estimators.waveform.least_squares import fit_waveforms
from friction_bayes.estimators.waveform.posterior import waveform_posteriors

__all__ = ["BATCH_FITS", "BatchFits", "BatchTask"]


@dataclass(frozen=True, kw_only=True, eq=False)
class BatchTask:
    """Records and what is known of all of them.

    Attributes
    ----------
    values : ndarray, shape (records, n)
        Samples.
    located : Located
        From :func:`friction_bayes.decay.free_decay.locate_free_decays`; rows where nothing was found are left
        out.
    step : float
        Sampling interval [s].
    system, quantity, unit
        What was measured, of what, and in which unit.
    prior : mapping
        Complete prior of the method.
    peaks : str
        How the paper's methods pick amplitudes.
    """

    values: Array
    located: Located
    step: float
    system: Oscillator
    quantity: Quantity
    unit: str
    prior: Mapping[str, float]
    peaks: str

    @property
    def usable(self) -> Mask:
        """Rows in which a free decay was found."""
        return self.located.status == FOUND

    @property
    def counts(self) -> Integers:
        """Samples in each moving part; none in a row that is left out."""
        return np.where(self.usable, self.located.stop - self.located.start, 0)

    @property
    def decays(self) -> tuple[Any, ...]:
        """Arguments that say to a half-cycle kernel where each decay lies, and what is known of it."""
        start, phase = self.located.start, self.located.phase
        frequency = self.located.frequency / self.step
        swing = swing_frequency(self.system, self.unit)
        order = self.quantity.order
        return self.values, self.step, frequency, phase, start, start + self.counts, order, swing


@dataclass(frozen=True, kw_only=True, eq=False)
class BatchFits:
    """What a method makes of many records, in the units of the signal; nan where it finds nothing.

    Attributes
    ----------
    family : scipy.stats continuous distribution
        Of the posterior of the signal's friction coefficient.
    parameters : tuple of ndarray, shape (records,)
        Its shapes, location and scale.
    frequency, frequency_sd, rest_position, noise_sd : ndarray, shape (records,)
        As in :class:`friction_bayes.estimators.base.Fit`.
    """

    family: Any
    parameters: tuple[Array, ...]
    frequency: Array
    frequency_sd: Array
    rest_position: Array
    noise_sd: Array

    @property
    def found(self) -> Mask:
        """Which records have a posterior."""
        return np.logical_and.reduce([np.isfinite(parameter) for parameter in self.parameters])


def _waveform(task: BatchTask) -> BatchFits:
    prior, counts = task.prior, task.counts
    fits = fit_waveforms(task.values, task.located, task.quantity.order, prior["coefficient_precision"])
    posterior = waveform_posteriors(fits, counts, prior)
    half_duration = np.where(counts > 1, 0.5 * (counts - 1) * task.step, np.nan)
    return BatchFits(
        family=stats.t,
        parameters=(posterior.degrees, posterior.mean[:, 2], posterior.scale[:, 2]),
        frequency=fits.coefficients[:, 3] / half_duration,
        frequency_sd=posterior.scale[:, 3] / half_duration,
        rest_position=fits.coefficients[:, 0],
        noise_sd=posterior.noise_sd,
    )


def _envelope(task: BatchTask) -> BatchFits:
    gram, coefficients, residual, rows, polynomials = envelope_statistics(*task.decays)
    found = np.isfinite(residual) & (rows >= MIN_ROWS)
    factor = np.linalg.cholesky(np.where(found[:, None, None], gram, np.eye(3))).swapaxes(-1, -2)
    projected = np.einsum("rij,rj->ri", factor, np.where(found[:, None], coefficients, 0.0))
    posterior = update_regressions(
        envelope_prior(task.prior), factor, projected, np.where(found, residual, 0.0), rows, found
    )
    fitted = np.isfinite(posterior.degrees)
    frequency = np.full(len(rows), np.nan)
    frequency[fitted] = small_motion_frequency(
        polynomials[fitted],
        np.asarray((task.counts[fitted] - 1) * task.step, dtype=np.float64),
        task.quantity.order,
        posterior.mean[fitted],
        swing_frequency(task.system, task.unit),
    )
    return BatchFits(
        family=stats.t,
        parameters=(posterior.degrees, posterior.mean[:, 1], posterior.scale[:, 1]),
        frequency=frequency,
        frequency_sd=np.full(len(rows), np.nan),
        rest_position=posterior.mean[:, 2],
        noise_sd=posterior.noise_sd,
    )


def _normal_gamma(task: BatchTask) -> BatchFits:
    count, mean, squares, frequency, factor = _friction_samples(task)
    prior = NormalGamma(**task.prior)
    mu, lam, alpha, beta = posterior_parameters(
        prior, np.maximum(count, 1), mean * factor, squares * factor**2
    )
    proper = (count > 0) & (lam > 0.0) & (alpha > 0.0) & (beta > 0.0)
    alpha, spread = np.where(proper, alpha, np.nan), np.where(proper, beta, np.nan)
    return _of_amplitudes(
        task, frequency, stats.t, (2.0 * alpha, mu / factor, np.sqrt(spread / alpha / lam) / factor)
    )


def _gamma_exponential(task: BatchTask) -> BatchFits:
    count, mean, _, frequency, factor = _friction_samples(task)
    prior = GammaExponential(**task.prior)
    alpha, kappa = prior.alpha + count, prior.kappa + count * mean * factor
    proper = (count > 0) & (alpha > 0.0) & (kappa > 0.0)
    alpha, kappa = np.where(proper, alpha, np.nan), np.where(proper, kappa, np.nan)
    return _of_amplitudes(task, frequency, stats.gamma, (alpha, np.zeros_like(alpha), 1.0 / (kappa * factor)))


def _friction_samples(task: BatchTask) -> tuple[Integers, Array, Array, Array, float]:
    """Statistics of the signal's friction samples, frequencies, and the factor to forces."""
    arguments = (*task.decays, task.peaks == "highest")
    return *friction_sample_statistics(*arguments), force_factor(task.system, task.quantity, task.unit)


def _of_amplitudes(task: BatchTask, frequency: Array, family: Any, parameters: tuple[Any, ...]) -> BatchFits:
    """Fits by the paper's methods, which know frequency and rest position only as they were found."""
    none = np.full(len(task.values), np.nan)
    return BatchFits(
        family=family,
        parameters=parameters,
        frequency=np.where(task.usable, frequency, np.nan),
        frequency_sd=none,
        rest_position=np.where(task.usable, task.located.rest_position, np.nan),
        noise_sd=none,
    )


BATCH_FITS: dict[str, Callable[[BatchTask], BatchFits]] = {
    "waveform": _waveform,
    "envelope": _envelope,
    "normal-gamma": _normal_gamma,
    "gamma-exponential": _gamma_exponential,
}
"""By method."""
