"""Default priors: one table, weak, from the declared system and never from the data they meet.

The declared system has a scale of force ``F`` (its weight ``m g``, or ``k`` times one radian) and so a scale
of signal. A default prior of an unknown is centred at zero with that scale and the tails of a Cauchy
distribution; that of the noise is centred at 1e-18 of it, with the weight of one observation (a tenth of one
where records may be as short as a few data). Such a prior has 1e-36 of the weight of one datum, and adds to
the noise less than rounding does to signals of picometres on a system of metres: results scale with the
signal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from friction_bayes.core.checks import finite
from friction_bayes.core.errors import InputError, unknown_name
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity
from friction_bayes.core.system import Oscillator

__all__ = [
    "PRIORS",
    "DeclaredSignal",
    "PriorParameter",
    "TabulatedPrior",
    "coefficient_bounds",
    "complete_prior",
    "default_prior",
    "force_scale",
    "prior_keys",
    "signal_scale",
]

FINEST = 1e-18
"""Noise over the scale, far below that of any record: a prior must not add to it."""
WIDEST = 1.0 / FINEST
"""Coefficients without a prior precision lie within this many times the signal's scale."""

UNCALIBRATED_SCALE = 10.0
"""Scale of a signal that was never calibrated, in its own unit: the range of a common acquisition card."""


class DeclaredSignal(Protocol):
    """The declaration of a signal, all that a default prior may depend on; a FreeDecay is one."""

    @property
    def system(self) -> Oscillator:
        """The measured oscillator."""
        ...

    @property
    def quantity(self) -> Quantity:
        """The measured quantity."""
        ...

    @property
    def unit(self) -> str:
        """Its unit."""
        ...


@dataclass(frozen=True)
class PriorParameter:
    """One line of the table: the default is ``factor * scale**power``.

    Attributes
    ----------
    key : str
        What ``--prior KEY=VALUE`` calls it.
    factor : float
        Default in units of the scale.
    power : int
        Power of the scale that carries its unit.
    reason : str
        Why this value.
    least : float
        Least value that leaves a posterior: zero, or a flat prior where that is below.
    """

    key: str
    factor: float
    power: int
    reason: str
    least: float = 0.0


_TENTH = "the noise level is known as well as from a tenth of a datum"
_DEVIATION = PriorParameter(
    "beta", 0.05 * FINEST**2, 2, "that tenth of a datum deviates by 1e-18 of the scale"
)

PRIORS: dict[str, tuple[PriorParameter, ...]] = {
    "normal-gamma": (
        PriorParameter("mu", 0.0, 1, "neither sign of friction is favoured", least=-math.inf),
        PriorParameter(
            "lam",
            FINEST**2,
            0,
            "friction is zero give or take the scale when samples scatter by 1e-18 of it",
        ),
        PriorParameter(
            "alpha", 0.5, 0, "the precision is known as well as from one friction sample", least=-0.5
        ),
        PriorParameter("beta", 0.5 * FINEST**2, 2, "that sample deviates by 1e-18 of the scale"),
    ),
    "gamma-exponential": (
        PriorParameter("alpha", 0.01, 0, "worth a hundredth of a friction sample"),
        PriorParameter("kappa", 0.01 * FINEST, 1, "that hundredth of a sample being 1e-18 of the scale"),
    ),
    "envelope": (
        PriorParameter(
            "coefficient_precision",
            FINEST**2,
            0,
            "coefficients are zero give or take the scale when samples scatter by 1e-18 of it",
        ),
        PriorParameter(
            "alpha",
            -1.45,
            0,
            f"{_TENTH}, less half a one for each coefficient: under so weak a prior these would count as "
            "data without scatter, and narrow short records' intervals",
            least=-1.5,
        ),
        _DEVIATION,
    ),
    "waveform": (
        PriorParameter(
            "coefficient_precision",
            0.0,
            0,
            "offset, amplitude and friction are uniform within 1e18 times the scale; above zero they "
            "are normal about zero, with this precision relative to that of a sample",
        ),
        PriorParameter("alpha", 0.05, 0, _TENTH),
        _DEVIATION,
    ),
}
"""By method; the scale is :func:`force_scale` for the paper's two, :func:`signal_scale` for the others."""


def signal_scale(system: Oscillator, quantity: Quantity, unit: str) -> float:
    """Scale of the signal that the declared system would give, in ``unit``.

    ``w0**q L`` for derivative order ``q``, with ``L`` the system's displacement scale; 10 units of a signal
    that was not calibrated, since nothing declared says what such a unit is.
    """
    if unit in UNCALIBRATED_UNITS:
        return UNCALIBRATED_SCALE
    return system.natural_frequency**quantity.order * system.displacement_scale


def coefficient_bounds(
    precision: float, system: Oscillator, quantity: Quantity, unit: str
) -> tuple[float, float]:
    """Support of a coefficient: all numbers, or a wide interval where it has no prior precision."""
    widest = WIDEST * signal_scale(system, quantity, unit) if precision == 0.0 else math.inf
    return -widest, widest


def force_scale(system: Oscillator, quantity: Quantity, unit: str) -> float:
    """Scale of the friction: ``k L`` [N or N m], or 10 of the signal's own units."""
    if unit in UNCALIBRATED_UNITS:
        return UNCALIBRATED_SCALE
    return system.stiffness * system.displacement_scale


def prior_keys(method: str) -> tuple[str, ...]:
    """Return the keys that ``--prior KEY=VALUE`` may set for a method."""
    return tuple(parameter.key for parameter in PRIORS[method])


def default_prior(method: str, system: Oscillator, quantity: Quantity, unit: str) -> dict[str, float]:
    """Return the default prior of a method for signals of a quantity, in ``unit``, from a system."""
    scale_of = force_scale if method in ("normal-gamma", "gamma-exponential") else signal_scale
    scale = scale_of(system, quantity, unit)
    return {p.key: p.factor * scale**p.power for p in PRIORS[method]}


class TabulatedPrior:
    """Part of an estimator whose default prior is in :data:`PRIORS` under its name."""

    name: str

    @property
    def prior_keys(self) -> tuple[str, ...]:
        """Keys that ``--prior KEY=VALUE`` may set."""
        return prior_keys(self.name)

    def default_prior(self, signal: DeclaredSignal) -> dict[str, float]:
        """Weak prior derived from the declared system."""
        return default_prior(self.name, signal.system, signal.quantity, signal.unit)


def complete_prior(
    method: str, default: Mapping[str, float], given: Mapping[str, float] | None
) -> dict[str, float]:
    """Return the default prior of a method with the given values in place of its own.

    Raises
    ------
    InputError
        If a key is unknown, the message names the known ones; if a value is not a finite number or less than
        the table allows.
    """
    prior = dict(default)
    least = {parameter.key: parameter.least for parameter in PRIORS.get(method, ())}
    for key, value in (given or {}).items():
        if key not in prior:
            raise unknown_name("prior", "key", key, prior)
        prior[key] = finite(f"prior {key}", value)
        if prior[key] < least.get(key, -math.inf):
            raise InputError(
                f"prior {key}", f"{prior[key]:g} is too small for {method}", f"give {least[key]:g} or more"
            )
    return prior
