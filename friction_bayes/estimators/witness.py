"""The witness of an estimate, friction by the loss of amplitude, and what an estimate is with it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.summary import HALF_WIDTH90, TAILS
from friction_bayes.estimators.envelope.loss_of_amplitude import EXACT_TO, UnevenLoss
from friction_bayes.estimators.noise.noise_accounts import SLIGHT

__all__ = ["AnswerPart", "Witness", "answer_parts", "not_negative"]

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


class AnswerPart(NamedTuple):
    """A share of what is reported, and a distribution of the friction coefficient: Mixture or Student t."""

    share: float
    coefficient: Any


def answer_parts(posterior: Any, witness: Witness | None, uneven: UnevenLoss | None) -> list[AnswerPart]:
    """The posterior with a witness, and friction under an uneven loss by the probability of that.

    A posterior that the witness contradicts and the witness share what is reported; one that it bounds is as
    wide as the witness. Friction under an uneven loss that the amplitudes alone show has the probability of
    that, unless this is sure and the witness is of it. The posterior, a Mixture or frozen Student t, is of
    the friction coefficient.
    """
    if witness is None:
        found = [AnswerPart(1.0, posterior)]
    elif not witness.agrees:
        found = [AnswerPart(0.5, posterior), AnswerPart(0.5, witness.coefficient)]
    elif witness.bounds:
        wider = max(_spread(witness.coefficient) / _spread(posterior), 1.0)
        found = [AnswerPart(1.0, Mixture.of_student(posterior).widened(wider))]
    else:
        found = [AnswerPart(1.0, posterior)]
    if uneven is None or uneven.losses or uneven.sure or uneven.probability < SLIGHT:
        return found
    found = [AnswerPart((1.0 - uneven.probability) * share, each) for share, each in found]
    return [*found, AnswerPart(uneven.probability, uneven.coefficient)]


def not_negative(known: Sequence[AnswerPart]) -> Any:
    """What is reported, each reading truncated at zero where the probability below is not negligible."""
    if not _NEGATIVE < sum(share * float(each.cdf(0.0)) for share, each in known) < 1.0:
        return known[0].coefficient if len(known) == 1 else _mixed(known)
    return _mixed([AnswerPart(share, Mixture.of_student(each).kept_positive()) for share, each in known])


def _mixed(known: Sequence[AnswerPart]) -> Mixture:
    return Mixture.of([each.coefficient for each in known], [each.share for each in known])


def _spread(distribution: Any) -> float:
    """Half the width of the central 90 % in units of that of a standard normal."""
    low, high = (float(distribution.ppf(p)) for p in TAILS)
    return (high - low) / (2.0 * HALF_WIDTH90)
