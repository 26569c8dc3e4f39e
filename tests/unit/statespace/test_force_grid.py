"""The grid over the random force: landscapes of known evidence, of one mode, two, and one at an edge."""

from __future__ import annotations

import math

import numpy as np
import pytest

from friction_bayes.statespace.force_grid import integrate_force
from friction_bayes.statespace.force_prior import ForcePrior, at_resonance
from friction_bayes.statespace.subset_evidence import SetEvidences

PRIOR = ForcePrior(centre=0.3, none=0.5)


def narrow(size, log_tau, *, centre, sd):
    """A normal around a ridge on which the best size grows with the correlation time."""
    ridge = -0.5 + 0.3 * (log_tau - centre)
    return -0.5 * (((size - ridge) / 0.08) ** 2 + ((log_tau - centre) / sd) ** 2)


def one(size, log_tau):
    return 30.0 + narrow(size, log_tau, centre=-0.6, sd=0.4)


def two(size, log_tau):
    """Two modes and a valley ten nats deep between them; the later one is two nats lower."""
    early = 30.0 + narrow(size, log_tau, centre=-1.4, sd=0.35)
    return np.logaddexp(early, 28.0 + narrow(size, log_tau, centre=1.7, sd=0.35))


def two_of_which_the_later_is_better(size, log_tau):
    early = 30.0 + narrow(size, log_tau, centre=-1.4, sd=0.35)
    return np.logaddexp(early, 33.0 + narrow(size, log_tau, centre=1.7, sd=0.35))


def at_the_longest_time(size, log_tau):
    """Growing in a straight line up to the end of the prior."""
    ridge = -0.5 + 0.3 * log_tau
    return 30.0 - 0.5 * ((size - ridge) / 0.08) ** 2 + 12.0 * (log_tau - math.log(PRIOR.tau_high))


class Landscape:
    """A regression whose likelihood is a function of size and time, and whose coefficient is its log."""

    names = ("friction",)
    scale = np.ones(1)
    positive = np.zeros(1, np.bool_)
    sets = np.ones((1, 1), np.bool_)
    noise_before = 1.0

    def __init__(self, height):
        self.height = height

    def evaluate(self, ratio, tau):
        if ratio == 0.0:
            return self._evaluated(0.0)
        return self._evaluated(float(self.height(math.log(ratio * at_resonance(tau)), math.log(tau))))

    def among(self, sets):
        assert sets.all()
        return self

    def marginals(self, point, chosen):
        del chosen
        return np.array([math.log(point.tau)]), np.ones(1)

    @staticmethod
    def _evaluated(log_weight):
        return SetEvidences(log_weight=np.array([log_weight]), noise2=np.ones(1), full_noise2=1.0)


def dense(height):
    """Log evidence of the part with a force, and the mean coefficient given one, by a fine grid."""
    log_tau = np.linspace(math.log(PRIOR.tau_low), math.log(PRIOR.tau_high), 2001)
    log_tau = 0.5 * (log_tau[1:] + log_tau[:-1])[:, None]
    size = np.arange(-6.0, 4.0, 0.01)
    log_q = size - np.log(at_resonance(np.exp(log_tau)))
    log_density = height(size, log_tau) + PRIOR.log_density(np.exp(log_q), np.exp(log_tau))
    mass = np.exp(log_density) * 0.01 * (log_tau[1, 0] - log_tau[0, 0])
    return math.log(mass.sum()), (mass * log_tau).sum() / mass.sum()


@pytest.mark.parametrize("height", [one, two, two_of_which_the_later_is_better, at_the_longest_time])
def test_evidence_and_mean_are_those_of_a_fine_grid(height):
    posterior = integrate_force(Landscape(height), PRIOR)
    evidence, mean = dense(height)
    found = posterior.log_evidence + math.log(posterior.probability)
    assert found == pytest.approx(evidence, abs=0.1)
    given = posterior.among((posterior.ratio > 0.0)[:, None]).coefficient("friction")
    assert given.mean() == pytest.approx(mean, abs=0.05)


def test_a_normal_mode_takes_few_evaluations():
    """Each whitens a record; half of them are to find the mode."""
    places = set()

    def counted(size, log_tau):
        places.add((size, log_tau))
        return one(size, log_tau)

    integrate_force(Landscape(counted), PRIOR)
    assert len(places) <= 75


def test_only_the_mode_is_the_better_of_two():
    posterior = integrate_force(Landscape(two_of_which_the_later_is_better), PRIOR, only_mode=True)
    assert len(posterior.points) == 2
    assert math.log(posterior.best.tau) == pytest.approx(1.7, abs=0.3)
