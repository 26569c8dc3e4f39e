"""Errors of a sensor other than noise, outliers, clipping and its clock's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["with_sensor"]

Signal = NDArray[np.float64]


def _play(signal: Signal, half_width: float) -> Signal:
    """Backlash: the reading stays until the signal has moved by the play, and follows it from there."""
    out = np.empty_like(signal)
    reading = float(signal[0])
    for i, value in enumerate(signal.tolist()):
        reading = min(max(reading, value - half_width), value + half_width)
        out[i] = reading
    return out


def _last_line(signal: Signal, step: float) -> Signal:
    """Position of the encoder line that was passed last, in whichever direction: the count is held."""
    out = np.empty_like(signal)
    line = round(float(signal[0]) / step)
    for i, value in enumerate((signal / step).tolist()):
        # on the way up the line below, on the way down the line above
        if value >= line + 1.0:
            line = int(np.floor(value))
        elif value <= line - 1.0:
            line = int(np.ceil(value))
        out[i] = line
    return step * out


def with_sensor(
    signal: Signal, times: Signal, rms: float, amplitude: float, drawn: Mapping[str, Any]
) -> Signal:
    """Add what a sensor adds.

    Parameters
    ----------
    signal, times : ndarray, shape (n,)
        Dimensionless.
    rms : float
        Of the moving signal, in the unit of ``signal``.
    amplitude : float
        Initial amplitude [rad for an angle].
    drawn : mapping
        Strengths as drawn.
    """
    out = signal
    if "gain_change" in drawn:
        out = out * (1.0 + drawn["gain_change"] * (times / times[-1] - 0.5))
    if "backlash" in drawn:
        out = _play(out, drawn["backlash"])
    if "held_counts" in drawn:
        out = _last_line(out, 2.0 * drawn["held_counts"])
    if "scale_square" in drawn:
        out = out + drawn["scale_square"] * out**2 + drawn["scale_cube"] * out**3
    if "once_a_turn" in drawn:
        turned = amplitude * signal
        error = drawn["once_a_turn"] * np.sin(turned + drawn["once_phase"])
        error += drawn["twice_a_turn"] * np.sin(2.0 * turned + drawn["twice_phase"])
        out = out + rms * error
    passed, drifts = times / times[-1], ("drift", "drift_square", "drift_cube")
    moved = sum(drawn.get(name, 0.0) * passed**power for power, name in enumerate(drifts, start=1))
    out = out + rms * (drawn.get("offset", 0.0) + moved)
    if "interference_amplitude" in drawn:
        angle = drawn["interference_frequency"] * times + drawn["interference_phase"]
        out += rms * drawn["interference_amplitude"] * np.sin(angle)
    if "mode_amplitude" in drawn:
        envelope = rms * drawn["mode_amplitude"] * np.exp(-drawn["mode_decay"] * times)
        out += envelope * np.cos(drawn["mode_frequency"] * times + drawn["mode_phase"])
    return out
