"""Statistical unit tests for other people's suites.

Nothing here is special to friction. Every test is two-sided, has a stated false-alarm rate, looks at the
effective sample size before anything else, and raises ``AssertionError`` with the figures in it. Seeds come
from one place, :func:`base_seed`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.checks import finite_array
from friction_bayes.validation.agreement import Agreement, compare
from friction_bayes.validation.calibration import (
    Calibration,
    Coverage,
    coverage,
    rank_pit,
    simulation_based_calibration,
)
from friction_bayes.validation.mixing import as_ensembles
from friction_bayes.validation.tabulated import Tabulated

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
    return int(os.environ.get("FRICTION_BAYES_TEST_SEED", "20261121"))


def assert_agreement(
    expected: Any,
    draws: ArrayLike,
    *,
    kind: Literal["density", "cdf"] = "density",
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
        Effective sample size where it is known (``n`` for independent draws), otherwise found from the draws.
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
        If ``expected`` is discrete or no distribution, or draws are no numbers.

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
        values = as_ensembles(finite_array("draws", draws))
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
        If a function takes one draw at a time, or does not return one value a replication.

    Notes
    -----
    A posterior that ignores the data and returns the prior is calibrated. See that the data are used as well:
    :func:`assert_prior_recovered` without data, and the mean posterior sd against that of the prior.

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
    if replications < minimum_replications:
        raise AssertionError(f"{replications} replications are fewer than {minimum_replications}: not judged")
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
    """Assert that intervals hold the truth as often as they claim: neither less nor more.

    Parameters
    ----------
    lower, upper : array_like, shape (replications,)
        Ends of the intervals of independent replications.
    truth : array_like, shape (replications,) or ()
    level : float
        What they claim.
    tolerance : float
        Coverage within this of ``level`` is taken as good; the binomial test is of what lies beyond.
    minimum_replications : int
        Fewer fail the test, whatever they say.
    false_alarm_rate : float

    Raises
    ------
    AssertionError
        If there are too few replications, an end is not a number, or the coverage is off.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.random.default_rng(1).normal(0.0, 1.0, 1000)
    >>> assert_coverage(x - 1.645, x + 1.645, 0.0, level=0.9).replications
    1000
    """
    low, high, true = np.broadcast_arrays(lower, upper, truth)
    if low.size < minimum_replications:
        raise AssertionError(f"{low.size} intervals are fewer than {minimum_replications}: not judged")
    if np.any(np.isnan(low)) or np.any(np.isnan(high)):
        raise AssertionError(f"{int((np.isnan(low) | np.isnan(high)).sum())} intervals have no end")
    result = coverage((low <= true) & (true <= high), level=level, tolerance=tolerance)
    if result.p_value < false_alarm_rate:
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

    Examples
    --------
    >>> import numpy as np
    >>> from scipy import stats
    >>> draws = np.random.default_rng(1).gamma(3.0, 1.0, 10_000)
    >>> sorted(assert_prior_recovered({"precision": draws}, {"precision": stats.gamma(3.0)}, ess=10_000))
    ['precision']
    """
    if set(draws) != set(prior):
        raise AssertionError(f"draws of {sorted(draws)} beside a prior of {sorted(prior)}")
    verdicts = {}
    for name in draws:
        try:
            verdicts[name] = assert_agreement(
                prior[name],
                draws[name],
                ess=ess,
                minimum_ess=minimum_ess,
                false_alarm_rate=false_alarm_rate / len(draws),
            )
        except AssertionError as error:
            raise AssertionError(f"prior of {name} not recovered: {error}") from None
    return verdicts
