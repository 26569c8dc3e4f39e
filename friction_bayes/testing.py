"""Statistical unit tests for other people's suites.

Nothing here is special to friction. Every test is two-sided, has a stated false-alarm rate, looks at the
effective sample size before anything else, and raises ``AssertionError`` with the figures in it. Seeds come
from one place, :func:`base_seed`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.checks import finite_sample, probability, real_array, whole
from friction_bayes.core.errors import InputError
from friction_bayes.validation.agreement import Agreement, compare
from friction_bayes.validation.calibration import (
    Calibration,
    Coverage,
    coverage,
    rank_pit,
    simulation_based_calibration,
)
from friction_bayes.validation.tabulated import Kind, Tabulated

__all__ = [
    "assert_agreement",
    "assert_calibrated",
    "assert_coverage",
    "assert_prior_recovered",
    "base_seed",
    "rank_pit",
]


def base_seed() -> int:
    """Return the one seed of a test suite: ``FRICTION_BAYES_TEST_SEED`` from the environment, or 20261121."""
    text = os.environ.get("FRICTION_BAYES_TEST_SEED", "20261121").strip()
    if not text.isdecimal():
        raise InputError(
            "FRICTION_BAYES_TEST_SEED",
            f"{text!r} is not a whole number",
            "set it to one, 0 or more, or unset it",
        )
    return int(text)


def assert_agreement(
    expected: Any,
    draws: ArrayLike,
    *,
    kind: Kind = "density",
    support: tuple[float, float] = (-math.inf, math.inf),
    ess: float | None = None,
    minimum_ess: float = 1000.0,
    false_alarm_rate: float = 0.01,
) -> Agreement:
    """Assert that draws come from a distribution.

    Parameters
    ----------
    expected : frozen distribution, callable or array_like
        A frozen continuous scipy distribution (or anything with ``mean``, ``std``, ``cdf`` and ``ppf``); a
        vectorised density, normalised here, or distribution function; or an array of independent draws.
    draws : array_like, shape (n,), (chains, n) or (ensembles, walkers, n)
        Chains and ensembles are independent of each other; walkers and successive draws need not be.
    kind : {"density", "cdf"}
        What a callable is.
    support : tuple of float
        Where a callable may be evaluated.
    ess : float, optional
        Effective sample size where it is known (``n`` for independent draws, and never more), otherwise found
        from the draws.
    minimum_ess : float
        Fewer effective draws fail the test, whatever they say.
    false_alarm_rate : float
        Share of correct samplers that fail, at most.

    Returns
    -------
    Agreement
        With every check made.

    Raises
    ------
    AssertionError
        If there are too few effective draws, or mean, sd, quantiles or the whole distribution differ.
    InputError
        If ``expected`` is discrete or no distribution, a callable is negative or not finite, or draws are no
        numbers or have their axes exchanged.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy import stats
    >>> draws = np.random.default_rng(1).normal(2.0, 3.0, 10_000)
    >>> assert_agreement(stats.norm(2.0, 3.0), draws, ess=10_000).agrees
    True
    >>> assert_agreement(lambda x: np.exp(-((x - 2.0) ** 2) / 18.0), draws, ess=10_000).agrees
    True
    """
    reference = expected
    if callable(expected) and not hasattr(expected, "cdf"):
        values = finite_sample("draws", draws)
        around = float(values.min()), float(values.max())
        reference = Tabulated.of(expected, around=around, support=support, kind=kind)
    verdict = compare(reference, draws, ess=ess, minimum_ess=minimum_ess, false_alarm_rate=false_alarm_rate)
    if not verdict.agrees:
        raise AssertionError(verdict.because)
    return verdict


def assert_calibrated(
    draw_prior: Callable[[np.random.Generator, int], Any],
    simulate: Callable[[Any, np.random.Generator], Any],
    posterior_cdf: Callable[[Any, Any], ArrayLike],
    *,
    replications: int = 10_000,
    seed: int | None = None,
    minimum_replications: int = 100,
    false_alarm_rate: float = 0.01,
) -> Calibration:
    """Assert that a posterior is calibrated, by simulation from its own prior.

    Parameters
    ----------
    draw_prior : callable, (Generator, replications) -> parameters
        One set of parameters a replication, in whatever form the next two take; proper priors only.
    simulate : callable, (parameters, Generator) -> data
        One data set for each.
    posterior_cdf : callable, (data, parameters) -> (replications,) or (replications, p)
        Posterior distribution function of each parameter at its true value. For a sampler give the rank of
        the truth among near-independent draws, :func:`rank_pit`.
    replications : int
        About 10,000 find a posterior whose location is 5 % of its sd off, 200 one that is a third off.
    seed : int, optional
        :func:`base_seed` when left out.
    minimum_replications : int
        Fewer fail the test, whatever they say.
    false_alarm_rate : float
        Share of calibrated posteriors that fail, at most.

    Raises
    ------
    AssertionError
        If the transforms are not uniform.
    InputError
        If a function does not return one value a replication. Errors that it raises itself are left as they
        are, with a note of the seed and of what it was given and must accept.

    Notes
    -----
    A posterior that ignores the data and returns the prior is calibrated in every parameter. It is not in the
    log-likelihood: let ``posterior_cdf`` return a further column, the rank (:func:`rank_pit`) of the
    log-likelihood at the truth among those at independent posterior draws. For the right posterior that rank
    is uniform as well, so that the false-alarm rate stays what it is (Modrak et al. 2023).

    Examples
    --------
    A normal mean under a normal prior, one observation each:

    >>> from scipy import stats
    >>> result = assert_calibrated(
    ...     lambda rng, n: rng.normal(0.0, 1.0, n),
    ...     lambda mean, rng: rng.normal(mean, 1.0),
    ...     lambda x, mean: stats.norm(x / 2.0, 0.5**0.5).cdf(mean),
    ...     seed=1,
    ... )
    >>> result.calibrated
    True
    """
    least = whole("minimum_replications", minimum_replications, least=1)
    if whole("replications", replications) < least:
        raise AssertionError(f"{replications} replications are fewer than {least}: not judged")
    result = simulation_based_calibration(
        draw_prior,
        simulate,
        posterior_cdf,
        replications=replications,
        seed=base_seed() if seed is None else seed,
        false_alarm_rate=false_alarm_rate,
    )
    if not result.calibrated:
        figures = "; ".join(str(check) for check in result.failed)
        raise AssertionError(
            f"not calibrated over {replications} replications, seed {result.seed}: {figures}"
        )
    return result


def assert_coverage(
    lower: ArrayLike,
    upper: ArrayLike,
    truth: ArrayLike,
    *,
    level: float,
    tolerance: float = 0.0,
    minimum_replications: int = 100,
    false_alarm_rate: float = 0.01,
) -> Coverage:
    """Assert that intervals cover the truth as often as they claim: neither less nor more.

    Parameters
    ----------
    lower, upper : array_like, shape (replications,)
        Ends of the intervals of independent replications.
    truth : array_like, shape (replications,) or ()
    level : float
        What they claim, such as 0.9.
    tolerance : float
        Coverage within this of ``level`` is taken as good; the binomial test is of what lies beyond.
    minimum_replications : int
        Fewer fail the test, whatever they say.
    false_alarm_rate : float

    Raises
    ------
    AssertionError
        If there are too few replications, an end is not a number, or the coverage is off.
    InputError
        If shapes differ, a lower end is above the upper one, or an option leaves nothing to test.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.random.default_rng(1).normal(0.0, 1.0, 1000)
    >>> assert_coverage(x - 1.645, x + 1.645, 0.0, level=0.9).replications
    1000
    """
    rate = probability("false_alarm_rate", false_alarm_rate, such_as=0.01)
    least = whole("minimum_replications", minimum_replications, least=1)
    given = [real_array(*each) for each in (("lower", lower), ("upper", upper), ("truth", truth))]
    if [len(shape) for shape in {each.shape for each in given if each.ndim}] != [1]:
        shapes = ", ".join(str(each.shape) for each in given)
        raise InputError("lower, upper, truth", f"shapes {shapes}", "give each one number a replication")
    low, high, true = np.broadcast_arrays(*given)
    if low.size < least:
        raise AssertionError(f"{low.size} intervals are fewer than {least}: not judged")
    endless = np.flatnonzero(np.isnan(low) | np.isnan(high))
    if endless.size:
        raise AssertionError(f"{endless.size} intervals have no end, the first in replication {endless[0]}")
    for i in np.flatnonzero(low > high)[:1]:
        raise InputError(
            "lower", f"entry {i} is {low[i]:g}, above upper, {high[i]:g}", "give the lower ends first"
        )
    for i in np.flatnonzero(np.isnan(true))[:1]:
        raise InputError("truth", f"entry {i} is nan", "give the value that the data were simulated from")
    result = coverage((low <= true) & (true <= high), level=level, tolerance=tolerance)
    if result.p_value < rate:
        raise AssertionError(str(result))
    return result


def assert_prior_recovered(
    draws: Mapping[str, ArrayLike],
    prior: Mapping[str, Any],
    *,
    ess: float | None = None,
    minimum_ess: float = 1000.0,
    false_alarm_rate: float = 0.01,
) -> dict[str, Agreement]:
    """Assert that a posterior given no data is the prior: a lost Jacobian shows here.

    Parameters
    ----------
    draws : mapping of str to array_like
        Draws of each parameter from the posterior of an empty data set; shapes as in
        :func:`assert_agreement`.
    prior : mapping of str to frozen distribution, density or independent draws
        The prior of the same parameters.
    ess, minimum_ess
        As in :func:`assert_agreement`.
    false_alarm_rate : float
        Of all parameters together.

    Raises
    ------
    AssertionError
        If names differ, or a parameter's draws do not come from its prior; the message names it.
    InputError
        As in :func:`assert_agreement`, or if there is no parameter to compare.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy import stats
    >>> draws = np.random.default_rng(1).gamma(3.0, 1.0, 10_000)
    >>> sorted(assert_prior_recovered({"precision": draws}, {"precision": stats.gamma(3.0)}, ess=10_000))
    ['precision']
    """
    for place, given in (("draws", draws), ("prior", prior)):
        if not hasattr(given, "keys") or not len(given):
            what = "holds no parameter" if hasattr(given, "keys") else f"{type(given).__name__} has no names"
            raise InputError(place, what, "give each parameter by its name, such as {'mean': ...}")
    names = list(draws)
    if set(names) != set(prior):
        raise AssertionError(f"draws of {sorted(names)} for a prior of {sorted(prior)}")
    rate = probability("false_alarm_rate", false_alarm_rate, such_as=0.01) / len(names)
    verdicts = {}
    for name in names:
        try:
            verdicts[name] = assert_agreement(
                prior[name], draws[name], ess=ess, minimum_ess=minimum_ess, false_alarm_rate=rate
            )
        except AssertionError as error:
            raise AssertionError(f"prior of {name} not recovered: {error}") from None
        except InputError as error:
            place = "prior" if error.place == "expected" else error.place
            raise InputError(f"{place} of {name}", error.problem, error.remedy) from None
    return verdicts
