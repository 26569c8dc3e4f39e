"""Effective sample sizes against series whose autocorrelation time is known."""

from __future__ import annotations

import numpy as np
import pytest
from arviz_stats.base import array_stats
from scipy import signal

from friction_bayes.validation.mixing import as_ensembles, bulk_ess, mixing, rank_normalise, tail_ess


def autoregressive(rng: np.random.Generator, shape: tuple[int, ...], tau: float) -> np.ndarray:
    """Stationary standard normal AR(1) series along the last axis, of autocorrelation time ``tau``."""
    r = (tau - 1.0) / (tau + 1.0)
    noise = rng.standard_normal(shape) * np.sqrt(1.0 - r**2)
    noise[..., 0] /= np.sqrt(1.0 - r**2)
    return signal.lfilter([1.0], [1.0, -r], noise, axis=-1)


@pytest.mark.parametrize("tau", [1.0, 4.0, 20.0])
def test_ess_of_a_known_series(rng: np.random.Generator, tau: float) -> None:
    found = mixing(autoregressive(rng, (4, 32, 4000), tau))
    # relative standard error about sqrt(10 tau / 16000), 11 % at most
    assert found.tau == pytest.approx(tau, rel=0.35)
    assert found.ess == pytest.approx(4 * 32 * 4000 / found.tau)


def test_agrees_with_arviz_where_chains_are_independent(rng: np.random.Generator) -> None:
    draws = autoregressive(rng, (16, 4000), 8.0)
    theirs = float(array_stats.ess(draws, chain_axis=0, draw_axis=1, method="bulk"))
    assert bulk_ess(draws).ess == pytest.approx(theirs, rel=0.2)
    theirs = float(array_stats.ess(draws, chain_axis=0, draw_axis=1, method="tail", prob=(0.05, 0.95)))
    assert tail_ess(draws).ess == pytest.approx(theirs, rel=0.25)


def test_walkers_that_move_together_count_once(rng: np.random.Generator) -> None:
    together = np.repeat(autoregressive(rng, (4, 1, 2000), 5.0), 32, axis=1)
    assert mixing(together).ess == pytest.approx(mixing(together[:, :1]).ess)


def test_ensembles_apart_show_as_slow_mixing(rng: np.random.Generator) -> None:
    draws = autoregressive(rng, (4, 32, 1000), 5.0)
    draws[0] += 2.0
    assert mixing(draws).ess < 50.0


def test_nothing_moved() -> None:
    assert mixing(np.ones((4, 8, 100))).ess == 0.0
    assert mixing(np.repeat(np.arange(8.0)[None, :, None], 100, axis=2)).ess == 0.0


def test_bulk_does_not_depend_on_the_scale_of_the_parameter(rng: np.random.Generator) -> None:
    draws = autoregressive(rng, (4, 8, 500), 5.0)
    assert bulk_ess(np.exp(3.0 * draws)).ess == pytest.approx(bulk_ess(draws).ess)
    scores = rank_normalise(np.exp(draws))
    assert scores.shape == draws.shape
    assert scores.std() == pytest.approx(1.0, abs=0.01)


def test_shapes() -> None:
    assert as_ensembles(np.zeros(5)).shape == (1, 1, 5)
    assert as_ensembles(np.zeros((3, 5))).shape == (3, 1, 5)
    with pytest.raises(ValueError, match=r"\(2, 3, 4, 5\)"):
        as_ensembles(np.zeros((2, 3, 4, 5)))
