"""A mass that breaks away at more than it slides, and so rests earlier than Coulomb friction says."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.estimators.waveform.early_rest import until_rest
from friction_bayes.estimators.waveform.estimator import white_noise_fit

SYSTEM = fb.Oscillator(mass=1.0, stiffness=100.0)
STEP = 0.015


def at_rest_from(breakaway: float, first: float, damping: float = 0.0, step: float = STEP) -> Array:
    """Displacement over ``r/k`` and velocity, by arcs about a centre each, until friction holds the mass."""
    x, values, speeds, carried = first, [], [], 0.0
    while abs(x) > breakaway:
        centre = np.sign(x)
        time = np.arange(carried, np.pi, 10.0 * step)
        swing = (x - centre) * np.exp(-damping * time)
        values.append(centre + swing * (np.cos(time) + damping * np.sin(time)))
        speeds.append(-10.0 * (1.0 + damping**2) * swing * np.sin(time))
        carried = float(time[-1] + 10.0 * step - np.pi)
        x = centre - (x - centre) * np.exp(-damping * np.pi)
    return np.array([np.concatenate([*values, np.full(80, x)]), np.concatenate([*speeds, np.zeros(80)])])


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("breakaway", [1.0, 1.6])
def test_friction_is_that_of_sliding(order: int, breakaway: float, rng: np.random.Generator) -> None:
    """From 25.4 r/k the last turning points are at 3.4, 1.4 and, sliding on, 0.6: 1.4 holds against 1.6."""
    motion = at_rest_from(breakaway, 25.4)
    x, clean = motion[0], motion[order]
    assert abs(x[-1]) == pytest.approx(1.4 if breakaway > 1.4 else 0.6)
    values = 0.004 * (clean + 0.002 * np.ptp(clean) * rng.standard_normal(x.size))
    quantity = ("displacement", "velocity")[order]
    found = fb.estimate(fb.make_record(STEP * np.arange(x.size), values, quantity), SYSTEM)
    low, high = found.friction.ppf([0.05, 0.95])
    # the middle 90 % widened to 99.7 %
    assert abs(found.friction.mean() - 0.4) < 0.91 * (high - low)
    assert high - low < 0.012 * 0.4
    # a displacement is cut there by its constant level alone
    assert found.decay.rests_early == (breakaway > 1.4 and order == 1)


@pytest.mark.parametrize("first", [24.0, 25.4, 27.0])
def test_a_rest_at_another_level_than_that_of_the_fit_is_not_early(
    first: float, rng: np.random.Generator
) -> None:
    """Damping changes where the mass comes to rest, and sliding friction holds it there."""
    step = 0.25 * STEP
    x, _ = at_rest_from(1.0, first, damping=0.003, step=step)
    values = 0.004 * (x + 0.001 * np.ptp(x) * rng.standard_normal(x.size))
    decay = find_free_decay(fb.make_record(step * np.arange(x.size), values, "displacement"), SYSTEM)
    assert decay.stops
    assert until_rest(decay, white_noise_fit(decay)(decay)) is decay
