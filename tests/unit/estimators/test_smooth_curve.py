"""The density of any smooth curve, and of one that jumps, against dense Gaussian algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp

from friction_bayes.estimators.noise.smooth_curve import log_density_of_curve


@pytest.mark.parametrize("places", [None, [[9], [17], [30]], [[5, 20], [8, 23]]])
def test_it_is_that_of_a_normal_signal(places: list[list[int]] | None, rng: np.random.Generator) -> None:
    n, amplitude, degrees = 40, 7.0, (4, 6)
    place, signal = np.linspace(-1.0, 1.0, n), 3.0 * rng.standard_normal(n)
    jumps = None if places is None else np.array(places)
    expected = []
    for degree in degrees:
        curve = amplitude * np.polynomial.legendre.legvander(place, degree)
        smooth = np.eye(n) + curve @ curve.T
        of_jumps = []
        for each in [[]] if places is None else places:
            raised = sum(((-1.0) ** k * (np.arange(n) >= at) for k, at in enumerate(each)), np.zeros(n))
            covariance = smooth + amplitude**2 * np.outer(raised, raised)
            of_jumps.append(stats.multivariate_normal(np.zeros(n), covariance).logpdf(signal))
        expected.append(logsumexp(of_jumps) - np.log(len(of_jumps)))
    found = log_density_of_curve(place, signal, amplitude, degrees, jumps)
    assert found == pytest.approx(logsumexp(expected) - np.log(len(degrees)), abs=1e-9)
