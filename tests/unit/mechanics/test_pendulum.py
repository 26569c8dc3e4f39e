"""Large swings of a pendulum against elliptic functions, quadrature and the energy balance."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk, sici

from friction_bayes.mechanics.pendulum import (
    amplitude_of_fundamental,
    frequency_ratio,
    friction_of_period,
    linear_amplitude,
    sine_integral,
    swing_amplitude,
    third_harmonic,
)

W0 = 3.0


def swing_signals(amplitude: float, n: int = 4096) -> tuple[np.ndarray, list[np.ndarray]]:
    """Phase from the turning point and angle, velocity, acceleration of a frictionless swing."""
    k = math.sin(amplitude / 2)
    quarter = ellipk(k * k)
    u = (np.arange(n) + 0.5) / n * 4 * quarter
    sn, cn, _, _ = ellipj(u + quarter, k * k)
    angle = 2 * np.arcsin(k * sn)
    return np.pi * u / (2 * quarter), [angle, 2 * W0 * k * cn, -(W0**2) * np.sin(angle)]


@pytest.mark.parametrize("x", [-3.0, -0.1, 0.0, 1e-9, 1.0, 3.1])
def test_sine_integral(x: float) -> None:
    assert sine_integral(x) == pytest.approx(sici(x)[0], rel=1e-14, abs=1e-300)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("amplitude", [1e-4, 0.5, 1.0, 1.5])
def test_fundamental_gives_the_amplitude(order: int, amplitude: float) -> None:
    phase, signals = swing_signals(amplitude)
    fundamental = 2 * np.mean(signals[order] * np.cos(phase + order * np.pi / 2))
    found, slope = linear_amplitude(fundamental, order, W0)
    assert found == pytest.approx(W0**order * sici(amplitude)[0], rel=1e-9)
    step = 1e-5 * fundamental
    numeric = (
        linear_amplitude(fundamental + step, order, W0)[0]
        - linear_amplitude(fundamental - step, order, W0)[0]
    )
    assert slope == pytest.approx(numeric / (2 * step), rel=1e-6)
    assert linear_amplitude(-fundamental, order, W0)[0] == -found
    quarter = ellipk(math.sin(amplitude / 2) ** 2)
    assert frequency_ratio(fundamental / W0**order, order) == pytest.approx(np.pi / (2 * quarter), rel=1e-9)
    if order == 0:
        assert amplitude_of_fundamental(fundamental)[0] == pytest.approx(amplitude, rel=1e-9)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_third_harmonic(order: int) -> None:
    phase, signals = swing_signals(0.8)
    about_turn = phase + order * np.pi / 2
    fundamental, third = (2 * np.mean(signals[order] * np.cos(m * about_turn)) for m in (1, 3))
    assert third_harmonic(fundamental / W0**order, order) == pytest.approx(third / fundamental, rel=0.1)


def lose(amplitude: float, d: float) -> float:
    """Amplitude half a cycle later, by the exact energy balance."""

    def balance(after: float) -> float:
        return math.cos(after) - math.cos(amplitude) - d * (amplitude + after)

    return brentq(balance, 0.0, amplitude, xtol=1e-15)


@pytest.mark.parametrize("amplitude", [0.3, 1.0, 2.0])
def test_sine_integral_falls_by_twice_d_each_half_cycle(amplitude: float) -> None:
    d = 0.004
    after = lose(amplitude, d)
    assert sine_integral(amplitude) - sine_integral(after) == pytest.approx(2 * d, rel=20 * d**2)
    assert quad(lambda x: math.sin(x) / x, after, amplitude)[0] == pytest.approx(2 * d, rel=20 * d**2)
    assert friction_of_period(amplitude, lose(after, d)) == pytest.approx(d, rel=20 * d**2)


def test_peaks_give_the_amplitude() -> None:
    _, signals = swing_signals(1.2)
    for order, signal in enumerate(signals):
        assert swing_amplitude(np.abs(signal).max(), order, W0) == pytest.approx(1.2, rel=1e-5)
    assert math.isnan(swing_amplitude(2.1 * W0, 1, W0))
