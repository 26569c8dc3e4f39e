"""Intervals of a model that leaves more than noise."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.noise.likelihood import NoiseModel
from friction_bayes.loop.simulation.coulomb import starting_point
from friction_bayes.loop.simulation.fit import fit_growing_record
from friction_bayes.loop.simulation.robust_covariance import robust_covariance

SYSTEM = fb.Oscillator(mass=1.0, stiffness=100.0)


def variance_ratio(seed: int, **effects: float) -> float:
    """Variance of friction with and without the misfit's share, Coulomb friction alone fitted."""
    record = fb.simulate(
        SYSTEM,
        friction=0.5,
        initial_displacement=0.4,
        duration=20.0,
        sampling_rate=100.0,
        noise_sd=4e-3,
        seed=seed,
        effects=effects,
    )
    model = LoopModel(SYSTEM, cut_records([record], SYSTEM), ())
    fit = fit_growing_record(model, [NoiseModel()], starting_point(model))
    assert fit is not None
    return robust_covariance(fit)[0, 0] / fit.covariance[0, 0]


def test_on_noise_alone_the_two_shares_are_alike() -> None:
    # the sandwich of ten stretches scatters as chi-square of nine degrees over nine: the mean of
    # twelve has a standard deviation of 0.14 and leaves 1 +- 0.6 in fewer than one run of 10,000
    shares = [variance_ratio(seed) - 1.0 for seed in range(12)]
    assert np.mean(shares) == pytest.approx(1.0, abs=0.6)


def test_a_misfit_widens_the_interval() -> None:
    assert variance_ratio(1, **{"viscous_damping.damping_ratio": 0.01}) > 10.0
