"""The witness of an estimate, friction by the loss of amplitude, and an estimate that it contradicts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.summary import TAILS
from friction_bayes.estimators.envelope.loss_of_amplitude import EXACT_TO

__all__ = ["Witness", "not_negative", "reconciled"]

_APART = 2.0
"""Standard deviations of their difference from which on two witnesses disagree: one in twenty by chance."""
_NEGATIVE = 1e-4
"""Probability of a negative friction below which the cut at zero changes nothing that is printed."""


@dataclass(frozen=True, eq=False)
class Witness:
    """Friction by the loss of amplitude.

    Attributes
    ----------
    coefficient : Mixture
        Friction coefficient of the signal.
    agrees : bool
        Whether it agrees with the posterior, within two standard deviations of their difference.
    bounds : bool
        Whether the reported interval has to be at least as wide.
    """

    coefficient: Mixture
    agrees: bool
    bounds: bool

    @classmethod
    def compared(cls, posterior: Any, coefficient: Mixture, *, bounds: bool) -> Witness:
        """Comparison with a posterior; the wider of two nested witnesses is as wide as their difference."""
        spread = max(_spread(posterior), _spread(coefficient))
        middle = posterior.median()
        apart = abs(middle - coefficient.median())
        return cls(coefficient, bool(apart <= _APART * math.hypot(spread, EXACT_TO * middle)), bounds)


def reconciled(posterior: Any, witness: Witness) -> Any:
    """A distribution that spans the posterior and a witness that disagrees, or is as wide as a bounding one.

    Parameters
    ----------
    posterior : Mixture or frozen Student t
        Of the friction coefficient.
    witness : Witness
    """
    if not witness.agrees:
        return Mixture.of([_as_mixture(posterior), witness.coefficient], (0.5, 0.5))
    if witness.bounds:
        wider = max(_spread(witness.coefficient) / _spread(posterior), 1.0)
        return _as_mixture(posterior).widened(wider)
    return posterior


def not_negative(posterior: Any, witness: Witness) -> Any:
    """The two reconciled and truncated at zero, where the probability below is not negligible.

    Where they disagree each is truncated by itself: a witness below zero says that there need be no friction.
    """
    answer = reconciled(posterior, witness)
    if not _NEGATIVE < float(answer.cdf(0.0)) < 1.0:
        return answer
    if witness.agrees:
        return _as_mixture(answer).kept_positive()
    positive = [_as_mixture(each).kept_positive() for each in (posterior, witness.coefficient)]
    return Mixture.of(positive, (0.5, 0.5))


def _as_mixture(distribution: Any) -> Mixture:
    return distribution if isinstance(distribution, Mixture) else Mixture.of_student(distribution)


def _spread(distribution: Any) -> float:
    """Half the width of the central 90 % in units of that of a standard normal."""
    low, high = (float(distribution.ppf(p)) for p in TAILS)
    return (high - low) / (2.0 * 1.6448536269514722)
