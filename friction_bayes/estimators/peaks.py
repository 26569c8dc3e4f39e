"""The paper's two methods: its conjugate pairs on friction samples from successive amplitudes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from friction_bayes.conjugate.gamma_exponential import GammaExponential, negative_share
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.scaled import scaled
from friction_bayes.conjugate.targets import gamma_exponential_target, normal_gamma_target
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, inverse_square
from friction_bayes.decay.calibrated import force_factor
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.friction_samples import friction_samples, natural_frequency_found
from friction_bayes.estimators.base import Fit, register
from friction_bayes.estimators.priors import complete_prior, default_prior, prior_keys

__all__ = ["GammaExponentialEstimator", "NormalGammaEstimator"]

_TELESCOPING = (
    "successive friction samples share an amplitude, so their errors are correlated at -1/2 and their mean "
    "hangs on the first and the last amplitude alone; the model takes them as independent, which makes the "
    "friction interval far too wide"
)
_RATE = (
    "this pair estimates the rate of an exponential distribution: its mean tends to 1 over the mean friction "
    "sample and not to the friction; kept as the paper's comparison"
)
_PRIOR_WIDTH = (
    "one friction sample has no scatter: the width of the interval is the prior's and no measure of the "
    "error; record more periods, or use waveform"
)


class NormalGammaEstimator:
    """Eqs. (4)-(8) on the samples of :func:`~friction_bayes.decay.friction_samples.friction_samples`."""

    name = "normal-gamma"
    prior_keys = prior_keys("normal-gamma")

    def default_prior(self, decay: FreeDecay) -> dict[str, float]:
        """Weak prior from the declared system, see :mod:`friction_bayes.estimators.priors`."""
        return default_prior(self.name, decay.system, decay.quantity, decay.unit)

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior; what ``prior`` leaves out is the default."""
        before = NormalGamma(**complete_prior(self.default_prior(decay), prior))
        samples = friction_samples(decay, peaks)
        posterior = before.update(samples)
        return _fit(
            decay,
            posterior,
            normal_gamma_target(before, samples),
            peaks,
            precision=posterior.precision,
            notes=(_TELESCOPING,) if samples.size > 1 else (_PRIOR_WIDTH,),
        )


class GammaExponentialEstimator:
    """Eqs. (9)-(11) on the samples of :func:`~friction_bayes.decay.friction_samples.friction_samples`."""

    name = "gamma-exponential"
    prior_keys = prior_keys("gamma-exponential")

    def default_prior(self, decay: FreeDecay) -> dict[str, float]:
        """Weak prior from the declared system, see :mod:`friction_bayes.estimators.priors`."""
        return default_prior(self.name, decay.system, decay.quantity, decay.unit)

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior; what ``prior`` leaves out is the default."""
        before = GammaExponential(**complete_prior(self.default_prior(decay), prior))
        samples = friction_samples(decay, peaks)
        posterior = before.update(samples)
        notes: tuple[str, ...] = (_RATE,)
        if share := negative_share(samples):
            notes += (
                f"{100.0 * share:.0f} % of the friction samples are negative, where an exponential "
                "likelihood is zero: the formal likelihood in the sum of samples is used",
            )
        return _fit(
            decay, posterior, gamma_exponential_target(before, samples), peaks, precision=None, notes=notes
        )


def _fit(
    decay: FreeDecay,
    posterior: NormalGamma | GammaExponential,
    target: Target,
    peaks: str,
    *,
    precision: Any,
    notes: tuple[str, ...],
) -> Fit:
    """Bring a posterior of the friction force to the unit of the signal."""
    calibrated = decay.unit not in UNCALIBRATED_UNITS
    factor = force_factor(decay.system, decay.quantity, decay.unit)
    force_unit = decay.system.friction_unit if calibrated else decay.unit
    return Fit(
        coefficient=scaled(posterior.friction, 1.0 / factor),
        precision=precision,
        precision_unit="" if precision is None else inverse_square(force_unit),
        posterior=posterior,
        amplitudes=target.observed.size + 1,
        frequency=natural_frequency_found(decay, peaks),
        frequency_sd=math.nan,
        rest_position=decay.rest_position,
        noise_sd=math.nan,
        prediction=None,
        target=target,
        notes=notes,
    )


register(NormalGammaEstimator())
register(GammaExponentialEstimator())
