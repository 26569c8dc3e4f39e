"""The friction force by the declared stiffness and by the declared mass, which a record may contradict.

In a signal of derivative order ``q`` friction shows as ``u = w**q r/k``, with the frequency ``w`` of the
record. So the declared stiffness gives the force ``k u / w**q``, the declared mass ``m w**(2-q) u``, and they
differ where ``w**2`` is not ``k/m``. The frequency is known far better than ``u``: its own error does not
count here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.quantities import Quantity
from friction_bayes.core.system import Oscillator

__all__ = [
    "ForceFactor",
    "by_mass",
    "by_stiffness",
    "by_stiffness_and_mass",
    "common_factor",
    "declared_forces",
    "disagreement",
    "frequencies_disagree",
]

_SEVERAL = 3.0
"""Standard deviations of the disagreement that the declared values may be off."""
_LEAST = 6e-4
"""Relative difference of the two forces that does not matter: 3e-4 in frequency."""
_FREQUENCY_SD = 2e-3
"""Relative standard deviation of a frequency whose method gives none, as of peaks in a short record."""


class ForceFactor(NamedTuple):
    """Factor from the signal's friction coefficient to the friction force.

    Attributes
    ----------
    factor : float or ndarray, shape (m,)
    relative_sd : float
        Its standard deviation over ``factor``; zero when it is taken as exact.
    """

    factor: Any
    relative_sd: float


def disagreement(system: Oscillator, frequency: ArrayLike, frequency_sd: ArrayLike) -> Array:
    """By how many of its standard deviations the record swings otherwise than ``sqrt(k/m)``.

    The standard deviation is that of ``log(m w**2 / k)``, from those of the frequency and, where given, of
    mass and stiffness.

    Parameters
    ----------
    system : Oscillator
    frequency, frequency_sd : array_like, shape (...)
        Natural frequency found [rad/s] and its standard deviation; nan where the method gives none.

    Returns
    -------
    ndarray, shape (...)
    """
    sd = np.asarray(frequency_sd) / frequency
    sd = np.where(np.isnan(sd), _FREQUENCY_SD, sd)
    declared = math.hypot(system.stiffness_sd / system.stiffness, system.moving_sd / system.moving)
    with np.errstate(divide="ignore"):
        return np.abs(_log_ratio(system, frequency)) / np.hypot(2.0 * sd, declared)


def frequencies_disagree(system: Oscillator, frequency: ArrayLike, frequency_sd: ArrayLike) -> Mask:
    """Whether that is more than the standard deviations allow, and enough to matter, shape (...)."""
    matters = np.abs(_log_ratio(system, frequency)) > _LEAST
    return np.asarray(matters & (disagreement(system, frequency, frequency_sd) > _SEVERAL))


def _log_ratio(system: Oscillator, frequency: ArrayLike) -> Array:
    """Logarithm of the force by the mass over that by the stiffness, ``m w**2 / k``."""
    return np.asarray(2.0 * np.log(np.asarray(frequency) / system.natural_frequency))


def by_stiffness(system: Oscillator, quantity: Quantity, frequency: Array | float) -> ForceFactor:
    """Factor with the declared stiffness, ``k / w**q``."""
    return ForceFactor(system.stiffness * frequency**-quantity.order, system.stiffness_sd / system.stiffness)


def by_mass(system: Oscillator, quantity: Quantity, frequency: Array | float) -> ForceFactor:
    """Factor with the declared mass or inertia, ``m w**(2-q)``."""
    return ForceFactor(system.moving * frequency ** (2 - quantity.order), system.moving_sd / system.moving)


def by_stiffness_and_mass(
    system: Oscillator, quantity: Quantity, frequency: float, coefficient: float
) -> tuple[float, float]:
    """Friction force of a friction coefficient of the signal, with each of both."""
    stiffness, mass = by_stiffness(system, quantity, frequency), by_mass(system, quantity, frequency)
    return coefficient * float(stiffness.factor), coefficient * float(mass.factor)


def declared_forces(
    system: Oscillator, quantity: Quantity, frequency: Array | float, *, disagree: bool
) -> tuple[ForceFactor, ...]:
    """Factors from the signal's friction coefficient to the friction force, equally probable.

    That of the trusted value where one is. Otherwise both where the frequencies disagree: one of the two
    values is then right and the record cannot say which, so each has half the probability, as a statement of
    ignorance. Where they agree and both have a standard deviation, the record's frequency says what their
    ratio is, and the two are averaged in logarithms, weighted by their precisions; not those of a pendulum,
    whose errors are not independent, as mass and arm are in both. A value without a standard deviation
    narrows nothing.

    Parameters
    ----------
    system : Oscillator
    quantity : Quantity
        What was measured.
    frequency : float or ndarray, shape (m,)
        Natural frequency found [rad/s].
    disagree : bool
        Whether it disagrees with that declared (see :func:`frequencies_disagree`).
    """
    stiffness, mass = by_stiffness(system, quantity, frequency), by_mass(system, quantity, frequency)
    if system.trust is not None:
        return (stiffness if system.trust == "stiffness" else mass,)
    if disagree:
        return stiffness, mass
    total = math.hypot(stiffness.relative_sd, mass.relative_sd)
    narrowed = stiffness.relative_sd * mass.relative_sd
    if narrowed > 0.0 and not system.pendulum:
        share = (mass.relative_sd / total) ** 2
        return (ForceFactor(stiffness.factor**share * mass.factor ** (1.0 - share), narrowed / total),)
    return (ForceFactor(system.force_factor(quantity), system.force_factor_relative_sd(quantity)),)


def common_factor(factors: Sequence[ForceFactor]) -> ForceFactor:
    """Mean and relative standard deviation of equally probable factors, each a number, taken as one."""
    mean = sum(float(factor) for factor, _ in factors) / len(factors)
    variance = sum((factor * sd) ** 2 + (factor - mean) ** 2 for factor, sd in factors) / len(factors)
    return ForceFactor(mean, math.sqrt(variance) / mean)
