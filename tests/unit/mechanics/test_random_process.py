"""The random force of a simulation: its distribution, and what it leaves as it is."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.core.errors import InputError
from friction_bayes.mechanics.random_process import random_force_path

FORCE = {"random_force.sd": 0.05, "random_force.correlation_time": 0.2}


def test_its_values_have_the_stated_sd_and_correlation(rng: np.random.Generator) -> None:
    spacing, values = random_force_path(3.0, 0.5, 4000.0, 2.0, rng)
    assert values.std() == pytest.approx(3.0, rel=0.05)
    lag = round(0.5 / spacing)
    assert np.corrcoef(values[lag:], values[:-lag])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.05)


def test_too_short_a_correlation_is_refused(rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="correlation_time"):
        random_force_path(1.0, 1e-9, 10.0, 1.0, rng)


def test_the_motion_differs_and_the_noise_does_not() -> None:
    plain, quiet = short_decay(), short_decay(noise_sd=0.0)
    moved, moved_quiet = short_decay(effects=FORCE), short_decay(effects=FORCE, noise_sd=0.0)
    np.testing.assert_allclose(moved - moved_quiet, plain - quiet, atol=1e-15)
    assert float(np.abs(moved_quiet - quiet).max()) > 1e-5


def test_it_needs_a_seed() -> None:
    with pytest.raises(InputError, match="seed"):
        fb.simulate(
            SYSTEM, friction=0.5, initial_displacement=0.02, duration=1.0, sampling_rate=100.0, effects=FORCE
        )
