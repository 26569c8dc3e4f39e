"""Does a closed form agree with draws? Differences in Monte Carlo standard errors, and a verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_sample, positive, probability
from friction_bayes.core.errors import InputError
from friction_bayes.validation.expected_distribution import Expected
from friction_bayes.validation.mixing import Mixing, as_ensembles, bulk_ess, mixing, tail_ess

__all__ = ["Agreement", "Check", "compare"]


_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)

_SHARES = {"mean": 0.4, "sd": 0.3, "quantiles": 0.2, "distribution": 0.1}
"""How the false-alarm rate is split (Bonferroni, weighted): most goes to what an error would move first."""

_HEAVY_TAILS = 6.0
"""Excess kurtosis (a Student t of 5 degrees of freedom) from which a sample's sd is no fair check."""


_RELATED = 5.0
"""Standard errors from which neighbouring chains are no accident; independent ones reach them in 3e-7."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """One difference between what is expected and what was sampled.

    Attributes
    ----------
    name : str
        ``mean``, ``sd``, ``P(below 5 % quantile)``, ..., ``distribution``.
    expected, sampled : float
        The figure by the closed form and by the draws; for ``distribution`` zero and the largest
        difference of the distribution functions (Kolmogorov-Smirnov).
    mcse : float
        Monte Carlo standard error of the difference; for ``distribution`` one over the root of the
        effective sample size.
    z : float
        ``(sampled - expected) / mcse``.
    p_value : float
        Two-sided.
    level : float
        The check fails where ``p_value`` is below it.
    """

    name: str
    expected: float
    sampled: float
    mcse: float
    z: float
    p_value: float
    level: float

    @classmethod
    def of_difference(
        cls, name: str, expected: float, sampled: float, mcse: float, *, level: float, dof: float = math.inf
    ) -> Check:
        """Compare two numbers: their difference over its standard error is a Student t of ``dof``."""
        difference = sampled - expected
        # draws that never move have no error, and are right by accident alone
        z = difference / mcse if mcse > 0.0 else math.copysign(math.inf, difference) if difference else 0.0
        p_value = 2.0 * float(stats.t.sf(abs(z), dof))
        return cls(
            name=name, expected=expected, sampled=sampled, mcse=mcse, z=z, p_value=p_value, level=level
        )

    @classmethod
    def of_distance(cls, name: str, distance: float, size: float, *, p_value: float, level: float) -> Check:
        """Compare two distribution functions by their largest distance, over ``size`` independent draws."""
        root = math.sqrt(size)
        return cls(
            name=name,
            expected=0.0,
            sampled=distance,
            mcse=_ratio(1.0, root),
            z=distance * root,
            p_value=p_value,
            level=level,
        )

    @property
    def passed(self) -> bool:
        """Whether the difference is within what chance makes of it."""
        return self.p_value >= self.level

    def __str__(self) -> str:
        """Return the check in one line."""
        return (
            f"{self.name}: {self.sampled:.6g} sampled, {self.expected:.6g} expected, "
            f"{self.z:+.2f} standard errors of {self.mcse:.2g}, "
            f"p = {self.p_value:.2g} (level {self.level:.2g})"
        )


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Verdict on a closed form compared with draws.

    Attributes
    ----------
    agrees : bool or None
        None where there are too few effective draws to judge.
    checks : tuple of Check
        Every comparison made; empty where not judged.
    ess : float
        The smaller of bulk and tail effective sample size.
    minimum_ess : float
        Below this no verdict is given.
    false_alarm_rate : float
        Probability, at most, that a correct closed form is found to disagree, over all checks together.
    """

    agrees: bool | None
    checks: tuple[Check, ...] = field(repr=False)
    ess: float
    minimum_ess: float
    false_alarm_rate: float

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that did not pass."""
        return tuple(check for check in self.checks if not check.passed)

    @property
    def because(self) -> str:
        """The verdict's reason in one line."""
        if self.agrees is None:
            return f"effective sample size {self.ess:.0f} is below {self.minimum_ess:.0f}: not judged"
        if self.failed:
            return "; ".join(str(check) for check in self.failed)
        furthest = min(self.checks, key=lambda check: check.p_value / check.level)
        return (
            f"{len(self.checks)} checks at effective sample size {self.ess:.0f}, "
            f"false-alarm rate {self.false_alarm_rate:g}; the furthest is {furthest}"
        )


def compare(
    expected: Any,
    draws: ArrayLike,
    *,
    ess: float | None = None,
    quantiles: Sequence[float] = _QUANTILES,
    false_alarm_rate: float = 0.01,
    minimum_ess: float = 1000.0,
) -> Agreement:
    """Compare a distribution with draws that should come from it.

    Parameters
    ----------
    expected : frozen distribution or array_like
        Anything with ``mean()``, ``std()``, ``cdf(x)`` and ``ppf(p)``, such as a frozen scipy distribution or
        :class:`~friction_bayes.validation.tabulated.Tabulated`; or an array of *independent* draws.
    draws : array_like, shape (n,), (chains, n) or (ensembles, walkers, n)
        Chains and ensembles are independent of each other, walkers and successive draws are not.
    ess : float, optional
        Effective sample size of the draws where it is known, such as ``n`` for independent ones, and no more
        than there are. When left out it is found from the autocorrelation of each function compared.
    quantiles : sequence of float
        Probabilities at which the distribution function is compared.
    false_alarm_rate : float
        Of all checks together.
    minimum_ess : float
        Fewer effective draws give no verdict.

    Returns
    -------
    Agreement

    Raises
    ------
    InputError
        If ``expected`` is no continuous distribution with its parameters, no numbers or fewer than
        ``minimum_ess`` of them; if draws are no
        numbers or their axes are exchanged; if ``ess`` or a rate is no valid number.

    Notes
    -----
    The mean is not compared where the variance is infinite, nor the sd where the excess kurtosis is above
    6: their Monte Carlo errors would not be normal; the quantiles and the distribution function then judge
    alone. At an effective sample size of 10,000 a mean 5 % of an sd off is 5 standard errors away, an sd
    5 % off (of a normal) 7; at a false-alarm rate of 1 % they are found from 2.9 and 3.0 on.
    """
    rate = probability("false_alarm_rate", false_alarm_rate, such_as=0.01)
    least = positive("minimum_ess", minimum_ess)
    reference = Expected.of(expected)
    if reference.size < least:
        raise InputError(
            "expected",
            f"{reference.size:g} draws" if reference.size > 1 else "one number",
            f"give {least:g} independent draws or more, or a distribution such as stats.norm(0, 1)",
        )
    values = as_ensembles(finite_sample("draws", draws))
    known = None if ess is None else _declared(ess, values.size)
    if known is None:
        _refuse_exchanged_axes(values)
    reach = known.ess if known else min(bulk_ess(values).ess, tail_ess(values).ess)
    verdict = Agreement(agrees=None, checks=(), ess=reach, minimum_ess=least, false_alarm_rate=rate)
    if not reach >= least:
        return verdict
    planned = _moment_checks(reference, values, known)
    planned += _distribution_checks(reference, values, known, quantiles)
    whole = sum(check.level for check in planned)
    checks = tuple(replace(check, level=check.level * rate / whole) for check in planned)
    return replace(verdict, checks=checks, agrees=all(check.passed for check in checks))


def _declared(ess: float, size: int) -> Mixing:
    """Return the effective sample size that the caller knows, of ``size`` draws."""
    known = positive("ess", ess)
    if known > size:
        raise InputError(
            "ess", f"{known:g} is more than the {size} draws", "leave it out, and it is found from the draws"
        )
    return Mixing(known, size / known, math.inf)


def _refuse_exchanged_axes(values: Array) -> None:
    """Refuse what is read as many short chains where each chain goes on where the last one was.

    The means of ``m`` independent chains have a lag-1 autocorrelation of sd ``1 / sqrt(m)`` or less; steps of
    a sampler have that of the sampler, and steps that are independent may lie on any axis.
    """
    chains, _, steps = values.shape
    if chains <= steps:
        return
    series = values.mean(axis=(1, 2)) - values.mean()
    if series[:-1] @ series[1:] * math.sqrt(chains) > _RELATED * (series @ series):
        raise InputError(
            "draws",
            f"read as {chains} chains of {steps} steps each, but neighbouring chains are alike",
            "put steps last, such as draws.T",
        )


def _moment_checks(reference: Expected, values: Array, known: Mixing | None) -> list[Check]:
    """Mean and sd, with their shares of the false-alarm rate for a level."""
    checks = []
    mean, sd = float(values.mean()), float(values.std())
    if math.isfinite(reference.mean) and math.isfinite(reference.sd):
        found = known or mixing(values)
        error = _ratio(sd, math.sqrt(reference.joint(found)))
        share = _SHARES["mean"]
        checks.append(Check.of_difference("mean", reference.mean, mean, error, level=share, dof=found.dof))
        if reference.excess_kurtosis <= _HEAVY_TAILS:
            squares = (values - mean) ** 2
            found = known or mixing(squares)
            # delta method: sd(s) = sd(s**2) / (2 s)
            error = _ratio(float(squares.std()), 2.0 * sd * math.sqrt(reference.joint(found)))
            share = _SHARES["sd"]
            checks.append(Check.of_difference("sd", reference.sd, sd, error, level=share, dof=found.dof))
    return checks


def _distribution_checks(
    reference: Expected, values: Array, known: Mixing | None, quantiles: Sequence[float]
) -> list[Check]:
    """Distribution function at the expected quantiles, and its largest difference anywhere."""
    checks, reach = [], math.inf
    for p in quantiles:
        below = values <= float(reference.distribution.ppf(p))
        found = known or mixing(below)
        size = reference.joint(found)
        reach = min(reach, size)
        error = _ratio(math.sqrt(p * (1.0 - p)), math.sqrt(size))
        share = _SHARES["quantiles"] / len(quantiles)
        name = f"P(below {100 * p:g} % quantile)"
        checks.append(Check.of_difference(name, p, float(below.mean()), error, level=share, dof=found.dof))
    ordered = np.sort(values, axis=None)
    steps = np.arange(ordered.size + 1) / ordered.size
    curve = reference.distribution.cdf(ordered)
    distance = float(max(np.max(steps[1:] - curve), np.max(curve - steps[:-1])))
    # correlated draws do not follow the Kolmogorov distribution; with the worst effective sample size of the
    # indicators in place of n the test is conservative
    p_value = float(stats.kstwo.sf(distance, max(int(reach), 1)))
    share = _SHARES["distribution"]
    checks.append(Check.of_distance("distribution", distance, reach, p_value=p_value, level=share))
    return checks


def _ratio(a: float, b: float) -> float:
    return a / b if b > 0.0 else math.inf
