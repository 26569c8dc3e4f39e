"""The density of any smooth curve, and of one that breaks, against dense Gaussian algebra."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp

from friction_bayes.estimators.noise.smooth_curve import log_density_of_curve

AMPLITUDE, DEGREES = 7.0, (2, 4)


def dense(signal: np.ndarray, place: np.ndarray, breaks: int) -> float:
    """The mean over degrees and numbers of breaks, jumps and bends anywhere, all as probable."""
    beyond = place >= place[:, None]
    kinds = np.concatenate([beyond * 1.0, beyond * (place - place[:, None])])
    expected = []
    for degree, count in product(DEGREES, range(breaks + 1)):
        smooth = np.polynomial.legendre.legvander(place, degree)
        found = []
        for broken in product(kinds, repeat=count):
            columns = AMPLITUDE * np.column_stack([smooth, *broken])
            covariance = np.eye(place.size) + columns @ columns.T
            found.append(stats.multivariate_normal(np.zeros(place.size), covariance).logpdf(signal))
        expected.append(logsumexp(found) - np.log(len(found)))
    return float(logsumexp(expected) - np.log(len(expected)))


@pytest.mark.parametrize("breaks", [0, 1])
def test_it_is_that_of_a_normal_signal(breaks: int, rng: np.random.Generator) -> None:
    place, signal = np.linspace(-1.0, 1.0, 20), 3.0 * rng.standard_normal(20)
    found = log_density_of_curve(place, signal, AMPLITUDE, DEGREES, breaks)
    assert found == pytest.approx(dense(signal, place, breaks), abs=1e-9)


def test_of_several_breaks_it_is_a_lower_bound_which_clear_ones_reach(rng: np.random.Generator) -> None:
    place = np.linspace(-1.0, 1.0, 14)
    for size, reached in ((0.0, 2.0), (9.0, 2.0)):
        signal = size * ((place > -0.4) - 2.0 * (place > 0.3)) + rng.standard_normal(14)
        found, exact = log_density_of_curve(place, signal, AMPLITUDE, DEGREES, 2), dense(signal, place, 2)
        assert exact - reached < found <= exact + 1e-9
