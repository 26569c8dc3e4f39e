"""Classical estimators: exact where their model is, and each on a decay that it does not model."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import friction_bayes as fb
from decays import SYSTEM
from experiments.classical import CLASSICAL, coulomb_signal, feeny_liang, log_decrement
from friction_bayes.decay.free_decay import find_free_decay

FRICTION = 0.07


@cache
def turning_points(friction: float, damping_ratio: float) -> np.ndarray:
    """Extremes of a release from 15 mm by SciPy's DOP853, half cycle by half cycle."""
    x, side, found = 0.015, -1.0, [0.015]
    while abs(x) > 2.0 * friction / SYSTEM.stiffness:

        def motion(_: float, y: np.ndarray, side: float = side) -> list[float]:
            return [y[1], -100.0 * y[0] - 20.0 * damping_ratio * y[1] - side * friction / 10.0]

        def stop(t: float, y: np.ndarray, side: float = side) -> float:
            return side * y[1] if t > 0.05 else 1.0

        stop.terminal = True  # type: ignore[attr-defined]
        step = solve_ivp(motion, (0.0, 1.0), [x, 0.0], "DOP853", events=stop, rtol=1e-12, atol=1e-15)
        x = float(step.y_events[0][0, 0])
        found.append(x)
        side = -side
    return np.array(found)


def record_of(**changes: object) -> xr.DataArray:
    settings = {
        "friction": FRICTION,
        "initial_displacement": 0.0147,
        "duration": 20.0,
        "sampling_rate": 200.0,
        "noise_sd": 0.0,
        "seed": 1,
    }
    return fb.simulate(SYSTEM, **(settings | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(("friction", "ratio"), [(0.3, 0.0), (0.2, 0.01), (0.2, 0.03)])
@pytest.mark.parametrize("rest", [0.0, 0.002])
def test_feeny_and_liang_are_exact_for_dry_and_viscous_friction(
    friction: float, ratio: float, rest: float
) -> None:
    found = feeny_liang(rest + turning_points(friction, ratio), SYSTEM.stiffness)
    assert found.friction == pytest.approx(friction, rel=1e-7)
    assert found.damping_ratio == pytest.approx(ratio, abs=1e-8)
    mirrored = feeny_liang(-turning_points(friction, ratio), SYSTEM.stiffness)
    assert mirrored.friction == pytest.approx(friction, rel=1e-7)


def test_logarithmic_decrement_is_exact_for_viscous_damping() -> None:
    ratio = 0.01
    decay = 0.015 * np.exp(-math.pi * ratio / math.sqrt(1.0 - ratio**2) * np.arange(30))
    found = log_decrement(decay * (-1.0) ** np.arange(30), SYSTEM.stiffness)
    assert found.damping_ratio == pytest.approx(ratio, rel=1e-9)
    assert found.sd < 1e-9


def test_logarithmic_decrement_loses_the_energy_that_dry_friction_takes() -> None:
    # over few half cycles the amplitude hardly changes, and both say the same to second order in the loss
    found = log_decrement(turning_points(0.1, 0.0)[:6], SYSTEM.stiffness)
    assert found.friction == pytest.approx(0.1, rel=0.01)


def test_model_signal_is_the_exact_decay() -> None:
    record = record_of(sampling_rate=500.0)
    expected = coulomb_signal(record["time"].values, 0.0147, FRICTION / 1000.0, 0.0, 10.0, 0.0)
    np.testing.assert_allclose(record.values, expected, atol=1e-12)


EXACT = {
    # end-to-end: the noise-free record of a Coulomb decay, what is left of method and reading
    "Feeny-Liang decrement": 1e-6,
    "line on the envelope": 2e-3,
    "least squares (lmfit)": 1e-5,
}


@pytest.mark.parametrize("method", EXACT)
def test_recovers_the_friction_of_a_record_without_noise(method: str) -> None:
    decay = find_free_decay(record_of(), SYSTEM)
    assert CLASSICAL[method](decay).friction == pytest.approx(FRICTION, rel=EXACT[method])


def test_least_squares_has_the_interval_of_the_whole_signal(seed: int) -> None:
    record = record_of(noise_sd=5e-4, seed=seed)
    found = CLASSICAL["least squares (lmfit)"](find_free_decay(record, SYSTEM))
    ours = fb.estimate(record, SYSTEM, random_force="none").friction
    assert found.friction == pytest.approx(float(ours.mean()), abs=0.02 * found.sd)
    assert found.sd == pytest.approx(float(ours.std()), rel=0.02)


def test_too_few_extremes_are_refused() -> None:
    with pytest.raises(fb.InputError, match="3 unknowns"):
        feeny_liang(np.array([1.0, -0.9, 0.8, -0.7]), 1.0)
