"""The paper's two methods: its conjugate pairs on friction samples from successive amplitudes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from scipy import stats

from friction_bayes.conjugate.gamma_exponential import GammaExponential, negative_share
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.scaled_distribution import scaled
from friction_bayes.conjugate.targets import gamma_exponential_target, normal_gamma_target
from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.quantities import inverse_square
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.friction_samples import (
    friction_sample_statistics,
    friction_samples,
    natural_frequency_found,
)
from friction_bayes.decay.sensor_calibration import force_factor
from friction_bayes.estimators.base import Fit, Fits, FreeDecays
from friction_bayes.estimators.priors import TabulatedPrior

__all__ = ["GammaExponentialEstimator", "NormalGammaEstimator"]

_TELESCOPING = (
    "successive friction samples share an amplitude, so their errors are correlated at -1/2 and their mean "
    "depends on the first and the last amplitude alone; the model takes them as independent, which makes the "
    "friction interval far too wide"
)
_RATE = (
    "this pair estimates the rate of an exponential distribution: its mean tends to 1 over the mean friction "
    "sample and not to the friction; kept as the paper's comparison"
)
_PRIOR_WIDTH = (
    "one friction sample has no scatter: the width of the interval is the prior's and does not measure "
    "the error; record more periods, or use waveform"
)


class NormalGammaEstimator(TabulatedPrior):
    """Eqs. (4)-(8) on the samples of :func:`~friction_bayes.decay.friction_samples.friction_samples`."""

    name = "normal-gamma"

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior."""
        before = NormalGamma(**prior)
        samples = friction_samples(decay, peaks)
        note = _TELESCOPING if samples.size > 1 else _PRIOR_WIDTH
        return _fit(decay, before, samples, peaks, normal_gamma_target, (note,))

    def fit_many(self, decays: FreeDecays, prior: Mapping[str, float], *, peaks: str) -> Fits:
        """Closed-form posteriors of many free decays."""
        before = NormalGamma(**prior)
        count, mean, squares, frequency = _sample_statistics(decays, peaks)
        factor = force_factor(decays.system, decays.quantity, decays.unit)
        mu, lam, alpha, beta = before.parameters_after(
            np.maximum(count, 1), mean * factor, squares * factor**2
        )
        proper = (count > 0) & (lam > 0.0) & (alpha > 0.0) & (beta > 0.0)
        alpha, beta = np.where(proper, alpha, np.nan), np.where(proper, beta, np.nan)
        parameters = (2.0 * alpha, mu / factor, np.sqrt(beta / alpha / lam) / factor)
        return _fits(decays, stats.t, parameters, frequency)


class GammaExponentialEstimator(TabulatedPrior):
    """Eqs. (9)-(11) on the samples of :func:`~friction_bayes.decay.friction_samples.friction_samples`."""

    name = "gamma-exponential"

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior."""
        before = GammaExponential(**prior)
        samples = friction_samples(decay, peaks)
        notes: tuple[str, ...] = (_RATE,)
        if share := negative_share(samples):
            notes += (
                f"{100.0 * share:.0f} % of the friction samples are negative, where an exponential "
                "likelihood is zero: the formal likelihood in the sum of samples is used",
            )
        return _fit(decay, before, samples, peaks, gamma_exponential_target, notes)

    def fit_many(self, decays: FreeDecays, prior: Mapping[str, float], *, peaks: str) -> Fits:
        """Closed-form posteriors of many free decays."""
        before = GammaExponential(**prior)
        count, mean, _, frequency = _sample_statistics(decays, peaks)
        factor = force_factor(decays.system, decays.quantity, decays.unit)
        alpha, kappa = before.parameters_after(count, count * mean * factor)
        proper = (count > 0) & (alpha > 0.0) & (kappa > 0.0)
        alpha, kappa = np.where(proper, alpha, np.nan), np.where(proper, kappa, np.nan)
        parameters = (alpha, np.zeros_like(alpha), 1.0 / (kappa * factor))
        return _fits(decays, stats.gamma, parameters, frequency)


def _fit(
    decay: FreeDecay,
    before: NormalGamma | GammaExponential,
    samples: Array,
    peaks: str,
    target: Callable[..., Target],
    notes: tuple[str, ...],
) -> Fit:
    """The posterior of the friction force, in the unit of the signal."""
    posterior = before.update(samples)
    precision = posterior.precision if isinstance(posterior, NormalGamma) else None
    factor = decay.force_factor
    return Fit(
        coefficient=scaled(posterior.friction, 1.0 / factor),
        precision=precision,
        precision_unit="" if precision is None else inverse_square(decay.friction_unit),
        posterior=posterior,
        amplitudes=samples.size + 1,
        frequency=natural_frequency_found(decay, peaks),
        frequency_sd=math.nan,
        rest_position=decay.rest_position,
        noise_sd=math.nan,
        prediction=None,
        build_target=partial(target, before, samples),
        notes=notes,
    )


def _sample_statistics(decays: FreeDecays, peaks: str) -> tuple[Integers, Array, Array, Array]:
    """Counts, means and squared deviations of the signal's friction samples, and frequencies [rad/s]."""
    arguments = (*decays.kernel_arguments, peaks == "highest")
    count, mean, squares, frequency = friction_sample_statistics(*arguments)
    return count, mean, squares, frequency


def _fits(decays: FreeDecays, family: Any, parameters: tuple[Array, ...], frequency: Array) -> Fits:
    """Posteriors of the signal's friction coefficient; frequency and rest position are as they were found."""
    none = np.full(len(decays.values), np.nan)
    return Fits(
        family=family,
        parameters=parameters,
        frequency=np.where(decays.usable, frequency, np.nan),
        frequency_sd=none,
        rest_position=np.where(decays.usable, decays.located.rest_position, np.nan),
        noise_sd=none,
    )
