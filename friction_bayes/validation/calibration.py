"""Is a posterior calibrated? Simulation-based calibration and the coverage of intervals.

Parameters drawn from the prior and data simulated from them make the parameter one more draw from its own
posterior. The posterior distribution function at the true parameter is then uniform, whatever the model
(Cook, Gelman & Rubin 2006; Talts et al. 2018).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import (
    finite_array,
    finite_sample,
    non_negative,
    probability,
    real_array,
    whole,
)
from friction_bayes.core.errors import InputError
from friction_bayes.validation.agreement import Check
from friction_bayes.validation.tabulated import ROUNDED

__all__ = ["Calibration", "Coverage", "coverage", "rank_pit", "simulation_based_calibration", "uniformity"]


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Verdict on probability integral transforms that should be uniform.

    Attributes
    ----------
    calibrated : bool
        Whether every check passed.
    pit : ndarray, shape (replications, parameters)
        Posterior distribution function at the true parameter.
    checks : tuple of Check
        For each parameter the mean (a bias), the spread about 1/2 (an interval too wide or too narrow) and
        the largest difference of distribution functions, each two-sided.
    false_alarm_rate : float
        Probability, at most, that a calibrated posterior is found not to be.
    seed : int or None
        Of the simulation; None where the transforms were given.
    """

    calibrated: bool
    pit: Array = field(repr=False)
    checks: tuple[Check, ...] = field(repr=False)
    false_alarm_rate: float
    seed: int | None = None

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that did not pass."""
        return tuple(check for check in self.checks if not check.passed)


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """How often intervals held the truth.

    Attributes
    ----------
    rate : float
        Share that did.
    standard_error : float
        Binomial, of a share of ``level``.
    level : float
        Share that should have.
    replications : int
    p_value : float
        Exact binomial test, two-sided, of a coverage within ``tolerance`` of ``level``.
    tolerance : float
    """

    rate: float
    standard_error: float
    level: float
    replications: int
    p_value: float
    tolerance: float

    def __str__(self) -> str:
        """Return the figures in one line."""
        within = f" +- {self.tolerance:g}" if self.tolerance else ""
        return (
            f"{self.rate:.4f} +- {self.standard_error:.4f} of {self.replications} intervals cover the truth, "
            f"{self.level:g}{within} should (p = {self.p_value:.2g})"
        )


def simulation_based_calibration(
    draw_prior: Callable[[np.random.Generator, int], Any],
    simulate: Callable[[Any, np.random.Generator], Any],
    posterior_cdf: Callable[[Any, Any], ArrayLike],
    *,
    replications: int,
    seed: int,
    false_alarm_rate: float = 0.01,
) -> Calibration:
    """Draw parameters, simulate data, and ask the posterior where the truth lies.

    Parameters
    ----------
    draw_prior : callable, (Generator, replications) -> parameters
        One set of parameters a replication, in whatever form the next two take.
    simulate : callable, (parameters, Generator) -> data
        One data set for each.
    posterior_cdf : callable, (data, parameters) -> (replications,) or (replications, p)
        Posterior distribution function of each scalar parameter at its true value; for a sampler, see
        :func:`rank_pit`.
    replications : int
    seed : int
        Prior and data take independent streams from it.
    false_alarm_rate : float
        Of all checks together.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If one of the functions does not return one value a replication. Errors that it raises itself are
        left as they are, with a note of what it was given.
    """
    replications, seed = whole("replications", replications, least=1), whole("seed", seed)
    prior_stream, data_stream = np.random.SeedSequence(seed).spawn(2)
    all_draws = f"all {replications} draws at once"

    def called(name: str, function: Callable[..., Any], given: Mapping[str, Any], needed: str) -> Any:
        try:
            result = function(*given.values())
        except Exception as error:
            error.add_note(
                f"{name} is called once for all replications, here with {' and '.join(given)}, seed {seed}; "
                f"it must {needed}"
            )
            raise
        if (count := _numbers_in(result)) < replications:
            problem = f"returned too few numbers for {replications} replications: {count}"
            raise InputError(name, problem, f"let it {needed}")
        return result

    parameters = called(
        "draw_prior",
        draw_prior,
        {
            "a Generator": np.random.default_rng(prior_stream),
            f"replications = {replications}": replications,
        },
        f"accept (rng, replications) and return {all_draws}",
    )
    data = called(
        "simulate",
        simulate,
        {"what draw_prior returned": parameters, "a Generator": np.random.default_rng(data_stream)},
        f"accept (parameters, rng) with {all_draws} and return one data set for each",
    )
    shape = f"shape ({replications},) or ({replications}, p)"
    needed = f"accept (data, parameters) with {all_draws} and return {shape}"
    given = {"what simulate returned": data, "what draw_prior returned": parameters}
    returned = called("posterior_cdf", posterior_cdf, given, needed)
    pit = real_array("posterior_cdf", returned, f"let it {needed}")
    if pit.shape[:1] != (replications,) or pit.ndim > 2 or not pit.size:
        raise InputError(
            "posterior_cdf", f"returned shape {pit.shape} for {replications} replications", f"let it {needed}"
        )
    return uniformity(pit, false_alarm_rate=false_alarm_rate, seed=seed)


def _numbers_in(returned: Any) -> float:
    """Count the numbers in arrays, alone or together; an empty axis counts as one, other forms as enough."""
    parts = [returned]
    if isinstance(returned, Mapping | tuple | list):
        parts = list(returned.values() if isinstance(returned, Mapping) else returned)
    if not all(isinstance(part, Real | np.ndarray) for part in parts):
        return math.inf
    return sum(math.prod(max(length, 1) for length in np.shape(part)) for part in parts)


def uniformity(pit: ArrayLike, *, false_alarm_rate: float = 0.01, seed: int | None = None) -> Calibration:
    """Test whether values are independent and uniform on [0, 1].

    Parameters
    ----------
    pit : array_like, shape (replications,) or (replications, parameters)
    false_alarm_rate : float
        Of all checks of all parameters together (Bonferroni).
    seed : int, optional
        Kept with the result.

    Raises
    ------
    InputError
        If a value is not within [0, 1].
    """
    rate = probability("false_alarm_rate", false_alarm_rate, such_as=0.01)
    values = np.asarray(pit, dtype=np.float64)
    values = values[:, None] if values.ndim == 1 else values
    n, parameters = values.shape
    outside = np.argwhere(~((values >= -ROUNDED) & (values <= 1.0 + ROUNDED)))
    if outside.size:
        row, column = outside[0]
        which = f" of parameter {column}" if parameters > 1 else ""
        raise InputError(
            "posterior_cdf",
            f"{values[row, column]:.17g} in replication {row}{which}",
            "let it return probabilities, from 0 to 1",
        )
    values = np.clip(values, 0.0, 1.0)
    level = rate / (3 * parameters)
    checks: list[Check] = []
    for i, u in enumerate(values.T):
        tag = f" of parameter {i}" if parameters > 1 else ""
        # moments of a uniform variable: var(u) = 1/12, mean and variance of (u - 1/2)**2: 1/12 and 1/180
        mean, spread = float(u.mean()), float(((u - 0.5) ** 2).mean())
        test = stats.kstest(u, "uniform")
        distance, p_value = float(test.statistic), float(test.pvalue)
        checks += [
            Check.of_difference(f"mean{tag}", 0.5, mean, math.sqrt(1.0 / 12.0 / n), level=level),
            Check.of_difference(f"spread{tag}", 1.0 / 12.0, spread, math.sqrt(1.0 / 180.0 / n), level=level),
            Check.of_distance(f"distribution{tag}", distance, n, p_value=p_value, level=level),
        ]
    return Calibration(
        calibrated=all(check.passed for check in checks),
        pit=values,
        checks=tuple(checks),
        false_alarm_rate=rate,
        seed=seed,
    )


def rank_pit(draws: ArrayLike, truth: ArrayLike, rng: np.random.Generator | int) -> Array:
    """Posterior distribution function at the truth from draws, ranks spread over their steps.

    Parameters
    ----------
    draws : array_like, shape (..., n)
        Near-independent posterior draws of each replication.
    truth : array_like, shape (...)
    rng : numpy.random.Generator or int
        Or the seed of one. The rank among ``n`` draws is one of ``n + 1`` equally likely steps; a uniform
        place within it makes the result exactly uniform.

    Raises
    ------
    InputError
        If there are no draws, one is not finite, or there is not one truth for each set of draws.
    """
    values, true = finite_sample("draws", draws), finite_array("truth", truth)
    if true.shape != values.shape[:-1]:
        raise InputError(
            "draws",
            f"shape {values.shape} for a truth of shape {true.shape}",
            "put the draws of each truth on the last axis",
        )
    rank = (values < true[..., None]).sum(axis=-1)
    return np.asarray((rank + np.random.default_rng(rng).random(rank.shape)) / (values.shape[-1] + 1.0))


def coverage(covered: ArrayLike, *, level: float, tolerance: float = 0.0) -> Coverage:
    """Coverage of intervals with its Monte Carlo error.

    Parameters
    ----------
    covered : array_like of bool, shape (replications,)
        Whether each interval held the truth; replications are independent.
    level : float
        What the intervals claim.
    tolerance : float
        Coverage within this of ``level`` is as good as ``level``.

    Raises
    ------
    InputError
        If ``level`` is no probability, or nothing would be off by more than ``tolerance``.
    """
    level, tolerance = probability("level", level), non_negative("tolerance", tolerance)
    if tolerance >= max(level, 1.0 - level):
        raise InputError(
            "tolerance",
            f"any coverage is within {tolerance:g} of {level:g}",
            "give a small share, such as 0.02",
        )
    held = np.asarray(covered, dtype=bool)
    hits, n = int(held.sum()), held.size
    rate = hits / n
    nearest = min(max(rate, level - tolerance, 0.0), min(level + tolerance, 1.0))
    p_value = float(stats.binomtest(hits, n, nearest).pvalue)
    return Coverage(
        rate=rate,
        standard_error=math.sqrt(level * (1.0 - level) / n),
        level=level,
        replications=n,
        p_value=p_value,
        tolerance=tolerance,
    )
