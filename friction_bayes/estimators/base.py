"""What an estimator is, and the one registry of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import FreeDecay

__all__ = ["ESTIMATORS", "Estimator", "Fit", "register"]


@dataclass(frozen=True, kw_only=True)
class Fit:
    """What an estimator makes of one free decay, in the units of the signal.

    Attributes
    ----------
    coefficient : frozen scipy.stats distribution
        Posterior of the friction coefficient of the signal, ``u = w0**q r/k`` for derivative order ``q``;
        :meth:`Oscillator.force_factor` turns it into a force.
    precision : frozen scipy.stats distribution or None
        Posterior of the model's precision parameter, 1/(unit of its data)**2.
    precision_unit : str
        Its unit.
    posterior : object
        The conjugate posterior itself (NormalGamma, GammaExponential, NormalInverseGamma).
    amplitudes : int
        How many amplitudes the model used, or that the moving record holds.
    frequency, frequency_sd : float
        Angular frequency found in the data [rad/s] and its standard deviation (nan where not estimated).
    rest_position : float
        Rest position, unit of the signal.
    noise_sd : float
        Posterior mean standard deviation of a signal sample (nan where the model has none).
    prediction : ndarray or None, shape (n,)
        Fitted signal over ``decay.time``.
    target : Target
        The same posterior for the sampler.
    notes : tuple of str
        What a reader must know: assumptions, negative samples, residuals that are not noise.
    """

    coefficient: Any
    precision: Any | None
    precision_unit: str
    posterior: Any
    amplitudes: int
    frequency: float
    frequency_sd: float
    rest_position: float
    noise_sd: float
    prediction: Array | None
    target: Target
    notes: tuple[str, ...] = field(default=())


class Estimator(Protocol):
    """One closed-form estimator; see CONTRIBUTING for how to add one."""

    name: str
    prior_keys: tuple[str, ...]
    """What ``--prior KEY=VALUE`` and ``prior={...}`` may set."""

    def default_prior(self, decay: FreeDecay) -> dict[str, float]:
        """Weak prior derived from the declared system, not from the data; keys are ``prior_keys``."""
        ...

    def fit(self, decay: FreeDecay, prior: Mapping[str, float], *, peaks: str) -> Fit:
        """Closed-form posterior of one free decay."""
        ...


ESTIMATORS: dict[str, Estimator] = {}


def register(estimator: Estimator) -> Estimator:
    """Add an estimator under its name."""
    ESTIMATORS[estimator.name] = estimator
    return estimator
