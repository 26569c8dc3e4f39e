"""Acceptance of an estimate by its precision parameter, as the paper proposes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from friction_bayes.core.checks import positive

__all__ = ["FALSE_ALARM", "SHARE", "Acceptance", "accept_by_set_up", "accept_by_threshold"]

SHARE = 0.9
"""Share of the set-up precision that a new record must reach: a scatter at most 5 % larger. The
paper's own criterion, 30 where its good record has 32.2 (Table 2), is a share of 0.93."""

FALSE_ALARM = 0.05
"""Chance of refusing a record that is as good as the set-up record, for want of amplitudes alone."""


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """Whether an estimate is accepted, and why.

    Attributes
    ----------
    accepted : bool
        The decision.
    criterion : str
        ``threshold`` or ``set-up record``.
    precision : float
        Posterior mean of the precision parameter of the new record.
    threshold : float
        What it had to reach.
    unit : str
        Unit of both.
    because : str
        The rule and its figures in one sentence.
    set_up_precision : float or None
        Posterior mean of the precision parameter of the set-up record.
    """

    accepted: bool
    criterion: str
    precision: float
    threshold: float
    unit: str
    because: str
    set_up_precision: float | None = None


def accept_by_threshold(precision: Any, threshold: float, *, unit: str) -> Acceptance:
    """Acceptance where the posterior mean of the precision reaches a given threshold.

    Parameters
    ----------
    precision : frozen scipy.stats distribution
        Posterior of the precision parameter.
    threshold : float
        The least precision accepted, in ``unit``; predefined in the set-up phase.
    unit : str
        Unit of the precision.

    Raises
    ------
    InputError
        If the threshold is not positive.
    """
    least = positive("accept_precision", threshold)
    mean = float(precision.mean())
    accepted = mean >= least
    relation = "reaches" if accepted else "falls short of"
    return Acceptance(
        accepted=accepted,
        criterion="threshold",
        precision=mean,
        threshold=least,
        unit=unit,
        because=f"the precision {mean:.4g} {unit} {relation} the threshold {least:.4g} {unit}",
    )


def accept_by_set_up(precision: Any, set_up: Any, *, unit: str) -> Acceptance:
    """Acceptance where the precision is not below that of a long set-up record by more than allowed.

    The posterior mean must reach :data:`SHARE` of the set-up record's. A record of few amplitudes
    may miss that by chance alone: where both have the same scatter, the ratio of the two means
    follows an F distribution with twice their gamma shapes as degrees of freedom, and its
    :data:`FALSE_ALARM` quantile takes the place of the share where it is lower.

    Parameters
    ----------
    precision, set_up : frozen scipy.stats distributions
        Posteriors (gamma) of the precision parameter of the new and of the set-up record.
    unit : str
        Their common unit.
    """
    freedom, set_up_freedom = (2.0 * _gamma_shape(each) for each in (precision, set_up))
    by_chance = float(stats.f(set_up_freedom, freedom).ppf(FALSE_ALARM))
    share = min(SHARE, by_chance)
    mean, reference = float(precision.mean()), float(set_up.mean())
    accepted = mean >= share * reference
    rule = f"the least share allowed is {share:.2f}"
    if by_chance < SHARE:
        rule += (
            f", below which chance alone takes {100.0 * FALSE_ALARM:.0f} % of records of so few amplitudes"
        )
    return Acceptance(
        accepted=accepted,
        criterion="set-up record",
        precision=mean,
        threshold=share * reference,
        unit=unit,
        because=f"the precision {mean:.4g} {unit} is {mean / reference:.2f} of the set-up record's; {rule}",
        set_up_precision=reference,
    )


def _gamma_shape(precision: Any) -> float:
    mean, variance = (float(np.asarray(moment)) for moment in precision.stats("mv"))
    return mean**2 / variance
