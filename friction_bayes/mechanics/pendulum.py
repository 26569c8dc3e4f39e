r"""Large swings of a pendulum: from what a signal shows to an amplitude that friction lowers linearly.

Over a half cycle from amplitude ``A`` to ``A'`` friction takes ``r (A + A')`` from the energy ``k (1 -
cos A)``. With ``M = (A + A')/2`` and ``h = (A - A')/2`` that is ``k sin M sin h = r M``, a midpoint step
of ``(sin A / A) dA = -2 d`` per half cycle with ``d = r/k``. So the sine integral :math:`\mathrm{Si}(A) =
\int_0^A \sin x / x\,dx` falls by ``2 d`` each half cycle, as ``A`` itself does in a linear system, up to
terms of order ``d^3``.

The frictionless swing itself is an odd Fourier series in its nome ``x^2``: ``theta = B sin(Omega t) +
...`` with ``B = 8 x / (1 + x^2)``, ``Omega = w0 / theta3^2`` and ``sin(A/2) = (theta2/theta3)^2``, by the
Jacobi theta constants of that nome.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = [
    "amplitude_of_fundamental",
    "angle_fundamental",
    "frequency_ratio",
    "friction_of_period",
    "linear_amplitude",
    "sine_integral",
    "swing_amplitude",
    "third_harmonic",
]

_LARGEST = 3.6
"""Fundamental of a swing of 3.1 rad; beyond it a swing is not a decay about the bottom any more."""
_LEAST_SLOPE = 0.2
"""Least growth of a signal's fundamental with that of the angle, relative to small swings."""


@njit(**KERNEL)
def sine_integral(amplitude: float) -> float:
    """``Si(A)`` by its power series, exact to rounding for ``|A| <= pi``."""
    term = amplitude
    total = amplitude
    for k in range(1, 30):
        term *= -amplitude * amplitude / ((2 * k) * (2 * k + 1))
        total += term / (2 * k + 1)
        if abs(term) < 1e-18 * abs(total):
            break
    return total


@njit(**INNER)
def _theta3(fundamental: float) -> tuple[float, float, float]:
    """Return ``x``, ``theta3`` and ``d(theta3)/dB`` for the fundamental ``B`` of the angle."""
    root = math.sqrt(16.0 - fundamental * fundamental)
    x = fundamental / (4.0 + root)
    x_slope = (1.0 + x * x) ** 2 / (8.0 * (1.0 - x * x))
    return x, 1.0 + 2.0 * x**2 + 2.0 * x**8, (4.0 * x + 16.0 * x**7) * x_slope


@njit(**KERNEL)
def amplitude_of_fundamental(fundamental: float) -> tuple[float, float]:
    """Amplitude [rad] of a frictionless swing whose angle has this Fourier fundamental, and its slope."""
    x, theta3, _ = _theta3(fundamental)
    theta2 = 1.0 + x**4 + x**12
    k = 4.0 * x * (theta2 / theta3) ** 2
    x_slope = (1.0 + x * x) ** 2 / (8.0 * (1.0 - x * x))
    ratio = 2.0 * (4.0 * x**3 + 12.0 * x**11) / theta2 - 2.0 * (4.0 * x + 16.0 * x**7) / theta3
    k_slope = 4.0 * (theta2 / theta3) ** 2 * (1.0 + x * ratio)
    return 2.0 * math.asin(k), 2.0 / math.sqrt(1.0 - k * k) * k_slope * x_slope


@njit(**KERNEL)
def angle_fundamental(fundamental: float, order: int) -> float:
    """Fundamental ``B`` of the angle from that of its derivative over ``w0**order``, which is not negative.

    The derivative's is ``B Omega**order``, solved for ``B`` by fixed-point iteration.
    """
    b = min(fundamental, _LARGEST)
    for _ in range(60 if order else 0):
        _, theta3, _ = _theta3(b)
        following = min(fundamental * theta3 ** (2 * order), _LARGEST)
        if abs(following - b) < 1e-14:
            break
        b = following
    return b


@njit(**KERNEL)
def frequency_ratio(fundamental: float, order: int) -> float:
    """``Omega/w0`` of a swing, from the fundamental of its signal over ``w0**order``."""
    _, theta3, _ = _theta3(angle_fundamental(abs(fundamental), order))
    return 1.0 / theta3**2


@njit(**KERNEL)
def linear_amplitude(fundamental: float, order: int, frequency: float) -> tuple[float, float]:
    """Amplitude that falls by ``2 u`` each half cycle, from the fundamental of a pendulum's signal.

    Parameters
    ----------
    fundamental : float
        Fourier amplitude of the signal over a half cycle [rad/s**order].
    order : int
        0 for angle, 1 for angular velocity, 2 for angular acceleration.
    frequency : float
        Natural frequency ``w0`` of small swings [rad/s].

    Returns
    -------
    amplitude, slope : float
        ``w0**order Si(A)`` and its derivative with respect to ``fundamental``; NaN where the signal hardly
        grows with the swing any more and does not show its amplitude (above about 2.1 rad in velocity,
        1.5 rad in acceleration, 3.1 rad in angle).
    """
    unit = frequency**order
    sign = 1.0 if fundamental >= 0.0 else -1.0
    b = angle_fundamental(abs(fundamental) / unit, order)
    _, theta3, theta3_slope = _theta3(b)
    signal_slope = theta3 ** (-2 * order) * (1.0 - 2.0 * order * b * theta3_slope / theta3)
    if b >= _LARGEST or signal_slope < _LEAST_SLOPE:
        return np.nan, np.nan
    amplitude, amplitude_slope = amplitude_of_fundamental(b)
    si_slope = math.sin(amplitude) / amplitude if amplitude > 1e-8 else 1.0
    return sign * unit * sine_integral(amplitude), si_slope * amplitude_slope / signal_slope


@njit(**KERNEL)
def friction_of_period(first: float, second: float) -> float:
    """Friction over stiffness [rad] from two amplitudes one period apart: ``d = (sin M / M) sin(h) / 2``.

    The sum of the energy lost in two half cycles, ``k (cos A'' - cos A) = r (A + 2 A' + A'')``, with the
    amplitude between them ``A' = (A + A'')/2 = M`` and ``h = (A - A'')/2``.
    """
    middle = 0.5 * (first + second)
    half_drop = 0.5 * (first - second)
    ratio = math.sin(middle) / middle if abs(middle) > 1e-8 else 1.0
    return 0.5 * ratio * math.sin(half_drop)


@njit(**KERNEL)
def swing_amplitude(peak: float, order: int, frequency: float) -> float:
    """Amplitude [rad] of a swing from the peak of its angle, angular velocity or angular acceleration.

    By the energy at the bottom, ``theta' = 2 w0 sin(A/2)``, or the torque at the turning point,
    ``theta'' = w0^2 sin(A)``; NaN where no swing has such a peak.
    """
    if order == 0:
        return peak
    ratio = peak / (2.0 * frequency) if order == 1 else peak / frequency**2
    if not abs(ratio) < 1.0:
        return np.nan
    return (2.0 if order == 1 else 1.0) * math.asin(ratio)


@njit(**KERNEL)
def third_harmonic(fundamental: float, order: int) -> float:
    """Third harmonic of the signal about its turning points, relative to the fundamental.

    Parameters
    ----------
    fundamental : float
        That fundamental, over ``w0**order``.
    order : int
        Derivative order of the signal.
    """
    b = angle_fundamental(abs(fundamental), order)
    x = b / (4.0 + math.sqrt(16.0 - b * b))
    ratio = x * x * (1.0 + x * x) / (3.0 * (1.0 + x**6))
    return 3.0 * ratio if order == 1 else -(9.0 ** (order // 2)) * ratio
