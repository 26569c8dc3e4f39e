"""What happens to a signal between sensor and file: filters, differences, integrals, straight lines.

Each step takes evenly spaced samples and returns as many.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.integrate import cumulative_trapezoid

__all__ = [
    "Process",
    "ac_coupling",
    "causal_low_pass",
    "differentiated",
    "gain_at",
    "integrated_twice",
    "moving_mean",
    "savitzky_golay",
    "straight_lines",
    "zero_phase_low_pass",
]

Process = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def causal_low_pass(corner: float, sampling_rate: float) -> Process:
    """Butterworth of order 2, corner at ``corner`` [Hz], in steady state at the first sample."""
    sos = signal.butter(2, corner, fs=sampling_rate, output="sos")
    return lambda values: signal.sosfilt(sos, values, zi=signal.sosfilt_zi(sos) * values[0])[0]


def zero_phase_low_pass(corner: float, sampling_rate: float) -> Process:
    """Butterworth of order 4 forward and backward."""
    sos = signal.butter(4, corner, fs=sampling_rate, output="sos")
    return lambda values: signal.sosfiltfilt(sos, values)


def savitzky_golay(window: int) -> Process:
    """Cubic fitted to ``window`` samples, its middle taken."""
    return lambda values: signal.savgol_filter(values, window, 3)


def moving_mean(window: int) -> Process:
    """Mean of ``window`` samples, an odd number, about each; of what there is at the ends."""
    ones = np.ones(window)

    def process(values: NDArray[np.float64]) -> NDArray[np.float64]:
        counts = np.convolve(np.ones(values.size), ones, mode="same")
        return np.convolve(values, ones, mode="same") / counts

    return process


def ac_coupling(corner: float, sampling_rate: float) -> Process:
    """High pass of order 1, in steady state at the first sample."""
    sos = signal.butter(1, corner, btype="highpass", fs=sampling_rate, output="sos")
    return lambda values: signal.sosfilt(sos, values, zi=signal.sosfilt_zi(sos) * values[0])[0]


def straight_lines(every: int) -> Process:
    """Every ``every``-th sample kept, straight lines between, the last one held."""

    def process(values: NDArray[np.float64]) -> NDArray[np.float64]:
        index = np.arange(values.size)
        return np.interp(index, index[::every], values[::every])

    return process


def differentiated(times: int, step: float) -> Process:
    """Central differences, ``times`` times over."""

    def process(values: NDArray[np.float64]) -> NDArray[np.float64]:
        for _ in range(times):
            values = np.gradient(values, step)
        return values

    return process


def integrated_twice(step: float) -> Process:
    """Trapezoids summed up and the mean removed, twice over."""

    def process(values: NDArray[np.float64]) -> NDArray[np.float64]:
        for _ in range(2):
            summed = cumulative_trapezoid(values, dx=step, initial=0)
            values = summed - summed.mean()
        return values

    return process


def gain_at(process: Process, frequency: float, step: float, order: int = 0) -> float:
    """By what a process multiplies the amplitude of a long oscillation.

    Parameters
    ----------
    process : Process
    frequency : float
        [rad/s].
    step : float
        Between samples [s].
    order : int
        How many times the process differentiates, negative for integrals; what that alone would do is left
        out.
    """
    n = math.ceil(40.0 * math.pi / frequency / step)
    phase = frequency * step * np.arange(n)
    found = process(np.cos(phase))
    middle = slice(n // 4, 3 * n // 4)
    waves = np.stack([np.cos(phase[middle]), np.sin(phase[middle]), np.ones(phase[middle].size)], axis=1)
    a, b, _ = np.linalg.lstsq(waves, found[middle], rcond=None)[0]
    return math.hypot(float(a), float(b)) / frequency**order
