"""Amplitude, signal and frequency along a record, from an envelope fit; the first axis is that of records."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.mechanics.pendulum import frequency_ratio, linear_amplitude, third_harmonic

__all__ = ["envelope_signal", "small_motion_frequency"]

_GRID = 513


def small_motion_frequency(
    polynomial: Array, duration: Array, order: int, mean: Array, swing: float
) -> Array:
    """Angular frequency [rad/s] of small motion: slope of the phase, weighted by the squared amplitude.

    A pendulum's phase is first brought to that of small swings.

    Parameters
    ----------
    polynomial : ndarray, shape (records, k)
        Phase, from :func:`friction_bayes.decay.phase_tracking.track_phase`.
    duration : ndarray, shape (records,)
        Of the moving parts [s].
    order : int
        Derivative order of the signal.
    mean : ndarray, shape (records, 3)
        Initial amplitude, friction coefficient and rest position.
    swing : float
        Natural frequency of a pendulum [rad/s]; zero for a linear system.
    """
    positions = np.linspace(-1.0, 1.0, _GRID)
    chi, _, amplitude = _linear_swing(polynomial, order, mean, positions)
    if swing > 0.0:
        ratio = _frequency_ratios(_fundamental(amplitude, order, swing) / swing**order, order)
        steps = np.diff(chi) * 2.0 / (ratio[:, 1:] + ratio[:, :-1])
        chi = np.concatenate([np.zeros((len(chi), 1)), np.cumsum(steps, axis=1)], axis=1)
    weights = amplitude**2 / (amplitude**2).sum(axis=1, keepdims=True)
    lever = positions - (weights * positions).sum(axis=1, keepdims=True)
    middle = (weights * chi).sum(axis=1, keepdims=True)
    slope = (weights * lever * (chi - middle)).sum(axis=1) / (weights * lever**2).sum(axis=1)
    return np.asarray(2.0 * slope / duration)


def envelope_signal(polynomial: Array, samples: int, order: int, mean: Array, swing: float) -> Array:
    """Fitted signal of one record, shape (samples,); the rest is as for :func:`small_motion_frequency`."""
    positions = np.linspace(-1.0, 1.0, samples)
    chi, half, amplitude = (a[0] for a in _linear_swing(polynomial[None], order, mean[None], positions))
    shift = np.where(half % 2.0 == 0.0, mean[1], -mean[1]) if order == 0 else 0.0
    if swing == 0.0:
        return np.asarray(mean[2] + shift + amplitude * np.cos(chi))
    fundamental = _fundamental(amplitude, order, swing)
    levels, level = np.unique(fundamental, return_inverse=True)
    ratio = np.array([third_harmonic(b, order) for b in levels / swing**order])
    return np.asarray(mean[2] + shift + fundamental * (np.cos(chi) + ratio[level] * np.cos(3.0 * chi)))


def _linear_swing(polynomial: Array, order: int, mean: Array, positions: Array) -> tuple[Array, Array, Array]:
    """Signal phase, half cycle number and amplitude (linear in friction) at positions in [-1, 1]."""
    chi = np.asarray(np.polynomial.chebyshev.chebval(positions, polynomial.T), dtype=np.float64)
    half = np.floor((chi - 0.5 * order * math.pi) / math.pi)
    return chi, half, mean[:, :1] - (2.0 * half + 1.0) * mean[:, 1:2]


def _fundamental(amplitude: Array, order: int, swing: float) -> Array:
    """Fourier amplitude of the signal of a pendulum, from the amplitude that is linear in friction."""
    unit = swing**order
    grid = np.linspace(0.0, 3.0, _GRID) * unit
    table = np.array([linear_amplitude(b, order, swing)[0] for b in grid])
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(table)) > 0.0])
    return np.sign(amplitude) * np.interp(np.abs(amplitude), table[rising], grid[rising])


@njit(**KERNEL)
def _frequency_ratios(fundamental: Array, order: int) -> Array:
    """``Omega/w0`` of many swings, any number of records."""
    ratio = np.empty(fundamental.shape)
    for k in range(fundamental.shape[0]):
        for i in range(fundamental.shape[1]):
            ratio[k, i] = frequency_ratio(fundamental[k, i], order)
    return ratio
